// What solves a large body's system: pliant's own solvers beside PETSc's GAMG, hypre's BoomerAMG and Trilinos' ML,
// these three through PETSc, for the same matrix and right-hand side, to the same residual in the same norm; processor
// seconds of one thread. Built where PETSc is found (pkg-config PETSc); nothing else of pliant needs it.
//
//   multigrid_packages CASE NODES STIFFNESS_SHARE [own] [gamg] [hypre] [ml]
//
// The matrix is mass + share times the step's stiffness: 1 is a time step, 1e6 nearly an equilibrium.

#include <petscksp.h>

#include <cstdio>
#include <ctime>
#include <random>
#include <vector>

#include "elasticity/corotated.hpp"
#include "motion/sized_scenes.hpp"

namespace pliant {
namespace {

double processor_s() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return double(time.tv_sec) + 1e-9 * double(time.tv_nsec);
}

void check(PetscErrorCode code) {
  if (code != 0) throw std::runtime_error("PETSc failed with code " + std::to_string(code));
}

struct System {
  BlockMatrix A;
  Points positions;
  VectorX b;
};

System make_system(const std::string& name, int nodes, double share) {
  const benchmark::SizedScene scene = benchmark::sized_scene(name, nodes);
  const Body& body = *scene.body;
  const MotionBlocks& blocks = scene.options.blocks;
  const auto elasticity = make_elasticity(scene.body, blocks);
  elasticity->set_parameters(scene.theta);
  elasticity->linearise(body.nodes);
  System system{BlockMatrix(body.pattern), body.nodes, VectorX(3 * body.node_count())};
  const double dt = scene.options.max_dt;
  elasticity->add_matrix(share * dt * (0.5 + scene.theta[blocks.stiffness_damping] / dt), system.A);
  for (std::size_t k = 0; k < body.mass.size(); ++k)
    for (int d = 0; d < 3; ++d)
      system.A.block(int(k))[4 * d] += scene.theta[blocks.density] * body.mass[k] / (0.5 * dt);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (double& x : system.b) x = uniform(random);
  if (!scene.options.holds.empty())
    for (const int node : eliminated_nodes(body, scene.options)) {
      system.A.constrain(node);
      system.b.segment<3>(3 * node).setZero();
    }
  return system;
}

void report(const char* name, double set_up, double again, double solve, int iterations, double residual) {
  std::printf("%-10s set-up %.3g s, of the next matrix %.3g s, solve %.3g s, %d iterations, residual %.1e\n", name,
              set_up, again, solve, iterations, residual);
}

double residual(const System& system, const VectorX& x) {
  VectorX product;
  system.A.multiply(x, product);
  return (system.b - product).norm() / system.b.norm();
}

void own(const System& system, SolverKind kind, const char* name) {
  double at = processor_s();
  const auto solver = make_linear_solver(system.A.shared_pattern(), {kind, 1e-8, 5000});
  solver->set_positions(system.positions);
  if (!solver->factorise(system.A)) throw std::runtime_error("not positive definite");
  const double set_up = processor_s() - at;
  at = processor_s();
  if (!solver->factorise(system.A)) throw std::runtime_error("not positive definite");
  const double again = processor_s() - at;
  VectorX x = VectorX::Zero(system.b.size());
  at = processor_s();
  const SolveSummary summary = solver->solve(system.b, x);
  report(name, set_up, again, processor_s() - at, summary.iterations, residual(system, x));
}

void packaged(const System& system, const char* type) {
  const BlockPattern& pattern = system.A.pattern();
  const PetscInt n = 3 * pattern.rows;
  std::vector<PetscInt> start{0}, column;
  std::vector<PetscScalar> value;
  for (int row = 0; row < pattern.rows; ++row)
    for (int d = 0; d < 3; ++d) {
      for (int b = pattern.row_start[row]; b < pattern.row_start[row + 1]; ++b)
        for (int e = 0; e < 3; ++e) {
          column.push_back(3 * pattern.column[b] + e);
          value.push_back(system.A.block(b)[3 * e + d]);
        }
      start.push_back(PetscInt(column.size()));
    }
  Mat A;
  check(MatCreateSeqAIJWithArrays(PETSC_COMM_SELF, n, n, start.data(), column.data(), value.data(), &A));
  check(MatSetBlockSize(A, 3));
  check(MatSetOption(A, MAT_SPD, PETSC_TRUE));
  Vec coordinates, b, x;
  check(VecCreateSeq(PETSC_COMM_SELF, n, &coordinates));
  check(VecSetBlockSize(coordinates, 3));
  check(VecDuplicate(coordinates, &b));
  check(VecDuplicate(coordinates, &x));
  const auto fill = [&](Vec to, const double* from) {
    PetscScalar* values;
    check(VecGetArray(to, &values));
    std::copy_n(from, n, values);
    check(VecRestoreArray(to, &values));
  };
  fill(coordinates, system.positions.data());
  fill(b, system.b.data());
  MatNullSpace rigid;
  check(MatNullSpaceCreateRigidBody(coordinates, &rigid));
  check(MatSetNearNullSpace(A, rigid));
  KSP solver;
  PC preconditioner;
  check(KSPCreate(PETSC_COMM_SELF, &solver));
  check(KSPSetType(solver, KSPCG));
  check(KSPSetNormType(solver, KSP_NORM_UNPRECONDITIONED));
  check(KSPSetTolerances(solver, 1e-8, PETSC_DEFAULT, PETSC_DEFAULT, 5000));
  check(KSPGetPC(solver, &preconditioner));
  check(PCSetType(preconditioner, type));
  check(KSPSetFromOptions(solver));
  check(KSPSetOperators(solver, A, A));
  double at = processor_s();
  check(KSPSetUp(solver));
  const double set_up = processor_s() - at;
  check(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
  check(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  at = processor_s();
  check(KSPSetUp(solver));
  const double again = processor_s() - at;
  at = processor_s();
  check(KSPSolve(solver, b, x));
  const double solve = processor_s() - at;
  PetscInt iterations;
  check(KSPGetIterationNumber(solver, &iterations));
  const PetscScalar* values;
  check(VecGetArrayRead(x, &values));
  report(type, set_up, again, solve, int(iterations), residual(system, Eigen::Map<const VectorX>(values, n)));
}

}  // namespace
}  // namespace pliant

int main(int count, char** arguments) {
  if (count < 4) {
    std::fprintf(stderr, "multigrid_packages CASE NODES STIFFNESS_SHARE [own] [gamg] [hypre] [ml]\n");
    return 1;
  }
  int none = 1;
  PetscInitialize(&none, &arguments, nullptr, nullptr);
  try {
    const pliant::System system = pliant::make_system(arguments[1], std::stoi(arguments[2]), std::stod(arguments[3]));
    for (int i = 4; i < count; ++i) {
      const std::string which = arguments[i];
      if (which != "own") {
        pliant::packaged(system, arguments[i]);
        continue;
      }
      pliant::own(system, pliant::SolverKind::Iterative, "iterative");
      pliant::own(system, pliant::SolverKind::Multigrid, "multigrid");
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "multigrid_packages: %s\n", error.what());
    return 1;
  }
  return 0;
}
