#include "mesh/hex_grid.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "base/disjoint_sets.hpp"
#include "base/error.hpp"

namespace pliant {

std::array<double, 8> shape_functions(const Vector3& p) {
  std::array<double, 8> n;
  for (int a = 0; a < 8; ++a)
    n[a] = (a & 1 ? p.x() : 1 - p.x()) * (a >> 1 & 1 ? p.y() : 1 - p.y()) * (a >> 2 & 1 ? p.z() : 1 - p.z());
  return n;
}

Eigen::Matrix<double, 8, 3> shape_gradients(const Vector3& p) {
  Eigen::Matrix<double, 8, 3> g;
  for (int a = 0; a < 8; ++a) {
    const double sx = a & 1 ? 1 : -1, sy = a >> 1 & 1 ? 1 : -1, sz = a >> 2 & 1 ? 1 : -1;
    const double fx = a & 1 ? p.x() : 1 - p.x(), fy = a >> 1 & 1 ? p.y() : 1 - p.y(),
                 fz = a >> 2 & 1 ? p.z() : 1 - p.z();
    g.row(a) << sx * fy * fz, fx * sy * fz, fx * fy * sz;
  }
  return g;
}

namespace {

const double gauss_offset = std::sqrt(3.0 / 5.0) / 2.0;
const std::array<double, 3> gauss_nodes = {0.5 - gauss_offset, 0.5, 0.5 + gauss_offset};

/// The three quadratic Lagrange polynomials on the Gauss nodes.
std::array<double, 3> lagrange(double t) {
  const double a = gauss_nodes[0], b = gauss_nodes[1], c = gauss_nodes[2];
  return {(t - b) * (t - c) / ((a - b) * (a - c)), (t - a) * (t - c) / ((b - a) * (b - c)),
          (t - a) * (t - b) / ((c - a) * (c - b))};
}

struct SurfacePatch {
  Vector3 moment = Vector3::Zero();  // area times position
  double area = 0.0;
};

/// The surface in a cell, by octant and by the axis that it faces most: the faces that meet at a sharp edge stay apart.
using Patches = std::array<SurfacePatch, 24>;

/// Integrates over the inside part of one cell by splitting it into small tetrahedra, on each of which the signed
/// distance is taken as linear. Works in unit-cube coordinates.
class CellCutter {
 public:
  CellCutter(const SignedDistance& distance, const Vector3& corner, double cell_size, int subdivisions)
      : n_(subdivisions), values_(std::size_t(std::pow(subdivisions + 1, 3))) {
    for (int k = 0; k <= n_; ++k)
      for (int j = 0; j <= n_; ++j)
        for (int i = 0; i <= n_; ++i) value(i, j, k) = distance.value(corner + cell_size / n_ * Vector3(i, j, k));
  }

  /// Returns false where no sample lies inside.
  bool run(CellQuadrature& quadrature, Patches& patches) {
    if (std::none_of(values_.begin(), values_.end(), [](double v) { return v < 0.0; })) return false;
    quadrature_ = &quadrature;
    patches_ = &patches;
    for (int k = 0; k < n_; ++k)
      for (int j = 0; j < n_; ++j)
        for (int i = 0; i < n_; ++i) subcell(i, j, k);
    return true;
  }

 private:
  double& value(int i, int j, int k) {
    const auto n = std::size_t(n_) + 1;
    return values_[(std::size_t(k) * n + std::size_t(j)) * n + std::size_t(i)];
  }

  struct Corner {
    Vector3 at;
    double value;
  };

  void subcell(int i, int j, int k) {
    std::array<Corner, 8> c;
    int inside = 0;
    for (int a = 0; a < 8; ++a) {
      const int x = i + (a & 1), y = j + (a >> 1 & 1), z = k + (a >> 2 & 1);
      c[a] = {Vector3(x, y, z) / n_, value(x, y, z)};
      inside += c[a].value < 0.0;
    }
    if (inside == 0) return;
    if (inside == 8) return whole(c[0].at);
    // Kuhn's six tetrahedra around the diagonal 0-7: neighbouring sub-cells agree on shared faces.
    static constexpr int paths[6][2] = {{1, 3}, {3, 2}, {2, 6}, {6, 4}, {4, 5}, {5, 1}};
    for (const auto& [p, q] : paths) cut({c[0], c[p], c[q], c[7]});
  }

  void whole(const Vector3& low) {
    const double g = 0.5 / std::sqrt(3.0), w = 1.0 / (8.0 * n_ * n_ * n_);
    for (int a = 0; a < 8; ++a)
      quadrature_->add(low + Vector3(0.5 + (a & 1 ? g : -g), 0.5 + (a & 2 ? g : -g), 0.5 + (a & 4 ? g : -g)) / n_, w);
  }

  void cut(std::array<Corner, 4> c) {
    std::stable_partition(c.begin(), c.end(), [](const Corner& corner) { return corner.value < 0.0; });
    const auto inside = std::count_if(c.begin(), c.end(), [](const Corner& corner) { return corner.value < 0.0; });
    const auto zero = [&](int a, int b) -> Vector3 {
      const double t = c[a].value / (c[a].value - c[b].value);
      return c[a].at + t * (c[b].at - c[a].at);
    };
    if (inside == 4) return tetrahedron(c[0].at, c[1].at, c[2].at, c[3].at);
    if (inside == 1) {
      const Vector3 p = zero(0, 1), q = zero(0, 2), r = zero(0, 3);
      tetrahedron(c[0].at, p, q, r);
      triangle(p, q, r);
    } else if (inside == 2) {
      const Vector3 ac = zero(0, 2), ad = zero(0, 3), bc = zero(1, 2), bd = zero(1, 3);
      prism(c[0].at, ac, ad, c[1].at, bc, bd);
      triangle(ac, ad, bd);
      triangle(ac, bd, bc);
    } else if (inside == 3) {
      const Vector3 p = zero(0, 3), q = zero(1, 3), r = zero(2, 3);
      prism(c[0].at, c[1].at, c[2].at, p, q, r);
      triangle(p, q, r);
    }
  }

  void prism(const Vector3& a0, const Vector3& a1, const Vector3& a2, const Vector3& b0, const Vector3& b1,
             const Vector3& b2) {
    tetrahedron(a0, a1, a2, b2);
    tetrahedron(a0, a1, b2, b1);
    tetrahedron(a0, b1, b2, b0);
  }

  /// Four points, exact for quadratic polynomials.
  void tetrahedron(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d) {
    const double volume = std::abs((b - a).cross(c - a).dot(d - a)) / 6.0;
    if (volume <= 0.0) return;
    const double far = (5.0 + 3.0 * std::sqrt(5.0)) / 20.0, near = (5.0 - std::sqrt(5.0)) / 20.0;
    const Vector3 sum = near * (a + b + c + d);
    for (const Vector3* p : {&a, &b, &c, &d}) quadrature_->add(sum + (far - near) * *p, volume / 4.0);
  }

  void triangle(const Vector3& a, const Vector3& b, const Vector3& c) {
    const Vector3 normal = 0.5 * (b - a).cross(c - a);
    const double area = normal.norm();
    const Vector3 centre = (a + b + c) / 3.0;
    const int octant = (centre.x() > 0.5) + 2 * (centre.y() > 0.5) + 4 * (centre.z() > 0.5);
    int axis = 0;
    normal.cwiseAbs().maxCoeff(&axis);
    SurfacePatch& patch = (*patches_)[8 * std::size_t(axis) + std::size_t(octant)];
    patch.area += area;
    patch.moment += area * centre;
  }

  int n_;
  std::vector<double> values_;
  CellQuadrature* quadrature_ = nullptr;
  Patches* patches_ = nullptr;
};

constexpr double hardly_any = 0.02;  // of a cell: it is merged even with what is held otherwise

struct LatticeCell {
  CellQuadrature quadrature;
  double fraction = 0.0;
};

/// The neighbour that takes over a barely cut cell: through a face before an edge before a corner, fullest first.
std::optional<int> merge_target(const HexGrid& grid, const std::vector<LatticeCell>& lattice_cells,
                                const Eigen::Vector3i& index, double threshold,
                                const std::function<bool(const Eigen::Vector3i&)>& suits) {
  std::optional<int> best;
  double best_score = -1.0;
  for (int n = 0; n < 27; ++n) {
    const Eigen::Vector3i step(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
    const int manhattan = step.cwiseAbs().sum();
    const Eigen::Vector3i at = index + step;
    if (manhattan == 0 || (at.array() < 0).any() || (at.array() >= grid.size.array()).any()) continue;
    const double fraction = lattice_cells[grid.lattice(at)].fraction;
    if (fraction < threshold || !suits(at)) continue;
    const double score = 2.0 * (3 - manhattan) + fraction;
    if (score > best_score) best_score = score, best = grid.lattice(at);
  }
  return best;
}

Eigen::Vector3i lattice_index(const HexGrid& grid, int index) {
  return {index % grid.size.x(), index / grid.size.x() % grid.size.y(), index / (grid.size.x() * grid.size.y())};
}

void number_cells_and_nodes(HexGrid& grid, const std::vector<LatticeCell>& lattice_cells,
                            const std::vector<int>& stands_for) {
  grid.cell_of_lattice.assign(grid.lattice_count(), -1);
  grid.node_of_lattice.assign(grid.lattice_count(), -1);
  for (int l = 0; l < grid.lattice_count(); ++l) {
    if (stands_for[l] != l) continue;
    const Eigen::Vector3i index = lattice_index(grid, l);
    grid.cell_of_lattice[l] = grid.cell_count();
    grid.cell_index.push_back(index);
    grid.quadrature.push_back(lattice_cells[l].quadrature);
    grid.cells.emplace_back();
    for (int a = 0; a < 8; ++a)
      grid.node_of_lattice[grid.lattice(index + Eigen::Vector3i(a & 1, a >> 1 & 1, a >> 2 & 1))] = 0;
  }
  for (int l = 0; l < grid.lattice_count(); ++l)
    if (stands_for[l] >= 0) grid.cell_of_lattice[l] = grid.cell_of_lattice[stands_for[l]];
  int count = 0;
  for (int& node : grid.node_of_lattice)
    if (node == 0) node = count++;
  grid.nodes.resize(count, 3);
  for (int l = 0; l < grid.lattice_count(); ++l)
    if (grid.node_of_lattice[l] >= 0) grid.nodes.row(grid.node_of_lattice[l]) = grid.lattice_position(l).transpose();
  for (int e = 0; e < grid.cell_count(); ++e)
    for (int a = 0; a < 8; ++a)
      grid.cells[e][a] =
          grid.node_of_lattice[grid.lattice(grid.cell_index[e] + Eigen::Vector3i(a & 1, a >> 1 & 1, a >> 2 & 1))];
}

}  // namespace

const std::array<Vector3, CellQuadrature::count>& CellQuadrature::points() {
  static const auto all = [] {
    std::array<Vector3, count> p;
    for (int q = 0; q < count; ++q) p[q] = {gauss_nodes[q % 3], gauss_nodes[q / 3 % 3], gauss_nodes[q / 9]};
    return p;
  }();
  return all;
}

void CellQuadrature::add(const Vector3& local, double weight) {
  const auto x = lagrange(local.x()), y = lagrange(local.y()), z = lagrange(local.z());
  for (int k = 0; k < 3; ++k)
    for (int j = 0; j < 3; ++j) {
      const double yz = weight * y[j] * z[k];
      for (int i = 0; i < 3; ++i) weights[(k * 3 + j) * 3 + i] += x[i] * yz;
    }
}

double CellQuadrature::volume_fraction() const {
  double sum = 0.0;
  for (const double w : weights) sum += w;
  return sum;
}

double HexGrid::volume() const {
  double sum = 0.0;
  for (const CellQuadrature& q : quadrature) sum += q.volume_fraction();
  return sum * cell_size * cell_size * cell_size;
}

CellPoint HexGrid::locate(const Vector3& point) const {
  const Vector3 s = (point - origin) / cell_size;
  const Eigen::Vector3i base = s.array().floor().cast<int>();
  int best = -1;
  double best_distance = std::numeric_limits<double>::max();
  const auto consider = [&](const Eigen::Vector3i& at) {
    if ((at.array() < 0).any() || (at.array() >= size.array()).any()) return;
    const int cell = cell_of_lattice[lattice(at)];
    if (cell < 0) return;
    const Vector3 centre = at.cast<double>().array() + 0.5;
    const double distance = (s - centre).squaredNorm();
    if (distance < best_distance) best_distance = distance, best = cell;
  };
  consider(base);
  for (int ring = 1; best < 0 && ring <= size.maxCoeff(); ++ring)
    for (int k = -ring; k <= ring; ++k)
      for (int j = -ring; j <= ring; ++j)
        for (int i = -ring; i <= ring; ++i)
          if (std::max({std::abs(i), std::abs(j), std::abs(k)}) == ring) consider(base + Eigen::Vector3i(i, j, k));
  return {best, s - cell_index[best].cast<double>()};
}

HexGrid make_hex_grid(const SignedDistance& distance, const Box& object, double cell_size,
                      const HexGridOptions& options, const Vector3& shift) {
  HexGrid grid;
  grid.cell_size = cell_size;
  const Eigen::Vector3i spanned = (object.extent() / cell_size).array().ceil().cast<int>();
  const Vector3 slack = spanned.cast<double>() * cell_size - object.extent();
  grid.origin = object.min - 0.5 * slack - cell_size * (Vector3::Ones() + shift);
  grid.size = spanned.array() + 4;  // one empty cell around, one more so that a shifted lattice still covers

  std::vector<LatticeCell> cells(grid.lattice_count());
  std::vector<int> stands_for(grid.lattice_count(), -1);
  for (int l = 0; l < grid.lattice_count(); ++l) {
    const Eigen::Vector3i index = lattice_index(grid, l);
    if ((index.array() + 1 >= grid.size.array()).any()) continue;
    const Vector3 corner = grid.lattice_position(l);
    const double centre_distance = distance.value(corner + Vector3::Constant(0.5 * cell_size));
    if (centre_distance > cell_size) continue;  // sqrt(3)/2 h reaches the corner; the rest is slack
    Patches patches;
    CellCutter cutter(distance, corner, cell_size, options.subdivisions);
    if (!cutter.run(cells[l].quadrature, patches)) continue;
    cells[l].fraction = cells[l].quadrature.volume_fraction();
    if (cells[l].fraction <= 0.0) continue;
    stands_for[l] = l;
    for (const SurfacePatch& patch : patches) {
      if (patch.area <= 1e-9) continue;
      const Vector3 position = corner + cell_size * patch.moment / patch.area;
      const SignedDistance::Sample sample = distance.sample(position);
      const Vector3 normal = sample.gradient.normalized();
      grid.surface.push_back({position - sample.value * normal, normal, patch.area * cell_size * cell_size});
    }
  }
  if (grid.surface.empty())
    throw InputError(
        {{}, "no cell of " + std::to_string(cell_size) + " m lies inside the object", "", "use smaller cells"});

  for (int l = 0; l < grid.lattice_count(); ++l) {
    if (stands_for[l] < 0 || cells[l].fraction >= options.merge_below) continue;
    const Eigen::Vector3i index = lattice_index(grid, l);
    const auto is_held = [&](const Eigen::Vector3i& at) {
      return options.is_held &&
             options.is_held(grid.lattice_position(grid.lattice(at)) + Vector3::Constant(0.5 * cell_size));
    };
    auto target = merge_target(grid, cells, index, options.merge_below,
                               [&](const auto& at) { return is_held(at) == is_held(index); });
    if (!target && cells[l].fraction < hardly_any)
      target = merge_target(grid, cells, index, options.merge_below, [](const auto&) { return true; });
    if (!target) continue;
    const Vector3 offset = (index - lattice_index(grid, *target)).cast<double>();
    for (int q = 0; q < CellQuadrature::count; ++q)
      cells[*target].quadrature.add(CellQuadrature::points()[q] + offset, cells[l].quadrature.weights[q]);
    stands_for[l] = *target;
  }
  number_cells_and_nodes(grid, cells, stands_for);
  return grid;
}

int face_connected_parts(const HexGrid& grid) {
  // Nodes with bit d of their number clear, then set: the two faces of a cell across axis d.
  std::map<std::array<int, 4>, int> first_cell;
  DisjointSets parts(grid.cells.size());
  for (int cell = 0; cell < grid.cell_count(); ++cell)
    for (int axis = 0; axis < 3; ++axis)
      for (const int side : {0, 1}) {
        std::array<int, 4> face{};
        int k = 0;
        for (int a = 0; a < 8; ++a)
          if ((a >> axis & 1) == side) face[std::size_t(k++)] = grid.cells[std::size_t(cell)][std::size_t(a)];
        std::ranges::sort(face);
        parts.join(first_cell.emplace(face, cell).first->second, cell);
      }
  return parts.count();
}

}  // namespace pliant
