// The same through the whole chain: a pendulum that its joint has to carry, its board, its spring.
#include <algorithm>
#include <cmath>
#include <functional>

#include "canopen/objects.hpp"
#include "tests/runtime/swing_loop.hpp"

namespace tandem::runtime {
namespace {

using hal::ControlMode;
using hal::PidLoop;

using test::kNow;

/// The swing, led to a slope by a controller; then the joint is nobody's.
struct SimServices : testing::Test, test::SwingLoop {
  void SetUp() override {
    add_sine({0}, "sine", true, "amplitude_rad = 0.4");
    begin({.settle_cycles = 200});
    run_to(RunPhase::kRunning);
    (void)torque_step(250);  // at the far end of the sine
    ASSERT_TRUE(cycle->services().switch_controllers({"sine"}, {}, kNow));
    (void)torque_step(1000);
    ASSERT_GT(std::abs(cycle->state().torque_Nm()[0]), 1.0) << "it carries nothing";
  }
  [[nodiscard]] float gain(std::uint16_t object, canopen::PidSub sub) const {
    return backend->robot().board(0).dictionary().value<float>(object, sub);
  }
};

TEST_F(SimServices, AJointThatCarriesAWeightChangesItsModeWithoutABump) {
  const double at_rest_Nm = torque_step(300);
  struct Step {
    const char* what;
    JointRequest wish;
  };
  const Step steps[] = {{"to torque", {.mode = 3}},           {"to position", {.mode = 1}},
                        {"to compliant", {.interaction = 1}}, {"to stiff", {.interaction = 0}},
                        {"to velocity", {.mode = 2}},         {"to position again", {.mode = 1}},
                        {"to current", {.mode = 5}},          {"back to position", {.mode = 1}}};
  for (const Step& step : steps) {
    ASSERT_TRUE(cycle->services().set_joint("swing", step.wish, kNow)) << step.what;
    const double before_rad = cycle->state().position_rad()[0];
    const double largest = torque_step(100);
    const double moved_rad = std::abs(cycle->state().position_rad()[0] - before_rad);
    std::printf("%-20s %.2f Nm a cycle (%.2f at rest), moved %.5f rad in 0.1 s\n", step.what,
                largest, at_rest_Nm, moved_rad);
    EXPECT_LE(largest, at_rest_Nm + 0.16) << step.what;  // three quanta of the wire
    EXPECT_LE(moved_rad, 0.01) << step.what;
  }
  EXPECT_TRUE(cycle->faults().empty());
}

TEST_F(SimServices, GainsReachTheBoardsObjectDictionaryBySdo) {
  namespace object = canopen::object;
  EXPECT_EQ(gain(object::kPositionGains, canopen::kPidKp), 600.0F);
  ASSERT_TRUE(cycle->services().set_gains("swing", PidLoop::kPosition, {.kp = 550.0}, kNow));
  ASSERT_TRUE(
      cycle->services().set_gains("swing", PidLoop::kTorque, {.ki = 2.5, .kd = 0.009}, kNow));
  int cycles = 0;
  while (gain(object::kTorqueGains, canopen::kPidKd) != 0.009F && cycles < 100) {
    ASSERT_TRUE(cycle->step());
    ++cycles;
  }
  EXPECT_LE(cycles, 20);
  EXPECT_EQ(gain(object::kPositionGains, canopen::kPidKp), 550.0F);
  EXPECT_EQ(gain(object::kPositionGains, canopen::kPidKi), 300.0F);
  EXPECT_EQ(gain(object::kTorqueGains, canopen::kPidKi), 2.5F);
  EXPECT_TRUE(cycle->faults().empty());
}

/// What a joint under way does while it is brought to rest.
struct Braking {
  double torque_Nm = 0.0;    // the largest
  double back_rad_s = 0.0;   // the fastest way back
  double coasts_rad = 0.0;   // from there to its rest
  double speed_rad_s = 0.0;  // at last: the true one; a count more in a cycle measures 0.015
};

struct MovingSwing : test::SwingLoop {
  MovingSwing() {
    add("runner", std::make_shared<test::Runner>(2.5), false);
    add("keeper", std::make_shared<test::Keeper>(), false);
    begin({.settle_cycles = 200});
    run_to(RunPhase::kRunning);
    steps(1500);
  }
  void by_controller() {
    ASSERT_TRUE(cycle->services().switch_controllers({}, {"runner"}, kNow));
    steps(400);
  }
  void by_operator() {
    ASSERT_TRUE(cycle->services().move_joint(
        "swing", {.target_rad = 2.9, .speed_rad_s = 2.5, .acceleration_rad_s2 = 12.5}, kNow));
    steps(300);
  }
  Braking braking() {
    Braking seen;
    const double from = cycle->state().position_rad()[0];
    EXPECT_NEAR(cycle->state().velocity_rad_s()[0], 2.5, 0.2);
    for (int i = 0; i < 1500; ++i) {
      steps(1);
      seen.torque_Nm = std::max(seen.torque_Nm, std::abs(cycle->state().torque_Nm()[0]));
      seen.back_rad_s = std::max(seen.back_rad_s, -cycle->state().velocity_rad_s()[0]);
    }
    seen.coasts_rad = cycle->state().position_rad()[0] - from;
    seen.speed_rad_s = backend->truth().velocity_rad_s()[0];
    return seen;
  }
};

TEST(MovingSwing, BrakesAsJointStopDoesWhoeverTakesItsHandOff) {
  struct Way {
    const char* what;
    bool controlled;
    std::function<void(MovingSwing&)> take;
  };
  const Way ways[] = {
      {"joint stop", false,
       [](MovingSwing& run) { ASSERT_TRUE(run.cycle->services().move_joint("swing", {}, kNow)); }},
      {"controller stop", true,
       [](MovingSwing& run) {
         ASSERT_TRUE(run.cycle->services().switch_controllers({"runner"}, {}, kNow));
       }},
      {"controller switch", true,
       [](MovingSwing& run) {
         ASSERT_TRUE(run.cycle->services().switch_controllers({"runner"}, {"keeper"}, kNow));
       }},
      {"controller start", false, [](MovingSwing& run) {
         ASSERT_TRUE(run.cycle->services().switch_controllers({}, {"keeper"}, kNow));
       }}};
  Braking right;
  for (const Way& way : ways) {
    MovingSwing run;
    way.controlled ? run.by_controller() : run.by_operator();
    way.take(run);
    const Braking seen = run.braking();
    std::printf("%-22s %5.1f Nm, back at %.3f rad/s, %.3f rad on, then %.4f rad/s\n", way.what,
                seen.torque_Nm, seen.back_rad_s, seen.coasts_rad, seen.speed_rad_s);
    if (right.torque_Nm == 0.0) right = seen;
    EXPECT_LE(seen.torque_Nm, 1.5 * right.torque_Nm) << way.what;
    EXPECT_LE(seen.back_rad_s, right.back_rad_s + 0.1) << way.what;
    EXPECT_NEAR(seen.speed_rad_s, 0.0, 0.01) << way.what;
  }
}

}  // namespace
}  // namespace tandem::runtime
