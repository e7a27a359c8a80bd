#include "photos/paint.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <ostream>
#include <random>
#include <stdexcept>
#include <utility>

#include "base/files.hpp"
#include "base/parallel.hpp"
#include "capture/markers.hpp"
#include "geometry/mesh_io.hpp"
#include "geometry/primitives.hpp"
#include "rays/look_at.hpp"
#include "rays/ray_scene.hpp"
#include "scene/scene_toml.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

constexpr int coarse = 4;         // [pixels] between rays away from dots
constexpr int lens_step = 8;      // [pixels] between exact rays; the lens is smooth between them
constexpr double ambient = 0.35;  // share of the light that comes from everywhere
constexpr double degree = std::numbers::pi / 180.0;

TriangleMesh placed(TriangleMesh mesh, const Vector3& at) {
  for (Vector3& vertex : mesh.vertices) vertex += at;
  return mesh;
}

Vector3 weighted(const std::vector<Vector3>& vertices, const std::array<int, 3>& corners, const Vector3& weights) {
  Vector3 out = Vector3::Zero();
  for (int k = 0; k < 3; ++k) out += weights[k] * vertices[std::size_t(corners[std::size_t(k)])];
  return out;
}

// Whether a ball may touch a triangle; true for some that it does not touch.
bool may_reach(const TriangleMesh& mesh, const std::array<int, 3>& corners, const Vector3& middle, double radius) {
  const Vector3 &a = mesh.vertices[std::size_t(corners[0])], &b = mesh.vertices[std::size_t(corners[1])],
                &c = mesh.vertices[std::size_t(corners[2])];
  const double reach = radius + std::max({(b - a).norm(), (c - a).norm(), (c - b).norm()});
  return (a - middle).squaredNorm() < reach * reach;
}

// A closed cylinder from one point to another.
TriangleMesh cylinder(const Vector3& from, const Vector3& to, double radius) {
  constexpr int sides = 32;
  const Vector3 axis = (to - from).normalized(), along = axis.unitOrthogonal(), across = axis.cross(along);
  TriangleMesh mesh;
  for (int k = 0; k < sides; ++k) {
    const double angle = 2.0 * std::numbers::pi * k / sides;
    const Vector3 arm = radius * (std::cos(angle) * along + std::sin(angle) * across);
    mesh.vertices.push_back(from + arm);
    mesh.vertices.push_back(to + arm);
  }
  mesh.vertices.push_back(from);
  mesh.vertices.push_back(to);
  for (int k = 0; k < sides; ++k) {
    const int a = 2 * k, b = 2 * ((k + 1) % sides);
    mesh.triangles.push_back({a, b, a + 1});
    mesh.triangles.push_back({b, b + 1, a + 1});
    mesh.triangles.push_back({2 * sides, b, a});
    mesh.triangles.push_back({2 * sides + 1, a + 1, b + 1});
  }
  return mesh;
}

// Directions of rays through any place of the picture, by interpolation between exact ones.
class Rays {
 public:
  explicit Rays(const LensCamera& camera)
      : columns_(camera.width / lens_step + 3), rows_(camera.height / lens_step + 3), origin_(camera.centre()) {
    std::vector<Vector2> pixels;
    for (int j = 0; j < rows_; ++j)
      for (int i = 0; i < columns_; ++i) pixels.emplace_back((i - 1) * lens_step, (j - 1) * lens_step);
    for (const Vector2& pixel : without_lens(camera, pixels)) directions_.push_back(ray_of(camera, pixel));
  }
  const Vector3& origin() const { return origin_; }
  Vector3 direction(double u, double v) const {
    const double x = std::clamp(u / lens_step + 1.0, 0.0, columns_ - 1.001);
    const double y = std::clamp(v / lens_step + 1.0, 0.0, rows_ - 1.001);
    const int i = int(x), j = int(y);
    const double s = x - i, t = y - j;
    return (1 - t) * ((1 - s) * at(i, j) + s * at(i + 1, j)) + t * ((1 - s) * at(i, j + 1) + s * at(i + 1, j + 1));
  }

 private:
  const Vector3& at(int i, int j) const { return directions_[std::size_t(j) * std::size_t(columns_) + std::size_t(i)]; }
  int columns_, rows_;
  Vector3 origin_;
  std::vector<Vector3> directions_;
};

double unit_random(std::uint64_t key) {  // 0 to 1, the same for the same key (splitmix64's finish)
  key += 0x9e3779b97f4a7c15ULL;
  key = (key ^ (key >> 30)) * 0xbf58476d1ce4e5b9ULL;
  key = (key ^ (key >> 27)) * 0x94d049bb133111ebULL;
  return double((key ^ (key >> 31)) >> 11) * 0x1p-53;
}

using Colour = Eigen::Vector3f;
Colour colour_of(const Rgb& rgb) { return Colour(rgb[0], rgb[1], rgb[2]); }

// Colours along rays.
class Painter {
 public:
  Painter(const PaintedScene& scene) : scene_(scene) {
    add({scene.vertices, scene.rest.triangles}, scene.colour);
    if (scene.probe) {
      const PaintedProbe& probe = *scene.probe;
      const Vector3 back = -probe.pose.direction;
      constexpr double handle = 0.03;  // [m] of shaft behind the second dot
      const Vector3 near = probe.pose.tip + probe.shape.tip * back, far = near + probe.shape.dots_apart * back;
      add(cylinder(far + handle * back, probe.pose.tip + 0.002 * back, probe.shaft_radius), scene.shaft_colour);
      add(cylinder(probe.pose.tip + 0.002 * back, probe.pose.tip, probe.shape.radius), scene.shaft_colour);
      for (const Vector3& dot : {near, far}) add(placed(make_sphere(probe.bead_radius, 3), dot), scene.bead_colour);
    }
    brightest_ = 1e-12;
    for (const Vector3& vertex : scene.rest.vertices)
      brightest_ = std::max(brightest_, 1.0 / (vertex - scene.lamp).squaredNorm());
    paint();
  }

  Colour colour(const Vector3& origin, const Vector3& direction) const {
    if (!direction.allFinite()) return colour_of(scene_.backdrop);
    const auto hit = rays_.cast(origin, direction);
    if (!hit) return colour_of(scene_.backdrop);
    const Part& part = parts_[std::size_t(hit->mesh)];
    const auto& corners = part.mesh.triangles[std::size_t(hit->triangle)];
    const Vector3 weights(1.0 - hit->u - hit->v, hit->u, hit->v);
    Vector3 normal = Vector3::Zero();
    for (int k = 0; k < 3; ++k) normal += weights[k] * part.normals[std::size_t(corners[std::size_t(k)])];
    const Vector3 to_lamp = scene_.lamp - (origin + hit->distance * direction);
    const double fall = 1.0 / (to_lamp.squaredNorm() * brightest_);
    const double lit = ambient + (1.0 - ambient) * fall * std::max(0.0, normal.normalized().dot(to_lamp.normalized()));
    const bool is_dot = hit->mesh == 0 && is_painted(hit->triangle, weights);
    return float(lit) * (is_dot ? colour_of(scene_.dot_colour) : part.colour);
  }

 private:
  struct Part {
    TriangleMesh mesh;
    std::vector<Vector3> normals;
    Colour colour;
  };

  void add(const TriangleMesh& mesh, const Rgb& colour) {
    rays_.add(mesh);
    parts_.push_back({mesh, vertex_normals(mesh), colour_of(colour)});
  }

  // Which dots may cover which triangle.
  void paint() {
    dots_on_.resize(scene_.rest.triangles.size());
    for (const PaintedDot& dot : scene_.dots) {
      const Vector3 centre = at_rest(dot.triangle, dot.weights);
      for (std::size_t t = 0; t < dots_on_.size(); ++t) {
        if (may_reach(scene_.rest, scene_.rest.triangles[t], centre, dot.radius))
          dots_on_[t].emplace_back(centre, dot.radius);
      }
    }
  }

  Vector3 at_rest(int triangle, const Vector3& weights) const {
    return weighted(scene_.rest.vertices, scene_.rest.triangles[std::size_t(triangle)], weights);
  }

  bool is_painted(int triangle, const Vector3& weights) const {
    const auto& dots = dots_on_[std::size_t(triangle)];
    if (dots.empty()) return false;
    const Vector3 place = at_rest(triangle, weights);
    return std::ranges::any_of(
        dots, [&](const auto& dot) { return (place - dot.first).squaredNorm() < dot.second * dot.second; });
  }

  const PaintedScene& scene_;
  RayScene rays_;
  std::vector<Part> parts_;
  double brightest_;
  std::vector<std::vector<std::pair<Vector3, double>>> dots_on_;
};

template <class Row>
void each_row(int rows, const Row& row) {
  parallel_for(0, rows, row);
}

cv::Vec3f to_cv(const Colour& c) { return {c[0], c[1], c[2]}; }

cv::Mat3f coarse_picture(const Painter& painter, const Rays& rays, int width, int height) {
  cv::Mat3f small((height + coarse - 1) / coarse, (width + coarse - 1) / coarse), out;
  const double middle = 0.5 * (coarse - 1);
  each_row(small.rows, [&](int v) {
    for (int u = 0; u < small.cols; ++u)
      small(v, u) = to_cv(painter.colour(rays.origin(), rays.direction(coarse * u + middle, coarse * v + middle)));
  });
  cv::resize(small, out, {small.cols * coarse, small.rows * coarse}, 0, 0, cv::INTER_LINEAR);
  return out(cv::Rect(0, 0, width, height));
}

// Pixels near what must be exact.
cv::Mat1b pixels_near_dots(const PaintedScene& scene, const LensCamera& camera, double blur) {
  cv::Mat1b near(camera.height, camera.width, std::uint8_t(0));
  const auto mark = [&](const Vector3& place, double radius) {
    const Vector2 pixel = project(camera, place);
    if (!pixel.allFinite() || pixel.cwiseAbs().maxCoeff() > 1e6) return;
    const double depth = camera.world_to_camera(place).z();
    const int reach = int(1.15 * camera.focal_length() * radius / depth + 3.0 * blur) + 3;
    const cv::Rect box(int(pixel.x()) - reach, int(pixel.y()) - reach, 2 * reach + 1, 2 * reach + 1);
    near(box & cv::Rect(0, 0, near.cols, near.rows)).setTo(1);
  };
  for (const PaintedDot& dot : scene.dots)
    mark(weighted(scene.vertices, scene.rest.triangles[std::size_t(dot.triangle)], dot.weights), dot.radius);
  if (scene.probe)
    for (const double back : {scene.probe->shape.tip, scene.probe->shape.tip + scene.probe->shape.dots_apart})
      mark(scene.probe->pose.tip - back * scene.probe->pose.direction, scene.probe->bead_radius);
  return near;
}

Colour pixel_colour(const Painter& painter, const Rays& rays, int u, int v, const PhotoQuality& quality) {
  const int n = quality.samples;
  Colour sum = Colour::Zero();
  for (int k = 0; k < n * n; ++k) {
    const std::uint64_t key = ((std::uint64_t(v) << 32) | std::uint64_t(u)) * 512 + std::uint64_t(2 * k);
    const double x = u - 0.5 + (k % n + unit_random(key)) / n, y = v - 0.5 + (k / n + unit_random(key + 1)) / n;
    sum += painter.colour(rays.origin(), rays.direction(x, y));
  }
  return sum / float(n * n);
}

Image<Rgb> developed(cv::Mat3f picture, const PhotoQuality& quality) {
  if (quality.blur > 0) cv::GaussianBlur(picture, picture, {0, 0}, quality.blur);
  if (quality.noise > 0) {
    cv::Mat3f noise(picture.size());
    cv::RNG(quality.seed * 0x9e3779b97f4a7c15ULL + 1).fill(noise, cv::RNG::NORMAL, 0.0, quality.noise);
    picture += noise;
  }
  Image<Rgb> out(picture.cols, picture.rows);
  each_row(picture.rows, [&](int v) {
    for (int u = 0; u < picture.cols; ++u)
      for (int k = 0; k < 3; ++k) out(u, v)[std::size_t(k)] = cv::saturate_cast<std::uint8_t>(picture(v, u)[k]);
  });
  return out;
}

}  // namespace

Image<Rgb> take_photograph(const PaintedScene& scene, const LensCamera& camera, const PhotoQuality& quality) {
  if (quality.samples < 1 || quality.samples > 16 || quality.blur < 0 || quality.noise < 0)
    throw std::invalid_argument("take_photograph: quality out of range");
  if (scene.vertices.size() != scene.rest.vertices.size())
    throw std::invalid_argument("take_photograph: one place a vertex");
  const Painter painter(scene);
  const Rays rays(camera);
  cv::Mat3f picture = coarse_picture(painter, rays, camera.width, camera.height);
  const cv::Mat1b near = pixels_near_dots(scene, camera, quality.blur);
  each_row(camera.height, [&](int v) {
    for (int u = 0; u < camera.width; ++u)
      if (near(v, u)) picture(v, u) = to_cv(pixel_colour(painter, rays, u, v, quality));
  });
  return developed(picture, quality);
}

namespace {

// Where oblique views from all sides see the middle: from direction d that of the areas' shadows, moment d / (area .
// d).
Vector3 seen_middle(const Matrix3& moment, const Vector3& area) {
  constexpr double slope = 0.8;
  const Vector3 normal = area.normalized(), along = normal.unitOrthogonal(), across = normal.cross(along);
  Matrix3 matrix = Matrix3::Zero();
  Vector3 side = Vector3::Zero();
  for (const Vector3& lean : {along, across, Vector3(-along), Vector3(-across)}) {
    const Vector3 direction = (normal + slope * lean).normalized();
    const Matrix3 flat = Matrix3::Identity() - direction * direction.transpose();
    matrix += flat;
    side += flat * moment * direction / area.dot(direction);
  }
  return matrix.ldlt().solve(side);
}

}  // namespace

Points dot_centres(const PaintedScene& scene) {
  constexpr int parts = 40;  // of a triangle's edge
  Points out = Points::Zero(Eigen::Index(scene.dots.size()), 3);
  for (std::size_t i = 0; i < scene.dots.size(); ++i) {
    const PaintedDot& dot = scene.dots[i];
    const Vector3 middle = weighted(scene.rest.vertices, scene.rest.triangles[std::size_t(dot.triangle)], dot.weights);
    Vector3 area = Vector3::Zero();    // and its direction
    Matrix3 moment = Matrix3::Zero();  // sum of place times area
    for (const auto& corners : scene.rest.triangles) {
      if (!may_reach(scene.rest, corners, middle, dot.radius)) continue;
      const Vector3& a = scene.vertices[std::size_t(corners[0])];
      const Vector3 share =
          (scene.vertices[std::size_t(corners[1])] - a).cross(scene.vertices[std::size_t(corners[2])] - a);
      for (int j = 0; j < parts; ++j)
        for (int k = 0; k < parts; ++k) {  // middles of the small triangles, upright and upside down
          const bool upright = j + k < parts;
          const double third = upright ? 1.0 / 3.0 : -1.0 / 3.0;
          const double u = ((upright ? j : parts - j) + third) / parts, v = ((upright ? k : parts - k) + third) / parts;
          const Vector3 weights(1.0 - u - v, u, v);
          if ((weighted(scene.rest.vertices, corners, weights) - middle).squaredNorm() > dot.radius * dot.radius)
            continue;
          area += share;
          moment += weighted(scene.vertices, corners, weights) * share.transpose();
        }
    }
    out.row(Eigen::Index(i)) = seen_middle(moment, area);
  }
  return out;
}

namespace {

// A dome: half axes, and how wide a press is.
const Vector3 half_axes(0.09, 0.06, 0.08);
constexpr double press_width = 0.03, distance_of_cameras = 0.9, stiffness_of_press = 250.0;  // [m], [m], [N/m]
constexpr double time_between = 2.0, sample_rate = 100.0;                                    // [s], [Hz]
const Vector3 view_axis = Vector3(0.0, 1.0, 0.5).normalized();

TriangleMesh dome() {
  TriangleMesh mesh = make_sphere(1.0, 5);
  for (Vector3& vertex : mesh.vertices) vertex = vertex.cwiseProduct(half_axes);
  return mesh;
}

// About the middle of an object, as far away as it is large.
std::vector<LensCamera> example_cameras(int width, int height, const Vector3& middle, double scale) {
  std::vector<LensCamera> cameras;
  const Vector3 along = view_axis.unitOrthogonal();
  const char* const sides[] = {"left", "right", "top"};
  for (int k = 0; k < 3; ++k) {
    const Vector3 axis = Eigen::AngleAxisd((20.0 + 120.0 * k) * degree, view_axis) * along;
    const Vector3 eye =
        middle + scale * distance_of_cameras * (Eigen::AngleAxisd((22.0 + 2.0 * k) * degree, axis) * view_axis);
    const double focal = 2.0 * width;
    const PinholeCamera pinhole =
        look_at(eye, middle + scale * Vector3(0.002 * k, 0.03, 0.01), Vector3(0.1 * k, 1.0, 0.05), width, height,
                2.0 * std::atan(0.5 * height / focal));
    LensCamera camera;
    camera.name = sides[k];
    camera.width = width;
    camera.height = height;
    camera.camera_matrix << focal, 0.0, 0.5 * width + 11.3 * k, 0.0, 1.002 * focal, 0.5 * height - 7.7, 0.0, 0.0, 1.0;
    camera.lens = LensDistortion({-0.25 + 0.02 * k, 0.11, 8e-4, -5e-4, -0.03});
    camera.world_to_camera = pinhole.camera_to_world.inverse();
    cameras.push_back(camera);
  }
  return cameras;
}

Vector3 outward(const Vector3& place) { return place.cwiseQuotient(half_axes.cwiseProduct(half_axes)).normalized(); }

// Dots at random places that all cameras see not too obliquely, none too near another.
std::vector<PaintedDot> scatter_dots(const TriangleMesh& mesh, const std::vector<LensCamera>& cameras,
                                     const PhotoExampleOptions& options,
                                     const std::function<Vector3(const PaintedDot&, const Vector3&)>& normal) {
  RayScene rays;
  rays.add(mesh);
  std::mt19937_64 random(options.seed);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  std::vector<double> sums;
  double area = 0.0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vector3& corner = mesh.vertices[std::size_t(a)];
    area += 0.5 * (mesh.vertices[std::size_t(b)] - corner).cross(mesh.vertices[std::size_t(c)] - corner).norm();
    sums.push_back(area);
  }
  const auto is_seen = [&](const PaintedDot& dot, const Vector3& place) {
    const Vector3 out = normal(dot, place);
    return std::ranges::all_of(cameras, [&](const LensCamera& camera) {
      const Vector3 way = camera.centre() - place;
      return out.dot(way.normalized()) > std::cos(63.0 * degree) && !rays.is_blocked(place, way, 0.005, 1.0);
    });
  };
  constexpr int tries = 200'000;
  double apart = 1.5 * std::sqrt(0.4 * area / options.dots);
  std::vector<PaintedDot> dots;
  std::vector<Vector3> places;
  for (int k = 0; k < tries && int(dots.size()) < options.dots; ++k) {
    if (k % 2000 == 1999) apart *= 0.97;
    const std::size_t t =
        std::min(std::size_t(std::ranges::lower_bound(sums, share(random) * area) - sums.begin()), sums.size() - 1);
    double u = share(random), v = share(random);
    if (u + v > 1.0) {
      u = 1.0 - u;
      v = 1.0 - v;
    }
    const PaintedDot dot{int(t), {1.0 - u - v, u, v}, 0.5 * options.dot_diameter};
    Vector3 place = Vector3::Zero();
    for (int i = 0; i < 3; ++i) place += dot.weights[i] * mesh.vertices[std::size_t(mesh.triangles[t][std::size_t(i)])];
    const double least = std::max(apart, 1.6 * options.dot_diameter);
    if (!is_seen(dot, place) ||
        std::ranges::any_of(places, [&](const Vector3& p) { return (p - place).norm() < least; }))
      continue;
    dots.push_back(dot);
    places.push_back(place);
  }
  if (int(dots.size()) < options.dots)
    throw std::invalid_argument(fmt::format("PhotoExample: there is room for {} dots only", dots.size()));
  return dots;
}

}  // namespace

namespace {

// Pushed in obliquely: much of the motion is along the surface.
PressedObject pressed_dome(const std::vector<double>& depths) {
  PressedObject object;
  object.name = "painted dome, pressed at two places";
  const TriangleMesh mesh = dome();
  object.scene.object.surface = mesh;
  object.scene.object.density = 60.0;
  object.scene.world.gravity = {0.0, -9.81, 0.0};
  object.scene.fixed.push_back({RegionHalfSpace{{0.0, -0.03, 0.0}, {0.0, -1.0, 0.0}}, {}});
  for (const auto& [up, tilt] : {std::pair(Vector3(0.25, 1.0, 0.35), Vector3(0.45, 0.0, -0.3)),
                                 std::pair(Vector3(-0.45, 1.0, 0.3), Vector3(-0.2, 0.0, -0.5))})
    for (const double depth : depths) {
      const Vector3 ray = up.normalized(), place = ray / ray.cwiseQuotient(half_axes).norm();
      PressedObject::Press press;
      press.contact = place, press.direction = (-outward(place) + tilt).normalized();
      press.shift = depth * press.direction, press.force = stiffness_of_press * depth;
      press.role = object.presses.size() % 3 == 2 ? "test" : "fit";
      press.vertices = mesh.vertices;
      for (Vector3& vertex : press.vertices) {
        const double fade = std::clamp((vertex.y() + 0.03) / 0.02, 0.0, 1.0);
        const double squared = (vertex - place).squaredNorm() / (press_width * press_width);
        vertex += fade * depth * std::exp(-0.5 * squared) * press.direction;
      }
      object.presses.push_back(std::move(press));
    }
  return object;
}

}  // namespace

PhotoExample::PhotoExample(const PhotoExampleOptions& options) : PhotoExample(options, pressed_dome(options.depths)) {}

PhotoExample::PhotoExample(const PhotoExampleOptions& options, PressedObject object)
    : options_(options), presses_(std::move(object.presses)) {
  painted_.rest = *object.scene.object.surface;
  painted_.vertices = painted_.rest.vertices;
  const Box box = bounding_box(painted_.rest);
  const Vector3 middle = 0.5 * (box.min + box.max);
  const double scale = 0.5 * box.extent().maxCoeff() / half_axes.maxCoeff();
  painted_.lamp = middle + scale * Vector3(0.5, 0.7, 0.2);
  session_.name = object.name;
  session_.file = "markers.toml";
  session_.scene = std::move(object.scene);
  session_.scene.object.file = "rest.ply";
  session_.cameras = example_cameras(options.width, options.height, middle, scale);
  for (const LensCamera& camera : session_.cameras) session_.images.push_back({camera.name + "/%03d.png"});
  session_.markers = {DotColour::Dark, options.dot_diameter, 0.1};
  session_.probe_dots = {DotColour::Red, 0.008, 0.1};
  session_.probe = {0.05, 0.06, object.probe_radius};
  session_.force_window = 0.2;
  session_.greatest_gap = 0.5;
  const std::vector<Vector3> normals = vertex_normals(painted_.rest);
  painted_.dots =
      scatter_dots(painted_.rest, session_.cameras, options, [&](const PaintedDot& dot, const Vector3&) -> Vector3 {
        return weighted(normals, painted_.rest.triangles[std::size_t(dot.triangle)], dot.weights).normalized();
      });
  std::mt19937_64 random(options.seed + 1);
  std::normal_distribution<double> noise(0.0, 0.02);
  for (std::size_t k = 0; k < presses_.size(); ++k) {
    PhotographedPress& own = session_.presses.emplace_back();
    own.number = int(k) + 1, own.time = time_between * double(k + 1), own.role = presses_[k].role;
    if (presses_[k].contact_is_written) own.contact = presses_[k].contact;
  }
  for (int i = 0; i < int(sample_rate * time_between * double(presses_.size() + 1)); ++i) {
    const double time = i / sample_rate;
    const int number = int(std::lround(time / time_between));
    const bool holds = number >= 1 && number <= int(presses_.size()) && std::abs(time - time_between * number) < 0.5;
    session_.log.times.push_back(time);
    session_.log.forces.push_back((holds ? force(number) : 0.0) + noise(random));
  }
}

const PressedObject::Press& PhotoExample::press(int number) const { return presses_.at(std::size_t(number) - 1); }
Vector3 PhotoExample::contact(int number) const { return press(number).contact; }
double PhotoExample::force(int number) const { return press(number).force; }

PaintedScene PhotoExample::scene(int number) const {
  PaintedScene out = painted_;
  if (number == 0) return out;
  const PressedObject::Press& own = press(number);
  out.vertices = own.vertices;
  out.probe = PaintedProbe{
      session_.probe, {own.contact + own.shift, own.direction, 0.0}, 0.001, 0.5 * session_.probe_dots.diameter};
  return out;
}

Image<Rgb> PhotoExample::photograph(int camera, int number, PhotoQuality quality) const {
  quality.seed = options_.seed * 1000 + std::uint64_t(number) * 10 + std::uint64_t(camera);
  return take_photograph(scene(number), session_.cameras.at(std::size_t(camera)), quality);
}

void PhotoExample::write(const fs::path& folder) const {
  write_mesh(folder / session_.scene.object.file, *session_.scene.object.surface);
  write_file(folder / "force.csv", [&](std::ostream& out) {
    out << "time,force\n";
    for (std::size_t i = 0; i < session_.log.times.size(); ++i)
      out << fmt::format("{:.3f},{:.4f}\n", session_.log.times[i], session_.log.forces[i]);
  });
  write_file(folder / "times.csv", [&](std::ostream& out) {
    out << "number,time\n";
    for (const PhotographedPress& own : session_.presses) out << own.number << ',' << own.time << '\n';
  });
  for (std::size_t c = 0; c < session_.cameras.size(); ++c) {
    write_lens_camera(folder / (session_.cameras[c].name + ".yml"), session_.cameras[c]);
    for (int number = 0; number <= int(presses_.size()); ++number)
      write_png(folder / session_.images[c](number), photograph(int(c), number));
  }
  for (int number = 0; number <= int(presses_.size()); ++number) {
    MarkerPositions truth{{}, dot_centres(scene(number))};
    for (std::size_t i = 0; i < painted_.dots.size(); ++i) truth.ids.push_back(fmt::format("dot{:03}", i));
    write_marker_positions(folder / fmt::format("truth/{:03}.csv", number), truth);
  }
  write_file(folder / "markers.toml", [&](std::ostream& out) {
    out << "format = \"markers/1\"\nname = " << toml_text(session_.name) << "\n\n";
    write_toml(out, session_.scene.object, session_.scene.object.file.string());
    write_toml(out, session_.scene.world);
    write_toml_blocks(out, session_.scene);
    out << "[markers]\ncolour = \"dark\"\ndiameter = " << toml_text(session_.markers.diameter)
        << "\n\n[probe]\ncolour = \"red\"\ndiameter = " << toml_text(session_.probe_dots.diameter)
        << "\ndots_apart = " << toml_text(session_.probe.dots_apart) << "\ntip = " << toml_text(session_.probe.tip)
        << "\nradius = " << toml_text(session_.probe.radius)
        << "\n\n[force]\nlog = \"force.csv\"\ntimes = \"times.csv\"\nwindow = " << toml_text(session_.force_window)
        << "\n\n";
    for (std::size_t c = 0; c < session_.cameras.size(); ++c)
      out << "[[camera]]\nname = " << toml_text(session_.cameras[c].name)
          << "\ncalibration = " << toml_text(session_.cameras[c].name + ".yml")
          << "\nimages = " << toml_text(session_.images[c].pattern) << "\n\n";
    out << "[rest]\nnumber = 0\n\n";
    for (const PhotographedPress& own : session_.presses)
      out << "[[press]]\nnumber = " << own.number << "\nrole = " << toml_text(own.role) << "\n"
          << (own.contact ? "contact = " + toml_text(*own.contact) + "\n" : "") << "\n";
  });
}

}  // namespace pliant
