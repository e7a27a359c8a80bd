#include "estimation/notes.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace pliant {

namespace {

std::string spoken(std::string name) {
  for (char& c : name)
    if (c == '_') c = ' ';
  return name;
}

void say_what_anchors(FitOutcome& outcome, const Capture& capture) {
  if (capture.scene.object.mass || capture.scene.object.density) return;
  const bool hangs = std::ranges::any_of(capture.loads, [](const Load& load) { return load.role == "fit"; });
  if (hangs)
    outcome.notes.push_back(
        "Neither mass nor density is known: both pascals and the density follow from the weights of [[load]].");
  else if (capture.scene.initial.release_of)
    outcome.notes.push_back(
        "Neither mass nor density is known: both pascals and the density follow from the weight that was released.");
  else
    outcome.notes.push_back(
        "Neither mass nor density is known: the absolute scale of stiffness is not identifiable, only E/rho. The "
        "values "
        "hold for the density listed; weigh the object to fix them.");
}

void say_what_is_inseparable(FitOutcome& outcome) {
  const auto names = outcome.parameters.coordinate_names();
  const auto parameters = outcome.parameters.coordinate_parameters();
  for (std::size_t i = 0; i < names.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      if (parameters[i]->is_auxiliary || parameters[j]->is_auxiliary) continue;
      const double r = outcome.correlation(Eigen::Index(i), Eigen::Index(j));
      if (std::abs(r) < 0.9) continue;
      char text[64];
      std::snprintf(text, sizeof text, " (rho = %.2f).", r);
      outcome.notes.push_back("The estimates of " + spoken(names[j]) + " and " + spoken(names[i]) +
                              " are strongly correlated" + text);
    }
}

void say_what_is_assumed(FitOutcome& outcome) {
  int at = 0;
  for (const Parameter& p : outcome.parameters.parameters()) {
    if (!p.estimated) continue;
    if (!p.is_auxiliary && std::isfinite(p.prior_std) &&
        outcome.std.segment(at, p.dimension()).maxCoeff() > 0.7 * p.prior_std)
      outcome.notes.push_back("The recording says little about " + spoken(p.name) +
                              ": its value is close to what was assumed beforehand.");
    at += p.dimension();
  }
}

void say_if_starts_disagree(FitOutcome& outcome) {
  double low = INFINITY, high = 0.0, least = INFINITY;
  for (const FitStart& s : outcome.starts) least = std::min(least, s.cost);
  for (const FitStart& s : outcome.starts) {
    if (!(s.cost < 1.5 * least)) continue;  // a start that fits far worse is no rival
    const double modulus = s.final[outcome.recordings.front().discretisation.simulation.blocks.youngs_moduli.front()];
    low = std::min(low, modulus);
    high = std::max(high, modulus);
  }
  if (high > 1.25 * low) {
    char text[160];
    std::snprintf(
        text, sizeof text,
        "Starts ended at different stiffness, from %.3g to %.3g Pa; the one with the lowest cost was followed.", low,
        high);
    outcome.notes.push_back(text);
  }
}

/// The stress-free reference shape is another one than the scan's.
void say_what_shape(FitOutcome& outcome) {
  for (const RecordingOutcome& r : outcome.recordings) {
    const SimulationOptions& scene = r.discretisation.simulation;
    if (!r.rest_body || (!scene.scan_sags && scene.shape.points.empty())) continue;
    const Points moved = r.rest_body->nodes - r.rest_body->scanned_positions();
    char text[64];
    std::snprintf(text, sizeof text, "%.3g mm", 1e3 * moved.rowwise().norm().maxCoeff());
    outcome.notes.push_back(scene.scan_sags ? "The scan shows the object as it sags; in its stress-free reference "
                                              "shape, which the model has, parts of it "
                                              "lie up to " +
                                                  std::string(text) + " elsewhere."
                                            : "The scan was corrected along with the material, by up to " +
                                                  std::string(text) + ".");
  }
}

}  // namespace

void add_notes(FitOutcome& outcome, const std::vector<const Capture*>& captures) {
  say_what_anchors(outcome, *captures.front());
  if (outcome.correlation.size() > 0) {
    say_what_is_inseparable(outcome);
    say_what_is_assumed(outcome);
  }
  say_if_starts_disagree(outcome);
  say_what_shape(outcome);
  if (outcome.evaluation.succeeded && outcome.evaluation.matched_fraction() < 0.9)
    outcome.notes.push_back(
        "More than a tenth of the observed points lie too far from the simulated object to be matched: "
        "check mass, planes, the pose of the scan and the segmentation.");
}

}  // namespace pliant
