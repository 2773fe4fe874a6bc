#include "hal/sim/push_row.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "hal/sim/payload.hpp"

namespace tandem::sim {
namespace {

/// The frame of its numbers in the body that it acts on; empty, after an error, of no place.
std::optional<model::Placement> read_push_place(TomlTable& table, const hal::RobotConfig& robot,
                                                const model::Tree* tree, ScenarioFault& push) {
  const bool by_joint = table.has("joint");
  const bool by_link = table.has("link") || table.has("site");
  if (by_joint && by_link) {
    (void)table.text_or("link", "");
    (void)table.text_or("site", "");
    table.error("joint", "a push acts at one place, and another is named, too", "keep one of them");
  }
  if (by_joint || tree == nullptr) {  // without a description nobody knows links
    std::vector<std::string> joints;
    for (const hal::JointConfig& joint : robot.joints) joints.push_back(joint.name);
    push.joint = index_in(table, "joint", joints);
    if (push.joint < 0) return {};
    return model::Placement{};
  }
  if (!by_link) {
    table.error("", "nothing says where it acts", "add site, link or joint");
    return {};
  }
  const auto frame = read_place(table, robot, tree, "it cannot be pushed", push);
  if (!frame) return {};
  return tree->links[static_cast<std::size_t>(push.link)].in_body * *frame;
}

/// Force and torque, or their impulses over the duration.
void read_wrench(TomlTable& table, ScenarioFault& push) {
  constexpr Range kMost{-1e5, 1e5};
  const bool force = table.has("force_N") || table.has("torque_Nm");
  const bool impulse = table.has("impulse_Ns") || table.has("impulse_Nms");
  const auto three = [&](const char* key) {
    std::array<double, 3> to{};
    const std::vector<double> from = table.numbers_or(key, {0.0, 0.0, 0.0}, kMost, 3);
    if (from.size() == 3) std::ranges::copy(from, to.begin());
    return to;
  };
  const std::array<double, 3> force_N = three("force_N"), torque_Nm = three("torque_Nm");
  const std::array<double, 3> Ns = three("impulse_Ns"), Nms = three("impulse_Nms");
  if (force == impulse) {
    table.error(force ? "impulse_Ns" : "",
                force ? "force or impulse, not both" : "nothing says how hard it pushes",
                "give force_N and torque_Nm, or impulse_Ns and impulse_Nms");
    return;
  }
  push.force_N = force ? force_N : Ns;
  push.torque_Nm = force ? torque_Nm : Nms;
  const bool shaped = push.shape != PushShape::kStep;
  if (push.duration_ns == 0 || (push.duration_ns < 0 && (impulse || shaped))) {
    table.error(table.has("for_s") ? "for_s" : "",
                std::string(impulse  ? "an impulse"
                            : shaped ? "a push with a shape"
                                     : "a push") +
                    " takes a time",
                "add for_s = 0.1, for one");
    return;
  }
  if (!impulse) return;
  const double over_s = 1e-9 * static_cast<double>(push.duration_ns) * area(push.shape, 1.0);
  for (double& one : push.force_N) one /= over_s;
  for (double& one : push.torque_Nm) one /= over_s;
}

std::array<double, 3> turned(const Eigen::Matrix3d& R, const std::array<double, 3>& v) {
  const Eigen::Vector3d in_body = R * Eigen::Vector3d(v.data());
  return {in_body.x(), in_body.y(), in_body.z()};
}

}  // namespace

double area(PushShape shape, double s) noexcept TANDEM_RT {
  s = std::clamp(s, 0.0, 1.0);
  switch (shape) {
    case PushShape::kStep: return s;
    case PushShape::kHalfSine: return (1.0 - std::cos(std::numbers::pi * s)) / std::numbers::pi;
    case PushShape::kTriangle: return s <= 0.5 ? s * s : 0.5 - (1.0 - s) * (1.0 - s);
  }
  return 0.0;
}

void read_push(TomlTable& table, const hal::RobotConfig& robot, const model::Tree* tree,
               ScenarioFault& push) {
  const auto place = read_push_place(table, robot, tree, push);
  const std::string shape = table.choice_or("shape", "step", {"step", "half_sine", "triangle"});
  if (shape == "half_sine") push.shape = PushShape::kHalfSine;
  if (shape == "triangle") push.shape = PushShape::kTriangle;
  const bool local = table.choice_or("frame", "world", {"world", "local"}) == "local";
  read_wrench(table, push);
  const auto point_m = table.numbers_or("point_m", {0.0, 0.0, 0.0}, {-10.0, 10.0}, 3);
  if (!place || point_m.size() != 3) return;
  const Eigen::Vector3d in_body = place->p + place->R * Eigen::Vector3d(point_m.data());
  push.point_m = {in_body.x(), in_body.y(), in_body.z()};
  if (!local) return;
  push.turns = 1;
  push.force_N = turned(place->R, push.force_N);
  push.torque_Nm = turned(place->R, push.torque_Nm);
}

}  // namespace tandem::sim
