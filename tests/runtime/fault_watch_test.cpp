// Which causes are reported of a joint, and when they are reported again.
#include "runtime/fault_watch.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/hal/fake_backend.hpp"

namespace tandem::runtime {
namespace {

using hal::FaultCause;

struct Joints : testing::Test {
  Joints() { robot.joints[1].drive.temperature_limit_C = 100.0; }
  /// The causes that the joints report in their present state.
  std::vector<FaultCause> told() {
    std::vector<FaultCause> causes;
    while (const auto found = watch.next_joint(state)) {
      EXPECT_EQ(found->index, 1);
      last = *found;
      causes.push_back(found->cause);
    }
    return causes;
  }
  std::vector<FaultCause> told_at(double temperature_C) {
    state.temperature_C()[1] = temperature_C;
    return told();
  }

  hal::RobotConfig robot = hal::test::fake_robot();
  struct Backend : hal::test::FakeBackend {
    using FakeBackend::FakeBackend;
    FaultCause fault_cause(std::size_t) const noexcept override { return cause; }
    FaultCause cause = FaultCause::kDrive;
  } backend{robot};
  hal::StateImage state{robot.shape()};
  FaultWatch watch{robot, backend, 10, {}};
  FaultRecord last{};
  const std::vector<FaultCause> nothing{}, hot{FaultCause::kHot}, fault{FaultCause::kDrive};
};

TEST_F(Joints, AHotWindingIsToldOnceUntilItHasCooledDown) {
  EXPECT_EQ(told_at(89.9), nothing);
  EXPECT_EQ(told_at(90.7), hot);
  EXPECT_EQ(last.code, 90U) << "degrees";
  EXPECT_EQ(last.category, hal::StopCategory::kWarn);
  EXPECT_EQ(told_at(99.0), nothing) << "once";
  EXPECT_EQ(told_at(86.0), nothing);
  EXPECT_EQ(told_at(91.0), nothing) << "it has not cooled down";
  EXPECT_EQ(told_at(84.0), nothing);
  EXPECT_EQ(told_at(91.0), hot) << "again";
  EXPECT_FALSE(watch.joint_in_fault());
  state.temperature_C()[0] = 1e9;
  state.temperature_C()[1] = std::nan("");
  EXPECT_EQ(told(), nothing) << "without a limit, or a measurement, there is nothing to tell";
}

/// A fault is one by the drive's state, whatever its backend says of the cause.
TEST_F(Joints, ADriveInFaultIsOneWhoseCauseIsNoDrives) {
  state.fault()[1] = 0x4310;
  for (const FaultCause cause : {FaultCause::kNone, FaultCause::kHot, FaultCause::kNotHomed}) {
    backend.cause = cause;
    EXPECT_EQ(told(), fault);
    EXPECT_EQ(last.category, hal::StopCategory::kCategory1);
    EXPECT_TRUE(watch.joint_in_fault());
    state.fault()[1] = 0;
    watch.reset(state);
    state.fault()[1] = 0x4310;
  }
}

TEST_F(Joints, AHotWindingDoesNotHideTheDrivesFault) {
  ASSERT_EQ(told_at(91.0), hot);
  const FaultRecord warning = last;
  state.fault()[1] = 0x4310;
  EXPECT_EQ(told(), fault);
  EXPECT_TRUE(watch.joint_in_fault());
  EXPECT_TRUE(watch.is_there(last));
  EXPECT_EQ(told_at(91.0), nothing);
  state.fault()[1] = 0;
  watch.reset(state);
  EXPECT_FALSE(watch.is_there(last));
  EXPECT_TRUE(watch.is_there(warning)) << "it is hot still";
  EXPECT_FALSE(watch.joint_in_fault());
  EXPECT_EQ(told_at(91.0), nothing) << "and has been told";
}

}  // namespace
}  // namespace tandem::runtime
