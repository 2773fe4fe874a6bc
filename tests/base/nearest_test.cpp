#include "base/nearest.hpp"

namespace tandem {
namespace {

const std::vector<std::string> kNames{"duration_s", "period_ns", "robot", "seed"};

TEST(Nearest, FindsASlipOfTheFinger) {
  EXPECT_EQ(nearest("durtaion_s", kNames), "duration_s");
  EXPECT_EQ(nearest("Robot", kNames), "robot");
}

TEST(Nearest, IsEmptyWhenNothingIsNear) { EXPECT_EQ(nearest("zzzzzzzz", kNames), ""); }

TEST(Suggest, ListsTheKnownNamesWhenNothingIsNear) {
  EXPECT_EQ(suggest("zzzzzzzz", kNames, 2), "known: duration_s, period_ns, …");
}

}  // namespace
}  // namespace tandem
