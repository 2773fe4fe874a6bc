#include "base/archive.hpp"

namespace tandem {
namespace {

struct Counter {
  int ticks = 0;
  std::vector<double> values = std::vector<double>(3);
  void archive(Archive& ar) { ar(ticks, values); }
};

TEST(Archive, ReadsBackWhatItWrote) {
  Counter counter{7, {1.0, 2.0, 3.0}};
  Archive out;
  out(counter);
  Archive in(out.bytes());
  Counter other;
  in(other);
  EXPECT_TRUE(in.ok());
  EXPECT_TRUE(in.at_end());
  EXPECT_EQ(other.ticks, 7);
  EXPECT_EQ(other.values, counter.values);
}

TEST(Archive, RefusesAShapeThatDiffers) {
  Counter counter;
  Archive out;
  out(counter);
  Archive in(out.bytes());
  Counter other{0, std::vector<double>(4)};
  in(other);
  EXPECT_FALSE(in.ok());
}

TEST(Archive, ThatIsBoundedTakesWhatFitsAndNoMore) {
  Counter counter{7, {1.0, 2.0, 3.0}};
  Archive free;
  free(counter);
  Archive bounded(free.bytes().size());
  const std::byte* memory = bounded.bytes().data();
  for (int again = 0; again < 2; ++again) {
    bounded.clear();
    bounded(counter);
    EXPECT_TRUE(bounded.ok());
    EXPECT_TRUE(std::ranges::equal(bounded.bytes(), free.bytes()));
  }
  EXPECT_EQ(bounded.bytes().data(), memory) << "it has not grown";
  char more = 'x';
  bounded(more);
  EXPECT_FALSE(bounded.ok());
  EXPECT_EQ(bounded.bytes().size(), free.bytes().size());
  bounded.clear();
  EXPECT_TRUE(bounded.ok());
}

TEST(Archive, WritesNothingOfWhatLiesBetweenMembers) {
#if __has_builtin(__builtin_clear_padding)
  struct Padded {
    char first;
    double second;
    char third;
  };
  std::vector<std::byte> written[2];
  for (const int fill : {0x00, 0xAA}) {
    alignas(Padded) std::byte memory[sizeof(Padded)];
    std::memset(memory, fill, sizeof memory);
    auto* padded = new (memory) Padded;
    padded->first = 'a';
    padded->second = 2.0;
    padded->third = 'c';
    Archive out;
    out(*padded);
    written[fill == 0 ? 0 : 1].assign(out.bytes().begin(), out.bytes().end());
  }
  EXPECT_EQ(written[0], written[1]);
#else
  GTEST_SKIP() << "this compiler cannot clear padding";
#endif
}

TEST(Archive, RefusesToReadPastTheEnd) {
  Archive in(std::span<const std::byte>{});
  int value = 5;
  in(value);
  EXPECT_FALSE(in.ok());
  EXPECT_EQ(value, 5);
}

}  // namespace
}  // namespace tandem
