#pragma once

#include <memory>
#include <string>
#include <vector>

#include "elasticity/material.hpp"
#include "motion/body_forces.hpp"
#include "motion/rotation_strain_step.hpp"
#include "solvers/general_solver.hpp"

namespace pliant {

/// How the load-free shape is looked for.
enum class ReferenceScheme {
  PseudoTransient,  ///< implicit steps of dX/dt = -K_0^-1 r that grow as r falls (Kelley and Keyes 1998): the default
  VirtualForce,     ///< the residual as a force that moves masses, damped: the scheme of Wang 2015, section 6.1
  Newton,           ///< full steps of Newton's method from the scan
};

struct ReferenceShapeOptions {
  ReferenceScheme scheme = ReferenceScheme::PseudoTransient;
  double tolerance = 1e-10;  ///< of the residual, relative to the load, (0, 1)
  int max_iterations = 200;  ///< >= 1; by parts, no more than 30 for each
  /// Elements of the shape that was found keep at least this part of the volume that they have in the scan, (0, 1).
  double least_volume_ratio = 0.05;
  bool by_parts = true;  ///< where the whole load cannot be carried, look for the part that can
  double virtual_step = 0.1, virtual_damping = 2.0;  ///< of the scheme by virtual forces [s], [1/s]
  SolverKind solver = SolverKind::Automatic;
};

/// What was found.
struct ReferenceShape {
  bool found = false;
  std::string reason;     ///< why not, in words
  Points X;               ///< n x 3 [m]; the best seen where none was found
  double residual = 0.0;  ///< of the forces at free nodes, relative to the load there
  double least_volume_ratio = 1.0;
  int iterations = 0;
  /// The largest part of the load for which a shape was found; 1 where `found`. Forces are proportional to Young's
  /// modulus: the smallest that carries the whole load is the given one over this, to about 5 %.
  double carried = 0.0;
};

/// Where the nodes of a body have to be stress-free so that its elasticity holds the scan in equilibrium (Wang 2015,
/// eq. 7-8): f(X, x_scan) + load = 0 at all nodes that are not held. Held nodes are where they are in the scan. The
/// mass is that of the scan.
class ReferenceShapeSolver {
 public:
  /// @param body  of tetrahedra, as scanned
  /// @param held  nodes that something else holds, at least three
  /// @param material  of the body
  /// @param blocks    of the parameter vectors below; the density is among them
  /// Throws std::invalid_argument for a body of hexahedra, and InputError where fewer nodes are held.
  ReferenceShapeSolver(std::shared_ptr<const Body> body, std::vector<int> held, Material material,
                       const MotionBlocks& blocks, const ReferenceShapeOptions& options = {});

  /// Where the nodes truly were when they were scanned, n x 3 [m], if not where the body has them. Held ones are to
  /// stay where they are.
  void set_scan(Points scan) { scan_ = std::move(scan); }
  /// @param load   on the nodes of the scan [N], n x 3
  /// @param guess  of X; null: the scan
  /// A shape counts as found only where the scan is a stable equilibrium of it. Where a part of the load alone can be
  /// carried, that part is looked for.
  [[nodiscard]] ReferenceShape find(const VectorX& theta, const Points& load, const Points* guess = nullptr);

  /// Makes ready for the derivatives of a shape that was found. False where its matrix cannot be factorised.
  [[nodiscard]] bool prepare_derivatives(const VectorX& theta, const Points& X);
  /// Change of X for a change of the forces at the nodes.
  [[nodiscard]] Points tangent(const Points& d_force);
  /// Cotangent of the forces at the nodes for one of X.
  [[nodiscard]] Points adjoint(const Points& X_bar);

 private:
  struct Attempt {
    bool converged = false, gives_way = false;  // the latter: a balance, but not a stable one
    std::string reason;
    Points X;
    double residual = 0.0, least_volume_ratio = 1.0;
    int iterations = 0;
  };
  Attempt attempt(const Points& load, const Points& from, double pseudo_step);
  /// residual_ = f(X, scan) + load at free nodes; false where an element is inside out.
  bool set_residual(const Points& X, const Points& load);
  /// X moved by a step whose parts turn; out of the way of folding, no part by more than a radian.
  Points moved(const Points& X, const Points& step);
  /// Whether the scan is a stable equilibrium of this shape.
  bool holds_still(const VectorX& theta, const Points& X);
  /// jacobian_ = R^T df/dX at the linearised X, R about each node's rotation from X to the scan: nearly symmetric,
  /// which df/dX itself is not where parts have turned.
  void set_turns();
  void set_jacobian();
  /// Of the system that was factorised.
  /// @param tolerance  of |b - A x| / |b|
  VectorX solve(const VectorX& b, double tolerance, GeneralSolver::Side side = GeneralSolver::Side::Plain);
  Points turned_back(const Points& forces) const;
  void add_mass(double density, BlockMatrix& matrix) const;
  void constrain(BlockMatrix& matrix) const;
  void clear_held(Points& points) const;

  std::shared_ptr<const Body> body_;
  std::vector<int> held_;
  Material material_;
  MotionBlocks blocks_;
  Points scan_;
  ReferenceShapeOptions options_;
  std::unique_ptr<ReferenceForces> forces_;
  GeneralSolver solver_, stability_;
  RotationStrainStep turning_;
  BlockMatrix jacobian_, metric_, matrix_;  // metric: what resists a step of pseudo-time
  std::vector<Matrix3> turn_;               // of each node
  Points residual_;
};

/// Weight and hung weights at the nodes of the scan [N], n x 3.
Points scan_load(const Body& body, const MotionBlocks& blocks, const VectorX& theta,
                 const std::vector<PointMass>& weights);

}  // namespace pliant
