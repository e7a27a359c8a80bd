#include <fmt/format.h>

#include <iostream>
#include <memory>
#include <string>

#include "base/error.hpp"
#include "base/files.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "exports/formats.hpp"

namespace pliant::apps {

namespace {

struct Arguments {
  std::string model, to, out;
  bool linear = false;
};

std::string in_hertz(const std::vector<double>& frequencies) {
  std::string text;
  for (const double f : frequencies) text += (text.empty() ? "" : ", ") + fmt::format("{:.4g}", f);
  return text + " Hz";
}

void say_files(const std::vector<std::string>& files, const std::string& folder) {
  std::cout << "written:";
  for (const std::string& file : files) std::cout << " " << file;
  std::cout << " in " << folder << "\n";
}

/// The surface as the model moves.
void run_surface(const Arguments& arguments, const ExportFormat& format) {
  const Model model = load_model(arguments.model);
  make_folder(arguments.out);
  const std::vector<std::string> files = format.write_surface(model, arguments.out, [](int done, int total) {
    show_progress("simulated", done, total);
    return !is_interrupted();
  });
  stop_if_interrupted();
  say_files(files, arguments.out);
}

void run(const Arguments& arguments) {
  const ExportFormat& format = export_format(arguments.to);
  if (format.write_surface) return run_surface(arguments, format);
  const bool is_quadratic = format.takes_quadratic && !arguments.linear;
  const Model model = load_model(arguments.model);
  const ExportModel exported =
      export_model(model, is_quadratic ? ElementKind::QuadraticTetrahedron : ElementKind::Tetrahedron);
  make_folder(arguments.out);
  const std::vector<std::string> files = write_export(exported, format, arguments.out);
  std::cout << fmt::format("{} {} tetrahedra, {} nodes, {} of them held\n", exported.body->element_count(),
                           is_quadratic ? "quadratic" : "linear", exported.body->node_count(), exported.held.size());
  if (exported.identified != 1.0)
    std::cout << fmt::format(
        "moduli are {:.4g} times the model's: with these elements its first frequency is the same\n",
        exported.identified);
  std::cout << "frequencies of the model: " << in_hertz(exported.model.frequencies) << "\n"
            << "of what was written:      " << in_hertz(exported.exported.frequencies) << "\n";
  if (exported.exported.sag > 0.0)
    std::cout << fmt::format("sag of small motions: {:.4g} mm, of the model {:.4g} mm\n", 1e3 * exported.exported.sag,
                             1e3 * exported.model.sag);
  for (const std::string& note : exported.notes) std::cout << "note: " << note << "\n";
  say_files(files, arguments.out);
}

std::string footer() {
  std::string text = "Formats:\n";
  for (const ExportFormat& f : export_formats())
    text += fmt::format("  {:<10} {}{}\n", f.name, f.program,
                        f.write_surface     ? ": the surface as it moves"
                        : f.takes_quadratic ? ""
                                            : "; linear tetrahedra");
  return text +
         "\nExamples:\n  pliant export fit/model.toml --to mujoco --out bear\n"
         "  pliant export fit/model.toml --to calculix --out bear && cd bear && ccx frequencies\n"
         "What goes over in each format, and what does not: docs/exports.md.";
}

}  // namespace

void add_export(CommandLine& line, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  Command command = line.add_command("export", "Write a fitted model for another simulator");
  command.option("model", arguments->model, "model.toml of a fit").required().type_name("MODEL");
  command.option("--to", arguments->to, "format, see below").required().type_name("FORMAT");
  command.option("--out,-o", arguments->out, "folder for the files").required().type_name("DIR");
  command.flag("--linear", arguments->linear, "linear tetrahedra also where the format takes quadratic ones");
  command.footer(footer());
  command.callback([arguments, &exit_code] {
    run(*arguments);
    exit_code = Fine;
  });
}

}  // namespace pliant::apps
