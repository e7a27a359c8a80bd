// How well and how fast markers are measured from photographs of a painted dome at full size: docs/markers.md.
// pliant_photos [WIDTH [DOTS [SEED]]] prints a row for the rest and for each press.

#include <cstdio>
#include <cstdlib>
#include <exception>

#include "photos/follow.hpp"
#include "support/marker_truth.hpp"

int main(int argc, char** argv) try {
  using namespace pliant;
  PhotoExampleOptions options;
  if (argc > 1) options.width = std::atoi(argv[1]);
  options.height = options.width * 2 / 3;
  if (argc > 2) options.dots = std::atoi(argv[2]);
  if (argc > 3) options.seed = std::uint64_t(std::atoi(argv[3]));
  const PhotoExample example(options);
  // Photographs are made before the clock runs.
  std::vector<std::vector<Image<Rgb>>> photographs(3);
  const int count = int(example.session().presses.size()) + 1;
  for (int camera = 0; camera < 3; ++camera)
    for (int number = 0; number < count; ++number)
      photographs[std::size_t(camera)].push_back(example.photograph(camera, number));
  const MarkerMeasurement measured = measure_markers(
      example.session(), [&](int camera, int number) { return photographs[std::size_t(camera)][std::size_t(number)]; });
  const Points dots = dot_centres(example.scene(0));
  const double spacing = spacing_of(measured.rest.positions);
  std::printf("%d x %d pixels, %d dots, seed %d, %.1f mm apart\n", options.width, options.height, options.dots,
              int(options.seed), 1e3 * spacing);
  std::printf(
      "| photographs | moved [spacings] | seen | wrong | unclear | mean error [px] | greatest [px] | chi^2 | "
      "deviation [mm] | middles moved by [px] | tip off [mm] | seconds |\n");
  for (int number = 0; number < count; ++number) {
    const test::MarkerErrors e = test::marker_errors(example, measured, number, dots);
    const bool is_rest = number == 0;
    const MeasuredPress* press = is_rest ? nullptr : &measured.presses[std::size_t(number) - 1];
    const PhotoFigures& f = is_rest ? measured.rest_figures : press->figures;
    std::printf("| %d | %.1f | %d | %d | %d | %.3f | %.3f | %.2f | %.4f | %.3f | %.3f | %.2f |%s\n", number,
                is_rest ? 0.0 : test::spacings_moved(example, measured, number, spacing), e.seen, e.wrong, f.ambiguous,
                e.mean, e.greatest, e.chi_squared, 1e3 * f.deviation, f.greatest_bias,
                is_rest ? 0.0 : 1e3 * (press->probe.tip - example.scene(number).probe->pose.tip).norm(), f.seconds,
                is_rest ? "" : press->failure.c_str());
  }
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
