// Identification of a robot from logs. Start here.
// Layer: identification.  Thread: non-RT only.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "base/result.hpp"
#include "hal/config/robot_config.hpp"
#include "identification/base_parameters.hpp"
#include "identification/samples.hpp"
#include "model/tree.hpp"

namespace tandem::identification {

/// The cut-off of the low pass over every signal, unless one asks for another.
inline constexpr double kCutoff_Hz = 10.0;

/// A number with half the width of its 95 % confidence interval, from the data alone. `ci95` is NaN
/// where the data say nothing.
struct Estimate {
  double value = 0.0;
  double ci95 = 0.0;
  /// The data give it: to within 30 % of its scale. A base parameter's is what the description
  /// would be wrong by, as kBelieved says.
  bool identifiable = false;
};

/// How a link's quantity shows in the equations, whatever the log holds: no motion changes it.
enum class Seen : std::uint8_t {
  kNot,     ///< no equation depends on it
  kInSums,  ///< only in sums with parameters of other links or of rotors: base parameters
  kAlone,   ///< by itself
};
[[nodiscard]] const char* to_string(Seen seen) noexcept;  ///< "not", "in sums", "alone"

/// A link of the description, in its own frame. What was not identifiable is as described, or what
/// fits the others best: the dynamics are those of the base parameters either way.
struct LinkResult {
  std::string name;
  model::Inertia described, identified;
  // By the data, and as far as these leave a choice by the description, believed as kBelieved says.
  // Identifiable: within 30 % of the mass, of the radius of gyration, of the largest moment, every
  // component; and a third less than the description has by itself.
  double mass_ci95 = 0.0;
  Eigen::Vector3d com_ci95;                  ///< [m]
  Eigen::Matrix<double, 6, 1> inertia_ci95;  ///< ixx ixy ixz iyy iyz izz about the com [kg m^2]
  bool mass_identifiable = false, com_identifiable = false, inertia_identifiable = false;
  Seen mass_seen = Seen::kNot, com_seen = Seen::kNot, inertia_seen = Seen::kNot;
  std::vector<std::string> base_parameters;  ///< names of those with a parameter of this link
  bool changed = false;  ///< it is the heaviest of its piece: only such are changed
};

/// A joint. Friction and offset are the sum of what is lost between the motor's current and the
/// measured torque, and between that and the motion. Not identifiable: NaN.
struct JointResult {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  std::string name;
  bool slides = false;
  bool behind_rotor = false;  ///< the torques hold nothing of the rotor, though there is no spring
  Estimate viscous_Nms_rad, coulomb_Nm, rotor_inertia_kg_m2, offset_Nm;
  Estimate link_viscous_Nms_rad, link_coulomb_Nm;    ///< the share behind the torque measurement
  Estimate motor_viscous_Nms_rad, motor_coulomb_Nm;  ///< the share before it
  double delay_s = 0.0;              ///< by which the torque is sampled later than the position
  double rms_Nm = kUnknown;          ///< of the residual, on held-out data; NaN without
  double relative_error = kUnknown;  ///< over the torque, both as RMS; NaN without held-out data
  double described_rms_Nm = kUnknown,
         described_relative_error = kUnknown;  ///< of the description alone
  // On the held-out data:
  std::vector<double> time_s, measured_Nm, described_Nm, identified_Nm;
  std::vector<std::size_t> first_of_log;  ///< where each log's part begins; it may be empty
};

/// One combination of parameters that the robot's motion shows.
struct BaseParameter {
  std::string name;  ///< of the parameter that it stands for: its factor is 1
  std::vector<std::pair<std::string, double>> terms;  ///< "LINK.hx_kg_m" and its factor
  Estimate estimate;
  double described = 0.0;
};

struct Identification {
  std::vector<LinkResult> links;    ///< all with mass, in the model's order
  std::vector<JointResult> joints;  ///< in the image's order
  std::vector<BaseParameter> base;
  double condition_number = 0.0;  ///< of the base parameters' columns, weighted, of unit length
  double usable_s = 0.0;          ///< of the logs, without what was excluded
  double held_out_s = 0.0;
  double described_mass_kg = 0.0, identified_mass_kg = 0.0;  ///< of everything that moves
  Estimate mass_kg;                   ///< the same, as far as the equations reach
  std::vector<LeftOut> left_out;      ///< stretches of a signal that were left out
  std::vector<std::string> remarks;   ///< what was excluded, and what was assumed
  std::vector<std::string> warnings;  ///< what to look at before the result is used
};

/// How long a motion has to be at least: what is used, and what the filter loses at both ends.
[[nodiscard]] double shortest_motion_s(double cutoff_Hz = kCutoff_Hz);

/// Identifies the robot from the first two thirds of every log, and compares on the last.
///
/// @param tree  of robot's description; outlives nothing
/// Errors: as read_recording() and make_identified_robot(); too little usable data; no joint that
/// moves by 0.1 rad (or 20 mm).
[[nodiscard]] Result<Identification> identify(const std::vector<std::string>& logs,
                                              const hal::RobotConfig& robot,
                                              const model::Tree& tree,
                                              double cutoff_Hz = kCutoff_Hz);
/// The same of recordings at hand.
[[nodiscard]] Result<Identification> identify(const std::vector<Recording>& recordings,
                                              const hal::RobotConfig& robot,
                                              const model::Tree& tree,
                                              double cutoff_Hz = kCutoff_Hz);

/// Base parameters of all columns of the equations, those of joints but for the delays included.
/// @param hung  of a floating base: of the joints' equations alone, with a base at rest
[[nodiscard]] BaseParameters structural_base(IdentifiedRobot& robot, const model::Tree& tree,
                                             bool hung = false);

/// "LINK.mass_kg", "JOINT.viscous_Nms_rad": of a column of the equations.
[[nodiscard]] std::string column_name(const IdentifiedRobot& robot, const model::Tree& tree,
                                      Eigen::Index column);

}  // namespace tandem::identification
