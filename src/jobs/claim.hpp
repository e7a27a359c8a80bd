#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

namespace pliant {

/// The right of one process to run a job, among all that share the batch's folder: a file that exists as long as the
/// process runs, is touched now and then, and lapses where that stops.
class Claim {
 public:
  /// @param file   of the claim, on the file system that the processes share; its folder exists
  /// @param lapse  a claim that was not touched for so long is taken over
  /// @return       nothing where another process holds it
  /// Throws InputError where the file cannot be made.
  static std::optional<Claim> take(const std::filesystem::path& file, std::chrono::seconds lapse = default_lapse);
  static constexpr std::chrono::seconds default_lapse{180};

  Claim(Claim&&) noexcept;
  Claim& operator=(Claim&&) = delete;
  /// Gives it back.
  ~Claim();

 private:
  struct Pulse;
  explicit Claim(std::unique_ptr<Pulse> pulse);
  std::unique_ptr<Pulse> pulse_;
};

}  // namespace pliant
