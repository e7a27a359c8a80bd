#pragma once

#include <filesystem>
#include <random>

#include "estimation/grip_trial.hpp"
#include "estimation/indentation_trial.hpp"
#include "model/vtu.hpp"
#include "support/presses.hpp"

namespace pliant::test {

/// Which static tests a capture of a block has.
struct CurveKinds {
  bool indentations = true, grips = true, curves = true, has_shape = true;
  double contact_error = 0.0;  ///< [m] by which indentations are deeper than they say, and its standard deviation
};

/// Static tests of a block on the floor (`PressedBlock`), with the forces and stresses that a law makes.
class CurveCapture {
 public:
  /// @param noise  standard deviation of forces and stresses over each curve's greatest
  CurveCapture(const std::filesystem::path& folder, const std::shared_ptr<const MaterialLaw>& law,
               const std::shared_ptr<const MaterialLaw>& element_law, double noise, const CurveKinds& kinds = {})
      : folder_(folder), noise_(noise), contact_error_(kinds.contact_error) {
    scene_ = block_.scene({}, law);
    capture.name = "tested block";
    if (kinds.has_shape) {
      VtuGrid grid;
      grid.kind = VtuCell::Tetrahedron;
      grid.points = scene_.body->nodes;
      grid.connectivity = scene_.body->connectivity;
      write_vtu(folder / "block.vtu", grid);
      capture.scene.object.volume.emplace();
      capture.scene.object.file = folder / "block.vtu";
      capture.scene.object.density = scene_.density;
      capture.scene.world.gravity = Vector3(0.0, -9.81, 0.0);
      capture.scene.fixed = {{RegionBox{{-1.0, -1.0, -1.0}, {1.0, -0.0499, 1.0}}, std::nullopt}};
    }
    if (kinds.indentations) {
      indent(law, {"site 1", IndenterShape::Ball, 0.03, {0.0, 0.05, 0.0}, {0.0, -1.0, 0.0}, {}, "fit"});
      indent(law, {"site 2", IndenterShape::Punch, 0.025, {0.04, 0.05, -0.03}, {0.0, -1.0, 0.0}, {}, "fit"});
      indent(law, {"", IndenterShape::Ball, 0.025, {-0.05, 0.05, 0.04}, {0.0, -1.0, 0.0}, {}, "test"});
    }
    if (kinds.grips) grip(law);
    if (kinds.curves) {
      stretch(*element_law, TestMode::Uniaxial, {0.8, 0.9, 1.1, 1.2, 1.3, 1.4}, "fit");
      stretch(*element_law, TestMode::Biaxial, {0.9, 1.05, 1.1, 1.2}, "fit");
      stretch(*element_law, TestMode::SimpleShear, {-0.2, 0.1, 0.3}, "test");
    }
    if (kinds.has_shape) write_markers();
    write_capture(folder, capture);
  }

  Capture capture;

 private:
  double error() { return normal_(random_); }

  void indent(const std::shared_ptr<const MaterialLaw>& law, Indentation facts) {
    ObservedIndentation test;
    test.probe = {facts.probe == IndenterShape::Ball ? ProbeKind::Ball : ProbeKind::Punch, facts.contact, facts.radius,
                  facts.direction};
    test.curve.depths = {0.002, 0.004, 0.006, 0.008, 0.01};
    for (double& depth : test.curve.depths) depth += contact_error_;
    IndentedBody body(scene_, test, law, mean_modulus(*scene_.body, *law));
    for (std::size_t d = 0; d < test.curve.depths.size(); ++d) {
      EXPECT_TRUE(body.solve(d)) << body.failure();
      test.curve.forces.push_back(body.force(d));
    }
    for (double& depth : test.curve.depths) depth -= contact_error_;
    facts.contact_std = contact_error_;
    const double std = std::max(1e-6, noise_) * test.curve.forces.back();
    test.curve.stds.assign(test.curve.depths.size(), std);
    for (double& force : test.curve.forces) force += noise_ > 0.0 ? std * error() : 0.0;
    facts.curve = folder_ / ("indentation_" + std::to_string(capture.indentations.size()) + ".csv");
    write_force_curve(facts.curve, test.curve);
    capture.indentations.push_back(std::move(facts));
  }

  void grip(const std::shared_ptr<const MaterialLaw>& law) {
    Grip facts;
    facts.name = "lid";
    facts.region = RegionBox{{-1.0, 0.0499, -1.0}, {1.0, 1.0, 1.0}};
    facts.displacement = {0.01, 0.004, 0.0};
    facts.force_direction = Vector3::UnitX();
    ObservedGrip test;
    for (int n = 0; n < scene_.body->node_count(); ++n)
      if (scene_.body->nodes(n, 1) > 0.0499) test.nodes.push_back(n);
    test.displacement = facts.displacement;
    test.has_force = true;
    test.direction = facts.force_direction;
    for (const double x : {-0.06, 0.0, 0.06}) test.rest.emplace_back(x, 0.01, 0.1);
    GrippedBody body(scene_, test, law);
    EXPECT_TRUE(body.solve()) << body.failure();
    facts.force_std = std::max(1e-6, noise_) * std::abs(body.force());
    facts.force = body.force() + (noise_ > 0.0 ? *facts.force_std * error() : 0.0);
    marked_.ids.clear();
    marked_.positions = body.markers();
    resting_.positions.resize(marked_.positions.rows(), 3);
    for (std::size_t m = 0; m < test.rest.size(); ++m) {
      marked_.ids.push_back(std::to_string(m));
      resting_.positions.row(Eigen::Index(m)) = test.rest[m].transpose();
      marked_.positions(Eigen::Index(m), 2) += 0.005;  // not measured
    }
    resting_.ids = marked_.ids;
    facts.markers = folder_ / "lid.csv", facts.markers_rest = folder_ / "rest.csv";
    facts.markers_std = 1e-4;
    facts.unseen = Vector3::UnitZ();
    capture.grips.push_back(std::move(facts));
  }

  void write_markers() {
    if (capture.grips.empty()) return;
    write_marker_positions(folder_ / "lid.csv", marked_);
    write_marker_positions(folder_ / "rest.csv", resting_);
  }

  void stretch(const MaterialLaw& law, TestMode mode, const std::vector<double>& stretches, const char* role) {
    MaterialTest test;
    test.mode = mode;
    test.stretch = stretches;
    if (mode == TestMode::Biaxial) test.second = {1.1, 1.0, 1.2, 0.95};
    test.stress = predict_test(law, test);
    const double std = std::max(1e-6, noise_) * test.greatest_stress();
    for (double& stress : test.stress) stress += noise_ > 0.0 ? std * error() : 0.0;
    MaterialCurve facts;
    facts.name = test_mode_names()[std::size_t(mode)];
    facts.mode = mode;
    facts.curve = folder_ / (facts.name + ".csv");
    facts.role = role;
    write_stress_curve(facts.curve,
                       {test.stretch, test.second, test.stress, std::vector<double>(test.stress.size(), std)});
    capture.material_curves.push_back(std::move(facts));
  }

  std::filesystem::path folder_;
  double noise_, contact_error_;
  PressedBlock block_;
  PressScene scene_;
  MarkerPositions marked_, resting_;
  std::mt19937 random_{5};
  std::normal_distribution<double> normal_;
};

}  // namespace pliant::test
