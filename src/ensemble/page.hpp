#pragma once

#include <string>
#include <vector>

#include "ensemble/tables.hpp"

namespace pliant {

/// Quantiles of a number over the frames, by `told_shares`.
struct EnsembleBand {
  EnsembleQuantity quantity;
  std::vector<std::array<double, 5>> frames;
};

/// The surface in one frame.
struct EnsembleSurface {
  int frame = 0;
  Points median;               ///< of each coordinate of the vertices [m], n x 3
  std::vector<double> spread;  ///< see `spread_of` [m]
};

/// How far apart members have points: half the diagonal of the box from the 5 % to the 95 % quantiles of each
/// coordinate [m].
std::vector<double> spread_of(const PositionQuantiles& quantiles, Eigen::Index points);

/// What the page of an ensemble shows.
struct EnsemblePage {
  const EnsemblePlan& plan;
  const Model& model;
  const TriangleMesh& surface;
  const MemberRecords& members;
  const std::vector<EnsembleColumn>& columns;
  std::vector<EnsembleBand> bands;        ///< of numbers in every frame
  std::vector<EnsembleBand> point_bands;  ///< of the points' coordinates, in the same way
  std::vector<EnsembleSurface> surfaces;  ///< in some frames
};

/// One self-contained page: quantiles of all quantities, their course over time, what drives them, how far apart the
/// members have the surface, and what failed.
std::string ensemble_html(const EnsemblePage& page);

}  // namespace pliant
