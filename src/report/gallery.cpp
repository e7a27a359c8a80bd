#include "report/gallery.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

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
  const PinholeCamera view = gallery.camera ? framed(*gallery.camera, box, gallery.width, gallery.height)
                                            : view_of(box, gallery.up, gallery.width, gallery.height);
  PictureOptions options;
  options.samples = gallery.samples;
  options.residual_range = range > 0.0 ? range : residual_range(all_residuals(gallery));
  std::vector<ReportPicture> pictures;
  for (const GalleryFrame& frame : gallery.frames) {
    const PictureScene scene{frame.surface, gallery.triangles, gallery.planes, frame.points, frame.residuals};
    pictures.push_back({encode_png(draw(scene, view, options)), caption(gallery, frame)});
  }
  return pictures;
}

ReportField draw_field(const Gallery& gallery, const Points& surface, const std::vector<double>& values,
                       const std::string& name, const std::string& unit, const std::string& caption) {
  ReportField field{name, unit, 0.0, 1.0, {}};
  const auto [least, most] = std::ranges::minmax(values);
  field.low = least, field.high = most > least ? most : least + std::max(1e-12, 1e-6 * std::abs(least));
  PictureScene scene{surface, gallery.triangles, gallery.planes, {}, {}};
  for (const double v : values) scene.colours.push_back(sequential_colour((v - field.low) / (field.high - field.low)));
  const Box box = box_of(surface);
  const PinholeCamera view = gallery.camera ? framed(*gallery.camera, box, gallery.width, gallery.height)
                                            : view_of(box, gallery.up, gallery.width, gallery.height);
  PictureOptions options;
  options.samples = gallery.samples;
  field.picture = {encode_png(draw(scene, view, options)), caption};
  return field;
}

}  // namespace pliant
