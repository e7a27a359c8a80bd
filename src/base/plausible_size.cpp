#include "base/plausible_size.hpp"

namespace pliant {

void require_plausible_size(std::size_t held, std::size_t needed, const Place& place, const std::string& what) {
  constexpr std::size_t small = std::size_t(16) << 20, greatest_ratio = 1032;
  if (needed <= small || needed / greatest_ratio <= held) return;
  throw InputError(
      {place, what + " of " + std::to_string(needed) + " bytes in " + std::to_string(held) + " bytes of the file",
       "at most " + std::to_string(greatest_ratio) + " times as many", "the file is damaged; copy or write it again"});
}

}  // namespace pliant
