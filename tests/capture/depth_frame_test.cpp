#include "capture/depth_frame.hpp"

#include <gtest/gtest.h>

namespace pliant::depth_frame_test {
namespace {

/// 100 pixels: 40 of `near`, 60 of `far`.
Image<std::uint16_t> two_values(std::uint16_t near, std::uint16_t far) {
  Image<std::uint16_t> raw(10, 10, far);
  for (std::size_t i = 0; i < 40; ++i) raw.pixels[i] = std::uint16_t(near + i % 7);
  return raw;
}

TEST(ToMetres, LeavesOutWhatStandsForNoReading) {
  Image<std::uint16_t> raw = two_values(900, 65535);
  raw(9, 9) = 0;
  const DepthImage depth = to_metres(raw, 1000.0);
  EXPECT_FLOAT_EQ(depth(0, 0), 0.9f);
  EXPECT_EQ(depth(8, 9), 0.0f);
  EXPECT_EQ(depth(9, 9), 0.0f);
}

TEST(ToMetres, LeavesOutWhereTheSensorsRangeEnds) {
  for (const std::uint16_t end : {std::uint16_t(4095), std::uint16_t(8191), std::uint16_t(10000)})
    EXPECT_EQ(to_metres(two_values(900, end), 1000.0)(9, 9), 0.0f) << end;
}

TEST(ToMetres, KeepsABackground) {
  EXPECT_FLOAT_EQ(to_metres(two_values(900, 3871), 1000.0)(9, 9), 3.871f) << "no full scale";
  EXPECT_FLOAT_EQ(to_metres(two_values(2500, 4000), 1000.0)(9, 9), 4.0f) << "not far beyond the rest";
  Image<std::uint16_t> raw = two_values(900, 900);
  raw(9, 9) = 4000;
  EXPECT_FLOAT_EQ(to_metres(raw, 1000.0)(9, 9), 4.0f) << "one pixel";
}

}  // namespace
}  // namespace pliant::depth_frame_test
