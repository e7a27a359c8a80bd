#include "motion/compliance.hpp"

namespace pliant {

namespace {

std::vector<ForceTerm*> pointers(const std::vector<std::unique_ptr<ForceTerm>>& terms) {
  std::vector<ForceTerm*> all;
  for (const auto& term : terms) all.push_back(term.get());
  return all;
}

}  // namespace

Compliance::Compliance(const std::shared_ptr<const Body>& body, const SimulationOptions& options, const VectorX& theta,
                       const Points& x)
    : x_(x), terms_(scene_forces(body, options)), statics_(body, pointers(terms_)) {
  for (const auto& term : terms_) term->set_parameters(theta);
  statics_.hold(eliminated_nodes(*body, options));
  is_ready_ = statics_.prepare_derivatives(x_);
}

Points Compliance::missing_forces() {
  Points forces = Points::Zero(x_.rows(), 3);
  for (const auto& term : terms_) term->add_force(x_, forces);
  return -forces;
}

}  // namespace pliant
