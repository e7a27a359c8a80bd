#include "tracked_objects.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>

#include "elasticity/modulus_field.hpp"
#include "geometry/primitives.hpp"
#include "mesh/tet_mesh.hpp"

namespace pliant {

namespace {

/// A straight limb, thick at one end [m].
struct Limb {
  Vector3 from, to;
  double from_radius, to_radius;

  double distance(const Vector3& p) const {
    const Vector3 along = to - from;
    const double share = std::clamp((p - from).dot(along) / along.squaredNorm(), 0.0, 1.0);
    return (p - from - share * along).norm() - ((1.0 - share) * from_radius + share * to_radius);
  }
};

/// x forwards, y up.
std::vector<Limb> dinosaur_limbs() {
  std::vector<Limb> limbs = {{{-0.10, 0.42, 0}, {0.12, 0.52, 0}, 0.100, 0.085},    // trunk
                             {{0.12, 0.52, 0}, {0.25, 0.72, 0}, 0.075, 0.045},     // neck
                             {{0.25, 0.73, 0}, {0.38, 0.70, 0}, 0.055, 0.035},     // head
                             {{-0.10, 0.42, 0}, {-0.38, 0.34, 0}, 0.085, 0.050},   // tail
                             {{-0.38, 0.34, 0}, {-0.65, 0.36, 0}, 0.050, 0.022}};  // its end
  for (const double side : {-1.0, 1.0}) {
    const auto add = [&](Vector3 from, Vector3 to, double from_radius, double to_radius) {
      from.z() *= side, to.z() *= side;
      limbs.push_back({from, to, from_radius, to_radius});
    };
    add({0.12, 0.50, 0.07}, {0.24, 0.40, 0.11}, 0.038, 0.026);     // arm
    add({-0.05, 0.39, 0.07}, {0.01, 0.21, 0.10}, 0.070, 0.050);    // thigh
    add({0.01, 0.21, 0.10}, {-0.02, 0.035, 0.10}, 0.050, 0.038);   // shank
    add({-0.02, 0.035, 0.10}, {0.08, 0.035, 0.10}, 0.038, 0.034);  // foot
  }
  return limbs;
}

/// Negative inside; the limbs run smoothly into each other.
double dinosaur_distance(const std::vector<Limb>& limbs, const Vector3& p) {
  constexpr double rounding = 0.012;  // [m]
  double sum = 0.0;
  for (const Limb& limb : limbs) sum += std::exp(-limb.distance(p) / rounding);
  return -rounding * std::log(std::max(sum, 1e-300));
}

std::vector<Vector3> dinosaur_controls() {
  return {{0.41, 0.70, 0.0},  {-0.67, 0.36, 0.0},  {0.25, 0.39, 0.11}, {0.25, 0.39, -0.11},
          {0.02, 0.06, 0.10}, {0.02, 0.06, -0.10}, {0.0, 0.46, 0.0}};
}

Box box_of(const Vector3& min, const Vector3& max) {
  Box box;
  box.extend(min), box.extend(max);
  return box;
}

}  // namespace

namespace {

constexpr double length = 1.0, edge = 0.25;  // of the bar [m]

/// Nodes of a body, each at most once.
std::vector<Vector3> random_nodes(const Body& body, int count, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<int> chosen;
  std::vector<Vector3> points;
  while (int(points.size()) < count) {
    const int n = int(random() % unsigned(body.node_count()));
    if (std::ranges::find(chosen, n) != chosen.end()) continue;
    chosen.push_back(n);
    points.push_back(body.nodes.row(n).transpose());
  }
  return points;
}

std::vector<StartingMotion> struck_bar() {
  return {{"twist", {0, 0, 0}, {10, 0, 0}, {}},
          {"bend", {0, 0.5, 0}, {0, 0, 1}, {}},
          {"stretch", {1.5, 0, 0}, {0, 0, 0}, {}}};
}

/// The free end turned about the bar's axis, bent up, or pulled out.
std::vector<StartingMotion> led_bar() {
  const auto at_end = [](const Vector3& p) { return p.x() > (1.0 - 1e-6) * length; };
  const auto led = [&](const char* name, const Matrix3& rotation, const Vector3& end) {
    const Vector3 middle(length, 0, 0);
    return StartingMotion{name, Vector3::Zero(), Vector3::Zero(), Hold{at_end, rotation, end - rotation * middle}};
  };
  const auto turned = [](double degrees, const Vector3& axis) {
    return Eigen::AngleAxisd(degrees * std::numbers::pi / 180.0, axis).toRotationMatrix();
  };
  return {led("twist", turned(60.0, Vector3::UnitX()), {length, 0, 0}),
          led("bend", turned(30.0, Vector3::UnitZ()), {0.95 * length, 0.25 * length, 0}),
          led("stretch", Matrix3::Identity(), {1.15 * length, 0, 0})};
}

}  // namespace

TrackedObject make_bar(int controls, unsigned seed, bool deformed_starts) {
  const Box box = box_of({0, -0.5 * edge, -0.5 * edge}, {length, 0.5 * edge, 0.5 * edge});
  Body body = make_body(make_tet_box(box, {20, 5, 5}, false));
  if (controls > 1)
    body.modulus = (seed == 0 ? linear_field(body, Vector3::UnitX(), controls)
                              : harmonic_field(body, random_nodes(body, controls, seed)))
                       .field;
  return {std::make_shared<Body>(std::move(body)),
          {[](const Vector3& p) { return p.x() < 1e-6 * length; }},
          deformed_starts ? led_bar() : struck_bar(),
          length};
}

TrackedObject make_dinosaur(int controls, double cell_size) {
  std::vector<Vector3> points = dinosaur_controls();
  if (controls < 1 || controls > int(points.size()))
    throw std::invalid_argument("a dinosaur has 1 to 7 control points");
  points.resize(std::size_t(controls));
  const auto inside = [limbs = dinosaur_limbs()](const Vector3& p) { return dinosaur_distance(limbs, p); };
  TetMeshOptions options;
  options.cell_size = cell_size;
  options.feature_angle_deg = 180.0;
  const Box box = box_of({-0.75, -0.06, -0.25}, {0.5, 0.86, 0.25});
  Body body = make_body(make_tet_mesh(make_level_surface(inside, box, 0.5 * cell_size), options));
  if (controls > 1) body.modulus = harmonic_field(body, points).field;
  const double size = body.size();
  return {std::make_shared<Body>(std::move(body)),
          {[](const Vector3& p) { return p.y() < 0.03; }},
          {{"swing", {0.3, 0, 0.3}, {0, 1, 0}, {}}},
          size};
}

}  // namespace pliant
