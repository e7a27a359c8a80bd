#include "live/live_page.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <cmath>
#include <cstring>
#include <stdexcept>

#include "base/base64.hpp"
#include "base/error.hpp"
#include "base/html.hpp"
#include "simulation/inner_bodies.hpp"
#include "simulation/scene_simulation.hpp"

// The files beside this one, as they are: what users get needs no other file.
#define PLIANT_FILE(name, path)                                                                  \
  extern const char name##_begin[], name##_end[];                                                \
  __asm__(".section .rodata\n" #name "_begin: .incbin \"" PLIANT_LIVE_PAGE "/" path "\"\n" #name \
          "_end: .byte 0\n.previous\n");                                                         \
  static std::string_view name() { return {name##_begin, std::size_t(name##_end - name##_begin)}; }

extern "C" {
PLIANT_FILE(pliant_live_module, "live.wasm.gz")
PLIANT_FILE(pliant_live_html, "live.html")
PLIANT_FILE(pliant_live_worker, "worker.js")
PLIANT_FILE(pliant_live_script, "page.js")
}

namespace pliant {

namespace {

std::string gzip(const std::string& bytes) {
  z_stream stream{};
  if (deflateInit2(&stream, 9, Z_DEFLATED, 15 + 16, 9, Z_DEFAULT_STRATEGY) != Z_OK)
    throw std::runtime_error("the page's object cannot be packed");
  std::string packed(deflateBound(&stream, uLong(bytes.size())), '\0');
  std::string copy = bytes;
  stream.next_in = reinterpret_cast<Bytef*>(copy.data());
  stream.avail_in = uInt(copy.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = uInt(packed.size());
  const int done = deflate(&stream, Z_FINISH);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  if (done != Z_STREAM_END) throw std::runtime_error("the page's object cannot be packed");
  return packed;
}

std::string list(const Vector3& v) { return fmt::format("[{},{},{}]", v.x(), v.y(), v.z()); }

void replace(std::string& text, const std::string& what, std::string_view with) {
  const std::size_t at = text.find(what);
  if (at != std::string::npos) text.replace(at, what.size(), with);
}

/// Facts that the page itself needs, as JSON.
std::string facts(const Model& model, const LiveData& data, const LiveRecording& recording) {
  const Scene& scene = model.scene;
  const Box box = bounding_box(data.surface);
  const double size = box.extent().maxCoeff();
  const Vector3 gravity = live_blocks(data.planes).gravity.vector(data.theta);
  const double magnitude = std::pow(10.0, std::floor(std::log10(size / 2.0)));
  const double mass = scene.object.total_mass().value_or(0.1);
  std::string planes, times, presses, counts, bytes;
  for (const LiveTest& press : data.tests)
    presses += fmt::format("{}{:.4g}", presses.empty() ? "" : ",", press.force.norm());
  for (const Plane& plane : scene.planes)
    planes += fmt::format("{}{{\"point\":{},\"normal\":{}}}", planes.empty() ? "" : ",", list(plane.point),
                          list(plane.normal));
  for (const double time : recording.times)
    times += fmt::format("{}{:.6g}", times.empty() ? "" : ",", time - recording.times.front());
  for (const auto& frame : recording.points) {
    counts += fmt::format("{}{}", counts.empty() ? "" : ",", frame.size());
    for (const Vector3& p : frame) {
      const Eigen::Vector3f q = p.cast<float>();
      bytes.append(reinterpret_cast<const char*>(q.data()), sizeof q);
    }
  }
  // The heaviest rain of the slider brings half the object's weight of water each second.
  const double drop = 1000.0 * 3.14159 / 6.0 * std::pow(0.004, 3), area = std::max(1e-4, size * size);
  return fmt::format(
      "{{\"up\":{},\"gravity\":{},\"size\":{},\"middle\":{},\"grid\":{},\"rain\":{:.4g},\"samples\":{},\"pressed\":{},"
      "\"deviations\":{},\"strain\":{:.4g},\"planes\":[{}],\"times\":[{}],\"presses\":[{}]{}}}",
      list(gravity.norm() > 0.0 ? Vector3(-gravity.normalized()) : scene.world.up), gravity.norm(), size,
      list(0.5 * (box.min + box.max)), magnitude, std::min(2e4, 0.5 * mass / (drop * area)), data.samples.size(),
      data.is_pressed, data.relative_deviations.size() > 0, recording.greatest_strain.value_or(0.0),
      data.is_pressed ? "" : planes, times, presses,
      recording.points.empty()
          ? ""
          : fmt::format(",\"observed\":{{\"counts\":[{}],\"points\":\"{}\"}}", counts, encode_base64(bytes)));
}

}  // namespace

bool is_known_to_pages(const Model& model) {
  const Timing& timing = model.scene.timing;
  const bool is_pressed = model.law && (timing.is_static || timing.times.empty());  // on the bodies that it is glued to
  return !has_sliding_bodies(model.scene) && model.scene.obstacles.empty() && (model.scene.inner.empty() || is_pressed);
}

LiveData live_data(const Model& model) {
  if (!is_known_to_pages(model))
    throw InputError({{},
                      "a model that slides on a rigid body inside it, moves with one, or meets an [[obstacle]]",
                      "planes alone, and bodies that pressed objects are glued to",
                      "pages know no others: `pliant press` and `pliant simulate` do"});
  Model free = model;
  free.scene.inner.clear();  // what they hold is among the held nodes
  for (const LedRegion& led : free.scene.led) free.scene.fixed.push_back({led.region, std::nullopt});  // hands lead
  free.scene.led.clear();
  free.scene.initial.released = false;
  free.scene.initial.release_of.reset(), free.scene.initial.pulls.clear(), free.scene.initial.pulled_at.clear();
  free.scene.wind.reset(), free.scene.forces.clear();  // hands and sliders take their place
  if (free.scene.timing.times.empty() || free.scene.timing.is_static) free.scene.timing = evenly_timed(30.0, 2);
  const ModelScene made = make_scene(free, free.scene, scene_distance(free.scene, Resolution{}.band), {}, true);
  LiveData data;
  data.mesh = made.body->mesh;
  data.relative_moduli = made.body->modulus.relative;
  data.surface = *model.scene.object.surface;
  data.fixed = free.scene.fixed, data.weights = model.scene.weights;
  data.planes = int(model.scene.planes.size());
  const MotionLayout blocks = live_blocks(data.planes);
  if (made.theta.size() != blocks.size()) throw std::logic_error("parameters of a model in motion have another layout");
  data.theta = made.theta;
  const SimulationOptions& s = made.simulation;
  data.max_dt = s.max_dt, data.newmark_theta = s.newmark_theta, data.contact_weight = s.contact_weight;
  data.rotation_prediction = s.rotation_prediction;
  data.material = s.material;
  data.contact = s.contact, data.friction_speed = s.friction_speed;
  data.up = model.scene.world.up;
  const ModelVolume& volume = model.volume;
  if (!volume.youngs_modulus_std.empty() && volume.youngs_modulus_std.size() == data.relative_moduli.size()) {
    data.relative_deviations.resize(Eigen::Index(volume.youngs_modulus_std.size()));
    for (std::size_t e = 0; e < volume.youngs_modulus_std.size(); ++e)
      data.relative_deviations[Eigen::Index(e)] = volume.youngs_modulus_std[e] / volume.youngs_modulus[e];
  }
  const Timing& timing = model.scene.timing;
  if (data.material.law() && (timing.is_static || timing.times.empty()) && made.body->kind != ElementKind::Hexahedron)
    data.held = held_nodes(*made.body, model.scene);
  data.is_pressed = !data.held.empty();
  // A model of presses that says nothing of gravity has none: it is stress-free as it was scanned.
  if (data.is_pressed && !model.scene.world.gravity) data.theta.segment<3>(live_blocks(data.planes).gravity).setZero();
  return data;
}

std::string live_page(const Model& model, LiveData data, const LiveRecording& recording) {
  if (data.is_pressed) data.tests = recording.presses;
  std::string page(pliant_live_html());
  replace(page, "@NAME@", escape_html(model.name));
  replace(page, "@NAME@", escape_html(model.name));
  replace(page, "@FACTS@", facts(model, data, recording));
  replace(page, "@MODULE@", encode_base64(pliant_live_module()));
  replace(page, "@DATA@", encode_base64(gzip(encode(data))));
  replace(page, "@WORKER@", pliant_live_worker());
  replace(page, "@PAGE@", pliant_live_script());
  return page;
}

std::string live_page(const Model& model, const LiveRecording& recording) {
  return live_page(model, live_data(model), recording);
}

}  // namespace pliant
