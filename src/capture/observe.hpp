#pragma once

#include <functional>
#include <vector>

#include "capture/capture.hpp"
#include "capture/outline.hpp"

namespace pliant {

/// Points of clouds, and why some of them were left out.
struct CloudCounts {
  int read = 0;
  int out_of_reach = 0;  ///< far from the object
  int on_plane = 0;      ///< on planes, or behind them
  int background = 0;    ///< as in the background cloud
  int isolated = 0;      ///< standing alone
};

/// The outline that a silhouette camera saw in a frame.
struct ObservedOutline {
  int camera = 0;  ///< index into Capture::silhouettes
  Outline outline;
};

/// What sensors saw of the object in one frame.
struct ObservedFrame {
  int frame = 0;
  std::vector<Vector3> points;  ///< [m], world, on the object's surface
  std::vector<float> noise;     ///< standard deviation of each point along the surface normal [m]
  std::vector<Vector3> view;    ///< unit direction from the sensor to the point; zero for clouds
  std::vector<int> camera;      ///< index into Capture::depth; -1 for clouds
  std::vector<int> pixel;       ///< row * width + column; -1 for clouds
  /// Of each depth camera, how far neighbouring pixels scatter over the noise (`pixel_scatter`); 0 where nothing tells.
  std::vector<double> scatter;
  CloudCounts cloud = {};  ///< of all clouds of the frame
  std::vector<ObservedOutline> outlines = {};
};

struct ObserveOptions {
  double plane_margin = 0.0;     ///< [m] pixels this close to a known plane are dropped; 0: three times the noise
  double edge_jump = 0.0;        ///< [m] depth jump between neighbours that marks an edge; 0: from the noise
  double band = 0.0;             ///< [m] without mask or background: keep points this near the rest surface's
                                 ///< bounding box; 0: the object's size
  int max_points_per_frame = 0;  ///< 0: all; else an even, deterministic subset of the pixels, and of each outline's
};

/// Points on the object for every frame that was observed, in order of frames (several cameras and clouds merged).
/// Per camera: mask, else background subtraction, else everything within the band; then pixels of planes and flying
/// pixels at depth edges are removed; noise from the sensor model. Of clouds, what lies far from the object, on planes,
/// as in the background cloud, or alone (`CloudSorter`) is left out. Outlines are those of silhouette cameras' masks.
/// Frames are read in parallel.
/// @param progress  called with the number of frames done and their total; may be empty
/// Throws InputError where an image cannot be decoded.
std::vector<ObservedFrame> observe(const Capture& capture, const ObserveOptions& options = {},
                                   const std::function<void(int, int)>& progress = {});

/// What sensors saw of the object under a hung weight.
struct ObservedLoad {
  ObservedFrame seen;  ///< of frame -1
  int outliers = 0;    ///< points of the cloud that were dropped for standing alone
};

/// The cloud and the depth images of a load, as `observe` reads those of a frame. Markers are not looked at.
/// Throws InputError where a file cannot be read.
ObservedLoad observe_load(const Capture& capture, const Load& load, const ObserveOptions& options = {});

}  // namespace pliant
