#include "batch_motion/motion_batch.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>
#include <utility>

#include "base/parallel.hpp"
#include "batch_motion/batch_engine.hpp"
#include "batch_motion/batch_mesh.hpp"
#include "batch_motion/solver_kernels.hpp"
#include "elasticity/lame.hpp"

namespace pliant {

using namespace batch_motion;

int cuda_device_count(std::string* reason) {
  std::string why;
  const int count = count_cuda_devices(why);
  if (reason) *reason = why;
  return count;
}

namespace {

void require(bool holds, const std::string& otherwise) {
  if (!holds) throw std::invalid_argument(otherwise);
}

void check(const BatchOptions& o, int members) {
  require(members > 0, "a batch needs at least one member");
  require(o.dt > 0.0 && std::isfinite(o.dt), "the time step must be positive");
  require(o.newmark_theta >= 0.5 && o.newmark_theta < 1.0, "Newmark's theta must lie in [0.5, 1)");
  require(o.contact_weight > 0.5 && o.contact_weight <= 1.0, "the contact's weight must lie in (0.5, 1]");
  require(o.rotation_prediction >= 0.0 && o.rotation_prediction <= 1.0,
          "the prediction of rotations must lie in [0, 1]");
  require(o.tolerance >= 1e-12 && o.tolerance < 1.0, "the solver's tolerance must lie in [1e-12, 1)");
  require(o.max_iterations >= 1, "the solver needs at least one iteration");
  require(o.friction_speed >= 0.0, "the speed below which friction fades must not be negative");
  require(!o.with_plane || (o.contact.stiffness > 0.0 && o.contact.smoothing > 0.0),
          "contact needs a positive stiffness and smoothing length");
}

void check(const BatchMember& m, int index, Eigen::Index nodes) {
  const std::string who = "member " + std::to_string(index) + ": ";
  require(m.youngs_modulus > 0.0 && std::isfinite(m.youngs_modulus), who + "Young's modulus must be positive");
  require(m.poissons_ratio > -1.0 && m.poissons_ratio < 0.5, who + "Poisson's ratio must lie in (-1, 0.5)");
  require(m.density > 0.0 && std::isfinite(m.density), who + "the density must be positive");
  require(m.mass_damping >= 0.0 && std::isfinite(m.mass_damping), who + "the mass damping must not be negative");
  require(m.stiffness_damping >= 0.0 && std::isfinite(m.stiffness_damping),
          who + "the stiffness damping must not be negative");
  require(m.friction >= 0.0 && std::isfinite(m.friction), who + "the friction must not be negative");
  require(m.contact_stiffness >= 0.0 && std::isfinite(m.contact_stiffness),
          who + "the contact's stiffness must not be negative");
  require(m.gravity.allFinite() && m.plane_point.allFinite() && m.plane_normal.allFinite(),
          who + "gravity and plane must be finite");
  require(m.plane_normal.squaredNorm() > 0.0, who + "the plane's normal must not be zero");
  for (const Points* points : {&m.start.x, &m.start.v}) {
    require(points->rows() == 0 || points->rows() == nodes, who + "the start has " + std::to_string(points->rows()) +
                                                                " rows, and the body " + std::to_string(nodes) +
                                                                " nodes");
    require(points->allFinite(), who + "the start must be finite");
  }
}

std::vector<double> relative_moduli(const Body& body, const BatchOptions& options) {
  if (!options.relative_moduli.empty()) return options.relative_moduli;
  require(body.modulus.controls == 1, "the body has a field of " + std::to_string(body.modulus.controls) +
                                          " moduli: give a batch each element's in `relative_moduli`");
  return body.modulus.relative;
}

std::vector<int> boundaries(int steps, const std::vector<int>& at) {
  std::vector<int> stops = at;
  if (stops.empty() || stops.back() != steps) stops.push_back(steps);
  if (stops.front() != 0) stops.insert(stops.begin(), 0);
  return stops;
}

}  // namespace

struct MotionBatch::Engines {
  MeshData const* mesh = nullptr;
  std::unique_ptr<EngineMaker> maker;
  std::vector<std::unique_ptr<BatchEngine>> all;
  std::vector<double> poissons_ratio;  // whose stiffness each lane has
  std::map<double, std::shared_ptr<const ClassStiffness>> stiffness;
  std::vector<State> states, bars;                 // one a member
  std::vector<std::vector<double>> first, second;  // numbers of an engine's members on their way

  int stride() const { return all.front()->stride(); }
  std::size_t nodes() const { return std::size_t(mesh->nodes); }
  int engine_of(int member) const { return member / stride(); }
  /// Members of an engine, and those that only fill it up.
  template <class Visit>
  void each_lane(std::size_t engine, int members, Visit&& visit) const {
    for (int lane = 0; lane < stride(); ++lane) {
      const int member = int(engine) * stride() + lane;
      visit(lane, std::min(member, members - 1), member < members);
    }
  }
  /// Side by side in several threads on the host: engines do not know of each other.
  template <class Visit>
  void each_engine(const Visit& visit) {
    if (all.size() == 1) return visit(std::size_t(0));
    const std::function<void(std::size_t)> task = [&](std::size_t i) { visit(i); };
    parallel_tasks(all.size(), task);
  }
  std::size_t at(std::size_t node, std::size_t d, int lane) const {
    return (3 * std::size_t(mesh->order[node]) + d) * std::size_t(stride()) + std::size_t(lane);
  }
  void pack(const Points& points, int lane, std::vector<double>& out) const {
    for (std::size_t n = 0; n < nodes(); ++n)
      for (std::size_t d = 0; d < 3; ++d) out[at(n, d, lane)] = points(Eigen::Index(n), Eigen::Index(d));
  }
  void unpack(const std::vector<double>& in, int lane, Points& points) const {
    points.resize(Eigen::Index(nodes()), 3);
    for (std::size_t n = 0; n < nodes(); ++n)
      for (std::size_t d = 0; d < 3; ++d) points(Eigen::Index(n), Eigen::Index(d)) = in[at(n, d, lane)];
  }
  void fetch_states(int members) {
    states.resize(std::size_t(members));
    each_engine([&](std::size_t i) {
      all[i]->get_state(first[i].data(), second[i].data());
      fetch(i, members, states);
    });
  }
  void fetch(std::size_t i, int members, std::vector<State>& out) const {
    each_lane(i, members, [&](int lane, int member, bool is_own) {
      if (!is_own) return;
      unpack(first[i], lane, out[std::size_t(member)].x);
      unpack(second[i], lane, out[std::size_t(member)].v);
    });
  }
  void add_cotangents(int members) {
    each_engine([&](std::size_t i) {
      each_lane(i, members, [&](int lane, int member, bool) {
        pack(bars[std::size_t(member)].x, lane, first[i]);
        pack(bars[std::size_t(member)].v, lane, second[i]);
      });
      all[i]->add_cotangents(first[i].data(), second[i].data());
    });
  }
  /// Of an engine's members, each with its own or all with one, where that has changed.
  void set_stiffness(std::size_t i, const std::vector<double>& wanted) {
    const auto lanes = std::ptrdiff_t(stride());
    const auto own = wanted.begin() + std::ptrdiff_t(i) * lanes;
    if (std::equal(own, own + lanes, poissons_ratio.begin() + std::ptrdiff_t(i) * lanes)) return;
    if (std::all_of(own, own + lanes, [&](double nu) { return nu == *own; })) {
      const ClassStiffness& unit = *stiffness.at(*own);
      return all[i]->set_shared_stiffness(unit.value.data(), unit.change.data());
    }
    for (int lane = 0; lane < int(lanes); ++lane) {
      const ClassStiffness& unit = *stiffness.at(own[lane]);
      all[i]->set_stiffness(lane, unit.value.data(), unit.change.data());
    }
  }
  /// A row of the engine's numbers for each member.
  std::vector<double> solver_numbers(std::size_t engine) const {
    std::vector<double> numbers(std::size_t(solver_number_count) * std::size_t(stride()));
    all[engine]->get_solver_numbers(numbers.data());
    return numbers;
  }
  std::vector<BatchRun> summaries(int members, int steps) const {
    std::vector<BatchRun> out(static_cast<std::size_t>(members));
    for (std::size_t i = 0; i < all.size(); ++i) {
      const std::vector<double> numbers = solver_numbers(i);
      const auto of = [&](SolverNumber which, int lane) {
        return numbers[std::size_t(which) * std::size_t(stride()) + std::size_t(lane)];
      };
      each_lane(i, members, [&](int lane, int member, bool is_own) {
        if (!is_own) return;
        BatchRun& s = out[std::size_t(member)];
        s.steps = int(of(Steps, lane));
        s.solver_iterations = long(of(AllIterations, lane));
        s.succeeded = of(IsAlive, lane) > 0.0 && s.steps == steps;
      });
    }
    return out;
  }
};

MotionBatch::~MotionBatch() = default;
MotionBatch::MotionBatch(MotionBatch&&) noexcept = default;
MotionBatch& MotionBatch::operator=(MotionBatch&&) noexcept = default;

MotionBatch::MotionBatch(std::shared_ptr<const Body> body, BatchOptions options, int members)
    : body_(std::move(body)), options_(std::move(options)), engines_(std::make_unique<Engines>()) {
  pliant::check(options_, members);
  members_.resize(std::size_t(members));
  is_set_.resize(std::size_t(members), false);
  const bool on_host = options_.device == BatchDevice::Host;
  auto mesh = std::make_shared<const MeshData>(make_mesh_data(*body_, relative_moduli(*body_, options_), options_.held,
                                                              options_.with_plane,
                                                              on_host ? SweepOrder::Natural : SweepOrder::Colours));
  StepNumbers step;
  step.dt = options_.dt, step.theta = options_.newmark_theta, step.contact_weight = options_.contact_weight;
  step.rotation_lag = options_.dt * options_.rotation_prediction;
  step.contact_lag = options_.dt * options_.contact_weight;
  step.smoothing = options_.contact.smoothing, step.reach = options_.contact.reach();
  step.is_quadratic = options_.contact.onset == Penalty::Onset::Quadratic;
  step.friction_way = options_.friction_speed * options_.dt;
  SolverNumbers solver;
  solver.tolerance = options_.tolerance, solver.most_iterations = options_.max_iterations;
  engines_->mesh = mesh.get();
  engines_->maker = on_host                                ? make_host_engines(mesh, step, solver)
                    : options_.device == BatchDevice::Cuda ? make_cuda_engines(mesh, step, solver)
                                                           : make_mimic_engines(mesh, step, solver);
  do {
    engines_->all.push_back(engines_->maker->make(members));
  } while (int(engines_->all.size()) * engines_->stride() < members);
  const std::size_t lanes = engines_->all.size() * std::size_t(stride());
  engines_->poissons_ratio.resize(lanes, std::numeric_limits<double>::quiet_NaN());
  engines_->first.assign(engines_->all.size(), std::vector<double>(3 * engines_->nodes() * std::size_t(stride())));
  engines_->second = engines_->first;
}

int MotionBatch::stride() const { return engines_->stride(); }

void MotionBatch::set_member(int index, BatchMember member) {
  require(index >= 0 && index < member_count(),
          "member " + std::to_string(index) + " of a batch of " + std::to_string(member_count()));
  pliant::check(member, index, body_->nodes.rows());
  if (member.start.x.rows() == 0) member.start.x = body_->scanned_positions();
  if (member.start.v.rows() == 0) member.start.v = Points::Zero(body_->nodes.rows(), 3);
  if (member.contact_stiffness == 0.0) member.contact_stiffness = options_.contact.stiffness;
  members_[std::size_t(index)] = std::move(member);
  is_set_[std::size_t(index)] = true;
}

void MotionBatch::check(int steps, const std::vector<int>& at) const {
  require(steps >= 0, "a run takes no step or some");
  for (std::size_t i = 0; i < at.size(); ++i)
    require(at[i] >= 0 && at[i] <= steps && (i == 0 || at[i] > at[i - 1]),
            "the steps at which states are asked for must ascend, from 0 to " + std::to_string(steps));
  if (const auto unset = std::ranges::find(is_set_, false); unset != is_set_.end())
    throw std::logic_error("member " + std::to_string(unset - is_set_.begin()) + " of the batch was never set");
}

void MotionBatch::begin() {
  Engines& e = *engines_;
  std::vector<double> wanted;  // Poisson's ratios of all lanes
  for (std::size_t k = 0; k < e.poissons_ratio.size(); ++k)
    wanted.push_back(members_[std::min(k, members_.size() - 1)].poissons_ratio);
  if (body_->kind == ElementKind::Hexahedron && wanted != e.poissons_ratio)
    for (const double nu : wanted)
      if (auto& known = e.stiffness[nu]; !known)
        known = std::make_shared<const ClassStiffness>(class_stiffness(*body_, nu));
  const auto lanes = std::size_t(stride());
  e.each_engine([&](std::size_t i) {
    std::vector<double> numbers(member_number_count * lanes), alive(lanes);
    e.each_lane(i, member_count(), [&](int lane, int member, bool is_own) {
      const BatchMember& m = members_[std::size_t(member)];
      const auto set = [&](int row, double value) { numbers[std::size_t(row) * lanes + std::size_t(lane)] = value; };
      const UnitLame lame = unit_lame(m.poissons_ratio);
      set(YoungsModulus, m.youngs_modulus), set(MassDamping, m.mass_damping);
      set(batch_motion::StiffnessDamping, m.stiffness_damping), set(Density, m.density);
      for (int d = 0; d < 3; ++d)
        set(Gravity + d, m.gravity[d]), set(PlanePoint + d, m.plane_point[d]), set(PlaneNormal + d, m.plane_normal[d]);
      set(Friction, m.friction), set(ContactStiffness, m.contact_stiffness);
      set(Lambda, lame.lambda), set(Mu, lame.mu), set(LambdaChange, lame.d_lambda), set(MuChange, lame.d_mu);
      alive[std::size_t(lane)] = is_own ? 1.0 : 0.0;
      e.pack(m.start.x, lane, e.first[i]);
      e.pack(m.start.v, lane, e.second[i]);
    });
    if (body_->kind == ElementKind::Hexahedron) e.set_stiffness(i, wanted);
    e.all[i]->set_numbers(numbers.data());
    e.all[i]->set_state(e.first[i].data(), e.second[i].data());
    e.all[i]->begin(alive.data());
  });
  e.stiffness.clear();
  e.poissons_ratio = wanted;
}

std::vector<BatchRun> MotionBatch::run(int steps, const std::vector<int>& at, const OnStates& on_states) {
  check(steps, at);
  begin();
  int done = 0;
  const auto go_to = [&](int step) {
    engines_->each_engine([&](std::size_t i) { engines_->all[i]->steps(step - done); });
    done = step;
  };
  for (const int step : at) {
    go_to(step);
    engines_->fetch_states(member_count());
    if (on_states) on_states(step, engines_->states);
  }
  go_to(steps);
  return engines_->summaries(member_count(), steps);
}

std::vector<BatchRun> MotionBatch::run_adjoint(int steps, const std::vector<int>& at, const OnStates& on_states,
                                               const AddCotangents& add_cotangents,
                                               std::vector<BatchGradient>& gradients) {
  check(steps, at);
  begin();
  Engines& e = *engines_;
  const int members = member_count();
  const std::size_t of_state = 6 * sizeof(double) * e.nodes() * std::size_t(stride()) * e.all.size();
  const bool all_kept = std::size_t(steps) * of_state <= options_.memory_budget;
  const int length = all_kept ? std::max(1, steps) : int(std::ceil(std::sqrt(double(steps))));
  const int segments = (steps + length - 1) / length;  // their first states stand in the slots from `length` on
  for (const auto& engine : e.all) engine->reserve(all_kept ? steps : length + segments + 1);
  const auto is_asked = [&](int step) { return std::ranges::binary_search(at, step); };

  const std::vector<int> stops = boundaries(steps, at);
  for (std::size_t k = 0; k < stops.size(); ++k) {
    if (k > 0)
      e.each_engine([&](std::size_t i) {
        for (int s = stops[k - 1]; s < stops[k]; ++s) {
          if (all_kept)
            e.all[i]->save(s);
          else if (s % length == 0)
            e.all[i]->save(length + s / length);
          e.all[i]->steps(1);
        }
      });
    if (!is_asked(stops[k]) || !on_states) continue;
    e.fetch_states(members);
    on_states(stops[k], e.states);
  }
  const std::vector<BatchRun> forwards = e.summaries(members, steps);

  const auto lanes = std::size_t(stride());
  e.each_engine([&](std::size_t i) {
    std::vector<double> alive(lanes, 0.0);
    e.each_lane(i, members, [&](int lane, int member, bool is_own) {
      alive[std::size_t(lane)] = is_own && forwards[std::size_t(member)].succeeded ? 1.0 : 0.0;
    });
    e.all[i]->begin_adjoint(alive.data());
  });
  const auto add_at = [&](int step) {
    if (!is_asked(step) || !add_cotangents) return;
    e.fetch_states(members);
    e.bars.resize(std::size_t(members));
    for (State& bar : e.bars)
      for (Points* points : {&bar.x, &bar.v}) points->setZero(body_->nodes.rows(), 3);
    add_cotangents(step, e.states, e.bars);
    e.add_cotangents(members);
  };
  for (std::size_t k = stops.size(); k-- > 0;) {
    add_at(stops[k]);
    if (k == 0) break;
    e.each_engine([&](std::size_t i) {
      BatchEngine& engine = *e.all[i];
      for (int s = stops[k] - 1; s >= stops[k - 1]; --s) {
        if (!all_kept && (s + 1 == steps || (s + 1) % length == 0)) {
          const int first = s / length * length;
          engine.save(length + segments);  // where the sweep is
          engine.restore(length + first / length);
          for (int r = first; r <= s; ++r) {
            engine.save(r - first);
            if (r < s) engine.steps(1);
          }
          engine.restore(length + segments);
        }
        engine.adjoint_step(all_kept ? s : s % length);
      }
    });
  }
  return collect_gradients(forwards, gradients);
}

std::vector<BatchRun> MotionBatch::collect_gradients(std::vector<BatchRun> summaries,
                                                     std::vector<BatchGradient>& gradients) {
  Engines& e = *engines_;
  const auto lanes = std::size_t(stride());
  gradients.assign(members_.size(), {});
  e.bars.resize(members_.size());
  for (std::size_t i = 0; i < e.all.size(); ++i) {
    std::vector<double> numbers(gradient_number_count * lanes);
    e.all[i]->get_gradient(numbers.data());
    e.all[i]->get_cotangents(e.first[i].data(), e.second[i].data());
    e.fetch(i, member_count(), e.bars);
    const std::vector<double> solver = e.solver_numbers(i);
    e.each_lane(i, member_count(), [&](int lane, int member, bool is_own) {
      if (!is_own) return;
      BatchRun& summary = summaries[std::size_t(member)];
      summary.succeeded = summary.succeeded && solver[IsAlive * lanes + std::size_t(lane)] > 0.0;
      const double scale = summary.succeeded ? 1.0 : std::numeric_limits<double>::quiet_NaN();
      const auto of = [&](int row) { return scale * numbers[std::size_t(row) * lanes + std::size_t(lane)]; };
      const BatchMember& m = members_[std::size_t(member)];
      BatchGradient& g = gradients[std::size_t(member)];
      g.youngs_modulus = of(ByLogModulus) / m.youngs_modulus;
      g.poissons_ratio = of(ByPoissonsRatio);
      g.mass_damping = of(ByMassDamping);
      g.stiffness_damping = of(ByStiffnessDamping);
      g.density = of(ByDensity);
      for (int d = 0; d < 3; ++d) {
        g.gravity[d] = of(ByGravity + d);
        g.plane_point[d] = of(ByPlanePoint + d);
        g.plane_normal[d] = of(ByPlaneNormal + d);
      }
      g.friction = of(ByFriction);
      if (m.contact_stiffness > 0.0) g.contact_stiffness = of(ByLogContactStiffness) / m.contact_stiffness;
      g.start.x = scale * e.bars[std::size_t(member)].x;
      g.start.v = scale * e.bars[std::size_t(member)].v;
    });
  }
  return summaries;
}

}  // namespace pliant
