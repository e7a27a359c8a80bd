#pragma once

#include <Eigen/SparseCore>
#include <memory>

#include "elasticity/law_layout.hpp"

namespace pliant {

/// The parameters q of every element's law out of a parameter vector, with derivatives. A few control values (one, one
/// a region, control points, zones, or one an element: whatever the body's `ModulusField` mixes) become the numbers of
/// each element (`element_numbers`), and those its q (`law_parameter_derivatives`): one sparse matrix dq/dtheta, whose
/// products are the tangent and the adjoint.
class MaterialField {
 public:
  /// Throws std::invalid_argument where the layout has another number of control moduli than the body's field.
  MaterialField(std::shared_ptr<const Body> body, LawLayout layout);

  const LawLayout& layout() const { return layout_; }
  /// Takes the law's numbers out of theta. Throws std::invalid_argument where they make no material.
  void set_parameters(const VectorX& theta);
  /// The law of all elements there; its table is elements x q.
  const std::shared_ptr<const TabulatedLaw>& law() const { return law_; }

  /// Sets the changes of every element's q for changes of theta, one a column.
  void set_changes(const Eigen::Ref<const MatrixX>& d_theta);
  /// That of one element, q; where `has_changes` is false all are zero, and there is none to ask for.
  auto change(int element, Eigen::Index direction = 0) const {
    return changes_.col(direction).segment(Eigen::Index(element) * parameters(), parameters());
  }
  bool has_changes() const { return has_changes_; }

  /// Collects cotangents of q ...
  void begin_adjoint() { bar_.setZero(Eigen::Index(body_->element_count()) * parameters()); }
  auto adjoint(int element) { return bar_.segment(Eigen::Index(element) * parameters(), parameters()); }
  /// ... and adds what they are to theta.
  void end_adjoint(VectorX& theta_bar);

 private:
  using Matrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;
  Eigen::Index parameters() const { return law_->table().cols(); }
  /// dq/dtheta, elements times q x theta.
  const Matrix& derivatives();

  std::shared_ptr<const Body> body_;
  LawLayout layout_;
  std::vector<ParameterHandle> handles_;
  VectorX theta_, values_;  // theta as it was set, and the law's numbers in it
  std::shared_ptr<const TabulatedLaw> law_;
  Matrix derivatives_;
  bool has_derivatives_ = false, has_changes_ = false;
  MatrixX changes_;  // one direction a column
  VectorX bar_;
};

}  // namespace pliant
