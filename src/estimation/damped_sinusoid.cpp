#include "estimation/damped_sinusoid.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/median.hpp"

namespace pliant {

namespace {

constexpr double padding = 8.0;          // grid points a resolved width 2 pi / T
constexpr double nyquist_share = 0.9;    // above, a coarse sampling's alias weighs as much
constexpr double visible = 3.0;          // decay times until a twentieth is left
constexpr int refinements = 60;          // of the compass search; each halves or keeps its steps
constexpr double fewest_periods = 1.5;   // fewer cannot be told from a settling value that is not yet reached
constexpr double most_damping = 0.5;     // ratio; beyond, the second swing is below a fortieth of the first
constexpr double least_explained = 0.3;  // share of the variance ...
constexpr double noise_explained = 8.0;  // ... or this times ln(n) / n: the highest of n peaks of white noise explains
                                         // about 2 ln(n) / n

/// What a sinusoid of given frequency and decay explains of a signal, about what is fitted along.
class Periodogram {
 public:
  Periodogram(const std::vector<double>& times, const VectorX& signal, const std::vector<DampedSinusoid>& known)
      : t_(Eigen::Map<const VectorX>(times.data(), Eigen::Index(times.size())).array() - times.front()) {
    MatrixX along(t_.size(), 1 + 2 * Eigen::Index(known.size()));
    along.col(0).setOnes();
    for (std::size_t k = 0; k < known.size(); ++k)
      along.middleCols<2>(1 + 2 * Eigen::Index(k)) = columns(known[k].omega, known[k].decay);
    const Eigen::ColPivHouseholderQR<MatrixX> qr(along);
    const MatrixX identity = MatrixX::Identity(along.rows(), qr.rank());
    basis_ = qr.householderQ() * identity;
    signal_ = without_basis(signal);
  }

  Eigen::Index unknowns() const { return basis_.cols(); }
  double total() const { return signal_.squaredNorm(); }
  double span() const { return t_[t_.size() - 1]; }

  double power(double omega, double decay) const {
    Eigen::Vector2d b;
    return solve(omega, decay, b);
  }
  double amplitude(double omega, double decay) const {
    Eigen::Vector2d b;
    solve(omega, decay, b);
    return b.norm();
  }

 private:
  using Columns = Eigen::Matrix<double, Eigen::Dynamic, 2>;

  Columns columns(double omega, double decay) const {
    Columns c(t_.size(), 2);
    const Eigen::ArrayXd envelope = (-decay * t_.array()).exp();
    c.col(0) = envelope * (omega * t_.array()).cos();
    c.col(1) = envelope * (omega * t_.array()).sin();
    return c;
  }
  template <class Values>
  Values without_basis(const Values& v) const {
    return v - basis_ * (basis_.transpose() * v).eval();
  }
  /// Power explained, and the amplitudes of cosine and sine.
  double solve(double omega, double decay, Eigen::Vector2d& amplitudes) const {
    const Columns c = without_basis(columns(omega, decay));
    const Eigen::Matrix2d gram = c.transpose() * c;
    const Eigen::Vector2d rhs = c.transpose() * signal_;
    // Where the two are (nearly) dependent, a trace on the diagonal leaves the smaller of the amplitudes.
    amplitudes = (gram + 1e-9 * gram.trace() * Eigen::Matrix2d::Identity()).ldlt().solve(rhs);
    return std::isfinite(amplitudes.sum()) ? rhs.dot(amplitudes) : 0.0;
  }

  VectorX t_, signal_;
  MatrixX basis_;
};

/// Peak of the periodogram on a grid, between its points by a parabola.
double grid_peak(const Periodogram& periodogram, const FrequencyBand& band, double spacing) {
  const int count = std::max(3, int(std::ceil((band.most - band.least) / spacing)) + 1);
  const double step = (band.most - band.least) / (count - 1);
  VectorX power(count);
  for (int i = 0; i < count; ++i) power[i] = periodogram.power(band.least + i * step, 0.0);
  Eigen::Index peak = 0;
  power.maxCoeff(&peak);
  double shift = 0.0;
  if (peak > 0 && peak < count - 1) {
    const double bend = power[peak - 1] - 2.0 * power[peak] + power[peak + 1];
    if (bend < 0.0) shift = 0.5 * (power[peak - 1] - power[peak + 1]) / bend;
  }
  return band.least + (double(peak) + shift) * step;
}

/// Compass search for the best frequency and decay.
void refine(const Periodogram& periodogram, const FrequencyBand& band, double width, DampedSinusoid& sinusoid) {
  const double most_decay = sinusoid.omega;
  sinusoid.power = periodogram.power(sinusoid.omega, sinusoid.decay);
  for (const double decay : {0.5, 1.0, 2.0, 4.0, 8.0, 16.0})
    if (const double d = decay / periodogram.span(); d < most_decay)
      if (const double power = periodogram.power(sinusoid.omega, d); power > sinusoid.power)
        sinusoid.power = power, sinusoid.decay = d;
  double omega_step = 0.25 * width, decay_step = std::max(0.25 * width, 0.5 * sinusoid.decay);
  for (int i = 0; i < refinements; ++i) {
    DampedSinusoid best = sinusoid;
    for (const auto& [d_omega, d_decay] :
         {std::pair{omega_step, 0.0}, {-omega_step, 0.0}, {0.0, decay_step}, {0.0, -decay_step}}) {
      DampedSinusoid trial = sinusoid;
      trial.omega = std::clamp(sinusoid.omega + d_omega, band.least, band.most);
      trial.decay = std::clamp(sinusoid.decay + d_decay, 0.0, most_decay);
      trial.power = periodogram.power(trial.omega, trial.decay);
      if (trial.power > best.power) best = trial;
    }
    if (best.power > sinusoid.power)
      sinusoid = best;
    else
      omega_step *= 0.5, decay_step *= 0.5;
  }
}

}  // namespace

double DampedSinusoid::natural() const { return std::hypot(omega, decay); }

FrequencyBand resolvable_band(const std::vector<double>& times) {
  std::vector<double> intervals;
  for (std::size_t i = 1; i < times.size(); ++i) intervals.push_back(times[i] - times[i - 1]);
  if (intervals.empty()) return {1.0, 0.0};
  const double usual = median(std::move(intervals));
  return {2.0 * std::numbers::pi / (times.back() - times.front()), nyquist_share * std::numbers::pi / usual};
}

std::optional<DampedSinusoid> dominant_sinusoid(const std::vector<double>& times, const VectorX& signal,
                                                const FrequencyBand& band, const std::vector<DampedSinusoid>& known) {
  if (times.size() < 6 + 2 * known.size() || !(band.least < band.most)) return {};
  const Periodogram periodogram(times, signal, known);
  const double total = periodogram.total();
  if (!(total > 0.0) || !std::isfinite(total)) return {};
  const double width = 2.0 * std::numbers::pi / periodogram.span(), spacing = width / padding;
  DampedSinusoid sinusoid;
  sinusoid.omega = grid_peak(periodogram, band, spacing);
  refine(periodogram, band, width, sinusoid);
  sinusoid.amplitude = periodogram.amplitude(sinusoid.omega, sinusoid.decay);
  sinusoid.explained = std::clamp(sinusoid.power / total, 0.0, 1.0);
  sinusoid.is_at_edge = sinusoid.omega < band.least + 0.5 * spacing || sinusoid.omega > band.most - 0.5 * spacing;
  const double seen =
      sinusoid.decay > 0.0 ? std::min(periodogram.span(), visible / sinusoid.decay) : periodogram.span();
  sinusoid.periods = sinusoid.omega * seen / (2.0 * std::numbers::pi);
  // Curvature of the unexplained sum of squares.
  const double h = 0.1 * std::max(1.0 / periodogram.span(), sinusoid.decay);
  const double curvature = (2.0 * sinusoid.power - periodogram.power(sinusoid.omega + h, sinusoid.decay) -
                            periodogram.power(sinusoid.omega - h, sinusoid.decay)) /
                           (h * h);
  const double freedom = std::max(1.0, double(times.size()) - double(periodogram.unknowns()) - 4.0);
  const double variance = std::max(0.0, total - sinusoid.power) / freedom;
  sinusoid.deviation = curvature > 0.0 ? std::sqrt(2.0 * variance / curvature) : width;
  return sinusoid;
}

std::string rejection_reason(const DampedSinusoid& sinusoid, std::size_t samples) {
  const double n = double(samples);
  if (sinusoid.explained < std::max(least_explained, std::min(0.9, noise_explained * std::log(n) / n)))
    return "no oscillation stands out of its motion";
  if (sinusoid.is_at_edge) return "its strongest oscillation lies at the edge of what could be its frequency";
  if (sinusoid.periods < fewest_periods) return "it swings less than one and a half times";
  if (sinusoid.damping_ratio() > most_damping) return "it settles without swinging";
  return "";
}

}  // namespace pliant
