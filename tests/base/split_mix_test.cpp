#include "base/split_mix.hpp"

#include <gtest/gtest.h>

namespace tandem {
namespace {

// The sequence that other implementations publish for this seed. Another generator would change
// every seeded run.
TEST(SplitMix, IsThePublishedGenerator) {
  std::uint64_t state = 1234567;
  for (const std::uint64_t expected :
       {6457827717110365317U, 3203168211198807973U, 9817491932198370423U, 4593380528125082431U,
        16408922859458223821U}) {
    EXPECT_EQ(split_mix(state), expected);
  }
}

}  // namespace
}  // namespace tandem
