#include "geometry/key_frames.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace pliant::key_frames_test {
namespace {

using One = KeyFrames<1>;
One::Key key(double time, double value) { return {time, One::Value::Constant(value)}; }

TEST(KeyFrames, AreMetAndStandStillAtTheEnds) {
  const One keys({key(1.0, 2.0), key(2.0, 5.0), key(4.0, 6.0)});
  for (const auto& k : keys.keys()) EXPECT_DOUBLE_EQ(keys.at(k.time)[0], k.value[0]);
  EXPECT_EQ(keys.at(-3.0)[0], 2.0);
  EXPECT_EQ(keys.at(9.0)[0], 6.0);
  EXPECT_NEAR((keys.at(1.0 + 1e-6)[0] - 2.0) / 1e-6, 0.0, 1e-4);
  EXPECT_NEAR((6.0 - keys.at(4.0 - 1e-6)[0]) / 1e-6, 0.0, 1e-4);
}

TEST(KeyFrames, OvershootNoKeyAndHaveNoKinks) {
  const One keys({key(0.0, 0.0), key(0.1, 1.0), key(1.0, 1.1), key(1.2, 1.1), key(2.0, -1.0)});
  double slope = 0.0;
  for (double t = 0.0; t < 2.0; t += 1e-4) {
    EXPECT_LE(keys.at(t)[0], 1.1 + 1e-12);
    EXPECT_GE(keys.at(t)[0], -1.0 - 1e-12);
    const double next = (keys.at(t + 1e-6)[0] - keys.at(t)[0]) / 1e-6;
    if (t > 0.0) {
      EXPECT_LT(std::abs(next - slope), 0.7) << t;
    }
    slope = next;
  }
}

TEST(KeyFrames, RefuseDisorder) {
  EXPECT_THROW(One(std::vector<One::Key>()), std::invalid_argument);
  EXPECT_THROW(One(std::vector<One::Key>{key(1.0, 0.0), key(1.0, 2.0)}), std::invalid_argument);
}

TEST(KeyedMotion, TurnsAboutItsCentre) {
  KeyFrames<6>::Value none = KeyFrames<6>::Value::Zero(), turns = none;
  turns << 0.5, 0.0, 0.0, 0.0, 3.0 * std::numbers::pi, 0.0;  // one and a half revolutions
  const KeyedMotion motion({1.0, 2.0, 3.0}, KeyFrames<6>({{0.0, none}, {1.0, turns}}));
  EXPECT_LT((motion.at(0.0)({4, 5, 6}) - Vector3(4, 5, 6)).norm(), 1e-14);
  EXPECT_LT((motion.at(1.0)({1, 2, 3}) - Vector3(1.5, 2, 3)).norm(), 1e-14);
  EXPECT_LT((motion.at(1.0)({2, 2, 3}) - Vector3(0.5, 2, 3)).norm(), 1e-12);
  const RigidMotion half = motion.at(0.5);  // by symmetry three quarters of a revolution
  EXPECT_LT((half({2, 2, 3}) - Vector3(1.25, 2.0, 4.0)).norm(), 1e-12);
}

}  // namespace
}  // namespace pliant::key_frames_test
