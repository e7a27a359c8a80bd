#include "estimation/pull_places.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "motion/compliance.hpp"
#include "motion/pull.hpp"

namespace pliant {

namespace {

constexpr int candidate_count = 48;

/// Without what pulls it. Corotated: of a pose that is no equilibrium other laws' stiffness may be indefinite.
SimulationOptions held_alone(SimulationOptions options) {
  options.material.elastic = ElasticLaw::Corotated;
  return options;
}

/// The cost of the best pulls: half the squares of what they leave, and of themselves over their prior deviation.
/// @param moved  what they do, a column each
double least_cost(const MatrixX& moved, const VectorX& left) {
  const MatrixX H = moved.transpose() * moved + MatrixX::Identity(moved.cols(), moved.cols()) / (pull_std * pull_std);
  const VectorX pulls = H.ldlt().solve(moved.transpose() * left);
  return 0.5 * (left - moved * pulls).squaredNorm() + 0.5 * (pulls / pull_std).squaredNorm();
}

class PlacesOfPose {
 public:
  PlacesOfPose(const FollowedRecording& held, const Track& track, const TrackedFrame& pose,
               const std::vector<TrackObservation>& seen)
      : body_(track.body), seen_(seen), marks_(*body_, track.marks) {
    SimulationOptions options = held_alone(held.discretisation().simulation);
    const std::vector<int> fixed = held_nodes(*body_, options.holds);
    compliance_ = std::make_unique<Compliance>(body_, options, held.start(), pose.nodes);
    if (fixed.empty() || !compliance_->is_ready()) return;
    left_ = moved_marks(compliance_->missing_forces());
    std::vector<Vector3> there;
    for (const int node : fixed) there.push_back(body_->scanned_positions().row(node).transpose());
    const Recording& recording = held.recording();
    const PullPoints points{far_points(recording.capture.scene.object.surface->vertices, there, candidate_count),
                            recording.size};
    places_ = points.at;
    const int own = int(held.start().size());
    VectorX theta(own + 3 * candidate_count);
    theta << held.start(), VectorX::Zero(3 * candidate_count);
    std::vector<ParameterHandle>& blocks = options.blocks.pulls;
    blocks.clear();
    for (int k = 0; k < candidate_count; ++k) blocks.push_back({own + 3 * k, 3});
    Pull pull(body_, points, fixed, options.blocks);
    for (const ParameterHandle& block : blocks) {
      moved_.emplace_back(left_.size(), 3);
      for (int axis = 0; axis < 3; ++axis) {
        theta.segment<3>(block) = Vector3::Unit(axis);
        pull.set_parameters(theta);
        Points force = Points::Zero(body_->node_count(), 3);
        pull.add_force(pose.nodes, force);
        moved_.back().col(axis) = moved_marks(force);
      }
      theta.segment<3>(block).setZero();
    }
  }

  std::vector<Vector3> choose(int most) const {
    const double noise = 0.5 * ObjectiveOptions{}.independent_points;  // the cost of residuals that are noise
    const double price = 1.5 * std::log(2.0 * noise);
    std::vector<Vector3> chosen;
    MatrixX moved_by_chosen(left_.size(), 0);
    double cost = 0.5 * left_.squaredNorm();
    while (int(chosen.size()) < most && !moved_.empty() && cost > noise) {
      MatrixX moved(left_.size(), moved_by_chosen.cols() + 3);
      moved.leftCols(moved_by_chosen.cols()) = moved_by_chosen;
      std::size_t best = 0;
      double least = std::numeric_limits<double>::infinity();
      for (std::size_t k = 0; k < moved_.size(); ++k) {
        moved.rightCols<3>() = moved_[k];
        if (const double left = least_cost(moved, left_); left < least) least = left, best = k;
      }
      if (!(least < cost - price)) break;
      cost = least;
      moved.rightCols<3>() = moved_[best];
      moved_by_chosen = std::move(moved);
      chosen.push_back(places_[best]);
    }
    return chosen;
  }

 private:
  /// How far forces move the marks that are seen, over their noise.
  VectorX moved_marks(const Points& forces) {
    const Points& u = compliance_->displacements(forces);
    VectorX moved(3 * Eigen::Index(seen_.size()));
    for (std::size_t i = 0; i < seen_.size(); ++i)
      moved.segment<3>(3 * Eigen::Index(i)) = marks_.position(seen_[i].point, u) / seen_[i].noise;
    return moved;
  }

  std::shared_ptr<const Body> body_;
  const std::vector<TrackObservation>& seen_;
  Embedding marks_;
  std::unique_ptr<Compliance> compliance_;
  VectorX left_;  // how far the marks would move if nothing but the scene's forces held them
  std::vector<Vector3> places_;
  std::vector<MatrixX> moved_;  // of each place: what its pulls along the axes do
};

}  // namespace

std::vector<Vector3> pull_places(const FollowedRecording& held, const Track& track, const TrackedFrame& pose,
                                 const std::vector<TrackObservation>& seen, int most) {
  return PlacesOfPose(held, track, pose, seen).choose(most);
}

}  // namespace pliant
