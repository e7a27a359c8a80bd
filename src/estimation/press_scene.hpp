#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/capture.hpp"
#include "capture/markers.hpp"
#include "estimation/marker_noise.hpp"
#include "estimation/static_tests.hpp"
#include "motion/equilibrium.hpp"
#include "parameters/parameter_set.hpp"

namespace pliant {

/// One press as it was measured.
struct ObservedPress {
  std::string name;                    ///< "press 1", ...
  std::string role;                    ///< "fit" or "test"
  Vector3 force;                       ///< [N], of the probe on the object
  std::vector<Vector3> rest;           ///< of the points below [m]
  std::vector<Vector3> loaded;         ///< where they were seen [m]
  bool has_probe = false;              ///< the last point is the disc's middle, by the probe's pose
  double greatest_displacement = 0.0;  ///< [m]
  std::vector<double> weights = {};    ///< of each coordinate's deviation (`MarkerNoise`), three a point; none: all 1

  double weight(std::size_t coordinate) const { return weights.empty() ? 1.0 : weights[coordinate]; }
};

/// Whether static tests with known forces are all that a capture has to fit: no frames, and no load to fit.
bool is_of_static_tests(const Capture& capture);

/// What presses of one object share, and the presses.
struct PressScene {
  std::shared_ptr<const Body> body;
  std::vector<int> held;     ///< nodes
  double noise = 0.0;        ///< first guess of a coordinate's deviation [m]
  double force_noise = 0.0;  ///< relative
  Points unit_weight;        ///< nodal forces [m^4/s^2]: times the density [kg/m^3] [N]
  double density = 0.0;      ///< [kg/m^3]
  std::vector<ObservedPress> presses;
  std::vector<Press> facts;                       ///< of the same presses
  std::shared_ptr<const StaticTests> tests = {};  ///< curves and grips; null: none
  /// Rigid bodies inside or under the object on which it slides; those that it is glued to are held nodes.
  std::vector<std::shared_ptr<const RigidShape>> sliding = {};

  Points dead_load() const { return density * unit_weight; }
  /// Contacts of an equilibrium: a probe's, if any, and those of the rigid bodies, which stay where they are.
  std::vector<RigidContact> contacts(std::optional<RigidContact> probe, double youngs_modulus) const;
  /// Curves and grips; none where there are none.
  const StaticTests& static_tests() const;
};

/// Reads a capture's presses (all roles) around a body of its object.
/// Throws InputError where neither region nor glued body holds an object that is pressed or gripped, a press' markers
/// are too few, or its disc covers nothing.
PressScene make_press_scene(const Capture& capture, std::shared_ptr<const Body> body);

/// Puts a name in front of those of all tests, so that tests of several captures are told apart.
void put_in_front(const std::string& name, PressScene& scene);

/// Rigid bodies of an equilibrium from this one on stay where they are.
void keep_inner_bodies(Equilibrium& equilibrium, int first);

/// Makes weights of the deviations [m] that `weights` of presses hold where captures state them: each over the median
/// of all; 1 for what states none. How large they are is what residuals say (`robust_noise`).
void weigh_by_stated_deviations(std::vector<ObservedPress>& presses);

/// One press, ready to be solved: its rigid contact on the body, led by its force, and its points' embedding.
class PressedBody {
 public:
  /// @param youngs_modulus  [Pa] about which the contact is stiff
  PressedBody(const PressScene& scene, int press, std::shared_ptr<const MaterialLaw> law, double youngs_modulus);

  /// To equilibrium from where it was last; where that fails, or at first, from rest.
  SolveSummary solve();
  /// The same, first from a placement that is nearly in equilibrium.
  SolveSummary solve_from(const Placement& guess);
  /// The next `solve` sets out from there.
  void begin_from(const Placement& placement) { placement_ = placement, has_placement_ = true; }
  Equilibrium& equilibrium() { return equilibrium_; }
  const Placement& placement() const { return placement_; }
  /// Simulated places of the press' points, one row each [m]; the probe's last.
  Points points() const;
  int point_count() const { return points_.point_count() + int(has_probe_); }
  const Embedding& embedding() const { return points_; }
  bool has_probe() const { return has_probe_; }
  const Vector3& contact_centre() const { return centre_; }

 private:
  Equilibrium equilibrium_;
  Embedding points_;
  Vector3 centre_;
  bool has_probe_;
  Placement placement_;
  bool has_placement_ = false;
};

/// What a material predicts of one press.
struct PressPrediction {
  bool succeeded = false;
  std::string failure;
  double marker_rms = 0.0, marker_max = 0.0;  ///< [m], of the markers (the probe not among them)
  double relative_error = 0.0;                ///< rms over the greatest measured displacement
  Placement placement;
};
PressPrediction predict_press(const PressScene& scene, int press, const std::shared_ptr<const MaterialLaw>& law,
                              double youngs_modulus);
/// All of them, side by side.
std::vector<PressPrediction> predict_presses(const PressScene& scene, const std::shared_ptr<const MaterialLaw>& law);

/// Deviation of a coordinate [m] that a press' markers show by themselves, whatever the material: of each marker's
/// displacement from the affine one of its nearest neighbours, the median over markers. Displacements that bend between
/// neighbours count as noise, so it is rather too great where markers are few.
double marker_noise(const ObservedPress& press);

/// What markers' displacements have that the affine ones of their nearest neighbours have not, as residuals of
/// coordinates [m] of a marker's own deviation, with each coordinate's weight and how far the neighbours moved [m].
struct LocalResiduals {
  std::vector<double> residuals, weights, displacements;
  void add(const ObservedPress& press);
};

/// A Young's modulus to set out from [Pa]: that of half spaces under flat punches (Sneddon 1965), E = F (1 - nu^2) /
/// (2 a u), the median of the presses to fit; and what curves and grips to fit say by `guessed_moduli`.
double punch_modulus(const PressScene& scene, double poissons_ratio);

}  // namespace pliant
