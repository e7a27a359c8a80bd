#include "jobs/claim.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <memory>

#include "base/error.hpp"

namespace pliant {

namespace {

namespace fs = std::filesystem;
using Seconds = std::chrono::seconds;

std::string own_name() {
  std::array<char, 256> host{};
  ::gethostname(host.data(), host.size() - 1);
  return std::string(host.data()) + " " + std::to_string(::getpid());
}

/// Makes the file where there is none. False where there is one.
bool create(const fs::path& file) {
  const int handle = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL, 0644);
  if (handle < 0) {
    if (errno == EEXIST) return false;
    throw InputError(
        {{file}, std::string("it cannot be made: ") + std::strerror(errno), "", "is the folder there, and writable?"});
  }
  const std::string text = own_name() + "\n";
  const bool is_written = ::write(handle, text.data(), text.size()) == ssize_t(text.size());
  ::close(handle);
  return is_written || fs::exists(file);
}

/// Time by the clock of the file system, which the processes share: machines' own clocks differ.
std::optional<fs::file_time_type> now_at(const fs::path& folder) {
  const fs::path probe = folder / (".now." + own_name());
  const int handle = ::open(probe.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  if (handle < 0) return std::nullopt;
  const bool is_written = ::write(handle, "\n", 1) == 1;
  ::close(handle);
  std::error_code error;
  const auto time = fs::last_write_time(probe, error);
  fs::remove(probe, error);
  return is_written ? std::optional(time) : std::nullopt;
}

bool has_lapsed(const fs::path& file, Seconds lapse) {
  std::error_code error;
  const auto touched = fs::last_write_time(file, error);
  if (error) return false;  // given back meanwhile: the next look finds it free
  const auto now = now_at(file.parent_path());
  return now && *now - touched > lapse;
}

}  // namespace

/// A thread that touches the file.
struct Claim::Pulse {
  fs::path file;
  std::mutex mutex;
  std::condition_variable ends;
  bool has_ended = false;
  std::thread thread;

  Pulse(fs::path claimed, Seconds lapse) : file(std::move(claimed)) {
    thread = std::thread([this, every = std::max(Seconds(1), lapse / 6)] {
      std::unique_lock lock(mutex);
      while (!ends.wait_for(lock, every, [this] { return has_ended; })) {
        // Written, so that the time is the file server's.
        const int handle = ::open(file.c_str(), O_WRONLY | O_TRUNC);
        if (handle < 0) continue;
        const std::string text = own_name() + "\n";
        (void)!::write(handle, text.data(), text.size());
        ::close(handle);
      }
    });
  }
  ~Pulse() {
    {
      const std::lock_guard lock(mutex);
      has_ended = true;
    }
    ends.notify_all();
    thread.join();
    std::error_code error;
    fs::remove(file, error);
  }
};

Claim::Claim(std::unique_ptr<Pulse> pulse) : pulse_(std::move(pulse)) {}
Claim::Claim(Claim&&) noexcept = default;
Claim::~Claim() = default;

std::optional<Claim> Claim::take(const fs::path& file, Seconds lapse) {
  if (!create(file)) {
    if (!has_lapsed(file, lapse)) return std::nullopt;
    // Of several that find it lapsed one alone can rename it.
    const fs::path taken = file.parent_path() / (file.filename().string() + ".lapsed." + own_name());
    std::error_code error;
    fs::rename(file, taken, error);
    if (error) return std::nullopt;
    fs::remove(taken, error);
    if (!create(file)) return std::nullopt;
  }
  return Claim(std::make_unique<Pulse>(file, lapse));
}

}  // namespace pliant
