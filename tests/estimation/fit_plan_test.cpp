// Plans are functions of what was done: no simulation is needed to see what comes next.
#include "estimation/fit_plan.hpp"

#include "support/plans.hpp"

namespace pliant::fit_plan_test {
namespace {

using test::Plans;
using testing::ElementsAre;
using testing::UnorderedElementsAre;

TEST_F(Plans, BeginWithTheMotionAtTheStart) {
  const std::vector<StageChain> chains = next();
  ASSERT_EQ(chains.size(), 1u);
  ASSERT_EQ(chains[0].size(), 2u);
  EXPECT_EQ(chains[0][0].id, (StageId{StageKind::Motion, 0, 0}));
  EXPECT_THAT(chains[0][0].free, ElementsAre("linear_velocity"));
  EXPECT_EQ(chains[0][0].horizon.until, Horizon::Until::Beginning);
  EXPECT_EQ(chains[0][0].from.front(), facts.parameters.reference());
  EXPECT_TRUE(chains[0][1].from.empty()) << "from where the one before ends";
  EXPECT_GT(chains[0][1].horizon.part, chains[0][0].horizon.part);
  EXPECT_TRUE(chains[0][0].by_pose) << "where points were registered, before the surface that is nearest";
  EXPECT_FALSE(chains[0][1].by_pose);
}

TEST_F(Plans, EndWithAlternativeModelsAtTheFinestEstimate) {
  facts.options.correct = false;
  facts.repetitions = {{18.0, 1.0}};
  facts.alternatives = {{"mesh", 1.5, 1.0, {}, false, 1.8}, {"time step", 1.0, 2.0, {}, false, 1.0}};
  has_done(record({StageKind::Motion, 0, 0}, 9.0, 7e3));
  has_done(record({StageKind::Motion, 0, 1}, 9.0, 7e3));
  for (int rounds = 0; rounds < 40; ++rounds) {
    const auto chains = next();
    if (chains.empty()) break;
    for (const StageChain& chain : chains) {
      for (const Stage& stage : chain) {
        StageRecord r = record(stage.id, 5.0, stage.id.kind == StageKind::Finer ? 9e3 : 8e3);
        if (stage.id.kind == StageKind::Scan)
          for (const double E : stage.trials) r.trials.emplace_back(E, std::abs(std::log(E / 8e3)) + 1.0);
        if (stage.id.kind == StageKind::Alternative) {
          EXPECT_EQ(stage.from.front(), theta(9e3)) << "where the repetition ended";
          EXPECT_EQ(stage.grid.cells, stage.id.number == 0 ? 27.0 : 18.0);
          EXPECT_EQ(stage.grid.steps, stage.id.number == 0 ? 1.0 : 2.0);
        }
        has_done(std::move(r));
      }
    }
  }
  const auto count = std::ranges::count(state.done, StageKind::Alternative, [](const auto& r) { return r.id.kind; });
  EXPECT_EQ(count, 2);
  EXPECT_EQ(state.done.back().id.number, 1);
}

TEST_F(Plans, GoOnWhereAChainWasInterrupted) {
  has_done(record({StageKind::Motion, 0, 0}, 9.0, 7e3));
  const auto chains = next();
  ASSERT_EQ(chains[0].size(), 1u);
  const Stage& stage = only(chains);
  EXPECT_EQ(stage.id.number, 1);
  EXPECT_EQ(stage.from.front(), theta(7e3));
  EXPECT_EQ(stage.iterations_before, 3);
}

TEST_F(Plans, EstimateFromTheBestStart) {
  has_followed(3.5, 2.5);
  const auto chains = next();
  ASSERT_EQ(chains.size(), 1u);
  const StageChain& chain = chains[0];
  ASSERT_EQ(chain.size(), 2u);
  EXPECT_EQ(chain[0].from.front(), theta(4.1e4));
  EXPECT_EQ(chain[0].id.start, 1);
  EXPECT_EQ(chain[0].band, facts.options.wide_band);
  EXPECT_EQ(chain[1].band, facts.options.fine_band);
  EXPECT_EQ(chain[1].grid.cells, facts.options.cells);
  EXPECT_EQ(chain[1].iterations, facts.options.max_iterations);
  EXPECT_THAT(chain[1].free, UnorderedElementsAre("youngs_modulus", "poissons_ratio", "linear_velocity"));
}

TEST_F(Plans, DoNotRepeatOnTheFullGridWhatTheStartsDidThere) {
  facts.coarse_is_as_fine = true;
  has_followed();
  const auto chains = next();
  ASSERT_EQ(chains[0].size(), 1u);
  EXPECT_EQ(only(chains).band, facts.options.fine_band);
}

TEST_F(Plans, EndWithTheEstimateWhereNothingElseIsAsked) {
  facts.options.correct = false;
  has_estimated();
  EXPECT_TRUE(next().empty());
  EXPECT_EQ(FitPlan(facts).estimate(state.done)->theta, theta(430.0));
}

TEST_F(Plans, EndWhereTheEstimateFails) {
  has_followed();
  has_done(record({StageKind::Fine, 0, 0}, infinite));
  EXPECT_TRUE(next().empty());
  EXPECT_EQ(FitPlan(facts).estimate(state.done), nullptr);
}

/// The last stage in the wide band must gain enough, and not the one in the narrow band; where it does not, nothing
/// follows.
TEST_F(Plans, EndInTheWideBandWhereTheLimitIsNotReached) {
  facts.limits.wide_band_cost = 1.7;
  has_followed();
  const std::vector<StageChain> chains = next();
  ASSERT_EQ(chains.size(), 1u);
  const StageChain& chain = chains.front();
  ASSERT_EQ(chain.size(), 2u);
  EXPECT_EQ(chain[0].give_up_above, 1.7);
  EXPECT_EQ(chain[1].give_up_above, infinite);
  has_done(record(chain[0].id, 2.0));
  EXPECT_FALSE(next().empty());
  state.done.back().succeeded = false;
  EXPECT_TRUE(next().empty());
}

TEST_F(Plans, CorrectWhatTheTestFinds) {
  has_estimated();
  const auto tests = next();
  EXPECT_EQ(only(tests).id.kind, StageKind::Test);
  EXPECT_EQ(only(tests).from.front(), theta(430.0));
  StageRecord test = record({StageKind::Test}, 1.5, 430.0);
  state.done.push_back(test);
  EXPECT_TRUE(next().empty()) << "nothing to correct";
  state.done.back().corrected = {"range_error@front"};
  const auto chains = next();
  const Stage& corrected = only(chains);
  EXPECT_EQ(corrected.id.kind, StageKind::Corrected);
  EXPECT_THAT(corrected.free, testing::Contains("range_error@front"));
  EXPECT_EQ(corrected.from.front(), theta(430.0));
  EXPECT_EQ(corrected.iterations_before, 6);
  EXPECT_TRUE(FitPlan(facts).estimated(state.done).find("range_error@front")->estimated);
  has_done(record(corrected.id, 1.0, 440.0));
  EXPECT_TRUE(next().empty());
  EXPECT_EQ(FitPlan(facts).estimate(state.done)->theta, theta(440.0));
}

TEST_F(Plans, RepeatTheEstimateFinerOneAfterTheOther) {
  facts.options.correct = false;
  facts.repetitions = {{12.0, 2.0}, {18.0, 1.0}};
  has_estimated();
  const auto first = next();
  EXPECT_EQ(only(first).name, "2 x steps");
  EXPECT_EQ(only(first).from.front(), theta(430.0));
  has_done(record({StageKind::Finer, 0, 0}, 1.4, 432.0));
  const auto second = next();
  EXPECT_EQ(only(second).name, "18 cells");
  EXPECT_EQ(only(second).from.front(), theta(432.0));
  EXPECT_GT(only(second).done_from, only(first).done_from);
  has_done(record({StageKind::Finer, 0, 1}, infinite));
  EXPECT_TRUE(next().empty());
}

TEST_F(Plans, EstimateOffTheScanUntilItsErrorsAreNotWorthIt) {
  facts.options.correct = false;
  facts.looks_at_scan_errors = true;
  facts.repetitions = {{18.0, 1.0}};
  facts.alternatives = {{"mesh", 1.0 / 1.5, 1.0, {}, false, 0.8}};
  has_estimated();
  const auto looks = next();
  EXPECT_EQ(only(looks).id, (StageId{StageKind::ScanErrors}));
  EXPECT_EQ(only(looks).change, ModelChange{});
  StageRecord look = record(only(looks).id, 1.5, 460.0);
  look.converged = true, look.scan_errors = {-1.0, 0.5};
  has_done(look);
  const auto estimates = next();
  const Stage& off = only(estimates);
  EXPECT_EQ(off.id, (StageId{StageKind::OffScan}));
  EXPECT_EQ(off.change.scan_errors, look.scan_errors);
  EXPECT_THAT(off.from, ElementsAre(theta(430.0), theta(460.0))) << "where it is, and where the step leads";
  EXPECT_DOUBLE_EQ(off.give_up_above, 1.5 - 0.5 * (1.0 + 0.25)) << "what the errors are worth by themselves";
  EXPECT_EQ(off.promise_tolerance, 0.5) << "another look follows";
  const PassState before = state;
  has_done(record(off.id, infinite));
  EXPECT_EQ(only(next()).name, "18 cells") << "the estimate on the scan stands";
  EXPECT_EQ(only(next()).change, ModelChange{});
  state = before;
  StageRecord ended = record(off.id, 0.5, 450.0);
  ended.scan_errors = look.scan_errors;
  has_done(ended);
  const auto again = next();
  EXPECT_EQ(only(again).id, (StageId{StageKind::ScanErrors, 0, 1}));
  EXPECT_EQ(only(again).from.front(), theta(450.0));
  EXPECT_EQ(only(again).change.scan_errors, look.scan_errors);
  const PassState looked_once = state;
  look.id = only(again).id, look.scan_errors = {-1.5, 0.25};
  has_done(look);
  const auto last = next();
  EXPECT_EQ(only(last).id, (StageId{StageKind::OffScan, 0, 1}));
  EXPECT_EQ(only(last).promise_tolerance, Stage().promise_tolerance);
  StageRecord best = record(only(last).id, 0.3, 455.0);
  best.scan_errors = look.scan_errors;
  has_done(best);
  EXPECT_EQ(only(next()).name, "18 cells") << "two estimates off the scan, and no third look";
  EXPECT_EQ(only(next()).change.scan_errors, look.scan_errors);
  state = looked_once, look.scan_errors = {-1.0, 0.5};
  has_done(record(only(again).id, 0.5));
  EXPECT_EQ(only(next()).change.scan_errors, look.scan_errors) << "of the finer mesh";
  EXPECT_EQ(only(next()).from.front(), theta(450.0));
  has_done(record({StageKind::Finer, 0, 0}, 0.4, 455.0));
  EXPECT_EQ(only(next()).id.kind, StageKind::Alternative);
  EXPECT_EQ(only(next()).change.scan_errors, look.scan_errors);
}

TEST_F(Plans, RepeatTheEstimateByNeed) {
  facts.options.correct = false;
  facts.repetitions = {{18.0, 1.0}, {27.0, 1.0}};
  facts.repeats_by_need = true;
  facts.alternatives = {{"mesh", 1.0 / 1.5, 1.0, {}, false, 0.8}};
  has_estimated();
  EXPECT_EQ(only(next()).id.kind, StageKind::Alternative);
  has_done(record({StageKind::Alternative, 0, 0}, 1.5));
  const auto asked = next();
  EXPECT_EQ(only(asked).id.kind, StageKind::Resolution);
  EXPECT_EQ(only(asked).grid.cells, facts.options.cells);
  StageRecord answer = record(only(asked).id, 0.0);
  answer.converged = true;
  has_done(answer);
  const auto finer = next();
  EXPECT_EQ(only(finer).name, "18 cells");
  EXPECT_EQ(only(finer).from.front(), theta(430.0));
  has_done(record(only(finer).id, 1.3, 433.0));
  const auto again = next();
  EXPECT_EQ(only(again).id.number, 1) << "the alternatives are not tried anew";
  EXPECT_EQ(only(again).grid.cells, 18.0);
  answer.id = only(again).id;
  has_done(answer);
  EXPECT_EQ(only(next()).name, "27 cells");
  has_done(record({StageKind::Finer, 0, 1}, infinite));
  EXPECT_TRUE(next().empty());
}

TEST_F(Plans, DoNotRepeatWhatIsNotNeeded) {
  facts.options.correct = false;
  facts.repetitions = {{18.0, 1.0}};
  facts.repeats_by_need = true;
  has_estimated();
  has_done(record(only(next()).id, 0.0));
  EXPECT_TRUE(next().empty());
}

TEST_F(Plans, LookForPullsAnewOnEveryGrid) {
  ParameterLayout layout = facts.parameters.layout();
  std::vector<Parameter> list = facts.parameters.parameters();
  Parameter pull;
  pull.name = "pull@1", pull.unit = "N", pull.transform = Transform::Vector, pull.estimated = pull.is_auxiliary = true;
  pull.at = layout.add({"pull@1", "N", 3, Role::Initial});
  pull.prior_mean = Vector3::Zero();
  list.push_back(pull);
  VectorX reference = facts.parameters.reference();
  reference.conservativeResize(layout.size());
  reference.tail<3>() = Vector3(1.0, 2.0, 3.0);
  facts.parameters = ParameterSet(layout, list, reference);
  facts.repetitions = {{18.0, 1.0}};
  facts.options.correct = false, facts.swings = true;
  has_scanned();
  for (const int start : {0, 1}) has_done(record({StageKind::Coarse, start, 0}, 2.0 + start, 415.0 + 4e4 * start));
  const auto followed = next();
  ASSERT_EQ(followed[0].size(), 3u);
  for (const Stage& stage : followed[0]) {
    EXPECT_EQ(stage.pose_of, (StageId{StageKind::Motion, 0, 1})) << "in which it was held at first";
    EXPECT_FALSE(stage.by_pose);
    EXPECT_THAT(stage.free, UnorderedElementsAre("youngs_modulus", "linear_velocity"));
  }
  state.done.clear();
  has_followed();
  for (const int number : {2, 3})
    for (const int start : {0, 1}) has_done(record({StageKind::Coarse, start, number}, 2.0, 415.0));
  const auto chains = next();
  ASSERT_EQ(chains[0].size(), 5u);
  const Stage& pulls = only(chains);
  EXPECT_EQ(pulls.id.kind, StageKind::Pulls);
  EXPECT_THAT(pulls.free, ElementsAre("pull@1"));
  EXPECT_EQ(pulls.horizon.until, Horizon::Until::Start);
  ASSERT_EQ(pulls.from.size(), 2u) << "from those at hand and from none";
  EXPECT_EQ(pulls.from[0].tail<3>(), Vector3(1.0, 2.0, 3.0));
  EXPECT_EQ(pulls.from[1].tail<3>(), Vector3(0.0, 0.0, 0.0));
  for (std::size_t i = 1; i + 1 < chains[0].size(); ++i)
    EXPECT_THAT(chains[0][i].free, testing::Not(testing::Contains("poissons_ratio")))
        << "it would make up for what others lack";
  EXPECT_THAT(chains[0].back().free, testing::Contains("poissons_ratio"));
  for (std::size_t i = 1; i < chains[0].size(); ++i)  // over the first swing, and at last together with all else
    EXPECT_EQ(std::ranges::count(chains[0][i].free, "pull@1"), i == 2 ? 0 : 1) << i;
  for (const Stage& stage : chains[0]) has_done(record(stage.id, 1.0, 430.0));
  const auto finer = next();
  ASSERT_EQ(finer[0].size(), 2u);
  EXPECT_EQ(only(finer).id.kind, StageKind::Pulls);
  EXPECT_EQ(only(finer).grid.cells, 18.0);
  facts.repetitions.clear();
  facts.alternatives = {{"mesh", 0.5, 1.0, {}, false, 0.8},
                        {"time step", 1.0, 0.5, {}, false, 0.6},
                        {"law", 0.5, 1.0, {.small_strain = true}, false, 0.5, true},
                        {"what is given", 0.5, 1.0, {}, true, 1.0}};
  const auto others = next();
  const auto numbers = [](const std::vector<StageChain>& of) {
    std::vector<int> all;
    for (const StageChain& chain : of)
      for (const Stage& stage : chain) all.push_back(stage.id.number);
    return all;
  };
  EXPECT_THAT(numbers(others), ElementsAre(0, 1, 3)) << "the law waits for the mesh that it shares";
  for (const StageChain& chain : others) EXPECT_THAT(chain.front().free, testing::Contains("pull@1"));
  has_done(record(others[0].front().id, 1.0, 440.0));
  const auto left = next();
  EXPECT_THAT(numbers(left), ElementsAre(1, 2, 3));
  EXPECT_EQ(left[1].front().from.front()[facts.moduli[0]], 440.0) << "from where that ended";
  EXPECT_EQ(left[0].front().from.front()[facts.moduli[0]], 430.0);
}

TEST_F(Plans, BegunFromAnotherFitLookAgainAtTheLastStage) {
  has_estimated();
  has_done(record({StageKind::Test}, 1.5));
  has_done(record({StageKind::Alternative, 0, 0}, 1.5));
  has_done(record({StageKind::Resolution, 0, 0}, 0.0));
  state = begun_from(state);
  for (const StageRecord& r : state.done)
    EXPECT_TRUE(r.id.kind != StageKind::Alternative && r.id.kind != StageKind::Resolution) << "of the other fit";
  ASSERT_TRUE(state.begin);
  EXPECT_EQ(state.begin->theta, theta(430.0));
  state.begin->theta = theta(500.0);
  const auto chains = next();
  ASSERT_EQ(chains[0].size(), 1u);
  EXPECT_EQ(only(chains).id, (StageId{StageKind::Fine, 0, 1}));
  EXPECT_EQ(only(chains).from.front(), theta(500.0));
  has_done(record({StageKind::Fine, 0, 1}, 1.2, 510.0));
  EXPECT_TRUE(next().empty()) << "what was tested is not tested again";
  EXPECT_EQ(FitPlan(facts).starts(state.done).size(), 2u);
}

TEST_F(Plans, BegunFromACorrectedFitGoOnWithItsCorrections) {
  has_estimated();
  has_done(record({StageKind::Test}, 1.5, 430.0));
  state.done.back().corrected = {"range_error@front"};
  has_done(record({StageKind::Corrected, 0, 2}, 1.0, 440.0));
  state = begun_from(state);
  const auto chains = next();
  EXPECT_EQ(only(chains).id, (StageId{StageKind::Corrected, 0, 2}));
  EXPECT_EQ(only(chains).from.front(), theta(440.0));
  state.begin->stage = 0;
  const auto all = next();
  ASSERT_EQ(all[0].size(), 2u);
  EXPECT_THAT(all[0].front().free, testing::Contains("range_error@front"));
}

TEST_F(Plans, BegunFromAFitOffTheScanStayOffItAndLookAnew) {
  facts.looks_at_scan_errors = true;
  const std::vector<double> errors = {-1.0, 0.5};
  has_estimated();
  has_done(record({StageKind::Test}, 1.5, 430.0));
  state.done.back().corrected = {"range_error@front"};
  has_done(record({StageKind::Corrected, 0, 2}, 1.0, 440.0));
  has_done(record({StageKind::ScanErrors}, 1.0, 450.0));
  has_done(record({StageKind::OffScan}, 0.5, 460.0));
  state.done.back().scan_errors = errors;
  state = begun_from(state);
  EXPECT_EQ(state.begin->scan_errors, errors);
  state.begin->stage = 1;
  const auto chains = next();
  EXPECT_EQ(only(chains).id, (StageId{StageKind::Fine, 0, 1}));
  EXPECT_EQ(only(chains).from.front(), theta(460.0));
  EXPECT_EQ(only(chains).change.scan_errors, errors);
  has_done(record({StageKind::Fine, 0, 1}, 0.4, 470.0));
  state.done.back().scan_errors = errors;
  EXPECT_EQ(only(next()).id.kind, StageKind::Corrected);
  EXPECT_EQ(only(next()).change.scan_errors, errors);
  EXPECT_EQ(FitPlan(facts).last_look(state).change.scan_errors, errors);
  has_done(record({StageKind::Corrected, 0, 2}, 0.3, 480.0));
  state.done.back().scan_errors = errors;
  EXPECT_EQ(only(next()).id, (StageId{StageKind::ScanErrors}));
  EXPECT_EQ(only(next()).change.scan_errors, errors) << "the differences are taken about the surface at hand";
}

TEST_F(Plans, LookOnceAtWhatWasReachedWhereTheyAreInterrupted) {
  has_moved();
  Stage look = FitPlan(facts).last_look(state);
  EXPECT_EQ(look.id, (StageId{StageKind::Fine, 0, 1}));
  EXPECT_EQ(look.band, facts.options.fine_band);
  state = {};
  has_followed();
  EXPECT_EQ(FitPlan(facts).last_look(state).from.front(), theta(411.0));
  has_done(record({StageKind::Fine, 0, 0}, 2.0, 420.0));
  EXPECT_EQ(FitPlan(facts).last_look(state).from.front(), theta(420.0));
}

}  // namespace
}  // namespace pliant::fit_plan_test
