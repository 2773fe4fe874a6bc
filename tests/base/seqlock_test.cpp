#include "base/seqlock.hpp"

#include <gtest/gtest.h>

#include <array>
#include <thread>

namespace tandem {
namespace {

struct Pair {
  std::uint64_t one, other;
};

TEST(Seqlock, IsZeroBeforeTheFirstWrite) {
  const Seqlock<Pair> lock(2);
  std::array<Pair, 2> read{Pair{7, 7}, Pair{7, 7}};
  ASSERT_TRUE(lock.read(read));
  EXPECT_EQ(read[1].other, 0U);
}

TEST(Seqlock, ReadsWhatWasWrittenLast) {
  Seqlock<Pair> lock(2);
  lock.write(std::array{Pair{1, 2}, Pair{3, 4}});
  lock.write(std::array{Pair{5, 6}, Pair{7, 8}});
  std::array<Pair, 2> read{};
  ASSERT_TRUE(lock.read(read));
  EXPECT_EQ(read[0].one, 5U);
  EXPECT_EQ(read[1].other, 8U);
}

TEST(Seqlock, NeverShowsPartsOfTwoWrites) {
  Seqlock<Pair> lock(64);
  std::atomic<bool> done{false};
  std::thread writer([&] {
    std::vector<Pair> values(64);
    for (std::uint64_t n = 1; !done.load(); ++n) {
      for (Pair& pair : values) pair = {n, ~n};
      lock.write(values);
    }
  });
  std::vector<Pair> read(64);
  while (!lock.read(read) || read[0].one == 0) {  // until the writer is at work
  }
  std::uint64_t last = 0;
  for (int i = 0; i < 20'000; ++i) {
    if (!lock.read(read)) continue;
    for (const Pair& pair : read) {
      ASSERT_EQ(pair.one, read[0].one);
      ASSERT_EQ(pair.other, ~read[0].one);
    }
    ASSERT_GE(read[0].one, last);
    last = read[0].one;
  }
  done = true;
  writer.join();
  EXPECT_GT(last, 0U);
}

}  // namespace
}  // namespace tandem
