#include "capture/find_plane.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "capture/small_capture.hpp"

namespace pliant::find_plane_test {
namespace {

using test::SmallCapture;

// The floor is at y = 0.5, seen from 0.5 m above it; depth is rounded to millimetres.
void expect_floor(const std::optional<FoundPlane>& plane) {
  ASSERT_TRUE(plane);
  EXPECT_LT(std::acos(std::min(1.0, plane->normal.dot(Vector3(0, -1, 0)))), 2e-3);
  EXPECT_NEAR(plane->point.y(), 0.5, 1e-3);
  EXPECT_LT(plane->rms, 1e-3);
  EXPECT_TRUE(plane->known);
}

Plane poor_guess() { return {{0.05, 0.47, 0.5}, Vector3(0.15, -1, 0.1).normalized(), false}; }

TEST(FindPlane, CorrectsAPoorGuess) {
  SmallCapture small;
  expect_floor(find_plane(small.read(), poor_guess()));
}

TEST(FindPlane, UsesTheBackgroundImage) {
  SmallCapture small;
  small.edit("masks = \"front/mask_%06d.png\"", "background = \"front/background.png\"");
  expect_floor(find_plane(small.read(), poor_guess()));
}

TEST(FindPlane, FindsNoneWhereNoneIs) {
  SmallCapture small;
  EXPECT_FALSE(find_plane(small.read(), {{0, -0.8, 0}, {0, 1, 0}, false}));
}

}  // namespace
}  // namespace pliant::find_plane_test
