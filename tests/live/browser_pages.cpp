// Pages for browser_test.py, and where the program itself has the nodes that they are compared with.
//   pliant_browser_pages FOLDER
#include <cstdio>
#include <filesystem>
#include <iostream>

#include "base/files.hpp"
#include "live/live_object.hpp"
#include "live/live_page.hpp"
#include "support/models.hpp"

int main(int argc, char** argv) {
  using namespace pliant;
  if (argc != 2) return std::cerr << "pliant_browser_pages FOLDER\n", 2;
  const std::filesystem::path folder = argv[1];
  Model model = test::block(false);
  model.scene.initial.linear_velocity = Vector3(0.4, 0.5, 0.1);
  model.scene.initial.angular_velocity = Vector3(3.0, 0.0, 6.0);
  const LiveRecording recording{{0.0, 0.1, 0.2}, {{Vector3(0, 0, 0)}, {Vector3(0.05, 0, 0)}, {}}};
  const std::string page = live_page(model, recording);
  write_file(folder / "free.html", page);
  LiveObject object(live_data(model));
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
  Model one = test::block(false);
  one.cell_size = 0.5;
  write_file(folder / "one.html", live_page(one));
  std::string broken = page;
  const std::string data = "<script id=\"data\" type=\"text/plain\">";
  broken.erase(broken.find(data) + data.size() + 400, 2000);
  write_file(folder / "broken.html", broken);
}
