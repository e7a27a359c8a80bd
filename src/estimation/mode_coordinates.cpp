#include "estimation/mode_coordinates.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/dense.hpp"
#include "base/median.hpp"
#include "elasticity/polar.hpp"

namespace pliant {

namespace {

constexpr int candidates = 12;     // nearest points, of which those seen at an instant make a neighbourhood
constexpr int most_in_part = 8;    // points of one: enough against noise, few enough to stay local
constexpr int fewest_in_part = 4;  // that fix an affine map
constexpr double least_flatness =
    0.1;  // thickness of a neighbourhood over its width; flatter ones leave F undetermined
constexpr double most_gradient_noise = 0.2;  // of an affine fit [-]; beyond, rotations are guesses
constexpr double least_share_seen = 1.0 / 3.0;
constexpr double enough_instants = 0.8;  // share of them that must show gradients
constexpr double large_rotation = 0.35;  // [rad]: displacements of modes are then wrong by a sixth of this square
constexpr double prior = 1e-5;           // weight of the prior, relative to the observations'

void sort_by_distance(std::vector<int>& order, const std::vector<Vector3>& points, const Vector3& from, int count) {
  const auto closer = [&](int a, int b) {
    const double da = (points[std::size_t(a)] - from).squaredNorm(), db = (points[std::size_t(b)] - from).squaredNorm();
    return da != db ? da < db : a < b;
  };
  std::partial_sort(order.begin(), order.begin() + count, order.end(), closer);
  order.resize(std::size_t(count));
}

}  // namespace

TrackedMotion::TrackedMotion(const Body& body, const std::vector<Vector3>& rest, std::vector<SeenInstant> instants,
                             bool is_free)
    : points_(body, rest), rest_(rest), size_(body.size()) {
  std::vector<double> counts, noises;
  for (const SeenInstant& instant : instants) {
    if (!instant.seen.empty()) counts.push_back(double(instant.seen.size()));
    for (const TrackObservation& seen : instant.seen) noises.push_back(seen.noise);
  }
  const double usual = median(std::move(counts)), noise = median(std::move(noises));
  neighbours_.resize(rest.size());
  for (std::size_t p = 0; p < rest.size(); ++p) {
    neighbours_[p].resize(rest.size());
    std::iota(neighbours_[p].begin(), neighbours_[p].end(), 0);
    sort_by_distance(neighbours_[p], rest, rest[p], std::min(candidates, int(rest.size())));
  }
  int with_gradients = 0;
  for (SeenInstant& given : instants) {
    if (given.seen.empty() || double(given.seen.size()) < least_share_seen * usual) continue;
    Instant instant{given.time, std::move(given.seen), {}};
    if (is_free) take_out_rigid_motion(instant);
    for (TrackObservation& seen : instant.seen) seen.position -= rest_[std::size_t(seen.point)];
    find_parts(instant, noise);
    if (2 * instant.parts.size() >= instant.seen.size()) ++with_gradients;
    instants_.push_back(std::move(instant));
  }
  has_gradients_ = with_gradients > 0 && with_gradients >= enough_instants * instant_count();
}

std::vector<double> TrackedMotion::times() const {
  std::vector<double> out;
  for (const Instant& instant : instants_) out.push_back(instant.time);
  return out;
}

void TrackedMotion::take_out_rigid_motion(Instant& instant) const {
  if (instant.seen.size() < 3) return;
  const double share = 1.0 / double(instant.seen.size());
  Vector3 seen_middle = Vector3::Zero(), rest_middle = Vector3::Zero();
  for (const TrackObservation& o : instant.seen) {
    seen_middle += share * o.position;
    rest_middle += share * rest_[std::size_t(o.point)];
  }
  Matrix3 correlation = Matrix3::Zero();
  for (const TrackObservation& o : instant.seen)
    correlation += (rest_[std::size_t(o.point)] - rest_middle) * (o.position - seen_middle).transpose();
  const Matrix3 back = polar_decomposition(correlation / correlation.norm()).R;
  for (TrackObservation& o : instant.seen) o.position = rest_middle + back * (o.position - seen_middle);
}

void TrackedMotion::find_parts(Instant& instant, double noise) {
  std::vector<int> seen_as(rest_.size(), -1);
  for (std::size_t i = 0; i < instant.seen.size(); ++i) seen_as[std::size_t(instant.seen[i].point)] = int(i);
  for (const TrackObservation& centre : instant.seen) {
    Neighbourhood part;
    for (const int p : neighbours_[std::size_t(centre.point)])
      if (seen_as[std::size_t(p)] >= 0 && int(part.seen.size()) < most_in_part)
        part.seen.push_back(seen_as[std::size_t(p)]);
    if (int(part.seen.size()) < fewest_in_part) continue;
    Points offset(Eigen::Index(part.seen.size()), 3), moved = offset;
    for (std::size_t i = 0; i < part.seen.size(); ++i) {
      const TrackObservation& o = instant.seen[std::size_t(part.seen[i])];
      offset.row(Eigen::Index(i)) = rest_[std::size_t(o.point)].transpose();
      moved.row(Eigen::Index(i)) = o.position.transpose();
    }
    offset.rowwise() -= offset.colwise().mean().eval();
    const Matrix3 spread = offset.transpose() * offset;
    const Eigen::SelfAdjointEigenSolver<Matrix3> eigen(spread);
    part.stiffness = eigen.eigenvalues()[0];
    if (!(part.stiffness > least_flatness * least_flatness * eigen.eigenvalues()[2])) continue;
    if (noise > most_gradient_noise * std::sqrt(part.stiffness)) continue;
    part.weights = offset * spread.inverse();
    const Matrix3 F = Matrix3::Identity() + moved.transpose() * part.weights;
    const Polar polar = polar_decomposition(F);
    if (polar.is_degenerate) continue;
    const Eigen::AngleAxisd turn(polar.R);
    part.rotation_strain = cross_matrix(turn.angle() * turn.axis()) + polar.S - Matrix3::Identity();
    largest_rotation_ = std::max(largest_rotation_, turn.angle());
    instant.parts.push_back(std::move(part));
  }
}

ModeProjection TrackedMotion::automatic() const {
  return has_gradients_ && largest_rotation_ > large_rotation ? ModeProjection::RotationStrain
                                                              : ModeProjection::Displacements;
}

MatrixX TrackedMotion::displacement_rows(const Instant& instant, const std::vector<Points>& at_points,
                                         VectorX& observed) const {
  const Eigen::Index count = Eigen::Index(instant.seen.size());
  MatrixX rows(3 * count, Eigen::Index(at_points.size()));
  observed.resize(3 * count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const TrackObservation& seen = instant.seen[std::size_t(i)];
    const double weight = 1.0 / seen.noise;
    observed.segment<3>(3 * i) = weight * seen.position;
    for (std::size_t j = 0; j < at_points.size(); ++j)
      rows.col(Eigen::Index(j)).segment<3>(3 * i) = weight * at_points[j].row(seen.point).transpose();
  }
  return rows;
}

MatrixX TrackedMotion::gradient_rows(const Instant& instant, const std::vector<Points>& at_points,
                                     VectorX& observed) const {
  const Eigen::Index count = Eigen::Index(instant.parts.size());
  MatrixX rows(9 * count, Eigen::Index(at_points.size()));
  observed.resize(9 * count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Neighbourhood& part = instant.parts[std::size_t(i)];
    const double weight = std::sqrt(part.stiffness);
    observed.segment<9>(9 * i) = weight * part.rotation_strain.reshaped();
    for (std::size_t j = 0; j < at_points.size(); ++j) {
      Matrix3 gradient = Matrix3::Zero();
      for (std::size_t k = 0; k < part.seen.size(); ++k)
        gradient += at_points[j].row(instant.seen[std::size_t(part.seen[k])].point).transpose() *
                    part.weights.row(Eigen::Index(k));
      rows.col(Eigen::Index(j)).segment<9>(9 * i) = weight * gradient.reshaped();
    }
  }
  return rows;
}

ModeCoordinates TrackedMotion::project(const std::vector<Points>& shapes, const VectorX& stiffness,
                                       ModeProjection projection) const {
  ModeCoordinates out;
  out.projection = projection == ModeProjection::Automatic ? automatic() : projection;
  std::vector<Points> at_points;
  for (const Points& shape : shapes) at_points.push_back(points_.positions(shape));
  std::vector<VectorX> values;
  for (const Instant& instant : instants_) {
    VectorX observed;
    const MatrixX rows = out.projection == ModeProjection::RotationStrain
                             ? gradient_rows(instant, at_points, observed)
                             : displacement_rows(instant, at_points, observed);
    if (rows.rows() == 0) continue;
    MatrixX normal = rows.transpose() * rows;
    // Where a mode is hardly seen it must not take up others' motion.
    normal.diagonal() += prior * normal.diagonal().maxCoeff() * stiffness.cwiseMax(1e-6);
    values.push_back(solve_symmetric(normal, VectorX(rows.transpose() * observed)));
    out.times.push_back(instant.time);
  }
  out.values.resize(Eigen::Index(values.size()), Eigen::Index(shapes.size()));
  for (std::size_t i = 0; i < values.size(); ++i) out.values.row(Eigen::Index(i)) = values[i].transpose();
  return out;
}

}  // namespace pliant
