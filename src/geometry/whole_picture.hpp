#pragma once

#include "geometry/camera.hpp"

namespace pliant {

/// Whether a ray comes out at each pixel of a camera's picture: looked at on a grid that has its corners.
bool sees_whole_picture(const PinholeCamera& camera);

}  // namespace pliant
