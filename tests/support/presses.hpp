#pragma once

#include <memory>
#include <random>

#include "estimation/press_objective.hpp"
#include "motion/press_session.hpp"
#include "support/bodies.hpp"

namespace pliant::test {

/// A block of 0.2 x 0.1 x 0.2 m on the floor, pressed by discs with known forces; markers on its free faces where the
/// given material has them.
struct PressedBlock {
  explicit PressedBlock(const Eigen::Vector3i& cells = {5, 3, 5})
      : body(tet_body({0.2, 0.1, 0.2}, cells, false, 0.1)) {}

  PressScene scene(const std::vector<std::pair<Vector3, Vector3>>& centres_and_forces,
                   const std::shared_ptr<const MaterialLaw>& law, double noise = 0.0, unsigned seed = 1) const {
    PressScene s;
    s.body = body;
    for (int n = 0; n < body->node_count(); ++n)
      if (body->nodes(n, 1) < -0.0499) s.held.push_back(n);
    s.noise = 2e-4;
    s.density = 30.0;
    s.unit_weight = weight_of(*body, 1.0, {0.0, -9.81, 0.0});
    std::vector<Vector3> markers;
    for (double a = -0.08; a < 0.09; a += 0.04)
      for (double b = -0.08; b < 0.09; b += 0.04) markers.emplace_back(a, 0.05, b);
    for (double a = -0.08; a < 0.09; a += 0.04)
      for (double b = -0.03; b < 0.04; b += 0.03) {
        markers.emplace_back(a, b, 0.1);
        markers.emplace_back(0.1, b, a);
      }
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    for (std::size_t i = 0; i < centres_and_forces.size(); ++i) {
      const auto& [centre, force] = centres_and_forces[i];
      Press press;
      press.force = force;
      press.contact_centre = centre;
      press.contact_radius = 0.03;
      s.facts.push_back(press);
      s.presses.push_back({"press " + std::to_string(i + 1), "fit", force, markers, markers, true, 0.0});
      s.presses.back().rest.push_back(centre);
      PressedBody pressed(s, int(i), law, mean_modulus(*body, *law));
      EXPECT_TRUE(pressed.solve().converged) << pressed.equilibrium().failure();
      const Points points = pressed.points();
      s.presses.back().loaded.clear();
      for (Eigen::Index m = 0; m < points.rows(); ++m) {
        const Vector3 error(normal(random), normal(random), normal(random));
        s.presses.back().loaded.emplace_back(points.row(m).transpose() + noise * error);
        s.presses.back().greatest_displacement =
            std::max(s.presses.back().greatest_displacement,
                     (points.row(m).transpose() - s.presses.back().rest[std::size_t(m)]).norm());
      }
    }
    return s;
  }

  static std::vector<std::pair<Vector3, Vector3>> presses() {
    return {{{0.0, 0.05, 0.0}, {0.0, -4.0, 0.5}},
            {{0.04, 0.05, -0.03}, {1.0, -15.0, 0.0}},
            {{-0.05, 0.05, 0.04}, {0.0, -30.0, 3.0}},
            {{0.1, 0.01, 0.0}, {-12.0, -2.0, 0.0}}};
  }

  std::shared_ptr<const Body> body;
};

}  // namespace pliant::test
