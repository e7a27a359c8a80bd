// A bar and a leaf that swing, seen by three depth sensors at 30 Hz: noise of 3 mm, a third of the surface hidden, one
// point in a hundred an outlier. The tracker has other elements, another mesh, another integrator and longer steps than
// the truth; the physics are the same (an inverse crime in that). Each object is tracked with its own Young's modulus
// and with wrong ones. JSON on stdout.
//   pliant_tracking [object=bar|leaf] [motion=slow|fast] [elements=linear|quadratic] [hidden=middle|end] [frames=75]
//                   [pixels=160] [moduli=1,0.1,10] [seed=1]

#include <chrono>
#include <nlohmann/json.hpp>
#include <sstream>

#include "choices.hpp"
#include "support/swinging.hpp"

namespace pliant {
namespace {

using nlohmann::json;

test::SwingOptions options_of(Choices& choices) {
  test::SwingOptions options;
  const bool is_fast = choices["motion"] == "fast", is_quadratic = choices["elements"] == "quadratic";
  options.tracked_is_quadratic = is_quadratic;
  options.held = 3;
  options.frames = std::stoi(choices["frames"]);
  if (choices["object"] == "leaf") {
    options.shape = test::SwingShape::Leaf;
    options.youngs_modulus = 8e6;
    options.pulls = {{0.0, is_fast ? 0.03 : 0.02, is_fast ? 0.2 : 0.05}, {0.0, 0.0, -0.02}};
    options.true_cells = {14, 5, 1};
    options.tracked_cells = is_quadratic ? Eigen::Vector3i(10, 4, 1) : Eigen::Vector3i(24, 8, 1);
  } else {
    options.youngs_modulus = is_fast ? 1.5e6 : 5e5;
    options.pulls.front() *= is_fast ? 1.6 : 1.0;
    options.tracked_cells = is_quadratic ? Eigen::Vector3i(1, 1, 10) : Eigen::Vector3i(3, 3, 27);
  }
  return options;
}

struct Tracking {
  explicit Tracking(Choices of) : choices(std::move(of)), swing(options_of(choices)) {}

  json run() {
    test::Sensors sensors = test::three_sensors(swing, std::stoi(choices["pixels"]));
    sensors.seed = unsigned(std::stoi(choices["seed"]));
    const auto hidden = choices["hidden"] == "end" ? test::is_in_end_third : test::is_in_middle_third;
    sensors.hidden = [this, hidden](const Vector3& p) { return hidden(swing.options.shape, p); };
    const test::SwingRecording recorded(swing, sensors);
    json tracks = json::array();
    std::istringstream moduli(choices["moduli"]);
    for (std::string factor; std::getline(moduli, factor, ',');) tracks.push_back(follow(recorded, std::stod(factor)));
    return {{"choices", choices},
            {"size", swing.size},
            {"youngs_modulus", swing.theta[swing.layout.youngs_moduli[0]]},
            {"true_nodes", swing.truth->node_count()},
            {"nodes", swing.body->node_count()},
            {"elements", swing.body->element_count()},
            {"frames", swing.frame_count()},
            {"points", recorded.observed.front().points.size()},
            {"noise", sensors.noise},
            {"outliers", sensors.outliers},
            {"fastest", swing.fastest()},
            {"tracks", tracks}};
  }

  json follow(const test::SwingRecording& recorded, double factor) const {
    VectorX theta = swing.theta;
    swing.layout.scale_moduli(theta, factor);
    const auto begin = std::chrono::steady_clock::now();
    const Track track = recorded.track(swing, theta);
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    std::vector<double> errors;
    double sum = 0.0, worst = 0.0, confidence = 1.0;
    int rounds = 0, beyond = 0;
    for (const TrackedFrame& frame : track.frames) {
      errors.push_back(swing.error(frame.frame, frame.nodes));
      sum += errors.back();
      worst = std::max(worst, errors.back());
      confidence = std::min(confidence, frame.confidence);
      rounds += frame.rounds;
      beyond += errors.back() > 0.01 ? 1 : 0;
    }
    const auto frames = double(track.frames.size());
    return {{"modulus_factor", factor},
            {"mean_error", sum / frames},
            {"worst_error", worst},
            {"frames_beyond_one_percent", beyond},
            {"lost_at", track.lost_at ? json(*track.lost_at) : json(nullptr)},
            {"least_confidence", confidence},
            {"samples", track.surface.vertices.size()},
            {"rounds", rounds / frames},
            {"seconds_per_frame", seconds / frames},
            {"correspondence", track.times.correspondence / frames},
            {"motion", track.times.motion / frames},
            {"visibility", track.times.visibility / frames},
            {"errors", errors}};
  }

  Choices choices;
  test::Swing swing;
};

}  // namespace
}  // namespace pliant

int main(int argc, char** argv) {
  return pliant::run_experiment<pliant::Tracking>("pliant_tracking", argc, argv,
                                                  {{"object", "bar"},
                                                   {"motion", "slow"},
                                                   {"elements", "linear"},
                                                   {"hidden", "middle"},
                                                   {"frames", "75"},
                                                   {"pixels", "160"},
                                                   {"moduli", "1,0.1,10"},
                                                   {"seed", "1"}});
}
