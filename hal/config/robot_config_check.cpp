// robot.toml against the URDF: names that must exist, and limits that the URDF completes.
#include <fmt/format.h>

#include <cassert>
#include <cmath>
#include <numbers>

#include "hal/config/capabilities.hpp"
#include "hal/config/drive_ranges.hpp"
#include "hal/config/following_error.hpp"
#include "hal/config/joint_scale.hpp"
#include "hal/config/robot_config_read.hpp"

namespace tandem::hal {
namespace {

/// A rated torque of a sheet beyond so many times the joint's largest is more likely in uNm.
constexpr double kLikelyOverrated = 30.0;

template <class T>
const T* find(const std::vector<T>& items, std::string_view name) {
  const auto found = std::ranges::find(items, name, &T::name);
  return found == items.end() ? nullptr : &*found;
}

template <class T>
int index_of(const std::vector<T>& items, std::string_view name) {
  const T* item = find(items, name);
  return item == nullptr ? -1 : static_cast<int>(item - items.data());
}

}  // namespace

ImageShape RobotConfig::shape() const {
  ImageShape shape{.joints = joints.size(), .sensor_channels = {}};
  for (const SensorConfig& sensor : sensors) shape.sensor_channels.push_back(sensor.channels());
  return shape;
}

Error RobotConfig::no_joint(std::string_view joint) const {
  return hal::no_joint(joint, names_of(joints), followers);
}
int RobotConfig::joint_index(std::string_view joint) const { return index_of(joints, joint); }
int RobotConfig::sensor_index(std::string_view sensor) const { return index_of(sensors, sensor); }
bool RobotConfig::is_passive(std::string_view joint) const {
  return find(passive, joint) != nullptr;
}
std::vector<std::string> RobotConfig::passive_names() const { return names_of(passive); }
const Follower* RobotConfig::follower(std::string_view wanted) const {
  return find(followers, wanted);
}
const BoardConfig* RobotConfig::board(std::string_view wanted) const {
  return find(boards, wanted);
}
const BusConfig* RobotConfig::bus(std::string_view wanted) const { return find(buses, wanted); }
const PostureConfig* RobotConfig::posture(std::string_view wanted) const {
  return find(postures, wanted);
}

const ActuatorConfig& RobotConfig::actuator_of(const JointConfig& joint) const {
  const ActuatorConfig* found = find(actuators, joint.actuator);
  assert(found != nullptr);  // the reader refuses a joint without one
  return *found;
}

const GainsConfig& RobotConfig::gains_of(const JointConfig& joint) const {
  const GainsConfig* found = find(gains, joint.gains);
  assert(found != nullptr);
  return *found;
}

namespace {

/// "'a'", "'a' and 'b'", "'a', 'b' and 27 more".
std::string quoted(const std::vector<std::string>& names) {
  constexpr std::size_t kShown = 4;
  std::string text = "'" + names.front() + "'";
  const std::size_t shown = names.size() <= kShown ? names.size() : 2;
  for (std::size_t i = 1; i < shown; ++i) {
    text += (i + 1 == names.size() ? " and '" : ", '") + names[i] + "'";
  }
  if (shown < names.size()) text += " and " + std::to_string(names.size() - shown) + " more";
  return text;
}

/// Collects the errors of one robot against its description.
class Check {
 public:
  Check(const RobotConfig& robot, const RobotDescription& description)
      : robot_(robot), description_(description) {}

 protected:
  void error(int line, std::string key, std::string message, std::string hint) {
    errors_.push_back({std::move(message), std::move(hint), robot_.file, line, std::move(key)});
  }

  const RobotConfig& robot_;
  const RobotDescription& description_;
  Diagnostics errors_;
};

class NameCheck : private Check {
 public:
  using Check::Check;

  Diagnostics run(const std::vector<JointReference>& loose) {
    const std::vector<std::string> moving = names_of(description_.moving_joints);
    for (const JointReference& one : loose) judge(one, moving);
    report_without_table();
    for (const JointConfig& one : robot_.joints) check_moving(one.line, "joint", one.name, moving);
    for (const PassiveConfig& one : robot_.passive)
      check_moving(one.line, "passive", one.name, moving);
    for (const SiteConfig& site : robot_.model.sites) {
      check_name(site.line, "site." + site.name + ".link", "link", site.link, description_.links);
    }
    std::vector<std::string> joints = moving;
    joints.insert(joints.end(), description_.other_joints.begin(), description_.other_joints.end());
    for (const FollowerDescription& one : description_.followers) joints.push_back(one.name);
    for (const SensorConfig& sensor : robot_.sensors) {
      const std::string key = "sensor." + sensor.name;
      check_name(sensor.line, key + ".link", "link", sensor.link, description_.links);
      if (sensor.type != SensorType::kForceTorque) continue;
      check_name(sensor.line, key + ".joint", "joint", sensor.joint, joints);
    }
    return std::move(errors_);
  }

 private:
  /// Whether the description has a joint so named, of any kind.
  [[nodiscard]] bool is_described(const std::string& joint) const {
    return find(description_.moving_joints, joint) != nullptr ||
           find(description_.followers, joint) != nullptr ||
           std::ranges::find(description_.other_joints, joint) != description_.other_joints.end();
  }

  /// Whether it follows from a [[joint]] that cannot be one, which is reported itself.
  [[nodiscard]] bool follows_from_another(const std::string& joint,
                                          const std::vector<std::string>& moving) const {
    return std::ranges::any_of(robot_.joints, [&](const JointConfig& one) {
      if (one.name == joint) return find(description_.moving_joints, joint) == nullptr;
      return !one.name.empty() && !is_described(one.name) && nearest(one.name, moving) == joint;
    });
  }

  void judge(JointReference one, const std::vector<std::string>& moving) {
    if (one.joint.empty()) return errors_.push_back(std::move(one.error));
    if (follows_from_another(one.joint, moving)) return;
    if (const auto* follower = find(description_.followers, one.joint)) {
      one.error.message =
          "the joint '" + one.joint + "' mimics '" + follower->leader + "' in the description";
      one.error.hint = "remove it here: it follows";
    } else if (!one.error.hint.empty()) {
      // says already what to do
    } else if (find(description_.moving_joints, one.joint) != nullptr) {
      return without_table_.push_back(std::move(one));
    } else if (is_described(one.joint)) {
      one.error.message = "the joint '" + one.joint + "' does not move in the description";
      one.error.hint = "remove it here";
    } else {
      one.error.message = "the description has no joint '" + one.joint + "'";
      one.error.hint = suggest(one.joint, moving);
    }
    errors_.push_back(std::move(one.error));
  }

  /// Joints whose [[joint]] is not there: one message, where the first of them is named.
  void report_without_table() {
    if (without_table_.empty()) return;
    Error error = std::ranges::min(without_table_, {}, [](const JointReference& one) {
                    return one.error.line;
                  }).error;
    std::vector<std::string> joints;
    for (const JointDescription& joint : description_.moving_joints) {
      if (std::ranges::count(without_table_, joint.name, &JointReference::joint) > 0) {
        joints.push_back(joint.name);
      }
    }
    error.message = "there is no [[joint]] " + quoted(joints);
    error.hint = "add one with its actuator";
    errors_.push_back(std::move(error));
  }

  /// A [[joint]] or [[passive]] is a joint of its own.
  void check_moving(int line, const std::string& table, const std::string& name,
                    const std::vector<std::string>& moving) {
    if (robot_.model.lock_lines.contains(name)) return;  // has been said
    const std::string key = table + "." + name;
    if (const auto* follower = find(description_.followers, name)) {
      error(line, key,
            "the joint '" + name + "' mimics '" + follower->leader +
                "' in the description and has no motor of its own",
            "remove the [[" + table + "]], or set mimic = \"independent\" in [model]");
    } else if (std::ranges::find(description_.other_joints, name) ==
               description_.other_joints.end()) {
      check_name(line, key, "joint", name, moving);
    } else {
      error(line, key, "the joint '" + name + "' does not move in the description",
            "remove the [[" + table + "]]");
    }
  }

  void check_name(int line, const std::string& key, const std::string& kind,
                  const std::string& name, const std::vector<std::string>& known) {
    if (name.empty() || std::ranges::find(known, name) != known.end()) return;
    error(line, key, "the description has no " + kind + " '" + name + "'", suggest(name, known));
  }

  std::vector<JointReference> without_table_;
};

/// Fills limits, and checks them and what depends on them.
class Completion : private Check {
 public:
  Completion(RobotConfig& robot, const RobotDescription& description)
      : Check(robot, description), completed_(robot) {}

  Diagnostics run() {
    bool all_known = true;
    for (JointConfig& joint : completed_.joints) {
      const JointDescription* found = find(description_.moving_joints, joint.name);
      if (found != nullptr) complete(joint, *found);
      all_known = all_known && found != nullptr;
    }
    for (const PassiveConfig& joint : robot_.passive) {
      all_known = all_known && find(description_.moving_joints, joint.name) != nullptr;
    }
    if (all_known) check_driven();
    for (const PostureConfig& posture : robot_.postures) check(posture);
    return std::move(errors_);
  }

 private:
  /// Only once every [[joint]] and [[passive]] is known: a misspelt one would be reported twice.
  void check_driven() {
    if (robot_.joints.empty()) return;
    std::vector<std::string> others;
    for (const JointDescription& joint : description_.moving_joints) {
      if (robot_.joint_index(joint.name) >= 0 || robot_.is_passive(joint.name)) continue;
      others.push_back(joint.name);
    }
    if (others.empty()) return;
    error(0, "joint",
          others.size() == 1 ? "the description's joint " + quoted(others) + " has no [[joint]]"
                             : "the description's joints " + quoted(others) + " have no [[joint]]",
          "add one or a [[passive]], or fix it with [model.lock] " + others.front() + " = 0.0");
  }

  static double countable_rad(const JointConfig& joint) {
    const double counts =
        std::max(joint.encoder_counts_per_rev.value, joint.motor_encoder_counts_per_rev);
    return kMostCounts / counts * 2.0 * std::numbers::pi;
  }

  /// One message for all that a joint lacks: often its <limit>.
  void report_unlimited(const JointConfig& joint, const JointDescription& found) {
    if (unlimited_.empty()) return;
    const std::string note = found.limits_note.empty() ? "" : " (" + found.limits_note + ")";
    std::string keys = unlimited_.front();
    for (std::size_t i = 1; i < unlimited_.size(); ++i) {
      keys += (i + 1 == unlimited_.size() ? " and " : ", ") + unlimited_[i];
    }
    error(joint.line, "joint." + joint.name + (unlimited_.size() == 1 ? "." + keys : ""),
          "neither this file nor the description gives a limit" + note, "set " + keys);
    unlimited_.clear();
  }

  void fill(double& value, double described, const std::string& key) {
    if (!std::isnan(value)) return;
    value = described;
    if (!std::isfinite(described) || described <= 0.0) unlimited_.push_back(key);
  }

  /// @param countable  the most that a joint without a limit may turn
  void fill_position(double& value, double described, double countable, const std::string& key) {
    if (!std::isnan(value)) return;
    if (std::isnan(described)) return unlimited_.push_back(key);
    value = std::isfinite(described) ? described : std::copysign(countable, described);
  }

  void complete(JointConfig& joint, const JointDescription& found) {
    const std::string key = "joint." + joint.name;
    const double countable = countable_rad(joint);
    joint.slides = found.slides;
    fill_position(joint.min_position_rad, found.min_position_rad, countable, "min_position_rad");
    fill_position(joint.max_position_rad, found.max_position_rad, countable, "max_position_rad");
    check_limits(joint, key);
    check_followers(joint, key);
    fill(joint.max_velocity_rad_s, found.max_velocity_rad_s, "max_velocity_rad_s");
    fill(joint.max_torque_Nm, found.max_torque_Nm, "max_torque_Nm");
    report_unlimited(joint, found);
    if (!std::isfinite(joint.max_acceleration_rad_s2)) {
      joint.max_acceleration_rad_s2 = joint.max_velocity_rad_s / kFullSpeed_s;
    }
    if (joint.slides && joint.following_error_rad.line == 0) {
      joint.following_error_rad = slide_following_error_m(joint);
    }
    if (std::isnan(joint.rated_torque_Nm.value)) joint.rated_torque_Nm = joint.max_torque_Nm;
    if (joint.max_torque_Nm > 32.0 * joint.rated_torque_Nm) {
      error(joint.line, key + ".rated_torque_Nm",
            "max_torque_Nm is more than 32 times the rated torque, the range of the wire",
            "raise rated_torque_Nm");
    } else if (joint.rated_torque_Nm.of_sheet &&
               joint.rated_torque_Nm > kLikelyOverrated * joint.max_torque_Nm) {
      error(joint.line, key + ".rated_torque_Nm",
            fmt::format("6076 of the sheet of board '{}', in mNm and with the gear, is {:.10g} Nm, "
                        "{:.3g} times max_torque_Nm: is it in uNm there?",
                        joint.board, joint.rated_torque_Nm.value,
                        joint.rated_torque_Nm / joint.max_torque_Nm),
            fmt::format("set this key: to {:.10g} if the drive's 6076 is in uNm, to {:.10g} if it "
                        "is in mNm",
                        1e-3 * joint.rated_torque_Nm, joint.rated_torque_Nm.value));
    } else if (joint.rated_torque_Nm > 100.0 * joint.max_torque_Nm) {
      error(joint.line, key + ".rated_torque_Nm",
            "torques go over the wire in thousandths of it, and max_torque_Nm has less than ten "
            "of these steps",
            "it is in Nm, object 6076 in mNm; lower it");
    }
    check_torque_rate(joint, key + ".max_torque_rate_Nm_s");
    check_gains(joint);
    std::ranges::move(check_joint_scale(robot_, joint), std::back_inserter(errors_));
    std::ranges::move(check_drive_ranges(robot_, joint), std::back_inserter(errors_));
  }

  /// Slower than the full torque in a second nothing can be controlled, and 6087 has 32 bits.
  void check_torque_rate(const JointConfig& joint, const std::string& key) {
    if (!joint.max_torque_rate_Nm_s) return;
    const double most = 4.0e6 * joint.rated_torque_Nm;
    if (*joint.max_torque_rate_Nm_s < joint.max_torque_Nm) {
      error(joint.line, key, "the joint would need more than a second to its max_torque_Nm",
            "at least " + std::to_string(joint.max_torque_Nm));
    } else if (*joint.max_torque_rate_Nm_s > most) {
      error(joint.line, key, "is beyond the range of the wire",
            "at most " + std::to_string(most) + ", 4e6 times the rated torque");
    }
  }

  /// One message for each loop of a table, however many joints have it.
  void check_gains(const JointConfig& joint) {
    if (!(joint.max_torque_Nm > 0.0)) return;
    const GainsConfig& gains = robot_.gains_of(joint);
    const JointCapabilities can = capabilities_of(robot_, joint);
    for (const auto& [loop, config] : {std::pair{PidLoop::kPosition, &gains.position},
                                       {PidLoop::kVelocity, &gains.velocity},
                                       {PidLoop::kTorque, &gains.torque},
                                       {PidLoop::kCurrent, &gains.current}}) {
      const std::string problem = gains_problem(can, loop, config->gains);
      const std::string where = "gains." + gains.name + "." + to_string(loop);
      if (problem.empty() || std::ranges::count(errors_, where, &Error::key) > 0) continue;
      error(gains.line, where, problem, "correct the gain, or the limits of " + joint.name);
    }
  }

  void check_limits(const JointConfig& joint, const std::string& key) {
    if (joint.min_position_rad >= joint.max_position_rad) {
      error(joint.line, key + ".min_position_rad",
            "with the description's limits the position limits are reversed or equal",
            "give both min_position_rad and max_position_rad");
    }
  }

  void check_followers(const JointConfig& joint, const std::string& key) {
    for (const FollowerDescription& follower : description_.followers) {
      if (follower.leader != joint.name) continue;
      const bool low = joint.min_position_rad < follower.min_leader_rad;
      if (!low && !(joint.max_position_rad > follower.max_leader_rad)) continue;
      error(joint.line, key + (low ? ".min_position_rad" : ".max_position_rad"),
            "would take '" + follower.name + "', which mimics this joint, beyond its own limits",
            "stay within " + std::to_string(follower.min_leader_rad) + " to " +
                std::to_string(follower.max_leader_rad));
    }
  }

  void check(const PostureConfig& posture) {
    for (std::size_t i = 0; i < robot_.joints.size(); ++i) {
      const JointConfig& joint = robot_.joints[i];
      const double q = posture.position_rad[i];
      if (!(q < joint.min_position_rad) && !(q > joint.max_position_rad)) continue;
      error(posture.line, "posture." + posture.name + "." + joint.name,
            "is beyond the joint's limits " + std::to_string(joint.min_position_rad) + " to " +
                std::to_string(joint.max_position_rad),
            "move it inside");
    }
  }

  RobotConfig& completed_;
  std::vector<std::string> unlimited_;  // keys of the joint that is being completed
};

}  // namespace

Diagnostics check_names(const RobotConfig& robot, const RobotDescription& description,
                        const std::vector<JointReference>& loose) {
  return NameCheck(robot, description).run(loose);
}

Diagnostics check_names(const RobotConfig& robot, const std::vector<JointReference>& loose) {
  Diagnostics errors;
  for (const JointReference& one : loose) {
    errors.push_back(one.error);
    if (one.error.hint.empty()) {
      errors.back().hint = suggest(one.joint, names_of(robot.joints));
    }
  }
  return errors;
}

Diagnostics complete_from_description(RobotConfig& robot, const RobotDescription& description) {
  Diagnostics errors = check_names(robot, description);
  Diagnostics others = Completion(robot, description).run();
  errors.insert(errors.end(), others.begin(), others.end());
  return errors;
}

}  // namespace tandem::hal
