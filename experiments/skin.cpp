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

#include "estimation/optimiser.hpp"
#include "estimation/press_objective.hpp"
#include "request.hpp"

namespace pliant {
namespace {

using nlohmann::json;
using Numbers = std::vector<double>;

struct Step {
  Vector3 pad;
  Points displacements;  ///< of the points in the plane; none: empty
  bool has_force = false, fitted = false;
  double force = 0.0, force_noise = 1.0;
};

struct Sheet {
  std::shared_ptr<const Body> body;
  std::vector<int> moving, held;  ///< nodes of the moving pad, and of both
  Embedding points;
  std::vector<Step> steps;
  double noise = 1.0;
};

class SheetTrial : public Trial {
 public:
  SheetTrial(std::shared_ptr<const Sheet> sheet, const LawLayout& layout, const VectorX& reference, bool all)
      : sheet_(std::move(sheet)),
        layout_(layout),
        all_(all),
        equilibrium_(sheet_->body, press_law(*sheet_->body, layout, reference), sheet_->held, {},
                     EquilibriumOptions{.tolerance = 1e-9}),
        placements_(sheet_->steps.size()) {}

  [[nodiscard]] CostEvaluation gradient(const VectorX& theta, VectorX& theta_bar) override {
    CostEvaluation result = run(theta, MatrixX::Identity(theta.size(), theta.size()));
    if (result.succeeded) theta_bar = result.frames.front().gradient;
    return result;
  }

  [[nodiscard]] CostEvaluation run(const VectorX& theta, const MatrixX& directions) override {
    CostEvaluation result;
    equilibrium_.set_law(press_law(*sheet_->body, layout_, theta));
    FrameFit fit;
    const bool with_derivatives = directions.cols() > 0;
    if (with_derivatives) {
      fit.gradient = VectorX::Zero(directions.cols());
      fit.gauss_newton = MatrixX::Zero(directions.cols(), directions.cols());
    }
    const double none = std::numeric_limits<double>::quiet_NaN();
    forces.assign(sheet_->steps.size(), none), rms.assign(sheet_->steps.size(), none);
    std::size_t before = sheet_->steps.size();
    for (std::size_t s = 0; s < sheet_->steps.size(); ++s) {
      const Step& step = sheet_->steps[s];
      if (!all_ && !step.fitted) continue;
      if (!solve(s, before)) return result.failure = equilibrium_.failure(), result;
      before = s;
      ++result.steps;
      add(s, step, theta, directions, with_derivatives, fit.cost, fit.gradient, fit.gauss_newton);
    }
    result.cost = fit.cost;
    result.frames.push_back(std::move(fit));
    result.succeeded = std::isfinite(result.cost);
    if (!result.succeeded) result.failure = "the cost is not finite";
    return result;
  }

  /// Of the last evaluation, a step each: force on the sheet [N], rms of the displacements' errors [m]; not a number
  /// where there was none.
  std::vector<double> forces, rms;

 private:
  /// From where the step was last, or from the step before.
  bool solve(std::size_t s, std::size_t before) {
    Placement& placement = placements_[s];
    const auto lead = [&] {
      for (const int n : sheet_->held) placement.nodes.row(n) = sheet_->body->nodes.row(n);
      for (const int n : sheet_->moving) placement.nodes.row(n) += sheet_->steps[s].pad.transpose();
    };
    if (placement.nodes.size() > 0 && equilibrium_.solve(placement).converged) return true;
    placement = before < placements_.size() ? placements_[before] : equilibrium_.rest();
    lead();
    if (equilibrium_.solve(placement).converged) return true;
    placement = {};
    return false;
  }

  Points internal(const Points& nodes) {
    Points forces_on(nodes.rows(), 3);
    forces_on.setZero();
    (void)equilibrium_.elasticity().evaluate(nodes, false);
    equilibrium_.elasticity().add_gradient(forces_on);
    return forces_on;
  }
  /// Of the moving pad on the sheet, along x.
  double pull(const Points& internal_forces) const {
    double sum = 0.0;
    for (const int n : sheet_->moving) sum += internal_forces(n, 0);
    return sum;
  }

  void add(std::size_t s, const Step& step, const VectorX& theta, const MatrixX& by_p, bool with_derivatives,
           double& cost, VectorX& gradient, MatrixX& curvature) {
    const Points& nodes = placements_[s].nodes;
    forces[s] = pull(internal(nodes));
    Points off;
    if (step.displacements.rows() > 0) {
      off = sheet_->points.positions(nodes) - sheet_->points.positions(sheet_->body->nodes) - step.displacements;
      off.col(2).setZero();
      rms[s] = std::sqrt(off.squaredNorm() / double(off.rows()));
      if (step.fitted) cost += 0.5 * off.squaredNorm() / (sheet_->noise * sheet_->noise);
    }
    const double r = (forces[s] - step.force) / step.force_noise;
    if (step.fitted && step.has_force) cost += 0.5 * r * r;
    if (!with_derivatives || !step.fitted) return;
    if (!equilibrium_.prepare_derivatives(placements_[s])) {
      cost = std::numeric_limits<double>::infinity();
      return;
    }
    const int count = layout_.size();
    std::vector<Points> changes(std::size_t(count), Points::Zero(nodes.rows(), 3));  // of dW/dx
    equilibrium_.elasticity().for_parameter_derivatives(
        [&](int e, std::span<const int> of, const Eigen::Ref<const MatrixX>& by_q) {
          const MatrixX by = by_q * law_parameters_by_theta(*sheet_->body, layout_, theta, e);
          for (std::size_t a = 0; a < of.size(); ++a)
            for (int k = 0; k < count; ++k)
              changes[std::size_t(k)].row(of[a]) += by.col(k).segment<3>(3 * Eigen::Index(a)).transpose();
        });
    MatrixX by_theta(off.size() + 1, count);
    for (int k = 0; k < count; ++k) {
      const Points& change = changes[std::size_t(k)];
      const Points moved = equilibrium_.response(-change);
      if (off.rows() > 0) {
        Points seen = sheet_->points.positions(moved.topRows(nodes.rows()));
        seen.col(2).setZero();
        by_theta.col(k).head(off.size()) = flat(seen) / sheet_->noise;
      }
      // The pull changes with the law, and with where the nodes go: a central difference along that.
      const double size = moved.cwiseAbs().maxCoeff();
      const double h = size > 0.0 ? 1e-7 / size : 0.0;
      double along = pull(change);
      if (h > 0.0)
        along += (pull(internal(nodes + h * moved.topRows(nodes.rows()))) -
                  pull(internal(nodes - h * moved.topRows(nodes.rows())))) /
                 (2.0 * h);
      by_theta(off.size(), k) = step.has_force ? along / step.force_noise : 0.0;
    }
    const MatrixX J = by_theta * by_p;
    VectorX residuals(J.rows());
    if (off.rows() > 0) residuals.head(off.size()) = flat(off) / sheet_->noise;
    residuals[off.size()] = step.has_force ? r : 0.0;
    gradient += J.transpose() * residuals;
    curvature += J.transpose() * J;
  }

  std::shared_ptr<const Sheet> sheet_;
  LawLayout layout_;
  bool all_;  ///< steps that are not fitted are simulated, too
  Equilibrium equilibrium_;
  std::vector<Placement> placements_;
};

std::vector<std::unique_ptr<Trial>> only(std::unique_ptr<Trial> trial) {
  std::vector<std::unique_ptr<Trial>> trials;
  trials.push_back(std::move(trial));
  return trials;
}

class Experiment {
 public:
  explicit Experiment(const Choices& choices) {
    request_ = read_request(choices);
    auto sheet = std::make_shared<Sheet>();
    const double cell = request_.at("cell"), thickness = request_.at("thickness"), fixed = request_.at("fixed_pad");
    const int behind = request_.at("cells").at(0), beside = request_.at("cells").at(1);
    const int between = int(std::lround(fixed / cell));
    Box box;
    box.extend(Vector3(-behind * cell, -beside * cell, -thickness));
    box.extend(Vector3((between + behind) * cell, beside * cell, 0.0));
    sheet->body = std::make_shared<Body>(make_body(make_tet_box(box, {between + 2 * behind, 2 * beside, 1}, false)));
    const double half = (request_.at("pad_cells").get<int>() + 0.01) * cell;
    for (int n = 0; n < sheet->body->node_count(); ++n) {
      const Vector3 at = sheet->body->nodes.row(n);
      const bool rim =
          at.x() < box.min.x() + 1e-9 || at.x() > box.max.x() - 1e-9 || std::abs(at.y()) > beside * cell - 1e-9;
      if (rim && request_.at("rim_held")) sheet->held.push_back(n);
      if (std::abs(at.y()) > half) continue;
      if (std::abs(at.x()) < half) sheet->moving.push_back(n);
      if (std::abs(at.x()) < half || std::abs(at.x() - between * cell) < half) sheet->held.push_back(n);
    }
    std::vector<Vector3> points;
    for (const json& p : request_.at("points")) points.emplace_back(p.at(0), p.at(1), 0.0);
    sheet->points = Embedding(*sheet->body, points);
    sheet->noise = request_.at("displacement_noise");
    for (const json& j : request_.at("steps")) {
      Step step;
      step.pad = Vector3(j.at("pad").at(0), j.at("pad").at(1), 0.0);
      const json& seen = j.at("displacements");
      step.displacements = Points::Zero(Eigen::Index(seen.size()), 3);
      for (std::size_t i = 0; i < seen.size(); ++i)
        step.displacements.row(Eigen::Index(i)) << seen[i].at(0).get<double>(), seen[i].at(1).get<double>(), 0.0;
      step.has_force = !j.at("force").is_null();
      if (step.has_force) step.force = j.at("force"), step.force_noise = j.at("force_noise");
      step.fitted = j.at("fitted");
      sheet->steps.push_back(std::move(step));
    }
    sheet_ = std::move(sheet);
  }

  json run() const {
    const auto begin = std::chrono::steady_clock::now();
    const int terms = request_.at("terms");
    const LawLayout layout({1, terms});
    ParameterSet parameters = law_parameters(layout, request_.at("start_modulus"));
    parameters.fix("poisson_ratio", request_.at("poisson_ratio"));
    const VectorX theta = parameters.reference();
    Objective objective(only(std::make_unique<SheetTrial>(sheet_, layout, theta, false)), parameters);
    const VectorX p = parameters.to_unconstrained(theta);
    json report = {{"nodes", sheet_->body->node_count()}, {"elements", sheet_->body->element_count()}};
    if (request_.at("task") == "check") {
      const CostEvaluation at = objective.linearise(p);
      if (!at.succeeded) throw std::runtime_error(at.failure);
      for (Eigen::Index k = 0; k < p.size(); ++k) {
        const VectorX d = 1e-3 * VectorX::Unit(p.size(), k);
        const double slope = (objective.evaluate(p + d).cost - objective.evaluate(p - d).cost) / 2e-3;
        report["derivative_errors"].push_back(std::abs(slope / at.gradient[k] - 1.0));
      }
      return report;
    }
    OptimiserOptions options;
    options.max_iterations = 25;
    const OptimiserSummary summary = minimise(objective, p, options);
    report["succeeded"] = summary.succeeded, report["reason"] = summary.reason;
    report["evaluations"] = summary.evaluations;
    if (summary.succeeded) {
      const VectorX found = parameters.to_theta(summary.p);
      report["theta"] = Numbers(found.begin(), found.end());
      SheetTrial whole(sheet_, layout, theta, true);
      const CostEvaluation evaluation = whole.run(found, MatrixX(found.size(), 0));
      if (!evaluation.succeeded) report["failure"] = evaluation.failure;
      for (const double f : whole.forces) report["forces"].push_back(std::isfinite(f) ? json(f) : json());
      for (const double r : whole.rms) report["rms"].push_back(std::isfinite(r) ? json(r) : json());
    }
    report["seconds"] = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return report;
  }

 private:
  json request_;
  std::shared_ptr<const Sheet> sheet_;
};

}  // namespace
}  // namespace pliant

int main(int argc, char** argv) {
  return pliant::run_experiment<pliant::Experiment>("pliant_skin", argc, argv, {{"request", ""}});
}
