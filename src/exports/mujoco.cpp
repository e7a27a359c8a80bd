#include <fmt/format.h>

#include <ostream>

#include "base/files.hpp"
#include "exports/formats.hpp"

namespace pliant {

namespace {

constexpr int most_flexes = 32;

/// XML takes no angle brackets, quotes and ampersands.
std::string plain(const std::string& text) {
  std::string out;
  for (const char c : text) out += c == '<' || c == '>' || c == '"' || c == '&' ? ' ' : c;
  return out;
}

/// One group of elements of a modulus: a flex over its own vertices, which are bodies that all flexes share.
void write_flex(const ExportModel& model, const ModulusGroups& groups, int group, const std::vector<bool>& is_held,
                std::ostream& out) {
  const Body& body = *model.body;
  std::vector<int> own(std::size_t(body.node_count()), -1), nodes;
  std::string elements;
  for (int e = 0; e < body.element_count(); ++e) {
    if (groups.group[std::size_t(e)] != group) continue;
    for (const int node : body.element(e)) {
      int& number = own[std::size_t(node)];
      if (number < 0) number = int(nodes.size()), nodes.push_back(node);
      elements += fmt::format("{}{}", elements.empty() ? "" : " ", number);
    }
  }
  std::string bodies, vertices;
  for (const int node : nodes) {
    const bool held = is_held[std::size_t(node)];
    bodies += (bodies.empty() ? "" : " ") + (held ? std::string("world") : fmt::format("v{}", node));
    vertices += vertices.empty() ? "" : " ";
    vertices += held
                    ? fmt::format("{:.9g} {:.9g} {:.9g}", body.nodes(node, 0), body.nodes(node, 1), body.nodes(node, 2))
                    : std::string("0 0 0");
  }
  out << fmt::format(
      "    <flex name=\"part{}\" dim=\"3\" radius=\"0\" body=\"{}\" vertex=\"{}\" element=\"{}\">\n"
      "      <contact selfcollide=\"none\" contype=\"0\" conaffinity=\"0\"/>\n"
      "      <elasticity young=\"{:.9g}\" poisson=\"{:.9g}\" damping=\"{:.9g}\"/>\n    </flex>\n",
      group + 1, bodies, vertices, elements, groups.moduli[std::size_t(group)], model.poissons_ratio,
      model.stiffness_damping);
}

void write_scene(const ExportModel& model, std::ostream& out) {
  const Body& body = *model.body;
  std::vector<bool> is_held(std::size_t(body.node_count()), false);
  for (const int node : model.held) is_held[std::size_t(node)] = true;
  const std::vector<double> masses = model.lumped_masses();
  out << fmt::format(
      "<mujoco model=\"{}\">\n"
      "  <!-- Metres, kilograms, seconds. A body a vertex, with its own mass; mass damping has no counterpart. The "
      "integrator takes the flexes' forces implicitly (MuJoCo 4); explicit ones need steps below {:.2g} s, and shorter "
      "ones where there is damping. -->\n"
      "  <option timestep=\"0.002\" gravity=\"{:.9g} {:.9g} {:.9g}\" integrator=\"discrete\" iterations=\"1000\"/>\n"
      "  <size memory=\"1G\"/>\n  <worldbody>\n",
      plain(model.name), 2.0 / model.stiffest, model.gravity.x(), model.gravity.y(), model.gravity.z());
  for (int n = 0; n < body.node_count(); ++n) {
    if (is_held[std::size_t(n)]) continue;
    const double mass = masses[std::size_t(n)];
    const auto joint = [](const char* axis) { return fmt::format("<joint type=\"slide\" axis=\"{}\"/>", axis); };
    out << fmt::format(
        "    <body name=\"v{}\" pos=\"{:.9g} {:.9g} {:.9g}\"><inertial pos=\"0 0 0\" mass=\"{:.9g}\" "
        "diaginertia=\"{:.3g} {:.3g} {:.3g}\"/>{}{}{}</body>\n",
        n, body.nodes(n, 0), body.nodes(n, 1), body.nodes(n, 2), mass, 1e-6 * mass, 1e-6 * mass, 1e-6 * mass,
        joint("1 0 0"), joint("0 1 0"), joint("0 0 1"));
  }
  out << "  </worldbody>\n  <deformable>\n";
  const ModulusGroups groups = grouped_moduli(model.moduli, most_flexes);
  for (int g = 0; g < int(groups.moduli.size()); ++g) write_flex(model, groups, g, is_held, out);
  out << "  </deformable>\n</mujoco>\n";
}

}  // namespace

std::vector<std::string> write_mujoco(const ExportModel& model, const std::filesystem::path& folder) {
  write_file(folder / "model.xml", [&](std::ostream& out) { write_scene(model, out); });
  return {"model.xml"};
}

}  // namespace pliant
