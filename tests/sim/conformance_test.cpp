// The conformance suite on the in-process robot, nothing disabled.
#include "tests/hal/conformance.hpp"
#include "tests/sim/swing_robot.hpp"

namespace tandem::hal::test {
namespace {

ConformanceRobot make(RobotConfig robot, int order) {
  ConformanceRobot made;
  made.robot = std::move(robot);
  auto backend = sim::SimRobot::create(made.robot, tandem::test::swing_kernels(order), {});
  EXPECT_TRUE(backend.has_value()) << backend.error().to_string();
  made.provoke_fault = [raw = backend->get()](std::size_t j) {
    sim::ScenarioFault unplugged;
    unplugged.kind = hal::FaultKind::kEncoderUnplug;
    unplugged.joint = static_cast<std::int32_t>(j);
    unplugged.duration_ns = 3'000'000;
    ASSERT_EQ(raw->robot().inject(unplugged), Code::kOk);
  };
  made.backend = std::move(*backend);
  return made;
}

template <int order>
ConformanceRobot make_swing() {
  return make(tandem::test::swing_robot(order), order);
}

ConformanceRobot make_classic() { return make(tandem::test::classic_swing_robot(), 2); }

ConformanceRobot make_line() { return make(tandem::test::line_swing_robot(), 2); }

INSTANTIATE_TEST_SUITE_P(SimRobot, BackendConformance,
                         testing::Values(ConformanceCase{"rigid", make_swing<0>},
                                         ConformanceCase{"electrical", make_swing<1>},
                                         ConformanceCase{"elastic", make_swing<2>},
                                         ConformanceCase{"both", make_swing<3>},
                                         ConformanceCase{"classic", make_classic},
                                         ConformanceCase{"line", make_line}),
                         [](const auto& made) { return made.param.name; });

}  // namespace
}  // namespace tandem::hal::test
