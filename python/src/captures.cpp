#include <pybind11/eigen.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "arrays.hpp"
#include "bindings.hpp"
#include "capture/observe.hpp"
#include "scan/scan_pose.hpp"

namespace pliant::python {

namespace {

py::list frames_of(const std::vector<ObservedFrame>& observed) {
  py::list frames;
  for (const ObservedFrame& frame : observed) {
    Points points(Eigen::Index(frame.points.size()), 3);
    for (std::size_t i = 0; i < frame.points.size(); ++i) points.row(Eigen::Index(i)) = frame.points[i].transpose();
    py::dict one;
    one["frame"] = frame.frame;
    one["points"] = array_of(std::move(points));
    one["noise"] = array_of(std::vector<double>(frame.noise.begin(), frame.noise.end()),
                            {py::ssize_t(frame.noise.size())});
    frames.append(one);
  }
  return frames;
}

py::list observed(const Capture& capture, int points_per_frame) {
  ObserveOptions options;
  options.max_points_per_frame = points_per_frame;
  std::vector<ObservedFrame> frames;
  {
    const py::gil_scoped_release unlocked;
    Capture placed = capture;
    frames = observe_placed(placed, options);
  }
  return frames_of(frames);
}

}  // namespace

void bind_captures(py::module_& module) {
  py::class_<Capture, std::shared_ptr<Capture>>(module, "Capture")
      .def(py::init([](const std::filesystem::path& path) {
             const py::gil_scoped_release unlocked;
             return std::make_shared<Capture>(read_capture(path));
           }),
           py::arg("path"))
      .def_readonly("name", &Capture::name)
      .def_readonly("folder", &Capture::folder)
      .def_readonly("sha256", &Capture::sha256)
      .def_property_readonly("times", [](const Capture& c) { return c.scene.timing.times; })
      .def_property_readonly("frame_rate", [](const Capture& c) { return c.scene.timing.frame_rate; })
      .def_property_readonly("start_frame", [](const Capture& c) { return c.scene.timing.start_frame; })
      .def_property_readonly("frame_count", &Capture::frame_count)
      .def_property_readonly("mass", [](const Capture& c) { return c.scene.object.total_mass(); })
      .def_property_readonly("gravity", [](const Capture& c) { return c.scene.world.gravity; })
      .def_property_readonly("cameras",
                             [](const Capture& c) {
                               std::vector<std::string> names;
                               for_each_camera(c, [&](const RecordingCamera& camera, auto, auto) {
                                 names.push_back(camera.name);
                               });
                               return names;
                             })
      .def_property_readonly("has_clouds", [](const Capture& c) { return !c.clouds.empty(); })
      .def_property_readonly("press_count", [](const Capture& c) { return c.presses.size(); })
      .def_property_readonly("vertices",
                             [](const Capture& c) {
                               return c.scene.object.surface ? py::object(vertices_of(*c.scene.object.surface))
                                                             : py::object(py::none());
                             })
      .def_property_readonly("triangles",
                             [](const Capture& c) {
                               return c.scene.object.surface ? py::object(triangles_of(*c.scene.object.surface))
                                                             : py::object(py::none());
                             })
      .def("observed", &observed);
}

}  // namespace pliant::python
