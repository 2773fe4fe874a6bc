// `tandem run`, `check` and `test` with scenarios; `tandem push` against a run.
#include <algorithm>

#include "apps/run/inject.hpp"
#include "tests/apps/running.hpp"

namespace tandem::apps {
namespace {

class ScenarioRun : public Running {
 protected:
  /// hold.toml with these rows, for one second.
  void scenario(const std::string& name, const std::string& rows) const {
    write_text(folder_ / (name + ".toml"), read_text(folder_ / "hold.toml") + "\n" + rows);
  }
  /// What `check` and `run` say of wrong rows, before anything moves.
  void refused(const std::string& rows, const std::string& words) const {
    scenario("wrong", rows);
    for (const char* command : {"check wrong.toml", "run wrong.toml --no-log"}) {
      const Outcome outcome = tandem(command);
      EXPECT_EQ(outcome.status, 2) << command << "\n" << rows;
      EXPECT_NE((outcome.out + outcome.err).find(words), std::string::npos)
          << command << "\n"
          << rows << outcome.out << outcome.err;
    }
  }
  [[nodiscard]] int line_of(const std::string& text) const {
    const std::string all = read_text(folder_ / "wrong.toml");
    return 1 + static_cast<int>(std::count(
                   all.begin(), all.begin() + static_cast<std::ptrdiff_t>(all.find(text)), '\n'));
  }
};

constexpr char kEvents[] = R"(
[[push]]
name = "nudge"
link = "link2"
when = "phase() == running"
after_s = 0.1
impulse_Ns = [0.05, 0, 0]
shape = "half_sine"
for_s = 0.05

[[event]]
name = "softer"
at_s = 0.8
ask = { do = "joint.gains", joint = "joint1", loop = "position", kp = 30.0 }

[[event]]
when = "time() > 0.9s"
ask = { do = "inject", scenario = "[[fault]]\nkind = 'push'\njoint = 'joint1'\nforce_N = [1,0,0]\nfor_s = 0.01" }

[[event]]
at_s = 1.0
ask = { do = "controller.stop", name = "hold" }

[[expect]]
eventually = "abs(truth.push_force_N.0) > 0.5N"
)";

TEST_F(ScenarioRun, ComesInTheSameCyclesEachTime) {
  scenario("events", kEvents);
  for (const char* log : {"one", "two"}) {
    const Outcome outcome =
        tandem("run events.toml --duration 1.2 -q --json run.json --log " + std::string(log));
    ASSERT_EQ(outcome.status, 0) << outcome.err;
  }
  const auto rows = json("run.json")["expectations"];
  ASSERT_EQ(rows.size(), 5U);
  EXPECT_EQ(rows[1]["name"], "nudge comes");
  EXPECT_EQ(rows[2]["name"], "softer comes");
  EXPECT_EQ(rows[2]["at_s"], 0.8);
  EXPECT_EQ(rows[3]["name"], "event[1] comes");
  for (const auto& row : rows) EXPECT_EQ(row["passed"], true) << row;
  std::vector<std::string> logs;
  for (const char* log : {"one", "two"})
    for (const auto& entry : std::filesystem::directory_iterator(folder_ / log))
      if (entry.path().extension() == ".mcap") logs.push_back(entry.path().string());
  ASSERT_EQ(logs.size(), 2U);
  const Outcome same = tandem("log diff " + shell_word(logs[0]) + " " + shell_word(logs[1]));
  EXPECT_EQ(same.status, 0) << same.out << same.err;
  const Outcome csv = tandem("log csv " + shell_word(logs[0]) + " --topic /tandem/event -o e.csv");
  const std::string events = read_text(folder_ / "e.csv") + csv.err;
  for (const char* text :
       {"injected push 'nudge'", "ended push 'nudge'", "softer: done", "gains set"})
    EXPECT_NE(events.find(text), std::string::npos) << text << " in\n" << events;
}

TEST_F(ScenarioRun, FailsWithWhatWasRefused) {
  scenario("bad", R"(
[[event]]
name = "no such controller"
at_s = 0.5
ask = { do = "controller.stop", name = "hodl" }
[[expect]]
always = "time() >= 0s"
)");
  const Outcome run = tandem("run bad.toml --duration 0.3 --no-log --json bad.json");
  EXPECT_EQ(run.status, 1) << run.err;
  const auto row = json("bad.json")["expectations"][1];
  EXPECT_EQ(row["passed"], false);
  EXPECT_NE(row["reason"].get<std::string>().find("it was refused"), std::string::npos) << row;
  EXPECT_NE(row["reason"].get<std::string>().find("hold"), std::string::npos) << row;
  EXPECT_NE(run.err.find("no such controller"), std::string::npos) << run.err;
  EXPECT_EQ(tandem("test bad.toml").status, 1);
}

// Its test passed, whatever the push would have done.
TEST_F(ScenarioRun, APushThatNeverCameIsNoPass) {
  scenario("late", R"(
[[push]]
link = "link2"
at_s = 50
force_N = [1, 0, 0]
for_s = 0.1
[[expect]]
always = "time() >= 0s"
)");
  const Outcome run = tandem("run late.toml --duration 0.3 --no-log --json late.json");
  EXPECT_EQ(run.status, 0) << run.err;
  EXPECT_EQ(json("late.json")["never_injected"], 1);
  const Outcome suite = tandem("test late.toml");
  EXPECT_EQ(suite.status, 1);
  EXPECT_NE(suite.err.find("1 fault or push of its scenario never came"), std::string::npos)
      << suite.err;
}

TEST_F(ScenarioRun, TheDocumentationsExamplePasses) {
  const std::string page = read_text(TANDEM_SOURCE_DIR "/docs/scenarios.md");
  const std::size_t from = page.find("```toml\n") + 8;
  std::string example = page.substr(from, page.find("```", from) - from);
  const std::string robot = "../coman/robot.toml";
  ASSERT_NE(example.find(robot), std::string::npos);
  example.replace(example.find(robot), robot.size(), TANDEM_SOURCE_DIR "/config/coman/robot.toml");
  write_text(folder_ / "example.toml", example);
  const Outcome run = tandem("run example.toml --no-log -q --json example.json");
  EXPECT_EQ(run.status, 0) << run.err;
  EXPECT_EQ(json("example.json")["expectations"].size(), 4U);
}

TEST_F(ScenarioRun, IsAsInALog) {
  const std::string all =
      "[[expect]]\nsignal = \"position(*)\"\nas_in = \"good.mcap\"\nwithin = \"1mrad\"\n";
  scenario("plain", "[[expect]]\nalways = \"time() >= 0s\"\n");
  ASSERT_EQ(tandem("run plain.toml --duration 0.3 -q --log log").status, 0);
  for (const auto& entry : std::filesystem::directory_iterator(folder_ / "log"))
    if (entry.path().extension() == ".mcap")
      std::filesystem::copy_file(entry.path(), folder_ / "good.mcap");
  scenario("same", all);
  const Outcome same = tandem("run same.toml --duration 0.3 -q --no-log --json same.json");
  EXPECT_EQ(same.status, 0) << same.err;
  const auto row = json("same.json")["expectations"][0];
  EXPECT_EQ(row["margin"], 0.001) << row;
  EXPECT_EQ(row["unit"], "rad");
  EXPECT_EQ(row["joint"], "joint1");
  scenario("other",
           all + "[[push]]\njoint = \"joint2\"\nforce_N = [0, 20, 0]\nat_s = 0.3\nfor_s = 0.1\n");
  const Outcome other = tandem("run other.toml --duration 0.3 -q --no-log --json other.json");
  EXPECT_EQ(other.status, 1) << other.err;
  const auto failed = json("other.json")["expectations"][0];
  EXPECT_LT(failed["margin"], 0.0) << failed;
  EXPECT_NE(failed["reason"].get<std::string>().find("it differed in"), std::string::npos);
  EXPECT_NE(failed["joint"], "") << failed;
  const Outcome longer = tandem("run same.toml --duration 5 -q --no-log --json long.json");
  EXPECT_EQ(longer.status, 1) << longer.err;
  EXPECT_NE(json("long.json")["expectations"][0].dump().find("; the log has it from 0 s to"),
            std::string::npos);
  refused("[[expect]]\nsignal = \"position(joint1)\"\nas_in = \"bad.mcap\"\nwithin = \"1mrad\"\n",
          "bad.mcap");
  refused("[[expect]]\nsignal = \"position(joint9)\"\nas_in = \"good.mcap\"\nwithin = \"1mrad\"\n",
          "joint1");
  refused("[[expect]]\nsignal = \"position(joint1)\"\nas_in = \"good.mcap\"\nwithin = \"1mm\"\n",
          "within");
  refused("[[expect]]\nsignal = \"position(joint1)\"\nas_in = \"good.mcap\"\n", "within");
}

TEST_F(ScenarioRun, AnOptionalEventThatDidNotComeSaysSo) {
  scenario("maybe",
           "[[event]]\nname = \"maybe\"\nwhen = \"time() > 100s\"\noptional = true\n"
           "ask = { do = \"run.stop\" }\n");
  const Outcome run = tandem("run maybe.toml --duration 0.1 --no-log --json maybe.json");
  EXPECT_EQ(run.status, 0) << run.err;
  EXPECT_EQ(json("maybe.json")["expectations"][0]["reason"], "did not come (optional)");
  const Outcome suite = tandem("test maybe.toml");  // without [[expect]]
  EXPECT_EQ(suite.status, 0) << suite.err;
  const Outcome check = tandem("check maybe.toml");
  EXPECT_NE(check.out.find("maybe: asks for"), std::string::npos) << check.out;
}

TEST_F(ScenarioRun, FindsWhatIsWrongBeforeAnythingMoves) {
  const std::string row = "[[event]]\nat_s = 1.0\n";
  refused(row + "ask = { do = \"controler.set\" }\n", "did you mean 'controller.set'?");
  refused(row + "ask = { do = \"joint.gains\", joint = \"joint1\", loop = \"positon\" }\n",
          "did you mean 'position'?");
  refused(row + "ask = { do = \"joint.gains\", joint = \"jiont1\", loop = \"position\" }\n",
          "did you mean 'joint1'?");
  refused(row + "ask = { do = \"joint.set\", joint = \"joint1\", stiffness_Nm_rad = nan }\n",
          "event[0].ask: joint.set: \"stiffness_Nm_rad\" is not of type number");
  EXPECT_NE(tandem("check wrong.toml").err.find("wrong.toml:" + std::to_string(line_of("ask ="))),
            std::string::npos);
  refused(row + "ask = { do = \"clock.pause\" }\n", "clock.pause is not for events");
  refused(row + "ask = { do = \"push\", site = \"hnd\", force_N = [1, 0, 0] }\n", "no site 'hnd'");
  refused(row, "event[0].ask");
  refused("[[event]]\nask = { do = \"run.stop\" }\n", "nothing says when it comes");
  refused(row + "when = \"time() > 1s\"\nask = { do = \"run.stop\" }\n", "keep one of both");
  refused("[[event]]\nwhen = \"tme() > 1s\"\nask = { do = \"run.stop\" }\n", "did you mean 'time");
  refused("[[push]]\nlink = \"link2\"\nforce_N = [1, 0, 0]\nwhen = \"time() > 1s\"\nat_s = 1.0\n",
          "it comes once");
  refused("[[push]]\nlink = \"link2\"\nforce_N = [1, 0, 0]\noptional = true\n", "without `when`");
  refused("[[fault]]\nkind = \"board_duplicate\"\nboard = \"board_1\"\nwhen = \"time() > 1s\"\n",
          "has to be there when the robot is made");
  refused(
      "[[event]]\nname = \"a\"\nat_s = 1.0\nask = { do = \"run.stop\" }\n"
      "[[push]]\nname = \"a\"\nlink = \"link2\"\nforce_N = [1, 0, 0]\n",
      "two events are called 'a'");
  refused("[[push]]\nlink = \"link9\"\nforce_N = [1, 0, 0]\n", "no link 'link9'");
}

TEST_F(ScenarioRun, OfARobotThatIsNotSimulatedHereIsRefused) {
  scenario("events", kEvents);
  const Outcome outcome = tandem("run events.toml --hal can --no-log");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("come in a simulation in this process"), std::string::npos)
      << outcome.err;
  const hal::RobotConfig robot;
  ControlRegistry registry;
  add_push(registry, robot, nullptr, 1'000'000, {});
  const Json no = registry.answer(R"({"do": "push", "joint": "a", "force_N": [1, 0, 0]})");
  EXPECT_EQ(no["ok"], false);
  EXPECT_NE(no["error"].get<std::string>().find("nobody can push it"), std::string::npos) << no;
}

TEST_F(ScenarioRun, IsPushedFromTheCommandLine) {
  start("--start-paused --duration 2000");
  until(R"("paused": true)");
  (void)to_run("clock step 500");
  const Outcome pushed = to_run("push --link link2 --force=-3,0,0 --for 20ms --shape triangle");
  EXPECT_EQ(pushed.status, 0) << pushed.err;
  EXPECT_EQ(pushed.out, "it is pushed from the next cycle on\n");
  const Outcome back = to_run("clock until 'truth.push_force_N.0 < -1N'");
  EXPECT_EQ(back.status, 0) << back.err;
  EXPECT_NE(to_run("push --link link2").err.find("nothing says how hard"), std::string::npos);
  EXPECT_NE(to_run("push lnk2 --force 1,0,0").err.find("no site 'lnk2'"), std::string::npos);
  EXPECT_NE(to_run("push --link link2 --force 1,0").err.find("force_N"), std::string::npos);
  EXPECT_EQ(end(), 0);
}

}  // namespace
}  // namespace tandem::apps
