// A run of the fake robot on first-order joints, whose cycles a test makes itself.
#pragma once

#include <chrono>
#include <future>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "rt/clock.hpp"
#include "runtime/robot_cycle.hpp"
#include "tests/hal/fake_backend.hpp"
#include "tests/runtime/first_order_robot.hpp"
#include "tests/runtime/test_controllers.hpp"

namespace tandem::runtime::test {

struct JointRun {
  explicit JointRun(hal::RobotConfig config = hal::test::fake_robot()) : robot(std::move(config)) {}

  /// A controller named "sine" that claims `joint`.
  void add_sine(std::size_t joint, bool active = true) {
    EXPECT_TRUE(host.add("sine", std::make_shared<Sine>(std::vector<std::size_t>{joint}),
                         parameters(), active));
  }
  /// After the controllers are added.
  void begin(const CycleConfig& config, log::Recorder* recorder = nullptr) {
    cycle = std::make_unique<RobotCycle>(CycleParts{robot, backend, host, clock, recorder}, config);
  }
  void steps(int count) {
    for (int i = 0; i < count; ++i) EXPECT_TRUE(cycle->step());
  }
  /// What `ask` returns, on a thread of its own, while cycles go on.
  template <class Ask>
  auto while_cycling(const Ask& ask) {
    auto asked = std::async(std::launch::async, ask);
    while (asked.wait_for(std::chrono::milliseconds(1)) != std::future_status::ready) steps(1);
    return asked.get();
  }
  [[nodiscard]] RunServices& services() const { return cycle->services(); }
  [[nodiscard]] JointStatus look(std::size_t joint) const {
    return services().joints()[joint].look;
  }
  /// The commanded position.
  [[nodiscard]] double reference(std::size_t joint) const {
    return cycle->command().position_rad()[joint];
  }
  /// `accepted`, or why not.
  [[nodiscard]] static std::string text(const Result<RequestResult>& answer,
                                        const char* accepted = "accepted") {
    return answer ? accepted : answer.error().to_string();
  }

  hal::RobotConfig robot;
  FirstOrderRobot backend{robot};
  ControllerHost host{robot, nullptr, 1'000'000};
  rt::WallClock clock;
  std::unique_ptr<RobotCycle> cycle;
};

/// The shoulder is a controller's, elbow and wrist are nobody's.
struct JointServices : testing::Test, JointRun {
  void SetUp() override {
    add_sine(0);
    begin({.settle_cycles = 20});
    steps(100);
    ASSERT_EQ(cycle->phase(), RunPhase::kRunning);
  }
  [[nodiscard]] Result<RequestResult> mode(const std::string& joint, hal::ControlMode mode) const {
    return services().set_joint(joint, {.mode = static_cast<std::int32_t>(mode)},
                                RunServices::Patience{0});
  }
};

}  // namespace tandem::runtime::test
