#include "elasticity/material.hpp"

#include <utility>

namespace pliant {

namespace {

/// The forces of a law as a function of where the body is stress-free.
class LawReferenceForces : public ReferenceForces {
 public:
  explicit LawReferenceForces(std::unique_ptr<LawElasticity> elasticity) : elasticity_(std::move(elasticity)) {}

  void set_parameters(const VectorX& theta) override { elasticity_->set_parameters(theta); }
  bool linearise(const Points& X, const Points& p, const Points& z) override {
    if (!elasticity_->set_reference_positions(X)) return false;
    elasticity_->linearise(p);
    elasticity_->linearise_reference(z);
    z_ = z;
    return true;
  }
  void add_force(Points& force) const override { elasticity_->add_force(z_, force); }
  void add_matrix(double scale, BlockMatrix& matrix) const override {
    elasticity_->add_reference_matrix(scale, matrix);
  }
  void add_tangents(std::span<const Points* const> d_references, std::span<Points* const> forces) const override {
    elasticity_->add_reference_tangents(d_references, forces);
  }
  void add_adjoint(const Points& w, Points& reference_bar) const override {
    elasticity_->add_reference_adjoint(w, reference_bar);
  }
  const Matrix3& rotation(int element) const override { return elasticity_->rotation(element).R; }
  double least_volume_ratio() const override { return elasticity_->least_volume_ratio(); }

 private:
  std::unique_ptr<LawElasticity> elasticity_;
  Points z_;
};

}  // namespace

std::optional<ElasticLaw> Material::of_mean_strain() const {
  const auto* law = std::get_if<ElasticLaw>(&elastic);
  return law ? std::optional(*law) : std::nullopt;
}

std::shared_ptr<const MaterialLaw> Material::law() const {
  const auto* law = std::get_if<std::shared_ptr<const MaterialLaw>>(&elastic);
  return law ? *law : nullptr;
}

std::vector<ParameterHandle> Material::parameters(const MaterialBlocks& blocks) const {
  if (law_layout()) return law_layout()->all();
  if (!of_mean_strain()) return {};
  std::vector<ParameterHandle> all = blocks.youngs_moduli;
  all.push_back(blocks.poissons_ratio);
  return all;
}

std::unique_ptr<Elasticity> Material::make_elasticity(const std::shared_ptr<const Body>& body,
                                                      const MaterialBlocks& blocks) const {
  if (const auto of_mean = of_mean_strain()) return pliant::make_elasticity(body, blocks, *of_mean);
  return law_layout() ? LawElasticity::make(body, *law_layout()) : LawElasticity::make(body, law());
}

std::unique_ptr<ReferenceForces> Material::make_reference_forces(const std::shared_ptr<const Body>& body,
                                                                 const MaterialBlocks& blocks) const {
  if (const auto of_mean = of_mean_strain()) return ReferenceForces::make(body, blocks, *of_mean);
  return std::make_unique<LawReferenceForces>(law_layout() ? LawElasticity::make(body, *law_layout())
                                                           : LawElasticity::make(body, law()));
}

}  // namespace pliant
