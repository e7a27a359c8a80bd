// CSV files of testing machines, written here as machines write them, and those of a real Instron beside the source
// tree.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>

#include "capture/curves.hpp"
#include "geometry/mesh_io.hpp"
#include "geometry/meshes.hpp"
#include "import_tools.hpp"

namespace pliant::machine_test {

using namespace test;
using ::testing::AllOf;
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
  EXPECT_NEAR(curve.stds.back(), 0.0051 * curve.stresses.back(), 0.0001 * curve.stresses.back());  // of the load cell
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
  EXPECT_GT(capture.indentations[0].contact_std, 0.0);
  EXPECT_LT(capture.indentations[0].contact_std, 1e-4);
  const ForceCurve curve = read_force_curve(capture.indentations[0].curve);
  EXPECT_NEAR(curve.depths.back(), 0.01, 1e-4);
  for (std::size_t i = 0; i < curve.depths.size(); ++i) EXPECT_NEAR(curve.forces[i], 2000.0 * curve.depths[i], 1e-3);
}

// 2 N per mm to 10 mm in rows of two numbers, written by a function of mm.
template <class Row>
std::string table(const std::string& titles, Row&& row) {
  std::string text = titles;
  for (int i = 0; i <= 100; ++i) text += row(0.1 * i) + "\n";
  return text;
}

std::string number(double value, int digits = 4, char decimal = '.') {
  std::string text(32, ' ');
  text.resize(std::size_t(std::snprintf(text.data(), text.size(), "%.*f", digits, value)));
  for (char& c : text)
    if (c == '.') c = decimal;
  return text;
}

// Numbers with a sign between thousands.
std::string grouped(double value, char thousands, char decimal) {
  std::string text = number(value, 2, decimal);
  for (std::size_t at = text.size() - 3; at > 3; at -= 3) text.insert(at - 3, 1, thousands);
  return text;
}

struct Written {
  std::string what, content;
};

std::string utf16(const std::string& text, bool with_mark) {
  std::string bytes = with_mark ? "\xFF\xFE" : "";
  for (const char c : text) bytes += c, bytes += '\0';
  return bytes;
}

std::vector<Written> tables_of_one_test() {
  const auto comma = [](double mm) { return number(mm) + "," + number(2 * mm); };
  const auto german = [](double mm) { return number(mm, 3, ',') + ";" + number(2 * mm, 3, ','); };
  const auto percent = [](double mm) { return number(2 * mm) + "," + number(0.02 * mm, 6); };
  return {
      {"underscores",
       table("Time_s,Force_N,Displacement_mm\n", [](double mm) { return "1," + number(2 * mm) + "," + number(mm); })},
      {"slashes", table("Weg / mm,Kraft/N\n", comma)},
      {"a comma", table("\"Displacement, mm\",\"Force, N\"\n", comma)},
      {"a space", table("Traverse mm\tLast N\n", [](double mm) { return number(mm) + "\t" + number(2 * mm); })},
      {"a word between", table("Weg in mm,Kraft in N\n", comma)},
      {"two brackets", table("Extension (crosshead) (mm),Force [channel 1] [N]\n", comma)},
      {"names of channels with units", table("Channel 1 [mm],Channel 2 [N]\n", comma)},
      {"Zwick", table("Prüfzeit;Standardweg;Standardkraft\n\"s\";\"mm\";\"N\"\n",
                      [&](double mm) { return "0,5;" + german(mm); })},
      {"Zwick with quotes and metadata",
       table(
           "\"Vorkraft\";\"0,05\";\"N\"\n\"Datum\";\"12.05.2024\"\n\n\"Standardweg\";\"Standardkraft\"\n\"mm\";\"N\"\n",
           [](double mm) { return "\"" + number(mm, 3, ',') + "\";\"" + number(2 * mm, 3, ',') + "\""; })},
      {"blank lines",
       table("Crosshead\tLoad\n\n(mm)\t(N)\n\n", [](double mm) { return number(mm) + "\t" + number(2 * mm) + "\n"; })},
      {"strain in per cent of a load",
       table("Dehnung %;Standardkraft N\n",
             [](double mm) { return number(2 * mm, 3, ',') + ";" + number(2 * mm, 3, ','); })},
      {"N/mm² behind a bracket", table("Strain (%),Stress (N/mm²)\n", percent)},
      {"N/mm^2", table("Dehnung [%],Spannung [N/mm^2]\n", percent)},
      {"MPa", table("Strain_%,Stress_MPa\n", percent)},
      {"elongation in per cent", table("Elongation (%),Stress (MPa)\n", percent)},
      {"a stretch",
       table("Stretch,Stress (MPa)\n", [](double mm) { return number(1.0 + 0.02 * mm) + "," + number(0.02 * mm, 6); })},
      {"grams",
       table("Force (g),Distance (mm)\n", [](double mm) { return number(2 * mm / 9.80665e-3) + "," + number(mm); })},
      {"kilograms",
       table("Load kgf,Extension mm\n", [](double mm) { return number(2 * mm / 9.80665, 6) + "," + number(mm); })},
      {"micrometres",
       table("Extension (\xC2\xB5m),Load (mN)\n", [](double mm) { return number(1e3 * mm) + "," + number(2e3 * mm); })},
      {"Latin-1", table("Dehnweg \xB5m;Pr\xFC"
                        "fkraft N\n",
                        [](double mm) { return number(1e3 * mm, 1, ',') + ";" + number(2 * mm, 4, ','); })},
      {"UTF-16", utf16(table("Extension (mm);Load (N)\r\n", [&](double mm) { return german(mm) + "\r"; }), true)},
      {"UTF-16 without a mark",
       utf16(table("Extension (mm)\tLoad (N)\n", [](double mm) { return number(mm) + "\t" + number(2 * mm); }), false)},
      {"a byte order mark", "\xEF\xBB\xBF" + table("Extension (mm),Load (N)\n", comma)},
      {"German thousands",
       table("Weg [µm];Kraft [mN]\n",
             [](double mm) { return grouped(1e3 * mm, '.', ',') + ";" + grouped(2e3 * mm, '.', ','); })},
      {"English thousands", table("Extension (um),Load (mN)\n",
                                  [](double mm) {
                                    return "\"" + grouped(1e3 * mm, ',', '.') + "\",\"" + grouped(2e3 * mm, ',', '.') +
                                           "\"";
                                  })},
      {"thousands of spaces",
       table("Weg (um);Kraft (mN)\n",
             [](double mm) { return grouped(1e3 * mm, ' ', ',') + ";" + grouped(2e3 * mm, ' ', ','); })},
      {"inches and pounds",
       table("Extension (in),Load (lbf)\n",
             [](double mm) { return number(mm / 25.4, 8) + "," + number(2 * mm / 4.4482216152605, 8); })},
      {"compression is negative",
       table("Weg mm;Kraft N\n", [](double mm) { return number(-mm, 3, ',') + ";" + number(-2 * mm, 3, ','); })},
  };
}

TEST(MachineCsv, ReadsTitlesUnitsAndNumbersAsMachinesWriteThem) {
  CaptureFacts facts;
  facts.length = 0.05, facts.area = 1e-4;
  for (const Written& file : tables_of_one_test()) {
    const TemporaryFolder folder;
    folder.write("pull.csv", file.content);
    std::optional<StressCurve> curve;
    const std::string complaint = complaint_of([&] {
      EXPECT_EQ(import_format("", folder / "pull.csv").name, "machine") << file.what;
      curve = curve_of(imported(folder / "pull.csv", folder / "out", "", {}, facts));
    });
    EXPECT_EQ(complaint, "") << file.what;
    if (!curve) continue;
    const double sign = file.what == "compression is negative" ? -1.0 : 1.0;
    EXPECT_NEAR(curve->stretches.back(), 1.0 + sign * 0.2, 3e-4) << file.what;
    for (std::size_t i = 0; i < curve->stresses.size(); ++i)
      EXPECT_NEAR(curve->stresses[i], 1e6 * (curve->stretches[i] - 1.0), 200.0) << file.what;
  }
}

TEST(MachineCsv, NamesTheLineAndTheWordThatItCannotRead) {
  CaptureFacts facts;
  facts.length = 0.05, facts.area = 1e-4;
  const auto complaint = [&](const std::string& content) {
    const TemporaryFolder folder;
    folder.write("pull.csv", content);
    return complaint_of([&] { (void)imported(folder / "pull.csv", folder / "out", "", {}, facts); });
  };
  EXPECT_THAT(complaint("a,b\n\nExtension (mm),Load (N)\n0,0\n1,2\n2,4 N?\n"),
              AllOf(HasSubstr("pull.csv:6"), HasSubstr("4 N?"), HasSubstr("\"load\"")));
  EXPECT_THAT(complaint("Extension (mm),Load (N)\n0,0\n1,2\nmean,2\n"),
              AllOf(HasSubstr("pull.csv:4"), HasSubstr("mean")));
  EXPECT_THAT(complaint("Extension (mm),Load (stone)\n0,0\n1,2\n"), AllOf(HasSubstr("pull.csv:1"), HasSubstr("stone")));
  EXPECT_THAT(complaint("Foo,Load (N)\n0,0\n1,2\n"), AllOf(HasSubstr("\"Foo\""), HasSubstr("line 2")));
  EXPECT_THAT(complaint("Extension (mm),True stress (MPa)\n0,0\n1,2\n"), HasSubstr("true stress"));
}

TEST(MachineCsv, TellsPercentsStrainsAndStretchesApart) {
  const auto last_stretch = [](const std::string& title, double begin, double end, const std::string& strain = "",
                               const std::string& true_title = "") {
    const TemporaryFolder folder;
    std::string text = title + ",Stress (kPa)" + (true_title.empty() ? "" : "," + true_title) + "\n";
    for (int i = 0; i <= 100; ++i) {
      const double value = begin + (end - begin) * i / 100.0;
      text +=
          number(value, 6) + "," + number(i) + (true_title.empty() ? "" : "," + number(std::log1p(value), 6)) + "\n";
    }
    folder.write("pull.csv", text);
    ImportOptions options;
    options.strain = strain;
    return curve_of(imported(folder / "pull.csv", folder / "out", "", options)).stretches.back();
  };
  const auto question = [&](const std::string& title, double begin, double end) {
    return complaint_of([&] { (void)last_stretch(title, begin, end); });
  };
  EXPECT_NEAR(last_stretch("Strain (%)", 0, 30), 1.3, 1e-9);
  EXPECT_NEAR(last_stretch("Strain (mm/mm)", 0, 3), 4.0, 1e-9);
  EXPECT_NEAR(last_stretch("Strain", 0, 0.3), 1.3, 1e-9);
  EXPECT_NEAR(last_stretch("Strain", 0, 30), 1.3, 1e-9);
  EXPECT_NEAR(last_stretch("Engineering strain", 0, 5, "", "True strain"), 6.0, 1e-9);
  EXPECT_NEAR(last_stretch("Stretch", 1, 4), 4.0, 1e-9);
  EXPECT_NEAR(last_stretch("Stretch (%)", 0, 40), 1.4, 1e-9);
  EXPECT_NEAR(last_stretch("Strain", 0, 5, "percent"), 1.05, 1e-9);
  EXPECT_NEAR(last_stretch("Strain", 0, 5, "strain"), 6.0, 1e-9);
  EXPECT_NEAR(last_stretch("Strain", 1, 5, "stretch"), 5.0, 1e-9);
  EXPECT_THAT(question("Strain", 0, 5), HasSubstr("--strain percent"));
  EXPECT_THAT(question("Strain (mm/mm)", 1, 1.3), HasSubstr("--strain stretch"));
  EXPECT_THAT(question("Strain (mm/mm)", 0, 30), HasSubstr("reaches 30"));
  EXPECT_THAT(question("Stretch", 0, 30), AllOf(HasSubstr("begins at 0"), HasSubstr("--strain percent")));
}

TEST(MachineCsv, AsksWhetherASpecimenIsPulledWhereSignsDiffer) {
  const TemporaryFolder folder;
  folder.write("press.csv", pull("Time (s),Crosshead (mm),Force (N)\n", 1.0, -1.0));
  CaptureFacts facts;
  facts.length = 0.05, facts.area = 1e-4;
  EXPECT_THAT(complaint_of([&] { (void)imported(folder / "press.csv", folder / "no", "", {}, facts); }),
              HasSubstr("--tension or --compression"));
  facts.is_compression = true;
  const StressCurve curve = curve_of(imported(folder / "press.csv", folder / "out", "", {}, facts));
  EXPECT_LT(curve.stretches.back(), 1.0);
  EXPECT_LT(curve.stresses.back(), 0.0);
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
