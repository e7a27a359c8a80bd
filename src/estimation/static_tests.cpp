#include "estimation/static_tests.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "base/error.hpp"
#include "base/parallel.hpp"
#include "capture/markers.hpp"
#include "elasticity/law_elasticity.hpp"
#include "estimation/grip_trial.hpp"
#include "estimation/indentation_trial.hpp"
#include "motion/fixed_regions.hpp"
#include "simulation/scene_simulation.hpp"
#include "simulation/strain_range.hpp"

namespace pliant {

namespace {

template <class Tests>
bool any_fitted(const Tests& tests) {
  return std::ranges::any_of(tests, [](const auto& test) { return is_fitted(test.role); });
}

std::string name_or(const std::string& name, const char* kind, std::size_t i) {
  return name.empty() ? fmt::format("{} {}", kind, i + 1) : name;
}

ObservedGrip observe_grip(const Capture& capture, std::size_t i, const Body& body) {
  const Grip& grip = capture.grips[i];
  ObservedGrip seen;
  seen.name = name_or(grip.name, "grip", i);
  seen.role = grip.role;
  seen.nodes = held_nodes(body, held_regions({FixedRegion{grip.region, std::nullopt}}, *capture.scene.object.surface));
  if (seen.nodes.empty())
    throw InputError({{capture.file},
                      seen.name + " holds no node of the mesh",
                      "a region that holds a part of the object",
                      "make it larger, or ask for more `cells`"});
  seen.displacement = grip.displacement;
  seen.has_force = grip.force.has_value();
  seen.direction = grip.force_direction.isZero() ? Vector3(grip.displacement.normalized()) : grip.force_direction;
  seen.force = grip.force.value_or(0.0);
  seen.force_std = grip.force_std.value_or(1.0);
  if (!grip.markers) return seen;
  const MarkerSet markers = read_marker_pair(*grip.markers_rest, *grip.markers);
  for (int m = 0; m < markers.marker_count(); ++m) {
    if (!markers.is_seen(0, m)) continue;
    seen.rest.emplace_back(markers.rest.row(m).transpose());
    seen.loaded.emplace_back(markers.frames[0].row(m).transpose());
  }
  seen.markers_std = *grip.markers_std;
  seen.seen = Matrix3::Identity();
  if (grip.unseen) seen.seen -= *grip.unseen * grip.unseen->transpose();
  return seen;
}

ObservedIndentation observe_indentation(const Capture& capture, std::size_t i) {
  const Indentation& test = capture.indentations[i];
  ProbeOptions probe;
  probe.kind = test.probe == IndenterShape::Ball ? ProbeKind::Ball : ProbeKind::Punch;
  probe.centre = test.contact;
  probe.radius = test.radius;
  probe.axis = test.direction;
  return {name_or(test.name, "indentation", i), test.role, probe, read_force_curve(test.curve), test.contact_std};
}

/// Points of the first third of a curve, at least one, whose force is beyond doubt: where depths are great the material
/// may stiffen.
std::vector<std::size_t> first_clear_points(const ForceCurve& curve) {
  constexpr double clear = 3.0;  // standard deviations
  std::vector<std::size_t> points;
  for (std::size_t i = 0; i < curve.depths.size(); ++i) {
    if (!points.empty() && 3 * i >= curve.depths.size()) break;
    if (curve.forces[i] > clear * curve.stds[i]) points.push_back(i);
  }
  return points;
}

double indentation_modulus(const ObservedIndentation& test, std::size_t i, double poissons_ratio) {
  const double a = test.probe.radius, depth = test.curve.depths[i], plane = 1.0 - poissons_ratio * poissons_ratio;
  if (test.probe.kind == ProbeKind::Ball) return 0.75 * test.curve.forces[i] * plane / (std::sqrt(a * depth) * depth);
  return test.curve.forces[i] * plane / (2.0 * a * depth);
}

}  // namespace

bool StaticTests::any_to_fit() const { return any_fitted(indentations) || any_fitted(grips) || any_fitted(curves); }

bool has_static_tests(const Capture& capture) {
  return !capture.indentations.empty() || !capture.grips.empty() || !capture.material_curves.empty();
}

bool has_static_tests_to_fit(const Capture& capture) {
  return any_fitted(capture.indentations) || any_fitted(capture.grips) || any_fitted(capture.material_curves);
}

bool is_of_material_curves(const Capture& capture) {
  return capture.scene.timing.times.empty() && any_fitted(capture.material_curves) &&
         !any_fitted(capture.indentations) && !any_fitted(capture.grips) && !any_fitted(capture.presses) &&
         !any_fitted(capture.loads);
}

std::vector<ObservedCurve> observed_curves(const Capture& capture) {
  std::vector<ObservedCurve> curves;
  for (std::size_t i = 0; i < capture.material_curves.size(); ++i) {
    const MaterialCurve& facts = capture.material_curves[i];
    StressCurve read =
        read_stress_curve(facts.curve, facts.mode == TestMode::Biaxial, facts.mode == TestMode::SimpleShear);
    MaterialTest test;
    test.name = name_or(facts.name, "material curve", i);
    test.mode = facts.mode;
    test.measure = facts.measure;
    test.stretch = std::move(read.stretches);
    test.stress = std::move(read.stresses);
    test.second = std::move(read.second);
    test.std = std::move(read.stds);
    test.prestretch = facts.prestretch;
    try {
      check_test(test);
    } catch (const std::invalid_argument& wrong) {
      throw InputError({{facts.curve},
                        wrong.what(),
                        "a stress-strain curve of an elastic material",
                        "stretches are 1 and shears 0 at rest; tension is positive"});
    }
    curves.push_back({facts.role, std::move(test)});
  }
  return curves;
}

StaticTests observe_static_tests(const Capture& capture, const Body& body) {
  StaticTests tests;
  for (std::size_t i = 0; i < capture.indentations.size(); ++i)
    tests.indentations.push_back(observe_indentation(capture, i));
  for (std::size_t i = 0; i < capture.grips.size(); ++i) tests.grips.push_back(observe_grip(capture, i, body));
  tests.curves = observed_curves(capture);
  return tests;
}

std::vector<double> guessed_moduli(const StaticTests& tests, const Body& body, double poissons_ratio) {
  std::vector<double> moduli;
  const auto add = [&](double modulus) {
    if (std::isfinite(modulus) && modulus > 0.0) moduli.push_back(modulus);
  };
  for (const ObservedIndentation& test : tests.indentations)
    if (is_fitted(test.role))
      for (const std::size_t i : first_clear_points(test.curve)) add(indentation_modulus(test, i, poissons_ratio));
  for (const ObservedGrip& test : tests.grips) {
    if (!is_fitted(test.role) || !test.has_force) continue;
    const double way = test.displacement.dot(test.direction), length = body.size();
    add(test.force / way * length * length / body.volume());
  }
  for (const ObservedCurve& curve : tests.curves)
    for (const double secant : is_fitted(curve.role) ? secant_moduli(curve.test) : std::vector<double>{}) add(secant);
  return moduli;
}

namespace {

/// How far a pressed or gripped body is strained.
class Strains {
 public:
  Strains(const PressScene& scene, const std::shared_ptr<const MaterialLaw>& law)
      : body_(*scene.body), elasticity_(LawElasticity::make(scene.body, law)), strains_(body_) {}
  void add(const Placement& placement) {
    strains_.add(body_fields(body_, *elasticity_, placement.nodes), std::nullopt);
  }
  std::optional<DeformationResult> range() const { return strains_.result(); }

 private:
  const Body& body_;
  std::unique_ptr<LawElasticity> elasticity_;
  StrainRange strains_;
};

CurvePrediction predict(const PressScene& scene, const ObservedIndentation& test,
                        const std::shared_ptr<const MaterialLaw>& law, double modulus) {
  CurvePrediction result{test.name,         "indentation",   test.role, "depth [m]", "N", test.curve.depths,
                         test.curve.forces, test.curve.stds, {},        {},          {}};
  IndentedBody body(scene, test, law, modulus);
  Strains strains(scene, law);
  VectorX forces = VectorX::Constant(Eigen::Index(test.curve.depths.size()), not_a_number);
  for (std::size_t d = 0; d < test.curve.depths.size(); ++d)
    if (body.solve(d))
      forces[Eigen::Index(d)] = body.force(d), strains.add(body.placements()[d]);
    else if (result.failure.empty())
      result.failure = body.failure();
  result.strained = strains.range();
  if (DepthOffset offset(test.curve, test.contact_std); result.failure.empty() && offset.is_unknown()) {
    offset.fit(forces);
    result.depth_offset = offset.value();
    forces += offset.value() * offset.slopes();
  }
  result.predicted.assign(forces.begin(), forces.end());
  return result;
}

CurvePrediction predict(const PressScene& scene, const ObservedGrip& test,
                        const std::shared_ptr<const MaterialLaw>& law) {
  CurvePrediction result{test.name,
                         "grip force",
                         test.role,
                         "displacement [m]",
                         "N",
                         {test.displacement.norm()},
                         {test.force},
                         {test.force_std},
                         {not_a_number},
                         {},
                         {}};
  GrippedBody body(scene, test, law);
  if (body.solve()) {
    result.predicted = {body.force()};
    Strains strains(scene, law);
    strains.add(body.placement());
    result.strained = strains.range();
  } else {
    result.failure = body.failure();
  }
  return result;
}

CurvePrediction predict(const ObservedCurve& curve, const MaterialLaw& law) {
  const MaterialTest& test = curve.test;
  CurvePrediction result{test.name,
                         "material curve",
                         curve.role,
                         test.mode == TestMode::SimpleShear ? "shear" : "stretch",
                         "Pa",
                         test.stretch,
                         test.stress,
                         test.std,
                         predict_test(law, test),
                         {},
                         {}};
  if (!std::ranges::all_of(result.predicted, [](double s) { return std::isfinite(s); }))
    result.failure = "no state without stress on the free faces";
  const double unstrained = test.mode == TestMode::SimpleShear ? 0.0 : 1.0;
  double greatest = 0.0;
  for (const double at : result.at) greatest = std::max(greatest, std::abs(at - unstrained));
  result.strained = DeformationResult{greatest, greatest};  // a specimen is strained alike
  return result;
}

}  // namespace

std::vector<CurvePrediction> predict_curves(const std::vector<ObservedCurve>& curves, const MaterialLaw& law) {
  std::vector<CurvePrediction> predictions;
  for (const ObservedCurve& curve : curves) predictions.push_back(predict(curve, law));
  return predictions;
}

std::vector<CurvePrediction> predict_curves(const PressScene& scene, const std::shared_ptr<const MaterialLaw>& law) {
  const StaticTests& tests = scene.static_tests();
  const double modulus = mean_modulus(*scene.body, *law);
  const std::size_t balls = tests.indentations.size();
  std::vector<CurvePrediction> all(balls);
  parallel_tasks(balls, [&](std::size_t i) { all[i] = predict(scene, tests.indentations[i], law, modulus); });
  for (const ObservedGrip& grip : tests.grips)
    if (grip.has_force) all.push_back(predict(scene, grip, law));
  for (CurvePrediction& curve : predict_curves(tests.curves, *law)) all.push_back(std::move(curve));
  return all;
}

std::string curve_sentence(const CurvePrediction& curve) {
  const std::string head = curve.name + " (" + curve.role + "): ";
  if (!curve.failure.empty()) return head + "the model finds no equilibrium: " + curve.failure;
  return head +
         fmt::format("{:.3g} {} rms, {:.1f} % of the greatest measured", curve.rms(), curve.unit,
                     100.0 * curve.relative_rms()) +
         (curve.depth_offset
              ? fmt::format("; touched {:.3g} mm {} than its depths say", 1e3 * std::abs(*curve.depth_offset),
                            *curve.depth_offset > 0.0 ? "earlier" : "later")
              : "");
}

}  // namespace pliant
