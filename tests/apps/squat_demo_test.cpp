// COMAN's squat through the whole chain, as `make demo` runs it, held against what was asked.
#include <cmath>
#include <numbers>

#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

class SquatDemo : public Program {};

TEST_F(SquatDemo, ComanSquatsAndStandsAtTheEnd) {
  const Outcome outcome = tandem("run " + shell_word(TANDEM_SOURCE_DIR "/config/coman/squat.toml") +
                                 " --report --json result.json");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto json = this->json("result.json");
  EXPECT_TRUE(json["faults"].empty());
  EXPECT_DOUBLE_EQ(json["sim_seconds"], 30.0);
  EXPECT_EQ(json["log"]["dropped"], 0);

  constexpr double kDegree = std::numbers::pi / 180.0;
  for (const std::string joint : {"LHipSag", "RHipSag", "LKneeSag", "RKneeSag"}) {
    EXPECT_LT(json["joints"][joint]["rms_tracking_error_rad"].get<double>(), 1.0 * kDegree)
        << joint;
  }
  const double weight = json["ground"]["weight_N"];
  EXPECT_NEAR(json["ground"]["mean_vertical_force_N"].get<double>(), weight, 0.005 * weight);
  EXPECT_LT(json["ground"]["max_foot_slip_m"].get<double>(), 0.005);
  const double depth =
      json["base"]["max_height_m"].get<double>() - json["base"]["min_height_m"].get<double>();
  EXPECT_NEAR(depth, 0.10, 0.02);
  EXPECT_LT(json["base"]["final_tilt_rad"].get<double>(), 3.0 * kDegree);

  const std::filesystem::path report = folder_ / "runs/coman-squat-001";
  EXPECT_TRUE(std::filesystem::exists(report / "report.html"));
  for (const std::string image : {"joint_position", "foot_force", "joint_torque", "posture"}) {
    EXPECT_TRUE(read_text(report / (image + ".png")).starts_with("\x89PNG")) << image;
  }
}

}  // namespace
}  // namespace tandem::apps
