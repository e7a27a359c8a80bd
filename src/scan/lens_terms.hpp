#pragma once

#include "geometry/lens.hpp"

namespace pliant {

/// A lens with changes of its coefficients k1 and k2.
LensDistortion changed_lens(const LensDistortion& lens, const Vector2& change);

}  // namespace pliant
