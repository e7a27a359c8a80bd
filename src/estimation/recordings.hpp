#pragma once

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "estimation/fit.hpp"

namespace pliant {

/// One of the recordings of a fit: what was seen, and where its own part of theta stands.
struct Recording {
  Capture capture;
  TrackedPoints tracked;
  std::shared_ptr<const std::vector<FrameObservations>> observations;
  std::shared_ptr<const SignedDistance> distance;
  double size = 0.0;  ///< of the object [m]
  int last_frame = 0;
  int theta_offset = 0, theta_size = 0;

  VectorX own(const VectorX& theta) const { return theta.segment(theta_offset, theta_size); }
  bool is_released() const { return capture.scene.initial.released; }
  /// The last frame of a part of the recording, (0, 1]. A flying object shows no stiffness in its first third; one that
  /// swings shows it at once.
  int horizon(double part) const;
};

/// How finely all recordings of a fit are simulated.
struct Grid {
  double cells = 0.0, steps = 0.0;        ///< as in `Resolution`
  std::vector<Discretisation> recording;  ///< of each
};

/// The recordings of one object side by side: they share its material, and each has its own start, planes and sensors.
class Recordings {
 public:
  /// Throws InputError where a recording cannot be fitted, with the reason.
  /// @param notes  what the user should know about how they were read is added
  Recordings(std::vector<RecordedCapture> recorded, const FitOptions& options, std::vector<std::string>& notes);

  const std::vector<Recording>& all() const { return all_; }
  const Recording& front() const { return all_.front(); }
  int controls() const { return controls_; }  ///< moduli of the object
  /// All parameters where the fit begins, with the options' choices.
  const ParameterSet& parameters() const { return parameters_; }
  bool any_released() const { return std::ranges::any_of(all_, &Recording::is_released); }
  bool all_static() const {
    return std::ranges::all_of(all_, [](const Recording& r) { return r.capture.scene.timing.is_static; });
  }
  /// Whether a scan was taken as the object sags.
  bool any_sags() const {
    return std::ranges::any_of(all_,
                               [](const Recording& r) { return r.capture.scene.object.shape_is == ShapeIs::Static; });
  }
  bool any_meshed_here() const {
    return std::ranges::any_of(all_, [](const Recording& r) { return !r.capture.scene.object.volume; });
  }

  [[nodiscard]] Grid grid(double cells, double steps) const;

  /// @param band        outlier scale, times the object's size
  /// @param last_frame  of each recording that is compared
  template <class LastFrame>
  [[nodiscard]] Objective objective(const Grid& grid, const ParameterSet& parameters, double band,
                                    LastFrame&& last_frame) const {
    std::vector<ObservedMotion> motions;
    for (std::size_t i = 0; i < all_.size(); ++i) {
      const Recording& r = all_[i];
      const Discretisation& d = grid.recording[i];
      ObjectiveOptions o;
      o.outlier_scale = band * r.size;
      o.last_frame = std::min(r.last_frame, last_frame(r));
      motions.push_back({d.mismatch, d.body, d.simulation, r.observations, o});
    }
    return {std::move(motions), with_field_prior(parameters, grid)};
  }
  /// The parameters with the prior of their moduli at the grid's control points, if it has any.
  [[nodiscard]] ParameterSet with_field_prior(ParameterSet parameters, const Grid& grid) const;

  /// Every recording's moduli [Pa], as many as controls.
  void set_moduli(VectorX& theta, const VectorX& moduli) const;

 private:
  ParameterSet make_ready(RecordedCapture recorded, Recording& recording, std::vector<std::string>& notes);
  Resolution resolution(double cells, double steps) const;
  double widest_band() const;

  FitOptions options_;
  std::vector<Recording> all_;
  int controls_ = 1;
  ParameterSet parameters_;
};

/// Whether a parameter is what all recordings of one object have in common.
bool is_material(const Parameter& parameter);

}  // namespace pliant
