// A sheet between two pads, one of which is led aside: fits a law to the sheet's displacements and the pad's force over
// some steps and predicts other steps, as JSON on stdout.
//   pliant_skin request=FILE
// The file: {"task": "fit" | "check", "thickness", "cell", "fixed_pad": x [m], "cells": [behind, beside] (that the
// sheet
//   reaches beyond the pads' middles), "pad_cells": N (half a pad's), "points": [[x, y], ...] [m] of the sheet at rest,
//   "displacement_noise": [m], "terms": N, "poisson_ratio": nu, "start_modulus": E [Pa], "rim_held": true | false,
//   "steps": [{"pad": [ux, uy] [m], "displacements": [[ux, uy], ...] or [], "force": f [N] or null, "force_noise": [N],
//   "fitted"}]}
// The moving pad stands around the origin, the fixed one around (fixed_pad, 0).

#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>

#include "estimation/grip_trial.hpp"
#include "estimation/optimiser.hpp"
#include "request.hpp"
#include "tested_bodies.hpp"

namespace pliant {
namespace {

using nlohmann::json;
using Numbers = std::vector<double>;

class Experiment {
 public:
  explicit Experiment(const Choices& choices) {
    request_ = read_request(choices);
    const double cell = request_.at("cell"), thickness = request_.at("thickness"), fixed = request_.at("fixed_pad");
    const int behind = request_.at("cells").at(0), beside = request_.at("cells").at(1);
    const int between = int(std::lround(fixed / cell));
    Box box;
    box.extend(Vector3(-behind * cell, -beside * cell, -thickness));
    box.extend(Vector3((between + behind) * cell, beside * cell, 0.0));
    const auto body =
        std::make_shared<Body>(make_body(make_tet_box(box, {between + 2 * behind, 2 * beside, 1}, false)));
    const double half = (request_.at("pad_cells").get<int>() + 0.01) * cell;
    std::vector<int> moving, held;
    for (int n = 0; n < body->node_count(); ++n) {
      const Vector3 at = body->nodes.row(n);
      const bool rim =
          at.x() < box.min.x() + 1e-9 || at.x() > box.max.x() - 1e-9 || std::abs(at.y()) > beside * cell - 1e-9;
      const bool is_beside = std::abs(at.y()) < half;
      if (is_beside && std::abs(at.x()) < half)
        moving.push_back(n);
      else if ((rim && request_.at("rim_held")) || (is_beside && std::abs(at.x() - between * cell) < half))
        held.push_back(n);
    }
    std::vector<Vector3> points;
    for (const json& p : request_.at("points")) points.emplace_back(p.at(0), p.at(1), 0.0);
    StaticTests tests;
    for (const json& j : request_.at("steps")) tests.grips.push_back(step(j, moving, points));
    scene_ = tested(body, held, std::move(tests));
  }

  json run() const {
    const auto begin = std::chrono::steady_clock::now();
    const int terms = request_.at("terms");
    const LawLayout layout({1, terms});
    ParameterSet parameters = law_parameters(layout, request_.at("start_modulus"));
    parameters.fix("poissons_ratio", request_.at("poisson_ratio"));
    const VectorX theta = parameters.reference();
    PressObjective objective = objective_of(scene_, layout, parameters);
    const VectorX p = parameters.to_unconstrained(theta);
    json report = {{"nodes", scene_->body->node_count()}, {"elements", scene_->body->element_count()}};
    if (request_.at("task") == "check") {
      report["derivative_errors"] = derivative_errors(objective.cost(), p);
      return report;
    }
    OptimiserOptions options;
    options.max_iterations = 25;
    const OptimiserSummary summary = minimise(objective.cost(), p, options);
    report["succeeded"] = summary.succeeded, report["reason"] = summary.reason;
    report["evaluations"] = summary.evaluations;
    if (summary.succeeded) {
      const VectorX found = parameters.to_theta(summary.p);
      report["theta"] = Numbers(found.begin(), found.end());
      predict(press_law(*scene_->body, layout, found), report);
    }
    report["seconds"] = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return report;
  }

 private:
  ObservedGrip step(const json& j, const std::vector<int>& moving, const std::vector<Vector3>& points) const {
    ObservedGrip grip;
    grip.role = j.at("fitted") ? "fit" : "test";
    grip.nodes = moving;
    grip.displacement = Vector3(j.at("pad").at(0), j.at("pad").at(1), 0.0);
    grip.direction = Vector3::UnitX();
    grip.has_force = !j.at("force").is_null();
    if (grip.has_force) grip.force = j.at("force"), grip.force_std = j.at("force_noise");
    const json& seen = j.at("displacements");
    for (std::size_t i = 0; i < seen.size(); ++i) {
      grip.rest.push_back(points[i]);
      grip.loaded.push_back(points[i] + Vector3(seen[i].at(0), seen[i].at(1), 0.0));
    }
    grip.markers_std = request_.at("displacement_noise");
    grip.seen = Vector3(1.0, 1.0, 0.0).asDiagonal();
    return grip;
  }

  /// Force on the sheet [N] and rms of the displacements' errors [m] of each step, null where there is none.
  void predict(const std::shared_ptr<const MaterialLaw>& law, json& report) const {
    for (const ObservedGrip& grip : scene_->tests->grips) {
      GrippedBody body(*scene_, grip, law);
      const bool solved = body.solve();
      if (!solved) report["failure"] = body.failure();
      report["forces"].push_back(solved ? json(body.force()) : json());
      double squares = 0.0;
      const Points there = solved ? body.markers() : Points(0, 3);
      for (Eigen::Index m = 0; m < there.rows(); ++m)
        squares += (grip.seen * (there.row(m).transpose() - grip.loaded[std::size_t(m)])).squaredNorm();
      report["rms"].push_back(there.rows() > 0 ? json(std::sqrt(squares / double(there.rows()))) : json());
    }
  }

  json request_;
  std::shared_ptr<const PressScene> scene_;
};

}  // namespace
}  // namespace pliant

int main(int argc, char** argv) {
  return pliant::run_experiment<pliant::Experiment>("pliant_skin", argc, argv, {{"request", ""}});
}
