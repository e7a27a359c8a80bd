#include "live/live_object.hpp"

#include <algorithm>
#include <stdexcept>

#include "elasticity/body_fields.hpp"
#include "live/live_motion.hpp"
#include "live/live_press.hpp"

namespace pliant {

std::unique_ptr<LiveObject> LiveObject::make(LiveData data) {
  if (data.is_pressed) return std::make_unique<LivePress>(std::move(data));
  return std::make_unique<LiveMotion>(std::move(data));
}

LiveObject::LiveObject(LiveData data) : data_(std::move(data)) {
  Body body = std::holds_alternative<HexGrid>(data_.mesh) ? make_body(std::get<HexGrid>(data_.mesh))
                                                          : make_body(std::get<TetMesh>(data_.mesh));
  if (data_.relative_moduli.size() == body.modulus.relative.size()) body.modulus.relative = data_.relative_moduli;
  const MotionLayout blocks = live_blocks(data_.planes);
  const auto fits = [&](const VectorX& theta, const std::shared_ptr<const MaterialLaw>& law) {
    return theta.size() == blocks.size() && (!law || law->element_count() == body.element_count());
  };
  bool is_sound = fits(data_.theta, data_.material.law());
  for (const LiveSample& sample : data_.samples) is_sound = is_sound && fits(sample.theta, sample.law);
  if (!is_sound) throw std::runtime_error("the bytes of the object make no sense");
  body_ = std::make_shared<Body>(std::move(body));
  vertices_ = Embedding(*body_, data_.surface.vertices);
}

LiveObject::Touched LiveObject::touched(int triangle, const Vector3& corners, const Points& vertices) const {
  const auto& t = data_.surface.triangles.at(std::size_t(triangle));
  Vector3 p[3], at = Vector3::Zero();
  for (int k = 0; k < 3; ++k) {
    p[k] = vertices.row(t[std::size_t(k)]).transpose();
    at += corners[k] * p[k];
  }
  return {at, -(p[1] - p[0]).cross(p[2] - p[0]).normalized()};
}

const std::vector<float>& LiveObject::field(LiveField which) {
  field_.assign(data_.surface.vertices.size(), 0.0f);
  if (which == LiveField::None) return field_;
  if (which == LiveField::Displacement) {
    for (std::size_t v = 0; v < field_.size(); ++v)
      field_[v] = float((surface_.row(Eigen::Index(v)).transpose() - data_.surface.vertices[v]).norm());
    return field_;
  }
  const std::shared_ptr<const MaterialLaw> law = this->law();
  std::vector<double> of_elements(std::size_t(body_->element_count()));
  for (int e = 0; e < body_->element_count(); ++e) {
    Matrix3 F = Matrix3::Zero();
    const auto element = body_->element(e);
    const auto gradients = body_->gradients(e);
    for (std::size_t a = 0; a < element.size(); ++a)
      F += nodes().row(element[a]).transpose() * gradients.row(Eigen::Index(a));
    double& value = of_elements[std::size_t(e)];
    if (which == LiveField::Modulus) value = law->small_strain(e).youngs_modulus;
    if (which == LiveField::Deviation && e < data_.relative_deviations.size())
      value = law->small_strain(e).youngs_modulus * data_.relative_deviations[e];
    if (which == LiveField::ModulusAtStrain) value = tangent_modulus(*law, e, F);
    if (which == LiveField::Strain) value = greatest_strain(polar_decomposition(F).S);
    if (which == LiveField::VonMises) value = von_mises(cauchy_stress(*law, e, F));
  }
  const std::vector<double> averages = averages_at(*body_, vertices_, of_elements);
  std::ranges::transform(averages, field_.begin(), [](double v) { return float(v); });
  return field_;
}

}  // namespace pliant
