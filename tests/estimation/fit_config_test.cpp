#include "estimation/fit_config.hpp"

#include "estimation/fit_state.hpp"
#include "estimation/press_fit.hpp"
#include "input_errors.hpp"
#include "temporary_folder.hpp"

namespace pliant::fit_config_test {
namespace {

TEST(FitConfig, FormerWordsAreRead) {
  FitOptions o;
  set_fit_option(o, "poissons_ratio=0.2");
  set_fit_option(o, "poissons_ratio@foam.estimate=false");
  ASSERT_TRUE(o.parameters.contains("poissons_ratio"));
  EXPECT_EQ((*o.parameters["poissons_ratio"].start)[0], 0.2);
  EXPECT_EQ(o.parameters["poissons_ratio@foam"].estimated, false);
  set_fit_option(o, "load_free=in_turns");
  EXPECT_NE(to_toml(o).find("load_free = \"staggered\""), std::string::npos);
  set_fit_option(o, "load_free=together");
  EXPECT_NE(to_toml(o).find("load_free = \"monolithic\""), std::string::npos);
}

using ::testing::HasSubstr;

FitOptions changed() {
  FitOptions o;
  o.cells = 17.5;
  o.coarse_cells = 6.0;
  o.steps = 2.0;
  o.points_per_frame = 0;
  o.scan_per_decade = 5;
  o.starts = 2;
  o.max_iterations = 31;
  o.wide_band = 0.2;
  o.fine_band = 0.04;
  o.newmark_theta = 0.6;
  o.optimiser = OptimiserKind::Rprop;
  o.solver = SolverKind::Cholmod;
  o.solver_tolerance = 1e-6;
  o.hold_strongly = true;
  o.parameters["youngs_modulus"].start = VectorX::Constant(1, 5120.25);
  o.parameters["poissons_ratio"].estimated = false;
  o.parameters["density"].prior_std = 0.125;
  VectorX g(3);
  g << 0.0, -9.5, 0.25;
  o.parameters["gravity"].start = g;
  o.parameters["gravity"].estimated = true;
  return o;
}

TEST(FitConfig, ChoicesAreWrittenAsTheyAreSet) {
  EXPECT_TRUE(written_choices({}, false).empty());
  EXPECT_EQ(written_choices({}, true).size(), fit_keys().size());
  const auto written = written_choices(changed(), false);
  EXPECT_THAT(written, ::testing::Contains(::testing::Pair("cells", "17.5")));
  EXPECT_THAT(written, ::testing::Contains(::testing::Pair("solver", "\"cholmod\"")));
  EXPECT_THAT(written, ::testing::Contains(::testing::Pair("hold_strongly", "true")));
  EXPECT_THAT(written, ::testing::Contains(::testing::Pair("poissons_ratio.estimate", "false")));
  EXPECT_THAT(written, ::testing::Contains(::testing::Pair("gravity", "[0, -9.5, 0.25]")));
  EXPECT_THAT(written, ::testing::Not(::testing::Contains(::testing::Key("refine"))));
  FitOptions set;
  for (auto [key, value] : written) {
    std::erase(value, '"');
    set_fit_option(set, key + "=" + value);
  }
  EXPECT_EQ(to_toml(set), to_toml(changed()));
}

TEST(FitConfig, RoundTripsEveryKey) {
  const test::TemporaryFolder folder;
  const FitOptions written = changed();
  FitOptions read;
  read_fit_options(folder.write("fit.toml", to_toml(written)), read);
  EXPECT_EQ(to_toml(read), to_toml(written));
  EXPECT_EQ(read.cells, 17.5);
  EXPECT_EQ(read.points_per_frame, 0);
  EXPECT_EQ(read.optimiser, OptimiserKind::Rprop);
  EXPECT_EQ(read.solver, SolverKind::Cholmod);
  EXPECT_EQ(read.solver_tolerance, 1e-6);
  EXPECT_TRUE(read.hold_strongly);
  ASSERT_TRUE(read.parameters.contains("gravity"));
  EXPECT_EQ(*read.parameters.at("gravity").start, *written.parameters.at("gravity").start);
  EXPECT_EQ(read.parameters.at("gravity").estimated, true);
  EXPECT_EQ(*read.parameters.at("youngs_modulus").start, VectorX::Constant(1, 5120.25));
  EXPECT_EQ(read.parameters.at("density").prior_std, 0.125);
  EXPECT_EQ(read.validate(), "");
}

TEST(FitConfig, ASeedThatSaysNothingIsReadAndAnotherRefused) {
  FitOptions options;
  set_fit_option(options, "seed=0");  // as older programs wrote it
  EXPECT_THROW(set_fit_option(options, "seed=42"), InputError);
}

TEST(FitConfig, ChoicesThatAreNotUsedAreNamed) {
  FitOptions options;
  EXPECT_TRUE(unused_choices(options, true, false).empty());
  EXPECT_TRUE(unused_choices(options, false, true).empty());
  options.law_terms = 2;
  options.steps = 2.0;
  options.cells = 9.0;
  options.marker_noise = 1e-4;
  const auto motion = unused_choices(options, true, false), presses = unused_choices(options, false, true),
             both = unused_choices(options, true, true);
  ASSERT_EQ(motion.size(), 2u);
  EXPECT_THAT(motion[0], HasSubstr("law_terms = 2 was not used"));
  EXPECT_THAT(motion[1], HasSubstr("marker_noise"));
  ASSERT_EQ(presses.size(), 1u);
  EXPECT_THAT(presses[0], HasSubstr("steps = 2"));
  ASSERT_EQ(both.size(), 1u);
  EXPECT_THAT(both[0], HasSubstr("law_terms = 2"));
}

TEST(FitConfig, KnowsTheNamesOfAllParameters) {
  for (const char* name : {"wind", "strength@1", "plane_7", "friction_12", "exponent_1", "poissons_ratio_2", "pull@3",
                           "youngs_modulus@top", "linear_velocity[2]"}) {
    FitOptions options;
    EXPECT_NO_THROW(set_fit_option(options, std::string(name) + ".estimate=false")) << name;
    EXPECT_TRUE(options.parameters.contains(name)) << name;
  }
  for (const char* name : {"plane_", "plane_x", "wind_2", "youngs_moduli", "exponent"}) {
    FitOptions options;
    EXPECT_THROW(set_fit_option(options, std::string(name) + ".estimate=false"), InputError) << name;
  }
}

TEST(FitConfig, TheMaterialOfAMotionIsALawOfItsForm) {
  FitOptions options;
  EXPECT_FALSE(options.law_of_motion());
  set_fit_option(options, "material=linear");
  EXPECT_FALSE(options.law_of_motion());
  set_fit_option(options, "material=neo_hookean");
  EXPECT_FALSE(options.law_of_motion()) << "that of the mean strain of elements";
  set_fit_option(options, "material=ogden");
  EXPECT_EQ(options.law_of_motion(), (LawForm{1, 1}));
  set_fit_option(options, "law_terms=2");
  EXPECT_EQ(options.law_of_motion(), (LawForm{1, 2}));
  EXPECT_TRUE(unused_choices(options, true, false).empty());
  options.law_terms = 4;
  EXPECT_THAT(options.validate(), HasSubstr("law_terms"));
  EXPECT_THAT(test::complaint_of([&] { set_fit_option(options, "material=jelly"); }), HasSubstr("neo_hookean"));
}

TEST(FitConfig, ALawInMotionIsNotTrackedAndSaysSoWhereTrackingIsAskedFor) {
  FitOptions options;
  options.material = MaterialKind::Ogden;
  options.tracking = TrackingUse::Off;
  EXPECT_TRUE(unused_choices(options, true, false).empty());
  options.tracking = TrackingUse::Loop;
  ASSERT_EQ(unused_choices(options, true, false).size(), 1u);
  EXPECT_THAT(unused_choices(options, true, false)[0], HasSubstr("tracker's own elasticity is linear"));
  options.material = MaterialKind::Linear;
  EXPECT_TRUE(unused_choices(options, true, false).empty());
}

TEST(FitConfig, DefaultsRoundTripAndEveryKeyIsWritten) {
  const test::TemporaryFolder folder;
  const std::string text = to_toml({});
  FitOptions read = changed();
  read.parameters.clear();
  read_fit_options(folder.write("fit.toml", text), read);
  EXPECT_EQ(to_toml(read), text);
  for (const FitKey& key : fit_keys()) {
    EXPECT_THAT(text, HasSubstr("\n" + key.name + " = "));
    EXPECT_FALSE(key.sentence.empty());
    FitOptions o;
    EXPECT_NO_THROW(set_fit_option(o, key.name + "=" + key.standard))
        << "the default shown in the help is not accepted";
    EXPECT_EQ(to_toml(o), text) << "the help shows another default than is used: " << key.name;
  }
}

TEST(FitConfig, UnknownKeysSuggestTheNearest) {
  FitOptions o;
  EXPECT_THAT(test::complaint_of([&] { set_fit_option(o, "max_iteration=3"); }), HasSubstr("max_iterations"));
  EXPECT_THAT(test::complaint_of([&] { set_fit_option(o, "youngs_modulos=3"); }), HasSubstr("youngs_modulus"));
  EXPECT_NE(test::complaint_of([&] { set_fit_option(o, "density.prior=3"); }), "");
  EXPECT_NE(test::complaint_of([&] { set_fit_option(o, "cells"); }), "");
  EXPECT_NE(test::complaint_of([&] { set_fit_option(o, "=4"); }), "");
  EXPECT_EQ(to_toml(o).find("[parameters.max"), std::string::npos);
}

TEST(FitConfig, ValuesOfAnotherTypeAreRefused) {
  for (const char* bad : {"cells=many", "cells=", "cells=12x", "starts=1.5", "starts=-1", "optimiser=newton",
                          "solver=fast", "hold_strongly=yes", "youngs_modulus=stiff", "gravity=1,2",
                          "gravity.estimate=maybe", "density.prior_std=-1", "density.prior_std=0"}) {
    FitOptions o;
    EXPECT_NE(test::complaint_of([&] { set_fit_option(o, bad); }), "") << bad;
  }
}

TEST(FitConfig, AFileReportsEveryProblemWithItsPlace) {
  const test::TemporaryFolder folder;
  const auto path =
      folder.write("fit.toml", "cells = \"many\"\nstarts = 2\nmax_iteration = 3\n[parameters.densty]\nstart = 4\n");
  FitOptions o;
  const std::string complaint = test::complaint_of([&] { read_fit_options(path, o); });
  EXPECT_THAT(complaint, HasSubstr("fit.toml:1:"));
  EXPECT_THAT(complaint, HasSubstr("fit.toml:3:"));
  EXPECT_THAT(complaint, HasSubstr("max_iterations"));
  EXPECT_THAT(complaint, HasSubstr("fit.toml:5:"));
  EXPECT_THAT(complaint, HasSubstr("densty"));
  EXPECT_NE(test::complaint_of([&] { read_fit_options(folder.write("broken.toml", "cells = = 3"), o); }), "");
  EXPECT_NE(test::complaint_of([&] { read_fit_options(folder / "missing.toml", o); }), "");
}

TEST(FitOptions, ValidateNamesWhatIsOutOfRange) {
  EXPECT_EQ(FitOptions{}.validate(), "");
  const auto complaint = [](auto&& change) {
    FitOptions o;
    change(o);
    return o.validate();
  };
  EXPECT_THAT(complaint([](FitOptions& o) { o.cells = 2; }), HasSubstr("cells"));
  EXPECT_THAT(complaint([](FitOptions& o) { o.cells = std::nan(""); }), HasSubstr("cells"));
  EXPECT_THAT(complaint([](FitOptions& o) { o.coarse_cells = 100; }), HasSubstr("coarse_cells"));
  EXPECT_THAT(complaint([](FitOptions& o) { o.steps = 0; }), HasSubstr("steps"));
  EXPECT_THAT(complaint([](FitOptions& o) { o.points_per_frame = 3; }), HasSubstr("points_per_frame"));
  EXPECT_THAT(complaint([](FitOptions& o) { o.starts = 0; }), HasSubstr("starts"));
  EXPECT_THAT(complaint([](FitOptions& o) { o.scan_per_decade = 0; }), HasSubstr("scan_per_decade"));
  EXPECT_THAT(complaint([](FitOptions& o) { o.max_iterations = 0; }), HasSubstr("max_iterations"));
  EXPECT_THAT(complaint([](FitOptions& o) { o.wide_band = 0.7; }), HasSubstr("band"));
  EXPECT_THAT(complaint([](FitOptions& o) { o.fine_band = 0.0; }), HasSubstr("band"));
  EXPECT_THAT(complaint([](FitOptions& o) { o.newmark_theta = 0.4; }), HasSubstr("newmark_theta"));
  EXPECT_THAT(complaint([](FitOptions& o) { o.solver_tolerance = 1.0; }), HasSubstr("solver_tolerance"));
}

/// Young's modulus and the range errors of two sensors.
ParameterSet three_parameters() {
  ParameterLayout layout;
  std::vector<Parameter> list;
  list.push_back(
      {"youngs_modulus", "Pa", Transform::Logarithm, layout.add({"youngs_modulus", "Pa"}), 1.0, 1.0, 1e9, true});
  for (const std::string name : {"range_error@left", "range_error@right"})
    list.push_back({name, "m", Transform::Shift, layout.add({name, "m", 1, Role::Sensor}), 0.01});
  for (Parameter& p : list) p.prior_mean = VectorX::Constant(1, 0.5);
  const VectorX ones = VectorX::Ones(layout.size());
  return {std::move(layout), std::move(list), ones};
}

ParameterSet overridden(const std::vector<std::string>& assignments) {
  FitOptions options;
  for (const std::string& assignment : assignments) set_fit_option(options, assignment);
  ParameterSet parameters = three_parameters();
  apply_overrides(parameters, options);
  return parameters;
}

TEST(Overrides, AStartWithTheWidthOfAPriorMovesThePriorThere) {
  const ParameterSet p = overridden({"youngs_modulus=5000", "youngs_modulus.prior_std=0.1"});
  EXPECT_EQ(p.reference()[p.find("youngs_modulus")->at], 5000.0);
  EXPECT_EQ(p.parameters()[0].prior_std, 0.1);
  EXPECT_DOUBLE_EQ(p.parameters()[0].prior_mean[0], std::log(5000.0));
}

TEST(Overrides, AStartAloneAndAWidthAloneLeaveThePriorWhereItIs) {
  for (const char* assignment : {"youngs_modulus=5000", "youngs_modulus.prior_std=0.1"})
    EXPECT_EQ(overridden({assignment}).parameters()[0].prior_mean[0], 0.5) << assignment;
}

TEST(Overrides, ANameAloneMeansThatOfEverySensor) {
  const ParameterSet p = overridden({"range_error.estimate=true", "range_error=0.02", "range_error.prior_std=2"});
  for (const std::size_t i : {1u, 2u}) {
    EXPECT_TRUE(p.parameters()[i].estimated);
    EXPECT_DOUBLE_EQ(p.parameters()[i].prior_mean[0], 2.0);
  }
  EXPECT_FALSE(overridden({"range_error@left.estimate=true"}).parameters()[2].estimated);
}

TEST(Overrides, RefuseAStartBeyondTheBoundsOfAnEstimateAndGivenNumbersOfAWrongSign) {
  EXPECT_THAT(test::complaint_of([] { overridden({"youngs_modulus=0.5"}); }),
              AllOf(HasSubstr("youngs_modulus is 0.5"), HasSubstr("1 or more")));
  EXPECT_THAT(test::complaint_of([] { overridden({"youngs_modulus=2e9"}); }), HasSubstr("1e+09 or less"));
  EXPECT_NO_THROW(overridden({"youngs_modulus=0.5", "youngs_modulus.estimate=false"}));
  EXPECT_THAT(test::complaint_of([] { overridden({"range_error@left=-0.01"}); }), HasSubstr("0 or more"));
}

TEST(Overrides, RefusesWhatIsNotThere) { EXPECT_THROW(overridden({"range_error@middle=0.02"}), InputError); }

FitState read_fit_state(const std::filesystem::path& path, const std::string& key) {
  return to_fit_state(read_file(path), path, key);
}

FitState some_state() {
  FitState state;
  state.pass.controls = 3;
  StageRecord scan{{StageKind::Scan}, "scan", VectorX::LinSpaced(20, -1.0, 3.0) / 7.0, VectorX::Constant(20, 0.1)};
  scan.trials = {{100.0, 2.5}, {1000.0, std::numeric_limits<double>::infinity()}, {1.0 / 3.0, 1e-300}};
  scan.succeeded = true;
  StageRecord start{{StageKind::Coarse, 1, 3}, "coarse", VectorX::Constant(4, 0.1), VectorX::Constant(4, 1.0 / 3.0)};
  start.start_cost = 12.0, start.cost = std::numeric_limits<double>::infinity();
  start.iterations = 7, start.converged = true, start.elements = 800;
  start.reason = "steps became \"short\"";
  StageRecord test{{StageKind::Test}, "test", VectorX::Constant(4, 0.1), VectorX::Constant(4, 0.1)};
  test.corrected = {"sensor_turn@front", "sensor_shift@front"}, test.told = "the pose of front";
  state.pass.done = {scan, start, test};
  state.pass.under_way = {{StageKind::Fine, 1, 0},
                          VectorX::Constant(20, 2.0 / 7.0),
                          {4, VectorX::Constant(3, -1.0 / 7.0), VectorX::Constant(9, 1e-7 / 3.0)}};
  state.pass.begin = {VectorX::Constant(20, 5.0 / 7.0), 2};
  StageRecord cut{{StageKind::Cut, 0, 3}, "2 zones", VectorX::Constant(6, 1.0 / 9.0), VectorX::Constant(6, 0.1)};
  cut.law = LawFinding{{1e-4 / 3.0, 0.1 / 3.0},
                       2e-4 / 3.0,
                       1e-9 / 3.0,
                       1.0 / 3.0,
                       77.0,
                       5,
                       -std::numeric_limits<double>::infinity(),
                       ZoneCut{1, ZoneCut::By::Depth, 1e-3 / 3.0},
                       {Vector3(0.1, -1.0 / 3.0, 0.0)}};
  state.pass.done.push_back(cut);
  PressSampling::State& sampling = state.sampled.emplace();
  PressSample& sample = sampling.kept.emplace_back();
  sample.succeeded = true, sample.weight = 1.0 / 7.0, sample.iterations = 5;
  sample.sample.strains = MatrixX::Constant(2, 6, 1.0 / 3.0);
  sample.sample.stresses = MatrixX::Constant(2, 6, 100.0 / 3.0);
  sampling.under.push_back(sample);
  sampling.under[0].rms = 1.0 / 3.0;
  return state;
}

TEST(FitState, RoundTripsToTheLastBit) {
  const test::TemporaryFolder folder;
  const FitState written = some_state();
  write_fit_state(folder / "state.json", written, "key");
  const FitState read = read_fit_state(folder / "state.json", "key");
  write_fit_state(folder / "again.json", read, "key");
  EXPECT_EQ(read_file(folder / "again.json"), read_file(folder / "state.json"));
  EXPECT_EQ(read.pass.controls, 3);
  ASSERT_EQ(read.pass.done.size(), written.pass.done.size());
  for (std::size_t i = 0; i < read.pass.done.size(); ++i) {
    const StageRecord &r = read.pass.done[i], &w = written.pass.done[i];
    EXPECT_EQ(r.id, w.id);
    EXPECT_EQ(r.name, w.name);
    EXPECT_EQ(r.from, w.from);
    EXPECT_EQ(r.theta, w.theta);
    EXPECT_EQ(r.start_cost, w.start_cost);
    EXPECT_EQ(r.cost, w.cost);
    EXPECT_EQ(r.iterations, w.iterations);
    EXPECT_EQ(r.succeeded, w.succeeded);
    EXPECT_EQ(r.converged, w.converged);
    EXPECT_EQ(r.reason, w.reason);
    EXPECT_EQ(r.elements, w.elements);
    EXPECT_EQ(r.trials, w.trials);
    EXPECT_EQ(r.corrected, w.corrected);
    EXPECT_EQ(r.told, w.told);
  }
  ASSERT_TRUE(read.pass.under_way.has_value());
  EXPECT_EQ(read.pass.under_way->id, written.pass.under_way->id);
  EXPECT_EQ(read.pass.under_way->from, written.pass.under_way->from);
  EXPECT_EQ(read.pass.under_way->optimiser.iterations, 4);
  EXPECT_EQ(read.pass.under_way->optimiser.p, written.pass.under_way->optimiser.p);
  EXPECT_EQ(read.pass.under_way->optimiser.memory, written.pass.under_way->optimiser.memory);
  ASSERT_TRUE(read.pass.begin.has_value());
  EXPECT_EQ(read.pass.begin->theta, written.pass.begin->theta);
  EXPECT_EQ(read.pass.begin->stage, 2);
  ASSERT_TRUE(read.sampled.has_value());
  ASSERT_TRUE(read.pass.done.back().law.has_value());
  const LawFinding &found = *read.pass.done.back().law, &found_written = *written.pass.done.back().law;
  EXPECT_FALSE(read.pass.done.front().law.has_value());
  EXPECT_EQ(found.noise, found_written.noise);
  EXPECT_EQ(found.track_squares, found_written.track_squares);
  EXPECT_EQ(found.deviation, found_written.deviation);
  EXPECT_EQ(found.stated_cost, found_written.stated_cost);
  EXPECT_EQ(found.observations, found_written.observations);
  EXPECT_EQ(found.dimension, found_written.dimension);
  EXPECT_EQ(found.evidence, found_written.evidence);
  EXPECT_EQ(found.cut, found_written.cut);
  EXPECT_EQ(found.points, found_written.points);
  ASSERT_EQ(read.sampled->kept.size(), 1u);
  EXPECT_EQ(read.sampled->kept[0].sample.strains, written.sampled->kept[0].sample.strains);
  EXPECT_EQ(read.sampled->kept[0].sample.stresses, written.sampled->kept[0].sample.stresses);
  EXPECT_EQ(read.sampled->kept[0].weight, 1.0 / 7.0);
  ASSERT_EQ(read.sampled->under.size(), 1u);
  EXPECT_EQ(read.sampled->under[0].rms, 1.0 / 3.0);
  write_fit_state(folder / "empty.json", {}, "key");
  EXPECT_TRUE(read_fit_state(folder / "empty.json", "key").pass.done.empty());
  EXPECT_FALSE(read_fit_state(folder / "empty.json", "key").sampled.has_value());
}

TEST(FitState, RefusesAnotherKeyAndDamage) {
  const test::TemporaryFolder folder;
  write_fit_state(folder / "state.json", some_state(), "key");
  EXPECT_THAT(test::complaint_of([&] { (void)read_fit_state(folder / "state.json", "other"); }),
              HasSubstr("another capture"));
  EXPECT_NE(test::complaint_of([&] { (void)read_fit_state(folder / "missing.json", "key"); }), "");
  const std::string whole = read_file(folder / "state.json");
  for (const std::size_t length : {std::size_t(0), std::size_t(1), whole.size() / 2, whole.size() - 2})
    EXPECT_NE(
        test::complaint_of([&] { (void)read_fit_state(folder.write("cut.json", whole.substr(0, length)), "key"); }), "")
        << length;
  for (const char* text :
       {"[]", "{}", "null", R"({"format": "fit-state/1", "key": "key"})", R"({"format": "fit-state/19", "key": "key"})",
        R"({"format": "fit-state/19", "key": "key", "pass": {"controls": 1, "done": [1]}})",
        R"({"format": "fit-state/19", "key": "key", "pass": {"controls": 1, "done": [], "under_way": ["x"]}})"})
    EXPECT_NE(test::complaint_of([&] { (void)read_fit_state(folder.write("bad.json", text), "key"); }), "") << text;
}

}  // namespace
}  // namespace pliant::fit_config_test
