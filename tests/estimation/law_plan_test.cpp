// The plan of a search for a law is a function of what was done: no press is simulated to see what comes next.
#include "estimation/law_plan.hpp"

#include <cmath>
#include <functional>

#include "base/error.hpp"
#include "input_errors.hpp"

namespace pliant::law_plan_test {
namespace {

using testing::ElementsAre;

constexpr double noise = 1e-4;

struct LawPlans : testing::Test {
  LawPlans() {
    facts.start_modulus = 1e4, facts.noise = noise, facts.size = 0.2, facts.presses = 6;
    facts.options.alternatives = false;
    answer = [](const Stage&, StageRecord&) {};
  }

  /// A stage that ends where it began, its residuals as large as the noise says for 300 coordinates.
  StageRecord record_of(const Stage& stage) const {
    StageRecord r{stage.id, stage.name, stage.from.front(), stage.from.front()};
    r.succeeded = true, r.cost = 150.0;
    r.law.emplace().noise = stage.law->noise;
    r.law->deviation = noise;
    r.law->track_squares = 300.0 * noise * noise, r.law->observations = 300.0;
    r.law->dimension = facts.parameters({stage.law->shape.form}).dimension();
    if (stage.id.kind == StageKind::Cut || stage.id.kind == StageKind::Move) r.succeeded = false;
    if (stage.id.kind == StageKind::ControlPoints) r.law->evidence = -1.0, r.law->points = {Vector3::Zero()};
    answer(stage, r);
    return r;
  }
  /// All stages to the end, by their names.
  std::vector<std::string> names() {
    std::vector<std::string> all;
    const LawPlan plan(facts);
    done.clear();
    for (end = plan.after(done); end.next && all.size() < 60; end = plan.after(done)) {
      all.push_back(end.next->name);
      done.push_back(record_of(*end.next));
    }
    return all;
  }

  LawFacts facts;
  std::function<void(const Stage&, StageRecord&)> answer;
  std::vector<StageRecord> done;
  LawPlan::Standing end;
};

TEST_F(LawPlans, KeepOneTermWhereNothingElseIsWorthIt) {
  EXPECT_THAT(names(), ElementsAre("1 term", "2 terms", "2 zones", "4 control points", "8 control points",
                                   "16 control points", "32 control points"));
  ASSERT_TRUE(end.best);
  EXPECT_EQ(end.best->shape.form.terms, 1);
  EXPECT_EQ(end.tried.size(), 7u);
  EXPECT_EQ(end.noise, noise);
  // Without a better fit half the BIC falls by ln(n) / 2 for each of two numbers more.
  EXPECT_NEAR(end.tried[1].evidence, -std::log(300.0), 1e-9);
}

TEST_F(LawPlans, ATermIsKeptByHalfTheBic) {
  double gain = 0.0;
  answer = [&](const Stage& stage, StageRecord& r) {
    if (stage.name == "2 terms") r.law->track_squares *= std::exp(-2.0 * gain / 300.0);
  };
  for (const bool is_enough : {false, true}) {
    gain = std::log(300.0) + (is_enough ? 3.1 : 2.9);
    const std::vector<std::string> all = names();
    EXPECT_NEAR(end.tried[1].evidence, is_enough ? 3.1 : 2.9, 1e-9);
    EXPECT_EQ(end.tried[1].kept, is_enough);
    EXPECT_EQ(end.best->shape.form.terms, is_enough ? 2 : 1);
    EXPECT_EQ(std::ranges::count(all, "2 terms apart"), is_enough ? 1 : 0);
  }
}

TEST_F(LawPlans, AGivenPoissonsRatioIsNotFreedByTerms) {
  facts.options.parameters["poissons_ratio"] = {VectorX::Constant(1, 0.45), false, {}};
  answer = [](const Stage& stage, StageRecord& r) {
    if (stage.name == "2 terms") r.law->track_squares *= 0.5;
  };
  const std::vector<std::string> all = names();
  EXPECT_EQ(std::ranges::count(all, "2 terms apart"), 0);
  EXPECT_EQ(done.front().theta[end.best->layout.poissons_ratio()], 0.45);
}

TEST_F(LawPlans, LawsOfTwoNumbersAreFittedOnce) {
  for (const MaterialKind material : {MaterialKind::Linear, MaterialKind::NeoHookean}) {
    facts.options.material = material;
    EXPECT_THAT(names(), ElementsAre(material == MaterialKind::Linear ? "linear" : "neo-Hookean"));
    EXPECT_EQ(end.best->shape.form.terms, 0);
  }
}

TEST_F(LawPlans, CurvesScaleTheModuliFirstAndTryBothSignsOfTheExponent) {
  facts.has_curves = true, facts.options.law_terms = 1;
  std::vector<double> exponents;
  answer = [&](const Stage& stage, StageRecord& r) {
    if (stage.id.kind == StageKind::Scale) r.theta[0] = 5e3;
    if (stage.name != "1 term" || stage.id.kind != StageKind::Law) return;
    EXPECT_EQ(stage.from.front()[0], 5e3) << "begins with the scaled modulus";
    exponents.push_back(stage.from.front()[facts.layout({}).exponent(0)]);
    if (exponents.size() == 2) r.law->track_squares *= 0.9;
  };
  const std::vector<std::string> all = names();
  ASSERT_EQ(exponents.size(), 2u);
  EXPECT_EQ(exponents[1], -2.0 * exponents[0]);
  EXPECT_EQ(end.best->theta[facts.layout({}).exponent(0)], exponents[1]) << "the better one is kept";
  EXPECT_EQ(done[0].id.kind, StageKind::Scale);
}

TEST_F(LawPlans, ASecondTermBeginsInTwoValleysWhereForcesTell) {
  facts.has_curves = true, facts.options.law_terms = 2, facts.options.law_zones = 1, facts.options.control_points = 1;
  const ParameterHandle second = facts.layout({1, 2}).exponent(1);
  std::vector<double> exponents;
  answer = [&](const Stage& stage, StageRecord& r) {
    if (stage.name != "2 terms") return;
    exponents.push_back(stage.from.front()[second]);
    r.law->track_squares *= exponents.size() == 2 ? 0.8 : 0.9;
  };
  (void)names();
  EXPECT_THAT(exponents, ElementsAre(-6.0, 14.0));
  EXPECT_EQ(end.best->theta[second], 14.0) << "the better one is kept";
}

TEST_F(LawPlans, AlternativesComeLast) {
  facts.options.alternatives = true, facts.options.law_zones = 1, facts.options.control_points = 1;
  answer = [](const Stage& stage, StageRecord& r) {
    if (stage.id.kind == StageKind::Alternative)
      r.shifts = {{"mass", VectorX::Constant(3, 0.1)}}, r.reason = "too coarse";
  };
  EXPECT_THAT(names(), ElementsAre("1 term", "2 terms", "alternatives"));
  ASSERT_EQ(end.shifts.size(), 1U);
  EXPECT_EQ(end.shifts[0].cause, "mass");
  EXPECT_EQ(end.untried, "too coarse");
}

/// A promised cut at 0 that is worth it once; it is moved to 10 mm.
struct TwoZones : LawPlans {
  TwoZones() {
    answer = [this](const Stage& stage, StageRecord& r) {
      if (stage.id.kind == StageKind::Cut && stage.law->shape.cuts.empty())
        r.succeeded = true, r.law->cut = ZoneCut{0, ZoneCut::By::Y, 0.0}, r.law->evidence = 50.0;
      if (stage.id.kind == StageKind::Move && stage.law->shape.cuts[0].at == 0.0)
        r.succeeded = true, r.law->cut = ZoneCut{0, ZoneCut::By::Y, 0.01}, r.law->evidence = 20.0;
      if (stage.id.kind == StageKind::Law && stage.name == "2 zones") {
        const bool is_moved = stage.law->shape.cuts[0].at > 0.0;
        EXPECT_EQ(stage.law->is_brief, is_moved && moves++ == 0);
        r.law->evidence = is_moved ? 60.0 : 40.0;
        r.cost = is_moved ? 100.0 : 120.0;
        r.law->track_squares *= zone_squares;
        r.law->noise = stage.law->is_brief ? stage.law->noise : MarkerNoise(0.9 * noise);
      }
    };
  }
  int moves = 0;
  double zone_squares = 0.8;
};

TEST_F(TwoZones, AreCutWhereMostIsPromisedAndMoved) {
  const std::vector<std::string> all = names();
  ASSERT_TRUE(end.best);
  EXPECT_THAT(end.best->shape.cuts, ElementsAre(ZoneCut{0, ZoneCut::By::Y, 0.01}));
  EXPECT_EQ(end.best->shape.form.laws, 2);
  EXPECT_EQ(end.best->found.evidence, 60.0);
  EXPECT_EQ(end.noise, 0.9 * noise);
  const auto third = std::ranges::find(end.tried, 3, [](const TriedLaw& t) { return t.form.controls; });
  ASSERT_NE(third, end.tried.end());
  EXPECT_FALSE(third->kept);
}

TEST_F(TwoZones, AreNotKeptWhereTheyFitHardlyBetter) {
  zone_squares = 0.92;
  (void)names();
  EXPECT_EQ(end.best->shape.form.controls, 1);
  EXPECT_EQ(end.noise, noise) << "as before them";
  const auto zones = std::ranges::find(end.tried, 2, [](const TriedLaw& t) { return t.form.controls; });
  ASSERT_NE(zones, end.tried.end());
  EXPECT_GT(zones->youngs_modulus, 0.0);
}

TEST_F(TwoZones, AreNoMoreThanWereAskedFor) {
  facts.options.law_zones = 1;
  const std::vector<std::string> all = names();
  EXPECT_EQ(std::ranges::count(all, "2 zones"), 0);
}

TEST_F(TwoZones, GoOnFromEveryRecord) {
  const std::vector<std::string> all = names();
  const std::vector<StageRecord> whole = done;
  const LawPlan plan(facts);
  for (std::size_t count = 0; count < whole.size(); ++count) {
    const LawPlan::Standing standing =
        plan.after(std::vector<StageRecord>(whole.begin(), whole.begin() + std::ptrdiff_t(count)));
    ASSERT_TRUE(standing.next);
    EXPECT_EQ(standing.next->id, whole[count].id);
    EXPECT_EQ(standing.next->from.front(), whole[count].from);
    EXPECT_EQ(standing.best.has_value(), count > 0);
  }
}

TEST_F(TwoZones, RecordsOfAnotherPlanAreRefused) {
  (void)names();
  facts.options.material = MaterialKind::Linear;
  EXPECT_NO_THROW((void)LawPlan(facts).after({}));
  facts.options.material = MaterialKind::Automatic, facts.has_curves = true;
  EXPECT_THAT(test::complaint_of([&] { (void)LawPlan(facts).after(done); }), testing::HasSubstr("--resume"));
}

TEST_F(LawPlans, RegionsGetALawEachByTheEvidence) {
  facts.modulus_names = {"youngs_modulus@top", "youngs_modulus@foot"};
  for (const double evidence : {2.0, 4.0}) {
    answer = [&](const Stage& stage, StageRecord& r) {
      if (stage.name == "a law a region") r.law->evidence = evidence;
    };
    std::vector<std::string> expected = {"1 term", "2 terms", "a law a region"};
    if (evidence > 3.0) expected.emplace_back("2 terms");  // of two laws, which is another form
    EXPECT_EQ(names(), expected);
    EXPECT_EQ(end.best->shape.form.laws, evidence > 3.0 ? 2 : 1);
  }
}

TEST_F(LawPlans, FieldsAreFittedWhereAStepPromisesSomething) {
  double squares = 0.85, evidence = 12.0;
  answer = [&](const Stage& stage, StageRecord& r) {
    if (stage.id.kind == StageKind::ControlPoints) {
      const int size = stage.law->shape.form.controls;
      r.law->points.assign(std::size_t(size), Vector3::Zero());
      for (int k = 0; k < size; ++k) r.law->points[std::size_t(k)].x() = 0.01 * k;
      r.theta = VectorX::Constant(stage.from.front().size() + size - stage.law->before.form.controls, 0.1);
      r.law->evidence = size == 8 ? 1.0 : -1.0;
    }
    if (stage.id.kind == StageKind::Law && stage.law->shape.form.controls == 8)
      r.law->evidence = evidence, r.law->track_squares *= squares;
  };
  const std::vector<std::string> all = names();
  EXPECT_EQ(std::ranges::count(all, "4 control points"), 1) << "promised only";
  EXPECT_EQ(std::ranges::count(all, "8 control points"), 2);
  EXPECT_EQ(end.best->shape.form.controls, 8);
  EXPECT_EQ(end.best->shape.points.size(), 8u);
  squares = 0.92;
  (void)names();
  EXPECT_EQ(end.best->shape.form.controls, 1) << "evidence, and hardly anything taken off the residuals";
  squares = 0.85, evidence = 8.0;
  (void)names();
  EXPECT_EQ(end.best->shape.form.controls, 1) << "evidence that what a law lacks may have made up";
}

TEST_F(LawPlans, SamplesFollowTheLawOfAllPressesInRoundsWhileThatGains) {
  facts.options.material = MaterialKind::Sampled;
  double gain = 0.2;
  answer = [&](const Stage& stage, StageRecord& r) {
    if (stage.id.kind != StageKind::Sample) return;
    r.converged = true, r.start_cost = 100.0, r.cost = 100.0 * (1.0 - gain);
  };
  (void)names();
  ASSERT_EQ(done.size(), 10u) << "two laws; four rounds of six presses, four at a time";
  for (std::size_t i = 2; i < done.size(); ++i) EXPECT_EQ(done[i].id.kind, StageKind::Sample);
  gain = 0.01;
  (void)names();
  EXPECT_EQ(done.size(), 4u) << "not worth another round";
}

TEST_F(LawPlans, NoRoundOfSamplesFollowsOneThatDoesNotCount) {
  facts.options.material = MaterialKind::Sampled;
  answer = [](const Stage& stage, StageRecord& r) {
    if (stage.id.kind == StageKind::Sample) r.converged = false, r.cost = 0.0, r.start_cost = 100.0;
  };
  (void)names();
  EXPECT_EQ(done.size(), 4u);
}

TEST_F(LawPlans, HaveNoLawWhereTheFirstCannotBeEvaluated) {
  answer = [](const Stage&, StageRecord& r) { r.succeeded = false; };
  EXPECT_THAT(names(), ElementsAre("1 term"));
  EXPECT_FALSE(end.best);
}

}  // namespace
}  // namespace pliant::law_plan_test
