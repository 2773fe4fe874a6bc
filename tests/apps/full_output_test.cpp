// A standard output that takes nothing: every command says so at its end.
#include "tests/apps/bad_input.hpp"

namespace tandem::apps {
namespace {

class FullOutput : public Program {
 protected:
  /// Runs `tandem ARGUMENTS` with this behind it in the shell.
  [[nodiscard]] Outcome with(const std::string& output, const std::string& arguments) const {
    const std::string command = "cd " + shell_word(folder_.string()) + " && { " +
                                shell_word(TANDEM_BINARY_DIR "/bin/tandem") + " " + arguments +
                                "; echo $? >status; } 2>err.txt " + output + " </dev/null";
    EXPECT_EQ(std::system(command.c_str()), 0) << command;
    return {std::atoi(read_text(folder_ / "status").c_str()), "", read_text(folder_ / "err.txt")};
  }
  void expect_said(const std::string& arguments, int status = 2) const {
    const Outcome outcome = with(">/dev/full", arguments);
    EXPECT_EQ(outcome.status, status) << arguments << "\n" << outcome.err;
    EXPECT_EQ(error_lines(outcome.err), 1) << arguments << "\n" << outcome.err;
    EXPECT_NE(outcome.err.find("error: not all of the standard output could be written: No space"),
              std::string::npos)
        << arguments << "\n"
        << outcome.err;
  }
};

const std::string kSquat = shell_word(TANDEM_SOURCE_DIR "/config/coman/squat.toml");

TEST_F(FullOutput, IsSaidByEveryCommand) {
  ASSERT_EQ(tandem("run hold.toml --duration 0.05 --quiet --log a").status, 0);
  ASSERT_EQ(tandem("run trajectory.toml --duration 0.1 --quiet --log b").status, 0);
  for (const char* arguments :
       {"check hold.toml", "check hold.toml --json -", "log info a/double_pendulum-hold-001.mcap",
        "log info a/double_pendulum-hold-001.mcap --json -",
        "log csv a/double_pendulum-hold-001.mcap",
        "log csv a/double_pendulum-hold-001.mcap --topic event", "model info robot.toml", "--help",
        "excite robot.toml --out e.toml --tries 3", "new -o made double_pendulum.urdf"})
    expect_said(arguments);
  expect_said("log diff a/double_pendulum-hold-001.mcap b/double_pendulum-trajectory-001.mcap", 1);
}

// fmt::print() throws when it cannot write: "terminate called", status 134.
TEST_F(FullOutput, IsSaidOfMoreThanABufferHolds) {
  expect_said("check --bus " + kSquat);
  expect_said("check --bus --json check.json " + kSquat);
  EXPECT_EQ(json("check.json")["ok"], false);
}

TEST_F(FullOutput, DoesNotStopARun) {
  const std::string run = "run hold.toml --no-log --no-socket --duration 2 --json ";
  expect_said(run + "-");
  expect_said(run + "run.json");
  ASSERT_EQ(tandem(run + "whole.json").status, 0);
  EXPECT_EQ(json("run.json")["cycles"], json("whole.json")["cycles"]);
  EXPECT_EQ(with("2>/dev/full >out.txt", run + "run.json").status, 0);
}

TEST_F(FullOutput, OfATraceLeavesTheRunsResult) {
  const Outcome run = tandem(
      "run hold.toml --no-log --no-socket -q --duration 1 --trace /dev/full --json run.json");
  EXPECT_EQ(run.status, 2);
  EXPECT_NE(run.err.find("cannot write the trace: No space"), std::string::npos) << run.err;
  EXPECT_EQ(json("run.json")["cycles"], 1000);
}

// A warning that could not be written had ended the command.
TEST_F(FullOutput, OfErrorsTakesNothingFromTheOther) {
  EXPECT_EQ(with("2>/dev/full >out.txt", "check hold.toml").status, 0);
  const std::string printed = read_text(folder_ / "out.txt");
  EXPECT_EQ(printed, tandem("check hold.toml").out);
}

TEST_F(FullOutput, IsNotAClosedPipe) {
  const auto expect_quiet = [&](const std::string& command) {
    const std::string err = read_text(folder_ / "err.txt");
    EXPECT_EQ(error_lines(err), 0) << command << "\n" << err;
    EXPECT_EQ(err.find("terminate"), std::string::npos) << command << "\n" << err;
  };
  const std::string program = shell_word(TANDEM_BINARY_DIR "/bin/tandem") + " ";
  for (const std::string& arguments : {std::string("check hold.toml"), "check --bus " + kSquat,
                                       "check --json - " + kSquat, std::string("--help")}) {
    for (const std::string pipe : {"| true", "| head -n 1 >out.txt"}) {
      for (const std::string shell : {"", "trap '' PIPE; "}) {
        const std::string command = "cd " + shell_word(folder_.string()) + " && (" + shell +
                                    program + arguments + " 2>err.txt " + pipe + ")";
        EXPECT_EQ(std::system(command.c_str()), 0) << command;
        expect_quiet(command);
      }
    }
  }
}

}  // namespace
}  // namespace tandem::apps
