// An object on a table, by its height seen from above, under a tip that pokes it at many places: fits fields of
// stiffness to some of the pokes and predicts the others, as JSON on stdout.
//   pliant_slab request=FILE
// The file: {"cloud": [[x, y, z], ...], "table": z [m], "raise": what is added to the cloud's heights [m], "cell": [m],
//   "tip_radius": [m], "poisson_ratio": nu, "controls": [N, ...], "terms": N, "start_modulus": E [Pa], "force_noise":
//   [N], "pokes": [{"point", "normal", "depths", "forces", "fitted"}]}

#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>

#include "elasticity/modulus_field.hpp"
#include "estimation/optimiser.hpp"
#include "geometry/primitives.hpp"
#include "request.hpp"
#include "tested_bodies.hpp"

namespace pliant {
namespace {

using nlohmann::json;
using Numbers = std::vector<double>;

constexpr double kernel = 4e-3;   // of the height's mean over the cloud [m]
constexpr double margin = 5e-3;   // that the object reaches beyond its points [m]
constexpr double spacing = 5e-3;  // of the surface's lattice [m]

Vector3 vector_of(const json& j) { return {j.at(0).get<double>(), j.at(1).get<double>(), j.at(2).get<double>()}; }

/// The closed surface between the table and the heights.
TriangleMesh extruded(const std::vector<Vector3>& cloud, double table, double raised) {
  Box box;
  for (const Vector3& p : cloud) box.extend(p);
  box.extend(Vector3(box.min.x(), box.min.y(), table));
  box.max.z() += raised;
  Box around = box;
  around.min.array() -= 3.0 * spacing, around.max.array() += 3.0 * spacing;
  const auto inside = [&](const Vector3& at) {
    double sum = 0.0, weights = 0.0, nearest = 1e300;
    for (const Vector3& p : cloud) {
      const double d2 = (p - at).head<2>().squaredNorm();
      nearest = std::min(nearest, d2);
      const double w = std::exp(-0.5 * d2 / (kernel * kernel)) + 1e-30;
      sum += w * p.z(), weights += w;
    }
    return std::max({at.z() - sum / weights - raised, table - at.z(), std::sqrt(nearest) - margin});
  };
  return make_level_surface(inside, around, spacing);
}

/// Where a line from outside first meets the body's boundary; nothing where it misses it.
std::optional<Vector3> first_met(const Body& body, const Vector3& point, const Vector3& normal) {
  const TetMesh& mesh = std::get<TetMesh>(body.mesh);
  double farthest = -1e300;
  for (const auto& f : mesh.boundary) {
    const Vector3 a = mesh.nodes.row(f[0]), b = mesh.nodes.row(f[1]), c = mesh.nodes.row(f[2]);
    Matrix3 m;
    m << b - a, c - a, -normal;
    if (std::abs(m.determinant()) < 1e-16) continue;
    const Vector3 s = m.inverse() * (point - a);
    if (s.x() >= -1e-9 && s.y() >= -1e-9 && s.x() + s.y() <= 1.0 + 1e-9) farthest = std::max(farthest, s.z());
  }
  if (farthest < -1e200) return std::nullopt;
  return point + farthest * normal;
}

class Experiment {
 public:
  explicit Experiment(const Choices& choices) {
    request_ = read_request(choices);
    std::vector<Vector3> cloud;
    for (const json& p : request_.at("cloud")) cloud.push_back(vector_of(p));
    const TriangleMesh surface = extruded(cloud, request_.at("table"), request_.at("raise"));
    TetMeshOptions options;
    options.cell_size = request_.at("cell");
    options.quadratic = true;
    body_ = make_body(make_tet_mesh(surface, options));
    const double ground = request_.at("table").get<double>() + 0.1 * spacing;
    for (int n = 0; n < body_.node_count(); ++n)
      if (body_.nodes(n, 2) < ground) held_.push_back(n);
    for (const json& poke : request_.at("pokes")) {
      const Vector3 normal = vector_of(poke.at("normal")).normalized();
      const auto touch = first_met(body_, vector_of(poke.at("point")), normal);
      pokes_.push_back(pushed_ball(touch.value_or(vector_of(poke.at("point"))), normal, request_.at("tip_radius"),
                                   poke.at("depths"), poke.at("forces"), request_.at("force_noise"),
                                   touch && poke.at("fitted") ? "fit" : "test"));
      meets_.push_back(touch.has_value());
    }
  }

  json run() {
    json report = {{"nodes", body_.node_count()},
                   {"elements", body_.element_count()},
                   {"held", held_.size()},
                   {"volume", body_.volume()}};
    std::fprintf(stderr, "%d nodes, %d elements, %.3g m^3\n", body_.node_count(), body_.element_count(),
                 body_.volume());
    for (const int controls : request_.at("controls").get<std::vector<int>>()) report["fits"].push_back(fit(controls));
    return report;
  }

 private:
  json fit(int controls) const {
    const auto begin = std::chrono::steady_clock::now();
    auto body = std::make_shared<Body>(body_);
    if (controls > 1) body->modulus = inverse_distance_field(*body, farthest_points(*body, controls)).field;
    const int terms = request_.at("terms");
    const LawLayout layout({controls, terms});
    ParameterSet parameters = law_parameters(layout, request_.at("start_modulus"));
    parameters.fix("poissons_ratio", request_.at("poisson_ratio"));
    const VectorX theta = parameters.reference();
    StaticTests tests;
    for (std::size_t i = 0; i < pokes_.size(); ++i)
      if (meets_[i]) tests.indentations.push_back(pokes_[i]);
    const auto scene = tested(body, held_, std::move(tests));
    PressObjective objective = objective_of(scene, layout, parameters);
    OptimiserOptions options;
    options.max_iterations = 8;
    options.cost_tolerance = 2e-3;
    const OptimiserSummary summary =
        minimise(objective.cost(), parameters.to_unconstrained(theta), options, [](const Iteration& i) {
          std::fprintf(stderr, "iteration %d: %g\n", i.number, i.cost);
          return true;
        });
    json report = {{"controls", controls},
                   {"succeeded", summary.succeeded},
                   {"reason", summary.reason},
                   {"evaluations", summary.evaluations}};
    if (summary.succeeded) {
      const VectorX found = parameters.to_theta(summary.p);
      report["theta"] = Numbers(found.begin(), found.end());
      const auto law = press_law(*body, layout, found);
      const std::vector<CurvePrediction> predicted = predict_curves(*scene, law);
      std::size_t next = 0;
      for (std::size_t i = 0; i < pokes_.size(); ++i)
        report["forces"].push_back(meets_[i] ? or_null(predicted[next++].predicted)
                                             : json(std::vector<json>(pokes_[i].curve.depths.size())));
    }
    report["seconds"] = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return report;
  }

  json request_;
  Body body_;
  std::vector<int> held_;
  std::vector<ObservedIndentation> pokes_;
  std::vector<bool> meets_;  ///< whether a poke's line meets the body
};

}  // namespace
}  // namespace pliant

int main(int argc, char** argv) {
  return pliant::run_experiment<pliant::Experiment>("pliant_slab", argc, argv, {{"request", ""}});
}
