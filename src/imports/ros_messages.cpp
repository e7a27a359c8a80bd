#include "imports/ros_messages.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "imports/binary_cursor.hpp"
#include "imports/camera_json.hpp"
#include "imports/image_sequence.hpp"

namespace pliant {

namespace {

constexpr double rep_118_scale = 1000.0;  // 16UC1 is in millimetres, 32FC1 in metres

// One message. Field by field, with CDR's alignment where there is one.
class RosMessage {
 public:
  RosMessage(std::string_view bytes, const RosBag& bag, const std::string& topic)
      : cursor_(bytes, bag.file.string() + " (" + topic + ")"), is_cdr_(bag.layout == RosLayout::Cdr) {
    if (!is_cdr_) return;
    const std::string_view head = cursor_.bytes(4, "the encapsulation of a message");
    if (head[0] != 0 || (head[1] != 0 && head[1] != 1))
      cursor_.fail("an encapsulation that is not plain CDR", "CDR", "convert the bag with `ros2 bag convert`");
    cursor_.set_big_endian(head[1] == 0);
  }

  template <class Number>
  Number number(const char* what) {
    if (is_cdr_)
      if (const std::size_t over = (cursor_.position() - 4) % sizeof(Number)) cursor_.skip(sizeof(Number) - over, what);
    return cursor_.number<Number>(what);
  }
  std::string text(const char* what) {
    const auto length = number<std::uint32_t>(what);
    std::string result(cursor_.bytes(length, what));
    if (is_cdr_ && !result.empty() && result.back() == '\0') result.pop_back();
    return result;
  }
  std::string_view data(const char* what) {
    const auto length = number<std::uint32_t>(what);
    return cursor_.bytes(length, what);
  }
  std::vector<double> doubles(std::size_t count, const char* what) {
    if (count > cursor_.left()) cursor_.fail(std::string(what) + " of an absurd length", "a few numbers");
    std::vector<double> result;
    for (std::size_t i = 0; i < count; ++i) result.push_back(number<double>(what));
    return result;
  }
  /// Reads the header; the time of its stamp [s].
  double header() {
    if (!is_cdr_) (void)number<std::uint32_t>("a header");
    const auto seconds = number<std::uint32_t>("a stamp"), nanoseconds = number<std::uint32_t>("a stamp");
    (void)text("a frame id");
    return double(seconds) + 1e-9 * double(nanoseconds);
  }
  BinaryCursor& cursor() { return cursor_; }

 private:
  BinaryCursor cursor_;
  bool is_cdr_;
};

// A number of pixels.
int ros_side(RosMessage& message, const char* what) {
  const auto side = message.number<std::uint32_t>(what);
  if (side < 1 || side > largest_side)
    message.cursor().fail(what + (" of " + std::to_string(side)), "1 to " + std::to_string(largest_side) + " pixels");
  return int(side);
}

struct RosImage {
  double time = 0.0;
  int width = 0, height = 0;
  std::string encoding;
  bool is_big_endian = false;
  std::size_t step = 0;
  std::string_view data;
};

RosImage ros_image(RosMessage& message) {
  RosImage image;
  image.time = message.header();
  image.height = ros_side(message, "an image's height");
  image.width = ros_side(message, "an image's width");
  image.encoding = message.text("an image's encoding");
  image.is_big_endian = message.number<std::uint8_t>("an image's byte order") != 0;
  image.step = message.number<std::uint32_t>("an image's step");
  image.data = message.data("an image's pixels");
  return image;
}

bool is_16_bit(const std::string& encoding) { return encoding == "16UC1" || encoding == "mono16"; }

std::string lower(std::string text) {
  for (char& c : text) c = char(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

Image<std::uint16_t> decoded(const RosImage& image, const std::filesystem::path& file) {
  const std::size_t size = image.encoding == "32FC1" ? 4 : 2;
  if (image.step < size * std::size_t(image.width) || image.data.size() < image.step * std::size_t(image.height))
    refuse(file,
           "an image of " + std::to_string(image.width) + " x " + std::to_string(image.height) + " with " +
               std::to_string(image.data.size()) + " bytes",
           "all its pixels", "the bag is damaged; record or copy it again");
  Image<std::uint16_t> result(image.width, image.height);
  for (int v = 0; v < image.height; ++v) {
    BinaryCursor row(image.data.substr(image.step * std::size_t(v), size * std::size_t(image.width)), file);
    row.set_big_endian(image.is_big_endian);
    for (int u = 0; u < image.width; ++u)
      result(u, v) = size == 4 ? raw_depth(row.number<float>("a pixel")) : row.number<std::uint16_t>("a pixel");
  }
  return result;
}

const RosTopic* find_topic(const RosBag& bag, const std::string& name) {
  const auto it = std::ranges::find(bag.topics, name, &RosTopic::name);
  return it == bag.topics.end() ? nullptr : &*it;
}

// The camera info of an image topic: beside it, or where the RealSense SDK puts it.
const RosTopic& camera_info_topic(const RosBag& bag, const std::string& image) {
  std::string folder = image;
  for (int up = 0; up < 3; ++up) {
    const auto slash = folder.rfind('/');
    if (slash == std::string::npos) break;
    folder.resize(slash);
    for (const char* name : {"/camera_info", "/info/camera_info"})
      if (const RosTopic* topic = find_topic(bag, folder + name); topic && !topic->times.empty()) return *topic;
  }
  refuse(bag.file, "no camera info for " + image, "a topic of sensor_msgs/CameraInfo beside it",
         "record it too, or give the intrinsics with --camera FILE");
}

LensDistortion lens_of(const std::string& model, std::vector<double> d, const std::filesystem::path& file) {
  if (std::ranges::all_of(d, [](double c) { return c == 0.0; })) return {};
  if (!std::ranges::all_of(d, [](double c) { return std::isfinite(c); }))
    refuse(file, "a coefficient of the lens that is not finite", "a calibrated camera", "give --camera FILE");
  const std::string name = lower(model);
  const bool is_known = name == "plumb_bob" || name == "rational_polynomial" || name == "brown conrady" ||
                        name == "brown_conrady" || name == "none" || name.empty();
  if (!is_known || !LensDistortion::takes(d.size()))
    refuse(file, "the lens model \"" + model + "\" with " + std::to_string(d.size()) + " coefficients",
           "plumb_bob, rational_polynomial or Brown Conrady, or coefficients that are zero",
           "rectify the images before recording, or give intrinsics with --camera FILE");
  return LensDistortion(std::move(d));
}

PinholeCamera camera_of_info(const RosBag& bag, const std::string& image_topic) {
  const RosTopic& topic = camera_info_topic(bag, image_topic);
  const std::string bytes = topic.read(0);
  RosMessage message(bytes, bag, topic.name);
  (void)message.header();
  PinholeCamera camera;
  camera.height = ros_side(message, "a height");
  camera.width = ros_side(message, "a width");
  const std::string model = message.text("a distortion model");
  const std::size_t count = message.number<std::uint32_t>("distortion coefficients");
  std::vector<double> d = message.doubles(count, "distortion coefficients");
  const std::vector<double> K = message.doubles(9, "the matrix K");
  (void)message.doubles(9, "the matrix R");
  const std::vector<double> P = message.doubles(12, "the matrix P");
  // Rectified images are seen through P, without distortion.
  const bool is_rectified = lower(image_topic).find("rect") != std::string::npos && P[0] > 0.0;
  camera.fx = is_rectified ? P[0] : K[0], camera.fy = is_rectified ? P[5] : K[4];
  camera.cx = is_rectified ? P[2] : K[2], camera.cy = is_rectified ? P[6] : K[5];
  if (!(camera.fx > 0 && camera.fy > 0) || !std::isfinite(camera.fx + camera.fy + camera.cx + camera.cy))
    message.cursor().fail("a focal length that is not positive, or a number that is not finite", "a calibrated camera",
                          "give --camera FILE");
  if (!is_rectified) camera.lens = lens_of(model, std::move(d), message.cursor().file());
  return camera;
}

// The RealSense SDK records the unit as the sensor's option "Depth Units" [m], a std_msgs/Float32.
std::optional<double> realsense_scale(const RosBag& bag, const std::string& image_topic) {
  const auto sensor = image_topic.find("/Depth_");
  if (sensor == std::string::npos) return std::nullopt;
  for (const RosTopic& topic : bag.topics) {
    const std::string name = lower(topic.name);
    if (!topic.name.starts_with(image_topic.substr(0, sensor) + "/option/") || !name.ends_with("/value")) continue;
    if (name.find("depth units") == std::string::npos && name.find("depth_units") == std::string::npos) continue;
    if (topic.times.empty()) continue;
    const std::string bytes = topic.read(0);
    RosMessage message(bytes, bag, topic.name);
    const double unit = message.number<float>("the depth unit");
    if (!(unit > 1e-6 && unit < 0.1))
      message.cursor().fail("a depth unit of " + std::to_string(unit) + " m", "about 0.001 m", "give --depth-scale");
    return std::round(1e6 / unit) / 1e6;
  }
  return std::nullopt;
}

bool is_compressed_depth(const RosTopic& topic) {
  return topic.type == "sensor_msgs/CompressedImage" && topic.name.ends_with("/compressedDepth");
}

// Encoding of a topic's first image; of compressedDepth what stands before the semicolon.
std::string encoding_of(const RosBag& bag, const RosTopic& topic) {
  const std::string bytes = topic.read(0);
  RosMessage message(bytes, bag, topic.name);
  if (!is_compressed_depth(topic)) return ros_image(message).encoding;
  (void)message.header();
  const std::string format = message.text("an image's format");
  return format.substr(0, format.find(';'));
}

std::vector<const RosTopic*> depth_topics(const RosBag& bag, const ImportOptions& options) {
  std::vector<const RosTopic*> chosen;
  for (const std::string& name : options.topics) {
    const RosTopic* topic = find_topic(bag, name);
    if (!topic || topic->times.empty())
      refuse(bag.file, "no messages of the topic " + name, "a topic with depth images");
    chosen.push_back(topic);
  }
  if (!chosen.empty()) return chosen;
  std::string names, colourised;
  for (const RosTopic& topic : bag.topics) {
    if (topic.times.empty() || (topic.type != "sensor_msgs/Image" && !is_compressed_depth(topic))) continue;
    const bool is_named_so = lower(topic.name).find("depth") != std::string::npos;
    const std::string encoding = encoding_of(bag, topic);
    if ((is_16_bit(encoding) || encoding == "32FC1") && (is_named_so || encoding != "mono16")) {
      chosen.push_back(&topic);
      names += (names.empty() ? "" : ", ") + topic.name;
    } else if (is_named_so) {
      colourised = encoding;
    }
  }
  if (chosen.empty() && !colourised.empty()) refuse_colourised(bag.file, "encoding " + colourised);
  if (chosen.empty())
    refuse(bag.file, "no topic with depth images", "sensor_msgs/Image in 16UC1, mono16 or 32FC1",
           "record the depth topic, such as /camera/depth/image_rect_raw");
  if (chosen.size() > 1)
    refuse(bag.file, "several topics with depth images: " + names, "one for each sensor",
           "say which with --topic, once for each sensor");
  return chosen;
}

// The first part of a topic's name; with a number where there are several sensors.
std::string sensor_name(const std::string& topic, std::size_t index, std::size_t count) {
  std::string name = topic.substr(std::min<std::size_t>(1, topic.size()));
  name = name.substr(0, name.find('/'));
  if (name.empty()) name = "camera";
  return count > 1 ? name + "_" + std::to_string(index) : name;
}

DepthStream stream_of_topic(const RosBag& bag, const RosTopic& topic, const ImportOptions& options) {
  const std::string encoding = encoding_of(bag, topic);
  const std::filesystem::path place = bag.file.string() + " (" + topic.name + ")";
  if (!is_16_bit(encoding) && encoding != "32FC1") refuse_colourised(place, "encoding " + encoding);
  const bool is_compressed = is_compressed_depth(topic);
  if (is_compressed && encoding == "32FC1")
    refuse(place, "compressedDepth of 32FC1", "16UC1, or images that are not compressed",
           "republish it with image_transport as raw");
  DepthStream stream;
  stream.camera = options.camera ? read_camera_json(*options.camera).camera : camera_of_info(bag, topic.name);
  if (encoding == "32FC1")
    stream.depth_scale = units_of_metres;
  else if (options.depth_scale)
    stream.depth_scale = *options.depth_scale;
  else if (const auto scale = realsense_scale(bag, topic.name))
    stream.depth_scale = *scale;
  else if (encoding == "16UC1")
    stream.depth_scale = rep_118_scale;
  else
    ask_for_scale(place, "encoding " + encoding + " says none");
  stream.image_count = int(topic.times.size());
  for (int i = 0; i < stream.image_count; ++i) {
    const std::string bytes = topic.read(i);
    RosMessage message(bytes, bag, topic.name);
    stream.times.push_back(message.header());
  }
  const auto has_stamps = std::ranges::any_of(stream.times, [](double t) { return t > 0.0; });
  if (!has_stamps) stream.times = topic.times;
  stream.read = [topic, layout = bag.layout, file = bag.file, place, is_compressed, encoding,
                 camera = stream.camera](int i) {
    const RosBag own{file, layout, {}};
    const std::string bytes = topic.read(i);
    RosMessage message(bytes, own, topic.name);
    if (is_compressed) {
      (void)message.header();
      (void)message.text("an image's format");
      constexpr std::size_t configuration = 12;  // of image_transport's plugin, before the PNG
      const std::string_view data = message.data("an image");
      if (data.size() <= configuration) refuse(place, "an empty image", "a PNG");
      return decode_depth_image(std::string(data.substr(configuration)), place);
    }
    const RosImage image = ros_image(message);
    if (image.encoding != encoding)
      refuse(place, "image " + std::to_string(i) + " has the encoding " + image.encoding, encoding + ", as the first");
    if (image.width != camera.width || image.height != camera.height)
      refuse(place, "an image of " + std::to_string(image.width) + " x " + std::to_string(image.height) + " pixels",
             std::to_string(camera.width) + " x " + std::to_string(camera.height) + ", as the camera info says");
    return decoded(image, place);
  };
  return stream;
}

}  // namespace

ImportedRecording recording_of_bag(const RosBag& bag, const ImportOptions& options) {
  ImportedRecording recording;
  recording.name = source_name(bag.file);
  const std::vector<const RosTopic*> topics = depth_topics(bag, options);
  for (std::size_t i = 0; i < topics.size(); ++i) {
    DepthStream stream = stream_of_topic(bag, *topics[i], options);
    stream.name = sensor_name(topics[i]->name, i, topics.size());
    recording.depth.push_back(std::move(stream));
  }
  if (topics.size() > 1)
    recording.notes.push_back(
        "where the sensors stand is not read from the bag: give each its `camera_to_world`, or "
        "find them with `pliant calibrate`");
  return recording;
}

}  // namespace pliant
