// A run with three controllers that is asked for changes between two steps, so that the cycle in
// which they are made is known.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "rt/clock.hpp"
#include "runtime/robot_cycle.hpp"
#include "tests/hal/fake_backend.hpp"
#include "tests/runtime/first_order_robot.hpp"
#include "tests/runtime/test_controllers.hpp"

namespace tandem::runtime::test {

inline constexpr RunServices::Patience kNow{0};  // asked for, not waited for
using Names = std::vector<std::string>;

inline TomlDocument document_of(const std::string& text = "") {
  return *TomlDocument::parse(text, "parameters");
}

/// Three joints. "left" has 0 and 1, "right" 1 and 2, "wrist" 2. Only "left" is active at first.
struct SwitchRun {
  explicit SwitchRun(std::uint64_t running_cycles = 2000, std::uint64_t settle_cycles = 0)
      : backend(robot), host(robot, nullptr, 1'000'000) {
    left = add("left", {0, 1}, true);
    right = add("right", {1, 2}, false);
    wrist = add("wrist", {2}, false);
    cycle = std::make_unique<RobotCycle>(
        CycleParts{robot, backend, host, clock},
        CycleConfig{.running_cycles = running_cycles, .settle_cycles = settle_cycles});
  }
  Sine* add(const std::string& name, std::vector<std::size_t> joints, bool active) {
    auto made = std::make_shared<Sine>(std::move(joints));
    EXPECT_TRUE(host.add(name, made, test::parameters(), active));
    return made.get();
  }
  void steps(int count) {
    for (int i = 0; i < count; ++i) EXPECT_TRUE(cycle->step());
  }
  /// Into the motion.
  void run() { steps(100); }
  [[nodiscard]] RunServices& services() const { return cycle->services(); }
  [[nodiscard]] Result<RequestResult> change(const Names& stop, const Names& start) const {
    return services().switch_controllers(stop, start, kNow);
  }
  [[nodiscard]] Names active() const {
    Names names;
    for (const ControllerStatus& one : services().controllers()) {
      if (one.active) names.push_back(one.name);
    }
    return names;
  }
  [[nodiscard]] double position(std::size_t joint) const {
    return cycle->command().position_rad()[joint];
  }

  const hal::RobotConfig robot = hal::test::fake_robot();
  FirstOrderRobot backend;
  ControllerHost host;
  rt::WallClock clock;
  Sine *left, *right, *wrist;
  std::unique_ptr<RobotCycle> cycle;
};

}  // namespace tandem::runtime::test
