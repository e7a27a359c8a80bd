#include "photos/follow.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <stdexcept>
#include <utility>

#include "base/median.hpp"

namespace pliant {

namespace {

constexpr int neighbour_count = 12;
constexpr int fewest_neighbours = 4;  // that say where a marker should be
// All in spacings of the markers about the one in question.
constexpr double seed_gate = 0.35, seed_agreement = 0.2;
constexpr double least_gate = 0.25, greatest_gate = 0.45;
constexpr double greatest_contradiction = 0.4;
constexpr double clear_ratio = 2.0, clear_margin = 0.2;  // how much farther the second nearest must be
constexpr double share_of_best = 0.5;                    // of the markers that an attempt must find to be heard
constexpr double stiffness = 0.05;                       // of the affine fit towards a rotation

std::vector<int> nearest(const Points& points, const Vector3& to, int count, int leave_out = -1) {
  std::vector<int> order;
  for (int j = 0; j < int(points.rows()); ++j)
    if (j != leave_out) order.push_back(j);
  const auto by_distance = [&](int a, int b) {
    return (points.row(a).transpose() - to).squaredNorm() < (points.row(b).transpose() - to).squaredNorm();
  };
  const auto end = order.begin() + std::min<long>(count, long(order.size()));
  std::partial_sort(order.begin(), end, order.end(), by_distance);
  order.erase(end, order.end());
  return order;
}

// What neighbours say of one marker.
struct Expectation {
  Vector3 position;
  double scatter = 0.0;  // of the neighbours about their own affine motion [m]
  int support = 0;
};

class Follower {
 public:
  Follower(const Points& rest, const Points& prediction, const Points& candidates)
      : prediction_(prediction), candidates_(candidates), found_(std::size_t(rest.rows()), -1) {
    for (int i = 0; i < int(rest.rows()); ++i) {
      neighbours_.push_back(nearest(rest, rest.row(i), neighbour_count, i));
      std::vector<double> distances;
      for (const int j : neighbours_.back()) distances.push_back((rest.row(i) - rest.row(j)).norm());
      spacing_.push_back(distances.empty() ? 0.0 : distances[std::min<std::size_t>(3, distances.size()) / 2]);
    }
  }

  Followed follow() {
    seed();
    grow();
    const int before = count();
    drop_contradictions();
    drop_shared();
    Followed out;
    out.candidate = found_;
    out.unclear = before - count() + unclear_;
    out.expected = prediction_;
    for (int i = 0; i < marker_count(); ++i)
      if (is_found(i))
        out.expected.row(i) = candidates_.row(found_[std::size_t(i)]);
      else if (const auto place = expectation(i))
        out.expected.row(i) = place->position;
    return out;
  }

 private:
  int marker_count() const { return int(found_.size()); }
  bool is_found(int i) const { return found_[std::size_t(i)] >= 0; }
  int count() const {
    return int(std::ranges::count_if(found_, [](int c) { return c >= 0; }));
  }
  Vector3 seen(int i) const { return candidates_.row(found_[std::size_t(i)]); }

  // The one point within `gate` of a place, where no second one is nearly as near. -1: none; -2: not clear.
  int only_point_near(const Vector3& place, double gate, double spacing) const {
    double best = infinite, second = infinite;
    int nearest_point = -1;
    for (int c = 0; c < int(candidates_.rows()); ++c) {
      const double distance = (candidates_.row(c).transpose() - place).norm();
      if (distance < best) {
        second = std::exchange(best, distance);
        nearest_point = c;
      } else {
        second = std::min(second, distance);
      }
    }
    if (best > gate) return -1;
    return second > clear_ratio * best + clear_margin * spacing ? nearest_point : -2;
  }

  // Markers near where they were predicted, that moved as their neighbours did.
  void seed() {
    std::vector<int> likely(found_.size());
    for (int i = 0; i < marker_count(); ++i)
      likely[std::size_t(i)] =
          only_point_near(prediction_.row(i), seed_gate * spacing_[std::size_t(i)], spacing_[std::size_t(i)]);
    const auto motion = [&](int i) -> Vector3 { return candidates_.row(likely[std::size_t(i)]) - prediction_.row(i); };
    for (int i = 0; i < marker_count(); ++i) {
      if (likely[std::size_t(i)] < 0) continue;
      int agree = 0, asked = 0;
      for (const int j : neighbours_[std::size_t(i)]) {
        if (asked == neighbour_count / 2) break;
        ++asked;
        agree +=
            likely[std::size_t(j)] >= 0 && (motion(i) - motion(j)).norm() < seed_agreement * spacing_[std::size_t(i)];
      }
      if (agree >= std::min(fewest_neighbours, asked)) found_[std::size_t(i)] = likely[std::size_t(i)];
    }
  }

  // Affine motion, kept near a rotation, of the neighbours found (but for `leave_out`'s own point).
  std::optional<Expectation> expectation(int i) const {
    std::vector<int> from;
    for (const int j : neighbours_[std::size_t(i)])
      if (is_found(j)) from.push_back(j);
    if (int(from.size()) < std::min(fewest_neighbours, marker_count() - 1)) return std::nullopt;
    const Vector3 own = prediction_.row(i);
    const double width = 2.0 * spacing_[std::size_t(i)];
    std::vector<double> weights;
    Vector3 mean_before = Vector3::Zero(), mean_after = Vector3::Zero();
    double sum = 0.0;
    for (const int j : from) {
      const double w = std::exp(-0.5 * (prediction_.row(j).transpose() - own).squaredNorm() / (width * width)) + 1e-3;
      weights.push_back(w);
      mean_before += w * prediction_.row(j).transpose();
      mean_after += w * seen(j);
      sum += w;
    }
    mean_before /= sum;
    mean_after /= sum;
    Matrix3 cross = Matrix3::Zero(), spread = Matrix3::Zero();
    for (std::size_t k = 0; k < from.size(); ++k) {
      const Vector3 before = prediction_.row(from[k]).transpose() - mean_before, after = seen(from[k]) - mean_after;
      cross += weights[k] * after * before.transpose();
      spread += weights[k] * before * before.transpose();
    }
    const Eigen::JacobiSVD<Matrix3> svd(cross, Eigen::ComputeFullU | Eigen::ComputeFullV);
    const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1.0 : 1.0;
    const Matrix3 rotation = svd.matrixU() * Vector3(1.0, 1.0, sign).asDiagonal() * svd.matrixV().transpose();
    const double ridge = stiffness * spread.trace() + 1e-30;
    const Matrix3 gradient = (cross + ridge * rotation) * (spread + ridge * Matrix3::Identity()).inverse();
    Expectation out{mean_after + gradient * (own - mean_before), 0.0, int(from.size())};
    double squares = 0.0;
    for (std::size_t k = 0; k < from.size(); ++k)
      squares +=
          weights[k] *
          (seen(from[k]) - mean_after - gradient * (prediction_.row(from[k]).transpose() - mean_before)).squaredNorm();
    out.scatter = std::sqrt(squares / sum);
    return out;
  }

  // Best supported markers first; each that is found can support others.
  void grow() {
    for (int support = neighbour_count; support >= std::min(fewest_neighbours, marker_count() - 1);) {
      std::vector<std::pair<int, int>> taken;
      int unclear = 0;
      for (int i = 0; i < marker_count(); ++i) {
        if (is_found(i)) continue;
        const auto place = expectation(i);
        if (!place || place->support < support) continue;
        const double spacing = spacing_[std::size_t(i)];
        const double gate = std::min(least_gate * spacing + 3.0 * place->scatter, greatest_gate * spacing);
        const int point = only_point_near(place->position, gate, spacing);
        if (point >= 0) taken.emplace_back(i, point);
        unclear += point == -2;
      }
      for (const auto& [i, point] : taken) found_[std::size_t(i)] = point;
      unclear_ = unclear;
      support = taken.empty() ? support - 1 : neighbour_count;
    }
  }

  // Leaves out, the worst first, what its neighbours contradict.
  void drop_contradictions() {
    for (;;) {
      int worst = -1;
      double greatest = greatest_contradiction;
      for (int i = 0; i < marker_count(); ++i) {
        if (!is_found(i)) continue;
        const auto place = expectation(i);
        const double off = place ? (seen(i) - place->position).norm() / spacing_[std::size_t(i)] : infinite;
        if (off > greatest) {
          greatest = off;
          worst = i;
        }
      }
      if (worst < 0) return;
      found_[std::size_t(worst)] = -1;
    }
  }

  // Two markers cannot be one point.
  void drop_shared() {
    std::map<int, int> claims;
    for (const int point : found_)
      if (point >= 0) ++claims[point];
    for (int& point : found_)
      if (point >= 0 && claims[point] > 1) point = -1;
  }

  const Points& prediction_;
  const Points& candidates_;
  std::vector<int> found_;
  std::vector<std::vector<int>> neighbours_;
  std::vector<double> spacing_;
  int unclear_ = 0;
};

}  // namespace

int Followed::followed_count() const {
  return int(std::ranges::count_if(candidate, [](int c) { return c >= 0; }));
}

Followed follow_markers(const Points& rest, const Points& prediction, const Points& candidates) {
  if (rest.rows() != prediction.rows()) throw std::invalid_argument("follow_markers: one prediction a marker");
  if (!rest.allFinite() || !prediction.allFinite() || !candidates.allFinite())
    throw std::invalid_argument("follow_markers: a position is not finite");
  return Follower(rest, prediction, candidates).follow();
}

Followed agreement(std::span<const Followed> attempts) {
  if (attempts.empty()) return {};
  Followed out = *std::ranges::max_element(attempts, {}, &Followed::followed_count);
  const double fewest = share_of_best * out.followed_count();
  for (std::size_t i = 0; i < out.candidate.size(); ++i) {
    int& own = out.candidate[i];
    const bool was_found = own >= 0;
    for (const Followed& other : attempts) {
      if (other.followed_count() < fewest) continue;
      for (std::size_t j = 0; j < other.candidate.size(); ++j)
        if (own >= 0 && (i == j ? other.candidate[j] >= 0 && other.candidate[j] != own : other.candidate[j] == own))
          own = -1;
    }
    out.unclear += was_found && own < 0;
  }
  return out;
}

double spacing_of(const Points& points) {
  std::vector<double> distances;
  for (int i = 0; i < int(points.rows()); ++i)
    for (const int j : nearest(points, points.row(i), 1, i))
      distances.push_back((points.row(i) - points.row(j)).norm());
  return median(std::move(distances));
}

}  // namespace pliant
