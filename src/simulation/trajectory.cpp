#include "simulation/trajectory.hpp"

#include <cstdio>

#include "elasticity/corotated.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

std::vector<double> six(const Matrix3& m) { return {m(0, 0), m(1, 1), m(2, 2), m(0, 1), m(1, 2), m(0, 2)}; }

}  // namespace

VtuCell vtu_cell(ElementKind kind) {
  switch (kind) {
    case ElementKind::Tetrahedron:
      return VtuCell::Tetrahedron;
    case ElementKind::QuadraticTetrahedron:
      return VtuCell::QuadraticTetrahedron;
    case ElementKind::Hexahedron:
      break;
  }
  return VtuCell::Hexahedron;
}

VtuGrid frame_grid(const Body& body, const State& state, const BodyFields& fields) {
  VtuGrid grid;
  grid.kind = vtu_cell(body.kind);
  grid.points = state.x;
  VtuArray displacement{"displacement [m]", 3, {}}, velocity{"velocity [m/s]", 3, {}}, strain{"strain [1]", 6, {}},
      stress{"stress [Pa]", 6, {}};
  const Points u = state.x - body.reference_positions();
  displacement.values.assign(u.data(), u.data() + u.size());
  velocity.values.assign(state.v.data(), state.v.data() + state.v.size());
  for (int e = 0; e < body.element_count(); ++e) {
    const auto cell = to_vtk_order(grid.kind, body.element(e));
    grid.connectivity.insert(grid.connectivity.end(), cell.begin(), cell.end());
    for (const double v : six(fields.strain[std::size_t(e)])) strain.values.push_back(v);
    for (const double v : six(fields.stress[std::size_t(e)])) stress.values.push_back(v);
  }
  grid.point_data = {std::move(displacement), std::move(velocity)};
  grid.cell_data = {std::move(strain),
                    std::move(stress),
                    {"von_mises [Pa]", 1, fields.von_mises},
                    {"greatest_strain [1]", 1, fields.greatest_strain},
                    {"tangent_modulus [Pa]", 1, fields.tangent_modulus}};
  return grid;
}

RolloutSummary write_trajectory(const fs::path& folder, std::shared_ptr<const Body> body,
                                const SimulationOptions& options, const VectorX& parameters,
                                const std::function<bool(int, int)>& progress,
                                const std::function<void(int, const State&, const BodyFields&)>& on_frame) {
  std::vector<PvdEntry> entries;
  const auto elasticity = scene_elasticity(body, options);
  elasticity->set_parameters(parameters);
  Simulation simulation(body, options);
  const RolloutSummary summary = simulation.run(parameters, [&](int frame, const State& state, auto) {
    char name[32];
    std::snprintf(name, sizeof name, "frames/%06d.vtu", frame);
    const BodyFields fields = body_fields(*body, *elasticity, state.x);
    write_vtu(folder / name, frame_grid(*body, state, fields), VtuPrecision::Single);
    entries.push_back({options.times[std::size_t(frame)] - options.times.front(), name});
    if (on_frame) on_frame(frame, state, fields);
    return !progress || progress(frame + 1, simulation.frame_count());
  });
  write_pvd(folder / "trajectory.pvd", entries);
  return summary;
}

}  // namespace pliant
