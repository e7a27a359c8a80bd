#include "geometry/subdivided.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <utility>

#include "geometry/primitives.hpp"
#include "support/tolerance.hpp"

namespace pliant::subdivided_test {
namespace {

using test::tolerance;

/// Each edge once in either direction.
bool is_closed(const TriangleMesh& mesh) {
  std::map<std::pair<int, int>, int> edges;
  for (const auto& t : mesh.triangles)
    for (std::size_t e = 0; e < 3; ++e) ++edges[{t[e], t[(e + 1) % 3]}];
  return std::ranges::all_of(edges, [&](const auto& edge) {
    return edge.second == 1 && edges.contains({edge.first.second, edge.first.first});
  });
}

TEST(Subdivided, IsTheSameSurfaceInSmallerTriangles) {
  const TriangleMesh box = make_box({0.4, 0.1, 0.2}, 0.1);
  const TriangleMesh fine = subdivided(box, 0.02, 100000);
  EXPECT_TRUE(is_closed(fine));
  // Sums over tens of thousands of triangles round.
  EXPECT_NEAR(surface_area(fine), surface_area(box), tolerance(1e-12) * surface_area(box));
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

}  // namespace
}  // namespace pliant::subdivided_test
