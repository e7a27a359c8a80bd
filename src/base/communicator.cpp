#include "base/communicator.hpp"

#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <string_view>
#include <utility>

#include "base/bytes.hpp"
#include "base/error.hpp"

namespace pliant {

#ifdef PLIANT_WITH_MPI
std::shared_ptr<Communicator> mpi_processes();  // mpi_communicator.cpp
#endif

namespace {

/// A number in the environment; `otherwise` where there is none.
int number_of_environment(const char* name, int otherwise) {
  const char* text = std::getenv(name);
  if (!text || *text == '\0') return otherwise;
  char* end = nullptr;
  const long number = std::strtol(text, &end, 10);
  return *end == '\0' && number >= 0 ? int(number) : otherwise;
}

/// The processors that this process may run on.
std::vector<int> allowed_processors() {
  cpu_set_t set;
  CPU_ZERO(&set);
  std::vector<int> processors;
  if (::sched_getaffinity(0, sizeof set, &set) == 0)
    for (int i = 0; i < CPU_SETSIZE; ++i)
      if (CPU_ISSET(i, &set)) processors.push_back(i);
  return processors;
}

std::string name_of_machine() {
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? std::string(name.data()) : std::string();
}

}  // namespace

void SingleProcess::abort(int exit_code) { std::_Exit(exit_code); }

Launch launch_of_environment() {
  // Open MPI's mpirun; MPICH, Intel MPI and srun --mpi=pmi2; srun --mpi=pmix, which leaves the number to Slurm.
  for (const auto& [rank, size] : {std::pair{"OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE"},
                                   std::pair{"PMI_RANK", "PMI_SIZE"}, std::pair{"PMIX_RANK", "SLURM_STEP_NUM_TASKS"}})
    if (const int number = number_of_environment(rank, -1); number >= 0) {
      const Launch launch{number, number_of_environment(size, 1)};
      if (launch.size > 1) return launch;
    }
  return {};
}

std::vector<std::string> environment_without_launch() {
  std::vector<std::string> kept;
  for (char** variable = ::environ; variable && *variable; ++variable) {
    const std::string_view text = *variable;
    const auto begins = [&](const char* prefix) { return text.starts_with(prefix); };
    if (!begins("OMPI_") && !begins("PMIX_") && !begins("PMI_") && !begins("ORTE_")) kept.emplace_back(text);
  }
  return kept;
}

bool has_mpi() {
#ifdef PLIANT_WITH_MPI
  return true;
#else
  return false;
#endif
}

std::shared_ptr<Communicator> launched_processes() {
  const Launch launch = launch_of_environment();
  if (launch.size == 1) return std::make_shared<SingleProcess>();
#ifdef PLIANT_WITH_MPI
  std::shared_ptr<Communicator> all = mpi_processes();
  if (all->size() != launch.size)
    throw InputError({{},
                      std::to_string(launch.size) + " processes were started together, and MPI knows of " +
                          std::to_string(all->size()),
                      "the launcher of the MPI that this program was built with",
                      "start it with that one's mpirun"});
  return all;
#else
  throw InputError(
      {{},
       std::to_string(launch.size) + " processes were started together, and this program is built without MPI",
       "one process, or a build with MPI",
       "configure with -DPLIANT_WITH_MPI=ON (Debian: libopenmpi-dev), or start it without mpirun"});
#endif
}

int fair_threads(Communicator& communicator) {
  const std::string machine = name_of_machine();
  const std::vector<int> own = allowed_processors();
  ByteWriter writer;
  writer.add(machine), writer.add(own);
  std::vector<int> users(CPU_SETSIZE, 0);  // processes on this machine, of each processor
  for (const std::string& bytes : communicator.all_gather(writer.take())) {
    ByteReader reader(bytes);
    if (reader.get<std::string>() != machine) continue;
    for (const int processor : reader.get<std::vector<int>>()) ++users[std::size_t(processor)];
  }
  double share = 0.0;
  for (const int processor : own) share += 1.0 / std::max(1, users[std::size_t(processor)]);
  constexpr double rounding = 1e-9;
  return std::max(1, int(share + rounding));
}

}  // namespace pliant
