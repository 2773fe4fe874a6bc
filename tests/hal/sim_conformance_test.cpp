// The conformance suite on a robot of config/ in process, with its generated kernels.
#include "hal/sim/sim_robot.hpp"
#include "tests/hal/conformance.hpp"
#include "tests/support/test_robot.hpp"

namespace tandem::hal::test {
namespace {

/// How a robot of config/ is tested: a joint that is free to move, and what moves it gently.
struct Trial {
  const char* robot;
  const char* posture;
  double lifted_m;  ///< the hoist holds a floating base so far above the posture's height
  const char* joint;
  double torque_Nm;
  double voltage_V;
  double torque_share = 0.3;
};

ConformanceRobot make(const Trial& trial) {
  auto loaded =
      std::make_shared<tandem::test::TestRobot>(tandem::test::load_test_robot(trial.robot));
  sim::SimRobotConfig config;
  config.posture = trial.posture;
  for (PostureConfig& posture : loaded->robot.postures) posture.base_height_m += trial.lifted_m;
  config.release_ns = 1'000'000'000'000'000;  // a hoist that holds a floating base to the end
  const auto joint = static_cast<std::size_t>(loaded->robot.joint_index(trial.joint));
  loaded->robot.joints[joint].on_fault = StopCategory::kHold;  // nor may a fault let the trunk fall
  auto backend = sim::SimRobot::create(loaded->robot, loaded->kernels.get(), config);
  if (!backend) throw std::runtime_error(backend.error().to_string());
  ConformanceRobot made;
  made.robot = loaded->robot;
  made.joint = joint;
  made.torque_Nm = trial.torque_Nm;
  made.voltage_V = trial.voltage_V;
  made.torque_share = trial.torque_share;
  made.provoke_fault = [raw = backend->get()](std::size_t j) {
    sim::ScenarioFault unplugged;
    unplugged.kind = hal::FaultKind::kEncoderUnplug;
    unplugged.joint = static_cast<std::int32_t>(j);
    unplugged.duration_ns = 20'000'000;
    ASSERT_EQ(raw->robot().inject(unplugged), Code::kOk);
  };
  made.backend = std::move(*backend);
  made.keep = loaded;
  return made;
}

/// One joint of every kind of drive.
const std::vector<Trial> kTrials{
    {"ur5e", "ready", 0.0, "shoulder_pan_joint", 5.0, 1.0},
    {"coman", "stand", 0.3, "RElbj", 0.5, 0.5},          // soft_arm
    {"coman", "stand", 0.3, "RKneeSag", 2.0, 0.5},       // soft_leg
    {"coman", "stand", 0.3, "WaistLat", 2.0, 0.5},       // stiff
    {"walkman", "stand", 0.3, "RWrj1", 0.5, 0.5, 0.05},  // small
    {"walkman", "stand", 0.3, "WaistLat", 10.0, 1.0},    // medium
    {"walkman", "stand", 0.3, "RElbj", 2.0, 0.5},        // medium2, light
    {"walkman", "stand", 0.3, "WaistYaw", 5.0, 0.5},     // medium2, heavy
    {"walkman", "stand", 0.3, "RKneeSag", 5.0, 1.0},     // big
};

std::vector<ConformanceCase> cases() {
  std::vector<ConformanceCase> all;
  for (const Trial& trial : kTrials) {
    all.push_back({std::string(trial.robot) + "_" + trial.joint, [trial] { return make(trial); }});
  }
  return all;
}

INSTANTIATE_TEST_SUITE_P(Config, BackendConformance, testing::ValuesIn(cases()),
                         [](const auto& made) { return made.param.name; });

}  // namespace
}  // namespace tandem::hal::test
