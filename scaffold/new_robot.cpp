// The steps of `tandem new` in order: description, base, posture, drives, right angles, wiring;
// each uses the results of those before.
#include "scaffold/new_robot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "base/open_file.hpp"
#include "base/quoting.hpp"
#include "hal/config/following_error.hpp"
#include "model/urdf.hpp"
#include "scaffold/standing.hpp"
#include "scaffold/steps.hpp"
#include "scaffold/strength.hpp"

namespace tandem::scaffold {
namespace {

constexpr double kControlPeriod_s = 1e-3;
constexpr double kMotorCounts = 1638400.0;
constexpr double kFirm = 0.6;  // needed_firmness() up to which legs are as firm as they should be
constexpr double kTold_m = 1e-4;

/// A slide that cannot carry what it bears, a suspension without a motor above all: it is locked.
struct Overload {
  std::string joint;
  double position = 0.0;
  Error told;
};

/// The joint that lets the root move, of errors of a description that was read as one that is
/// fixed; empty: there is none.
std::string floating_joint(const Diagnostics& errors) {
  constexpr std::string_view kKey = "joint ";
  for (const Error& error : errors) {
    if (error.message.find("of type 'floating' lets the base move") != std::string::npos)
      return error.key.starts_with(kKey) ? error.key.substr(kKey.size()) : error.key;
  }
  return {};
}

/// Such errors are no fault of the file.
bool wants_to_float(const Diagnostics& errors) { return !floating_joint(errors).empty(); }

/// Decides one thing after the other; each step may use what the steps before have found.
class Maker {
 public:
  explicit Maker(const Request& request) : request_(request) {}

  [[nodiscard]] const std::vector<Overload>& overloaded() const { return overloaded_; }

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
  void find_overloaded(const std::vector<double>& torques);
  void warn_of_weakness(const std::vector<JointLoad>& loads, const std::vector<double>& torques);
  Status check_down(const Posed& neutral, bool asked);
  void firm_up(const std::vector<JointLoad>& loads);
  void retune(const std::vector<JointLoad>& loads, const Tuning& tuning);
  void fill_model();
  void fill_drives();
  void fill_joints();
  void fill_posture(const std::string& name, double base_height_m);
  void fill_report();

  const Request& request_;
  std::string text_;  ///< of the description
  NewRobot robot_;
  std::optional<StandingPosture> standing_;
  Eigen::VectorXd q_;
  std::vector<Overload> overloaded_;
  std::string floating_;  ///< the description's floating joint at its root, or empty
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
  robot_.command =
      request_.command.empty() ? "tandem new " + shell_word(request_.urdf) : request_.command;
  Diagnostics fewest;
  for (const bool repair : {false, true}) {
    robot_.config.model.repair_inertia = repair;
    for (const bool floating : {false, true}) {
      auto found = read_tree(floating);
      if (!found && !floating) floating_ = floating_joint(found.error());
      if (!found) {
        const bool better =
            fewest.empty() || wants_to_float(fewest) || found.error().size() < fewest.size();
        const bool judged = repair && (fewest.empty() || !wants_to_float(found.error()));
        if (better && judged) fewest = found.error();
        continue;
      }
      if (!floating) floating_.clear();
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
  const bool asked = request_.base == Base::kFloating || !floating_.empty();
  const std::string lock = "--lock " + shell_word(floating_);
  if (!floating_.empty() && request_.base == Base::kFixed) {
    return fail("the description's root moves by the floating joint '" + floating_ + "'",
                "fix it by " + lock + ", or leave --base out, if the robot stands on feet");
  }
  if (request_.base != Base::kFixed && heavy) {
    robot_.feet = find_feet(robot_.tree, posed, FeetBy::kName);
    if (robot_.feet.empty() && asked) {
      robot_.feet = find_feet(robot_.tree, posed, FeetBy::kStructure);
      for (FoundFoot& foot : robot_.feet) {
        const std::string chosen = "no link is called a foot: this is one of the lowest ends";
        foot.guess = foot.guess.empty() ? chosen : chosen + "; " + foot.guess;
      }
    }
  }
  const bool floating = !robot_.feet.empty();
  if (!floating && asked) {
    const std::string& root = robot_.tree.bodies[0].name;
    const std::string hint = !floating_.empty()
                                 ? "fix the floating joint at its root by " + lock + "; or "
                                 : "give --base fixed, or leave --base out; or ";
    if (!heavy) {
      return fail("the root link '" + root + "' has no mass, so it cannot float",
                  hint + "give the link an <inertial>");
    }
    return fail("no link can be a foot, so a floating base would fall for ever",
                hint + "call the feet's links foot or sole");
  }
  const char* why = request_.base != Base::kAuto ? "as --base says"
                    : !floating_.empty()         ? "the description has a floating joint"
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
    if (Status upright = check_down(posed, asked); !upright) return upright;
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

Status Maker::check_down(const Posed& neutral, bool asked) {
  const Eigen::Vector3d down = direction_down(robot_.tree, robot_.feet, neutral);
  if (down.z() < -0.5) return {};
  const Eigen::Vector3d ahead = direction_ahead_of(robot_.tree, robot_.feet, neutral, down);
  Error error = lies(robot_.tree.links[0].name, down, ahead);
  if (!asked) return std::unexpected(std::move(error));
  error.file = request_.urdf;
  robot_.warnings.push_back(std::move(error));
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
  if (const double beside_m = standing_->beside_m(); beside_m > kTold_m) {
    robot_.remarks.push_back(
        fmt::format("The centre of mass is {:.2g} mm beside the middle of the feet: the legs have "
                    "no joints to shift it over level soles.",
                    1e3 * beside_m));
  }
  return {};
}

Status Maker::choose_drives() {
  const std::optional<Posed> stance =
      standing_ ? std::optional<Posed>(std::in_place, robot_.tree, q_) : std::nullopt;
  std::vector<JointLoad> loads = loads_of(robot_.tree, robot_.feet, stance ? &*stance : nullptr);
  const std::vector<double> torques = torques_at(robot_.tree, robot_.feet, Posed(robot_.tree, q_));
  for (std::size_t j = 0; j < loads.size(); ++j)
    if (loads[j].fall_Nm_rad > 0.0) loads[j].stand_Nm = std::abs(torques[j]);
  robot_.limits = limits_of(robot_.tree, loads);
  if (std::string replaced = replaced_limits(robot_.tree, robot_.limits); !replaced.empty())
    robot_.remarks.push_back(std::move(replaced));
  if (request_.like != nullptr) {
    robot_.like = request_.like->config.name;
    robot_.scale = scale_of(robot_.tree, request_.like->tree);
    take_drives(*request_.like, loads, torques, kControlPeriod_s, robot_);
  } else {
    robot_.drives = size_drives(robot_.tree, robot_.limits);
    if (request_.dynamics) add_described_dynamics(robot_);
    robot_.gains = tune(robot_.drives, loads, {.period_s = kControlPeriod_s});
  }
  robot_.sensors = find_sensors(robot_.tree, text_);
  fill_model();
  fill_joints();
  find_overloaded(torques);
  if (!standing_) {
    fill_posture("ready", 0.0);
    robot_.move = swing(robot_, q_);
    warn_of_weakness(loads, torques);
    return {};
  }
  settle_balls(robot_.ahead, *stance, robot_.feet);
  standing_->stay_on(robot_.feet);
  robot_.move = squat_and_swing(robot_, *standing_);
  fill_ground(request_.like == nullptr ? nullptr : &request_.like->config, robot_);
  if (request_.like == nullptr) firm_up(loads);
  robot_.stands_m = standing_->height_m();
  robot_.stands_share = standing_->height_m() / standing_->greatest_height_m();
  fill_posture("stand", robot_.stands_m);
  warn_of_weakness(loads, torques);
  return {};
}

/// Ankles, knees and hips that give way one after the other need more than each one alone; last of
/// all, the position loop may be nearer to the velocity loop. Integrals are for the stiffness that
/// all of them have together.
void Maker::firm_up(const std::vector<JointLoad>& loads) {
  Tuning tuning{.period_s = kControlPeriod_s};
  double needed = needed_firmness(robot_, q_).value_or(0.0);
  for (const auto& [fall_margin, cascade] :
       {std::pair{4.5, 4.0}, {7.0, 4.0}, {10.0, 4.0}, {10.0, 3.0}, {15.0, 2.5}, {20.0, 2.0}}) {
    if (needed <= kFirm) break;
    tuning.fall_margin = fall_margin;
    tuning.cascade = cascade;
    retune(loads, tuning);
    needed = needed_firmness(robot_, q_).value_or(0.0);
  }
  if (!(needed > 0.5)) return;  // else the reserve is as large as it is taken to be
  tuning.reserve = std::max(0.0, 1.0 / needed - 1.0);
  retune(loads, tuning);
}

void Maker::retune(const std::vector<JointLoad>& loads, const Tuning& tuning) {
  robot_.gains = tune(robot_.drives, loads, tuning);
  robot_.config.actuators.clear();
  robot_.config.gains.clear();
  robot_.config.joints.clear();
  fill_drives();
  fill_joints();
}

void Maker::find_overloaded(const std::vector<double>& torques) {
  for (const hal::JointConfig& joint : robot_.config.joints) {
    const int index = robot_.tree.joint_index(joint.name);
    const auto j = static_cast<std::size_t>(index);
    const double bears_N = std::abs(torques[j]);
    if (!joint.slides || robot_.limits[j].effort_guessed || bears_N <= joint.max_torque_Nm)
      continue;
    overloaded_.push_back(
        {joint.name,
         std::round(q_[index] * 1e4) / 1e4,
         {.message = fmt::format("it bears {:.4g} N, and its <limit effort> is {:.4g} N: it is "
                                 "locked, as a suspension without a motor is to be",
                                 bears_N, joint.max_torque_Nm),
          .hint = "to have it moved, correct the effort, and make the robot anew",
          .file = robot_.tree.file,
          .line = robot_.tree.joints[j].line,
          .key = "joint " + joint.name}});
  }
}

void Maker::warn_of_weakness(const std::vector<JointLoad>& loads,
                             const std::vector<double>& torques) {
  std::ranges::move(undriven(robot_), std::back_inserter(robot_.warnings));
  Diagnostics weak = weak_drives(robot_, torques);
  if (const auto burden = overburdened(robot_, loads)) {
    const bool still = !robot_.move.swings && robot_.move.squat_m == 0.0;
    std::string remark = burden->told.message + (still ? "; move.toml keeps still." : ".");
    remark[0] = 'T';
    robot_.remarks.push_back(std::move(remark));
    if (burden->grams || weak.empty()) robot_.warnings.push_back(burden->told);
    if (burden->grams) return;  // all else is wrong because of it
  }
  std::ranges::move(weak, std::back_inserter(robot_.warnings));
  if (!standing_) return;
  if (auto warning = falls_over(robot_, q_)) robot_.warnings.push_back(std::move(*warning));
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
  fill_drives();
}

void Maker::fill_drives() {
  for (const DriveSize& drive : robot_.drives) robot_.config.actuators.push_back(drive.actuator);
  for (const GainSet& set : robot_.gains) robot_.config.gains.push_back(set.gains);
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
  Request own = request;
  Diagnostics told;
  for (std::optional<NewRobot> robot;;) {
    Maker maker(own);
    auto made = maker.run();
    if (!made && robot) return std::move(*robot);  // nothing would be left that moves
    if (!made) return made;
    robot = std::move(*made);
    for (const Error& one : told) {
      robot->warnings.push_back(one);
      robot->remarks.push_back(fmt::format("{}: {}.", one.key, one.message));
    }
    if (maker.overloaded().empty()) return std::move(*robot);
    for (const Overload& one : maker.overloaded()) {
      own.lock.emplace_back(one.joint, one.position);
      told.push_back(one.told);
    }
  }
}

}  // namespace tandem::scaffold
