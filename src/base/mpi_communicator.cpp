// Processes that exchange what they find by MPI: the only source that knows it.
#include <mpi.h>

#include <algorithm>
#include <cstdlib>
#include <stdexcept>
#include <thread>

#include "base/communicator.hpp"

namespace pliant {

std::shared_ptr<Communicator> mpi_processes();

namespace {

using Clock = std::chrono::steady_clock;

/// Waits as MPI's own calls do not: who waits for long leaves its processor to others. False: not within `patience`.
bool wait(MPI_Request& request, std::optional<std::chrono::milliseconds> patience = std::nullopt) {
  using std::chrono::microseconds;
  constexpr microseconds shortest{20}, longest{2000};
  constexpr int part = 20;  // of what was waited so far: that much later it is noticed
  const auto begin = Clock::now();
  for (int done = 0;;) {
    MPI_Test(&request, &done, MPI_STATUS_IGNORE);
    if (done) return true;
    const auto waited = std::chrono::duration_cast<microseconds>(Clock::now() - begin);
    if (patience && waited > *patience) return false;
    if (waited < shortest * part)
      std::this_thread::yield();
    else
      std::this_thread::sleep_for(std::min(waited / part, longest));
  }
}

/// MPI between its start and its end.
struct Mpi {
  Mpi() {
    int provided = 0;
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_SERIALIZED, &provided);
    if (provided < MPI_THREAD_SERIALIZED)
      throw std::runtime_error("this MPI cannot be called from programs of several threads");
  }
  Mpi(const Mpi&) = delete;
  Mpi& operator=(const Mpi&) = delete;
  ~Mpi() { MPI_Finalize(); }
};

class MpiCommunicator : public Communicator {
 public:
  /// @param comm  its own
  MpiCommunicator(std::shared_ptr<Mpi> mpi, MPI_Comm comm) : mpi_(std::move(mpi)), comm_(comm) {
    MPI_Comm_rank(comm_, &rank_);
    MPI_Comm_size(comm_, &size_);
    MPI_Comm_dup(comm_, &ends_);
  }
  ~MpiCommunicator() override { MPI_Comm_free(&ends_), MPI_Comm_free(&comm_); }

  int rank() const override { return rank_; }
  int size() const override { return size_; }

  [[nodiscard]] std::vector<std::string> all_gather(std::string own) override {
    // The sizes first: whoever is late is waited for there, and what is large then goes without pauses.
    long long own_size = (long long)own.size();
    std::vector<long long> sizes((std::size_t(size_)));
    MPI_Request request;
    MPI_Iallgather(&own_size, 1, MPI_LONG_LONG, sizes.data(), 1, MPI_LONG_LONG, comm_, &request);
    (void)wait(request);
    std::vector<std::string> all((std::size_t(size_)));
    const long long most = std::max(1, (1 << 30) / size_), longest = *std::ranges::max_element(sizes);
    for (long long done = 0; done < longest; done += most) {  // counts of MPI are ints
      std::vector<int> counts, begins;
      int total = 0;
      for (const long long size : sizes) {
        counts.push_back(int(std::clamp(size - done, 0LL, most)));
        begins.push_back(total);
        total += counts.back();
      }
      std::string together(std::size_t(total), '\0');
      const char* part = own.data() + std::min(done, own_size);
      MPI_Iallgatherv(part, counts[std::size_t(rank_)], MPI_BYTE, together.data(), counts.data(), begins.data(),
                      MPI_BYTE, comm_, &request);
      (void)wait(request);
      for (std::size_t r = 0; r < all.size(); ++r)
        all[r].append(together, std::size_t(begins[r]), std::size_t(counts[r]));
    }
    return all;
  }

  [[nodiscard]] std::shared_ptr<Communicator> first(int count) override {
    MPI_Comm part;
    MPI_Comm_split(comm_, rank_ < count ? 0 : MPI_UNDEFINED, rank_, &part);
    if (part == MPI_COMM_NULL) return nullptr;
    return std::make_shared<MpiCommunicator>(mpi_, part);
  }

  [[nodiscard]] std::optional<std::vector<int>> end(int exit_code,
                                                    std::optional<std::chrono::milliseconds> patience) override {
    code_ = exit_code;
    codes_.resize(std::size_t(size_));  // both live on where the others are late
    MPI_Request request;
    MPI_Iallgather(&code_, 1, MPI_INT, codes_.data(), 1, MPI_INT, ends_, &request);
    if (!wait(request, patience)) return std::nullopt;
    return codes_;
  }

  [[noreturn]] void abort(int exit_code) override {
    MPI_Abort(MPI_COMM_WORLD, exit_code);
    std::_Exit(exit_code);
  }

 private:
  std::shared_ptr<Mpi> mpi_;
  MPI_Comm comm_, ends_ = MPI_COMM_NULL;
  int rank_ = 0, size_ = 1, code_ = 0;
  std::vector<int> codes_;
};

}  // namespace

std::shared_ptr<Communicator> mpi_processes() {
  auto mpi = std::make_shared<Mpi>();
  MPI_Comm all;
  MPI_Comm_dup(MPI_COMM_WORLD, &all);
  return std::make_shared<MpiCommunicator>(std::move(mpi), all);
}

}  // namespace pliant
