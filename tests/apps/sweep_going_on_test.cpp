// A sweep that goes on: with more points, after a stop, after damage; points that crash or hang.
#include <algorithm>
#include <csignal>
#include <thread>

#include "base/process.hpp"
#include "tests/apps/program.hpp"
#include "tests/support/eventually.hpp"

namespace tandem::apps {
namespace {

class SweepGoingOn : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    edit("hold.toml", "[[controller]]",
         "[[expect]]\nname = \"slow\"\nalways = \"abs(velocity(joint1)) < 2rad/s\"\n"
         "[[push]]\nname = \"bump\"\nlink = \"link1\"\nwhen = \"phase() == running\"\nafter_s = "
         "0.05\ntorque_Nm = [1.0, 0, 0]\nfor_s = 0.1\n[[controller]]");
    study("values = [0.0, 0.5, 40.0]\n");
  }
  void study(const std::string& values, const std::string& more = {}) const {
    write_text(folder_ / "study.toml", "experiment = \"hold.toml\"\nset = [\"duration_s=0.3\"]\n" +
                                           more + "[[vary]]\nkey = \"push[0].torque_Nm[0]\"\n" +
                                           values);
  }
  void goes_on(std::size_t points, const std::string& more = {}) const {
    const Outcome on = tandem("sweep study.toml -o out --json out.json" + more);
    EXPECT_EQ(on.status, 0) << on.err;
    EXPECT_NE(on.out.find("goes on: " + std::to_string(points) + " points are there already"),
              std::string::npos)
        << on.out;
  }
  [[nodiscard]] std::string points_file() const { return read_text(folder_ / "out/points.jsonl"); }
};

// Every byte of the study, and of the experiment, voided all points.
TEST_F(SweepGoingOn, KeepsThePointsThatMeanTheSame) {
  ASSERT_EQ(tandem("sweep study.toml -o out -q").status, 0);
  const std::string table = read_text(folder_ / "out/results.csv");
  study("values = [0.0, 0.5, 40.0]  # a remark\n", "[keep]\nlogs_MB = 0\n");
  edit("hold.toml", "[[push]]", "# a remark\n[[push]]");
  goes_on(3);
  EXPECT_EQ(read_text(folder_ / "out/results.csv"), table);
  // One before, one behind, and one that is gone: what is there is numbered anew.
  study("values = [-1.0, 0.0, 40.0, 50.0]\n");
  goes_on(2);
  EXPECT_EQ(json("out.json")["points"], 4);
  EXPECT_EQ(json("out.json")["rate"]["passed"], 2);
  ASSERT_EQ(tandem("sweep study.toml -o fresh -q").status, 0);
  EXPECT_EQ(read_text(folder_ / "out/results.csv"), read_text(folder_ / "fresh/results.csv"));
  study("values = [0.0, 0.5, 40.0]\n");
  goes_on(3);  // what the study had no more was kept, too
  EXPECT_EQ(read_text(folder_ / "out/results.csv"), table);

  edit("hold.toml", "< 2rad/s", "< 3rad/s");
  const Outcome other = tandem("sweep study.toml -o out -q");
  EXPECT_EQ(other.status, 2);
  EXPECT_NE(other.err.find("its points are of another hold.toml: they are not mixed"),
            std::string::npos)
      << other.err;
}

TEST_F(SweepGoingOn, ADamagedLineCostsItsPoint) {
  ASSERT_EQ(tandem("sweep study.toml -o out -q -j 1").status, 0);
  const std::string table = read_text(folder_ / "out/results.csv");
  std::string lines = points_file();
  lines[lines.find('\n') + 10] = '\0';
  write_text(folder_ / "out/points.jsonl", lines);
  const Outcome on = tandem("sweep study.toml -o out");
  EXPECT_EQ(on.status, 0) << on.err;
  EXPECT_NE(on.err.find("out/points.jsonl:2: is damaged: its point is computed again"),
            std::string::npos)
      << on.err;
  EXPECT_NE(on.out.find("goes on: 2 points are there already"), std::string::npos) << on.out;
  EXPECT_EQ(read_text(folder_ / "out/results.csv"), table);
  EXPECT_EQ(tandem("sweep study.toml -o out -q").err, "") << "it says so once";
}

// A result hangs on the study's time limit where the point was too slow for that.
TEST_F(SweepGoingOn, ACrashAKillAndAHangAreResults) {
  const std::string hangs = TANDEM_BINARY_DIR "/tests/test_plugins/hangs.so";
  write_text(folder_ / "hangs.toml",
             "robot = \"robot.toml\"\nduration_s = 0.3\n[faults]\nwatchdog_s = 60.0\n"
             "[[expect]]\nname = \"slow\"\nalways = \"time() >= 0s\"\n"
             "[[controller]]\nplugin = \"" +
                 hangs + "\"\n[controller.parameters]\nafter_cycles = 100\ncrash = \"no\"\n");
  const auto limited = [&](const char* limit) {
    write_text(folder_ / "study.toml", std::string("experiment = \"hangs.toml\"\ntime_limit_s = ") +
                                           limit +
                                           "\n[[variant]]\nname = \"runs\"\nset = ["
                                           "\"controller[0].parameters.after_cycles=1000000\"]\n"
                                           "[[variant]]\nname = \"aborts\"\nset = ["
                                           "\"controller[0].parameters.crash=abort\"]\n"
                                           "[[variant]]\nname = \"is killed\"\nset = ["
                                           "\"controller[0].parameters.crash=kill\"]\n"
                                           "[[variant]]\nname = \"hangs\"\nset = ["
                                           "\"controller[0].parameters.for_s=600.0\"]\n");
  };
  limited("8");
  ASSERT_EQ(tandem("sweep study.toml -o out -q -j 4").status, 0);
  const std::string csv = read_text(folder_ / "out/results.csv");
  for (const char* row :
       {",runs,,1,as planned,", ",aborts,,0,crashed,", "abort() (SIGABRT)",
        ",is killed,,0,crashed,crashed: SIGKILL", ",hangs,,0,too slow,it was ended after 8 s"})
    EXPECT_NE(csv.find(row), std::string::npos) << row << "\n" << csv;
  limited("0.5");
  const Outcome on = tandem("sweep study.toml -o out -j 4");
  EXPECT_NE(on.out.find("goes on: 3 points are there already"), std::string::npos) << on.out;
  EXPECT_NE(read_text(folder_ / "out/results.csv").find("it was ended after 0.5 s"),
            std::string::npos);
}

TEST_F(SweepGoingOn, StoppedItHasTheTablesOfWhatIsThere) {
  write_text(folder_ / "study.toml",
             "experiment = \"hold.toml\"\n[[vary]]\nkey = \"duration_s\"\n"
             "values = [0.3, 100000.0]\n");
  const Result<pid_t> child = spawn(
      {.command = {TANDEM_BINARY_DIR "/bin/tandem", "sweep", (folder_ / "study.toml").string(),
                   "-j", "2", "-o", (folder_ / "out").string()},
       .output = (folder_ / "said.txt").string()});
  ASSERT_TRUE(child) << child.error().to_string();
  EXPECT_TRUE(test::eventually([&] {
    return std::filesystem::exists(folder_ / "out/points.jsonl") &&
           std::ranges::count(points_file(), '\n') == 1;
  }));
  EXPECT_EQ(::kill(*child, SIGTERM), 0);
  EXPECT_EQ(wait_for(*child), 128 + SIGTERM) << read_text(folder_ / "said.txt");
  const std::string csv = read_text(folder_ / "out/results.csv");
  EXPECT_EQ(std::ranges::count(csv, '\n'), 2) << csv;
  EXPECT_NE(csv.find(",as planned,"), std::string::npos) << csv;
  EXPECT_TRUE(std::filesystem::exists(folder_ / "out/index.html"));
}

}  // namespace
}  // namespace tandem::apps
