#include <fmt/format.h>

#include <array>
#include <ostream>
#include <string_view>

#include "base/files.hpp"
#include "exports/formats.hpp"

namespace pliant {

namespace {

constexpr int sofa_steps_a_period = 100;

/// Modules of SOFA 23.06 and later that a scene's components stand in.
constexpr std::array<std::string_view, 8> plugins = {
    "Sofa.Component.AnimationLoop",       "Sofa.Component.Constraint.Projective",
    "Sofa.Component.LinearSolver.Direct", "Sofa.Component.Mass",
    "Sofa.Component.ODESolver.Backward",  "Sofa.Component.SolidMechanics.FEM.Elastic",
    "Sofa.Component.StateContainer",      "Sofa.Component.Topology.Container.Dynamic",
};

void write_scn(const ExportModel& model, std::ostream& out) {
  const Body& body = *model.body;
  std::string positions, tetrahedra, moduli, held;
  const auto add = [](std::string& text, const std::string& word) { text += (text.empty() ? "" : " ") + word; };
  for (int n = 0; n < body.node_count(); ++n)
    add(positions, fmt::format("{:.9g} {:.9g} {:.9g}", body.nodes(n, 0), body.nodes(n, 1), body.nodes(n, 2)));
  for (int e = 0; e < body.element_count(); ++e)
    for (const int node : body.element(e)) add(tetrahedra, std::to_string(node));
  for (const double modulus : model.moduli) add(moduli, fmt::format("{:.9g}", modulus));
  for (const int node : model.held) add(held, std::to_string(node));
  const Vector3& g = model.gravity;
  out << fmt::format(
      "<?xml version=\"1.0\"?>\n<!-- Metres, kilograms, seconds. The trapezoidal rule is stable at any step; this one "
      "is a hundredth of the first period. -->\n<Node name=\"root\" dt=\"{:.6g}\" gravity=\"{:.9g} {:.9g} {:.9g}\">\n",
      1.0 / (sofa_steps_a_period * model.exported.frequencies.front()), g.x(), g.y(), g.z());
  for (const std::string_view plugin : plugins) out << fmt::format("  <RequiredPlugin name=\"{}\"/>\n", plugin);
  out << fmt::format(
      "  <DefaultAnimationLoop/>\n  <Node name=\"object\">\n"
      "    <EulerImplicitSolver trapezoidalScheme=\"true\" rayleighMass=\"{:.9g}\" rayleighStiffness=\"{:.9g}\"/>\n"
      "    <SparseLDLSolver template=\"CompressedRowSparseMatrixMat3x3\"/>\n"
      "    <TetrahedronSetTopologyContainer name=\"topology\" position=\"{}\" tetrahedra=\"{}\"/>\n"
      "    <TetrahedronSetGeometryAlgorithms template=\"Vec3\"/>\n"
      "    <MechanicalObject name=\"nodes\" template=\"Vec3\" src=\"@topology\"/>\n"
      "    <MeshMatrixMass massDensity=\"{:.9g}\" topology=\"@topology\"/>\n"
      "    <TetrahedronFEMForceField method=\"large\" topology=\"@topology\" poissonRatio=\"{:.9g}\" "
      "youngModulus=\"{}\"/>\n",
      model.mass_damping, model.stiffness_damping, positions, tetrahedra, model.density, model.poissons_ratio, moduli);
  if (!model.held.empty()) out << fmt::format("    <FixedProjectiveConstraint indices=\"{}\"/>\n", held);
  out << "  </Node>\n</Node>\n";
}

}  // namespace

std::vector<std::string> write_sofa(const ExportModel& model, const std::filesystem::path& folder) {
  write_file(folder / "model.scn", [&](std::ostream& out) { write_scn(model, out); });
  return {"model.scn"};
}

}  // namespace pliant
