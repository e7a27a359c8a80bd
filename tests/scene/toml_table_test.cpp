#include "scene/toml_table.hpp"

#include <Eigen/Geometry>

namespace pliant::toml_table_test {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(NearestName, FindsTheMisspelt) {
  const std::set<std::string> known = {"gravity", "up", "frame_rate"};
  EXPECT_EQ(nearest_name("gravty", known), "gravity");
  EXPECT_EQ(nearest_name("framerate", known), "frame_rate");
  EXPECT_EQ(nearest_name("temperature", known), "");
}

TEST(Rigid, AcceptsARoundedRotation) {
  Eigen::Matrix4d pose = Eigen::Matrix4d::Identity();
  const Matrix3 turn = Eigen::AngleAxisd(2.1, Vector3(1, 2, 3).normalized()).toRotationMatrix();
  pose.topLeftCorner<3, 3>() = (turn * 1e4).array().round() / 1e4;
  pose.topRightCorner<3, 1>() = Vector3(1, 2, 3);
  EXPECT_THAT(why_not_rigid(pose), IsEmpty());
  const RigidMotion motion = nearest_rigid(pose);
  EXPECT_LT((motion.rotation.transpose() * motion.rotation - Matrix3::Identity()).norm(), 1e-14);
  EXPECT_LT((motion.rotation - turn).norm(), 2e-4);
  EXPECT_EQ(motion.translation, Vector3(1, 2, 3));
}

TEST(Rigid, RefusesScaleMirrorAndTransposition) {
  Eigen::Matrix4d pose = Eigen::Matrix4d::Identity();
  pose(0, 0) = 1.01;
  EXPECT_THAT(why_not_rigid(pose), HasSubstr("not orthonormal"));
  pose(0, 0) = -1;
  EXPECT_THAT(why_not_rigid(pose), HasSubstr("mirrors"));
  pose(0, 0) = 1;
  pose(3, 1) = 2;
  EXPECT_THAT(why_not_rigid(pose), HasSubstr("transposed"));
}

}  // namespace
}  // namespace pliant::toml_table_test
