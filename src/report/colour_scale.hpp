#pragma once

#include <span>
#include <string>
#include <vector>

#include "report/image.hpp"

namespace pliant {

/// Which numbers the colours of a field stand for: `sequential_colour` from `low` to `high`.
struct ColourScale {
  double low = 0.0, high = 1.0;  ///< in the field's unit, low < high; of a logarithmic scale 0 < low
  bool logarithmic = false;

  /// Where on the scale a number lies, 0..1; beyond its ends at them, not a number where the number is none.
  double place(double value) const;
  /// Grey where the number is none.
  Rgb colour(double value) const { return sequential_colour(place(value)); }
  /// About `count` round numbers within the scale: 1, 2 or 5 times a power of ten apart, or, where it is logarithmic,
  /// such numbers themselves.
  std::vector<double> ticks(int count = 5) const;
};

enum class ScaleEnds {
  FromZero,  ///< from 0 to what 99 of 100 values stay below: beside an edge that is held, stress has no bound
  All,       ///< from the least to the greatest value, logarithmic where they are more than a decade apart
};

/// The scale of a field's values, in any unit; those that are not finite do not count. Without any, 0..1; where all
/// are the same, as much beyond it as can be told apart.
ColourScale colour_scale(std::span<const double> values, ScaleEnds ends);

/// The scale as an SVG element: its colours, with round numbers below them and the field's name with the unit, whose
/// prefix the greatest number decides.
/// @param id  of this element in the page, unique
std::string colour_bar_svg(const ColourScale& scale, const std::string& name, const std::string& unit,
                           const std::string& id);

}  // namespace pliant
