#include "report/picture.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <stdexcept>

#include "base/parallel.hpp"
#include "rays/look_at.hpp"
#include "rays/ray_scene.hpp"

namespace pliant {

namespace {

using Colour = Eigen::Array3d;  // linear light, 0..1

constexpr double pi = std::numbers::pi;
constexpr double key_spread = 0.22;  // radius of the key light at distance 1: how soft shadows are

Colour from_srgb(double r, double g, double b) {
  return Colour(r, g, b).unaryExpr([](double c) { return std::pow(c / 255.0, 2.2); });
}

uint8_t to_srgb(double linear) {
  return uint8_t(std::lround(255.0 * std::pow(std::clamp(linear, 0.0, 1.0), 1.0 / 2.2)));
}

Rgb to_srgb(const Colour& c) { return {to_srgb(c[0]), to_srgb(c[1]), to_srgb(c[2])}; }

// Numbers in [0, 1) that look random but follow from the pixel and the sample alone.
double hash_number(uint32_t a, uint32_t b, uint32_t c) {
  uint32_t h = a * 0x9E3779B1u ^ b * 0x85EBCA77u ^ c * 0xC2B2AE3Du;
  h = (h ^ h >> 15) * 0x2C1B3C6Du;
  h = (h ^ h >> 12) * 0x297A2D39u;
  return double((h ^ h >> 15) >> 8) * 0x1p-24;
}

// Four numbers in [0, 1): the rays of one pixel share an even sequence (Roberts' R4), shifted from pixel to pixel.
std::array<double, 4> spread_numbers(uint32_t pixel, uint32_t ray) {
  constexpr std::array<double, 4> steps{0.8566748838545029, 0.7338918566271260, 0.6287067210378087, 0.5385972572236101};
  std::array<double, 4> numbers;
  for (uint32_t k = 0; k < 4; ++k) {
    const double sum = hash_number(pixel, k, 1) + steps[k] * (ray + 1.0);
    numbers[k] = sum - std::floor(sum);
  }
  return numbers;
}

// Cosine and sine of a part of the full turn, [0, 1), to a few degrees: directions of rays that are spread anyway.
std::array<double, 2> turned(double part) {
  constexpr std::size_t count = 128;
  static const std::array<std::array<double, 2>, count> table = [] {
    std::array<std::array<double, 2>, count> all;
    for (std::size_t k = 0; k < count; ++k)
      all[k] = {std::cos(2.0 * pi * (double(k) + 0.5) / count), std::sin(2.0 * pi * (double(k) + 0.5) / count)};
    return all;
  }();
  return table[std::min(count - 1, std::size_t(part * count))];
}

// A value of 1, 2 or 5 times a power of ten that is not below `value`.
double round_up_nicely(double value) {
  const double decade = std::pow(10.0, std::floor(std::log10(value)));
  for (const double step : {1.0, 2.0, 5.0})
    if (step * decade >= value * (1.0 - 1e-9)) return step * decade;
  return 10.0 * decade;
}

Vector3 scene_up(const PictureScene& scene) {
  return scene.planes.empty() ? Vector3::UnitY() : scene.planes.front().normal;
}

class Painter {
 public:
  Painter(const PictureScene& scene, const PinholeCamera& camera, const PictureOptions& options)
      : scene_(scene), camera_(camera), options_(options), up_(scene_up(scene)) {
    TriangleMesh mesh;
    for (Eigen::Index i = 0; i < scene.surface.rows(); ++i) {
      mesh.vertices.emplace_back(scene.surface.row(i));
      box_.extend(mesh.vertices.back());
    }
    mesh.triangles = scene.triangles;
    for (const Rgb& c : scene.colours) colours_.push_back(from_srgb(c[0], c[1], c[2]));
    normals_ = vertex_normals(mesh);
    rays_.add(mesh);
    if (scene.about) box_ = *scene.about;
    const bool is_empty = mesh.vertices.empty() && !scene.about;
    size_ = is_empty ? 1.0 : box_.extent().norm();
    centre_ = is_empty ? Vector3::Zero().eval() : (0.5 * (box_.min + box_.max)).eval();
    grid_ = grid_spacing(box_);
    // the key light comes over the viewer's left shoulder
    const Matrix3& r = camera.camera_to_world.rotation;
    key_ = (1.1 * up_ - 0.55 * r.col(0) - 0.45 * r.col(2)).normalized();
  }

  /// What a pixel's middle shows.
  struct Look {
    int what = 0;                // 0: sky, 1: the object, 2 and on: the planes
    bool is_even = true;         // nothing changes quickly there: no shadow, no grid line
    std::array<long, 2> cell{};  // of the grid
    Colour colour = Colour::Zero();
    bool is_as_even_as(const Look& other) const {
      return is_even && other.is_even && what == other.what && cell == other.cell;
    }
  };
  Look look(int u, int v) const {
    const View seen = view(u, v);
    Look look;
    look.colour = colour(seen, v, uint32_t(v) * 65536u + uint32_t(u), 0);
    if (seen.object) return look.what = 1, look.is_even = false, look;
    if (!seen.plane || fade(seen.point, *seen.plane) <= 0.0) return look;
    look.what = 2 + int(seen.plane - scene_.planes.data());
    look.is_even = !on_grid_line(seen.point, *seen.plane) && is_far_from_shadow(seen.point, floor_reach());
    const auto axes = grid_axes(*seen.plane);
    for (std::size_t k = 0; k < 2; ++k)
      look.cell[k] = std::lround(std::floor(axes[k].dot(seen.point - seen.plane->point) / grid_));
    return look;
  }

  /// Of as many rays as the options ask for.
  Colour pixel(int u, int v) const {
    Colour sum = Colour::Zero();
    const int n = options_.samples;
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i)
        sum += colour(view(u + (i + 0.5) / n - 0.5, v + (j + 0.5) / n - 0.5), v + (j + 0.5) / n - 0.5,
                      uint32_t(v) * 65536u + uint32_t(u), uint32_t(j * n + i));
    return sum / double(n * n);
  }

  // Discs of the observed points; hidden ones are left out.
  struct Disc {
    double u, v;
    Colour colour;
  };
  std::vector<Disc> discs() const {
    const double range = options_.residual_range > 0.0 ? options_.residual_range : residual_range(scene_.residuals);
    // a random part, not every n-th: the points come row by row from an image
    const double part = double(options_.max_points) / std::max<double>(1.0, double(scene_.points.size()));
    std::vector<Disc> discs;
    for (size_t i = 0; i < scene_.points.size(); ++i) {
      if (hash_number(uint32_t(i), 0, 2) >= part) continue;
      const Vector3 seen = camera_.project(scene_.points[i]);
      if (seen.z() <= 0.0 || is_hidden(scene_.points[i])) continue;
      const Rgb c = scene_.residuals.empty() ? Rgb{30, 120, 110} : diverging_colour(scene_.residuals[i] / range);
      discs.push_back({seen.x(), seen.y(), from_srgb(c[0], c[1], c[2])});
    }
    return discs;
  }

 private:
  struct FloorHit {
    double distance;
    const Plane* plane;
  };

  bool is_hidden(const Vector3& point) const {
    const Vector3 eye = camera_.camera_to_world.translation, to_point = point - eye;
    const double distance = to_point.norm(), slack = 0.06 * size_;  // points a little inside the surface still show
    return rays_.is_blocked(eye, to_point / distance, 0.0, distance - slack);
  }

  std::optional<FloorHit> floor(const Vector3& eye, const Vector3& direction) const {
    std::optional<FloorHit> nearest;
    for (const Plane& plane : scene_.planes) {
      const double along = plane.normal.dot(direction), height = plane.normal.dot(eye - plane.point);
      if (along >= -1e-9 || height <= 0.0) continue;  // seen from behind: glass
      if (const double distance = -height / along; !nearest || distance < nearest->distance)
        nearest = FloorHit{distance, &plane};
    }
    return nearest;
  }

  /// What a ray meets first: the object, a plane, or neither.
  struct View {
    Vector3 direction, point;
    std::optional<RayHit> object;
    const Plane* plane = nullptr;
  };
  View view(double u, double v) const {
    const Vector3 eye = camera_.camera_to_world.translation;
    View view;
    view.direction = (camera_.unproject(u, v, 1.0) - eye).normalized();
    const auto hit = rays_.cast(eye, view.direction);
    const auto ground = floor(eye, view.direction);
    if (hit && (!ground || hit->distance < ground->distance + 1e-6 * size_)) {
      view.object = hit;
      view.point = eye + hit->distance * view.direction;
    } else if (ground) {
      view.plane = ground->plane;
      view.point = eye + ground->distance * view.direction;
    }
    return view;
  }

  Colour colour(const View& view, double v, uint32_t pixel, uint32_t index) const {
    if (view.object) return object_colour(view.point, *view.object, view.direction, pixel, index);
    const Colour sky = background(v);
    return view.plane ? floor_colour(view.point, *view.plane, sky, pixel, index) : sky;
  }

  Colour background(double v) const {
    static const Colour above = from_srgb(238, 242, 246), below = from_srgb(250, 250, 249);
    const double t = std::clamp(v / std::max(1, camera_.height - 1), 0.0, 1.0);
    return (1.0 - t) * above + t * below;
  }

  // Part of the sky above a surface that is not covered by the object, cosine weighted, and the part of the broad key
  // light that reaches it.
  struct Light {
    double sky, key;
  };
  Light light(const Vector3& point, const Vector3& normal, double reach, uint32_t pixel, uint32_t index) const {
    if (is_far_from_shadow(point, reach)) return {1.0, 1.0};
    const Vector3 a = normal.unitOrthogonal(), b = normal.cross(a);
    const Vector3 ka = key_.unitOrthogonal(), kb = key_.cross(ka);
    const Vector3 start = point + 1e-4 * size_ * normal;
    int open = 0, lit = 0;
    const int n = options_.light_rays;
    for (int k = 0; k < n; ++k) {
      const auto [r1, r2, r3, r4] = spread_numbers(pixel, index * uint32_t(n) + uint32_t(k));
      const double radius = std::sqrt(r1), spread = key_spread * std::sqrt(r3);
      const auto [cosine, sine] = turned(r2);
      const Vector3 to_sky = radius * (cosine * a + sine * b) + std::sqrt(1.0 - r1) * normal;
      open += !rays_.is_blocked(start, to_sky, 0.0, reach);
      const auto [key_cosine, key_sine] = turned(r4);
      const Vector3 to_key = key_ + spread * (key_cosine * ka + key_sine * kb);
      lit += normal.dot(to_key) > 0.0 && !rays_.is_blocked(start, to_key, 0.0, 1e3 * size_);
    }
    return {double(open) / n, double(lit) / n};
  }

  // Whether the sphere around the object is out of reach and clear of the cone towards the key light.
  bool is_far_from_shadow(const Vector3& point, double reach) const {
    const Vector3 to_centre = centre_ - point;
    const double radius = 0.5 * size_, distance = to_centre.norm();
    if (distance < radius + reach) return false;
    const double aside = std::acos(std::clamp(to_centre.dot(key_) / distance, -1.0, 1.0));
    return aside > std::asin(radius / distance) + std::atan(key_spread);
  }

  Vector3 smooth_normal(const RayHit& hit) const {
    const auto& [a, b, c] = scene_.triangles[hit.triangle];
    const Vector3 n = (1.0 - hit.u - hit.v) * normals_[a] + hit.u * normals_[b] + hit.v * normals_[c];
    return n.norm() > 1e-9 ? n.normalized() : hit.normal;
  }

  Colour albedo(const RayHit& hit) const {
    static const Colour grey = from_srgb(176, 182, 190);
    if (scene_.colours.empty()) return grey;
    Colour sum = Colour::Zero();
    const double share[] = {1.0 - hit.u - hit.v, hit.u, hit.v};
    for (std::size_t k = 0; k < 3; ++k) {
      sum += share[k] * colours_[std::size_t(scene_.triangles[hit.triangle][k])];
    }
    return sum;
  }

  Colour object_colour(const Vector3& point, const RayHit& hit, const Vector3& direction, uint32_t pixel,
                       uint32_t index) const {
    Vector3 normal = smooth_normal(hit), face = hit.normal;
    if (face.dot(direction) > 0.0) normal = -normal, face = -face;
    const Light light_here = light(point, face, 0.6 * size_, pixel, index);
    const double height = 0.5 + 0.5 * normal.dot(up_);
    static const Colour sky = from_srgb(222, 232, 245), ground = from_srgb(196, 184, 172),
                        key = from_srgb(255, 246, 232);
    const Colour ambient = (0.35 + 0.65 * light_here.sky) * ((1.0 - height) * ground + height * sky);
    const double facing = std::max(0.0, normal.dot(key_));
    const Vector3 half = (key_ - direction).normalized();
    const double shine = 0.05 * std::pow(std::max(0.0, normal.dot(half)), 24.0) * light_here.key;
    const Colour lit = 0.62 * ambient + 0.75 * light_here.key * facing * key;
    const double even = options_.even_light;
    return albedo(hit) * (even + (1.0 - even) * lit) + (1.0 - even) * shine;
  }

  Colour floor_colour(const Vector3& point, const Plane& plane, const Colour& sky, uint32_t pixel,
                      uint32_t index) const {
    static const Colour plain = from_srgb(243, 242, 239);
    const double f = fade(point, plane);
    if (f <= 0.0) return sky;
    const Light light_here = light(point, plane.normal, floor_reach(), pixel, index);
    const double shade = (0.45 + 0.55 * light_here.sky) * (0.72 + 0.28 * light_here.key);
    const double line = on_grid_line(point, plane) ? 0.80 : 1.0;
    const double soft = f * f * (3.0 - 2.0 * f);
    return soft * shade * line * plain + (1.0 - soft) * sky;
  }

  double floor_reach() const { return 0.8 * size_; }

  /// One near the object, zero far away, where the floor is not drawn.
  double fade(const Vector3& point, const Plane& plane) const {
    const Vector3 from_centre = point - centre_;
    const Vector3 within = from_centre - plane.normal.dot(from_centre) * plane.normal;
    return std::clamp(1.6 - within.norm() / (1.3 * size_), 0.0, 1.0);
  }

  /// Directions of the grid, which follow the world's axes where the plane allows it.
  static std::array<Vector3, 2> grid_axes(const Plane& plane) {
    Eigen::Index least;
    plane.normal.cwiseAbs().minCoeff(&least);
    const Vector3 b = plane.normal.cross(Vector3::Unit(least)).normalized();
    return {b.cross(plane.normal), b};
  }

  bool on_grid_line(const Vector3& point, const Plane& plane) const {
    const double half_width = 0.006 * grid_;
    for (const Vector3& axis : grid_axes(plane)) {
      const double lines = axis.dot(point - plane.point) / grid_;
      if (std::abs(lines - std::floor(lines + 0.5)) * grid_ < half_width) return true;
    }
    return false;
  }

  const PictureScene& scene_;
  const PinholeCamera& camera_;
  const PictureOptions& options_;
  Vector3 up_, key_, centre_;
  Box box_;
  double size_ = 1.0, grid_ = 0.1;
  std::vector<Vector3> normals_;
  std::vector<Colour> colours_;  // of the vertices, if they have any
  RayScene rays_;
};

void check(const PictureScene& scene, const PictureOptions& options) {
  if (!scene.residuals.empty() && scene.residuals.size() != scene.points.size())
    throw std::invalid_argument("draw: as many residuals as points are needed, or none");
  if (!scene.colours.empty() && scene.colours.size() != std::size_t(scene.surface.rows()))
    throw std::invalid_argument("draw: as many colours as vertices are needed, or none");
  if (options.samples < 1 || options.samples > 8) throw std::invalid_argument("draw: samples must be 1..8");
  if (options.light_rays < 1 || options.light_rays > 64) throw std::invalid_argument("draw: light_rays must be 1..64");
  if (!(options.even_light >= 0.0 && options.even_light <= 1.0))
    throw std::invalid_argument("draw: even_light must be 0..1");
  if (options.max_points < 1) throw std::invalid_argument("draw: max_points must be at least 1");
}

// How much of a pixel a disc covers, by the distance of their centres; smooth over one pixel at the rim.
double coverage(double distance, double radius) { return std::clamp(radius + 0.5 - distance, 0.0, 1.0); }

void paint_disc(std::vector<Colour>& canvas, const PinholeCamera& camera, const Painter::Disc& disc, double radius) {
  const double rim = 0.5, rim_darkness = radius > 1.5 ? 0.5 : 0.3, reach = radius + rim + 1.0;
  const int u0 = std::max(0, int(std::ceil(disc.u - reach))), u1 = std::min(camera.width - 1, int(disc.u + reach));
  const int v0 = std::max(0, int(std::ceil(disc.v - reach))), v1 = std::min(camera.height - 1, int(disc.v + reach));
  for (int v = v0; v <= v1; ++v)
    for (int u = u0; u <= u1; ++u) {
      Colour& pixel = canvas[size_t(v) * camera.width + u];
      const double distance = std::hypot(u - disc.u, v - disc.v);
      pixel *= 1.0 - rim_darkness * coverage(distance, radius + rim);  // dark rim: white discs show on a light surface
      const double inside = coverage(distance, radius);
      pixel = (1.0 - inside) * pixel + inside * disc.colour;
    }
}

// So large that discs spread evenly over what they cover leave most of it free.
double automatic_radius(const PinholeCamera& camera, const std::vector<Painter::Disc>& discs) {
  Eigen::AlignedBox2d box;
  for (const Painter::Disc& disc : discs) box.extend(Eigen::Vector2d(disc.u, disc.v));
  const double covered = discs.empty() ? 0.0 : 0.6 * (box.sizes().array() + 1.0).prod();
  const double spacing = std::sqrt(covered / std::max<double>(1.0, double(discs.size())));
  return std::clamp(0.3 * spacing, 0.8, camera.width / 180.0);
}

// Corners of a box.
std::array<Vector3, 8> corners(const Box& box) {
  std::array<Vector3, 8> result;
  for (int i = 0; i < 8; ++i)
    for (int k = 0; k < 3; ++k) result[i][k] = i >> k & 1 ? box.max[k] : box.min[k];
  return result;
}

}  // namespace

double residual_range(const std::vector<double>& residuals) {
  std::vector<double> sizes;
  for (const double r : residuals)
    if (std::isfinite(r)) sizes.push_back(std::abs(r));
  if (sizes.empty()) return 1e-3;
  const auto nth = sizes.begin() + ptrdiff_t(0.95 * double(sizes.size() - 1));
  std::nth_element(sizes.begin(), nth, sizes.end());
  return *nth > 0.0 ? round_up_nicely(*nth) : 1e-3;
}

double grid_spacing(const Box& object) {
  const double size = object.extent().maxCoeff();
  return size > 0.0 && std::isfinite(size) ? round_up_nicely(size / 5.0) : 0.1;
}

Picture draw(const PictureScene& scene, const PinholeCamera& camera, const PictureOptions& options) {
  check(scene, options);
  const Painter painter(scene, camera, options);
  std::vector<Colour> canvas(size_t(camera.width) * camera.height);
  std::vector<Painter::Look> looks(canvas.size());
  const auto at = [&](int u, int v) { return size_t(v) * size_t(camera.width) + size_t(u); };
  parallel_for(0, camera.height, [&](int v) {
    for (int u = 0; u < camera.width; ++u) looks[at(u, v)] = painter.look(u, v);
  });
  // Where a pixel and all around it show the same plain thing, one ray tells what many would.
  const auto is_even = [&](int u, int v) {
    for (int y = std::max(0, v - 1); y <= std::min(camera.height - 1, v + 1); ++y)
      for (int x = std::max(0, u - 1); x <= std::min(camera.width - 1, u + 1); ++x)
        if (!looks[at(x, y)].is_as_even_as(looks[at(u, v)])) return false;
    return true;
  };
  parallel_for(0, camera.height, [&](int v) {
    for (int u = 0; u < camera.width; ++u)
      canvas[at(u, v)] = is_even(u, v) ? looks[at(u, v)].colour : painter.pixel(u, v);
  });
  const std::vector<Painter::Disc> discs = painter.discs();
  const double radius = options.disc_radius > 0.0 ? options.disc_radius : automatic_radius(camera, discs);
  for (const Painter::Disc& disc : discs) paint_disc(canvas, camera, disc, radius);
  Picture picture(camera.width, camera.height);
  std::transform(canvas.begin(), canvas.end(), picture.pixels.begin(), [](const Colour& c) { return to_srgb(c); });
  return picture;
}

PinholeCamera framed(const PinholeCamera& camera, const Box& box, int width, int height) {
  return framed(camera, corners(box), width, height);
}

PinholeCamera framed(const PinholeCamera& camera, std::span<const Vector3> points, int width, int height) {
  PinholeCamera straight = camera;  // a picture shows straight lines straight
  straight.lens = {};
  PinholeCamera result = straight;
  result.width = width, result.height = height;
  Eigen::Array2d low = Eigen::Array2d::Constant(1e300), high = -low;
  bool in_front = true;
  for (const Vector3& point : points) {
    const Vector3 seen = straight.project(point);
    in_front = in_front && seen.z() > 0.0;
    low = low.min(seen.head<2>().array()), high = high.max(seen.head<2>().array());
  }
  const Eigen::Array2d size(width, height);
  double zoom = double(width) / camera.width;
  Eigen::Array2d middle(0.5 * (camera.width - 1), 0.5 * (camera.height - 1));
  if (in_front) {
    zoom = (0.80 * size / (high - low)).minCoeff();
    middle = 0.5 * (low + high);
  }
  result.fx *= zoom, result.fy *= zoom;
  result.cx = (camera.cx - middle.x()) * zoom + 0.5 * (width - 1);
  result.cy = (camera.cy - middle.y()) * zoom + 0.5 * (height - 1);
  return result;
}

PinholeCamera view_of(const Box& box, const Vector3& up, int width, int height, double azimuth, double elevation) {
  Eigen::Index least;
  up.cwiseAbs().minCoeff(&least);
  const Vector3 y = up.normalized(), x = y.cross(Vector3::Unit(least)).normalized(), z = x.cross(y);
  const Vector3 aside = std::sin(azimuth) * x + std::cos(azimuth) * z;
  const Vector3 towards_eye = std::cos(elevation) * aside + std::sin(elevation) * y;
  const Vector3 centre = 0.5 * (box.min + box.max);
  const double distance = 2.6 * std::max(1e-9, box.extent().norm());
  return framed(look_at(centre + distance * towards_eye, centre, y, width, height, 0.5), box, width, height);
}

}  // namespace pliant
