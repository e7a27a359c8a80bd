#include <fmt/format.h>

#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <string>

#include "base/error.hpp"
#include "base/files.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "exports/formats.hpp"
#include "model/samples.hpp"

namespace pliant::apps {

namespace {

namespace fs = std::filesystem;

struct Arguments {
  std::string model, to, out;
  bool linear = false;
  int samples = 0, cells = 0;

  std::optional<double> mesh_cells() const { return cells > 0 ? std::optional<double>(cells) : std::nullopt; }
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
void write_moving(const Model& model, const ExportFormat& format, const std::string& folder) {
  make_folder(folder);
  const std::vector<std::string> files = format.write_surface(model, folder, [](int done, int total) {
    show_progress("simulated", done, total);
    return !is_interrupted();
  });
  stop_if_interrupted();
  say_files(files, folder);
}

ElementKind elements_for(const Arguments& arguments, const ExportFormat& format) {
  return format.takes_quadratic && !arguments.linear ? ElementKind::QuadraticTetrahedron : ElementKind::Tetrahedron;
}

/// Materials drawn from what the fit left open, each in a folder of its own.
void run_samples(const Arguments& arguments, const ExportFormat& format, const Model& model) {
  const fs::path file = fs::path(arguments.model).parent_path() / "result.json";
  const std::vector<DrawnMaterial> samples = posterior_samples(read_result(file), arguments.samples, 1, file);
  make_folder(arguments.out);
  std::string table = "sample";
  for (const std::string& column : material_columns) table += "," + column;
  table += "\n";
  for (std::size_t i = 0; i < samples.size(); ++i) {
    table += std::to_string(i + 1);
    for (const double number : numbers_of(samples[i])) table += fmt::format(",{:.9g}", number);
    table += "\n";
  }
  write_file(fs::path(arguments.out) / "samples.csv", table);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const std::string folder = (fs::path(arguments.out) / fmt::format("sample_{:04}", i + 1)).string();
    const Model drawn = with_material(model, samples[i]);
    if (format.write_surface) {
      write_moving(drawn, format, folder);
    } else {
      make_folder(folder);
      (void)write_export(export_model(drawn, elements_for(arguments, format), arguments.mesh_cells()), format, folder,
                         file);
      show_progress("written", int(i) + 1, int(samples.size()));
    }
    stop_if_interrupted();
  }
  std::cout << fmt::format("{} materials in {}: sample_0001 ..., and samples.csv\n", samples.size(), arguments.out);
}

/// The result of the fit that wrote a model.
std::optional<fs::path> result_beside(const fs::path& model) {
  const fs::path file = model.parent_path() / "result.json";
  return is_file(file) ? std::optional(file) : std::nullopt;
}

void run(const Arguments& arguments) {
  const ExportFormat& format = export_format(arguments.to);
  if (format.write_surface && (arguments.cells > 0 || arguments.linear))
    throw InputError({{},
                      "`--cells` and `--linear` with the format `" + format.name + "`, which has no elements",
                      "a format of elements",
                      "leave them out: the surface is that of the recording"});
  const Model model = load_model(arguments.model);
  if (arguments.samples > 0) return run_samples(arguments, format, model);
  if (format.write_surface) return write_moving(model, format, arguments.out);
  const ElementKind kind = elements_for(arguments, format);
  const bool is_quadratic = kind == ElementKind::QuadraticTetrahedron;
  const ExportModel exported = export_model(model, kind, arguments.mesh_cells());
  make_folder(arguments.out);
  const std::vector<std::string> files = write_export(exported, format, arguments.out, result_beside(arguments.model));
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
         "  pliant export fit/model.toml --to newton --samples 100 --out bears     for domain randomisation\n"
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
  command
      .option("--cells", arguments->cells,
              "elements along the longest axis of a mesh laid anew, 2 to 300; found where left out: docs/exports.md")
      .positive()
      .type_name("N");
  command
      .option("--samples", arguments->samples,
              "so many materials drawn from what the fit left open (result.json beside the model), each in a folder of "
              "its own")
      .positive()
      .type_name("N");
  command.footer(footer());
  command.callback([arguments, &exit_code] {
    run(*arguments);
    exit_code = Fine;
  });
}

}  // namespace pliant::apps
