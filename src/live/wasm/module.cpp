// What the page calls: one object, numbers and pointers alone. Arrays lie in the module's memory until the next call.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "live/live_motion.hpp"
#include "live/live_press.hpp"

#define PLIANT_EXPORT(name) extern "C" __attribute__((export_name(#name), visibility("default")))

namespace {

using pliant::LiveField;
using pliant::LiveMotion;
using pliant::LiveObject;
using pliant::LivePress;
using pliant::Vector3;

std::string bytes;
std::unique_ptr<LiveObject> object;
LiveMotion* motion = nullptr;  // what the object is; the other one is null
LivePress* press = nullptr;
std::vector<float> floats;
std::vector<double> doubles;

float* floats_of(const pliant::Points& points) {
  floats.resize(std::size_t(points.size()));
  for (Eigen::Index i = 0; i < points.size(); ++i) floats[std::size_t(i)] = float(points.data()[i]);
  return floats.data();
}

const double* doubles_of(std::initializer_list<Vector3> vectors) {
  doubles.clear();
  for (const Vector3& v : vectors) doubles.insert(doubles.end(), v.begin(), v.end());
  return doubles.data();
}

}  // namespace

PLIANT_EXPORT(reserve) char* reserve(int size) {
  bytes.resize(std::size_t(size));
  return bytes.data();
}
PLIANT_EXPORT(load) int load() {
  object = LiveObject::make(pliant::decode(bytes));
  motion = dynamic_cast<LiveMotion*>(object.get());
  press = dynamic_cast<LivePress*>(object.get());
  bytes = {};
  return object->body().node_count();
}
PLIANT_EXPORT(vertex_count) int vertex_count() { return int(object->data().surface.vertices.size()); }
PLIANT_EXPORT(triangle_count) int triangle_count() { return int(object->data().surface.triangles.size()); }
PLIANT_EXPORT(element_count) int element_count() { return object->body().element_count(); }
PLIANT_EXPORT(triangles) const int* triangles() { return object->data().surface.triangles.data()->data(); }
PLIANT_EXPORT(surface) const float* surface() { return floats_of(object->surface()); }
PLIANT_EXPORT(nodes) const double* nodes() { return object->nodes().data(); }
PLIANT_EXPORT(step) int step() { return object->step() ? 1 : 0; }
PLIANT_EXPORT(reset) void reset() { object->reset(); }
PLIANT_EXPORT(grab) void grab(int triangle, double a, double b, double c, double radius) {
  object->grab(triangle, {a, b, c}, radius);
}
PLIANT_EXPORT(move_hand) void move_hand(double x, double y, double z) { object->move_hand({x, y, z}); }
PLIANT_EXPORT(let_go) void let_go() { object->let_go(); }
/// Force [N], where it holds [m], where the hand is [m]: nine numbers; null where nothing is held.
PLIANT_EXPORT(hand) const double* hand() {
  const auto ends = object->hand();
  return ends ? doubles_of({object->hand_force(), ends->first, ends->second}) : nullptr;
}
PLIANT_EXPORT(touch)
void touch(int kind, int triangle, double a, double b, double c, double radius, double x, double y, double z) {
  object->touch(pliant::LiveProbe(kind), triangle, {a, b, c}, radius, {x, y, z});
}
PLIANT_EXPORT(move_probe) void move_probe(double x, double y, double z) { object->move_probe({x, y, z}); }
PLIANT_EXPORT(lift) void lift() { object->lift(); }
/// Force on the object [N], and the way from where it touched [m]: six numbers.
PLIANT_EXPORT(probe) const double* probe() { return doubles_of({object->probe_force(), object->probe_way()}); }
PLIANT_EXPORT(set_gravity) void set_gravity(double x, double y, double z) { object->set_gravity({x, y, z}); }
PLIANT_EXPORT(set_material) void set_material(double stiffness, double damping) {
  object->set_material(stiffness, damping);
}
PLIANT_EXPORT(set_sample) void set_sample(int sample) { object->set_sample(sample); }
PLIANT_EXPORT(field) const float* field(int which) { return object->field(LiveField(which)).data(); }

// An object that moves.
PLIANT_EXPORT(step_length) double step_length() { return motion ? motion->step_length() : 0.0; }
PLIANT_EXPORT(set_pace) void set_pace(double factor) {
  if (motion) motion->set_pace(std::max(1.0, factor));
}
PLIANT_EXPORT(time) double time_now() { return motion ? motion->time() : 0.0; }
PLIANT_EXPORT(kinetic_energy) double kinetic_energy() { return motion ? motion->kinetic_energy() : 0.0; }
PLIANT_EXPORT(start_as_recorded) void start_as_recorded() {
  if (motion) motion->start_as_recorded();
}
PLIANT_EXPORT(set_wind) void set_wind(double x, double y, double z, double gusts) {
  if (motion) motion->set_wind({x, y, z}, gusts);
}
PLIANT_EXPORT(set_rain) void set_rain(double rate, double diameter) {
  if (motion) motion->set_rain(rate, diameter);
}
PLIANT_EXPORT(push) void push(double x, double y, double z) {
  if (motion) motion->push({x, y, z});
}
PLIANT_EXPORT(drop_count) int drop_count() {
  floats.clear();
  if (!motion) return 0;
  for (const Vector3& drop : motion->drops())
    for (int i = 0; i < 3; ++i) floats.push_back(float(drop[i]));
  return int(floats.size() / 3);
}
PLIANT_EXPORT(drops) const float* drops() { return floats.data(); }

// An object that is pressed.
PLIANT_EXPORT(is_settled) int is_settled() { return press && press->is_settled() ? 1 : 0; }
PLIANT_EXPORT(press_as_recorded) void press_as_recorded(int test) {
  if (press && test >= 0 && test < int(press->data().tests.size())) press->press_as_recorded(test);
}
