// Pages for browser_test.py, and where the program itself has the nodes that they are compared with.
//   pliant_browser_pages FOLDER             for browser_test.py
//   pliant_browser_pages FOLDER --sizes     for browser_frames.py: torus.html, 1,144 nodes; block.html, 1,764
//   tetrahedra
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <string>

#include "base/files.hpp"
#include "live/live_motion.hpp"
#include "live/live_page.hpp"
#include "support/models.hpp"

namespace {

using namespace pliant;

int write_sizes(const std::filesystem::path& folder) {
  Model torus = test::block(false);
  torus.name = "torus";
  torus.scene.object.surface = make_torus(0.1, 0.04, 96, 48);
  for (Vector3& vertex : torus.scene.object.surface->vertices) vertex.y() += 0.1;
  torus.cell_size = 0.0178;
  torus.youngs_modulus = 8000.0, torus.scene.object.density = 100.0;
  torus.scene.object.mass = 100.0 * enclosed_volume(*torus.scene.object.surface);
  write_file(folder / "torus.html", live_page(torus));
  write_file(folder / "block.html", live_page(test::pressed_block({14, 7, 3})));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const std::filesystem::path folder = argc > 1 ? argv[1] : "";
  if (argc == 3 && std::string(argv[2]) == "--sizes") return write_sizes(folder);
  if (argc != 2) return std::cerr << "pliant_browser_pages FOLDER [--sizes]\n", 2;
  Model model = test::block(false);
  model.scene.initial.linear_velocity = Vector3(0.4, 0.5, 0.1);
  model.scene.initial.angular_velocity = Vector3(3.0, 0.0, 6.0);
  const LiveRecording recording{{0.0, 0.1, 0.2}, {}, {{Vector3(0, 0, 0)}, {Vector3(0.05, 0, 0)}, {}}};
  const LiveData data = live_data(model);
  LiveData with_samples = data;
  with_samples.samples.assign(2, LiveSample{data.theta, {}});
  live_blocks(data.planes).scale_moduli(with_samples.samples[0].theta, 0.2);
  const std::string page = live_page(model, with_samples, recording);
  write_file(folder / "free.html", page);
  LiveMotion object(data);
  object.start_as_recorded();
  for (int step = 0; step < 100; ++step)
    if (!object.step()) return std::cerr << "a step cannot be taken\n", 1;
  std::string numbers = "[";
  for (int i = 0; i < 30; ++i) {
    char number[40];
    std::snprintf(number, sizeof number, "%s%.17g", i ? "," : "", object.state().x.data()[i]);
    numbers += number;
  }
  write_file(folder / "free.json", numbers + "]\n");
  write_file(folder / "held.html", live_page(test::block(true)));
  LiveRecording presses;
  presses.presses = {{{0.06, 0.025, 0.0}, 0.015, {0.0, -1.0, 0.0}}, {{0.06, 0.025, 0.0}, 0.015, {0.0, -2.0, 0.0}}};
  presses.points = {{Vector3(0.06, 0.02, 0.0)}, {Vector3(0.06, 0.015, 0.0)}};
  presses.greatest_strain = 1e-3;
  const Model pressed = test::pressed_block();
  LiveData with_laws = live_data(pressed);
  for (const double factor : {0.5, 2.0}) {
    Model other = pressed;
    for (std::vector<double>& row : other.law->rows) row[1] *= factor;
    const LiveData sample_data = live_data(other);
    with_laws.samples.push_back({sample_data.theta, sample_data.material.law()});
  }
  write_file(folder / "pressed.html", live_page(pressed, with_laws, presses));
  Model one = test::block(false);
  one.cell_size = 0.5;
  write_file(folder / "one.html", live_page(one));
  std::string broken = page;
  const std::string head = "<script id=\"data\" type=\"text/plain\">";
  broken.erase(broken.find(head) + head.size() + 400, 2000);
  write_file(folder / "broken.html", broken);
}
