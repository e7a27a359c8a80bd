#include "capture/outline.hpp"

#include <cmath>

#include "capture/observe.hpp"
#include "capture/small_capture.hpp"
#include "capture/survey.hpp"
#include "input_errors.hpp"
#include "support/tolerance.hpp"

namespace pliant::outline_test {
namespace {

using test::complaint_of;
using test::SmallCapture;
using test::tolerance;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

PinholeCamera camera_of(const Image<std::uint8_t>& mask) {
  return {mask.width, mask.height, 80.0, 80.0, 0.5 * (mask.width - 1), 0.5 * (mask.height - 1), {}};
}

Image<std::uint8_t> drawn(int width, int height, const std::function<bool(int, int)>& shows) {
  Image<std::uint8_t> mask(width, height);
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u) mask(u, v) = shows(u, v) ? 255 : 0;
  return mask;
}

TEST(OutlineOf, ARingHasTwoCurvesWithNormalsAwayFromIt) {
  const Vector2 centre(40.3, 31.8);
  const double inner = 9.0, outer = 21.0;
  const auto radius = [&](int u, int v) { return (Vector2(u, v) - centre).norm(); };
  const auto mask = drawn(80, 64, [&](int u, int v) { return radius(u, v) > inner && radius(u, v) < outer; });
  const Outline outline = outline_of(mask, camera_of(mask));
  EXPECT_FALSE(outline.is_cut);
  ASSERT_EQ(outline.points.size(), outline.normals.size());
  double squares = 0.0;
  int on_inner = 0;
  for (std::size_t i = 0; i < outline.points.size(); ++i) {
    const Vector2 from = outline.points[i] - centre;
    const bool is_inner = from.norm() < 0.5 * (inner + outer);
    const double off = from.norm() - (is_inner ? inner : outer);
    EXPECT_LT(std::abs(off), 0.75);
    squares += off * off, on_inner += is_inner;
    EXPECT_GT((is_inner ? -1.0 : 1.0) * outline.normals[i].dot(from.normalized()), 0.9);
    // Along a curve neighbours touch.
    const bool is_next = i > 0 && is_inner == ((outline.points[i - 1] - centre).norm() < 0.5 * (inner + outer));
    if (is_next) {
      EXPECT_LT((outline.points[i] - outline.points[i - 1]).norm(), 1.01);
    }
  }
  EXPECT_LT(std::sqrt(squares / double(outline.points.size())), 0.35);  // of a pixel: it is one wide
  EXPECT_GT(on_inner, 50);
  EXPECT_GT(int(outline.points.size()) - on_inner, 120);
}

TEST(OutlineOf, WhatLiesAlongThePicturesBorderIsNoOutline) {
  const auto mask = drawn(60, 40, [](int u, int v) { return u < 20 && v > 10 && v < 30; });
  const Outline outline = outline_of(mask, camera_of(mask));
  EXPECT_TRUE(outline.is_cut);
  ASSERT_FALSE(outline.points.empty());
  for (std::size_t i = 0; i < outline.points.size(); ++i) {
    EXPECT_GT(outline.points[i].x(), 3.0);
    EXPECT_GE(outline.normals[i].norm(), 0.999);
  }
}

TEST(OutlineOf, SpecksAndEmptyMasksHaveNone) {
  const auto specks = drawn(40, 40, [](int u, int v) { return u % 8 == 3 && v % 8 == 3; });
  EXPECT_TRUE(outline_of(specks, camera_of(specks)).points.empty());
  const auto nothing = drawn(40, 40, [](int, int) { return false; });
  EXPECT_TRUE(outline_of(nothing, camera_of(nothing)).points.empty());
}

TEST(OutlineOf, PixelsWithoutAReadingWithinTheObjectAreNoHoles) {
  const auto radius = [](int u, int v) { return (Vector2(u, v) - Vector2(40.0, 31.0)).norm(); };
  const auto disc = drawn(80, 64, [&](int u, int v) { return radius(u, v) < 24.0; });
  const auto torn = drawn(80, 64, [&](int u, int v) { return radius(u, v) < 24.0 && (u < 36 || u >= 42 || v != 30); });
  const auto pierced = drawn(80, 64, [&](int u, int v) { return radius(u, v) < 24.0 && radius(u, v) > 4.0; });
  const std::size_t whole = outline_of(disc, camera_of(disc)).points.size();
  EXPECT_EQ(outline_of(torn, camera_of(torn)).points.size(), whole);
  EXPECT_GT(outline_of(pierced, camera_of(pierced)).points.size(), whole + 20);
}

TEST(OutlineOf, GapsOfTwoPixelsAreClosedAndWiderOnesAreSeen) {
  const auto cut = [](int gap) {
    const auto mask = drawn(80, 60, [&](int u, int v) {
      return u > 10 && u < 70 && v > 10 && v < 50 && (u < 40 || u >= 40 + gap || v > 40);
    });
    return outline_of(mask, camera_of(mask)).points.size();
  };
  EXPECT_EQ(cut(1), cut(0));
  EXPECT_EQ(cut(2), cut(0));
  EXPECT_GT(cut(3), cut(0) + 40);
}

TEST(OutlineOf, ALensIsTakenOutOfThePoints) {
  const auto mask = drawn(80, 60, [](int u, int v) { return u > 10 && u < 70 && v > 10 && v < 50; });
  PinholeCamera camera = camera_of(mask);
  const Outline straight = outline_of(mask, camera);
  camera.lens = LensDistortion({0.2, 0.0, 0.0, 0.0});
  const Outline bent = outline_of(mask, camera);
  ASSERT_EQ(bent.points.size(), straight.points.size());
  for (std::size_t i = 0; i < bent.points.size(); ++i) {
    const Vector3 ray = camera.ray(straight.points[i].x(), straight.points[i].y());
    EXPECT_NEAR(bent.points[i].x(), 80.0 * ray.x() + camera.cx, tolerance(1e-9));
    EXPECT_NEAR(bent.points[i].y(), 80.0 * ray.y() + camera.cy, tolerance(1e-9));
  }
  EXPECT_GT((bent.points[0] - straight.points[0]).norm(), 1.0);
}

/// The small capture seen by the same camera, of which its masks alone are left.
struct Silhouettes : SmallCapture {
  Silhouettes() {
    const auto replace = [this](std::string_view from, std::string_view to) { edit(from, to); };
    replace("[[depth]]", "[[silhouette]]");
    replace("images = \"front/%06d.png\"\ndepth_scale = 1000.0\n", "");
    replace("noise = 0.002\n", "outline_std = 0.5\n");
  }
  void write_mask(int frame, const Image<std::uint8_t>& mask) const {
    write_png(folder / ("front/mask_00000" + std::to_string(frame) + ".png"), mask);
  }
  std::string complaint() const {
    return complaint_of([this] { (void)read(); });
  }
};

TEST(Silhouettes, AreReadObservedAndSurveyed) {
  Silhouettes small;
  small.edit("outline_std = 0.5",
             "outline_std = 0.5\noutline_error_std = 0.25\ntime_offset = 0.01\npose_std = { turn = 0.02, shift = 0 }");
  const Capture capture = small.read();
  ASSERT_EQ(capture.silhouettes.size(), 1u);
  EXPECT_TRUE(capture.depth.empty());
  const SilhouetteCamera& camera = capture.silhouettes[0];
  EXPECT_EQ(camera.name, "front");
  EXPECT_EQ(camera.camera.fx, 80.0);
  EXPECT_EQ(camera.outline_std, 0.5);
  EXPECT_EQ(camera.outline_error_std, 0.25);
  EXPECT_EQ(camera.time_offset, 0.01);
  EXPECT_EQ(camera.pose_std, (PoseStd{0.02, 0.0}));
  EXPECT_TRUE(has_time_offsets(capture));
  EXPECT_TRUE(has_silhouettes_alone(capture));
  EXPECT_NEAR(pixel_size(capture, camera, 0), 1.0 / 80.0, tolerance(1e-12));  // a metre away
  const std::vector<ObservedFrame> frames = observe(capture);
  ASSERT_EQ(frames.size(), 4u);
  for (const ObservedFrame& frame : frames) {
    EXPECT_TRUE(frame.points.empty());
    ASSERT_EQ(frame.outlines.size(), 1u);
    EXPECT_EQ(frame.outlines[0].outline.points.size(), 4u * 18u);  // 18 pixels show 0.2 m, a little nearer
  }
  ObserveOptions few;
  few.max_points_per_frame = 20;
  EXPECT_EQ(observe(capture, few)[0].outlines[0].outline.points.size(), 20u);
  const Survey seen = survey(capture, frames);
  ASSERT_EQ(seen.outlines.size(), 1u);
  EXPECT_EQ(seen.outlines[0].points.median, 72);
  EXPECT_NEAR(seen.outlines[0].travel, 0.18 / 0.9, 0.02);  // told as if it were its middle that is seen, not its face
  EXPECT_TRUE(seen.moves);
  const Identifiability told = identifiability(capture, seen);
  EXPECT_THAT(told.possible, ::testing::Contains(HasSubstr("Silhouettes are all that is seen")));
}

TEST(Silhouettes, ComeBackAsTheyWereWritten) {
  Silhouettes small;
  small.edit("outline_std = 0.5", "outline_std = 0.4\noutline_error_std = 0.3");
  const Capture capture = small.read();
  write_capture(small.folder.path(), capture);
  EXPECT_EQ(read_capture(small.folder.path()).silhouettes, capture.silhouettes);
  const Capture there = as_seen_from(capture, small.folder / "elsewhere");
  EXPECT_EQ(there.silhouettes[0].masks.pattern, "../front/mask_%06d.png");
}

TEST(Silhouettes, ThatCannotBeUsedAreRefused) {
  EXPECT_EQ(Silhouettes().complaint(), "");
  const auto slip = [](const char* from, const char* to) {
    Silhouettes small;
    small.edit(from, to);
    return small.complaint();
  };
  EXPECT_THAT(slip("masks = \"front/mask_%06d.png\"\n", ""), HasSubstr("has no `masks`"));
  EXPECT_THAT(slip("front/mask_%06d", "front/none_%06d"), HasSubstr("nor for any other frame"));
  EXPECT_THAT(slip("front/mask_%06d", "front/%06d"), HasSubstr("16 bits a channel"));
  EXPECT_THAT(slip("width = 80", "width = 90"), HasSubstr("has 80 x 60 pixels"));
  EXPECT_THAT(slip("fx = 80.0", "fx = 3.6"), HasSubstr("focal lengths are in pixels"));
  EXPECT_THAT(slip("outline_std = 0.5", "outline_std = 0"),
              HasSubstr("pixels by which points of the masks' outlines err"));
  EXPECT_THAT(slip("outline_std = 0.5", "noise = 0.002"), HasSubstr("noise"));
  EXPECT_THAT(slip("gravity = [0.0, 9.81, 0.0]", "up = [0, -1, 0]"), HasSubstr("silhouettes alone"));
  EXPECT_THAT(slip("mass = 0.8", "mass = 0.8\npose = \"unknown\""), HasSubstr("nothing shows the surface"));
  EXPECT_THAT(slip("[0, 0, 1, -1]", "[0, 0, 1, 9]"), HasSubstr("looks past the rest surface"));
  EXPECT_THAT(slip("[1, 0, 0, 0]", "[1, 0, 0, 0.5]"), HasSubstr("no pixels of its masks near the rest surface"));
}

TEST(Silhouettes, WithMasksThatAreEmptyOrInvertedAreRefused) {
  Silhouettes small;
  small.write_mask(1, Image<std::uint8_t>(80, 60));  // the start frame
  EXPECT_THAT(small.complaint(), HasSubstr("shows no pixel of the object"));
  Image<std::uint8_t> inverted = SmallCapture::mask_image(0.02);
  for (std::uint8_t& m : inverted.pixels) m = std::uint8_t(255 - m);
  small.write_mask(1, inverted);
  EXPECT_THAT(small.complaint(), HasSubstr("they look inverted"));
}

TEST(Silhouettes, FramesThatAreEmptyOrCutAreTold) {
  Silhouettes small;
  small.write_mask(2, Image<std::uint8_t>(80, 60));
  small.write_mask(3, drawn(80, 60, [](int u, int v) { return u > 30 && u < 50 && v > 40; }));
  const Capture capture = small.read();
  const Survey seen = survey(capture, observe(capture));
  EXPECT_THAT(seen.outlines[0].points.empty_frames, ElementsAre(2));
  EXPECT_THAT(seen.outlines[0].cut_frames, ElementsAre(3));
}

TEST(Silhouettes, StandBesideDepth) {
  SmallCapture small;
  small.append(
      "\n[[silhouette]]\nname = \"front\"\nwidth = 80\nheight = 60\nfx = 80.0\nfy = 80.0\ncx = 39.5\ncy = 29.5\n"
      "camera_to_world = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, -1], [0, 0, 0, 1]]\n"
      "masks = \"front/mask_%06d.png\"\n");
  EXPECT_THAT(complaint_of([&] { (void)small.read(); }), HasSubstr("a second camera \"front\""));
  small.edit("[[silhouette]]\nname = \"front\"", "[[silhouette]]\nname = \"film\"");
  const Capture capture = small.read();
  EXPECT_FALSE(has_silhouettes_alone(capture));
  const std::vector<ObservedFrame> frames = observe(capture);
  EXPECT_FALSE(frames[0].points.empty());
  EXPECT_EQ(frames[0].outlines.size(), 1u);
}

}  // namespace
}  // namespace pliant::outline_test
