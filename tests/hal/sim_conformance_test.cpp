// The conformance suite on a robot of config/ in process, with its generated kernels.
#include "hal/sim/sim_robot.hpp"
#include "tests/hal/conformance.hpp"
#include "tests/support/test_robot.hpp"

namespace tandem::hal::test {
namespace {

ConformanceRobot make_ur5e() {
  auto loaded = std::make_shared<tandem::test::TestRobot>(tandem::test::load_test_robot("ur5e"));
  sim::SimRobotConfig config;
  config.posture = "ready";
  auto backend = sim::SimRobot::create(loaded->robot, loaded->kernels.get(), config);
  if (!backend) throw std::runtime_error(backend.error().to_string());
  ConformanceRobot made;
  made.robot = loaded->robot;
  made.joint = static_cast<std::size_t>(loaded->robot.joint_index("shoulder_pan_joint"));
  made.torque_Nm = 5.0;
  made.voltage_V = 1.0;
  made.provoke_fault = [raw = backend->get()](std::size_t j) {
    sim::Fault unplugged;
    unplugged.kind = hal::FaultKind::kEncoderUnplug;
    unplugged.joint = static_cast<std::int32_t>(j);
    unplugged.duration_ns = 20'000'000;
    ASSERT_EQ(raw->robot().inject(unplugged), Code::kOk);
  };
  made.backend = std::move(*backend);
  made.keep = loaded;
  return made;
}

INSTANTIATE_TEST_SUITE_P(Config, BackendConformance,
                         testing::Values(ConformanceCase{"ur5e", make_ur5e}),
                         [](const auto& made) { return made.param.name; });

}  // namespace
}  // namespace tandem::hal::test
