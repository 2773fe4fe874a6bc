// What `tandem shrink` and `tandem search` are made of, on functions.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "apps/search/cma_es.hpp"
#include "apps/search/point_runs.hpp"
#include "apps/search/scenario_rows.hpp"
#include "apps/search/shrink.hpp"
#include "base/toml_reader.hpp"

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
  const auto ground = ScenarioText::read("[[sim.ground]]\nslope_deg = 3.0\n", "ground.toml");
  ASSERT_TRUE(ground) << ground.error().to_string();
  EXPECT_EQ(ground->rows().size(), 1U);
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

TEST(CmaEs, DoesNotMoveTowardsPointsWithoutAValue) {
  CmaEs blind(Eigen::VectorXd::Constant(2, 0.5), 0.3, 1);
  std::vector<Eigen::VectorXd> points;
  for (int generation = 0; generation < 30; ++generation) {
    points = blind.ask();
    blind.tell(std::vector<double>(points.size(), std::nan("")));
  }
  for (const Eigen::VectorXd& x : points) EXPECT_LT((x.array() - 0.5).abs().maxCoeff(), 0.1);
  // The middle, where it begins, has none; minus infinity is less than any.
  CmaEs search(Eigen::VectorXd::Constant(2, 0.5), 0.3, 1);
  double nearest = 1.0;
  for (int generation = 0; generation < 60; ++generation) {
    points = search.ask();
    std::vector<double> values;
    for (const Eigen::VectorXd& x : points) {
      const double far = (x.array() - 0.2).matrix().norm();
      nearest = std::min(nearest, far);
      values.push_back(x[0] > 0.4   ? std::nan("")
                       : far < 0.01 ? -std::numeric_limits<double>::infinity()
                                    : far);
    }
    search.tell(values);
  }
  EXPECT_LT(nearest, 0.01);
}

TEST(LeastMargin, WhatFailsWithoutOneIsTheWorstAndWhatIsRefusedIsNone) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  ChildRun run{
      .expectations = {{.name = "a", .passed = true, .margin = 2.0, .unit = "m", .reason = {}},
                       {.name = "b", .passed = true, .unit = {}, .reason = {}},
                       {.name = "c", .unit = "s", .reason = "it was outside"}},
      .ended = "completed"};
  EXPECT_EQ(margin_value(*least_margin(run, "a")), 2.0);
  EXPECT_EQ(margin_value(*least_margin(run, "b")), kNone);
  EXPECT_EQ(margin_value(*least_margin(run, "c")), -kNone);
  EXPECT_EQ(least_margin(run, "")->name, "c");
  EXPECT_FALSE(least_margin(run, "d"));
  run.ended = "by a fault";
  EXPECT_EQ(margin_value(*least_margin(run, "a")), 2.0) << "another one failed";
  run.expectations.pop_back();
  run.reason = "it ended by a fault that no expectation awaits";
  EXPECT_EQ(margin_value(*least_margin(run, "a")), -kNone);
  EXPECT_FALSE(least_margin(run, "d"));
  for (const char* ended : {"crashed", "too slow"}) {
    const ChildRun bad{.ended = ended, .reason = "why"};
    EXPECT_EQ(margin_value(*least_margin(bad, "a")), -kNone) << ended;
    EXPECT_EQ(least_margin(bad, "")->reason, "why") << ended;
  }
  EXPECT_FALSE(least_margin({.ended = "refused", .reason = "why"}, "a"));
  EXPECT_FALSE(least_margin({.ended = "crashed", .killed = true}, "a")) << "not by itself";
}

}  // namespace
}  // namespace tandem::apps
