#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "capture/capture.hpp"
#include "photos/find_dots.hpp"
#include "photos/force_log.hpp"
#include "photos/lens_camera.hpp"
#include "photos/probe.hpp"

namespace pliant {

/// What dots of one kind look like.
struct DotKind {
  DotColour colour = DotColour::Dark;
  double diameter = 0.0;        ///< [m]
  double least_contrast = 0.1;  ///< of the full scale
};

/// The photographs of one press.
struct PhotographedPress {
  int number = 0;     ///< of its photographs
  double time = 0.0;  ///< [s] of the force log's clock
  std::string role = "fit";
  std::optional<Vector3> contact;  ///< [m] on the rest surface, where the user knows better
  std::optional<bool> glued;
};

/// A `markers.toml` (docs/markers.md), valid as a whole. SI units, world coordinates.
struct PhotoSession {
  std::filesystem::path file, folder;
  std::string name;

  Scene scene;  ///< surface, mass or density, gravity, and where the object is held

  std::vector<LensCamera> cameras;
  std::vector<FramePattern> images;  ///< by camera, relative to `folder`
  DotKind markers, probe_dots;
  ProbeShape probe;
  double tolerance = 1.0;  ///< [pixels]
  int least_views = 3;     ///< that must see a marker under load; at rest always three

  ForceLog log;
  double force_window = 0.0, greatest_gap = 0.0;  ///< [s]

  int rest_number = 0;
  std::vector<PhotographedPress> presses;

  std::filesystem::path photograph(int camera, int number) const;
};

/// Reads and validates a session: `path` is the folder or its markers.toml.
/// Throws InputError with every problem found: keys and types, files that are missing, cameras that OpenCV cannot read,
/// photographs of another size, presses without a force.
PhotoSession read_photo_session(const std::filesystem::path& path);

}  // namespace pliant
