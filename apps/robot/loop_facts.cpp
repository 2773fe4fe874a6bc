#include "apps/robot/loop_facts.hpp"

#include <fmt/core.h>

#include <algorithm>

#include "hal/sim/setup.hpp"
#include "model/closed_loops.hpp"
#include "model/interpreted_kernels.hpp"

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

std::string posture_text(const std::string& posture) {
  return posture.empty() ? "with every joint at 0" : "in the posture '" + posture + "'";
}

/// Index in q of the first joint.
std::size_t first_joint(const tandem_kernels& kernels) {
  return kernels.floating_base != 0 ? 7U : 0U;
}

/// q at a posture, the passive joints where they start from.
std::vector<double> start_of(const hal::RobotConfig& robot, const tandem_kernels& kernels,
                             const hal::PostureConfig* posture) {
  std::vector<double> q(kernels.nq, 0.0);
  const std::size_t base = first_joint(kernels);
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

  LoopStudy run(std::span<const std::string> postures) {
    if (!make(robot_.loop_specs(), loops_)) return std::move(out_);
    for (const std::string& name : postures) look_at(name);
    out_.open_freedom = kernels_.nv;
    out_.freedom = kernels_.nv - rank_of(loops_, kernels_.nv);
    return std::move(out_);
  }

 private:
  bool make(const std::vector<model::LoopSpec>& specs, model::ClosedLoops& loops) {
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
    const std::vector<double> start = start_of(robot_, kernels_, robot_.posture(posture));
    std::vector<double> q = start;
    LoopClosing closing{.posture = posture, .passive = {}};
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
    std::vector<model::LoopSpec> balls = robot_.loop_specs();
    for (model::LoopSpec& one : balls) {
      if (one.type == model::LoopType::kRevolute) one.type = model::LoopType::kBall;
    }
    model::ClosedLoops loops;
    if (!make(balls, loops) || !loops.close(q.data(), kMostSteps)) return false;
    loops_.move(q.data(), rest_.data());
    return true;
  }

  Error open_loop(const std::string& posture, const std::vector<double>& start) {
    const bool axes = meets_but_for_axes(start);
    const std::size_t worst = widest(loops_);
    const hal::LoopConfig& loop = robot_.loops[worst];
    Error error;
    error.message = fmt::format("the loop does not close {}: {}", posture_text(posture),
                                axes ? "where its sites meet, " + loops_.gap(worst).to_string()
                                     : loops_.gap(worst).to_string());
    error.hint = axes ? "axis is a direction in both sites' frames: correct it, or turn a site by "
                        "rpy_rad"
                      : "change the posture, position_rad of a [[passive]], or the sites' xyz_m";
    if (!axes && loop.type == model::LoopType::kRod) error.hint += " or length_m";
    error.file = robot_.file;
    error.line = loop.line;
    error.key = "loop." + loop.name;
    return error;
  }

  const hal::RobotConfig& robot_;
  const tandem_kernels& kernels_;
  const std::vector<double> rest_;
  model::ClosedLoops loops_;
  LoopStudy out_;
};

}  // namespace

LoopStudy study_loops(const hal::RobotConfig& robot, const model::Tree& tree,
                      std::span<const std::string> postures) {
  if (robot.loops.empty()) return {};
  auto mechanism = model::make_mechanism(tree, sim::model_spec(robot), model::Frames::kAsDescribed);
  if (!mechanism) return {.postures = {}, .errors = {mechanism.error()}};
  const model::InterpretedKernels kernels(std::move(*mechanism), robot.name);
  return Study(robot, *kernels.get()).run(postures);
}

std::vector<std::string> postures_of(const hal::RobotConfig& robot) {
  std::vector<std::string> names;
  for (const hal::PostureConfig& one : robot.postures) names.push_back(one.name);
  if (names.empty()) names.emplace_back();
  return names;
}

Diagnostics check_loop_bodies(const hal::RobotConfig& robot, const model::Tree& tree) {
  Diagnostics errors;
  for (const hal::LoopConfig& loop : robot.loops) {
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

void add_loop_facts(const hal::RobotConfig& robot, const LoopStudy& study, Facts& facts) {
  for (const model::LoopSpec& loop : robot.loops) {
    facts.add("loop " + loop.name,
              fmt::format("{}, {} to {}", type_text(loop.type), loop.sites[0], loop.sites[1]));
  }
  for (const LoopClosing& one : study.postures) {
    std::string text = fmt::format(
        "{} from a gap of {:.3g} m:", one.closed ? "closes" : "does not close", one.start_gap_m);
    for (std::size_t i = 0; i < one.passive.size(); ++i) {
      text += fmt::format("{} {} {:.4f}", i == 0 ? "" : ",", one.passive[i].first,
                          one.passive[i].second);
    }
    facts.add(one.posture.empty() ? "every joint at 0" : "posture " + one.posture, text);
  }
  if (study.postures.empty()) return;
  facts.add("freedom", fmt::format("{} of {} degrees remain with the loops closed; motors: {}",
                                   study.freedom, study.open_freedom, robot.joints.size()));
}

void add_loop_json(const hal::RobotConfig& robot, const LoopStudy& study, Json& json) {
  if (robot.loops.empty()) return;
  for (const hal::LoopConfig& loop : robot.loops) {
    json["loops"].push_back(
        {{"name", loop.name}, {"type", type_text(loop.type)}, {"sites", loop.sites}});
  }
  json["loop_postures"] = Json::array();
  for (const LoopClosing& one : study.postures) {
    Json passive = Json::object();
    for (const auto& [joint, position] : one.passive) passive[joint] = position;
    json["loop_postures"].push_back({{"posture", one.posture},
                                     {"closed", one.closed},
                                     {"start_gap_m", one.start_gap_m},
                                     {"passive", passive}});
  }
  json["freedom"] = {{"degrees", study.freedom},
                     {"open_degrees", study.open_freedom},
                     {"motors", robot.joints.size()}};
}

}  // namespace tandem::apps
