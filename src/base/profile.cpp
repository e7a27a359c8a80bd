#include "base/profile.hpp"

#include <utility>

namespace pliant {

namespace {

std::atomic<Profile*> current_profile = nullptr;
thread_local Timed* innermost = nullptr;

}  // namespace

std::string_view activity_name(Activity activity) {
  constexpr std::array<std::string_view, activity_count> names = {
      "reading",       "meshing",  "load-free shapes", "equilibria", "steps",   "tangents",
      "adjoint steps", "mismatch", "tracking",         "vibrations", "pictures"};
  return names[std::size_t(activity)];
}

Profile::Recording::Recording(Profile& profile) : before_(current_profile.exchange(&profile)) {}
Profile::Recording::~Recording() { current_profile = before_; }

Profile* Profile::current() { return current_profile; }

void Profile::add(Activity activity, long long count, std::chrono::steady_clock::duration time) {
  counts_[std::size_t(activity)] += count;
  ticks_[std::size_t(activity)] += time.count();
}

void Profile::add(StageTime stage) {
  const std::lock_guard lock(mutex_);
  stages_.push_back(std::move(stage));
}

std::vector<ActivityTime> Profile::activities() const {
  using Clock = std::chrono::steady_clock;
  std::vector<ActivityTime> all;
  for (std::size_t i = 0; i < activity_count; ++i)
    if (counts_[i] > 0 || ticks_[i] > 0)
      all.push_back({std::string(activity_name(Activity(i))), counts_[i],
                     std::chrono::duration<double>(Clock::duration(ticks_[i].load())).count()});
  return all;
}

std::vector<StageTime> Profile::stages() const {
  const std::lock_guard lock(mutex_);
  return stages_;
}

Timed::Timed(Activity activity, long long count) : profile_(Profile::current()), activity_(activity), count_(count) {
  if (!profile_) return;
  around_ = std::exchange(innermost, this);
  begin_ = Clock::now();
}

Timed::~Timed() {
  if (!profile_) return;
  const Clock::duration taken = Clock::now() - begin_;
  innermost = around_;
  if (around_) around_->within_ += taken;
  profile_->add(activity_, count_, taken - within_);
}

}  // namespace pliant
