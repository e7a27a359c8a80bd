#pragma once

#include <array>
#include <vector>

namespace pliant {

/// Shares of the members that are told everywhere.
inline constexpr std::array<double, 5> told_shares = {0.05, 0.25, 0.50, 0.75, 0.95};

/// Quantiles of numbers, in their unit: linear between neighbours in the order of size, the k-th of n standing at the
/// share k / (n - 1) (Hyndman and Fan 1996, definition 7; NumPy's `quantile`). Numbers that are none do not count;
/// without any, the quantiles are none.
/// @param shares  0..1, ascending
std::vector<double> quantiles(std::vector<double> numbers, const std::vector<double>& shares);
std::array<double, 5> told_quantiles(std::vector<double> numbers);

/// The same of floats, which stay where they are in part only: they are put in order as far as is needed.
std::array<double, 5> told_quantiles(float* begin, float* end);

/// Correlation of the ranks of two numbers of the same members (Spearman 1904), -1..1; equal numbers have their mean
/// rank. Members of which either is none do not count; with fewer than three, or all equal, it is none.
double rank_correlation(const std::vector<double>& a, const std::vector<double>& b);

}  // namespace pliant
