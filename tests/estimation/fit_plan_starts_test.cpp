// Plans are functions of what was done: no simulation is needed to see what comes next.
#include "estimation/fit_plan.hpp"
#include "support/plans.hpp"

namespace pliant::fit_plan_starts_test {
namespace {

using test::Plans;
using testing::ElementsAre;
using testing::UnorderedElementsAre;

TEST_F(Plans, ScanWhereNoSwingWasSeen) {
  has_moved();
  EXPECT_EQ(only(next()).id.kind, StageKind::Swing);
  has_done(record({StageKind::Swing}, 0.0));
  const auto chains = next();
  const Stage& scan = only(chains);
  EXPECT_EQ(scan.id.kind, StageKind::Scan);
  ASSERT_EQ(scan.trials.size(), 9u) << "four decades, two values each";
  EXPECT_DOUBLE_EQ(scan.trials.front(), 200.0 * 10.0 * 0.1) << "the stress under its own weight";
  EXPECT_NEAR(scan.trials.back() / scan.trials.front(), 1e4, 1e-8);
}

/// Starts differ by how floors rub where nobody said it.
TEST_F(Plans, ScanFrictionAlongWhereNobodySaidIt) {
  const ParameterHandle friction = facts.parameters.find("range_error@front")->at;  // any number will do
  facts.frictions = {friction};
  has_moved();
  has_done(record({StageKind::Swing}, 0.0));
  const auto chains = next();
  const Stage& slides = only(chains);
  EXPECT_EQ(slides.id, (StageId{StageKind::Scan}));
  StageRecord scan = record(slides.id, 0.0);
  scan.trials = {{2e2, 7.0}, {4e2, 5.0}, {4e3, 6.0}};
  has_done(scan);
  const auto more = next();
  const Stage& sticks = only(more);
  EXPECT_EQ(sticks.id, (StageId{StageKind::Scan, 0, 1}));
  EXPECT_EQ(sticks.trials, slides.trials);
  EXPECT_GT(sticks.from.front()[friction], slides.from.front()[friction]);
  scan.id = sticks.id;
  scan.trials = {{2e2, 7.0}, {4e2, 6.0}, {4e3, 3.0}};
  has_done(scan);
  const auto starts = next();
  ASSERT_GE(starts.size(), 2u);
  EXPECT_EQ(starts[0].front().from.front()[friction], sticks.from.front()[friction]);
  EXPECT_EQ(starts[0].front().from.front()[facts.moduli.front()], 4e3);
  EXPECT_EQ(starts[1].front().from.front()[friction], slides.from.front()[friction]);
  EXPECT_EQ(starts[1].front().from.front()[facts.moduli.front()], 4e2);
}

TEST_F(Plans, ScanFromTheSoftestThatMayHoldItselfUp) {
  facts.softest = 7e3;
  has_moved();
  has_done(record({StageKind::Swing}, 0.0));
  const auto chains = next();
  EXPECT_DOUBLE_EQ(only(chains).trials.front(), 7e3);
}

TEST_F(Plans, DrawGravityWhereItIsNotKnown) {
  facts.options.most_starts = 4;
  facts.parameters.set_estimated("gravity", true);
  has_followed();
  for (StageRecord& r : state.done) r.misfit = 9.0;
  const std::vector<StageChain> drawn = next();
  ASSERT_EQ(drawn.size(), 2u);
  const VectorX &first = drawn[0][0].from.front(), &second = drawn[1][0].from.front();
  const Vector3 change = facts.gravity.vector(first) - facts.gravity.vector(facts.parameters.reference());
  for (int d = 0; d < 3; ++d) {
    EXPECT_NE(change[d], 0.0);
    EXPECT_LT(std::abs(change[d]), 40.0) << "four deviations of the prior";
    EXPECT_NE(facts.gravity.vector(first)[d], facts.gravity.vector(second)[d]);
  }
  EXPECT_EQ(first[facts.density], facts.parameters.reference()[facts.density]) << "given";
}

TEST_F(Plans, DrawStartsWhileTheBestDoesNotFit) {
  facts.options.most_starts = 5;
  has_followed();
  for (StageRecord& r : state.done) r.misfit = 9.0;
  const std::vector<StageChain> drawn = next();
  ASSERT_EQ(drawn.size(), 2u) << "two more";
  for (std::size_t i = 0; i < drawn.size(); ++i) {
    ASSERT_EQ(drawn[i].size(), 1u) << "over the first frames alone";
    EXPECT_EQ(drawn[i][0].id, (StageId{StageKind::Coarse, 2 + int(i), 0}));
    const double modulus = drawn[i][0].from.front()[facts.moduli[0]];
    EXPECT_GT(modulus, 400.0 / 6.0);
    EXPECT_LT(modulus, 4e4 * 6.0);
  }
  EXPECT_NE(drawn[0][0].from.front(), drawn[1][0].from.front());
  EXPECT_EQ(next()[0][0].from.front(), drawn[0][0].from.front()) << "the same again";
  // One leads nowhere in the first frames, one is as good as the best.
  has_done(record({StageKind::Coarse, 2, 0}, 50.0));
  has_done(record({StageKind::Coarse, 3, 0}, 2.0, 9e3));
  const std::vector<StageChain> on = next();
  ASSERT_EQ(on.size(), 1u);
  EXPECT_EQ(on[0][0].id, (StageId{StageKind::Coarse, 3, 1}));
  EXPECT_EQ(on[0][0].from.front(), theta(9e3));
  StageRecord good = record({StageKind::Coarse, 3, 1}, 1.0, 9.1e3);
  good.misfit = 1.2;
  has_done(good);
  const std::vector<StageChain> fine = next();
  EXPECT_EQ(only(fine).id.kind, StageKind::Fine) << "no more are needed";
  EXPECT_EQ(only(fine).from.front(), theta(9.1e3));
  EXPECT_EQ(FitPlan(facts).starts(state.done).size(), 4u);
}

TEST_F(Plans, DrawNoMoreStartsThanAreAllowed) {
  facts.options.most_starts = 3;
  has_followed();
  for (StageRecord& r : state.done) r.misfit = 9.0;
  ASSERT_EQ(next().size(), 1u);
  has_done(record({StageKind::Coarse, 2, 0}, infinite));
  EXPECT_EQ(only(next()).id.kind, StageKind::Fine);
}

TEST_F(Plans, BeginAnewWithADampingThatTheCoarseGridTookForNone) {
  ParameterLayout layout = facts.parameters.layout();
  std::vector<Parameter> list = facts.parameters.parameters();
  Parameter damping;
  damping.name = "stiffness_damping", damping.unit = "s", damping.estimated = true;
  damping.at = layout.add({damping.name, damping.unit, 1, Role::Damping});
  list.push_back(damping);
  VectorX began(layout.size());
  began << facts.parameters.reference(), 3e-3;
  facts.parameters = ParameterSet(layout, list, began);
  has_followed();
  for (const auto& [ended, begins] : {std::pair{1e-6, 3e-4}, std::pair{2e-4, 2e-4}, std::pair{9e-3, 9e-3}}) {
    for (StageRecord& r : state.done) r.theta[damping.at] = ended;
    EXPECT_EQ(only(next()).id.kind, StageKind::Fine);
    EXPECT_DOUBLE_EQ(only(next()).from.front()[damping.at], begins);
  }
}

TEST_F(Plans, BeginAtTheSwingThatWasSeen) {
  has_moved();
  StageRecord swing = record({StageKind::Swing}, 0.0, 5e3);
  swing.converged = true;
  has_done(swing);
  const auto anew = next();
  EXPECT_EQ(only(anew).id, (StageId{StageKind::Motion, 0, 2})) << "the motion is looked for anew";
  EXPECT_EQ(only(anew).from.front(), theta(5e3));
  has_done(record({StageKind::Motion, 0, 2}, 9.0, 5e3));
  has_done(record({StageKind::Motion, 0, 3}, 8.0, 5e3));
  const auto chains = next();
  const Stage& start = only(chains);
  EXPECT_EQ(start.id, (StageId{StageKind::Coarse, 0, 0}));
  EXPECT_EQ(start.from.front(), theta(5e3));
  EXPECT_EQ(FitPlan(facts).start_theta(state.done), theta(5e3));
}

TEST_F(Plans, LookAtTheFirstFramesWhereSeveralModuliSwing) {
  const auto horizons = [&] {
    std::vector<double> parts;
    for (const StageChain& chain : next())
      for (const Stage& stage : chain) parts.push_back(stage.horizon.part);
    return parts;
  };
  facts.swings = true, facts.is_scanned = false;
  has_moved();
  StageRecord swing = record({StageKind::Swing}, 0.0, 5e3);
  swing.converged = true;
  has_done(swing);
  has_done(record({StageKind::Motion, 0, 2}, 9.0, 5e3));
  has_done(record({StageKind::Motion, 0, 3}, 8.0, 5e3));
  EXPECT_THAT(horizons(), ElementsAre(0.12, 0.25, 0.5, 1.0));
  EXPECT_FALSE(next()[0][0].tries_moduli) << "the swing has told the one there is";
  facts.moduli.push_back(facts.moduli.front());
  facts.relative_moduli = VectorX::Ones(2);
  EXPECT_THAT(horizons(), ElementsAre(0.04, 0.07, 0.12, 0.25, 0.5, 1.0));
  const StageChain chain = next()[0];
  for (std::size_t i = 0; i < chain.size(); ++i) EXPECT_EQ(chain[i].tries_moduli, i == 0) << i;
  facts.options.span = 0.2;
  EXPECT_THAT(horizons(), ElementsAre(0.04, 0.07, 0.12, 1.0)) << "no stage of frames that are not compared";
  EXPECT_EQ(next()[0].back().id, chain.back().id) << "numbers do not depend on the span";
}

TEST_F(Plans, BeginWhereTheUserSays) {
  facts.is_scanned = false;
  has_moved();
  const auto chains = next();
  const Stage& start = only(chains);
  EXPECT_EQ(start.id, (StageId{StageKind::Coarse, 0, 0}));
  EXPECT_EQ(start.from.front(), facts.parameters.reference());
}

TEST_F(Plans, FollowTheBestValleyOfAScanBeforeTheOthers) {
  has_scanned();
  const auto chains = next();
  ASSERT_EQ(chains.size(), 2u);
  EXPECT_EQ(chains[0].front().from.front(), theta(4e2));
  EXPECT_EQ(chains[1].front().from.front(), theta(4e4));
  for (const StageChain& chain : chains) {
    ASSERT_EQ(chain.size(), 1u) << "over the first frames";
    EXPECT_THAT(chain[0].free, UnorderedElementsAre("youngs_modulus", "linear_velocity"));
    EXPECT_LT(chain[0].horizon.part, 1.0);
  }
  has_done(record({StageKind::Coarse, 0, 0}, 2.5, 410.0));
  ASSERT_EQ(next().size(), 1u) << "the others before any goes on";
  EXPECT_EQ(next()[0][0].id, (StageId{StageKind::Coarse, 1, 0}));
  has_done(record({StageKind::Coarse, 1, 0}, 3.5, 4.1e4));
  EXPECT_EQ(only(next()).id, (StageId{StageKind::Coarse, 0, 1})) << "the best over the first frames";
  has_done(record({StageKind::Coarse, 0, 1}, 2.6, 420.0));
  const auto on = next();
  EXPECT_EQ(only(on).id, (StageId{StageKind::Coarse, 1, 1}));
  ASSERT_EQ(on[0].size(), 1u);
  EXPECT_THAT(only(on).free, UnorderedElementsAre("youngs_modulus", "linear_velocity"));
  EXPECT_EQ(only(on).horizon.part, 1.0);
  EXPECT_EQ(only(on).from.front(), theta(4.1e4));
  EXPECT_EQ(FitPlan(facts).start_theta(state.done), theta(4e2));
}

TEST_F(Plans, StopAStartInTheValleyOfOneThatHasEnded) {
  has_scanned();
  has_done(record({StageKind::Coarse, 0, 0}, 2.5, 410.0));
  has_done(record({StageKind::Coarse, 1, 0}, 3.5, 4.1e4));
  has_done(record({StageKind::Coarse, 0, 1}, 2.6, 420.0));
  const FitPlan plan(facts);
  const Stage stage = only(next());
  ASSERT_EQ(stage.id, (StageId{StageKind::Coarse, 1, 1}));
  EXPECT_EQ(plan.joined_on_the_way(stage, theta(500.0), 3.5, state.done), std::optional(0));
  EXPECT_FALSE(plan.joined_on_the_way(stage, theta(500.0), 2.5, state.done)) << "it is the better one";
  EXPECT_FALSE(plan.joined_on_the_way(stage, theta(500.0), 6.0, state.done)) << "far above";
  EXPECT_FALSE(plan.joined_on_the_way(stage, theta(900.0), 3.5, state.done)) << "elsewhere";
  Stage first = stage;
  first.horizon.part = 0.6;
  EXPECT_FALSE(plan.joined_on_the_way(first, theta(500.0), 3.5, state.done)) << "of fewer frames";
  VectorX thrown = theta(500.0);
  thrown[facts.parameters.find("range_error@front")->at] = 5.0;
  EXPECT_EQ(plan.joined_on_the_way(stage, thrown, 3.5, state.done), std::optional(0)) << "sensors tell no valleys";
  facts.swings = true;
  EXPECT_FALSE(FitPlan(facts).joined_on_the_way(stage, theta(500.0), 3.5, state.done)) << "swings may be out of step";
  facts.swings = false;
  StageRecord stopped = record({StageKind::Coarse, 1, 1}, 3.4, 550.0);
  stopped.joined = 0, stopped.reason = "came into the valley of start 1";
  has_done(stopped);
  EXPECT_EQ(only(next()).id.kind, StageKind::Fine);
  const std::vector<FitStart> starts = plan.starts(state.done);
  EXPECT_EQ(starts[1].cost, 2.6) << "that of the one it joined";
  EXPECT_EQ(starts[1].final, theta(420.0));
  EXPECT_THAT(starts[1].reason, testing::HasSubstr("start 1"));
}

TEST_F(Plans, GiveUpAStartThatLeadsNowhere) {
  has_scanned();
  has_done(record({StageKind::Coarse, 0, 0}, 20.0, 410.0));
  has_done(record({StageKind::Coarse, 1, 0}, 2.0, 4.1e4));
  EXPECT_EQ(only(next()).id, (StageId{StageKind::Coarse, 1, 1}));
  has_done(record({StageKind::Coarse, 1, 1}, 30.0, 4e4));
  EXPECT_EQ(only(next()).id.start, 1) << "costs over fewer frames are not compared with those over all";
  const std::vector<FitStart> starts = FitPlan(facts).starts(state.done);
  EXPECT_EQ(starts[0].cost, infinite);
  EXPECT_THAT(starts[0].reason, testing::HasSubstr("10"));
  EXPECT_EQ(starts[1].cost, 30.0);
}

TEST_F(Plans, FollowOneOfTwoStartsThatLeadToTheSamePlace) {
  has_scanned();
  has_done(record({StageKind::Coarse, 0, 0}, 2.02, 9e3));
  has_done(record({StageKind::Coarse, 1, 0}, 2.0, 1.1e4));
  EXPECT_EQ(only(next()).id, (StageId{StageKind::Coarse, 1, 1}));
  has_done(record({StageKind::Coarse, 1, 1}, 4.0, 1e4));
  EXPECT_EQ(only(next()).id.kind, StageKind::Fine);
  const std::vector<FitStart> starts = FitPlan(facts).starts(state.done);
  EXPECT_EQ(starts[0].cost, 4.0) << "that of the one it joined";
  EXPECT_THAT(starts[0].reason, testing::HasSubstr("start 2"));
  // Two that cost the same in other places are both followed.
  state.done.clear();
  has_scanned();
  has_done(record({StageKind::Coarse, 0, 0}, 2.02, 5e3));
  has_done(record({StageKind::Coarse, 1, 0}, 2.0, 1.1e4));
  EXPECT_EQ(only(next()).id, (StageId{StageKind::Coarse, 1, 1}));
  has_done(record({StageKind::Coarse, 1, 1}, 4.0, 1e4));
  EXPECT_EQ(only(next()).id, (StageId{StageKind::Coarse, 0, 1}));
}

TEST_F(Plans, LeaveOutTheWideBandWhereTheBestStartExplainsWhatWasSeen) {
  has_followed();
  EXPECT_EQ(next()[0].size(), 2u);
  state.done.back().misfit = state.done[state.done.size() - 2].misfit = 1.2;
  ASSERT_EQ(next()[0].size(), 1u);
  EXPECT_EQ(only(next()).band, facts.options.fine_band);
  facts.swings = true;
  EXPECT_GT(next()[0].size(), 1u) << "swings may be out of step";
}

TEST_F(Plans, OfObjectsThatSwingLookAtThemLongerAndLonger) {
  facts.swings = true;
  has_scanned();
  has_done(record({StageKind::Coarse, 0, 0}, 2.5, 410.0));
  has_done(record({StageKind::Coarse, 1, 0}, 3.5, 4.1e4));
  for (const StageChain& chain : next()) {
    ASSERT_EQ(chain.size(), 3u);
    for (std::size_t i = 1; i < chain.size(); ++i) EXPECT_GT(chain[i].horizon.part, chain[i - 1].horizon.part);
  }
}

TEST_F(Plans, LeaveOutAStartThatFailed) {
  has_scanned();
  has_done(record({StageKind::Coarse, 0, 0}, infinite));
  const auto chains = next();
  EXPECT_EQ(only(chains).id, (StageId{StageKind::Coarse, 1, 0})) << "the other one goes on";
  has_done(record({StageKind::Coarse, 1, 0}, 4.0));
  has_done(record({StageKind::Coarse, 1, 1}, 3.9, 3e4));
  const auto fine = next();
  EXPECT_EQ(only(fine).id.start, 1);
  EXPECT_EQ(only(fine).from.front(), theta(3e4));
  const std::vector<FitStart> starts = FitPlan(facts).starts(state.done);
  EXPECT_EQ(starts[0].cost, infinite);
  EXPECT_EQ(starts[1].cost, 3.9);
  EXPECT_EQ(starts[1].iterations, 6);
}

TEST(BestOfScans, AreValleysFirst) {
  const std::vector<std::pair<double, double>> trials = {{1.0, 3.0}, {2.0, 1.0}, {3.0, 1.5}, {4.0, 2.0}, {5.0, 1.9}};
  using S = ScannedStart;
  EXPECT_THAT(best_of_scans({trials}, 2), ElementsAre(S{0, 2.0}, S{0, 5.0}))
      << "a neighbour of the lowest leads to the same place";
  EXPECT_THAT(best_of_scans({trials}, 3), ElementsAre(S{0, 2.0}, S{0, 5.0}, S{0, 3.0}));
}

TEST(BestOfScans, LeaveOutWhatIsHopelessAndWhatCannotBeSimulated) {
  EXPECT_THAT(best_of_scans({{{1.0, 1.0}, {2.0, 9.0}, {3.0, 4.5}}}, 3), ElementsAre(ScannedStart{0, 1.0}));
  EXPECT_THAT(best_of_scans({{{1.0, infinite}, {2.0, infinite}}}, 3), ElementsAre());
}

TEST(BestOfScans, AreTheBestOfAll) {
  EXPECT_THAT(best_of_scans({{{1.0, 5.0}, {2.0, 6.0}}, {{1.0, 4.0}, {2.0, 3.0}}}, 2),
              ElementsAre(ScannedStart{1, 2.0}, ScannedStart{0, 1.0}))
      << "valleys of each, however low a neighbour in the other";
}

}  // namespace
}  // namespace pliant::fit_plan_starts_test
