#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/types.hpp"
#include "model/result.hpp"
#include "report/colour_scale.hpp"

namespace pliant {

/// Agreement in one frame.
struct FrameResidual {
  int frame = 0;
  double time = 0.0;            ///< [s]
  double rms = 0.0;             ///< root mean square distance of observed points to the surface [m]
  int points = 0;               ///< observed points behind it
  std::optional<double> noise;  ///< what the sensor's noise alone would give [m]
};

/// A picture for the page.
struct ReportPicture {
  std::string png;      ///< bytes of a PNG file
  std::string caption;  ///< plain text
};

/// A number over the object's surface in some of its states, all drawn in colours of one scale.
struct ReportField {
  std::string name, unit;  ///< "von Mises stress", "Pa"
  ColourScale scale = {};
  std::vector<ReportPicture> pictures = {};
  std::string abscissa = {};                     ///< of the plot below: "time [s]"
  std::vector<double> at = {};                   ///< of every state; fewer than two: no plot
  std::vector<double> greatest = {}, mean = {};  ///< of the elements in each state, the mean by volume; as many as `at`
};

/// Correlation of every pair of estimated parameters at the solution.
struct CorrelationTable {
  std::vector<std::string> names;  ///< of parameters
  MatrixX values;                  ///< as many rows and columns, -1..1
};

/// What a fit's page shows. Empty parts are left out of the page.
struct ReportData {
  std::string title;
  Result result;
  ConvergenceHistory convergence;
  std::vector<FrameResidual> residuals;
  double residual_range = 0.0;  ///< [m], where the colours of the discs in the pictures end; 0: no colour scale
  std::vector<ReportPicture> pictures;
  std::vector<ReportField> fields;
  CorrelationTable correlations;
  std::vector<LoadError> loads;           ///< that took no part in the fit, as the model predicts them
  std::vector<StaticError> presses;       ///< all of them, as the model predicts them ...
  std::vector<double> press_forces;       ///< ... and their forces [N]
  std::vector<double> basis_errors;       ///< of a sampled material: error of stress with 1, 2, ... samples an element
  std::string model_file = "model.toml";  ///< beside the page
  std::string live_page = {};             ///< beside the page; empty: none
  std::string capture_path;               ///< as the user named it; empty: "CAPTURE" in the commands shown
};

/// One self-contained page: no script, no link to another file or place but the live page beside it; light and dark by
/// the reader's setting. Throws std::invalid_argument where correlations or convergence rows do not fit their names.
std::string report_html(const ReportData& data);

/// Writes the page, whole or not at all. Throws InputError where it cannot be written.
void write_report(const std::filesystem::path& path, const ReportData& data);

/// One self-contained page of fields alone, of a simulation.
std::string fields_html(const std::string& title, const std::vector<ReportField>& fields);

/// A unit as people write it and what a number is multiplied by for it: a prefix brings `value` to 1..1000 where people
/// use one.
struct SpokenUnit {
  double factor;
  std::string unit;  ///< empty: a number without a unit
};
SpokenUnit spoken_unit(double value, const std::string& unit);

/// A parameter's name for people: "youngs_modulus@red half" gives "Young's modulus (red half)".
std::string spoken_name(const std::string& name);

/// A value with its uncertainty and unit: "590 ± 21 Pa", "12.3 ± 0.4 kPa"; both to the same decimal place, which the
/// first two digits of the uncertainty decide; four digits where the uncertainty is unknown.
std::string value_with_uncertainty(double value, std::optional<double> std, const std::string& unit);

/// What mesh and time step may have put a scalar off, and its limit: "mesh ± 12 Pa, time step ± 3 Pa, limit 585 Pa".
/// Empty where the estimate was not repeated.
std::string discretisation_words(const ParameterResult& parameter);

/// Which cause contributes most to the deviation of Young's modulus, and what would reduce it. Empty where no budget of
/// causes is there.
std::string largest_share_sentence(const Result& result);

/// What the figures mean, one plain sentence each: agreement against noise, trust in each parameter, pairs that the
/// recording can hardly tell apart, parameters that were given, starts that ended elsewhere.
std::vector<std::string> plain_sentences(const ReportData& data);

}  // namespace pliant
