// Recordings to equations: what can be used of them, and whether it is enough.
#include "identification/identify.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "identification/answer.hpp"
#include "identification/estimate.hpp"
#include "identification/low_pass.hpp"
#include "log/log_file.hpp"

namespace tandem::identification {
namespace {

constexpr double kShortest_s = 5.0;
// A log in which no joint moves by more is of a robot that stands: weight, offsets and stiction are
// one and the same there.
constexpr double kStands_rad = 0.1, kStands_m = 0.02;

bool stands(const hal::RobotConfig& robot, const IdentifiedRobot& identified,
            const Equations& equations) {
  for (std::size_t c = 0; c < equations.travel_rad.size(); ++c) {
    const auto joint = static_cast<std::size_t>(identified.facts.joint[c]);
    const double least = robot.joints[joint].slides ? kStands_m : kStands_rad;
    if (equations.travel_rad[c] > least) return false;
  }
  return true;
}

/// Where the intervals are known to be too narrow, and which ones allow for what.
void warn_of_intervals(const std::vector<Recording>& recordings, const IdentifiedRobot& identified,
                       double cutoff_Hz, Identification& out) {
  if (cutoff_Hz != kCutoff_Hz) {
    out.warnings.push_back(fmt::format(
        "the intervals were checked with a cut-off of {} Hz only, not with {} Hz: do not trust "
        "them. A higher one lets through errors of timing and of the model that are not in them, a "
        "lower one loses motion",
        kCutoff_Hz, cutoff_Hz));
  }
  const double hold_s = std::ranges::max(recordings, {}, &Recording::unknown_hold_s).unknown_hold_s;
  if (!(hold_s > 0.0)) return;
  std::string names, rigid;  // whose rotors the data show, and all without a spring
  for (std::size_t c = 0; c < identified.facts.joint.size(); ++c) {
    if (!identified.facts.rigid[c]) continue;
    const JointResult& joint = out.joints[static_cast<std::size_t>(identified.facts.joint[c])];
    rigid += (rigid.empty() ? "" : ", ") + joint.name;
    if (!joint.rotor_inertia_kg_m2.identifiable) continue;
    names += (names.empty() ? "" : ", ") + joint.name;
  }
  if (!rigid.empty() && std::ranges::any_of(recordings, &Recording::out_of_step)) {
    out.warnings.push_back(
        "the boards' control has another period than the log: what these joints' torques do "
        "between two samples is not known, and no interval allows for it. Do not trust their "
        "rotors and friction, nor what they carry; make both periods equal: " +
        rigid);
  }
  if (names.empty()) return;
  out.remarks.push_back(fmt::format(
      "the log does not say for how long a motor's voltage was held. During a hold the back-EMF "
      "looks like rotor inertia, and a sample at its end is not the mean. So the intervals of "
      "these joints' rotors, and of six-axis sensors behind them, allow for a hold of up to "
      "{:.3g} ms: {}",
      1e3 * hold_s, names));
}

/// What was left out of a recording.
void note_left_out(const Recording& recording, bool one_of_several, bool floating,
                   Identification& out) {
  for (const std::string& remark : recording.remarks)
    out.remarks.push_back(one_of_several ? recording.path + ": " + remark : remark);
  out.left_out.insert(out.left_out.end(), recording.left_out.begin(), recording.left_out.end());
  if (!recording.hangs || !floating) return;
  out.remarks.push_back(recording.path +
                        ": the robot hangs from a hoist, whose force is not known: the base's "
                        "equations are left out");
}

/// All equations anew.
Status make_equations(const std::vector<Recording>& recordings, double cutoff_Hz,
                      IdentifiedRobot& identified, Equations& equations,
                      const Eigen::VectorXd& assumed = {}) {
  equations = Equations{};
  for (const Recording& recording : recordings) {
    const Status s = add_equations(recording, cutoff_Hz, identified, equations, assumed);
    if (!s) return s;
  }
  return {};
}

// What the data say of a described rotor.
constexpr double kSureDeviations = 3.0;  // standard deviations
constexpr double kNoShare = 0.05;        // of the described rotor: as good as none
constexpr double kLittleShare = 0.1;     // more than that is not what was found
constexpr double kOppositeShare = -0.5;  // less than that is a torque of the other sign

enum class RotorFound : std::uint8_t { kNothing, kRotor, kNoRotor };

RotorFound look_for_rotor(double described, double estimate, double deviation) {
  const double doubt = kSureDeviations * deviation / described, share = estimate / described;
  if (share - doubt > kNoShare) return RotorFound::kRotor;
  const bool little = share < std::max(kNoShare, doubt) && share + doubt < kLittleShare;
  if (little && share > kOppositeShare) return RotorFound::kNoRotor;
  return RotorFound::kNothing;
}

/// Whether each coordinate's torques hold nothing of its described rotor, as those of a
/// sensor between gear and link do. The data say so where they know the rotor within a tenth of
/// its description and find none; where they cannot say, it is as with the other joints, if these
/// agree. No where the drive has a spring: then the rotor is behind it.
/// @param equations  of all logs, whose rotors are in the links' rows
std::vector<bool> measured_behind_rotors(IdentifiedRobot& robot, const model::Tree& tree,
                                         const Equations& equations) {
  // The hold of a voltage, if there is one, looks like a tenth of a rotor or two: that is doubted
  // of a value, and no reason to doubt this.
  Equations undoubted = equations;
  for (ChannelRows& channel : undoubted.channels) channel.doubt.clear();
  const DataEstimate data =
      estimate_from_data(undoubted, std::vector<bool>(equations.time_s.size(), true),
                         make_prior(robot), structural_base(robot, tree));
  const std::size_t joints = robot.facts.joint.size();
  std::vector<RotorFound> found(joints, RotorFound::kNothing);
  for (std::size_t c = 0; c < joints; ++c) {
    const double described = robot.facts.rotor_kg_m2[c];
    if (!robot.facts.rigid[c] || !(described > 0.0)) continue;
    const Eigen::Index at = robot.regressor.columns() +
                            kJointColumns * static_cast<Eigen::Index>(c) +
                            static_cast<Eigen::Index>(JointColumn::kRotor);
    found[c] = look_for_rotor(described, data.mean[at], std::sqrt(data.link_covariance(at, at)));
  }
  const bool any = std::ranges::find(found, RotorFound::kNoRotor) != found.end();
  const bool agree = std::ranges::find(found, RotorFound::kRotor) == found.end();
  std::vector<bool> behind(joints, false);
  for (std::size_t c = 0; c < joints; ++c) {
    behind[c] = robot.facts.rigid[c] && (found[c] == RotorFound::kNoRotor ||
                                         (any && agree && found[c] == RotorFound::kNothing));
  }
  return behind;
}

/// A log of a real robot does not say whether its torques are the motors' or those of sensors
/// behind the rotors. The data do: an arm of this kind was explained badly, with described rotors
/// of 0.5 kg m2 that its torques knew nothing of.
Status find_torque_place(const std::vector<Recording>& recordings, const model::Tree& tree,
                         double cutoff_Hz, IdentifiedRobot& identified, Equations& equations,
                         Identification& out) {
  const bool recorded = std::ranges::all_of(recordings, [](const Recording& recording) {
    return recording.unknown_hold_s > 0.0 && !recording.out_of_step;
  });
  RobotFacts& facts = identified.facts;
  const bool rigid = std::ranges::find(facts.rigid, true) != facts.rigid.end();
  if (!recorded || !rigid) return {};
  facts.behind_rotor = measured_behind_rotors(identified, tree, equations);
  std::string names;
  for (std::size_t c = 0; c < facts.rigid.size(); ++c) {
    if (!facts.behind_rotor[c]) continue;
    facts.rigid[c] = false;
    names += (names.empty() ? "" : ", ") + identified.regressor.coordinates()[c];
  }
  if (names.empty()) return {};
  out.remarks.push_back(
      "these joints' torques hold nothing of their rotors, as those of sensors between gear and "
      "link: the rotors stay as described: " +
      names);
  return make_equations(recordings, cutoff_Hz, identified, equations);
}

/// Held voltages are corrected by the robot's inertia: once more by the one that was found.
Status refine_holds(const std::vector<Recording>& recordings, const hal::RobotConfig& robot,
                    const model::Tree& tree, double cutoff_Hz, IdentifiedRobot& identified,
                    Equations& equations) {
  const auto& rigid = identified.facts.rigid;
  const bool held = std::ranges::any_of(
      recordings, [](const Recording& recording) { return recording.voltage_hold_s > 0.0; });
  if (!held || std::ranges::find(rigid, true) == rigid.end()) return {};
  const Eigen::VectorXd found = fitted(robot, tree, identified, equations);
  return make_equations(recordings, cutoff_Hz, identified, equations, found);
}

/// A torque with the wrong sign is 200 % of itself away from every description of the robot.
void warn_of_signs(Identification& out) {
  std::size_t opposite = 0, known = 0;
  for (const JointResult& joint : out.joints) {
    if (!std::isfinite(joint.described_relative_error)) continue;
    ++known;
    opposite += std::abs(joint.described_relative_error - 2.0) < 0.2 ? 1 : 0;
  }
  if (known == 0 || 2 * opposite <= known) return;
  out.warnings.push_back(fmt::format(
      "of {} of {} joints the torques are about the opposite of what the description says: they "
      "may have the other sign (a positive torque moves its joint towards positive positions). "
      "Then nothing of this result is true: record or import them with the right sign",
      opposite, known));
}

}  // namespace

double shortest_motion_s(double cutoff_Hz) {
  constexpr double kPeriod_s = 1e-3;
  const LowPass filter(kPeriod_s, cutoff_Hz);
  const double whole = kShortest_s + 2.0 * kPeriod_s * static_cast<double>(filter.reach());
  return std::ceil(10.0 * whole) / 10.0;
}

Result<Identification> identify(const std::vector<Recording>& recordings,
                                const hal::RobotConfig& robot, const model::Tree& tree,
                                double cutoff_Hz) {
  auto identified = make_identified_robot(tree, robot);
  if (!identified) return std::unexpected(identified.error());
  Equations equations;
  Identification out;
  for (const Recording& recording : recordings)
    note_left_out(recording, recordings.size() > 1, identified->floating, out);
  if (const Status s = make_equations(recordings, cutoff_Hz, *identified, equations); !s)
    return std::unexpected(s.error());
  if (equations.usable_s < kShortest_s) {
    const std::string why = out.remarks.empty() ? "" : "; " + out.remarks.front();
    return std::unexpected(
        Error{fmt::format("too short to identify anything: {:.1f} s can be used, {} s are needed{}",
                          equations.usable_s, kShortest_s, why),
              "`tandem excite` writes an experiment that moves the robot for long enough",
              recordings.empty() ? "" : recordings.front().path,
              0,
              {}});
  }
  if (stands(robot, *identified, equations)) {
    return std::unexpected(
        Error{fmt::format("the joints hardly move: nothing can be said of their masses (no joint "
                          "moves by {} rad or {} mm)",
                          kStands_rad, 1e3 * kStands_m),
              "`tandem excite` writes an experiment that moves them",
              recordings.front().path,
              0,
              {}});
  }
  if (equations.held_s > 0.0) {
    out.warnings.push_back(fmt::format(
        "for {:.1f} s something else than the measured feet seems to carry the robot, or push it: "
        "the base's equations are left out there. Of a robot that hangs on purpose the experiment "
        "should say so: [sim] hoist.lift_m",
        equations.held_s));
  }
  if (const Status s = find_torque_place(recordings, tree, cutoff_Hz, *identified, equations, out);
      !s) {
    return std::unexpected(s.error());
  }
  if (const Status s = refine_holds(recordings, robot, tree, cutoff_Hz, *identified, equations); !s)
    return std::unexpected(s.error());
  answer(robot, tree, *identified, equations, out);
  warn_of_signs(out);
  warn_of_intervals(recordings, *identified, cutoff_Hz, out);
  return out;
}

Result<Identification> identify(const std::vector<std::string>& logs, const hal::RobotConfig& robot,
                                const model::Tree& tree, double cutoff_Hz) {
  std::vector<Recording> recordings;
  for (const std::string& path : logs) {
    auto recording = read_recording(path, robot);
    if (!recording) return std::unexpected(recording.error());
    const auto twin =
        std::ranges::find(recordings, recording->data_sha256, &Recording::data_sha256);
    if (twin != recordings.end()) return std::unexpected(log::same_data(path, twin->path));
    recordings.push_back(std::move(*recording));
  }
  return identify(recordings, robot, tree, cutoff_Hz);
}

}  // namespace tandem::identification
