#include <pybind11/eigen.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "arrays.hpp"
#include "base/files.hpp"
#include "bindings.hpp"
#include "exports/formats.hpp"
#include "model/samples.hpp"
#include "interruption.hpp"
#include "pictures/situation_output.hpp"
#include "simulation/model_simulation.hpp"

namespace pliant::python {

namespace {

namespace fs = std::filesystem;

py::dict small_motions(const SmallMotions& motions) {
  py::dict out;
  out["frequencies"] = motions.frequencies;
  out["sag"] = motions.sag;
  return out;
}

py::dict export_to(const Model& model, const std::string& to, const fs::path& out, bool linear,
                   std::optional<double> cells, const std::optional<fs::path>& result) {
  const ExportFormat& format = export_format(to);
  if (format.write_surface && (linear || cells))
    throw py::value_error("linear, cells: the format " + to + " has no elements");
  Interruption interruption;
  py::dict told;
  std::vector<std::string> files;
  if (format.write_surface) {
    {
      const py::gil_scoped_release unlocked;
      make_folder(out);
      files = format.write_surface(model, out, [&](int, int) { return !interruption.asked(); });
    }
    interruption.rethrow();
  } else {
    ExportModel exported;
    {
      const py::gil_scoped_release unlocked;
      exported = export_model(model, format.takes_quadratic && !linear ? ElementKind::QuadraticTetrahedron
                                                                       : ElementKind::Tetrahedron,
                              cells);
      make_folder(out);
      files = write_export(exported, format, out, result);
    }
    told["moduli_factor"] = exported.identified;
    told["model"] = small_motions(exported.model);
    told["exported"] = small_motions(exported.exported);
    told["notes"] = exported.notes;
  }
  told["files"] = files;
  return told;
}

void simulate(const Model& model, const fs::path& out, const std::optional<fs::path>& situation, double duration) {
  Interruption interruption;
  RolloutSummary summary;
  {
    const py::gil_scoped_release unlocked;
    if (situation) {
      Situation read = read_situation(*situation);
      if (duration > 0.0) read.duration = duration;
      SituationFiles files;
      files.folder = out;
      summary = write_situation(model, read, files, [&](const char*, int, int) { return !interruption.asked(); }).summary;
    } else {
      summary = write_simulation(model, out, [&](int, int) { return !interruption.asked(); }).summary;
    }
  }
  interruption.rethrow();
  if (!summary.succeeded)
    throw std::runtime_error("the simulation stopped in frame " + std::to_string(summary.frames) + ": " +
                             summary.failure);
}

py::dict samples(const fs::path& result, int count, unsigned seed) {
  if (count < 1) throw py::value_error("count: expected 1 or more, got " + std::to_string(count));
  const std::vector<DrawnMaterial> drawn = posterior_samples(read_result(result), count, seed);
  const auto column = [&](double DrawnMaterial::*member) {
    std::vector<double> values;
    for (const DrawnMaterial& sample : drawn) values.push_back(sample.*member);
    return array_of(std::move(values), {py::ssize_t(drawn.size())});
  };
  py::dict out;
  out["youngs_modulus"] = column(&DrawnMaterial::youngs_modulus);
  out["poissons_ratio"] = column(&DrawnMaterial::poissons_ratio);
  out["mass_damping"] = column(&DrawnMaterial::mass_damping);
  out["stiffness_damping"] = column(&DrawnMaterial::stiffness_damping);
  return out;
}

std::shared_ptr<Model> with_values(const Model& model, std::optional<double> youngs_modulus,
                                   std::optional<double> poissons_ratio, std::optional<double> mass_damping,
                                   std::optional<double> stiffness_damping) {
  DrawnMaterial sample{youngs_modulus.value_or(model.youngs_modulus), poissons_ratio.value_or(model.poissons_ratio),
                        mass_damping.value_or(model.mass_damping),
                        stiffness_damping.value_or(model.stiffness_damping)};
  if (!(sample.youngs_modulus > 0.0)) throw py::value_error("youngs_modulus: expected a positive number [Pa]");
  if (!(sample.poissons_ratio > -1.0 && sample.poissons_ratio < 0.5))
    throw py::value_error("poissons_ratio: expected a number between -1 and 0.5");
  if (!(sample.mass_damping >= 0.0)) throw py::value_error("mass_damping: expected 0 or more [1/s]");
  if (!(sample.stiffness_damping >= 0.0)) throw py::value_error("stiffness_damping: expected 0 or more [s]");
  return std::make_shared<Model>(with_material(model, sample));
}

}  // namespace

void bind_models(py::module_& module) {
  py::class_<Model, std::shared_ptr<Model>>(module, "Model")
      .def(py::init([](const fs::path& path) {
             const py::gil_scoped_release unlocked;
             return std::make_shared<Model>(load_model(path));
           }),
           py::arg("path"))
      .def_readonly("name", &Model::name)
      .def_readonly("youngs_modulus", &Model::youngs_modulus)
      .def_readonly("poissons_ratio", &Model::poissons_ratio)
      .def_readonly("mass_damping", &Model::mass_damping)
      .def_readonly("stiffness_damping", &Model::stiffness_damping)
      .def_property_readonly("density", [](const Model& m) { return m.scene.object.density; })
      .def_property_readonly("mass", [](const Model& m) { return m.scene.object.mass; })
      .def_property_readonly("law", [](const Model& m) { return m.law ? m.law->name : std::string(); })
      .def_property_readonly("element_moduli",
                             [](const py::object& self) {
                               const std::vector<double>& moduli = self.cast<const Model&>().volume.youngs_modulus;
                               return view_of(moduli.data(), {py::ssize_t(moduli.size())}, self);
                             })
      .def_property_readonly("vertices", [](const Model& m) { return vertices_of(m.scene.object.surface.value()); })
      .def_property_readonly("triangles", [](const Model& m) { return triangles_of(m.scene.object.surface.value()); })
      .def("with_values", &with_values)
      .def("save", [](const Model& m, const fs::path& folder) { save_model(folder, m); })
      .def("body",
           [](const Model& m) {
             const py::gil_scoped_release unlocked;
             return std::const_pointer_cast<Body>(make_scene(m).body);
           })
      .def("simulate", &simulate)
      .def("export", &export_to);
  module.def("posterior_samples", &samples);
  module.def("export_formats", [] {
    py::dict formats;
    for (const ExportFormat& format : export_formats()) formats[py::str(format.name)] = format.program;
    return formats;
  });
}

}  // namespace pliant::python
