// A robot of config/ with its kernels: a test that uses one depends on the target kernels_NAME.
// Layer: tests.  Thread: any.
#pragma once

#include <memory>
#include <string>

#include "hal/config/robot_config.hpp"
#include "model/kernel_library.hpp"
#include "model/tree.hpp"

namespace tandem::test {

struct TestRobot {
  hal::RobotConfig robot;  ///< complete with its description's limits
  model::KernelLibrary kernels;
  std::shared_ptr<const model::Tree> tree;  ///< the description
};

/// config/NAME/robot.toml. Throws std::runtime_error with the message of what went wrong.
[[nodiscard]] TestRobot load_test_robot(const std::string& name);

}  // namespace tandem::test
