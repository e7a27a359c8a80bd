#include "estimation/press_scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/dense.hpp"
#include "base/error.hpp"
#include "base/median.hpp"
#include "base/parallel.hpp"
#include "estimation/problem.hpp"
#include "motion/press_session.hpp"
#include "simulation/inner_bodies.hpp"

namespace pliant {

namespace {

ObservedPress observe_press(const Capture& capture, std::size_t i) {
  const Press& press = capture.presses[i];
  ObservedPress seen;
  seen.name = "press " + std::to_string(i + 1);
  seen.role = press.role;
  seen.force = press.force;
  const MarkerSet markers = read_marker_pair(press.markers_rest, press.markers);
  Points deviations;
  if (press.markers_std) deviations = read_marker_deviations(*press.markers_std, markers.ids);
  for (int m = 0; m < markers.marker_count(); ++m) {
    if (!markers.is_seen(0, m)) continue;
    if (press.markers_std)
      for (int d = 0; d < 3; ++d) seen.weights.push_back(deviations(m, d));
    seen.rest.emplace_back(markers.rest.row(m).transpose());
    seen.loaded.emplace_back(markers.frames[0].row(m).transpose());
    seen.greatest_displacement = std::max(seen.greatest_displacement, (seen.loaded.back() - seen.rest.back()).norm());
  }
  if (seen.rest.size() < 3)
    throw InputError({{press.markers},
                      fmt::format("{} markers of {} under load", seen.rest.size(), seen.name),
                      "at least three that are also among those at rest",
                      "see which ids the two files share"});
  if (press.probe && press.glued) {
    seen.has_probe = true;
    seen.rest.push_back(press.contact_centre);
    seen.loaded.push_back(press.probe->point);
    // What the probe went counts as measured: no marker lies under it.
    seen.greatest_displacement = std::max(seen.greatest_displacement, (seen.loaded.back() - seen.rest.back()).norm());
  }
  return seen;
}

RigidContact contact_of(const PressScene& scene, const Press& press, double youngs_modulus) {
  ProbeOptions probe{press.glued ? ProbeKind::BondedDisc : ProbeKind::Punch, press.contact_centre, press.contact_radius,
                     press.probe ? press.probe->normal : press.force.normalized()};
  return probe_contact(*scene.body, probe, youngs_modulus);
}

ProbeControl control_of(const Press& press) {
  ProbeControl control;
  control.force = press.force;
  if (press.glued) return control;
  control.axis = press.probe ? press.probe->normal : press.force.normalized();
  control.force = *control.axis * control.axis->dot(press.force);
  return control;
}

std::vector<Vector3> without_probe(const ObservedPress& seen) {
  return {seen.rest.begin(), seen.rest.end() - (seen.has_probe ? 1 : 0)};
}

}  // namespace

bool is_of_static_tests(const Capture& capture) {
  const bool has_loads = std::ranges::any_of(capture.loads, [](const Load& load) { return load.role == "fit"; });
  return (!capture.presses.empty() || has_static_tests(capture)) && capture.scene.timing.times.empty() && !has_loads;
}

PressScene make_press_scene(const Capture& capture, std::shared_ptr<const Body> body) {
  PressScene scene;
  scene.held = held_nodes(*body, capture.scene);
  scene.sliding = sliding_bodies(capture.scene);
  const bool is_pressed = !capture.presses.empty() || !capture.indentations.empty() || !capture.grips.empty();
  if (is_pressed && scene.held.size() < 3)
    throw InputError({{capture.file},
                      "nothing holds the object while it is pressed",
                      "a block [[fixed]] that holds nodes of the mesh, or a glued [[inner]]",
                      "say where the object stands or is clamped"});
  const double volume = body->volume();
  scene.density =
      capture.scene.object.mass ? *capture.scene.object.mass / volume : capture.scene.object.density.value_or(0.0);
  scene.unit_weight = weight_of(*body, 1.0, capture.scene.world.gravity.value_or(Vector3::Zero()));
  scene.noise = 1e-3 * object_size(capture.scene);
  scene.tests = std::make_shared<StaticTests>(observe_static_tests(capture, *body));
  scene.body = std::move(body);
  for (std::size_t i = 0; i < capture.presses.size(); ++i) scene.presses.push_back(observe_press(capture, i));
  weigh_by_stated_deviations(scene.presses);
  scene.facts = capture.presses;
  return scene;
}

void put_in_front(const std::string& name, PressScene& scene) {
  for (ObservedPress& press : scene.presses) press.name = name + ": " + press.name;
  if (!scene.tests) return;
  StaticTests tests = *scene.tests;
  for (ObservedIndentation& test : tests.indentations) test.name = name + ": " + test.name;
  for (ObservedGrip& test : tests.grips) test.name = name + ": " + test.name;
  for (ObservedCurve& curve : tests.curves) curve.test.name = name + ": " + curve.test.name;
  scene.tests = std::make_shared<StaticTests>(std::move(tests));
}

void weigh_by_stated_deviations(std::vector<ObservedPress>& presses) {
  std::vector<double> stated;
  for (const ObservedPress& press : presses)
    std::ranges::copy_if(press.weights, std::back_inserter(stated), [](double s) { return std::isfinite(s); });
  if (stated.empty()) return;
  const double usual = median(std::move(stated));
  for (ObservedPress& press : presses) {
    if (press.weights.empty()) continue;
    for (double& w : press.weights) w = std::isfinite(w) ? w / usual : 1.0;
    press.weights.resize(3 * press.rest.size(), 1.0);  // the probe's
  }
}

std::vector<RigidContact> PressScene::contacts(std::optional<RigidContact> probe, double youngs_modulus) const {
  std::vector<RigidContact> contacts;
  if (probe) contacts.push_back(std::move(*probe));
  for (RigidContact& inner : inner_contacts(*body, sliding, youngs_modulus)) contacts.push_back(std::move(inner));
  return contacts;
}

void keep_inner_bodies(Equilibrium& equilibrium, int first) {
  for (int i = first; i < equilibrium.contact_count(); ++i)
    equilibrium.set_control(i, {ProbeControl::Kind::Position, {}, Vector3::Zero(), {}});
}

const StaticTests& PressScene::static_tests() const {
  static const StaticTests no_tests;
  return tests ? *tests : no_tests;
}

PressedBody::PressedBody(const PressScene& scene, int press, std::shared_ptr<const MaterialLaw> law,
                         double youngs_modulus)
    : equilibrium_(scene.body, std::move(law), scene.held,
                   scene.contacts(contact_of(scene, scene.facts[std::size_t(press)], youngs_modulus), youngs_modulus),
                   {.reuse_factor = true}),
      points_(*scene.body, without_probe(scene.presses[std::size_t(press)])),
      centre_(scene.facts[std::size_t(press)].contact_centre),
      has_probe_(scene.presses[std::size_t(press)].has_probe) {
  equilibrium_.set_dead_load(scene.dead_load());
  keep_inner_bodies(equilibrium_, 1);
  equilibrium_.set_control(0, control_of(scene.facts[std::size_t(press)]));
}

SolveSummary PressedBody::solve() {
  if (has_placement_) {
    const SolveSummary summary = equilibrium_.solve(placement_);
    if (summary.converged) return summary;
  }
  placement_ = equilibrium_.rest();
  const SolveSummary summary = equilibrium_.solve(placement_);
  has_placement_ = summary.converged;
  return summary;
}

SolveSummary PressedBody::solve_from(const Placement& guess) {
  Placement near = guess;
  const SolveSummary summary = equilibrium_.solve(near);
  if (!summary.converged) return solve();
  placement_ = std::move(near);
  has_placement_ = true;
  return summary;
}

Points PressedBody::points() const {
  Points all(point_count(), 3);
  all.topRows(points_.point_count()) = points_.positions(placement_.nodes);
  if (has_probe_) all.row(all.rows() - 1) = centre_.transpose() + placement_.translations.row(0);
  return all;
}

PressPrediction predict_press(const PressScene& scene, int press, const std::shared_ptr<const MaterialLaw>& law,
                              double youngs_modulus) {
  PressPrediction prediction;
  PressedBody pressed(scene, press, law, youngs_modulus);
  if (!pressed.solve().converged) {
    prediction.failure = pressed.equilibrium().failure();
    return prediction;
  }
  const ObservedPress& seen = scene.presses[std::size_t(press)];
  const Points points = pressed.points();
  const int markers = pressed.embedding().point_count();
  double squares = 0.0;
  for (int m = 0; m < markers; ++m) {
    const double d = (points.row(m).transpose() - seen.loaded[std::size_t(m)]).norm();
    squares += d * d;
    prediction.marker_max = std::max(prediction.marker_max, d);
  }
  prediction.marker_rms = std::sqrt(squares / double(markers));
  if (seen.greatest_displacement > 0.0) prediction.relative_error = prediction.marker_rms / seen.greatest_displacement;
  prediction.placement = pressed.placement();
  prediction.succeeded = true;
  return prediction;
}

std::vector<PressPrediction> predict_presses(const PressScene& scene, const std::shared_ptr<const MaterialLaw>& law) {
  const double modulus = mean_modulus(*scene.body, *law);
  std::vector<PressPrediction> predictions(scene.presses.size());
  parallel_for(0, int(predictions.size()),
               [&](int i) { predictions[std::size_t(i)] = predict_press(scene, i, law, modulus); });
  return predictions;
}

void LocalResiduals::add(const ObservedPress& press) {
  const int count = int(press.rest.size()) - int(press.has_probe);
  constexpr int neighbours = 8;
  std::vector<int> order;
  for (int m = 0; m < count; ++m) {
    order.resize(std::size_t(count));
    std::iota(order.begin(), order.end(), 0);
    const Vector3& at = press.rest[std::size_t(m)];
    const int near = std::min(neighbours + 1, count);
    std::ranges::partial_sort(order, order.begin() + near, {},
                              [&](int i) { return (press.rest[std::size_t(i)] - at).squaredNorm(); });
    if (near < 5) break;
    MatrixX A(near - 1, 4), b(near - 1, 3);  // the first is the marker itself
    for (int k = 1; k < near; ++k) {
      const auto i = std::size_t(order[std::size_t(k)]);
      A.row(k - 1) << 1.0, (press.rest[i] - at).transpose();
      b.row(k - 1) = (press.loaded[i] - press.rest[i]).transpose();
    }
    // Markers of one face say nothing about the normal direction: the least change along it.
    const VectorX row = pseudo_inverse(A).row(0).transpose();  // of the value at the marker
    const Vector3 moved = b.transpose() * row, error = press.loaded[std::size_t(m)] - at - moved;
    const double spread = std::sqrt(1.0 + row.squaredNorm());
    for (std::size_t d = 0; d < 3; ++d) {
      residuals.push_back(error[Eigen::Index(d)] / spread);
      weights.push_back(press.weight(3 * std::size_t(m) + d));
      displacements.push_back(moved.norm());
    }
  }
}

double marker_noise(const ObservedPress& press) {
  LocalResiduals local;
  local.add(press);
  std::vector<double>& sizes = local.residuals;
  for (double& r : sizes) r = std::abs(r);
  return 1.4826 * median(std::move(sizes));
}

double punch_modulus(const PressScene& scene, double poissons_ratio) {
  std::vector<double> moduli;
  for (std::size_t i = 0; i < scene.presses.size(); ++i) {
    const ObservedPress& seen = scene.presses[i];
    if (seen.role != "fit" || seen.greatest_displacement <= 0.0) continue;
    moduli.push_back(seen.force.norm() * (1.0 - poissons_ratio * poissons_ratio) /
                     (2.0 * scene.facts[i].contact_radius * seen.greatest_displacement));
  }
  for (const double modulus : guessed_moduli(scene.static_tests(), *scene.body, poissons_ratio))
    moduli.push_back(modulus);
  if (moduli.empty()) return 1e4;
  return median(std::move(moduli));
}

}  // namespace pliant
