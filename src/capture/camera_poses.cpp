#include "capture/camera_poses.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>
#include <optional>
#include <ostream>

#include "base/csv.hpp"
#include "base/files.hpp"

namespace pliant {

namespace {

constexpr const char* pose_header = "frame,x,y,z,qx,qy,qz,qw";

}  // namespace

std::vector<RigidMotion> read_camera_poses(const std::filesystem::path& path, int frame_count, int every) {
  std::vector<std::optional<RigidMotion>> read(static_cast<std::size_t>(frame_count));
  read_csv(path, pose_header, [&](CsvRow& row) {
    const auto frame = row.index(0);
    double n[7];
    for (std::size_t i = 0; i < 7; ++i) {
      const auto number = row.number(i + 1);
      if (!number) return;
      n[i] = *number;
    }
    if (!frame) return;
    if (*frame >= frame_count)
      return row.complain(0, "frame " + std::to_string(*frame), "0 to " + std::to_string(frame_count - 1));
    const double length = Eigen::Vector4d(n[3], n[4], n[5], n[6]).norm();
    if (!(length > 1e-6)) return row.complain(4, "a quaternion of zero", "a rotation");
    auto& pose = read[std::size_t(*frame)];
    if (pose) return row.complain(0, "a second pose of frame " + std::to_string(*frame), "one");
    const Eigen::Quaterniond q(n[6] / length, n[3] / length, n[4] / length, n[5] / length);
    pose = RigidMotion{q.toRotationMatrix(), Vector3(n[0], n[1], n[2])};
  });
  std::vector<RigidMotion> poses;
  for (int frame = 0; frame < frame_count; ++frame) {
    const auto& pose = read[std::size_t(frame)];
    if (!pose && every > 0 && frame % every == 0)
      throw InputError({{path}, "no pose of frame " + std::to_string(frame), "one for each image", ""});
    poses.push_back(pose ? *pose : poses.back());
  }
  return poses;
}

void write_camera_poses(const std::filesystem::path& path, std::span<const RigidMotion> poses) {
  write_file(path, [&](std::ostream& out) {
    out << pose_header << "\n";
    for (std::size_t frame = 0; frame < poses.size(); ++frame) {
      const Eigen::Quaterniond q(poses[frame].rotation);
      const Vector3& t = poses[frame].translation;
      char line[256];
      std::snprintf(line, sizeof line, "%zu,%.9g,%.9g,%.9g,%.12g,%.12g,%.12g,%.12g\n", frame, t.x(), t.y(), t.z(),
                    q.x(), q.y(), q.z(), q.w());
      out << line;
    }
  });
}

}  // namespace pliant
