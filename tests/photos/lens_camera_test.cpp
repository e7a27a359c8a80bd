#include "photos/lens_camera.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <opencv2/calib3d.hpp>
#include <string>

#include "input_errors.hpp"
#include "temporary_folder.hpp"

namespace pliant::test::lens_camera_test {
namespace {

using testing::HasSubstr;

LensCamera some_camera() {
  LensCamera camera;
  camera.width = 1200;
  camera.height = 800;
  camera.camera_matrix << 2400, 0, 610, 0, 2410, 390, 0, 0, 1;
  camera.lens = LensDistortion({-0.25, 0.1, 8e-4, -5e-4, -0.02});
  camera.world_to_camera = {Eigen::AngleAxisd(0.4, Vector3(1, -2, 0.5).normalized()).toRotationMatrix(),
                            Vector3(0.1, -0.05, 0.9)};
  return camera;
}

constexpr const char* head = "%YAML:1.0\n---\nimage_width: 1200\nimage_height: 800\n";
constexpr const char* matrix =
    "camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [2400., 0., 610., 0., 2410., 390., 0., "
    "0., 1.]\n";
constexpr const char* lens =
    "distortion_coefficients: !!opencv-matrix\n   rows: 5\n   cols: 1\n   dt: d\n   data: [-0.25, 0.1, 8e-4, -5e-4, "
    "-0.02]\n";
constexpr const char* shift = "T: !!opencv-matrix\n   rows: 3\n   cols: 1\n   dt: d\n   data: [100., -50., 900.]\n";

std::string rotation(const char* numbers) {
  return std::string("R: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [") + numbers + "]\n";
}

TEST(LensCamera, ComesBackFromItsFile) {
  const TemporaryFolder folder;
  const LensCamera camera = some_camera();
  write_lens_camera(folder / "a.yml", camera);
  const LensCamera again = read_lens_camera(folder / "a.yml", folder / "a.yml");
  EXPECT_EQ(again.width, 1200);
  EXPECT_EQ(again.height, 800);
  EXPECT_TRUE(again.camera_matrix.isApprox(camera.camera_matrix, 1e-12));
  EXPECT_EQ(again.lens, camera.lens);
  EXPECT_TRUE(again.world_to_camera.rotation.isApprox(camera.world_to_camera.rotation, 1e-12));
  EXPECT_TRUE(again.world_to_camera.translation.isApprox(camera.world_to_camera.translation, 1e-12));
}

/// R as a vector, T in millimetres, [R | T] as a projection of any scale: all the same camera.
TEST(LensCamera, TakesEveryWayToWriteThePose) {
  const TemporaryFolder folder;
  const std::string common = std::string(head) + matrix + lens;
  const auto by_matrix = folder.write("a.yml", common + rotation("0., -1., 0., 1., 0., 0., 0., 0., 1.") + shift);
  const auto by_vector = folder.write("b.yml", common + "R: [0., 0., 1.5707963267948966]\nT: [0.1, -0.05, 0.9]\n");
  const auto pose = folder.write("pose.yml", "%YAML:1.0\n---\nR: [0., 0., 1.5707963267948966]\nT: [0.1, -0.05, 0.9]\n");
  const auto intrinsics = folder.write("c.yml", common);
  // -2 camera_matrix [R | T]
  const auto by_projection =
      folder.write("d.yml", common +
                                "projection: !!opencv-matrix\n   rows: 3\n   cols: 4\n   dt: d\n"
                                "   data: [0., 4800., -1220., -1578., -4820., 0., -780., -461., 0., 0., -2., -1.8]\n");
  const LensCamera first = read_lens_camera(by_matrix, by_matrix, 0.001);
  for (const LensCamera& other : {read_lens_camera(by_vector, by_vector), read_lens_camera(intrinsics, pose),
                                  read_lens_camera(by_projection, by_projection)}) {
    EXPECT_TRUE(other.world_to_camera.rotation.isApprox(first.world_to_camera.rotation, 1e-12));
    EXPECT_TRUE(other.world_to_camera.translation.isApprox(first.world_to_camera.translation, 1e-12));
  }
}

TEST(LensCamera, RefusesWhatMakesNoSense) {
  const TemporaryFolder folder;
  const auto complaint = [&](const std::string& content) {
    const auto file = folder.write("bad.yml", content);
    return complaint_of([&] { read_lens_camera(file, file); });
  };
  const std::string common = std::string(head) + matrix + lens,
                    straight = rotation("1., 0., 0., 0., 1., 0., 0., 0., 1.");
  EXPECT_THAT(complaint("no yaml"), HasSubstr("bad.yml: cannot be read as OpenCV's YAML"));
  EXPECT_THAT(complaint(std::string(head) + lens + straight + shift), HasSubstr("no key `camera_matrix`"));
  EXPECT_THAT(complaint(std::string(head) + matrix + straight + shift), HasSubstr("no key `distortion_coefficients`"));
  EXPECT_THAT(complaint(common + shift), HasSubstr("no key `R`"));
  EXPECT_THAT(complaint(common + straight), HasSubstr("no key `T`"));
  EXPECT_THAT(complaint(common + rotation("1., 0., 0., 0., 1., 0., 0., 0., -1.") + shift), HasSubstr("`R` mirrors"));
  EXPECT_THAT(complaint(common + rotation("2., 0., 0., 0., 1., 0., 0., 0., 1.") + shift), HasSubstr("not orthonormal"));
  EXPECT_THAT(complaint(common + rotation("1., 0., 0., 0., .Nan, 0., 0., 0., 1.") + shift), HasSubstr("not finite"));
  EXPECT_THAT(
      complaint("%YAML:1.0\n---\nimage_width: 1200\nimage_height: 8\n" + std::string(matrix) + lens + straight + shift),
      HasSubstr("bad.yml:4: `image_height` is 8"));
  EXPECT_THAT(complaint_of([&] { read_lens_camera(folder / "none.yml", folder / "none.yml"); }), HasSubstr("none.yml"));
}

/// Lens out, lens in; and the pinhole without lens agrees with the ray through its pixel.
TEST(LensCamera, LensAndPinholeAgree) {
  const LensCamera camera = some_camera();
  const Vector3 place = camera.world_to_camera.inverse()(Vector3(0.12, -0.07, 0.8));
  const Vector2 seen = project(camera, place), straight = project_without_lens(camera, place);
  EXPECT_GT((seen - straight).norm(), 2.0) << "the lens must matter here";
  EXPECT_LT((without_lens(camera, std::span(&seen, 1))[0] - straight).norm(), 1e-4);
  const Vector3 ray = ray_of(camera, straight), to = place - camera.centre();
  EXPECT_LT(ray.normalized().cross(to.normalized()).norm(), 1e-12);
  EXPECT_GT(ray.dot(to), 0);
  const Vector3 behind = camera.world_to_camera.inverse()(Vector3(0, 0, -1));
  EXPECT_FALSE(project(camera, behind).allFinite());
}

/// Against OpenCV itself, with as many coefficients as it knows.
TEST(LensCamera, SeesWhereOpenCvSees) {
  const std::vector<double> all = {-0.25, 0.1,  8e-4,  -5e-4, -0.02, 0.03, -0.02,
                                   0.01,  1e-3, -2e-3, 5e-4,  1e-3,  0.05, -0.03};
  for (const std::size_t count : {4, 5, 8, 12, 14}) {
    LensCamera camera = some_camera();
    const std::vector<double> distortion(all.begin(), all.begin() + long(count));
    camera.lens = LensDistortion(distortion);
    const Vector3 local(0.14, -0.1, 0.8);
    std::vector<cv::Point2d> theirs;
    cv::projectPoints(std::vector{cv::Point3d(local.x(), local.y(), local.z())}, cv::Vec3d(), cv::Vec3d(),
                      cv::Matx33d(2400, 0, 610, 0, 2410, 390, 0, 0, 1), distortion, theirs);
    const Vector2 ours = project(camera, camera.world_to_camera.inverse()(local));
    EXPECT_LT((ours - Vector2(theirs[0].x, theirs[0].y)).norm(), 1e-8) << count << " coefficients";
  }
}

TEST(LensCamera, DerivativeAgreesWithDifferences) {
  const LensCamera camera = some_camera();
  const Vector3 place(0.02, 0.03, -0.04);
  Eigen::Matrix<double, 2, 3> derivative;
  project_without_lens(camera, place, &derivative);
  constexpr double h = 1e-6;
  for (int k = 0; k < 3; ++k) {
    const Vector3 step = h * Vector3::Unit(k);
    const Vector2 difference =
        (project_without_lens(camera, place + step) - project_without_lens(camera, place - step)) / (2 * h);
    EXPECT_LT((difference - derivative.col(k)).norm(), 1e-5 * derivative.norm());
  }
}

}  // namespace
}  // namespace pliant::test::lens_camera_test
