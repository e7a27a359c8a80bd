// The evaluation of Weiss et al. 2020 on synthetic recordings: minimisations from given starts, costs and gradients
// over a parameter, and shapes that its recordings need, as JSON on stdout.
//   pliant_weiss request=FILE
// The file: {"task": "shape", "shape": "pillow" | "tree", "spacing": [m], "out": FILE}, or
//   {"task": "minimise" | "sweep", "capture": FOLDER, "set": {NAME: VALUE} (choices as after --set of `pliant fit`),
//    "estimated": [NAME], "cost": "surface" | "displacement" | "field" (the costs J_SSC, J_DISP and J_SDF of the paper;
//    the last two need the true surfaces that `pliant synth` writes, and the last can only be swept),
//    "frames": N (the last one that is compared; left out: all),
//    "difference": [Pa] (left out: exact derivatives), of the gradient's forward differences}, and
//   of "minimise" {"starts": [{NAME: NUMBER | [NUMBERS]}], "optimiser", "max_iterations", "serial": BOOL,
//   "horizons": [PARTS of the frames that are compared, one minimisation after the other; left out: all]},
//   of "sweep" {"over": NAME, "values": [NUMBERS]}.

#include <algorithm>
#include <cmath>
#include <ctime>
#include <filesystem>

#include "base/error.hpp"
#include "base/parallel.hpp"
#include "estimation/fit_config.hpp"
#include "estimation/problem.hpp"
#include "estimation/start_objective.hpp"
#include "geometry/mesh_io.hpp"
#include "meshing/level_mesh.hpp"
#include "meshing/mesh_distance.hpp"
#include "request.hpp"

namespace pliant {
namespace {

using nlohmann::json;

// Shapes
// ---------------------------------------------------------------------------------------------------------------

/// A cushion of 0.46 x 0.46 x 0.15 m, y upwards: thick in the middle, with rounded corners.
double pillow(const Vector3& x) {
  const Vector3 part = x.cwiseQuotient(Vector3(0.23, 0.075, 0.23)).cwiseAbs();
  const double level = std::pow(part.x(), 4) + std::pow(part.y(), 2) + std::pow(part.z(), 4);
  return 0.075 * (std::pow(level, 1.0 / 3.0) - 1.0);
}

/// Distance to a rod between two points whose radius changes evenly.
double rod(const Vector3& x, const Vector3& a, const Vector3& b, double at_a, double at_b) {
  const double along = std::clamp((x - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
  return (x - a - along * (b - a)).norm() - (at_a + along * (at_b - at_a));
}

/// A tree 0.5 m high, y upwards: a leaning trunk and three branches that are melted together.
double tree(const Vector3& x) {
  constexpr double melting = 0.012;  // [m]
  const double parts[] = {rod(x, {0.0, 0.02, 0.0}, {0.05, 0.42, 0.0}, 0.045, 0.028),
                          rod(x, {0.025, 0.22, 0.0}, {-0.15, 0.36, 0.03}, 0.028, 0.022),
                          rod(x, {0.035, 0.3, 0.0}, {0.2, 0.45, -0.03}, 0.026, 0.022),
                          rod(x, {0.05, 0.4, 0.0}, {0.02, 0.47, 0.09}, 0.026, 0.022)};
  double sum = 0.0;
  for (const double part : parts) sum += std::exp(-part / melting);
  return -melting * std::log(std::max(sum, 1e-300));
}

json make_shape(const json& request) {
  const std::string name = request.at("shape");
  if (name != "pillow" && name != "tree") throw std::invalid_argument("shapes are \"pillow\" and \"tree\"");
  const TriangleMesh mesh =
      make_even_level_surface(name == "pillow" ? pillow : tree, {Vector3(-0.4, -0.2, -0.4), Vector3(0.4, 0.6, 0.4)},
                              request.at("spacing").get<double>());
  const MeshReport report = examine(mesh);
  if (!report.complaints.empty())
    throw std::invalid_argument("the shape is no closed surface: " + report.complaints[0]);
  write_mesh(request.at("out").get<std::string>(), mesh);
  return {{"vertices", mesh.vertices.size()}, {"volume", enclosed_volume(mesh)}};
}

// Costs
// ----------------------------------------------------------------------------------------------------------------

/// The true surface in a frame of the recording, counted from its first.
TriangleMesh true_surface(const Capture& capture, int frame) {
  char name[32];
  std::snprintf(name, sizeof name, "truth/%06d.ply", frame);
  return read_mesh(capture.folder / name);
}

/// Vertices of the true surface as points that were followed, a tenth of a millimetre off (equation 2 without
/// velocities).
TrackedPoints true_displacements(const Capture& capture) {
  constexpr std::size_t every = 7;
  TrackedPoints tracked;
  const auto& rest = capture.scene.object.surface->vertices;
  for (std::size_t i = 0; i < rest.size(); i += every) tracked.rest.push_back(rest[i]);
  for (int frame = capture.scene.timing.start_frame; frame < capture.frame_count(); ++frame) {
    const TriangleMesh surface = true_surface(capture, frame);
    for (std::size_t i = 0; i < tracked.rest.size(); ++i)
      tracked.frames[frame].push_back({int(i), surface.vertices[i * every], 1e-4, 0});
  }
  return tracked;
}

/// Differences of two signed distances where a lattice around the object at rest has its points (equation 3): the true
/// one, and that of the object at rest, advected by looking it up where the displacement at the point itself came from
/// (one semi-Lagrangian step).
class FieldTrial : public Trial {
 public:
  FieldTrial(const Capture& capture, const Discretisation& d, int last_frame)
      : distance_(d.distance),
        surface_(d.mismatch.surface),
        last_frame_(last_frame),
        simulation_(d.body, d.simulation),
        rest_(d.body->nodes) {
    const double margin = extension().band() + extension().cell_size();
    for (int frame = 0; frame <= last_frame; ++frame) {
      const SignedDistance field = signed_distance(true_surface(capture, frame + capture.scene.timing.start_frame),
                                                   distance_->spacing(), margin + 0.1);
      VectorX values(lattice().rows());
      for (Eigen::Index i = 0; i < values.size(); ++i) values[i] = field.value(lattice().row(i).transpose());
      seen_.push_back(std::move(values));
    }
  }

  CostEvaluation run(const VectorX& theta, const MatrixX&) override {
    CostEvaluation e;
    const RolloutSummary s =
        simulation_.run(theta, MatrixX(theta.size(), 0), last_frame_, [&](int frame, const State& state, auto) {
          e.cost += 0.5 * difference(frame, state, nullptr).squaredNorm();
          return frame < last_frame_;
        });
    return ended(s, std::move(e));
  }

  CostEvaluation gradient(const VectorX& theta, VectorX& theta_bar) override {
    CostEvaluation e;
    const RolloutSummary s = simulation_.run_adjoint(
        theta, last_frame_,
        [&](int frame, const State& state) {
          e.cost += 0.5 * difference(frame, state, nullptr).squaredNorm();
          return true;
        },
        [&](int frame, const State& state, Points& x_bar) {
          Points slopes;
          const VectorX r = difference(frame, state, &slopes);
          x_bar -= extension().apply_transpose(slopes.array().colwise() * r.array());
        },
        theta_bar);
    return ended(s, std::move(e));
  }

 private:
  static CostEvaluation ended(const RolloutSummary& s, CostEvaluation e) {
    e.steps = s.steps, e.succeeded = s.succeeded, e.failure = s.failure;
    return e;
  }
  const DisplacementExtension& extension() const { return surface_->extension(); }
  const Points& lattice() const { return extension().rest_positions(); }

  /// Advected less true distances, in cells. @param slopes  out: of the advected ones, where they were looked up
  VectorX difference(int frame, const State& state, Points* slopes) const {
    const Points moved = extension().apply(Points(state.x - rest_));
    VectorX r(lattice().rows());
    if (slopes) slopes->resize(lattice().rows(), 3);
    const double cut = extension().band(), per_cell = 1.0 / extension().cell_size();
    for (Eigen::Index i = 0; i < r.size(); ++i) {
      const auto sample = distance_->sample((lattice().row(i) - moved.row(i)).transpose());
      const bool is_within = std::abs(sample.value) < cut;
      r[i] = per_cell * (std::clamp(sample.value, -cut, cut) - std::clamp(seen_[std::size_t(frame)][i], -cut, cut));
      if (slopes) slopes->row(i) = (is_within ? per_cell : 0.0) * sample.gradient.transpose();
    }
    return r;
  }

  std::shared_ptr<const SignedDistance> distance_;
  std::shared_ptr<const SurfaceConstraints> surface_;
  int last_frame_;
  Simulation simulation_;
  Points rest_;
  std::vector<VectorX> seen_;
};

/// A cost of one parameter whose gradient is a forward difference.
class ForwardDifference : public CostFunction {
 public:
  /// @param width  [unit of the parameter] > 0
  ForwardDifference(std::shared_ptr<CostFunction> cost, double width) : cost_(std::move(cost)), width_(width) {
    if (parameters().dimension() != 1) throw std::invalid_argument("differences are of one estimated parameter");
  }
  const ParameterSet& parameters() const override { return cost_->parameters(); }
  CostEvaluation evaluate(const VectorX& p) override { return cost_->evaluate(p); }
  CostEvaluation linearise(const VectorX& p) override { return gradient(p); }
  CostEvaluation gradient(const VectorX& p) override {
    CostEvaluation here = cost_->evaluate(p);
    if (!here.succeeded) return here;
    VectorX theta = parameters().to_theta(p);
    theta[parameters().coordinate_parameters().front()->at] += width_;
    const VectorX beyond = parameters().to_unconstrained(theta);
    const CostEvaluation there = cost_->evaluate(beyond);
    here.steps += there.steps;
    if (!there.succeeded) return there;
    here.gradient = VectorX::Constant(1, (there.cost - here.cost) / (beyond - p)[0]);
    return here;
  }

 private:
  std::shared_ptr<CostFunction> cost_;
  double width_;
};

// Studies
// --------------------------------------------------------------------------------------------------------------

OptimiserKind optimiser_of(const std::string& name) {
  FitOptions options;
  set_fit_option(options, "optimiser=" + name);
  return options.optimiser;
}

class Experiment {
 public:
  explicit Experiment(const Choices& choices) : request_(read_request(choices)) {}

  json run() {
    const std::string task = request_.at("task");
    if (task == "shape") return make_shape(request_);
    read();
    if (task == "minimise") return minimise_all();
    if (task == "sweep") return sweep();
    throw std::invalid_argument("tasks are \"shape\", \"minimise\" and \"sweep\"");
  }

 private:
  void read() {
    recording_.capture = read_capture(request_.at("capture").get<std::string>());
    cost_ = request_.value("cost", "surface");
    if (cost_ == "displacement") {
      recording_.followed = true_displacements(recording_.capture);
    } else if (cost_ == "surface" || cost_ == "field") {
      ObserveOptions options;
      options.max_points_per_frame = request_.value("points_per_frame", 0);
      if (cost_ == "surface") recording_.observed = observe(recording_.capture, options);
    } else {
      throw std::invalid_argument("costs are \"surface\", \"displacement\" and \"field\"");
    }
    if (const int last = request_.value("frames", 0); last > 0) {
      auto& times = recording_.capture.scene.timing.times;
      const int count = recording_.capture.scene.timing.start_frame + last + 1;
      if (count > int(times.size())) throw std::invalid_argument("the recording is shorter than \"frames\"");
      times.resize(std::size_t(count));
      std::erase_if(recording_.observed, [&](const ObservedFrame& seen) { return seen.frame >= count; });
    }
    const json choices = request_.value("set", json::object());
    for (const auto& [name, value] : choices.items())
      set_fit_option(options_, name + "=" + (value.is_string() ? value.get<std::string>() : value.dump()));
  }

  /// The cost in a vector of the estimated parameters alone, for one thread.
  /// @param part  of the frames
  std::shared_ptr<CostFunction> cost(double part = 1.0) const {
    FitOptions options = options_;
    options.span = part;
    const CaptureParameters parameters =
        default_parameters(recording_.capture, enclosed_volume(*recording_.capture.scene.object.surface));
    const std::vector<std::string> estimated = request_.at("estimated");
    for (const Parameter& p : parameters.set.parameters())
      options.parameters[p.name].estimated = std::ranges::find(estimated, p.name) != estimated.end();
    std::shared_ptr<CostFunction> made;
    if (cost_ == "field") {
      ParameterSet set = parameters.set;
      apply_overrides(set, options);
      Resolution resolution;
      resolution.cells = options.cells, resolution.band = options.wide_band;
      const Discretisation d = discretise(recording_.capture, capture_distance(recording_.capture, resolution.band),
                                          resolution, parameters.blocks, set.reference());
      std::vector<std::unique_ptr<Trial>> trials;
      trials.push_back(std::make_unique<FieldTrial>(recording_.capture, d, int(d.simulation.times.size()) - 1));
      made = std::make_shared<Objective>(std::move(trials), std::move(set));
    } else {
      made = start_objective({recording_}, options).cost;
    }
    const double width = request_.value("difference", 0.0);
    return width > 0.0 ? std::make_shared<ForwardDifference>(made, width) : made;
  }

  static VectorX start_of(const ParameterSet& parameters, const json& start) {
    VectorX theta = parameters.reference();
    for (const auto& [name, value] : start.items()) {
      const Parameter* p = parameters.find(name);
      const std::vector<double> numbers =
          value.is_array() ? value.get<std::vector<double>>() : std::vector<double>{value.get<double>()};
      if (!p || Eigen::Index(numbers.size()) != p->at.size)
        throw std::invalid_argument("a start's \"" + name + "\" is no parameter of so many numbers");
      std::ranges::copy(numbers, theta.data() + p->at.first);
    }
    return parameters.to_unconstrained(theta);
  }

  static json values_of(const ParameterSet& parameters, const VectorX& p) {
    const VectorX theta = parameters.to_theta(p);
    json values;
    for (const Parameter& q : parameters.parameters()) {
      if (!q.estimated) continue;
      const std::vector<double> numbers(theta.data() + q.at.first, theta.data() + q.at.first + q.at.size);
      values[q.name] = numbers.size() == 1 ? json(numbers.front()) : json(numbers);
    }
    return values;
  }

  json minimise_from(const json& start, const OptimiserOptions& options) const {
    const std::vector<double> horizons = request_.value("horizons", std::vector<double>{1.0});
    const std::clock_t begin = std::clock();  // of the processor: of this run alone where runs are serial
    json way = json::array(), first;
    VectorX p;
    OptimiserSummary s;
    int iterations = 0, evaluations = 0;
    long long steps = 0;
    std::shared_ptr<CostFunction> function;
    for (const double part : horizons) {
      function = cost(part);
      const ParameterSet& parameters = function->parameters();
      if (p.size() == 0) p = start_of(parameters, start), first = values_of(parameters, p);
      s = minimise(*function, p, options, [&](const Iteration& i) {
        way.push_back({i.cost, values_of(parameters, i.p)});
        return true;
      });
      p = s.p;
      iterations += s.iterations, evaluations += s.evaluations, steps += s.steps;
    }
    const double seconds = double(std::clock() - begin) / CLOCKS_PER_SEC;
    const auto finite = [](double value) { return std::isfinite(value) ? json(value) : json(); };
    return {{"start", first},
            {"found", values_of(function->parameters(), p)},
            {"start_cost", finite(s.start_cost)},
            {"cost", finite(s.evaluation.cost)},
            {"surface_rms", s.evaluation.surface_rms()},
            {"succeeded", s.succeeded},
            {"converged", s.converged},
            {"reason", s.reason},
            {"iterations", iterations},
            {"evaluations", evaluations},
            {"steps", steps},
            {"processor_seconds", request_.value("serial", false) ? json(seconds) : json()},
            {"way", way}};
  }

  json minimise_all() const {
    OptimiserOptions options;
    options.kind = optimiser_of(request_.value("optimiser", "levenberg_marquardt"));
    options.max_iterations = request_.value("max_iterations", 50);
    options.promise_tolerance = 0.005, options.cost_tolerance = 1e-6;  // far from the minimum the cost is flat
    const std::vector<json> starts = request_.at("starts");
    std::vector<json> rows(starts.size());
    const auto one = [&](std::size_t i) {
      rows[i] = minimise_from(starts[i], options);
      std::fprintf(stderr, "%zu of %zu: %s\n", i + 1, starts.size(), rows[i].at("found").dump().c_str());
    };
    if (request_.value("serial", false)) {
      const ThreadLimit limit(1);
      for (std::size_t i = 0; i < starts.size(); ++i) one(i);
    } else {
      parallel_tasks(starts.size(), one);
    }
    return {{"rows", rows}};
  }

  json sweep() const {
    const std::string over = request_.at("over");
    const std::vector<double> values = request_.at("values");
    std::vector<json> rows(values.size());
    parallel_tasks(values.size(), [&](std::size_t i) {
      const auto function = cost();
      const ParameterSet& parameters = function->parameters();
      const VectorX p = start_of(parameters, {{over, values[i]}});
      const CostEvaluation e = function->gradient(p);
      rows[i] = {{"value", values[i]}, {"succeeded", e.succeeded}};
      if (!e.succeeded) return;
      rows[i]["cost"] = e.cost;
      // By the parameter itself, not by its logarithm.
      rows[i]["gradient"] = e.gradient[0] / parameters.jacobian(p)(parameters.find(over)->at.first, 0);
    });
    return {{"rows", rows}};
  }

  json request_;
  std::string cost_;
  RecordedCapture recording_;
  FitOptions options_;
};

}  // namespace
}  // namespace pliant

int main(int argc, char** argv) {
  return pliant::run_experiment<pliant::Experiment>("pliant_weiss", argc, argv, {{"request", ""}});
}
