#include "base/process_group.hpp"

#include <algorithm>
#include <exception>
#include <numeric>
#include <stdexcept>

#include "base/bytes.hpp"
#include "base/error.hpp"

namespace pliant {

namespace {

enum class Came : char { WithBytes, Interrupted, WithBadInput, WithFailure };

/// What one process hands in.
struct Handed {
  std::string what;
  bool is_asked = false;
  Came came = Came::WithBytes;
  std::string bytes;  // or what was thrown
};

std::string packed(const InputError& error) {
  ByteWriter writer;
  writer.add(error.problems().size());
  for (const Problem& p : error.problems()) {
    writer.add(p.place.file.string()), writer.add(p.place.line), writer.add(p.place.column);
    writer.add(p.found), writer.add(p.expected), writer.add(p.advice);
  }
  return writer.take();
}

std::vector<Problem> unpacked(const std::string& bytes) {
  ByteReader reader(bytes);
  std::vector<Problem> problems(reader.get<std::size_t>());
  for (Problem& p : problems) {
    p.place.file = reader.get<std::string>();
    reader.read(p.place.line), reader.read(p.place.column);
    reader.read(p.found), reader.read(p.expected), reader.read(p.advice);
  }
  return problems;
}

void make_share(Handed& own, const std::function<std::string()>& make) {
  try {
    own.bytes = make();
  } catch (const Interrupted&) {
    own.came = Came::Interrupted;
  } catch (const InputError& error) {
    own.came = Came::WithBadInput, own.bytes = packed(error);
  } catch (const std::exception& error) {
    own.came = Came::WithFailure, own.bytes = error.what();
  }
}

std::string packed(const Handed& own) {
  ByteWriter writer;
  writer.add(own.what), writer.add(own.is_asked), writer.add(own.came), writer.add(own.bytes);
  return writer.take();
}

Handed unpacked_share(const std::string& bytes) {
  ByteReader reader(bytes);
  Handed handed;
  reader.read(handed.what), reader.read(handed.is_asked), reader.read(handed.came), reader.read(handed.bytes);
  return handed;
}

void throw_failure(const Handed& handed) {
  switch (handed.came) {
    case Came::WithBytes:
      return;
    case Came::Interrupted:
      throw Interrupted();
    case Came::WithBadInput:
      throw InputError(unpacked(handed.bytes));
    case Came::WithFailure:
      throw std::runtime_error(handed.bytes);
  }
}

}  // namespace

ProcessGroup::ProcessGroup(std::shared_ptr<Communicator> communicator, std::function<bool()> asked)
    : communicator_(std::move(communicator)), asked_(std::move(asked)) {
  if (!communicator_) throw std::invalid_argument("a group of processes without a communicator");
}

std::vector<std::string> ProcessGroup::gather(std::string_view what, const std::function<std::string()>& make) {
  if (is_alone()) return {make()};
  Handed own;
  own.what = what;
  make_share(own, make);
  own.is_asked = is_asked_to_stop();
  std::vector<Handed> all;
  for (const std::string& bytes : communicator_->all_gather(packed(own))) all.push_back(unpacked_share(bytes));
  for (std::size_t r = 1; r < all.size(); ++r)
    if (all[r].what != all.front().what)
      throw std::runtime_error("the processes have come apart: the first is at \"" + all.front().what + "\", process " +
                               std::to_string(r + 1) + " at \"" + all[r].what +
                               "\"; run them on machines of one kind, with the same program and the same files");
  for (const Handed& handed : all)
    is_interrupted_ = is_interrupted_ || handed.is_asked || handed.came == Came::Interrupted;
  std::vector<std::string> shares;
  for (Handed& handed : all) {
    throw_failure(handed);
    shares.push_back(std::move(handed.bytes));
  }
  return shares;
}

std::string ProcessGroup::of_first(std::string_view what, const std::function<std::string()>& make) {
  return std::move(gather(what, [&] { return is_first() ? make() : std::string(); }).front());
}

bool ProcessGroup::is_interrupted() const { return is_alone() ? is_asked_to_stop() : is_interrupted_; }

bool ProcessGroup::agrees_to_stop() {
  if (is_alone()) return is_asked_to_stop();
  (void)gather("a stop", [] { return std::string(); });
  return is_interrupted_;
}

std::vector<int> shared_out(const std::vector<double>& work, int workers) {
  std::vector<std::size_t> order(work.size());
  std::iota(order.begin(), order.end(), std::size_t(0));
  std::ranges::stable_sort(order, std::ranges::greater(), [&](std::size_t i) { return work[i]; });
  std::vector<double> load(std::size_t(std::max(1, workers)), 0.0);
  std::vector<int> worker(work.size(), 0);
  for (const std::size_t i : order) {
    const auto least = std::ranges::min_element(load);
    worker[i] = int(least - load.begin());
    *least += work[i];
  }
  return worker;
}

}  // namespace pliant
