#include "batch/job_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>

#include "base/csv.hpp"
#include "base/error.hpp"
#include "base/files.hpp"
#include "base/html.hpp"
#include "model/result.hpp"

namespace pliant {

namespace {

namespace fs = std::filesystem;

struct Row {
  const BatchJob* job;
  std::optional<BatchStatus> status;
  std::optional<Result> result;
};

std::optional<Result> result_of(const fs::path& folder) {
  if (!is_file(folder / "result.json")) return std::nullopt;
  try {
    return read_result(folder / "result.json");
  } catch (const InputError&) {
    return std::nullopt;
  }
}

std::string state_of(const Row& row) { return row.status ? name_of(row.status->state) : "not run"; }

/// A number of a parameter; empty: none.
std::string number(const std::optional<ParameterValue>& value) {
  const double* scalar = value ? std::get_if<double>(&*value) : nullptr;
  return scalar ? fmt::format("{:.9g}", *scalar) : "";
}

/// Where a parameter stands in the table: the material first.
int rank_of(const std::string& name) {
  constexpr std::array<const char*, 4> first = {"youngs_modulus", "poissons_ratio", "mass_damping",
                                                "stiffness_damping"};
  for (std::size_t k = 0; k < first.size(); ++k)
    if (name.starts_with(first[k])) return int(k);
  return int(first.size());
}

/// Scalars that any job estimated, in a fixed order, each with its unit.
std::vector<std::pair<std::string, std::string>> columns_of(const std::vector<Row>& rows) {
  std::set<std::pair<std::string, std::string>> columns;
  for (const Row& row : rows)
    if (row.result)
      for (const ParameterResult& p : row.result->parameters)
        if (p.estimated && std::holds_alternative<double>(p.value)) columns.emplace(p.name, p.unit);
  std::vector<std::pair<std::string, std::string>> sorted(columns.begin(), columns.end());
  std::ranges::stable_sort(sorted, {}, [](const auto& column) { return rank_of(column.first); });
  return sorted;
}

std::string csv(const std::vector<Row>& rows) {
  const auto columns = columns_of(rows);
  std::string text = "recording,folder,state,reason,verdict,surface_rms [m]";
  for (const auto& [name, unit] : columns)
    text += fmt::format(",{0} [{1}],{0} std [{1}],{0} 5 % [{1}],{0} 95 % [{1}]", name, unit);
  text += "\n";
  for (const Row& row : rows) {
    text += csv_cell(row.job->capture.filename().string()) + "," + row.job->name + "," + state_of(row) + "," +
            csv_cell(row.status ? row.status->reason : "");
    text += "," + (row.result ? row.result->verdict : "") + ",";
    if (row.result && row.result->error.surface_rms) text += fmt::format("{:.6g}", *row.result->error.surface_rms);
    for (const auto& [name, unit] : columns) {
      const ParameterResult* p = row.result ? row.result->find(name) : nullptr;
      text += "," + (p ? number(p->value) : "") + "," + (p ? number(p->std) : "");
      text += p && p->interval_90 ? fmt::format(",{:.9g},{:.9g}", p->interval_90->first, p->interval_90->second) : ",,";
    }
    text += "\n";
  }
  return text;
}

std::string told(const ParameterResult* p) {
  const double* value = p ? std::get_if<double>(&p->value) : nullptr;
  if (!value) return "";
  std::string text = fmt::format("{:.4g}", *value);
  if (p->interval_90)
    text += fmt::format("<br><small class=interval>{:.3g} .. {:.3g}</small>", p->interval_90->first,
                        p->interval_90->second);
  return text;
}

std::string page(const std::vector<Row>& rows, const BatchSummary& summary) {
  const auto columns = columns_of(rows);
  std::string text =
      "<!doctype html><meta charset=utf-8><title>pliant batch</title><style>"
      "body{font:15px system-ui,sans-serif;margin:2em;max-width:100%}table{border-collapse:collapse}"
      "th,td{padding:.3em .8em;border-bottom:1px solid #ddd;text-align:left;vertical-align:top}"
      "small{color:#666}.interval{white-space:nowrap}.failed,.timed{color:#a00}</style>";
  text += fmt::format("<h1>{} recordings</h1><p>{} ended, {} of them converged. 90 % intervals beside the values.</p>",
                      summary.jobs, summary.ended, summary.converged);
  text += "<table><tr><th>recording<th>state<th>verdict";
  for (const auto& [name, unit] : columns) text += "<th>" + escape_html(name) + (unit == "1" ? "" : " [" + unit + "]");
  for (const Row& row : rows) {
    const std::string name = escape_html(row.job->capture.filename().string()), state = state_of(row);
    const bool has_report = row.result.has_value();
    text += "\n<tr><td>" + (has_report ? "<a href=\"" + row.job->name + "/report.html\">" + name + "</a>" : name);
    text += "<td class=\"" + state.substr(0, state.find(' ')) + "\">" + state;
    if (row.status && !row.status->reason.empty()) text += "<br><small>" + escape_html(row.status->reason) + "</small>";
    text += "<td>" + (row.result ? row.result->verdict : "");
    for (const auto& [parameter, unit] : columns)
      text += "<td>" + told(row.result ? row.result->find(parameter) : nullptr);
  }
  return text + "\n</table>\n";
}

std::vector<Row> rows_of(const fs::path& batch, const std::vector<BatchJob>& jobs) {
  std::vector<Row> rows;
  for (const BatchJob& job : jobs) {
    Row row{&job, read_status(batch, job), {}};
    if (row.status) row.result = result_of(batch / job.name);
    rows.push_back(std::move(row));
  }
  std::ranges::sort(rows, {}, [](const Row& row) { return std::pair(row.job->capture.filename(), row.job->key); });
  return rows;
}

BatchSummary summary_of(const std::vector<Row>& rows) {
  BatchSummary summary;
  for (const Row& row : rows) {
    ++summary.jobs;
    summary.ended += row.status.has_value() ? 1 : 0;
    summary.converged += row.status && row.status->state == BatchStatus::State::Converged ? 1 : 0;
  }
  return summary;
}

}  // namespace

BatchSummary write_batch_table(const fs::path& batch, const std::vector<BatchJob>& jobs) {
  const auto ended = [&] {
    return std::ranges::count_if(jobs, [&](const BatchJob& job) { return read_status(batch, job).has_value(); });
  };
  while (true) {
    const std::vector<Row> rows = rows_of(batch, jobs);
    const BatchSummary summary = summary_of(rows);
    write_file(batch / "results.csv", csv(rows));
    write_file(batch / "results.html", page(rows, summary));
    // Another process may have ended a job and written its table meanwhile, in whose place this one now stands.
    if (ended() == summary.ended) return summary;
  }
}

}  // namespace pliant
