#include "meshing/volume_match.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "mesh/tet_mesh.hpp"

namespace pliant::volume_match_test {
namespace {

using std::numbers::pi;

struct Elements {
  std::vector<Vector3> nodes;
  std::vector<std::array<int, 4>> tets;

  /// Six times the volume of an element [m^3].
  double six_volumes(const std::array<int, 4>& t) const {
    const auto at = [&](int k) -> const Vector3& { return nodes[std::size_t(t[std::size_t(k)])]; };
    return (at(1) - at(0)).cross(at(2) - at(0)).dot(at(3) - at(0));
  }
  double volume() const {
    double sum = 0.0;
    for (const auto& t : tets) sum += six_volumes(t) / 6.0;
    return sum;
  }
  double least_volume() const {
    double least = std::numeric_limits<double>::max();
    for (const auto& t : tets) least = std::min(least, six_volumes(t) / 6.0);
    return least;
  }
};

constexpr double inner = 1.0, outer = 2.0, length = 6.0;  // [m]

/// A pipe along x whose cross-section is a ring between two regular polygons, corners on circles of radius `inner` and
/// `outer`.
Elements pipe(int sides) {
  const int along = 6, through = 2;
  const TetMesh box = make_tet_box({Vector3::Zero(), Vector3::Ones()}, {along, through, sides}, false);
  Elements e;
  std::vector<int> number(std::size_t(box.node_count()));
  for (int n = 0; n < box.node_count(); ++n) {
    const Vector3 p = box.nodes.row(n).transpose();
    if (p.z() > 1.0 - 1e-9) {  // the seam: the nodes at z = 0 again
      number[std::size_t(n)] = number[std::size_t(n - sides * (along + 1) * (through + 1))];
      continue;
    }
    number[std::size_t(n)] = int(e.nodes.size());
    const double r = inner + p.y() * (outer - inner), angle = 2.0 * pi * p.z();
    e.nodes.emplace_back(length * p.x(), r * std::cos(angle), r * std::sin(angle));
  }
  for (auto t : box.tets) {
    for (int& n : t) n = number[std::size_t(n)];
    e.tets.push_back(t);
  }
  return e;
}

/// Of the round pipe's surface, its flat ends included.
Vector3 nearest_on_pipe(const Vector3& p) {
  const double r = std::hypot(p.y(), p.z()), inside = std::clamp(r, inner, outer);
  const double x = std::clamp(p.x(), 0.0, length);
  const auto at = [&](double along, double radius) { return Vector3(along, p.y() * radius / r, p.z() * radius / r); };
  Vector3 nearest = at(x, outer);
  for (const Vector3& other : {at(x, inner), at(0.0, inside), at(length, inside)})
    if ((other - p).norm() < (nearest - p).norm()) nearest = other;
  return nearest;
}

class RoundPipe : public ::testing::TestWithParam<int> {};

TEST_P(RoundPipe, HasItsVolumeWhateverThePolygon) {
  const double ideal = pi * (outer * outer - inner * inner) * length;
  Elements e = pipe(GetParam());
  ASSERT_GT(e.least_volume(), 0.0);
  const Elements before = e;
  const double polygon = std::sin(2.0 * pi / GetParam()) * GetParam() / (2.0 * pi);  // its area to the circle's
  ASSERT_NEAR(e.volume() / ideal, polygon, 1e-9);
  match_volume(e.nodes, e.tets, nearest_on_pipe);
  EXPECT_NEAR(e.volume() / ideal, 1.0, 0.03 * (1.0 - polygon));
  EXPECT_GT(e.least_volume(), 0.5 * before.least_volume());
  double outside = 0.0, bore = 0.0;  // how much farther from the axis
  for (std::size_t n = 0; n < e.nodes.size(); ++n) {
    const Vector3 &p = e.nodes[n], &was = before.nodes[n];
    const double r = std::hypot(p.y(), p.z()), r_before = std::hypot(was.y(), was.z());
    const bool is_end = was.x() < 1e-9 || was.x() > length - 1e-9;
    if (is_end) {
      EXPECT_NEAR(p.x(), was.x(), 1e-9) << "ends are flat and stay so";
    }
    if (r_before > outer - 1e-9) {
      outside += r - r_before;
    } else if (r_before < inner + 1e-9) {
      bore += r - r_before;
    } else if (!is_end) {
      EXPECT_EQ(p, was) << "inside";
    }
  }
  EXPECT_GT(outside, 0.0);
  EXPECT_GT(bore, 0.0) << "its chords lie in the air, where no material is";
}
INSTANTIATE_TEST_SUITE_P(Sides, RoundPipe, ::testing::Values(6, 8, 12, 24));

TEST(VolumeMatch, LeavesABoxAsItIs) {
  const TetMesh box = make_tet_box({Vector3::Zero(), {3.0, 2.0, 1.0}}, {6, 4, 2}, false);
  Elements e;
  for (int n = 0; n < box.node_count(); ++n) e.nodes.emplace_back(box.nodes.row(n).transpose());
  e.tets = box.tets;
  const std::vector<Vector3> before = e.nodes;
  match_volume(e.nodes, e.tets, [&](const Vector3& p) {
    Vector3 nearest = p;
    double least = std::numeric_limits<double>::max();
    for (int axis = 0; axis < 3; ++axis)
      for (const double side : {0.0, 3.0 - axis})
        if (const double off = std::abs(p[axis] - side); off < least) {
          least = off;
          nearest = p;
          nearest[axis] = side;
        }
    return nearest;
  });
  for (std::size_t n = 0; n < before.size(); ++n) EXPECT_LT((e.nodes[n] - before[n]).norm(), 1e-12) << n;
}

TEST(VolumeMatch, IgnoresASurfaceThatIsElsewhere) {
  Elements e = pipe(8);
  const std::vector<Vector3> before = e.nodes;
  match_volume(e.nodes, e.tets, [](const Vector3& p) -> Vector3 { return p + Vector3(0.0, 0.0, 5.0); });
  EXPECT_EQ(e.nodes, before);
}

}  // namespace
}  // namespace pliant::volume_match_test
