#pragma once

#include <span>
#include <vector>

#include "elasticity/corotated.hpp"
#include "elasticity/material_law.hpp"

// Numbers over a deformed body that people look at. Files, pictures and pages take them from here, whatever the body's
// elements and its law.

namespace pliant {

/// Of each element of a body: of its mean deformation F = R S (Weiss 2020, eq. 30), in the world's frame.
struct BodyFields {
  std::vector<Matrix3> strain;          ///< R (S - I) R^T [-]: the Biot strain, turned along
  std::vector<Matrix3> stress;          ///< Cauchy stress of the elastic forces [Pa], without that of their damping
  std::vector<double> von_mises;        ///< of that stress [Pa]
  std::vector<double> greatest_strain;  ///< `greatest_strain` [-]
  std::vector<double> tangent_modulus;  ///< Young's modulus at the strain at hand [Pa] (`tangent_modulus`)
};

/// The fields of a body whose nodes are here.
/// @param elasticity  of the body, with its parameters set; it is left linearised about `positions`
/// @param positions   of the nodes [m], n x 3
/// Never throws for what it finds: stress and tangent modulus are not a number where the law knows no such deformation.
BodyFields body_fields(const Body& body, Elasticity& elasticity, const Points& positions);

/// A number of each element as a smooth one at points: the mean of the elements about a node, by volume, then the mean
/// of the nodes about a point, by the magnitude of their weights there.
/// @param of_elements  one an element, in any unit. Never throws.
std::vector<double> averages_at(const Body& body, const Embedding& points, std::span<const double> of_elements);

/// The von Mises stress of a Cauchy stress, sqrt(3/2) |dev sigma| [Pa]: that of simple tension which distorts as much.
double von_mises(const Matrix3& stress);

/// The principal strain of the greatest magnitude, as a magnitude [-]: the largest |s_i - 1| of the singular values s_i
/// of F = R S. Zero for every rotation; of a bar that is pulled to l times its length, |l - 1|.
/// @param S  the symmetric factor of F [-]
double greatest_strain(const Matrix3& S);

/// The Cauchy stress P F^T / det F of an element of a law [Pa]; not a number where the law knows no such deformation.
Matrix3 cauchy_stress(const MaterialLaw& law, int element, const Matrix3& F);

}  // namespace pliant
