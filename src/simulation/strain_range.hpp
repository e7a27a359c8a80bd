#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "elasticity/body.hpp"
#include "elasticity/body_fields.hpp"
#include "model/result.hpp"

namespace pliant {

/// How far a body is strained over a series of states, and how fast.
class StrainRange {
 public:
  explicit StrainRange(const Body& body);

  /// @param fields  of the body in that state
  /// @param time    [s], later than that of the state before; nothing: a body at rest, which has no rate
  void add(const BodyFields& fields, std::optional<double> time);

  /// Nothing before a state was added.
  std::optional<DeformationResult> result() const;

 private:
  double exceeded_by(double share, const std::vector<double>& of_elements) const;

  std::vector<double> volumes_, peaks_, before_, rates_;
  std::optional<double> time_;
};

/// The wider one of two in each number; the one that there is, where there is one.
std::optional<DeformationResult> wider(const std::optional<DeformationResult>& a,
                                       const std::optional<DeformationResult>& b);
/// The range of curves and measurements between grips that were fitted; nothing where there is none.
std::optional<DeformationResult> strain_range(const std::vector<CurvePrediction>& curves);

/// How far the object of a model was strained while it was recorded, by the result.json of its fit in the same folder;
/// nothing where that says nothing. Throws InputError where it is there and cannot be read.
std::optional<DeformationResult> recorded_strain_range(const std::filesystem::path& model_file);
/// That a model is extrapolated, in words; empty where it is not, or where nothing is known of either range.
std::string extrapolation_note(const std::optional<DeformationResult>& recorded,
                               const std::optional<DeformationResult>& now);

}  // namespace pliant
