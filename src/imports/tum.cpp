// TUM RGB-D (Sturm et al. 2012; file formats of the benchmark): depth.txt with a time and a file a line, 16-bit PNG
// with 5000 units a metre, and groundtruth.txt with poses from camera to world.
#include "base/files.hpp"
#include "imports/camera_json.hpp"
#include "imports/formats.hpp"
#include "imports/image_sequence.hpp"
#include "imports/time_list.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

constexpr double tum_scale = 5000.0;

// Poses at the times of the images: `origin` is the first one's stamp, `unit` the unit of all.
void read_tum_poses(const fs::path& file, double origin, double unit, DepthStream& stream) {
  std::vector<double> times;
  std::vector<RigidMotion> poses;
  for (const NumberRow& row : read_rows(file)) {
    double n[8];
    for (std::size_t i = 0; i < 8; ++i) n[i] = number_at(row, i, file, "time, tx, ty, tz, qx, qy, qz, qw");
    const auto pose = motion_of({n[4], n[5], n[6], n[7]}, {n[1], n[2], n[3]});
    if (!pose) throw InputError(Problem{{file, row.line}, "a quaternion of zero", "a rotation", ""});
    if (!times.empty() && !(unit * (n[0] - origin) > times.back()))
      throw InputError(Problem{{file, row.line}, "a time that is not after the one before", "times that grow", ""});
    times.push_back(unit * (n[0] - origin));
    poses.push_back(*pose);
  }
  if (times.empty()) refuse(file, "no pose", "time, tx, ty, tz, qx, qy, qz, qw a line");
  for (const double time : stream.times) stream.poses.push_back(pose_at(times, poses, time));
}

}  // namespace

bool is_tum_folder(const fs::path& source) { return is_file(source / "depth.txt"); }

ImportedRecording read_tum_folder(const fs::path& source, const ImportOptions& options) {
  const fs::path list = source / "depth.txt";
  std::vector<fs::path> files;
  std::vector<double> stamps;
  for (const NumberRow& row : read_rows(list)) {
    stamps.push_back(number_at(row, 0, list, "a time in seconds, and a file"));
    if (row.cells.size() != 2) throw InputError(Problem{{list, row.line}, "no file", "a time and a file", ""});
    files.push_back(source / row.cells[1]);
    if (!is_file(files.back()))
      throw InputError(Problem{{list, row.line},
                               "\"" + row.cells[1] + "\" " + why_no_file(files.back()),
                               "a depth image",
                               "name the folder that holds depth.txt and depth/"});
  }
  const CameraFile camera = camera_of_folder(source, options);
  ImportedRecording recording;
  recording.name = source_name(source);
  DepthStream stream = stream_of_files(camera.camera, options.depth_scale.value_or(tum_scale), std::move(files), list);
  stream.times = in_seconds(stamps, {}, camera.frame_rate, options, list, recording.notes);
  const double span = stamps.empty() ? 0.0 : stamps.back() - stamps.front();
  const double unit = span > 0.0 ? stream.times.back() / span : 1.0;
  if (is_file(source / "groundtruth.txt")) read_tum_poses(source / "groundtruth.txt", stamps.front(), unit, stream);
  recording.depth.push_back(std::move(stream));
  return recording;
}

}  // namespace pliant
