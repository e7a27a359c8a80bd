#include "capture/c3d.hpp"

#include "input_errors.hpp"
#include "support/c3d_writer.hpp"
#include "temporary_folder.hpp"

namespace pliant::c3d_test {
namespace {

using test::C3dWriter;
using test::complaint_of;
using test::TemporaryFolder;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

const double unseen = std::numeric_limits<double>::quiet_NaN();

/// Two markers, three frames; the second one is not seen in frame 1.
C3dWriter small_file() {
  C3dWriter file;
  file.labels = {"Tip - 1", "Base"};
  file.frames.assign(3, Points(2, 3));
  file.frames[0] << 1.5, -20.0, 300.0, 0.0, 10.0, 20.0;
  file.frames[1] << 2.5, -21.0, 301.0, unseen, unseen, unseen;
  file.frames[2] << 3.5, -22.0, 302.0, 0.0, 12.0, -20.5;
  return file;
}

C3dTrajectories read_back(const C3dWriter& file) {
  const TemporaryFolder folder;
  return read_c3d(folder.write("a.c3d", file.bytes()));
}

std::string said(const C3dWriter& file) {
  return complaint_of([&] { (void)read_back(file); });
}

void expect_frames(const C3dTrajectories& read, const C3dWriter& file, double metres, double tolerance) {
  ASSERT_EQ(read.frames.size(), file.frames.size());
  for (std::size_t f = 0; f < file.frames.size(); ++f) {
    ASSERT_EQ(read.frames[f].rows(), file.frames[f].rows());
    for (Eigen::Index i = 0; i < file.frames[f].size(); ++i) {
      const double written = metres * file.frames[f].data()[i], back = read.frames[f].data()[i];
      if (std::isnan(written))
        EXPECT_TRUE(std::isnan(back)) << "frame " << f;
      else
        EXPECT_NEAR(back, written, tolerance) << "frame " << f;
    }
  }
}

TEST(C3d, FloatsComeBack) {
  const C3dTrajectories read = read_back(small_file());
  EXPECT_THAT(read.labels, ElementsAre("Tip - 1", "Base"));
  EXPECT_EQ(read.frame_rate, 100.0);
  expect_frames(read, small_file(), 1e-3, 1e-12);  // the values are floats, but for the factor to metres
}

TEST(C3d, IntegersComeBackWithinHalfAStep) {
  C3dWriter file = small_file();
  file.integer_scale = 0.02;
  expect_frames(read_back(file), file, 1e-3, 1e-3 * 0.5 * 0.02 * (1 + 1e-6));
}

TEST(C3d, TakesEveryUnitOfLength) {
  C3dWriter file = small_file();
  for (const auto& [unit, metres] : {std::pair{"m", 1.0}, {"cm", 1e-2}, {"mm", 1e-3}, {"MM", 1e-3}}) {
    file.units = unit;
    expect_frames(read_back(file), file, metres, 1e-12 * 1e3);
  }
}

TEST(C3d, MissingSamplesAreMarkedInThreeWays) {
  for (const double scale : {0.0, 0.5}) {
    C3dWriter file = small_file();
    file.integer_scale = scale;
    for (const bool writes_nan : {false, true}) {
      file.writes_nan = writes_nan;  // integers: zero
      expect_frames(read_back(file), file, 1e-3, 1e-12);
    }
  }
  C3dWriter file = small_file();
  file.frames[2].row(0).setZero();
  EXPECT_TRUE(std::isnan(read_back(file).frames[2](0, 0)));
}

TEST(C3d, SkipsAnalogData) {
  for (const double scale : {0.0, 0.5}) {
    C3dWriter file = small_file();
    file.integer_scale = scale;
    file.analog_words = 3;
    expect_frames(read_back(file), file, 1e-3, 1e-12);
  }
}

TEST(C3d, CountsFramesOfLongRecordingsByParameters) {
  C3dWriter file = small_file();
  file.last_frame = 1;
  EXPECT_EQ(read_back(file).frames.size(), 1u);
  file.long_frames = 3.0F;
  EXPECT_EQ(read_back(file).frames.size(), 3u);
  file.trial_end = 2;
  EXPECT_EQ(read_back(file).frames.size(), 2u);
  file.trial_end = 70000;
  EXPECT_THAT(said(file), HasSubstr("after 3 of 70000 frames"));
}

TEST(C3d, JoinsLabelsOfManyTrajectories) {
  C3dWriter file;
  for (int i = 0; i < 300; ++i) file.labels.push_back(std::to_string(i));
  file.frames.assign(2, Points::Constant(300, 3, 1.0));
  const C3dTrajectories read = read_back(file);
  ASSERT_EQ(read.labels.size(), 300u);
  EXPECT_EQ(read.labels[299], "299");
}

TEST(C3d, TrajectoriesWithoutLabelHaveNone) {
  C3dWriter file = small_file();
  file.labels[1] = "";
  EXPECT_THAT(read_back(file).labels, ElementsAre("Tip - 1", ""));
}

TEST(C3d, ARateMayBeMissing) {
  C3dWriter file = small_file();
  file.rate = 0.0;
  EXPECT_EQ(read_back(file).frame_rate, std::nullopt);
}

TEST(C3d, SaysWhatIsWrong) {
  const auto with = [](auto change) {
    C3dWriter file = small_file();
    change(file);
    return said(file);
  };
  EXPECT_THAT(with([](C3dWriter& f) { f.units.reset(); }),
              AllOf(HasSubstr("a.c3d: no unit of length (POINT:UNITS); expected m, cm or mm"), HasSubstr("as CSV")));
  EXPECT_THAT(with([](C3dWriter& f) { f.units = "inch"; }), HasSubstr("the unit of length \"inch\""));
  EXPECT_THAT(with([](C3dWriter& f) { f.processor = 85; }), HasSubstr("DEC"));
  EXPECT_THAT(with([](C3dWriter& f) { f.processor = 86; }), HasSubstr("MIPS"));
  EXPECT_THAT(with([](C3dWriter& f) { f.processor = 3; }), HasSubstr("processor type 3"));
  EXPECT_THAT(with([](C3dWriter& f) { f.used = 5; }), HasSubstr("2 trajectories where POINT:USED is 5"));
  EXPECT_THAT(with([](C3dWriter& f) { f.scale_parameter = 0.1F; }), HasSubstr("the same sign"));
  EXPECT_THAT(with([](C3dWriter& f) { f.scale_parameter = 0.0F; }), HasSubstr("not zero"));
  EXPECT_THAT(with([](C3dWriter& f) { f.last_frame = 0; }), HasSubstr("frames from 1 to 0"));
  EXPECT_THAT(with([](C3dWriter& f) { f.labels.clear(), f.frames.clear(); }), HasSubstr("no trajectories"));
}

TEST(C3d, TellsSeveralFaultsTogether) {
  C3dWriter file = small_file();
  file.units.reset();
  file.used = 5;
  EXPECT_THAT(said(file), AllOf(HasSubstr("POINT:UNITS"), HasSubstr("POINT:USED")));
}

TEST(C3d, RefusesOtherFiles) {
  const TemporaryFolder folder;
  for (const char* content : {"", "\x02", "frame,id,x,y,z\n"})
    EXPECT_THAT(complaint_of([&] { (void)read_c3d(folder.write("a.c3d", content)); }),
                HasSubstr("expected a C3D file"));
  EXPECT_THAT(complaint_of([&] { (void)read_c3d(folder / "none.c3d"); }), HasSubstr("cannot be read"));
}

TEST(C3d, RefusesEveryTruncation) {
  const TemporaryFolder folder;
  for (const double scale : {0.0, 0.5}) {
    C3dWriter file = small_file();
    file.integer_scale = scale;
    const std::string whole = file.bytes();
    for (std::size_t size = 0; size < whole.size(); ++size)
      EXPECT_NE(complaint_of([&] { (void)read_c3d(folder.write("a.c3d", whole.substr(0, size))); }), "") << size;
  }
}

TEST(C3d, SurvivesEveryBrokenByte) {
  const TemporaryFolder folder;
  const std::string whole = small_file().bytes();
  for (std::size_t at = 0; at < whole.size(); ++at)
    for (const char value : {'\0', '\x7f', '\xff'}) {
      std::string broken = whole;
      broken[at] = value;
      const auto path = folder.write("a.c3d", broken);
      EXPECT_NO_FATAL_FAILURE((void)complaint_of([&] { (void)read_c3d(path); })) << at;
    }
}

}  // namespace
}  // namespace pliant::c3d_test
