// A block under a ball: fits a law to forces over depths and predicts other depths and balls, as JSON on stdout.
//   pliant_probing request=FILE
// The file: {"task": "fit" | "predict" | "check", "block": {"half_width": L, "thickness": L, "half_edges": [...],
//   "depth_edges": [...]} [m] (edges: where cells end, from the touched point), "radius": R [m], "depths": [... m],
//   "forces": [... N], "terms": N, "poisson_ratio": nu, "parameters": [...] (predict: of the law, (mu, exponent, nu) a
//   term), "others": [{"radius", "depths"}]}

#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>

#include "estimation/optimiser.hpp"
#include "request.hpp"
#include "tested_bodies.hpp"

namespace pliant {
namespace {

using nlohmann::json;
using Numbers = std::vector<double>;

constexpr double relative_noise = 0.02;  // of the greatest force

/// Cells around the origin, under the plane z = 0, finer near the origin; quadratic tetrahedra.
std::shared_ptr<const Body> make_block(const json& j) {
  const Numbers side = j.at("half_edges"), down = j.at("depth_edges");
  const int half = int(side.size()), deep = int(down.size());
  Box box;
  box.extend(Vector3(-half, -half, -deep));
  box.extend(Vector3(half, half, 0));
  TetMesh mesh = make_tet_box(box, {2 * half, 2 * half, deep}, false);
  const auto place = [](const Numbers& edges, double cells) {
    const int n = int(std::lround(std::abs(cells)));
    return n == 0 ? 0.0 : std::copysign(edges[std::size_t(n - 1)], cells);
  };
  Points nodes = mesh.nodes;
  for (Eigen::Index n = 0; n < nodes.rows(); ++n)
    nodes.row(n) << place(side, nodes(n, 0)), place(side, nodes(n, 1)), place(down, nodes(n, 2));
  return std::make_shared<Body>(make_body(with_mid_nodes(make_tet_mesh(std::move(nodes), std::move(mesh.tets)))));
}

ObservedIndentation push(double radius, const Numbers& depths, const Numbers& forces) {
  double greatest = 0.0;
  for (const double f : forces) greatest = std::max(greatest, std::abs(f));
  return pushed_ball(Vector3::Zero(), Vector3::UnitZ(), radius, depths, forces,
                     greatest > 0.0 ? relative_noise * greatest : 1.0);
}

class Experiment {
 public:
  explicit Experiment(const Choices& choices) {
    request_ = read_request(choices);
    body_ = make_block(request_.at("block"));
    const double bottom = body_->nodes.col(2).minCoeff();
    for (int n = 0; n < body_->node_count(); ++n)
      if (body_->nodes(n, 2) < 0.999 * bottom) held_.push_back(n);
  }

  json run() {
    json report = {{"nodes", body_->node_count()}, {"elements", body_->element_count()}};
    const auto begin = std::chrono::steady_clock::now();
    if (request_.at("task") == "predict") {
      const Numbers q = request_.at("parameters");
      MatrixX table(body_->element_count(), Eigen::Index(q.size()));
      for (std::size_t k = 0; k < q.size(); ++k) table.col(Eigen::Index(k)).setConstant(q[k]);
      others(q.size() == 2 ? std::shared_ptr<const MaterialLaw>(std::make_shared<LinearLaw>(table))
                           : std::make_shared<OgdenLaw>(table),
             report);
    } else {
      fit(report);
    }
    report["seconds"] = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return report;
  }

 private:
  void fit(json& report) {
    const auto scene =
        tested(body_, held_, {{push(request_.at("radius"), request_.at("depths"), request_.at("forces"))}, {}, {}});
    const int terms = request_.at("terms");
    const double nu = request_.at("poisson_ratio"), start = punch_modulus(*scene, nu);
    report["hertz_modulus"] = start;
    const LawLayout layout({1, terms});
    ParameterSet parameters = law_parameters(layout, start);
    parameters.fix("poissons_ratio", nu);
    PressObjective objective = objective_of(scene, layout, parameters);
    const VectorX p = parameters.to_unconstrained(parameters.reference());
    if (request_.at("task") == "check") {
      report["derivative_errors"] = derivative_errors(objective.cost(), p);
      return;
    }
    OptimiserOptions options;
    options.max_iterations = 15;
    const OptimiserSummary summary = minimise(objective.cost(), p, options);
    report["succeeded"] = summary.succeeded, report["reason"] = summary.reason;
    report["iterations"] = summary.iterations, report["evaluations"] = summary.evaluations;
    if (!summary.succeeded) return;
    const VectorX found = parameters.to_theta(summary.p);
    report["theta"] = Numbers(found.begin(), found.end());
    const auto law = press_law(*body_, layout, found);
    const VectorX q = law->table().row(0);
    report["parameters"] = Numbers(q.begin(), q.end());
    report["fitted"] = predict_curves(*scene, law).front().predicted;
    others(law, report);
  }

  void others(const std::shared_ptr<const MaterialLaw>& law, json& report) {
    for (const json& other : request_.value("others", json::array())) {
      const Numbers depths = other.at("depths");
      const auto scene =
          tested(body_, held_, {{push(other.at("radius"), depths, Numbers(depths.size(), 0.0))}, {}, {}});
      report["others"].push_back({{"radius", other.at("radius")},
                                  {"depths", depths},
                                  {"forces", or_null(predict_curves(*scene, law).front().predicted)}});
    }
  }

  json request_;
  std::shared_ptr<const Body> body_;
  std::vector<int> held_;
};

}  // namespace
}  // namespace pliant

int main(int argc, char** argv) {
  return pliant::run_experiment<pliant::Experiment>("pliant_probing", argc, argv, {{"request", ""}});
}
