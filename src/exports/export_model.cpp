#include "exports/export_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "base/error.hpp"
#include "exports/flat_elements.hpp"
#include "simulation/inner_bodies.hpp"
#include "simulation/model_simulation.hpp"
#include "simulation/scene_simulation.hpp"

namespace pliant {

namespace {

constexpr int frequencies_told = 6;
constexpr double close_frequencies = 0.02;  // relative
constexpr double fewest_cells = 2.0, most_cells = 300.0;
constexpr int most_export_nodes = 8000;  // of a mesh that nobody asked for

/// Highest frequency of K with lumped masses over the nodes that are not held, by power iteration [rad/s].
double stiffest_of(const std::shared_ptr<const Body>& body, const SimulationOptions& options, const VectorX& theta,
                   const std::vector<double>& masses, const std::vector<int>& held) {
  constexpr int iterations = 100;
  const auto elasticity = scene_elasticity(body, options);
  elasticity->set_parameters(theta);
  elasticity->linearise(body->nodes);
  BlockMatrix K(body->pattern);
  elasticity->add_matrix(1.0, K);
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  VectorX x(3 * body->node_count()), y(x.size());
  for (double& value : x) value = normal(random);
  const auto hold = [&](VectorX& v) {
    for (const int node : held) v.segment<3>(3 * node).setZero();
  };
  hold(x);
  double lambda = 0.0;
  for (int i = 0; i < iterations; ++i) {
    y.setZero();
    K.multiply(x, y);
    for (Eigen::Index k = 0; k < y.size(); ++k) y[k] /= masses[std::size_t(k / 3)];
    hold(y);
    lambda = y.norm() / x.norm();
    x = y.normalized();
  }
  return std::sqrt(lambda);
}

}  // namespace

std::vector<double> ExportModel::lumped_masses() const {
  std::vector<double> masses(std::size_t(body->node_count()), 0.0);
  for (int e = 0; e < body->element_count(); ++e)
    for (const int node : body->element(e))
      masses[std::size_t(node)] += density * body->element_volume[std::size_t(e)] / body->nodes_per_element();
  return masses;
}

namespace {

/// A mesh for an export, and how it vibrates and sags with the model's moduli.
struct Candidate {
  std::shared_ptr<const Body> body;
  SmallMotions motions;
  double poissons_ratio = 0.0;
  double identified = 1.0;  ///< what moduli are to be multiplied by
  double off = 0.0;         ///< of the further frequencies then, at most [-]
};

std::shared_ptr<const Body> mended(const Body& body, const std::vector<Hold>& holds) {
  const auto is_held = [&](const Vector3& place) {
    return std::ranges::any_of(holds, [&](const Hold& hold) { return hold.contains(place); });
  };
  Body other = make_body(with_flat_elements_mended(std::get<TetMesh>(body.mesh), is_held));
  other.modulus = body.modulus;
  return std::make_shared<Body>(std::move(other));
}

/// A model, and all that its meshes are compared by.
struct Comparison {
  const Model& model;
  const ModelScene& scene;
  SimulationOptions options;        ///< `elastic_alone`
  std::vector<double> frequencies;  ///< of the model's own elements [Hz]

  bool is_of(ElementKind kind) const { return scene.body->kind == kind; }

  /// @param poissons_ratio  of the new elements
  Candidate candidate(std::shared_ptr<const Body> body, double poissons_ratio) const {
    Candidate c;
    c.body = std::move(body);
    c.poissons_ratio = poissons_ratio;
    VectorX theta = scene.theta;
    theta[options.blocks.poissons_ratio] = poissons_ratio;
    c.motions = small_motions(c.body, options, theta, c.body->nodes, frequencies_told);
    // The same elements need no identification, but for rounding.
    if (!is_of(c.body->kind) || scene.body->node_count() != c.body->node_count())
      c.identified = std::pow(frequencies.front() / c.motions.frequencies.front(), 2);
    for (std::size_t k = 1; k < frequencies.size(); ++k)
      c.off = std::max(c.off, std::abs(std::sqrt(c.identified) * c.motions.frequencies[k] / frequencies[k] - 1.0));
    return c;
  }

  /// Linear elements lock where the material hardly changes its volume. A smaller ratio of Poisson's frees them; it is
  /// lowered while the further frequencies come closer.
  Candidate candidate(ElementKind kind, std::optional<double> cells) const {
    std::shared_ptr<const Body> body = model_body(model, kind, cells);
    if (kind != ElementKind::Tetrahedron || is_of(kind)) return candidate(std::move(body), model.poissons_ratio);
    body = mended(*body, options.holds);
    Candidate best = candidate(body, model.poissons_ratio);
    for (const double ratio : {0.48, 0.46, 0.44, 0.42, 0.40, 0.37, 0.34, 0.30}) {
      if (best.off <= close_frequencies) break;
      if (ratio >= model.poissons_ratio) continue;
      Candidate next = candidate(body, ratio);
      if (next.off > best.off) break;
      best = std::move(next);
    }
    return best;
  }

  /// Finer meshes until all frequencies are close, one more would have too many nodes, or they come no closer twice:
  /// then the model's own elements are too coarse to be met. The error falls with the square of the elements' size,
  /// which says how much finer the next mesh is to be.
  Candidate fine_enough(ElementKind kind) const {
    constexpr double finest_step = 2.0, coarsest_step = 1.25, aim = 0.85 * close_frequencies;
    constexpr int most_meshes = 5;
    Candidate best = candidate(kind, std::nullopt), last = best;
    int no_closer = 0;
    double cells = (kind == ElementKind::Tetrahedron ? 1.2 : 0.6) * object_size(model.scene) / model.cell_size;
    for (int k = 1; k < most_meshes && best.off > close_frequencies; ++k) {
      const double room = std::cbrt(double(most_export_nodes) / last.body->node_count());
      const double finer = std::min(std::clamp(std::sqrt(last.off / aim), coarsest_step, finest_step), room);
      if (finer < 1.05) break;
      const double before = last.off;
      last = candidate(kind, cells *= finer);
      if (last.off < 0.9 * best.off) best = last;
      const bool is_no_closer = last.off > 0.5 * (1.0 + 1.0 / (finer * finer)) * before;
      no_closer = k > 1 && is_no_closer ? no_closer + 1 : 0;  // the first was not laid anew
      if (no_closer == 2) break;                              // one mesh may be worse than its size promises
    }
    return best;
  }
};

/// How a model's linear tetrahedra vibrate against quadratic ones of the same mesh: they lock where they are flat,
/// where few of them lie across what bends, and where the material hardly changes its volume. Nothing where they do
/// not, or are no linear tetrahedra.
std::string locking_note(const ModelScene& scene, const SimulationOptions& options, double first_frequency) {
  constexpr double much = 0.1;          // of the frequency
  constexpr int most_elements = 20000;  // that are looked at
  if (scene.body->kind != ElementKind::Tetrahedron || scene.body->element_count() > most_elements) return "";
  Body quadratic = make_body(with_mid_nodes(std::get<TetMesh>(scene.body->mesh)));
  quadratic.modulus = scene.body->modulus;
  const auto body = std::make_shared<Body>(std::move(quadratic));
  const double freer = small_motions(body, options, scene.theta, body->nodes, 1).frequencies.front();
  if (first_frequency < (1.0 + much) * freer) return "";
  return fmt::format(
      "The model's linear tetrahedra lock: its first frequency is {:.4g} Hz, that of quadratic ones of the same mesh "
      "{:.4g} Hz. "
      "A modulus that was fitted with them is too small by the square of that; give quadratic elements, or more "
      "through the "
      "thickness.",
      first_frequency, freer);
}

/// Other elements than its own are laid over the model's surface: linear ones, and quadratic ones of a model of
/// hexahedra.
Candidate chosen_mesh(const Comparison& comparison, ElementKind kind, std::optional<double> cells) {
  const bool is_laid_anew =
      kind == ElementKind::Tetrahedron ? !comparison.is_of(kind) : comparison.is_of(ElementKind::Hexahedron);
  if (cells || !is_laid_anew || !comparison.model.scene.object.surface) return comparison.candidate(kind, cells);
  return comparison.fine_enough(kind);
}

}  // namespace

ExportModel export_model(const Model& model, ElementKind kind, std::optional<double> cells) {
  if (cells && !(*cells >= fewest_cells && *cells <= most_cells))
    throw InputError({{},
                      fmt::format("a mesh of {:.6g} elements along the longest axis", *cells),
                      fmt::format("{:g} to {:g}", fewest_cells, most_cells),
                      "leave the number out: a mesh that is fine enough is found"});
  const ModelScene scene = make_scene(model);
  const SimulationOptions options = elastic_alone(scene.simulation);
  const Comparison comparison{
      model, scene, options,
      small_motions(scene.body, options, scene.theta, scene.body->nodes, frequencies_told).frequencies};
  const Candidate chosen = chosen_mesh(comparison, kind, cells);
  ExportModel out;
  out.name = model.name;
  out.body = chosen.body;
  out.poissons_ratio = chosen.poissons_ratio;
  out.density = scene.theta[options.blocks.density];
  out.mass_damping = model.mass_damping, out.stiffness_damping = model.stiffness_damping;
  out.gravity = scene.theta.segment<3>(options.blocks.gravity);
  out.held = eliminated_nodes(*out.body, options);
  out.model = small_motions(scene.body, options, scene.theta, out.body->nodes, frequencies_told);
  out.exported = chosen.motions;
  out.identified = chosen.identified;
  for (double& hertz : out.exported.frequencies) hertz *= std::sqrt(out.identified);
  out.exported.sag /= out.identified;
  for (const double relative : out.body->modulus.relative)
    out.moduli.push_back(out.identified * relative * model.youngs_modulus);
  if (kind == ElementKind::Tetrahedron) {
    VectorX theta = scene.theta;
    theta[options.blocks.poissons_ratio] = out.poissons_ratio;
    out.stiffest = std::sqrt(out.identified) * stiffest_of(out.body, options, theta, out.lumped_masses(), out.held);
  }
  if (std::string locks = locking_note(scene, options, comparison.frequencies.front()); !locks.empty())
    out.notes.push_back(std::move(locks));
  if (out.poissons_ratio != model.poissons_ratio)
    out.notes.push_back(
        fmt::format("Poisson's ratio is {:.4g}, the model's {:.4g}: with the latter these elements lock.",
                    out.poissons_ratio, model.poissons_ratio));
  if (chosen.off > close_frequencies)
    out.notes.push_back(
        fmt::format("Of the first {} frequencies one is {:.1f} % off the model's: a finer mesh may mend it.",
                    frequencies_told, 100.0 * chosen.off));
  if (model.law)
    out.notes.push_back("The model's law (" + model.law->name + ") is told by its moduli of small strains.");
  if (!model.scene.planes.empty() || !model.scene.obstacles.empty())
    out.notes.push_back("Planes and obstacles that the object meets are left out.");
  if (!model.scene.led.empty()) out.notes.push_back("Regions that are led are left out: nothing holds them.");
  if (has_sliding_bodies(model.scene)) out.notes.push_back("Rigid bodies on which the object slides are left out.");
  if (!model.scene.weights.empty()) out.notes.push_back("Weights that hang from the object are left out.");
  if (model.material.damping == StiffnessDamping::KelvinVoigt && model.stiffness_damping > 0.0)
    out.notes.push_back("Stiffness damping is that of small motions, on which both of its laws agree.");
  return out;
}

ModulusGroups grouped_moduli(const std::vector<double>& moduli, int most) {
  ModulusGroups groups;
  std::map<double, int> different;
  for (const double modulus : moduli) different.try_emplace(modulus, 0);
  if (int(different.size()) <= most) {
    for (auto& [modulus, number] : different) number = int(groups.moduli.size()), groups.moduli.push_back(modulus);
    for (const double modulus : moduli) groups.group.push_back(different.at(modulus));
    return groups;
  }
  const double low = std::log(different.begin()->first), step = (std::log(different.rbegin()->first) - low) / most;
  std::map<int, int> numbers;
  for (const double modulus : moduli) {
    const int at = std::min(most - 1, int((std::log(modulus) - low) / step));
    const auto [entry, is_new] = numbers.try_emplace(at, int(groups.moduli.size()));
    if (is_new) groups.moduli.push_back(std::exp(low + (at + 0.5) * step));
    groups.group.push_back(entry->second);
  }
  return groups;
}

}  // namespace pliant
