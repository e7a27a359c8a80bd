#include "estimation/uncertainty.hpp"

#include <cmath>
#include <random>
#include <set>
#include <string>

#include "estimation/alternative.hpp"
#include "estimation/given_quantities.hpp"
#include "estimation/judgement.hpp"
#include "estimation/press_fit.hpp"
#include "estimation/verdict.hpp"

namespace pliant::uncertainty_test {
namespace {

/// A cost of two coordinates whose frames' gradients cancel.
CostEvaluation measured(const MatrixX& curvature, int frames = 40) {
  CostEvaluation e;
  e.succeeded = true;
  e.gauss_newton = curvature;
  e.gradient = VectorX::Zero(curvature.rows());
  for (int f = 0; f < frames; ++f) {
    FrameFit frame;
    frame.frame = f;
    frame.points = frame.matched = 100;
    frame.sum_noise_squares = 100e-6, frame.sum_squares = 100e-6;
    frame.gradient = VectorX::Zero(curvature.rows());
    frame.gauss_newton = curvature / double(frames);
    e.frames.push_back(std::move(frame));
  }
  return e;
}

MatrixX curvature() { return MatrixX{{400.0, 100.0}, {100.0, 250.0}}; }

ParameterSet young_and_poisson() {
  ParameterLayout layout;
  std::vector<Parameter> list;
  const auto add = [&](const char* name, const char* unit, Role role, Transform transform, bool estimated) {
    Parameter p;
    p.name = name, p.unit = unit, p.estimated = estimated, p.transform = transform;
    p.at = layout.add({name, unit, transform == Transform::Vector ? 3 : 1, role});
    list.push_back(p);
  };
  add("youngs_modulus", "Pa", Role::Material, Transform::Logarithm, true);
  add("poissons_ratio", "1", Role::Material, Transform::LogitHalf, true);
  add("density", "kg/m^3", Role::Inertia, Transform::Logarithm, false);
  add("range_error@front", "m", Role::Sensor, Transform::Shift, false);
  add("sensor_turn@front", "rad", Role::Sensor, Transform::Vector, false);
  VectorX theta(7);
  theta << 1e4, 0.3, 500.0, 0.0, 0.0, 0.0, 0.0;
  return {layout, list, theta};
}

TEST(UnmodelledStd, IsAShareOfADampingOrOfWhatIsUsualWhereItIsLess) {
  ParameterLayout layout;
  Parameter damping;
  damping.name = "stiffness_damping", damping.unit = "s", damping.estimated = true;
  damping.transform = Transform::InverseSinh, damping.scale = 0.004;
  damping.at = layout.add({"stiffness_damping", "s", 1, Role::Damping});
  for (const double value : {1e-4, 4e-3, 0.2}) {
    const VectorX theta = VectorX::Constant(1, value);
    const ParameterSet set(layout, {damping}, theta);
    const VectorX p = set.to_unconstrained(theta), floor = unmodelled_std(set, theta, MeasuredAs::MeetingObstacles);
    EXPECT_NEAR(set.jacobian(p)(0, 0) * floor[0], 0.16 * std::hypot(value, 0.004), 1e-12) << value;
  }
}

TEST(StudentsT, HasTheQuantilesOfItsTables) {
  EXPECT_NEAR(t_quantile_90(2.0), 2.9200, 1e-4);
  EXPECT_NEAR(t_quantile_90(2.5), 2.5582, 0.025);
  EXPECT_NEAR(t_quantile_90(3.0), 2.3534, 0.02);
  EXPECT_NEAR(t_quantile_90(4.0), 2.1318, 0.01);
  EXPECT_NEAR(t_quantile_90(8.0), 1.8595, 1e-3);
  EXPECT_NEAR(t_quantile_90(20.0), 1.7247, 1e-4);
  EXPECT_NEAR(t_quantile_90(1e6), 1.6449, 1e-4);
}

TEST(GaussNewtonShift, ReachesTheLeastOfAQuadraticCost) {
  CostEvaluation e = measured(curvature());
  const VectorX least = Eigen::Vector2d(0.03, -0.2);
  e.gradient = -(curvature() * least);
  EXPECT_LT((gauss_newton_shift(e, 1.0) - least).norm(), 1e-12);
  EXPECT_NEAR(gauss_newton_shift(e, 0.1)[1], -0.1, 1e-12) << "no further than one step is believed";
}

TEST(GivenQuantities, WidenTheEstimateAsMarginalisationDoes) {
  const MatrixX H{{4.0, 1.0, 0.5}, {1.0, 3.0, -0.7}, {0.5, -0.7, 5.0}};
  const VectorX shift = shifts_of_given(H, {0, 1}, {2}).col(0);
  const MatrixX alone = H.topLeftCorner(2, 2).inverse(), marginal = H.inverse().topLeftCorner(2, 2);
  EXPECT_LT((alone + shift * shift.transpose() - marginal).norm(), 1e-14);
}

TEST(GivenQuantities, HaveAPriorAboutWhereTheyAre) {
  const ParameterSet alone = young_and_poisson();
  const ParameterSet all = with_given(alone, given_quantities(alone));
  EXPECT_EQ(all.dimension(), 2 + 1 + 1 + 3);
  VectorX gradient = VectorX::Zero(7);
  EXPECT_NEAR(all.prior(all.to_unconstrained(all.reference()), &gradient), 0.0, 1e-20);
  EXPECT_LT(gradient.norm(), 1e-10);
}

TEST(GivenQuantities, AreThoseThatAreNotEstimated) {
  const std::vector<GivenQuantity> given = given_quantities(young_and_poisson());
  ASSERT_EQ(given.size(), 3u);
  EXPECT_EQ(given[0].cause, "mass");
  EXPECT_EQ(given[1].cause, "range of front");
  EXPECT_EQ(given[2].cause, "pose of front");
}

TEST(GivenQuantities, OfASensorAreKnownNoBetterThanItReads) {
  const ParameterSet set = young_and_poisson();
  CommonError error;
  error.sensor.turn = set.find("sensor_turn@front")->at;
  error.relative = 0.03;
  EXPECT_EQ(given_quantities(set, {error})[2].deviation, 0.06) << "at the object's ends, half its size away";
  error.relative = 1e-5;
  EXPECT_EQ(given_quantities(set, {error})[2].deviation, given_quantities(set)[2].deviation);
  error.sensor.turn = {}, error.relative = 0.03;
  EXPECT_EQ(given_quantities(set, {error})[2].deviation, given_quantities(set)[2].deviation) << "of another sensor";
}

TEST(GivenQuantities, AreKnownAsWellAsWasStated) {
  const auto stated = [](double std) {
    std::vector<Parameter> list = young_and_poisson().parameters();
    list[2].given_std = list[3].given_std = std;
    return given_quantities(ParameterSet(young_and_poisson().layout(), list, young_and_poisson().reference()));
  };
  const std::vector<GivenQuantity> given = stated(0.004);
  ASSERT_EQ(given.size(), 3u);
  EXPECT_EQ(given[0].deviation, 0.004);
  EXPECT_EQ(given[1].deviation, 0.004);
  EXPECT_EQ(given[2].deviation, judgement.given_turn);
  ASSERT_EQ(stated(0.0).size(), 1u) << "what is exact moves nothing";
  EXPECT_EQ(stated(0.0)[0].cause, "pose of front");
}

/// Of E in ln E, with gravity along y: a cost of both that is least along a line.
struct Weighed {
  explicit Weighed(bool masses_are_known) : scale{0.01, masses_are_known} {
    ParameterLayout layout;
    Parameter modulus{"youngs_modulus", "Pa", Transform::Logarithm,
                      layout.add({"youngs_modulus", "Pa", 1, Role::Material})};
    modulus.estimated = true;
    Parameter gravity{"gravity", "m/s^2", Transform::Direction, layout.add({"gravity", "m/s^2", 3, Role::Load})};
    gravity.origin = Vector3(0.0, -9.81, 0.0);
    VectorX theta(4);
    theta << 1e4, 0.0, -9.81, 0.0;
    all = with_strengths_of_gravity({layout, {modulus, gravity}, theta});
  }
  /// By how much the scale moves ln E where it has the power `power` of gravity's strength, known to that strength
  /// but for `left` of its curvature.
  double shift(double power, double left = 0.0) const {
    constexpr double curvature = 1e6;
    CostEvaluation e;
    e.gauss_newton = curvature * MatrixX{{1.0, -power}, {-power, power * power + left}};
    const std::vector<ModelShift> shifts = shifts_of_given(e, all, {}, scale);
    EXPECT_EQ(shifts.size(), 1u);
    EXPECT_EQ(shifts.front().cause, "scale of lengths");
    return shifts.front().shift[0] / scale.deviation;
  }

  GivenScale scale;
  ParameterSet all;
};

TEST(GivenScale, MovesWhatHasLengthsInItAndWhatFollowsGravity) {
  EXPECT_NEAR(Weighed(true).shift(0.0), -1.0, 1e-9) << "a force by an area, of masses times lengths";
  EXPECT_NEAR(Weighed(false).shift(0.0), 2.0, 1e-9) << "and the masses by volumes";
  EXPECT_NEAR(Weighed(true).shift(1.0), -2.0, 1e-9) << "what sags";
  EXPECT_NEAR(Weighed(false).shift(1.0), 1.0, 1e-9);
}

TEST(GivenScale, IsNarrowerWhereTheRecordingTellsHowFastThingsFall) {
  const double tells = 1e-2;  // a curvature of 1e4, as much as the deviation's own
  EXPECT_NEAR(Weighed(true).shift(1.0, tells), -2.0 / std::sqrt(2.0), 1e-9);
}

TEST(GivenScale, NoGravityIsNoStrength) {
  const Weighed still(true);
  std::vector<Parameter> list = still.all.parameters();
  ASSERT_EQ(list.size(), 3u);
  list.pop_back();
  list[1].origin = Vector3::Zero();
  EXPECT_EQ(with_strengths_of_gravity({still.all.layout(), list, VectorX::Zero(4)}).parameters().size(), 2u);
}

TEST(Uncertainties, OfNoiseAloneAreTheNoises) {
  const CostEvaluation e = measured(curvature());
  const Uncertainty u = uncertainty_of(e, {}, {});
  EXPECT_LT((u.covariance - curvature().inverse()).norm(), 1e-14);
  EXPECT_EQ(u.std, u.std_noise);
  EXPECT_EQ(u.std_model.norm(), 0.0);
  ASSERT_EQ(u.budget.size(), 1u);
  const double freedom = double(e.frames.size()) / 4.0;
  EXPECT_NEAR(u.high[0], t_quantile_90(freedom) * u.std[0], 1e-12);
  EXPECT_EQ(u.low[0], -u.high[0]);
}

TEST(Uncertainties, OfModelsAddInSquares) {
  const std::vector<ModelShift> shifts = {{"mesh", Eigen::Vector2d(0.1, 0.0)},
                                          {"pose of front", Eigen::Vector2d(0.03, 0.0)},
                                          {"pose of front", Eigen::Vector2d(0.04, -0.2)}};
  const Uncertainty noise = uncertainty_of(measured(curvature(), 400), {}, {});
  const Uncertainty u = uncertainty_of(measured(curvature(), 400), shifts, Eigen::Vector2d(0.05, 0.0));
  EXPECT_NEAR(u.std_model[0], std::sqrt(0.01 + 0.0009 + 0.0016 + 0.0025), 1e-12);
  EXPECT_NEAR(u.std[0], std::hypot(noise.std[0], u.std_model[0]), 1e-12);
  EXPECT_NEAR(u.covariance(0, 1), noise.covariance(0, 1) - 0.008, 1e-12) << "a shift moves both together";
  ASSERT_EQ(u.budget.size(), 4u);
  EXPECT_EQ(u.budget[2].cause, "pose of front");
  EXPECT_NEAR(u.budget[2].std[0], 0.05, 1e-12);
  double squares = 0.0;
  for (const UncertaintyShare& share : u.budget) squares += share.std[0] * share.std[0];
  EXPECT_NEAR(std::sqrt(squares), u.std[0], 1e-12);
  EXPECT_GT(u.high[0] / u.std[0], noise.high[0] / noise.std[0]) << "fewer degrees of freedom";
}

/// Recordings that each pull at the estimate of their sum, alike in 40 frames apiece: the cost of the coordinates that
/// all share is quadratic about each recording's own least, and coordinate `2 + r` belongs to recording r alone.
CostEvaluation recordings_about(const std::vector<Eigen::Vector2d>& least, const MatrixX& of_one) {
  constexpr int frames = 40;
  const int count = int(least.size());
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& l : least) mean += l / count;
  CostEvaluation e = measured(MatrixX::Zero(2 + count, 2 + count), 0);
  for (int r = 0; r < count; ++r) {
    FrameFit frame;
    frame.recording = r;
    frame.gauss_newton = MatrixX::Zero(2 + count, 2 + count);
    frame.gauss_newton.topLeftCorner(2, 2) = of_one / frames;
    frame.gauss_newton(2 + r, 2 + r) = 30.0 / frames;
    frame.gradient = VectorX::Zero(2 + count);
    frame.gradient.head(2) = of_one * (mean - least[r]) / frames;
    for (frame.frame = 0; frame.frame < frames; ++frame.frame) {
      e.gauss_newton += frame.gauss_newton;
      e.gradient += frame.gradient;
      e.frames.push_back(frame);
    }
  }
  return e;
}

TEST(ShareWithin, IsAllWhereNoModulusMovesFurther) {
  const ParameterSet set = young_and_poisson();
  const std::vector<const Parameter*> coordinates = set.coordinate_parameters();
  EXPECT_EQ(share_within(VectorX{{-0.2, 0.9}}, coordinates, 0.25), 1.0) << "Poisson's ratio is not bounded";
  EXPECT_EQ(share_within(VectorX{{0.0, 0.9}}, coordinates, 0.0), 1.0);
  EXPECT_DOUBLE_EQ(share_within(VectorX{{-0.5, 0.9}}, coordinates, 0.25), 0.5);
}

TEST(FormsOfTheLaw, ThatAreNotRuledOutWidenTheModulus) {
  const LawForm form;
  const auto tried = [&](double evidence, bool kept, double modulus) {
    return TriedLaw{form, 1.0, evidence, kept, modulus};
  };
  const ParameterSet set = young_and_poisson();
  EXPECT_TRUE(shifts_of_forms(set, 1e4, {tried(infinite, true, 1e4), tried(-8.0, false, 5e3)}).empty());
  const std::vector<ModelShift> shifts = shifts_of_forms(
      set, 1e4, {tried(-8.0, false, 5e3), tried(2.0, false, 9e3), tried(-2.0, false, 1.05e4), tried(0.0, false, 0.0)});
  ASSERT_EQ(shifts.size(), 1u);
  EXPECT_NEAR(shifts[0].shift[0], std::log(0.9), 1e-12) << "the farthest of those that may be true";
  EXPECT_EQ(shifts[0].shift[1], 0.0);
}

TEST(FrameGroups, AreTheRecordingsFromThreeOn) {
  const FrameGroups groups = frame_groups(recordings_about(std::vector<Eigen::Vector2d>(3), curvature()), 3);
  EXPECT_EQ(groups.count, 3);
  EXPECT_EQ(groups.of.front(), 0);
  EXPECT_EQ(groups.of.back(), 2);
  EXPECT_EQ(groups.cause, "what the recordings differ by");
}

TEST(FrameGroups, OfFewerAreTheQuartersOfEachMotion) {
  CostEvaluation two = recordings_about(std::vector<Eigen::Vector2d>(2), curvature());
  const FrameGroups groups = frame_groups(two, 2);
  EXPECT_EQ(groups.count, 8);
  for (std::size_t i = 0; i < two.frames.size(); ++i) EXPECT_EQ(groups.of[i], int(i / 10)) << "of forty frames apiece";
  EXPECT_EQ(groups.cause, "what parts of the motion differ by");
  const FrameGroups of_first = frame_groups(two, 1);
  EXPECT_EQ(of_first.count, 4);
  EXPECT_EQ(of_first.of.back(), -1) << "a load beside the motion is taken along in all";
  EXPECT_EQ(frame_groups(measured(curvature(), 7), 1).count, 0) << "too few frames to be split";
  EXPECT_FALSE(covariance_between(measured(curvature(), 7), frame_groups(measured(curvature(), 7), 1)));
}

TEST(CovarianceBetweenGroups, IsTheScatterOfTheirMeanWhereTheyAreAlike) {
  const std::vector<Eigen::Vector2d> least = {{0.1, 0.02}, {-0.05, 0.3}, {0.0, -0.1}, {0.2, 0.04}};
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& l : least) mean += l / 4.0;
  Eigen::Matrix2d scatter = Eigen::Matrix2d::Zero();
  for (const Eigen::Vector2d& l : least) scatter += (l - mean) * (l - mean).transpose() / (3.0 * 4.0);
  const CostEvaluation e = recordings_about(least, curvature());
  const MatrixX between = *covariance_between(e, frame_groups(e, 4));
  EXPECT_LT((between.topLeftCorner(2, 2) - scatter).norm(), 1e-12);
  EXPECT_LT(between.bottomRightCorner(4, 4).norm(), 1e-20) << "what each has of its own does not move";
}

TEST(CovarianceBetweenGroups, WidensNothingThatNoiseAccountsFor) {
  const std::vector<Eigen::Vector2d> alike(3, Eigen::Vector2d(0.2, 0.1));
  const Uncertainty u = uncertainty_of(recordings_about(alike, curvature()), {}, {}, 3);
  EXPECT_EQ(u.std, u.std_noise);
}

TEST(CovarianceBetweenGroups, MakesTheIntervalHoldWhatRecordingsScatterAbout) {
  constexpr int count = 5, draws = 2000;
  constexpr double scatter = 0.3;  // of one recording, six times what its noise makes
  std::mt19937 random(7);
  std::normal_distribution<double> normal(0.0, scatter);
  int held = 0, held_by_noise = 0;
  for (int draw = 0; draw < draws; ++draw) {
    std::vector<Eigen::Vector2d> least;
    double mean = 0.0;
    for (int r = 0; r < count; ++r) {
      least.push_back({normal(random), normal(random)});
      mean += least.back()[0] / count;
    }
    const CostEvaluation e = recordings_about(least, curvature());
    const auto holds_zero = [&](const Uncertainty& u) { return mean + u.low[0] < 0.0 && 0.0 < mean + u.high[0]; };
    held += holds_zero(uncertainty_of(e, {}, {}, count));
    held_by_noise += holds_zero(uncertainty_of(e, {}, {}, 0));
  }
  EXPECT_NEAR(held / double(draws), 0.9, 0.03);
  EXPECT_LT(held_by_noise / double(draws), 0.7) << "recordings that do not differ would show nothing";
}

/// A motion whose beginning asks for another value than its end is known no better than the two differ.
TEST(CovarianceBetweenGroups, WidensWhatPartsOfAMotionDisagreeAbout) {
  CostEvaluation e = measured(MatrixX::Zero(2, 2), 40);
  for (FrameFit& frame : e.frames) {
    frame.gauss_newton = curvature() / 40.0;
    frame.gradient = curvature() * Eigen::Vector2d(frame.frame < 20 ? 0.3 : -0.3, 0.0) / 40.0;
    e.gauss_newton += frame.gauss_newton;
  }
  const Uncertainty u = uncertainty_of(e, {}, {}, 1);
  EXPECT_NEAR(u.std[0], 0.3 / std::sqrt(3.0), 1e-9) << "four quarters at +-0.3: their scatter over the root of four";
  EXPECT_EQ(u.budget.back().cause, "what parts of the motion differ by");
  EXPECT_LT(u.std[1], 1.01 * u.std_noise[1]) << "of which they tell the same";
}

/// All but the first quarter of a motion hardly know the second number, and ask for a step of a hundred.
TEST(CovarianceBetweenGroups, GoesNoFartherThanTheLinearModelIsWorth) {
  CostEvaluation e = measured(MatrixX::Zero(2, 2), 40);
  for (FrameFit& frame : e.frames) {
    const bool is_first = frame.frame < 10;
    frame.gauss_newton = Eigen::Vector2d(1.0, is_first ? 1.0 : 1e-4).asDiagonal();
    frame.gradient = Eigen::Vector2d(0.0, is_first ? 0.03 : -0.01);
    e.gauss_newton += frame.gauss_newton;
  }
  const Uncertainty u = uncertainty_of(e, {}, {}, 1);
  EXPECT_EQ(u.budget.back().cause, "what parts of the motion differ by");
  EXPECT_GT(u.std[1], 0.5) << "the quarters do disagree";
  EXPECT_LT(u.std[1], 1.5 * largest_shift);
}

TEST(Verdicts, AreGoodWhereResidualsAreNoise) {
  const CostEvaluation e = measured(curvature());
  const Verdict v = verdict_of(e, uncertainty_of(e, {}, {}), young_and_poisson());
  EXPECT_EQ(name_of(v.kind), "explained");
  EXPECT_TRUE(v.reasons.empty());
}

TEST(Verdicts, DoubtAModelThatMissesTheRecording) {
  CostEvaluation e = measured(curvature());
  for (FrameFit& f : e.frames) f.sum_squares *= 9.0;
  Verdict v = verdict_of(e, uncertainty_of(e, {}, {}), young_and_poisson());
  EXPECT_EQ(name_of(v.kind), "unexplained");
  ASSERT_EQ(v.reasons.size(), 1u);
  EXPECT_NE(v.reasons[0].find("3.0 times the noise"), std::string::npos) << v.reasons[0];

  e = measured(curvature());
  for (int f = 20; f < 24; ++f) e.frames[std::size_t(f)].sum_squares *= 9.0;
  v = verdict_of(e, uncertainty_of(e, {}, {}), young_and_poisson());
  EXPECT_EQ(name_of(v.kind), "unexplained") << "for a tenth of the frames";
  EXPECT_NE(v.reasons.at(0).find("frame 2"), std::string::npos) << v.reasons[0];

  e = measured(curvature());
  e.frames[20].sum_squares *= 9.0;
  EXPECT_EQ(name_of(verdict_of(e, uncertainty_of(e, {}, {}), young_and_poisson()).kind), "explained") << "one frame";

  e = measured(curvature());
  for (FrameFit& f : e.frames) f.matched = 70;
  EXPECT_EQ(name_of(verdict_of(e, uncertainty_of(e, {}, {}), young_and_poisson()).kind), "unexplained");
}

TEST(Verdicts, SayThatAModulusIsNotDetermined) {
  const CostEvaluation e = measured(curvature());
  const Uncertainty wide = uncertainty_of(e, {{"mesh", Eigen::Vector2d(0.4, 0.0)}}, {});
  const Verdict v = verdict_of(e, wide, young_and_poisson());
  EXPECT_EQ(name_of(v.kind), "undetermined");
  ASSERT_EQ(v.reasons.size(), 1u);
  EXPECT_NE(v.reasons[0].find("other models"), std::string::npos) << v.reasons[0];
  const Uncertainty poisson = uncertainty_of(e, {{"mesh", Eigen::Vector2d(0.0, 0.9)}}, {});
  EXPECT_EQ(name_of(verdict_of(e, poisson, young_and_poisson()).kind), "explained") << "Poisson's ratio is no modulus";
}

/// Two control points, of which one is where nothing bends; or neither is known but for their ratio.
TEST(Verdicts, JudgeAFieldByItsMean) {
  const MotionLayout layout({.moduli = 2});
  std::vector<Parameter> list;
  for (const ParameterHandle& modulus : layout.youngs_moduli) {
    list.push_back({"youngs_modulus@" + std::to_string(list.size() + 1), "Pa", Transform::Logarithm, modulus});
    list.back().estimated = true;
  }
  ParameterSet field(layout.layout(), list, VectorX::Constant(layout.size(), 1e4));
  const CostEvaluation e = measured(curvature());
  const auto verdict = [&](const Eigen::Vector2d& shift) {
    return verdict_of(e, uncertainty_of(e, {{"mesh", shift}}, {}), field);
  };
  EXPECT_EQ(name_of(verdict({0.4, 0.0}).kind), "undetermined") << "two materials of regions";
  field.set_joint_prior({"youngs_modulus@1", "youngs_modulus@2"}, MatrixX::Identity(2, 2));
  EXPECT_EQ(name_of(verdict({0.4, 0.0}).kind), "explained");
  const Verdict unknown = verdict({0.4, 0.4});
  EXPECT_EQ(name_of(unknown.kind), "undetermined");
  ASSERT_EQ(unknown.reasons.size(), 1u);
  EXPECT_NE(unknown.reasons[0].find("The mean of Young's modulus"), std::string::npos) << unknown.reasons[0];
}

/// What a result repeats is all there is, each by a name of its own.
TEST(Judgement, EveryNumberHasANameAValueAndAMeaning) {
  std::set<std::string> names;
  for (const Judged& number : all_judged()) {
    EXPECT_TRUE(names.insert(number.name).second) << number.name;
    EXPECT_GT(number.value, 0.0) << number.name;
    EXPECT_GT(std::string(number.meaning).size(), 5u) << number.name;
  }
  EXPECT_EQ(names.count("verdict.residual"), 1u);
  EXPECT_EQ(names.count("hypothesis.press_outlier"), 1u) << "the last";
}

}  // namespace
}  // namespace pliant::uncertainty_test
