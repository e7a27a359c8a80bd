#pragma once

#include <optional>
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

/// The range of stress-strain curves that were fitted; nothing where there is none.
std::optional<DeformationResult> strain_range(const std::vector<CurvePrediction>& curves);

}  // namespace pliant
