#include "tracking/surface_samples.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <numeric>

#include "geometry/primitives.hpp"
#include "support/tolerance.hpp"
#include "tracking/neighbours.hpp"

namespace pliant::surface_samples_test {
namespace {

using test::tolerance;

TEST(SampleLevels, CoverTheSurfaceAtEverySpacing) {
  const TriangleMesh mesh = make_torus(0.1, 0.04, 60, 30);
  const std::vector<SampleLevel> levels = sample_levels(mesh, 60);
  ASSERT_GT(levels.size(), 3U);
  EXPECT_EQ(levels.front().spacing, 0.0);
  EXPECT_EQ(levels.front().vertex.size(), mesh.vertices.size());
  const double whole = surface_area(mesh);
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
