#include "base/spsc_ring.hpp"

#include <thread>

namespace tandem {
namespace {

TEST(SpscRing, CountsWhatItRefusesWhenFull) {
  SpscRing ring(8, 4);
  for (int i = 0; i < 6; ++i) {
    if (!ring.begin_push().empty()) ring.end_push();
  }
  EXPECT_EQ(ring.size(), 4U);
  EXPECT_EQ(ring.dropped(), 2U);
}

TEST(SpscRing, UsesItsFirstSlotsAgainOnceItIsEmpty) {
  SpscRing ring(8, 4);
  const auto push = [&] {
    const std::byte* slot = ring.begin_push().data();
    ring.end_push();
    return slot;
  };
  const std::byte* const first = push();
  EXPECT_EQ(push(), first + 8);
  ring.pop();
  EXPECT_EQ(push(), first + 16);  // one is in use: they follow each other
  ring.pop();
  ring.pop();
  for (int round = 0; round < 3; ++round) {
    EXPECT_EQ(push(), first);
    EXPECT_EQ(ring.front().data(), first);
    ring.pop();
  }
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(push(), first + 8 * i);
  EXPECT_TRUE(ring.begin_push().empty());
}

TEST(SpscRing, HandsEverySlotOverInOrderBetweenThreads) {
  SpscRing ring(sizeof(std::uint64_t), 64);
  constexpr std::uint64_t kCount = 200'000;
  std::jthread producer([&] {
    for (std::uint64_t i = 0; i < kCount;) {
      auto slot = ring.begin_push();
      if (slot.empty()) {
        std::this_thread::yield();
        continue;
      }
      std::memcpy(slot.data(), &i, sizeof i);
      ring.end_push();
      ++i;
    }
  });
  for (std::uint64_t expected = 0; expected < kCount;) {
    auto slot = ring.front();
    if (slot.empty()) {
      std::this_thread::yield();
      continue;
    }
    std::uint64_t value = 0;
    std::memcpy(&value, slot.data(), sizeof value);
    ASSERT_EQ(value, expected);
    ring.pop();
    ++expected;
  }
}

}  // namespace
}  // namespace tandem
