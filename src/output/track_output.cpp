#include "output/track_output.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "base/files.hpp"
#include "base/html.hpp"
#include "elasticity/corotated.hpp"
#include "model/vtu.hpp"
#include "output/fit_output.hpp"
#include "report/gallery.hpp"
#include "report/page.hpp"
#include "report/plot.hpp"
#include "simulation/trajectory.hpp"

namespace pliant {

namespace fs = std::filesystem;

std::vector<State> states_of(const Track& track) {
  std::vector<State> states;
  for (std::size_t i = 0; i < track.frames.size(); ++i) {
    const TrackedFrame& frame = track.frames[i];
    State state{frame.nodes, Points::Zero(frame.nodes.rows(), 3)};
    if (i > 0 && !frame.is_held && frame.time > track.frames[i - 1].time)
      state.v = (frame.nodes - track.frames[i - 1].nodes) / (frame.time - track.frames[i - 1].time);
    states.push_back(std::move(state));
  }
  return states;
}

std::vector<Points> follow(const Track& track, const std::vector<Vector3>& rest, int frame_count) {
  const Embedding embedding(*track.body, rest);
  std::vector<Points> positions(std::size_t(frame_count), Points::Constant(Eigen::Index(rest.size()), 3,
                                                                           std::numeric_limits<double>::quiet_NaN()));
  for (const TrackedFrame& frame : track.frames) positions[std::size_t(frame.frame)] = embedding.positions(frame.nodes);
  return positions;
}

std::string to_json(const Track& track, const Capture& capture) {
  nlohmann::ordered_json json;
  json["format"] = "track/1";
  json["capture"] = {{"name", capture.name}, {"sha256", capture.sha256}};
  json["nodes"] = track.body->node_count();
  json["elements"] = track.body->element_count();
  json["surface_samples"] = track.surface.vertices.size();
  json["lost_at"] = track.lost_at ? nlohmann::ordered_json(*track.lost_at) : nlohmann::ordered_json(nullptr);
  if (!track.note.empty()) json["note"] = track.note;
  json["frames"] = nlohmann::ordered_json::array();
  for (const TrackedFrame& f : track.frames) {
    nlohmann::ordered_json frame = {{"frame", f.frame},   {"time", f.time},           {"held", f.is_held},
                                    {"points", f.points}, {"explained", f.explained}, {"supported", f.supported}};
    if (f.points > 0) frame["surface_rms"] = f.surface_rms;
    if (f.markers > 0) frame["marker_rms"] = f.marker_rms;
    frame["confidence"] = f.confidence;
    frame["lost"] = f.is_lost;
    frame["rounds"] = f.rounds;
    json["frames"].push_back(std::move(frame));
  }
  return json.dump(1) + "\n";
}

namespace {

std::string to_csv(const Track& track) {
  std::string text = "frame,time,points,explained,supported,surface_rms,marker_rms,confidence,lost,rounds\n";
  for (const TrackedFrame& f : track.frames)
    text += fmt::format("{},{:.9g},{},{:.4f},{:.4f},{:.6g},{:.6g},{:.4f},{},{}\n", f.frame, f.time, f.points,
                        f.explained, f.supported, f.surface_rms, f.marker_rms, f.confidence, int(f.is_lost), f.rounds);
  return text;
}

Gallery gallery_of(const Capture& capture, const std::vector<ObservedFrame>& observed, const Track& track,
                   const MotionBlocks& blocks, const VectorX& theta) {
  Gallery gallery;
  gallery.triangles = track.surface.triangles;
  gallery.planes = planes_at(capture, blocks, theta);
  if (!capture.depth.empty()) gallery.camera = capture.depth.front().camera;
  gallery.up = capture.scene.world.up;
  gallery.width = 560, gallery.height = 420;
  gallery.samples = 2;  // a picture a frame
  const Embedding embedding(*track.body, track.surface.vertices);
  for (const TrackedFrame& f : track.frames) {
    GalleryFrame drawn{f.frame, f.time, embedding.positions(f.nodes), {}, {}};
    const auto seen = std::ranges::find(observed, f.frame, &ObservedFrame::frame);
    if (seen != observed.end()) {
      drawn.points = seen->points;
      for (const float r : f.residuals) drawn.residuals.push_back(double(r));  // NaN is drawn grey: an outlier
    }
    gallery.frames.push_back(std::move(drawn));
  }
  return gallery;
}

std::string page(const Capture& capture, const Track& track, const std::vector<ReportPicture>& pictures) {
  Series rms{"explained points to the surface", {}, {}, Mark::LineAndDots, {}, {}, 0};
  Series explained{"explained share of the points", {}, {}, Mark::Line, {}, {}, 1},
      confidence{"confidence", {}, {}, Mark::Line, {}, {}, 0};
  double worst = 1.0;
  for (const TrackedFrame& f : track.frames) {
    if (f.points > 0) rms.x.push_back(f.frame), rms.y.push_back(1e3 * f.surface_rms);
    explained.x.push_back(f.frame), explained.y.push_back(f.explained);
    confidence.x.push_back(f.frame), confidence.y.push_back(f.confidence);
    worst = std::min(worst, f.confidence);
  }
  const std::string name = escape_html(capture.name);
  std::string html = page_head(name) + "<h1>" + name + "</h1><p class=\"sub\">" +
                     fmt::format("Tracked through {} frames; {} nodes, {} surface samples. ", track.frames.size(),
                                 track.body->node_count(), track.surface.vertices.size());
  html += track.lost_at ? fmt::format("<b>Lost in frame {}.</b>", *track.lost_at)
                        : fmt::format("Never lost; least confidence {:.2f}.", worst);
  html += "</p>\n";
  if (!track.note.empty()) html += "<p>" + escape_html(track.note) + "</p>\n";
  PlotOptions errors;
  errors.title = "Agreement over time", errors.x_label = "frame", errors.y_label = "rms [mm]", errors.zero_y = true;
  html += panel(plot_svg({rms}, errors));
  PlotOptions shares;
  shares.title = "How sure each frame is", shares.x_label = "frame", shares.y_label = "share", shares.zero_y = true;
  std::vector<ReportPicture> shown;
  for (const int i : spread_frames(0, int(pictures.size()) - 1, 12)) shown.push_back(pictures[std::size_t(i)]);
  return html + panel(plot_svg({confidence, explained}, shares)) + figures(shown) +
         "<footer>Grey discs are outliers. All frames are in pictures/, figures in track.json, the motion "
         "in trajectory.pvd.</footer>\n</main></body></html>\n";
}

}  // namespace

void write_track(const fs::path& folder, const Capture& capture, const std::vector<ObservedFrame>& observed,
                 const Track& track, const MotionBlocks& blocks, const VectorX& theta, bool with_pictures,
                 const std::function<void(const char*, int, int)>& progress) {
  make_folder(folder / "frames");
  make_folder(folder / "pictures");
  write_file(folder / "track.json", to_json(track, capture));
  write_file(folder / "track.csv", to_csv(track));
  MaterialBlocks material = blocks;  // an estimate may have more control moduli than the body that was followed
  material.youngs_moduli.resize(std::size_t(track.body->modulus.controls), material.youngs_moduli.front());
  const auto elasticity = make_elasticity(track.body, material);
  elasticity->set_parameters(theta);
  const std::vector<State> states = states_of(track);
  std::vector<PvdEntry> entries;
  for (std::size_t i = 0; i < states.size(); ++i) {
    const std::string name = fmt::format("frames/{:06d}.vtu", track.frames[i].frame);
    write_vtu(folder / name, frame_grid(*track.body, states[i], body_fields(*track.body, *elasticity, states[i].x)),
              VtuPrecision::Single);
    entries.push_back({track.frames[i].time - track.frames.front().time, name});
    if (progress) progress("written", int(i) + 1, int(states.size()));
  }
  write_pvd(folder / "trajectory.pvd", entries);
  std::vector<ReportPicture> pictures;
  if (with_pictures) {
    Gallery gallery = gallery_of(capture, observed, track, blocks, theta);
    std::vector<double> residuals;
    for (const double r : all_residuals(gallery))
      if (std::isfinite(r)) residuals.push_back(r);
    if (progress) progress("pictures", 0, 1);
    pictures = draw_gallery(gallery, residual_range(residuals));
    for (std::size_t i = 0; i < pictures.size(); ++i)
      write_file(folder / fmt::format("pictures/{:06d}.png", track.frames[i].frame), pictures[i].png);
  }
  write_file(folder / "track.html", page(capture, track, pictures));
}

}  // namespace pliant
