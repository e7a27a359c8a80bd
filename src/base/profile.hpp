#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

namespace pliant {

/// What a fit spends its time on. No two overlap: what runs within another is not counted for that one too.
enum class Activity {
  Reading,       ///< images and clouds, to points with noise
  Meshing,       ///< a body of elements out of a scan, and what is compared with its surface
  LoadFree,      ///< stress-free shapes of scans that sag, and their derivatives
  Equilibria,    ///< of what is at rest, held or pressed, and their derivatives
  Steps,         ///< time steps
  Tangents,      ///< of steps, along directions
  AdjointSteps,  ///< the reverse sweep
  Mismatch,      ///< of a frame, with its derivatives
  Tracking,      ///< correspondences and their maximisation
  Vibrations,    ///< natural frequencies and modes
  Pictures,      ///< of the report, and the page of the live object
};
constexpr std::size_t activity_count = std::size_t(Activity::Pictures) + 1;

/// For people and files: "steps", "adjoint steps".
std::string_view activity_name(Activity activity);

/// How often something was done, and how long threads were busy with it, all of them together.
struct ActivityTime {
  std::string name;  ///< as `activity_name` has it
  long long count = 0;
  double seconds = 0.0;
};

/// A stage of a fit that ended.
struct StageTime {
  std::string name;
  int start = 0, iterations = 0, elements = 0;
  double work = 0.0;     ///< nodes times time steps (`CostEvaluation::work`)
  double seconds = 0.0;  ///< wall time; stages of several starts run side by side
};

/// Where the time of a fit goes: what `Timed` scopes and stages in this process add while it is being recorded. Any
/// number of threads.
class Profile {
 public:
  /// While it lives, the process records into the profile; of two at a time, into the later one.
  class Recording {
   public:
    explicit Recording(Profile& profile);
    Recording(const Recording&) = delete;
    Recording& operator=(const Recording&) = delete;
    ~Recording();

   private:
    Profile* before_;
  };

  /// The one that is recorded into; null: none is.
  static Profile* current();

  void add(Activity activity, long long count, std::chrono::steady_clock::duration time);
  void add(StageTime stage);

  /// Those that were done at all, in the order of `Activity`.
  [[nodiscard]] std::vector<ActivityTime> activities() const;
  /// In the order in which they ended.
  [[nodiscard]] std::vector<StageTime> stages() const;

 private:
  std::array<std::atomic<long long>, activity_count> counts_{}, ticks_{};
  mutable std::mutex mutex_;
  std::vector<StageTime> stages_;
};

/// Adds the time that its scope takes in this thread, less that of scopes within it, to the profile that is recorded.
/// Without one it does next to nothing.
class Timed {
 public:
  /// @param count  how many it stands for: tangents of a step along so many directions
  explicit Timed(Activity activity, long long count = 1);
  Timed(const Timed&) = delete;
  Timed& operator=(const Timed&) = delete;
  ~Timed();

 private:
  using Clock = std::chrono::steady_clock;
  Profile* profile_;
  Activity activity_;
  long long count_;
  Timed* around_ = nullptr;
  Clock::time_point begin_;
  Clock::duration within_{};  // of scopes in this one
};

}  // namespace pliant
