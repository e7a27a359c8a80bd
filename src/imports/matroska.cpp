// Azure Kinect and Orbbec recordings (.mkv): a track of 16-bit grey depth in millimetres, and an attachment with the
// factory's calibration (JSON). The programs ffprobe and ffmpeg take the file apart.
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>

#include "base/files.hpp"
#include "imports/camera_json.hpp"
#include "imports/ffmpeg.hpp"
#include "imports/formats.hpp"
#include "imports/image_sequence.hpp"
#include "imports/json_values.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

using MkvJson = nlohmann::json;

constexpr double kinect_scale = 1000.0;

MkvJson mkv_streams(const fs::path& file) {
  const MkvJson json = probed(file, "-show_streams");
  if (json.is_null())
    refuse(file, "ffprobe finds no track in it", "a Matroska recording", "the file may be cut short; copy it again");
  return json["streams"];
}

bool is_grey_16(const MkvJson& stream) { return text_at(stream, "/pix_fmt").starts_with("gray16"); }

bool is_called_depth(const MkvJson& stream) {
  return text_at(stream, "/tags/title") == "DEPTH" || text_at(stream, "/tags/title") == "depth";
}

// The track with 16-bit grey pictures that is called depth, or the first of such.
const MkvJson& depth_track(const MkvJson& streams, const fs::path& file) {
  const MkvJson* found = nullptr;
  std::string colourised;
  for (const MkvJson& stream : streams) {
    if (text_at(stream, "/codec_type") != "video") continue;
    if (is_grey_16(stream)) {
      if (!found || is_called_depth(stream)) found = &stream;
    } else if (is_called_depth(stream)) {
      colourised = text_at(stream, "/pix_fmt");
    }
  }
  if (!found && !colourised.empty()) refuse_colourised(file, "pixel format " + colourised);
  if (!found) refuse(file, "no track of 16-bit grey pictures", "a depth track", "record with the depth camera on");
  return *found;
}

// How a depth mode cuts its picture out of the sensor's 1024 x 1024 pixels.
struct DepthMode {
  int width, height, binned, left, top;
};
constexpr DepthMode depth_modes[] = {
    {640, 576, 1024, 192, 180},  // narrow field of view
    {320, 288, 512, 96, 90},     // narrow, pixels binned 2 x 2
    {1024, 1024, 1024, 0, 0},    // wide
    {512, 512, 512, 0, 0},       // wide, pixels binned 2 x 2
};

// The factory's calibration: cx, cy, fx, fy by the sensor's side, then k1 .. k6, the distortion's centre, p2, p1.
PinholeCamera kinect_camera(const std::string& text, int width, int height, const fs::path& file) {
  const MkvJson json = MkvJson::parse(text, nullptr, false);
  const auto fail = [&](const std::string& found) {
    refuse(file, found, "the calibration of an Azure Kinect or what records like it", "give --camera FILE");
  };
  if (json.is_discarded()) fail("an attachment that is no JSON");
  const MkvJson& cameras = value_at(json, "/CalibrationInformation/Cameras");
  for (const MkvJson& camera : cameras) {
    if (text_at(camera, "/Purpose") != "CALIBRATION_CameraPurposeDepth") continue;
    const MkvJson& p = value_at(camera, "/Intrinsics/ModelParameters");
    if (!p.is_array() || p.size() < 14 || !std::ranges::all_of(p, [](const MkvJson& v) { return v.is_number(); }))
      fail("a calibration with " + std::to_string(p.size()) + " parameters");
    const auto at = [&](std::size_t i) { return p[i].get<double>(); };
    for (const DepthMode& mode : depth_modes) {
      if (mode.width != width || mode.height != height) continue;
      PinholeCamera result;
      result.width = width, result.height = height;
      result.cx = at(0) * mode.binned - mode.left - 0.5, result.cy = at(1) * mode.binned - mode.top - 0.5;
      result.fx = at(2) * mode.binned, result.fy = at(3) * mode.binned;
      result.lens = LensDistortion({at(4), at(5), at(13), at(12), at(6), at(7), at(8), at(9)});
      if (at(10) != 0.0 || at(11) != 0.0) fail("a lens whose distortion has a centre of its own");
      return result;
    }
    fail("depth pictures of " + std::to_string(width) + " x " + std::to_string(height) +
         " pixels, which are of no mode");
  }
  fail("a calibration without a depth camera");
  return {};
}

std::string calibration_of(const MkvJson& streams, const fs::path& file) {
  int index = 0;
  for (const MkvJson& stream : streams) {
    if (text_at(stream, "/codec_type") != "attachment") continue;
    if (text_at(stream, "/tags/filename").ends_with(".json")) {
      std::string folder = (fs::temp_directory_path() / "pliant.XXXXXX").string();
      if (!::mkdtemp(folder.data())) refuse(folder, "a temporary folder that cannot be made", "a place to write to");
      const fs::path out = fs::path(folder) / "calibration.json";
      (void)output_of("ffmpeg -y -v quiet -dump_attachment:t:" + std::to_string(index) + " " +
                      shell_word(out.string()) + " -i " + ffmpeg_argument(file) + " 2>/dev/null </dev/null");
      const std::string text = is_file(out) ? read_file(out) : std::string();
      remove_file(out);
      std::error_code ignored;
      fs::remove(folder, ignored);
      if (!text.empty()) return text;
    }
    ++index;
  }
  refuse(file, "no calibration attached", "an attachment calibration.json", "give the intrinsics with --camera FILE");
}

std::vector<double> packet_times(const fs::path& file, int track) {
  const std::string text =
      output_of("ffprobe -v quiet -select_streams " + std::to_string(track) +
                " -show_entries packet=pts_time -of csv=p=0 " + ffmpeg_argument(file) + " 2>/dev/null </dev/null");
  std::vector<double> times;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    char* rest = nullptr;
    const std::string line = text.substr(at, end - at);
    const double time = std::strtod(line.c_str(), &rest);
    if (rest != line.c_str()) times.push_back(time);
    at = end + 1;
  }
  return times;
}

// Pictures of the track one after the other; going back begins anew.
class MkvFrames {
 public:
  MkvFrames(const fs::path& file, int track, int width, int height) : file_(file), width_(width), height_(height) {
    command_ = "ffmpeg -v quiet -i " + ffmpeg_argument(file) + " -map 0:" + std::to_string(track) +
               " -fps_mode passthrough -f rawvideo -pix_fmt gray16le - 2>/dev/null </dev/null";
  }
  Image<std::uint16_t> read(int i) {
    const std::lock_guard lock(mutex_);
    if (!pipe_ || i < next_) pipe_ = open_pipe(command_), next_ = 0;
    Image<std::uint16_t> image(width_, height_);
    for (; next_ <= i; ++next_)
      if (std::fread(image.pixels.data(), 2, image.pixels.size(), pipe_.get()) != image.pixels.size())
        refuse(file_, "depth picture " + std::to_string(next_) + " cannot be decoded", "a whole recording",
               "take those before it with --last");
    return image;
  }

 private:
  fs::path file_;
  int width_, height_;
  std::string command_;
  std::mutex mutex_;
  ProgramPipe pipe_{nullptr, ::pclose};
  int next_ = 0;
};

}  // namespace

bool is_matroska(const fs::path& source) {
  if (ending_of(source) != ".mkv") return false;
  if (!has_ffmpeg()) return true;
  const MkvJson json = probed(source, "-show_streams");
  return json.is_null() || std::ranges::any_of(json["streams"], [](const MkvJson& stream) {
           return is_grey_16(stream) || is_called_depth(stream);
         });
}

ImportedRecording read_matroska(const fs::path& source, const ImportOptions& options) {
  require_ffmpeg(source, ", or export the depth images as 16-bit PNG and import them with --from images");
  const MkvJson streams = mkv_streams(source);
  const MkvJson& track = depth_track(streams, source);
  const int width = whole_number_at(track, "/width", 0), height = whole_number_at(track, "/height", 0),
            index = whole_number_at(track, "/index", 0);
  if (width < 1 || height < 1) refuse(source, "a depth track without a size", "pictures");
  ImportedRecording recording;
  recording.name = source_name(source);
  DepthStream stream;
  stream.name = "kinect";
  stream.camera = options.camera ? read_camera_json(*options.camera).camera
                                 : kinect_camera(calibration_of(streams, source), width, height, source);
  stream.depth_scale = options.depth_scale.value_or(kinect_scale);
  stream.times = packet_times(source, index);
  stream.image_count = int(stream.times.size());
  if (stream.image_count == 0) refuse(source, "no depth picture", "a recording with depth");
  const auto frames = std::make_shared<MkvFrames>(source, index, width, height);
  stream.read = [frames](int i) { return frames->read(i); };
  recording.depth.push_back(std::move(stream));
  return recording;
}

}  // namespace pliant
