// Position and velocity loops that will probably oscillate, at the period in which their boards
// compute them.
#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "base/counted.hpp"
#include "hal/config/capabilities.hpp"
#include "robot/check_rows.hpp"
#include "robot/gains_judge.hpp"

namespace tandem::robot {

namespace {

std::optional<Error> ringing_loops(const hal::RobotConfig& config, const tandem_kernels& kernels,
                                   const std::string& posture) {
  const hal::PostureConfig* start = config.posture(posture);
  if (start == nullptr && !posture.empty()) return {};  // has been said elsewhere
  const GainsJudge judge(config, &kernels);
  const hal::ParameterImage now = hal::initial_parameters(config);
  std::vector<double> position_rad(config.joints.size(), 0.0);
  if (start != nullptr) position_rad = start->position_rad;
  const hal::JointConfig* worst_joint = nullptr;
  LoopVerdict worst;
  std::size_t count = 0;
  for (std::size_t j = 0; j < config.joints.size(); ++j) {
    if (!judge.unknown(j).empty()) continue;
    GainsJudge::Gains gains;
    for (std::size_t l = 0; l < gains.size(); ++l) {
      gains[l] = now.gains(j, static_cast<hal::PidLoop>(l));
    }
    bool rings = false;
    for (const hal::PidLoop loop : {hal::PidLoop::kPosition, hal::PidLoop::kVelocity}) {
      const auto verdict = judge.judge(j, loop, gains, position_rad, false);
      if (!verdict || verdict->stable()) continue;
      rings = true;
      if (worst_joint != nullptr && !verdict->worse_than(worst)) continue;
      worst = *verdict;
      worst_joint = &config.joints[j];
    }
    count += rings ? 1 : 0;
  }
  if (worst_joint == nullptr) return {};
  const bool springy =
      config.actuator_of(*worst_joint).spring_Nm_rad > 0.0 &&
      config.gains_of(*worst_joint).position_feedback == hal::PositionFeedback::kLink;
  return Error{
      .message = fmt::format(
          "with these gains and a control period of {:g} ms the {} loop will probably oscillate: "
          "with an inertia of {:.3g} {} it doubles in {:.2g} s{}",
          worst.period_s * 1e3, hal::to_string(worst.loop), worst.inertia_kg_m2,
          worst_joint->slides ? "kg" : "kg m2",
          std::numbers::ln2 * worst.period_s / std::log(worst.growth),
          count == 1 ? "" : fmt::format("; so will {} more", counted(count - 1, "joint"))),
      .hint =
          std::string("lower the gains, or shorten its board's control_period_ns ") +
          (springy ? "(docs/firmware.md); on a soft spring set position_feedback = \"motor\" in "
                     "its [gains.…] (docs/robots.md)"
                   : "(docs/firmware.md)"),
      .file = config.file,
      .line = worst_joint->line,
      .key = "joint." + worst_joint->name + ".gains"};
}

}  // namespace

void check_gains(const CheckedRobot& s, Findings& findings) {
  if (s.use.postures.empty()) return;
  auto warning = ringing_loops(s.robot.config, s.kernels, s.use.postures.front());
  if (warning) findings.warn(std::move(*warning));
}

}  // namespace tandem::robot
