#include "estimation/tracking_loop.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "base/error.hpp"
#include "estimation/field_choice.hpp"
#include "estimation/fit_plan.hpp"
#include "estimation/followed.hpp"
#include "estimation/recordings.hpp"

namespace pliant {

namespace {

constexpr int every_so_many = 5;  // frames one is left out
constexpr double settled = 0.02;  // change of ln E

using Phase = FitState::Tracking::Phase;

std::string text_of(const char* format, double value) {
  char text[40];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

TrackingUse use_of(const std::vector<RecordedCapture>& recordings, const FitOptions& options) {
  if (options.law_of_motion()) return TrackingUse::Off;  // the tracker's own elasticity is linear
  if (options.tracking != TrackingUse::Automatic) return options.tracking;
  const bool suits = std::ranges::all_of(recordings, [](const RecordedCapture& r) {
    const Capture& c = r.capture;
    return !r.followed && !c.scene.timing.is_static && c.scene.object.shape_is == ShapeIs::Reference &&
           c.markers.empty() && c.silhouettes.empty() && !has_time_offsets(c) && !has_moving_cameras(c) &&
           (!c.clouds.empty() || c.depth.size() > 1);
  });
  return suits ? TrackingUse::Both : TrackingUse::Off;
}

/// Rounds of tracking and fits to what was tracked; where points are fitted too, those, and the better one of the two
/// with all frames.
class TrackingLoop : public PassPlanner {
 public:
  TrackingLoop(std::vector<RecordedCapture> recordings, const FitOptions& options, FitMonitor monitor, FitState resume)
      : all_(std::move(recordings)),
        options_(options),
        monitor_(std::move(monitor)),
        is_both_(use_of(all_, options) == TrackingUse::Both) {
    options_.tracking = TrackingUse::Off;
    if (resume.tracking) {
      state_ = *resume.tracking;
      left_ = std::move(resume);
      left_.tracking.reset();
    }
    for (const RecordedCapture& r : all_) split(r);
    for (const RecordedCapture& r : looped()) followed_.emplace_back(r, options_, notes_);
  }

  std::optional<Pass> next() override {
    while (!is_done()) {
      if (!inner_) begin_part();
      if (!inner_) continue;
      if (std::optional<Pass> pass = inner_->next()) return as_part(std::move(*pass));
    }
    return std::nullopt;
  }

  bool take(FitOutcome outcome, PassState reached) override {
    const bool is_kept = inner_->take(std::move(outcome), reached);
    if (!inner_->is_done()) return is_kept;
    FitState stands;
    inner_->write(stands);
    FitOutcome whole = inner_->outcome();
    const bool is_over = whole.interrupted || part_ == Part::Last;
    inner_.reset();
    for (const FitEvent& event : whole.history) history_.emplace_back(controls_of(whole), event);
    forward_steps_ += whole.forward_steps;
    end_part(std::move(whole), stands.field && stands.field->state ? *stands.field->state : std::move(reached));
    return !is_over;
  }

  bool is_done() const override { return final_.has_value(); }
  void write(FitState& state) const override {
    state.tracking = state_;
    state.field.reset();
    if (inner_) inner_->write(state);
  }
  FitOutcome outcome() override { return with_history(std::move(*final_)); }

 private:
  enum class Part { Round, RoundsAgain, Points, Last };

  void split(const RecordedCapture& r) {
    RecordedCapture training{r.capture, {}, {}}, held_out = training;
    for (const ObservedFrame& frame : r.observed) {
      const int since = frame.frame - r.capture.scene.timing.start_frame;
      (since > 0 && since % every_so_many == 3 ? held_out : training).observed.push_back(frame);
    }
    training_.push_back(std::move(training));
    held_out_.push_back(std::move(held_out));
  }

  bool interrupted() const { return monitor_.agrees_to_stop(); }

  JointLayout layout_of(int controls) const { return joint_layout(all_, options_, controls); }
  /// Follows with so many control moduli from now on.
  void follow_with_controls(int controls) {
    if (controls == followed_controls()) return;
    FitOptions options = options_;
    options.control_points = controls;
    std::vector<std::string> told_before;
    followed_.clear();
    for (const RecordedCapture& r : looped()) followed_.emplace_back(r, options, told_before);
  }
  /// Control moduli that the object is followed with.
  int followed_controls() const { return int(followed_.front().material().youngs_moduli.size()); }

  /// Each recording's own parameters where nothing is known yet.
  std::vector<VectorX> known_at_first() const {
    std::vector<VectorX> parts;
    for (const FollowedRecording& r : followed_) parts.push_back(r.start());
    return parts;
  }

  /// Each recording's own parameters of an estimate, with the moduli that the object is followed with.
  std::vector<VectorX> to_follow_with(const VectorX& theta, int controls) const {
    const JointLayout layout = layout_of(followed_controls());
    const VectorX all = with_controls(theta, controls, followed_controls());
    std::vector<VectorX> parts;
    for (std::size_t i = 0; i < all_.size(); ++i) parts.push_back(layout.part(all, i));
    return parts;
  }

  /// Follows all recordings with their own parameters. False, with the tracks before, where it was interrupted.
  [[nodiscard]] bool follow(const std::vector<FollowedRecording>& recordings, const std::vector<VectorX>& own) {
    std::vector<std::shared_ptr<const Track>> tracks;
    for (std::size_t i = 0; i < recordings.size(); ++i) {
      tracks.push_back(
          std::make_shared<Track>(recordings[i].follow(own[i], [this](int, int) { return !interrupted(); })));
      if (interrupted()) return false;
    }
    tracks_ = std::move(tracks);
    return true;
  }

  /// Interrupted as it followed: the end is what was reached before, which may be nothing.
  void stop(std::optional<FitOutcome> reached) {
    final_ = reached ? std::move(reached) : FitOutcome{};
    final_->interrupted = true, final_->converged = false, final_->reason = "interrupted";
  }

  std::vector<RecordedCapture> followed_captures(const std::vector<RecordedCapture>& recordings) const {
    std::vector<RecordedCapture> followed;
    for (std::size_t i = 0; i < recordings.size(); ++i) {
      const Capture& capture = recordings[i].capture;
      followed.push_back({capture, {}, supported_points(*tracks_[i], object_size(capture.scene))});
      if (followed.back().followed->frames.empty())
        throw InputError({{capture.file},
                          "the tracker finds the object in no frame",
                          "points near its surface at rest",
                          "look at `pliant track`; or fit the points themselves with --set tracking=off"});
    }
    return followed;
  }

  /// @param own  the first recording's parameters that it was followed with
  TrackingRound described(const VectorX& own) const {
    TrackingRound round;
    round.youngs_modulus = own[followed_.front().material().youngs_moduli.front()];
    round.confidence = 1.0;
    double squares = 0.0, points = 0.0;
    for (const auto& track : tracks_) {
      round.lost = round.lost || track->lost_at.has_value();
      for (const TrackedFrame& f : track->frames) {
        squares += f.surface_rms * f.surface_rms * f.points * f.explained;
        points += f.points * f.explained;
        if (f.points > 0 || f.markers > 0) round.confidence = std::min(round.confidence, f.confidence);
      }
    }
    if (points > 0.0) round.surface_rms = std::sqrt(squares / points);
    return round;
  }

  /// A pass of a part, told as such.
  Pass as_part(Pass pass) const {
    pass.name = name_ + ": " + pass.name;
    pass.done_from = done_from_ + (done_to_ - done_from_) * pass.done_from;
    pass.done_to = done_from_ + (done_to_ - done_from_) * pass.done_to;
    return pass;
  }

  void begin(Part part, const std::string& name, double done_from, double done_to,
             std::vector<RecordedCapture> recordings, const FitOptions& options, FitState from) {
    part_ = part, name_ = name, done_from_ = done_from, done_to_ = done_to;
    FitOptions own = options;
    own.alternatives = options.alternatives && (part == Part::Last || !is_both_);
    own.budget = 0.0;  // every round would spend it
    inner_ = planner_of_points(std::move(recordings), own, std::move(from), monitor_.processes);
  }

  /// A fit that looks again from an estimate, with other observations.
  static FitState from_there(const PassState& state, const VectorX& theta) {
    FitState begun{begun_from(state), {}, {}, {}};
    begun.pass.begin->theta = theta;
    return begun;
  }

  /// A parameter vector of all recordings with another number of control moduli: their mean in the logarithm where it
  /// differs.
  VectorX with_controls(const VectorX& theta, int before, int after) const {
    if (before == after) return theta;
    const JointLayout from = layout_of(before);
    double mean = 0.0;
    for (const double modulus : from.blocks.front().motion.moduli(theta)) mean += std::log(modulus) / before;
    return with_moduli(from, theta, layout_of(after), VectorX::Constant(after, std::exp(mean)));
  }
  /// Control moduli of an estimate.
  static int controls_of(const FitOutcome& outcome) {
    return outcome.recordings.front().discretisation.body->modulus.controls;
  }

  /// How many control points there are is chosen once.
  static FitOptions with_chosen_controls(FitOptions options, int controls) {
    if (options.control_points == FitOptions::automatic) options.control_points = controls;
    return options;
  }

  /// The modulus that a user gives is the one to track with: how fast the tracked motion is tells a better one to begin
  /// its fit.
  FitOptions without_start(FitOptions options) const {
    const std::vector<ParameterBlock> blocks = layout_of(options.controls()).layout.blocks();
    for (auto& [name, change] : options.parameters) {
      const auto block = std::ranges::find(blocks, name, &ParameterBlock::name);
      const bool is_modulus =
          name == "youngs_modulus" || (block != blocks.end() && block->role == Role::Material && block->unit == "Pa");
      if (is_modulus && change.estimated.value_or(true)) change.start.reset();
    }
    return options;
  }

  /// Points of the surface tell how its modulus varies. Where the tracked motion bends is partly how the tracker bent
  /// it, with an object of one modulus at first: that is asked on request alone.
  static FitOptions for_points(FitOptions options) {
    if (options.control_points == FitOptions::unsaid && !options.parameters.contains("youngs_modulus"))
      options.control_points = FitOptions::automatic;
    return options;
  }

  double share(int round) const { return (is_both_ ? 0.5 : 1.0) * round / options_.tracking_rounds; }
  const std::vector<RecordedCapture>& looped() const { return is_both_ ? training_ : all_; }

  /// What is left to do, or the end.
  void begin_part() {
    if (state_.phase == Phase::Loop) return begin_round();
    if (state_.phase == Phase::Direct && is_both_ && !direct_)
      return begin(Part::Points, "points", 0.5, 0.9, training_, for_points(options_), std::exchange(left_, {}));
    if (state_.phase != Phase::Last && !loop_) return begin_rounds_again();
    if (!is_both_) {
      final_ = std::move(loop_);
      return;
    }
    begin_last();
  }

  void begin_round() {
    const bool is_first = state_.rounds.empty();
    const int round = int(state_.rounds.size()),
              controls = is_first ? followed_controls() : state_.rounds.back().controls;
    const VectorX theta = is_first ? VectorX() : state_.rounds.back().theta;
    if (!is_first) follow_with_controls(controls);
    const std::vector<VectorX> own = is_first ? known_at_first() : to_follow_with(theta, controls);
    if (!follow(followed_, own)) return stop(std::move(loop_));
    round_ = described(own.front());
    moduli_before_ = is_first ? followed_.front().material().moduli(own.front())
                              : layout_of(controls).blocks.front().motion.moduli(theta);
    FitState from = std::exchange(left_, {});
    const bool is_resumed = !from.pass.done.empty() || from.pass.under_way || from.pass.begin;
    if (!is_resumed && state_.loop) from = from_there(*state_.loop, theta);
    begin(Part::Round, "round " + std::to_string(round + 1), share(round), share(round + 1),
          followed_captures(looped()), without_start(is_first ? options_ : with_chosen_controls(options_, controls)),
          std::move(from));
  }

  /// All rounds were done before an interruption.
  void begin_rounds_again() {
    const TrackingRound& round = state_.rounds.back();
    follow_with_controls(round.controls);
    if (!follow(followed_, to_follow_with(round.theta, round.controls))) return stop(std::move(direct_));
    begin(Part::RoundsAgain, "rounds", 0.5, 0.5, followed_captures(looped()),
          with_chosen_controls(without_start(options_), round.controls), {*state_.loop, {}, {}, {}});
  }

  /// The better one again, from where it is, with all frames.
  void begin_last() {
    const PassState& best = state_.keeps_loop ? *state_.loop : *state_.direct;
    const VectorX theta = estimate_of(best)->theta;
    FitOptions options = state_.keeps_loop ? without_start(options_) : for_points(options_);
    options = with_chosen_controls(std::move(options), best.controls);
    std::vector<FollowedRecording> all;
    std::vector<std::string> ignored;
    for (const RecordedCapture& r : all_) all.emplace_back(r, options_, ignored);
    if (!follow(all, to_follow_with(theta, best.controls))) return stop(std::move(state_.keeps_loop ? loop_ : direct_));
    FitState from = left_.pass.begin ? std::exchange(left_, {}) : from_there(best, theta);
    begin(Part::Last, "all frames", 0.9, 1.0, state_.keeps_loop ? followed_captures(all_) : all_, options,
          std::move(from));
  }

  void end_part(FitOutcome outcome, PassState reached) {
    switch (part_) {
      case Part::Round:
        return end_round(std::move(outcome), std::move(reached));
      case Part::RoundsAgain:
        loop_ = std::move(outcome);
        break;
      case Part::Points:
        if (outcome.interrupted) {
          final_ = std::move(outcome);
          return;
        }
        if (outcome.evaluation.succeeded) state_.direct = std::move(reached);
        direct_ = std::move(outcome);
        break;
      case Part::Last:
        final_ = with_choice_of_points(std::move(outcome));
        return;
    }
    if (state_.phase == Phase::Direct && loop_ && direct_) compare();
  }

  void end_round(FitOutcome outcome, PassState reached) {
    if (outcome.interrupted || !outcome.evaluation.succeeded) {
      final_ = std::move(outcome);
      return;
    }
    round_.theta = outcome.theta, round_.controls = controls_of(outcome), round_.fields = outcome.fields;
    round_.fit_rms = outcome.evaluation.track_rms();
    round_.change = change(moduli_before_, layout_of(round_.controls).blocks.front().motion.moduli(outcome.theta));
    state_.loop = std::move(reached);
    state_.rounds.push_back(round_);
    loop_ = std::move(outcome);
    if (round_.change < settled || int(state_.rounds.size()) >= options_.tracking_rounds) state_.phase = Phase::Direct;
  }

  /// Both estimates by the frames that were left out.
  void compare() {
    result_.loop = score(*loop_), result_.direct = score(*direct_);
    state_.keeps_loop =
        !result_.direct->succeeded || (result_.loop->succeeded && result_.loop->cost < result_.direct->cost);
    state_.phase = Phase::Last;
  }

  FitOutcome with_choice_of_points(FitOutcome outcome) const {
    if (state_.keeps_loop || !direct_) return outcome;
    outcome.fields = direct_->fields;
    if (!outcome.fields.empty()) outcome.notes.insert(outcome.notes.begin(), direct_->notes.front());
    return outcome;
  }

  /// Of ln E by an estimate, the greatest of all moduli; by their mean in the logarithm where there were fewer or more.
  static double change(const VectorX& before, const VectorX& after) {
    const VectorX logs = before.array().log();
    double greatest = 0.0;
    for (Eigen::Index k = 0; k < after.size(); ++k) {
      const double from = before.size() == after.size() ? logs[k] : logs.mean();
      greatest = std::max(greatest, std::abs(std::log(after[k]) - from));
    }
    return greatest;
  }

  HeldOutFrames score(const FitOutcome& outcome) const {
    HeldOutFrames score;
    if (!outcome.evaluation.succeeded) return score;
    double squares = 0.0, points = 0.0;
    score.succeeded = true;
    for (std::size_t i = 0; i < all_.size(); ++i) {
      const CostEvaluation e = predicted(outcome, i, held_out_[i]);
      score.succeeded = score.succeeded && e.succeeded;
      score.cost += e.cost;
      for (const FrameFit& f : e.frames) squares += f.sum_squares, points += f.points, ++score.frames;
    }
    if (points > 0.0) score.surface_rms = std::sqrt(squares / points);
    return score;
  }

  /// How an estimate fits points that were seen.
  CostEvaluation predicted(const FitOutcome& outcome, std::size_t recording, const RecordedCapture& seen) const {
    const RecordingOutcome& estimate = outcome.recordings[recording];
    const Discretisation& d = estimate.discretisation;
    ObjectiveOptions o;
    o.outlier_scale = options_.fine_band * object_size(seen.capture.scene);
    o.last_frame = int(d.simulation.times.size()) - 1;
    const auto observations =
        std::make_shared<std::vector<FrameObservations>>(frame_observations(seen.capture, seen.observed, {}));
    return Objective(d.mismatch, d.body, d.simulation, observations,
                     ParameterSet(outcome.parameters.layout(), {}, outcome.theta), o)
        .evaluate(VectorX(0));
  }

  /// With all that was done on the way; the agreement is that with the points.
  FitOutcome with_history(FitOutcome outcome) {
    outcome.history.clear();
    for (auto& [controls, event] : history_) {
      if (outcome.theta.size() > 0) event.theta = with_controls(event.theta, controls, controls_of(outcome));
      outcome.history.push_back(std::move(event));
    }
    outcome.forward_steps = forward_steps_;
    if (!is_both_ && !state_.rounds.empty() && !state_.rounds.front().fields.empty() && outcome.fields.empty()) {
      outcome.fields = state_.rounds.front().fields;
      outcome.notes.insert(outcome.notes.begin(), explained(outcome.fields));
    }
    result_.rounds = state_.rounds;
    result_.keeps_loop = state_.keeps_loop;
    result_.tracks = tracks_;
    result_.why = why(outcome.interrupted);
    if (outcome.evaluation.succeeded) agree_with_points(outcome);
    outcome.notes.insert(outcome.notes.begin(), result_.why);
    for (const auto& track : tracks_) {
      if (!track->note.empty()) outcome.notes.push_back(track->note);
      if (track->lost_at)
        outcome.notes.push_back("The tracker lost the object in frame " + std::to_string(*track->lost_at) + ".");
    }
    outcome.tracking = std::move(result_);
    return outcome;
  }

  void agree_with_points(FitOutcome& outcome) const {
    std::vector<FrameFit> frames;
    for (std::size_t i = 0; i < all_.size(); ++i) {
      CostEvaluation e = predicted(outcome, i, all_[i]);
      if (!e.succeeded) return;
      for (FrameFit& f : e.frames) {
        f.recording = int(i);
        frames.push_back(f);
      }
      outcome.recordings[i].evaluation.frames = e.frames;
    }
    outcome.evaluation.frames = std::move(frames);
  }

  std::string why(bool is_interrupted) const {
    const int rounds = int(state_.rounds.size());
    std::string text = "The object was tracked and its motion fitted in " + std::to_string(rounds) +
                       (rounds == 1 ? " round" : " rounds in turns");
    if (!is_both_) return text + ".";
    text +=
        ", and the points were fitted themselves; every " + std::to_string(every_so_many) + "th frame was left out. ";
    if (!result_.loop || !result_.direct) return text + "It was interrupted before they were compared.";
    const auto said = [](const HeldOutFrames& f) {
      return f.succeeded ? text_of("%.4g", f.cost) + " (" + text_of("%.3g", 1e3 * f.surface_rms) + " mm rms)"
                         : std::string("cannot be simulated");
    };
    return text + "Cost of those frames: " + said(*result_.loop) + " of the tracked motion's estimate, " +
           said(*result_.direct) + " of the points'; " + (state_.keeps_loop ? "the tracked motion's" : "the points'") +
           (is_interrupted ? " was kept; it was interrupted before that was finished with all frames."
                           : " was kept and finished with all frames.");
  }

  std::vector<RecordedCapture> all_;
  FitOptions options_;
  FitMonitor monitor_;
  bool is_both_;
  std::vector<RecordedCapture> training_, held_out_;
  std::vector<FollowedRecording> followed_;
  std::vector<std::string> notes_;  // of reading the recordings, which the fits tell too
  FitState::Tracking state_;
  FitState left_;  // by an interruption
  std::vector<std::shared_ptr<const Track>> tracks_;
  // The part under way.
  Part part_ = Part::Round;
  std::unique_ptr<PassPlanner> inner_;
  std::string name_;
  double done_from_ = 0.0, done_to_ = 1.0;
  TrackingRound round_;
  VectorX moduli_before_;
  // What came out.
  std::optional<FitOutcome> loop_, direct_, final_;
  TrackingOutcome result_;
  std::vector<std::pair<int, FitEvent>> history_;  // with the number of control moduli
  long long forward_steps_ = 0;
};

}  // namespace

bool tracks(const std::vector<RecordedCapture>& recordings, const FitOptions& options) {
  return use_of(recordings, options) != TrackingUse::Off;
}

std::unique_ptr<PassPlanner> planner_of_tracking(std::vector<RecordedCapture> recordings, const FitOptions& options,
                                                 const FitMonitor& monitor, FitState resume) {
  return std::make_unique<TrackingLoop>(std::move(recordings), options, monitor, std::move(resume));
}

}  // namespace pliant
