// `tandem shrink` and `tandem search`: what they do, on functions and on the pendulum.
#include "apps/search/cma_es.hpp"
#include "apps/search/scenario_rows.hpp"
#include "apps/search/shrink.hpp"
#include "base/toml_reader.hpp"
#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

/// Events without numbers, "e0" to "e7".
ScenarioRows plain_rows() {
  ScenarioRows rows;
  for (std::size_t i = 0; i < 8; ++i)
    rows.push_back({.place = i, .text = "[[event]]\nname = \"e" + std::to_string(i) + "\"\n"});
  return rows;
}

bool has_place(const ScenarioRows& rows, std::size_t place) {
  return std::ranges::find(rows, place, &ScenarioRow::place) != rows.end();
}

TEST(Shrinking, LeavesThoseTwoEventsThatNeedEachOther) {
  std::size_t asked = 0;
  const auto first_failing =
      [&asked](const std::vector<ScenarioRows>& all) -> std::optional<std::size_t> {
    for (std::size_t i = 0; i < all.size(); ++i) {
      ++asked;
      if (has_place(all[i], 1) && has_place(all[i], 6)) return i;
    }
    return std::nullopt;
  };
  const ScenarioRows left = shrunk(plain_rows(), first_failing);
  ASSERT_EQ(left.size(), 2U);
  EXPECT_EQ(left[0], plain_rows()[1]);
  EXPECT_EQ(left[1], plain_rows()[6]);
  EXPECT_LE(asked, 30U);
}

TEST(Shrinking, NothingIsLeftOfWhatFailsByItself) {
  std::size_t asked = 0;
  const auto always = [&asked](const std::vector<ScenarioRows>& all) -> std::optional<std::size_t> {
    asked += all.size();
    return 0;
  };
  EXPECT_TRUE(shrunk(plain_rows(), always).empty());
  EXPECT_EQ(asked, 1U);
}

TEST(Shrinking, MakesValuesSmallerRounderAndLeavesOutWhatHasADefault) {
  const std::string hard = R"([[push]]
name = "b"   # the one
link = "torso"
at_s = 2.137
impulse_Ns = [-4.0, 0.5, 0.0]
point_m = [0.0, 0.0, 0.1]
shape = "half_sine"
for_s = 0.1
)";
  // As long as it pushes back by 2.9 Ns, and not before 1.5 s.
  const auto first_failing =
      [](const std::vector<ScenarioRows>& all) -> std::optional<std::size_t> {
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (all[i].size() != 1) continue;
      auto row = TomlDocument::parse(all[i][0].text, "row")->root().tables("push")[0];
      if (row.numbers("impulse_Ns", 3)[0] <= -2.9 && row.number("at_s") > 1.5 &&
          row.number("for_s") > 0.0)
        return i;
    }
    return std::nullopt;
  };
  const ScenarioRows left = shrunk({{.place = 0, .text = hard}}, first_failing);
  ASSERT_EQ(left.size(), 1U);
  EXPECT_EQ(left[0].text, R"([[push]]
name = "b"   # the one
link = "torso"
at_s = 2
impulse_Ns = [-3, 0, 0]
for_s = 0.1
)");
}

constexpr char kLayout[] = R"(# A bump.
robot = "robot.toml"
names = [
  "[[push]]",  # no header
]

# The first.
[[push]]
at_s = 1.0

[controller]
text = """
[[push]]
"""

[[event]]
at_s = 2.0
[event.ask]
do = "run.stop"
# The end.
)";

TEST(ScenarioText, IsTheSameWithAllOfItsRowsAndKeepsTheRestWithout) {
  const auto scenario = ScenarioText::read(kLayout, "layout.toml");
  ASSERT_TRUE(scenario) << scenario.error().to_string();
  ASSERT_EQ(scenario->rows().size(), 2U);
  EXPECT_EQ(scenario->rows()[0].text, "# The first.\n[[push]]\nat_s = 1.0\n\n");
  EXPECT_EQ(scenario->with(scenario->rows()), kLayout);
  EXPECT_EQ(scenario->with({}), R"(# A bump.
robot = "robot.toml"
names = [
  "[[push]]",  # no header
]

[controller]
text = """
[[push]]
"""

)");
  const auto inline_rows = ScenarioText::read("push = [{ at_s = 1.0 }]\n", "inline.toml");
  ASSERT_FALSE(inline_rows);
  EXPECT_EQ(inline_rows.error().hint, "write each as [[push]] with its keys below");
}

/// Evaluations until `function`, whose least value is 0 within the unit cube, is below 1e-10.
std::size_t evaluations(std::size_t n, double (*function)(const Eigen::VectorXd&)) {
  CmaEs search(Eigen::VectorXd::Constant(static_cast<Eigen::Index>(n), 0.5), 0.3, 1);
  for (std::size_t count = 0; count < 20'000;) {
    std::vector<double> values;
    for (const Eigen::VectorXd& x : search.ask()) {
      values.push_back(function(x));
      ++count;
      if (values.back() < 1e-10) return count;
    }
    search.tell(values);
  }
  return 20'000;
}

double sphere(const Eigen::VectorXd& x) { return (x.array() - 0.3).square().sum(); }
/// Axes that differ by a factor of 1000.
double ellipsoid(const Eigen::VectorXd& x) {
  double sum = 0.0;
  const auto last = static_cast<double>(x.size() - 1);
  for (Eigen::Index i = 0; i < x.size(); ++i)
    sum += std::pow(1e6, static_cast<double>(i) / last) * (x[i] - 0.3) * (x[i] - 0.3);
  return sum;
}
/// A bent valley, from -2 to 2.
double rosenbrock(const Eigen::VectorXd& x) {
  const Eigen::ArrayXd y = 4.0 * x.array() - 2.0;
  double sum = 0.0;
  for (Eigen::Index i = 0; i + 1 < y.size(); ++i)
    sum += 100.0 * std::pow(y[i + 1] - y[i] * y[i], 2) + std::pow(1.0 - y[i], 2);
  return sum;
}
/// Least in a corner of the cube.
double corner(const Eigen::VectorXd& x) { return x.squaredNorm(); }

TEST(CmaEs, FindsTheLeastValueInAsManyEvaluationsAsTheLiteratureHas) {
  EXPECT_LT(evaluations(10, sphere), 1'800U);
  EXPECT_LT(evaluations(10, ellipsoid), 4'800U);
  EXPECT_LT(evaluations(10, rosenbrock), 6'500U);
  EXPECT_LT(evaluations(10, corner), 1'900U);
  EXPECT_LT(evaluations(1, sphere), 150U);
}

TEST(CmaEs, HasTheSamePointsForTheSameSeedAndAllWithinTheCube) {
  for (const std::uint64_t seed : {1U, 2U}) {
    CmaEs one(Eigen::VectorXd::Constant(2, 0.1), 0.8, seed), two = one;
    for (int generation = 0; generation < 20; ++generation) {
      const auto points = one.ask();
      EXPECT_EQ(points, two.ask());
      std::vector<double> values;
      for (const Eigen::VectorXd& x : points) {
        EXPECT_GE(x.minCoeff(), 0.0);
        EXPECT_LE(x.maxCoeff(), 1.0);
        values.push_back(values.empty() ? std::nan("") : sphere(x));
      }
      one.tell(values);
      two.tell(values);
    }
  }
}

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
  write_text(folder_ / "study.toml", "experiment = \"five.toml\"\n");
  refused("study.toml", "add a [[vary]]");
}

}  // namespace
}  // namespace tandem::apps
