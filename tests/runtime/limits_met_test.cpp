// A limit that is met is told while the run goes on: once for each joint.
#include "tests/runtime/loop_run.hpp"

namespace tandem::runtime {
namespace {

TEST(LimitsMet, AreToldWhenTheyHappenAndOnce) {
  test::JointRun run;
  run.add_sine({1}, "wave", true, "amplitude_rad = 9.0");
  run.begin();
  std::uint64_t seen = 0;
  run.until(RunPhase::kRunning);
  EXPECT_TRUE(run.cycle->limits_met(seen).empty());
  run.steps(300);
  const auto met = run.cycle->limits_met(seen);
  ASSERT_EQ(met.size(), 1U);
  EXPECT_EQ(met[0].joint, run.robot.joints[1].name);
  EXPECT_EQ(met[0].text, hal::in_words(run.cycle->first_limited(1)) + ", by 'wave'");
  EXPECT_TRUE(met[0].text.starts_with("the position reference ")) << met[0].text;
  EXPECT_DOUBLE_EQ(met[0].time_s, 1e-3 * static_cast<double>(met[0].cycle));
  run.steps(300);
  EXPECT_TRUE(run.cycle->limits_met(seen).empty()) << "the table counts them";
  std::uint64_t late = 0;
  EXPECT_EQ(run.cycle->limits_met(late).size(), 1U) << "who comes later";
}

}  // namespace
}  // namespace tandem::runtime
