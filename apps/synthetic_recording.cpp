#include "synthetic_recording.hpp"

#include "commands.hpp"
#include "synthesis/scene_motion.hpp"

namespace pliant::apps {

void write_recording(const std::filesystem::path& folder, const SyntheticScene& scene) {
  const auto simulate = [](const SyntheticScene& of) {
    return simulate_scene(of, [](int done, int total) {
      stop_if_interrupted();
      show_progress("simulated", done, total);
      return true;
    });
  };
  write_synthetic_capture(folder, synthesise(scene, simulate),
                          [](int done, int total) { show_progress("recorded", done, total); });
}

}  // namespace pliant::apps
