// Wrong input ends with exit status 2, one clear message, and no run.
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>

#include "tests/apps/bad_input.hpp"

namespace tandem::apps {
namespace {

TEST_F(BadInput, OfATerminalsEscapesIsShownAndNotObeyed) {
  const Outcome outcome = tandem("check 'a\033[2Jb.toml'");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("a\\u001b[2Jb.toml"), std::string::npos) << outcome.err;
  EXPECT_EQ(outcome.err.find('\033'), std::string::npos);
}

/// A plugin that threw had ended `tandem check` with a signal, one that called exit(0) with
/// success.
TEST_F(BadInput, FromAControllersLibraryIsRefused) {
  const std::string folder =
      "TANDEM_CONTROLLERS=" + shell_word(TANDEM_BINARY_DIR "/tests/broken_plugins");
  for (const std::string command : {"check", "run"}) {
    edit("hold.toml", "plugin = \"hold\"", "plugin = \"throws\"");
    const Outcome threw = tandem(command + " hold.toml", folder);
    EXPECT_EQ(threw.status, 2) << threw.err;
    EXPECT_NE(threw.err.find("threw an exception: no such thing"), std::string::npos) << threw.err;
    edit("hold.toml", "plugin = \"throws\"", "plugin = \"exits\"");
    const Outcome ended = tandem(command + " hold.toml --json ended.json", folder);
    EXPECT_EQ(ended.status, 2) << ended.err;
    EXPECT_NE(ended.err.find("the controller called exit()"), std::string::npos) << ended.err;
    EXPECT_EQ(json("ended.json")["ok"], false) << "there was none";
    std::filesystem::remove(folder_ / "ended.json");
    edit("hold.toml", "plugin = \"exits\"", "plugin = \"hold\"");
  }
  EXPECT_FALSE(has_log());
}

// `tandem run` and `tandem check` had waited for ever.
TEST_F(BadInput, FromAControllersLibraryThatDoesNotReturnIsRefused) {
  const std::string hold = read_text(folder_ / "hold.toml");
  const std::string program =
      "TANDEM_CONTROLLERS=" + shell_word(TANDEM_BINARY_DIR "/tests/broken_plugins") +
      " timeout 200 " + shell_word(TANDEM_BINARY_DIR "/bin/tandem") + " ";
  std::string both = "cd " + shell_word(folder_.string());
  for (const std::string command : {"check", "run"}) {
    const std::string plugin = command == "run" ? "never_returns" : "never_returns_when_made";
    write_text(folder_ / (command + ".toml"), hold);
    edit(command + ".toml", "plugin = \"hold\"", "plugin = \"" + plugin + "\"");
    both += " && { (" + program + command + " " + command + ".toml --json " + command +
            ".json >/dev/null 2>" + command + ".txt </dev/null; echo $? >" + command +
            ".status) & }";
  }
  ASSERT_EQ(std::system((both + " && wait").c_str()), 0);
  for (const std::string command : {"check", "run"}) {
    EXPECT_EQ(read_text(folder_ / (command + ".status")), "2\n");
    const std::string err = read_text(folder_ / (command + ".txt"));
    EXPECT_NE(err.find("the controller did not return within 15000 ms"), std::string::npos) << err;
    EXPECT_EQ(json(command + ".json")["ok"], false);
  }
  EXPECT_FALSE(has_log());
}

TEST_F(BadInput, OfAnotherKindIsNamedWithTheCommandThatTakesIt) {
  const Outcome robot = tandem("run robot.toml");
  EXPECT_EQ(robot.status, 2);
  EXPECT_NE(robot.err.find("this is a robot"), std::string::npos) << robot.err;
  EXPECT_NE(robot.err.find("hold.toml"), std::string::npos) << robot.err;
  EXPECT_EQ(std::ranges::count(robot.err, '\n'), 1) << robot.err;
  const Outcome urdf = tandem("run double_pendulum.urdf");
  EXPECT_EQ(urdf.status, 2);
  EXPECT_NE(urdf.err.find("tandem new"), std::string::npos) << urdf.err;
}

TEST_F(BadInput, DampingWithoutTheBackEmfIsWarnedOf) {
  const Outcome before = tandem("check hold.toml");
  EXPECT_EQ(before.err.find("back-EMF"), std::string::npos) << before.err;
  const std::string text = read_text(folder_ / "robot.toml");
  const auto at = text.find("damping_Nms_rad = ");
  ASSERT_NE(at, std::string::npos);
  write_text(folder_ / "robot.toml",
             text.substr(0, at) + "damping_Nms_rad = 1e-3" + text.substr(text.find('\n', at)));
  const Outcome outcome = tandem("check hold.toml");
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("damping_Nms_rad: is 0.001, and the back-EMF alone is N^2 K^2 / R = "),
            std::string::npos)
      << outcome.err;
}

TEST_F(BadInput, AFloatingBaseWithoutGroundIsWarnedOf) {
  edit("robot.toml", "base = \"fixed\"", "base = \"floating\"");
  for (const char* command : {"check robot.toml", "check hold.toml"}) {  // not of an experiment
    const Outcome outcome = tandem(command);
    EXPECT_NE(outcome.err.find("falls for ever"), std::string::npos) << command << outcome.err;
  }
}

TEST_F(BadInput, AMissingExperimentIsRefused) {
  expect_refused({"nothing.toml", "cannot read"}, "run nothing.toml");
}

TEST_F(BadInput, AFolderIsRefusedWithTheCommandsForWhatIsInIt) {
  std::filesystem::create_directory(folder_ / "arm");
  for (const char* file : {"double_pendulum.urdf", "robot.toml", "hold.toml", "trajectory.toml"}) {
    std::filesystem::rename(folder_ / file, folder_ / "arm" / file);
  }
  std::filesystem::create_directory(folder_ / "empty");
  const std::string folder = "arm: this is a folder, and ";
  expect_refused({folder + "an experiment is needed",
                  "(type: tandem run arm/hold.toml, or: tandem run arm/trajectory.toml)"},
                 "run arm");
  expect_refused({"(type: tandem run ./arm/../arm/hold.toml, or: "}, "run ./arm/../arm/");
  expect_refused({"write one: docs/configuration.md"}, "run empty");
  expect_refused({folder + "a robot is needed", "(type: tandem model info arm/robot.toml)"},
                 "model info arm");
  expect_refused({"(type: tandem eds arm/robot.toml)"}, "eds arm");
  for (const std::string command : {"check", "emulate", "serve"}) {
    expect_refused({folder, "tandem " + command + " arm/hold.toml, ",
                    ", or: tandem " + command + " arm/trajectory.toml)"},
                   command + " arm");
  }
}

TEST_F(BadInput, AnExperimentInPlaceOfARobotIsRefusedWithTheRobotsCommand) {
  for (const std::string command :
       {"model info", "model build", "model ros2", "eds", "check --repair"}) {
    expect_refused({"hold.toml: this is an experiment, and a robot is needed",
                    "(type: tandem " + command + " robot.toml)"},
                   command + " hold.toml");
  }
}

TEST_F(BadInput, ADurationThatIsNoneIsRefusedInOneShortLine) {
  for (const std::string text : {"0", "-3", "nan", "inf", "1e300", "endles", "Endless"}) {
    const Outcome outcome = tandem("run hold.toml --duration " + text);
    EXPECT_EQ(outcome.status, 2) << outcome.err;
    EXPECT_NE(outcome.err.find("--duration: '" + text +
                               "' is no number of seconds above 0, and up to 1000000, "
                               "nor endless"),
              std::string::npos)
        << outcome.err;
    EXPECT_LT(outcome.err.size(), 150U) << outcome.err;
  }
  expect_refused({"duration_s: 0.0001 s are less than half a cycle", "run for 0.001 s or longer"},
                 "run hold.toml --duration 0.0001");
}

TEST_F(BadInput, AnEmptyNameIsRefusedAsOne) {
  for (const std::string command :
       {"run \"\"", "check \"\"", "check \"\" --repair", "model info \"\""}) {
    expect_refused({"the file's name is empty"}, command);
  }
}

TEST_F(BadInput, AMissingRobotIsNoExperimentToRepair) {
  expect_refused({"error: nothing.toml: cannot read this file"}, "check nothing.toml --repair");
}

TEST_F(BadInput, AFileThatIsNotThereIsRefusedWithTheNearestName) {
  expect_refused({"hodl.toml: cannot read this file (did you mean 'hold.toml'?)"}, "run hodl.toml");
  expect_refused({"../hodl.toml: cannot read this file (check the path and its permissions)"},
                 "run ../hodl.toml");
  expect_refused({"/rbot.toml: cannot read this file (did you mean '", "/robot.toml'?)"},
                 "model info " + shell_word((folder_ / "rbot.toml").string()));
  edit("hold.toml", "robot.toml", "robots.toml");
  expect_refused({"robots.toml: cannot read this file (did you mean 'robot.toml'?"},
                 "check hold.toml");
}

// `log diff *.mcap` of three logs had said which one is too many, and not how many it takes.
TEST_F(BadInput, AnArgumentTooManyIsRefusedWithThoseThatThereAre) {
  const Outcome diff = tandem("log diff a.mcap b.mcap c.mcap");
  EXPECT_EQ(diff.status, 2);
  EXPECT_NE(diff.err.find("'c.mcap' is one argument too many: tandem log diff takes log, other\n"),
            std::string::npos)
      << diff.err;
  const Outcome list = tandem("joint halt joint1");
  EXPECT_NE(list.err.find("'joint1' is one argument too many: tandem joint halt takes none"),
            std::string::npos)
      << list.err;
}

// With --realtime, which is a simulation, a run ends; the help had said that it waits.
TEST_F(BadInput, OfARunsHelpSaysWhatARealtimeSimulationDoesAfterAStop) {
  EXPECT_NE(tandem("run --help").out.find("with --realtime, too"), std::string::npos);
}

TEST_F(BadInput, AnEmptyFileIsRefusedAsOne) {
  write_text(folder_ / "hold.toml", " \n\n");
  expect_refused({"hold.toml: the file is empty"});
  write_text(folder_ / "hold.toml",
             "robot = 'robot.toml'\nduration_s = 1\n[[controller]]\n"
             "plugin = 'hold'\n");
  write_text(folder_ / "robot.toml", "");
  expect_refused({"robot.toml: the file is empty", "it is the robot of hold.toml:1"});
}

TEST_F(BadInput, APipeIsRefusedAndNotWaitedFor) {
  for (const char* file : {"double_pendulum.urdf", "robot.toml", "hold.toml"}) {
    std::filesystem::remove(folder_ / file);
    ASSERT_EQ(mkfifo((folder_ / file).c_str(), 0600), 0);
    expect_refused({std::string(file) + ": this is no regular file"});
  }
}

TEST_F(BadInput, TextThatIsNoXmlIsRefusedAsADescription) {
  edit("robot.toml", "urdf = \"double_pendulum.urdf\"", "urdf = \"hold.toml\"");
  expect_refused({"hold.toml:1: this is no XML, so no URDF"});
}

TEST_F(BadInput, AnExperimentInPlaceOfARobotIsRefused) {
  edit("hold.toml", "robot = \"robot.toml\"", "robot = \"trajectory.toml\"");
  expect_refused({"trajectory.toml:", "robot: this is an experiment, and a robot is needed"});
}

TEST_F(BadInput, AControllerInSingleBracketsIsRefusedWithTheHeaderToWrite) {
  edit("hold.toml", "[[controller]]", "[controller]");
  expect_refused({"hold.toml:7: controller: must be an array of tables (write [[controller]])"});
}

TEST_F(BadInput, AFileThatIsNoControllerIsNamedAtItsLine) {
  edit("hold.toml", "\"hold\"", "\"./robot.toml\"");
  expect_refused({"error: hold.toml:7: controller.robot: ", "cannot be loaded"});
}

TEST_F(BadInput, AFolderInPlaceOfAnExperimentIsRefused) {
  expect_refused({"this is a folder"}, "run .");
}

TEST_F(BadInput, AMissingRobotIsRefused) {
  std::filesystem::remove(folder_ / "robot.toml");
  expect_refused({"robot.toml", "cannot read"});
}

TEST_F(BadInput, AMissingUrdfIsRefused) {
  std::filesystem::remove(folder_ / "double_pendulum.urdf");
  expect_refused({"double_pendulum.urdf"});
}

TEST_F(BadInput, AUrdfCutInHalfIsRefused) {
  const std::string text = read_text(folder_ / "double_pendulum.urdf");
  write_text(folder_ / "double_pendulum.urdf", text.substr(0, text.size() / 2));
  expect_refused({"double_pendulum.urdf:"});
}

TEST_F(BadInput, ANanInTheTomlIsRefused) {
  edit("robot.toml", "inertia_kg_m2 = 0.002", "inertia_kg_m2 = nan");
  expect_refused({"robot.toml:", "inertia_kg_m2", "finite"});
}

TEST_F(BadInput, AnInfiniteNumberInTheTomlIsRefused) {
  edit("robot.toml", "max_torque_Nm = 2.0", "max_torque_Nm = inf");
  expect_refused({"robot.toml:", "max_torque_Nm", "finite"});
}

TEST_F(BadInput, ANanInTheUrdfIsRefused) {
  const std::string text = read_text(folder_ / "double_pendulum.urdf");
  const std::size_t at = text.find("mass value=\"");
  ASSERT_NE(at, std::string::npos);
  edit("double_pendulum.urdf", text.substr(at, text.find('"', at + 12) - at + 1),
       "mass value=\"nan\"");
  expect_refused({"double_pendulum.urdf:"});
}

TEST_F(BadInput, AJointThatTheUrdfLacksIsRefusedWithTheNearest) {
  edit("robot.toml", "joints = [\"joint1\", \"joint2\"]", "joints = [\"joint1\", \"jiont2\"]");
  edit("robot.toml", "names = [\"joint1\", \"joint2\"]", "names = [\"joint1\", \"jiont2\"]");
  edit("robot.toml", "joint2 = -0.5", "jiont2 = -0.5");
  const Outcome outcome = tandem("run hold.toml");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("no joint 'jiont2'"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("did you mean 'joint2'?"), std::string::npos) << outcome.err;
  EXPECT_FALSE(has_log());
}

TEST_F(BadInput, AJointOnTwoBoardsIsRefused) {
  edit("robot.toml", "[[joint]]",
       "[[board]]\nname = \"board_2\"\nbus = \"arm\"\njoints = [\"joint1\"]\n\n[[joint]]");
  expect_refused({"robot.toml:", "joint1", "two boards", "board_1", "board_2"});
}

TEST_F(BadInput, ANodeIdTwiceOnABusIsRefused) {
  edit("robot.toml", "[posture.ready]",
       "[[sensor]]\nname = \"imu\"\ntype = \"imu\"\nbus = \"arm\"\nnode_id = 1\nlink = \"link2\"\n"
       "\n[posture.ready]");
  expect_refused({"robot.toml:", "node id 1 is taken on bus 'arm'"});
}

TEST_F(BadInput, AMisspeltKeyIsRefusedWithTheNearest) {
  edit("hold.toml", "duration_s", "durration_s");
  const Outcome outcome = tandem("run hold.toml");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("hold.toml:"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("did you mean 'duration_s'?"), std::string::npos) << outcome.err;
  EXPECT_FALSE(has_log());
}

TEST_F(BadInput, AnUnknownKeyOfTheRobotIsRefused) {
  edit("robot.toml", "gear_ratio = 20", "gear_ratio = 20\ngear_ration = 3");
  expect_refused({"robot.toml:", "gear_ration", "unknown key", "did you mean 'gear_ratio'?"});
}

TEST_F(BadInput, AnUnknownParameterOfAControllerIsRefused) {
  edit("hold.toml", "plugin = \"hold\"", "plugin = \"hold\"\n[controller.parameters]\nspeeed = 1");
  expect_refused({"hold.toml:", "speeed", "unknown key"});
}

TEST_F(BadInput, AGainOfTheWrongSignIsRefused) {
  edit("robot.toml", "kp = 6.0", "kp = -6.0");
  expect_refused({"robot.toml:", "gains.motor.position.kp", "wrong sign"});
}

TEST_F(BadInput, APluginThatDoesNotExistIsRefusedWithTheNearest) {
  edit("hold.toml", "\"hold\"", "\"hodl\"");
  expect_refused({"hold.toml:", "hodl", "hold"});
}

TEST_F(BadInput, APluginThatDoesNotExistIsRefusedBeforeKernelsAreBuilt) {
  edit("robot.toml", "inertia_kg_m2 = 0.002", "inertia_kg_m2 = 0.003");
  edit("hold.toml", "\"hold\"", "\"./hold.so\"");
  expect_refused({folder_.string() + "/hold.so", "no such controller library"});
}

TEST_F(BadInput, AFileThatIsNoLibraryIsNamedOnce) {
  edit("hold.toml", "\"hold\"", "\"./robot.toml\"");
  const std::string err = tandem("run hold.toml").err;
  const std::string path = folder_.string() + "/robot.toml";
  const std::size_t first = err.find(path);
  ASSERT_NE(first, std::string::npos) << err;
  EXPECT_EQ(err.find(path, first + 1), std::string::npos) << err;
}

TEST_F(BadInput, AFirstWayPointTooFarFromTheStartIsRefusedWithTheTimeItNeeds) {
  edit("trajectory.toml", "time_s = 1.5", "time_s = 0.05");
  for (const std::string command : {"check trajectory.toml", "run trajectory.toml"}) {
    expect_refused({"trajectory.toml:11: ", "waypoint[0].time_s: joint 'joint1' would need ",
                    "on the way from the start", "(time_s = "},
                   command);
  }
}

TEST_F(BadInput, ABoardOfTwoAxesOnClassicCanIsNamedWithItsLine) {
  edit("robot.toml", "fd = true", "fd = false");
  for (const std::string command : {"check robot.toml", "check hold.toml", "run hold.toml"}) {
    expect_refused({"error: robot.toml:", "board 'board_1': has 2 axes",
                    "or set fd = true for the bus 'arm' (line "},
                   command);
  }
}

TEST_F(BadInput, APositionLoopThatIsEmptyIsNamedAtItsGains) {
  const std::string text = read_text(folder_ / "robot.toml");
  const std::size_t loop = text.find("position = {");
  ASSERT_NE(loop, std::string::npos);
  edit("robot.toml", text.substr(loop, text.find('}', loop) + 1 - loop), "position = {}");
  const std::string lines = text.substr(0, text.find("[gains.motor]"));
  expect_refused({"error: robot.toml:" + std::to_string(std::ranges::count(lines, '\n') + 1) + ": ",
                  "gains.motor: joint 'joint1' has no position control (stiff)"});
}

TEST_F(BadInput, AGroundTooStiffForTheSubStepIsNamedAtItsStiffness) {
  std::filesystem::remove_all(folder_);
  std::filesystem::copy(TANDEM_SOURCE_DIR "/config/coman", folder_,
                        std::filesystem::copy_options::recursive);
  const std::string text = read_text(folder_ / "robot.toml");
  const std::size_t key = text.find("\nstiffness_N_m = ") + 1;
  edit("robot.toml", text.substr(key, text.find('\n', key) - key), "stiffness_N_m = 1e12");
  const auto line = std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(key), '\n');
  for (const std::string command : {"check squat.toml", "run squat.toml --duration 0.05"}) {
    expect_refused({"error: robot.toml:" + std::to_string(line + 1) +
                        ": contact.stiffness_N_m: makes a sub-step of ",
                    "lower it, or sim.substep_ns to at most "},
                   command);
  }
}

// The line was that of the file's beginning, and what is short enough did not divide the period.
TEST_F(BadInput, ASubStepThatIsTooLongIsNamedWhereItIsSet) {
  std::filesystem::remove_all(folder_);
  std::filesystem::copy(TANDEM_SOURCE_DIR "/config/coman", folder_,
                        std::filesystem::copy_options::recursive);
  const std::string setting = "--set sim.substep_ns=1000000";
  const Outcome check = tandem("check squat.toml " + setting);
  EXPECT_EQ(check.status, 2);
  EXPECT_EQ(check.err.find("error: " + setting + ": sim.substep_ns: 1000000 ns is unstable at "),
            0U)
      << check.err;
  const std::size_t most = check.err.find("(at most "), fits = check.err.find("posture: ");
  ASSERT_NE(most, std::string::npos) << check.err;
  ASSERT_NE(fits, std::string::npos) << check.err;
  const int most_ns = std::stoi(check.err.substr(most + 9)),
            fits_ns = std::stoi(check.err.substr(fits + 9));
  EXPECT_LE(fits_ns, most_ns);
  EXPECT_EQ(1'000'000 % fits_ns, 0);
  EXPECT_EQ(tandem("check squat.toml --set sim.substep_ns=" + std::to_string(fits_ns)).status, 0);
}

TEST_F(BadInput, GravityThatPointsUpIsWarnedOf) {
  edit("robot.toml", "base = \"fixed\"", "base = \"fixed\"\ngravity_m_s2 = [0, 0, 9.81]");
  for (const std::string command : {"check robot.toml", "check hold.toml"}) {
    const Outcome outcome = tandem(command);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.err.find("model.gravity_m_s2: gravity points up"), std::string::npos)
        << outcome.err;
  }
}

TEST_F(BadInput, AJointTooWeakForItsStartPostureIsWarnedOf) {
  EXPECT_EQ(tandem("check hold.toml").err.find("gravity asks"), std::string::npos);
  edit("robot.toml", "max_torque_Nm = 2.0", "max_torque_Nm = 0.1");
  for (const std::string command :
       {"check robot.toml", "check hold.toml", "run hold.toml --duration 0.01 --quiet"}) {
    const Outcome outcome = tandem(command);
    EXPECT_NE(outcome.err.find("joint.joint1.max_torque_Nm: gravity asks "), std::string::npos)
        << outcome.err;
    EXPECT_NE(outcome.err.find(" Nm of it in the posture 'ready', and it can give 0.1"),
              std::string::npos)
        << outcome.err;
  }
  edit("robot.toml", "base = \"fixed\"", "base = \"floating\"");
  const Outcome falls = tandem("check robot.toml");
  EXPECT_NE(falls.err.find("falls for ever"), std::string::npos) << falls.err;
  EXPECT_EQ(falls.err.find("gravity asks"), std::string::npos) << "one reason is enough";
}

TEST_F(BadInput, APluginWithoutItsEntryPointIsRefused) {
  edit("hold.toml", "\"hold\"", "\"" TANDEM_BINARY_DIR "/tests/broken_plugins/no_entry.so\"");
  expect_refused({"no_entry.so", "tandem_controller_plugin"});
}

TEST_F(BadInput, APluginOfAnotherAbiIsRefused) {
  edit("hold.toml", "\"hold\"",
       "\"" TANDEM_BINARY_DIR "/tests/broken_plugins/older_interface.so\"");
  expect_refused({"older_interface.so", "interface"});
}

// With 6 and 7 Cyclone DDS crashed in its own clean-up.
bool loopback_is_up() {
  const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(9);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const int routed = ::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address);
  ::close(fd);
  return routed == 0;
}

TEST_F(BadInput, OfTooFewOpenFilesForDdsIsRefusedWhateverIsLeft) {
  if (!loopback_is_up()) GTEST_SKIP() << "DDS needs the loopback interface, which is down";
  for (int limit = 4; limit <= 40; ++limit) {
    const Outcome outcome =
        tandem("run hold.toml --duration 0.05 --no-log --no-socket -q --dds --domain 99",
               "prlimit --nofile=" + std::to_string(limit));
    const bool loaded = outcome.err.find("loading shared libraries") == std::string::npos;
    if (!loaded && limit < 10) continue;  // with what the test runner has open
    if (outcome.status == 0) {
      EXPECT_GE(limit, 20) << "it needs so many";
      continue;
    }
    EXPECT_EQ(outcome.status, 2) << limit << ": " << outcome.err;
    EXPECT_EQ(error_lines(outcome.err), 1) << limit << ": " << outcome.err;
    EXPECT_LT(limit, 30) << "there is room";
  }
  EXPECT_NE(tandem("run hold.toml --no-log --no-socket -q --dds", "prlimit --nofile=10")
                .err.find("DDS needs 20 more open files than this process has, which may open"),
            std::string::npos);
}

TEST_F(BadInput, APeriodOfZeroIsRefused) {
  edit("hold.toml", "seed = 1", "seed = 1\nperiod_ns = 0");
  expect_refused({"hold.toml:", "period_ns", "out of range"});
}

TEST_F(BadInput, KernelsOfAnotherDescriptionAreRefusedWithTheCommandThatMendsIt) {
  edit("robot.toml", "inertia_kg_m2 = 0.002", "inertia_kg_m2 = 0.003");
  expect_refused({"another description", "run: tandem model build robot.toml"},
                 "run hold.toml --no-build --duration 0.05");
}

TEST_F(BadInput, AKernelVariantThatIsNotThereIsRefused) {
  expect_refused({"no variant 'x87'"}, "run hold.toml --kernel-variant x87");
}

TEST_F(BadInput, IsReportedAsJsonByEveryCommand) {
  for (const std::string command :
       {"run nothing.toml", "check nothing.toml", "model info nothing.toml",
        "log info nothing.mcap", "log diff nothing.mcap nothing.mcap", "report nothing.mcap",
        "eds nothing.toml", "new nothing.urdf", "emulate nothing.toml", "serve nothing.toml",
        "doctor nothing.toml"}) {
    const Outcome outcome = tandem(command + " --json -");
    EXPECT_EQ(outcome.status, 2) << command;
    const auto json = nlohmann::json::parse(outcome.out, nullptr, false);
    ASSERT_TRUE(json.is_object()) << command << "\n" << outcome.out;
    EXPECT_EQ(json["ok"], false) << command;
    ASSERT_EQ(json["errors"].size(), 1U) << command << "\n" << outcome.out;
    const std::string file = json["errors"][0]["file"];
    EXPECT_TRUE(file.starts_with("nothing.")) << command << "\n" << outcome.out;
  }
  const Outcome asked = tandem("fault show --socket nothing.sock --json -");
  EXPECT_EQ(nlohmann::json::parse(asked.out)["ok"], false) << asked.out;
  const Outcome usage = tandem("run hold.toml --rate x --json -");
  EXPECT_EQ(usage.status, 2);
  EXPECT_EQ(nlohmann::json::parse(usage.out)["errors"].size(), 1U) << usage.out;
}

TEST_F(BadInput, AJsonFileThatCannotBeWrittenIsRefused) {
  for (const char* file : {"robot.toml/result.json", "robot.toml/a/b.json", "/proc/nowhere/a.json"})
    expect_refused({file}, std::string("run hold.toml --duration 0.05 --quiet --json ") + file);
}

TEST_F(BadInput, AFileThatIsNoUtf8IsRefusedInJsonToo) {
  write_text(folder_ / "latin\xE9.toml", "name = \"caf\xE9\"\n");
  write_text(folder_ / "names.toml", "robot = \"caf\xC3\xA9.toml\"\nduration_s = 1\n");
  for (const std::string file : {"latin\xE9.toml", "names.toml"}) {
    const Outcome outcome = tandem("check " + shell_word(file) + " --json -");
    EXPECT_EQ(outcome.status, 2) << outcome.err;
    const auto json = nlohmann::json::parse(outcome.out);
    EXPECT_EQ(json["ok"], false);
    EXPECT_FALSE(json["errors"].empty());
  }
}

TEST_F(BadInput, BytesOfAUrdfThatAreNoUtf8AreRefusedInJsonToo) {
  edit("double_pendulum.urdf", "<link name=\"link1\">", "<link name=\"link1\xFF\">");
  const Outcome outcome = tandem("check robot.toml --json -");
  EXPECT_EQ(outcome.status, 2) << outcome.err;
  EXPECT_EQ(nlohmann::json::parse(outcome.out)["ok"], false);
}

TEST_F(BadInput, ANameThatLeadsOutOfTheFolderIsRefused) {
  edit("robot.toml", "name = \"double_pendulum\"", "name = \"../../x\"");
  expect_refused({"robot.toml:", "name: '../../x' has other characters"}, "model build robot.toml");
}

TEST_F(BadInput, AnActuatorWithoutInertiaIsRefusedWithItsLine) {
  edit("robot.toml", "inertia_kg_m2 = 0.002", "inertia_kg_m2 = 0");
  for (const std::string command : {"check robot.toml", "check hold.toml", "run hold.toml"}) {
    expect_refused({"robot.toml:18: actuator.motor.inertia_kg_m2", "greater than 0"}, command);
  }
}

TEST_F(BadInput, AUrdfThatXacroHasNotExpandedIsRefused) {
  edit("double_pendulum.urdf", "<mass value=\"0.26703\" />", "<mass value=\"${mass}\" />");
  expect_refused({"double_pendulum.urdf:", "link link1: '${mass}' was left by xacro",
                  "expand the xacro first"},
                 "check robot.toml");
}

const char* const kBareRobot = "name = \"bare\"\n[model]\nurdf = \"bare.urdf\"\nbase = \"fixed\"\n";

/// A bob that two parallel axes turn one after the other, with a link of this mass between them.
std::string two_axes(const std::string& mass) {
  const auto link = [](const std::string& name, const std::string& kg, const std::string& moment) {
    return "<link name='" + name + "'><inertial><mass value='" + kg + "'/><inertia ixx='" + moment +
           "' ixy='0' ixz='0' iyy='" + moment + "' iyz='0' izz='" + moment +
           "'/></inertial></link>";
  };
  const auto joint = [](const std::string& name, const std::string& from, const std::string& to) {
    return "<joint name='" + name + "' type='continuous'><parent link='" + from +
           "'/><child link='" + to + "'/></joint>";
  };
  return "<robot name='bare'><link name='base'/>" + link("between", mass, mass) +
         link("bob", "1", "0.1") + joint("a", "base", "between") + joint("b", "between", "bob") +
         "</robot>";
}

TEST_F(BadInput, AMasslessLinkBetweenParallelAxesIsRefused) {
  write_text(folder_ / "bare.toml", kBareRobot);
  write_text(folder_ / "bare.urdf", two_axes("0"));
  for (const std::string command : {"check bare.toml", "model build bare.toml -o bare.so"}) {
    expect_refused({"bare.urdf:1: joint a: the mass matrix is singular when every joint is at 0: "
                    "the joints 'a' and 'b' can move without moving any mass"},
                   command);
  }
  write_text(folder_ / "bare.urdf", two_axes("0.1"));
  EXPECT_EQ(tandem("check bare.toml").status, 0);
}

TEST_F(BadInput, ARobotInWhichNothingMovesIsRefused) {
  write_text(folder_ / "bare.toml", kBareRobot);
  write_text(folder_ / "bare.urdf", "<robot name='bare'><link name='base'/></robot>");
  for (const std::string command : {"check bare.toml", "model build bare.toml -o bare.so"}) {
    expect_refused({"bare.urdf: the description has no joint that moves"}, command);
  }
}

}  // namespace
}  // namespace tandem::apps
