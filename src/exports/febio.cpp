#include <fmt/format.h>

#include <ostream>

#include "base/files.hpp"
#include "exports/formats.hpp"
#include "model/vtu.hpp"
#include "simulation/trajectory.hpp"

namespace pliant {

namespace {

constexpr int most_febio_materials = 64;
constexpr int steps_a_period = 100;

/// `sag`: at rest under gravity that grows to its whole. Else the motion from the stress-free shape under gravity.
enum class FebioTask { Sag, Motion };

/// FEBio's neo-Hookean energy has ln J where pliant's has J - 1; both are the same for small strains. Stiffness damping
/// beta is a Newtonian viscous solid beside it, of the bulk viscosity beta K and the shear viscosity beta G: for small
/// strains beta times the elastic stress of the strain's rate.
void write_material(const ExportModel& model, const ModulusGroups& groups, std::size_t g, FebioTask task,
                    std::ostream& out) {
  const double E = groups.moduli[g], nu = model.poissons_ratio, beta = model.stiffness_damping;
  const std::string elastic = fmt::format("<E>{:.9g}</E><v>{:.9g}</v>", E, nu);
  if (task == FebioTask::Sag || beta == 0.0) {
    out << fmt::format(
        "    <material id=\"{0}\" name=\"material{0}\" type=\"neo-Hookean\"><density>{1:.9g}</density>{2}</material>\n",
        g + 1, model.density, elastic);
    return;
  }
  out << fmt::format(
      "    <material id=\"{0}\" name=\"material{0}\" type=\"solid mixture\"><density>{1:.9g}</density>"
      "<solid type=\"neo-Hookean\"><density>{1:.9g}</density>{2}</solid>"
      "<solid type=\"Newtonian viscous solid\"><kappa>{3:.9g}</kappa><mu>{4:.9g}</mu></solid></material>\n",
      g + 1, model.density, elastic, beta * E / (3.0 * (1.0 - 2.0 * nu)), beta * E / (2.0 * (1.0 + nu)));
}

void write_febio_mesh(const ExportModel& model, const ModulusGroups& groups, std::ostream& out) {
  const Body& body = *model.body;
  out << "  <Mesh>\n    <Nodes name=\"object\">\n";
  for (int n = 0; n < body.node_count(); ++n)
    out << fmt::format("      <node id=\"{}\">{:.9g},{:.9g},{:.9g}</node>\n", n + 1, body.nodes(n, 0), body.nodes(n, 1),
                       body.nodes(n, 2));
  out << "    </Nodes>\n";
  for (std::size_t g = 0; g < groups.moduli.size(); ++g) {
    out << fmt::format("    <Elements type=\"{}\" name=\"part{}\">\n", model.is_quadratic() ? "tet10" : "tet4", g + 1);
    for (int e = 0; e < body.element_count(); ++e) {
      if (groups.group[std::size_t(e)] != int(g)) continue;
      out << fmt::format("      <elem id=\"{}\">", e + 1);
      const char* comma = "";
      for (const int node : to_vtk_order(vtu_cell(body.kind), body.element(e))) out << comma << node + 1, comma = ",";
      out << "</elem>\n";
    }
    out << "    </Elements>\n";
  }
  if (!model.held.empty()) {
    out << "    <NodeSet name=\"held\">";
    const char* comma = "";
    for (const int node : model.held) out << comma << node + 1, comma = ",";
    out << "</NodeSet>\n";
  }
  out << "  </Mesh>\n  <MeshDomains>\n";
  for (std::size_t g = 0; g < groups.moduli.size(); ++g)
    out << fmt::format("    <SolidDomain name=\"part{0}\" mat=\"material{0}\"/>\n", g + 1);
  out << "  </MeshDomains>\n";
}

void write_control(const ExportModel& model, FebioTask task, std::ostream& out) {
  const bool is_static = task == FebioTask::Sag;
  const double step = is_static ? 0.1 : 1.0 / (steps_a_period * model.exported.frequencies.front());
  const int steps = is_static ? 10 : 2 * steps_a_period;
  out << fmt::format(
      "  <Control>\n    <analysis>{}</analysis>\n    <time_steps>{}</time_steps>\n    <step_size>{:.6g}</step_size>\n"
      "    <time_stepper type=\"default\"><max_retries>10</max_retries><dtmin>{:.6g}</dtmin><dtmax>{:.6g}</dtmax>"
      "</time_stepper>\n    <solver type=\"solid\"/>\n  </Control>\n",
      is_static ? "STATIC" : "DYNAMIC", steps, step, 1e-3 * step, step);
}

void write_loads(const ExportModel& model, FebioTask task, std::ostream& out) {
  const bool is_static = task == FebioTask::Sag;
  out << "  <Loads>\n    <!-- FEBio pushes against what is written here: minus the acceleration of gravity -->\n"
         "    <body_load type=\"const\">";
  for (int d = 0; d < 3; ++d) out << fmt::format("<{0} lc=\"1\">{1:.9g}</{0}>", "xyz"[d], 0.0 - model.gravity[d]);
  out << "</body_load>\n";
  if (!is_static && model.mass_damping > 0.0)
    out << fmt::format("    <body_load type=\"mass damping\"><C>{:.9g}</C></body_load>\n", model.mass_damping);
  out << fmt::format(
      "  </Loads>\n  <LoadData>\n    <load_controller id=\"1\" type=\"loadcurve\"><interpolate>LINEAR</interpolate>"
      "<extend>CONSTANT</extend><points><pt>0,{}</pt><pt>1,1</pt></points></load_controller>\n  </LoadData>\n",
      is_static ? 0 : 1);
}

void write_feb(const ExportModel& model, FebioTask task, std::ostream& out) {
  const ModulusGroups groups = grouped_moduli(model.moduli, most_febio_materials);
  out << "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<febio_spec version=\"4.0\">\n"
         "  <!-- Metres, kilograms, seconds -->\n  <Module type=\"solid\"/>\n";
  write_control(model, task, out);
  out << "  <Material>\n";
  for (std::size_t g = 0; g < groups.moduli.size(); ++g) write_material(model, groups, g, task, out);
  out << "  </Material>\n";
  write_febio_mesh(model, groups, out);
  if (!model.held.empty())
    out << "  <Boundary>\n    <bc type=\"zero displacement\" node_set=\"held\"><x_dof>1</x_dof><y_dof>1</y_dof>"
           "<z_dof>1</z_dof></bc>\n  </Boundary>\n";
  write_loads(model, task, out);
  out << fmt::format(
      "  <Output>\n    <plotfile type=\"febio\"><var type=\"displacement\"/><var type=\"stress\"/></plotfile>\n"
      "    <logfile><node_data data=\"ux;uy;uz\" delim=\",\" file=\"{}.csv\"/></logfile>\n  </Output>\n"
      "</febio_spec>\n",
      task == FebioTask::Sag ? "sag" : "motion");
}

}  // namespace

std::vector<std::string> write_febio(const ExportModel& model, const std::filesystem::path& folder) {
  write_file(folder / "motion.feb", [&](std::ostream& out) { write_feb(model, FebioTask::Motion, out); });
  if (model.held.empty()) return {"motion.feb"};  // nothing is at rest that nothing holds
  write_file(folder / "sag.feb", [&](std::ostream& out) { write_feb(model, FebioTask::Sag, out); });
  return {"motion.feb", "sag.feb"};
}

}  // namespace pliant
