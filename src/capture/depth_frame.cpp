#include "capture/depth_frame.hpp"

#include <algorithm>
#include <string>

namespace pliant {

namespace {

constexpr std::uint16_t greatest_raw = 65535;  // no reading, as some recorders write it

template <class Pixel>
Image<Pixel> of_size(Image<Pixel> image, const RecordingCamera& recording, const std::filesystem::path& path) {
  const PinholeCamera& camera = recording.camera;
  if (image.width == camera.width && image.height == camera.height) return image;
  const auto text = [](int w, int h) { return std::to_string(w) + " x " + std::to_string(h) + " pixels"; };
  throw InputError(Problem{{path},
                           text(image.width, image.height),
                           text(camera.width, camera.height) + " as camera \"" + recording.name + "\" has",
                           ""});
}

}  // namespace

std::uint16_t range_limit(const Image<std::uint16_t>& raw) {
  constexpr double least_share = 0.01, farthest = 0.5;  // of the pixels; of the limit, what else is read
  constexpr int least_limit = 2047;
  std::uint16_t limit = 0, below = 0;
  for (const std::uint16_t r : raw.pixels)
    if (r != greatest_raw) limit = std::max(limit, r);
  std::size_t at_limit = 0, nearer = 0;
  for (const std::uint16_t r : raw.pixels)
    if (r == limit)
      ++at_limit;
    else if (r > 0 && r < limit)
      ++nearer, below = std::max(below, r);
  const bool is_full_scale = (limit & (limit + 1)) == 0 || limit % 1000 == 0;
  const double least = least_share * double(raw.pixels.size());
  const bool stands_apart = double(at_limit) > least && double(nearer) > least && below <= farthest * limit;
  return limit >= least_limit && is_full_scale && stands_apart ? limit : greatest_raw;
}

DepthImage to_metres(const Image<std::uint16_t>& raw, double depth_scale) {
  const std::uint16_t limit = range_limit(raw);
  DepthImage depth(raw.width, raw.height);
  std::ranges::transform(raw.pixels, depth.pixels.begin(),
                         [=](std::uint16_t r) { return r >= limit ? 0.0f : float(r / depth_scale); });
  return depth;
}

DepthImage read_depth(const Capture& capture, const DepthCamera& camera, int frame) {
  return read_depth(camera, capture.folder / camera.images(frame));
}

DepthImage read_depth(const DepthCamera& camera, const std::filesystem::path& path) {
  return to_metres(of_size(read_depth_image(path), camera, path), camera.depth_scale);
}

std::optional<DepthImage> read_background(const DepthCamera& camera) {
  if (!camera.background) return std::nullopt;
  return to_metres(of_size(read_depth_image(*camera.background), camera, *camera.background), camera.depth_scale);
}

std::optional<Image<std::uint8_t>> read_object_mask(const Capture& capture, const DepthCamera& camera, int frame) {
  if (!camera.masks) return std::nullopt;
  return read_object_mask(camera, capture.folder / (*camera.masks)(frame));
}

Image<std::uint8_t> read_object_mask(const Capture& capture, const SilhouetteCamera& camera, int frame) {
  return read_object_mask(camera, capture.folder / camera.masks(frame));
}

Image<std::uint8_t> read_object_mask(const RecordingCamera& camera, const std::filesystem::path& path) {
  return of_size(read_mask(path), camera, path);
}

}  // namespace pliant
