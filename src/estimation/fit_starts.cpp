#include "estimation/fit_starts.hpp"

#include <algorithm>

#include "estimation/modal_start.hpp"
#include "estimation/notes.hpp"
#include "estimation/swing.hpp"

namespace pliant {

namespace {

/// The first modulus of a swing whose modes about rest are known, where its weight changes them.
std::optional<double> with_weight(const Discretisation& d, const Recording& r, const VectorX& theta) {
  if (r.blocks.motion.gravity.vector(theta).isZero()) return std::nullopt;
  Simulation simulation(d.body, d.simulation);
  const auto start = swing_start(simulation, theta, *r.observations);
  return start ? std::optional(start->youngs_modulus) : std::nullopt;
}

/// Dampings that the user has not given begin where the decay of the vibrations has them.
void take_dampings(const ModalStart& start, const PlanFacts& facts, VectorX& theta) {
  const auto take = [&](const char* name, double value) {
    const auto change = facts.options.parameters.find(name);
    const Parameter* p = facts.parameters.find(name);
    if (value <= 0.0 || !p->estimated || (change != facts.options.parameters.end() && change->second.start)) return;
    theta[p->at] = std::clamp(value, p->lower, p->upper);
  };
  take("mass_damping", start.mass_damping);
  take("stiffness_damping", start.stiffness_damping);
}

std::string told(const std::string& what, double modulus) {
  return what + in_three_digits(modulus) + " Pa; the fit started there.";
}

std::optional<SeenSwing> swing_of_tracks(const Recordings& recordings, const Recording& r, const Discretisation& d,
                                         const std::vector<int>& held, const PlanFacts& facts, VectorX theta) {
  ModalStartOptions o;
  o.first_frame = r.capture.scene.timing.start_frame;
  o.curve_samples = 0;
  const ModalStart start =
      modal_start(d.body, r.blocks.motion, theta, held, r.tracked, r.capture.scene.timing.times, o);
  if (!start.found) return std::nullopt;
  take_dampings(start, facts, theta);
  const VectorX relative = start.moduli / start.moduli[0];
  recordings.set_moduli(theta, start.moduli[0] * relative);
  const double modulus = with_weight(d, r, theta).value_or(start.moduli[0]);
  recordings.set_moduli(theta, modulus * relative);
  return SeenSwing{theta,
                   told("The vibrations of the followed points are those of a Young's modulus of about ", modulus)};
}

std::optional<SeenSwing> swing_of_points(const Recordings& recordings, const Recording& r, const Discretisation& d,
                                         const PlanFacts& facts, VectorX theta) {
  Simulation simulation(d.body, d.simulation);
  const auto start = swing_start(simulation, theta, *r.observations);
  if (!start) return std::nullopt;
  recordings.set_moduli(theta, start->youngs_modulus * facts.relative_moduli);
  return SeenSwing{theta, told("The object swings at " + in_three_digits(start->frequency) +
                                   " Hz, as with a Young's modulus of about ",
                               start->youngs_modulus)};
}

}  // namespace

std::optional<SeenSwing> seen_swing(const Recordings& recordings, const PlanFacts& facts, const Grid& coarse,
                                    const VectorX& theta) {
  for (std::size_t i = 0; i < recordings.all().size(); ++i) {
    const Recording& r = recordings.all()[i];
    if (r.capture.scene.timing.is_static || r.capture.scene.fixed.empty()) continue;
    const Discretisation& d = coarse.recording[i];
    const std::vector<int> held = held_nodes(*d.body, d.simulation.holds);
    if (held.size() < 3) continue;
    auto seen = r.tracked.rest.empty() ? swing_of_points(recordings, r, d, facts, theta)
                                       : swing_of_tracks(recordings, r, d, held, facts, theta);
    if (seen) return seen;
  }
  return std::nullopt;
}

}  // namespace pliant
