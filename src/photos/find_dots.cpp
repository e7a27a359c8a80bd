#include "photos/find_dots.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "base/files.hpp"
#include "base/median.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

constexpr int skirt = 4;              // [pixels] about a dot into which its blurred edge reaches
constexpr int ring = 3;               // [pixels] beyond, where its surroundings are measured
constexpr int deep = 3;               // [pixels] inside the edge from which on a pixel counts as covered
constexpr double least_step = 6.0;    // grey levels above the mean about it from which a pixel may be a dot's
constexpr double dark_limit = 20.0;   // grey levels below which light cannot be divided out
constexpr double least_sigma = 0.01;  // [pixels] no centre is known better
constexpr int darkest_colour = 48;    // grey level below which a colour counts as shade
constexpr std::array names = {"dark", "light", "red", "green", "blue", "yellow", "magenta", "cyan"};

std::uint8_t positive(int value) { return std::uint8_t(std::max(value, 0)); }

// How much a colour sticks out, over the brightest channel: the same in light and in shade.
std::uint8_t saturation(int by, const Rgb& p) {
  const int brightest = std::max({int(p[0]), int(p[1]), int(p[2]), darkest_colour});
  return std::uint8_t(255 * std::max(by, 0) / brightest);
}

std::uint8_t dotness(const Rgb& p, DotColour colour) {
  const int r = p[0], g = p[1], b = p[2];
  switch (colour) {
    case DotColour::Dark:
      return positive(255 - std::max({r, g, b}));
    case DotColour::Light:
      return positive(std::min({r, g, b}));
    case DotColour::Red:
      return saturation(r - std::max(g, b), p);
    case DotColour::Green:
      return saturation(g - std::max(r, b), p);
    case DotColour::Blue:
      return saturation(b - std::max(r, g), p);
    case DotColour::Yellow:
      return saturation(std::min(r, g) - b, p);
    case DotColour::Magenta:
      return saturation(std::min(r, b) - g, p);
    case DotColour::Cyan:
      return saturation(std::min(g, b) - r, p);
  }
  return 0;
}

cv::Mat1b dotness_of(const Image<Rgb>& photograph, DotColour colour) {
  cv::Mat1b image(photograph.height, photograph.width);
  for (int v = 0; v < image.rows; ++v)
    for (int u = 0; u < image.cols; ++u) image(v, u) = dotness(photograph(u, v), colour);
  return image;
}

struct Blobs {
  cv::Mat1i labels;
  cv::Mat1i stats;
};

// Connected pixels that stand out from the mean about them.
Blobs stand_out(const cv::Mat1b& image, const FindDotsOptions& options) {
  cv::Mat1b smooth, mean, above;
  cv::GaussianBlur(image, smooth, {5, 5}, 1.0);
  const int window = 2 * int(1.5 * options.greatest_diameter) + 1;
  cv::boxFilter(smooth, mean, -1, {window, window});
  const double step = std::max(least_step, 0.25 * 255.0 * options.least_contrast);
  cv::add(mean, cv::Scalar(step), mean);
  cv::compare(smooth, mean, above, cv::CMP_GT);
  Blobs blobs;
  cv::Mat centres;
  cv::connectedComponentsWithStats(above, blobs.labels, blobs.stats, centres, 8, CV_32S);
  return blobs;
}

// One component of pixels in a window of the photograph, and what else is there.
struct Window {
  cv::Rect frame;  // in the photograph
  cv::Mat1b own;   // not zero where the dot is
  cv::Mat1b free;  // not zero where neither this dot nor another is, nor the blurred edge of one
  cv::Mat1b edge;  // not zero over the dot and its blurred edge
};

// The level of the surroundings as a plane a + b x + c y about the window's corner, and the scatter about it.
struct Surroundings {
  Vector3 plane;
  double noise = 0.0;  // grey levels
  double operator()(double x, double y) const { return plane.dot(Vector3(1.0, x, y)); }
};

std::optional<Surroundings> measure_surroundings(const cv::Mat1b& image, const cv::Mat1b& free) {
  constexpr int rounds = 3, fewest = 12;
  Surroundings about{Vector3::Zero(), 1e9};
  for (int round = 0; round < rounds; ++round) {
    Matrix3 matrix = Matrix3::Zero();
    Vector3 side = Vector3::Zero();
    double squares = 0.0;
    int count = 0;
    const auto each = [&](const auto& take) {
      for (int y = 0; y < image.rows; ++y)
        for (int x = 0; x < image.cols; ++x)
          if (free(y, x) && (round == 0 || std::abs(image(y, x) - about(x, y)) <= 2.5 * about.noise + 0.5))
            take(Vector3(1.0, x, y), double(image(y, x)));
    };
    each([&](const Vector3& row, double level) {
      matrix += row * row.transpose();
      side += row * level;
      ++count;
    });
    if (count < fewest) return std::nullopt;
    Surroundings next{matrix.ldlt().solve(side), 0.0};
    each([&](const Vector3& row, double level) { squares += std::pow(level - next.plane.dot(row), 2); });
    next.noise = std::sqrt(squares / std::max(count - 3, 1));
    about = next;
  }
  return about;
}

// How much of each pixel the dot covers, 0 to 1 but for noise.
cv::Mat1d coverage(const cv::Mat1b& image, const Window& window, const Surroundings& about, double level,
                   bool is_dark) {
  cv::Mat1b core;
  cv::erode(window.own, core, cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * deep + 1, 2 * deep + 1}), {-1, -1}, 1,
            cv::BORDER_CONSTANT, cv::Scalar(0));
  const double middle = about(0.5 * image.cols, 0.5 * image.rows);
  const bool divides = is_dark && 255.0 - middle > dark_limit;
  cv::Mat1d share(image.size(), 0.0);
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x) {
      if (!window.edge(y, x)) continue;
      const double surroundings = about(x, y);
      const double light = divides ? (255.0 - surroundings) / (255.0 - middle) : 1.0;
      share(y, x) = core(y, x) ? 1.0 : (image(y, x) - surroundings) / (light * (level - middle));
    }
  return share;
}

// Median level of the pixels farthest inside.
double level_of(const cv::Mat1b& image, const cv::Mat1b& own) {
  cv::Mat1f depth;
  cv::Mat1b padded;
  cv::copyMakeBorder(own, padded, 1, 1, 1, 1, cv::BORDER_CONSTANT, cv::Scalar(0));
  cv::distanceTransform(padded, depth, cv::DIST_L2, 3);
  double deepest = 0.0;
  cv::minMaxLoc(depth, nullptr, &deepest);
  std::vector<int> levels;
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x)
      if (depth(y + 1, x + 1) > std::min(2.0, 0.6 * deepest)) levels.push_back(image(y, x));
  return median(std::move(levels));
}

struct Moments {
  double area = 0.0;
  Vector2 centre = Vector2::Zero();
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
};

Moments moments_of(const cv::Mat1d& share) {
  const cv::Moments m = cv::moments(share);
  Moments out;
  out.area = m.m00;
  if (out.area <= 0) return out;
  out.centre = {m.m10 / m.m00, m.m01 / m.m00};
  out.spread << m.mu20, m.mu11, m.mu11, m.mu02;
  out.spread /= m.m00;
  return out;
}

// Scatter of the outline about an ellipse with these moments [pixels].
double outline_error(const cv::Mat1b& own, const Moments& moments, double radius) {
  std::vector<std::vector<cv::Point>> outlines;
  cv::findContours(own, outlines, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  if (outlines.size() != 1) return 1e9;
  const Eigen::Matrix2d shape = (moments.spread / std::sqrt(moments.spread.determinant())).inverse();
  double sum = 0.0, squares = 0.0;
  for (const cv::Point& p : outlines[0]) {
    const Vector2 arm = Vector2(p.x, p.y) - moments.centre;
    const double far = std::sqrt(arm.dot(shape * arm));
    sum += far;
    squares += far * far;
  }
  const double n = double(outlines[0].size()), mean = sum / n;
  return std::sqrt(std::max(squares / n - mean * mean, 0.0)) * radius / std::max(mean, 1e-9);
}

// Of the centre, by noise of the pixels at the dot's edge and a scatter of the level of its surroundings.
double sigma_of(const cv::Mat1d& share, const Moments& moments, double relative_noise) {
  double arms = 0.0;
  for (int y = 0; y < share.rows; ++y)
    for (int x = 0; x < share.cols; ++x)
      if (share(y, x) != 0.0 && share(y, x) != 1.0) arms += 0.5 * (Vector2(x, y) - moments.centre).squaredNorm();
  return std::max(least_sigma, relative_noise * std::sqrt(arms) / moments.area);
}

class Finder {
 public:
  Finder(const cv::Mat1b& image, const FindDotsOptions& options)
      : image_(image), options_(options), blobs_(stand_out(image, options)) {}

  std::vector<Dot> find() {
    const int least = std::max(4, int(0.5 * options_.least_aspect * std::pow(options_.least_diameter, 2)));
    for (int label = 1; label < blobs_.stats.rows; ++label) {
      const cv::Rect box(blobs_.stats(label, cv::CC_STAT_LEFT), blobs_.stats(label, cv::CC_STAT_TOP),
                         blobs_.stats(label, cv::CC_STAT_WIDTH), blobs_.stats(label, cv::CC_STAT_HEIGHT));
      const bool is_large = std::max(box.width, box.height) > 2.5 * options_.greatest_diameter + 2 * skirt;
      if (is_large || blobs_.stats(label, cv::CC_STAT_AREA) < least) continue;
      cut(label, box);
    }
    return std::move(dots_);
  }

 private:
  // Cuts a blob half-way between its level and that of its surroundings; each part may be a dot.
  void cut(int label, const cv::Rect& box) {
    const int margin = skirt + ring;
    const cv::Rect frame(box.x - margin, box.y - margin, box.width + 2 * margin, box.height + 2 * margin);
    if ((frame & cv::Rect(0, 0, image_.cols, image_.rows)) != frame) return;
    const cv::Mat1b image = image_(frame);
    const cv::Mat1i labels = blobs_.labels(frame);
    const cv::Mat1b blob = labels == label;
    cv::Mat1b others = (labels != 0) & (labels != label), wide;
    const cv::Mat reach = cv::getStructuringElement(cv::MORPH_ELLIPSE, {5, 5});
    cv::dilate(labels != 0, wide, reach);
    const auto about = measure_surroundings(image, wide == 0);
    if (!about) return;
    const double level = level_of(image, blob);
    const double middle = (*about)(0.5 * image.cols, 0.5 * image.rows);
    if (level - middle < 255.0 * options_.least_contrast) return;
    cv::Mat1b own(image.size(), std::uint8_t(0));
    for (int y = 0; y < image.rows; ++y)
      for (int x = 0; x < image.cols; ++x)
        if (blob(y, x) && image(y, x) > 0.5 * (level + (*about)(x, y))) own(y, x) = 255;
    cv::Mat1i parts;
    const int count = cv::connectedComponents(own, parts, 4, CV_32S);
    cv::dilate(others, others, reach);
    for (int part = 1; options_.fills_notches && part < count; ++part) fill_notches(parts, part);
    for (int part = 1; part < count; ++part)
      measure(image, frame, parts == part, (own != 0) & (parts != part), others, *about);
  }

  // A part becomes its convex hull.
  static void fill_notches(cv::Mat1i& parts, int part) {
    std::vector<cv::Point> inside, hull;
    cv::findNonZero(parts == part, inside);
    cv::convexHull(inside, hull);
    cv::Mat1b filled(parts.size(), std::uint8_t(0));
    cv::fillConvexPoly(filled, hull, cv::Scalar(255));
    parts.setTo(part, filled & (parts == 0));
  }

  void measure(const cv::Mat1b& image, const cv::Rect& frame, const cv::Mat1b& own, const cv::Mat1b& siblings,
               const cv::Mat1b& others, const Surroundings& about) {
    Window window{frame, own, {}, {}};
    const int size = 2 * skirt + 1;
    cv::Mat1b taken;
    cv::dilate(own, window.edge, cv::getStructuringElement(cv::MORPH_ELLIPSE, {size, size}));
    cv::dilate(siblings, taken, cv::getStructuringElement(cv::MORPH_ELLIPSE, {size, size}));
    window.edge.setTo(0, others);
    window.edge.setTo(0, taken & ~own);
    const double level = level_of(image, own), contrast = level - about(0.5 * image.cols, 0.5 * image.rows);
    if (contrast < 255.0 * options_.least_contrast) return;
    const cv::Mat1d share = coverage(image, window, about, level, options_.colour == DotColour::Dark);
    const Moments moments = moments_of(share);
    if (moments.area < 3.0) return;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(moments.spread);
    if (!(axes.eigenvalues()[0] > 0)) return;
    const double aspect = std::sqrt(axes.eigenvalues()[0] / axes.eigenvalues()[1]);
    const double radius = std::sqrt(moments.area / std::numbers::pi), diameter = 2.0 * radius / std::sqrt(aspect);
    if (diameter < options_.least_diameter || diameter > options_.greatest_diameter || aspect < options_.least_aspect)
      return;
    if (outline_error(own, moments, radius) > 0.4 + 0.06 * radius) return;
    const Vector2 corner(frame.x, frame.y);
    dots_.push_back({corner + moments.centre, sigma_of(share, moments, about.noise / contrast), diameter, aspect,
                     contrast / 255.0});
  }

  const cv::Mat1b& image_;
  const FindDotsOptions& options_;
  Blobs blobs_;
  std::vector<Dot> dots_;
};

void validate(const Image<Rgb>& photograph, const FindDotsOptions& options) {
  if (photograph.pixels.empty()) throw std::invalid_argument("find_dots: an image without pixels");
  if (!(options.least_diameter > 0 && options.greatest_diameter >= options.least_diameter))
    throw std::invalid_argument("find_dots: diameters must be above 0, the least first");
  if (!(options.least_contrast > 0 && options.least_contrast < 1))
    throw std::invalid_argument("find_dots: least_contrast must lie between 0 and 1");
}

}  // namespace

std::optional<DotColour> dot_colour(std::string_view name) {
  const auto found = std::ranges::find(names, name);
  if (found == names.end()) return std::nullopt;
  return DotColour(found - names.begin());
}

std::vector<Dot> find_dots(const Image<Rgb>& photograph, const FindDotsOptions& options) {
  validate(photograph, options);
  const cv::Mat1b image = dotness_of(photograph, options.colour);
  return Finder(image, options).find();
}

Image<Rgb> read_photograph(const fs::path& path) {
  const std::string content = read_file(path);
  cv::Mat3b bgr;
  try {
    if (!content.empty())
      bgr = cv::imdecode(cv::Mat(1, int(content.size()), CV_8U, const_cast<char*>(content.data())),
                         cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception&) {
    bgr.release();
  }
  if (bgr.empty())
    throw InputError(
        Problem{{path}, "is no image that can be read", "a JPEG, PNG or TIFF file", "convert raw photographs first"});
  Image<Rgb> out(bgr.cols, bgr.rows);
  for (int v = 0; v < bgr.rows; ++v)
    for (int u = 0; u < bgr.cols; ++u) out(u, v) = {bgr(v, u)[2], bgr(v, u)[1], bgr(v, u)[0]};
  return out;
}

}  // namespace pliant
