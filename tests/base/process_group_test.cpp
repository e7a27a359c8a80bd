// Processes that carry out one task together: threads stand in for them here.
#include "base/process_group.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <bit>
#include <cstdint>
#include <cstdlib>

#include "base/bytes.hpp"
#include "base/error.hpp"
#include "support/thread_ranks.hpp"

namespace pliant::process_group_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

TEST(SharedOut, TheLargestFirstToWhomHasLeast) {
  EXPECT_THAT(shared_out({1.0, 5.0, 2.0, 4.0}, 2), ElementsAre(0, 0, 1, 1));
  EXPECT_THAT(shared_out({3.0, 3.0, 3.0}, 2), ElementsAre(0, 1, 0)) << "of equals the lower number";
  EXPECT_THAT(shared_out({1.0, 2.0}, 4), ElementsAre(1, 0));
  EXPECT_THAT(shared_out({1.0, 2.0}, 1), ElementsAre(0, 0));
  EXPECT_TRUE(shared_out({}, 3).empty());
}

TEST(Bytes, ComeBackAsTheyWere) {
  MatrixX matrix(2, 3);
  matrix << 1.0, -0.0, 3.0, not_a_number, infinite, 6.0;
  const VectorX vector = VectorX::LinSpaced(5, 0.1, 0.7);
  const std::vector<float> floats = {1.5f, 2.5f};
  ByteWriter writer;
  writer.add(7), writer.add(true), writer.add(std::string("words\0and", 9)), writer.add(vector), writer.add(matrix);
  writer.add(floats), writer.add(MatrixX()), writer.add(std::string());
  const std::string bytes = writer.take();
  ByteReader reader(bytes);
  EXPECT_EQ(reader.get<int>(), 7);
  EXPECT_TRUE(reader.get<bool>());
  EXPECT_EQ(reader.get<std::string>(), std::string("words\0and", 9));
  EXPECT_EQ(reader.get<VectorX>(), vector);
  const auto back = reader.get<MatrixX>();
  ASSERT_EQ(back.rows(), 2);
  ASSERT_EQ(back.cols(), 3);
  for (Eigen::Index i = 0; i < 6; ++i)
    EXPECT_EQ(std::bit_cast<std::uint64_t>(back.data()[i]), std::bit_cast<std::uint64_t>(matrix.data()[i])) << i;
  EXPECT_EQ(reader.get<std::vector<float>>(), floats);
  EXPECT_EQ(reader.get<MatrixX>().size(), 0);
  EXPECT_FALSE(reader.at_end());
  EXPECT_EQ(reader.get<std::string>(), "");
  EXPECT_TRUE(reader.at_end());
  EXPECT_THROW((void)reader.get<int>(), std::runtime_error);
  ByteReader cut(std::string_view(bytes).substr(0, 12));
  (void)cut.get<int>(), (void)cut.get<bool>();
  EXPECT_THROW((void)cut.get<std::string>(), std::runtime_error);
}

TEST(ProcessGroup, OfOneChangesNothing) {
  bool asked = false;
  ProcessGroup alone(std::make_shared<SingleProcess>(), [&] { return asked; });
  EXPECT_TRUE(alone.is_alone());
  EXPECT_TRUE(alone.is_first());
  EXPECT_THAT(alone.gather("work", [] { return std::string("share"); }), ElementsAre("share"));
  EXPECT_EQ(alone.of_first("word", [] { return std::string("word"); }), "word");
  struct Own : std::runtime_error {
    using std::runtime_error::runtime_error;
  };
  EXPECT_THROW((void)alone.gather("work", []() -> std::string { throw Own("own"); }), Own) << "exceptions stay theirs";
  EXPECT_FALSE(alone.is_interrupted());
  asked = true;
  EXPECT_TRUE(alone.is_interrupted()) << "at once";
  EXPECT_TRUE(alone.agrees_to_stop());
}

TEST(ProcessGroup, GathersSharesInTheOrderOfRanks) {
  const auto thrown = test::run_ranks(3, [](const auto& communicator) {
    ProcessGroup group(communicator);
    EXPECT_EQ(group.size(), 3);
    for (int round = 0; round < 50; ++round) {
      const std::string own = std::to_string(10 * round + group.rank());
      const std::string first = std::to_string(10 * round);
      EXPECT_THAT(group.gather("work", [&] { return own; }),
                  ElementsAre(first, std::to_string(10 * round + 1), std::to_string(10 * round + 2)));
      EXPECT_EQ(group.of_first("word", [&] { return own; }), first);
    }
  });
  for (const std::exception_ptr& failure : thrown) EXPECT_EQ(test::what_of(failure), "");
}

TEST(ProcessGroup, WhatOneThrowsIsThrownInAll) {
  for (const char* kind : {"input", "interrupted", "other"}) {
    const auto thrown = test::run_ranks(3, [&](const auto& communicator) {
      ProcessGroup group(communicator);
      const auto fail = [&]() -> std::string {
        if (group.rank() != 1) return "fine";
        if (std::string("input") == kind)
          throw InputError({{"capture.toml", 3, 4}, "a wrong word", "another one", "write that"});
        if (std::string("interrupted") == kind) throw Interrupted();
        throw std::logic_error("no room");
      };
      (void)group.gather("work", fail);
    });
    for (const std::exception_ptr& failure : thrown) {
      ASSERT_TRUE(failure) << kind;
      try {
        std::rethrow_exception(failure);
      } catch (const InputError& error) {
        EXPECT_STREQ(kind, "input");
        EXPECT_EQ(error.problems().front().place.line, 3);
        EXPECT_STREQ(error.what(), "capture.toml:3:4: a wrong word; expected another one; write that");
      } catch (const Interrupted&) {
        EXPECT_STREQ(kind, "interrupted");
      } catch (const std::runtime_error& error) {
        EXPECT_STREQ(kind, "other");
        EXPECT_STREQ(error.what(), "no room");
      }
    }
  }
}

TEST(ProcessGroup, AgreesOnAStopWhereTheyMeet) {
  std::atomic<bool> asked = false;
  const auto thrown = test::run_ranks(2, [&](const auto& communicator) {
    ProcessGroup group(communicator, [&] { return communicator->rank() == 1 && asked; });
    (void)group.gather("work", [] { return std::string(); });
    EXPECT_FALSE(group.is_interrupted());
    if (group.rank() == 1) asked = true;
    EXPECT_FALSE(group.is_interrupted()) << "nobody else knows";
    EXPECT_EQ(group.is_asked_to_stop(), group.rank() == 1);
    (void)group.gather("work", [] { return std::string(); });
    EXPECT_TRUE(group.is_interrupted());
    EXPECT_TRUE(group.agrees_to_stop());
  });
  for (const std::exception_ptr& failure : thrown) EXPECT_EQ(test::what_of(failure), "");
}

TEST(ProcessGroup, ThatHasComeApartSaysSo) {
  const auto thrown = test::run_ranks(2, [](const auto& communicator) {
    ProcessGroup group(communicator);
    (void)group.gather(group.is_first() ? "a cost" : "a gradient", [] { return std::string(); });
  });
  for (const std::exception_ptr& failure : thrown)
    EXPECT_THAT(test::what_of(failure), HasSubstr("the first is at \"a cost\", process 2 at \"a gradient\""));
}

TEST(Communicator, OfTheFirstOnesLeavesOutTheOthers) {
  const auto thrown = test::run_ranks(3, [](const auto& communicator) {
    const auto part = communicator->first(2);
    EXPECT_EQ(part != nullptr, communicator->rank() < 2);
    if (part) {
      EXPECT_THAT(part->all_gather(std::to_string(part->rank())), ElementsAre("0", "1"));
    }
    EXPECT_THAT(communicator->end(communicator->rank(), std::nullopt).value(), ElementsAre(0, 1, 2));
  });
  for (const std::exception_ptr& failure : thrown) EXPECT_EQ(test::what_of(failure), "");
}

TEST(Threads, OfProcessesOfOneMachineAreItsProcessorsSharedOut) {
  SingleProcess alone;
  const int all = fair_threads(alone);
  EXPECT_GE(all, 1);
  const auto thrown = test::run_ranks(
      2, [&](const auto& communicator) { EXPECT_EQ(fair_threads(*communicator), std::max(1, all / 2)); });
  for (const std::exception_ptr& failure : thrown) EXPECT_EQ(test::what_of(failure), "");
}

/// Sets variables of the environment for a while.
class Variables {
 public:
  explicit Variables(std::map<std::string, std::string> variables) : variables_(std::move(variables)) {
    for (const auto& [name, value] : variables_) ::setenv(name.c_str(), value.c_str(), 1);
  }
  ~Variables() {
    for (const auto& [name, value] : variables_) ::unsetenv(name.c_str());
  }

 private:
  std::map<std::string, std::string> variables_;
};

TEST(Launch, IsReadOffTheEnvironment) {
  EXPECT_EQ(launch_of_environment().size, 1) << "this test was started by no launcher";
  {
    const Variables open_mpi({{"OMPI_COMM_WORLD_RANK", "2"}, {"OMPI_COMM_WORLD_SIZE", "4"}});
    EXPECT_EQ(launch_of_environment().rank, 2);
    EXPECT_EQ(launch_of_environment().size, 4);
    for (const std::string& variable : environment_without_launch()) EXPECT_FALSE(variable.starts_with("OMPI_"));
  }
  {
    const Variables alone({{"OMPI_COMM_WORLD_RANK", "0"}, {"OMPI_COMM_WORLD_SIZE", "1"}});
    EXPECT_EQ(launched_processes()->size(), 1);
  }
  {
    const Variables mpich({{"PMI_RANK", "1"}, {"PMI_SIZE", "3"}});
    EXPECT_EQ(launch_of_environment().rank, 1);
    EXPECT_EQ(launch_of_environment().size, 3);
  }
  const Variables slurm({{"PMIX_RANK", "5"}, {"SLURM_STEP_NUM_TASKS", "8"}});
  EXPECT_EQ(launch_of_environment().rank, 5);
  EXPECT_EQ(launch_of_environment().size, 8);
}

}  // namespace
}  // namespace pliant::process_group_test
