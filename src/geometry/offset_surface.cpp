#include "geometry/offset_surface.hpp"

#include <Eigen/Eigenvalues>

namespace pliant {

std::vector<Vector3> offset_directions(const TriangleMesh& surface) {
  constexpr double hardly = 0.05;  // of the greatest eigenvalue: what two nearly parallel faces differ by says nothing
  std::vector<Matrix3> squares(surface.vertices.size(), Matrix3::Zero());
  std::vector<Vector3> sums(surface.vertices.size(), Vector3::Zero());
  for (const auto& face : surface.triangles) {
    const auto corner = [&](std::size_t k) { return surface.vertices[std::size_t(face[k])]; };
    const Vector3 area = 0.5 * (corner(1) - corner(0)).cross(corner(2) - corner(0)), normal = area.normalized();
    for (const int v : face) {
      squares[std::size_t(v)] += area * normal.transpose();
      sums[std::size_t(v)] += area;
    }
  }
  std::vector<Vector3> moves(sums.size(), Vector3::Zero());
  for (std::size_t v = 0; v < sums.size(); ++v) {
    if (squares[v].isZero(0.0)) continue;
    const Eigen::SelfAdjointEigenSolver<Matrix3> eigen(squares[v]);
    for (int k = 0; k < 3; ++k)
      if (eigen.eigenvalues()[k] > hardly * eigen.eigenvalues()[2]) {
        const Vector3 axis = eigen.eigenvectors().col(k);
        moves[v] += axis.dot(sums[v]) / eigen.eigenvalues()[k] * axis;
      }
  }
  return moves;
}

}  // namespace pliant
