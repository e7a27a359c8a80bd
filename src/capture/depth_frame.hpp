#pragma once

#include <optional>

#include "capture/capture.hpp"
#include "capture/image_io.hpp"

namespace pliant {

/// Depth [m] along the optical axis; 0 where there is no reading.
using DepthImage = Image<float>;

/// A depth camera's image of one frame. Throws InputError where it cannot be decoded or has another size.
DepthImage read_depth(const Capture& capture, const DepthCamera& camera, int frame);

/// An image of that camera that belongs to no frame. Throws likewise.
DepthImage read_depth(const DepthCamera& camera, const std::filesystem::path& path);

/// The camera's view of the scene without the object; nothing where the capture has none.
std::optional<DepthImage> read_background(const DepthCamera& camera);

/// 255 where the pixel shows the object; nothing where the capture has no masks.
std::optional<Image<std::uint8_t>> read_object_mask(const Capture& capture, const DepthCamera& camera, int frame);
Image<std::uint8_t> read_object_mask(const Capture& capture, const SilhouetteCamera& camera, int frame);
Image<std::uint8_t> read_object_mask(const RecordingCamera& camera, const std::filesystem::path& path);

/// The raw value from which on pixels of an image have no reading: 65535, or where the sensor's range ends. That is the
/// greatest value of an image where it is full scale (2^n - 1, or whole thousands), a hundredth of the pixels have just
/// that, as many have less, and none more than half of it.
std::uint16_t range_limit(const Image<std::uint16_t>& raw);

/// Raw readings to metres; 0 where there is none: 0 and `range_limit`.
DepthImage to_metres(const Image<std::uint16_t>& raw, double depth_scale);

}  // namespace pliant
