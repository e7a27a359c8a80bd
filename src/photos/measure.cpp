#include "photos/measure.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "base/median.hpp"
#include "geometry/surface_distance.hpp"
#include "photos/follow.hpp"
#include "photos/match_views.hpp"

namespace pliant {

namespace {

using Clock = std::chrono::steady_clock;

constexpr double surface_tolerance = 0.05;   // of the object's size, as for contacts of a capture
constexpr double loaded_margin = 0.5;        // of the object's size about its box, for markers under load
constexpr double probe_slack = 3.0;          // times the tolerance: shafts are not thin
constexpr double least_pixels = 4.0;         // diameter of a dot
constexpr double usual_rest_multiple = 5.0;  // of the rms at rest
constexpr int fewest_markers = 4;
constexpr int normal_neighbours = 8;

double size_of(const TriangleMesh& surface) { return bounding_box(surface).extent().maxCoeff(); }

Points positions_of(const std::vector<Sighting>& sightings) {
  Points out(Eigen::Index(sightings.size()), 3);
  for (std::size_t i = 0; i < sightings.size(); ++i) out.row(Eigen::Index(i)) = sightings[i].position;
  return out;
}

// Dots of all cameras at one moment.
struct View {
  std::vector<Dot> dots;  // as seen, through the lens
};
struct Snapshot {
  std::vector<View> markers, probe;  // by camera
};

std::vector<ViewDots> without_lens(std::span<const LensCamera> cameras, const std::vector<View>& views,
                                   const std::vector<std::vector<Vector2>>& shifts = {}) {
  std::vector<ViewDots> out(views.size());
  for (std::size_t c = 0; c < views.size(); ++c) {
    std::vector<Vector2> seen;
    for (std::size_t k = 0; k < views[c].dots.size(); ++k) {
      seen.push_back(views[c].dots[k].centre - (shifts.empty() ? Vector2::Zero() : shifts[c][k]));
      out[c].sigmas.push_back(views[c].dots[k].sigma);
    }
    out[c].pixels = without_lens(cameras[c], seen);
  }
  return out;
}

// Normals of the surface that the points lie on, towards the cameras.
std::vector<Vector3> normals_of(const Points& points, std::span<const LensCamera> cameras) {
  Vector3 eye = Vector3::Zero();
  for (const LensCamera& camera : cameras) eye += camera.centre() / double(cameras.size());
  std::vector<Vector3> normals;
  for (int i = 0; i < int(points.rows()); ++i) {
    std::vector<int> order(std::size_t(points.rows()));
    std::iota(order.begin(), order.end(), 0);
    const auto end = order.begin() + std::min<long>(normal_neighbours + 1, long(order.size()));
    std::partial_sort(order.begin(), end, order.end(), [&](int a, int b) {
      return (points.row(a) - points.row(i)).squaredNorm() < (points.row(b) - points.row(i)).squaredNorm();
    });
    Vector3 mean = Vector3::Zero();
    Matrix3 spread = Matrix3::Zero();
    for (auto j = order.begin(); j != end; ++j) mean += points.row(*j).transpose() / double(end - order.begin());
    for (auto j = order.begin(); j != end; ++j) {
      const Vector3 arm = points.row(*j).transpose() - mean;
      spread += arm * arm.transpose();
    }
    const Vector3 normal = Eigen::SelfAdjointEigenSolver<Matrix3>(spread).eigenvectors().col(0);
    normals.push_back(normal.dot(eye - points.row(i).transpose()) < 0 ? Vector3(-normal) : normal);
  }
  return normals;
}

class Measurer {
 public:
  Measurer(const PhotoSession& session, const PhotographSource& photographs, const PhotoProgress& progress)
      : session_(session),
        photographs_(photographs),
        progress_(progress),
        size_(size_of(*session.scene.object.surface)) {}

  MarkerMeasurement measure() {
    measure_rest();
    measurement_.presses.resize(session_.presses.size());
    expected_.resize(session_.presses.size());
    int done = 1;
    for (const std::size_t i : by_force()) {
      tell(done);
      measure_press(i);
      ++done;
    }
    tell(done);
    return std::move(measurement_);
  }

 private:
  const std::vector<LensCamera>& cameras() const { return session_.cameras; }
  void tell(int done) const {
    if (progress_) progress_(done, int(session_.presses.size()) + 1);
  }

  Image<Rgb> photograph(std::size_t camera, int number) const {
    Image<Rgb> image = photographs_(int(camera), number);
    const LensCamera& lens = cameras()[camera];
    if (image.width == lens.width && image.height == lens.height) return image;
    throw InputError(Problem{
        {session_.photograph(int(camera), number)},
        fmt::format("{} x {} pixels", image.width, image.height),
        fmt::format("{} x {}, the size that camera \"{}\" was calibrated at", lens.width, lens.height, lens.name),
        "use the photographs as the camera wrote them, neither scaled nor turned"});
  }

  // Between which diameters [pixels] dots of a kind can be, `slack` times nearer or farther than the object.
  FindDotsOptions find_options(const LensCamera& lens, const DotKind& kind, double slack) const {
    const Box box = bounding_box(*session_.scene.object.surface);
    double least = 1e300, greatest = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
      const Vector3 p(corner & 1 ? box.max.x() : box.min.x(), corner & 2 ? box.max.y() : box.min.y(),
                      corner & 4 ? box.max.z() : box.min.z());
      const double depth = std::max(lens.world_to_camera(p).z(), 1e-3 * size_);
      least = std::min(least, lens.focal_length() * kind.diameter / depth);
      greatest = std::max(greatest, lens.focal_length() * kind.diameter / depth);
    }
    if (greatest < least_pixels)
      throw InputError(Problem{
          {session_.file},
          fmt::format("a dot of {} m is {:.1f} pixels wide to camera \"{}\"", kind.diameter, greatest, lens.name),
          fmt::format("{} or more, better 10", least_pixels),
          "correct `diameter` or the calibration's unit, paint larger dots, or go nearer"});
    FindDotsOptions options;
    options.colour = kind.colour;
    options.least_diameter = std::max(0.6 * least / slack, 0.5 * least_pixels);
    options.greatest_diameter = 1.6 * greatest * slack;
    options.least_contrast = kind.least_contrast;
    return options;
  }

  Snapshot look(int number) const {
    Snapshot out{std::vector<View>(cameras().size()), std::vector<View>(cameras().size())};
    for (std::size_t c = 0; c < cameras().size(); ++c) {
      const Image<Rgb> image = photograph(c, number);
      out.markers[c].dots = find_dots(image, find_options(cameras()[c], session_.markers, 1.1));
      FindDotsOptions beads = find_options(cameras()[c], session_.probe_dots, 1.7);
      beads.fills_notches = true;
      out.probe[c].dots = find_dots(image, beads);
      // A probe's dot may also look like a marker.
      std::erase_if(out.markers[c].dots, [&](const Dot& dot) {
        return std::ranges::any_of(out.probe[c].dots, [&](const Dot& probe) {
          return (dot.centre - probe.centre).norm() < 0.5 * probe.diameter && probe.contrast > dot.contrast;
        });
      });
    }
    return out;
  }

  std::function<bool(const Vector3&)> near_box(double margin) const {
    const Box box = bounding_box(*session_.scene.object.surface);
    return [box, margin](const Vector3& p) {
      return (p.array() >= box.min.array() - margin).all() && (p.array() <= box.max.array() + margin).all();
    };
  }

  void measure_rest() {
    const auto start = Clock::now();
    const Snapshot seen = look(session_.rest_number);
    const std::vector<ViewDots> views = without_lens(cameras(), seen.markers);
    std::vector<Sighting> all =
        possible_sightings(cameras(), views, {session_.tolerance, 3, near_box(surface_tolerance * size_)});
    const Points places = positions_of(all);
    std::vector<Vector3> points;
    for (const Sighting& s : all) points.push_back(s.position);
    const std::vector<double> away = distances_to_surface(*session_.scene.object.surface, points);
    std::vector<Sighting> near;
    for (std::size_t i = 0; i < all.size(); ++i)
      if (away[i] <= surface_tolerance * size_) near.push_back(all[i]);
    ResolvedSightings resolved = resolve(std::move(near), session_.tolerance);
    std::ranges::sort(resolved.sure, {}, &Sighting::dots);
    check_enough(resolved, seen, all.size());
    PhotoFigures& figures = measurement_.rest_figures;
    figures.ambiguous = resolved.ambiguous_dots();
    const double greatest = correct_centres(resolved.sure, seen.markers);
    rest_ = positions_of(resolved.sure);
    for (std::size_t i = 0; i < resolved.sure.size(); ++i) measurement_.ids.push_back(fmt::format("{:03}", i));
    std::vector<int> candidate(resolved.sure.size());
    std::iota(candidate.begin(), candidate.end(), 0);
    rest_rms_ = median_rms(resolved.sure);
    fill(measurement_.rest, figures, resolved.sure, candidate, seen);
    figures.greatest_bias = greatest;
    figures.seconds = std::chrono::duration<double>(Clock::now() - start).count();
  }

  static double median_rms(const std::vector<Sighting>& sightings) {
    std::vector<double> all;
    for (const Sighting& s : sightings) all.push_back(s.rms);
    return median(all);
  }

  void check_enough(const ResolvedSightings& resolved, const Snapshot& seen, std::size_t possible) const {
    if (int(resolved.sure.size()) >= fewest_markers) return;
    std::string counts;
    for (std::size_t c = 0; c < cameras().size(); ++c)
      counts += fmt::format("{}{} dots by \"{}\"", c ? ", " : "", seen.markers[c].dots.size(), cameras()[c].name);
    throw InputError(Problem{{session_.photograph(0, session_.rest_number)},
                             fmt::format("only {} markers at rest ({}; {} sets of them agree between cameras)",
                                         resolved.sure.size(), counts, possible),
                             fmt::format("{} at least, seen by three cameras, near the surface", fewest_markers),
                             "check `colour` and `diameter`; where dots are seen but none agree, the calibrations' "
                             "poses, `unit` and `tolerance`; "
                             "where some agree, that `surface` stands in the cameras' world"});
  }

  // Moves dots to where their middles are seen, and points with them; the greatest shift [pixels].
  double correct_centres(std::vector<Sighting>& sightings, const std::vector<View>& views) const {
    if (sightings.size() < 4) return 0.0;
    const std::vector<Vector3> normals = normals_of(positions_of(sightings), cameras());
    std::vector<std::vector<Vector2>> shifts(views.size());
    for (std::size_t c = 0; c < views.size(); ++c) shifts[c].assign(views[c].dots.size(), Vector2::Zero());
    double greatest = 0.0;
    for (std::size_t i = 0; i < sightings.size(); ++i)
      for (std::size_t c = 0; c < views.size(); ++c)
        if (const int dot = sightings[i].dots[c]; dot >= 0) {
          const Vector2 shift =
              centre_bias(cameras()[c], sightings[i].position, normals[i], 0.5 * session_.markers.diameter);
          if (!shift.allFinite()) continue;
          shifts[c][std::size_t(dot)] = shift;
          greatest = std::max(greatest, shift.norm());
        }
    const std::vector<ViewDots> moved = without_lens(cameras(), views, shifts);
    for (Sighting& sighting : sightings) sighting = triangulate(cameras(), moved, sighting.dots);
    return greatest;
  }

  // Positions, deviations and figures of markers; `candidate` by marker, -1: not seen.
  void fill(MeasuredMarkers& markers, PhotoFigures& figures, const std::vector<Sighting>& sightings,
            const std::vector<int>& candidate, const Snapshot& seen) const {
    const Eigen::Index count = rest_.rows();
    markers.positions = markers.deviations = Points::Constant(count, 3, not_a_number);
    std::vector<Sighting> used;
    for (const int c : candidate)
      if (c >= 0) used.push_back(sightings[std::size_t(c)]);
    figures.noise_factor = noise_factor(used);
    std::vector<double> deviations;
    double squares = 0.0;
    int dots = 0;
    for (Eigen::Index i = 0; i < count; ++i) {
      const int c = candidate[std::size_t(i)];
      if (c < 0) continue;
      const Sighting& sighting = sightings[std::size_t(c)];
      markers.positions.row(i) = sighting.position;
      markers.deviations.row(i) = figures.noise_factor * sighting.covariance.diagonal().cwiseSqrt().transpose();
      deviations.push_back(markers.deviations.row(i).norm() / std::numbers::sqrt3);
      squares += sighting.rms * sighting.rms * sighting.view_count();
      dots += sighting.view_count();
    }
    for (const View& view : seen.markers) figures.dots.push_back(int(view.dots.size()));
    figures.seen = int(used.size());
    figures.rms = dots ? std::sqrt(squares / dots) : 0.0;
    figures.deviation = median(deviations);
  }

  std::vector<std::size_t> by_force() const {
    std::vector<std::size_t> order(session_.presses.size());
    std::iota(order.begin(), order.end(), std::size_t(0));
    std::ranges::stable_sort(order, {}, [&](std::size_t i) { return std::abs(force_of(session_.presses[i]).force); });
    return order;
  }

  MeasuredForce force_of(const PhotographedPress& press) const {
    return force_at(session_.log, press.time, session_.force_window, session_.greatest_gap).value_or(MeasuredForce{});
  }

  void measure_press(std::size_t index) {
    const auto start = Clock::now();
    MeasuredPress& own = measurement_.presses[index];
    own.press = session_.presses[index];
    own.force = force_of(own.press);
    const Snapshot seen = look(own.press.number);
    find_pose(own, seen);
    follow(index, seen);
    if (own.failure.empty() && own.figures.seen == 0) own.failure = "no marker could be followed";
    own.figures.seconds = std::chrono::duration<double>(Clock::now() - start).count();
  }

  void find_pose(MeasuredPress& own, const Snapshot& seen) const {
    const double slack = probe_slack * session_.tolerance;
    const std::vector<ViewDots> views = without_lens(cameras(), seen.probe);
    const ResolvedSightings dots = resolve(possible_sightings(cameras(), views, {slack, 2, {}}), slack);
    const FoundProbe probe =
        find_probe(dots.sure, session_.probe, *session_.scene.object.surface, noise_factor(dots.sure));
    own.failure = probe.failure;
    if (!probe.pose) return;
    own.probe = *probe.pose;
    if (own.press.contact) {
      own.contact = *own.press.contact;
      return;
    }
    const auto contact = contact_of(own.probe, *session_.scene.object.surface, size_);
    if (contact)
      own.contact = *contact;
    else
      own.failure =
          "the probe's axis does not meet the rest surface: give `contact`, or check `tip` and the surface's place";
  }

  void follow(std::size_t index, const Snapshot& seen) {
    MeasuredPress& own = measurement_.presses[index];
    const double tolerance = std::min(session_.tolerance, std::max(usual_rest_multiple * rest_rms_, 0.2));
    const std::vector<ViewDots> views = without_lens(cameras(), seen.markers);
    const ResolvedSightings resolved = resolve(
        possible_sightings(cameras(), views, {tolerance, session_.least_views, near_box(loaded_margin * size_)}),
        tolerance);
    std::vector<Sighting> candidates = resolved.sure;
    candidates.insert(candidates.end(), resolved.open.begin(), resolved.open.end());
    const Points places = positions_of(candidates);
    std::vector<Followed> attempts;
    for (const Points& prediction : predictions(own)) attempts.push_back(follow_markers(rest_, prediction, places));
    Followed followed = agreement(attempts);
    drop_shared_dots(followed, candidates);
    expected_[index] = followed.expected;
    std::vector<Sighting> used;
    std::vector<int> candidate(followed.candidate.size(), -1);
    for (std::size_t i = 0; i < candidate.size(); ++i)
      if (followed.candidate[i] >= 0) {
        candidate[i] = int(used.size());
        used.push_back(candidates[std::size_t(followed.candidate[i])]);
      }
    own.figures.greatest_bias = correct_centres(used, seen.markers);
    fill(own.markers, own.figures, used, candidate, seen);
    own.figures.ambiguous = followed.unclear;
  }

  // Where markers may be: at rest; where they were under the press whose probe was nearest, also farther by as much as
  // the probe is; and a bell about the contact that follows the probe, narrow to wide.
  std::vector<Points> predictions(const MeasuredPress& own) const {
    std::vector<Points> out{rest_};
    const bool is_placed = own.failure.empty();
    const Vector3 way = own.probe.tip - own.contact;
    if (const auto nearest = nearest_press(own)) {
      const MeasuredPress& other = measurement_.presses[*nearest];
      const Points moved = expected_[*nearest] - rest_;
      out.push_back(rest_ + moved);
      const double before = (other.probe.tip - other.contact).norm();
      if (is_placed && other.failure.empty() && before > 0) out.push_back(rest_ + way.norm() / before * moved);
    }
    for (const double width : {0.08, 0.15, 0.3, 0.6}) {
      if (!is_placed) break;
      Points bell = rest_;
      for (Eigen::Index i = 0; i < bell.rows(); ++i) {
        const double away = (rest_.row(i).transpose() - own.contact).norm() / (width * size_);
        bell.row(i) += std::exp(-0.5 * away * away) * way.transpose();
      }
      out.push_back(bell);
    }
    return out;
  }

  // The press, among those done, whose probe was nearest; nothing: there is none.
  std::optional<std::size_t> nearest_press(const MeasuredPress& own) const {
    std::optional<std::size_t> nearest;
    double least = 1e300;
    for (std::size_t i = 0; i < expected_.size(); ++i) {
      if (expected_[i].rows() == 0) continue;
      const MeasuredPress& other = measurement_.presses[i];
      const bool both_known = own.probe.tip_sigma > 0 && other.probe.tip_sigma > 0;
      const double away = both_known ? (own.probe.tip - other.probe.tip).norm() : 1e200;
      if (away > least) continue;
      least = away;
      nearest = i;
    }
    return nearest;
  }

  // Two markers cannot show the same dot in a photograph.
  static void drop_shared_dots(Followed& followed, const std::vector<Sighting>& candidates) {
    std::map<std::pair<std::size_t, int>, int> claims;
    const auto each_dot = [&](int candidate, const auto& take) {
      const std::vector<int>& dots = candidates[std::size_t(candidate)].dots;
      for (std::size_t c = 0; c < dots.size(); ++c)
        if (dots[c] >= 0) take(std::pair(c, dots[c]));
    };
    for (const int candidate : followed.candidate)
      if (candidate >= 0) each_dot(candidate, [&](const auto& dot) { ++claims[dot]; });
    for (int& candidate : followed.candidate) {
      bool is_shared = false;
      if (candidate >= 0) each_dot(candidate, [&](const auto& dot) { is_shared = is_shared || claims[dot] > 1; });
      if (!is_shared) continue;
      candidate = -1;
      ++followed.unclear;
    }
  }

  const PhotoSession& session_;
  const PhotographSource& photographs_;
  const PhotoProgress& progress_;
  double size_;
  MarkerMeasurement measurement_;
  Points rest_;
  double rest_rms_ = 0.0;
  std::vector<Points> expected_;  // by press; empty: not yet done
};

}  // namespace

MarkerMeasurement measure_markers(const PhotoSession& session, const PhotographSource& photographs,
                                  const PhotoProgress& progress) {
  return Measurer(session, photographs, progress).measure();
}

PhotographSource photographs_of(const PhotoSession& session) {
  return [&session](int camera, int number) { return read_photograph(session.photograph(camera, number)); };
}

Vector2 centre_bias(const LensCamera& camera, const Vector3& centre, const Vector3& normal, double radius) {
  constexpr int corners = 48;
  const Vector3 along = normal.unitOrthogonal(), across = normal.cross(along);
  std::vector<Vector3> points{centre};
  for (int k = 0; k < corners; ++k) {
    const double angle = 2.0 * std::numbers::pi * k / corners;
    points.push_back(centre + radius * (std::cos(angle) * along + std::sin(angle) * across));
  }
  const std::vector<Vector2> pixels = project(camera, points);
  double area = 0.0;
  Vector2 moment = Vector2::Zero();
  for (int k = 0; k < corners; ++k) {
    const Vector2 a = pixels[std::size_t(k) + 1] - pixels[0],
                  b = pixels[std::size_t((k + 1) % corners) + 1] - pixels[0];
    const double twice = a.x() * b.y() - a.y() * b.x();
    area += twice;
    moment += twice * (a + b) / 3.0;
  }
  return moment / area;
}

}  // namespace pliant
