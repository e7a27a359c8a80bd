#include "estimation/modal_start.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "base/dense.hpp"
#include "base/error.hpp"

namespace pliant {

namespace {

constexpr int rigid_motions = 6;
constexpr int spare_modes = 4;  // that may cross those looked at while moduli change
constexpr std::size_t fewest_instants = 12;
constexpr double model_error = 0.02;        // of ln omega: meshes, clamps, sagging
constexpr double same_frequency = 0.05;     // of ln omega: modes closer than this may share one oscillation
constexpr double one_modulus_reach = 0.35;  // of ln omega, about where the strongest mode leads to expect a mode
constexpr double several_moduli_reach = 0.8;
constexpr double least_amplitude = 5e-3;  // over the strongest mode's: below, it is what a linear projection leaves
constexpr double least_spread = 0.2;      // of ln omega: below, decays do not tell the two dampings apart
constexpr double pull_deviation = 3.0;    // of ln E_k from their mean: ratios of twenty are not surprising
constexpr double start_contrast = 1.8;    // of ln E: one control six times as stiff as the others
constexpr int most_rounds = 6, most_iterations = 30;
constexpr double settled = 3e-3;  // of ln E_k between rounds

struct MatchedSinusoid {
  int mode;
  DampedSinusoid sinusoid;
  double observed, weight;  // ln omega without damping; inverse variance
};

/// The body's vibrations, rigid motions left out, for several ln E.
class Vibrations {
 public:
  Vibrations(std::shared_ptr<const Body> body, const MotionBlocks& blocks, const VectorX& parameters,
             const std::vector<int>& held, int count)
      : analysis_(std::move(body), blocks, held),
        blocks_(blocks),
        theta_(parameters),
        skipped_(held.empty() ? rigid_motions : 0) {
    const int half = 3 * (analysis_.body().node_count() - int(analysis_.held().size())) / 2;
    count_ = std::min(count, half - skipped_);
    solved_ = std::min(count_ + spare_modes, half - skipped_);
    if (count_ < 1)
      throw InputError({{},
                        std::to_string(2 * half) + " unknowns that are not held",
                        "enough for vibrations",
                        "use smaller elements, or hold less of the object"});
  }
  int controls() const { return analysis_.body().modulus.controls; }
  int count() const { return count_; }

  /// False where the modes cannot be found.
  bool solve(const VectorX& log_moduli) {
    for (int k = 0; k < controls(); ++k) theta_[blocks_.youngs_moduli[std::size_t(k)]] = std::exp(log_moduli[k]);
    all_ = analysis_.lowest(theta_, skipped_ + solved_);
    return all_.converged;
  }
  double log_omega(int mode) const { return 0.5 * std::log(all_.squared_frequencies[skipped_ + mode]); }
  /// d ln omega / d ln E_k, modes x controls.
  MatrixX log_derivatives() {
    MatrixX d = analysis_.modulus_derivatives(theta_, all_).bottomRows(solved_);
    for (int i = 0; i < solved_; ++i) d.row(i) *= 0.5 / all_.squared_frequencies[skipped_ + i];
    for (int k = 0; k < controls(); ++k) d.col(k) *= theta_[blocks_.youngs_moduli[std::size_t(k)]];
    return d;
  }
  std::vector<Points> shapes() const {
    return {all_.shapes.begin() + skipped_, all_.shapes.begin() + skipped_ + count_};
  }
  /// Which of the modes solved last looks most like each of these shapes, each taken once.
  std::vector<int> follow(const std::vector<Points>& shapes) const {
    MatrixX likeness(Eigen::Index(shapes.size()), solved_);
    for (std::size_t i = 0; i < shapes.size(); ++i) {
      const Points momentum = analysis_.mass_product(theta_, shapes[i]);
      for (int j = 0; j < solved_; ++j)
        likeness(Eigen::Index(i), j) =
            std::abs(flat(momentum).dot(flat(all_.shapes[std::size_t(skipped_) + std::size_t(j)])));
    }
    std::vector<int> found(shapes.size(), 0);
    for (std::size_t taken = 0; taken < shapes.size(); ++taken) {
      Eigen::Index i = 0, j = 0;
      likeness.maxCoeff(&i, &j);
      found[std::size_t(i)] = int(j);
      likeness.row(i).setConstant(-1.0);
      likeness.col(j).setConstant(-1.0);
    }
    return found;
  }
  /// Mode coordinates of the motion. A free body's rigid motions take part: what is left of them is not vibration.
  ModeCoordinates project(const TrackedMotion& motion, ModeProjection projection) const {
    std::vector<Points> taking_part(all_.shapes.begin(), all_.shapes.begin() + skipped_ + count_);
    VectorX stiffness = all_.squared_frequencies.head(skipped_ + count_) / all_.squared_frequencies[skipped_];
    stiffness.head(skipped_).setZero();
    ModeCoordinates c = motion.project(taking_part, stiffness, projection);
    c.values = c.values.rightCols(count_).eval();
    return c;
  }

 private:
  ModalAnalysis analysis_;
  MaterialBlocks blocks_;
  VectorX theta_;
  int skipped_, count_ = 0, solved_ = 0;
  Modes all_;
};

/// Finds the vibrations' oscillations in their coordinates.
class SinusoidSearch {
 public:
  SinusoidSearch(const ModeCoordinates& coordinates, const Vibrations& vibrations)
      : coordinates_(coordinates), vibrations_(vibrations), doubts_(std::size_t(vibrations.count())) {}

  std::vector<MatchedSinusoid> run() {
    std::vector<MatchedSinusoid> found;
    const FrequencyBand band = resolvable_band(coordinates_.times);
    std::vector<std::optional<DampedSinusoid>> alone;
    for (int j = 0; j < vibrations_.count(); ++j) {
      alone.push_back(dominant_sinusoid(coordinates_.times, coordinates_.values.col(j), band));
      doubts_[std::size_t(j)] =
          alone.back() ? rejection_reason(*alone.back(), coordinates_.times.size()) : "it does not move";
    }
    const auto power = [&](int j) { return alone[std::size_t(j)] ? alone[std::size_t(j)]->power : 0.0; };
    std::vector<int> order(alone.size());
    std::iota(order.begin(), order.end(), 0);
    std::ranges::stable_sort(order, [&](int a, int b) { return power(a) > power(b); });
    for (const int j : order) {
      if (found.empty()) {
        if (doubts_[std::size_t(j)].empty()) found.push_back(matched(j, *alone[std::size_t(j)]));
        continue;
      }
      const FrequencyBand near = expected(j, found.front(), band);
      const auto sinusoid =
          dominant_sinusoid(coordinates_.times, coordinates_.values.col(j), near, disturbing(j, found));
      doubts_[std::size_t(j)] =
          sinusoid ? rejection_reason(*sinusoid, coordinates_.times.size()) : "it is too fast or slow for the frames";
      if (sinusoid && sinusoid->amplitude < least_amplitude * found.front().sinusoid.amplitude)
        doubts_[std::size_t(j)] = "it hardly moves beside the strongest one";
      if (doubts_[std::size_t(j)].empty()) found.push_back(matched(j, *sinusoid));
    }
    return found;
  }
  /// Of each mode that `run` left out, why.
  const std::vector<std::string>& doubts_found() const { return doubts_; }

 private:
  static MatchedSinusoid matched(int mode, const DampedSinusoid& sinusoid) {
    const double deviation = sinusoid.deviation / sinusoid.natural();
    return {mode, sinusoid, std::log(sinusoid.natural()), 1.0 / (model_error * model_error + deviation * deviation)};
  }
  /// ln of how much faster the strongest mode is seen to be than modelled.
  double offset(const MatchedSinusoid& strongest) const {
    return strongest.observed - vibrations_.log_omega(strongest.mode);
  }
  FrequencyBand expected(int mode, const MatchedSinusoid& strongest, const FrequencyBand& band) const {
    const double reach = vibrations_.controls() == 1 ? one_modulus_reach : several_moduli_reach;
    const double middle = vibrations_.log_omega(mode) + offset(strongest);
    return {std::max(band.least, std::exp(middle - reach)), std::min(band.most, std::exp(middle + reach))};
  }
  /// Oscillations of stronger modes that a coordinate may take up because its shape is not quite right, and the
  /// strongest one's second harmonic, which large swings have; not those of modes as fast as this one.
  std::vector<DampedSinusoid> disturbing(int mode, const std::vector<MatchedSinusoid>& stronger) const {
    std::vector<DampedSinusoid> known;
    for (const MatchedSinusoid& m : stronger)
      if (std::abs(vibrations_.log_omega(m.mode) - vibrations_.log_omega(mode)) > same_frequency)
        known.push_back(m.sinusoid);
    DampedSinusoid harmonic = stronger.front().sinusoid;
    harmonic.omega *= 2.0, harmonic.decay *= 2.0;
    const double middle = vibrations_.log_omega(mode) + offset(stronger.front());
    if (std::abs(std::log(harmonic.omega) - middle) > same_frequency) known.push_back(harmonic);
    return known;
  }

  const ModeCoordinates& coordinates_;
  const Vibrations& vibrations_;
  std::vector<std::string> doubts_;
};

/// The match as a function of ln E, with modes recognised by their shapes.
class FrequencyMatch {
 public:
  FrequencyMatch(Vibrations& vibrations, const std::vector<MatchedSinusoid>& sinusoids, std::vector<Points> shapes)
      : vibrations_(vibrations), sinusoids_(sinusoids), shapes_(std::move(shapes)) {}

  /// ln (modelled / observed), one a sinusoid; empty where modes cannot be found.
  VectorX residuals(const VectorX& log_moduli) {
    if (!vibrations_.solve(log_moduli)) return {};
    modes_ = vibrations_.follow(shapes_);
    VectorX r(Eigen::Index(sinusoids_.size()));
    for (std::size_t t = 0; t < sinusoids_.size(); ++t)
      r[Eigen::Index(t)] = vibrations_.log_omega(modes_[std::size_t(sinusoids_[t].mode)]) - sinusoids_[t].observed;
    return r;
  }
  /// Of the residuals last computed, by ln E_k.
  MatrixX jacobian() {
    const MatrixX all = vibrations_.log_derivatives();
    MatrixX J(Eigen::Index(sinusoids_.size()), all.cols());
    for (std::size_t t = 0; t < sinusoids_.size(); ++t)
      J.row(Eigen::Index(t)) = all.row(modes_[std::size_t(sinusoids_[t].mode)]);
    return J;
  }
  VectorX weights() const {
    VectorX w(Eigen::Index(sinusoids_.size()));
    for (std::size_t t = 0; t < sinusoids_.size(); ++t) w[Eigen::Index(t)] = sinusoids_[t].weight;
    return w;
  }
  /// Which mode of the last solution each of the shapes is.
  const std::vector<int>& modes() const { return modes_; }

 private:
  Vibrations& vibrations_;
  const std::vector<MatchedSinusoid>& sinusoids_;
  std::vector<Points> shapes_;
  std::vector<int> modes_;
};

double mismatch_of(const VectorX& weights, const VectorX& residuals) {
  return residuals.size() == 0 ? std::numeric_limits<double>::quiet_NaN()
                               : weights.dot(residuals.cwiseAbs2()) / weights.sum();
}

struct Bounds {
  double least, most;  // of ln E
  VectorX clamped(const VectorX& q) const { return q.cwiseMax(least).cwiseMin(most); }
};

/// Curvature of the pull towards equal moduli.
MatrixX pull_towards_equal(Eigen::Index m) {
  return (MatrixX::Identity(m, m) - MatrixX::Constant(m, m, 1.0 / double(m))) / (pull_deviation * pull_deviation);
}

/// Levenberg and Marquardt's damped steps from ln E = q. False where modes cannot be found.
bool match_frequencies(FrequencyMatch& match, const Bounds& bounds, VectorX& q) {
  const Eigen::Index m = q.size();
  const VectorX w = match.weights();
  // All moduli together first: ln omega moves by half of it whatever the shapes are.
  VectorX r = match.residuals(q);
  if (r.size() == 0) return false;
  q = bounds.clamped(q.array() - 2.0 * w.dot(r) / w.sum());
  if (m == 1) return true;
  const MatrixX pull = pull_towards_equal(m);
  const auto cost = [&](const VectorX& at, const VectorX& residuals) {
    return w.dot(residuals.cwiseAbs2()) + at.dot(pull * at);
  };
  r = match.residuals(q);
  if (r.size() == 0) return false;
  double best = cost(q, r), damping = 1e-3;
  MatrixX J = match.jacobian();
  for (int iteration = 0; iteration < most_iterations; ++iteration) {
    MatrixX H = J.transpose() * w.asDiagonal() * J + pull;
    H.diagonal() += damping * H.diagonal();
    const VectorX step = -solve_symmetric(H, VectorX(J.transpose() * w.cwiseProduct(r) + pull * q));
    const VectorX trial = bounds.clamped(q + step.cwiseMax(-1.5).cwiseMin(1.5));
    const VectorX r_trial = match.residuals(trial);
    if (r_trial.size() > 0 && cost(trial, r_trial) < best) {
      const bool is_done = (trial - q).cwiseAbs().maxCoeff() < 0.1 * settled;
      q = trial, r = r_trial, best = cost(q, r), damping = std::max(1e-6, 0.2 * damping);
      if (is_done) return true;
      J = match.jacobian();
    } else {
      damping *= 5.0;
      if (damping > 1e6) return true;
    }
  }
  return true;
}

/// alpha and beta >= 0 with decay_j = (alpha + beta omega_j^2) / 2, by least squares of the decays over their
/// deviations.
void find_dampings(const std::vector<MatchedSinusoid>& sinusoids, ModalStart& start) {
  const DampedSinusoid& strongest = sinusoids.front().sinusoid;
  start.mass_damping = strongest.decay;
  start.stiffness_damping = strongest.decay / std::pow(strongest.natural(), 2);
  const auto [slow, fast] = std::ranges::minmax_element(sinusoids, {}, &MatchedSinusoid::observed);
  if (fast->observed - slow->observed < least_spread) return;
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d rhs = Eigen::Vector2d::Zero();
  for (const MatchedSinusoid& m : sinusoids) {
    const Eigen::Vector2d row(0.5, 0.5 * std::pow(m.sinusoid.natural(), 2));
    // The decay errs as much as omega, and by a tenth where the model of damping does.
    const double weight = 1.0 / (std::pow(m.sinusoid.deviation, 2) + std::pow(0.1 * m.sinusoid.decay, 2) + 1e-12);
    normal += weight * row * row.transpose();
    rhs += weight * m.sinusoid.decay * row;
  }
  Eigen::Vector2d found = normal.fullPivLu().solve(rhs);
  if (found[0] < 0.0) found = {0.0, rhs[1] / normal(1, 1)};
  if (found[1] < 0.0) found = {rhs[0] / normal(0, 0), 0.0};
  start.mass_damping = std::max(0.0, found[0]);
  start.stiffness_damping = std::max(0.0, found[1]);
  start.dampings_are_told_apart = true;
}

void describe_modes(const std::vector<MatchedSinusoid>& sinusoids, const std::vector<std::string>& doubts,
                    const FrequencyMatch& match, const Vibrations& vibrations, ModalStart& start) {
  double energy = 0.0, weight = 0.0;
  const auto energy_of = [](const DampedSinusoid& sinusoid) {
    return 0.5 * std::pow(sinusoid.natural() * sinusoid.amplitude, 2);
  };
  for (const MatchedSinusoid& m : sinusoids) energy += energy_of(m.sinusoid), weight += m.weight;
  for (int j = 0; j < vibrations.count(); ++j) {
    ObservedMode seen;
    seen.mode = j;
    seen.modelled_frequency = std::exp(vibrations.log_omega(match.modes()[std::size_t(j)])) / (2.0 * std::numbers::pi);
    const auto found = std::ranges::find(sinusoids, j, &MatchedSinusoid::mode);
    seen.is_used = found != sinusoids.end();
    if (seen.is_used) {
      seen.observed_frequency = found->sinusoid.natural() / (2.0 * std::numbers::pi);
      seen.relative_deviation = found->sinusoid.deviation / found->sinusoid.natural();
      seen.damping_ratio = found->sinusoid.damping_ratio();
      seen.energy = energy_of(found->sinusoid) / energy;
      seen.weight = found->weight / weight;
    } else {
      seen.reason = doubts[std::size_t(j)];
    }
    start.modes.push_back(std::move(seen));
  }
}

/// What one round of projection and match comes to.
struct Round {
  VectorX log_moduli;
  ModeCoordinates coordinates;
  std::vector<MatchedSinusoid> sinusoids;
  std::vector<std::string> doubts;  // of each mode
  std::vector<Points> shapes;       // which the coordinates and the sinusoids belong to
  double score =
      std::numeric_limits<double>::infinity();  // of rounds with equally many sinusoids the closest match is best
};

/// From the shapes that belong to ln E = q. `score` stays infinite where nothing swings or modes cannot be found.
Round run_round(Vibrations& vibrations, const TrackedMotion& motion, ModeProjection projection, const Bounds& bounds,
                const VectorX& q) {
  Round round;
  round.log_moduli = q;
  if (!vibrations.solve(q)) return round;
  round.coordinates = vibrations.project(motion, projection);
  SinusoidSearch search(round.coordinates, vibrations);
  round.sinusoids = search.run();
  round.doubts = search.doubts_found();
  round.shapes = vibrations.shapes();
  if (round.sinusoids.empty()) return round;
  FrequencyMatch match(vibrations, round.sinusoids, round.shapes);
  if (!match_frequencies(match, bounds, round.log_moduli)) return round;
  const VectorX residuals = match.residuals(round.log_moduli);
  if (residuals.size() > 0)
    round.score = (1.0 + match.weights().dot(residuals.cwiseAbs2())) / double(round.sinusoids.size());
  return round;
}

/// Rounds from each of the starts until the moduli stay; the best of all.
Round best_round(Vibrations& vibrations, const TrackedMotion& motion, ModeProjection projection, const Bounds& bounds) {
  const int m = vibrations.controls();
  Round best;
  for (int stiffer = -1; stiffer < (m > 1 ? m : 0); ++stiffer) {
    VectorX q = VectorX::Constant(m, 0.5 * (bounds.least + bounds.most));
    if (stiffer >= 0) q[stiffer] += start_contrast;
    for (int i = 0; i < most_rounds; ++i) {
      Round round = run_round(vibrations, motion, projection, bounds, q);
      const bool has_settled = (round.log_moduli - q).cwiseAbs().maxCoeff() < settled;
      const bool is_over = has_settled || m == 1 || !std::isfinite(round.score);
      q = round.log_moduli;
      if (round.score < best.score || best.log_moduli.size() == 0) best = std::move(round);
      if (is_over) break;
    }
  }
  return best;
}

void draw_curves(FrequencyMatch& match, const Bounds& bounds, int samples, const VectorX& q, ModalStart& start) {
  const VectorX w = match.weights(), at_q = match.residuals(q);
  for (int k = 0; k < int(q.size()) && samples > 0; ++k) {
    MatchCurve curve{k, VectorX::LinSpaced(samples, bounds.least, bounds.most), VectorX(samples)};
    for (int i = 0; i < samples; ++i) {
      VectorX at = q;
      at[k] = curve.moduli[i];
      const VectorX r = q.size() == 1 ? VectorX(at_q.array() + 0.5 * (at[0] - q[0])) : match.residuals(at);
      curve.mismatch[i] = mismatch_of(w, r);
    }
    curve.moduli = curve.moduli.array().exp();
    start.curves.push_back(std::move(curve));
  }
}

TrackedMotion make_motion(const Body& body, const TrackedPoints& tracked, const std::vector<double>& times,
                          int first_frame, bool is_free) {
  std::vector<SeenInstant> instants;
  for (const auto& [frame, seen] : tracked.frames) {
    if (frame < first_frame) continue;
    if (frame >= int(times.size()))
      throw InputError({{},
                        "followed points at frame " + std::to_string(frame),
                        "frames below " + std::to_string(times.size()),
                        "give a time for each frame"});
    instants.push_back({times[std::size_t(frame)], seen});
  }
  return {body, tracked.rest, std::move(instants), is_free};
}

void validate(const ModalStartOptions& options) {
  if (options.modes < 1)
    throw InputError({{}, std::to_string(options.modes) + " modes", "at least one", "the default is eight"});
  if (!(options.least_modulus > 0.0 && options.least_modulus < options.most_modulus))
    throw InputError(
        {{},
         "moduli from " + std::to_string(options.least_modulus) + " to " + std::to_string(options.most_modulus) + " Pa",
         "a range above zero",
         "the default is 1e3 to 1e8"});
}

}  // namespace

ModalStart modal_start(std::shared_ptr<const Body> body, const MotionBlocks& blocks, const VectorX& parameters,
                       const std::vector<int>& held, const TrackedPoints& tracked, const std::vector<double>& times,
                       const ModalStartOptions& options) {
  validate(options);
  const TrackedMotion motion = make_motion(*body, tracked, times, options.first_frame, held.empty());
  Vibrations vibrations(std::move(body), blocks, parameters, held, options.modes);
  const Bounds bounds{std::log(options.least_modulus), std::log(options.most_modulus)};
  ModalStart start;
  start.largest_rotation = motion.largest_rotation();
  if (motion.times().size() < fewest_instants)
    return start.reason = "followed points are seen at " + std::to_string(motion.times().size()) +
                          " instants; an oscillation takes at least " + std::to_string(fewest_instants),
           start;

  const Round best = best_round(vibrations, motion, options.projection, bounds);
  start.coordinates = best.coordinates;
  if (best.doubts.empty()) return start.reason = "the body's modes cannot be found", start;
  if (best.sinusoids.empty())
    return start.reason = "no vibration of the body is seen; of the lowest one: " + best.doubts.front(), start;
  const VectorX& q = best.log_moduli;
  FrequencyMatch match(vibrations, best.sinusoids, best.shapes);
  const VectorX residuals = match.residuals(q);
  if (residuals.size() == 0) return start.reason = "the body's modes cannot be found", start;
  start.mismatch = mismatch_of(match.weights(), residuals);
  start.moduli = q.array().exp();
  const MatrixX J = match.jacobian();
  const MatrixX H = J.transpose() * match.weights().asDiagonal() * J + pull_towards_equal(q.size());
  start.log_deviations = inverse(H).diagonal().cwiseSqrt();
  describe_modes(best.sinusoids, best.doubts, match, vibrations, start);
  find_dampings(best.sinusoids, start);
  draw_curves(match, bounds, options.curve_samples, q, start);
  if (q.minCoeff() <= bounds.least || q.maxCoeff() >= bounds.most)
    start.reason = "a modulus lies at the end of the range in which it was sought";
  else if (int(best.sinusoids.size()) < vibrations.controls())
    start.reason = std::to_string(best.sinusoids.size()) + " vibrations for " + std::to_string(vibrations.controls()) +
                   " moduli: what they leave open is as if the object were even";
  start.found = true;
  return start;
}

}  // namespace pliant
