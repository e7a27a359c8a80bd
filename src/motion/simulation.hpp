#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "elasticity/body.hpp"
#include "elasticity/material.hpp"
#include "motion/body_forces.hpp"
#include "motion/contact_defaults.hpp"
#include "motion/fixed_regions.hpp"
#include "motion/pull.hpp"
#include "motion/rest_shape.hpp"
#include "motion/statics.hpp"
#include "motion/stepper.hpp"

namespace pliant {

/// A scene in motion: what is fixed about it while parameters vary.
struct SimulationOptions {
  std::vector<double> times;  ///< [s] of each frame; the first is when the object is let go
  double max_dt = 0.0;        ///< [s], > 0: each interval is cut into equal steps no longer than this
  double newmark_theta = 0.51;
  double contact_weight = 0.6, rotation_prediction = 0.5;  ///< see StepOptions
  Material material;
  SolverOptions solver;
  Integrator integrator = Integrator::Lagged;
  NewtonOptions newton;
  Penalty contact;              ///< of the surface with every plane
  double friction_speed = 0.0;  ///< below which friction fades to nothing [m/s]; 0: there is none, whatever its
                                ///< coefficients
  /// Where the parameter vectors of the motion have what it depends on: obstacles are its planes, and where it has
  /// pulls the motion starts at rest in the equilibrium under them (see `Pull`).
  MotionBlocks blocks = MotionLayout();
  PullPoints pull_points;  ///< where the pulls act, one a block; none: nodes of the body far from what is held
  std::vector<PointMass> released_weights;  ///< hung from the object at the start's equilibrium, and gone afterwards
  bool scan_sags = false;   ///< the body stands in its scan as gravity and weights hold it; its stress-free reference
                            ///< follows from the parameters. Tetrahedra only
  ShapeField shape;         ///< how the scan may err: one point a block of scan corrections. Tetrahedra only
  std::vector<Hold> holds;  ///< held regions
  std::vector<PointMass> weights;  ///< hung from the object: point masses that move along with their points
  std::vector<PointMass> loads;    ///< the same, hung since the scan was taken: a scan that sags does not show them
  KeyFrames<3> gravity_change;     ///< of gravity over time, added to that of the parameter vector [m/s^2]
  /// Makers of forces beyond those above, such as wind, hands and led shapes; each is called once a simulation.
  std::vector<std::function<std::unique_ptr<ForceTerm>(const std::shared_ptr<const Body>& body)>> further_forces;
  RigidMotion start_pose;       ///< from rest to where the object is at the start, where nothing is held
  bool starts_settled = false;  ///< the motion starts from the equilibrium under the forces of its first instant
  /// Where nodes are at the start, n x 3 [m]: what led them there lets go then. Empty: where they rest, or where the
  /// equilibrium of what holds the object until then has them. The same for every parameter vector.
  Points start;
  /// Velocities of the nodes at the start, n x 3 [m/s], beside those of the parameter vector. Empty: none.
  Points start_velocities;
  bool is_static = false;      ///< every frame sees the same equilibrium; steps, velocities and damping play no part
  bool hold_strongly = false;  ///< nodes in held regions are eliminated, instead of Nitsche's method; always so for
                               ///< tetrahedra, which follow the shape
  int most_halvings = 5;       ///< of a step that cannot be taken as a whole, >= 0
  std::size_t memory_budget = std::size_t(256) << 20;  ///< [bytes] for states kept for the adjoint
};

struct RolloutSummary {
  bool succeeded = false;
  int steps = 0, frames = 0, solver_iterations = 0;
  std::string failure;  ///< why it stopped, in words
};

/// Derivatives of a scalar cost by the nodes, n x 3 each.
struct NodeCotangents {
  Points start;             ///< by where nodes are at the start [1/m]; of an object that is held until then, zero
  Points start_velocities;  ///< by their velocities there [s/m]
  /// By where nodes are stress-free [1/m], their mass and all else staying as they are, the start included. Empty
  /// unless it is asked for.
  Points reference;
  bool with_reference = false;  ///< asks for it
};

/// Runs one body through a scene's frames, or to its equilibrium, with tangents or adjoint. Not for concurrent use;
/// copies are cheap to make with the same body.
class Simulation {
 public:
  /// Throws std::invalid_argument where options contradict each other or the body.
  Simulation(std::shared_ptr<const Body> body, SimulationOptions options);

  const Body& body() const { return *body_; }
  const SimulationOptions& options() const { return options_; }
  int frame_count() const { return int(options_.times.size()); }

  /// From now on the object is stress-free where it is for this theta, whatever theta is: derivatives leave that out
  /// too. Returns why it cannot, or nothing.
  [[nodiscard]] std::string hold_shape(const VectorX& theta);

  /// Looks for load-free shapes from that which another simulation of the same body and options found last.
  void begin_shape_from(const Simulation& other);

  /// The body with its load-free shape for theta; the given one where theta does not say, or there is none.
  std::shared_ptr<const Body> rest_body(const VectorX& theta);

  /// Called at each frame, also the first, with the state and its tangents; false ends the run there (as a success).
  using OnFrame = std::function<bool(int frame, const State& state, std::span<const State> tangents)>;

  /// @param directions  theta.size() x p: changes of theta whose tangents are carried along; may have no columns
  /// @param last_frame  where to stop (inclusive)
  RolloutSummary run(const VectorX& theta, const MatrixX& directions, int last_frame, const OnFrame& on_frame);
  RolloutSummary run(const VectorX& theta, const OnFrame& on_frame);

  /// Reverse sweep of a scalar cost that is a sum over frames.
  /// @param cost      called at each frame, forwards: adds nothing to the state, returns false to fail
  /// @param cotangent called at each frame, backwards: adds the cost's derivative by positions to `x_bar` (n x 3)
  /// @param theta_bar out: derivative of the summed cost by theta
  /// Keeps states within the memory budget, and beyond it the first state of each of about sqrt(steps) segments, which
  /// are run again when the sweep reaches them.
  /// @param nodes     out, where given: derivatives by the nodes. Throws std::invalid_argument as `set_reference` does
  ///                  where they are asked for by the reference
  RolloutSummary run_adjoint(const VectorX& theta, int last_frame, const std::function<bool(int, const State&)>& cost,
                             const std::function<void(int, const State&, Points&)>& cotangent, VectorX& theta_bar,
                             NodeCotangents* nodes = nullptr);
  /// From now on motions start there, with these velocities beside those of theta: n x 3 each, or empty for where nodes
  /// rest, and for none. Throws std::invalid_argument as the constructor does for `SimulationOptions::start`.
  void set_start(Points positions, Points velocities);
  /// From now on the body is stress-free where its nodes are there [m], n x 3; it still starts where it was scanned,
  /// and mass, surface and the unit of pulls stay those of the body as it was given. Throws std::invalid_argument where
  /// the elements are not tetrahedra, where a law is given beside the moduli, where the parameters say where the
  /// body is stress-free, and where an element has no positive volume.
  void set_reference(Points reference);
  /// Bytes of states that the last reverse sweep held at its most.
  std::size_t peak_state_bytes() const { return peak_state_bytes_; }

 private:
  struct StepPlan {
    double time, dt;  ///< of its start, and its length [s]
    int frame_after;  ///< frame reached by this step, -1: none
  };
  /// False where the object cannot be stress-free anywhere: the summary says so.
  bool set_parameters(const VectorX& theta, RolloutSummary& summary);
  /// Whether the motion starts from an equilibrium, under forces that end there.
  bool starts_held() const { return forces_.pull || forces_.let_go || options_.starts_settled; }
  void hold_start(bool held);
  void check_start() const;
  void check_reference() const;
  /// Where and how fast the object is when it is let go; for a held one also the derivatives' matrix. False where
  /// there is no such equilibrium: the summary says so.
  bool start(const VectorX& theta, State& state, RolloutSummary& summary);
  /// Changes of where the nodes are stress-free along directions; empty where theta does not say that. `scan` is that
  /// of where they were scanned.
  struct ShapeChange {
    std::vector<Points> reference, scan;
    const Points* of(std::size_t direction) const { return reference.empty() ? nullptr : &reference[direction]; }
  };
  bool follows_shape() const { return shape_ && !shape_is_held_; }
  bool shape_tangents(const MatrixX& directions, ShapeChange& change, RolloutSummary& summary);
  /// Tangents of the start that was found last.
  std::vector<State> start_tangents(const State& start, const MatrixX& directions, const ShapeChange& shape);
  /// Adds to theta_bar and, where given, reference_bar. Any steps may have been taken since the start was found.
  bool start_adjoint(const State& start, const State& bar, VectorX& theta_bar, Points* reference_bar);
  Points velocities(const VectorX& theta) const;
  /// The equilibrium of static scenes and of pulled objects: at once where Newton's method gets there from rest, else
  /// by steps of the load, gravity, pulls and the holds' displacement together, as large as it follows. Never from an
  /// equilibrium that was found before: where there are several, which one it is must depend on the parameters alone.
  bool find_equilibrium(const VectorX& theta, State& state, RolloutSummary& summary);
  /// To the equilibrium under the parameters at hand, with the matrix of its derivatives. False where there is none.
  [[nodiscard]] bool settle(Points& x, RolloutSummary& summary);
  /// Moves the held regions from one part of their way to another, and the whole body's positions along with them: each
  /// node as the regions move, by inverse square distance from them.
  void move_holds(double from, double to, Points& positions);
  void prepare_holds();
  /// A stepper, and those of its forces that the simulation talks to.
  struct StepForces {
    Elasticity* elasticity = nullptr;
    FixedRegions* fixed_regions = nullptr;  // if any, as the two below
    Pull* pull = nullptr;
    PointWeights* let_go = nullptr;
  };
  Stepper make_stepper(StepForces& forces) const;
  /// Makes the second stepper ready for the parameters of the first one.
  void prepare_second(const VectorX& theta);
  /// Solves for a step's way `delta`.
  bool forward_step(const StepPlan& plan, Stepper& stepper, const State& start, Points& delta, RolloutSummary& summary);
  /// Carries the tangents over the step that a stepper solved last. False where its matrix cannot be factorised.
  bool step_tangents(Stepper& stepper, const State& start, const Points& delta, const MatrixX& directions,
                     std::vector<State>& tangents, const ShapeChange& shape);
  /// The step i of `steps_`, in halves where it cannot be taken as a whole: they stand in its place then. Sets the
  /// step's way, not its end.
  bool take_step(std::size_t i, Stepper& stepper, const State& start, Points& delta, RolloutSummary& summary);
  /// How far the middle of a lagged step lies from where its rotations, strains and contact were predicted, the
  /// farthest node, in edges of an element. A step is too long where that is no small part.
  double surprise(const StepPlan& plan, const State& start, const Points& delta) const;
  /// All steps up to a frame. The tangents of a step go along beside the next step, which another stepper takes.
  void take_steps(const VectorX& theta, const MatrixX& directions, const ShapeChange& shape, int last_frame,
                  const OnFrame& on_frame, const State& start, std::vector<State>& tangents, RolloutSummary& summary);
  std::size_t state_bytes() const { return 2 * 3 * sizeof(double) * std::size_t(body_->node_count()); }
  std::size_t segment_length(std::size_t steps) const;

  std::shared_ptr<const Body> body_;
  SimulationOptions options_;
  double longest_step_ = 0.0;         // of the plan [s]
  double element_edge_ = 0.0;         // of a cube as large as a mean element [m]
  std::vector<StepPlan> steps_;       // of the run: the plan's, some in halves
  std::vector<Vector3> hold_middle_;  // of each hold's nodes at rest
  MatrixX hold_share_;                // n x holds: how much each node moves with each; rows sum to one
  StepForces forces_;                 // of the stepper
  Stepper stepper_;
  /// What takes every other step of a run with tangents.
  struct Second {
    StepForces forces;
    Stepper stepper;
    std::shared_ptr<const Body> reference;  // where its forces have the body stress-free, if that was set
  };
  std::unique_ptr<Second> second_;
  Statics statics_;                   // of the stepper's forces
  std::unique_ptr<RestShape> shape_;  // where theta says where the body is stress-free
  bool shape_is_held_ = false;
  std::shared_ptr<const Body> reference_body_;  // where it is stress-free, if that was set
  Points reference_bar_;                        // likewise, of the reverse sweep
  std::vector<StepPlan> plan_;
  Points delta_, rest_, lever_;
  std::size_t peak_state_bytes_ = 0;
};

/// The elasticity of a scene's body.
std::unique_ptr<Elasticity> scene_elasticity(const std::shared_ptr<const Body>& body, const SimulationOptions& options);

/// All forces of a scene but what holds it until it is let go, each held region at the end of its way.
std::vector<std::unique_ptr<ForceTerm>> scene_forces(const std::shared_ptr<const Body>& body,
                                                     const SimulationOptions& options);

/// Nodes that a simulation of the scene eliminates; the others in held regions are held by forces.
std::vector<int> eliminated_nodes(const Body& body, const SimulationOptions& options);

/// The longest step that suits an object of this size falling under this gravity.
double default_time_step(const Body& body, double gravity);

}  // namespace pliant
