#pragma once

#include <array>
#include <string>
#include <vector>

#include "ensemble/ensemble.hpp"

// Tables of an ensemble (docs/ensemble.md).

namespace pliant {

/// Every member's numbers without its paths, in the order of the members.
using MemberRecords = std::vector<MemberRecord>;
/// Throws InputError where a chunk cannot be read.
MemberRecords read_members(const std::filesystem::path& ensemble, const EnsemblePlan& plan);

/// A quantity of all members, not a number where a member has none.
struct EnsembleColumn {
  EnsembleQuantity quantity;
  std::vector<double> numbers;
};
/// The material's numbers, then the outputs.
std::vector<EnsembleColumn> columns_of(const EnsemblePlan& plan, const MemberRecords& members);
/// A number that members have in every frame, in one of them.
std::vector<double> series_of(const MemberRecords& members, const RecordShape& shape, int series, int frame);

std::string members_csv(const EnsemblePlan& plan, const MemberRecords& members);
std::string quantiles_csv(const std::vector<EnsembleColumn>& columns);
std::string frames_csv(const EnsemblePlan& plan, const MemberRecords& members);

/// Quantiles of the coordinates of all points in one frame, one by one [m]: by `told_shares`, points x 3 each. Those of
/// the surface's vertices come first.
using PositionQuantiles = std::array<Points, 5>;
/// @param most_bytes  for members' positions at a time: fewer points at once are read where members are many
PositionQuantiles position_quantiles(const std::filesystem::path& ensemble, const EnsemblePlan& plan, int frame,
                                     std::size_t most_bytes = std::size_t(128) << 20);

/// The head of `points.csv`, and its rows of one frame.
std::string points_csv_head();
std::string points_csv_rows(const EnsemblePlan& plan, int frame, const PositionQuantiles& quantiles);

}  // namespace pliant
