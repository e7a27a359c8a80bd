#include "held_objects.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "geometry/primitives.hpp"

namespace pliant {

namespace {

using std::numbers::pi;

/// Negative inside, about a distance near the surface [m].
using Shape = std::function<double(const Vector3&)>;

/// Along a curve that is cut into straight pieces; the radius goes evenly from one end to the other [m].
Shape tube(const std::function<Vector3(double)>& curve, int pieces, double from_radius, double to_radius) {
  std::vector<Vector3> points;
  for (int i = 0; i <= pieces; ++i) points.push_back(curve(double(i) / pieces));
  return [=](const Vector3& p) {
    double least = 1e300;
    for (int i = 0; i < pieces; ++i) {
      const Vector3 along = points[std::size_t(i) + 1] - points[std::size_t(i)], to = p - points[std::size_t(i)];
      const double share = std::clamp(to.dot(along) / along.squaredNorm(), 0.0, 1.0), at = (i + share) / pieces;
      least = std::min(least, (to - share * along).norm() - ((1.0 - at) * from_radius + at * to_radius));
    }
    return least;
  };
}

/// An elliptic plate about the origin with half axes along x and z, a round rim, and half its thickness along y [m].
double plate(const Vector3& p, double half_x, double half_z, double half_thickness) {
  const Eigen::Vector2d at(p.x(), p.z()), axes(half_x, half_z);
  const double within = at.cwiseQuotient(axes).norm(), slope = at.cwiseQuotient(axes.cwiseProduct(axes)).norm();
  const double aside = slope > 0.0 ? within * (within - 1.0) / slope : -axes.minCoeff();  // of the ellipse, near it
  return std::hypot(std::max(aside + half_thickness, 0.0), p.y()) - half_thickness;
}

/// About the origin, with rounded edges [m].
double rounded_box(const Vector3& p, const Vector3& half_edges, double radius) {
  const Vector3 q = p.cwiseAbs() - half_edges + Vector3::Constant(radius);
  return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0) - radius;
}

/// All of them, running smoothly into each other.
Shape together(const std::vector<Shape>& shapes, double rounding) {
  return [=](const Vector3& p) {
    double sum = 0.0;
    for (const Shape& shape : shapes) sum += std::exp(-std::max(shape(p), -100.0 * rounding) / rounding);
    return -rounding * std::log(std::max(sum, 1e-300));
  };
}

Box box_of(const Vector3& min, const Vector3& max) {
  Box box;
  box.extend(min), box.extend(max);
  return box;
}

HeldObject make_plant() {
  std::vector<Shape> shapes = {tube([](double s) { return Vector3(0.0, 0.05 * s, 0.0); }, 1, 0.028, 0.022)};
  for (const double azimuth : {0.0, 0.7 * pi, 1.35 * pi}) {
    const Vector3 out(std::cos(azimuth), 0.0, std::sin(azimuth)), across = Vector3::UnitY().cross(out);
    const double height = 0.34 + 0.04 * std::cos(3.0 * azimuth);
    const auto stalk = [=](double s) -> Vector3 {
      return 2.0 * s * (1.0 - s) * Vector3(0.03 * out + 0.8 * height * Vector3::UnitY()) +
             s * s * Vector3(0.14 * out + height * Vector3::UnitY()) + Vector3(0.0, 0.04, 0.0);
    };
    shapes.push_back(tube(stalk, 12, 0.012, 0.009));
    const Vector3 along = (out - 0.2 * Vector3::UnitY()).normalized(), up = across.cross(-along).normalized();
    const Vector3 middle = stalk(1.0) + 0.09 * along;
    shapes.push_back([=](const Vector3& p) {
      const Vector3 to = p - middle;
      const double u = to.dot(along), w = to.dot(across);
      return plate({u, to.dot(up) + 1.2 * u * u, w}, 0.11, 0.06, 0.006);
    });
  }
  return {make_level_surface(together(shapes, 0.003), box_of({-0.34, -0.05, -0.34}, {0.34, 0.5, 0.34}), 0.004),
          {[](const Vector3& p) { return p.y() < 0.012; }}};
}

HeldObject make_beam() {
  constexpr double length = 0.6, edge = 0.03;
  return {make_box({length, edge, edge}, edge / 4.0), {[](const Vector3& p) { return p.x() < -0.499 * length; }}, 60.0};
}

HeldObject make_holder() {
  const auto neck = [](double s) -> Vector3 {  // up, then over in an arc
    constexpr double rise = 0.12, radius = 0.09, turn = 2.2;
    const double arc = radius * turn, at = s * (rise + arc);
    if (at < rise) return {0.0, at, 0.0};
    const double angle = (at - rise) / radius;
    return {radius * (1.0 - std::cos(angle)), rise + radius * std::sin(angle), 0.0};
  };
  const Vector3 end = neck(1.0);
  const Matrix3 turn = Eigen::AngleAxisd(0.5, Vector3::UnitZ()).toRotationMatrix();
  const std::vector<Shape> shapes = {[](const Vector3& p) {
                                       return rounded_box(p - Vector3(0.03, 0.0, 0.0), {0.08, 0.02, 0.06}, 0.01);
                                     },
                                     tube(neck, 24, 0.012, 0.010),
                                     [=](const Vector3& p) {
                                       return rounded_box(turn.transpose() * (p - end), {0.012, 0.06, 0.035}, 0.008);
                                     }};
  return {make_level_surface(together(shapes, 0.003), box_of({-0.1, -0.05, -0.09}, {0.27, 0.25, 0.09}), 0.004),
          {[](const Vector3& p) { return p.y() < 0.0; }}};
}

}  // namespace

HeldObject make_held_object(const std::string& name) {
  if (name == "plant") return make_plant();
  if (name == "beam") return make_beam();
  if (name == "holder") return make_holder();
  throw std::invalid_argument("\"" + name + "\" is not an object: plant, beam or holder");
}

}  // namespace pliant
