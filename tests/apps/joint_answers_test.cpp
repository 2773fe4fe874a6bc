// What a run answers of its joints and sensors: its commands over a fake robot, and what
// `tandem sensor` and `tandem joint` print of them.
#include <unistd.h>

#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "apps/clients/commands.hpp"
#include "apps/command_line/command_line.hpp"
#include "apps/control/run_control.hpp"
#include "apps/transport/control_socket.hpp"
#include "tests/runtime/loop_run.hpp"
#include "tests/support/socket_path.hpp"

namespace tandem::apps {
namespace {

using runtime::RunPhase;

hal::RobotConfig with_a_slide() {
  hal::RobotConfig robot = hal::test::fake_robot();
  robot.joints[1].slides = true;
  return robot;
}

/// A run without controllers whose cycles are made while somebody waits for an answer. Its elbow
/// slides.
template <class Backend>
struct Answered : ::testing::Test, runtime::test::LoopRun {
  Answered() : LoopRun(with_a_slide()) {}
  void begin(RunPhase in = RunPhase::kRunning) {
    LoopRun::begin(backend, {.after_stop = runtime::AfterStop::kWait});
    steps(100);
    ASSERT_EQ(cycle->phase(), in);
    add_run_commands(registry, *cycle, robot, judge);
  }
  [[nodiscard]] Json answer(const std::string& question) {
    return while_cycling([&] { return registry.answer(question); });
  }
  [[nodiscard]] std::string refused(const std::string& question) {
    const Json said = answer(question);
    EXPECT_EQ(said["ok"], false) << said;
    return said.value("error", "") + " (" + said.value("hint", "") + ")";
  }
  [[nodiscard]] Json joint(std::size_t index) {
    return answer(R"({"do": "joint.list"})")["joints"][index];
  }
  /// A command line as it is asked of `socket`.
  [[nodiscard]] static Exit perform(const std::vector<std::string>& words,
                                    const std::string& socket) {
    std::vector<const char*> line{"tandem"};
    for (const std::string& word : words) line.push_back(word.c_str());
    line.insert(line.end(), {"--socket", socket.c_str()});
    const Command command = parse_command_line(static_cast<int>(line.size()), line.data());
    const auto* asked = std::get_if<AskedOptions>(&command);
    return asked == nullptr ? Exit::kUsage : asked_command(*asked);
  }
  /// Runs a command against the run's socket; `out` and `err` are what it printed.
  Exit command(const std::vector<std::string>& words) {
    const std::string path = tandem::test::socket_path("-joints");
    const auto socket = ControlSocket::open(path, registry);
    EXPECT_TRUE(socket) << socket.error().to_string();
    ::testing::internal::CaptureStdout();
    ::testing::internal::CaptureStderr();
    const Exit status = while_cycling([&] { return perform(words, path); });
    out = ::testing::internal::GetCapturedStdout();
    err = ::testing::internal::GetCapturedStderr();
    return status;
  }
  static void has(const std::string& text, const std::string& words) {
    EXPECT_NE(text.find(words), std::string::npos) << text;
  }

  Backend backend{robot};
  JudgeGains judge;
  ControlRegistry registry;
  std::string out, err;  // of the last command
};

using JointAnswers = Answered<runtime::test::FirstOrderRobot>;
using SensorAnswers = Answered<hal::test::FakeBackend>;

TEST_F(SensorAnswers, NameFrameValuesAndAge) {
  robot.sensors[0].link = "palm";
  begin();
  const Json sensors = answer(R"({"do": "sensor.list"})")["sensors"];
  ASSERT_EQ(sensors.size(), 2U);
  EXPECT_EQ(sensors[0]["sensor"], "hand");
  EXPECT_EQ(sensors[0]["type"], "force_torque");
  EXPECT_EQ(sensors[0]["joint"], "wrist");
  EXPECT_EQ(sensors[0]["link"], "palm");
  EXPECT_EQ(sensors[0]["age_cycles"], 0);
  EXPECT_EQ(sensors[0]["valid"], true);
  EXPECT_EQ(sensors[0]["force_N"][2], 9.81);
  EXPECT_EQ(sensors[0]["torque_Nm"].size(), 3U);
  EXPECT_EQ(sensors[1]["type"], "imu");
  EXPECT_EQ(sensors[1]["orientation_xyzw"], Json({0.0, 0.0, 0.0, 1.0}));
  EXPECT_EQ(sensors[1]["angular_velocity_rad_s"].size(), 3U);
  EXPECT_EQ(sensors[1]["specific_force_m_s2"], Json({0.0, 0.0, 9.81}));

  EXPECT_EQ(command({"sensor", "list"}), Exit::kDone) << err;
  has(out, "palm");
  has(out, "0  0  9.81");
  has(out, "fresh");
  EXPECT_EQ(command({"sensor", "list", "imu"}), Exit::kDone);
  EXPECT_EQ(out.find("palm"), std::string::npos) << out;
  EXPECT_EQ(command({"sensor", "list", "hnad"}), Exit::kUsage);
  has(err, "the robot has no sensor 'hnad' (did you mean 'hand'?)");
}

TEST_F(JointAnswers, OfASensorThatIsSilentAreNotValid) {
  begin();
  backend.lost_sensor = 1;
  steps(20);
  const Json imu = answer(R"({"do": "sensor.list"})")["sensors"][1];
  EXPECT_EQ(imu["valid"], false);
  EXPECT_GE(imu["age_cycles"].get<int>(), 20);
  EXPECT_EQ(command({"sensor", "list"}), Exit::kDone);
  has(out, "no sample for ");
}

TEST_F(JointAnswers, RefuseAnAngleForAJointThatSlides) {
  begin();
  const std::string move = R"({"do": "joint.move", "joint": "elbow", "target_rad": 0.5)";
  EXPECT_EQ(refused(move + R"(, "unit": "angle"})"),
            "elbow: this joint slides (give metres: 20mm, 0.02m)");
  EXPECT_EQ(joint(1)["moving"], false);
  EXPECT_EQ(answer(move + R"(, "unit": "length"})")["ok"], true);
  EXPECT_EQ(joint(1)["moving"], true);
  EXPECT_EQ(joint(1)["slides"], true);
  EXPECT_EQ(joint(2)["slides"], false);
  EXPECT_EQ(refused(R"({"do": "joint.move", "joint": "wrist", "target_rad": 0, "unit": "length"})"),
            "wrist: this joint turns (give an angle: 30deg, 0.5rad)");
  EXPECT_EQ(command({"joint", "move", "elbow", "--to", "30deg"}), Exit::kUsage);
  has(err, "elbow: this joint slides");
}

TEST_F(JointAnswers, RefuseAMotionWhileAFaultIsLatched) {
  begin();
  const std::string move = R"({"do": "joint.move", "joint": "wrist", "target_rad": 0.5})";
  EXPECT_EQ(answer(move)["ok"], true);
  backend.faulted_joint = 0;
  steps(2);
  ASSERT_EQ(cycle->phase(), RunPhase::kFaulted);
  EXPECT_EQ(
      refused(move),
      "wrist: nothing is moved while a fault is latched (tandem fault reset, then ask again)");
  EXPECT_EQ(refused(R"({"do": "joint.set", "joint": "wrist", "mode": "velocity"})"),
            "wrist: nothing is set while a fault is latched (tandem fault reset, then ask again)");
  EXPECT_EQ(joint(2)["moving"], false) << "the one under way is over";
}

TEST_F(JointAnswers, WaitForAMotionUntilItHasArrived) {
  begin();
  const std::vector<std::string> move{"joint", "move",    "wrist", "--to",
                                      "0.3",   "--speed", "2",     "--wait"};
  EXPECT_EQ(command(move), Exit::kDone) << err;
  has(out, "wrist moves from 0.1");  // it may have begun before the answer is written
  has(out, " rad to 0.3 rad: ");
  has(out, "wrist has arrived: 0.3 rad, measured 0.");
  EXPECT_EQ(err, "");
  EXPECT_EQ(joint(2)["commanded_position_rad"], 0.3);
  EXPECT_EQ(command(move), Exit::kDone) << "it is there already" << err;
}

TEST_F(JointAnswers, WarnOfAMotionThatHasArrivedWhenTheJointHasNot) {
  backend.sag_rad = 0.05;
  begin();
  const auto move = [this](const char* joint, const char* to) {
    return command({"joint", "move", joint, "--to", to, "--speed", "2", "--wait"});
  };
  EXPECT_EQ(move("wrist", "20deg"), Exit::kDone);
  has(out, " rad (");
  has(out, "to 0.3491 rad (20 deg): tandem joint list wrist");
  has(out, "wrist has arrived: 0.3491 rad (20 deg), measured ");
  has(err, "warning: wrist: what is measured is 0.05");
  has(err, "it lags, or something holds it: tandem joint show wrist");
  EXPECT_EQ(move("elbow", "0.4"), Exit::kDone) << "it slides";
  has(out, "to 0.4 m: ");
  has(err, "warning: elbow: what is measured is 0.05");
}

TEST_F(JointAnswers, SayTheLimitsWithTheirUnits) {
  begin();
  const std::string wrist = R"({"do": "joint.move", "joint": "wrist", "target_rad": )";
  EXPECT_EQ(refused(wrist + "-30}"),
            "wrist: the target -30 rad (-1719 deg) is beyond the joint's limits (give -1.5 to 1.5 "
            "rad, which is -85.94 to 85.94 deg)");
  EXPECT_EQ(refused(wrist + R"(0, "speed_rad_s": 3})"),
            "wrist: the speed 3 rad/s (171.9 deg/s) is beyond the joint's limit (give more than 0, "
            "at most 2 rad/s (114.6 deg/s))");
  EXPECT_EQ(refused(wrist + R"(0, "acceleration_rad_s2": -1})"),
            "wrist: the acceleration -1 rad/s2 (-57.3 deg/s2) is beyond the joint's limit (give "
            "more than 0)");
  EXPECT_EQ(refused(R"({"do": "joint.move", "joint": "elbow", "target_rad": 20})"),
            "elbow: the target 20 m is beyond the joint's limits (give -1.5 to 1.5 m)");
  EXPECT_EQ(refused(R"({"do": "joint.set", "joint": "elbow", "stiffness_Nm_rad": 201})"),
            "elbow: the stiffness 201 N/m is beyond the joint's limit (give 0 to 200 N/m)");
  has(refused(R"({"do": "joint.set", "joint": "wrist", "damping_Nms_rad": -1})"),
      "wrist: the damping -1 Nms/rad is beyond");
  EXPECT_EQ(joint(2)["min_position_rad"], -1.5);
}

/// Those that turn and those that slide have no unit in common.
TEST_F(JointAnswers, ShowEachJointInItsUnits) {
  begin();
  EXPECT_EQ(command({"joint", "list"}), Exit::kDone) << err;
  for (const char* words : {"position  ", "0.1 rad  ", "0.1 m  ", " rad/s  ", " m/s  "}) {
    has(out, words);
  }
  EXPECT_EQ(out.find('['), std::string::npos) << out;
  EXPECT_EQ(command({"joint", "list", "elbow"}), Exit::kDone);
  has(out, "position [m]  velocity [m/s]  torque [N]");
  EXPECT_EQ(command({"joint", "list", "elbow", "--drives"}), Exit::kDone);
  has(out, "motor [m]");
  EXPECT_EQ(command({"joint", "list", "wrist", "shoulder", "--drives"}), Exit::kDone);
  has(out, "motor [rad]");
  EXPECT_EQ(command({"joint", "set", "elbow", "--stiffness", "40"}), Exit::kDone) << err;
  has(out, " N/m\n");
  has(out, " Ns/m");
}

/// They were the old ones, as the command goes over to them within 0.1 s.
TEST_F(JointAnswers, OfASetAreTheValuesThatWereAskedFor) {
  begin();
  const std::string set = R"({"do": "joint.set", "joint": "wrist", "stiffness_Nm_rad": 33,)"
                          R"( "damping_Nms_rad": 1.5)";
  const Json now = answer(set + R"(, "mode": "position", "interaction": "compliant"})");
  EXPECT_EQ(now["stiffness_Nm_rad"], 33.0) << now;
  EXPECT_EQ(now["damping_Nms_rad"], 1.5);
  EXPECT_EQ(now["mode"], "position");
  EXPECT_EQ(now["interaction"], "compliant");
  EXPECT_EQ(now["moving"], false) << "nobody asked for a motion";
  EXPECT_FALSE(now.contains("note"));
  EXPECT_EQ(joint(2)["stiffness_Nm_rad"], 33.0);
}

/// The impedance of a joint that is held stays: the answer says when the other one comes.
TEST_F(JointAnswers, OfASetWhileJointsAreHeldSayWhenItIsInForce) {
  ASSERT_TRUE(host->add("sine", std::make_shared<runtime::test::Sine>(std::vector<std::size_t>{0}),
                        runtime::test::parameters()));
  begin();
  (void)cycle->inbox().emergency_stop(hal::StopCategory::kCategory1);
  steps(2);
  cycle->inbox().reset_faults();
  steps(60);
  ASSERT_EQ(cycle->phase(), RunPhase::kHeld);
  const Json later = answer(R"({"do": "joint.set", "joint": "wrist", "stiffness_Nm_rad": 33})");
  EXPECT_EQ(later["done"], true) << later;
  EXPECT_EQ(later.value("note", ""),
            "the joint is held as it is: its new impedance is in force once controllers run");
}

/// The last good figures of an encoder that gives no value looked fresh.
TEST_F(JointAnswers, SayThatTheFiguresOfAFaultySensorAreNotLive) {
  for (hal::JointConfig& joint : robot.joints) joint.on_fault = hal::StopCategory::kWarn;
  begin();
  const auto shown = [&](const char* verb = "show") {
    EXPECT_EQ(command({"joint", verb, "elbow"}), Exit::kDone) << err;
    return out;
  };
  EXPECT_EQ(joint(1)["feedback"], "fresh");
  has(shown(), "sample          fresh");
  backend.fault_code = 0x7300;
  backend.faulted_joint = 1;
  steps(2);
  EXPECT_EQ(joint(1)["feedback"], "sensor_fault");
  EXPECT_EQ(joint(0)["feedback"], "fresh");
  has(shown(), "sample          a sensor is in fault: what it measures is not valid");
  has(shown("list"), "fault (0x7300), sensor");
  backend.fault_code = 0x8611;  // it says nothing of the sensors
  steps(2);
  has(shown(), "sample          fresh");
  backend.faulted_joint = -1;
  backend.lost_joint = 1;
  steps(3);  // and no more, as while an answer is awaited
  EXPECT_EQ(registry.answer(R"({"do": "joint.list"})")["joints"][1]["feedback"], "old");
  steps(20);
  EXPECT_EQ(joint(1)["feedback"], "lost");
  has(shown(), " cycles old: no feedback");
}

// It stood at 0, it seemed.
TEST_F(JointAnswers, SayNothingOfAJointThatWasNeverHeard) {
  backend.lost_joint = 1;  // and so the run is in fault
  begin(RunPhase::kFaulted);
  const Json joints = registry.answer(R"({"do": "joint.list"})")["joints"];
  for (const char* key : {"position_rad", "velocity_rad_s", "torque_Nm", "motor_position_rad"}) {
    EXPECT_TRUE(joints[1][key].is_null()) << key;
    EXPECT_TRUE(joints[0][key].is_number()) << key;
  }
  (void)command({"joint", "show", joints[1]["joint"]});
  has(out, "position        - ");
}

TEST_F(JointAnswers, TakeQuantitiesWithABlankAndInCentimetres) {
  begin();
  for (const char* text : {"30 deg", "30deg", " 30  deg ", "0.5235987755982988 rad"}) {
    EXPECT_EQ(command({"joint", "move", "wrist", "--to", text, "--speed", "20 deg/s",
                       "--acceleration", "40 deg/s2"}),
              Exit::kDone)
        << text << ": " << err;
    has(out, "0.5236 rad");
  }
  for (const char* text : {"5cm", "5 cm", "50 mm", "50mm", "0.05 m", "0.05"}) {  // it slides
    EXPECT_EQ(command({"joint", "move", "elbow", "--to", text, "--speed", "10 cm/s"}), Exit::kDone)
        << text << ": " << err;
    has(out, " to 0.05 m");
  }
  for (const char* text : {"5 c m", "5 km", "cm", " ", "5 5", "5 deg rad"}) {
    EXPECT_EQ(command({"joint", "move", "elbow", "--to", text}), Exit::kUsage) << text;
    has(err, "is no number with a unit");
    has(err, "2cm");
  }
}

TEST_F(JointAnswers, TellAWaiterThatTheRunHasEnded) {
  begin();
  const std::vector<std::string> move{"joint", "move",    "wrist", "--to",
                                      "-1.2",  "--speed", "0.01",  "--wait"};
  const std::string path = tandem::test::socket_path("-end");
  auto socket = ControlSocket::open(path, registry);
  ASSERT_TRUE(socket) << socket.error().to_string();
  ::testing::internal::CaptureStderr();
  ::testing::internal::CaptureStdout();
  auto waits = std::async(std::launch::async, [&] { return perform(move, path); });
  for (int i = 0; i < 20'000 && joint(2)["moving"] == false; ++i) steps(1);
  while_cycling([&] {  // until what is asked for is answered
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    socket->reset();
    return 0;
  });
  EXPECT_EQ(waits.get(), Exit::kFault);
  (void)::testing::internal::GetCapturedStdout();
  EXPECT_EQ(::testing::internal::GetCapturedStderr(),
            "error: the run has ended (its own output and its log say how)\n");
}

TEST_F(JointAnswers, HaltEveryMotionOfAnOperator) {
  begin();
  for (const char* joint : {"elbow", "wrist"}) {
    ASSERT_EQ(command({"joint", "move", joint, "--to", "-1.2", "--speed", "0.1"}), Exit::kDone);
  }
  EXPECT_EQ(command({"joint", "halt"}), Exit::kDone) << err;
  has(out, "joints  elbow, wrist");
  steps(2000);
  for (const std::size_t j : {1U, 2U}) {
    EXPECT_EQ(joint(j)["moving"], false);
    EXPECT_GT(joint(j)["commanded_position_rad"].get<double>(), -1.0);
  }
  EXPECT_EQ(answer(R"({"do": "joint.halt"})")["joints"], Json::array()) << "nothing is led";
  EXPECT_EQ(command({"joint", "halt"}), Exit::kDone) << err;
  EXPECT_EQ(out.find("cycle"), std::string::npos) << "it had said: done in cycle 0\n" << out;
  has(out, "nothing has moved by joint move, home or recover");
}

/// Somebody else stops it, or a fault does.
TEST_F(JointAnswers, EndTheWaitingWithStatus1WhenTheMotionEndsElsewhere) {
  begin();
  const std::vector<std::string> move{"joint", "move",    "wrist", "--to",
                                      "-1.2",  "--speed", "0.01",  "--wait"};
  const auto wait_and = [&](const std::function<void()>& meanwhile) {
    const std::string path = tandem::test::socket_path("-wait");
    const auto socket = ControlSocket::open(path, registry);
    ::testing::internal::CaptureStdout();
    ::testing::internal::CaptureStderr();
    auto waits = std::async(std::launch::async, [&] { return perform(move, path); });
    for (int i = 0; i < 20'000 && joint(2)["moving"] == false; ++i) steps(1);
    meanwhile();
    while (waits.wait_for(std::chrono::microseconds(100)) != std::future_status::ready) steps(1);
    out = ::testing::internal::GetCapturedStdout();
    err = ::testing::internal::GetCapturedStderr();
    return waits.get();
  };
  EXPECT_EQ(wait_and([this] {
              EXPECT_EQ(answer(R"({"do": "joint.stop", "joint": "wrist"})")["ok"], true);
            }),
            Exit::kFault);
  has(err, "error: wrist: its motion to -1.2 rad has ended at ");
  has(err, "it was stopped, or sent elsewhere");
  EXPECT_EQ(wait_and([this] {
              backend.faulted_joint = 0;
              steps(1);
            }),
            Exit::kFault);
  has(err, "its drive is not enabled any more: tandem fault show");
}

TEST_F(JointAnswers, ShowOneJointWithItsDrive) {
  begin();
  EXPECT_EQ(command({"joint", "show", "elbow"}), Exit::kDone) << err;
  for (const char* words :
       {"elbow, slides", "motor position", " m at the joint", "N/m", "operation enabled",
        "fault           none", " degC", "fresh", "limits          -1.5 to 1.5 m, 2 m/s, 20 N"}) {
    has(out, words);
  }
  EXPECT_EQ(command({"joint", "show", "wrist"}), Exit::kDone) << err;
  has(out, "limits          -1.5 to 1.5 rad (-85.94 to 85.94 deg), 2 rad/s, 20 Nm");
  EXPECT_EQ(command({"joint", "show", "elbwo"}), Exit::kUsage);
  has(err, "the robot has no joint 'elbwo' (did you mean 'elbow'?)");
}

/// Whether the loop takes them at once or, of a paused run, later: what is asked next is judged
/// with what was asked before.
TEST_F(JointAnswers, RefuseGainsThatTheModelFindsUnstable) {
  judge = [](std::size_t joint, hal::PidLoop loop, const auto& gains, const auto& position_rad) {
    EXPECT_EQ(joint, 1U);
    EXPECT_EQ(position_rad.size(), 3U);
    const hal::PidGains& of = gains[static_cast<std::size_t>(loop)];
    const bool stable = of.ki < of.kp;
    return Json{{"judged", true},         {"stable", stable},
                {"loop", "position"},     {"phase_margin_deg", 20.0},
                {"crossover_rad_s", 7.0}, {"inertia_kg_m2", 1.0},
                {"doubles_in_s", 0.5},    {"remedy", "ki = 1 gives it one"}};
  };
  begin();
  const std::string ask = R"({"do": "joint.gains", "joint": "elbow", "loop": "position", )";
  const Json taken = answer(ask + R"("kp": 20.0, "ki": 10.0})");
  EXPECT_EQ(taken["ok"], true) << taken;
  EXPECT_EQ(taken["stability"]["phase_margin_deg"], 20.0);
  has(taken["note"], "warning: it may swing; position loop: phase margin 20 deg at 7 rad/s");
  const std::string no = refused(ask + R"("ki": 30.0})");
  has(no, "elbow: with kp = 20, ki = 30, kd = ");
  has(no, "ki = 1 gives it one; --anyway");
  EXPECT_EQ(joint(1)["gains"]["position"]["ki"], 10.0);
  has(refused(ask + R"("kp": -1})"), "kp -1 is beyond the joint's limit");

  const Json waits = registry.answer(ask + R"("kp": 40.0})");  // no cycle takes it
  EXPECT_EQ(waits["done"], false) << waits;
  EXPECT_EQ(registry.answer(ask + R"("ki": 30.0})")["ok"], true) << "40, not 20";
  const Json insisted = answer(ask + R"("ki": 60.0, "anyway": true})");
  EXPECT_EQ(insisted["ok"], true) << insisted;
  has(insisted["note"], "warning: the position loop is unstable, it doubles in 0.5 s");
  EXPECT_EQ(joint(1)["gains"]["position"]["kp"], 40.0);
  EXPECT_EQ(joint(1)["gains"]["position"]["ki"], 60.0);
}

TEST_F(JointAnswers, SayThatGainsWithoutAModelAreNotJudged) {
  begin();
  const Json taken =
      answer(R"({"do": "joint.gains", "joint": "elbow", "loop": "position", "kp": 20.0})");
  EXPECT_EQ(taken["stability"]["judged"], false) << taken;
  has(taken["note"], "not judged against the model: ");
}

TEST_F(JointAnswers, ResetOneDrive) {
  for (hal::JointConfig& joint : robot.joints) joint.on_fault = hal::StopCategory::kWarn;
  begin();
  const std::vector<std::string> reset{"joint", "reset", "elbow"};
  EXPECT_EQ(command(reset), Exit::kDone) << err;
  has(out,
      "elbow: its drive has no fault; what the run has latched stays until `tandem fault reset`");
  backend.faulted_joint = 1;
  steps(2);
  EXPECT_EQ(joint(1)["fault"], 0x7310);
  has(joint(1)["fault_text"], "0x7310");
  EXPECT_EQ(command(reset), Exit::kDone) << err;
  has(out, "elbow: its fault is cleared, and it is held where it is");
  EXPECT_EQ(joint(1)["fault_text"], "");

  backend.reset_clears = false;
  backend.faulted_joint = 1;
  steps(2);
  EXPECT_EQ(command(reset), Exit::kFault) << out;
  has(err, "error: elbow: the reset failed, its cause is still there: ");

  backend.reset_clears = true;
  (void)cycle->inbox().emergency_stop(hal::StopCategory::kCategory1);
  steps(1);
  EXPECT_EQ(command(reset), Exit::kDone) << err;
  has(out, "its drive stays disabled: `tandem fault reset` enables every joint where it is");
  EXPECT_EQ(cycle->phase(), RunPhase::kFaulted);
  EXPECT_EQ(answer(R"({"do": "fault.show"})")["latched"], 2) << "until the run is reset";
}

}  // namespace
}  // namespace tandem::apps
