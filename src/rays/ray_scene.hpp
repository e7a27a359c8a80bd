#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "base/types.hpp"
#include "geometry/camera.hpp"
#include "geometry/triangle_mesh.hpp"

namespace pliant {

/// The nearest triangle that a ray meets.
struct RayHit {
  double distance = 0.0;             ///< along the ray, in lengths of its direction
  int mesh = -1, triangle = -1;      ///< numbers given by RayScene::add; row of that mesh's triangles
  double u = 0.0, v = 0.0;           ///< the point is (1-u-v) a + u b + v c of the triangle's corners a, b, c
  Vector3 normal = Vector3::Zero();  ///< unit length, to the side from which the corners run counter-clockwise
};

/// What a pinhole camera sees, row by row; pixel (u, v) is at v * width + u. All vectors have width * height entries.
struct DepthRender {
  int width = 0, height = 0;
  std::vector<float> depth;   ///< [m] along the optical axis; 0: nothing is there
  std::vector<int> mesh;      ///< number of the mesh; -1: nothing
  std::vector<int> triangle;  ///< row of the mesh's triangles; -1: nothing
  std::vector<float> cosine;  ///< of the angle between the ray back to the camera and the outward normal, -1..1;
                              ///< negative where the triangle is seen from inside
  int at(int u, int v) const { return v * width + u; }
};

/// Offset of a pixel's ray [pixels] from its centre, called with (u, v); must be a pure function of them.
using PixelOffset = std::function<Eigen::Vector2d(int u, int v)>;

/// Triangle meshes that rays are cast at (Embree). Vertices may move from frame to frame; triangles stay.
/// Answers do not depend on the number of threads. Casting from several threads is safe, changing is not.
class RayScene {
 public:
  RayScene();
  ~RayScene();
  RayScene(RayScene&&) noexcept;
  RayScene& operator=(RayScene&&) noexcept;

  /// Adds a mesh (n x 3 vertices [m]) and returns its number, counted from 0.
  /// Throws std::invalid_argument where a triangle names a vertex that is not there.
  int add(const Points& vertices, std::span<const std::array<int, 3>> triangles);
  int add(const TriangleMesh& mesh);

  /// Moves the vertices of a mesh. Throws std::invalid_argument unless there are as many as before.
  void set_vertices(int mesh, const Points& vertices);

  /// The nearest hit with distance in (near, far), or nothing.
  std::optional<RayHit> cast(const Vector3& origin, const Vector3& direction, double near = 0.0,
                             double far = 1e30) const;

  /// True where something lies on the ray with distance in (near, far).
  bool is_blocked(const Vector3& origin, const Vector3& direction, double near, double far) const;

  /// Depth image by one ray a pixel; rows in parallel.
  DepthRender render_depth(const PinholeCamera& camera, const PixelOffset& offset = {}) const;

  /// Corners [m] of a triangle and its vertex numbers as they are now.
  std::array<int, 3> triangle(int mesh, int triangle) const;
  Vector3 vertex(int mesh, int vertex) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Vertices of a mesh as n x 3.
Points vertex_points(const TriangleMesh& mesh);

}  // namespace pliant
