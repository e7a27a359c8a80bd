#include "base/plausible_size.hpp"

#include <limits>

#include "input_errors.hpp"

namespace pliant::plausible_size_test {

using test::complaint_of;
using ::testing::HasSubstr;

TEST(PlausibleSize, TakesWhatIsSmallOrWhatPackingMakes) {
  EXPECT_NO_THROW(require_plausible_size(10, std::size_t(16) << 20, {"a.bin"}, "a chunk"));
  EXPECT_NO_THROW(require_plausible_size(std::size_t(1) << 20, std::size_t(1032) << 20, {"a.bin"}, "a chunk"));
}

TEST(PlausibleSize, RefusesWhatNoPackingMakes) {
  EXPECT_THAT(complaint_of([] {
                require_plausible_size(10, (std::size_t(16) << 20) + 1, {"a.bin", 7}, "a chunk");
              }),
              HasSubstr("a.bin:7: a chunk of 16777217 bytes in 10 bytes of the file"));
  EXPECT_THROW(require_plausible_size(std::size_t(1) << 20, std::size_t(1034) << 20, {"a.bin"}, "a chunk"), InputError);
  EXPECT_THROW(require_plausible_size(0, std::numeric_limits<std::size_t>::max(), {"a.bin"}, "a chunk"), InputError);
}

}  // namespace pliant::plausible_size_test
