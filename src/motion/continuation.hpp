#pragma once

#include <optional>

namespace pliant {

struct ContinuationOptions {
  double first = 0.5;           ///< share of the load tried first, (0, 1]
  double largest = 1.0;         ///< step of the load, (0, 1]
  double growth = 1.5;          ///< of the step after one that was carried, >= 1
  double shrink = 0.5;          ///< of the step after one that was not followed, (0, 1)
  double least = 1e-3;          ///< step below which it is given up, of the load
  double least_relative = 0.0;  ///< the same, of the share that is carried already; the greater counts
};

/// Steps of a load from nothing (0) to all of it (1), as large as a solver follows (incremental loading): it proposes a
/// share, is told what became of it, and proposes the next.
///   LoadContinuation steps(options);
///   while (const auto share = steps.next()) steps.report(attempt(*share));
class LoadContinuation {
 public:
  enum class Outcome {
    Carried,      ///< an equilibrium was found
    NotFollowed,  ///< none was found: a shorter step may help
    TooMuch,      ///< there is one, but it is not stable: only less load helps, and the limit is closed in on
  };
  explicit LoadContinuation(const ContinuationOptions& options = {});

  /// The share of the load to try, from the one that is carried. Nothing: all is carried, or it is given up.
  [[nodiscard]] std::optional<double> next() const;
  void report(Outcome outcome);
  double carried() const { return carried_; }
  bool is_complete() const { return carried_ >= 1.0; }

 private:
  double least() const;
  double share() const;
  double towards_limit() const;

  ContinuationOptions options_;
  double carried_ = 0.0, step_;
  std::optional<double> limit_;  // smallest share that was too much
};

}  // namespace pliant
