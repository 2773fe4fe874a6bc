// `tandem run --set` and `tandem sweep`.
#include <chrono>
#include <csignal>
#include <thread>

#include "base/process.hpp"
#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

class SweepProgram : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    edit("hold.toml", "[[controller]]",
         "[[expect]]\nname = \"slow\"\nalways = \"abs(velocity(joint1)) < 2rad/s\"\n"
         "[[push]]\nname = \"bump\"\nlink = \"link1\"\nwhen = \"phase() == running\"\nafter_s = "
         "0.05\ntorque_Nm = [1.0, 0, 0]\n"
         "for_s = 0.1\n[[controller]]");
    study("values = [0.0, 0.5, 1.0, 40.0]\n");
  }
  void study(const std::string& values, const std::string& more = {}) const {
    write_text(folder_ / "study.toml", "experiment = \"hold.toml\"\nset = [\"duration_s=0.3\"]\n" +
                                           more + "[[vary]]\nkey = \"push[0].torque_Nm[0]\"\n" +
                                           values);
  }
};

TEST_F(SweepProgram, ASetValueIsRunLoggedAndToldOf) {
  const Outcome run = tandem(
      "run hold.toml --log . --json run.json --set duration_s=0.2 --set push.bump.torque_Nm[0]=40");
  EXPECT_EQ(run.status, 1) << run.err;
  EXPECT_EQ(json("run.json")["planned_cycles"], 200);
  std::string log;
  for (const auto& entry : std::filesystem::directory_iterator(folder_))
    if (entry.path().extension() == ".mcap") log = entry.path().filename().string();
  EXPECT_NE(read_text(folder_ / log).find("--set push.bump.torque_Nm[0]=40"), std::string::npos);
  EXPECT_EQ(tandem("replay " + log).status, 0);

  const Outcome other = tandem("run hold.toml --no-log --from " + log + "@0.2s");
  EXPECT_EQ(other.status, 2);
  const Outcome typo = tandem("check hold.toml --set push[0].torqe_Nm=3");
  EXPECT_EQ(typo.status, 2);
  EXPECT_NE(typo.err.find("--set push[0].torqe_Nm=3: push.bump.torqe_Nm: unknown key (did you mean "
                          "'torque_Nm'?)"),
            std::string::npos)
      << typo.err;
  const Outcome robot = tandem("check hold.toml --set robot.joint[0].max_velocity_rad_s=-1");
  EXPECT_EQ(robot.status, 2);
  EXPECT_NE(robot.err.find("--set robot.joint[0]."), std::string::npos) << robot.err;
}

TEST_F(SweepProgram, HasTheSameBytesOnAnyNumberOfWorkersAndGoesOn) {
  ASSERT_EQ(tandem("sweep study.toml -j 1 -o one --json one.json").status, 0);
  const auto summary = json("one.json");
  EXPECT_EQ(summary["points"], 4);
  EXPECT_EQ(summary["rate"]["passed"], 3);
  EXPECT_EQ(summary["worst"][0]["passed"], false);
  const std::string command = summary["worst"][0]["command"];
  EXPECT_EQ(command,
            "tandem run hold.toml --hal sim --set duration_s=0.3 --set 'push[0].torque_Nm[0]=40'");
  EXPECT_EQ(tandem(command.substr(7) + " --no-log").status, 1);

  ASSERT_EQ(tandem("sweep study.toml -j 3 -o three -q").status, 0);
  for (const char* file : {"results.csv", "results.sqlite", "index.html"})
    EXPECT_EQ(read_text(folder_ / "one" / file), read_text(folder_ / "three" / file)) << file;

  // As a process leaves it that is killed while it writes.
  const std::string lines = read_text(folder_ / "one/points.jsonl");
  const std::size_t second = lines.find('\n', lines.find('\n') + 1) + 1;
  write_text(folder_ / "one/points.jsonl", lines.substr(0, second + 40));
  std::filesystem::remove(folder_ / "one/results.csv");
  const Outcome on = tandem("sweep study.toml -j 1 -o one --at-least 0.9");
  EXPECT_EQ(on.status, 1) << on.err;
  EXPECT_NE(on.out.find("goes on: 2 points are there already"), std::string::npos) << on.out;
  EXPECT_EQ(read_text(folder_ / "one/results.csv"), read_text(folder_ / "three/results.csv"));

  edit("robot.toml", "[model]", "# other\n[model]");
  const Outcome mixed = tandem("sweep study.toml -o one");
  EXPECT_EQ(mixed.status, 2);
  EXPECT_NE(mixed.err.find("its points are of another robot.toml: they are not mixed"),
            std::string::npos)
      << mixed.err;
}

// What comes at a time, at a condition, is asked for, or is random; with an event that does not
// vary among those that do.
constexpr char kMixed[] = R"toml(robot = "robot.toml"
posture = "ready"
duration_s = 0.8
[sim]
noise = true
[[controller]]
plugin = "hold"
[[push]]
name = "same"
link = "link1"
when = "phase() == running"
after_s = 0.1
torque_Nm = [1.0, 0.0, 0.0]
for_s = 0.05
[[push]]
name = "later"
link = "link2"
when = "abs(velocity(joint1)) > 0.05rad/s"
after_s = 0.2
impulse_Ns = [0.1, 0.2, 0.3]
for_s = 0.05
[[fault]]
kind = "frame_drop"
probability = 0.3
at_s = 0.9
for_s = 0.05
[[fault]]
kind = "frame_drop"
probability = 0.2
at_s = 1.0
for_s = 0.1
[[event]]
name = "softer"
at_s = 0.9
ask = { do = "joint.gains", joint = "joint1", loop = "position", kp = 20.0 }
[[expect]]
name = "slow"
rms = "velocity(joint1)"
below = "0.001rad/s"
[[expect]]
name = "in place"
bounds = "position(joint2)"
below = "9rad"
)toml";

TEST_F(SweepProgram, HasTheSameBytesByBranchesOfWhateverHappens) {
  write_text(folder_ / "mixed.toml", kMixed);
  const auto rows_of = [this](const std::string& key, const std::string& values, bool branch) {
    write_text(folder_ / "study.toml",
               "experiment = \"mixed.toml\"\nseeds = 2\n[[vary]]\nkey = \"" + key +
                   "\"\nvalues = " + values + "\n");
    std::filesystem::remove_all(folder_ / "one");
    const Outcome outcome =
        tandem(std::string("sweep study.toml -q -j 2 -o one") + (branch ? "" : " --no-branches"));
    EXPECT_EQ(outcome.status, 0) << key << ": " << outcome.err;
    return read_text(folder_ / "one/results.csv");
  };
  for (const auto& [key, values] : {
           std::pair{"push.later.impulse_Ns[0]", "[0.1, 0.2, 0.3, 0.4]"},
           std::pair{"push.later.after_s", "[0.0, 0.1, 0.3, 9.0]"},
           std::pair{"push.later.when",
                     "[\"position(joint2) > 9rad\", \"phase() == running\", \"time() > "
                     "1s\"]"},
           std::pair{"fault[1].at_s", "[0.5, 0.85, 1.0, 1.2]"},
           std::pair{"fault[0].probability", "[0.1, 0.3, 0.5]"},
           std::pair{"event.softer.at_s", "[0.7, 0.9, 1.1]"},
           std::pair{"event.softer.ask.kp", "[10.0, 50.0, 90.0]"},
       }) {
    EXPECT_EQ(rows_of(key, values, true), rows_of(key, values, false)) << key;
  }
}

TEST_F(SweepProgram, BuildsTheKernelsOfEachRobotOnce) {
  study("values = [0.0, 0.5]\n",
        "[[vary]]\nkey = \"robot.model.link.link2.mass_kg\"\nvalues = [1.25, 1.5]\n");
  const Outcome outcome =
      tandem("sweep study.toml -q -j 2 -o one --json one.json", "XDG_CACHE_HOME=$PWD/cache");
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(json("one.json")["rate"]["passed"], 4) << read_text(folder_ / "one/results.csv");
  std::size_t libraries = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder_ / "cache/tandem/models"))
    libraries += entry.path().extension() == ".so" ? 1 : 0;
  EXPECT_EQ(libraries, 2U);
}

TEST_F(SweepProgram, ACrashARefusalAndAHangCostOnePointEach) {
  study("values = [0.0, \"text\"]\n", "time_limit_s = 2\n");
  EXPECT_EQ(tandem("sweep study.toml -o out --json out.json -q").status, 0);
  const std::string csv = read_text(folder_ / "out/results.csv");
  EXPECT_NE(csv.find(",1,as planned,,"), std::string::npos) << csv;
  EXPECT_NE(csv.find(",0,refused,"), std::string::npos) << csv;
  EXPECT_EQ(json("out.json")["rate"]["of"], 1);
  EXPECT_EQ(json("out.json")["rate"]["refused"], 1);
  EXPECT_FALSE(has_log());

  study("values = [40.0]\n", "[keep]\nlogs_MB = 50\n");
  EXPECT_EQ(tandem("sweep study.toml -o kept -q").status, 0);
  EXPECT_TRUE(has_log());
}

TEST_F(SweepProgram, RefusesWhatWouldComeToNothing) {
  study("values = [0.0]\n", "set_ = 3\n");
  EXPECT_EQ(tandem("sweep study.toml").status, 2);
  write_text(folder_ / "study.toml",
             "experiment = \"hold.toml\"\n[[vary]]\nkey = \"push[7].at_s\"\nvalues = [1]\n");
  const Outcome wrong = tandem("sweep study.toml");
  EXPECT_EQ(wrong.status, 2);
  EXPECT_NE(wrong.err.find("--set push[7].at_s=1: push has 1 entry"), std::string::npos)
      << wrong.err;
  EXPECT_FALSE(std::filesystem::exists(folder_ / "sweeps"));
}

}  // namespace
}  // namespace tandem::apps
