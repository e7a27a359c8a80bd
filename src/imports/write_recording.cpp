#include "imports/write_recording.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "base/files.hpp"
#include "base/median.hpp"
#include "capture/camera_poses.hpp"
#include "capture/capture_rules.hpp"
#include "capture/curves.hpp"
#include "capture/frame_numbers.hpp"
#include "capture/markers.hpp"
#include "geometry/solid_surface.hpp"
#include "imports/first_loading.hpp"
#include "imports/mask_overview.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

constexpr double standard_gravity = 9.81;  // [m/s^2]
constexpr double still_shift = 2e-3;       // [m] a camera that moves no farther, and turns no farther, stands
constexpr double still_turn = 0.2;         // [degrees]
constexpr double exact_clock = 1e-4;       // [s] offsets below are none
constexpr double small_mask = 0.25;        // of the usual pixels
constexpr std::size_t shown_masks = 12;    // in the overview
constexpr int shown_columns = 4;
constexpr int shown_width = 480;  // [pixels]
constexpr const char* overview_name = "masks_overview.png";

std::string written(const char* format, auto... values) {
  char text[256];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

// Which images become frames, and when they were taken.
struct Frames {
  std::vector<int> images;    // of the first sensor
  std::vector<double> times;  // [s] from the first; as many
  double rate = 0.0;          // [Hz] of even frames; 0: times say all
};

Frames chosen_frames(const ImageStream& stream, const CaptureFacts& facts, const std::string& name,
                     std::vector<std::string>& notes) {
  if (stream.times.empty() && !(stream.frame_rate > 0.0))
    refuse(name, "images without times", "times, or a frame rate", "give --rate, frames a second");
  const int last = facts.last.value_or(stream.image_count - 1);
  if (facts.first < 0 || facts.every < 1 || last >= stream.image_count || facts.first > last)
    refuse(name, "images " + std::to_string(facts.first) + " to " + std::to_string(last) + " are asked for",
           "images from 0 to " + std::to_string(stream.image_count - 1), "correct --first, --last and --every");
  Frames frames;
  const std::vector<int> periods = stream.times.empty() ? periods_of(stream.numbers) : std::vector<int>();
  const bool has_gaps = !periods.empty() && periods.back() >= stream.image_count;
  if (has_gaps) notes.push_back(note_of_gaps(periods, "the numbers in the images' names"));
  if (stream.times.empty() && periods.empty() && !stream.numbers.empty())
    notes.push_back(
        "the numbers in the images' names do not grow evenly: images are taken to be evenly spaced in time");
  int late = 0;
  for (int i = facts.first; i <= last; i += facts.every) {
    if (!stream.times.empty()) {
      const double time = stream.times[std::size_t(i)] - stream.times[std::size_t(facts.first)];
      if (!std::isfinite(time)) refuse(name, "a time that is not finite", "seconds");
      if (!frames.times.empty() && !(time > frames.times.back())) {
        ++late;
        continue;
      }
      frames.times.push_back(time);
    } else if (has_gaps) {
      frames.times.push_back((periods[std::size_t(i)] - periods[std::size_t(facts.first)]) / stream.frame_rate);
    } else {
      frames.times.push_back(double(frames.images.size()) * facts.every / stream.frame_rate);
    }
    frames.images.push_back(i);
  }
  if (late > 0)
    notes.push_back(written("%d images are left out: their time is not after that of the image before", late));
  if (stream.times.empty() && !has_gaps) frames.rate = stream.frame_rate / facts.every;
  return frames;
}

// Images of another sensor for the same frames: the nearest in time, and how much later they are.
std::vector<int> matched_images(const ImageStream& stream, const ImageStream& first, const Frames& frames,
                                const std::string& name, double& offset, std::vector<std::string>& notes) {
  offset = 0.0;
  if (stream.times.empty() || first.times.empty()) {
    if (stream.image_count != first.image_count)
      refuse(name,
             "sensors with " + std::to_string(first.image_count) + " and " + std::to_string(stream.image_count) +
                 " images, and no times",
             "as many images of each", "import one sensor by name");
    return frames.images;
  }
  std::vector<int> images;
  std::vector<double> delays;
  for (const int frame : frames.images) {
    const double time = first.times[std::size_t(frame)];
    const auto nearest = std::ranges::min_element(
        stream.times, [&](double a, double b) { return std::abs(a - time) < std::abs(b - time); });
    images.push_back(int(nearest - stream.times.begin()));
    delays.push_back(*nearest - time);
  }
  const double delay_of_most = median(delays);
  if (std::abs(delay_of_most) > 1.0)
    refuse(name,
           written("sensor \"%s\" is %.3f s beside \"%s\"", stream.name.c_str(), delay_of_most, first.name.c_str()),
           "sensors that recorded at the same time", "import them one by one");
  if (std::abs(delay_of_most) > exact_clock) offset = delay_of_most;
  double spread = 0.0;
  for (const double delay : delays) spread = std::max(spread, std::abs(delay - offset));
  if (spread > 1e-3)
    notes.push_back(written("images of \"%s\" are up to %.1f ms beside the time that the capture gives them",
                            stream.name.c_str(), 1e3 * spread));
  return images;
}

bool stands(const std::vector<RigidMotion>& poses, const std::vector<int>& images) {
  const RigidMotion& first = poses[std::size_t(images.front())];
  return std::ranges::all_of(images, [&](int i) {
    const RigidMotion& pose = poses[std::size_t(i)];
    const double turn = Eigen::AngleAxisd(Matrix3(pose.rotation * first.rotation.transpose())).angle();
    return (pose.translation - first.translation).norm() <= still_shift &&
           turn * 180.0 / std::numbers::pi <= still_turn;
  });
}

std::string folder_name(std::string name) {
  for (char& c : name)
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '_' && c != '-') c = '_';
  return name.empty() ? "camera" : name;
}

std::string image_name(const fs::path& folder, std::size_t frame) {
  return (folder / written("%06zu.png", frame)).string();
}

template <class Pixel>
void require_size(const fs::path& folder, const ImageStream& stream, int i, const Image<Pixel>& image) {
  if (image.width != stream.camera.width || image.height != stream.camera.height)
    refuse(folder, written("image %d has %d x %d pixels", i, image.width, image.height),
           written("%d x %d, the camera's size", stream.camera.width, stream.camera.height));
}

void write_images(const fs::path& folder, const DepthStream& stream, const std::vector<int>& images,
                  std::vector<std::string>& notes, const std::function<void()>& written_one) {
  make_folder(folder);
  Image<std::uint16_t> before;
  std::vector<int> repeated;
  for (std::size_t k = 0; k < images.size(); ++k) {
    Image<std::uint16_t> image = stream.read(images[k]);
    require_size(folder, stream, images[k], image);
    write_png(image_name(folder, k), image);
    if (image.pixels == before.pixels) repeated.push_back(int(k));
    before = std::move(image);
    written_one();
  }
  if (!repeated.empty())
    notes.push_back("frames that repeat the one before, to the last bit: " + ranges_text(repeated) +
                    "; a recorder that delivers an image twice has the second one's time wrong");
}

// Masks that show much less of the object than usual, where it may have been lost.
void note_small_masks(const std::vector<int>& sizes, std::vector<std::string>& notes) {
  const auto is_small = [usual = median(sizes)](int size) { return size < small_mask * usual; };
  if (const auto first = std::ranges::find_if(sizes, is_small); first != sizes.end())
    notes.push_back(
        written("%d masks have less than a quarter of the usual pixels, the first that of frame %d: look at %s; an "
                "object that stays "
                "where it is needs a --background without it",
                int(std::ranges::count_if(sizes, is_small)), int(first - sizes.begin()), overview_name));
}

void write_masks(const fs::path& out, const std::string& name, const MaskStream& stream, const std::vector<int>& images,
                 std::vector<std::string>& notes, const std::function<void()>& written_one) {
  make_folder(out / name);
  std::vector<Image<Rgb>> shown;
  std::vector<int> sizes;
  for (std::size_t k = 0; k < images.size(); ++k) {
    const Image<std::uint8_t> mask = stream.read(images[k]);
    require_size(out / name, stream, images[k], mask);
    write_png(image_name(out / name, k), mask);
    sizes.push_back(int(std::ranges::count_if(mask.pixels, [](std::uint8_t m) { return m != 0; })));
    const std::size_t wanted = std::min<std::size_t>(shown_masks, images.size());
    if (k == shown.size() * (images.size() - 1) / std::max<std::size_t>(1, wanted - 1))
      shown.push_back(outlined(stream.picture(images[k]), mask, shown_width));
    written_one();
  }
  write_png(out / overview_name, side_by_side(shown, shown_columns));
  note_small_masks(sizes, notes);
}

// What the images of all sensors have in common with a capture's cameras.
void fill_camera(const fs::path& out, const ImageStream& stream, const std::vector<int>& images,
                 RecordingCamera& camera) {
  camera.name = folder_name(stream.name);
  camera.camera = stream.camera;
  if (stream.poses.empty()) return;
  camera.camera.camera_to_world = stream.poses[std::size_t(images.front())];
  if (stands(stream.poses, images)) return;
  for (const int image : images) camera.moved.push_back(stream.poses[std::size_t(image)]);
  camera.poses = out / camera.name / "poses.csv";
  make_folder(out / camera.name);
  write_camera_poses(*camera.poses, camera.moved);
}

Frames take_frames(const ImageStream& first, const ImportedRecording& recording, const CaptureFacts& facts,
                   ImportedCapture& result) {
  Frames frames = chosen_frames(first, facts, recording.name, result.notes);
  result.capture.scene.timing.times = frames.times;
  result.capture.scene.timing.frame_rate = frames.rate;
  return frames;
}

void write_depth(const fs::path& out, const ImportedRecording& recording, const CaptureFacts& facts,
                 ImportedCapture& result, const std::function<void(int, int)>& progress) {
  const DepthStream& first = recording.depth.front();
  const Frames frames = take_frames(first, recording, facts, result);
  const int total = int(frames.images.size() * recording.depth.size());
  int done = 0;
  for (const DepthStream& stream : recording.depth) {
    DepthCamera camera;
    const std::vector<int> images =
        &stream == &first ? frames.images
                          : matched_images(stream, first, frames, recording.name, camera.time_offset, result.notes);
    fill_camera(out, stream, images, camera);
    camera.depth_scale = stream.depth_scale;
    camera.images = {camera.name + "/%06d.png"};
    write_images(out / camera.name, stream, images, result.notes, [&] {
      if (progress) progress(++done, total);
    });
    result.capture.depth.push_back(std::move(camera));
  }
}

void write_silhouettes(const fs::path& out, const ImportedRecording& recording, const CaptureFacts& facts,
                       ImportedCapture& result, const std::function<void(int, int)>& progress) {
  const MaskStream& stream = *recording.masks;
  const Frames frames = take_frames(stream, recording, facts, result);
  SilhouetteCamera camera;
  fill_camera(out, stream, frames.images, camera);
  camera.masks = {camera.name + "/%06d.png"};
  int done = 0;
  write_masks(out, camera.name, stream, frames.images, result.notes, [&] {
    if (progress) progress(++done, int(frames.images.size()));
  });
  result.capture.silhouettes.push_back(std::move(camera));
}

// Where the top of the first image points, in world coordinates.
Vector3 picture_top(const ImportedRecording& recording) {
  if (recording.depth.empty() && !recording.masks) return Vector3::UnitY();
  const ImageStream& first =
      recording.masks ? static_cast<const ImageStream&>(*recording.masks) : recording.depth.front();
  return -(first.poses.empty() ? first.camera.camera_to_world : first.poses.front()).rotation.col(1).normalized();
}

void write_facts(const fs::path& out, const ImportedRecording& recording, const CaptureFacts& facts,
                 ImportedCapture& result, std::string& comment) {
  Scene& scene = result.capture.scene;
  if (facts.mass && facts.density)
    refuse(recording.name, "both a mass and a density", "one of the two", "keep what was measured");
  scene.object.mass = facts.mass, scene.object.density = facts.density;
  if (facts.surface) {
    scene.object.surface = read_surface(*facts.surface);
    scene.object.file = out / ("rest" + facts.surface->extension().string());
    write_file(scene.object.file, read_file(*facts.surface));
  } else if (!recording.test) {
    comment += "\n# Still to say: `surface`, the object at rest in world coordinates";
  }
  if (recording.masks && recording.masks->camera.camera_to_world == RigidMotion())
    comment +=
        "\n# Still to say: `camera_to_world`, where the camera stands against the scan; as it is the world has its "
        "axes: x to the "
        "right of the picture, y down, z forward";
  if (!facts.mass && !facts.density && !recording.test)
    comment += "\n# Still to say: `mass` [kg] or `density` [kg/m^3]";
  if (facts.up) {
    scene.world.up = facts.up->normalized();
    scene.world.gravity = -standard_gravity * scene.world.up;
  } else if (recording.gravity) {
    scene.world.gravity = *recording.gravity;
    scene.world.up = -recording.gravity->normalized();
  } else if (!recording.test) {
    scene.world.up = picture_top(recording);
    const std::string guess = recording.depth.empty() && !recording.masks ? "y" : "the top of the first image";
    comment += "\n# A guess: `up` is " + guess + "; give `gravity` where it is known";
    result.notes.push_back("nobody said which way is up: taken is " + guess + " (--up X,Y,Z says otherwise)");
  }
  if (!recording.test)
    comment +=
        "\n# Still to say: `start_frame`, the first frame in which the object moves freely, and what it may touch"
        " ([[plane]]) or is held by ([[fixed]])";
}

void write_markers(const fs::path& out, const ImportedRecording& recording, const CaptureFacts& facts,
                   ImportedCapture& result) {
  const C3dTrajectories& all = *recording.markers;
  if (!all.frame_rate)
    refuse(recording.name, "markers without a frame rate", "a frame rate", "give --rate, frames a second");
  const int count = int(all.frames.size()), last = facts.last.value_or(count - 1);
  if (facts.first < 0 || facts.every < 1 || last >= count || facts.first > last)
    refuse(recording.name, written("frames %d to %d are asked for, and the file has %d", facts.first, last, count),
           "frames that there are", "correct --first, --last and --every");
  std::vector<std::string> ids;
  std::vector<Eigen::Index> rows;
  int hidden = 0;
  const Points& start = all.frames[std::size_t(facts.first)];
  for (Eigen::Index i = 0; i < start.rows(); ++i) {
    if (!start.row(i).allFinite()) {
      ++hidden;
      continue;
    }
    std::string id = all.labels[std::size_t(i)];
    for (char& c : id)
      if (c == ',' || c == '"' || c == '\n' || c == '\r') c = '_';
    if (id.empty()) id = "marker" + std::to_string(i + 1);
    while (std::ranges::find(ids, id) != ids.end()) id += "_" + std::to_string(i + 1);
    ids.push_back(id);
    rows.push_back(i);
  }
  if (ids.empty())
    refuse(recording.name, written("no marker is seen in frame %d", facts.first), "markers at rest",
           "begin with --first where all are seen and the object is at rest");
  if (hidden > 0)
    result.notes.push_back(
        written("%d markers are left out: they are not seen in frame %d, which gives their places at "
                "rest",
                hidden, facts.first));
  const auto chosen = [&](const Points& frame) {
    Points points(Eigen::Index(rows.size()), 3);
    for (std::size_t k = 0; k < rows.size(); ++k) points.row(Eigen::Index(k)) = frame.row(rows[k]);
    return points;
  };
  std::vector<Points> frames;
  for (int i = facts.first; i <= last; i += facts.every) frames.push_back(chosen(all.frames[std::size_t(i)]));
  result.capture.scene.timing = evenly_timed(*all.frame_rate / facts.every, int(frames.size()));
  const MarkerTrack track{out / "markers_rest.csv", out / "markers.csv"};
  write_marker_positions(track.rest, {ids, chosen(start)});
  write_marker_track(track.track, ids, frames);
  result.capture.markers.push_back(track);
}

LoadingOptions loading_options(const CaptureFacts& facts) {
  LoadingOptions options;
  for (const std::string& what : facts.kept) {
    if (what == "force-zero")
      options.keeps_force_zero = true;
    else if (what == "extension-zero")
      options.keeps_extension_zero = true;
    else if (what == "break")
      options.keeps_break = true;
    else
      refuse({}, "--keep " + what, "force-zero, extension-zero or break");
  }
  return options;
}

void write_indentation(const fs::path& out, const ImportedRecording& recording, const CaptureFacts& facts,
                       ImportedCapture& result) {
  const MachineTest& test = *recording.test;
  if (!facts.contact || !facts.surface)
    refuse(recording.name, "an indenter without a place", "--surface and --contact X,Y,Z",
           "say which point of the scan it touches first");
  if (test.extensions.empty() || test.forces.empty())
    refuse(recording.name, "no column of an extension and a force", "both", "export them too");
  LoadingOptions options = loading_options(facts);
  options.is_indentation = true;
  options.power = *facts.probe == IndenterShape::Ball ? 1.5 : 1.0;
  options.force_std = facts.force_std.value_or(0.0), options.force_resolution = test.force_resolution;
  const LoadingCurve loading = first_loading(test.extensions, test.forces, options, recording.name);
  Indentation indentation;
  indentation.name = test.name;
  indentation.probe = *facts.probe;
  indentation.radius = facts.probe_radius;
  indentation.contact = *facts.contact;
  indentation.direction = -facts.up.value_or(Vector3::UnitY()).normalized();
  indentation.contact_std = loading.zero_std;
  indentation.curve = out / "curve.csv";
  write_force_curve(indentation.curve, {loading.extensions, loading.forces, loading.stds});
  result.capture.indentations.push_back(indentation);
  result.notes.insert(result.notes.end(), loading.notes.begin(), loading.notes.end());
}

// Whether what a machine calls positive pulls (1) or compresses (-1) the specimen.
double pulling_sign(const LoadingCurve& loading, const CaptureFacts& facts, const std::string& name,
                    std::vector<std::string>& notes) {
  if (facts.is_compression || facts.is_tension) return facts.is_compression ? -1.0 : 1.0;
  if (loading.extension_sign != loading.force_sign)
    refuse(name, "an extension and a force of opposite signs", "a specimen that is pulled, or one that is compressed",
           "say which: --tension or --compression");
  if (loading.force_sign > 0.0)
    notes.emplace_back("positive numbers pull the specimen (--compression, where they do not)");
  else
    notes.emplace_back("negative numbers compress the specimen (--tension, where they do not)");
  return loading.force_sign;
}

void write_material_curve(const fs::path& out, const ImportedRecording& recording, const CaptureFacts& facts,
                          ImportedCapture& result) {
  const MachineTest& test = *recording.test;
  const bool takes_forces = facts.area && !test.forces.empty() && (facts.length || !test.strains.empty());
  const bool has_stresses = !takes_forces && !test.stresses.empty();
  const bool takes_extensions = facts.length && !test.extensions.empty() && (takes_forces || test.strains.empty());
  if (!(takes_forces || has_stresses) || !(takes_extensions || !test.strains.empty()))
    refuse(recording.name, "a specimen of unknown size", "its length between the grips and its cross section",
           "give --length METRES and --area SQUARE_METRES at rest; of an indenter --ball or --punch RADIUS");
  const double length = takes_extensions ? *facts.length : 1.0, area = takes_forces ? *facts.area : 1.0;
  LoadingOptions options = loading_options(facts);
  if (facts.force_std && !facts.area)
    refuse(recording.name, "the standard deviation of a force, and stresses",
           "--area, over which it is one of a stress");
  options.force_std = facts.force_std.value_or(0.0) / (takes_forces ? 1.0 : facts.area.value_or(1.0));
  options.force_resolution = takes_forces ? test.force_resolution : test.stress_resolution;
  if (!takes_extensions) options.extension = {"%", 100.0};
  if (!takes_forces) options.force = {"kPa", 1e-3};
  const LoadingCurve loading = first_loading(takes_extensions ? test.extensions : test.strains,
                                             takes_forces ? test.forces : test.stresses, options, recording.name);
  result.notes.insert(result.notes.end(), loading.notes.begin(), loading.notes.end());
  const double sign = pulling_sign(loading, facts, recording.name, result.notes);
  MaterialCurve material;
  material.name = test.name;
  material.curve = out / "curve.csv";
  StressCurve curve;
  for (std::size_t i = 0; i < loading.forces.size(); ++i) {
    curve.stretches.push_back(1.0 + sign * loading.extensions[i] / length);
    curve.stresses.push_back(sign * loading.forces[i] / area);
    curve.stds.push_back(loading.stds[i] / area);
  }
  if (*std::ranges::min_element(curve.stretches) <= 0.0)
    refuse(recording.name, "a specimen that is compressed by more than its length", "--length in metres");
  write_stress_curve(material.curve, curve);
  result.capture.material_curves.push_back(material);
}

void write_test(const fs::path& out, const ImportedRecording& recording, const CaptureFacts& facts,
                ImportedCapture& result) {
  if (facts.probe)
    write_indentation(out, recording, facts, result);
  else
    write_material_curve(out, recording, facts, result);
}

}  // namespace

ImportedCapture write_recording(const fs::path& out, const ImportedRecording& recording, const CaptureFacts& facts,
                                const std::function<void(int, int)>& progress) {
  const fs::path folder = (fs::absolute(out) / "").lexically_normal().parent_path();
  if (is_file(folder / "capture.toml"))
    refuse(folder / "capture.toml", "a capture that is there already", "a folder without one",
           "choose another folder, or remove the old capture first");
  ImportedCapture result;
  result.notes = recording.notes;
  result.capture.name = recording.name;
  std::string comment = "made by pliant import";
  make_folder(folder);
  write_facts(folder, recording, facts, result, comment);
  if (!recording.depth.empty()) write_depth(folder, recording, facts, result, progress);
  if (recording.masks) write_silhouettes(folder, recording, facts, result, progress);
  if (recording.markers) write_markers(folder, recording, facts, result);
  if (recording.test) write_test(folder, recording, facts, result);
  write_capture(folder, result.capture, comment);
  return result;
}

}  // namespace pliant
