#include <cstdio>
#include <memory>

#include "motion/simulation.hpp"

using namespace pliant;

int main() {  // a soft ball dropped on the floor: how high its middle is, frame by frame
  const Vector3 centre(0.0, 0.10, 0.0), radius(0.05, 0.05, 0.05), margin(0.02, 0.02, 0.02);  // [m]
  const Box box{centre - radius, centre + radius};
  const SignedDistance distance({box.min - margin, box.max + margin}, 0.002,
                                [&](const Vector3& p) { return (p - centre).norm() - radius.x(); });
  const auto body = std::make_shared<Body>(make_body(make_hex_grid(distance, box, 0.0125)));

  SimulationOptions options;
  ParameterLayout layout;  // of all parameters of a scene with one plane
  const MotionBlocks& at = options.blocks = add_motion_blocks(layout, {.planes = 1});
  VectorX parameters = VectorX::Zero(layout.size());
  at.set_moduli(parameters, 5000.0);  // [Pa]
  parameters[at.poissons_ratio] = 0.3;
  parameters[at.stiffness_damping] = 0.002;              // [s]
  parameters[at.density] = 100.0;                        // [kg/m^3]
  parameters.segment<3>(at.gravity) << 0.0, -9.81, 0.0;  // [m/s^2]
  parameters.segment<3>(at.planes[0].normal) << 0.0, 1.0, 0.0;

  for (int frame = 0; frame <= 30; ++frame) options.times.push_back(frame / 60.0);  // [s]
  options.max_dt = default_time_step(*body, 9.81);
  options.contact = default_contact(*body, parameters[at.density] * body->volume(), 9.81);
  Simulation(body, options).run(parameters, [&](int frame, const State& state, auto) {
    std::printf("%.3f s  %.4f m\n", options.times[std::size_t(frame)], state.x.col(1).mean());
    return true;
  });
}
