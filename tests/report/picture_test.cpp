#include "report/picture.hpp"

#include <png.h>

#include <cmath>
#include <random>

#include "geometry/primitives.hpp"
#include "rays/ray_scene.hpp"
#include "temporary_folder.hpp"

namespace pliant::picture_test {
namespace {

Picture decode(const std::string& bytes) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  EXPECT_TRUE(png_image_begin_read_from_memory(&image, bytes.data(), bytes.size()));
  image.format = PNG_FORMAT_RGB;
  Picture picture(int(image.width), int(image.height));
  EXPECT_TRUE(png_image_finish_read(&image, nullptr, picture.pixels.data(), 0, nullptr));
  return picture;
}

double brightness(const Rgb& c) { return (c[0] + c[1] + c[2]) / 3.0; }

// A ring that lies a little above the floor.
PictureScene ring_on_floor() {
  PictureScene scene;
  const TriangleMesh ring = make_torus(0.15, 0.06, 64, 32);
  scene.surface = vertex_points(ring).rowwise() + Vector3(0, 0.06, 0).transpose();
  scene.triangles = ring.triangles;
  scene.planes = {Plane{}};
  return scene;
}

Box box_of(const PictureScene& scene) {
  Box box;
  for (Eigen::Index i = 0; i < scene.surface.rows(); ++i) box.extend(scene.surface.row(i));
  return box;
}

// Points on the seen side of the ring, off by a residual that changes along x.
void add_points(PictureScene& scene, int count) {
  std::mt19937 generator(1);
  std::uniform_real_distribution<double> angle(0.0, 2.0 * M_PI), upper(0.2, M_PI - 0.2);
  for (int i = 0; i < count; ++i) {
    const double s = angle(generator), t = upper(generator), residual = 0.008 * std::cos(s);
    const double tube = 0.06 + residual, from_axis = 0.15 + tube * std::cos(t);
    scene.points.emplace_back(from_axis * std::cos(s), 0.06 + tube * std::sin(t), from_axis * std::sin(s));
    scene.residuals.push_back(residual);
  }
}

PictureOptions quick() {
  PictureOptions options;
  options.samples = 2, options.light_rays = 4;
  return options;
}

TEST(Image, PngComesBackPixelByPixel) {
  Picture picture(3, 2);
  picture.pixels = {{255, 0, 0}, {0, 255, 0}, {0, 0, 255}, {1, 2, 3}, {254, 128, 7}, {0, 0, 0}};
  const Picture read = decode(encode_png(picture));
  EXPECT_EQ(read.width, 3);
  EXPECT_EQ(read.pixels, picture.pixels);
  picture.pixels.pop_back();
  EXPECT_THROW(encode_png(picture), std::invalid_argument);
}

TEST(Image, DivergingColoursAreBlueWhiteRedAndClamped) {
  EXPECT_GT(diverging_colour(-0.7)[2], diverging_colour(-0.7)[0] + 60);
  EXPECT_GT(diverging_colour(0.7)[0], diverging_colour(0.7)[2] + 60);
  EXPECT_EQ(diverging_colour(0.0), (Rgb{247, 247, 247}));
  EXPECT_EQ(diverging_colour(1.0), diverging_colour(50.0));
  EXPECT_EQ(diverging_colour(std::nan("")), (Rgb{128, 128, 128}));
  EXPECT_EQ(css({0, 128, 255}), "#0080ff");
}

TEST(Picture, ShowsTheObjectItsShadowAndTheFloor) {
  const PictureScene scene = ring_on_floor();
  const PinholeCamera camera = view_of(box_of(scene), Vector3::UnitY(), 160, 120, 0.3, 0.9);
  const Picture picture = draw(scene, camera, quick());
  const auto at = [&](const Vector3& world) {
    const Vector3 seen = camera.project(world);
    return brightness(picture(int(std::lround(seen.x())), int(std::lround(seen.y()))));
  };
  const double tube_top = at({0.15, 0.12, 0}), hole = at({0.0, 0.0, 0.0}), open_floor = at({-0.29, 0, 0.11});
  EXPECT_LT(tube_top, open_floor - 10);  // the object is darker than the floor
  EXPECT_LT(hole, open_floor - 5);       // the floor in the ring's hole is shaded
  EXPECT_GT(open_floor, 200);
}

TEST(Picture, DiscsHaveTheColourOfTheirResidual) {
  PictureScene scene = ring_on_floor();
  scene.points = {{0.15, 0.122, 0.0}, {-0.15, 0.118, 0.0}};
  scene.residuals = {0.002, -0.002};
  PictureOptions options = quick();
  options.residual_range = 0.002, options.disc_radius = 3.0;
  const PinholeCamera camera = view_of(box_of(scene), Vector3::UnitY(), 160, 120, 0.3, 0.9);
  const Picture picture = draw(scene, camera, options);
  for (int i = 0; i < 2; ++i) {
    const Vector3 seen = camera.project(scene.points[i]);
    const Rgb found = picture(int(std::lround(seen.x())), int(std::lround(seen.y())));
    const Rgb expected = diverging_colour(i == 0 ? 1.0 : -1.0);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(found[k], expected[k], 2);
  }
}

TEST(Picture, SurfacesHaveTheColoursOfTheirVertices) {
  PictureScene scene = ring_on_floor();
  scene.planes.clear();
  const PinholeCamera camera = view_of(box_of(scene), Vector3::UnitY(), 120, 90);
  scene.colours.assign(std::size_t(scene.surface.rows()), Rgb{200, 40, 40});
  const Picture red = draw(scene, camera);
  scene.colours.assign(std::size_t(scene.surface.rows()), Rgb{40, 40, 200});
  const Picture blue = draw(scene, camera);
  int redder = 0, bluer = 0;
  for (std::size_t i = 0; i < red.pixels.size(); ++i) {
    redder += red.pixels[i][0] > red.pixels[i][2] + 40;
    bluer += blue.pixels[i][2] > blue.pixels[i][0] + 40;
  }
  EXPECT_GT(redder, 800);
  EXPECT_NEAR(redder, bluer, 0.1 * redder);
  scene.colours.pop_back();
  EXPECT_THROW((void)draw(scene, camera), std::invalid_argument);
}

TEST(Picture, ColoursInEvenLightAreThoseOfTheScale) {
  PictureScene scene = ring_on_floor();
  scene.planes.clear();
  const Rgb colour = sequential_colour(0.4);
  scene.colours.assign(std::size_t(scene.surface.rows()), colour);
  PictureOptions options = quick();
  options.even_light = 1.0;
  const Picture picture = draw(scene, view_of(box_of(scene), Vector3::UnitY(), 90, 60), options);
  int like = 0;
  for (const Rgb& pixel : picture.pixels) {
    int off = 0;
    for (std::size_t k = 0; k < 3; ++k) off = std::max(off, std::abs(int(pixel[k]) - int(colour[k])));
    like += off <= 1;
  }
  EXPECT_GT(like, 0.2 * double(picture.pixels.size()));
  options.even_light = 1.5;
  EXPECT_THROW((void)draw(scene, view_of(box_of(scene), Vector3::UnitY(), 90, 60), options), std::invalid_argument);
}

TEST(Image, SequentialColoursGrowLighterAndAreClamped) {
  double before = 0.0;
  for (int k = 0; k <= 10; ++k) {
    const Rgb c = sequential_colour(0.1 * k);
    const double lightness = 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
    EXPECT_GT(lightness, before);
    before = lightness;
  }
  EXPECT_EQ(sequential_colour(-3.0), sequential_colour(0.0));
  EXPECT_EQ(sequential_colour(7.0), sequential_colour(1.0));
  EXPECT_EQ(sequential_colour(std::nan("")), (Rgb{128, 128, 128}));
}

TEST(Picture, PointsBehindTheObjectAreNotDrawn) {
  PictureScene scene = ring_on_floor();
  const PinholeCamera camera = view_of(box_of(scene), Vector3::UnitY(), 160, 120, 0.3, 1.2);
  const Picture without = draw(scene, camera, quick());
  scene.points = {{0.15, 0.001, 0.0}};  // under the tube
  EXPECT_EQ(draw(scene, camera, quick()).pixels, without.pixels);
  scene.points = {{0.15, 0.125, 0.0}};
  EXPECT_NE(draw(scene, camera, quick()).pixels, without.pixels);
}

TEST(Picture, IsTheSameEveryTime) {
  PictureScene scene = ring_on_floor();
  add_points(scene, 50);
  const PinholeCamera camera = view_of(box_of(scene), Vector3::UnitY(), 80, 60);
  EXPECT_EQ(draw(scene, camera, quick()).pixels, draw(scene, camera, quick()).pixels);
}

TEST(Picture, AnEmptySceneIsBackground) {
  const PinholeCamera camera = view_of({{0, 0, 0}, {1, 1, 1}}, Vector3::UnitZ(), 20, 10);
  for (const Rgb& pixel : draw({}, camera, quick()).pixels) EXPECT_GT(brightness(pixel), 230);
}

TEST(Picture, FramedViewsHoldTheBoxAndFillThePicture) {
  PinholeCamera camera{320, 240, 285, 285, 159.5, 119.5, {}};
  const Box box{{-0.3, 0.1, 2.0}, {0.1, 0.2, 2.3}};
  for (const PinholeCamera& view : {framed(camera, box, 640, 400), view_of(box, Vector3::UnitY(), 640, 400),
                                    view_of(box, Vector3::UnitZ(), 640, 400, 3.0, 0.1)}) {
    Eigen::Array2d low(1e9, 1e9), high(-1e9, -1e9);
    for (int i = 0; i < 8; ++i) {
      const Vector3 seen = view.project(
          {i & 1 ? box.max.x() : box.min.x(), i & 2 ? box.max.y() : box.min.y(), i & 4 ? box.max.z() : box.min.z()});
      low = low.min(seen.head<2>().array()), high = high.max(seen.head<2>().array());
    }
    EXPECT_GT(low.minCoeff(), 0.0);
    EXPECT_LT(high.x(), 640);
    EXPECT_LT(high.y(), 400);
    EXPECT_NEAR(std::max((high - low).x() / 640, (high - low).y() / 400), 0.8, 1e-9);
  }
  EXPECT_EQ(framed(camera, box, 640, 400).camera_to_world.translation, camera.camera_to_world.translation);
}

TEST(Picture, RangesAreRoundNumbers) {
  EXPECT_DOUBLE_EQ(residual_range({}), 1e-3);
  EXPECT_DOUBLE_EQ(residual_range({0.0, 0.0}), 1e-3);
  EXPECT_DOUBLE_EQ(residual_range(std::vector<double>(100, -0.0031)), 5e-3);
  EXPECT_DOUBLE_EQ(residual_range(std::vector<double>(100, 0.002)), 2e-3);
  EXPECT_DOUBLE_EQ(grid_spacing({{0, 0, 0}, {0.42, 0.1, 0.1}}), 0.1);
}

TEST(Picture, RefusesWhatDoesNotFit) {
  PictureScene scene = ring_on_floor();
  scene.points = {{0, 0, 0}};
  scene.residuals = {1.0, 2.0};
  const PinholeCamera camera = view_of(box_of(scene), Vector3::UnitY(), 8, 6);
  EXPECT_THROW(draw(scene, camera), std::invalid_argument);
  PictureOptions options;
  options.samples = 0;
  EXPECT_THROW(draw(ring_on_floor(), camera, options), std::invalid_argument);
}

// With PLIANT_PICTURES=folder the picture is left there for people to look at.
TEST(Picture, LargeWithPoints) {
  PictureScene scene = ring_on_floor();
  add_points(scene, 900);
  const bool keep = std::getenv("PLIANT_PICTURES") != nullptr;
  const PinholeCamera camera = view_of(box_of(scene), Vector3::UnitY(), keep ? 800 : 80, keep ? 500 : 50);
  const std::string png = encode_png(draw(scene, camera));
  if (keep) write_file(std::filesystem::path(std::getenv("PLIANT_PICTURES")) / "ring.png", png);
  EXPECT_EQ(decode(png).width, camera.width);
}

}  // namespace
}  // namespace pliant::picture_test
