#include "rays/look_at.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace pliant {

PinholeCamera look_at(const Vector3& eye, const Vector3& target, const Vector3& up, int width, int height,
                      double vertical_field_of_view) {
  if (width <= 0 || height <= 0) throw std::invalid_argument("look_at: the image needs a positive width and height");
  if (!(vertical_field_of_view > 0.0 && vertical_field_of_view < std::numbers::pi))
    throw std::invalid_argument("look_at: the field of view must lie between 0 and pi");
  const Vector3 view = target - eye, right = view.cross(up);
  if (!(right.norm() > 1e-9 * view.norm() * up.norm()))
    throw std::invalid_argument("look_at: the view needs a direction, and `up` one across it");
  PinholeCamera camera;
  camera.width = width, camera.height = height;
  camera.fx = camera.fy = 0.5 * height / std::tan(0.5 * vertical_field_of_view);
  camera.cx = 0.5 * (width - 1), camera.cy = 0.5 * (height - 1);
  const Vector3 x = right.normalized(), z = view.normalized();
  camera.camera_to_world.rotation << x, z.cross(x), z;
  camera.camera_to_world.translation = eye;
  return camera;
}

}  // namespace pliant
