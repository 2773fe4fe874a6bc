// `tandem shrink` and `tandem search`, on the pendulum.
#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

constexpr char kFive[] = R"(# Five bumps; one is too hard.
robot = "robot.toml"
posture = "ready"
duration_s = 0.6

[[controller]]
plugin = "hold"

[[push]]
name = "first"
link = "link2"
at_s = 0.9
force_N = [1.0, 0.0, 0.0]
for_s = 0.05

[[push]]
name = "second"
link = "link1"
at_s = 0.95
force_N = [0.0, 0.0, 2.0]
for_s = 0.05

# The hard one.
[[push]]
name = "third"
link = "link2"
at_s = 1.013
impulse_Ns = [0.1, 1.0, 0.3]
shape = "half_sine"
for_s = 0.1

[[push]]
name = "fourth"
link = "link2"
at_s = 1.2
force_N = [-1.0, 0.0, 0.0]
for_s = 0.05

[[push]]
name = "fifth"
link = "link1"
at_s = 1.25
force_N = [0.0, 0.0, -1.0]
for_s = 0.05

[[expect]]
name = "in place"
always = "abs(position(joint1) - reference(joint1)) < 0.05rad"
)";

class Shrink : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    std::filesystem::create_directories(folder_ / "found");
    write_text(folder_ / "five.toml", kFive);
  }
  /// Fails always, without a margin.
  void write_settle() const {
    write_text(folder_ / "settle.toml", kFive);
    edit("settle.toml", "[[expect]]\n",
         "[[expect]]\nname = \"it moves\"\nsettles = \"position(joint1)\"\nabove = \"9rad\"\n"
         "in_s = 5\n[[expect]]\n");
  }
};

TEST_F(Shrink, OneOfFivePushesIsLeftAndItsCommandRepeatsIt) {
  const Outcome outcome = tandem("shrink five.toml -o found/small.toml --json small.json -j 2");
  EXPECT_EQ(outcome.status, 0) << outcome.out << outcome.err;
  const auto result = json("small.json");
  EXPECT_EQ(result["events_before"], 5);
  EXPECT_EQ(result["events"], 1);
  EXPECT_EQ(result["expectation"]["name"], "in place");
  EXPECT_LT(result["expectation"]["margin"], 0.0);
  const std::string small = read_text(folder_ / "found/small.toml");
  EXPECT_TRUE(
      small.starts_with("# Shrunk by `tandem shrink` from ../five.toml: 1 of 5 events is left."))
      << small;
  EXPECT_NE(small.find("robot = \"../robot.toml\""), std::string::npos) << small;
  EXPECT_NE(small.find(R"(# The hard one.
[[push]]
name = "third"
link = "link2"
at_s = 1
impulse_Ns = [0, 0.)"),
            std::string::npos)
      << small;
  EXPECT_EQ(small.find("first"), std::string::npos) << small;
  // What it prints fails, by the same margin to the last bit.
  const std::string command = result["command"];
  EXPECT_NE(outcome.out.find("repeat it: " + command), std::string::npos) << outcome.out;
  EXPECT_EQ(tandem(command.substr(7) + " --json once.json").status, 1);
  EXPECT_EQ(json("once.json")["expectations"][0]["margin"], result["expectation"]["margin"]);
  // However many run at once.
  EXPECT_EQ(tandem("shrink five.toml -o found/alone.toml -j 1 -q").status, 0);
  EXPECT_EQ(read_text(folder_ / "found/alone.toml").substr(300), small.substr(300));
}

TEST_F(Shrink, RefusesWhatDoesNotFailOrHasNothingToLeaveOut) {
  const auto refused = [this](const std::string& arguments, const std::string& why) {
    const Outcome outcome = tandem("shrink " + arguments);
    EXPECT_EQ(outcome.status, 2) << arguments;
    EXPECT_NE(outcome.err.find(why), std::string::npos) << arguments << ": " << outcome.err;
    EXPECT_FALSE(std::filesystem::exists(folder_ / "small.toml")) << arguments;
  };
  write_text(folder_ / "soft.toml", kFive);
  edit("soft.toml", "[0.1, 1.0, 0.3]", "[0.1, 0.2, 0.3]");
  refused("soft.toml -o small.toml", "it passes all of its 1 expectation");
  refused("hold.toml -o small.toml", "nothing happens in it");
  refused("five.toml -o ./five.toml", "would be overwritten");
  refused("five.toml -o small.toml --expect 'in plac'", "did you mean 'in place'");
  write_text(folder_ / "mine.toml", "# Written by hand.\n");
  refused("five.toml -o mine.toml", "mine.toml");
  EXPECT_EQ(read_text(folder_ / "mine.toml"), "# Written by hand.\n");
}

constexpr char kStudy[] = R"(experiment = "five.toml"
[sample]
method = "random"
points = 4
[[vary]]
key = "push[2].impulse_Ns[1]"
uniform = [0.1, 0.8]
[[vary]]
key = "push[2].at_s"
uniform = [0.95, 1.1]
)";

TEST_F(Shrink, ASearchFindsTheHardestPushWhateverRunsAtOnce) {
  write_text(folder_ / "study.toml", kStudy);
  const Outcome outcome = tandem(
      "search study.toml --expect 'in place' --runs 18 -o found/worst.toml --json w.json -j 2");
  EXPECT_EQ(outcome.status, 1) << outcome.out << outcome.err;
  const auto worst = json("w.json");
  EXPECT_EQ(worst["runs"], 18);
  EXPECT_EQ(worst["expectation"]["name"], "in place");
  EXPECT_LT(worst["expectation"]["margin"], -0.07);
  const std::string command = worst["command"];
  EXPECT_EQ(tandem(command.substr(7) + " --json once.json").status, 1);
  EXPECT_EQ(json("once.json")["expectations"][0]["margin"], worst["expectation"]["margin"]);
  EXPECT_TRUE(
      read_text(folder_ / "found/worst.toml")
          .starts_with("# Found by `tandem search` with ../study.toml: the worst of 18 runs."));

  EXPECT_EQ(tandem("search study.toml --expect 'in place' --runs 18 --json alone.json -j 1").status,
            1);
  auto alone = json("alone.json");
  for (const char* same : {"expectation", "settings", "progress", "failed"})
    EXPECT_EQ(alone[same], worst[same]) << same;
}

// The runs have a beginning in common, which is simulated once; or each begins at its beginning.
TEST_F(Shrink, ASearchComesToTheSameBytesByBranches) {
  write_text(folder_ / "study.toml", kStudy);
  write_text(folder_ / "map.toml", R"(experiment = "five.toml"
[[vary]]
key = "push.third.impulse_Ns"
values = [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]
)");
  const std::string limit =
      "search map.toml --limit push.third.impulse_Ns --up-to 1 --halvings 3 -q ";
  EXPECT_EQ(tandem("search study.toml --runs 12 -q -j 1 --no-branches --json whole.json").status,
            1);
  EXPECT_EQ(tandem(limit + "-j 2 --no-branches -o whole.csv --json wholes.json").status, 0);
  const auto whole = json("whole.json");
  EXPECT_EQ(whole["branched"], 0);
  EXPECT_EQ(whole["trunks"], 0);
  for (const char* const jobs : {"1", "2"}) {
    const std::string j = std::string("-j ") + jobs;
    EXPECT_EQ(tandem("search study.toml --runs 12 -q --json branched.json " + j).status, 1);
    const auto branched = json("branched.json");
    EXPECT_EQ(branched["branched"], 12);
    EXPECT_EQ(branched["trunks"], 1);
    for (const char* same : {"expectation", "settings", "progress", "failed", "runs"})
      EXPECT_EQ(branched[same], whole[same]) << same << " " << j;
    EXPECT_EQ(tandem(limit + "-o branched.csv --json branches.json " + j).status, 0);
    EXPECT_EQ(read_text(folder_ / "branched.csv"), read_text(folder_ / "whole.csv")) << j;
    EXPECT_EQ(json("branches.json")["branched"], json("wholes.json")["runs"]);
  }
}

TEST_F(Shrink, ShrinksToTheSameByBranches) {
  const std::string shrink = "shrink five.toml -q -j 1 ";
  EXPECT_EQ(tandem(shrink + "-o whole.toml --json whole.json --no-branches").status, 0);
  EXPECT_EQ(tandem(shrink + "-o branched.toml --json branched.json").status, 0);
  const auto after_words = [&](const char* file) {
    const std::string text = read_text(folder_ / file);
    return text.substr(text.find("\n\n"));
  };
  EXPECT_EQ(after_words("branched.toml"), after_words("whole.toml"));
  EXPECT_EQ(json("branched.json")["expectation"], json("whole.json")["expectation"]);
  EXPECT_EQ(json("branched.json")["runs"], json("whole.json")["runs"]);
  EXPECT_EQ(json("whole.json")["branched"], 0);
  EXPECT_GT(json("branched.json")["branched"], 10);
}

TEST_F(Shrink, DrawsLimitsByDirection) {
  write_text(folder_ / "map.toml", R"(experiment = "five.toml"
[[vary]]
key = "push[2].impulse_Ns"
values = [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]
[[vary]]
key = "push[2].at_s"
values = [1.0, 1.1]
)");
  const std::string limit = "search map.toml --limit 'push[2].impulse_Ns' --up-to 1 --halvings 1 ";
  const Outcome drawn = tandem(limit + "--svg map.svg");
  EXPECT_EQ(drawn.status, 0) << drawn.err;
  const std::string svg = read_text(folder_ / "map.svg");
  EXPECT_TRUE(svg.starts_with("<svg ")) << svg;
  for (const char* text :
       {"push[2].at_s = 1<", "push[2].at_s = 1.1", "push[2].impulse_Ns by direction", "Ns/kg",
        "none failed", "double_pendulum"})
    EXPECT_NE(svg.find(text), std::string::npos) << text << "\n" << svg;
  edit("map.toml", "[[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]", "[1.0]");
  edit("map.toml", "push[2].impulse_Ns", "push[2].for_s");
  const Outcome none = tandem("search map.toml --limit 'push[2].for_s' --up-to 1 --svg map.svg");
  EXPECT_EQ(none.status, 2);
  EXPECT_NE(none.err.find("is no direction"), std::string::npos) << none.err;
}

TEST_F(Shrink, ASearchCountsFailuresWithoutAMarginAsTheWorstAndRefusedPointsApart) {
  write_settle();
  write_text(folder_ / "study.toml", R"(experiment = "settle.toml"
[[vary]]
key = "push[2].for_s"
values = [-1, 0.1]
)");
  const Outcome outcome =
      tandem("search study.toml --method phase --expect 'it moves' --runs 2 --json w.json");
  EXPECT_EQ(outcome.status, 1) << outcome.out << outcome.err;
  const auto worst = json("w.json");
  EXPECT_EQ(worst["expectation"]["reason"], "it was outside at the end of its window");
  EXPECT_TRUE(worst["expectation"]["margin"].is_null());
  EXPECT_EQ(worst["settings"][0], "push[2].for_s=0.1");
  EXPECT_EQ(worst["refused"], 1);
  EXPECT_EQ(worst["failed"], 1);
  EXPECT_NE(outcome.out.find("without a margin: nothing counts as worse"), std::string::npos)
      << outcome.out;
  EXPECT_NE(outcome.out.find("1 of them; the first: "), std::string::npos) << outcome.out;

  edit("study.toml", "[-1, 0.1]", "[-1]");
  const Outcome none = tandem("search study.toml --runs 1");
  EXPECT_EQ(none.status, 2);
  EXPECT_NE(none.err.find("no point of the study can be run: "), std::string::npos) << none.err;
}

TEST_F(Shrink, ALimitLiesBetweenWhatPassedAndWhatFailed) {
  write_text(folder_ / "map.toml", R"(experiment = "five.toml"
[[vary]]
key = "push[2].impulse_Ns"
values = [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]
)");
  const Outcome outcome = tandem(
      "search map.toml --limit 'push[2].impulse_Ns' --up-to 1 --halvings 3 -o map.csv --json "
      "m.json");
  EXPECT_EQ(outcome.status, 0) << outcome.out << outcome.err;
  // Across the axis of the joint 0.6 Ns pass and 0.65 fail; along it nothing moves.
  EXPECT_EQ(read_text(folder_ / "map.csv"),
            "push[2].impulse_Ns,passes_at,fails_at\n"
            "\"[0, 1, 0]\",0.5,0.625\n"
            "\"[1, 0, 0]\",1,\n");
  EXPECT_EQ(json("m.json")["runs"], 5);
}

TEST_F(Shrink, ALimitOfWhatFailsAlreadyAtZeroSaysSo) {
  write_settle();
  write_text(folder_ / "map.toml", R"(experiment = "settle.toml"
[[vary]]
key = "push[2].impulse_Ns"
values = [[0.0, 1.0, 0.0]]
)");
  const std::string limit = "search map.toml --limit 'push[2].impulse_Ns' --up-to 1 --halvings 0 ";
  const Outcome outcome = tandem(limit + "--expect 'it moves' -o map.csv --json m.json");
  EXPECT_EQ(outcome.status, 0) << outcome.out << outcome.err;
  const auto point = json("m.json")["points"][0];
  EXPECT_TRUE(point["passed"].is_null());
  EXPECT_EQ(point["failed"], 0.0);
  const std::string reason =
      "fails already at 0: it moves failed, it was outside at the end of its window";
  EXPECT_EQ(point["reason"], reason);
  EXPECT_NE(outcome.out.find(reason), std::string::npos) << outcome.out;
  EXPECT_EQ(read_text(folder_ / "map.csv"),
            "push[2].impulse_Ns,passes_at,fails_at\n\"[0, 1, 0]\",,0\n");
  EXPECT_NE(tandem(limit + "--expect 'it move'").err.find("did you mean 'it moves'"),
            std::string::npos);
}

TEST_F(Shrink, ASearchRefusesWhatHasNoWorst) {
  write_text(folder_ / "study.toml", kStudy);
  const auto refused = [this](const std::string& arguments, const std::string& why) {
    const Outcome outcome = tandem("search " + arguments);
    EXPECT_EQ(outcome.status, 2) << arguments;
    EXPECT_NE(outcome.err.find(why), std::string::npos) << arguments << ": " << outcome.err;
  };
  refused("study.toml --runs 2 --expect 'in plac'", "did you mean 'in place'");
  refused("study.toml --method phase", "say --along KEY");
  refused("study.toml --method phase --along at_s", "no [[vary]] has the key 'at_s'");
  refused("study.toml --limit at_s --up-to 2", "limits are of a grid's points");
  refused("study.toml --along 'push[2].at_s'", "--along is of --method phase, and this is cma_es");
  refused("five.toml", "is an experiment, and no study");
  write_text(folder_ / "map.toml",
             "experiment = \"five.toml\"\n[[vary]]\nkey = \"push[2].at_s\"\nvalues = [1]\n");
  refused("map.toml --limit 'push[2].impulse_Ns' --up-to 2",
          "no [[vary]] of it has the key 'push[2].impulse_Ns'");
  refused("map.toml --limit 'push[2].at_s' --up-to -3", "'-3' is no factor from 1e-9 to 1e9");
  refused("map.toml --limit 'push[2].at_s' --up-to 2 --along x", "excludes");
  EXPECT_NE(tandem("shrink study.toml").err.find("is a study"), std::string::npos);
  EXPECT_NE(tandem("run study.toml").err.find("is a study, and no experiment"), std::string::npos);
  edit("map.toml", "push[2].at_s", "robot.joint.joint1.max_velocity_rad_s");
  refused("map.toml -o worst.toml",
          "'robot.joint.joint1.max_velocity_rad_s' is of the robot's file: no scenario has it");
  write_text(folder_ / "study.toml", "experiment = \"five.toml\"\n");
  refused("study.toml", "add a [[vary]]");
  write_text(folder_ / "worst.toml", "# Mine.\n");
  refused("study.toml -o worst.toml", "it is no scenario that was found before");
}

}  // namespace
}  // namespace tandem::apps
