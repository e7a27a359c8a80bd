#pragma once

#include <string>
#include <vector>

namespace pliant {

/// How a series is drawn.
enum class Mark { Line, Dots, LineAndDots, DashedLine };

/// One curve. Points that are not finite, or not positive on a logarithmic axis, are left out and interrupt the line.
struct Series {
  std::string label;         ///< for the legend; empty: not listed
  std::vector<double> x, y;  ///< as many of each
  Mark mark = Mark::Line;
  std::vector<double> low, high;  ///< a shaded band around y: empty, or as many as x
  int colour = -1;                ///< number in the palette; -1: the series' own place in the list
};

/// A line across the whole plot at a value of y.
struct Level {
  double y = 0.0;
  std::string label;
  double spread = 0.0;  ///< half width of a shaded band around it; 0: none
};

struct PlotOptions {
  std::string title, x_label, y_label;  ///< labels with their unit: "time [s]"
  bool log_x = false, log_y = false;
  bool zero_y = false;  ///< the y axis begins at zero (linear axes only)
  int width = 760, height = 320;
  std::vector<Level> levels;
};

/// A plot as an SVG element for an HTML page. Colours are the CSS variables --ink, --muted, --grid and --series-0 ..
/// --series-5, each with a value of its own for use outside a page that defines them.
/// Throws std::invalid_argument where the vectors of a series have different lengths.
std::string plot_svg(const std::vector<Series>& series, const PlotOptions& options = {});

/// Round places for the marks of an axis: within [low, high], about `count` of them, at 1, 2 or 5 times a power of ten
/// apart (logarithmic: powers of ten, and 2 and 5 times them where there are few decades).
std::vector<double> axis_ticks(double low, double high, int count, bool logarithmic);

/// A number for people with so many significant digits: 0.0021, 590, 12 300, 4.2e-7 written as 4.2×10⁻⁷.
std::string readable(double value, int digits = 3);

}  // namespace pliant
