// Maps a log's joints, feet and passive joints to the kernels, stretch by stretch between missing
// samples, and subtracts what closed loops carry.
#include "report/logged_torque.hpp"

#include <algorithm>
#include <limits>
#include <optional>
#include <span>

#include "model/closed_loops.hpp"
#include "report/inverse_dynamics.hpp"

namespace tandem::report {
namespace {

constexpr double kMotionStep_s = 0.005;
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

std::size_t index_of(int index) { return static_cast<std::size_t>(index); }

/// Where joint `name` stands in run.positions(); none: neither driven nor known to the truth.
std::optional<std::size_t> position_index(const RunData& run, const std::string& name) {
  if (const int driven = run.robot.joint_index(name); driven >= 0) return index_of(driven);
  const auto passive = std::ranges::find(run.robot.passive, name, &hal::PassiveConfig::name);
  const auto index = static_cast<std::size_t>(passive - run.robot.passive.begin());
  if (index >= run.passive_rad.size()) return std::nullopt;
  return run.robot.joints.size() + index;
}

/// The foot at each wrench site of the kernels; -1: no foot, nothing acts there.
std::vector<int> feet_of_wrenches(const RunData& run, const tandem_kernels& kernels) {
  std::vector<int> feet;
  const auto& all = run.robot.contact.feet;
  for (std::uint32_t w = 0; w < kernels.wrenches; ++w) {
    const auto foot = std::ranges::find(all, kernels.wrench_names[w], &hal::Foot::site);
    feet.push_back(foot == all.end() ? -1 : static_cast<int>(foot - all.begin()));
  }
  return feet;
}

/// What the ground did at each wrench site: force and moment in W's axes.
std::vector<double> ground_wrenches(const RunData& run, const std::vector<int>& feet,
                                    std::size_t row) {
  std::vector<double> wrenches(6 * feet.size(), 0.0);
  for (std::size_t w = 0; w < feet.size(); ++w) {
    for (std::size_t k = 0; feet[w] >= 0 && k < 3; ++k) {
      wrenches[6 * w + k] = run.foot_force_N[3 * index_of(feet[w]) + k][row];
      wrenches[6 * w + 3 + k] = run.foot_moment_Nm[3 * index_of(feet[w]) + k][row];
    }
  }
  return wrenches;
}

/// Where every joint of the kernels stands in run.positions().
Result<std::vector<std::size_t>> model_order(const RunData& run, const tandem_kernels& kernels) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < kernels.joints; ++i) {
    const std::optional<std::size_t> index = position_index(run, kernels.joint_names[i]);
    if (!index) return fail("the log lacks the position of " + std::string(kernels.joint_names[i]));
    order.push_back(*index);
  }
  return order;
}

/// What inverse dynamics needs to know of closed loops; nothing for a robot without passive joints.
Result<model::ClosedLoops> loops_of(const RunData& run, const tandem_kernels& kernels) {
  if (run.robot.passive.empty()) return model::ClosedLoops();
  if (kernels.sensors > 0) {
    return fail("the loops' forces cannot be told from those that force sensors measure");
  }
  return model::ClosedLoops::create(run.robot.loop_specs(), run.robot.passive_names(), kernels);
}

/// The motion's next row, with the passive joints' velocities that keep the loops closed.
void add_row(const RunData& run, std::size_t row, const tandem_kernels& kernels,
             const std::vector<std::size_t>& order, model::ClosedLoops& loops,
             SampledMotion& motion) {
  std::vector<double> q, v, sensors;
  if (kernels.floating_base != 0) {
    for (std::size_t i = 0; i < 7; ++i) q.push_back(run.base[i][row]);
    for (std::size_t i = 0; i < 6; ++i) v.push_back(run.base[7 + i][row]);
  }
  const std::vector<double> positions = run.positions(row);
  for (const std::size_t j : order) {
    q.push_back(positions[j]);
    v.push_back(j < run.velocity_rad_s.size() ? run.velocity_rad_s[j][row] : 0.0);
  }
  loops.move(q.data(), v.data());
  loops.differentiate(q.data());
  loops.close_rates(v.data());
  for (std::size_t s = 0; s < kernels.sensors; ++s) {
    const int index = run.robot.sensor_index(kernels.sensor_names[s]);
    const std::size_t first = run.first_channel(index_of(std::max(index, 0)));
    for (std::size_t i = 0; i < 6; ++i) sensors.push_back(run.sensor[first + i][row]);
  }
  motion.q.push_back(std::move(q));
  motion.v.push_back(std::move(v));
  motion.sensors.push_back(std::move(sensors));
}

/// The rows [begin, end), between which none is missing, a few milliseconds apart.
/// @param times  get those of the motion's rows
SampledMotion motion_of(const RunData& run, std::size_t begin, std::size_t end,
                        const tandem_kernels& kernels, const std::vector<std::size_t>& order,
                        model::ClosedLoops& loops, std::vector<double>& times) {
  const auto stride = static_cast<std::size_t>(std::max(1.0, kMotionStep_s / run.step_s));
  const std::vector<int> feet = feet_of_wrenches(run, kernels);
  const bool ground_known = run.motion_known() || run.robot.contact.feet.empty();
  SampledMotion motion;
  motion.step_s = run.step_s * static_cast<double>(stride);
  for (std::size_t row = begin; row < end; row += stride) {
    add_row(run, row, kernels, order, loops, motion);
    if (ground_known) motion.wrenches.push_back(ground_wrenches(run, feet, row));
    times.push_back(run.time_s[row]);
  }
  return motion;
}

}  // namespace

Result<Curve> inverse_dynamics_curve(const RunData& run, int joint, const tandem_kernels& kernels) {
  const Result<std::vector<std::size_t>> order = model_order(run, kernels);
  if (!order) return std::unexpected(order.error());
  if (kernels.floating_base != 0 && !run.motion_known())
    return fail("the log lacks the base's motion");
  Result<model::ClosedLoops> loops = loops_of(run, kernels);
  if (!loops) return std::unexpected(loops.error());
  const auto place = std::ranges::find(*order, index_of(joint)) - order->begin();
  const std::size_t wanted =
      (kernels.floating_base != 0 ? 6U : 0U) + static_cast<std::size_t>(place);
  const std::span<const double> times(run.time_s.data(), run.rows_before_stop());
  std::vector<std::size_t> ends = stretches(times);
  ends.push_back(times.size());
  Curve curve{"inverse dynamics", CurveStyle::kComputed, {}, {}};
  for (std::size_t i = 0; i + 1 < ends.size(); ++i) {
    const SampledMotion motion =
        motion_of(run, ends[i], ends[i + 1], kernels, *order, *loops, curve.x);
    if (!wrenches_known(kernels, motion)) return fail("the log lacks the ground's forces");
    std::vector<std::vector<double>> torques = inverse_dynamics(kernels, motion);
    const bool has_rates = torques.size() > 1;
    if (i > 0) {
      const auto at = static_cast<std::ptrdiff_t>(curve.y.size());
      curve.x.insert(curve.x.begin() + at, run.time_s[ends[i]]);
      curve.y.push_back(kUnknown);
    }
    for (std::size_t row = 0; row < torques.size(); ++row) {
      loops->move(motion.q[row].data(), motion.v[row].data());
      loops->differentiate(motion.q[row].data());
      loops->carry_passive(torques[row].data());
      curve.y.push_back(has_rates ? torques[row][wanted] : kUnknown);
    }
  }
  return curve;
}

}  // namespace tandem::report
