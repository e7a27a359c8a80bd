#pragma once

#include <cstddef>
#include <vector>

namespace pliant {

/// Times nearer to each other than this are one instant [s].
inline constexpr double same_instant = 1e-7;

/// The times in rising order, each instant once [s].
std::vector<double> instants_of(std::vector<double> times);

/// Which of such instants a time is. Throws std::out_of_range where it is none of them.
std::size_t instant_at(const std::vector<double>& instants, double time);

}  // namespace pliant
