#include <chrono>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "base/error.hpp"
#include "base/files.hpp"
#include "capture/image_io.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "estimation/fit_config.hpp"
#include "estimation/load_free.hpp"
#include "output/fit_output.hpp"
#include "report/picture.hpp"

namespace pliant::apps {

namespace {

namespace fs = std::filesystem;

struct Arguments {
  std::string capture, out;
  std::vector<std::string> settings;
};

FitOptions read_options(const Arguments& arguments) {
  FitOptions options;
  for (const std::string& assignment : arguments.settings) set_fit_option(options, assignment);
  if (const std::string wrong = options.validate(); !wrong.empty())
    throw InputError({{}, wrong, "", "see `pliant fit --help`"});
  const auto modulus = options.parameters.find("youngs_modulus");
  if (modulus == options.parameters.end() || !modulus->second.start)
    throw InputError({{arguments.capture},
                      "nothing says how stiff the object is: the softer, the more it sags",
                      "Young's modulus in pascals",
                      "add --set youngs_modulus=2e5"});
  return options;
}

Box box_of(const Points& points) {
  Box box;
  for (Eigen::Index n = 0; n < points.rows(); ++n) box.extend(points.row(n).transpose());
  return box;
}

/// The load-free shape and what it sags into, as grey surfaces; the scan as dots, which should lie on the second.
Picture overlay(const Capture& capture, const LoadFree& found) {
  PictureScene scene;
  const Points free = Embedding(*found.scene.body, capture.scene.object.surface->vertices).positions(found.shape.X),
               sagged =
                   Embedding(*found.scene.body, capture.scene.object.surface->vertices).positions(found.sagged_again);
  scene.surface.resize(free.rows() + sagged.rows(), 3);
  scene.surface << free, sagged;
  const int shift = int(free.rows());
  for (const auto& t : capture.scene.object.surface->triangles) {
    scene.triangles.push_back(t);
    scene.triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
  }
  scene.points = capture.scene.object.surface->vertices;
  return draw(scene, view_of(box_of(scene.surface), capture.scene.world.up, 900, 640, 0.6, 0.15));
}

nlohmann::json facts_of(const LoadFree& found, double modulus, double size, double seconds) {
  const Body& body = *found.scene.body;
  nlohmann::json json = {{"format", "rest/1"},
                         {"found", found.shape.found},
                         {"youngs_modulus", {{"value", modulus}, {"unit", "Pa"}}},
                         {"nodes", body.node_count()},
                         {"elements", body.element_count()},
                         {"residual", found.shape.residual},
                         {"iterations", found.shape.iterations},
                         {"least_volume_ratio", found.shape.least_volume_ratio},
                         {"size", size},
                         {"seconds", seconds}};
  if (found.shape.found) {
    json["sag"] = found.sag;
    json["re_sag_error"] = found.re_sag_error;
  } else {
    json["reason"] = found.shape.reason;
    if (found.shape.carried > 0.0) json["least_youngs_modulus"] = modulus / found.shape.carried;
  }
  return json;
}

int run(const Arguments& arguments) {
  const FitOptions options = read_options(arguments);
  if (options.control_points == FitOptions::automatic)
    throw InputError({{}, "control_points is auto", "a number: nothing here tells how many the object needs", ""});
  const Capture capture = at_rest(read_capture(arguments.capture));
  if (!capture.scene.object.surface) throw InputError({{capture.file}, "there is no scan ([object] surface)", "", ""});
  const double size = object_size(capture.scene);
  Resolution resolution;
  resolution.element = options.element.value_or(ElementKind::QuadraticTetrahedron);
  resolution.cells = options.cells;
  resolution.field = {options.controls(), options.control_weights};
  const int controls = control_count(capture.scene, options.controls());
  CaptureParameters parameters = default_parameters(capture, enclosed_volume(*capture.scene.object.surface), controls);
  apply_overrides(parameters.set, options);
  const VectorX theta = parameters.set.reference();
  const auto begin = std::chrono::steady_clock::now();
  const LoadFree found = find_load_free(capture, resolution, parameters.blocks, theta);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const fs::path out = arguments.out;
  const double modulus = theta[parameters.blocks.motion.youngs_moduli.front()];
  const nlohmann::json facts = facts_of(found, modulus, size, seconds);
  make_folder(out);
  write_file(out / "rest.json", facts.dump(2) + "\n");
  std::cout << capture.name << "\n  " << found.scene.body->element_count() << " elements, "
            << found.scene.body->node_count() << " nodes, " << found.shape.iterations << " iterations, " << seconds
            << " s\n";
  if (!found.shape.found) {
    std::cout << "  no stress-free reference shape sags into the scan: " << found.shape.reason << "\n";
    if (found.shape.carried > 0.0)
      std::cout << "  the smallest Young's modulus that can carry it is about " << modulus / found.shape.carried
                << " Pa\n";
    return NotConverged;
  }
  std::cout << "  forces balance to " << found.shape.residual << " of the load; the object sags by " << 1e3 * found.sag
            << " mm (" << 100.0 * found.sag / size << " % of its size)\n  sagging again it comes to within "
            << 1e3 * found.re_sag_error << " mm of the scan\n";
  const ModulusStatistics moduli = modulus_statistics(found.scene.body, parameters.blocks.motion, theta, MatrixX());
  save_model(out, make_model(capture, found.scene, theta, moduli, options.cells));
  write_png(out / "rest.png", overlay(capture, found));
  std::cout << "Look at " << (out / "rest.png").string() << "; the model with its stress-free reference shape is "
            << (out / "model.toml").string() << "\n";
  return Fine;
}

constexpr const char* footer =
    R"(Keys of --set are those of `pliant fit` that a resting object has: youngs_modulus (needed), poissons_ratio, density,
cells, element (quadratic_tetrahedra where left out, or tetrahedra), control_points, youngs_modulus@REGION.

Examples:
  pliant rest recordings/plant --set youngs_modulus=3e6 --out plant-rest

The folder gets the model with its stress-free surface and volume mesh (model.toml, surface.ply, model.vtu), rest.json with the
figures, and rest.png: both shapes in grey, the scan as dots.)";

}  // namespace

void add_rest(CommandLine& line, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  Command command = line.add_command(
      "rest", "Find the stress-free reference shape of an object scanned under gravity (inverse elastostatics)");
  command
      .option("capture", arguments->capture,
              "folder with a capture.toml in it; what holds the object is in its [[fixed]]")
      .required()
      .type_name("CAPTURE");
  command.option("--set", arguments->settings, "one choice; may be given many times")
      .type_name("KEY=VALUE")
      .one_value_a_use();
  command.option("--out,-o", arguments->out, "folder for the result").required().type_name("DIR");
  command.footer(footer);
  command.callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace pliant::apps
