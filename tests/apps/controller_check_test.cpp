// `tandem controller check` and `tandem run --gate` with a controller that breaks each rule, and
// who is named where something is slow or wrong.
#include <map>
#include <set>

#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

const std::string kPlugins = TANDEM_BINARY_DIR "/tests/test_plugins/";
const std::string kPlugin = kPlugins + "breaks.so";

class ControllerCheck : public Program {
 protected:
  void SetUp() override {
    if (TANDEM_SANITIZED != 0) GTEST_SKIP() << "a sanitizer interposes the same calls itself";
    Program::SetUp();
  }
  /// The rules that are not kept, of a check with `rule`.
  std::map<std::string, nlohmann::json> broken(const std::string& rule) {
    const Outcome outcome = tandem(
        "controller check " + shell_word(kPlugin) +
        " --robot robot.toml --duration 0.5 --json check.json --set 'rule = \"" + rule + "\"'");
    said_ = outcome.out;
    EXPECT_EQ(outcome.err.empty(), rule != "print") << rule << outcome.err;
    std::map<std::string, nlohmann::json> found;
    const auto checked = json("check.json");
    for (const auto& one : checked["rules"])
      if (one["kept"] != true) found[one["rule"]] = one;
    EXPECT_EQ(outcome.status, found.empty() ? 0 : 1) << rule;
    EXPECT_EQ(checked["kept"], found.empty());
    return found;
  }
  std::string said_;
};

/// Whether a line of the stack has the function.
bool has_line(const nlohmann::json& breach, const std::string& function) {
  for (const auto& line : breach["stack"])
    if (line.get<std::string>().find(function) != std::string::npos) return true;
  return false;
}

TEST_F(ControllerCheck, PassesAControllerThatKeepsTheRules) {
  const auto found = broken("none");
  EXPECT_TRUE(found.empty()) << found.begin()->second.dump(1);
  EXPECT_NE(said_.find("no allocation"), std::string::npos) << said_;
}

TEST_F(ControllerCheck, NamesThePlaceOfEachBrokenRule) {
  const struct {
    const char *rule, *name, *call, *function;
  } cases[] = {
      {"allocation", "no allocation", "malloc", "make_a_list"},
      {"lock", "no lock", "pthread_mutex_lock", "take_a_lock"},
      {"system_call", "no system call", "", "ask_the_kernel"},
      {"print", "no system call", "write", "print_a_line"},
      {"thread", "no thread", "pthread_create", "misbehave"},
      {"thread_in_configure", "no thread", "pthread_create", "configure"},
      {"archive_allocates", "no allocation", "malloc", "archive"},
  };
  for (const auto& one : cases) {
    const auto found = broken(one.rule);
    ASSERT_TRUE(found.contains(one.name)) << one.rule << "\n" << said_;
    const auto& breach = found.at(one.name)["breaches"][0];
    std::set<std::string> places;
    for (const auto& each : found.at(one.name)["breaches"]) {
      EXPECT_TRUE(
          places.insert(each["call"].dump() + each["function"].dump() + each["stack"].dump())
              .second)
          << "told twice:\n"
          << each.dump(1);
    }
    EXPECT_EQ(breach["controller"], "breaks");
    if (*one.call != '\0') {
      EXPECT_EQ(breach["call"], one.call);
    }
    EXPECT_TRUE(has_line(breach, one.function)) << breach.dump(1);
    EXPECT_NE(said_.find(one.function), std::string::npos) << said_;
    EXPECT_TRUE(has_line(breach, "breaks.cpp:")) << "file and line\n" << breach.dump(1);
    if (one.rule == std::string("lock") || one.rule == std::string("system_call")) {
      EXPECT_EQ(found.size(), 1U) << said_;
    }
  }
}

TEST_F(ControllerCheck, CountsPageFaults) {
  const auto found = broken("page_fault");
  ASSERT_TRUE(found.contains("no page fault")) << said_;
  EXPECT_EQ(found.at("no page fault")["breaches"][0]["function"], "update()");
}

TEST_F(ControllerCheck, ProvesTheArchive) {
  auto found = broken("archive_reads_more");
  ASSERT_TRUE(found.contains("save, restore, save")) << said_;
  EXPECT_NE(found["save, restore, save"]["note"].dump().find("'breaks'"), std::string::npos);
  found = broken("archive_forgets");
  ASSERT_EQ(found.size(), 1U) << said_;
  EXPECT_NE(found["a rewound run"]["note"].dump().find("joint1"), std::string::npos)
      << found["a rewound run"];
}

TEST_F(ControllerCheck, RefusesWhatItCannotCheck) {
  for (const auto& [arguments, text] : std::map<std::string, std::string>{
           {"nothing.so", "there is no such library"},
           {shell_word(kPlugin) + " --experiment hold.toml", "none of its controllers is"},
           {shell_word(kPlugin) + " --robot robot.toml --set 'rule = \"no\"'", "rule"},
           {shell_word(kPlugin) + " --robot none.toml", "none.toml"}}) {
    const Outcome outcome = tandem("controller check " + arguments);
    EXPECT_EQ(outcome.status, 2) << arguments;
    EXPECT_NE(outcome.err.find(text), std::string::npos) << outcome.err;
  }
}

// It had named a temporary file that nobody sees, and what followed on from the missing key first.
TEST_F(ControllerCheck, SaysWhatToGiveItOnTheCommandLine) {
  const auto said = [&](const std::string& more) {
    return tandem("controller check " + shell_word(kPlugins + "nodder_asks.so") + more).err;
  };
  EXPECT_EQ(said(" --set 'speed_rad_s = 1.0'"),
            "error: gain: this key is missing (give it: --set 'gain = …')\n");
  const std::string wrong = said(" --set 'gain = 1.0' --set 'speed_rad_s = \"fast\"'");
  EXPECT_TRUE(wrong.starts_with("error: --set 'speed_rad_s = \"fast\"': speed_rad_s: ")) << wrong;
  const std::string syntax = said(" --set 'gain = '");
  EXPECT_TRUE(syntax.starts_with("error: --set 'gain = ': not valid TOML")) << syntax;
  EXPECT_EQ(said(" --set 'gain = 0.0' --set 'speed_rad_s = 1.0'"),
            "error: controller.nodder_asks: a gain of 0 does nothing (raise it)\n");
}

TEST_F(ControllerCheck, TakesABundledRobotByItsName) {
  const Outcome outcome =
      tandem("controller check " + shell_word(kPlugin) + " --robot double_pendulum --duration 0.3");
  EXPECT_EQ(outcome.status, 0) << outcome.err << outcome.out;
}

TEST_F(ControllerCheck, TakesAnExperimentThatNamesThePlugin) {
  edit("hold.toml", "plugin = \"hold\"", "plugin = \"breaks\"\nname = \"mine\"");
  const Outcome outcome =
      tandem("controller check " + shell_word(kPlugin) + " --experiment hold.toml --duration 0.3");
  EXPECT_EQ(outcome.status, 0) << outcome.err << outcome.out;
}

TEST_F(ControllerCheck, IsTheGateOfARun) {
  edit("hold.toml", "plugin = \"hold\"",
       "plugin = \"" + kPlugin + "\"\nname = \"hold\"\nparameters = { rule = \"lock\" }");
  const Outcome outcome =
      tandem("run hold.toml --gate --no-log --no-socket --duration 0.5 --json run.json");
  EXPECT_EQ(outcome.status, 1) << outcome.err;
  const auto rules = json("run.json")["gate"];
  ASSERT_EQ(rules.size(), 5U);
  EXPECT_EQ(rules[1]["rule"], "no lock");
  EXPECT_EQ(rules[1]["kept"], false);
  EXPECT_TRUE(has_line(rules[1]["breaches"][0], "take_a_lock")) << rules;
  EXPECT_NE(outcome.out.find("no lock: pthread_mutex_lock in hold: update()"), std::string::npos)
      << outcome.out;
}

// An overrun, a NaN: the table and the log said which joint, and nobody's name.
TEST_F(ControllerCheck, IsNotNeededToNameWhoWasSlowOrWrong) {
  edit("hold.toml", "plugin = \"hold\"",
       "plugin = \"" + kPlugin + "\"\nname = \"hold\"\nparameters = { rule = \"slow\" }");
  Outcome outcome =
      tandem("run hold.toml --realtime --no-socket --no-log --duration 0.5 --json run.json");
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  const auto slow = json("run.json")["controllers"]["hold"];
  EXPECT_GT(slow["overruns"], 0) << slow;
  EXPECT_GE(slow["call_ns"]["max"], 5'000'000);
  EXPECT_LE(slow["overruns"], json("run.json")["overruns"]);
  edit("hold.toml", "slow", "nan");
  outcome = tandem("run hold.toml --no-socket --json run.json --log log");
  EXPECT_EQ(outcome.status, 1);
  EXPECT_EQ(json("run.json")["fault_log"][0]["controller"], "hold");
  EXPECT_NE(outcome.err.find("joint2: the command of the controller 'hold' was not a finite "
                             "number: position reference nan"),
            std::string::npos)
      << outcome.err;
  const std::string events = tandem("log csv log/*.mcap --topic event").out;
  for (const char* event : {"\"fault", "\"command limited"}) {
    const std::string says = event + std::string(
                                         " of joint2: the position reference nan is not "
                                         "finite, controller 'hold'");
    EXPECT_NE(events.find(says), std::string::npos) << events;
  }
  EXPECT_EQ(json("run.json")["joints"]["joint2"]["limited_controller"], "hold");
}

// "joint1 in 100 of 1000 cycles", null, and no event.
TEST_F(ControllerCheck, IsNotNeededToNameWhoMetALimit) {
  edit("hold.toml", "plugin = \"hold\"",
       "plugin = \"" + kPlugin + "\"\nname = \"hold\"\nparameters = { rule = \"too_fast\" }");
  const Outcome outcome = tandem("run hold.toml --no-socket --json run.json --log log");
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.out.find(" cycles, by 'hold'"), std::string::npos) << outcome.out;
  const auto joint = json("run.json")["joints"]["joint2"];
  EXPECT_GT(joint["limited_cycles"], 0);
  EXPECT_EQ(joint["limited_controller"], "hold");
  EXPECT_TRUE(json("run.json")["joints"]["joint1"]["limited_controller"].is_null());
  const std::string events = tandem("log csv log/*.mcap --topic event").out;
  const std::string what = joint["limited_command"];
  EXPECT_NE(outcome.out.find("; first " + what.substr(0, 24)), std::string::npos) << outcome.out;
  const std::string met = "command limited of joint2: " + what + ", controller 'hold'";
  EXPECT_NE(events.find(met), std::string::npos) << events;
  EXPECT_EQ(events.find(met), events.rfind(met)) << "once";
  const std::string told = " s: joint2: limited: " + what + ", by 'hold'\n";
  EXPECT_NE(outcome.err.find(told), std::string::npos) << outcome.err;
  EXPECT_EQ(outcome.err.find(": limited: "), outcome.err.rfind(": limited: "))
      << "of a joint, once";
}

TEST_F(ControllerCheck, IsNotNeededToNameWhoWroteWithoutAClaim) {
  edit("hold.toml", "plugin = \"hold\"",
       "plugin = \"" + kPlugin + "\"\nname = \"hold\"\nparameters = { rule = \"stray\" }");
  const Outcome outcome = tandem("run hold.toml --no-socket --json run.json --log log");
  EXPECT_NE(outcome.out.find("the controller 'hold' wrote to this"), std::string::npos)
      << outcome.out;
  const auto faults = json("run.json")["fault_log"];
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0]["controller"], "hold");
  EXPECT_EQ(faults[0]["joint"], "joint2");
  EXPECT_NE(tandem("log csv log/*.mcap --topic event")
                .out.find("unclaimed write of joint2, controller 'hold'"),
            std::string::npos);
}

// As docs/controllers.md has it; the sanitizer's run-time was taken for another version of what the
// program has, and its loader refused the flag that keeps such apart.
TEST_F(ControllerCheck, IsNotNeededByTheAddressSanitizer) {
  if (std::string(TANDEM_ASAN_RUNTIME).find('/') == std::string::npos)
    GTEST_SKIP() << "this compiler has no libasan.so";
  edit("hold.toml", "plugin = \"hold\"", "plugin = \"" + kPlugins + "overflows.so\"");
  const Outcome outcome =
      tandem("run hold.toml --no-socket --no-log", "LD_PRELOAD=" + shell_word(TANDEM_ASAN_RUNTIME));
  EXPECT_NE(outcome.err.find("heap-buffer-overflow"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("overflows.cpp:17"), std::string::npos) << outcome.err;
}

}  // namespace
}  // namespace tandem::apps
