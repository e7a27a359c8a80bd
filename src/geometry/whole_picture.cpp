#include "geometry/whole_picture.hpp"

namespace pliant {

bool sees_whole_picture(const PinholeCamera& camera) {
  constexpr int across = 32;  // places along each side
  for (int v = 0; v <= across; ++v)
    for (int u = 0; u <= across; ++u)
      if (!camera.ray((camera.width - 1.0) * u / across, (camera.height - 1.0) * v / across).allFinite()) return false;
  return true;
}

}  // namespace pliant
