#pragma once

#include <cmath>
#include <string>

#include "capture/depth_frame.hpp"
#include "capture/observe.hpp"
#include "imports/formats.hpp"
#include "imports/write_recording.hpp"
#include "input_errors.hpp"
#include "temporary_folder.hpp"

namespace pliant::test {

inline std::filesystem::path import_data(std::string_view name) {
  return std::filesystem::path(PLIANT_SOURCE_DIR) / "tests/imports/data" / name;
}

/// The picture of all readers' tests: depth [mm] is no plane and grows by 100 a frame, and pixel
/// (0, 0) has no reading.
inline std::uint16_t ramp(int u, int v, int frame) {
  return u == 0 && v == 0 ? std::uint16_t(0) : std::uint16_t(600 + u + 2 * v + u * v / 6 + 100 * frame);
}

inline Image<std::uint16_t> ramp_image(int width, int height, int frame) {
  Image<std::uint16_t> image(width, height);
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u) image(u, v) = ramp(u, v, frame);
  return image;
}

/// Checks that a camera of a capture saw `ramp` in each frame, from image `first` on.
inline void expect_ramp(const Capture& capture, int images, int first = 0, std::size_t index = 0,
                        float tolerance = 5e-6f) {
  ASSERT_GT(capture.depth.size(), index);
  const DepthCamera& camera = capture.depth[index];
  ASSERT_EQ(capture.frame_count(), images);
  for (int frame = 0; frame < images; ++frame) {
    const DepthImage depth = read_depth(capture, camera, frame);
    for (int v = 0; v < depth.height; ++v)
      for (int u = 0; u < depth.width; ++u)
        ASSERT_NEAR(depth(u, v), 1e-3f * float(ramp(u, v, first + frame)), tolerance)
            << "pixel " << u << ", " << v << " of frame " << frame;
  }
}

/// Imports a source and reads the capture back.
inline Capture imported(const std::filesystem::path& source, const std::filesystem::path& out,
                        const std::string& from = "", const ImportOptions& options = {},
                        const CaptureFacts& facts = {}) {
  (void)write_recording(out, import_format(from, source).read(source, options), facts);
  return read_capture(out);
}

}  // namespace pliant::test
