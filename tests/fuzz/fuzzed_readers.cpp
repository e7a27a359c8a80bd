#include "fuzz/fuzzed_readers.hpp"

#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <initializer_list>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include "base/files.hpp"
#include "capture/camera_poses.hpp"
#include "capture/capture.hpp"
#include "capture/curves.hpp"
#include "capture/image_io.hpp"
#include "capture/markers.hpp"
#include "capture/point_cloud.hpp"
#include "geometry/mesh_io.hpp"
#include "geometry/solid_surface.hpp"
#include "geometry/volume_mesh.hpp"
#include "imports/camera_json.hpp"
#include "imports/formats.hpp"
#include "imports/lzfse.hpp"
#include "imports/time_list.hpp"
#include "imports/zip_archive.hpp"
#include "model/model.hpp"
#include "model/result.hpp"
#include "model/samples.hpp"
#include "model/vtu.hpp"
#include "scene/obstacle.hpp"
#ifdef PLIANT_WITH_BAGS
#include "imports/ros_messages.hpp"
#endif

namespace pliant::fuzz {

namespace fs = std::filesystem;

namespace {

constexpr int most_images = 3;  // of a stream

void read_surface_mesh(const fs::path& file) { (void)examine(read_surface(file)); }

void read_volume(const fs::path& file) { (void)boundary_surface(read_volume_mesh(file)); }

void read_cloud(const fs::path& file) {
  (void)read_point_count(file);
  (void)read_points(file);
}

void read_images_of(const ImportedRecording& recording) {
  for (const DepthStream& stream : recording.depth)
    for (int i = 0; i < std::min(stream.image_count, most_images); ++i) (void)stream.read(i);
  for (int i = 0; recording.masks && i < std::min(recording.masks->image_count, most_images); ++i)
    (void)recording.masks->read(i);
}

/// A recording that is the file itself.
template <const char* format>
void import_file(const fs::path& file) {
  const ImportFormat& own = import_format(format, file);
  ImportOptions options;
  options.fx = 20.0;  // of videos
  (void)own.recognises(file);
  read_images_of(own.read(file, options));
}

/// A recording that is the file's folder.
template <const char* format>
void import_folder(const fs::path& file) {
  import_file<format>(file.parent_path());
}

constexpr char mkv[] = "mkv", video[] = "video", bag[] = "bag", db3[] = "db3", r3d[] = "r3d", stray[] = "stray",
               weiss[] = "weiss", c3d[] = "c3d", markers[] = "markers", machine[] = "machine", tum[] = "tum",
               redwood[] = "redwood";

/// A film beside the file, which ffprobe and ffmpeg take apart: programs in the same folder that bear those names, and
/// write what stands there.
template <const char* format>
void import_film(const fs::path& file) {
  const std::string paths = std::getenv("PATH") ? std::getenv("PATH") : "";
  ::setenv("PATH", (file.parent_path().string() + ":" + paths).c_str(), 1);
  const std::unique_ptr<const std::string, void (*)(const std::string*)> restored(
      &paths, [](const std::string* former) { ::setenv("PATH", former->c_str(), 1); });
  import_file<format>(file.parent_path() / "film.mkv");
}

void read_times(const fs::path& file) {
  std::vector<std::string> notes;
  (void)read_time_list(file, {}, {}, notes);
}

void read_zip(const fs::path& file) {
  const ZipArchive archive(file);
  (void)archive.read("first");
  (void)archive.read("second");
}

void read_lzfse(const fs::path& file) {
  constexpr std::size_t largest = std::size_t(1) << 20;
  (void)lzfse_decompressed(read_file(file), largest, file);
}

template <class Number>
void append(std::string& bytes, Number number) {
  bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
}

/// A zip archive of files that are stored as they are: of each its name and content.
std::string zip_of(std::initializer_list<std::pair<std::string, std::string>> files) {
  std::string archive, directory;
  for (const auto& [name, content] : files) {
    std::string entry;
    append<std::uint32_t>(entry, 20), append<std::uint32_t>(entry, 0), append<std::uint16_t>(entry, 0);
    append(entry, std::uint32_t(crc32(0, reinterpret_cast<const Bytef*>(content.data()), uInt(content.size()))));
    append(entry, std::uint32_t(content.size())), append(entry, std::uint32_t(content.size()));
    append(entry, std::uint16_t(name.size())), append<std::uint16_t>(entry, 0);
    directory += "PK\1\2" + std::string(2, '\0') + entry + std::string(10, '\0');
    append(directory, std::uint32_t(archive.size()));
    directory += name;
    archive += "PK\3\4" + entry + name + content;
  }
  const auto begin = std::uint32_t(archive.size());
  archive += directory + "PK\5\6" + std::string(4, '\0');
  append(archive, std::uint16_t(files.size())), append(archive, std::uint16_t(files.size()));
  append(archive, std::uint32_t(directory.size())), append(archive, begin);
  return archive + std::string(2, '\0');
}

/// Record3D's archive of one image, whose metadata are the file.
void read_record3d_metadata(const fs::path& file) {
  const fs::path archive = file.parent_path() / "recording.r3d";
  write_file(archive,
             zip_of({{"metadata", read_file(file)}, {"rgbd/0.depth", read_file(file.parent_path() / "0.depth")}}));
  import_file<r3d>(archive);
}

#ifdef PLIANT_WITH_BAGS
/// A bag of ROS 2 with one image and one camera info, of which the file is one and stands beside the other.
void read_messages(const fs::path& file) {
  const auto topic = [&](const char* name, const char* type, const char* message) {
    return RosTopic{name, type, {0.0}, [bytes = read_file(file.parent_path() / message)](int) { return bytes; }};
  };
  const RosBag messages{file,
                        RosLayout::Cdr,
                        {topic("/camera/depth/image_raw", "sensor_msgs/Image", "image.cdr"),
                         topic("/camera/depth/camera_info", "sensor_msgs/CameraInfo", "camera_info.cdr")}};
  read_images_of(recording_of_bag(messages, {}));
}
#endif

void read_motion_table(const fs::path& file) {
  static constexpr KeyTable forms[] = {{"time,x,y,z", 3}, {"time,x,y,z,turn_x,turn_y,turn_z", 6}};
  std::vector<KeyFrames<6>::Key> keys;
  (void)read_key_table(file, forms, keys);
}

const std::vector<FuzzedReader> all_readers = {
    {"ply", "surface.ply", read_surface_mesh},
    {"obj", "surface.obj", read_surface_mesh},
    {"stl", "surface.stl", read_surface_mesh},
    {"point_ply", "points.ply", read_cloud},
    {"pcd", "points.pcd", read_cloud},
    {"gmsh", "volume.msh", read_volume},
    {"vtk", "volume.vtk", read_volume},
    {"vtu", "volume.vtu", read_volume},
    {"model_vtu", "model.vtu", [](const fs::path& file) { (void)read_vtu(file); }},
    {"depth_image", "depth.png", [](const fs::path& file) { (void)read_depth_image(file); }},
    {"mask", "mask.png", [](const fs::path& file) { (void)read_mask(file); }},
    {"c3d", "markers.c3d", import_file<c3d>},
    {"marker_table", "markers.csv", import_file<markers>},
    {"marker_positions", "markers.csv", [](const fs::path& file) { (void)read_marker_positions(file); }},
    {"machine", "test.csv", import_file<machine>},
    {"force_curve", "curve.csv", [](const fs::path& file) { (void)read_force_curve(file); }},
    {"stress_curve", "curve.csv", [](const fs::path& file) { (void)read_stress_curve(file, true, false); }},
    {"camera_poses", "poses.csv", [](const fs::path& file) { (void)read_camera_poses(file, 5, 2); }},
    {"materials", "members.csv", [](const fs::path& file) { (void)read_materials(file, {}); }},
    {"time_list", "times.txt", read_times},
    {"camera", "camera.json", [](const fs::path& file) { (void)read_camera_json(file); }},
    {"tum", "depth.txt", import_folder<tum>},
    {"stray", "odometry.csv", import_folder<stray>},
    {"weiss", "config.json", import_folder<weiss>},
    {"redwood", "trajectory.log", import_folder<redwood>},
    {"video", "probe.json", import_film<video>},
    {"matroska", "probe.json", import_film<mkv>},
    {"kinect", "calibration.json", import_film<mkv>},
    {"zip", "archive.zip", read_zip},
    {"lzfse", "0.depth", read_lzfse},
    {"record3d", "metadata.json", read_record3d_metadata},
#ifdef PLIANT_WITH_BAGS
    {"ros1_bag", "recording.bag", import_file<bag>},
    {"ros2_bag", "recording.db3", import_file<db3>},
    {"ros_image", "image.cdr", read_messages},
    {"ros_camera_info", "camera_info.cdr", read_messages},
#endif
    {"motion_table", "motion.csv", read_motion_table},
    {"capture", "capture.toml", [](const fs::path& file) { (void)read_capture(file); }},
    {"model", "model.toml", [](const fs::path& file) { (void)load_model(file); }},
    {"result", "result.json", [](const fs::path& file) { (void)read_result(file); }},
};

fs::path scratch_folder() {
  const fs::path memory = "/dev/shm";
  std::string name = ((is_folder(memory) ? memory : fs::temp_directory_path()) / "pliant_fuzz.XXXXXX").string();
  if (!::mkdtemp(name.data()))
    throw std::runtime_error("no folder can be made in " + fs::path(name).parent_path().string());
  return name;
}

}  // namespace

std::span<const FuzzedReader> fuzzed_readers() { return all_readers; }

const FuzzedReader& fuzzed_reader(std::string_view name) {
  std::string names;
  for (const FuzzedReader& reader : all_readers) {
    if (reader.name == name) return reader;
    names += (names.empty() ? "" : ", ") + std::string(reader.name);
  }
  throw std::invalid_argument("no reader \"" + std::string(name) + "\"; expected one of " + names);
}

Feeder::Feeder(const FuzzedReader& reader) : reader_(reader), folder_(scratch_folder()) {
  const fs::path surroundings = fs::path(PLIANT_SOURCE_DIR) / "tests/fuzz/surroundings" / reader.name;
  if (is_folder(surroundings)) fs::copy(surroundings, folder_, fs::copy_options::recursive);
}

Feeder::~Feeder() {
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

std::string Feeder::complaint_about(std::string_view bytes) const {
  const fs::path file = folder_ / reader_.file;
  std::ofstream(file, std::ios::binary).write(bytes.data(), std::streamsize(bytes.size()));
  try {
    reader_.read(file);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

}  // namespace pliant::fuzz
