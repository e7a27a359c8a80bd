#include "report/colour_scale.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/html.hpp"
#include "report/plot.hpp"
#include "report/report.hpp"

namespace pliant {

double ColourScale::place(double value) const {
  if (std::isnan(value) || (logarithmic && value <= 0.0)) return std::nan("");
  const double at = logarithmic ? std::log(value / low) / std::log(high / low) : (value - low) / (high - low);
  return std::clamp(at, 0.0, 1.0);
}

std::vector<double> ColourScale::ticks(int count) const { return axis_ticks(low, high, count, logarithmic); }

ColourScale colour_scale(std::span<const double> values, ScaleEnds ends) {
  std::vector<double> finite;
  for (const double v : values)
    if (std::isfinite(v)) finite.push_back(v);
  if (finite.empty()) return {};
  ColourScale scale;
  if (ends == ScaleEnds::FromZero) {
    const auto end = finite.begin() + std::ptrdiff_t(0.99 * double(finite.size() - 1));
    std::ranges::nth_element(finite, end);
    scale.low = 0.0, scale.high = std::max(0.0, *end);
  } else {
    std::tie(scale.low, scale.high) = std::pair(std::ranges::min(finite), std::ranges::max(finite));
    scale.logarithmic = scale.low > 0.0 && scale.high > 10.0 * scale.low;
  }
  if (!(scale.high > scale.low)) scale.high = scale.low + std::max(1e-12, 1e-6 * std::abs(scale.low));
  return scale;
}

std::string colour_bar_svg(const ColourScale& scale, const std::string& name, const std::string& unit,
                           const std::string& id) {
  constexpr double left = 24.0, width = 472.0;
  const auto [factor, spoken] = spoken_unit(std::max(std::abs(scale.low), std::abs(scale.high)), unit);
  const std::string title = escape_html(spoken.empty() ? name : name + " [" + spoken + "]");
  std::string svg =
      fmt::format(R"svg(<svg viewBox="0 0 520 62" role="img" aria-label="colours of {0}" )svg"
                  R"svg(style="font:13px system-ui,sans-serif;fill:var(--muted)"><text x="{1}" y="14">{0}</text>)svg"
                  R"svg(<defs><linearGradient id="{2}">)svg",
                  title, left, id);
  for (int k = 0; k <= 16; ++k)
    svg += fmt::format(R"svg(<stop offset="{:.4f}" stop-color="{}"/>)svg", k / 16.0, css(sequential_colour(k / 16.0)));
  svg += fmt::format(R"svg(</linearGradient></defs><rect x="{}" y="22" width="{}" height="14" fill="url(#{})" )svg"
                     R"svg(style="stroke:var(--grid)"/>)svg",
                     left, width, id);
  for (const double tick : scale.ticks()) {
    const double x = left + width * scale.place(tick);
    svg += fmt::format(R"svg(<line x1="{0:.1f}" y1="36" x2="{0:.1f}" y2="41" style="stroke:var(--muted)"/>)svg"
                       R"svg(<text x="{0:.1f}" y="56" text-anchor="middle">{1}</text>)svg",
                       x, readable(factor * tick, 6));
  }
  return svg + "</svg>";
}

}  // namespace pliant
