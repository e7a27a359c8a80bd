// CSV files of testing machines, written here as machines write them, and those of a real Instron beside the source
// tree.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/curves.hpp"
#include "geometry/mesh_io.hpp"
#include "geometry/meshes.hpp"
#include "import_tools.hpp"

namespace pliant::machine_test {

using namespace test;
using ::testing::HasSubstr;

// Pulls to 10 mm and goes back; 2 N per mm.
std::string pull(const std::string& titles, double per_mm, double per_newton) {
  std::string text = titles;
  for (int i = 0; i <= 400; ++i) {
    const double mm = i <= 200 ? 0.05 * i : 20.0 - 0.05 * i, newton = 2.0 * mm;
    text +=
        std::to_string(0.1 * i) + "," + std::to_string(mm * per_mm) + "," + std::to_string(newton * per_newton) + "\n";
  }
  return text;
}

StressCurve curve_of(const Capture& capture) {
  return read_stress_curve(capture.material_curves.front().curve, false, false);
}

TEST(MachineCsv, BecomesAStressStrainCurveOfTheFirstLoading) {
  const TemporaryFolder folder;
  folder.write("pull.csv", pull("Specimen,A\n\nTime,Extension,Load\n(s),(mm),(N)\n", 1.0, 1.0));
  EXPECT_EQ(import_format("", folder / "pull.csv").name, "machine");
  EXPECT_THAT(complaint_of([&] { (void)imported(folder / "pull.csv", folder / "out"); }), HasSubstr("--length"));
  CaptureFacts facts;
  facts.length = 0.05, facts.area = 1e-4;
  const StressCurve curve = curve_of(imported(folder / "pull.csv", folder / "out", "", {}, facts));
  ASSERT_EQ(curve.stretches.size(), 100u);
  EXPECT_NEAR(curve.stretches.back(), 1.2, 1e-3);
  for (std::size_t i = 0; i < 100; ++i)  // stress = 2000 N/m * (stretch - 1) * 0.05 m / 1e-4 m^2
    EXPECT_NEAR(curve.stresses[i], 1e6 * (curve.stretches[i] - 1.0), 1.0);
  EXPECT_NEAR(curve.stds.front(), 0.01 * curve.stresses.back(), 1e-6);
}

TEST(MachineCsv, TurnsUnitsIntoSiAndRefusesUnknownOnes) {
  const TemporaryFolder folder;
  CaptureFacts facts;
  facts.length = 0.05, facts.area = 1e-4, facts.is_compression = true;
  folder.write("pull.csv", pull("Time (s),Crosshead (cm),Force (kN)\n", 0.1, 1e-3));
  const StressCurve curve = curve_of(imported(folder / "pull.csv", folder / "out", "", {}, facts));
  EXPECT_NEAR(curve.stretches.back(), 0.8, 2e-3);
  EXPECT_NEAR(curve.stresses.back(), 1e6 * (curve.stretches.back() - 1.0), 1e4);
  folder.write("pull.csv", pull("Time (s),Extension,Load (N)\n", 1.0, 1.0));
  EXPECT_THAT(complaint_of([&] { (void)imported(folder / "pull.csv", folder / "no", "machine", {}, facts); }),
              HasSubstr("without a unit"));
  folder.write("pull.csv", pull("Time (s),Extension (furlong),Load (N)\n", 1.0, 1.0));
  EXPECT_THAT(complaint_of([&] { (void)imported(folder / "pull.csv", folder / "no", "machine", {}, facts); }),
              HasSubstr("\"furlong\""));
  folder.write("pull.csv", "Time (s),Extension (mm),Load (N)\n0,0,0\n1,1,oops\n");
  EXPECT_THAT(complaint_of([&] { (void)imported(folder / "pull.csv", folder / "no", "machine", {}, facts); }),
              HasSubstr("pull.csv:3"));
}

TEST(MachineCsv, BecomesAnIndentationWhereAProbeIsTold) {
  const TemporaryFolder folder;
  folder.write("pull.csv", pull("Time (s),Extension (mm),Load (N)\n", 1.0, 1.0));
  write_mesh(folder / "ball.ply", box_mesh({-0.05, -0.05, -0.05}, {0.05, 0.05, 0.05}));
  CaptureFacts facts;
  facts.probe = IndenterShape::Ball, facts.probe_radius = 0.004, facts.density = 1000.0;
  EXPECT_THAT(complaint_of([&] { (void)imported(folder / "pull.csv", folder / "out", "", {}, facts); }),
              HasSubstr("--contact"));
  facts.surface = folder / "ball.ply", facts.contact = Vector3(0, 0, 0.05), facts.up = Vector3(0, 0, 1);
  const Capture capture = imported(folder / "pull.csv", folder / "out", "", {}, facts);
  ASSERT_EQ(capture.indentations.size(), 1u);
  EXPECT_EQ(capture.indentations[0].direction, Vector3(0, 0, -1));
  const ForceCurve curve = read_force_curve(capture.indentations[0].curve);
  EXPECT_NEAR(curve.depths.back(), 0.01, 1e-4);
  for (std::size_t i = 0; i < curve.depths.size(); ++i) EXPECT_NEAR(curve.forces[i], 2000.0 * curve.depths[i], 1e-3);
}

TEST(MachineCsv, ReadsTheFileOfARealInstron) {
  const std::filesystem::path file = shared_data() / "silicone-tensile/BodyDouble_SILK.csv";
  if (!is_file(file)) GTEST_SKIP() << "no file " << file;
  const TemporaryFolder folder;
  const StressCurve curve = curve_of(imported(file, folder / "out"));
  EXPECT_NEAR(curve.stretches.back(), 6.88, 0.05);     // engineering strain 5.88643, not true strain
  EXPECT_NEAR(curve.stresses.back(), 1.13043e6, 2e4);  // engineering stress
  EXPECT_NEAR(curve.stresses.front() / (curve.stretches.front() - 1.0), 10310.0 / 0.044615, 1e4);
}

}  // namespace pliant::machine_test
