#pragma once

#include "capture/capture.hpp"
#include "estimation/objective.hpp"
#include "estimation/press_law.hpp"

namespace pliant {

/// A measured curve: stress over stretch or shear.
struct MaterialTest {
  std::string name;
  TestMode mode = TestMode::Uniaxial;
  StressMeasure measure = StressMeasure::First;
  std::vector<double> stretch;  ///< [-], > 0; of a simple shear the shear, of any sign
  std::vector<double> stress;   ///< [Pa], as many
  std::vector<double> second;   ///< Biaxial: the stretches along y, as many
  double prestretch = 1.0;      ///< SimpleShear: along x
  std::vector<double> std =
      {};  ///< [Pa] standard deviation of each stress, as many; empty: the same part of the greatest

  double greatest_stress() const;  ///< [Pa], of any sign
};

/// Throws std::invalid_argument where lengths differ, a number is not finite, a stretch not positive, or nothing of the
/// curve differs from zero.
void check_test(const MaterialTest& test);

/// The cube at one point of a test.
struct TestPoint {
  bool found = false;     ///< false: the law has no state in which the free faces carry no stress, or none was found
  Matrix3 F;              ///< deformation gradient
  Matrix3 P;              ///< nominal stress [Pa]
  double stress = 0.0;    ///< by the test's measure [Pa]
  VectorX by_parameters;  ///< d stress / dq of the law's parameters, where asked for
};

/// The homogeneous deformation at a point of a test. The free stretch minimises the energy: Newton's method on its
/// logarithm, which keeps to where a bracket has the root. Derivatives follow by the implicit function theorem.
/// @param element  of the law
TestPoint solve_test(const MaterialLaw& law, int element, const MaterialTest& test, std::size_t point,
                     bool with_derivatives = false);

/// A law's stresses over a whole test [Pa]; not a number where no state was found.
std::vector<double> predict_test(const MaterialLaw& law, const MaterialTest& test);

/// Root mean square of predicted less measured stress over the test's greatest stress. Not a number where `predicted`
/// holds one.
double relative_rms(const MaterialTest& test, const std::vector<double>& predicted);

/// Secant moduli of a test's points, as if all were stretched along one axis [Pa]; those that are positive.
std::vector<double> secant_moduli(const MaterialTest& test);

/// The body of one tetrahedron whose law the curves determine.
/// @param controls  moduli of the object: the element's is the first
std::shared_ptr<const Body> unit_element(int controls = 1);

/// A stress-strain curve of a material: half the squares of simulated less measured stress over the test's standard
/// deviations or, where it states none, over `noise` times the curve's greatest stress, so that curves count by their
/// points, not by their units. The law is that of one element: of the first control modulus, where there are several.
class CurveTrial : public Trial {
 public:
  /// @param number  what the evaluation's frame calls it
  /// @param noise   standard deviation of a stress, relative to the curve's greatest, > 0
  /// @param parameters  whose exponents keep to their bounds: what lies beyond cannot be simulated
  /// Throws std::invalid_argument where the test is not as `check_test` wants it, or the noise is not positive.
  CurveTrial(MaterialTest test, int number, const LawLayout& layout, double noise, const ParameterSet& parameters);

  [[nodiscard]] CostEvaluation run(const VectorX& theta, const MatrixX& directions) override;
  [[nodiscard]] CostEvaluation gradient(const VectorX& theta, VectorX& theta_bar) override;
  [[nodiscard]] std::unique_ptr<Trial> anew() const override { return std::make_unique<CurveTrial>(*this); }

  /// Goes on with another form of the law.
  void set_layout(const LawLayout& layout, const ParameterSet& parameters);
  /// What the evaluation's frame says of its trial (`FrameFit::recording`).
  void set_recording(int recording) { recording_ = recording; }

 private:
  double std_of(std::size_t point) const;

  MaterialTest test_;
  int number_, recording_ = 0;
  LawLayout layout_;
  double noise_;
  std::vector<Parameter> bounded_;
  std::shared_ptr<const Body> body_;
};

}  // namespace pliant
