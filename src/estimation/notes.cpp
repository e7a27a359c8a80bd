#include "estimation/notes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>

#include "estimation/sensor_poses.hpp"

namespace pliant {

std::string in_three_digits(double value) {
  constexpr double four_digits = 1e3, most_written_out = 1e8;
  if (!(std::abs(value) >= four_digits && std::abs(value) < most_written_out)) return fmt::format("{:.3g}", value);
  const double last = std::pow(10.0, std::floor(std::log10(std::abs(value))) - 2.0);  // of the digits that count
  return fmt::format("{:.0f}", std::round(value / last) * last);
}

std::string note_of_untried(const std::string& cause, const std::string& why) {
  return "How much the estimate depends on the " + cause + " could not be seen: " + why + ".";
}

namespace {

std::string spoken(std::string name) {
  for (char& c : name)
    if (c == '_') c = ' ';
  using Names = std::pair<std::string_view, std::string_view>;
  for (const auto& [plain, written] : {Names{"youngs", "Young's"}, Names{"poissons", "Poisson's"}})
    if (name.starts_with(plain)) name.replace(0, plain.size(), written);
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
  constexpr double strong = 0.9;
  constexpr std::size_t most = 6;  // pairs; the result has them all
  const auto names = outcome.parameters.coordinate_names();
  const auto parameters = outcome.parameters.coordinate_parameters();
  std::vector<std::pair<double, std::string>> pairs;
  for (std::size_t i = 0; i < names.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const auto is_aside = [](const Parameter& p) { return p.is_auxiliary || p.role == Role::Sensor; };
      if (is_aside(*parameters[i]) || is_aside(*parameters[j])) continue;
      const double r = outcome.correlation(Eigen::Index(i), Eigen::Index(j));
      if (std::abs(r) >= strong)
        pairs.emplace_back(-std::abs(r),
                           fmt::format("The estimates of {} and {} are strongly correlated (rho = {:.2f}): an error in "
                                       "one is made up by {} error in the other.",
                                       spoken(names[j]), spoken(names[i]), r, r > 0.0 ? "a like" : "an opposite"));
    }
  std::ranges::stable_sort(pairs, {}, [](const auto& pair) { return pair.first; });
  for (std::size_t k = 0; k < std::min(most, pairs.size()); ++k) outcome.notes.push_back(std::move(pairs[k].second));
  if (pairs.size() > most)
    outcome.notes.push_back(fmt::format("{} more pairs of parameters are strongly correlated.", pairs.size() - most));
}

void say_what_is_assumed(FitOutcome& outcome) {
  int at = 0;
  for (const Parameter& p : outcome.parameters.parameters()) {
    if (!p.estimated) continue;
    if (!p.is_auxiliary && std::isfinite(p.prior_std) &&
        outcome.uncertainty.std_noise.segment(at, p.dimension()).maxCoeff() > 0.7 * p.prior_std)
      outcome.notes.push_back("The recording says little about " + spoken(p.name) +
                              ": what was assumed beforehand weighs as much, or more.");
    at += p.dimension();
  }
}

/// Where sensors stand against what their captures state.
void say_poses(FitOutcome& outcome, const std::vector<const Capture*>& captures) {
  constexpr double doubtful = 3.0, degree = std::numbers::pi / 180.0;
  for (std::size_t r = 0; r < outcome.recordings.size(); ++r) {
    const std::vector<std::string> names = sensor_names(*captures[r]);
    const std::vector<PoseStd> stds = pose_stds(*captures[r]);
    const std::vector<SensorBlocks>& sensors = outcome.recordings[r].discretisation.mismatch.sensors;
    for (std::size_t k = 0; k < sensors.size(); ++k) {
      if (stds[k].turn == 0.0 && stds[k].shift == 0.0) continue;
      const Vector3 turn = sensors[k].turn.vector(outcome.theta), shift = sensors[k].shift.vector(outcome.theta);
      if (turn.isZero() && shift.isZero()) continue;  // a tracker took it as exact
      std::string text =
          fmt::format("The pose of {}{} was found {:.2f} degrees and {:.1f} mm from where the capture has it", names[k],
                      outcome.recordings.size() > 1 ? " in recording " + std::to_string(r + 1) : "",
                      turn.norm() / degree, 1e3 * shift.norm());
      const auto deviations = [](const Vector3& v, double std) {
        return std > 0.0 ? v.cwiseAbs().maxCoeff() / std : 0.0;
      };
      const double off = std::max(deviations(turn, stds[k].turn), deviations(shift, stds[k].shift));
      text += fmt::format(" (known there to {:.2f} degrees and {:.1f} mm about each axis).", stds[k].turn / degree,
                          1e3 * stds[k].shift);
      if (off > doubtful)
        text += fmt::format(
            " That is {:.1f} deviations: look at camera_to_world, where the scan stands, and planes that are known; or "
            "state a greater pose_std.",
            off);
      outcome.notes.push_back(std::move(text));
    }
  }
}

void say_where_starts_ended(FitOutcome& outcome) {
  constexpr double same = 1.02, rival = 1.5;  // times the lowest cost: a start that fits far worse is no rival
  if (outcome.starts.size() < 2) return;
  double low = INFINITY, high = 0.0, least = INFINITY;
  std::size_t reached = 0, given_up = 0;
  for (const FitStart& s : outcome.starts) least = std::min(least, s.cost);
  for (const FitStart& s : outcome.starts) {
    if (!std::isfinite(s.cost)) ++given_up;
    if (s.cost <= same * least) ++reached;
    if (!(s.cost < rival * least)) continue;
    const double modulus = s.final[outcome.recordings.front().discretisation.simulation.blocks.youngs_moduli.front()];
    low = std::min(low, modulus);
    high = std::max(high, modulus);
  }
  std::string told = fmt::format("{} of {} starts ended at the lowest cost", reached, outcome.starts.size());
  if (given_up > 0) told += fmt::format(", {} {} given up", given_up, given_up == 1 ? "was" : "were");
  if (high > 1.25 * low)
    told += fmt::format("; Young's modulus of those that fit nearly as well runs from {:.3g} to {:.3g} Pa", low, high);
  outcome.notes.push_back(told + ".");
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

std::string spoken_law(const LawForm& form) {
  if (form.terms == 0) return form.two_numbers == ElasticLaw::NeoHookean ? "a neo-Hookean law" : "a linear law";
  return fmt::format("Ogden's law of {} term{}{}", form.terms, form.terms == 1 ? "" : "s",
                     form.own_ratios ? " with Poisson's ratios of their own" : "");
}

/// Which elastic law, and which stiffness damping where something moves.
std::string spoken_material(const Discretisation& d) {
  const Material& material = d.simulation.material;
  const LawLayout* law = material.law_layout();
  std::string words = law ? spoken_law(law->form())
                      : material.of_mean_strain() == ElasticLaw::NeoHookean
                          ? "a neo-Hookean law of each element's mean strain"
                          : "corotated linear elasticity";
  if (d.simulation.is_static) return words;
  return words + ", " + (material.damping == StiffnessDamping::KelvinVoigt ? "Kelvin-Voigt" : "Rayleigh") + " damping";
}

void say_what_law(FitOutcome& outcome) {
  outcome.material = spoken_material(outcome.recordings.front().discretisation);
  outcome.notes.push_back("The material is " + outcome.material +
                          "; Young's modulus and Poisson's ratio are those of small strains.");
}

std::string form_of(const LawForm& form, const Capture& capture) {
  const std::string law = spoken_law(form);
  if (form.laws > 1)
    return law + fmt::format(", one for each of {} {}", form.laws, capture.scene.regions.empty() ? "zones" : "regions");
  return form.controls > 1 ? law + fmt::format(" with {} moduli", form.controls) : law;
}

std::string verdict_on(const TriedLaw& tried) {
  const bool was_fitted = std::isfinite(tried.cost);
  const char* verdict = tried.kept ? "kept" : was_fitted ? "not kept" : "not fitted";
  if (!std::isfinite(tried.evidence)) return tried.kept ? "tried first" : verdict;
  return fmt::format("{}, ln of the evidence for it {:.1f}{}", verdict, tried.evidence,
                     was_fitted ? "" : " by what a step promises");
}

std::string told(const SampledMaterial& sampled, const std::vector<PressSample>& samples) {
  double least = std::numeric_limits<double>::infinity(), most = 0.0;
  for (const PressSample& s : samples) least = std::min(least, s.weight), most = std::max(most, s.weight);
  return fmt::format(
      "The sampled material has {:.1f} samples an element beside the element's own law, from {} presses; the weight of "
      "smoothness was chosen by "
      "the noise in each, between {:.3g} and {:.3g}. Its stress misses that of the presses' own fields by "
      "{:.1f} % of the greatest, root mean square. The parameters above are those of the law that all presses "
      "share, from which the elements' laws depart.",
      sampled.mean_samples, samples.size(), least, most, 100.0 * sampled.stress_misfit);
}

/// Probes whose contact spans fewer nodes than show where it ends: their force is that of the mesh.
void say_what_contacts_are_coarse(const LawOutcome& law, std::vector<std::string>& notes) {
  constexpr int enough_nodes = 12;
  const Body& body = *law.scene->body;
  for (const ObservedIndentation& test : law.scene->static_tests().indentations) {
    const double deepest = test.curve.depths.back(), radius = test.probe.radius;
    const double reach = test.probe.kind == ProbeKind::Ball ? std::sqrt(radius * deepest) : radius;
    const Vector3 axis = probe_axis(body, test.probe);
    int nodes = 0;
    for (int n = 0; n < body.node_count(); ++n) {
      const Vector3 r = body.reference_positions().row(n).transpose() - test.probe.centre;
      const double along = r.dot(axis);
      nodes += std::abs(along) < 0.5 * reach && (r - along * axis).norm() < reach;
    }
    if (nodes < enough_nodes)
      notes.push_back(fmt::format(
          "The contact of {} has a radius of about {:.2g} mm and spans {} nodes of the mesh: too few for its "
          "force. Ask for more cells (--set cells=N), or give a volume_mesh that is finer there.",
          test.name, 1e3 * reach, nodes));
  }
}

}  // namespace

void add_law_notes(FitOutcome& outcome, const LawOutcome& law, const Capture& capture) {
  std::vector<std::string>& notes = outcome.notes;
  outcome.material = form_of(law.layout.form(), capture);
  for (const TriedLaw& tried : law.tried)
    notes.push_back(fmt::format("{}: {}", form_of(tried.form, capture), verdict_on(tried)));
  for (std::size_t c = 0; c < law.cuts.size(); ++c)
    notes.push_back(fmt::format("Zones: {}.", describe(law.cuts[c], int(c) + 1)));
  say_what_contacts_are_coarse(law, notes);
  if (!law.scene->presses.empty())
    notes.push_back(law.noise.growth > 0.0
                        ? fmt::format("A marker's coordinate is taken to err by {:.3g} mm and, on top of it, by "
                                      "{:.2g} % of how far the marker moves.",
                                      1e3 * law.noise.at_rest, 100.0 * law.noise.growth)
                        : fmt::format("A marker's coordinate is taken to err by {:.3g} mm.", 1e3 * law.noise.at_rest));
  if (!law.sampled) return;
  outcome.material += ", and what presses show of each element, interpolated in strain space";
  notes.push_back(told(*law.sampled, law.samples));
}

void add_notes(FitOutcome& outcome, const std::vector<const Capture*>& captures) {
  say_what_law(outcome);
  say_what_anchors(outcome, *captures.front());
  if (outcome.correlation.size() > 0) {
    say_what_is_inseparable(outcome);
    say_what_is_assumed(outcome);
  }
  say_where_starts_ended(outcome);
  say_poses(outcome, captures);
  say_what_shape(outcome);
  if (outcome.evaluation.succeeded && outcome.evaluation.matched_fraction() < 0.9)
    outcome.notes.push_back(
        "More than a tenth of the observed points lie too far from the simulated object to be matched: "
        "check mass, planes, the pose of the scan and the segmentation.");
}

}  // namespace pliant
