#include "runtime/controller_host.hpp"

#include <limits>

#include "tests/hal/fake_backend.hpp"
#include "tests/runtime/test_controllers.hpp"

namespace tandem::runtime {
namespace {

using hal::ControlMode;
using hal::DriveState;
using test::parameters;
using test::Sine;

class ControllerHostOfFake : public testing::Test {
 protected:
  Status add(const std::string& name, std::vector<std::size_t> joints,
             ControlMode mode = ControlMode::kPosition) {
    auto controller = std::make_unique<Sine>(std::move(joints), mode);
    last_ = controller.get();
    return host_.add(name, std::move(controller), parameters());
  }
  std::int8_t mode(std::size_t joint) const { return command_.mode()[joint]; }

  const hal::RobotConfig robot_ = hal::test::fake_robot();
  ControllerHost host_{robot_, nullptr, 1'000'000};
  hal::StateImage state_{robot_.shape()};
  hal::CommandImage command_{robot_.shape()};
  Sine* last_ = nullptr;
};

TEST_F(ControllerHostOfFake, RefusesTwoControllersOnOneJointAndNamesBoth) {
  ASSERT_TRUE(add("left", {0, 1}));
  const Status added = add("right", {2, 1});
  ASSERT_FALSE(added);
  EXPECT_EQ(added.error().key, "elbow");
  EXPECT_EQ(added.error().message, "is claimed by the controllers 'left' and 'right'");
  EXPECT_EQ(host_.size(), 1U);
}

TEST_F(ControllerHostOfFake, RefusesAJointClaimedTwiceByOneController) {
  EXPECT_FALSE(add("left", {1, 1}));
}

TEST_F(ControllerHostOfFake, RefusesAJointThatDoesNotExist) {
  const Status added = add("left", {3});
  ASSERT_FALSE(added);
  EXPECT_NE(added.error().message.find("joint number 3 of 3"), std::string::npos);
}

TEST_F(ControllerHostOfFake, RefusesAModeThatTheJointLacks) {
  hal::RobotConfig robot = robot_;
  robot.gains[0].current = {};
  ControllerHost host(robot, nullptr, 1'000'000);
  const std::vector<std::size_t> joints{1};
  const Status added =
      host.add("left", std::make_unique<Sine>(joints, ControlMode::kCurrent), parameters());
  ASSERT_FALSE(added);
  EXPECT_EQ(added.error().key, "gains.arm");
  EXPECT_NE(added.error().message.find("joint 'elbow' has no current control"), std::string::npos)
      << added.error().message;
}

TEST_F(ControllerHostOfFake, ReportsParametersThatTheControllerDoesNotKnow) {
  const auto document = TomlDocument::parse("amplitude_rd = 0.1", "x.toml");
  ASSERT_TRUE(
      host_.add("left", std::make_unique<Sine>(std::vector<std::size_t>{0}), document->root()));
  ASSERT_EQ(document->diagnostics().size(), 1U);
  EXPECT_EQ(document->diagnostics()[0].key, "amplitude_rd");
  EXPECT_EQ(document->diagnostics()[0].hint, "did you mean 'amplitude_rad'?");
}

/// Asks for one parameter and refuses the rest unread.
class Refusing final : public Controller {
 public:
  Status configure(ControllerSetup& setup) override {
    return fail("there is no joint '" + setup.parameters.text("joint") + "'");
  }
  void start(const hal::CycleTime&, const hal::StateImage&,
             hal::CommandImage&) noexcept TANDEM_RT override {}
  Code update(const hal::CycleTime&, const hal::StateImage&,
              hal::CommandImage&) noexcept TANDEM_RT override {
    return Code::kOk;
  }
};

TEST_F(ControllerHostOfFake, FindsNoFaultWithParametersThatARefusingControllerDidNotGetTo) {
  const auto document = TomlDocument::parse("joint = 'x'\nperiod_s = 2.0", "x.toml");
  const Status added = host_.add("left", std::make_unique<Refusing>(), document->root());
  ASSERT_FALSE(added);
  EXPECT_EQ(added.error().message, "there is no joint 'x'");
  EXPECT_TRUE(document->diagnostics().empty()) << document->diagnostics().front().to_string();
}

/// Joints 0 and 2 as they were, joint 1 as `writer` wrote it.
class StrayWrites : public ControllerHostOfFake {
 protected:
  test::Stray& begin(bool chooses) {
    auto made = std::make_unique<test::Stray>(1, chooses);
    test::Stray& writer = *made;
    EXPECT_TRUE(host_.add("writer", std::move(made), parameters()));
    state_.position_rad()[0] = 0.3;
    host_.start({}, {state_, command_});
    return writer;
  }
  void update() { EXPECT_EQ(host_.update({}, {state_, command_}), Code::kOk); }
  /// Told of these joints, one a cycle, and then of nothing more.
  void expect_told(const std::vector<std::size_t>& joints) {
    for (const std::size_t joint : joints) {
      const auto stray = host_.take_stray();
      ASSERT_TRUE(stray.has_value()) << joint;
      EXPECT_EQ(stray->joint, joint);
      EXPECT_EQ(host_.name(stray->controller), "writer");
      update();
    }
    update();
    EXPECT_FALSE(host_.take_stray().has_value());
  }
};

TEST_F(StrayWrites, AreTakenBackAndToldOnceOfEachJoint) {
  begin(false);
  for (int i = 0; i < 3; ++i) {
    for (const std::size_t j : {0U, 2U}) {
      EXPECT_EQ(command_.position_rad()[j], state_.position_rad()[j]);
      EXPECT_EQ(mode(j), static_cast<int>(ControlMode::kPosition));
      EXPECT_EQ(command_.torque_Nm()[j] + command_.voltage_V()[j] + command_.current_A()[j], 0.0);
      EXPECT_EQ(command_.velocity_rad_s()[j], 0.0);
      EXPECT_NE(command_.stiffness_Nm_rad()[j], 0.07);
      EXPECT_NE(command_.damping_Nms_rad()[j], 0.07);
      EXPECT_EQ(command_.interaction()[j] + command_.fault_reset()[j], 0);
    }
    EXPECT_EQ(command_.position_rad()[1], 0.07);
    EXPECT_EQ(mode(1), static_cast<int>(ControlMode::kPosition)) << "its claim's";
    EXPECT_EQ(command_.interaction()[1], 0);
    update();
  }
  expect_told({0, 2, 1});
}

TEST_F(StrayWrites, OfModesAreAllowedWhereTheyAreClaimed) {
  begin(true);
  EXPECT_EQ(mode(1), static_cast<int>(ControlMode::kTorque));
  EXPECT_EQ(command_.interaction()[1], 1);
  EXPECT_EQ(mode(0), static_cast<int>(ControlMode::kPosition));
  expect_told({0, 2});
}

TEST_F(StrayWrites, OfNumbersThatAreNoneDoNotGetThrough) {
  begin(false).value = std::numeric_limits<double>::quiet_NaN();
  update();
  EXPECT_EQ(command_.position_rad()[0], 0.3);
}

TEST(StrayWritesOfAWeakJoint, GetNoModeThatItCannotDo) {
  hal::RobotConfig robot = hal::test::fake_robot();
  robot.gains[0].current = {};
  ControllerHost host(robot, nullptr, 1'000'000);
  auto writer = std::make_unique<test::Stray>(0, true);
  writer->mode = ControlMode::kCurrent;
  ASSERT_TRUE(host.add("writer", std::move(writer), parameters()));
  const hal::StateImage state{robot.shape()};
  hal::CommandImage command{robot.shape()};
  host.start({}, {state, command});
  EXPECT_EQ(command.mode()[0], static_cast<std::int8_t>(ControlMode::kPosition));
  EXPECT_EQ(host.take_stray()->joint, 1U) << "other joints' first";
}

TEST_F(ControllerHostOfFake, HoldsJointsThatNobodyClaimedWhereTheyAre) {
  ASSERT_TRUE(add("one", {1}, ControlMode::kTorque));
  state_.position_rad()[0] = 0.3;
  state_.position_rad()[2] = -0.4;
  host_.start({}, {state_, command_});
  EXPECT_EQ(mode(0), static_cast<int>(ControlMode::kPosition));
  EXPECT_EQ(mode(1), static_cast<int>(ControlMode::kTorque));
  EXPECT_EQ(mode(2), static_cast<int>(ControlMode::kPosition));
  state_.position_rad()[0] = 0.35;  // pushed away: the reference stays
  EXPECT_EQ(host_.update({}, {state_, command_}), Code::kOk);
  EXPECT_EQ(command_.position_rad()[0], 0.3);
  EXPECT_EQ(command_.position_rad()[2], -0.4);
}

TEST_F(ControllerHostOfFake, GivesCompliantJointsTheirDefaultStiffness) {
  ASSERT_TRUE(add("one", {1}));
  host_.start({}, {state_, command_});
  EXPECT_EQ(command_.stiffness_Nm_rad()[1], 50.0);
  EXPECT_EQ(command_.damping_Nms_rad()[1], 15.0);
}

TEST_F(ControllerHostOfFake, IsDoneWhenEveryControllerIs) {
  ASSERT_TRUE(add("one", {0}));
  Sine* one = last_;
  ASSERT_TRUE(add("two", {1}));
  Sine* two = last_;
  host_.start({}, {state_, command_});
  one->answer = Code::kStopped;
  EXPECT_EQ(host_.update({}, {state_, command_}), Code::kOk);
  EXPECT_EQ(host_.update({}, {state_, command_}), Code::kOk);
  EXPECT_EQ(one->updates, 1);  // a controller that is done is not called again
  two->answer = Code::kStopped;
  EXPECT_EQ(host_.update({}, {state_, command_}), Code::kStopped);
}

TEST_F(ControllerHostOfFake, NamesTheControllerThatGaveUp) {
  ASSERT_TRUE(add("one", {0}));
  ASSERT_TRUE(add("two", {1}));
  last_->answer = Code::kNotFinite;
  host_.start({}, {state_, command_});
  EXPECT_EQ(host_.update({}, {state_, command_}), Code::kNotFinite);
  EXPECT_EQ(host_.name(host_.failed_controller()), "two");
}

TEST_F(ControllerHostOfFake, HoldKeepsAPositionReferenceAndItsFeedForward) {
  command_.mode()[0] = static_cast<std::int8_t>(ControlMode::kPosition);
  command_.position_rad()[0] = 0.5;
  command_.torque_Nm()[0] = 7.0;
  command_.velocity_rad_s()[0] = 1.0;
  command_.mode()[1] = static_cast<std::int8_t>(ControlMode::kTorque);
  command_.torque_Nm()[1] = 9.0;
  state_.position_rad()[0] = 0.45;
  state_.position_rad()[1] = -0.2;
  state_.drive_state()[0] = static_cast<std::uint8_t>(DriveState::kOperationEnabled);
  host_.references().hold({state_, command_});
  EXPECT_EQ(command_.position_rad()[0], 0.5);
  EXPECT_EQ(command_.torque_Nm()[0], 7.0);
  EXPECT_EQ(command_.velocity_rad_s()[0], 0.0);
  EXPECT_EQ(mode(1), static_cast<int>(ControlMode::kPosition));
  EXPECT_EQ(command_.position_rad()[1], -0.2);
  EXPECT_EQ(command_.torque_Nm()[1], 0.0);
}

TEST_F(ControllerHostOfFake, HoldFollowsAJointWhoseDriveIsOff) {
  command_.mode()[0] = static_cast<std::int8_t>(ControlMode::kPosition);
  command_.position_rad()[0] = 0.5;
  command_.torque_Nm()[0] = 7.0;
  state_.position_rad()[0] = 0.45;
  state_.drive_state()[0] = static_cast<std::uint8_t>(DriveState::kFault);
  host_.references().hold({state_, command_});
  EXPECT_EQ(command_.position_rad()[0], 0.45);
  EXPECT_EQ(command_.torque_Nm()[0], 0.0);
}

}  // namespace
}  // namespace tandem::runtime
