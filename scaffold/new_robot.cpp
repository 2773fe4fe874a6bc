// The steps of `tandem new` in order: description, base, posture, drives, right angles, wiring;
// each uses the results of those before.
#include "scaffold/new_robot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "base/open_file.hpp"
#include "hal/config/following_error.hpp"
#include "model/urdf.hpp"
#include "scaffold/described_damping.hpp"
#include "scaffold/firmness.hpp"
#include "scaffold/ground.hpp"
#include "scaffold/like.hpp"
#include "scaffold/moves.hpp"
#include "scaffold/standing.hpp"
#include "scaffold/strength.hpp"
#include "scaffold/wiring.hpp"

namespace tandem::scaffold {
namespace {

constexpr double kControlPeriod_s = 1e-3;
constexpr double kMotorCounts = 1638400.0;

/// Errors of a description whose root moves, read as one that is fixed: no fault of the file.
bool wants_to_float(const Diagnostics& errors) {
  return std::ranges::any_of(errors, [](const Error& error) {
    return error.message.find("of type 'floating' lets the base move") != std::string::npos;
  });
}

/// Decides one thing after the other; each step may use what the steps before have found.
class Maker {
 public:
  explicit Maker(const Request& request) : request_(request) {}

  std::expected<NewRobot, Diagnostics> run() {
    if (Diagnostics errors = read(); !errors.empty()) return std::unexpected(errors);
    for (const auto step : {&Maker::choose_base, &Maker::choose_posture, &Maker::choose_drives,
                            &Maker::look_at_angles, &Maker::wire_up}) {
      if (Status done = (this->*step)(); !done) {
        Error error = done.error();
        error.file = request_.urdf;
        return std::unexpected(Diagnostics{error});
      }
    }
    return std::move(robot_);
  }

 private:
  using Tree = model::Tree;

  Diagnostics read();
  Diagnostics take(model::UrdfModel found);
  [[nodiscard]] std::expected<model::UrdfModel, Diagnostics> read_tree(bool floating,
                                                                       bool exact = false) const;
  void narrow_to_soft_limits();
  Status choose_base();
  Status choose_posture();
  Status choose_drives();
  Status look_at_angles();
  Status wire_up();
  void warn_of_weakness(const std::vector<double>& torques);
  void fill_model();
  void fill_joints();
  void fill_posture(const std::string& name, double base_height_m);
  void fill_report();

  const Request& request_;
  std::string text_;  ///< of the description
  NewRobot robot_;
  Outfit outfit_;
  std::optional<Standing> standing_;
  Eigen::VectorXd q_;
  bool must_float_ = false;  ///< the description has a floating joint at its root
};

std::expected<model::UrdfModel, Diagnostics> Maker::read_tree(bool floating, bool exact) const {
  return model::parse_urdf(text_, request_.urdf,
                           {.floating_base = floating,
                            .lock = request_.lock,
                            .repair_inertia = robot_.config.model.repair_inertia,
                            .exact_right_angles = exact});
}

/// As it stands if that is possible; else with what the reader offers to make it so. What that
/// mends is no error here.
Diagnostics Maker::read() {
  text_ = request_.text;
  if (text_.empty()) {
    auto text = read_file(request_.urdf, "name a .urdf file", kMostUrdfBytes);
    if (!text) return {Error{text.error().message, text.error().hint, request_.urdf, 0, {}}};
    text_ = std::move(*text);
  }
  robot_.config.model.lock = request_.lock;
  Diagnostics fewest;
  for (const bool repair : {false, true}) {
    robot_.config.model.repair_inertia = repair;
    for (const bool floating : {false, true}) {
      auto found = read_tree(floating);
      if (!found) {
        const bool better =
            fewest.empty() || wants_to_float(fewest) || found.error().size() < fewest.size();
        const bool judged = repair && (fewest.empty() || !wants_to_float(found.error()));
        if (better && judged) fewest = found.error();
        continue;
      }
      must_float_ = floating;
      return take(std::move(*found));
    }
  }
  return fewest;
}

Diagnostics Maker::take(model::UrdfModel found) {
  if (found.tree.joints.empty()) {
    return {Error{
        "the robot has no joint that moves", "name another description", request_.urdf, 0, {}}};
  }
  robot_.tree = std::move(found.tree);
  robot_.warnings = std::move(found.warnings);
  robot_.right_angles = found.right_angles;
  for (const model::Joint& joint : robot_.tree.joints) {
    if (!joint.follows()) continue;
    robot_.remarks.push_back(fmt::format("{} follows {} and has no drive: <mimic>.", joint.name,
                                         robot_.tree.joints[joint.leader].name));
  }
  if (!found.limits_notes.empty()) {
    const auto& [joint, note] = *found.limits_notes.begin();
    const std::size_t more = found.limits_notes.size() - 1;
    robot_.remarks.push_back(fmt::format("Limits are guessed: {} (joint {}){}.", note, joint,
                                         more == 0 ? "" : fmt::format(", and of {} more", more)));
  }
  robot_.extras = model::joint_extras(text_);
  narrow_to_soft_limits();
  outfit_ = read_outfit(text_);
  return {};
}

/// From here on the soft limits are the joints' limits.
void Maker::narrow_to_soft_limits() {
  for (model::Joint& joint : robot_.tree.joints) {
    const auto own = robot_.extras.find(joint.name);
    if (own == robot_.extras.end()) continue;
    // fmax() and fmin() pass over limits that are not there.
    const double lower = std::fmax(joint.lower, own->second.soft_lower);
    const double upper = std::fmin(joint.upper, own->second.soft_upper);
    if (!(lower < upper)) continue;
    if (lower == joint.lower) own->second.soft_lower = model::JointExtras::kNone;
    if (upper == joint.upper) own->second.soft_upper = model::JointExtras::kNone;
    joint.lower = lower;
    joint.upper = upper;
  }
}

Status Maker::choose_base() {
  const Posed posed(robot_.tree, neutral_posture(robot_.tree));
  const bool heavy = robot_.tree.bodies[0].inertia.mass_kg > 0.0;
  const bool asked = request_.base == Base::kFloating || must_float_;
  if (must_float_ && request_.base == Base::kFixed) {
    return fail("the description's root moves by a floating joint",
                "leave --base out, or make that joint fixed");
  }
  if (request_.base != Base::kFixed && heavy) {
    robot_.feet = find_feet(robot_.tree, posed, FeetBy::kName);
    if (robot_.feet.empty() && asked) {
      robot_.feet = find_feet(robot_.tree, posed, FeetBy::kStructure);
      for (Foot& foot : robot_.feet) {
        const std::string chosen = "no link is called a foot: this is one of the lowest ends";
        foot.guess = foot.guess.empty() ? chosen : chosen + "; " + foot.guess;
      }
    }
  }
  const bool floating = !robot_.feet.empty();
  if (!floating && asked) {
    const std::string& root = robot_.tree.bodies[0].name;
    const std::string hint = must_float_ ? "" : "give --base fixed, or leave --base out; or ";
    if (!heavy) {
      return fail("the root link '" + root + "' has no mass, so it cannot float",
                  hint + "give the link an <inertial>");
    }
    return fail("no link can be a foot, so a floating base would fall for ever",
                hint + "call the feet's links foot or sole");
  }
  const char* why = request_.base != Base::kAuto ? "as --base says"
                    : must_float_                ? "the description has a floating joint"
                    : floating                   ? "there are feet by name"
                                                 : "no link is called a foot";
  robot_.remarks.push_back(
      fmt::format("The base is {}: {}.", floating ? "floating" : "fixed", why));
  if (floating) {  // a base that moves changes what the reader has to refuse
    auto found = read_tree(true);
    if (!found && !robot_.config.model.repair_inertia) {
      robot_.config.model.repair_inertia = true;
      found = read_tree(true);
    }
    if (!found) return std::unexpected(found.error().front());
    robot_.tree = std::move(found->tree);
    robot_.warnings = std::move(found->warnings);
    narrow_to_soft_limits();
    robot_.ahead = direction_ahead(robot_.feet, posed);
    face_ahead(robot_.ahead, posed, robot_.feet);
  }
  if (robot_.config.model.repair_inertia) {
    robot_.remarks.push_back("Impossible inertias are replaced by the nearest possible ones.");
  }
  robot_.limbs = split_limbs(robot_.tree, robot_.feet, posed, robot_.ahead);
  robot_.mass_kg = 0.0;
  for (std::size_t b = floating ? 0 : 1; b < robot_.tree.bodies.size(); ++b) {
    robot_.mass_kg += robot_.tree.bodies[b].inertia.mass_kg;
  }
  return {};
}

Status Maker::choose_posture() {
  if (robot_.feet.empty()) {
    q_ = waiting_posture(robot_.tree);
    return {};
  }
  standing_.emplace(robot_.tree, robot_.feet, robot_.ahead, spared_posture(robot_.tree));
  if (Status found = standing_->find(); !found) return found;
  q_ = standing_->q();
  return {};
}

Status Maker::choose_drives() {
  const std::optional<Posed> stance =
      standing_ ? std::optional<Posed>(std::in_place, robot_.tree, q_) : std::nullopt;
  const std::vector<JointLoad> loads =
      loads_of(robot_.tree, robot_.feet, stance ? &*stance : nullptr);
  const std::vector<double> torques = torques_at(robot_.tree, robot_.feet, Posed(robot_.tree, q_));
  robot_.limits = limits_of(robot_.tree, loads);
  if (request_.like != nullptr) {
    robot_.like = request_.like->config.name;
    robot_.scale = scale_of(robot_.tree, request_.like->tree);
    take_drives(*request_.like, loads, torques, kControlPeriod_s, robot_);
  } else {
    robot_.drives = size_drives(robot_.tree, robot_.limits);
    if (request_.damping) add_described_damping(robot_);
    robot_.gains = tune(robot_.drives, loads, kControlPeriod_s);
  }
  robot_.sensors = find_sensors(robot_.tree, outfit_);
  fill_model();
  fill_joints();
  if (!standing_) {
    fill_posture("ready", 0.0);
    robot_.move = swing(robot_, q_);
    warn_of_weakness(torques);
    return {};
  }
  settle_balls(robot_.ahead, *stance, robot_.feet);
  standing_->stay_on(robot_.feet);
  robot_.move = squat_and_swing(robot_, *standing_);
  fill_ground(request_.like == nullptr ? nullptr : &request_.like->config, robot_);
  robot_.stands_m = standing_->height_m();
  robot_.stands_share = standing_->height_m() / standing_->greatest_height_m();
  fill_posture("stand", robot_.stands_m);
  warn_of_weakness(torques);
  if (auto warning = falls_over(robot_, q_)) robot_.warnings.push_back(std::move(*warning));
  return {};
}

void Maker::warn_of_weakness(const std::vector<double>& torques) {
  std::ranges::move(weak_drives(robot_, torques), std::back_inserter(robot_.warnings));
}

/// How far the robot would move if its right angles were exact.
Status Maker::look_at_angles() {
  if (robot_.right_angles.count == 0) return {};
  const auto exact = read_tree(robot_.tree.floating_base, true);
  if (!exact) return std::unexpected(exact.error().front());
  robot_.turned = model::largest_displacement(robot_.tree, exact->tree);
  return {};
}

Status Maker::wire_up() {
  fill_report();
  return wire(robot_);
}

void Maker::fill_model() {
  hal::RobotConfig& config = robot_.config;
  config.name = request_.name;
  config.model.urdf = request_.urdf;
  config.model.floating_base = robot_.tree.floating_base;
  for (const DriveSize& drive : robot_.drives) config.actuators.push_back(drive.actuator);
  for (const GainSet& set : robot_.gains) config.gains.push_back(set.gains);
}

void Maker::fill_joints() {
  hal::RobotConfig& config = robot_.config;
  for (const Limb& limb : robot_.limbs) {
    for (const int j : limb.joints) {
      const JointLimits& limit = robot_.limits[j];
      hal::JointConfig joint;
      joint.name = robot_.tree.joints[j].name;
      const auto serves = [&](const auto& group) {
        return std::ranges::count(group.joints, j) > 0;
      };
      joint.actuator = std::ranges::find_if(robot_.drives, serves)->actuator.name;
      joint.gains = std::ranges::find_if(robot_.gains, serves)->gains.name;
      joint.min_position_rad = limit.range.lower;
      joint.max_position_rad = limit.range.upper;
      joint.max_torque_Nm = joint.rated_torque_Nm = limit.effort;
      joint.max_velocity_rad_s = limit.velocity;
      if (const auto own = robot_.extras.find(joint.name); own != robot_.extras.end()) {
        if (own->second.acceleration > 0.0) {
          joint.max_acceleration_rad_s2 = own->second.acceleration;
        }
        if (own->second.jerk > 0.0) joint.max_jerk_rad_s3 = own->second.jerk;
      }
      joint.encoder_counts_per_rev = kEncoderCounts;
      joint.motor_encoder_counts_per_rev = kMotorCounts;
      joint.slides = robot_.tree.joints[j].type == model::JointType::kPrismatic;
      if (joint.slides) joint.following_error_rad = hal::slide_following_error_m(joint);
      config.joints.push_back(std::move(joint));
    }
  }
}

void Maker::fill_posture(const std::string& name, double base_height_m) {
  hal::PostureConfig posture;
  posture.name = name;
  posture.base_height_m = base_height_m;
  for (const hal::JointConfig& joint : robot_.config.joints) {
    posture.position_rad.push_back(q_[robot_.tree.joint_index(joint.name)]);
  }
  robot_.config.postures.push_back(std::move(posture));
}

/// A leg's hip and knee, or the first two joints of the first limb.
void Maker::fill_report() {
  std::vector<int> joints = standing_ ? standing_->hip_and_knee() : std::vector<int>{};
  if (joints.empty()) joints = robot_.limbs.front().joints;
  if (joints.size() > 2) joints.resize(2);
  for (const int j : joints) robot_.report.push_back(robot_.tree.joints[j].name);
}

}  // namespace

std::expected<NewRobot, Diagnostics> make_robot(const Request& request) {
  return Maker(request).run();
}

}  // namespace tandem::scaffold
