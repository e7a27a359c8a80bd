#pragma once

#include <string>
#include <vector>

namespace pliant {

/// How a measure is written for people: `scale` of the unit in one of the program's.
struct WrittenUnit {
  const char* name = "mm";
  double scale = 1e3;
};

/// How the first loading is looked for in what a machine recorded.
struct LoadingOptions {
  bool keeps_force_zero = false;      ///< forces count from the machine's zero
  bool keeps_extension_zero = false;  ///< extensions count from the machine's zero
  bool keeps_break = false;           ///< rows behind a break stay
  bool is_indentation = false;        ///< a probe that touches an object, else a specimen between grips
  double power = 1.0;                 ///< of the extension from contact by which the force rises: Hertz' ball 1.5
  double force_std = 0.0;             ///< stated standard deviation of a force; 0: found
  double force_resolution = 0.0;      ///< of the last digit with which forces are written
  WrittenUnit extension, force = {"N", 1.0};
};

/// The first loading of a test, from where the force begins: both positive in the direction of loading.
struct LoadingCurve {
  std::vector<double> extensions, forces, stds;   ///< as many; extensions grow, stds are of forces
  double extension_sign = 1.0, force_sign = 1.0;  ///< of the machine's numbers in the direction of loading
  double zero_std = 0.0;           ///< standard deviation of where extensions count from; 0: not estimated
  std::vector<std::string> notes;  ///< what was taken and corrected, a sentence each
};

/// Finds the first loading in a test's rows and brings it to its zeros.
///
/// Taken are the rows that go beyond all extensions before them: of later cycles what loads the specimen for the first
/// time. Rows behind a fall of the force by more than a quarter are a break. Where the force rises only after a part
/// that is flat, the rise is carried back to the flat part's level (toe compensation, ASTM D638, annex A1); else the
/// force at the machine's zero of extension is an offset. Extensions that begin elsewhere, where the force does not go
/// back to zero at the machine's, count from the first row. Of an indentation the contact is where force = offset + c
/// (depth - contact)^power, with a term of the next power, fits best.
///
/// The noise of a force is what it differs by from a cubic through four neighbours (the median over all); to it come
/// the file's resolution, half a per cent of the force (ISO 7500-1, class 0.5) and a thousandth of the greatest. Rows
/// are averaged to 100 points at most.
/// @param extensions, forces  as many, in the order of time; rows in which either is not finite are left out
/// Throws InputError where nothing moves, no force is measured, or fewer than two points are left.
LoadingCurve first_loading(const std::vector<double>& extensions, const std::vector<double>& forces,
                           const LoadingOptions& options, const std::string& name);

}  // namespace pliant
