#pragma once

#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include "capture/capture.hpp"
#include "capture/image_io.hpp"
#include "rays/ray_scene.hpp"

namespace pliant {

/// What a depth camera does to the true distances. Everything is off by default.
struct SensorModel {
  double noise_base = 0.0;          ///< a [m] >= 0 of sigma(z) = a + b (z - z0)^2, the deviation along the optical axis
  double noise_growth = 0.0;        ///< b [1/m] >= 0
  double noise_reference = 0.0;     ///< z0 [m] >= 0; nearer than it sigma stays a
  double correlated_part = 0.0;     ///< 0..1, part of the variance that neighbouring pixels share
  double correlation_length = 2.0;  ///< [pixels] > 0, of that part
  double step = 0.0;                ///< [m] >= 0, readings are whole multiples of it; 0: as fine as the image holds
  double lateral_jitter = 0.0;      ///< [pixels] >= 0, deviation of where a pixel really looks
  double edge_loss = 0.0;           ///< 0..1, probability that a pixel at a jump in depth has no reading
  double edge_flying = 0.0;         ///< 0..1, probability that such a pixel, if not lost, reads something in between
  double edge_jump = 0.02;          ///< [m] > 0, difference to a neighbour that makes an edge
  double grazing_angle = std::numbers::pi / 2;  ///< [rad] 0..pi/2, surfaces seen more obliquely have no reading
  double hole_rate = 0.0;                       ///< 0..1, probability that a pixel has no reading for no reason

  /// sigma(z) [m].
  double noise(double depth) const;
  /// What is out of range, in words; "" where nothing is.
  std::string validate() const;
};

/// "ideal": the model's defaults, nothing is lost or blurred. "structured-light": a hand-held sensor of the first
/// generation with noise 1.2 mm + 1.9 mm/m^2 (z - 0.4 m)^2 (Nguyen, Izadi, Lovell 2012), steps of 1 mm, lost and flying
/// pixels at edges. Throws std::invalid_argument for another name; `sensor_presets` lists them.
SensorModel sensor_preset(const std::string& name);
std::vector<std::string> sensor_presets();

/// What a camera records of one frame.
struct SensedFrame {
  Image<std::uint16_t> depth;  ///< raw units; 0: no reading
  Image<std::uint8_t> mask;    ///< 255 where the pixel's own ray meets the object
};

/// Looks at a scene. Random numbers follow from seed, camera, frame and pixel alone: the same on every machine with
/// the same arithmetic, whatever the number of threads.
/// @param object       number of the object's mesh in the scene
/// @param depth_scale  raw units per metre; what does not fit into 16 bits has no reading
SensedFrame sense(const RayScene& scene, int object, const PinholeCamera& camera, const SensorModel& sensor,
                  double depth_scale, std::uint64_t seed, int camera_number, int frame);

/// Numbers that follow from a few counters: uniform in [0, 1) and standard normal.
double counter_uniform(std::uint64_t seed, std::uint64_t a, std::uint64_t b, std::uint64_t c);
double counter_normal(std::uint64_t seed, std::uint64_t a, std::uint64_t b, std::uint64_t c);

}  // namespace pliant
