#include "motion/continuation.hpp"

#include <algorithm>

namespace pliant {

LoadContinuation::LoadContinuation(const ContinuationOptions& options) : options_(options), step_(options.first) {}

double LoadContinuation::least() const { return std::max(options_.least, options_.least_relative * carried_); }
double LoadContinuation::share() const { return std::min(1.0, carried_ + step_); }
double LoadContinuation::towards_limit() const { return carried_ > 0.0 ? 0.5 * (*limit_ - carried_) : 0.25 * *limit_; }

std::optional<double> LoadContinuation::next() const {
  if (is_complete() || step_ < least()) return std::nullopt;
  return share();
}

void LoadContinuation::report(Outcome outcome) {
  const double tried = share();
  if (outcome == Outcome::Carried) {
    step_ = std::min(options_.growth * step_, options_.largest);
    if (limit_ && tried >= *limit_) limit_.reset(), step_ *= 2.0;
    carried_ = tried;
    // Near the limit its last shortest step is tried once.
    if (limit_) step_ = *limit_ - carried_ > 2.0 * least() ? towards_limit() : std::max(*limit_ - carried_, least());
    return;
  }
  if (outcome == Outcome::TooMuch) {
    limit_ = limit_ ? std::min(*limit_, tried) : tried;
    step_ = towards_limit();
  } else {
    step_ = options_.shrink * (tried - carried_);
  }
}

}  // namespace pliant
