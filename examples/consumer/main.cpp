#include <cstdio>

#include "geometry/primitives.hpp"
#include "simulation/model_simulation.hpp"

using namespace pliant;

int main() {  // a soft ball dropped on a floor 0.1 m below: how high its middle is, frame by frame
  Model ball;
  ball.scene.object.surface = make_sphere(0.05, 3);  // [m]
  ball.scene.object.density = 100.0;                 // [kg/m^3]
  ball.scene.planes = {{.point = {0.0, -0.1, 0.0}}};
  ball.scene.timing = evenly_timed(60.0, 31);  // [Hz], frames
  ball.material.elastic = ElasticLaw::NeoHookean;
  ball.youngs_modulus = 5000.0, ball.poissons_ratio = 0.3, ball.stiffness_damping = 0.002;  // [Pa], [-], [s]
  ball.cell_size = 0.0125, ball.substeps = 6;                                               // [m], a frame
  simulate(ball, [](double time, const State& state) {
    std::printf("%.3f s  %.4f m\n", time, state.x.col(1).mean());
    return true;
  });
}
