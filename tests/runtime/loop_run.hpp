// A loop around a robot of the test's own, whose cycles the test makes itself.
// Runs of the bundled robots: bundled_run.hpp.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "rt/clock.hpp"
#include "runtime/robot_cycle.hpp"
#include "tests/hal/fake_backend.hpp"
#include "tests/runtime/first_order_robot.hpp"
#include "tests/runtime/test_controllers.hpp"

namespace tandem::runtime::test {

inline constexpr RunServices::Patience kNow{0};  // asked for, not waited for

/// Everything but the backend.
struct LoopRun {
  explicit LoopRun(hal::RobotConfig config, const tandem_kernels* its = nullptr) : kernels(its) {
    of(std::move(config));
  }
  /// From now on it is of this robot, without controllers.
  void of(hal::RobotConfig config) {
    cycle.reset();
    host.reset();
    robot = std::move(config);
    host.emplace(robot, kernels, 1'000'000);
  }
  void add(const std::string& name, std::shared_ptr<Controller> controller, bool active = true,
           const std::string& its_parameters = "") {
    EXPECT_TRUE(host->add(name, std::move(controller), parameters(its_parameters), active));
  }
  Sine* add_sine(std::vector<std::size_t> joints = {0}, const std::string& name = "sine",
                 bool active = true, const std::string& its_parameters = "") {
    auto sine = std::make_shared<Sine>(std::move(joints));
    add(name, sine, active, its_parameters);
    return sine.get();
  }
  /// After the controllers are added.
  void begin(hal::Backend& backend, const CycleConfig& config) {
    cycle = std::make_unique<RobotCycle>(CycleParts{.robot = robot,
                                                    .backend = backend,
                                                    .controllers = *host,
                                                    .clock = *clock,
                                                    .recorder = recorder,
                                                    .truth = truth,
                                                    .observer = observer,
                                                    .owner = owner,
                                                    .snapshots = snapshots},
                                         config);
  }
  void steps(std::uint64_t count) {
    for (std::uint64_t i = 0; i < count; ++i) EXPECT_TRUE(cycle->step());
  }
  /// @return cycles taken
  int until(RunPhase phase, int most = 200) {
    int taken = 0;
    while (taken < most && cycle->phase() != phase && cycle->step()) ++taken;
    EXPECT_EQ(cycle->phase(), phase);
    return taken;
  }
  /// What `ask` returns, on a thread of its own, while cycles go on.
  template <class Ask>
  auto while_cycling(const Ask& ask) {
    auto asked = std::async(std::launch::async, ask);
    while (asked.wait_for(std::chrono::microseconds(200)) != std::future_status::ready) steps(1);
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
  const tandem_kernels* kernels;
  std::optional<ControllerHost> host;
  // What begin() takes.
  rt::WallClock wall_clock;
  rt::Clock* clock = &wall_clock;
  log::Recorder* recorder = nullptr;
  const hal::TruthImage* truth = nullptr;
  hal::CycleObserver* observer = nullptr;
  RemoteCommandParts owner = {};
  SnapshotPort* snapshots = nullptr;
  std::unique_ptr<RobotCycle> cycle;
};

/// The fake robot on first-order joints.
struct JointRun : LoopRun {
  explicit JointRun(hal::RobotConfig config = hal::test::fake_robot())
      : LoopRun(std::move(config)) {}
  void begin(const CycleConfig& config = {}) { LoopRun::begin(backend, config); }

  FirstOrderRobot backend{robot};
};

/// The shoulder is a controller's, elbow and wrist are nobody's.
struct JointServices : testing::Test, JointRun {
  void SetUp() override {
    add_sine();
    begin({.settle_cycles = 20});
    steps(100);
    ASSERT_EQ(cycle->phase(), RunPhase::kRunning);
  }
  [[nodiscard]] Result<RequestResult> mode(const std::string& joint, hal::ControlMode mode) const {
    return services().set_joint(joint, {.mode = static_cast<std::int32_t>(mode)}, kNow);
  }
};

}  // namespace tandem::runtime::test
