// `tandem model`: libraries that are built once, and their figures.
#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

class Model : public Program {};

TEST_F(Model, BuildsALibraryAndLeavesItAloneTheSecondTime) {
  ASSERT_EQ(tandem("model build robot.toml -o kernels.so").status, 0);
  ASSERT_TRUE(std::filesystem::exists(folder_ / "kernels.so"));
  const auto built = std::filesystem::last_write_time(folder_ / "kernels.so");
  const Outcome again = tandem("model build robot.toml -o kernels.so");
  EXPECT_EQ(again.status, 0);
  EXPECT_NE(again.out.find("up to date"), std::string::npos) << again.out;
  EXPECT_EQ(std::filesystem::last_write_time(folder_ / "kernels.so"), built);
}

TEST_F(Model, AUsersOwnRobotRunsFromTheCacheFolder) {
  edit("robot.toml", "inertia_kg_m2 = 0.002", "inertia_kg_m2 = 0.003");
  const std::string cache = "XDG_CACHE_HOME='" + folder_.string() + "/cache'";
  ASSERT_EQ(tandem("model build robot.toml", cache).status, 0);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "cache/tandem/models"));
  const Outcome run = tandem("run hold.toml --duration 0.05 --no-log", cache);
  EXPECT_EQ(run.status, 0) << run.err;
}

TEST_F(Model, InfoCountsOperationsAndMachineCode) {
  const Outcome outcome = tandem("model info robot.toml --json -");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json["robot"], "double_pendulum");
  EXPECT_EQ(json["joints"], 2);
  EXPECT_EQ(json["nv"], 2);
  EXPECT_GT(json["mass_kg"], 0.0);
  for (const std::string kernel : {"forward_dynamics", "inverse_dynamics", "mass_matrix"}) {
    const auto& k = json["kernels"][kernel];
    EXPECT_GT(k["add"], 0) << kernel;
    EXPECT_GT(k["mul"], 0) << kernel;
    EXPECT_TRUE(k.contains("div") && k.contains("sqrt") && k.contains("sincos")) << kernel;
    EXPECT_GT(k["text_bytes"], 50) << kernel;
    EXPECT_LT(k["text_bytes"], 10'000) << kernel;
  }
}

TEST_F(Model, InfoTellsOfAVariantByName) {
  const Outcome outcome = tandem("model info robot.toml --kernel-variant baseline --json -");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(nlohmann::json::parse(outcome.out)["kernel_variant"], "baseline");
}

}  // namespace
}  // namespace tandem::apps
