// Points of a study, and what their results say, without a run.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "sweep/pictures.hpp"
#include "sweep/statistics.hpp"
#include "sweep/study.hpp"
#include "sweep/summary.hpp"
#include "tests/apps/program.hpp"

namespace tandem::sweep {
namespace {

const Method& method(std::string_view name) {
  return *std::ranges::find(methods(), name, &Method::name);
}

TEST(Sampling, SobolAndLatinHypercubeFillEveryRangeEvenly) {
  for (const auto& [name, keys] : {std::pair{"sobol", 21}, std::pair{"latin_hypercube", 5}}) {
    constexpr std::size_t kPoints = 64;
    const auto n = static_cast<std::size_t>(keys);
    const auto all = method(name).spread(kPoints, n, 7);
    for (std::size_t k = 0; k < n; ++k) {
      std::set<int> parts;
      for (std::size_t p = 0; p < kPoints; ++p)
        parts.insert(static_cast<int>(all[p * n + k] * kPoints));
      EXPECT_EQ(parts.size(), kPoints) << name << " key " << k;
    }
  }
}

TEST(Sampling, SobolFillsThePlaneEvenly) {
  const auto all = method("sobol").spread(64, 2, 1);
  std::set<int> cells;
  for (std::size_t p = 0; p < 64; ++p)
    cells.insert(static_cast<int>(all[2 * p] * 8) * 8 + static_cast<int>(all[2 * p + 1] * 8));
  EXPECT_EQ(cells.size(), 64U);
}

TEST(Sampling, DistributionsHaveTheirQuantiles) {
  const auto at = [](std::string_view name, double u, double a, double b) {
    return std::ranges::find(distributions(), name, &Distribution::name)->at(u, a, b);
  };
  EXPECT_DOUBLE_EQ(at("uniform", 0.25, -1.0, 3.0), 0.0);
  EXPECT_DOUBLE_EQ(at("log_uniform", 0.5, 1.0, 100.0), 10.0);
  EXPECT_NEAR(at("normal", 0.975, 0.0, 1.0), 1.959963984540054, 1e-12);
  EXPECT_NEAR(at("normal", 0.001, 5.0, 2.0), 5.0 - 2.0 * 3.090232306167813, 1e-11);
}

TEST(Statistics, AreThoseOfTheTables) {
  EXPECT_NEAR(wilson(8, 10).low, 0.4901625, 1e-6);
  EXPECT_NEAR(wilson(8, 10).high, 0.9433178, 1e-6);
  EXPECT_EQ(wilson(0, 10).low, 0.0);
  EXPECT_NEAR(wilson(0, 10).high, 0.2775328, 1e-6);
  EXPECT_EQ(wilson(0, 0).high, 1.0);
  EXPECT_NEAR(mcnemar(1, 9), 2.0 * 11.0 / 1024.0, 1e-12);
  EXPECT_EQ(mcnemar(0, 0), 1.0);
  EXPECT_EQ(mcnemar(5, 5), 1.0);
  EXPECT_NEAR(*rank_correlation(std::vector{1.0, 2.0, 3.0, 4.0}, std::vector{1.0, 4.0, 9.0, 16.0}),
              1.0, 1e-12);
  EXPECT_NEAR(*rank_correlation(std::vector{1.0, 1.0, 2.0}, std::vector{3.0, 2.0, 1.0}),
              -std::sqrt(0.75), 1e-12);
  EXPECT_FALSE(rank_correlation(std::vector{1.0, 1.0, 1.0}, std::vector{1.0, 2.0, 3.0}));
}

class StudyFile : public apps::Program {
 protected:
  std::expected<Study, Diagnostics> read(const std::string& rows) const {
    apps::write_text(folder_ / "study.toml", "experiment = \"hold.toml\"\n" + rows);
    return read_study((folder_ / "study.toml").string());
  }
  std::string first_error(const std::string& rows) const {
    const auto study = read(rows);
    if (study) return "none";
    Error error = study.error().front();
    error.file = "study.toml";
    return error.to_string();
  }
};

TEST_F(StudyFile, MakesPointsInOrderThatAreNamedByWhatTheySet) {
  const auto study = read(
      "seeds = 2\n[[vary]]\nkey = \"a\"\nfrom = 0.0\nto = 1.0\nsteps = 3\n"
      "[[vary]]\nkey = \"b\"\nvalues = [\"x\", \"y\"]\n"
      "[[variant]]\nname = \"old\"\n[[variant]]\nname = \"new\"\nset = [\"c=1\"]\n");
  ASSERT_TRUE(study) << study.error().front().to_string();
  const Points points(*study);
  ASSERT_EQ(points.size(), 24U);
  EXPECT_EQ(points.at(0).command("e.toml"),
            "tandem run e.toml --hal sim --set a=0 --set 'b=\"x\"' --seed 1");
  EXPECT_EQ(points.at(23).command("e.toml"),
            "tandem run e.toml --hal sim --set c=1 --set a=1 --set 'b=\"y\"' --seed 2");
  EXPECT_EQ(points.at(8).values, (std::vector<std::string>{"0.5", "\"x\""}));
  std::set<std::string> names;
  for (std::uint64_t i = 0; i < points.size(); ++i) names.insert(points.at(i).name);
  EXPECT_EQ(names.size(), 24U);
  EXPECT_EQ(points.at(0).name, "9654e740745968e0");
}

TEST_F(StudyFile, RefusesTwoRowsThatSetTheSamePlace) {
  const auto text = apps::read_text(folder_ / "hold.toml");
  apps::write_text(folder_ / "hold.toml",
                   text + "\n[[push]]\nname = \"knock\"\nimpulse_Ns = [0.0, 1.0, 0.0]\n");
  const auto vary = [](const std::string& key) {
    return "[[vary]]\nkey = \"" + key + "\"\nvalues = [1, 2]\n";
  };
  EXPECT_EQ(first_error(vary("push.knock.impulse_Ns[1]") +
                        "[[variant]]\nname = \"b\"\nset = [\"push[0].impulse_Ns[1]=3\"]\n"),
            "study.toml:3: vary.push.knock.impulse_Ns[1].key: varies push[0].impulse_Ns[1], which "
            "'push[0].impulse_Ns[1]' in `set` of [[variant]] 'b' sets too (leave one of the two "
            "out)");
  EXPECT_EQ(first_error("set = [\"duration_s=2\"]\n" + vary("duration_s")),
            "study.toml:4: vary.duration_s.key: varies duration_s, which 'duration_s' in `set` of "
            "the study sets too (leave one of the two out)");
  EXPECT_EQ(first_error(vary("push[0].impulse_Ns[1]") + vary("push.knock.impulse_Ns")),
            "study.toml:6: vary.push.knock.impulse_Ns.key: varies push[0].impulse_Ns, which "
            "[[vary]] 'push[0].impulse_Ns[1]' of line 3 sets too (leave one of the two out)");
  EXPECT_EQ(first_error("set = [\"push[0].impulse_Ns=[1.0,2.0,3.0]\"]\n" +
                        vary("push.knock.impulse_Ns[1]")),
            "none");
  EXPECT_EQ(first_error(vary("seed")),
            "study.toml:3: vary.seed.key: seeds are no [[vary]] (give `seeds = [1, 2]`)");
}

PointResult point_of(std::optional<double> margin, bool passed, const std::string& reason = {}) {
  return {.passed = passed,
          .ended = "as planned",
          .reason = {},
          .expectations = {
              {.name = "slips", .passed = passed, .margin = margin, .unit = {}, .reason = reason}}};
}

PointResult refused_point() {
  PointResult result;
  result.ended = "refused";
  result.reason = "too long";
  return result;
}

TEST_F(StudyFile, FailuresWithoutAMarginCountAsTheLeastAndAreOneRowOfTheirValues) {
  const auto study = read("seeds = 2\n[[vary]]\nkey = \"duration_s\"\nvalues = [1, 2, 3, 4]\n");
  ASSERT_TRUE(study);
  const Points points(*study);
  const std::vector<std::optional<PointResult>> results{point_of(0.5, true),
                                                        point_of(0.6, true),
                                                        point_of(-0.1, false, "far"),
                                                        point_of(0.1, true),
                                                        point_of({}, false, "fell"),
                                                        point_of({}, false, "fell"),
                                                        refused_point(),
                                                        refused_point()};
  const SweepSummary summary = summary_of(*study, points, results);
  EXPECT_EQ(summary.rate.passed, 3U);
  EXPECT_EQ(summary.rate.all, 6U);
  EXPECT_EQ(summary.rate.refused, 2U);
  EXPECT_EQ(summary.refused_why, "too long");
  EXPECT_FALSE(summary.seeds_alike);
  ASSERT_EQ(summary.worst.size(), 3U);
  EXPECT_EQ(summary.worst[0].why, "slips: fell");
  EXPECT_EQ(summary.worst[0].more_text(*study), " and 1 more seed");
  EXPECT_EQ(summary.worst[1].why, "slips: far");
  EXPECT_EQ(summary.worst[1].more, 0U);
  EXPECT_EQ(summary.worst[2].why, "slips: margin 0.5");
  ASSERT_EQ(summary.ranking.size(), 1U);
  EXPECT_EQ(summary.ranking[0].points, 6U);
  EXPECT_EQ(summary.ranking[0].without_margin, 2U);
  EXPECT_NEAR(summary.ranking[0].rank_correlation, -0.9701425, 1e-6);
  EXPECT_EQ(kept_points({.logs_MB = 1.0, .sample = 1}, results),
            (std::vector<std::uint64_t>{0, 4, 5, 2}));
}

TEST_F(StudyFile, SeedsThatChangeNothingCountOnce) {
  const auto study = read("seeds = 3\n[[vary]]\nkey = \"duration_s\"\nvalues = [1, 2]\n");
  ASSERT_TRUE(study);
  const Points points(*study);
  std::vector<std::optional<PointResult>> results(3, point_of(0.5, true));
  results.resize(6, point_of(-0.5, false));
  SweepSummary summary = summary_of(*study, points, results);
  EXPECT_TRUE(summary.seeds_alike);
  EXPECT_EQ(summary.rate.all, 2U);
  EXPECT_EQ(summary.rate.passed, 1U);
  EXPECT_EQ(summary.done, 6U);
  results[5]->expectations[0].margin = std::nextafter(-0.5, 0.0);
  summary = summary_of(*study, points, results);
  EXPECT_FALSE(summary.seeds_alike);
  EXPECT_EQ(summary.rate.all, 6U);
}

TEST(Pictures, EndsOfAnAxisHaveTheDigitsThatTellThemApart) {
  EXPECT_EQ(ends_in_words(0.2995, 0.3001),
            (std::pair<std::string, std::string>("0.2995", "0.3001")));
  EXPECT_EQ(ends_in_words(-2.0, 10.25), (std::pair<std::string, std::string>("-2", "10.2")));
}

TEST(Pictures, FailuresWithoutAMarginHaveALaneAndLabelsHaveRoom) {
  const std::vector<MarginOfPoint> points{
      {.index = 0, .margin = -0.00012345, .failed = true},
      {.index = 1, .margin = -0.00012301, .failed = true},
      {.index = 2, .margin = -std::numeric_limits<double>::infinity(), .failed = true}};
  const NamedMargin margin{.name = "slips", .unit = "m"};
  EXPECT_NE(histogram(points, margin).find(">no margin</text>"), std::string::npos);
  Vary vary;
  vary.key = "posture";
  vary.values = {"\"stand\"", "\"squat\"", "\"bow\""};
  const std::string svg = scatter(points, {0.0, 1.0, 2.0}, margin, vary);
  EXPECT_NE(svg.find(">no margin</text>"), std::string::npos);
  EXPECT_NE(svg.find(">squat</text>"), std::string::npos);
  // 11 letters of 6.3 before 72.3: all of them are right of 0.
  EXPECT_NE(svg.find("<text x=\"72.3\" y=\"14.0\" text-anchor=\"end\">-0.00012301</text>"),
            std::string::npos)
      << svg;
}

TEST_F(StudyFile, SaysWhatIsWrong) {
  EXPECT_EQ(first_error("[[vary]]\nkey = \"a\"\nuniform = [1, 2]\n"),
            "study.toml:4: vary.a.uniform: a grid has no distributions (give `values`, or `from`, "
            "`to` and `steps`; or another [sample] method)");
  EXPECT_EQ(
      first_error("[sample]\nmethod = \"sobl\"\npoints = 4\n"),
      "study.toml:3: sample.method: 'sobl' is not one of the choices (did you mean 'sobol'?)");
  EXPECT_EQ(
      first_error("[[vary]]\nkey = \"a\"\nvalue = [1]\n"),
      "study.toml:2: vary.a: says no values (give one of: values; from, to and steps; uniform; "
      "log_uniform; normal)");
  const std::string many = "\nfrom = 0.0\nto = 1.0\nsteps = 1000\n";
  EXPECT_EQ(first_error("[[vary]]\nkey = \"a\"" + many + "[[vary]]\nkey = \"b\"" + many +
                        "[[vary]]\nkey = \"c\"" + many),
            "study.toml:1: the study has 1000000000 points, 10000000 at most (give fewer values or "
            "seeds, or [sample] method = \"sobol\" with `points`)");
}

}  // namespace
}  // namespace tandem::sweep
