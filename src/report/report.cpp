#include "report/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>
#include <stdexcept>

#include "base/files.hpp"
#include "base/html.hpp"
#include "report/image.hpp"
#include "report/page.hpp"
#include "report/plot.hpp"

namespace pliant {

namespace {

std::optional<double> scalar(const std::optional<ParameterValue>& value) {
  if (!value || !std::holds_alternative<double>(*value)) return std::nullopt;
  return std::get<double>(*value);
}

std::string vector_text(const Vector3& v, const std::optional<Vector3>& std) {
  std::string text;
  for (int k = 0; k < 3; ++k)
    text += (k ? ", " : "(") + value_with_uncertainty(v[k], std ? std::optional((*std)[k]) : std::nullopt, "1");
  return text + ")";
}

// Any value with its uncertainty.
std::string value_text(const ParameterValue& value, const std::optional<ParameterValue>& std, const std::string& unit) {
  if (const auto* number = std::get_if<double>(&value)) return value_with_uncertainty(*number, scalar(std), unit);
  const std::string spoken_unit = unit == "m/s^2" ? " m/s²" : unit.empty() || unit == "1" ? "" : " " + unit;
  if (const auto* v = std::get_if<Vector3>(&value)) {
    const auto* spread = std ? std::get_if<Vector3>(&*std) : nullptr;
    return vector_text(*v, spread ? std::optional(*spread) : std::nullopt) + spoken_unit;
  }
  const auto& plane = std::get<PlaneValue>(value);
  return "point " + vector_text(plane.point, std::nullopt) + " m, normal " + vector_text(plane.normal, std::nullopt);
}

// ---- headline

// The interval of one standard deviation and the start on a scale around the value, where that says something.
std::string error_bar(double value, double std) {
  if (!(std > 0.0) || !std::isfinite(std) || value == 0.0) return "";
  const double relative = std::min(1.0, std / std::abs(value)), half = 100.0 * relative;
  return fmt::format(
      R"svg(<svg viewBox="0 0 220 16" preserveAspectRatio="none" aria-hidden="true">)svg"
      R"svg(<rect x="0" y="6.5" width="220" height="3" rx="1.5" style="fill:var(--grid)"/>)svg"
      R"svg(<rect x="{:.1f}" y="4" width="{:.1f}" height="8" rx="3" style="fill:var(--accent);opacity:.35"/>)svg"
      R"svg(<rect x="108.5" y="1" width="3" height="14" rx="1" style="fill:var(--accent)"/></svg>)svg",
      110.0 - half, std::max(2.0, 2.0 * half));
}

std::string card(const ParameterResult& p) {
  std::string html = "<div class=\"card\"><div class=\"name\">" + escape_html(spoken_name(p.name)) + "</div>";
  const auto value = scalar(p.value), std = scalar(p.std);
  html += std::string("<div class=\"value") + (value ? "" : " vector") + "\">" +
          escape_html(value_text(p.value, p.std, p.unit)) + "</div>";
  if (value && std) html += error_bar(*value, *std);
  std::string from;
  if (value && std && *value != 0.0) from = "± " + readable(100.0 * *std / std::abs(*value), 2) + " %";
  if (p.start) from += (from.empty() ? "" : ", ") + ("began at " + value_text(*p.start, std::nullopt, p.unit));
  if (const std::string words = discretisation_words(p); !words.empty()) from += (from.empty() ? "" : "; ") + words;
  return html + "<div class=\"from\">" + escape_html(from) + "</div></div>\n";
}

std::string headline(const Result& result) {
  std::string cards;
  for (const ParameterResult& p : result.parameters)
    if (p.estimated) cards += card(p);
  return cards.empty() ? "" : "<div class=\"cards\">\n" + cards + "</div>\n";
}

/// Whether the estimates can be quoted, and if not, why.
std::string verdict(const Result& result) {
  if (result.verdict.empty()) return "";
  const std::string says = result.verdict == "explained"
                               ? "The model explains the recording: its distances are those of the sensor's noise."
                           : result.verdict == "unexplained"
                               ? "The model does not explain the recording. The numbers below are its best attempt."
                               : "The recording does not determine the material.";
  std::string html =
      "<p class=\"verdict " + escape_html(result.verdict) + "\"><b>" + escape_html(result.verdict) + ".</b> " + says;
  for (const std::string& reason : result.reasons) html += " " + escape_html(reason);
  return html + "</p>\n";
}

std::string words(const ReportData& data) {
  std::string items;
  for (const std::string& sentence : plain_sentences(data)) items += "<li>" + escape_html(sentence) + "</li>\n";
  return items.empty() ? "" : "<ul class=\"words\">\n" + items + "</ul>\n";
}

// ---- pictures

std::string residual_scale(double range) {
  if (range <= 0.0) return "";
  std::string svg =
      R"svg(<div class="scale"><svg viewBox="0 0 520 46" role="img" aria-label="colours of the residuals" )svg"
      R"svg(style="font:12px system-ui,sans-serif;fill:var(--muted)"><defs><linearGradient id="residual-scale">)svg";
  for (int k = 0; k <= 16; ++k)
    svg +=
        fmt::format(R"svg(<stop offset="{:.4f}" stop-color="{}"/>)svg", k / 16.0, css(diverging_colour(k / 8.0 - 1.0)));
  svg +=
      R"svg(</linearGradient></defs><rect x="1" y="4" width="518" height="14" rx="3" fill="url(#residual-scale)" )svg"
      R"svg(style="stroke:var(--grid)"/>)svg";
  const std::string mm = readable(1e3 * range, 3);
  svg += fmt::format(R"svg(<text x="1" y="36">−{} mm, seen inside the surface</text>)svg", mm);
  svg += R"svg(<text x="260" y="36" text-anchor="middle">0</text>)svg";
  svg += fmt::format(R"svg(<text x="519" y="36" text-anchor="end">seen outside, +{} mm</text>)svg", mm);
  return svg + "</svg></div>\n";
}

std::string pictures(const ReportData& data) {
  if (data.pictures.empty()) return "";
  std::string html =
      "<p>Dots are observed points; the grey surface is the simulation with the estimated parameters.</p>\n" +
      residual_scale(data.residual_range);
  return html + figures(data.pictures);
}

// ---- plots

std::string residual_plot(const std::vector<FrameResidual>& residuals) {
  if (residuals.empty()) return "";
  Series rms{"simulation against recording", {}, {}, Mark::LineAndDots, {}, {}, 0};
  Series noise{"the sensor's noise alone", {}, {}, Mark::DashedLine, {}, {}, 1};
  for (const FrameResidual& frame : residuals) {
    rms.x.push_back(frame.time), rms.y.push_back(1e3 * frame.rms);
    if (frame.noise) noise.x.push_back(frame.time), noise.y.push_back(1e3 * *frame.noise);
  }
  PlotOptions options;
  options.x_label = "time [s]", options.y_label = "rms distance [mm]", options.zero_y = true;
  std::vector<Series> series{rms};
  if (!noise.x.empty()) series.push_back(noise);
  return panel(plot_svg(series, options));
}

// Rows of each start, numbered on through its stages. Lines are broken between stages: their costs count other things.
std::map<int, std::vector<const ConvergenceRow*>> rows_by_start(const ConvergenceHistory& history) {
  std::map<int, std::vector<const ConvergenceRow*>> starts;
  for (const ConvergenceRow& row : history.rows) starts[row.start].push_back(&row);
  return starts;
}

Series start_series(int start, const std::vector<const ConvergenceRow*>& rows, bool labelled,
                    const std::function<double(const ConvergenceRow&)>& value) {
  Series series{labelled ? "start " + std::to_string(start + 1) : "", {}, {}, Mark::LineAndDots, {}, {}, start};
  for (size_t i = 0; i < rows.size(); ++i) {
    if (i > 0 && rows[i]->stage != rows[i - 1]->stage) series.x.push_back(double(i)), series.y.push_back(NAN);
    series.x.push_back(double(i)), series.y.push_back(value(*rows[i]));
  }
  return series;
}

std::string cost_plot(const ConvergenceHistory& history) {
  std::vector<Series> series;
  const auto starts = rows_by_start(history);
  for (const auto& [start, rows] : starts)
    series.push_back(start_series(start, rows, starts.size() > 1 && starts.size() <= 8,
                                  [](const ConvergenceRow& row) { return row.cost; }));
  PlotOptions options;
  options.x_label = "iteration", options.y_label = "cost", options.log_y = true;
  return panel(plot_svg(series, options));
}

std::string parameter_plot(const ReportData& data, size_t index) {
  const ConvergenceHistory& history = data.convergence;
  std::vector<Series> series;
  bool positive = true;
  for (const auto& [start, rows] : rows_by_start(history)) {
    series.push_back(
        start_series(start, rows, false, [&](const ConvergenceRow& row) { return row.parameters[index]; }));
    for (const ConvergenceRow* row : rows) positive = positive && row->parameters[index] > 0.0;
  }
  PlotOptions options;
  const std::string& unit = history.units[index];
  options.title = spoken_name(history.parameters[index]);
  options.x_label = "iteration", options.y_label = unit.empty() || unit == "1" ? "value" : "[" + unit + "]";
  options.width = 460, options.height = 250, options.log_y = positive;
  const ParameterResult* p = data.result.find(history.parameters[index]);
  if (p && scalar(p->value)) options.levels = {{*scalar(p->value), "", scalar(p->std).value_or(0.0)}};
  return panel(plot_svg(series, options));
}

void check(const ConvergenceHistory& history) {
  if (history.units.size() != history.parameters.size())
    throw std::invalid_argument("report_html: as many units as parameters are needed in the convergence");
  for (const ConvergenceRow& row : history.rows)
    if (row.parameters.size() != history.parameters.size())
      throw std::invalid_argument("report_html: a convergence row does not fit its parameters' names");
}

// The stages in the order in which they came, where there is more than one.
std::string stages_sentence(const ConvergenceHistory& history) {
  std::vector<std::string> stages;
  for (const ConvergenceRow& row : history.rows)
    if (std::find(stages.begin(), stages.end(), row.stage) == stages.end()) stages.push_back(row.stage);
  if (stages.size() < 2) return "";
  std::string names;
  for (const std::string& stage : stages) names += (names.empty() ? "" : " → ") + escape_html(stage);
  return "<p class=\"given\">Stages: " + names +
         ". A line is broken between them; costs on both sides do not compare.</p>\n";
}

std::string convergence(const ReportData& data) {
  check(data.convergence);
  if (data.convergence.rows.empty()) return "";
  std::string html = cost_plot(data.convergence), small;
  for (size_t i = 0; i < data.convergence.parameters.size(); ++i) small += parameter_plot(data, i);
  html += stages_sentence(data.convergence);
  return html + (small.empty() ? "" : "<div class=\"small-plots\">\n" + small + "</div>\n");
}

// ---- tables

/// What was held likely beforehand: the 90 % interval of a scalar, a vector with its deviations.
std::string prior_text(const ParameterResult& p) {
  if (!p.prior) return "";
  if (const auto& interval = p.prior->interval_90)
    return value_text(interval->first, std::nullopt, p.unit) + " to " +
           value_text(interval->second, std::nullopt, p.unit);
  return value_text(p.prior->median, p.prior->std, p.unit);
}

std::string parameter_table(const Result& result) {
  std::string body;
  for (const ParameterResult& p : result.parameters)
    body += fmt::format(
        "<tr{}><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n", p.estimated ? "" : " class=\"given\"",
        escape_html(spoken_name(p.name)), escape_html(value_text(p.value, p.std, p.unit)), escape_html(prior_text(p)),
        p.start ? escape_html(value_text(*p.start, std::nullopt, p.unit)) : "", p.estimated ? "estimated" : "given");
  return body.empty()
             ? ""
             : table("<th>parameter</th><th>value</th><th>held likely before</th><th>start</th><th></th>", body);
}

/// Deviations of the scalars by cause, in per cent of the values, and what would narrow the moduli's most.
std::string uncertainty_table(const Result& result) {
  if (result.uncertainty.size() < 2) return "";
  std::vector<const ParameterResult*> shown;
  for (const ParameterResult& p : result.parameters)
    if (p.estimated && p.interval_90 && result.uncertainty.front().std.contains(p.name)) shown.push_back(&p);
  if (shown.empty()) return "";
  std::string head = "<th>cause</th>", body;
  for (const ParameterResult* p : shown) head += "<th>" + escape_html(spoken_name(p->name)) + "</th>";
  const auto percent = [](const ParameterResult& p, double std) {
    const double value = std::abs(*scalar(p.value));
    return value > 0.0 && std::isfinite(std) ? readable(100.0 * std / value, 2) + " %" : std::string();
  };
  for (const UncertaintyResult& u : result.uncertainty) {
    body += "<tr><td>" + escape_html(u.cause) + "</td>";
    for (const ParameterResult* p : shown) body += "<td>" + percent(*p, u.std.at(p->name)) + "</td>";
    body += "</tr>\n";
  }
  body += "<tr><td>together</td>";
  for (const ParameterResult* p : shown) body += "<td>" + percent(*p, scalar(p->std).value_or(0.0)) + "</td>";
  body += "</tr>\n<tr><td>90 % interval</td>";
  for (const ParameterResult* p : shown)
    body += "<td>" + escape_html(value_text(p->interval_90->first, std::nullopt, p->unit)) + " to " +
            escape_html(value_text(p->interval_90->second, std::nullopt, p->unit)) + "</td>";
  return table(head, body + "</tr>\n") +
         "<p class=\"given\">Standard deviations by cause, over the value. Each model was tried from the estimate, by "
         "a "
         "few steps; what the capture gives moves within its tolerance.</p>\n" +
         "<p>" + escape_html(largest_share_sentence(result)) + "</p>\n";
}

std::string correlation_table(const CorrelationTable& correlations) {
  const auto n = Eigen::Index(correlations.names.size());
  if (correlations.values.rows() != n || correlations.values.cols() != n)
    throw std::invalid_argument("report_html: the correlations do not fit their names");
  if (n < 2) return "";
  std::string head = "<th></th>", body;
  for (const std::string& name : correlations.names)
    head += "<th style=\"text-align:center\">" + escape_html(spoken_name(name)) + "</th>";
  for (Eigen::Index i = 0; i < n; ++i) {
    body += "<tr><td>" + escape_html(spoken_name(correlations.names[i])) + "</td>";
    for (Eigen::Index j = 0; j < n; ++j)
      body += i == j ? "<td class=\"cell given\">1</td>" : correlation_cell(correlations.values(i, j));
    body += "</tr>\n";
  }
  return table(head, body) +
         "<p class=\"given\">Near −1 or 1 the recording cannot tell the two apart: their uncertainties belong "
         "together.</p>\n";
}

// The parameter that a start's number belongs to: "linear_velocity.x" is one of three.
const ParameterResult* parameter_of(const Result& result, const std::string& name) {
  const ParameterResult* p = result.find(name);
  return p ? p : result.find(name.substr(0, name.find('.')));
}

// Estimated scalars of a start, in words.
std::string spoken_values(const Result& result, const std::map<std::string, double>& values) {
  std::string text;
  for (const auto& [name, value] : values) {
    const ParameterResult* p = parameter_of(result, name);
    if (p && !p->estimated) continue;  // the same for all starts
    text += (text.empty() ? "" : "; ") + spoken_name(name) + " " +
            value_with_uncertainty(value, std::nullopt, p ? p->unit : "1");
  }
  return text;
}

// Best first.
std::string starts_table(const Result& result) {
  if (result.starts.empty()) return "";
  std::vector<std::size_t> order(result.starts.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return result.starts[i].cost.value_or(HUGE_VAL); });
  std::string body;
  for (const std::size_t i : order) {
    const StartResult& s = result.starts[i];
    body += fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td><td>{}{}</td><td>{}</td><td>{}</td></tr>\n", i + 1,
                        s.cost ? readable(*s.cost, 4) : "-", s.iterations,
                        s.converged ? "" : "not converged: ", escape_html(s.reason),
                        escape_html(spoken_values(result, s.start)), escape_html(spoken_values(result, s.final)));
  }
  return table(
      "<th>start</th><th>cost</th><th>iterations</th><th>why it stopped</th><th>began at</th><th>ended at</th>", body);
}

// Scalars, a row for each resolution and one for their limit.
std::string tracking_part(const Result& result) {
  if (!result.tracking) return "";
  const TrackingResult& tracking = *result.tracking;
  const auto mm = [](const std::optional<double>& length) { return length ? readable(1e3 * *length, 3) : "?"; };
  std::string html = "<p>" + escape_html(tracking.why) + "</p>\n", body;
  Series tracked{"points to the tracked surface", {}, {}, Mark::LineAndDots, {}, {}, 0};
  Series fitted{"tracked to simulated points", {}, {}, Mark::LineAndDots, {}, {}, 1};
  Series modulus{"", {}, {}, Mark::LineAndDots, {}, {}, 0};
  for (std::size_t i = 0; i < tracking.rounds.size(); ++i) {
    const TrackingRoundResult& r = tracking.rounds[i];
    const double round = double(i) + 1.0;
    tracked.x.push_back(round), tracked.y.push_back(1e3 * r.surface_rms.value_or(NAN));
    fitted.x.push_back(round), fitted.y.push_back(1e3 * r.fit_rms.value_or(NAN));
    if (i == 0) modulus.x.push_back(0.0), modulus.y.push_back(r.tracked_with);
    modulus.x.push_back(round), modulus.y.push_back(r.youngs_modulus);
    body += fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{:.2f}{}</td></tr>\n", i + 1,
                        escape_html(value_with_uncertainty(r.tracked_with, std::nullopt, "Pa")),
                        escape_html(value_with_uncertainty(r.youngs_modulus, std::nullopt, "Pa")), mm(r.surface_rms),
                        mm(r.fit_rms), r.confidence, r.lost ? ", lost" : "");
  }
  PlotOptions errors, moduli;
  errors.title = "Error of each round", errors.x_label = "round", errors.y_label = "rms [mm]", errors.zero_y = true;
  moduli.title = "Young's modulus after each round", moduli.x_label = "round", moduli.y_label = "[Pa]";
  moduli.log_y = true;
  for (PlotOptions* options : {&errors, &moduli}) options->width = 460, options->height = 250;
  html += "<div class=\"small-plots\">\n" + panel(plot_svg({tracked, fitted}, errors)) +
          panel(plot_svg({modulus}, moduli)) + "</div>\n";
  return html + table(
                    "<th>round</th><th>tracked with</th><th>estimated</th><th>points to surface [mm]</th>"
                    "<th>tracked to simulated [mm]</th><th>least confidence</th>",
                    body);
}

std::string resolutions_table(const Result& result) {
  if (result.resolutions.size() < 2) return "";
  std::vector<const ParameterResult*> shown;
  for (const ParameterResult& p : result.parameters)
    if (p.extrapolated && scalar(p.value)) shown.push_back(&p);
  std::string head = "<th>cells</th><th>time steps</th><th>elements</th>", body;
  for (const ParameterResult* p : shown) head += "<th>" + escape_html(spoken_name(p->name)) + "</th>";
  for (const ResolutionResult& r : result.resolutions) {
    body +=
        fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td>", readable(r.cells, 3), readable(r.steps, 3), r.elements);
    for (const ParameterResult* p : shown) {
      const auto value = r.values.find(p->name);
      const std::string text =
          value == r.values.end() ? "" : escape_html(value_text(value->second, std::nullopt, p->unit));
      body += "<td>" + text + "</td>";
    }
    body += "</tr>\n";
  }
  body += "<tr><td colspan=\"3\">limit</td>";
  for (const ParameterResult* p : shown)
    body += "<td>" + escape_html(value_text(*p->extrapolated, std::nullopt, p->unit)) + "</td>";
  return table(head, body + "</tr>\n") +
         "<p class=\"given\">Cells are elements along the object's longest axis, time steps those to one default step. "
         "The limit is Richardson's extrapolation; the errors stated for mesh and time step follow Roache's grid "
         "convergence index.</p>\n";
}

std::string presses_section(const ReportData& data) {
  if (data.presses.empty()) return "";
  std::string body;
  std::array<Series, 2> series;
  series[0].label = "fitted", series[1].label = "test, took no part in the fit";
  for (std::size_t i = 0; i < data.presses.size(); ++i) {
    const StaticError& press = data.presses[i];
    const bool is_test = press.role == "test";
    const auto length = [](const std::optional<double>& l) {
      return l ? readable(1e3 * *l, 3) + " mm" : "no equilibrium";
    };
    body += fmt::format("<tr><td>{}{}</td><td>{} N</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
                        escape_html(press.name), is_test ? " (test)" : "", readable(data.press_forces[i], 3),
                        length(press.max_displacement), length(press.marker_rms),
                        press.relative_error ? readable(100.0 * *press.relative_error, 3) + " %" : "");
    if (!press.marker_rms) continue;
    Series& s = series[is_test];
    s.mark = Mark::Dots;
    s.x.push_back(data.press_forces[i]);
    s.y.push_back(1e3 * *press.marker_rms);
  }
  PlotOptions options;
  options.x_label = "force [N]";
  options.y_label = "markers, rms [mm]";
  options.zero_y = true;
  std::vector<Series> drawn;
  for (Series& s : series)
    if (!s.x.empty()) drawn.push_back(std::move(s));
  std::string html = plot_svg(drawn, options);
  if (!data.basis_errors.empty()) {
    Series errors;
    errors.mark = Mark::LineAndDots;
    for (std::size_t k = 0; k < data.basis_errors.size(); ++k) {
      errors.x.push_back(double(k));
      errors.y.push_back(100.0 * data.basis_errors[k]);
    }
    options.x_label = "samples of an element", options.y_label = "error of stress [%]";
    html += "<p>What the elements' own laws and few of the samples leave of all of them:</p>\n" +
            plot_svg({errors}, options);
  }
  return html + "<details><summary>All presses</summary>\n" +
         table("<th></th><th>force</th><th>greatest displacement</th><th>markers, rms</th><th>of the displacement</th>",
               body) +
         "</details>\n";
}

/// One plot for each curve: measured points, and the model's line.
std::string curves_section(const std::vector<CurvePrediction>& curves) {
  std::string body, plots;
  for (const CurvePrediction& curve : curves) {
    const std::string name = curve.name + (curve.role == "test" ? " (test)" : "");
    const double percent = 100.0 * curve.relative_rms();
    body += fmt::format(
        "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n", escape_html(name), escape_html(curve.kind),
        curve.failure.empty() ? readable(curve.rms(), 3) + " " + curve.unit : escape_html(curve.failure),
        std::isfinite(percent) ? readable(percent, 3) + " %" : "");
    if (curve.at.size() < 2) continue;
    std::vector<Series> drawn(2);
    drawn[0].label = "measured", drawn[0].mark = Mark::Dots;
    drawn[0].x = curve.at, drawn[0].y = curve.measured;
    drawn[1].label = "model";
    for (std::size_t i = 0; i < curve.at.size(); ++i) {
      if (!std::isfinite(curve.predicted[i])) continue;
      drawn[1].x.push_back(curve.at[i]);
      drawn[1].y.push_back(curve.predicted[i]);
    }
    if (drawn[1].x.empty()) drawn.pop_back();
    PlotOptions options;
    options.x_label = curve.abscissa;
    options.y_label = curve.unit == "N" ? "force [N]" : "stress [Pa]";
    plots += "<p>" + escape_html(name) + "</p>\n" + plot_svg(drawn, options);
  }
  if (body.empty()) return "";
  return table("<th></th><th></th><th>model less measured, rms</th><th>of the greatest measured</th>", body) + plots;
}

std::string loads_table(const std::vector<LoadError>& loads) {
  if (loads.empty()) return "";
  const auto cell = [](const std::optional<double>& length, const std::optional<double>& relative) {
    if (!length || !relative) return std::string("<td></td>");
    return fmt::format("<td>{} mm, {} %</td>", readable(1e3 * *length, 3), readable(100.0 * *relative, 3));
  };
  std::string body;
  bool has_surface_distances = false;
  for (const LoadError& load : loads) {
    const bool is_surface = load.observed.find("markers") == std::string::npos;
    has_surface_distances = has_surface_distances || (is_surface && load.mean);
    body += fmt::format("<tr><td>{}</td>{}{}<td>{}</td></tr>\n", escape_html(load.name),
                        cell(load.mean, load.relative_mean), cell(load.max, load.relative_max),
                        load.failure.empty() ? fmt::format("{}, {} points", escape_html(load.observed), load.points)
                                             : escape_html(load.failure));
  }
  const char* of_surfaces =
      has_surface_distances
          ? " Points are compared with the nearest place of the simulated surface: sliding along it does not show."
          : "";
  return table("<th></th><th>mean distance, of the object's size</th><th>greatest</th><th>seen</th>", body) +
         "<p class=\"given\">Equilibria under weights that took no part in the fit." + of_surfaces + "</p>\n";
}

std::string usage(const ReportData& data) {
  const std::string capture = data.capture_path.empty() ? "CAPTURE" : data.capture_path;
  const std::string model = escape_html(data.model_file);
  const std::string live = data.live_page.empty()
                               ? ""
                               : "<p><a href=\"" + escape_html(data.live_page) + "\">Touch it</a>: " +
                                     (data.presses.empty() ? "pull, poke and throw" : "press and pull") +
                                     " the fitted object in the browser.</p>\n";
  return live + "<p>The model stands beside this page: <code>" + model +
         "</code> with its volume mesh and surface. All numbers are SI.</p>\n<pre>"
         "# predict another recording with this model and compare\npliant evaluate " +
         model + " OTHER_CAPTURE\n\n# repeat this fit\npliant fit " + escape_html(capture) + " --out OUT</pre>\n<p>" +
         (data.presses.empty() ? "The simulated motion opens in ParaView: <code>trajectory.pvd</code>. "
                               : "The object under each press opens in ParaView: <code>presses.pvd</code>. ") +
         "The figures of this page are in <code>result.json</code> and <code>convergence.csv</code>.</p>\n";
}

std::string footer(const Result& result) {
  std::string text = result.software.name + " " + result.software.version;
  if (!result.software.commit.empty()) text += " (" + result.software.commit.substr(0, 12) + ")";
  if (result.time.wall_seconds > 0.0) text += "; " + readable(result.time.wall_seconds, 3) + " s";
  if (result.time.forward_steps > 0) text += ", " + readable(double(result.time.forward_steps), 7) + " time steps";
  if (result.time.ms_per_forward_step) text += ", " + readable(*result.time.ms_per_forward_step, 3) + " ms a step";
  if (!result.capture.sha256.empty()) text += "; recording " + result.capture.sha256.substr(0, 16);
  return "<footer>" + escape_html(text) + "</footer>\n";
}

}  // namespace

std::string fields_html(const std::string& title, const std::vector<ReportField>& fields) {
  const std::string name = escape_html(title);
  return page_head(name) + "<h1>" + name + "</h1>\n" + section("Fields over the object", fields_section(fields)) +
         "</main></body></html>\n";
}

std::string report_html(const ReportData& data) {
  const std::string title = escape_html(data.title.empty() ? data.result.capture.name : data.title);
  std::string html = page_head(title);
  const std::string recording = escape_html(data.result.capture.name);
  html += "<h1>" + title + "</h1>\n<p class=\"sub\">" + (recording == title ? "" : recording) + "</p>\n";
  html += verdict(data.result) + headline(data.result);
  html += section("Summary", words(data));
  html += section("Observed and simulated", pictures(data));
  html += section("Fields over the object", fields_section(data.fields));
  html += section("Agreement over time", data.residuals.size() > 1 ? residual_plot(data.residuals) : "");
  html += section("Presses", presses_section(data));
  html += section("Force-depth and stress-strain curves", curves_section(data.result.curves));
  html += section("Static loads", loads_table(data.loads));
  html += section("Convergence", convergence(data));
  html += section("All parameters", parameter_table(data.result));
  html += section("Alternating tracking and estimation", tracking_part(data.result));
  html += section("Convergence in mesh and time step", resolutions_table(data.result));
  html += section("Uncertainty by cause", uncertainty_table(data.result));
  html += section("Parameter correlations", correlation_table(data.correlations));
  html += section("Starting points", starts_table(data.result));
  html += section("Using the model", usage(data));
  return html + footer(data.result) + "</main></body></html>\n";
}

void write_report(const std::filesystem::path& path, const ReportData& data) { write_file(path, report_html(data)); }

}  // namespace pliant
