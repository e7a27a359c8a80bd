#include "imports/background_subtraction.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "base/disjoint_sets.hpp"
#include "base/median.hpp"
#include "base/types.hpp"

namespace pliant {

namespace {

constexpr double border_width = 0.03;    // of the picture's shorter side
constexpr double plain_reach = 8.0;      // [levels] from a plain background that its pixels lie
constexpr double plain_share = 0.8;      // of a border that is plain: hands and clamps may come in
constexpr double largest_hole = 0.01;    // of the object's pixels, that is filled
constexpr double least_contrast = 16.0;  // [levels]
constexpr double clear_of_noise = 4.0;   // standard deviations of the background's differences
constexpr int least_pixels = 100;        // of an object
constexpr double most_covered = 0.6;     // of a picture, and
constexpr double most_along = 0.5;       // of its border, by an object

using Levels = std::array<int, 3>;

bool is_at_border(int u, int v, int width, int height, int reach) {
  return u < reach || v < reach || u >= width - reach || v >= height - reach;
}

int border_of(const Image<Rgb>& picture) {
  return std::max(1, int(border_width * std::min(picture.width, picture.height)));
}

double root_mean_square(double r, double g, double b) { return std::sqrt((r * r + g * g + b * b) / 3.0); }

// Mean over 3 x 3 pixels, at the border over those that there are twice.
Image<Rgb> smoothed(const Image<Rgb>& picture) {
  const auto along = [](const Image<Rgb>& from, int du, int dv) {
    Image<Rgb> to(from.width, from.height);
    for (int v = 0; v < from.height; ++v)
      for (int u = 0; u < from.width; ++u) {
        const Rgb& before = from(std::max(0, u - du), std::max(0, v - dv));
        const Rgb& after = from(std::min(from.width - 1, u + du), std::min(from.height - 1, v + dv));
        for (std::size_t c = 0; c < 3; ++c) to(u, v)[c] = std::uint8_t((before[c] + from(u, v)[c] + after[c] + 1) / 3);
      }
    return to;
  };
  return along(along(picture, 1, 0), 0, 1);
}

Image<Rgb> median_picture(const std::vector<Image<Rgb>>& pictures) {
  Image<Rgb> result = pictures.front();
  std::vector<std::uint8_t> values(pictures.size());
  for (std::size_t p = 0; p < result.pixels.size(); ++p)
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t k = 0; k < pictures.size(); ++k) values[k] = pictures[k].pixels[p][c];
      result.pixels[p][c] = median(values);
    }
  return result;
}

// A colour that changes slowly over a picture: of each channel a polynomial of second degree.
class PlainColour {
 public:
  // Fitted to a picture's border without what lies off it there, then to all that is near.
  explicit PlainColour(const Image<Rgb>& picture) : width_(picture.width), height_(picture.height) {
    const int step = std::max(1, std::max(width_, height_) / 128), border = border_of(picture);
    std::vector<Place> edge, all;
    for (int v = 0; v < height_; v += step)
      for (int u = 0; u < width_; u += step) all.push_back({u, v, picture(u, v)});
    for (int v = 0; v < height_; ++v)
      for (int u = 0; u < width_; ++u)
        if ((u + v) % step == 0 && is_at_border(u, v, width_, height_, border)) edge.push_back({u, v, picture(u, v)});
    fit(edge);
    for (int i = 0; i < 8; ++i) fit(near(edge, std::max(plain_reach, 2.0 * median(distances(edge)))));
    share_ = double(near(edge, plain_reach).size()) / double(edge.size());
    for (int i = 0; i < 2; ++i) fit(near(all, plain_reach));
  }

  Vector3 at(int u, int v) const { return (terms(u, v).transpose() * coefficients_).transpose(); }
  double distance(int u, int v, const Rgb& colour) const {
    const Vector3 own = at(u, v);
    return root_mean_square(colour[0] - own[0], colour[1] - own[1], colour[2] - own[2]);
  }
  double share_of_border() const { return share_; }

 private:
  struct Place {
    int u, v;
    Rgb colour;
  };
  using Terms = Eigen::Matrix<double, 6, 1>;

  Terms terms(int u, int v) const {
    const double x = 2.0 * u / width_ - 1.0, y = 2.0 * v / height_ - 1.0;
    return Terms(1.0, x, y, x * x, x * y, y * y);
  }
  std::vector<double> distances(const std::vector<Place>& places) const {
    std::vector<double> result;
    for (const Place& place : places) result.push_back(distance(place.u, place.v, place.colour));
    return result;
  }
  std::vector<Place> near(const std::vector<Place>& places, double reach) const {
    std::vector<Place> result;
    for (const Place& place : places)
      if (distance(place.u, place.v, place.colour) <= reach) result.push_back(place);
    return result;
  }
  void fit(const std::vector<Place>& places) {
    Eigen::Matrix<double, 6, 6> A = Eigen::Matrix<double, 6, 6>::Zero();
    Eigen::Matrix<double, 6, 3> b = Eigen::Matrix<double, 6, 3>::Zero();
    for (const Place& place : places) {
      const Terms t = terms(place.u, place.v);
      A += t * t.transpose();
      b += t * Eigen::RowVector3d(place.colour[0], place.colour[1], place.colour[2]);
    }
    A.diagonal().array() += 1e-9 * std::max(1.0, A.trace());  // few places, or all on a line
    coefficients_ = A.ldlt().solve(b);
  }

  int width_, height_;
  Eigen::Matrix<double, 6, 3> coefficients_ = Eigen::Matrix<double, 6, 3>::Zero();
  double share_ = 0.0;
};

// The picture with the plain colour wherever something else is in the way.
Image<Rgb> uncovered(Image<Rgb> picture, const PlainColour& plain) {
  for (int v = 0; v < picture.height; ++v)
    for (int u = 0; u < picture.width; ++u) {
      if (plain.distance(u, v, picture(u, v)) <= plain_reach) continue;
      const Vector3 colour = plain.at(u, v);
      for (std::size_t c = 0; c < 3; ++c)
        picture(u, v)[c] = std::uint8_t(std::lround(std::clamp(colour[Eigen::Index(c)], 0.0, 255.0)));
    }
  return picture;
}

// How much lighter than the background a picture is along its border.
Levels change_of_light(const Image<Rgb>& picture, const Image<Rgb>& background) {
  const int border = border_of(picture);
  std::array<std::vector<int>, 3> changes;
  for (int v = 0; v < picture.height; ++v)
    for (int u = 0; u < picture.width; ++u) {
      if ((u + v) % 4 != 0 || !is_at_border(u, v, picture.width, picture.height, border)) continue;
      for (std::size_t c = 0; c < 3; ++c) changes[c].push_back(int(picture(u, v)[c]) - background(u, v)[c]);
    }
  return {median(changes[0]), median(changes[1]), median(changes[2])};
}

using Histogram = std::array<double, 256>;

// Mean and standard deviation of a histogram's levels from `begin` up to `end`.
struct LevelsPart {
  double count = 0.0, mean = 0.0, deviation = 0.0;
};
LevelsPart part_of(const Histogram& histogram, int begin, int end) {
  LevelsPart part;
  double sum = 0.0, squares = 0.0;
  for (int level = begin; level < end; ++level) {
    const double n = histogram[std::size_t(level)];
    part.count += n, sum += n * level, squares += n * level * level;
  }
  if (part.count == 0.0) return part;
  part.mean = sum / part.count;
  part.deviation = std::sqrt(std::max(0.0, squares / part.count - part.mean * part.mean));
  return part;
}

// The first level above Otsu's threshold: of those that do equally well the middle one.
int otsu_level(const Histogram& histogram) {
  double best = 0.0, sum = 0.0;
  int count = 0;
  for (int level = 1; level < 256; ++level) {
    const LevelsPart below = part_of(histogram, 0, level), above = part_of(histogram, level, 256);
    const double between = below.count * above.count * std::pow(above.mean - below.mean, 2);
    if (between > best * (1.0 + 1e-9)) best = between, sum = 0.0, count = 0;
    if (best > 0.0 && between >= best * (1.0 - 1e-9)) sum += level, ++count;
  }
  return count > 0 ? int(std::lround(sum / count)) : 255;
}

// Connected regions of pixels of one value; those that show the object are also connected by corners.
DisjointSets regions_of(const Image<std::uint8_t>& mask) {
  DisjointSets regions(mask.pixels.size());
  const int width = mask.width;
  for (int v = 0, p = 0; v < mask.height; ++v)
    for (int u = 0; u < width; ++u, ++p) {
      const std::uint8_t value = mask(u, v);
      if (u > 0 && mask(u - 1, v) == value) regions.join(p - 1, p);
      if (v > 0 && mask(u, v - 1) == value) regions.join(p - width, p);
      if (v > 0 && u > 0 && value != 0 && mask(u - 1, v - 1) == value) regions.join(p - width - 1, p);
      if (v > 0 && u + 1 < width && value != 0 && mask(u + 1, v - 1) == value) regions.join(p - width + 1, p);
    }
  return regions;
}

// Pixels of one value in each region, at the region's root.
std::vector<int> sizes_of(DisjointSets& regions, const Image<std::uint8_t>& mask, bool of_object) {
  std::vector<int> sizes(mask.pixels.size(), 0);
  for (int p = 0; p < int(sizes.size()); ++p)
    if ((mask.pixels[std::size_t(p)] != 0) == of_object) ++sizes[std::size_t(regions.root(p))];
  return sizes;
}

// Takes away all but the largest region of the object; its size in pixels.
int keep_largest(Image<std::uint8_t>& mask) {
  DisjointSets regions = regions_of(mask);
  const std::vector<int> sizes = sizes_of(regions, mask, true);
  const auto largest = std::ranges::max_element(sizes);
  for (int p = 0; p < int(sizes.size()); ++p)
    if (regions.root(p) != int(largest - sizes.begin())) mask.pixels[std::size_t(p)] = 0;
  return *largest;
}

void fill_holes_below(Image<std::uint8_t>& mask, double pixels) {
  DisjointSets regions = regions_of(mask);
  std::vector<int> sizes = sizes_of(regions, mask, false);
  for (int v = 0, p = 0; v < mask.height; ++v)
    for (int u = 0; u < mask.width; ++u, ++p)
      if (is_at_border(u, v, mask.width, mask.height, 1)) sizes[std::size_t(regions.root(p))] = 0;  // no hole
  for (int p = 0; p < int(sizes.size()); ++p)
    if (const int size = sizes[std::size_t(regions.root(p))]; size > 0 && size < pixels)
      mask.pixels[std::size_t(p)] = 255;
}

}  // namespace

BackgroundSubtraction::BackgroundSubtraction(std::vector<Image<Rgb>> samples, const BackgroundChoice& choice) {
  for (Image<Rgb>& sample : samples) sample = smoothed(sample);
  if (choice.kind == BackgroundKind::Given) {
    background_ = smoothed(choice.empty);
  } else {
    background_ = median_picture(samples);
    const PlainColour plain(background_);
    kind_ =
        choice.kind.value_or(plain.share_of_border() >= plain_share ? BackgroundKind::Plain : BackgroundKind::Still);
    if (kind_ == BackgroundKind::Plain) background_ = uncovered(std::move(background_), plain);
  }
  Histogram histogram{};
  for (const Image<Rgb>& sample : samples)
    for (const std::uint8_t level : difference(sample).pixels) ++histogram[level];
  const int level = choice.threshold ? std::clamp(int(std::ceil(*choice.threshold)), 1, 255) : otsu_level(histogram);
  const LevelsPart below = part_of(histogram, 0, level), above = part_of(histogram, level, 256);
  threshold_ = choice.threshold.value_or(level - 0.5);
  contrast_ = above.count > 0.0 ? above.mean - below.mean : 0.0;
  spread_ = below.deviation;
}

bool BackgroundSubtraction::tells_object() const {
  return contrast_ >= std::max(least_contrast, clear_of_noise * spread_);
}

Image<std::uint8_t> BackgroundSubtraction::difference(const Image<Rgb>& smooth) const {
  const Levels light = change_of_light(smooth, background_);
  Image<std::uint8_t> result(smooth.width, smooth.height);
  for (std::size_t p = 0; p < result.pixels.size(); ++p) {
    const Rgb &a = smooth.pixels[p], &b = background_.pixels[p];
    result.pixels[p] = std::uint8_t(std::min(
        255L, std::lround(root_mean_square(a[0] - b[0] - light[0], a[1] - b[1] - light[1], a[2] - b[2] - light[2]))));
  }
  return result;
}

Image<std::uint8_t> BackgroundSubtraction::mask(const Image<Rgb>& picture) const {
  Image<std::uint8_t> mask = difference(smoothed(picture));
  for (std::uint8_t& level : mask.pixels) level = level > threshold_ ? 255 : 0;
  const int size = keep_largest(mask);
  fill_holes_below(mask, largest_hole * size);
  return mask;
}

std::string doubt_about(const Image<std::uint8_t>& mask) {
  int border = 0, along = 0;
  for (int v = 0; v < mask.height; ++v)
    for (int u = 0; u < mask.width; ++u)
      if (is_at_border(u, v, mask.width, mask.height, 1)) ++border, along += mask(u, v) != 0;
  const auto pixels = std::ranges::count_if(mask.pixels, [](std::uint8_t m) { return m != 0; });
  const auto per_cent = [](double part, double whole) {
    return std::to_string(std::lround(100.0 * part / whole)) + " %";
  };
  if (pixels < least_pixels) return "only " + std::to_string(pixels) + " pixels differ from the background";
  if (double(pixels) > most_covered * double(mask.pixels.size()))
    return per_cent(double(pixels), double(mask.pixels.size())) + " of the picture differ from the background";
  if (along > most_along * border)
    return "what differs from the background lies along " + per_cent(along, border) + " of the picture's border";
  return "";
}

}  // namespace pliant
