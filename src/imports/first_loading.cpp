#include "imports/first_loading.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>
#include <span>

#include "base/median.hpp"
#include "base/types.hpp"
#include "imports/recording.hpp"

namespace pliant {

namespace {

constexpr std::size_t curve_points = 100;    // of what comes out
constexpr std::size_t onset_points = 400;    // in which the onset is looked for
constexpr int onset_candidates = 400;        // places that are tried, and again between the best one's neighbours
constexpr double reversal = 0.02;            // of the reach, by which a cycle goes back or a later one goes farther
constexpr double break_fall = 0.25;          // of the greatest force
constexpr double class_of_cell = 0.005;      // of a force
constexpr double zero_of_cell = 0.001;       // of the greatest force
constexpr double normal_median = 0.6745;     // of the absolute value of what is normally distributed
constexpr double clear = 3.0;                // standard deviations
constexpr double onset_window = 0.25;        // of the way behind the onset, by which a specimen's is refined
constexpr double flat_slope = 0.3;           // of the slope behind the onset, at most, before it
constexpr double least_first_slope = 0.6;    // at the onset, of the mean slope behind it; gradual rises have less
constexpr double usual_curvature = 0.3;      // of the force, that a term of the next power may be
constexpr double beginning_at_rest = 0.005;  // of the force's rise, in the first row of a probe that does not touch
constexpr std::size_t flat_rows = 3;
constexpr int foot_passes = 6;
constexpr std::size_t rows_of_beginning = 12;
constexpr double usual_offset = 0.002;  // of the greatest force, below which an offset is none
constexpr double great_offset = 0.02;   // likewise, where no row is at zero

std::string worded(const char* format, auto... values) {
  std::array<char, 400> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return text.data();
}

struct Row {
  double u, v;  // extension and force in the direction of loading
};
using Rows = std::vector<Row>;

// Median of what values differ by from the cubic through two neighbours on either side, as a standard deviation.
double scatter_of(const Rows& rows, double Row::*of, double Row::*along) {
  std::vector<double> residuals;
  for (std::size_t i = 2; i + 2 < rows.size(); ++i) {
    double sum = 0.0, squares = 0.0;
    for (std::size_t j = i - 2; j <= i + 2; ++j) {
      double weight = 1.0;
      for (std::size_t k = i - 2; k <= i + 2; ++k)
        if (k != j) weight /= rows[j].*along - rows[k].*along;
      sum += weight * rows[j].*of, squares += weight * weight;
    }
    if (std::isfinite(squares)) residuals.push_back(std::abs(sum) / std::sqrt(squares));
  }
  return residuals.size() < 3 ? 0.0 : median(std::move(residuals)) / normal_median;
}

// The same of numbers that are evenly apart in time.
double scatter_in_time(const std::vector<double>& values) {
  Rows rows;
  for (std::size_t i = 0; i < values.size(); ++i) rows.push_back({double(i), values[i]});
  return scatter_of(rows, &Row::v, &Row::u);
}

// Rows that go beyond all before them, and how often the test went back.
struct Envelope {
  Rows rows;
  int reversals = 0;
  int loadings = 0;  // cycles of which a part is taken
};

Envelope envelope_of(const std::vector<double>& u, const std::vector<double>& v) {
  const double reach = *std::ranges::max_element(u) - u.front();
  const double scatter = scatter_in_time(u), noise = scatter > 1e-6 * reach ? scatter : 0.0;  // no rounding
  const double step_back = std::max(reversal * reach, 6.0 * noise);
  Envelope result;
  double most = u.front(), turn = u.front(), taken_from = -infinite;
  bool goes_back = false, has_gone_back = false, is_taken = false;
  for (std::size_t i = 0; i < u.size(); ++i) {
    turn = goes_back ? std::min(turn, u[i]) : std::max(turn, u[i]);
    if (goes_back ? u[i] > turn + step_back : u[i] < turn - step_back) {
      goes_back = !goes_back, turn = u[i];
      if (goes_back) ++result.reversals, has_gone_back = true, is_taken = false;
      if (goes_back && !result.rows.empty()) {  // rows on the way back, before it was told from noise, are none of it
        const auto top = std::ranges::max_element(result.rows, {}, &Row::u);
        taken_from = top->u + step_back;
        result.rows.erase(top + 1, result.rows.end());
      }
    }
    const bool is_beyond = i == 0 || u[i] > most - (has_gone_back && !is_taken ? 0.0 : 2.0 * noise);
    most = std::max(most, u[i]);
    if (goes_back || !is_beyond || !(u[i] > taken_from)) continue;
    result.loadings += !is_taken;
    is_taken = true;
    result.rows.push_back({u[i], v[i]});
  }
  return result;
}

// Rows averaged over even steps of the extension from `begin` on.
struct Point {
  double u = 0.0, v = 0.0, count = 0.0;
};
std::vector<Point> averaged(const Rows& rows, double begin, std::size_t most) {
  double end = begin;
  for (const Row& row : rows) end = std::max(end, row.u);
  std::vector<Point> bins(most), points;
  for (const Row& row : rows) {
    if (!(row.u > begin)) continue;
    const double place = std::ceil((row.u - begin) / (end - begin) * double(most) - 1e-9) - 1.0;
    Point& bin = bins[std::min(most - 1, std::size_t(std::max(0.0, place)))];
    bin.u += row.u, bin.v += row.v, bin.count += 1.0;
  }
  for (const Point& bin : bins)
    if (bin.count > 0.0) points.push_back({bin.u / bin.count, bin.v / bin.count, bin.count});
  return points;
}

// How well forces follow v = level + c (u - onset)^power + d (u - onset)^(power + 1) behind an onset, and `level`
// before.
struct OnsetFit {
  double onset = 0.0, level = 0.0, level_std = 0.0, slope = 0.0;  // slope: c
  double chi2 = std::numeric_limits<double>::infinity();
  double onset_std = 0.0;
  std::size_t before = 0;  // points before the onset
};

class OnsetSearch {
 public:
  OnsetSearch(std::vector<Point> points, double noise, double power) : points_(std::move(points)), power_(power) {
    least_ = greatest_ = points_.front().v;
    for (const Point& p : points_) least_ = std::min(least_, p.v), greatest_ = std::max(greatest_, p.v);
    rise_ = greatest_ - least_, reach_ = points_.back().u - points_.front().u;
    for (const Point& p : points_)
      variances_.push_back(noise * noise / p.count + std::pow(class_of_cell * (p.v - least_), 2) +
                           std::pow(1e-6 * rise_, 2));
  }

  const std::vector<Point>& points() const { return points_; }
  double deviation(std::size_t i) const { return std::sqrt(variances_[i]); }

  // At one onset; the level is free or zero.
  OnsetFit at(double onset, bool has_level) const {
    MatrixX normal = MatrixX::Zero(3, 3);
    VectorX right = VectorX::Zero(3);
    OnsetFit fit;
    fit.onset = onset;
    double squares = 0.0;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const double way = std::max(0.0, points_[i].u - onset), rise = std::pow(way, power_);
      const Vector3 row(1.0, rise, rise * way);
      fit.before += points_[i].u <= onset;
      normal += row * row.transpose() / variances_[i];
      right += row * points_[i].v / variances_[i];
      squares += points_[i].v * points_[i].v / variances_[i];
    }
    const double whole = std::pow(reach_, power_ + 1.0) / (usual_curvature * rise_);
    normal(2, 2) += whole * whole;
    if (!has_level) normal.row(0).setZero(), normal.col(0).setZero(), normal(0, 0) = 1.0, right[0] = 0.0;
    const Eigen::LDLT<MatrixX> factor(normal);
    const VectorX c = factor.solve(right);
    fit.level = c[0], fit.slope = c[1];
    fit.level_std = std::sqrt(std::max(0.0, factor.solve(Vector3::UnitX())[0]));
    fit.chi2 = squares - 2.0 * c.dot(right) + c.dot(normal * c) - (has_level ? 0.0 : c[0] * c[0]);
    return fit;
  }

  // The best of onsets in an interval, with the standard deviation that the curve gives it.
  OnsetFit best(double low, double high, bool has_level) const {
    OnsetFit best;
    double step = (high - low) / onset_candidates;
    for (int pass = 0; pass < 3; ++pass) {
      for (int k = 0; k <= onset_candidates; ++k)
        if (const OnsetFit fit = at(low + step * k, has_level); fit.chi2 < best.chi2 && fit.slope > 0.0) best = fit;
      low = best.onset - step, step = 2.0 * step / onset_candidates;
    }
    const double h = std::max(1e-4 * reach_, step);
    const double excess = std::max(1.0, best.chi2 / double(points_.size()));
    const double bend =
        (at(best.onset + h, has_level).chi2 - 2.0 * best.chi2 + at(best.onset - h, has_level).chi2) / (h * h);
    best.onset_std = bend > 0.0 ? std::sqrt(2.0 * excess / bend) : reach_;
    return best;
  }

  double reach() const { return reach_; }
  double rise() const { return rise_; }

 private:
  std::vector<Point> points_;
  std::vector<double> variances_;
  double power_, least_ = 0.0, greatest_ = 0.0, rise_ = 0.0, reach_ = 0.0;
};

// Slope of a straight line through points.
double slope_of(std::span<const Point> points) {
  double n = 0.0, u = 0.0, v = 0.0, uu = 0.0, uv = 0.0;
  for (const Point& p : points) n += 1, u += p.u, v += p.v, uu += p.u * p.u, uv += p.u * p.v;
  const double spread = uu - u * u / n;
  return spread > 0.0 ? (uv - u * v / n) / spread : 0.0;
}

// Where the loading begins: what is to be taken off extensions and forces.
struct Zero {
  double extension = 0.0, force = 0.0;
  double std = 0.0;    // of the extension
  double begin = 0.0;  // extension from which rows are taken
};

class ZeroFinder {
 public:
  ZeroFinder(const Rows& rows, double noise, const LoadingOptions& options, std::vector<std::string>& notes)
      : rows_(rows), noise_(noise), options_(options), notes_(notes) {
    std::vector<double> steps;
    for (std::size_t i = 1; i < rows.size(); ++i) steps.push_back(rows[i].u - rows[i - 1].u);
    step_ = std::max(0.0, median(std::move(steps)));
  }

  Zero find() {
    if (rows_.size() < 6) return as_recorded();
    return options_.is_indentation ? contact() : specimen();
  }

 private:
  double first() const { return rows_.front().u; }
  bool begins_at_zero() const { return std::abs(first()) <= 2.5 * step_; }
  Zero as_recorded() const { return {0.0, 0.0, 0.0, begins_at_zero() ? 0.0 : std::max(first() - 1e-9 * step_, 0.0)}; }

  std::string in_u(double u) const { return worded("%.4g %s", u * options_.extension.scale, options_.extension.name); }
  std::string in_v(double v) const { return worded("%.3g %s", v * options_.force.scale, options_.force.name); }

  // A specimen's rise behind a flat part; nothing where there is none.
  std::optional<Zero> slack() const {
    const OnsetSearch wide(averaged(rows_, first() - step_, onset_points), noise_, 1.0);
    OnsetFit fit = wide.best(first(), first() + 0.8 * wide.reach(), true);
    const double end = fit.onset + onset_window * (first() + wide.reach() - fit.onset);
    Rows near;
    std::ranges::copy_if(rows_, std::back_inserter(near), [&](const Row& row) { return row.u <= end; });
    if (near.size() < 2 * flat_rows) return std::nullopt;
    const std::vector<Point> all = averaged(near, first() - step_, onset_points);
    const OnsetSearch whole(all, noise_, 1.0);
    // Without the foot, the points about the onset that rise gradually.
    std::vector<Point> straight = all;
    std::size_t foot = 0, behind = 0;
    for (int pass = 0; pass < foot_passes; ++pass) {
      fit = OnsetSearch(straight, noise_, 1.0).best(first(), end, true);
      const auto lies_off = [&](std::size_t i) {
        const double rise = fit.slope * std::max(0.0, all[i].u - fit.onset);
        return all[i].v - fit.level - rise > clear * whole.deviation(i);
      };
      foot = behind = std::size_t(std::ranges::count_if(all, [&](const Point& p) { return p.u <= fit.onset; }));
      while (behind < all.size() && lies_off(behind)) ++behind;
      while (foot > 0 && lies_off(foot - 1)) --foot;
      const double way =
          behind < all.size() ? all[behind].u - fit.onset : 0.0;  // as far again, where less is left of it
      if (behind > foot && behind < all.size())
        while (behind < all.size() && all[behind].u < fit.onset + 2.0 * way) ++behind;
      if (foot < flat_rows || all.size() - behind < flat_rows) return std::nullopt;
      straight.assign(all.begin(), all.begin() + std::ptrdiff_t(foot));
      straight.insert(straight.end(), all.begin() + std::ptrdiff_t(behind), all.end());
    }
    const std::span<const Point> flat(straight.data(), foot), rise(straight.data() + foot, straight.size() - foot);
    const double excess = std::max(1.0, fit.chi2 / double(straight.size()));
    const OnsetFit from_first = OnsetSearch(straight, noise_, 1.0).at(first() - step_, true);
    if (fit.slope < least_first_slope * slope_of(rise) || slope_of(flat) > flat_slope * fit.slope ||
        from_first.chi2 - fit.chi2 < clear * clear * excess)
      return std::nullopt;
    return Zero{fit.onset, fit.level, fit.onset_std, std::max(fit.onset, rise.front().u - 1e-9 * step_)};
  }

  // Level and slope at the first row: over the first rows, and over more of them as long as these agree.
  OnsetFit beginning() const {
    std::optional<OnsetFit> few, begin;
    for (const double part : {0.04, 0.1, 0.25}) {
      const double end = first() + part * (rows_.back().u - first());
      Rows near;
      std::ranges::copy_if(rows_, std::back_inserter(near),
                           [&](const Row& row) { return row.u <= end || near.size() < rows_of_beginning; });
      const OnsetFit fit = OnsetSearch(averaged(near, first() - step_, onset_points), noise_, 1.0).at(first(), true);
      if (!few) few = fit;
      if (std::abs(fit.level - few->level) <= 2.0 * few->level_std) begin = fit;
    }
    return begin.value_or(*few);
  }

  Zero specimen() {
    if (const auto found = slack()) return told_slack(*found);
    const OnsetFit begin = beginning();
    const double greatest = std::ranges::max_element(rows_, {}, &Row::v)->v;
    const bool has_row_at_zero = std::abs(first()) < 0.1 * step_ || !begins_at_zero();
    const auto is_offset = [&](double force) {
      const double least = has_row_at_zero ? usual_offset * greatest
                                           : std::max(great_offset * greatest, 0.5 * std::abs(rows_.front().v));
      return std::abs(force) > std::max(clear * begin.level_std, least);
    };
    const double crossing = begin.slope > 0.0 ? first() - begin.level / begin.slope : first();
    const bool begins_later = !begins_at_zero() && std::abs(crossing) < first() && crossing < 0.5 * first();
    Zero zero = as_recorded();
    if (begins_later) return zero;
    if (options_.keeps_force_zero) {
      if (options_.keeps_extension_zero || !is_offset(begin.level)) return moved(zero);
      zero.extension = crossing, zero.begin = first() - 1e-9 * step_;
      notes_.push_back("extensions count from where the force would be zero, " + in_u(crossing - first()) +
                       " from the first row: the force there, " + in_v(begin.level) + ", is kept as a preload");
      return zero;
    }
    const double offset = begin.level - (begins_at_zero() ? begin.slope * first() : 0.0);
    zero = moved(zero);
    if (!is_offset(offset)) return zero;
    zero.force = offset;
    notes_.push_back("forces count from " + in_v(offset) + ", the force at no extension (of " + in_v(greatest) +
                     " at most): an offset of the load cell; a preload is kept by --keep force-zero");
    return zero;
  }

  // Counted from the first row where that is not the machine's zero.
  Zero moved(Zero zero) {
    if (begins_at_zero() || options_.keeps_extension_zero) return zero;
    zero.extension = first(), zero.begin = first();
    notes_.push_back("extensions begin at " + in_u(first()) + " and count from there (--keep extension-zero)");
    return zero;
  }

  Zero told_slack(Zero found) {
    const double late = found.extension - first();
    if (options_.keeps_extension_zero) {
      notes_.push_back("the force begins " + in_u(late) + " late: kept, as --keep extension-zero says");
      found = {0.0, found.force, 0.0, std::max(first(), 0.0)};
    } else {
      notes_.push_back("the force begins " + in_u(late) +
                       " after the first row: slack is taken off, extensions count from " + in_u(found.extension) +
                       ", where the rise meets the level before it (toe compensation, ASTM D638; "
                       "--keep extension-zero)");
    }
    return with_level(found);
  }

  // The level before an onset is the force's zero.
  Zero with_level(Zero zero) {
    if (options_.keeps_force_zero) return zero.force = 0.0, zero;
    const double greatest = std::ranges::max_element(rows_, {}, &Row::v)->v;
    if (std::abs(zero.force) > std::max(noise_, 0.002 * greatest))
      notes_.push_back("forces count from " + in_v(zero.force) + ", the force before the loading (--keep force-zero)");
    return zero;
  }

  // The onset of a force that rises by a power of the way from there, with a level before it where that is worth its
  // number.
  OnsetFit onset_by(double power) const {
    const OnsetSearch search(averaged(rows_, first() - step_, onset_points), noise_, power);
    const double count = double(search.points().size());
    const bool begins_at_rest =
        search.points().front().v < std::max(clear * search.deviation(0), beginning_at_rest * search.rise());
    const double low = first() - (begins_at_rest ? step_ : 0.5 * search.reach()), high = first() + 0.9 * search.reach();
    const OnsetFit fit = search.best(low, high, false);
    if (options_.keeps_force_zero) return fit;
    const OnsetFit with_level = search.best(first() - step_, high, true);
    const double excess = std::max(1.0, with_level.chi2 / count);
    return fit.chi2 - with_level.chi2 > std::log(count) * excess ? with_level : fit;
  }

  Zero contact() {
    OnsetFit fit = onset_by(options_.power);
    double power = options_.power;
    if (const OnsetFit linear = onset_by(1.0); linear.chi2 < fit.chi2) fit = linear, power = 1.0;
    const Zero at_machine{0.0, fit.level, fit.onset_std, std::max(first() - 1e-9 * step_, 0.0)};
    const std::string found = in_u(fit.onset) + " +- " + in_u(fit.onset_std);
    Zero zero = at_machine;
    if (options_.keeps_extension_zero) {
      zero.std = 0.0;
      notes_.push_back(
          "depths count from the machine's zero: it must be where the probe touches the object (the curve "
          "says at " +
          found + ")");
    } else if (std::abs(fit.onset) <= clear * fit.onset_std) {
      notes_.push_back("depths count from the machine's zero, where the curve says that the probe touches (" + found +
                       ")");
    } else {
      zero.extension = fit.onset, zero.begin = std::max(fit.onset, first() - 1e-9 * step_);
      notes_.push_back("depths count from where the curve says that the probe touches, " + found +
                       " by the machine, where force ~ depth^" + worded("%g", power) +
                       " begins (--keep extension-zero)");
    }
    const auto air = std::ranges::count_if(rows_, [&](const Row& row) { return row.u < zero.extension; });
    if (air > 0) notes_.push_back(worded("%td rows before contact are left out", air));
    return with_level(zero);
  }

  const Rows& rows_;
  double noise_;
  const LoadingOptions& options_;
  std::vector<std::string>& notes_;
  double step_ = 0.0;
};

// Rows in the direction in which the test goes farthest, from a sign of the force that resists.
struct Directed {
  std::vector<double> u, v;
  double extension_sign = 1.0, force_sign = 1.0;
};

Directed directed(const std::vector<double>& extensions, const std::vector<double>& forces, const std::string& name) {
  Directed d;
  for (std::size_t i = 0; i < extensions.size(); ++i)
    if (std::isfinite(extensions[i]) && std::isfinite(forces[i]))
      d.u.push_back(extensions[i]), d.v.push_back(forces[i]);
  if (d.u.size() < 2) refuse(name, std::to_string(d.u.size()) + " lines of numbers", "a curve");
  const auto farthest = std::ranges::max_element(d.u, {}, [&](double u) { return std::abs(u - d.u.front()); });
  const double way = *farthest - d.u.front();
  if (way == 0.0) refuse(name, "an extension that does not change", "a test that moves the crosshead");
  d.extension_sign = way < 0.0 ? -1.0 : 1.0;
  const auto last = std::size_t(farthest - d.u.begin()) + 1;
  double base = d.v.front(), extreme = base;
  for (std::size_t i = 0; i < last; ++i)
    if (std::abs(d.v[i] - base) > std::abs(extreme - base)) extreme = d.v[i];
  if (extreme == base) refuse(name, "a force that is the same throughout", "a measured force");
  d.force_sign = extreme < base ? -1.0 : 1.0;
  for (double& u : d.u) u *= d.extension_sign;
  for (double& v : d.v) v *= d.force_sign;
  return d;
}

// Rows up to the greatest force, where it falls by more than a quarter behind.
void cut_break(Rows& rows, const LoadingOptions& options, std::vector<std::string>& notes) {
  const auto top = std::ranges::max_element(rows, {}, &Row::v);
  const double least = std::ranges::min_element(rows.begin(), top + 1, {}, &Row::v)->v;
  const bool falls = std::any_of(top, rows.end(),
                                 [&](const Row& row) { return row.v - least < (1.0 - break_fall) * (top->v - least); });
  if (!falls) return;
  const std::size_t behind = std::size_t(rows.end() - top) - 1;
  const std::string where =
      worded("the force falls behind %.4g %s, as of a specimen that breaks: ", top->u * options.extension.scale,
             options.extension.name);
  if (options.keeps_break) return notes.push_back(where + "kept, as --keep break says");
  notes.push_back(where + worded("%zu rows are left out (--keep break)", behind));
  rows.erase(top + 1, rows.end());
}

}  // namespace

LoadingCurve first_loading(const std::vector<double>& extensions, const std::vector<double>& forces,
                           const LoadingOptions& options, const std::string& name) {
  LoadingCurve curve;
  const Directed test = directed(extensions, forces, name);
  curve.extension_sign = test.extension_sign, curve.force_sign = test.force_sign;
  Envelope envelope = envelope_of(test.u, test.v);
  if (envelope.reversals > 0)
    curve.notes.push_back(worded(
        envelope.loadings > 1
            ? "the test goes back %d times: taken is what loads it for the first time, the parts of %d cycles beyond "
              "all extensions before"
            : "the test goes back %d times: taken is the first loading alone (%d cycle)",
        envelope.reversals, envelope.loadings));
  else
    curve.notes.emplace_back("taken is the first loading, up to the greatest extension");
  Rows& rows = envelope.rows;
  cut_break(rows, options, curve.notes);
  std::ranges::stable_sort(rows, {}, &Row::u);
  const double noise = scatter_of(rows, &Row::v, &Row::u), resolution = options.force_resolution;
  const Zero zero = ZeroFinder(rows, std::hypot(noise, resolution / std::sqrt(12.0)), options, curve.notes).find();
  curve.zero_std = zero.std;
  const std::vector<Point> points = averaged(rows, zero.begin, curve_points);
  if (points.size() < 2) refuse(name, "fewer than two points of a first loading", "a curve");
  double greatest = 0.0;
  for (const Point& p : points) greatest = std::max(greatest, std::abs(p.v - zero.force));
  if (!(greatest > 0.0)) refuse(name, "a force that is zero throughout", "a measured force");
  for (const Point& p : points) {
    const double v = p.v - zero.force;
    curve.extensions.push_back(p.u - zero.extension), curve.forces.push_back(v);
    curve.stds.push_back(options.force_std > 0.0
                             ? options.force_std
                             : std::sqrt(noise * noise / p.count + resolution * resolution / 12.0 +
                                         std::pow(class_of_cell * v, 2) + std::pow(zero_of_cell * greatest, 2)));
  }
  if (!(options.force_std > 0.0))
    curve.notes.push_back(worded(
        "the force's standard deviation: its scatter, %.2g %s, the file's resolution, %.2g %s, and of the load cell "
        "0.5 %% of the force and 0.1 %% of the greatest (--force-std)",
        noise * options.force.scale, options.force.name, resolution * options.force.scale, options.force.name));
  return curve;
}

}  // namespace pliant
