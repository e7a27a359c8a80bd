// Motions that the model explains for a while: the estimate is that of the part that it explains.
#include "estimation/explained_span.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/dropped.hpp"
#include "support/interruption.hpp"

namespace pliant::explained_span_test {
namespace {

FitOptions quick() {
  FitOptions options;
  options.cells = options.coarse_cells = 5.0;
  options.budget = 0.0;
  options.alternatives = false;
  options.most_starts = 3;
  for (const char* name : {"poissons_ratio", "mass_damping", "contact_stiffness"})
    options.parameters[name].estimated = false;
  options.parameters["poissons_ratio"].start = VectorX::Constant(1, 0.3);
  options.parameters["mass_damping"].start = VectorX::Constant(1, 0.2);
  return options;
}

constexpr int kicked = 17;  // frames after it is let go; the ground is touched about frame 9

/// After a while something pushes the block that no model knows of.
RecordedCapture kicked_block() {
  test::Dropped dropped;
  dropped.moved = [](int frame) {
    const double since = std::max(0, frame - kicked) / 60.0;
    return Vector3(0.8 * since, 0.0, 0.5 * since);
  };
  return dropped.record();
}

double modulus(const FitOutcome& outcome) { return outcome.theta[outcome.parameters.find("youngs_modulus")->at]; }

int last_frame(const FitOutcome& outcome) { return outcome.evaluation.frames.back().frame; }

TEST(ExplainedSpan, IsLookedForWhereMotionsMeetObstaclesAlone) {
  RecordedCapture block = test::Dropped{}.record();
  FitOptions options;
  EXPECT_TRUE(ExplainedSpan::suits({block}, options));
  options.span = 1.0;
  EXPECT_FALSE(ExplainedSpan::suits({block}, options)) << "the user has chosen";
  options.span = 0.0;
  block.capture.scene.planes.clear();
  EXPECT_FALSE(ExplainedSpan::suits({block}, options));
}

TEST(ExplainedSpan, OfAWholeThatIsExplainedIsTheWhole) {
  RecordedCapture block = test::Dropped{}.record();
  for (ObservedFrame& frame : block.observed)  // what two meshes of it differ by is little beside that
    for (float& noise : frame.noise) noise = 0.01F;
  const FitOptions options = quick();
  const FitOutcome outcome = fit({block}, options);
  ASSERT_TRUE(outcome.evaluation.succeeded) << outcome.reason;
  EXPECT_EQ(outcome.verdict.kind, Verdict::Kind::Explained);
  EXPECT_EQ(last_frame(outcome), 29);
  EXPECT_DOUBLE_EQ(outcome.cells, options.cells);
  EXPECT_THAT(outcome.notes, ::testing::Not(::testing::Contains(::testing::HasSubstr("whole motion"))));
}

TEST(ExplainedSpan, EndsBeforeWhatNoParametersExplain) {
  const RecordedCapture block = kicked_block();
  FitOptions options = quick();
  const FitOutcome part = fit({block}, options);
  ASSERT_TRUE(part.evaluation.succeeded) << part.reason;
  EXPECT_EQ(part.verdict.kind, Verdict::Kind::Explained);
  EXPECT_GE(last_frame(part), 11);
  EXPECT_LE(last_frame(part), kicked + 4);
  EXPECT_DOUBLE_EQ(part.cells, 1.5 * options.cells);
  EXPECT_THAT(part.notes, ::testing::Contains(::testing::HasSubstr("whole motion")));
  EXPECT_THAT(part.verdict.reasons, ::testing::Contains(::testing::HasSubstr("of the motion")));
  EXPECT_FALSE(part.starts.empty());
  options.span = 1.0;
  const FitOutcome whole = fit({block}, options);
  EXPECT_EQ(whole.verdict.kind, Verdict::Kind::Unexplained);
  EXPECT_EQ(last_frame(whole), 29);
  const auto off = [](const FitOutcome& outcome) {
    return std::abs(modulus(outcome) / test::Dropped::youngs_modulus - 1.0);
  };
  EXPECT_LT(off(part), 0.15);
  EXPECT_LT(off(part), off(whole));
}

/// A mesh that is too coarse explains no whole motion; on the finer one of its parts the whole is explained, too.
TEST(ExplainedSpan, ReachesTheWholeAgainFromItsParts) {
  FitOptions options = quick();
  options.cells = options.coarse_cells = 6.0;
  const FitOutcome outcome = fit({test::Dropped{}.record()}, options);
  ASSERT_TRUE(outcome.evaluation.succeeded) << outcome.reason;
  EXPECT_EQ(outcome.verdict.kind, Verdict::Kind::Explained);
  EXPECT_EQ(last_frame(outcome), 29);
  EXPECT_DOUBLE_EQ(outcome.cells, 1.5 * options.cells) << "it went by parts";
  EXPECT_THAT(outcome.notes, ::testing::Not(::testing::Contains(::testing::HasSubstr("whole motion"))));
}

TEST(ExplainedSpan, OfWhatTouchesNothingIsTheWholeWithItsAlternatives) {
  RecordedCapture block = kicked_block();
  for (Plane& plane : block.capture.scene.planes) plane.point = Vector3(0.0, -5.0, 0.0);  // far below
  FitOptions options = quick();
  options.alternatives = true;
  const FitOutcome outcome = fit({block}, options);
  ASSERT_TRUE(outcome.evaluation.succeeded) << outcome.reason;
  EXPECT_EQ(outcome.verdict.kind, Verdict::Kind::Unexplained);
  EXPECT_EQ(last_frame(outcome), 29);
  EXPECT_DOUBLE_EQ(outcome.cells, options.cells);
  EXPECT_GT(outcome.uncertainty.budget.size(), 1u) << "other models are tried all the same";
  EXPECT_THAT(outcome.notes, ::testing::Not(::testing::Contains(::testing::HasSubstr("whole motion"))));
}

TEST(ExplainedSpan, GoesOnAfterAnInterruption) {
  const RecordedCapture block = kicked_block();
  const FitOutcome undisturbed = fit({block}, quick());
  const auto has_tried_one = [](const FitState& state) { return state.span && state.span->has_whole; };
  test::Interruption interruption(has_tried_one);
  const FitOutcome cut = fit({block}, quick(), interruption.monitor());
  ASSERT_TRUE(interruption.came());
  EXPECT_TRUE(cut.interrupted);
  const FitOutcome resumed = fit({block}, quick(), {}, interruption.left());
  EXPECT_FALSE(resumed.interrupted);
  EXPECT_EQ(last_frame(resumed), last_frame(undisturbed));
  EXPECT_NEAR(modulus(resumed), modulus(undisturbed), 1e-6 * modulus(undisturbed));
}

}  // namespace
}  // namespace pliant::explained_span_test
