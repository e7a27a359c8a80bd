// The cost of a recording and its derivative over Young's modulus, as CSV on stdout.
//   pliant_sweep CAPTURE CELLS FROM TO COUNT [NAME=VALUE]...
// FROM and TO [Pa] are spaced evenly by logarithm; NAME=VALUE sets another parameter of result.json, a scalar. Columns:
// E [Pa], cost, its derivative by E [1/Pa] by the adjoint and by tangents, and rms distance [m].

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>

#include "base/error.hpp"
#include "estimation/problem.hpp"
#include "geometry/triangle_mesh.hpp"

namespace pliant {
namespace {

void set_scalar(ParameterSet& parameters, const std::string& assignment) {
  const auto equals = assignment.find('=');
  const Parameter* p = parameters.find(assignment.substr(0, equals));
  if (equals == std::string::npos || !p || p->dimension() != 1)
    throw std::invalid_argument("\"" + assignment + "\" is not the value of a scalar parameter");
  VectorX theta = parameters.reference();
  theta[p->at] = std::atof(assignment.c_str() + equals + 1);
  parameters.set_reference(theta);
}

CaptureParameters only_youngs_modulus(const Capture& capture, int argc, char** argv) {
  CaptureParameters parameters = default_parameters(capture, enclosed_volume(*capture.scene.object.surface));
  for (int i = 6; i < argc; ++i) set_scalar(parameters.set, argv[i]);
  const std::vector<Parameter> all = parameters.set.parameters();
  for (const Parameter& p : all) parameters.set.set_estimated(p.name, is_modulus(p));
  return parameters;
}

int run(int argc, char** argv) {
  if (argc < 6) {
    std::fprintf(stderr, "usage: pliant_sweep CAPTURE CELLS FROM TO COUNT [NAME=VALUE]...\n");
    return 2;
  }
  const double from = std::atof(argv[3]), to = std::atof(argv[4]);
  const int count = std::atoi(argv[5]);
  const Capture capture = read_capture(argv[1]);
  const auto observations =
      std::make_shared<std::vector<FrameObservations>>(frame_observations(capture, observe(capture)));
  const auto [parameters, blocks] = only_youngs_modulus(capture, argc, argv);
  Resolution resolution;
  resolution.cells = std::atof(argv[2]);
  const Discretisation scene =
      discretise(capture, capture_distance(capture, resolution.band), resolution, blocks, parameters.reference());
  ObjectiveOptions options;
  options.outlier_scale = 0.12 * object_size(capture.scene);
  options.last_frame = int(scene.simulation.times.size()) - 1;
  Objective objective(scene.mismatch, scene.body, scene.simulation, observations, parameters, options);
  std::printf("youngs_modulus,cost,gradient_adjoint,gradient_tangent,surface_rms\n");
  for (int i = 0; i < count; ++i) {
    const double modulus = from * std::pow(to / from, count > 1 ? double(i) / (count - 1) : 0.0);
    VectorX theta = parameters.reference();
    blocks.motion.set_moduli(theta, modulus);
    const VectorX p = parameters.to_unconstrained(theta);
    const CostEvaluation adjoint = objective.gradient(p), tangent = objective.linearise(p);
    if (!adjoint.succeeded || !tangent.succeeded) {
      std::fprintf(stderr, "%g Pa: %s\n", modulus, (adjoint.succeeded ? tangent : adjoint).failure.c_str());
      continue;
    }
    std::printf("%.8g,%.10g,%.10g,%.10g,%.6g\n", modulus, adjoint.cost, adjoint.gradient[0] / modulus,
                tangent.gradient[0] / modulus, tangent.surface_rms());
    std::fflush(stdout);
  }
  return 0;
}

}  // namespace
}  // namespace pliant

int main(int argc, char** argv) try { return pliant::run(argc, argv); } catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 2;
}
