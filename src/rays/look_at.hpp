#pragma once

#include "base/types.hpp"
#include "geometry/camera.hpp"

namespace pliant {

/// Camera at `eye` that sees `target` in the middle of its image, with `up` upwards in it.
/// @param vertical_field_of_view  [rad], 0 < angle < pi, over the whole height of the image
/// Throws std::invalid_argument where eye and target coincide, `up` points along the view, a size is not positive or
/// the angle is out of range.
PinholeCamera look_at(const Vector3& eye, const Vector3& target, const Vector3& up, int width, int height,
                      double vertical_field_of_view);

}  // namespace pliant
