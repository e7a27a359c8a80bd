#include "elasticity/material_field.hpp"

#include <algorithm>
#include <stdexcept>

namespace pliant {

namespace {

VectorX values_at(const std::vector<ParameterHandle>& handles, const VectorX& theta) {
  VectorX values(Eigen::Index(handles.size()));
  for (std::size_t k = 0; k < handles.size(); ++k) values[Eigen::Index(k)] = theta[handles[k]];
  return values;
}

}  // namespace

MaterialField::MaterialField(std::shared_ptr<const Body> body, LawLayout layout)
    : body_(std::move(body)), layout_(std::move(layout)), handles_(layout_.all()) {
  if (layout_.form().controls != body_->modulus.controls)
    throw std::invalid_argument("a body of " + std::to_string(body_->modulus.controls) +
                                " control moduli and a law of " + std::to_string(layout_.form().controls));
}

void MaterialField::set_parameters(const VectorX& theta) {
  VectorX values = values_at(handles_, theta);
  if (law_ && values == values_ && theta.size() == theta_.size()) return;
  law_ = law_at(*body_, layout_, theta);
  values_ = std::move(values);
  theta_ = theta;
  has_derivatives_ = false;
}

auto MaterialField::derivatives() -> const Matrix& {
  if (has_derivatives_) return derivatives_;
  std::vector<Eigen::Triplet<double>> entries;
  for (int e = 0; e < body_->element_count(); ++e) {
    const VectorX own = element_numbers(*body_, layout_, theta_, e);
    const MatrixX by_own = law_parameter_derivatives(layout_.form(), own);
    for (const auto& [number, at, share] : number_shares(*body_, layout_, theta_, own, e))
      for (Eigen::Index q = 0; q < by_own.rows(); ++q)
        if (by_own(q, number) != 0.0)
          entries.emplace_back(int(e * by_own.rows() + q), int(at.first), share * by_own(q, number));
  }
  derivatives_.resize(Eigen::Index(body_->element_count()) * parameters(), theta_.size());
  derivatives_.setFromTriplets(entries.begin(), entries.end());
  has_derivatives_ = true;
  return derivatives_;
}

void MaterialField::set_changes(const Eigen::Ref<const MatrixX>& d_theta) {
  has_changes_ = false;
  for (Eigen::Index c = 0; c < d_theta.cols(); ++c)
    has_changes_ = has_changes_ || !values_at(handles_, d_theta.col(c)).isZero(0.0);
  if (has_changes_) changes_.noalias() = derivatives() * d_theta;
}

void MaterialField::end_adjoint(VectorX& theta_bar) { theta_bar += derivatives().transpose() * bar_; }

}  // namespace pliant
