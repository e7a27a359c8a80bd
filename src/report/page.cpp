#include "report/page.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "base/base64.hpp"
#include "base/html.hpp"
#include "report/image.hpp"
#include "report/page_style.hpp"
#include "report/plot.hpp"

namespace pliant {

std::string page_head(const std::string& title) {
  return "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
         "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">"
         "<meta name=\"color-scheme\" content=\"light dark\"><title>" +
         title + "</title><style>" + page_style + "</style></head><body><main>\n";
}

std::string section(const std::string& title, const std::string& body) {
  return body.empty() ? "" : "<section><h2>" + title + "</h2>\n" + body + "</section>\n";
}

std::string panel(const std::string& content) { return "<div class=\"panel\">" + content + "</div>\n"; }

std::string table(const std::string& head, const std::string& body) {
  return "<div class=\"panel table\"><table><thead><tr>" + head + "</tr></thead><tbody>\n" + body +
         "</tbody></table></div>\n";
}

std::string figures(const std::vector<ReportPicture>& pictures) {
  if (pictures.empty()) return "";
  std::string html = "<div class=\"pictures\">\n";
  for (const ReportPicture& picture : pictures) {
    const std::string caption = escape_html(picture.caption);
    html += "<figure><img alt=\"" + caption + "\" src=\"data:image/png;base64," + encode_base64(picture.png) +
            "\"><figcaption>" + caption + "</figcaption></figure>\n";
  }
  return html + "</div>\n";
}

namespace {

std::string field_plot(const ReportField& field) {
  if (field.at.size() < 2) return "";
  double most = 0.0;
  for (const double v : field.greatest)
    if (std::isfinite(v)) most = std::max(most, std::abs(v));
  const auto [factor, unit] = spoken_unit(most, field.unit);
  std::array<Series, 2> series;
  series[0].label = "greatest of all elements", series[1].label = "mean by volume";
  for (std::size_t i = 0; i < field.at.size(); ++i) {
    for (Series& s : series) s.x.push_back(field.at[i]);
    series[0].y.push_back(factor * field.greatest[i]);
    series[1].y.push_back(factor * field.mean[i]);
  }
  PlotOptions options;
  options.x_label = field.abscissa, options.y_label = unit.empty() ? field.name : field.name + " [" + unit + "]";
  options.zero_y = true, options.height = 260;
  return panel(plot_svg({series[0], series[1]}, options));
}

}  // namespace

std::string fields_section(const std::vector<ReportField>& fields) {
  std::string html;
  int number = 0;
  for (const ReportField& field : fields) {
    html += "<h3>" + escape_html(field.name) + "</h3>\n<div class=\"scale\">" +
            colour_bar_svg(field.scale, field.name, field.unit, fmt::format("field-{}", ++number)) + "</div>\n" +
            figures(field.pictures) + field_plot(field);
  }
  return html;
}

// Readable on the diverging colours of both ends.
std::string correlation_cell(double value) {
  const Rgb colour = diverging_colour(value);
  const char* ink = std::abs(value) > 0.7 ? "#fff" : "#222";
  return fmt::format("<td class=\"cell\" style=\"background:{};color:{}\">{}{:.2f}</td>", css(colour), ink,
                     value < 0 ? "−" : "", std::abs(value));
}

}  // namespace pliant
