#include "simulation/strain_range.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/files.hpp"

namespace pliant {

namespace {

constexpr double of_greatest = 0.01, of_median = 0.5;  // shares of the volume

}  // namespace

StrainRange::StrainRange(const Body& body) : volumes_(body.element_volume) {}

void StrainRange::add(const BodyFields& fields, std::optional<double> time) {
  const std::vector<double>& strain = fields.greatest_strain;
  if (peaks_.empty()) peaks_.assign(strain.size(), 0.0), rates_.assign(strain.size(), 0.0);
  for (std::size_t e = 0; e < strain.size(); ++e) {
    peaks_[e] = std::max(peaks_[e], strain[e]);
    if (time && time_ && *time > *time_)
      rates_[e] = std::max(rates_[e], std::abs(strain[e] - before_[e]) / (*time - *time_));
  }
  before_ = strain, time_ = time;
}

double StrainRange::exceeded_by(double share, const std::vector<double>& of_elements) const {
  std::vector<std::size_t> order(of_elements.size());
  std::iota(order.begin(), order.end(), std::size_t(0));
  std::ranges::sort(order, [&](std::size_t a, std::size_t b) { return of_elements[a] > of_elements[b]; });
  double left = share * std::accumulate(volumes_.begin(), volumes_.end(), 0.0);
  for (const std::size_t e : order)
    if ((left -= volumes_[e]) < 0.0) return of_elements[e];
  return 0.0;
}

std::optional<DeformationResult> StrainRange::result() const {
  if (peaks_.empty()) return std::nullopt;
  DeformationResult result;
  result.greatest_strain = exceeded_by(of_greatest, peaks_);
  result.median_strain = exceeded_by(of_median, peaks_);
  if (time_) result.greatest_rate = exceeded_by(of_greatest, rates_);
  return result;
}

std::optional<DeformationResult> wider(const std::optional<DeformationResult>& a,
                                       const std::optional<DeformationResult>& b) {
  if (!a || !b) return a ? a : b;
  return DeformationResult{std::max(a->greatest_strain, b->greatest_strain),
                           std::max(a->median_strain, b->median_strain), std::max(a->greatest_rate, b->greatest_rate)};
}

std::optional<DeformationResult> strain_range(const std::vector<CurvePrediction>& curves) {
  std::optional<DeformationResult> result;
  for (const CurvePrediction& curve : curves)
    if (curve.role == "fit") result = wider(result, curve.strained);
  return result;
}

std::optional<DeformationResult> recorded_strain_range(const std::filesystem::path& model_file) {
  const std::filesystem::path file = model_file.parent_path() / "result.json";
  return is_file(file) ? read_result(file).deformation : std::nullopt;
}

std::string extrapolation_note(const std::optional<DeformationResult>& recorded,
                               const std::optional<DeformationResult>& now) {
  constexpr double same = 1.05;
  if (!recorded || !now || now->greatest_strain <= same * recorded->greatest_strain) return "";
  return fmt::format(
      "The object is strained by up to {:.2g} %, and was by up to {:.2g} % while the model was fitted (a hundredth of "
      "the volume by more): beyond that the model is extrapolated.",
      100.0 * now->greatest_strain, 100.0 * recorded->greatest_strain);
}

}  // namespace pliant
