#include "imports/formats.hpp"

#include <algorithm>

#include "base/files.hpp"

namespace pliant {

const std::vector<ImportFormat>& import_formats() {
  static const std::vector<ImportFormat> all = {
#ifdef PLIANT_WITH_BAGS
      {"bag", "ROS 1 bags, also of the RealSense viewer", is_ros1_bag, read_ros1_bag},
      {"db3", "ROS 2 bags in SQLite, also of the RealSense viewer", is_ros2_bag, read_ros2_bag},
#endif
      {"r3d", "Record3D on iPhone and iPad", is_record3d, read_record3d},
      {"stray", "Stray Scanner on iPhone and iPad", is_stray_scanner, read_stray_scanner},
      {"mkv", "Azure Kinect and Orbbec, by the program ffmpeg", is_matroska, read_matroska},
      {"video", "plain videos of an object before a background, by the program ffmpeg", is_video, read_video},
      {"weiss", "SparseSurfaceConstraints: config.json and cam0/depth0.png", is_weiss_folder, read_weiss_folder},
      {"c3d", "markers of motion capture, C3D", is_c3d, read_c3d_markers},
      {"markers", "markers as CSV: frame,id,x,y,z, or columns NAME_x, NAME_y, NAME_z", is_marker_csv, read_marker_csv},
      {"machine", "testing machines (Instron and others) as CSV: extension and load, or strain and stress",
       is_machine_csv, read_machine_csv},
      {"tum", "TUM RGB-D: depth.txt and depth/*.png", is_tum_folder, read_tum_folder},
      {"redwood", "Open3D and Redwood: depth/*.png beside colour images", is_redwood_folder, read_redwood_folder},
      {"images", "a folder of 16-bit PNG or PGM images and a JSON file of the camera", is_image_folder,
       read_image_folder},
  };
  return all;
}

const ImportFormat& import_format(const std::string& name, const std::filesystem::path& source) {
  if (!is_file(source) && !is_folder(source))
    refuse(source, "the source " + why_no_file(source), "a file or folder of a recording");
  std::string names;
  for (const ImportFormat& format : import_formats()) {
    if (name.empty() ? format.recognises(source) : format.name == name) return format;
    names += (names.empty() ? "" : ", ") + format.name;
  }
  if (!name.empty()) refuse({}, "no format `" + name + "`", names);
  refuse(source, "a source of no format that is known", "one of " + names,
         "say which with --from; docs/imports.md tells what each holds");
}

}  // namespace pliant
