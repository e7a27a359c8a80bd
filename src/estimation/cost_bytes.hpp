#pragma once

#include "base/bytes.hpp"
#include "estimation/cost.hpp"

namespace pliant {

/// An evaluation as bytes for another process, to the last bit.
void write(const CostEvaluation& evaluation, ByteWriter& to);

/// Reads it back. Throws std::runtime_error where the bytes end too early.
[[nodiscard]] CostEvaluation read_evaluation(ByteReader& from);

}  // namespace pliant
