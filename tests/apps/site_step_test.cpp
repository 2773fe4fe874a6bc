// A site that is led a step: where it really goes, by the model of a bundled robot.
#include "robot/site_step.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "model/interpreted_kernels.hpp"
#include "robot/posture.hpp"
#include "robot/robot_files.hpp"

namespace tandem::robot {
namespace {

struct Panda {
  RobotFiles files = *read_robot(TANDEM_SOURCE_DIR "/config/panda/robot.toml");
  model::InterpretedKernels kernels{
      *model::make_mechanism(files.tree, files.spec, model::Frames::kAsDescribed)};
  std::vector<double> ready = files.config.posture("ready")->position_rad;

  /// R (row-major), then p, of the site "hand" in the base's frame.
  [[nodiscard]] std::array<double, 12> hand(const std::vector<double>& position_rad) const {
    hal::PostureConfig posture;
    posture.position_rad = position_rad;
    const std::vector<double> q = coordinates_at(files.config, *kernels.get(), &posture);
    const std::vector<double> zero(kernels.get()->nv, 0.0);
    std::vector<double> poses(12 * kernels.get()->sites), twists(6 * kernels.get()->sites);
    kernels.get()->site_twists(q.data(), zero.data(), poses.data(), twists.data());
    const std::size_t at = 12 * site();
    std::array<double, 12> pose;
    for (std::size_t i = 0; i < 12; ++i) pose[i] = poses[at + i];
    return pose;
  }
  [[nodiscard]] std::size_t site() const {
    std::size_t s = 0;
    while (std::string(kernels.get()->site_names[s]) != "hand") ++s;
    return s;
  }
  [[nodiscard]] std::vector<double> after(const SiteStep& step) const {
    const auto led = site_step(files.config, kernels.get(), step, ready);
    EXPECT_TRUE(led) << led.error().to_string();
    std::vector<double> to = ready;
    if (!led) return to;
    for (std::size_t i = 0; i < led->joints.size(); ++i) to[led->joints[i]] = led->target_rad[i];
    return to;
  }
  [[nodiscard]] std::string refused(const SiteStep& step, const std::vector<double>& from) const {
    const auto led = site_step(files.config, kernels.get(), step, from);
    return led ? "made" : led.error().to_string();
  }
};

TEST(SiteStep, GoesStraightAndKeepsItsDirection) {
  const Panda panda;
  const std::array<double, 12> before = panda.hand(panda.ready);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const bool own : {false, true}) {
      constexpr double kBy = 0.05;
      const auto now = panda.hand(panda.after({"hand", axis, own, kBy}));
      for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(now[i], before[i], 2e-3);
      for (std::size_t i = 0; i < 3; ++i) {
        // A column of R is the site's axis in the base's frame.
        const double along = own ? before[3 * i + axis] : (i == axis ? 1.0 : 0.0);
        EXPECT_NEAR(now[9 + i] - before[9 + i], kBy * along, 5e-4) << axis << own << i;
      }
    }
  }
}

TEST(SiteStep, TurnsAboutAnAxisInItsPlace) {
  const Panda panda;
  const std::array<double, 12> before = panda.hand(panda.ready);
  constexpr double kBy = 0.1;
  const auto now = panda.hand(panda.after({"hand", 5, false, kBy}));  // about the base's z
  for (std::size_t i = 9; i < 12; ++i) EXPECT_NEAR(now[i], before[i], 1e-3);
  for (std::size_t column = 0; column < 3; ++column) {
    const double x = before[column], y = before[3 + column];
    EXPECT_NEAR(now[column], std::cos(kBy) * x - std::sin(kBy) * y, 2e-3);
    EXPECT_NEAR(now[3 + column], std::sin(kBy) * x + std::cos(kBy) * y, 2e-3);
    EXPECT_NEAR(now[6 + column], before[6 + column], 2e-3);
  }
}

TEST(SiteStep, IsRefusedWithWords) {
  const Panda panda;
  const auto has = [](const std::string& text, const char* words) {
    EXPECT_NE(text.find(words), std::string::npos) << text;
  };
  has(panda.refused({"hnad", 0, false, 0.01}, panda.ready), "did you mean 'hand'?");
  // The arm straight up: it can go no higher.
  std::vector<double> straight(panda.ready.size(), 0.0);
  straight[3] = -0.07;
  has(panda.refused({"hand", 2, false, 0.05}, straight), "near a singular one");
  std::vector<double> bent = panda.ready;
  bent[3] = panda.files.config.joints[3].min_position_rad + 0.005;
  has(panda.refused({"hand", 0, false, -0.05}, bent), "beyond its limit");
  has(site_step(panda.files.config, nullptr, {"hand", 0, false, 0.01}, panda.ready)
          .error()
          .to_string(),
      "no model");
  const RobotFiles loops = *read_robot(TANDEM_SOURCE_DIR "/config/four_bar/robot.toml");
  has(site_step(loops.config, panda.kernels.get(), {"hand", 0, false, 0.01}, {})
          .error()
          .to_string(),
      "closed loops");
}

}  // namespace
}  // namespace tandem::robot
