// `tandem controller` against a running `tandem run`.
#include <cmath>

#include "tests/apps/controllers_run.hpp"
#include "tests/support/eventually.hpp"

namespace tandem::apps {
namespace {

TEST_F(Controllers, AreLoadedSwitchedStoppedAndUnloaded) {
  begin("");
  expect(to_run("controller list").out, "hold        active  joint1, joint2");
  EXPECT_EQ(asked("controller load hold --name rest --set 'duration_s = 2.0'")["active"],
            nlohmann::json({"hold"}));
  expect(refused("controller start rest"),
         "joint1: is claimed by the controllers 'hold' and 'rest' (tandem controller switch --stop "
         "hold --start rest)");
  const auto change = asked("controller switch --stop hold --start rest");
  EXPECT_EQ(change["done"], true);
  EXPECT_GT(change["cycle"].get<int>(), 0);
  EXPECT_EQ(change["active"], nlohmann::json({"rest"}));
  expect(refused("controller unload rest"), "rest: the controller is active");
  expect(to_run("controller stop rest").out, "active: none");
  EXPECT_EQ(to_run("controller unload rest").status, 0);
  const auto list = asked("controller list")["controllers"];
  ASSERT_EQ(list.size(), 1U);
  EXPECT_EQ(list[0]["name"], "hold");
  EXPECT_EQ(list[0]["active"], false);
  EXPECT_EQ(list[0]["claims"][1]["joint"], "joint2");
  EXPECT_EQ(to_run("controller start hold").status, 0);
  EXPECT_EQ(end(), 0);
}

TEST_F(Controllers, AShadowShowsHowFarItIsAndIsSwitchedToOnceItAgrees) {
  begin("");
  expect(refused("controller difference hold"), "hold: is no shadow");
  expect(refused("controller shadow hold"),
         "hold: is active: a shadow runs beside the active ones");
  EXPECT_EQ(to_run("controller load hold --name rest").status, 0);
  EXPECT_EQ(asked("controller shadow rest")["done"], true);
  expect(to_run("controller list").out, "rest        shadow  joint1, joint2");
  const auto apart = asked("controller difference rest");
  ASSERT_EQ(apart["shadows"].size(), 1U);
  EXPECT_EQ(apart["shadows"][0]["runs"], true);
  EXPECT_EQ(apart["switch"], nlohmann::json());
  const auto joint = apart["shadows"][0]["joints"][1];
  EXPECT_EQ(joint["joint"], "joint2");
  EXPECT_EQ(joint["owner"], "hold");
  EXPECT_EQ(joint["references"][0]["name"], "position_rad");
  EXPECT_EQ(joint["references"][0]["unit"], "rad");
  EXPECT_LT(std::abs(joint["references"][0]["difference"].get<double>()), 0.1);
  EXPECT_EQ(to_run("controller load gravity_compensation --name soft").status, 0);
  EXPECT_EQ(to_run("controller shadow soft").status, 0);
  const Outcome late =
      to_run("controller switch --stop hold --start soft --when-within 1 --timeout 20ms");
  EXPECT_EQ(late.status, 1);
  expect(late.out, "nothing has changed: they did not agree in time, at last by another mode at");
  const Outcome never =
      to_run("controller switch --stop hold --start soft --when-within 1 --timeout 20ms --json -");
  EXPECT_EQ(never.status, 1);
  EXPECT_EQ(nlohmann::json::parse(never.out, nullptr, false)["done"], false);
  // It was taken for 1 mrad.
  expect(
      refused("controller switch --stop hold --start rest --when-within 1mm"),
      "joint1: when_within is a length, and the reference of this joint, which 'rest' claims, is "
      "in rad (give an angle: 0.5deg, 0.01rad; or a bare number [rad])");
  EXPECT_EQ(
      to_run("controller load gravity_compensation --name limp --set 'mode = \"torque\"'").status,
      0);
  EXPECT_EQ(to_run("controller shadow limp").status, 0);
  expect(refused("controller switch --stop hold --start limp --when-within 1deg"),
         "is in Nm (give a bare number [Nm])");
  const auto change = asked("controller switch --stop hold --start rest --when-within 0.2");
  EXPECT_EQ(change["switch"]["state"], "done");
  const auto list = asked("controller list")["controllers"];
  EXPECT_EQ(list[0]["active"], false);
  EXPECT_EQ(list[1]["active"], true);
  EXPECT_EQ(list[1]["shadow"], false);
  expect(refused("controller switch --stop rest --start hold --timeout 1s"),
         "is for a switch that waits");
  EXPECT_EQ(end(), 0);
}

class Builds : public Controllers {
 protected:
  /// nodder.so is that build now, as a linker leaves it.
  void put(const std::string& build) const {
    const std::filesystem::path plugins = TANDEM_BINARY_DIR "/tests/test_plugins";
    std::filesystem::copy_file(plugins / ("nodder_" + build + ".so"), folder_ / "new.so");
    std::filesystem::rename(folder_ / "new.so", folder_ / "nodder.so");
  }
  void begin_with_nodder() {
    put("1");
    const std::string hold = read_text(folder_ / "hold.toml");
    write_text(folder_ / "hold.toml", hold.substr(0, hold.find("[[controller]]")) +
                                          "[[controller]]\nplugin = \"./nodder.so\"\n"
                                          "[controller.parameters]\nspeed_rad_s = 0.5\n");
    begin("");
  }
  /// The run ends by itself, with all that it tells.
  void expect_whole_end() {
    EXPECT_EQ(end(), 0);
    const auto summary = json("run.json");
    EXPECT_GT(summary["controllers"]["nodder"]["calls"], 0);
    EXPECT_EQ(summary["fault_log"].size(), 0U);
  }
};

TEST_F(Builds, GoOnInTheStateOfTheFormerOne) {
  begin_with_nodder();
  const auto place_rad = [this] {
    return asked("joint show joint2")["position_rad"].get<double>();
  };
  const auto stands = [&](double rad) {
    return test::eventually([&] { return std::abs(place_rad() - rad) < 1e-3; });
  };
  double before_rad = 0.0;
  EXPECT_TRUE(test::eventually([&] {
    const double last_rad = before_rad;
    before_rad = place_rad();
    return std::abs(before_rad - last_rad) < 1e-5;
  }));
  put("2");
  expect(to_run("controller reload nodder").out, "nodder: the new build goes on in cycle ");
  EXPECT_TRUE(stands(before_rad + 0.2)) << place_rad() << " of " << before_rad;
  expect(to_run("controller reload nodder").out, "nodder: the same build as before goes on");
  put("fails");
  expect(refused("controller reload nodder"), "this build has a mistake");
  put("asks");
  const std::string asks = refused("controller reload nodder");
  expect(asks, "gain: this key is missing (its parameters are");
  EXPECT_EQ(asks.find("docs/controllers.md"), std::string::npos) << "it is its author's own";
  EXPECT_EQ(asked("controller list")["controllers"][0]["active"], true);
  put("more");
  const auto more = asked("controller reload nodder");
  EXPECT_EQ(more["carried"], false);
  EXPECT_EQ(more["changed"], true);
  expect(more["afresh"], "has another size than before");
  EXPECT_TRUE(stands(before_rad + 0.5)) << "from where it stood";
  put("all");
  expect(to_run("controller reload nodder").out, "starts afresh in cycle ");
  EXPECT_EQ(asked("controller list")["controllers"][0]["claims"].size(), 2U);
  put("2");
  EXPECT_EQ(to_run("controller stop nodder").status, 0);
  expect(to_run("controller reload nodder").out, "claims other joints or modes than before");
  EXPECT_EQ(asked("controller list")["controllers"][0]["active"], false);
  EXPECT_EQ(to_run("controller start nodder").status, 0);
  EXPECT_EQ(asked("controller reload nodder --fresh")["afresh"], "that was asked for");
  expect(refused("controller reload noder"), "did you mean 'nodder'?");
  EXPECT_EQ(end(), 0);
  EXPECT_EQ(json("run.json")["fault_log"].size(), 0U);
}

// The linker keeps a lock while a library's own code runs in it: the next build, which was right,
// was blamed for not returning, and the process never ended.
TEST_F(Builds, OfWhichOneHangsWhereItIsLoadedDoNotTakeTheBlameForIt) {
  begin_with_nodder();
  put("stuck");
  expect(refused("controller reload nodder"), "nodder: the controller did not return within");
  expect(refused("controller reload nodder --untried"), "nodder: the controller did not return");
  put("2");
  for (int i = 0; i < 2; ++i)
    expect(refused("controller reload nodder"), "nodder.so, which does not return from its static");
  EXPECT_EQ(asked("controller list")["controllers"][0]["active"], true);
  EXPECT_EQ(to_run("controller stop nodder").status, 0);
  EXPECT_EQ(to_run("controller unload nodder").status, 0);
  expect_whole_end();
}

TEST_F(Builds, OfWhichOneHangsWhereItIsFreedHoldNothingUp) {
  begin_with_nodder();
  put("clings");
  ASSERT_EQ(
      to_run("controller load ./nodder.so --name other --set speed_rad_s=0.5 --untried").status, 0);
  EXPECT_EQ(to_run("controller unload other").status, 0);
  EXPECT_EQ(asked("controller list")["controllers"].size(), 1U);
  put("2");
  expect(refused("controller reload nodder"), "nodder.so, which does not return from its static");
  expect_whole_end();
}

TEST_F(Controllers, TellTheirSignals) {
  begin("");
  expect(to_run("signal list").out, "no loaded controller declares a signal");
  expect(refused("signal watch"), "no loaded controller declares a signal");
  ASSERT_EQ(to_run("controller load gravity_compensation --name weigh").status, 0);
  const auto waiting = asked("signal list")["signals"];
  ASSERT_EQ(waiting.size(), 1U);
  EXPECT_EQ(waiting[0]["signal"], "weigh.weight");
  EXPECT_EQ(waiting[0]["unit"], "Nm");
  EXPECT_EQ(waiting[0]["names"], nlohmann::json({"weight.joint1", "weight.joint2"}));
  EXPECT_TRUE(waiting[0]["cycle"].is_null()) << "it has not run yet";
  EXPECT_TRUE(waiting[0]["values"][0].is_null());
  expect(to_run("signal list").out, "weigh.weight  Nm    -      torque that holds");
  ASSERT_EQ(to_run("controller switch --stop hold --start weigh").status, 0);
  ASSERT_TRUE(tandem::test::eventually(
      [&] { return asked("signal list weigh")["signals"][0]["values"][0].is_number(); }));
  const std::string lines = to_run("signal watch weigh.weight --every 0.01 --count 3").out;
  expect(lines, "time_s  weigh.weight.joint1 [Nm]  weigh.weight.joint2 [Nm]\n");
  EXPECT_EQ(std::ranges::count(lines, '\n'), 4) << lines;
  expect(refused("signal list weigh.weihgt"), "did you mean 'weigh.weight'?");
  EXPECT_EQ(end(), 0);
}

constexpr char kTestPlugins[] = TANDEM_BINARY_DIR "/tests/test_plugins/";

// The run had ended with the signal, and the robot with it.
TEST_F(Controllers, ThatCrashBeforeTheirFirstCycleAreRefusedAndTheRunGoesOn) {
  if (TANDEM_SANITIZED != 0) GTEST_SKIP() << "a sanitizer handles signals itself";
  begin("");
  const auto lazy = [](const std::string& crash) {
    return "controller load " + shell_word(std::string(kTestPlugins) + "hangs.so") +
           " --name lazy --set at_once=true --set 'crash = \"" + crash + "\"'";
  };
  const std::string crashed = "lazy: the controller crashed before its first cycle: ";
  const std::string null = refused(lazy("null"));
  expect(null, crashed + "SIGSEGV in ");
  expect(null, "hangs.cpp:");
  expect(null, "the run goes on");
  expect(read_text(folder_ / "run.txt"), "from the trial of the controller 'lazy'");
  expect(refused(lazy("stack")), crashed + "SIGSEGV");
  expect(refused(lazy("abort")), crashed + "SIGABRT");
  expect(refused(lazy("divide")), crashed + "SIGFPE");
  expect(refused(lazy("exit")), "lazy: the controller called exit()");
  expect(refused("controller load " +
                 shell_word(std::string(kTestPlugins) + "crashes_when_opened.so")),
         "crashes_when_opened: the controller crashed before its first cycle: SIGSEGV");
  EXPECT_EQ(to_run("controller load " + shell_word(std::string(kTestPlugins) + "hangs.so") +
                   " --name lazy")
                .status,
            0)
      << "it is the parameters that let it crash";
  EXPECT_EQ(asked("controller list")["controllers"].size(), 2U);
  EXPECT_EQ(end(), 0);
}

TEST_F(Controllers, KeepTheirFormerBuildWhenTheNewOneCrashes) {
  if (TANDEM_SANITIZED != 0) GTEST_SKIP() << "a sanitizer handles signals itself";
  const auto put = [this](const std::string& build) {
    std::filesystem::copy_file(std::string(kTestPlugins) + build + ".so", folder_ / "new.so");
    std::filesystem::rename(folder_ / "new.so", folder_ / "nodder.so");
  };
  put("nodder_1");
  const std::string hold = read_text(folder_ / "hold.toml");
  write_text(folder_ / "hold.toml", hold.substr(0, hold.find("[[controller]]")) +
                                        "[[controller]]\nplugin = \"./nodder.so\"\n"
                                        "[controller.parameters]\nspeed_rad_s = 0.5\n");
  begin("");
  put("crashes_when_opened");
  expect(refused("controller reload nodder"),
         "nodder: the controller crashed before its first cycle: SIGSEGV");
  EXPECT_EQ(asked("controller list")["controllers"][0]["active"], true);
  // What it cannot be tried with is not opened, either.
  put("nodder_2");
  const std::string robot = read_text(folder_ / "robot.toml");
  write_text(folder_ / "robot.toml", "not a robot");
  expect(refused("controller reload nodder"), "nodder: it could not be tried: ");
  EXPECT_EQ(asked("controller reload nodder --untried")["done"], true);
  write_text(folder_ / "robot.toml", robot);
  EXPECT_EQ(asked("controller reload nodder")["done"], true);
  EXPECT_EQ(end(), 0);
}

TEST_F(Controllers, ThatCrashUntriedEndTheRun) {
  if (TANDEM_SANITIZED != 0) GTEST_SKIP() << "a sanitizer handles signals itself";
  begin("");
  EXPECT_NE(to_run("controller load --untried " +
                   shell_word(std::string(kTestPlugins) + "crashes_when_opened.so"))
                .status,
            0);
  EXPECT_NE(join(), 0);
}

// The log of a crash named only the libraries of the start.
TEST_F(Controllers, ThatCameAndCrashedAreInTheLog) {
  if (TANDEM_SANITIZED != 0) GTEST_SKIP() << "a sanitizer handles signals itself";
  log_flags_ = "--log l";
  begin("");
  ASSERT_EQ(to_run("controller load " + shell_word(std::string(kTestPlugins) + "hangs.so") +
                   " --name late --set 'crash = \"null\"'")
                .status,
            0);
  (void)to_run("controller switch --stop hold --start late");
  EXPECT_NE(join(), 0);
  const std::string info = tandem("log info l/double_pendulum-hold-001.mcap").out;
  expect(info, "loaded_controllers");
  expect(info, "late ");
  expect(info, "the controller 'late'");
}

TEST_F(Controllers, ThatAreBrokenAreRefusedWhileTheRunGoesOn) {
  begin("");
  const auto broken = [](const std::string& name) {
    return "controller load " +
           shell_word(TANDEM_BINARY_DIR "/tests/broken_plugins/" + name + ".so");
  };
  expect(refused(broken("no_entry")), "has no entry point");
  expect(refused(broken("older_interface")), "was built for controller interface ");
  for (const char* name : {"exits", "exits_when_made"})  // it had ended the run
    expect(refused(broken(name)), "the controller called exit()");
  expect(refused("controller load hodl"), "did you mean 'hold'?");
  expect(refused("controller load recorded_motion"),
         "log: this key is missing (give it with --set or --parameters)");
  expect(refused("controller load hold"), "of this name is loaded already");
  expect(refused("controller load hold --name x --set 'durtion_s = 2'"), "durtion_s");
  expect(refused("controller load hold --name x --set 'durtion_s = '"), "parameters:1");
  for (const char* line : {"durtion_s = 2", "duration_s = "}) {
    write_text(folder_ / "par.toml", std::string("\n\n\n") + line + "\n");
    expect(refused("controller load hold --name x --parameters par.toml"), " par.toml:4: ");
  }
  EXPECT_EQ(asked("controller list")["controllers"].size(), 1U);
  EXPECT_EQ(end(), 0);
  EXPECT_EQ(json("run.json")["fault_log"].size(), 0U);
}

// --set went into the file's last table.
TEST_F(Controllers, TakeParametersOfAFileWithTablesAndOfTheCommandLine) {
  begin("");
  const std::string tables =
      "[[waypoint]]\ntime_s = 1.0\nposition_rad = [0.1, 0.2]\n"
      "[[waypoint]]\ntime_s = 2.0\nposition_rad = [0.2, 0.1]\n";
  write_text(folder_ / "par.toml", "# of a test\ninterpolation = \"quintic\"\n" + tables);
  write_text(folder_ / "tables.toml", tables);
  const std::string load = "controller load joint_trajectory --set 'stop_at_end = true' ";
  const Outcome both = to_run(load + "--parameters par.toml");
  EXPECT_EQ(both.status, 0) << both.err;
  EXPECT_EQ(to_run(load + "--name two --parameters tables.toml").status, 0);
  write_text(folder_ / "wrong.toml", "\n\ninterpolatoin = \"quintic\"\n" + tables);
  expect(refused(load + "--name x --parameters wrong.toml"), " wrong.toml:3: ");
  expect(refused("controller load joint_trajectory --name x --parameters par.toml "
                 "--set 'stop_at_edn = true'"),
         "stop_at_edn");
  EXPECT_EQ(end(), 0);
}

TEST_F(Controllers, TakeTheirParametersAsAnObjectToo) {
  begin("");
  const Outcome outcome = to_run(
      "ask '{\"do\": \"controller.load\", \"plugin\": \"hold\", \"name\": \"one\", "
      "\"parameters\": {\"joints\": [\"joint2\"], \"duration_s\": 1.5}}'");
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  const auto list = asked("controller list")["controllers"];
  ASSERT_EQ(list[1]["claims"].size(), 1U);
  EXPECT_EQ(list[1]["claims"][0]["joint"], "joint2");
  EXPECT_EQ(end(), 0);
}

TEST_F(Controllers, OfAnExperimentMayWaitToBeStarted) {
  write_text(folder_ / "hold.toml", read_text(folder_ / "hold.toml") +
                                        "[[controller]]\nplugin = \"hold\"\nname = \"rest\"\n"
                                        "active = false\n");
  expect(tandem("check hold.toml").out, "Inactive at first.");
  begin("");
  EXPECT_EQ(asked("controller switch --stop hold --start rest")["active"],
            nlohmann::json({"rest"}));
  EXPECT_EQ(end(), 0);
}

TEST_F(Controllers, ThatAreActiveMayNotShareAJoint) {
  write_text(folder_ / "hold.toml", read_text(folder_ / "hold.toml") +
                                        "[[controller]]\nplugin = \"hold\"\nname = \"rest\"\n");
  const Outcome outcome = tandem("check hold.toml");
  EXPECT_EQ(outcome.status, 2);
  expect(outcome.err, "is claimed by the controllers 'hold' and 'rest'");
}

TEST_F(Controllers, OfARunWhoseTimeStandsChangeWithItsNextCycle) {
  begin("");
  EXPECT_EQ(to_run("controller load hold --name rest").status, 0);
  EXPECT_EQ(to_run("clock pause").status, 0);
  const auto asked_for = asked("controller switch --stop hold --start rest");
  EXPECT_EQ(asked_for["done"], false);
  EXPECT_EQ(asked_for["active"], nlohmann::json({"hold"}));
  expect(asked_for["note"], "next cycle");
  expect(refused("controller start hold"), "is claimed by the controllers");
  EXPECT_EQ(to_run("clock step").status, 0);
  expect(to_run("controller list").out, "rest        active");
  EXPECT_EQ(to_run("clock resume").status, 0);
  EXPECT_EQ(end(), 0);
}

}  // namespace
}  // namespace tandem::apps
