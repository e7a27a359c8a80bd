#include "ensemble/tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/csv.hpp"
#include "base/parallel.hpp"
#include "ensemble/quantiles.hpp"

namespace pliant {

namespace {

namespace fs = std::filesystem;

std::string share_name(std::size_t k) { return fmt::format("{:g} %", 100.0 * told_shares[k]); }

/// Empty where there is none.
std::string cell(double number) { return std::isfinite(number) ? fmt::format("{:.9g}", number) : ""; }

std::string column_name(const EnsembleQuantity& q) { return q.name + " [" + q.unit + "]"; }

/// Heads of columns of the quantiles of a quantity.
std::string quantile_heads(const EnsembleQuantity& q) {
  std::string text;
  for (std::size_t k = 0; k < told_shares.size(); ++k)
    text += fmt::format(",{} {} [{}]", q.name, share_name(k), q.unit);
  return text;
}

bool is_simulated(const MemberRecord& record) { return record.state == MemberRecord::State::Simulated; }

}  // namespace

MemberRecords read_members(const fs::path& ensemble, const EnsemblePlan& plan) {
  MemberRecords members;
  members.reserve(std::size_t(plan.members()));
  for (const EnsembleChunk& chunk : plan.chunks) {
    const ChunkReader reader(chunks_of(ensemble), chunk, plan.shape);
    for (int i = 0; i < chunk.members; ++i) members.push_back(reader.record(i));
  }
  return members;
}

std::vector<EnsembleColumn> columns_of(const EnsemblePlan& plan, const MemberRecords& members) {
  std::vector<EnsembleColumn> columns;
  for (std::size_t k = 0; k < material_columns.size(); ++k) {
    const std::string& name = material_columns[k];
    const std::size_t bracket = name.find(" [");
    EnsembleColumn column{{name.substr(0, bracket), name.substr(bracket + 2, name.size() - bracket - 3)}, {}};
    for (const DrawnMaterial& material : plan.materials) column.numbers.push_back(numbers_of(material)[k]);
    columns.push_back(std::move(column));
  }
  for (std::size_t k = 0; k < plan.outputs.size(); ++k) {
    EnsembleColumn column{plan.outputs[k], {}};
    for (const MemberRecord& member : members) column.numbers.push_back(member.outputs[k]);
    columns.push_back(std::move(column));
  }
  return columns;
}

std::vector<double> series_of(const MemberRecords& members, const RecordShape& shape, int series, int frame) {
  const auto at = std::size_t(frame) * std::size_t(shape.series) + std::size_t(series);
  std::vector<double> numbers;
  for (const MemberRecord& member : members) numbers.push_back(double(member.series[at]));
  return numbers;
}

std::string members_csv(const EnsemblePlan& plan, const MemberRecords& members) {
  std::string text = "member";
  for (const std::string& column : material_columns) text += "," + column;
  text += ",state,reason";
  for (const EnsembleQuantity& output : plan.outputs) text += "," + csv_cell(column_name(output));
  text += "\n";
  for (std::size_t i = 0; i < members.size(); ++i) {
    text += std::to_string(i + 1);
    for (const double number : numbers_of(plan.materials[i])) text += "," + cell(number);
    text += std::string(is_simulated(members[i]) ? ",simulated," : ",failed,") + csv_cell(members[i].reason);
    for (const double number : members[i].outputs) text += "," + cell(number);
    text += "\n";
  }
  return text;
}

std::string quantiles_csv(const std::vector<EnsembleColumn>& columns) {
  std::string text = "quantity,unit,members";
  for (std::size_t k = 0; k < told_shares.size(); ++k) text += "," + share_name(k);
  text += "\n";
  for (const EnsembleColumn& column : columns) {
    const auto count = std::ranges::count_if(column.numbers, [](double number) { return std::isfinite(number); });
    text += csv_cell(column.quantity.name) + "," + column.quantity.unit + "," + std::to_string(count);
    for (const double quantile : told_quantiles(column.numbers)) text += "," + cell(quantile);
    text += "\n";
  }
  return text;
}

std::string frames_csv(const EnsemblePlan& plan, const MemberRecords& members) {
  const std::vector<EnsembleQuantity>& all = EnsembleScene::series();
  std::string text = "frame,time [s]";
  for (const EnsembleQuantity& quantity : all) text += quantile_heads(quantity);
  text += "\n";
  for (int frame = 0; frame < plan.shape.frames; ++frame) {
    text += fmt::format("{},{:.9g}", frame, plan.times[std::size_t(frame)]);
    for (int series = 0; series < int(all.size()); ++series)
      for (const double quantile : told_quantiles(series_of(members, plan.shape, series, frame)))
        text += "," + cell(quantile);
    text += "\n";
  }
  return text;
}

PositionQuantiles position_quantiles(const fs::path& ensemble, const EnsemblePlan& plan, int frame,
                                     std::size_t most_bytes) {
  const auto members = std::size_t(plan.members());
  const int points = plan.shape.points;
  PositionQuantiles found;
  for (Points& quantile : found) quantile.resize(points, 3);
  if (points == 0) return found;
  const int at_once = int(std::clamp<std::size_t>(most_bytes / (3 * sizeof(float) * members), 1, std::size_t(points)));
  std::vector<float> of_member(3 * std::size_t(at_once)),
      all(of_member.size() * members);  // all: coordinates x members
  for (int first = 0; first < points; first += at_once) {
    const int count = std::min(at_once, points - first);
    const std::size_t coordinates = 3 * std::size_t(count);
    std::size_t member = 0;
    for (const EnsembleChunk& chunk : plan.chunks) {
      const ChunkReader reader(chunks_of(ensemble), chunk, plan.shape);
      for (int i = 0; i < chunk.members; ++i, ++member) {
        reader.positions(i, frame, first, count, of_member.data());
        for (std::size_t c = 0; c < coordinates; ++c) all[c * members + member] = of_member[c];
      }
    }
    parallel_for(std::size_t(0), coordinates, [&](std::size_t c) {
      const std::array<double, 5> quantiles = told_quantiles(&all[c * members], &all[c * members] + members);
      for (std::size_t k = 0; k < quantiles.size(); ++k)
        found[k](Eigen::Index(first) + Eigen::Index(c / 3), Eigen::Index(c % 3)) = quantiles[k];
    });
  }
  return found;
}

std::string points_csv_head() {
  std::string text = "frame,time [s],id";
  for (const char* axis : {"x", "y", "z"}) text += quantile_heads({axis, "m"});
  return text + "\n";
}

std::string points_csv_rows(const EnsemblePlan& plan, int frame, const PositionQuantiles& quantiles) {
  std::string text;
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    text += fmt::format("{},{:.9g},{}", frame, plan.times[std::size_t(frame)], csv_cell(plan.points[i]));
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      for (const Points& quantile : quantiles) text += "," + cell(quantile(plan.vertices + Eigen::Index(i), axis));
    text += "\n";
  }
  return text;
}

}  // namespace pliant
