#include "base/nearest.hpp"

namespace tandem {
namespace {

const std::vector<std::string> kNames{"duration_s", "period_ns", "robot", "seed"};

TEST(Nearest, FindsASlipOfTheFinger) {
  EXPECT_EQ(nearest("durtaion_s", kNames), "duration_s");
  EXPECT_EQ(nearest("Robot", kNames), "robot");
}

TEST(Nearest, FindsANameThatLacksItsUnit) {
  const std::vector<std::string> keys{"com_m", "inertia_kg_m2", "mass_kg"};
  EXPECT_EQ(nearest("mass", keys), "mass_kg");
  EXPECT_EQ(nearest("inertia", keys), "inertia_kg_m2");
  EXPECT_EQ(nearest("mas_kg", std::vector<std::string>{"mas_kg_2", "mass_kg"}), "mass_kg")
      << "a slip is nearer";
}

TEST(Nearest, IsEmptyWhenNothingIsNear) { EXPECT_EQ(nearest("zzzzzzzz", kNames), ""); }

TEST(Suggest, ListsTheKnownNamesWhenNothingIsNear) {
  EXPECT_EQ(suggest("zzzzzzzz", kNames, 2), "known: duration_s, period_ns, …");
}

}  // namespace
}  // namespace tandem
