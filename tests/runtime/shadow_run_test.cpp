// COMAN squats with shadows beside it, through the whole chain, under the real-time trap.
#include <cmath>

#include "tests/runtime/bundled_run.hpp"

namespace tandem::runtime {
namespace {

constexpr RunServices::Patience kAtOnce{0};

/// Beside the squat "rest" is loaded, which keeps the joints where they are at its start.
struct SquatBesideRest : BundledRun {
  SquatBesideRest()
      : BundledRun("coman", "squat", {.change = [](Experiment& e) {
                     e.controllers.push_back(
                         {"hold", "rest", false, TomlDocument::parse("", "rest")->root()});
                   }}) {
    run_to(RunPhase::kRunning);
    steps(1'500);
  }
};

TEST(ShadowRun, ChangesNoBitOfARunOfComan) {
  SquatBesideRest with, without;
  ASSERT_TRUE(with.cycle->services().begin_shadow("rest", kAtOnce));
  EXPECT_EQ(with.bytes(1'500), without.bytes(1'500));
  EXPECT_TRUE(with.cycle->services().shadows().at(0).runs);
}

TEST(ShadowRun, ShowsHowFarTheSquatHasLedAJointFromWhereItWas) {
  SquatBesideRest run;
  ASSERT_TRUE(run.cycle->services().begin_shadow("rest", kAtOnce));
  run.steps(1);
  const std::vector<double> stood(run.run->state().position_rad().begin(),
                                  run.run->state().position_rad().end());
  run.steps(2'000);
  const ShadowStatus shadow = run.cycle->services().shadows().at(0);
  double most_rad = 0.0;
  for (std::size_t i = 0; i < shadow.claims.size(); ++i) {
    const std::size_t j = shadow.claims[i].joint;
    EXPECT_EQ(shadow.owners[i], "squat");
    EXPECT_NEAR(shadow.joints[i].now[0], stood[j] - run.run->command().position_rad()[j], 1e-9);
    most_rad = std::fmax(most_rad, shadow.joints[i].most[0]);
  }
  EXPECT_GT(most_rad, 0.2) << "a knee";
}

}  // namespace
}  // namespace tandem::runtime
