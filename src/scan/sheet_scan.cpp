#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <unordered_map>

#include "base/median.hpp"
#include "scan/even_mesh.hpp"
#include "scan/rest_scan.hpp"

namespace pliant {

namespace {

constexpr std::size_t least_points = 100;
constexpr int counted_neighbours = 8;  // whose distance says how dense the points lie

/// Points in cells of a lattice, to find those within a cell's width.
class PointCells {
 public:
  PointCells(std::vector<Vector3> points, double width) : points_(std::move(points)), width_(width) {
    for (int i = 0; i < int(points_.size()); ++i) cells_[key(cell(points_[std::size_t(i)]))].push_back(i);
  }

  const std::vector<Vector3>& points() const { return points_; }

  /// Calls visit(number, squared distance) for every point within the width of a cell.
  template <class Visit>
  void near(const Vector3& place, const Visit& visit) const {
    const Eigen::Vector3i middle = cell(place);
    for (int k = -1; k <= 1; ++k)
      for (int j = -1; j <= 1; ++j)
        for (int i = -1; i <= 1; ++i) {
          const auto found = cells_.find(key(middle + Eigen::Vector3i(i, j, k)));
          if (found == cells_.end()) continue;
          for (const int n : found->second) {
            const double d = (points_[std::size_t(n)] - place).squaredNorm();
            if (d <= width_ * width_) visit(n, d);
          }
        }
  }

 private:
  Eigen::Vector3i cell(const Vector3& p) const { return (p / width_).array().floor().cast<int>(); }
  static std::int64_t key(const Eigen::Vector3i& c) {
    constexpr std::int64_t span = 1 << 20;
    return ((c.z() + span / 2) * span + c.y() + span / 2) * span + c.x() + span / 2;
  }

  std::vector<Vector3> points_;
  double width_;
  std::unordered_map<std::int64_t, std::vector<int>> cells_;
};

// Median distance of a point to its eighth neighbour [m].
double typical_reach(const std::vector<Vector3>& points) {
  constexpr std::size_t sample = 300;
  std::vector<double> reaches, squares;
  for (std::size_t i = 0; i < points.size(); i += std::max<std::size_t>(1, points.size() / sample)) {
    squares.clear();
    for (const Vector3& other : points) squares.push_back((other - points[i]).squaredNorm());
    const auto eighth = squares.begin() + std::min<std::ptrdiff_t>(counted_neighbours, std::ssize(squares) - 1);
    std::ranges::nth_element(squares, eighth);
    reaches.push_back(std::sqrt(*eighth));
  }
  return median(std::move(reaches));
}

// The largest set of points that hang together within the reach, without those that have few neighbours.
std::vector<Vector3> largest_sheet(const std::vector<Vector3>& points, double reach) {
  const PointCells cells(points, reach);
  std::vector<char> visited(points.size(), 0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    int neighbours = -1;
    cells.near(points[i], [&](int, double) { ++neighbours; });
    if (neighbours < counted_neighbours / 2) visited[i] = 1;
  }
  std::vector<int> best;
  for (int i = 0; i < int(points.size()); ++i) {
    if (visited[std::size_t(i)]) continue;
    std::vector<int> members{i};
    visited[std::size_t(i)] = 1;
    for (std::size_t next = 0; next < members.size(); ++next)
      cells.near(points[std::size_t(members[next])], [&](int n, double) {
        if (visited[std::size_t(n)]) return;
        visited[std::size_t(n)] = 1;
        members.push_back(n);
      });
    if (members.size() > best.size()) best = std::move(members);
  }
  std::vector<Vector3> result;
  for (const int i : best) result.push_back(points[std::size_t(i)]);
  return result;
}

struct LocalPlane {
  Vector3 point = Vector3::Zero(), normal = Vector3::UnitZ();
  double nearest = 1e300;  // distance of the nearest point [m]
  bool is_found = false;
};

// Through the points around a place, the nearer ones counting more (Levin 1998).
LocalPlane plane_at(const PointCells& cells, const Vector3& place, double reach) {
  LocalPlane result;
  double total = 0.0, nearest = 1e300;
  int count = 0;
  Matrix3 moment = Matrix3::Zero();
  Vector3 first = Vector3::Zero();
  cells.near(place, [&](int n, double d) {
    const double w = std::exp(-4.0 * d / (reach * reach));
    const Vector3 arm = cells.points()[std::size_t(n)] - place;
    total += w, first += w * arm, moment += w * arm * arm.transpose();
    nearest = std::min(nearest, d);
    ++count;
  });
  if (count < 4) return result;
  first /= total;
  const Eigen::SelfAdjointEigenSolver<Matrix3> axes(Matrix3(moment / total - first * first.transpose()));
  return {place + first, axes.eigenvectors().col(0), std::sqrt(nearest), true};
}

std::vector<Vector3> projected(const PointCells& cells, double reach) {
  std::vector<Vector3> result = cells.points();
  for (Vector3& point : result) {
    const LocalPlane plane = plane_at(cells, point, reach);
    if (plane.is_found) point -= plane.normal.dot(point - plane.point) * plane.normal;
  }
  return result;
}

}  // namespace

RestScan scan_sheet(const std::vector<Vector3>& points, double thickness, const std::filesystem::path& place) {
  constexpr double most_lattice_points = 5e7;
  if (!(thickness > 0.0)) throw std::invalid_argument("scan_sheet: the thickness must be positive");
  const auto fail = [&](const std::string& found, const std::string& expected, const std::string& advice) {
    throw InputError(Problem{{place}, found, expected, advice});
  };
  if (points.size() < least_points)
    fail(std::to_string(points.size()) + " points", "100 at least on the sheet", "choose another frame (--frame)");
  const double spread = typical_reach(points), reach = 1.5 * spread;
  const std::vector<Vector3> sheet = largest_sheet(points, reach);
  if (sheet.size() < least_points || 2 * sheet.size() < points.size())
    fail("the points fall apart: the largest piece has " + std::to_string(sheet.size()) + " of " +
             std::to_string(points.size()),
         "one sheet", "choose a frame in which it is well seen (--frame)");
  Box box;
  for (const Vector3& point : sheet) box.extend(point);
  RestScan scan;
  scan.spacing = 0.4 * thickness;
  const double margin = 2.0 * reach + 8.0 * scan.spacing;
  box.min.array() -= margin, box.max.array() += margin;
  if ((box.extent() / scan.spacing).prod() > most_lattice_points)
    fail("a thickness of " + std::to_string(1e3 * thickness) + " mm is too little for a sheet of that size",
         "a hundredth of its size or more", "raise --thickness and lower the density so that the mass stays");

  const PointCells middle(projected(PointCells(sheet, reach), reach), reach);
  scan.mesh = even_mesh(
      [&](const Vector3& p) {
        const LocalPlane plane = plane_at(middle, p, reach);
        if (!plane.is_found) return 0.5 * reach;
        return std::max(std::abs(plane.normal.dot(p - plane.point)) - 0.5 * thickness, plane.nearest - spread);
      },
      box, scan.spacing);
  if (scan.mesh.triangles.empty())
    fail("the points make no sheet of that thickness", "a thickness of the order of their noise or more",
         "raise --thickness");
  scan.seen.assign(scan.mesh.vertices.size(), 1);
  scan.seen_share = 1.0;
  scan.readings = int(sheet.size());
  double squares = 0.0;
  for (const Vector3& point : sheet) {
    const LocalPlane plane = plane_at(middle, point, reach);
    if (plane.is_found) squares += std::pow(plane.normal.dot(point - plane.point), 2);
  }
  scan.readings_rms = std::sqrt(squares / scan.readings);
  return scan;
}

}  // namespace pliant
