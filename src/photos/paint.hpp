#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "capture/image_io.hpp"
#include "photos/session.hpp"

// Photographs of painted objects whose truth is known: for tests, and for trying out a set-up before building it.

namespace pliant {

/// A round dot painted on the surface at rest.
struct PaintedDot {
  int triangle = 0;                   ///< of the surface
  Vector3 weights = Vector3::Zero();  ///< of the triangle's corners, sum 1
  double radius = 0.0;                ///< [m], at rest
};

/// The probe as cameras see it: a shaft with two beads on its axis.
struct PaintedProbe {
  ProbeShape shape;
  ProbePose pose;
  double shaft_radius = 0.0, bead_radius = 0.0;  ///< [m]
};

/// What stands before the cameras.
struct PaintedScene {
  TriangleMesh rest;              ///< as it was painted
  std::vector<Vector3> vertices;  ///< where its vertices are now [m]
  std::vector<PaintedDot> dots;
  std::optional<PaintedProbe> probe;
  Vector3 lamp = Vector3::Zero();  ///< a point light [m]
  Rgb colour = {205, 190, 170}, dot_colour = {35, 32, 30}, backdrop = {70, 75, 85}, shaft_colour = {225, 225, 222},
      bead_colour = {190, 35, 40};
};

/// Faults of a picture.
struct PhotoQuality {
  int samples = 3;         ///< rays along each side of a pixel near dots, 1 to 16
  double blur = 0.8;       ///< [pixels] deviation of a Gaussian
  double noise = 2.0;      ///< [grey levels of 255] deviation
  std::uint64_t seed = 1;  ///< of the noise
};

/// The photograph that a camera takes. Away from dots and beads only every fourth pixel is computed.
/// Throws std::invalid_argument for quality out of range or as many vertices as the mesh has not.
Image<Rgb> take_photograph(const PaintedScene& scene, const LensCamera& camera, const PhotoQuality& quality = {});

/// Where cameras see the middles of the dots now, m x 3 [m]: in the middle of the flat disc that a dot's rim spans. On
/// a surface that bends with a radius R it lies radius^2 / (2 R) below it.
Points dot_centres(const PaintedScene& scene);

/// An object under presses, as it truly deforms.
struct PressedObject {
  std::string name;
  Scene scene;  ///< surface, mass or density, gravity, and where the object is held
  struct Press {
    Vector3 contact, direction;     ///< where the probe first touched [m]; unit, into the object
    Vector3 shift;                  ///< of its tip since [m]
    double force = 0.0;             ///< along its direction [N]
    std::vector<Vector3> vertices;  ///< of the surface [m]
    std::string role = "fit";
    bool contact_is_written = false;  ///< in markers.toml: a probe that drifted touched elsewhere than on its axis
  };
  std::vector<Press> presses;
  double probe_radius = 0.006;  ///< [m]
};

/// A session with known truth: an object with dots, three cameras with lenses, pressed. Left to itself it is a soft
/// dome that is pushed in at two places.
struct PhotoExampleOptions {
  int dots = 200, width = 3888, height = 2592;
  double dot_diameter = 0.004;                         ///< [m]
  std::vector<double> depths = {0.012, 0.024, 0.036};  ///< [m] of the dome's presses at each of the two places
  std::uint64_t seed = 1;
};
class PhotoExample {
 public:
  /// The dome. Throws std::invalid_argument where so many dots have no room.
  explicit PhotoExample(const PhotoExampleOptions& options);
  /// Another object, before stationary cameras like those of the dome, as far away as it is large.
  PhotoExample(const PhotoExampleOptions& options, PressedObject object);

  /// What is written in its markers.toml; file names as `write` uses them.
  const PhotoSession& session() const { return session_; }
  /// What stands before the cameras in photograph `number`: 0 at rest, then the presses.
  PaintedScene scene(int number) const;
  Image<Rgb> photograph(int camera, int number, PhotoQuality quality = {}) const;
  /// Where the probe first touched [m].
  Vector3 contact(int number) const;
  double force(int number) const;

  /// Writes markers.toml and all that it names, and truth/NNN.csv with the dots' true places.
  void write(const std::filesystem::path& folder) const;

 private:
  const PressedObject::Press& press(int number) const;

  PhotoExampleOptions options_;
  PhotoSession session_;
  PaintedScene painted_;
  std::vector<PressedObject::Press> presses_;
};

}  // namespace pliant
