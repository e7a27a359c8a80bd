#pragma once

#include "geometry/key_frames.hpp"

namespace pliant {

/// What key frames depart by from a value that the parameters have; none: nothing, ever.
inline KeyFrames<3> changes(std::vector<KeyFrames<3>::Key> keys, const Vector3& from) {
  if (keys.empty()) return {};
  for (auto& key : keys) key.value -= from;
  return KeyFrames<3>(std::move(keys));
}

}  // namespace pliant
