#pragma once

#include <gmock/gmock.h>

#include <cmath>

#include "estimation/fit_plan.hpp"

namespace pliant::test {

/// A plan of a fit, and stages that were done, of an object that is dropped: no simulation is needed to see what comes
/// next.
struct Plans : testing::Test {
  Plans() {
    ParameterLayout layout;
    std::vector<Parameter> list;
    const auto add = [&](const char* name, const char* unit, int size, Role role, bool estimated) -> Parameter& {
      Parameter p;
      p.name = name, p.unit = unit, p.estimated = estimated;
      p.transform = size == 1 ? Transform::Logarithm : Transform::Vector;
      p.at = layout.add({name, unit, size, role});
      list.push_back(p);
      return list.back();
    };
    facts.moduli = {add("youngs_modulus", "Pa", 1, Role::Material, true).at};
    add("poissons_ratio", "1", 1, Role::Material, true);
    facts.density = add("density", "kg/m^3", 1, Role::Inertia, false).at;
    Parameter& gravity = add("gravity", "m/s^2", 3, Role::Load, false);
    gravity.prior_mean = Vector3(0.0, -10.0, 0.0), gravity.prior_std = 10.0;
    facts.gravity = gravity.at;
    add("linear_velocity", "m/s", 3, Role::Initial, true);
    add("range_error@front", "m", 1, Role::Sensor, false);
    VectorX theta = VectorX::Zero(layout.size());
    theta[facts.moduli[0]] = 1e4, theta[1] = 0.3, theta[facts.density] = 200.0;
    theta.segment<3>(facts.gravity) = Vector3(0.0, -10.0, 0.0);
    facts.parameters = ParameterSet(layout, list, theta);
    facts.relative_moduli = VectorX::Ones(1);
    facts.size = 0.1;
    facts.options.scan_per_decade = 2, facts.options.starts = 2;
  }

  std::vector<StageChain> next() const { return FitPlan(facts).next(state); }
  const Stage& only(const std::vector<StageChain>& chains) const {
    EXPECT_EQ(chains.size(), 1u);
    return chains.front().front();
  }
  VectorX theta(double modulus) const {
    VectorX t = facts.parameters.reference();
    t[facts.moduli[0]] = modulus;
    return t;
  }
  StageRecord record(const StageId& id, double cost, double modulus = 1e4) const {
    StageRecord r{id, "", theta(modulus), theta(modulus)};
    r.cost = cost, r.succeeded = std::isfinite(cost), r.iterations = 3;
    r.misfit = 2.5;  // neither so good that a stage can be left out, nor so bad that more starts are needed
    return r;
  }
  void has_done(StageRecord r) { state.done.push_back(std::move(r)); }
  void has_moved() {
    has_done(record({StageKind::Motion, 0, 0}, 9.0));
    has_done(record({StageKind::Motion, 0, 1}, 8.0));
  }
  /// Valleys at 400 Pa and at 4e4 Pa, the first one lower.
  void has_scanned() {
    has_moved();
    has_done(record({StageKind::Swing}, 0.0));
    StageRecord scan = record({StageKind::Scan}, 0.0);
    scan.trials = {{2e2, 5.0}, {4e2, 3.0}, {4e3, 6.0}, {4e4, 4.0}, {4e5, infinite}};
    has_done(scan);
  }
  void has_followed(double first = 2.5, double second = 3.5) {
    has_scanned();
    for (const int number : {0, 1}) {
      has_done(record({StageKind::Coarse, 0, number}, first, 410.0 + number));
      has_done(record({StageKind::Coarse, 1, number}, second, 4.1e4));
    }
  }
  void has_estimated() {
    has_followed();
    has_done(record({StageKind::Fine, 0, 0}, 2.0, 420.0));
    has_done(record({StageKind::Fine, 0, 1}, 1.5, 430.0));
  }

  PlanFacts facts;
  PassState state;
};

}  // namespace pliant::test
