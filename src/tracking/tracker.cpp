#include "tracking/tracker.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numeric>

#include "base/error.hpp"
#include "base/profile.hpp"
#include "elasticity/modes.hpp"
#include "geometry/subdivided.hpp"
#include "tracking/neighbours.hpp"

namespace pliant {

namespace {

using Clock = std::chrono::steady_clock;

class Stopwatch {
 public:
  explicit Stopwatch(double& seconds) : seconds_(seconds) {}
  ~Stopwatch() { seconds_ += std::chrono::duration<double>(Clock::now() - begin_).count(); }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;

 private:
  double& seconds_;
  Clock::time_point begin_ = Clock::now();
};

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  const auto at = values.begin() + std::ptrdiff_t(share * double(values.size() - 1));
  std::ranges::nth_element(values, at);
  return *at;
}

/// omega^2 [1/s^2] of the slowest vibration that is no rigid motion.
double slowest_vibration(const std::shared_ptr<const Body>& body, const MotionBlocks& blocks, const VectorX& theta,
                         const std::vector<int>& held) {
  const Modes found = modes(body, blocks, theta, held, held.empty() ? 7 : 1);
  if (!found.converged) throw InputError({{}, "the object's vibrations cannot be found: " + found.failure, "", ""});
  return found.squared_frequencies[found.count() - 1];
}

std::vector<Vector3> with(std::vector<Vector3> points, const std::vector<Vector3>& more) {
  points.insert(points.end(), more.begin(), more.end());
  return points;
}

bool is_in_picture(const PinholeCamera& camera, const Vector3& point) {
  const Vector3 seen = camera.project(point);
  return seen.z() > 0.0 && seen.x() > -0.5 && seen.x() < camera.width - 0.5 && seen.y() > -0.5 &&
         seen.y() < camera.height - 0.5;
}

constexpr int burst = 3;  // frames of outliers that pass

// Nearly backward Euler: velocities are those of the way from frame to frame, which rings for no mode of the body.
constexpr double implicit = 0.999;

}  // namespace

Tracker::Tracker(std::shared_ptr<const Body> body, const SimulationOptions& scene, const VectorX& theta,
                 const TriangleMesh& surface, std::vector<PinholeCamera> cameras, const std::vector<Vector3>& markers,
                 int typical, double noise, const TrackOptions& options)
    : body_(std::move(body)),
      surface_(subdivided(surface, options.sample_spacing * body_->size(), options.most_samples)),
      cameras_(std::move(cameras)),
      options_(options),
      size_(body_->size()),
      mass_(theta[scene.blocks.density] * body_->volume()),
      noise_(noise),
      typical_(std::max(1, typical)),
      samples_(int(surface_.vertices.size())),
      levels_(sample_levels(surface_)),
      visible_(surface_.vertices.size(), 1.0),
      density_(surface_.vertices.size(), 1.0),
      outlier_share_(options.outlier_share) {
  while (mark_level_ + 1 < levels_.size() && int(levels_[mark_level_ + 1].vertex.size()) >= options.marks / 2)
    ++mark_level_;
  const double area = std::accumulate(levels_.front().area.begin(), levels_.front().area.end(), 0.0);
  finest_ = 0.7 * std::sqrt(area / double(samples_));
  std::vector<std::unique_ptr<ForceTerm>> terms = scene_forces(body_, scene);
  auto springs = std::make_unique<PointSprings>(*body_, Embedding(*body_, with(surface_.vertices, markers)));
  springs_ = springs.get();
  terms.push_back(std::move(springs));
  StepOptions steps;
  steps.dt = 1.0;
  steps.newmark_theta = implicit;
  steps.contact_weight = scene.contact_weight;
  steps.solver = scene.solver;
  stepper_ = std::make_unique<Stepper>(body_, std::move(terms), scene.blocks, steps);
  const std::vector<int> held = held_nodes(*body_, scene.holds);
  stepper_->hold(eliminated_nodes(*body_, scene));
  stepper_->set_parameters(theta);
  is_free_ = held.empty();
  slowest_ = slowest_vibration(body_, scene.blocks, theta, held);
  pendulum_ = scene.blocks.gravity.vector(theta).norm() / size_;
  const Points& rest = body_->scanned_positions();
  state_ = {rest, Points::Zero(rest.rows(), 3)};
  const Vector3 linear = scene.blocks.linear_velocity.vector(theta);
  const Matrix3 spin = cross_matrix(scene.blocks.angular_velocity.vector(theta));
  state_.v = ((rest.rowwise() - body_->centre_of_mass().transpose()) * spin.transpose()).rowwise() + linear.transpose();
  if (!cameras_.empty()) rays_.add(surface_);
}

std::vector<Vector3> Tracker::marks() const {
  std::vector<Vector3> marks;
  for (const int v : levels_[mark_level_].vertex) marks.push_back(surface_.vertices[std::size_t(v)]);
  return marks;
}

TrackedFrame Tracker::hold(const TrackView& view) {
  state_.v.setZero();
  TrackedFrame frame = look(0.0, true, view);
  frame.is_held = true;
  return frame;
}

TrackedFrame Tracker::compare(const TrackView& view) {
  TrackedFrame frame;
  frame.nodes = state_.x;
  see(state_.x);
  describe(state_.x, view, frame);
  return frame;
}

TrackedFrame Tracker::advance(double dt, const TrackView& view) { return look(dt, false, view); }

const SampleLevel& Tracker::level_for(double deviation) const {
  constexpr double densest = 1.2;  // deviations between samples: a mixture of such Gaussians is still smooth
  std::size_t level = 0;
  while (level + 1 < levels_.size() && levels_[level + 1].spacing <= densest * deviation) ++level;
  return levels_[level];
}

Points Tracker::samples_of(const SampleLevel& level, const Points& nodes) const {
  Points samples(Eigen::Index(level.vertex.size()), 3);
  for (std::size_t i = 0; i < level.vertex.size(); ++i)
    samples.row(Eigen::Index(i)) = springs_->points().position(level.vertex[i], nodes).transpose();
  return samples;
}

std::vector<double> Tracker::shares_of(const SampleLevel& level) const {
  constexpr double hidden = 0.01;  // of what is visible: a camera sees a little around corners
  std::vector<double> shares(level.vertex.size());
  double sum = 0.0;
  for (std::size_t i = 0; i < shares.size(); ++i) {
    const auto v = std::size_t(level.vertex[i]);
    shares[i] = level.area[i] * std::max(hidden, visible_[v]) * density_[v];
    sum += shares[i];
  }
  for (double& share : shares) share /= sum;
  return shares;
}

void Tracker::learn_density(const SampleLevel& level, const std::vector<double>& shares, const Correspondence& c) {
  if (c.explained_points <= 0.0) return;
  const double prior = options_.density_prior;
  std::vector<double> density(shares.size());
  for (std::size_t i = 0; i < shares.size(); ++i) {
    const double before = shares[i] / density_[std::size_t(level.vertex[i])];  // up to a factor
    const double seen = c.mass[Eigen::Index(i)] / c.explained_points;
    density[i] = before > 0.0 ? (seen / before + prior) / (1.0 + prior) : 1.0;
  }
  for (std::size_t v = 0; v < density_.size(); ++v) density_[v] = density[std::size_t(level.sample_of[v])];
}

Points Tracker::normals_of(const Points& vertices) const {
  TriangleMesh now{{}, surface_.triangles};
  now.vertices.reserve(std::size_t(samples_));
  for (int v = 0; v < samples_; ++v) now.vertices.push_back(vertices.row(v).transpose());
  Points normals(samples_, 3);
  const std::vector<Vector3> of_vertices = vertex_normals(now);
  for (int v = 0; v < samples_; ++v) normals.row(v) = of_vertices[std::size_t(v)].transpose();
  return normals;
}

void Tracker::see(const Points& nodes) {
  if (cameras_.empty()) return;
  const Stopwatch watch(times_.visibility);
  constexpr double clear = 2e-3;  // of the size: a ray begins so far outside
  const Points vertices = samples_of(levels_.front(), nodes);
  rays_.set_vertices(0, vertices);
  const Points normals = normals_of(vertices);
  std::ranges::fill(visible_, 0.0);
  for (std::size_t v = 0; v < visible_.size(); ++v) {
    const Vector3 vertex = vertices.row(Eigen::Index(v)), normal = normals.row(Eigen::Index(v));
    for (const PinholeCamera& camera : cameras_) {
      const Vector3 from = vertex + clear * size_ * normal, to = camera.camera_to_world.translation - from;
      const double cosine = to.normalized().dot(normal);
      if (cosine > visible_[v] && is_in_picture(camera, vertex) && !rays_.is_blocked(from, to, 0.0, 1.0))
        visible_[v] = cosine;
    }
  }
}

double Tracker::spread(const TrackView& view) const {
  double sum = 0.0;
  for (const float noise : view.noise) sum += double(noise) * double(noise);
  return view.noise.empty() ? noise_ : std::sqrt(sum / double(view.noise.size()));
}

double Tracker::volume_of(const TrackView& view) const {
  constexpr double thinnest = 0.2;  // of the size: points of one side are flat
  if (view.points.empty()) return std::pow(size_, 3);
  Vector3 low = view.points.front(), high = low;
  for (const Vector3& point : view.points) low = low.cwiseMin(point), high = high.cwiseMax(point);
  return (high - low).cwiseMax(thinnest * size_).prod();
}

bool Tracker::relax(Points& delta, double tolerance) {
  const Stopwatch watch(times_.motion);
  constexpr int most = 15;
  constexpr double least_share = 0.05;
  // Each step finds the end as if rotations did not change on the way there, which overshoots where load stiffens or
  // softens the body more than its elasticity does. Aitken's dynamic relaxation finds the share that does not.
  Points way, last_way;
  double share = 1.0;
  for (int i = 0; i < most; ++i) {
    Points end = delta;
    if (!stepper_->prepare(state_, delta) || !stepper_->solve(state_, end).converged) return false;
    last_way.swap(way);
    way = end - delta;
    const double farthest = way.cwiseAbs().maxCoeff();
    if (farthest < tolerance) {
      delta += way;
      return true;
    }
    if (i > 0) {
      const Points change = way - last_way;
      share = std::clamp(-share * last_way.cwiseProduct(change).sum() / change.squaredNorm(), least_share, 1.0);
    }
    delta += share * way;
  }
  return true;  // as near as a round needs: the next one goes on
}

bool Tracker::drift(double dt) {
  constexpr int steps = 4;
  springs_->clear();
  for (int i = 0; i < steps; ++i) {
    stepper_->set_time_step(dt / steps);
    Points delta = dt / steps * state_.v;
    if (!relax(delta, 1e-5 * size_)) return false;
    stepper_->advance(delta, state_);
  }
  return true;
}

double Tracker::choose(std::vector<Points> candidates, const TrackView& view, Points& delta) const {
  constexpr std::size_t most = 400;  // points are enough to tell poses apart
  constexpr double most_outliers = 0.5;
  double best = std::numeric_limits<double>::infinity();
  for (Points& candidate : candidates) {
    const Points nodes = state_.x + candidate;
    const Points samples = samples_of(levels_.front(), nodes);
    const Neighbours near(samples);
    std::vector<double> distances;
    const std::size_t stride = std::max<std::size_t>(1, view.points.size() / most);
    for (std::size_t i = 0; i < view.points.size(); i += stride)
      distances.push_back(std::sqrt(near.nearest(view.points[i]).squared_distance));
    for (const TrackObservation& seen : view.markers)
      distances.push_back((springs_->points().position(samples_ + seen.point, nodes) - seen.position).norm());
    // What was no part of the object a moment ago is hardly one now.
    const double distance = quantile(std::move(distances), 0.8 * (1.0 - std::min(outlier_share_, most_outliers)));
    if (distance < best) best = distance, delta = std::move(candidate);
  }
  return best;
}

bool Tracker::maximise(double dt, bool at_rest, const TrackView& view, double distance, Points& delta,
                       TrackedFrame& frame) {
  const double noise = spread(view), least = std::max(finest_, noise), widest = options_.widest * size_;
  const double inertia = at_rest ? 0.0 : 1.0 / (dt * dt);
  // Between slow frames a free body would fall out of sight: something that nobody told of carries it.
  const bool is_flying = is_free_ && inertia > pendulum_;
  const double motion = (is_flying ? options_.free_weight : options_.data_weight) * (pendulum_ + inertia);
  const double shape = (is_free_ ? options_.shape_weight : options_.data_weight) * slowest_;
  const double stiffness = mass_ * (motion + shape);  // of all springs [N/m]
  const double sharpest = std::hypot(least, noise);
  // Points spread about a surface that fits by a little less than the deviation they are sought with.
  constexpr double sharpening = 0.85, settled = 0.95;
  const double volume = volume_of(view);
  double sigma = std::clamp(distance, least, std::max(least, widest));
  see(state_.x + delta);
  bool saw_again = false;
  for (frame.rounds = 1; frame.rounds <= options_.max_rounds; ++frame.rounds) {
    const SampleLevel& level = level_for(std::hypot(sigma, noise));
    const Points nodes = state_.x + delta;
    Correspondence c;
    {
      const Stopwatch watch(times_.correspondence);
      MixtureOptions mixture{sigma, outlier_share_, volume};
      const std::vector<double> shares = shares_of(level);
      c = expect(samples_of(level, nodes), shares, {view.points, view.noise}, mixture);
      learn_density(level, shares, c);
    }
    // Wider correspondences are blunter: their springs are softer, though not by as much as eq. 5 has it with a
    // constant eta, which would hardly draw a far surface at all.
    const double eta = stiffness * sharpest * std::hypot(sigma, noise) / typical_;
    VectorX k = VectorX::Zero(springs_->count());
    Points targets = Points::Zero(springs_->count(), 3), normals = Points::Zero(springs_->count(), 3);
    normals.topRows(samples_) = normals_of(samples_of(levels_.front(), nodes));
    for (std::size_t i = 0; i < level.vertex.size(); ++i) {
      k[level.vertex[i]] = eta * c.precision[Eigen::Index(i)];
      targets.row(level.vertex[i]) = c.target.row(Eigen::Index(i));
    }
    for (const TrackObservation& seen : view.markers) {
      k[samples_ + seen.point] = stiffness / double(view.markers.size());
      targets.row(samples_ + seen.point) = seen.position.transpose();
    }
    // Where the surface lies along itself shows in its ends and edges; what pulls it sideways elsewhere is mostly
    // chance.
    const double tangential = std::clamp(sigma / (options_.sliding * size_), 0.02, 1.0);
    springs_->set(std::move(k), std::move(targets), std::move(normals), tangential);
    const Points before = delta;
    if (!relax(delta, 0.02 * sigma)) return false;
    const double moved = (delta - before).rowwise().norm().maxCoeff();
    if (!view.points.empty()) {
      const double explained = c.explained_points / double(view.points.size());
      outlier_share_ = std::clamp(0.5 * outlier_share_ + 0.5 * (1.0 - explained), 0.01, 0.7);
    }
    const double seen = c.explained_points > 0.0 ? std::sqrt(c.sum_squares / (3.0 * c.explained_points)) : 0.0;
    const double next = std::clamp(sharpening * seen, std::max(least, options_.annealing * sigma), sigma);
    if (moved < 0.1 * least && next > settled * sigma) break;
    sigma = next;
    if (!saw_again && sigma <= 2.0 * least && frame.rounds > 3) see(state_.x + delta), saw_again = true;
  }
  frame.rounds = std::min(frame.rounds, options_.max_rounds);
  return true;
}

TrackedFrame Tracker::look(double dt, bool at_rest, const TrackView& view) {
  const Timed timed(Activity::Tracking);
  constexpr double forever = 1e3;  // [s], a step that leaves no inertia
  constexpr std::size_t fewest = 10;
  TrackedFrame frame;
  const bool is_seen = view.points.size() >= fewest || !view.markers.empty();
  const State start = state_;
  bool fine = true;
  if (!is_seen) {
    if (!at_rest) fine = drift(dt);
  } else {
    stepper_->set_time_step(at_rest ? forever : dt);
    Points delta = Points::Zero(state_.x.rows(), 3);
    double distance = 0.0;
    if (at_rest) {
      distance = found_ ? choose({delta}, view, delta) : options_.widest * size_;
    } else {
      springs_->clear();
      Points predicted = dt * state_.v;
      std::vector<Points> candidates = {dt * state_.v, delta};
      if (relax(predicted, 1e-3 * size_)) candidates.push_back(std::move(predicted));
      distance = choose(std::move(candidates), view, delta);
    }
    fine = maximise(dt, at_rest, view, distance, delta, frame);
    if (fine) {
      stepper_->advance(delta, state_);
      if (at_rest) state_.v.setZero();
      found_ = true;
    }
  }
  if (!fine) {
    state_ = start;
    if (!at_rest && !drift(dt)) state_ = {start.x, Points::Zero(start.x.rows(), 3)};
  }
  frame.nodes = state_.x;
  frame.is_lost = !fine;
  describe(state_.x, view, frame);
  lost_for_ = frame.is_lost ? lost_for_ + 1 : 0;
  if (frame.is_lost && fine) {
    // A burst of outliers passes, and the object goes on as it did; after that it waits to be found again.
    state_ = start;
    if (at_rest || lost_for_ > burst || !drift(dt)) state_ = {start.x, Points::Zero(start.x.rows(), 3)};
    outlier_share_ = options_.outlier_share;
    frame.nodes = state_.x;
    see(state_.x);
    describe(state_.x, view, frame);
    frame.is_lost = true;
  }
  return frame;
}

void Tracker::describe(const Points& nodes, const TrackView& view, TrackedFrame& frame) {
  const SampleLevel& all = levels_.front();
  const SampleLevel& coarse = levels_[mark_level_];
  frame.points = int(view.points.size()), frame.markers = int(view.markers.size());
  frame.mark_points.assign(coarse.vertex.size(), 0);
  double squares = 0.0;
  for (const TrackObservation& seen : view.markers)
    squares += (springs_->points().position(samples_ + seen.point, nodes) - seen.position).squaredNorm();
  if (frame.markers > 0) frame.marker_rms = std::sqrt(squares / frame.markers);
  frame.residuals.assign(view.points.size(), std::numeric_limits<float>::quiet_NaN());
  if (view.points.empty()) {
    frame.confidence = frame.markers > 0 ? std::min(1.0, 0.02 * size_ / std::max(frame.marker_rms, 1e-12)) : 0.0;
    return;
  }
  const double noise = spread(view), least = std::max(finest_, noise);
  const Points samples = samples_of(all, nodes);
  const Correspondence c =
      expect(samples, shares_of(all), {view.points, view.noise}, {least, outlier_share_, volume_of(view)});
  const Points normals = normals_of(samples);
  squares = 0.0;
  int explained = 0;
  for (std::size_t i = 0; i < view.points.size(); ++i) {
    if (c.explained[i] < 0.5f || c.likeliest[i] < 0) continue;
    const int v = c.likeliest[i];
    const Vector3 vertex = samples.row(v), normal = normals.row(v);
    const double off = normal.dot(view.points[i] - vertex);
    frame.residuals[i] = float(off);
    squares += off * off;
    ++explained;
    ++frame.mark_points[std::size_t(coarse.sample_of[std::size_t(v)])];
  }
  frame.explained = double(explained) / frame.points;
  if (explained > 0) frame.surface_rms = std::sqrt(squares / explained);
  double seen = 0.0, visible = 0.0;
  for (std::size_t m = 0; m < coarse.vertex.size(); ++m) {
    const double area = coarse.area[m] * (visible_[std::size_t(coarse.vertex[m])] > 0.0 ? 1.0 : 0.0);
    visible += area;
    if (frame.mark_points[m] > 0) seen += area;
  }
  frame.supported = visible > 0.0 ? seen / visible : 0.0;
  usually_supported_ = std::max(frame.supported, 0.98 * usually_supported_);
  const double fits = std::min(1.0, 2.0 * std::max(noise, 0.005 * size_) / std::max(frame.surface_rms, 1e-12));
  frame.confidence = usually_supported_ > 0.0 ? fits * frame.supported / usually_supported_ : 0.0;
  constexpr double lost = 0.15;
  const bool enough = frame.points >= 0.1 * typical_;
  frame.is_lost = frame.is_lost || (enough && frame.confidence < lost);
}

namespace {

/// Of the first run of lost frames that is longer than a burst, or lasts to the end.
std::optional<int> first_lost(const std::vector<TrackedFrame>& frames) {
  for (std::size_t i = 0; i < frames.size(); ++i) {
    std::size_t end = i;
    while (end < frames.size() && frames[end].is_lost) ++end;
    if (end - i > std::size_t(burst) || (end > i && end == frames.size())) return frames[i].frame;
    i = std::max(i, end);
  }
  return std::nullopt;
}

}  // namespace

Track track(const Capture& capture, const std::shared_ptr<const Body>& body, const SimulationOptions& scene,
            const VectorX& theta, const std::vector<ObservedFrame>& observed, const std::vector<Vector3>& markers,
            const std::map<int, std::vector<TrackObservation>>& seen_markers, const TrackOptions& options,
            const std::function<bool(int, int)>& progress) {
  if (std::ranges::any_of(capture.scene.fixed, [](const FixedRegion& f) { return f.displaced_to.has_value(); }) ||
      !capture.scene.led.empty())
    throw InputError({{capture.file},
                      "a held region is moved from rest (displaced_to, [[led]])",
                      "regions held where they are at rest",
                      "tracking does not follow clamps that move; leave them out"});
  require_standing_cameras(capture, "tracking (--set tracking=off fits the points themselves)");
  if (has_time_offsets(capture))
    throw InputError({{capture.file},
                      "a depth camera with a `time_offset`",
                      "cameras that take their images at the times of the frames",
                      "tracking goes from frame to frame: fit the points themselves, with --set tracking=off"});
  std::map<int, TrackView> views;
  std::vector<double> counts;
  double squares = 0.0;
  std::size_t all = 0;
  for (const ObservedFrame& frame : observed) {
    views[frame.frame].points = frame.points;
    views[frame.frame].noise = frame.noise;
    if (!frame.points.empty()) counts.push_back(double(frame.points.size()));
    for (const float noise : frame.noise) squares += double(noise) * double(noise);
    all += frame.noise.size();
  }
  for (const auto& [frame, seen] : seen_markers) views[frame].markers = seen;
  if (all == 0 && seen_markers.empty())
    throw InputError({{capture.file}, "no frame shows any point of the object", "depth images, clouds or markers", ""});

  Track result;
  result.body = body;
  VectorX own = theta;
  SimulationOptions still = scene;
  if (scene.scan_sags) {
    Simulation simulation(body, scene);
    if (const std::string failure = simulation.hold_shape(theta); failure.empty()) {
      result.body = simulation.rest_body(theta);
    } else {
      own.segment<3>(scene.blocks.gravity).setZero();
      result.note = "The material is too soft for its scan (" + failure +
                    "): the object was tracked without gravity, as if it were stress-free as scanned.";
    }
    still.scan_sags = false;
  }
  std::vector<PinholeCamera> cameras;
  if (capture.clouds.empty())
    for (const DepthCamera& depth : capture.depth) cameras.push_back(depth.camera);
  Tracker tracker(result.body, still, own, *capture.scene.object.surface, std::move(cameras), markers,
                  int(quantile(counts, 0.5)), all > 0 ? std::sqrt(squares / double(all)) : 0.0, options);
  result.surface = tracker.surface();
  result.marks = tracker.marks();

  const bool held_before = capture.scene.initial.released || capture.scene.timing.is_static;
  const int first = held_before ? 0 : capture.scene.timing.start_frame, frames = capture.frame_count();
  for (int f = first; f < frames; ++f) {
    const bool at_rest = held_before && (capture.scene.timing.is_static || f <= capture.scene.timing.start_frame);
    const double time = capture.scene.timing.times[std::size_t(f)];
    const TrackView& view = views[f];
    if (at_rest && view.points.empty() && view.markers.empty()) continue;
    TrackedFrame frame;
    if (at_rest) {
      frame = tracker.hold(view);
    } else if (f == first) {  // a falling object is, when it is let go, where it was scanned
      frame = tracker.compare(view);
    } else {
      frame = tracker.advance(time - capture.scene.timing.times[std::size_t(f) - 1], view);
    }
    frame.frame = f, frame.time = time;
    result.frames.push_back(std::move(frame));
    if (progress && !progress(f - first + 1, frames - first)) break;
  }
  result.lost_at = first_lost(result.frames);
  result.times = tracker.times();
  return result;
}

}  // namespace pliant
