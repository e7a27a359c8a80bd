#pragma once

#include <mutex>
#include <vector>

#include "batch_motion/batch_engine.hpp"
#include "batch_motion/step_kernels.hpp"

namespace pliant::batch_motion {

/// What a step needs besides its members' own numbers. Engines that take turns share it.
template <class Backend>
struct Workspace {
  template <class Number>
  using Array = typename Backend::template Array<Number>;

  Workspace(const MeshView& mesh, int corners, std::size_t stride)
      : rotation(9 * count(mesh.elements) * stride),
        element_force(3 * count(mesh.elements * corners) * stride),
        element_product(3 * count(mesh.elements * corners) * stride),
        sample_force(3 * count(mesh.samples) * stride),
        sample_product(3 * count(mesh.samples) * stride),
        touched(count(mesh.nodes) * stride),
        sample_matrix(2 * count(mesh.samples) * stride),
        right(3 * count(mesh.nodes) * stride),
        way(3 * count(mesh.nodes) * stride),
        residual(3 * count(mesh.nodes) * stride),
        partial(2 * count(mesh.chunks) * stride),
        pivot(6 * count(mesh.nodes) * stride),
        scaled(9 * count(mesh.lower_blocks) * stride),
        y(3 * count(mesh.nodes) * stride),
        r(3 * count(mesh.nodes) * stride),
        p(3 * count(mesh.nodes) * stride),
        t(3 * count(mesh.nodes) * stride),
        s(3 * count(mesh.nodes) * stride) {}
  static std::size_t count(int number) { return std::size_t(number); }

  Array<double> rotation, element_force, element_product, sample_force, sample_product, touched, sample_matrix, right,
      way, residual, partial;
  Array<float> pivot, scaled, y, r, p, t, s;

  /// Of the reverse sweep; made when one begins.
  struct Reverse {
    Array<double> element_v_bar, sample_v_bar, element_sum, sample_sum, node_sum, element_partial, sample_partial,
        node_partial;
  };
  std::unique_ptr<Reverse> reverse;
};

/// Mesh and workspaces of the engines of one batch.
template <class Backend>
class Shared {
 public:
  Shared(std::shared_ptr<const MeshData> data, const StepNumbers& step_numbers, const SolverNumbers& solver_numbers,
         const Backend& of)
      : backend(of), step(step_numbers), solver(solver_numbers), data_(std::move(data)) {
    mesh = data_->view([this](const auto& values) { return backend.place(values, ints_, doubles_); });
  }
  const MeshData& data() const { return *data_; }

  /// Lends a workspace; the second of two threads gets another one.
  std::unique_ptr<Workspace<Backend>> lend(std::size_t stride) {
    const std::lock_guard lock(mutex_);
    if (free_.empty()) return std::make_unique<Workspace<Backend>>(mesh, data_->nodes_per_element, stride);
    auto last = std::move(free_.back());
    free_.pop_back();
    return last;
  }
  void take_back(std::unique_ptr<Workspace<Backend>> workspace) {
    const std::lock_guard lock(mutex_);
    free_.push_back(std::move(workspace));
  }

  Backend backend;
  StepNumbers step;
  SolverNumbers solver;
  MeshView mesh;

 private:
  std::shared_ptr<const MeshData> data_;
  std::vector<typename Backend::template Array<int>> ints_;
  std::vector<typename Backend::template Array<double>> doubles_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<Workspace<Backend>>> free_;
};

/// The order of a step's kernels, whatever runs them: a backend has arrays and runs kernels over items, each for all
/// members.
/// @tparam N  nodes an element
template <class Backend, int N>
class Engine : public BatchEngine {
 public:
  Engine(std::shared_ptr<Shared<Backend>> shared, int members)
      : shared_(std::move(shared)), backend_(shared_->backend), mesh_(shared_->mesh) {
    const std::size_t stride = backend_.set_members(members), n = 3 * std::size_t(mesh_.nodes);
    stride_ = stride;
    for (auto* array : {&x_, &v_}) array->resize(n * stride);
    quaternion_.resize(4 * std::size_t(mesh_.elements) * stride);
    members_.resize(member_number_count * stride);
    numbers_.resize(solver_number_count * stride);
  }

  int stride() const override { return int(stride_); }
  void set_numbers(const double* numbers) override { backend_.upload(numbers, members_); }
  void set_stiffness(int member, const double* value, const double* change) override {
    shares_stiffness_ = false;
    for (auto* array : {&stiffness_value_, &stiffness_change_}) array->resize(stiffness_numbers() * stride_);
    put(member, value, stiffness_value_);
    put(member, change, stiffness_change_);
  }
  void set_shared_stiffness(const double* value, const double* change) override {
    shares_stiffness_ = true;
    for (auto* array : {&stiffness_value_, &stiffness_change_}) array->resize(stiffness_numbers());
    backend_.upload(value, stiffness_value_);
    backend_.upload(change, stiffness_change_);
  }
  void set_state(const double* x, const double* v) override {
    backend_.upload(x, x_);
    backend_.upload(v, v_);
  }
  void get_state(double* x, double* v) const override {
    backend_.download(x_, x);
    backend_.download(v_, v);
  }
  void begin(const double* alive) override {
    std::vector<double> identity(4 * std::size_t(mesh_.elements) * stride_, 0.0);
    for (std::size_t e = 0; e < std::size_t(mesh_.elements); ++e)
      for (std::size_t m = 0; m < stride_; ++m) identity[4 * e * stride_ + m] = 1.0;
    backend_.upload(identity.data(), quaternion_);
    set_alive(alive);
  }
  void steps(int count) override {
    const Lent own(*this);
    for (int i = 0; i < count; ++i) step();
  }

  void reserve(int slots) override {
    while (int(slots_.size()) < slots) {
      slots_.emplace_back();
      slots_.back().x.resize(x_.size());
      slots_.back().v.resize(v_.size());
    }
  }
  void save(int slot) override { copy(x_, slots_[std::size_t(slot)].x), copy(v_, slots_[std::size_t(slot)].v); }
  void restore(int slot) override { copy(slots_[std::size_t(slot)].x, x_), copy(slots_[std::size_t(slot)].v, v_); }

  void begin_adjoint(const double* alive) override {
    for (auto* array : {&x_bar_, &v_bar_, &w_, &before_, &added_}) array->resize(x_.size());
    gradient_.resize(gradient_number_count * stride_);
    for (auto* array : {&x_bar_, &v_bar_, &w_, &before_}) zero(*array);
    zero(gradient_);
    adjoint_steps_ = 0;
    set_alive(alive);
  }
  void add_cotangents(const double* x_bar, const double* v_bar) override {
    backend_.upload(x_bar, added_);
    backend_.each(vector_items(), Add{added_.data(), x_bar_.data()});
    backend_.upload(v_bar, added_);
    backend_.each(vector_items(), Add{added_.data(), v_bar_.data()});
  }
  void adjoint_step(int slot) override;
  void get_cotangents(double* x_bar, double* v_bar) const override {
    backend_.download(x_bar_, x_bar);
    backend_.download(v_bar_, v_bar);
  }
  void get_gradient(double* gradient) const override { backend_.download(gradient_, gradient); }
  void get_solver_numbers(double* numbers) const override { backend_.download(numbers_, numbers); }

 private:
  template <class Number>
  using Array = typename Backend::template Array<Number>;

  /// A workspace while it lives.
  struct Lent {
    explicit Lent(Engine& engine) : of(engine) { of.work_ = of.shared_->lend(of.stride_); }
    Lent(const Lent&) = delete;
    Lent& operator=(const Lent&) = delete;
    ~Lent() { of.shared_->take_back(std::move(of.work_)); }
    Engine& of;
  };

  int vector_items() const { return 3 * mesh_.nodes; }
  std::size_t stiffness_numbers() const { return 9 * 36 * std::size_t(shared_->data().classes); }
  void copy(const Array<double>& from, Array<double>& to) {
    backend_.each(int(to.size() / stride_), Copy{from.data(), to.data()});
  }
  void zero(Array<double>& array) { backend_.each(int(array.size() / stride_), Zero{array.data()}); }
  void put(int member, const double* values, Array<double>& array) {
    member_values_.resize(array.size() / stride_);
    backend_.upload(values, member_values_);
    backend_.each(int(member_values_.size()), PutMember{member_values_.data(), std::size_t(member), array.data()});
  }
  void set_alive(const double* alive) {
    std::vector<double> numbers(solver_number_count * stride_, 0.0);
    for (std::size_t m = 0; m < stride_; ++m) numbers[IsAlive * stride_ + m] = alive[m];
    backend_.upload(numbers.data(), numbers_);
  }
  MemberStiffness<N> stiffness() const {
    if constexpr (N == 8)
      return {stiffness_value_.data(), stiffness_change_.data(), mesh_.element_class, shares_stiffness_};
    else
      return {};
  }
  const double* number(SolverNumber which) const { return numbers_.data() + std::size_t(which) * stride_; }

  void step();
  /// Rotations, contact and the step's matrix about the state at hand, and what preconditions it.
  void prepare();
  /// A x = b, from the x at hand.
  /// @param has_product  whether the elements' product with it is there
  void solve(const double* b, Array<double>& x, bool has_product);
  void iterate();

  std::shared_ptr<Shared<Backend>> shared_;
  Backend backend_;
  MeshView mesh_;
  std::size_t stride_ = 0;
  Array<double> x_, v_, quaternion_, members_, numbers_, stiffness_value_, stiffness_change_, member_values_;
  Array<double> x_bar_, v_bar_, w_, before_, added_, gradient_;
  struct Slot {
    Array<double> x, v;
  };
  std::vector<Slot> slots_;
  int adjoint_steps_ = 0;
  bool shares_stiffness_ = false;
  std::unique_ptr<Workspace<Backend>> work_;
};

template <class Backend, int N>
void Engine<Backend, N>::prepare() {
  Workspace<Backend>& o = *work_;
  const StepNumbers& step = shared_->step;
  backend_.each(mesh_.elements,
                RotateElements<N>{mesh_, step, x_.data(), v_.data(), quaternion_.data(), o.rotation.data()});
  backend_.each(mesh_.samples, SampleForces<N>{mesh_, step, members_.data(), x_.data(), v_.data(),
                                               o.sample_force.data(), o.sample_matrix.data()});
  backend_.each(mesh_.nodes, TouchedNodes{mesh_, o.sample_matrix.data(), o.touched.data()});
  const StepMatrix<N> matrix{mesh_, step, stiffness(), members_.data(), o.rotation.data(), o.sample_matrix.data()};
  backend_.each(mesh_.nodes, DiagonalFactor<N>{matrix, o.pivot.data()});
  backend_.each(mesh_.lower_blocks, ScaledBlock<N>{matrix, o.pivot.data(), o.scaled.data()});
}

template <class Backend, int N>
void Engine<Backend, N>::step() {
  prepare();
  Workspace<Backend>& o = *work_;
  const StepNumbers& step = shared_->step;
  backend_.each(mesh_.nodes, FirstWay{mesh_, step, v_.data(), o.way.data()});
  backend_.each(mesh_.elements, ElementForces<N>{mesh_, step, stiffness(), members_.data(), x_.data(), o.way.data(),
                                                 o.rotation.data(), o.element_force.data(), o.element_product.data()});
  backend_.each(mesh_.nodes, StepRight{mesh_, step, members_.data(), v_.data(), o.element_force.data(),
                                       o.sample_force.data(), o.touched.data(), o.right.data()});
  solve(o.right.data(), o.way, true);
  backend_.each(mesh_.nodes, Advance{step, number(IsAlive), o.way.data(), x_.data(), v_.data()});
  backend_.each(1, CountSteps{numbers_.data()});
}

template <class Backend, int N>
void Engine<Backend, N>::solve(const double* b, Array<double>& solution, bool has_product) {
  double* const x = solution.data();
  Workspace<Backend>& o = *work_;
  const SolverNumbers& solver = shared_->solver;
  const StepNumbers& step = shared_->step;
  for (int refinement = 0;; ++refinement) {
    if (refinement > 0 || !has_product)
      backend_.each(mesh_.elements, ElementProducts<N>{mesh_, step, stiffness(), members_.data(), x, o.rotation.data(),
                                                       o.element_product.data()});
    backend_.each(mesh_.samples,
                  SampleProducts<N>{mesh_, step, members_.data(), o.sample_matrix.data(), x, o.sample_product.data()});
    backend_.each(mesh_.nodes, Residual{mesh_, step, members_.data(), b, x, o.element_product.data(),
                                        o.sample_product.data(), o.touched.data(), o.residual.data()});
    backend_.each(mesh_.chunks, ResidualSquares{mesh_, b, o.residual.data(), o.partial.data()});
    backend_.each(1, JudgeResidual{mesh_, o.partial.data(), numbers_.data(), solver.tolerance, solver.least_reduction,
                                   refinement == 0});
    if (!backend_.any(number(IsOpen))) return;
    if (refinement == solver.most_refinements) break;
    backend_.each(mesh_.nodes, NarrowResidual{o.residual.data(), numbers_.data(), o.pivot.data(), o.y.data()});
    iterate();
    backend_.each(mesh_.nodes, AddCorrection{numbers_.data(), o.pivot.data(), o.y.data(), x});
  }
  backend_.each(1, JudgeMembers{numbers_.data()});
}

/// Conjugate gradients from `y`, which becomes the solution.
template <class Backend, int N>
void Engine<Backend, N>::iterate() {
  Workspace<Backend>& o = *work_;
  backend_.forward(ForwardSweep{mesh_, o.scaled.data(), o.y.data(), nullptr, o.r.data()});
  backend_.each(mesh_.chunks, BeginGradients{mesh_, o.r.data(), o.p.data(), o.t.data(), o.y.data(), o.partial.data()});
  backend_.each(1, BeginNumbers{mesh_, o.partial.data(), numbers_.data()});
  const double most = shared_->solver.most_iterations;
  do {
    for (int i = 0; i < Backend::iterations_together; ++i) {
      backend_.backward(BackwardSweep{mesh_, o.scaled.data(), o.p.data(), o.t.data()});
      backend_.forward(ForwardSweep{mesh_, o.scaled.data(), o.p.data(), o.t.data(), o.s.data()});
      backend_.each(mesh_.chunks, Curvature{mesh_, o.p.data(), o.t.data(), o.s.data(), o.partial.data()});
      backend_.each(1, StepLength{mesh_, o.partial.data(), numbers_.data()});
      backend_.each(mesh_.chunks, UpdateSolution{mesh_, numbers_.data(), o.t.data(), o.s.data(), o.y.data(), o.r.data(),
                                                 o.partial.data()});
      backend_.each(1, NextDirection{mesh_, o.partial.data(), numbers_.data(), most});
      backend_.each(mesh_.chunks, UpdateDirection{mesh_, numbers_.data(), o.r.data(), o.p.data(), o.t.data()});
    }
  } while (backend_.any(number(IsIterating)));
}

template <class Backend, int N>
void Engine<Backend, N>::adjoint_step(int slot) {
  const Lent own(*this);
  Workspace<Backend>& o = *work_;
  const StepNumbers& step = shared_->step;
  const auto count = [](int number) { return std::size_t(number); };
  const SumItems of_elements{mesh_.elements, ElementAdjoint<N>::sums, nullptr, nullptr},
      of_samples{mesh_.samples, SampleAdjoint<N>::sums, nullptr, nullptr},
      of_nodes{mesh_.nodes, AdjointNodes::sums, nullptr, nullptr};
  if (!o.reverse) {
    o.reverse = std::make_unique<typename Workspace<Backend>::Reverse>();
    auto& made = *o.reverse;
    made.element_v_bar.resize(o.element_force.size());
    made.sample_v_bar.resize(o.sample_force.size());
    made.element_sum.resize(count(of_elements.items * of_elements.columns) * stride_);
    made.sample_sum.resize(count(of_samples.items * of_samples.columns) * stride_);
    made.node_sum.resize(count(of_nodes.items * of_nodes.columns) * stride_);
    made.element_partial.resize(count(of_elements.chunks() * of_elements.columns) * stride_);
    made.sample_partial.resize(count(of_samples.chunks() * of_samples.columns) * stride_);
    made.node_partial.resize(count(of_nodes.chunks() * of_nodes.columns) * stride_);
  }
  auto& a = *o.reverse;
  copy(x_, added_);  // the step's end
  restore(slot);
  prepare();
  backend_.each(mesh_.nodes, AdjointRight{mesh_, step, adjoint_steps_ > 1 ? 1.0 : 0.0, x_bar_.data(), v_bar_.data(),
                                          w_.data(), before_.data(), o.right.data()});
  ++adjoint_steps_;
  solve(o.right.data(), w_, false);
  backend_.each(mesh_.elements, ElementAdjoint<N>{mesh_, step, stiffness(), members_.data(), x_.data(), v_.data(),
                                                  added_.data(), o.rotation.data(), w_.data(), o.element_force.data(),
                                                  a.element_v_bar.data(), a.element_sum.data()});
  backend_.each(mesh_.samples,
                SampleAdjoint<N>{mesh_, step, members_.data(), x_.data(), v_.data(), added_.data(), w_.data(),
                                 o.sample_force.data(), a.sample_v_bar.data(), a.sample_sum.data()});
  backend_.each(mesh_.nodes,
                AdjointNodes{mesh_, step, members_.data(), x_.data(), v_.data(), added_.data(), w_.data(),
                             o.element_force.data(), a.element_v_bar.data(), o.sample_force.data(),
                             a.sample_v_bar.data(), o.touched.data(), x_bar_.data(), v_bar_.data(), a.node_sum.data()});
  const auto sum = [&](SumItems items, const Array<double>& values, Array<double>& partial) {
    items.values = values.data(), items.partial = partial.data();
    backend_.each(items.chunks() * items.columns, items);
  };
  sum(of_elements, a.element_sum, a.element_partial);
  sum(of_samples, a.sample_sum, a.sample_partial);
  sum(of_nodes, a.node_sum, a.node_partial);
  backend_.each(
      1, AddGradient{step, members_.data(), of_elements.chunks(), of_samples.chunks(), of_nodes.chunks(),
                     a.element_partial.data(), a.sample_partial.data(), a.node_partial.data(), gradient_.data()});
  backend_.each(1, CountSteps{numbers_.data()});
}

}  // namespace pliant::batch_motion
