#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "capture/capture.hpp"
#include "capture/find_plane.hpp"
#include "capture/observe.hpp"
#include "capture/segment.hpp"

namespace pliant {

/// Number of points per frame.
struct PointCounts {
  int least = 0, median = 0, greatest = 0;
  std::vector<int> empty_frames;
};

/// A declared plane against what the cameras see of it.
struct PlaneSurvey {
  std::optional<FoundPlane> seen;
  double angle = 0.0;     ///< between the declared and the seen normal [rad]
  double distance = 0.0;  ///< from the declared point to the seen plane [m]
};

/// A point cloud of which nothing is known: its size, and the plane that most of it lies on.
struct CloudScene {
  int points = 0;
  Box box;
  std::optional<PlaneFit> plane;  ///< where it explains a fifth of the points at least
};

/// Markers of one [[markers]] block, or of all presses and loads together.
struct MarkerSurvey {
  int markers = 0;                      ///< at rest; the most of one file of presses and loads
  int frames = 0;                       ///< of the capture; or presses and loads with markers
  std::vector<int> empty_frames;        ///< in which no marker was seen
  double missing = 0.0;                 ///< share of positions that were not seen
  std::vector<std::string> never_seen;  ///< ids
  std::vector<std::string> left_out;    ///< labels that no marker at rest has
  std::optional<double> noise;          ///< [m] scatter of a coordinate between neighbouring frames; nothing: unknown
  double travel = 0.0;               ///< [m] greatest way of the seen markers (their median) from the first sighting;
                                     ///< under loads: from rest
  std::optional<double> frame_rate;  ///< [Hz] as the track's file states it
  std::vector<std::string> doubts;   ///< traded names and jumps, a sentence each
};

/// The outlines of one [[silhouette]] block.
struct OutlineSurvey {
  PointCounts points;           ///< of the outline in each frame
  std::vector<int> cut_frames;  ///< in which the object reaches the picture's border
  double noise = 0.0;           ///< [m] standard deviation of the outline, at the object
  double travel = 0.0;          ///< [m] greatest way of the outline's middle across the view, at the object
};

/// What a recording shows, in figures.
struct Survey {
  /// Of each depth camera the frames after `start_frame` whose image file is that of the frame before, byte by byte: no
  /// sensor reads a scene twice alike.
  std::vector<std::vector<int>> repeated_images;
  PointCounts points;
  double median_noise = 0.0;  ///< of points along the surface normal [m]
  double travel = 0.0;        ///< greatest displacement of the seen points' centroid or box from the first frame [m]
  bool moves = false;         ///< travel of points, outlines or markers beyond their noise
  std::optional<int> first_contact;  ///< first frame after `start_frame` in which what is seen comes to a plane
  std::optional<double>
      seen_share;  ///< of the rest surface's vertices, at the start; nothing where it is not in that pose
  std::vector<PlaneSurvey> planes;             ///< of each Capture::planes
  std::vector<Segmentation> scenes;            ///< of each camera's first frame, where there is no rest surface
  std::vector<CloudScene> clouds;              ///< of each cloud sequence's first frame, where there is no rest surface
  std::vector<OutlineSurvey> outlines;         ///< of each Capture::silhouettes, where there is a rest surface
  std::vector<MarkerSurvey> markers;           ///< of each Capture::markers
  std::optional<MarkerSurvey> loaded_markers;  ///< of all presses and loads that have markers
};

/// @param frames  as `observe` gives them; markers are read here
/// Throws InputError where a file cannot be read.
Survey survey(const Capture& capture, std::span<const ObservedFrame> frames);

/// Identifiability of an object's parameters from a recording: what can be estimated, what cannot, and why, in plain
/// sentences.
struct Identifiability {
  std::vector<std::string> possible, impossible;
};

Identifiability identifiability(const Capture& capture, const Survey& survey);

}  // namespace pliant
