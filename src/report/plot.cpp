#include "report/plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "base/html.hpp"

namespace pliant {

namespace {

constexpr std::array<const char*, 6> palette{"#2f6fb3", "#d2691e", "#3c8d5a", "#8b5fbf", "#b8860b", "#c0436a"};
constexpr double margin_left = 74, margin_right = 18, margin_bottom = 48;

std::string series_colour(int number) {
  const int k = number % int(palette.size());
  return fmt::format("var(--series-{},{})", k, palette[k]);
}

// One axis: values to pixels.
struct Axis {
  double low = 0.0, high = 1.0, pixel_low = 0.0, pixel_high = 1.0;
  bool logarithmic = false;
  std::vector<double> ticks;

  bool shows(double value) const { return std::isfinite(value) && (!logarithmic || value > 0.0); }
  double operator()(double value) const {
    const auto scale = [&](double v) { return logarithmic ? std::log10(v) : v; };
    const double t = (scale(value) - scale(low)) / (scale(high) - scale(low));
    return pixel_low + std::clamp(t, -0.5, 1.5) * (pixel_high - pixel_low);
  }
};

// Whether there is no place between two numbers but what rounding makes: ticks could not be told apart.
bool are_one(double low, double high) { return high - low <= 1e-9 * std::max(std::abs(low), std::abs(high)); }

// Range of what is to be shown, and never empty.
class Range {
 public:
  explicit Range(bool logarithmic) : logarithmic_(logarithmic) {}
  void extend(double value) {
    if (!std::isfinite(value) || (logarithmic_ && value <= 0.0)) return;
    low_ = std::min(low_, value), high_ = std::max(high_, value);
  }
  std::pair<double, double> padded(double part) const {
    if (low_ > high_) return logarithmic_ ? std::pair{1.0, 10.0} : std::pair{0.0, 1.0};
    if (logarithmic_) {
      const double factor = are_one(low_, high_) ? 2.0 : std::pow(high_ / low_, part);
      return {low_ / factor, high_ * factor};
    }
    const double pad = are_one(low_, high_) ? std::max(std::abs(low_) * 0.1, 1e-12) : part * (high_ - low_);
    return {low_ - pad, high_ + pad};
  }

 private:
  bool logarithmic_;
  double low_ = HUGE_VAL, high_ = -HUGE_VAL;
};

void check(const Series& series) {
  const size_t n = series.x.size();
  const bool bands = series.low.empty() && series.high.empty();
  if (series.y.size() != n || (!bands && (series.low.size() != n || series.high.size() != n)))
    throw std::invalid_argument("plot_svg: the vectors of series \"" + series.label + "\" differ in length");
}

class Plot {
 public:
  Plot(const std::vector<Series>& series, const PlotOptions& options) : series_(series), options_(options) {
    for (const Series& s : series) check(s);
    top_ = 14.0 + (options.title.empty() ? 0.0 : 22.0) + (has_legend() ? 22.0 : 0.0);
    set_x();
    set_y();
  }

  std::string svg() {
    out_ += fmt::format(
        R"svg(<svg class="plot" viewBox="0 0 {} {}" role="img" aria-label="{}" xmlns="http://www.w3.org/2000/svg" )svg"
        R"svg(style="font:13px system-ui,sans-serif;fill:var(--ink,#22262b)">)svg",
        options_.width, options_.height, escape_html(options_.title.empty() ? options_.y_label : options_.title));
    titles();
    grid();
    for (const Level& level : options_.levels) draw_level(level);
    for (size_t i = 0; i < series_.size(); ++i) draw_band(series_[i], colour(i));
    for (size_t i = 0; i < series_.size(); ++i) draw_series(series_[i], colour(i));
    legend();
    return out_ + "</svg>";
  }

 private:
  std::string colour(size_t i) const { return series_colour(series_[i].colour >= 0 ? series_[i].colour : int(i)); }
  bool has_legend() const {
    return std::any_of(series_.begin(), series_.end(), [](const Series& s) { return !s.label.empty(); });
  }
  double right() const { return options_.width - margin_right; }
  double bottom() const { return options_.height - margin_bottom; }

  void set_x() {
    Range range(options_.log_x);
    for (const Series& s : series_)
      for (const double v : s.x) range.extend(v);
    std::tie(x_.low, x_.high) = range.padded(0.02);
    x_.pixel_low = margin_left, x_.pixel_high = right(), x_.logarithmic = options_.log_x;
    x_.ticks = axis_ticks(x_.low, x_.high, options_.width / 90, options_.log_x);
  }

  void set_y() {
    Range range(options_.log_y);
    for (const Series& s : series_)
      for (const auto* values : {&s.y, &s.low, &s.high})
        for (const double v : *values) range.extend(v);
    for (const Level& level : options_.levels)
      range.extend(level.y - level.spread), range.extend(level.y + level.spread);
    if (options_.zero_y) range.extend(0.0);
    std::tie(y_.low, y_.high) = range.padded(0.07);
    if (options_.zero_y && !options_.log_y) y_.low = 0.0;
    y_.pixel_low = bottom(), y_.pixel_high = top_, y_.logarithmic = options_.log_y;
    y_.ticks = axis_ticks(y_.low, y_.high, std::max(3, options_.height / 60), options_.log_y);
  }

  void text(double x, double y, const std::string& content, const std::string& style) {
    out_ += fmt::format(R"svg(<text x="{:.1f}" y="{:.1f}" style="{}">{}</text>)svg", x, y, style, content);
  }

  void titles() {
    if (!options_.title.empty()) text(margin_left, 20, escape_html(options_.title), "font-weight:600");
    const char* muted = "fill:var(--muted,#667);text-anchor:middle";
    text(0.5 * (margin_left + right()), options_.height - 10, escape_html(options_.x_label), muted);
    const double middle = 0.5 * (top_ + bottom());
    out_ += fmt::format(R"svg(<text transform="translate(16 {:.1f}) rotate(-90)" style="{}">{}</text>)svg", middle,
                        muted, escape_html(options_.y_label));
  }

  void line(double x1, double y1, double x2, double y2, const std::string& style) {
    out_ += fmt::format(R"svg(<line x1="{:.1f}" y1="{:.1f}" x2="{:.1f}" y2="{:.1f}" style="{}"/>)svg", x1, y1, x2, y2,
                        style);
  }

  void grid() {
    const std::string thin = "stroke:var(--grid,#e3e5e8);stroke-width:1",
                      small = "font-size:12px;fill:var(--muted,#667)";
    for (const double t : y_.ticks) {
      line(margin_left, y_(t), right(), y_(t), thin);
      text(margin_left - 8, y_(t) + 4, readable(t, 4), small + ";text-anchor:end");
    }
    for (const double t : x_.ticks) {
      line(x_(t), bottom(), x_(t), bottom() + 5, "stroke:var(--muted,#667);stroke-width:1");
      text(x_(t), bottom() + 19, readable(t, 4), small + ";text-anchor:middle");
    }
    line(margin_left, bottom(), right(), bottom(), "stroke:var(--muted,#667);stroke-width:1");
  }

  void draw_level(const Level& level) {
    if (!y_.shows(level.y)) return;
    const std::string stroke = "stroke:var(--muted,#667);stroke-width:1.3;stroke-dasharray:5 4";
    if (level.spread > 0.0) {
      const double high = y_(level.y + level.spread), low_value = level.y - level.spread;
      const double low = y_.shows(low_value) ? y_(low_value) : bottom();
      out_ += fmt::format(
          R"svg(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" style="fill:var(--muted,#667);opacity:.13"/>)svg",
          margin_left, high, right() - margin_left, std::max(0.0, low - high));
    }
    line(margin_left, y_(level.y), right(), y_(level.y), stroke);
    text(right() - 4, y_(level.y) - 5, escape_html(level.label),
         "font-size:12px;fill:var(--muted,#667);text-anchor:end");
  }

  void draw_band(const Series& s, const std::string& colour) {
    std::string there, back;
    for (size_t i = 0; i < s.low.size(); ++i) {
      if (!x_.shows(s.x[i]) || !y_.shows(s.low[i]) || !y_.shows(s.high[i])) continue;
      there += fmt::format("{:.1f},{:.1f} ", x_(s.x[i]), y_(s.high[i]));
      back = fmt::format("{:.1f},{:.1f} ", x_(s.x[i]), y_(s.low[i])) + back;
    }
    if (!there.empty())
      out_ += fmt::format(R"svg(<polygon points="{}{}" style="fill:{};opacity:.16"/>)svg", there, back, colour);
  }

  void draw_series(const Series& s, const std::string& colour) {
    if (s.mark != Mark::Dots) draw_line(s, colour);
    if (s.mark == Mark::Line || s.mark == Mark::DashedLine) return;
    const double radius = s.x.size() > 150 ? 1.6 : 3.0;
    for (size_t i = 0; i < s.x.size(); ++i)
      if (x_.shows(s.x[i]) && y_.shows(s.y[i]))
        out_ += fmt::format(R"svg(<circle cx="{:.1f}" cy="{:.1f}" r="{}" style="fill:{}"/>)svg", x_(s.x[i]), y_(s.y[i]),
                            radius, colour);
  }

  void draw_line(const Series& s, const std::string& colour) {
    std::string path;
    bool pen_down = false;
    for (size_t i = 0; i < s.x.size(); ++i) {
      const bool shown = x_.shows(s.x[i]) && y_.shows(s.y[i]);
      if (shown) path += fmt::format("{}{:.1f} {:.1f}", pen_down ? "L" : "M", x_(s.x[i]), y_(s.y[i]));
      pen_down = shown;
    }
    const char* dash = s.mark == Mark::DashedLine ? ";stroke-dasharray:6 5" : "";
    if (!path.empty())
      out_ += fmt::format(
          R"svg(<path d="{}" style="fill:none;stroke:{};stroke-width:2;stroke-linejoin:round;stroke-linecap:round{}"/>)svg",
          path, colour, dash);
  }

  void legend() {
    double x = margin_left;
    const double y = top_ - 12.0;
    for (size_t i = 0; i < series_.size(); ++i) {
      if (series_[i].label.empty()) continue;
      line(x, y - 4, x + 18, y - 4, "stroke-width:3;stroke:" + colour(i));
      text(x + 24, y, escape_html(series_[i].label), "font-size:12px");
      x += 44.0 + 6.6 * double(series_[i].label.size());
    }
  }

  const std::vector<Series>& series_;
  const PlotOptions& options_;
  Axis x_, y_;
  double top_ = 0.0;
  std::string out_;
};

std::vector<double> linear_ticks(double low, double high, int count) {
  const double rough = (high - low) / std::max(1, count), decade = std::pow(10.0, std::floor(std::log10(rough)));
  double step = 10.0 * decade;
  for (const double nice : {1.0, 2.0, 5.0})
    if (nice * decade >= 0.8 * rough) {
      step = nice * decade;
      break;
    }
  std::vector<double> ticks;
  for (double k = std::ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; ++k)
    ticks.push_back(k == 0 ? 0.0 : k * step);
  return ticks;
}

std::vector<double> logarithmic_ticks(double low, double high, int count) {
  const int first = int(std::floor(std::log10(low))), last = int(std::ceil(std::log10(high)));
  const int every = std::max(1, (last - first) / std::max(1, 2 * count));
  const bool between = last - first <= 3;
  std::vector<double> ticks;
  for (int decade = first; decade <= last; decade += every)
    for (const double factor : {1.0, 2.0, 5.0}) {
      const double tick = factor * std::pow(10.0, decade);
      if ((factor == 1.0 || between) && tick >= low * (1.0 - 1e-9) && tick <= high * (1.0 + 1e-9))
        ticks.push_back(tick);
    }
  return ticks;
}

// 12 300 with a narrow space at the thousands.
std::string grouped(const std::string& digits) {
  const size_t end = std::min(digits.find('.'), digits.size());
  if (end < 5) return digits;
  std::string out;
  for (size_t i = 0; i < end; ++i) {
    if (i > 0 && (end - i) % 3 == 0) out += "\u202f";
    out += digits[i];
  }
  return out + digits.substr(end);
}

std::string superscript(int exponent) {
  static constexpr std::array<const char*, 10> digits{"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string out = exponent < 0 ? "⁻" : "";
  for (const char c : std::to_string(std::abs(exponent))) out += digits[c - '0'];
  return out;
}

}  // namespace

std::string plot_svg(const std::vector<Series>& series, const PlotOptions& options) {
  return Plot(series, options).svg();
}

std::vector<double> axis_ticks(double low, double high, int count, bool logarithmic) {
  if (!(low < high) || are_one(low, high) || !std::isfinite(low) || !std::isfinite(high) || (logarithmic && low <= 0.0))
    return {};
  if (!logarithmic) return linear_ticks(low, high, count);
  const std::vector<double> ticks = logarithmic_ticks(low, high, count);
  return ticks.size() >= 2 ? ticks : linear_ticks(low, high, count);
}

std::string readable(double value, int digits) {
  if (std::isnan(value)) return "unknown";
  if (std::isinf(value)) return value > 0 ? "∞" : "−∞";
  if (value == 0.0) return "0";
  int exponent = int(std::floor(std::log10(std::abs(value)) + 1e-12));
  const double unit = std::pow(10.0, exponent - digits + 1);
  const double rounded = std::round(value / unit) * unit;
  if (std::abs(rounded) >= std::pow(10.0, exponent + 1) * (1.0 - 1e-12)) ++exponent;
  std::string text;
  if (exponent < -4 || exponent >= 7) {
    text = fmt::format("{:.{}f}", rounded / std::pow(10.0, exponent), digits - 1);
  } else {
    text = fmt::format("{:.{}f}", rounded, std::max(0, digits - 1 - exponent));
  }
  const bool negative = text.front() == '-';
  if (negative) text.erase(0, 1);
  if (text.find('.') != std::string::npos) {
    text.erase(text.find_last_not_of('0') + 1);
    if (text.back() == '.') text.pop_back();
  }
  text = grouped(text);
  if (exponent < -4 || exponent >= 7)
    text = text == "1" ? "10" + superscript(exponent) : text + "×10" + superscript(exponent);
  return (negative ? "−" : "") + text;
}

}  // namespace pliant
