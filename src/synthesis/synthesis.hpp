#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "capture/capture.hpp"
#include "synthesis/sensor.hpp"

namespace pliant {

/// A depth camera of a synthetic recording.
struct SyntheticCamera {
  std::string name;
  PinholeCamera camera;
  SensorModel sensor;
  double depth_scale = 1000.0;  ///< raw units per metre
  int every = 1;
};

/// A true parameter, for judging estimates.
struct TrueParameter {
  std::string name;  ///< as in result.json
  std::variant<double, Vector3> value;
  std::string unit;
};

/// A recording that is known completely.
struct Synthesis {
  std::string name;
  Scene scene;                           ///< the object's surface at rest, exactly one of its mass and density; timing
  std::vector<double> plane_half_sizes;  ///< [m] of each plane: half the edge of the square that cameras see around the
                                         ///< object; 0: invisible
  std::vector<Points> trajectory;        ///< the surface's vertices in each frame, n x 3 [m]
  std::vector<SyntheticCamera> cameras;
  std::vector<TrueParameter> truth;
  std::uint64_t seed = 1;
  double scan_noise = 0.0;        ///< [m] deviation of the vertices of rest.ply along their normals
  bool write_trajectory = false;  ///< the true surface of each frame as truth/000000.ply ...
};

/// Writes a capture as docs/formats.md describes it: capture.toml, rest.ply, depth images, masks, and truth.json (never
/// read by a fit) in the format "synth-truth/1". Frames are made in parallel; the files do not depend on the number of
/// threads.
/// @param progress  called with images done and their total, from one thread at a time; may be empty
/// Throws std::invalid_argument where the parts do not fit together, InputError where a file cannot be written.
void write_synthetic_capture(const std::filesystem::path& folder, const Synthesis& synthesis,
                             const std::function<void(int, int)>& progress = {});

}  // namespace pliant
