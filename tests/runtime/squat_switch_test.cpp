// COMAN changes controllers in the middle of its squat, where its legs move fastest: through the
// whole chain, under the real-time trap.
#include <algorithm>
#include <cmath>

#include "tests/runtime/bundled_run.hpp"

namespace tandem::runtime {
namespace {

constexpr RunServices::Patience kNow{0};
// Cycle of kRunning: a quarter of the first squat, less half of a brake, which ends there.
constexpr int kFastest = 2750 - 125;
constexpr int kWatched = 200;  // cycles after a switch: twice what leading over takes

/// On the wire a torque is a whole number of these, and five times as many in the legs.
constexpr double kQuantum_Nm = 0.01;

long quanta(double torque_Nm) { return std::lround(torque_Nm / kQuantum_Nm); }

/// The largest changes from one cycle to the next, over all joints.
struct Steps {
  double position = 0.0;        ///< commanded, in what its rate limit allows in a cycle
  double torque = 0.0;          ///< commanded, in the joint's max torque
  double velocity_rad_s = 0.0;  ///< commanded
  double spring_Nm = 0.0;       ///< measured
};

void widen(double& most, double one, double other) { most = std::max(most, std::abs(other - one)); }

/// Beside the squat there is "rest", which holds the joints without carrying the weight for them.
struct SwitchedSquat : BundledRun {
  SwitchedSquat()
      : BundledRun("coman", "squat",
                   {.duration_s = 20.0, .change = [](Experiment& e) {
                      const auto none = TomlDocument::parse("", "rest");
                      e.controllers.push_back({"hold", "rest", false, none->root()});
                    }}) {
    capabilities = hal::joint_capabilities(experiment->robot);
    run_to(RunPhase::kRunning);
    (void)go(kFastest);
  }
  /// Goes on for `count` cycles.
  Steps go(int count) {
    Steps most;
    const double period_s = static_cast<double>(experiment->loop.period_ns) * 1e-9;
    const hal::CommandImage& now = cycle->command();
    for (int i = 0; i < count; ++i) {
      const hal::CommandImage before = now;
      const hal::StateImage measured = cycle->state();
      EXPECT_TRUE(cycle->step());
      for (std::size_t j = 0; j < capabilities.size(); ++j) {
        const double way = capabilities[j].max_velocity_rad_s * period_s;
        const double torque_Nm = capabilities[j].max_torque_Nm;
        widen(most.position, before.position_rad()[j] / way, now.position_rad()[j] / way);
        widen(most.torque, before.torque_Nm()[j] / torque_Nm, now.torque_Nm()[j] / torque_Nm);
        widen(most.velocity_rad_s, before.velocity_rad_s()[j], now.velocity_rad_s()[j]);
        widen(most.spring_Nm, measured.torque_Nm()[j], cycle->state().torque_Nm()[j]);
      }
    }
    return most;
  }
  void change(const std::vector<std::string>& stop, const std::vector<std::string>& start) {
    const auto asked = cycle->services().switch_controllers(stop, start, kNow);
    ASSERT_TRUE(asked) << asked.error().to_string();
  }
  std::vector<hal::JointCapabilities> capabilities;
};

TEST(SquatSwitch, ChangesNothingInItsCycleAndNoMoreThanASquatInThoseAfterIt) {
  SwitchedSquat run;
  struct Change {
    std::vector<std::string> stop, start;
    int then;  // cycles until the next
  };
  const Change changes[] = {{{"squat"}, {}, 1000},
                            {{}, {"squat"}, kFastest},
                            {{"squat"}, {"rest"}, 1000},
                            {{"rest"}, {"squat"}, kFastest}};
  for (const Change& change : changes) {
    const std::string what = (change.stop.empty() ? "held" : change.stop[0]) + " to " +
                             (change.start.empty() ? "held" : change.start[0]);
    SCOPED_TRACE(what);
    const Steps before = run.go(1);
    run.change(change.stop, change.start);
    const Steps boundary = run.go(1);
    EXPECT_NEAR(boundary.position, before.position, 1e-9) << "it goes on as it did";
    EXPECT_NEAR(boundary.torque, 0.0, 1e-12);
    EXPECT_NEAR(boundary.velocity_rad_s, 0.0, 1e-12);
    EXPECT_LE(quanta(boundary.spring_Nm), 20);  // four of the legs'
    const Steps after = run.go(kWatched);
    EXPECT_LE(after.position, 0.2);  // of what the rate limit allows; the squat alone has 0.12
    EXPECT_LE(after.torque, 0.02);   // of the joint's max torque
    EXPECT_LE(after.velocity_rad_s, 0.02);
    EXPECT_LE(quanta(after.spring_Nm), 20);
    std::printf(
        "%-14s position %.3f of its rate limit, torque %.4f of its maximum, spring %.2f "
        "and then %.2f Nm",
        what.c_str(), after.position, after.torque, boundary.spring_Nm, after.spring_Nm);
    (void)run.go(change.then);
    std::printf(", tilt %.3f rad\n", run.cycle->statistics().base()->final_tilt_rad);
  }
  for (const FaultReport& fault : run.cycle->faults()) ADD_FAILURE() << fault.joint << fault.text;
  const auto base = run.cycle->statistics().base();
  ASSERT_TRUE(base);
  EXPECT_LT(base->final_tilt_rad, 0.05) << "it stands";
}

// A new build of the squat goes on where the former one was, where the legs move fastest.
TEST(SquatSwitch, AReloadIsNoMoreThanTheSquatGoingOn) {
  SwitchedSquat run, other;
  ASSERT_TRUE(run.cycle->services().reload("squat", false, kNow));
  const Steps boundary = run.go(1), same = other.go(1);
  EXPECT_NEAR(boundary.position, same.position, 1e-3) << "of the rate limit";
  EXPECT_NEAR(boundary.torque, 0.0, 1e-12);
  const Steps after = run.go(kWatched), alone = other.go(kWatched);
  EXPECT_NEAR(after.position, alone.position, 1e-3);
  double apart_rad = 0.0;
  Steps later;  // torques go by measured speeds: how far they flicker at most shows in seconds only
  for (int i = 0; i < 3000; ++i) {
    (void)run.go(1);
    later.torque = std::max(later.torque, other.go(1).torque);
    const auto one = run.cycle->command().position_rad();
    const auto two = other.cycle->command().position_rad();
    for (std::size_t j = 0; j < one.size(); ++j)
      apart_rad = std::max(apart_rad, std::abs(one[j] - two[j]));
  }
  std::printf("a reload in motion: %.4f of the rate limit, %.4f alone; then %.2g rad apart\n",
              after.position, alone.position, apart_rad);
  EXPECT_LT(apart_rad, 1e-4);
  EXPECT_NEAR(after.torque, std::max(alone.torque, later.torque), 1e-3);
  EXPECT_TRUE(run.cycle->faults().empty());
}

TEST(SquatSwitch, AtTheSameCycleGivesTheSameBits) {
  SwitchedSquat run;
  const auto before = run.cycle->save();
  ASSERT_TRUE(before);
  run.change({"squat"}, {"rest"});
  const auto first = run.bytes(50);  // during the transfer
  const auto midway = run.cycle->save();
  ASSERT_TRUE(midway);
  const auto rest = run.bytes(200);

  ASSERT_TRUE(run.cycle->restore(*before));
  run.change({"squat"}, {"rest"});
  EXPECT_TRUE(run.bytes(50) == first);
  EXPECT_TRUE(run.bytes(200) == rest);
  ASSERT_TRUE(run.cycle->restore(*midway));
  EXPECT_TRUE(run.bytes(200) == rest);

  SwitchedSquat other;
  other.change({"squat"}, {"rest"});
  EXPECT_TRUE(other.bytes(50) == first);
}

}  // namespace
}  // namespace tandem::runtime
