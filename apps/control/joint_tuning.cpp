#include "apps/control/joint_tuning.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <functional>
#include <string_view>
#include <utility>

#include "base/quoting.hpp"

namespace tandem::apps {
namespace {

/// What may be another than in robot.toml.
struct Tuned {
  std::array<hal::PidGains, hal::kPidLoops> gains{};
  double stiffness_Nm_rad = 0.0, damping_Nms_rad = 0.0;

  bool operator==(const Tuned&) const = default;
};

Tuned written(const hal::GainsConfig& in) {
  return {{in.position.gains, in.velocity.gains, in.torque.gains, in.current.gains},
          in.stiffness_Nm_rad,
          in.damping_Nms_rad};
}

/// The impedance of a stiff joint to which no controller has given one yet reads 0: it stays.
Tuned now(const runtime::JointInfo& joint, const hal::GainsConfig& in) {
  const runtime::JointStatus& look = joint.look;
  const bool none = look.stiffness_Nm_rad == 0.0 && look.damping_Nms_rad == 0.0 &&
                    look.interaction == static_cast<std::uint8_t>(hal::InteractionMode::kStiff);
  return {joint.gains, none ? in.stiffness_Nm_rad : look.stiffness_Nm_rad,
          none ? in.damping_Nms_rad : look.damping_Nms_rad};
}

std::string key(std::string_view name) {
  constexpr std::string_view kBare =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-";
  const bool bare = !name.empty() && name.find_first_not_of(kBare) == std::string_view::npos;
  return bare ? std::string(name) : quoted_text(name);
}

std::string loop(const char* name, const hal::PidGains& of, double output_limit) {
  std::string line = fmt::format("{} = {{ kp = {}, ki = {}, kd = {}", name, of.kp, of.ki, of.kd);
  if (output_limit > 0.0) line += fmt::format(", output_limit = {}", output_limit);
  return line + " }\n";
}

/// A whole table: what cannot change in a run is as `in` has it.
std::string table(const std::string& name, const hal::GainsConfig& in, const Tuned& of) {
  const bool motor = in.position_feedback == hal::PositionFeedback::kMotor;
  return fmt::format("[gains.{}]\n", key(name)) +
         loop("position", of.gains[0], in.position.output_limit) +
         loop("velocity", of.gains[1], in.velocity.output_limit) +
         loop("torque", of.gains[2], in.torque.output_limit) +
         loop("current", of.gains[3], in.current.output_limit) +
         fmt::format("position_feedback = \"{}\"\n", motor ? "motor" : "link") +
         fmt::format("torque_feedforward = {}\n", in.torque_feedforward) +
         fmt::format("emf_compensation = {}\n", in.emf_compensation) +
         fmt::format("stiffness_Nm_rad = {}\n", of.stiffness_Nm_rad) +
         fmt::format("damping_Nms_rad = {}\n\n", of.damping_Nms_rad);
}

/// Joints of one table that agree.
struct Agreed {
  Tuned tuned;
  std::vector<std::string> joints;
};

/// Its joints by what they have now: those first that keep the table's name.
std::vector<Agreed> agreed_of(const hal::RobotConfig& robot, const hal::GainsConfig& in,
                              const std::vector<runtime::JointInfo>& joints) {
  std::vector<Agreed> all;
  for (std::size_t j = 0; j < joints.size(); ++j) {
    if (robot.gains_of(robot.joints[j]).name != in.name) continue;
    const Tuned tuned = now(joints[j], in);
    auto same = std::ranges::find(all, tuned, &Agreed::tuned);
    if (same == all.end()) same = all.insert(all.end(), {.tuned = tuned, .joints = {}});
    same->joints.push_back(joints[j].name);
  }
  std::ranges::stable_sort(all, std::ranges::greater{},
                           [](const Agreed& one) { return one.joints.size(); });
  return all;
}

std::string quoted_list(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ", ") + quoted_text(name);
  return "[" + list + "]";
}

}  // namespace

Tuning tuning_of(const hal::RobotConfig& robot, const std::vector<runtime::JointInfo>& joints) {
  Tuning out{.toml = fmt::format("# Gains of {} in a run: these tables take the place of its "
                                 "robot.toml's [gains.NAME].\n\n",
                                 quoted_text(robot.name)),
             .changed = {}};
  for (const hal::GainsConfig& in : robot.gains) {
    const std::vector<Agreed> all = agreed_of(robot, in, joints);
    if (all.empty()) out.toml += table(in.name, in, written(in));
    for (std::size_t i = 0; i < all.size(); ++i) {
      std::string name = in.name;
      if (i > 0) {
        name += "_" + all[i].joints.front();
        out.toml += fmt::format("# Split the [[joint]] of {}, and give it gains = {}.\n",
                                quoted_list(all[i].joints), quoted_text(name));
      }
      out.toml += table(name, in, all[i].tuned);
      if (all[i].tuned == written(in)) continue;
      out.changed.insert(out.changed.end(), all[i].joints.begin(), all[i].joints.end());
    }
  }
  return out;
}

}  // namespace tandem::apps
