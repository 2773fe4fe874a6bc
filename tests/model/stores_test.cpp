#include "model/stores.hpp"

#include <gtest/gtest.h>

namespace tandem::model {
namespace {

/// "0+4 5+1": first and count of each.
std::string text(const std::vector<OutputStore>& stores) {
  std::string result;
  for (const OutputStore& store : stores)
    result += (result.empty() ? "" : " ") + std::to_string(store.first) + "+" +
              std::to_string(store.count);
  return result;
}

TEST(Stores, TakeNeighboursThatAreKnownAtAboutTheSameTime) {
  const std::vector<std::uint32_t> one_array(12, 0);
  EXPECT_EQ(text(stores_of({{0, 1}, {1, 2}, {2, 3}, {3, 4}, {4, 5}, {6, 6}}, one_array, 10)),
            "0+4 4+1 6+1");
  EXPECT_EQ(text(stores_of({{0, 1}, {1, 2}, {2, 3}}, one_array, 10)), "0+2 2+1");
  EXPECT_EQ(text(stores_of({{0, 1}, {1, 20}, {2, 21}}, one_array, 10)), "0+1 1+2");
  EXPECT_EQ(text(stores_of({{0, 1}, {1, 1}}, one_array, 0)), "0+1 1+1");
}

TEST(Stores, WaitForTheLast) {
  const std::vector<std::uint32_t> one_array(2, 0);
  const auto stores = stores_of({{0, 9}, {1, 4}}, one_array, 10);
  ASSERT_EQ(stores.size(), 1u);
  EXPECT_EQ(stores[0].time, 9u);
}

TEST(Stores, LeaveNoArray) {
  const std::vector<std::uint32_t> arrays{0, 0, 1, 1};
  EXPECT_EQ(text(stores_of({{1, 1}, {2, 1}, {3, 1}}, arrays, 10)), "1+1 2+2");
  EXPECT_EQ(text(stores_of_runs({true, true, true, true}, arrays)), "0+2 2+2");
}

TEST(Stores, OverlapAtTheEndOfARun) {
  const std::vector<std::uint32_t> one_array(12, 0);
  std::vector<bool> wanted(12, false);
  for (int k = 2; k < 9; ++k) wanted[static_cast<std::size_t>(k)] = true;
  wanted[11] = true;
  EXPECT_EQ(text(stores_of_runs(wanted, one_array)), "2+4 5+4 11+1");
}

}  // namespace
}  // namespace tandem::model
