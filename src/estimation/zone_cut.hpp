#pragma once

namespace pliant {

/// A cut of one zone of an object in two, by where the elements' centres lie.
struct ZoneCut {
  enum class By : int { X, Y, Z, Depth };  ///< a coordinate in the scan, or how far below the nearest surface
  int zone = 0;                            ///< of those that were there before; its upper part becomes the last zone
  By by = By::X;
  double at = 0.0;  ///< [m]
  bool operator==(const ZoneCut&) const = default;
};

}  // namespace pliant
