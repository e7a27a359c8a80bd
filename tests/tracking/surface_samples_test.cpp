#include "tracking/surface_samples.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <map>
#include <numeric>

#include "geometry/primitives.hpp"
#include "geometry/subdivided.hpp"
#include "support/tolerance.hpp"
#include "tracking/neighbours.hpp"

namespace pliant::surface_samples_test {
namespace {

using test::tolerance;

double area(const TriangleMesh& mesh) {
  double sum = 0.0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vector3& p = mesh.vertices[std::size_t(a)];
    sum += 0.5 * (mesh.vertices[std::size_t(b)] - p).cross(mesh.vertices[std::size_t(c)] - p).norm();
  }
  return sum;
}

/// Each edge once in either direction.
bool is_closed(const TriangleMesh& mesh) {
  std::map<std::pair<int, int>, int> edges;
  for (const auto& t : mesh.triangles)
    for (std::size_t e = 0; e < 3; ++e) ++edges[{t[e], t[(e + 1) % 3]}];
  return std::ranges::all_of(edges, [&](const auto& edge) {
    return edge.second == 1 && edges.contains({edge.first.second, edge.first.first});
  });
}

double mean_edge(const TriangleMesh& mesh) {
  double sum = 0.0;
  for (const auto& t : mesh.triangles)
    for (std::size_t e = 0; e < 3; ++e)
      sum += (mesh.vertices[std::size_t(t[e])] - mesh.vertices[std::size_t(t[(e + 1) % 3])]).norm();
  return sum / (3.0 * double(mesh.triangles.size()));
}

TEST(Subdivided, IsTheSameSurfaceInSmallerTriangles) {
  const TriangleMesh box = make_box({0.4, 0.1, 0.2}, 0.1);
  const TriangleMesh fine = subdivided(box, 0.02, 100000);
  EXPECT_TRUE(is_closed(fine));
  // Sums over tens of thousands of triangles round.
  EXPECT_NEAR(area(fine), area(box), tolerance(1e-12) * area(box));
  EXPECT_NEAR(enclosed_volume(fine), enclosed_volume(box), tolerance(1e-12) * enclosed_volume(box));
  EXPECT_LE(mean_edge(fine), 0.02);
  EXPECT_GT(mean_edge(fine), 0.01) << "no finer than asked for";
  for (std::size_t v = 0; v < box.vertices.size(); ++v) EXPECT_EQ(fine.vertices[v], box.vertices[v]);
}

TEST(Subdivided, StopsAtTheMostVertices) {
  const TriangleMesh ball = make_sphere(0.1, 2);
  for (const int most : {10, 200, 1000, 5000}) {
    const TriangleMesh fine = subdivided(ball, 1e-4, most);
    EXPECT_LE(fine.vertices.size(), std::max<std::size_t>(ball.vertices.size(), std::size_t(most)));
    EXPECT_GT(4 * fine.vertices.size(), std::size_t(most)) << "but no sooner";
    EXPECT_TRUE(is_closed(fine));
  }
  EXPECT_EQ(subdivided(ball, 1.0, 5000).triangles, ball.triangles) << "fine enough as it is";
}

TEST(SampleLevels, CoverTheSurfaceAtEverySpacing) {
  const TriangleMesh mesh = make_torus(0.1, 0.04, 60, 30);
  const std::vector<SampleLevel> levels = sample_levels(mesh, 60);
  ASSERT_GT(levels.size(), 3U);
  EXPECT_EQ(levels.front().spacing, 0.0);
  EXPECT_EQ(levels.front().vertex.size(), mesh.vertices.size());
  const double whole = area(mesh);
  for (std::size_t l = 0; l < levels.size(); ++l) {
    const SampleLevel& level = levels[l];
    EXPECT_NEAR(std::accumulate(level.area.begin(), level.area.end(), 0.0), whole, tolerance(1e-12) * whole) << l;
    EXPECT_GT(*std::ranges::min_element(level.area), 0.0) << l;
    ASSERT_EQ(level.sample_of.size(), mesh.vertices.size());
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
      double nearest = std::numeric_limits<double>::infinity();
      for (const int s : level.vertex)
        nearest = std::min(nearest, (mesh.vertices[std::size_t(s)] - mesh.vertices[v]).norm());
      const int own = level.vertex[std::size_t(level.sample_of[v])];
      EXPECT_NEAR((mesh.vertices[std::size_t(own)] - mesh.vertices[v]).norm(), nearest, tolerance(1e-15));
      if (l > 0) {
        EXPECT_LT(nearest, level.spacing) << "nothing is left uncovered";
      }
    }
    for (std::size_t i = 0; i < level.vertex.size(); ++i)
      for (std::size_t j = 0; j < i; ++j)
        EXPECT_GE((mesh.vertices[std::size_t(level.vertex[i])] - mesh.vertices[std::size_t(level.vertex[j])]).norm(),
                  level.spacing);
    if (l > 0) {
      EXPECT_LE(level.vertex.size(), levels[l - 1].vertex.size());
      EXPECT_GE(level.vertex.size(), 60U);
    }
    if (l > 1) {
      EXPECT_DOUBLE_EQ(level.spacing, 1.5 * levels[l - 1].spacing);
    }
  }
  EXPECT_LT(levels.back().vertex.size(), 200U) << "down to few";
}

TEST(SampleLevels, OfASmallMeshAreAllItsVertices) {
  const TriangleMesh mesh = make_box({0.1, 0.1, 0.1}, 0.1);
  EXPECT_EQ(sample_levels(mesh, 60).size(), 1U);
}

TEST(Neighbours, AreThoseOfAllPairs) {
  const TriangleMesh mesh = make_torus(0.1, 0.04, 20, 12);
  Points points(Eigen::Index(mesh.vertices.size()), 3);
  for (Eigen::Index i = 0; i < points.rows(); ++i) points.row(i) = mesh.vertices[std::size_t(i)].transpose();
  const Neighbours near(points);
  const Vector3 place(0.07, 0.02, -0.03);
  const VectorX squared = (points.rowwise() - place.transpose()).rowwise().squaredNorm();
  Eigen::Index nearest = -1;
  const double least = squared.minCoeff(&nearest);
  EXPECT_EQ(near.nearest(place).index, nearest);
  EXPECT_NEAR(near.nearest(place).squared_distance, least, tolerance(1e-16));
  std::vector<Neighbours::Match> found;
  near.within(place, 0.05, found);
  EXPECT_EQ(Eigen::Index(found.size()), (squared.array() < 0.05 * 0.05).count());
  for (const auto& [index, distance] : found) EXPECT_LT(squared[index], 0.05 * 0.05);
  near.within(place, 1e-6, found);
  EXPECT_TRUE(found.empty());
}

}  // namespace
}  // namespace pliant::surface_samples_test
