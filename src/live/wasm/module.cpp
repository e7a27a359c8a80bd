// What the page calls: one object, numbers and pointers alone. Arrays lie in the module's memory until the next call.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "live/live_object.hpp"

#define PLIANT_EXPORT(name) extern "C" __attribute__((export_name(#name), visibility("default")))

namespace {

using pliant::LiveObject;
using pliant::Vector3;

std::string bytes;
std::unique_ptr<LiveObject> object;
std::vector<float> floats;
std::vector<double> doubles;

float* floats_of(const pliant::Points& points) {
  floats.resize(std::size_t(points.size()));
  for (Eigen::Index i = 0; i < points.size(); ++i) floats[std::size_t(i)] = float(points.data()[i]);
  return floats.data();
}

}  // namespace

PLIANT_EXPORT(reserve) char* reserve(int size) {
  bytes.resize(std::size_t(size));
  return bytes.data();
}
PLIANT_EXPORT(load) int load() {
  object = std::make_unique<LiveObject>(pliant::decode(bytes));
  bytes = {};
  return object->body().node_count();
}
PLIANT_EXPORT(vertex_count) int vertex_count() { return int(object->data().surface.vertices.size()); }
PLIANT_EXPORT(triangle_count) int triangle_count() { return int(object->data().surface.triangles.size()); }
PLIANT_EXPORT(element_count) int element_count() { return object->body().element_count(); }
PLIANT_EXPORT(triangles) const int* triangles() { return object->data().surface.triangles.data()->data(); }
PLIANT_EXPORT(surface) const float* surface() { return floats_of(object->surface()); }
PLIANT_EXPORT(nodes) const double* nodes() { return object->state().x.data(); }
PLIANT_EXPORT(step_length) double step_length() { return object->step_length(); }
PLIANT_EXPORT(time) double time_now() { return object->time(); }
PLIANT_EXPORT(kinetic_energy) double kinetic_energy() { return object->kinetic_energy(); }
PLIANT_EXPORT(step) int step() { return object->step() ? 1 : 0; }
PLIANT_EXPORT(reset) void reset() { object->reset(); }
PLIANT_EXPORT(start_as_recorded) void start_as_recorded() { object->start_as_recorded(); }
PLIANT_EXPORT(grab) void grab(int triangle, double a, double b, double c, double radius, double stiffness) {
  object->grab(triangle, {a, b, c}, radius, stiffness);
}
PLIANT_EXPORT(move_hand) void move_hand(double x, double y, double z) { object->move_hand({x, y, z}); }
PLIANT_EXPORT(let_go) void let_go() { object->let_go(); }
/// Force [N], where it holds [m], where the hand is [m]: nine numbers; null where nothing is held.
PLIANT_EXPORT(hand) const double* hand() {
  const auto ends = object->hand();
  if (!ends) return nullptr;
  const Vector3 force = object->hand_force();
  doubles.assign(9, 0.0);
  for (std::size_t i = 0; i < 3; ++i) {
    doubles[i] = force[Eigen::Index(i)];
    doubles[3 + i] = ends->first[Eigen::Index(i)];
    doubles[6 + i] = ends->second[Eigen::Index(i)];
  }
  return doubles.data();
}
PLIANT_EXPORT(set_gravity) void set_gravity(double x, double y, double z) { object->set_gravity({x, y, z}); }
PLIANT_EXPORT(set_wind) void set_wind(double x, double y, double z, double gusts) {
  object->set_wind({x, y, z}, gusts);
}
PLIANT_EXPORT(set_rain) void set_rain(double rate, double diameter) { object->set_rain(rate, diameter); }
PLIANT_EXPORT(set_probe)
void set_probe(double ax, double ay, double az, double bx, double by, double bz, double radius) {
  object->set_probe({ax, ay, az}, {bx, by, bz}, radius);
}
PLIANT_EXPORT(probe_force) double probe_force() { return object->probe_force().norm(); }
PLIANT_EXPORT(set_material) void set_material(double stiffness, double damping) {
  object->set_material(stiffness, damping);
}
PLIANT_EXPORT(push) void push(double x, double y, double z) { object->push({x, y, z}); }
PLIANT_EXPORT(set_sample) void set_sample(int sample) { object->set_sample(sample); }
PLIANT_EXPORT(field) const float* field(int which) { return object->field(LiveObject::Field(which)).data(); }
PLIANT_EXPORT(drop_count) int drop_count() {
  const auto& drops = object->drops();
  floats.clear();
  for (const Vector3& drop : drops)
    for (int i = 0; i < 3; ++i) floats.push_back(float(drop[i]));
  return int(drops.size());
}
PLIANT_EXPORT(drops) const float* drops() { return floats.data(); }
