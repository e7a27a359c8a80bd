#include "capture/depth_frame.hpp"

#include <algorithm>
#include <string>

namespace pliant {

namespace {

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

DepthImage to_metres(const Image<std::uint16_t>& raw, double depth_scale) {
  DepthImage depth(raw.width, raw.height);
  std::ranges::transform(raw.pixels, depth.pixels.begin(), [=](std::uint16_t r) { return float(r / depth_scale); });
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
