#include "report/gallery.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/parallel.hpp"
#include "report/plot.hpp"

namespace pliant {

namespace {

Box box_of(const Points& surface) {
  Box box;
  for (Eigen::Index i = 0; i < surface.rows(); ++i) box.extend(surface.row(i));
  return box;
}

Box motion_box(const Gallery& gallery) {
  Box box;
  for (const GalleryFrame& frame : gallery.frames)
    for (Eigen::Index i = 0; i < frame.surface.rows(); ++i) box.extend(frame.surface.row(i));
  return box;
}

PinholeCamera view_of(const Gallery& gallery, const Box& box) {
  return gallery.camera ? framed(*gallery.camera, box, gallery.width, gallery.height)
                        : pliant::view_of(box, gallery.up, gallery.width, gallery.height);
}

std::string caption(const Gallery& gallery, const GalleryFrame& frame) {
  std::string text = fmt::format("Frame {}, {} s", frame.frame, readable(frame.time, 3));
  double squares = 0.0;
  std::size_t near = 0;
  for (const double r : frame.residuals)
    if (std::isfinite(r)) squares += r * r, ++near;
  if (near > 0)
    text += fmt::format(": {} points, {} mm rms", readable(double(near), 6),
                        readable(1e3 * std::sqrt(squares / double(near)), 2));
  if (near < frame.residuals.size()) text += fmt::format(", {} outliers", frame.residuals.size() - near);
  if (!gallery.planes.empty())
    text += fmt::format("; grid {} mm", readable(1e3 * grid_spacing(box_of(frame.surface)), 3));
  return text;
}

}  // namespace

std::vector<int> spread_frames(int first, int last, int count) {
  std::vector<int> frames;
  const int available = last - first + 1, drawn = std::min(count, available);
  for (int i = 0; i < drawn; ++i)
    frames.push_back(drawn == 1 ? first : first + int(std::lround(double(i) * (available - 1) / (drawn - 1))));
  return frames;
}

std::vector<double> all_residuals(const Gallery& gallery) {
  std::vector<double> all;
  for (const GalleryFrame& frame : gallery.frames)
    all.insert(all.end(), frame.residuals.begin(), frame.residuals.end());
  return all;
}

std::vector<ReportPicture> draw_gallery(const Gallery& gallery, double range) {
  if (gallery.frames.empty()) return {};
  const Box box = motion_box(gallery);
  const PinholeCamera view = view_of(gallery, box);
  PictureOptions options;
  options.samples = gallery.samples;
  options.residual_range = range > 0.0 ? range : residual_range(all_residuals(gallery));
  std::vector<ReportPicture> pictures(gallery.frames.size());
  parallel_tasks(pictures.size(), [&](std::size_t i) {
    const GalleryFrame& frame = gallery.frames[i];
    const PictureScene scene{frame.surface, gallery.triangles, gallery.planes, frame.points, frame.residuals};
    pictures[i] = {encode_png(draw(scene, view, options)), caption(gallery, frame)};
  });
  return pictures;
}

ReportField draw_field(const Gallery& gallery, const std::vector<FieldState>& states, const std::string& name,
                       const std::string& unit, ScaleEnds ends) {
  ReportField field{name, unit};
  std::vector<double> all;
  Box box;
  for (const FieldState& state : states) {
    all.insert(all.end(), state.values.begin(), state.values.end());
    for (Eigen::Index i = 0; i < state.surface.rows(); ++i) box.extend(state.surface.row(i));
  }
  if (states.empty()) return field;
  field.scale = colour_scale(all, ends);
  const PinholeCamera view = view_of(gallery, box);
  PictureOptions options;
  options.samples = gallery.samples, options.light_rays = 1,
  options.even_light = 0.75;  // colours speak; light shows the shape alone
  field.pictures.resize(states.size());
  parallel_tasks(states.size(), [&](std::size_t i) {
    const FieldState& state = states[i];
    PictureScene scene{state.surface, gallery.triangles, gallery.planes, {}, {}};
    for (const double v : state.values) scene.colours.push_back(field.scale.colour(v));
    scene.about = box;
    field.pictures[i] = {encode_png(draw(scene, view, options)), state.caption};
  });
  return field;
}

}  // namespace pliant
