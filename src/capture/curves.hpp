#pragma once

#include <filesystem>
#include <vector>

namespace pliant {

/// Points of a force-depth curve, in the order of their file: depths grow.
struct ForceCurve {
  std::vector<double> depths;  ///< [m] that the probe went along its direction
  std::vector<double> forces;  ///< [N] of the probe on the object along that direction, as many
  std::vector<double> stds;    ///< [N] standard deviation of each force, as many, > 0
};

/// Points of a stress-strain curve, in the order of their file.
struct StressCurve {
  std::vector<double> stretches;  ///< [-] along x; of a simple shear the shear
  std::vector<double> second;     ///< [-] biaxial: stretches along y, as many; else empty
  std::vector<double> stresses;   ///< [Pa], as many
  std::vector<double> stds;       ///< [Pa] standard deviation of each stress, as many, > 0
};

/// Reads a CSV file with the header `depth,force,std`.
/// Throws InputError with every problem: a wrong header, a number that is not finite, depths that are negative or do
/// not grow, a standard deviation that is not positive.
ForceCurve read_force_curve(const std::filesystem::path& path);

/// Reads a CSV file with the header `stretch,stress,std`, or `stretch,second,stress,std` of a biaxial test.
/// @param is_shear  the first column holds shears of any sign; else stretches, which are positive
/// Throws InputError with every problem.
StressCurve read_stress_curve(const std::filesystem::path& path, bool is_biaxial, bool is_shear);

/// Writes the same formats, whole or not at all. Throws InputError where the file cannot be written.
void write_force_curve(const std::filesystem::path& path, const ForceCurve& curve);
void write_stress_curve(const std::filesystem::path& path, const StressCurve& curve);

}  // namespace pliant
