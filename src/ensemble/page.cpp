#include "ensemble/page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/html.hpp"
#include "ensemble/quantiles.hpp"
#include "report/gallery.hpp"
#include "report/page.hpp"
#include "report/plot.hpp"

namespace pliant {

namespace {

constexpr std::size_t failures_told = 20;
constexpr std::size_t point_plots = 12;  // coordinates of four points
constexpr double telling = 0.1;          // a rank correlation from where on something is said to depend on something

/// Where a coordinate or an instant of one event stands in the table of quantiles, and in no other.
bool is_place_or_time(const EnsembleQuantity& q) {
  return q.name.ends_with("_x") || q.name.ends_with("_y") || q.name.ends_with("_z") || q.name.ends_with("_time") ||
         q.name.starts_with("x@") || q.name.starts_with("y@") || q.name.starts_with("z@");
}

double greatest_size(const std::vector<double>& numbers) {
  double most = 0.0;
  for (const double number : numbers)
    if (std::isfinite(number)) most = std::max(most, std::abs(number));
  return most;
}

/// The unit in which all of these numbers are told, strains in per cent.
SpokenUnit told_unit(const std::vector<double>& numbers, const EnsembleQuantity& q) {
  if (q.name == "peak_strain") return {100.0, "%"};
  return spoken_unit(greatest_size(numbers), q.unit);
}

std::string with_unit(const std::string& name, const std::string& unit) {
  return unit.empty() ? name : name + " [" + unit + "]";
}

std::string quantile_table(const std::vector<EnsembleColumn>& columns) {
  std::string head = "<th></th>", body;
  for (const double share : told_shares) head += fmt::format("<th>{:g} %</th>", 100.0 * share);
  for (const EnsembleColumn& column : columns) {
    const std::array<double, 5> values = told_quantiles(column.numbers);
    const SpokenUnit unit = told_unit({values.begin(), values.end()}, column.quantity);
    body += "<tr><td>" + escape_html(with_unit(spoken_name(column.quantity.name), unit.unit)) + "</td>";
    for (const double value : values)
      body += "<td>" + (std::isfinite(value) ? readable(unit.factor * value, 4) : "") + "</td>";
    body += "</tr>\n";
  }
  return table(head, body);
}

/// Median, with bands of half and of nine tenths of the members.
std::string band_plot(const EnsembleBand& band, const std::vector<double>& times) {
  std::vector<double> all;
  for (const auto& frame : band.frames) all.insert(all.end(), frame.begin(), frame.end());
  const SpokenUnit unit = told_unit(all, band.quantity);
  std::array<Series, 2> series;
  for (std::size_t k = 0; k < series.size(); ++k) {
    series[k].colour = 0;
    for (std::size_t f = 0; f < band.frames.size(); ++f) {
      const auto at = [&](std::size_t share) { return unit.factor * band.frames[f][share]; };
      series[k].x.push_back(times[f]), series[k].y.push_back(at(2));
      series[k].low.push_back(at(k)), series[k].high.push_back(at(4 - k));
    }
  }
  PlotOptions options;
  options.title = spoken_name(band.quantity.name);
  options.x_label = "time [s]", options.y_label = unit.unit.empty() ? "" : "[" + unit.unit + "]";
  options.width = 460, options.height = 250;
  return panel(plot_svg({series[0], series[1]}, options));
}

std::string band_plots(const std::vector<EnsembleBand>& bands, const std::vector<double>& times) {
  if (times.size() < 2 || bands.empty()) return "";
  std::string html = "<div class=\"small-plots\">\n";
  for (const EnsembleBand& band : bands) html += band_plot(band, times);
  return html + "</div>\n";
}

std::string over_time(const EnsemblePage& page) {
  const std::string all = band_plots(page.bands, page.plan.times);
  if (all.empty()) return "";
  return "<p>The median of each frame, and where half and nine tenths of the members lie.</p>\n" + all;
}

std::string points_over_time(const EnsemblePage& page) {
  const bool are_many = page.point_bands.size() > point_plots;
  std::vector<EnsembleBand> shown = page.point_bands;
  if (are_many) shown.resize(point_plots);
  std::string html = band_plots(shown, page.plan.times);
  if (are_many && !html.empty()) html += "<p class=\"given\">The other points are in <code>points.csv</code>.</p>\n";
  return html;
}

/// Shares of the members below a value.
std::string distributions(const std::vector<EnsembleColumn>& columns) {
  std::vector<double> shares;
  for (int percent = 0; percent <= 100; ++percent) shares.push_back(0.01 * percent);
  std::string html;
  for (const EnsembleColumn& column : columns) {
    if (is_place_or_time(column.quantity)) continue;
    const std::vector<double> values = quantiles(column.numbers, shares);
    if (!std::isfinite(values.front()) || !(values.back() > values.front())) continue;
    const SpokenUnit unit = told_unit(values, column.quantity);
    Series series;
    for (std::size_t k = 0; k < shares.size(); ++k)
      series.x.push_back(unit.factor * values[k]), series.y.push_back(100.0 * shares[k]);
    PlotOptions options;
    options.title = spoken_name(column.quantity.name);
    options.x_label = with_unit("", unit.unit), options.y_label = "members below [%]", options.zero_y = true;
    options.width = 460, options.height = 220;
    html += panel(plot_svg({series}, options));
  }
  return html.empty() ? "" : "<div class=\"small-plots\">\n" + html + "</div>\n";
}

/// How the ranks of what varies go with those of what comes out.
std::string drivers(const EnsemblePage& page) {
  std::vector<const EnsembleColumn*> varied, told;
  for (std::size_t k = 0; k < page.columns.size(); ++k) {
    const EnsembleColumn& column = page.columns[k];
    const auto [least, most] = std::ranges::minmax(column.numbers);
    if (k < material_columns.size() ? most > least : !is_place_or_time(column.quantity))
      (k < material_columns.size() ? varied : told).push_back(&column);
  }
  std::string head = "<th></th>", body;
  for (const EnsembleColumn* v : varied)
    head += "<th style=\"text-align:center\">" + escape_html(spoken_name(v->quantity.name)) + "</th>";
  for (const EnsembleColumn* t : told) {
    std::string row;
    bool is_any = false;
    for (const EnsembleColumn* v : varied) {
      const double correlation = rank_correlation(v->numbers, t->numbers);
      is_any = is_any || std::abs(correlation) > telling;
      row += std::isfinite(correlation) ? correlation_cell(correlation) : "<td class=\"cell given\">-</td>";
    }
    if (is_any) body += "<tr><td>" + escape_html(spoken_name(t->quantity.name)) + "</td>" + row + "</tr>\n";
  }
  if (varied.empty() || body.empty()) return "";
  return table(head, body) +
         "<p class=\"given\">Correlations of ranks over all members: near −1 or 1 the one decides the other. Materials "
         "that are drawn together are correlated with each other, too.</p>\n";
}

std::string surfaces(const EnsemblePage& page) {
  if (page.surfaces.empty()) return "";
  Gallery gallery;
  gallery.triangles = page.surface.triangles;
  gallery.planes = page.model.scene.planes;
  gallery.up = page.model.scene.world.up;
  gallery.width = 480, gallery.height = 400;
  std::vector<FieldState> states;
  for (const EnsembleSurface& s : page.surfaces)
    states.push_back({s.median, s.spread,
                      fmt::format("Frame {}, {} s", s.frame, readable(page.plan.times[std::size_t(s.frame)], 3))});
  return "<p>The median of each coordinate, coloured by how far apart the members are: half the diagonal of the box "
         "that holds nine tenths of them in each coordinate.</p>\n" +
         fields_section({draw_field(gallery, states, "spread", "m", ScaleEnds::FromZero)});
}

std::string failures(const MemberRecords& members) {
  std::string items;
  std::size_t count = 0;
  for (std::size_t i = 0; i < members.size(); ++i) {
    if (members[i].state == MemberRecord::State::Simulated) continue;
    if (++count <= failures_told)
      items += fmt::format("<li>Member {}: {}</li>\n", i + 1, escape_html(members[i].reason));
  }
  if (count > failures_told)
    items += fmt::format("<li>and {} more, in <code>members.csv</code></li>\n", count - failures_told);
  return items.empty() ? "" : "<ul class=\"words\">\n" + items + "</ul>\n";
}

}  // namespace

std::vector<double> spread_of(const PositionQuantiles& quantiles, Eigen::Index points) {
  std::vector<double> spread;
  for (Eigen::Index i = 0; i < points; ++i)
    spread.push_back(0.5 * (quantiles.back().row(i) - quantiles.front().row(i)).norm());
  return spread;
}

std::string ensemble_html(const EnsemblePage& page) {
  const auto failed = std::ranges::count_if(
      page.members, [](const MemberRecord& member) { return member.state != MemberRecord::State::Simulated; });
  const std::string title = escape_html(page.plan.model);
  std::string html = page_head(title) + "<h1>" + title + "</h1>\n";
  html += fmt::format("<p class=\"sub\">An ensemble of {} members with materials drawn from {}; {}</p>\n",
                      page.members.size(), escape_html(page.plan.source),
                      failed == 0 ? "all were simulated" : fmt::format("{} of them could not be simulated", failed));
  html += section("What comes out",
                  quantile_table(page.columns) +
                      "<p class=\"given\">Below each value lies that share of the members. Furthest and lowest: "
                      "where the vertex of the surface is then that moves most, or comes lowest. "
                      "Coordinates of points are those of the last frame.</p>\n");
  html += section("Over time", over_time(page));
  html += section("Points over time", points_over_time(page));
  html += section("The surface", surfaces(page));
  html += section("Distributions", distributions(page.columns));
  html += section("What it depends on", drivers(page));
  html += section("Members that failed", failures(page.members));
  html +=
      section("Files",
              "<p>One row a member: <code>members.csv</code>. Quantiles: <code>quantiles.csv</code>, in every frame "
              "<code>frames.csv</code>" +
                  std::string(page.plan.points.empty() ? "" : ", of the points <code>points.csv</code>") +
                  (page.plan.vertices > 0 ? "; of the surface <code>surface.pvd</code>, which opens in ParaView" : "") +
                  ".</p>\n");
  return html + "</main></body></html>\n";
}

}  // namespace pliant
