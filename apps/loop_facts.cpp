#include "apps/loop_facts.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <string_view>

#include "model/closed_loops.hpp"

namespace tandem::apps {
namespace {

constexpr int kMostSteps = 200;

const char* type_text(model::LoopType type) {
  switch (type) {
    case model::LoopType::kBall: return "ball";
    case model::LoopType::kRevolute: return "revolute";
    case model::LoopType::kRod: break;
  }
  return "rod";
}

/// q at a posture, the passive joints where they start from.
std::vector<double> start_of(const hal::RobotConfig& robot, const tandem_kernels& kernels,
                             const hal::PostureConfig* posture) {
  std::vector<double> q(kernels.nq, 0.0);
  const std::size_t base = kernels.floating_base != 0 ? 7 : 0;
  if (base != 0) q[6] = 1.0;
  for (std::size_t i = 0; i < kernels.joints; ++i) {
    const int driven = robot.joint_index(kernels.joint_names[i]);
    const auto passive =
        std::ranges::find(robot.passive, kernels.joint_names[i], &hal::PassiveConfig::name);
    if (passive != robot.passive.end()) q[base + i] = passive->position_rad;
    if (driven < 0 || posture == nullptr) continue;
    q[base + i] = posture->position_rad[static_cast<std::size_t>(driven)];
  }
  return q;
}

double widest_gap_m(const model::ClosedLoops& loops) {
  double gap_m = 0.0;
  for (std::size_t l = 0; l < loops.loops(); ++l) {
    gap_m = std::max(gap_m, loops.position_error_m(l));
  }
  return gap_m;
}

/// How many of the equations say something of their own. @pre loops.differentiate()
std::size_t rank_of(const model::ClosedLoops& loops, std::size_t nv) {
  const std::size_t n = loops.rows();
  const std::span<const double> A = loops.jacobian();
  std::vector<double> S(n * n, 0.0);
  for (std::size_t i = 0; i < n * n; ++i) {
    for (std::size_t k = 0; k < nv; ++k) S[i] += A[i / n * nv + k] * A[i % n * nv + k];
  }
  model::SemidefiniteSolver solver(n);
  solver.factorise(S, n);
  return solver.rank();
}

std::string posture_text(const tandem_kernels& kernels, model::ClosedLoops& loops,
                         std::vector<double>& q) {
  const std::vector<double> rest(kernels.nv, 0.0);
  loops.move(q.data(), rest.data());
  const double before_m = widest_gap_m(loops);
  const bool closed = loops.close(q.data(), kMostSteps);
  loops.move(q.data(), rest.data());
  loops.differentiate(q.data());
  if (!closed) return fmt::format("does not close: a gap of {:.3g} m is left", widest_gap_m(loops));
  std::string text = fmt::format("closes from a gap of {:.3g} m:", before_m);
  for (std::size_t j = 0; j < loops.passive().size(); ++j) {
    const std::size_t joint = loops.passive()[j] - (kernels.floating_base != 0 ? 6U : 0U);
    const std::size_t at = joint + (kernels.floating_base != 0 ? 7U : 0U);
    text += fmt::format("{} {} {:.4f}", j == 0 ? "" : ",", kernels.joint_names[joint], q[at]);
  }
  return text;
}

}  // namespace

void add_loop_facts(const hal::RobotConfig& robot, const tandem_kernels* kernels,
                    std::span<const std::string> postures, Facts& facts) {
  for (const model::LoopSpec& loop : robot.loops) {
    facts.add("loop " + loop.name,
              fmt::format("{}, {} to {}", type_text(loop.type), loop.sites[0], loop.sites[1]));
  }
  if (robot.loops.empty() || kernels == nullptr) return;
  auto loops = model::ClosedLoops::create(robot.loop_specs(), robot.passive_names(), *kernels);
  if (!loops) return;  // a run says why
  for (const std::string& name : postures) {
    std::vector<double> q = start_of(robot, *kernels, robot.posture(name));
    facts.add(name.empty() ? "every joint at 0" : "posture " + name,
              posture_text(*kernels, *loops, q));
    if (&name != &postures.back()) continue;
    facts.add("freedom", fmt::format("{} of {} degrees remain with the loops closed; motors: {}",
                                     kernels->nv - rank_of(*loops, kernels->nv), kernels->nv,
                                     robot.joints.size()));
  }
}

}  // namespace tandem::apps
