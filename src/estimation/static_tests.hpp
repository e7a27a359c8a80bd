#pragma once

#include <memory>
#include <string>
#include <vector>

#include "capture/capture.hpp"
#include "capture/curves.hpp"
#include "estimation/material_tests.hpp"
#include "model/result.hpp"
#include "motion/contact_defaults.hpp"
#include "motion/equilibrium.hpp"

namespace pliant {

struct PressScene;

/// Force-depth curve as it was measured.
struct ObservedIndentation {
  std::string name, role;  ///< "indentation 1" or as the capture names it; "fit" or "test"
  ProbeOptions probe;      ///< with its axis
  ForceCurve curve;
  double contact_std = 0.0;  ///< [m] of an error that all depths have in common; 0: they are exact
};

/// Measurement between grips as it was made.
struct ObservedGrip {
  std::string name, role;          ///< "grip 1" or as the capture names it; "fit" or "test"
  std::vector<int> nodes;          ///< of the body, that are moved
  Vector3 displacement;            ///< [m] of those nodes
  bool has_force = false;          ///< whether the force was measured
  Vector3 direction;               ///< unit vector of the measured force
  double force = 0.0;              ///< [N] of the grip on the object along `direction`
  double force_std = 1.0;          ///< [N]
  std::vector<Vector3> rest;       ///< [m] markers at rest that were seen under load
  std::vector<Vector3> loaded;     ///< [m] where they were seen, as many
  double markers_std = 1.0;        ///< [m] of a coordinate
  Matrix3 seen = Matrix3::Zero();  ///< projector on the directions in which markers were measured
};

/// Stress-strain curve as it was measured.
struct ObservedCurve {
  std::string role;  ///< "fit" or "test"
  MaterialTest test;
};

/// Static tests of a capture beside its presses.
struct StaticTests {
  std::vector<ObservedIndentation> indentations;
  std::vector<ObservedGrip> grips;
  std::vector<ObservedCurve> curves;
  bool any_to_fit() const;
};

/// Whether a capture has curves or grips, of any role, and whether any of them is to be fitted.
bool has_static_tests(const Capture& capture);
bool has_static_tests_to_fit(const Capture& capture);
/// Whether stress-strain curves of the object's material are all that a capture has to fit.
bool is_of_material_curves(const Capture& capture);

/// Stress-strain curves of a capture, of all roles.
std::vector<ObservedCurve> observed_curves(const Capture& capture);

/// Reads a capture's static tests (all roles) around a body of its object.
/// Throws InputError where a grip holds none of the body's nodes, or files cannot be read.
StaticTests observe_static_tests(const Capture& capture, const Body& body);

/// Young's moduli that the tests to fit say by closed formulas, to set out from [Pa]: of a ball that of Hertz 1882, of
/// a punch that of Sneddon 1965, of a grip force over displacement as of a bar, of a curve its secants.
std::vector<double> guessed_moduli(const StaticTests& tests, const Body& body, double poissons_ratio);

/// What a law predicts of all static tests of a scene but presses. Stress-strain curves are those of the law of the
/// first element.
std::vector<CurvePrediction> predict_curves(const PressScene& scene, const std::shared_ptr<const MaterialLaw>& law);
/// The same of stress-strain curves alone.
std::vector<CurvePrediction> predict_curves(const std::vector<ObservedCurve>& curves, const MaterialLaw& law);

/// "site 3 (test): 0.012 N rms, 4.1 % of the greatest measured".
std::string curve_sentence(const CurvePrediction& curve);

}  // namespace pliant
