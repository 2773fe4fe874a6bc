// `tandem check`: every error of every file, and nothing moves.
#include <algorithm>

#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

class Check : public Program {};

TEST_F(Check, TellsWhatARunWouldDoAndLeavesNothingBehind) {
  const Outcome outcome = tandem("check hold.toml");
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  for (const std::string text : {"double_pendulum", "controller hold", "5000 cycles"}) {
    EXPECT_NE(outcome.out.find(text), std::string::npos) << text << "\nin: " << outcome.out;
  }
  EXPECT_FALSE(has_log());
  EXPECT_FALSE(std::filesystem::exists(folder_ / "runs"));
}

TEST_F(Check, ReadsARobotByItself) {
  const Outcome outcome = tandem("check robot.toml");
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("2 on 1 board\n"), std::string::npos) << outcome.out;
}

TEST_F(Check, ShowsTheScalesOfDrivesOfOthersAndWhereTheyComeFrom) {
  const std::string robot = TANDEM_SOURCE_DIR "/config/panda_classic/robot.toml";
  const Outcome outcome = tandem("check " + shell_word(robot) + " --json scales.json");
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  const auto json = nlohmann::json::parse(read_text(folder_ / "scales.json"));
  ASSERT_EQ(json["scales"].size(), 7U) << json;
  const auto& first = json["scales"][0];
  for (const char* key : {"encoder_counts_from", "rated_torque_from", "velocity_units_from"}) {
    EXPECT_TRUE(first[key].is_string()) << key << first;
  }
  EXPECT_GT(first["encoder_counts_per_rev"], 100.0);
  EXPECT_NE(outcome.out.find(first["joint"].get<std::string>()), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find(" counts per revolution ("), std::string::npos) << outcome.out;
  const Outcome own = tandem("check robot.toml --json own.json");
  EXPECT_EQ(own.status, 0) << own.err;
  EXPECT_FALSE(nlohmann::json::parse(read_text(folder_ / "own.json")).contains("scales"));
}

/// `--json robot.toml` had replaced the robot.
TEST_F(Check, DoesNotWriteItsJsonOverAFileThatIsNone) {
  const std::string robot = read_text(folder_ / "robot.toml");
  const Outcome outcome = tandem("check robot.toml --json robot.toml");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("error: robot.toml: this file is there, and it is no JSON"),
            std::string::npos)
      << outcome.err;
  EXPECT_EQ(read_text(folder_ / "robot.toml"), robot);
  EXPECT_EQ(tandem("check robot.toml --json new.json").status, 0);
  EXPECT_EQ(tandem("check robot.toml --json new.json").status, 0) << "its own is written again";
}

TEST_F(Check, GivesEveryErrorAsJsonWithFileLineKeyAndHint) {
  edit("robot.toml", "kp = 6.0", "kp = -6.0");
  edit("robot.toml", "gear_ratio", "gear_ration");
  const Outcome outcome = tandem("check hold.toml --json -");
  EXPECT_EQ(outcome.status, 2);
  const auto json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json["ok"], false);
  ASSERT_EQ(json["errors"].size(), 2U) << outcome.out;  // unknown, wrong sign
  for (const auto& error : json["errors"]) {
    EXPECT_NE(error["file"].get<std::string>().find("robot.toml"), std::string::npos);
    EXPECT_GT(error["line"].get<int>(), 0);
    EXPECT_NE(error["key"], "");
    EXPECT_NE(error["message"], "");
    EXPECT_TRUE(error.contains("hint"));
  }
}

/// It is category 1 then, which was first said when somebody pressed the button.
TEST_F(Check, WarnsOfARetractThatNoControllerCanCarryOut) {
  std::string text = read_text(folder_ / "hold.toml");
  const auto line = std::ranges::count(text, '\n') + 4;
  text +=
      "\n[estimation.observer]\n[estimation.collision]\nreaction = \"retract\"\n"
      "threshold_Nm = { joint1 = 1.0 }\n";
  write_text(folder_ / "retract.toml", text);
  const Outcome outcome = tandem("check retract.toml");
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("retract.toml:" + std::to_string(line) +
                             ": estimation.collision.reaction: \"retract\" will be category 1: no "
                             "controller of retract.toml can"),
            std::string::npos)
      << outcome.err;
  EXPECT_NE(outcome.out.find("collisions, by 1 threshold; reaction: safe posture, stop"),
            std::string::npos)
      << outcome.out;
}

TEST_F(Check, WarnsOfACategory2ThatNoControllerCanCarryOut) {
  const std::string robot = read_text(folder_ / "robot.toml");
  write_text(folder_ / "robot.toml", robot + "\n[safety]\nemergency_stop = \"category2\"\n");
  const auto line = std::ranges::count(robot, '\n') + 3;
  const std::string warning =
      "robot.toml:" + std::to_string(line) +
      ": safety.emergency_stop: \"category2\" will be category 1: no "
      "controller of hold.toml can bring the robot to a safe posture (add a "
      "controller that can retreat, such as squat, or say \"category1\" "
      "(docs/safety.md))\n";
  for (const std::string command : {"check hold.toml", "run hold.toml --no-log --duration 0.1"}) {
    const Outcome outcome = tandem(command);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_EQ(outcome.err.find("warning: "), 0U) << outcome.err;
    EXPECT_NE(outcome.err.find(warning), std::string::npos) << outcome.err << warning;
  }
  write_text(folder_ / "robot.toml", robot);
  edit("robot.toml", "names = [", "on_fault = \"category2\"\nnames = [");
  const Outcome joints = tandem("check hold.toml");
  EXPECT_NE(
      joints.err.find(": joint.joint1.on_fault: \"category2\" will be category 1, and so will "
                      "1 more: no controller"),
      std::string::npos)
      << joints.err;
  edit("robot.toml", "category2", "category1");
  EXPECT_EQ(tandem("check hold.toml").err.find("category"), std::string::npos);
}

TEST_F(Check, WarnsOfNoCategory2ThatAControllerCanCarryOut) {
  for (const char* file : {"coman.urdf", "robot.toml", "squat.toml", "hold.toml"}) {
    std::filesystem::copy_file(std::filesystem::path(TANDEM_SOURCE_DIR "/config/coman") / file,
                               folder_ / file, std::filesystem::copy_options::overwrite_existing);
  }
  write_text(folder_ / "robot.toml",
             read_text(folder_ / "robot.toml") + "\n[safety]\nemergency_stop = \"category2\"\n");
  EXPECT_NE(tandem("check hold.toml").err.find("safety.emergency_stop"), std::string::npos);
  const Outcome squat = tandem("check squat.toml");
  EXPECT_EQ(squat.status, 0) << squat.err;
  EXPECT_EQ(squat.err.find("safety.emergency_stop"), std::string::npos) << squat.err;
}

TEST_F(Check, ShowsTheLoadOfEveryBus) {
  const Outcome outcome = tandem("check --bus hold.toml --json -");
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("slow commands, if all changed"), std::string::npos) << outcome.err;
  const auto bus = nlohmann::json::parse(outcome.out)["buses"][0];
  EXPECT_EQ(bus["bus"], "arm");
  EXPECT_EQ(bus["ok"], true);
  EXPECT_EQ(bus["rows"][0]["what"], "SYNC");
  EXPECT_EQ(bus["rows"][0]["time_us"], 55.0);
}

TEST_F(Check, RefusesWhatARealBusCannotCarryAndSoDoesRun) {
  edit("robot.toml", "data_bitrate = 8_000_000", "max_load = 0.1");
  for (const std::string command : {"check hold.toml", "check --bus robot.toml", "run hold.toml"}) {
    const Outcome outcome = tandem(command);
    EXPECT_EQ(outcome.status, 2) << command;
    EXPECT_NE(outcome.err.find("cannot carry its mean load"), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.err.find("any of these fits: period_ns ="), std::string::npos) << outcome.err;
  }
  EXPECT_FALSE(has_log());
}

TEST_F(Check, TellsHowLoopsCloseAndWhatCanStillMove) {
  const Outcome robot =
      tandem("check " + shell_word(TANDEM_SOURCE_DIR "/config/four_bar/robot.toml"));
  EXPECT_EQ(robot.status, 0) << robot.err;
  for (const std::string text :
       {"revolute, coupler_end to rocker_end", "closes from a gap of 0.0", "1 of 3 degrees"}) {
    EXPECT_NE(robot.out.find(text), std::string::npos) << text << "\nin: " << robot.out;
  }
  const Outcome run =
      tandem("check " + shell_word(TANDEM_SOURCE_DIR "/config/parallel_ankle/hold.toml"));
  EXPECT_NE(run.out.find("2 of 4 degrees"), std::string::npos) << run.out;
}

/// Closed loops, in files that a test may spoil.
class CheckLoops : public Check {
 protected:
  void SetUp() override {
    Check::SetUp();
    for (const char* file : {"robot.toml", "four_bar.urdf", "hold.toml"}) {
      std::filesystem::copy_file(TANDEM_SOURCE_DIR "/config/four_bar/" + std::string(file),
                                 folder_ / file, std::filesystem::copy_options::overwrite_existing);
    }
  }

  /// One error, of `check` on robot and experiment and of `run`.
  void expect_refused(const std::string& expected) const {
    for (const std::string command : {"check robot.toml", "check hold.toml", "run hold.toml"}) {
      const Outcome outcome = tandem(command);
      EXPECT_EQ(outcome.status, 2) << command;
      EXPECT_EQ(outcome.err.substr(0, outcome.err.find('\n')), "error: " + expected) << command;
      EXPECT_EQ(std::ranges::count(outcome.err, '\n'), 1) << outcome.err;
      EXPECT_EQ(outcome.out, "") << "not called fine";
    }
  }
};

TEST_F(CheckLoops, RefusesAnAxisThatDiffersAndSaysByHowMuch) {
  edit("robot.toml", "rocker\"\nxyz_m", "rocker\"\nrpy_rad = [0.5, 0, 0]\nxyz_m");
  expect_refused(
      "robot.toml:21: loop.pin: the loop does not close in the posture 'ready': where its sites "
      "meet, its axes are 28.65 degrees apart (axis is a direction in both sites' frames: correct "
      "it, or turn a site by rpy_rad)");
}

TEST_F(CheckLoops, AreCheckedByEmulateToo) {
  edit("robot.toml", "rocker\"\nxyz_m", "rocker\"\nrpy_rad = [0.5, 0, 0]\nxyz_m");
  const Outcome outcome = tandem("emulate robot.toml --no-build");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("loop.pin: the loop does not close in the posture 'ready'"),
            std::string::npos)
      << outcome.err;
}

TEST_F(CheckLoops, RefusesAGapThatNoPositionCloses) {
  edit("robot.toml", "[0.28, 0.0, 0.0]", "[2.28, 0.0, 0.0]");
  const Outcome outcome = tandem("check robot.toml --json -");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("robot.toml:20: loop.pin: the loop does not close in the posture "
                             "'ready': a gap of "),
            std::string::npos)
      << outcome.err;
  const auto json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json["ok"], false);
  EXPECT_EQ(json["loop_postures"][0]["closed"], false);
}

TEST_F(CheckLoops, RefusesTwoSitesOfOneBody) {
  edit("robot.toml", "link = \"rocker\"", "link = \"coupler\"");
  expect_refused(
      "robot.toml:20: loop.pin: both sites are on the link 'coupler', so the loop closes nothing "
      "(put one of them on the link that it shall meet)");
}

TEST_F(CheckLoops, RefusesAPassiveJointInAPosture) {
  edit("robot.toml", "crank = 1.0", "crank = 1.0\ncoupler = 0.3");
  expect_refused(
      "robot.toml:76: posture.ready.coupler: the joint 'coupler' is passive: where it stands "
      "follows from the closed loops (remove it here; position_rad of its [[passive]] says where "
      "it starts from)");
}

TEST_F(CheckLoops, NamesTheControllerThatNeedsAMotorAtEveryJoint) {
  edit("hold.toml", "plugin = \"hold\"",
       "plugin = \"squat\"\nparameters = { depth_m = 0.1, period_s = 2 }");
  for (const std::string command : {"check hold.toml", "run hold.toml"}) {
    const Outcome outcome = tandem(command);
    EXPECT_EQ(outcome.status, 2);
    EXPECT_EQ(outcome.err,
              "error: hold.toml:9: controller.squat: the joint 'coupler' is passive, and this "
              "controller needs a motor at every joint (run hold, joint_trajectory or "
              "gravity_compensation)\n");
  }
}

TEST_F(CheckLoops, TellsOfThemAsJsonBeforeKernelsAreBuilt) {
  edit("robot.toml", "inertia_kg_m2 = 0.002", "inertia_kg_m2 = 0.0021");  // other kernels
  for (const std::string file : {"robot.toml", "hold.toml"}) {
    const Outcome outcome = tandem("check " + file + " --json -");
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    const auto json = nlohmann::json::parse(outcome.out);
    EXPECT_EQ(json["kernels"], "");
    EXPECT_EQ(json["loops"][0]["name"], "pin");
    EXPECT_EQ(json["loops"][0]["type"], "revolute");
    EXPECT_EQ(json["loops"][0]["sites"][1], "rocker_end");
    const auto posture = json["loop_postures"][0];
    EXPECT_EQ(posture["posture"], "ready");
    EXPECT_EQ(posture["closed"], true);
    EXPECT_GT(posture["start_gap_m"].get<double>(), 0.0);
    EXPECT_NEAR(posture["passive"]["coupler"], -0.6, 0.2);
    EXPECT_EQ(json["freedom"]["degrees"], 1);
    EXPECT_EQ(json["freedom"]["open_degrees"], 3);
    EXPECT_EQ(json["freedom"]["motors"], 1);
  }
}

TEST_F(Check, NamesALockThatCannotBeAtItsLine) {
  edit("robot.toml", "base = \"fixed\"", "base = \"fixed\"\n[model.lock]\njiont2 = 0.0");
  const Outcome outcome = tandem("check robot.toml");
  EXPECT_EQ(outcome.err,
            "error: robot.toml:9: model.lock.jiont2: the description has no joint 'jiont2' to "
            "lock (did you mean 'joint2'?)\n");
}

TEST_F(Check, ReportsALockedJointOfAListOnce) {
  edit("robot.toml", "base = \"fixed\"", "base = \"fixed\"\n[model.lock]\njoint1 = 0.0");
  const Outcome outcome = tandem("check robot.toml");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_EQ(std::ranges::count(outcome.err, '\n'), 1) << outcome.err;
  EXPECT_NE(outcome.err.find("names: the joint 'joint1' is locked in [model.lock]"),
            std::string::npos)
      << outcome.err;
}

TEST_F(Check, SaysOkAsJson) {
  const Outcome outcome = tandem("check hold.toml --json -");
  EXPECT_EQ(outcome.status, 0);
  const auto json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json["ok"], true);
  EXPECT_EQ(json["errors"], nlohmann::json::array());
  EXPECT_NE(json["kernels"], "");
  ASSERT_EQ(json["warnings"].size(), 1U) << outcome.out;
  EXPECT_EQ(json["warnings"][0]["key"], "dynamics");
  EXPECT_NE(outcome.err.find("double_pendulum"), std::string::npos) << "text for people";
}

TEST_F(Check, FindsAPluginBesideTheExperimentFromAnyFolder) {
  std::filesystem::copy_file(TANDEM_BINARY_DIR "/lib/controllers/hold.so", folder_ / "mine.so");
  edit("hold.toml", "\"hold\"", "\"./mine.so\"");
  EXPECT_EQ(tandem("check hold.toml").status, 0) << read_text(folder_ / "err.txt");
  std::filesystem::create_directory(folder_ / "my_robot");
  for (const char* file : {"double_pendulum.urdf", "robot.toml", "hold.toml", "mine.so"}) {
    std::filesystem::rename(folder_ / file, folder_ / "my_robot" / file);
  }
  EXPECT_EQ(tandem("check my_robot/hold.toml").status, 0) << read_text(folder_ / "err.txt");
}

TEST_F(Check, HoldsOfWhatTheDemoNamesNext) {
  std::istringstream makefile(read_text(TANDEM_SOURCE_DIR "/Makefile"));
  const std::string start = "\t@echo \"  build/release/bin/tandem ";
  int named = 0;
  for (std::string line; std::getline(makefile, line);) {
    if (!line.starts_with(start)) continue;
    std::istringstream words(line.substr(start.size()));
    std::string command;
    std::string file;
    words >> command >> file;
    ++named;
    file = TANDEM_SOURCE_DIR "/" + file;
    EXPECT_TRUE(std::filesystem::exists(file)) << file;
    if (command != "run") continue;
    EXPECT_EQ(tandem("check " + shell_word(file)).status, 0) << read_text(folder_ / "err.txt");
  }
  EXPECT_EQ(named, 4);
}

TEST_F(Check, RepairShowsWhatItWouldTakeForAnInertiaThatCannotBe) {
  edit("double_pendulum.urdf", "ixx=\"0.00040827\"", "ixx=\"0.00090827\"");
  const Outcome strict = tandem("check robot.toml");
  EXPECT_EQ(strict.status, 2);
  EXPECT_NE(strict.err.find("link link1: the inertia breaks the triangle inequality"),
            std::string::npos)
      << strict.err;
  EXPECT_NE(strict.err.find("tandem check --repair"), std::string::npos) << strict.err;
  const Outcome repaired = tandem("check robot.toml --repair --json -");
  EXPECT_EQ(repaired.status, 0) << repaired.err;
  EXPECT_NE(repaired.err.find("1 repaired"), std::string::npos) << repaired.err;
  const auto warnings = nlohmann::json::parse(repaired.out)["warnings"];
  ASSERT_EQ(warnings.size(), 2U) << repaired.out;  // the first is of <dynamics>
  EXPECT_EQ(warnings[1]["key"], "link link1");
  EXPECT_NE(warnings[1]["message"].get<std::string>().find("; taken: "), std::string::npos);
  edit("robot.toml", "base = \"fixed\"", "base = \"fixed\"\ninertia = \"repair\"");
  EXPECT_EQ(tandem("check robot.toml").status, 0);
  EXPECT_EQ(tandem("check hold.toml --repair").status, 2);
}

/// COMAN's files, with another height of the base in its posture.
void copy_coman(const std::filesystem::path& to, const std::string& height) {
  const std::filesystem::path from = TANDEM_SOURCE_DIR "/config/coman";
  for (const char* file : {"coman.urdf", "hold.toml"}) {
    std::filesystem::copy_file(from / file, to / file,
                               std::filesystem::copy_options::overwrite_existing);
  }
  std::string robot = read_text(from / "robot.toml");
  const std::string before = "base_height_m = 0.502";
  robot.replace(robot.find(before), before.size(), "base_height_m = " + height);
  write_text(to / "robot.toml", robot);
}

/// A shape that the URDF gives is somebody's word; one that is guessed of an inertia is not.
TEST_F(Check, WarnsOfACollisionShapeThatStartsInsideTheGround) {
  std::ofstream(folder_ / "robot.toml", std::ios::app)
      << "\n[contact]\nheight_m = 0.4\nstiffness_N_m = 25000\ndamping_s_m = 3.3\n"
         "tangential_stiffness_N_m = 25000\ntangential_damping_Ns_m = 90\nstatic_friction = 0.9\n"
         "sliding_friction = 0.8\nstick_velocity_m_s = 0.01\n";
  const std::string says = "the link 'link2' starts ";
  const Outcome given = tandem("check robot.toml");
  EXPECT_EQ(given.status, 0) << given.err;
  EXPECT_NE(given.err.find("posture.ready: " + says), std::string::npos) << given.err;
  EXPECT_NE(given.err.find("m inside the ground: what is inside does not touch it in this run"),
            std::string::npos)
      << given.err;
  const std::string open = "<collision>", close = "</collision>";
  std::string urdf = read_text(folder_ / "double_pendulum.urdf");
  for (std::size_t at; (at = urdf.find(open)) != std::string::npos;) {
    urdf.erase(at, urdf.find(close) + close.size() - at);
  }
  write_text(folder_ / "double_pendulum.urdf", urdf);
  const Outcome guessed = tandem("check robot.toml");
  EXPECT_EQ(guessed.status, 0) << guessed.err;
  EXPECT_EQ(guessed.err.find(says), std::string::npos) << guessed.err;
}

/// What is said is what then happens: at 40 ms the joints follow, at 100 ms they do not.
TEST_F(Check, WarnsOfGainsThatAreTooHighForTheControlPeriod) {
  const std::string says = ".gains: with these gains and a control period of 100 ms the ";
  EXPECT_EQ(tandem("check robot.toml").err.find("will probably oscillate"), std::string::npos);
  const std::string robot = read_text(folder_ / "robot.toml");
  const std::string trajectory = read_text(folder_ / "trajectory.toml");
  for (const bool slow : {false, true}) {
    const std::string period = slow ? "100_000_000" : "40_000_000";
    write_text(folder_ / "robot.toml", robot);
    edit("robot.toml", "name = \"board_1\"",
         "name = \"board_1\"\nheartbeat_ms = 1000\ncontrol_period_ns = " + period);
    write_text(folder_ / "trajectory.toml", "period_ns = " + period + "\n" + trajectory);
    for (const std::string command : {"check robot.toml", "check trajectory.toml"}) {
      const Outcome checked = tandem(command);
      EXPECT_EQ(checked.status, 0) << checked.err;
      EXPECT_EQ(checked.err.find(says) != std::string::npos, slow) << checked.err;
    }
    const Outcome run = tandem("run trajectory.toml --no-log");
    EXPECT_EQ(run.status, slow ? 1 : 0) << run.out << run.err;
    EXPECT_EQ(run.err.find(says) != std::string::npos, slow) << run.err;
  }
}

TEST_F(Check, WarnsOfWhatIsPlannedForAfterTheEnd) {
  const std::string late = "the controller 'joint_trajectory' reaches this ";
  EXPECT_EQ(tandem("check trajectory.toml").err.find(late), std::string::npos);
  edit("trajectory.toml", "duration_s = 5.0", "duration_s = 2.5");
  for (const std::string command : {"check trajectory.toml", "run trajectory.toml --no-log"}) {
    const Outcome outcome = tandem(command);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    for (const std::string& text :
         {"trajectory.toml:14: controller.joint_trajectory.parameters.waypoint[1].time_s: " + late +
              "3 s after its start, and 1 more later; the run ends after 2.5 s",
          std::string("duration_s = 4.8 or more")}) {
      EXPECT_NE(outcome.err.find(text), std::string::npos) << text << "\nin: " << outcome.err;
    }
  }
  EXPECT_EQ(tandem("run trajectory.toml --no-log --duration 0.5").err.find(late), std::string::npos)
      << "who says how long knows it";
}

TEST_F(Check, RefusesAStartInsideTheGroundAndSaysWhichHeightTouches) {
  copy_coman(folder_, "0.362");
  for (const std::string command : {"check hold.toml", "run hold.toml"}) {
    const Outcome outcome = tandem(command);
    EXPECT_EQ(outcome.status, 2) << command;
    EXPECT_NE(outcome.err.find("robot.toml:217: posture.stand.base_height_m: the posture 'stand' "
                               "starts 0.1"),
              std::string::npos)
        << outcome.err;
    EXPECT_NE(outcome.err.find("m inside the ground, with the foot '"), std::string::npos);
  }
  EXPECT_FALSE(has_log());
  const Outcome robot = tandem("check robot.toml");
  EXPECT_EQ(robot.status, 0) << "a posture need not be one to start from";
  const std::string hint = "(base_height_m = ";
  const std::size_t at = robot.err.find(hint);
  ASSERT_NE(at, std::string::npos) << robot.err;
  const std::string height = robot.err.substr(at + hint.size(), 6);
  EXPECT_NEAR(std::stod(height), 0.502, 0.005);
  copy_coman(folder_, height);
  EXPECT_EQ(tandem("check hold.toml").status, 0);
  copy_coman(folder_, "0.8");  // the hoist lets it down
  EXPECT_EQ(tandem("check hold.toml").status, 0);
}

// The cure was on another page alone.
TEST_F(Check, NamesTheMotorsEncoderForALoopThatRingsOnASpring) {
  write_text(folder_ / "robot.toml",
             read_text(TANDEM_SOURCE_DIR "/config/double_pendulum/robot.toml"));
  edit("robot.toml", "kp = 6.0", "kp = 600.0");
  const std::string says = "position_feedback = \"motor\"";
  EXPECT_EQ(tandem("check robot.toml").err.find(says), std::string::npos) << "a rigid drive";
  edit("robot.toml", "order = 0", "order = 2\nspring_Nm_rad = 200.0\nspring_damping_Nms_rad = 0.2");
  const Outcome soft = tandem("check robot.toml");
  EXPECT_NE(soft.err.find("will probably oscillate"), std::string::npos) << soft.err;
  EXPECT_NE(soft.err.find(says), std::string::npos) << soft.err;
}

/// Each command had a list of its own: a robot by itself was not told of its back-EMF, and
/// `emulate` was silent.
TEST_F(Check, SaysTheSameOfARobotWhoeverAsks) {
  edit("robot.toml", "damping_Nms_rad = 0.17", "damping_Nms_rad = 0.05");
  edit("robot.toml", "[model]\n", "[model]\ngravity_m_s2 = [0, 0, 9.81]\n");
  edit("robot.toml", "kp = 6.0", "kp = 600.0");
  for (const std::string command :
       {"check robot.toml", "check hold.toml", "run hold.toml --duration 0.01 --no-log",
        "emulate robot.toml --interface can0=none", "emulate hold.toml --interface can0=none"}) {
    const Outcome outcome = tandem(command);
    for (const std::string warning :
         {"actuator.motor.damping_Nms_rad: is 0.05, and the back-EMF alone is", "gravity points up",
          "the position loop will probably oscillate"}) {
      const std::size_t at = outcome.err.find(warning);
      EXPECT_NE(at, std::string::npos) << command << ": " << warning << "\nin: " << outcome.err;
      if (at != std::string::npos) {
        EXPECT_EQ(outcome.err.find(warning, at + 1), std::string::npos) << command << ": twice";
      }
    }
  }
}

/// Once each, whoever finds it first: the check of the robot or the kernels' maker.
TEST_F(Check, FindsWhatNoKernelsCanBeMadeOf) {
  write_text(folder_ / "robot.toml", read_text(folder_ / "robot.toml") +
                                         "\n[[sensor]]\nname = \"wrist\"\ntype = \"force_torque\"\n"
                                         "bus = \"arm\"\nnode_id = 20\njoint = \"joint1\"\n"
                                         "link = \"link2\"\n");
  for (const std::string command :
       {"check robot.toml", "check hold.toml", "run hold.toml", "emulate robot.toml"}) {
    const Outcome outcome = tandem(command);
    EXPECT_EQ(outcome.status, 2) << command;
    const std::string error = "link 'link2' turns against both sides of joint 'joint1'";
    const std::size_t at = outcome.err.find(error);
    ASSERT_NE(at, std::string::npos) << command << outcome.err;
    EXPECT_EQ(outcome.err.find(error, at + 1), std::string::npos) << command << ": twice";
  }
}

}  // namespace
}  // namespace tandem::apps
