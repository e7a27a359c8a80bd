#include "estimation/verdict.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace pliant {
namespace {

using Kind = Verdict::Kind;

/// Frames of followed points alone, whose residuals are so many times the noise.
CostEvaluation of_markers(double over_noise) {
  CostEvaluation evaluation;
  evaluation.succeeded = true;
  for (int f = 0; f < 20; ++f) {
    FrameFit frame;
    frame.frame = f;
    frame.tracks = 10;
    frame.independent = 30.0;
    frame.cost = 0.5 * frame.independent * over_noise * over_noise;
    evaluation.cost += frame.cost;
    evaluation.frames.push_back(frame);
  }
  return evaluation;
}

TEST(Verdict, MotionsSeenByMarkersAloneAreJudgedByTheirNoise) {
  EXPECT_EQ(verdict_of(of_markers(1.0), {}, {}).kind, Kind::Explained);
  const Verdict far = verdict_of(of_markers(3.0), {}, {});
  EXPECT_EQ(far.kind, Kind::Unexplained);
  EXPECT_THAT(far.reasons, ::testing::ElementsAre(::testing::HasSubstr("3.0 times the noise")));
}

TEST(Verdict, StaticTestsAreUnexplainedBeyondNoiseAndASmallPartOfWhatWasMeasured) {
  const auto kind = [](double over_noise, double relative) {
    return verdict_of(std::vector<Agreement>{{"the forces of grips", over_noise, relative}}, {}, {}).kind;
  };
  EXPECT_EQ(kind(1.0, 0.2), Kind::Explained) << "the measurement tells no more";
  EXPECT_EQ(kind(5.0, 0.01), Kind::Explained) << "a law of few numbers";
  EXPECT_EQ(kind(5.0, 0.2), Kind::Unexplained);
  EXPECT_EQ(kind(std::numeric_limits<double>::infinity(), 0.2), Kind::Unexplained);
  const Verdict verdict = verdict_of(std::vector<Agreement>{{"the forces of grips", 5.0, 0.2}}, {}, {});
  EXPECT_THAT(verdict.reasons,
              ::testing::ElementsAre("The model misses the forces of grips by 20 % of the greatest measured, 5.0 times "
                                     "the noise."));
}

}  // namespace
}  // namespace pliant
