// Row by row, ClosedLoops::close() from the last row's solution; a loop that stays open is an
// error.
#include "report/close_passive.hpp"

#include <fmt/core.h>

#include <algorithm>

#include "model/closed_loops.hpp"

namespace tandem::report {
namespace {

/// Where the joints of the image, and the passive ones, stand in q.
struct Places {
  std::vector<std::size_t> driven, passive;
};

Result<Places> places_of(const RunData& run, const tandem_kernels& kernels) {
  const std::size_t base = kernels.nq - kernels.joints;
  const auto find = [&](const std::string& name, std::vector<std::size_t>& places) {
    const auto end = kernels.joint_names + kernels.joints;
    const auto* const found = std::find(kernels.joint_names, end, name);
    places.push_back(base + static_cast<std::size_t>(found - kernels.joint_names));
    return found != end;
  };
  Places places;
  bool all = true;
  for (const hal::JointConfig& joint : run.robot.joints) {
    all = find(joint.name, places.driven) && all;
  }
  for (const hal::PassiveConfig& joint : run.robot.passive) {
    all = find(joint.name, places.passive) && all;
  }
  if (!all) return fail("the kernels are of another robot");
  return places;
}

}  // namespace

Status close_passive(RunData& run, const tandem_kernels& kernels) {
  constexpr int kMostSteps = 200;
  if (run.robot.passive.empty() || !run.passive_rad.empty()) return {};
  const Result<Places> places = places_of(run, kernels);
  if (!places) return std::unexpected(places.error());
  auto loops =
      model::ClosedLoops::create(run.robot.loop_specs(), run.robot.passive_names(), kernels);
  if (!loops) return std::unexpected(loops.error());
  std::vector<double> q(kernels.nq, 0.0);
  if (kernels.floating_base != 0) q[6] = 1.0;  // no loop goes through the world
  for (std::size_t i = 0; i < places->passive.size(); ++i) {
    q[places->passive[i]] = run.robot.passive[i].position_rad;
  }
  Columns closed(places->passive.size());
  for (std::size_t row = 0; row < run.rows(); ++row) {
    for (std::size_t j = 0; j < places->driven.size(); ++j) {
      q[places->driven[j]] = run.position_rad[j][row];
    }
    if (!loops->close(q.data(), kMostSteps)) {
      return fail(
          fmt::format("the measured positions leave a loop open at {:.3f} s", run.time_s[row]));
    }
    for (std::size_t i = 0; i < closed.size(); ++i) closed[i].push_back(q[places->passive[i]]);
  }
  run.passive_rad = std::move(closed);
  return {};
}

}  // namespace tandem::report
