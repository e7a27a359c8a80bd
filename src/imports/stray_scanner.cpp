// Stray Scanner: depth/*.png in millimetres, confidence/*.png (0 low, 1, 2 high), camera_matrix.csv of the colour
// video, which is 1920 pixels wide, and odometry.csv: timestamp, frame, x, y, z, qx, qy, qz, qw, from the camera (axes
// as in OpenCV) to ARKit's world, whose y points up.
#include <cmath>

#include "base/files.hpp"
#include "imports/formats.hpp"
#include "imports/image_sequence.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

constexpr double stray_scale = 1000.0;
constexpr int colour_width = 1920, colour_height = 1440;

PinholeCamera stray_camera(const fs::path& file) {
  const std::vector<NumberRow> rows = read_rows(file);
  if (rows.size() != 3) refuse(file, std::to_string(rows.size()) + " lines", "three: a 3 x 3 matrix");
  PinholeCamera camera;
  camera.width = colour_width, camera.height = colour_height;
  camera.fx = number_at(rows[0], 0, file, "fx"), camera.cx = number_at(rows[0], 2, file, "cx");
  camera.fy = number_at(rows[1], 1, file, "fy"), camera.cy = number_at(rows[1], 2, file, "cy");
  constexpr double off_centre = 0.1;  // of the width: then the matrix is of another resolution
  if (!(camera.fx > 0 && camera.fy > 0) || std::abs(camera.cx / colour_width - 0.5) > off_centre)
    refuse(file, "a camera whose centre is at column " + std::to_string(camera.cx), "one of a video 1920 pixels wide",
           "import the folder depth with --from images and intrinsics of its own");
  return camera;
}

// Readings of low confidence are taken away.
Image<std::uint16_t> stray_image(const fs::path& depth, const fs::path& confidence, const PinholeCamera& camera) {
  Image<std::uint16_t> image = read_raw_depth(depth, camera);
  if (!is_file(confidence)) return image;
  const Image<std::uint8_t> sure = read_mask(confidence);
  if (sure.width != image.width || sure.height != image.height)
    refuse(confidence, "an image of another size than the depth's", "one confidence a pixel");
  for (std::size_t i = 0; i < image.pixels.size(); ++i)
    if (sure.pixels[i] == 0) image.pixels[i] = 0;
  return image;
}

}  // namespace

bool is_stray_scanner(const fs::path& source) {
  return is_file(source / "odometry.csv") && is_file(source / "camera_matrix.csv");
}

ImportedRecording read_stray_scanner(const fs::path& source, const ImportOptions& options) {
  const PinholeCamera colour = stray_camera(source / "camera_matrix.csv");
  std::vector<fs::path> files = image_files(source / "depth");
  if (files.empty()) refuse(source / "depth", "no depth image", "PNG files in millimetres");
  const ImageHeader header = read_image_header(files.front());
  ImportedRecording recording;
  recording.name = source_name(source);
  DepthStream stream = stream_of_files(resized(colour, header.width, header.height),
                                       options.depth_scale.value_or(stray_scale), files, source);
  stream.name = "iphone";
  const fs::path odometry = source / "odometry.csv";
  std::vector<NumberRow> rows = read_rows(odometry);
  if (!rows.empty()) rows.erase(rows.begin());  // the header
  if (rows.size() < files.size())
    refuse(odometry, std::to_string(rows.size()) + " poses", std::to_string(files.size()) + ", one a depth image",
           "the recording is not whole");
  for (std::size_t i = 0; i < files.size(); ++i) {
    double n[9];
    for (std::size_t k = 0; k < 9; ++k)
      n[k] = number_at(rows[i], k, odometry, "timestamp, frame, x, y, z, qx, qy, qz, qw");
    const auto pose = motion_of({n[5], n[6], n[7], n[8]}, {n[2], n[3], n[4]});
    if (!pose) throw InputError(Problem{{odometry, rows[i].line}, "a quaternion of zero", "a rotation", ""});
    stream.times.push_back(n[0]);
    stream.poses.push_back(*pose);
  }
  stream.read = [files, confidence = source / "confidence", camera = stream.camera](int i) {
    const fs::path& file = files[std::size_t(i)];
    return stray_image(file, confidence / file.filename(), camera);
  };
  recording.gravity = Vector3(0.0, -9.81, 0.0);
  recording.depth.push_back(std::move(stream));
  recording.notes.push_back("readings of low confidence are left out");
  return recording;
}

}  // namespace pliant
