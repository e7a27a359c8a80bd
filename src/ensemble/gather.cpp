#include "ensemble/gather.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "base/error.hpp"
#include "base/files.hpp"
#include "ensemble/page.hpp"
#include "ensemble/quantiles.hpp"
#include "ensemble/tables.hpp"
#include "jobs/claim.hpp"
#include "model/vtu.hpp"
#include "report/gallery.hpp"

namespace pliant {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr int surfaces_drawn = 4;

Json description(const EnsemblePlan& plan) {
  Json json = {{"format", "ensemble/1"},
               {"key", plan.key},
               {"model", plan.model},
               {"from", plan.source},
               {"members", plan.members()}};
  const auto told = [](const std::vector<EnsembleQuantity>& quantities) {
    Json list = Json::array();
    for (const EnsembleQuantity& q : quantities) list.push_back({{"name", q.name}, {"unit", q.unit}});
    return list;
  };
  json["outputs"] = told(plan.outputs), json["series"] = told(EnsembleScene::series());
  json["times"] = plan.times;
  json["vertices"] = plan.vertices, json["points"] = plan.points;
  for (const EnsembleChunk& chunk : plan.chunks)
    json["chunks"].push_back(
        {{"file", "chunks/" + chunk.name}, {"first", chunk.first + 1}, {"members", chunk.members}});
  return json;
}

bool is_gathered(const fs::path& ensemble, const EnsemblePlan& plan) {
  if (!is_file(ensemble / "ensemble.json")) return false;
  const Json json = Json::parse(read_file(ensemble / "ensemble.json"), nullptr, false);
  if (!json.is_object() || json.value("key", "") != plan.key) return false;
  std::vector<std::string> files = {"members.csv", "quantiles.csv", "frames.csv", "ensemble.html"};
  if (!plan.points.empty()) files.emplace_back("points.csv");
  if (plan.vertices > 0) files.emplace_back("surface.pvd");
  return std::ranges::all_of(files, [&](const std::string& file) { return is_file(ensemble / file); });
}

/// The surface's vertices at the median of each coordinate, with their other quantiles.
VtuGrid surface_grid(const TriangleMesh& surface, const PositionQuantiles& quantiles) {
  const auto vertices = Eigen::Index(surface.vertices.size());
  VtuGrid grid;
  grid.kind = VtuCell::Triangle;
  grid.points = quantiles[2].topRows(vertices);
  for (const auto& triangle : surface.triangles)
    grid.connectivity.insert(grid.connectivity.end(), triangle.begin(), triangle.end());
  for (const std::size_t k : {0, 1, 3, 4}) {
    VtuArray array{fmt::format("{:g} % [m]", 100.0 * told_shares[k]), 3, {}};
    for (Eigen::Index i = 0; i < vertices; ++i)
      for (Eigen::Index axis = 0; axis < 3; ++axis) array.values.push_back(quantiles[k](i, axis));
    grid.point_data.push_back(std::move(array));
  }
  grid.point_data.push_back({"spread [m]", 1, spread_of(quantiles, vertices)});
  return grid;
}

/// Bands of the points' coordinates; their frames are added by `add_points`.
std::vector<EnsembleBand> bands_of_points(const EnsemblePlan& plan) {
  std::vector<EnsembleBand> bands;
  for (const std::string& id : plan.points)
    for (const char* axis : {"x@", "y@", "z@"}) bands.push_back({{axis + id, "m"}, {}});
  return bands;
}

void add_points(const PositionQuantiles& quantiles, int vertices, std::vector<EnsembleBand>& bands) {
  for (std::size_t b = 0; b < bands.size(); ++b) {
    std::array<double, 5>& at = bands[b].frames.emplace_back();
    for (std::size_t k = 0; k < at.size(); ++k)
      at[k] = quantiles[k](vertices + Eigen::Index(b / 3), Eigen::Index(b % 3));
  }
}

std::vector<EnsembleBand> bands_of_series(const EnsemblePlan& plan, const MemberRecords& members) {
  std::vector<EnsembleBand> bands;
  for (int s = 0; s < plan.shape.series; ++s) {
    EnsembleBand band{EnsembleScene::series()[std::size_t(s)], {}};
    for (int frame = 0; frame < plan.shape.frames; ++frame)
      band.frames.push_back(told_quantiles(series_of(members, plan.shape, s, frame)));
    bands.push_back(std::move(band));
  }
  return bands;
}

/// Writes what is told of paths, and what of them the page shows.
void gather_paths(const fs::path& ensemble, const EnsembleScene& scene, const EnsemblePlan& plan, EnsemblePage& page,
                  const std::function<bool(int, int)>& progress) {
  const std::vector<int> drawn = spread_frames(0, plan.shape.frames - 1, surfaces_drawn);
  std::vector<PvdEntry> entries;
  std::string rows = points_csv_head();
  page.point_bands = bands_of_points(plan);
  for (int frame = 0; frame < plan.shape.frames; ++frame) {
    const PositionQuantiles quantiles = position_quantiles(ensemble, plan, frame);
    if (plan.vertices > 0) {
      const std::string name = fmt::format("surface/{:06}.vtu", frame);
      write_vtu(ensemble / name, surface_grid(scene.surface(), quantiles), VtuPrecision::Single);
      entries.push_back({plan.times[std::size_t(frame)], name});
      if (std::ranges::binary_search(drawn, frame))
        page.surfaces.push_back(
            {frame, quantiles[2].topRows(plan.vertices), spread_of(quantiles, Eigen::Index(plan.vertices))});
    }
    rows += points_csv_rows(plan, frame, quantiles);
    add_points(quantiles, plan.vertices, page.point_bands);
    if (progress && !progress(frame + 1, plan.shape.frames)) throw Interrupted();
  }
  if (plan.vertices > 0) write_pvd(ensemble / "surface.pvd", entries);
  if (!plan.points.empty()) write_file(ensemble / "points.csv", rows);
}

}  // namespace

bool gather_ensemble(const fs::path& ensemble, const Model& model, const EnsembleScene& scene, const EnsemblePlan& plan,
                     const std::function<bool(int, int)>& progress) {
  if (is_gathered(ensemble, plan)) return true;
  make_folder(ensemble / "claims");
  const std::optional<Claim> claim = Claim::take(ensemble / "claims" / plan.key);
  if (!claim) return false;
  const MemberRecords members = read_members(ensemble, plan);
  const std::vector<EnsembleColumn> columns = columns_of(plan, members);
  EnsemblePage page{plan, model, scene.surface(), members, columns, bands_of_series(plan, members), {}, {}};
  for (const char* file : {"ensemble.json", "points.csv", "surface.pvd"})
    remove_file(ensemble / file);  // of another one
  write_file(ensemble / "members.csv", members_csv(plan, members));
  write_file(ensemble / "quantiles.csv", quantiles_csv(columns));
  write_file(ensemble / "frames.csv", frames_csv(plan, members));
  if (plan.shape.points > 0) gather_paths(ensemble, scene, plan, page, progress);
  // Pictures need members that were simulated.
  if (std::ranges::none_of(members, [](const MemberRecord& m) { return m.state == MemberRecord::State::Simulated; }))
    page.surfaces.clear();
  write_file(ensemble / "ensemble.html", ensemble_html(page));
  write_file(ensemble / "ensemble.json", description(plan).dump(2) + "\n");
  return true;
}

}  // namespace pliant
