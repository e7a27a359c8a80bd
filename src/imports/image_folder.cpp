// A folder of depth images with a JSON file of the camera, and the same of Open3D and of the Redwood data sets.
#include <algorithm>
#include <charconv>

#include "base/files.hpp"
#include "imports/camera_json.hpp"
#include "imports/formats.hpp"
#include "imports/image_sequence.hpp"
#include "imports/time_list.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

constexpr double redwood_scale = 1000.0;  // Open3D's depth images, and those of the Redwood data sets, are in mm

fs::path images_folder(const fs::path& source) { return is_folder(source / "depth") ? source / "depth" : source; }

// Depth images of a folder: of 16 bits and one channel, where it has any; pictures and masks may lie beside them.
std::vector<fs::path> depth_files(const fs::path& folder) {
  const std::vector<fs::path> all = image_files(folder);
  std::vector<fs::path> deep;
  for (const fs::path& file : all) {
    const ImageHeader header = read_image_header(file);
    if (header.bits == 16 && header.channels == 1) deep.push_back(file);
  }
  return deep.empty() ? all : deep;  // none: the first one is refused by what it is
}

// Files of Redwood's sensor are named FRAME-MICROSECONDS.png: the second number of each, where all have two.
std::vector<double> times_in_names(const std::vector<fs::path>& files) {
  std::vector<double> times;
  for (const fs::path& file : files) {
    const std::string name = file.stem().string();
    const auto dash = name.find('-');
    long long frame = 0, microseconds = 0;
    if (dash == std::string::npos) return {};
    const char *middle = name.data() + dash, *end = name.data() + name.size();
    if (std::from_chars(name.data(), middle, frame).ptr != middle) return {};
    const auto second = std::from_chars(middle + 1, end, microseconds);
    if (second.ptr != end || second.ec != std::errc()) return {};
    times.push_back(1e-6 * double(microseconds));
  }
  return times;
}

// Names that are times themselves: seconds with a point, or numbers of more than eight digits.
std::vector<double> times_as_names(const std::vector<fs::path>& files) {
  constexpr double least_time = 1e8;
  std::vector<double> times;
  for (const fs::path& file : files) {
    const std::string name = file.stem().string();
    double time = 0.0;
    const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), time, std::chars_format::fixed);
    if (error != std::errc() || end != name.data() + name.size()) return {};
    if (name.find('.') == std::string::npos && time < least_time) return {};
    times.push_back(time);
  }
  return times;
}

void read_times(const fs::path& source, const std::vector<fs::path>& files, const CameraFile& camera,
                const ImportOptions& options, DepthStream& stream, std::vector<std::string>& notes) {
  for (const char* name : {"timestamps.txt", "times.txt", "timestamps.csv", "times.csv"}) {
    if (options.frame_rate || !is_file(source / name)) continue;
    stream.times = read_time_list(source / name, camera.frame_rate, options, notes);
    if (stream.times.size() != files.size())
      refuse(source / name, std::to_string(stream.times.size()) + " times",
             std::to_string(files.size()) + ", one for each depth image");
    return;
  }
  stream.times = times_in_names(files);
  if (std::vector<double> times = times_as_names(files);
      stream.times.empty() && times.size() > 1 && !options.frame_rate)
    stream.times = in_seconds(std::move(times), {}, camera.frame_rate, options, source, notes);
  stream.frame_rate = camera.frame_rate.value_or(0.0);
}

// Redwood's trajectory: of each image three whole numbers and the 4 x 4 matrix from camera to world.
void read_trajectory(const fs::path& file, DepthStream& stream) {
  const std::vector<NumberRow> rows = read_rows(file);
  if (rows.size() != 5 * std::size_t(stream.image_count))
    refuse(file, std::to_string(rows.size()) + " lines", std::to_string(5 * stream.image_count) + ", five an image",
           "the trajectory must have a pose for each depth image");
  for (std::size_t k = 0; k < rows.size(); k += 5) {
    RigidMotion pose;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j)
        pose.rotation(i, j) = number_at(rows[k + 1 + std::size_t(i)], std::size_t(j), file, "a number of a matrix");
      pose.translation[i] = number_at(rows[k + 1 + std::size_t(i)], 3, file, "a number of a matrix");
    }
    constexpr double orthogonal = 1e-3;
    if ((pose.rotation * pose.rotation.transpose() - Matrix3::Identity()).norm() > orthogonal)
      throw InputError(Problem{{file, rows[k + 1].line}, "a matrix that does not rotate", "a rigid motion", ""});
    stream.poses.push_back(pose);
  }
}

ImportedRecording read_images(const fs::path& source, const ImportOptions& options, std::optional<double> usual_scale) {
  if (!is_folder(source)) refuse(source, "a file", "a folder with depth images");
  const CameraFile camera = camera_of_folder(source, options);
  const fs::path folder = images_folder(source);
  const std::vector<fs::path> files = depth_files(folder);
  if (files.empty()) refuse(folder, "no depth image", "16-bit PNG or PGM files, in this folder or in `depth`");
  (void)read_raw_depth(files.front(), camera.camera);
  const std::optional<double> scale = options.depth_scale  ? options.depth_scale
                                      : camera.depth_scale ? camera.depth_scale
                                                           : usual_scale;
  if (!scale) ask_for_scale(folder, "neither images nor the camera's file tell it");
  ImportedRecording recording;
  recording.name = source_name(source);
  DepthStream stream = stream_of_files(camera.camera, *scale, files, folder);
  read_times(source, files, camera, options, stream, recording.notes);
  for (const char* name : {"trajectory.log", "camera_trajectory.log"})
    if (is_file(source / name) && stream.poses.empty()) read_trajectory(source / name, stream);
  recording.depth.push_back(std::move(stream));
  return recording;
}

}  // namespace

bool is_image_folder(const fs::path& source) {
  return is_folder(source) && !image_files(images_folder(source)).empty();
}

ImportedRecording read_image_folder(const fs::path& source, const ImportOptions& options) {
  return read_images(source, options, std::nullopt);
}

bool is_redwood_folder(const fs::path& source) {
  if (!is_folder(source / "depth")) return false;
  return is_folder(source / "color") || is_folder(source / "image") || is_folder(source / "rgb");
}

ImportedRecording read_redwood_folder(const fs::path& source, const ImportOptions& options) {
  return read_images(source, options, redwood_scale);
}

}  // namespace pliant
