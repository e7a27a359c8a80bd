// Plain videos of an object before a background that its colour is told from: masks. The programs ffprobe and ffmpeg
// take the file apart.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <nlohmann/json.hpp>

#include "base/files.hpp"
#include "capture/new_capture.hpp"
#include "imports/background_subtraction.hpp"
#include "imports/camera_json.hpp"
#include "imports/ffmpeg.hpp"
#include "imports/formats.hpp"
#include "imports/image_sequence.hpp"
#include "imports/json_values.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

using VideoJson = nlohmann::json;

constexpr std::array video_endings = {".3gp", ".avi",  ".m4v", ".mkv", ".mov",  ".mp4",
                                      ".mpg", ".mpeg", ".mts", ".ogv", ".webm", ".wmv"};
constexpr int background_samples = 25;
constexpr double even_time = 6e-4;  // [s] that times may be off an even rate: Matroska has whole milliseconds
constexpr double same_rate = 0.01;  // rates that differ by less are the same

// Pictures of a video one after the other, upright as ffmpeg turns them; going back begins anew.
class VideoPictures {
 public:
  VideoPictures(const fs::path& file, int track)
      : file_(file),
        command_("ffmpeg -v quiet -i " + ffmpeg_argument(file) + " -map 0:" + std::to_string(track) +
                 " -fps_mode passthrough -f image2pipe -c:v ppm -pix_fmt rgb24 - 2>/dev/null </dev/null") {}

  const Image<Rgb>& read(int i) {
    if (!pipe_ || i < last_) pipe_ = open_pipe(command_), last_ = -1;
    while (last_ < i) take_next();
    return picture_;
  }

 private:
  void take_next() {
    int width = 0, height = 0;
    const bool has_header = std::fscanf(pipe_.get(), "P6 %d %d 255", &width, &height) == 2 && width > 0 && height > 0;
    if (has_header) (void)std::fgetc(pipe_.get());
    if (has_header && (picture_.width != width || picture_.height != height)) picture_ = Image<Rgb>(width, height);
    if (!has_header ||
        std::fread(picture_.pixels.data(), sizeof(Rgb), picture_.pixels.size(), pipe_.get()) != picture_.pixels.size())
      refuse(file_, "image " + std::to_string(last_ + 1) + " cannot be decoded",
             "a whole video, and ffmpeg of version 5.1 or later",
             last_ < 0 ? "play it; convert it with another program where that works"
                       : "take those before it with --last " + std::to_string(last_));
    ++last_;
  }

  fs::path file_;
  std::string command_;
  ProgramPipe pipe_{nullptr, ::pclose};
  Image<Rgb> picture_;
  int last_ = -1;
};

bool is_film(const VideoJson& stream) {
  return text_at(stream, "/codec_type") == "video" && whole_number_at(stream, "/disposition/attached_pic", 0) == 0;
}

int film_track(const VideoJson& json, const fs::path& file) {
  for (const VideoJson& stream : json["streams"])
    if (is_film(stream)) return whole_number_at(stream, "/index", 0);
  refuse(file, "no pictures in it", "a video", "");
}

double ratio_of(const std::string& text) {
  double above = 0.0, below = 0.0;
  return std::sscanf(text.c_str(), "%lf/%lf", &above, &below) == 2 && below > 0.0 ? above / below : 0.0;
}

// Of each picture in the order in which they are shown; not a number where the file does not tell.
std::vector<double> picture_times(const fs::path& file, int track) {
  const VideoJson json = probed(file, "-select_streams " + std::to_string(track) +
                                          " -show_entries stream=index:frame=best_effort_timestamp_time");
  std::vector<double> times;
  for (const VideoJson& frame : value_at(json, "/frames")) {
    const std::string text = text_at(frame, "/best_effort_timestamp_time");
    char* end = nullptr;
    const double time = std::strtod(text.c_str(), &end);
    times.push_back(end != text.c_str() ? time : not_a_number);
  }
  return times;
}

bool are_even(const std::vector<double>& times, double rate) {
  for (std::size_t i = 0; i < times.size(); ++i)
    if (std::abs(times[i] - times.front() - double(i) / rate) > even_time) return false;
  return true;
}

// Times of the pictures, or their rate where that says as much.
void take_times(const VideoJson& json, const fs::path& file, int track, MaskStream& stream,
                std::vector<std::string>& notes) {
  std::vector<double> times = picture_times(file, track);
  stream.image_count = int(times.size());
  if (times.empty())
    refuse(file, "a video of which no picture can be decoded", "pictures", "the file may be cut short; copy it again");
  std::string rate;
  for (const VideoJson& candidate : json["streams"])
    if (whole_number_at(candidate, "/index", -1) == track) rate = text_at(candidate, "/avg_frame_rate");
  stream.frame_rate = ratio_of(rate);
  const bool knows_times = std::ranges::all_of(times, [](double time) { return std::isfinite(time); });
  if (knows_times && !(stream.frame_rate > 0.0 && are_even(times, stream.frame_rate))) stream.times = std::move(times);
  const double recorded = std::atof(text_at(json, "/format/tags/com.android.capture.fps").c_str());
  if (recorded > 0.0 && std::abs(recorded / stream.frame_rate - 1.0) > same_rate)
    notes.push_back("slow motion: " + std::to_string(std::lround(recorded)) +
                    " images a second were recorded, and the video plays " +
                    std::to_string(std::lround(stream.frame_rate)) +
                    "; give --rate where its times are not the motion's");
}

PinholeCamera video_camera(const fs::path& source, const ImportOptions& options, const Image<Rgb>& picture) {
  PinholeCamera camera;
  if (options.camera) {
    camera = read_camera_json(*options.camera).camera;
    if (camera.width != picture.width || camera.height != picture.height)
      refuse(*options.camera,
             "a camera of " + std::to_string(camera.width) + " x " + std::to_string(camera.height) + " pixels",
             std::to_string(picture.width) + " x " + std::to_string(picture.height) +
                 ", the size of upright pictures of " + source.filename().string(),
             "use the intrinsics of this resolution");
    return camera;
  }
  if (!options.fx && !options.field_of_view_deg)
    refuse(source, "a camera of unknown focal length",
           "--fov DEGREES of the picture's width, --fx PIXELS or --camera FILE",
           "film a ruler: fx is its length in pixels times its distance over its length");
  camera.width = picture.width, camera.height = picture.height;
  camera.fx = camera.fy = options.fx ? *options.fx : focal_length(*options.field_of_view_deg, picture.width);
  camera.cx = 0.5 * (picture.width - 1), camera.cy = 0.5 * (picture.height - 1);
  return camera;
}

BackgroundChoice background_choice(const ImportOptions& options, const Image<Rgb>& picture) {
  BackgroundChoice choice;
  choice.threshold = options.threshold;
  if (options.background == "plain") {
    choice.kind = BackgroundKind::Plain;
  } else if (options.background == "still") {
    choice.kind = BackgroundKind::Still;
  } else if (!options.background.empty()) {
    choice.kind = BackgroundKind::Given;
    const VideoJson json = probed(options.background, "-show_streams");
    if (!is_file(options.background) || json.is_null())
      refuse(options.background, "a background that is no picture",
             "a picture or video of the scene without the object", "or --background plain, or still");
    choice.empty = VideoPictures(options.background, film_track(json, options.background)).read(0);
    if (choice.empty.width != picture.width || choice.empty.height != picture.height)
      refuse(options.background,
             "a background of " + std::to_string(choice.empty.width) + " x " + std::to_string(choice.empty.height) +
                 " pixels",
             std::to_string(picture.width) + " x " + std::to_string(picture.height) + ", those of the video",
             "take it with the same camera from the same place");
  }
  return choice;
}

const char* words_of(BackgroundKind kind) {
  switch (kind) {
    case BackgroundKind::Plain:
      return "plain, in the colour of the pictures' border (--background plain)";
    case BackgroundKind::Still:
      return "what each pixel shows in most images (--background still)";
    case BackgroundKind::Given:
      break;
  }
  return "the given picture";
}

constexpr const char* background_advice =
    "take a background of one colour that the object does not have, in even light, or give a picture of the scene "
    "without "
    "the object (--background FILE), or the difference that counts (--threshold LEVELS)";

std::shared_ptr<BackgroundSubtraction> background_of(const fs::path& source, const ImportOptions& options,
                                                     VideoPictures& pictures, int count,
                                                     std::vector<std::string>& notes) {
  const BackgroundChoice choice = background_choice(options, pictures.read(0));
  std::vector<Image<Rgb>> samples;
  const int last = std::min(count, background_samples) - 1;
  for (int k = 0; k <= last; ++k)
    samples.push_back(pictures.read(last == 0 ? 0 : int(std::int64_t(k) * (count - 1) / last)));
  auto result = std::make_shared<BackgroundSubtraction>(std::move(samples), choice);
  const std::string levels = std::to_string(std::lround(result->contrast())) + " of 255 levels";
  if (!options.threshold && !result->tells_object())
    refuse(source, "the object is not told from the background: what differs most does so by " + levels,
           "an object of another colour than what is behind it", background_advice);
  notes.push_back(std::string("background: ") + words_of(result->kind()));
  notes.push_back("the object differs from it by " + levels + ", and what does so by more than " +
                  std::to_string(std::lround(result->threshold())) + " is taken for it (--threshold)");
  return result;
}

}  // namespace

bool is_video(const fs::path& source) {
  return is_file(source) && std::ranges::find(video_endings, ending_of(source)) != video_endings.end();
}

ImportedRecording read_video(const fs::path& source, const ImportOptions& options) {
  require_ffmpeg(source, ", or cut the object out with another program and describe the masks as [[silhouette]]");
  const VideoJson json = probed(source, "-show_streams -show_format");
  if (json.is_null())
    refuse(source, "ffprobe finds no pictures in it", "a video that ffmpeg reads",
           "the file may be cut short; copy it again");
  const int track = film_track(json, source);
  ImportedRecording recording;
  recording.name = source_name(source);
  MaskStream stream;
  const auto pictures = std::make_shared<VideoPictures>(source, track);
  stream.camera = video_camera(source, options, pictures->read(0));
  take_times(json, source, track, stream, recording.notes);
  const auto background = background_of(source, options, *pictures, stream.image_count, recording.notes);
  stream.picture = [pictures](int i) { return pictures->read(i); };
  stream.read = [source, pictures, background](int i) {
    Image<std::uint8_t> mask = background->mask(pictures->read(i));
    if (const std::string doubt = doubt_about(mask); !doubt.empty())
      refuse(source, "image " + std::to_string(i) + ": " + doubt, "an object before a background",
             std::string("leave such images out (--first, --last), or ") + background_advice);
    return mask;
  };
  recording.masks = std::move(stream);
  return recording;
}

}  // namespace pliant
