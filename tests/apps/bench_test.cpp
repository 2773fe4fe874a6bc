// `tandem bench engines`: what it measures of Tandem's own engine, its page, and what it refuses.
#include <map>

#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

class Bench : public Program {
 protected:
  [[nodiscard]] std::string cache() const {
    return "XDG_CACHE_HOME=" + shell_word(folder_.string() + "/cache");
  }
};

TEST_F(Bench, EnginesConvergeWithTheOrderOfTheirIntegrator) {
  const Outcome outcome =
      tandem("bench engines --engines tandem --scenes box -o out --json box.json", cache());
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  std::map<std::string, std::map<double, double>> error;
  const nlohmann::json measured = json("box.json");
  for (const nlohmann::json& row : measured["results"])
    error[row["engine"]][row["step_ms"]] = row["error_rad"];
  ASSERT_EQ(error.size(), 2U);
  EXPECT_NEAR(error["tandem"][4.0] / error["tandem"][2.0], 4.0, 0.4);
  EXPECT_NEAR(error["tandem rk4"][4.0] / error["tandem rk4"][2.0], 16.0, 2.0);
  EXPECT_LT(error["tandem rk4"][1.0], 1e-9);
  for (const nlohmann::json& row : measured["results"])
    EXPECT_LT(row["base_error_mm"], 1e-4) << "a free box flies straight: " << row;
  const std::string page = read_text(folder_ / "out/engines.md");
  EXPECT_NE(page.find("| tandem rk4 | this build | Runge-Kutta, order 4 |"), std::string::npos);
  EXPECT_NE(page.find("** needs least"), std::string::npos) << page;
  EXPECT_NE(page.find("; most accurate in the shortest steps: **tandem rk4**, "), std::string::npos)
      << page;
  EXPECT_EQ(page.find(".md#"), std::string::npos) << "no link to a page that is not beside it";
  EXPECT_NE(page.find("![A box tumbles](engines/box.png)"), std::string::npos);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "out/engines/box.png"));
}

// Where the folder of the bundled experiments is a relative one, every engine's squat was refused.
TEST_F(Bench, SquatsFromWithinTheFolderOfTheExperiments) {
  std::filesystem::create_directory_symlink(TANDEM_SOURCE_DIR "/config", folder_ / "config");
  const Outcome outcome =
      tandem("bench engines --engines tandem --scenes squat -q -o out", cache());
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const std::string page = read_text(folder_ / "out/engines.md");
  EXPECT_NE(page.find("| tandem | 0.0"), std::string::npos) << page;
  EXPECT_NE(page.find("| tandem rk4 | 0.0"), std::string::npos) << page;
}

TEST_F(Bench, RefusesAnEngineThatIsNotThereBeforeItMeasures) {
  const Outcome outcome = tandem("bench engines --engines havok -o out", cache());
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("--engines: there is no engine 'havok' beside"), std::string::npos)
      << outcome.err;
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
}

TEST_F(Bench, RefusesASceneThatThereIsNot) {
  const Outcome outcome = tandem("bench engines --scenes boxes", cache());
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("boxes"), std::string::npos) << outcome.err;
}

TEST_F(Bench, TellsOfASceneWithoutItsFlag) {
  const Outcome outcome = tandem("bench engines box", cache());
  EXPECT_EQ(outcome.status, 2);
  EXPECT_EQ(outcome.err,
            "tandem: 'box' is one argument too many: did you mean --scenes box?\n"
            "Try `tandem bench engines --help`.\n");
}

}  // namespace
}  // namespace tandem::apps
