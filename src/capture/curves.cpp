#include "capture/curves.hpp"

#include <optional>
#include <ostream>

#include "base/csv.hpp"
#include "base/files.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

void complain_unless_positive(CsvRow& row, std::size_t column, const std::optional<double>& value, const char* what) {
  if (value && !(*value > 0.0)) row.complain(column, "a value of " + std::to_string(*value), what);
}

}  // namespace

ForceCurve read_force_curve(const fs::path& path) {
  ForceCurve curve;
  read_csv(path, "depth,force,std", [&](CsvRow& row) {
    const auto depth = row.number(0), force = row.number(1), std = row.number(2);
    complain_unless_positive(row, 2, std, "the standard deviation of the force in newtons, above 0");
    if (depth && (*depth < 0.0 || (!curve.depths.empty() && *depth <= curve.depths.back())))
      row.complain(0, "a depth of " + std::to_string(*depth) + " m", "depths in metres from 0 that grow",
                   "sort the points by depth, and keep those of loading alone");
    curve.depths.push_back(depth.value_or(0.0));
    curve.forces.push_back(force.value_or(0.0));
    curve.stds.push_back(std.value_or(1.0));
  });
  return curve;
}

StressCurve read_stress_curve(const fs::path& path, bool is_biaxial, bool is_shear) {
  StressCurve curve;
  const std::size_t stress_column = is_biaxial ? 2 : 1;
  read_csv(path, is_biaxial ? "stretch,second,stress,std" : "stretch,stress,std", [&](CsvRow& row) {
    const auto stretch = row.number(0), stress = row.number(stress_column), std = row.number(stress_column + 1);
    if (!is_shear) complain_unless_positive(row, 0, stretch, "a stretch above 0: 1 is the unloaded length");
    if (is_biaxial) {
      const auto second = row.number(1);
      complain_unless_positive(row, 1, second, "a stretch above 0: 1 is the unloaded length");
      curve.second.push_back(second.value_or(1.0));
    }
    complain_unless_positive(row, stress_column + 1, std, "the standard deviation of the stress in pascals, above 0");
    curve.stretches.push_back(stretch.value_or(1.0));
    curve.stresses.push_back(stress.value_or(0.0));
    curve.stds.push_back(std.value_or(1.0));
  });
  return curve;
}

void write_force_curve(const fs::path& path, const ForceCurve& curve) {
  write_file(path, [&](std::ostream& out) {
    out.precision(12);
    out << "depth,force,std\n";
    for (std::size_t i = 0; i < curve.depths.size(); ++i)
      out << curve.depths[i] << "," << curve.forces[i] << "," << curve.stds[i] << "\n";
  });
}

void write_stress_curve(const fs::path& path, const StressCurve& curve) {
  const bool is_biaxial = !curve.second.empty();
  write_file(path, [&](std::ostream& out) {
    out.precision(12);
    out << (is_biaxial ? "stretch,second,stress,std\n" : "stretch,stress,std\n");
    for (std::size_t i = 0; i < curve.stretches.size(); ++i) {
      out << curve.stretches[i] << ",";
      if (is_biaxial) out << curve.second[i] << ",";
      out << curve.stresses[i] << "," << curve.stds[i] << "\n";
    }
  });
}

}  // namespace pliant
