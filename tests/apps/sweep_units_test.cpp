// Points of a study, and what their results say, without a run.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

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
