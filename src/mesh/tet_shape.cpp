#include "mesh/tet_shape.hpp"

#include <cmath>
#include <stdexcept>
#include <vector>

namespace pliant {

namespace {

/// The four points with one coordinate 1 - 3 a and three coordinates a.
void add_corner_orbit(std::vector<TetQuadraturePoint>& rule, double a, double weight) {
  for (int i = 0; i < 4; ++i) {
    rule.push_back({Barycentric::Constant(a), weight});
    rule.back().at[i] = 1.0 - 3.0 * a;
  }
}

/// The six points with two coordinates a and two coordinates 1/2 - a.
void add_edge_orbit(std::vector<TetQuadraturePoint>& rule, double a, double weight) {
  for (const auto& [i, j] : tet_edges) {
    rule.push_back({Barycentric::Constant(a), weight});
    rule.back().at[i] = rule.back().at[j] = 0.5 - a;
  }
}

}  // namespace

std::span<const TetQuadraturePoint> tet_quadrature(int degree) {
  static const std::vector<TetQuadraturePoint> one = {{Barycentric::Constant(0.25), 1.0}};
  static const auto four = [] {
    std::vector<TetQuadraturePoint> rule;
    add_corner_orbit(rule, (5.0 - std::sqrt(5.0)) / 20.0, 0.25);
    return rule;
  }();
  static const auto fourteen = [] {  // degree 5, N. Walkington (2000), Quadrature on simplices of arbitrary dimension
    std::vector<TetQuadraturePoint> rule;
    add_corner_orbit(rule, 0.31088591926330060980, 0.11268792571801585080);
    add_corner_orbit(rule, 0.092735250310891226402, 0.073493043116361949544);
    add_edge_orbit(rule, 0.045503704125649649492, 0.042546020777081466438);
    return rule;
  }();
  if (degree < 0 || degree > 5)
    throw std::invalid_argument("tet_quadrature: no rule of degree " + std::to_string(degree));
  if (degree <= 1) return one;
  return degree == 2 ? std::span<const TetQuadraturePoint>(four) : fourteen;
}

}  // namespace pliant
