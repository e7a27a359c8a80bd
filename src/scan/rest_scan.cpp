#include "scan/rest_scan.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>

#include "base/files.hpp"
#include "meshing/mesh_distance.hpp"
#include "scan/even_mesh.hpp"
#include "scan/view_hull.hpp"

namespace pliant {

namespace {

constexpr double steep = 0.2;  // of the view's level part: less is a look from above, which needs no mirror

constexpr double shell = 4.0;  // lattice spacings that stay behind readings that contradict the mirror image

struct Reading {
  Vector3 point, normal;
  double noise;
};

std::vector<Reading> readings_of(const std::vector<ViewHull>& hulls) {
  std::vector<Reading> readings;
  for (const ViewHull& hull : hulls)
    for (int v = 0; v < hull.depth().height; ++v)
      for (int u = 0; u < hull.depth().width; ++u) {
        const double z = hull.depth()(u, v);
        if (z > 0) readings.push_back({hull.camera().unproject(u, v, z), hull.normal(u, v), hull.noise(u, v)});
      }
  return readings;
}

/// The solid that the views leave, before it is meshed.
class Solid {
 public:
  Solid(const ScanViews& views, const Vector3& up) : plane_(views.plane) {
    for (const ScanView& view : views.views) hulls_.emplace_back(view);
    readings_ = readings_of(hulls_);
    up_ = plane_ ? plane_->normal : up.normalized();
    Vector3 sum = Vector3::Zero();
    double deviation = 0.0;
    for (const Reading& reading : readings_) {
      centre_ += reading.point / double(readings_.size());
      deviation += reading.noise / double(readings_.size());
    }
    for (const ViewHull& hull : hulls_) {
      const Vector3 view = (centre_ - hull.camera().camera_to_world.translation).normalized();
      sum += (view - view.dot(up_) * up_) / double(hulls_.size());
    }
    if (sum.norm() > steep) ahead_ = sum.normalized();
    foot_ = scan_plane_reach * deviation;
    noise_ = deviation;
  }

  const std::vector<Reading>& readings() const { return readings_; }
  const std::vector<ViewHull>& hulls() const { return hulls_; }
  const Vector3& up() const { return up_; }
  Vector3 ahead() const { return ahead_.value_or(up_.unitOrthogonal()); }
  const std::optional<Vector3>& guessed_direction() const { return ahead_; }
  double noise() const { return noise_; }
  double height(const Vector3& p) const { return up_.dot(p - plane_->point); }

  void set_mirror(const Plane& mirror, double thickness, bool limits_depth) {
    shell_ = thickness + 2.0 * noise_;
    mirror_ = mirror;
    limits_depth_ = limits_depth;
    for (const Reading& reading : readings_) {
      const double excess = mirrored_value(reading.point) - 2.0 * noise_;
      if (excess <= 0.0) continue;
      spared_.push_back({reading.point, excess});
      most_excess_ = std::max(most_excess_, excess);
    }
  }
  double spared_share() const { return double(spared_.size()) / double(readings_.size()); }

  /// Negative inside; not a distance far from the surface, but of its order near it [m].
  double value(Vector3 p) const {
    const double above = plane_ ? height(p) : std::numeric_limits<double>::max();
    if (above < foot_) p += (foot_ - above) * up_;
    double result = seen_value(p);
    if (mirror_) {
      result = std::max(result, completed_value(p));
      for (const ViewHull& hull : hulls_) result = std::max(result, limits_depth_ ? hull.beyond_back(p) : result);
    }
    return std::max(result, -above);
  }

  double seen_value(const Vector3& p) const {
    double result = -std::numeric_limits<double>::max();
    for (const ViewHull& hull : hulls_) result = std::max(result, hull.value(p));
    return result;
  }
  double mirrored_value(const Vector3& p, const Plane& mirror) const {
    return seen_value(p - 2.0 * mirror.normal.dot(p - mirror.point) * mirror.normal);
  }

 private:
  struct Spared {
    Vector3 point;
    double excess;
  };

  double mirrored_value(const Vector3& p) const { return mirrored_value(p, *mirror_); }

  // The mirrored part, pushed out where it would cut off what was seen: a shell stays behind those readings.
  double completed_value(const Vector3& p) const {
    const double cut = mirrored_value(p);
    double pushed = 0.0;
    if (cut > 0.0 && cut < most_excess_ + shell_)
      for (const Spared& spared : spared_)
        pushed = std::max(pushed, spared.excess + shell_ - (p - spared.point).norm());
    return cut - pushed;
  }

  std::optional<Plane> plane_, mirror_;
  std::vector<ViewHull> hulls_;
  std::vector<Reading> readings_;
  std::vector<Spared> spared_;
  Vector3 up_ = Vector3::UnitY(), centre_ = Vector3::Zero();
  std::optional<Vector3> ahead_;
  bool limits_depth_ = true;
  double foot_ = 0.0, noise_ = 0.0, most_excess_ = 0.0, shell_ = 0.0;
};

// How badly the mirrored part fits, 0..1: where it cuts readings off, and where both show a surface but not the same.
double mirror_misfit(const Solid& solid, const Plane& mirror, double scale) {
  constexpr std::size_t wanted = 2000;
  constexpr double facing = 0.3;  // cosine to the mirrored view beyond which it would see the surface
  const auto& readings = solid.readings();
  const std::size_t step = std::max<std::size_t>(1, readings.size() / wanted);
  double sum = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < readings.size(); i += step) {
    const auto& [point, normal, noise] = readings[i];
    const double gap = solid.mirrored_value(point, mirror);
    const Vector3 flipped = normal - 2.0 * mirror.normal.dot(normal) * mirror.normal;
    const bool is_facing = std::ranges::any_of(solid.hulls(), [&](const ViewHull& hull) {
      return -flipped.dot((point - hull.camera().camera_to_world.translation).normalized()) > facing;
    });
    if (gap > 0.0 || is_facing) sum += std::min(1.0, std::pow(gap / scale, 2));
    ++count;
  }
  return sum / count;
}

// Of the places that fit about equally well the nearest: the object is no deeper than what was seen asks for.
Plane find_mirror(const Solid& solid, const Vector3& ahead, double spacing) {
  constexpr double slack = 0.05, tolerance = 0.0003;
  std::vector<double> along, across;
  const Vector3 side = ahead.cross(solid.up());
  for (const Reading& reading : solid.readings()) {
    along.push_back(ahead.dot(reading.point));
    across.push_back(side.dot(reading.point));
  }
  std::ranges::sort(along);
  std::ranges::sort(across);
  const double width = across.back() - across.front(), scale = 4.0 * solid.noise() + spacing;
  std::vector<std::pair<double, double>> misfits;
  for (double s = along[along.size() / 20] + 0.1 * width; s < along.back() + 0.5 * width; s += 0.5 * spacing)
    misfits.emplace_back(s, mirror_misfit(solid, {s * ahead, -ahead, true}, scale));
  const double least = std::ranges::min_element(misfits, {}, &std::pair<double, double>::second)->second;
  const auto chosen =
      std::ranges::find_if(misfits, [&](const auto& m) { return m.second <= (1.0 + slack) * least + tolerance; });
  return {chosen->first * ahead, -ahead, true};
}

double triangle_area(const TriangleMesh& mesh, const std::array<int, 3>& t) {
  const Vector3 &a = mesh.vertices[std::size_t(t[0])], &b = mesh.vertices[std::size_t(t[1])],
                &c = mesh.vertices[std::size_t(t[2])];
  return 0.5 * (b - a).cross(c - a).norm();
}

void measure(const Solid& solid, const std::optional<Plane>& plane, RestScan& scan) {
  double seen = 0.0, resting = 0.0, area = 0.0;
  for (const Vector3& vertex : scan.mesh.vertices)
    scan.seen.push_back(std::ranges::any_of(
        solid.hulls(), [&](const ViewHull& hull) { return hull.shows(vertex, 0.75 * scan.spacing); }));
  for (const auto& triangle : scan.mesh.triangles) {
    const double own = triangle_area(scan.mesh, triangle);
    area += own;
    double highest = plane ? -1e300 : 1e300;
    for (const int i : triangle) {
      seen += own / 3.0 * scan.seen[std::size_t(i)];
      if (plane) highest = std::max(highest, solid.height(scan.mesh.vertices[std::size_t(i)]));
    }
    if (highest < 0.25 * scan.spacing) resting += own;
  }
  scan.seen_share = seen / area;
  scan.resting_share = resting / area;
  Box box;
  Matrix3 axes;
  axes << solid.ahead().cross(solid.up()), solid.ahead(), solid.up();
  for (const Vector3& vertex : scan.mesh.vertices) box.extend(axes.transpose() * vertex);
  scan.width = box.extent().x(), scan.depth = box.extent().y(), scan.height = box.extent().z();
  const SignedDistance distance = signed_distance(scan.mesh, 0.5 * scan.spacing, 4.0 * scan.spacing);
  double squares = 0.0;
  for (const Reading& reading : solid.readings()) squares += std::pow(distance.value(reading.point), 2);
  scan.readings = int(solid.readings().size());
  scan.readings_rms = std::sqrt(squares / scan.readings);
}

Box box_of(const Solid& solid, const std::optional<Plane>& mirror) {
  Box box;
  for (const Reading& reading : solid.readings()) {
    box.extend(reading.point);
    if (mirror) box.extend(reading.point - 2.0 * mirror->normal.dot(reading.point - mirror->point) * mirror->normal);
  }
  return box;
}

}  // namespace

RestScan scan_rest_surface(const ScanViews& views, const Vector3& up, const RestScanOptions& options,
                           const std::filesystem::path& place) {
  if (options.resolution < 10 || options.resolution > 200)
    throw std::invalid_argument("scan_rest_surface: the resolution must be 10..200");
  if (options.depth && !(*options.depth > 0.0))
    throw std::invalid_argument("scan_rest_surface: the depth must be positive");
  if (views.views.empty()) throw std::invalid_argument("scan_rest_surface: no view");
  Solid solid(views, up);
  const Box seen = box_of(solid, std::nullopt);
  RestScan scan;
  scan.spacing = seen.extent().maxCoeff() / options.resolution;
  if (const auto& ahead = solid.guessed_direction()) {
    if (options.depth) {
      double nearest = 1e300;
      for (const Reading& reading : solid.readings()) nearest = std::min(nearest, ahead->dot(reading.point));
      scan.mirror = Plane{(nearest + 0.5 * *options.depth) * *ahead, -*ahead, true};
    } else {
      scan.mirror = find_mirror(solid, *ahead, scan.spacing);
    }
    solid.set_mirror(*scan.mirror, shell * scan.spacing, !options.depth);
    scan.kept_from_mirror = solid.spared_share();
  }
  Box box = box_of(solid, scan.mirror);
  if (views.plane)  // down to the plane, also where a look from above sees nothing near it
    for (const Reading& reading : solid.readings())
      box.extend(reading.point - solid.height(reading.point) * solid.up());
  box = grown(box, 0.1 * box.extent().maxCoeff() + 6.0 * scan.spacing);
  scan.mesh = even_mesh([&](const Vector3& p) { return solid.value(p); }, box, scan.spacing, views.plane);
  if (scan.mesh.triangles.empty())
    throw InputError(Problem{{place},
                             "the readings and their mirror image enclose no volume",
                             "an object of which more than one side is seen",
                             "say how deep it is along the view (--depth)"});
  measure(solid, views.plane, scan);
  return scan;
}

void write_scan(const std::filesystem::path& path, const RestScan& scan) {
  const auto write_raw = [](std::ostream& stream, const auto& value) {
    stream.write(reinterpret_cast<const char*>(&value), sizeof value);
  };
  write_file(path, [&](std::ostream& stream) {
    stream << "ply\nformat binary_little_endian 1.0\nelement vertex " << scan.mesh.vertices.size()
           << "\nproperty double x\nproperty double y\nproperty double z\nproperty uchar seen\nelement face "
           << scan.mesh.triangles.size() << "\nproperty list uchar int vertex_indices\nend_header\n";
    for (std::size_t i = 0; i < scan.mesh.vertices.size(); ++i) {
      for (const double x : scan.mesh.vertices[i]) write_raw(stream, x);
      write_raw(stream, std::uint8_t(scan.seen[i]));
    }
    for (const auto& triangle : scan.mesh.triangles) {
      write_raw(stream, std::uint8_t(3));
      for (const int i : triangle) write_raw(stream, std::int32_t(i));
    }
  });
}

}  // namespace pliant
