#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "imports/recording.hpp"

namespace pliant {

/// How messages are laid out as bytes: ROS 1 without gaps, ROS 2 by CDR with alignment.
enum class RosLayout { Ros1, Cdr };

/// Messages of one topic of a bag, in order of their times.
struct RosTopic {
  std::string name, type;     ///< "/camera/depth/image_rect_raw", "sensor_msgs/Image"; without ROS 2's "/msg/"
  std::vector<double> times;  ///< [s] at which each was recorded
  std::function<std::string(int)> read;  ///< bytes of message i
};

/// A bag of either kind.
struct RosBag {
  std::filesystem::path file;
  RosLayout layout = RosLayout::Ros1;
  std::vector<RosTopic> topics;
};

/// Opens a ROS 1 bag (format 2.0; chunks without compression, bz2 or lz4). Throws InputError.
RosBag open_ros1_bag(const std::filesystem::path& file);

/// Opens a ROS 2 bag: the SQLite file, or the folder that it lies in. Throws InputError.
RosBag open_ros2_bag(const std::filesystem::path& source);

/// Depth streams of a bag: sensor_msgs/Image (16UC1, mono16, 32FC1) and compressedDepth of 16UC1, each with the
/// sensor_msgs/CameraInfo beside it. Units: millimetres of 16UC1 (REP 118); the RealSense SDK's bags state theirs as
/// the option Depth Units; others are asked for. Times are those of the images' headers. Throws InputError where there
/// is none, where several are and `options.topics` chooses none, and for what cannot be used: 8-bit images of depth, an
/// unknown lens, no camera info.
ImportedRecording recording_of_bag(const RosBag& bag, const ImportOptions& options);

}  // namespace pliant
