#include "robot/closure_study.hpp"

#include <fmt/core.h>

#include <algorithm>

#include "model/closed_loops.hpp"
#include "robot/posture.hpp"

namespace tandem::robot {
namespace {

constexpr int kMostSteps = 200;

std::string posture_text(const std::string& posture) {
  return posture.empty() ? "with every joint at 0" : "in the posture '" + posture + "'";
}

/// Index in q of the first joint.
std::size_t first_joint(const tandem_kernels& kernels) {
  return kernels.floating_base != 0 ? 7U : 0U;
}

std::size_t widest(const model::ClosedLoops& loops) {
  std::size_t worst = 0;
  for (std::size_t l = 1; l < loops.loops(); ++l) {
    if (loops.position_error_m(l) > loops.position_error_m(worst)) worst = l;
  }
  return worst;
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

class Study {
 public:
  Study(const hal::RobotConfig& robot, const tandem_kernels& kernels)
      : robot_(robot), kernels_(kernels), rest_(kernels.nv, 0.0) {}

  ClosureStudy run(std::span<const std::string> postures) {
    if (!make(robot_.loop_specs(), loops_)) return std::move(out_);
    for (const std::string& name : postures) look_at(name);
    out_.open_freedom = kernels_.nv;
    out_.freedom = kernels_.nv - rank_of(loops_, kernels_.nv);
    return std::move(out_);
  }

 private:
  bool make(const std::vector<model::KinematicLoop>& specs, model::ClosedLoops& loops) {
    auto made = model::ClosedLoops::create(specs, robot_.passive_names(), kernels_);
    if (made) {
      loops = std::move(*made);
      return true;
    }
    out_.errors.push_back(made.error());
    out_.errors.back().file = robot_.file;
    return false;
  }

  void look_at(const std::string& posture) {
    const std::vector<double> start = coordinates_at(robot_, kernels_, robot_.posture(posture));
    std::vector<double> q = start;
    ClosureInPosture closing{.posture = posture, .passive = {}};
    loops_.move(q.data(), rest_.data());
    for (std::size_t l = 0; l < loops_.loops(); ++l) {
      closing.start_gap_m = std::max(closing.start_gap_m, loops_.gap(l).position_m);
    }
    closing.closed = loops_.close(q.data(), kMostSteps);
    loops_.move(q.data(), rest_.data());
    loops_.differentiate(q.data());
    if (!closing.closed) out_.errors.push_back(open_loop(posture, start));
    const std::size_t base = first_joint(kernels_);
    for (const std::size_t v : loops_.passive()) {
      const std::size_t joint = v - (base == 0 ? 0U : 6U);
      closing.passive.emplace_back(kernels_.joint_names[joint], q[base + joint]);
    }
    out_.postures.push_back(std::move(closing));
  }

  /// Where the sites could meet, only the axes are wrong: then they alone are named.
  bool meets_but_for_axes(std::vector<double> q) {
    std::vector<model::KinematicLoop> balls = robot_.loop_specs();
    for (model::KinematicLoop& one : balls) {
      if (one.type == model::KinematicLoopType::kRevolute)
        one.type = model::KinematicLoopType::kBall;
    }
    model::ClosedLoops loops;
    if (!make(balls, loops) || !loops.close(q.data(), kMostSteps)) return false;
    loops_.move(q.data(), rest_.data());
    return true;
  }

  Error open_loop(const std::string& posture, const std::vector<double>& start) {
    const bool axes = meets_but_for_axes(start);
    const std::size_t worst = widest(loops_);
    const hal::KinematicLoopConfig& loop = robot_.loops[worst];
    Error error;
    error.message = fmt::format("the loop does not close {}: {}", posture_text(posture),
                                axes ? "where its sites meet, " + loops_.gap(worst).to_string()
                                     : loops_.gap(worst).to_string());
    error.hint = axes ? "axis is a direction in both sites' frames: correct it, or turn a site by "
                        "rpy_rad"
                      : "change the posture, position_rad of a [[passive]], or the sites' xyz_m";
    if (!axes && loop.type == model::KinematicLoopType::kRod) error.hint += " or length_m";
    error.file = robot_.file;
    error.line = loop.line;
    error.key = "loop." + loop.name;
    return error;
  }

  const hal::RobotConfig& robot_;
  const tandem_kernels& kernels_;
  const std::vector<double> rest_;
  model::ClosedLoops loops_;
  ClosureStudy out_;
};

}  // namespace

ClosureStudy study_loops(const hal::RobotConfig& robot, const tandem_kernels& kernels,
                         std::span<const std::string> postures) {
  if (robot.loops.empty()) return {};
  return Study(robot, kernels).run(postures);
}

Diagnostics check_loop_bodies(const hal::RobotConfig& robot, const model::Tree& tree) {
  Diagnostics errors;
  for (const hal::KinematicLoopConfig& loop : robot.loops) {
    const model::Link* links[2] = {nullptr, nullptr};
    for (std::size_t i = 0; i < 2; ++i) {
      const auto site = std::ranges::find(robot.model.sites, loop.sites[i], &hal::SiteConfig::name);
      const int index = site == robot.model.sites.end() ? -1 : tree.link_index(site->link);
      if (index >= 0) links[i] = &tree.links[static_cast<std::size_t>(index)];
    }
    if (links[0] == nullptr || links[1] == nullptr || links[0]->body != links[1]->body) continue;
    const std::string where = links[0] == links[1]
                                  ? "on the link '" + links[0]->name + "'"
                                  : "on one body: '" + links[0]->name + "' and '" + links[1]->name +
                                        "' are fixed to each other";
    errors.push_back({"both sites are " + where + ", so the loop closes nothing",
                      "put one of them on the link that it shall meet", robot.file, loop.line,
                      "loop." + loop.name});
  }
  return errors;
}

}  // namespace tandem::robot
