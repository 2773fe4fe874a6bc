// `tandem run --from LOG@TIME`: what it takes over, what it refuses, and what its log says.
#include <algorithm>

#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

class FromLog : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    const Outcome run = tandem("run hold.toml --log . --duration 0.5 -q --set sim.noise=true");
    ASSERT_EQ(run.status, 0) << run.err;
    log_ = log_but({});
  }
  /// The only log that is not one of these.
  [[nodiscard]] std::string log_but(const std::vector<std::string>& others) const {
    for (const auto& entry : std::filesystem::directory_iterator(folder_)) {
      const std::string name = entry.path().filename().string();
      if (name.ends_with(".mcap") && std::ranges::find(others, name) == others.end()) return name;
    }
    return {};
  }
  [[nodiscard]] Outcome from(const std::string& options) const {
    return tandem("run hold.toml --log . --duration 1 --from " + log_ + "@1.5s " + options);
  }
  void refused(const std::string& options, const std::string& words) const {
    const Outcome outcome = from(options);
    EXPECT_EQ(outcome.status, 2) << outcome.out;
    EXPECT_NE(outcome.err.find(words), std::string::npos) << outcome.err;
  }

  std::string log_;
};

// It said "'robot' is not the same", whatever differed.
TEST_F(FromLog, NamesTheKeyThatDiffersAndBothValues) {
  refused("", "sim.noise is true in that run, and ");
  refused("", "(--set sim.noise=true)");
  refused("--set sim.noise=true --seed 7", "seed is ");
  refused("--set sim.noise=true --set 'controller[0].parameters.duration_s=9.5'",
          "controller[0].parameters.duration_s is ");
  refused("--set sim.noise=true --set robot.joint[0].max_velocity_rad_s=1.25",
          "joint[0].max_velocity_rad_s is ");
  refused("--set sim.noise=true --set robot.name=other", "that run is of double_pendulum");
  edit("hold.toml", "[[controller]]", "[parallel]\n[[controller]]");
  refused("--set sim.noise=true", "parallel is not there in that run, and {} in this one");
}

// It gave a --set of a row that is not there, which makes none.
TEST_F(FromLog, OffersNoSettingOfARowThatIsNotThere) {
  const std::string push = "[[push]]\nlink = \"link2\"\nat_s = 1.2\nforce_N = [1, 0, 0]\n";
  edit("hold.toml", "[[controller]]", push + "[[controller]]");
  const Outcome pushed = tandem("run hold.toml --log . --duration 0.5 -q --set sim.noise=true");
  ASSERT_EQ(pushed.status, 0) << pushed.err;
  log_ = log_but({log_});
  edit("hold.toml", push, "");
  const Outcome outcome = from("--set sim.noise=true");
  EXPECT_EQ(outcome.status, 2) << outcome.out;
  EXPECT_NE(outcome.err.find("push[0]."), std::string::npos) << outcome.err;
  EXPECT_EQ(outcome.err.find("--set"), std::string::npos) << outcome.err;
}

TEST_F(FromLog, TellsWhatItTookOverAndWhoLeads) {
  const Outcome on = from("--set sim.noise=true --json run.json");
  ASSERT_EQ(on.status, 0) << on.err;
  const auto summary = json("run.json");
  EXPECT_EQ(summary["cycles"], 1000);
  EXPECT_LT(summary["simulated_seconds"], 0.75);
  EXPECT_GT(summary["simulated_seconds"], 0.55);
  EXPECT_NE(on.out.find("of the run that it goes on from"), std::string::npos) << on.out;
  const std::string second = log_but({log_});
  const Outcome info = tandem("log info " + second);
  for (const char* words : {"active as it begins", "--set sim.noise=true", "duration_s = 1"})
    EXPECT_NE(info.out.find(words), std::string::npos) << words << "\n" << info.out;
  const Outcome replay = tandem("replay " + second);
  EXPECT_EQ(replay.status, 2);
  EXPECT_NE(replay.err.find("as it goes on from another run"), std::string::npos) << replay.err;
  EXPECT_NE(replay.err.find("replay the log that has it: " + log_), std::string::npos)
      << replay.err;
}

}  // namespace
}  // namespace tandem::apps
