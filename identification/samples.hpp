// Recordings filtered, differentiated and decimated: the equations of a robot, instant by instant.
// Layer: identification.  Thread: non-RT only.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "hal/config/robot_config.hpp"
#include "identification/recording.hpp"
#include "identification/regressor.hpp"

namespace tandem::identification {

/// What of the robot's configuration identification uses, in the order of the regressor's
/// coordinates.
struct RobotFacts {
  std::vector<int> joint;   ///< in the image; -1: a joint that nobody measures
  std::vector<bool> rigid;  ///< the rotor turns with the link: its inertia is in the link's row
  /// measured_behind_rotors(): such a drive counts as one with a spring. Empty: none is.
  std::vector<bool> behind_rotor;
  std::vector<double> rotor_kg_m2;      ///< as described, on the link side
  std::vector<double> torque_per_A;     ///< on the link side; 0: not known
  std::vector<double> damping_Nms_rad;  ///< of the actuator, back-EMF included
  std::vector<double> max_torque_Nm, max_velocity_rad_s;
  int imu_link = -1;                        ///< in tree.links; -1: none
  std::size_t imu_channel = 0;              ///< first of its channels
  std::vector<std::size_t> wrench_channel;  ///< per sensor of the regressor's spec
  Eigen::Vector3d gravity_m_s2;
};

struct IdentifiedRobot {
  Regressor regressor;
  RobotFacts facts;
  bool floating = false;
};
/// @param tree  outlives the result
/// Errors: closed loops, or passive joints; a floating base without IMU; what Regressor::create()
/// refuses.
[[nodiscard]] Result<IdentifiedRobot> make_identified_robot(const model::Tree& tree,
                                                            const hal::RobotConfig& robot);

/// The columns of a joint behind those of the links.
enum class JointColumn : std::uint8_t { kViscous, kCoulomb, kOffset, kRotor, kDelay };
inline constexpr Eigen::Index kJointColumns = 5;

/// Below it a sliding joint's Coulomb friction has no full effect [rad/s or m/s]: sign(v) is
/// tanh(v / it).
inline constexpr double kStick_rad_s = 0.01;

/// One equation at many instants: y = X x. X has ten columns for each piece, and kJointColumns for
/// each coordinate: friction, offset, rotor inertia, and by how much its torque is sampled later
/// than its position [s].
struct ChannelRows {
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> X;  ///< with spare rows
  Eigen::VectorXd y;                 ///< without what is known
  Eigen::VectorXd measured;          ///< with it: the torque itself
  std::vector<std::size_t> instant;  ///< of each row
  /// What y may have of an unknown hold of the rigid drives' voltages: one standard deviation of
  /// it, the same hold in all rows, channels and logs, for the drives of a robot are alike. Rows
  /// beyond its end have none.
  std::vector<double> doubt;

  [[nodiscard]] Eigen::Index rows() const { return static_cast<Eigen::Index>(instant.size()); }
  void append(const Eigen::VectorXd& x, double value, double whole, std::size_t at);
  /// Sets the doubt of the row that was appended last.
  void doubt_last(double one_deviation);
};

/// A motor at an instant, on the link side.
struct MotorInstant {
  double drive = 0.0;         ///< torque that its current makes [Nm]
  double drive_rate = 0.0;    ///< [Nm/s]
  double torque = 0.0;        ///< on the link [Nm]
  double velocity = 0.0;      ///< [rad/s]
  double acceleration = 0.0;  ///< [rad/s^2]; 0 where the rotor's inertia is in the link's row
  double direction = 0.0;     ///< -1 to 1
};

/// All equations of a log, or of several.
struct Equations {
  std::vector<double> time_s;             ///< of each instant
  std::vector<std::size_t> first_of_log;  ///< instant
  std::vector<double> repeats_s;          ///< of each log: after which its motion repeats; 0: not
  double stride_s = 0.0;                  ///< of instants, where none is left out
  std::vector<ChannelRows> channels;      ///< as the regressor's
  /// By how much the noise of the IMU moves X and y of a channel: rows whose sum of squares is
  /// what that noise adds to the rows' own, on average. Empty of a fixed base.
  std::vector<ChannelRows> sensor_noise;
  std::vector<std::vector<MotorInstant>> motors;  ///< per coordinate
  std::vector<double> travel_rad;                 ///< per coordinate: range of its position
  Eigen::Index columns = 0;
  double usable_s = 0.0;  ///< time that the instants stand for
  double held_s = 0.0;    ///< of them: something else than the feet holds the base, as it seems
};

/// Appends the instants of a recording.
/// @param cutoff_Hz  of the low pass, the same for every signal
/// @param assumed    (columns) parameters by which held voltages are corrected; empty: the
///                   description's
/// Errors: the cut-off is too high for the log's period.
[[nodiscard]] Status add_equations(const Recording& recording, double cutoff_Hz,
                                   IdentifiedRobot& robot, Equations& equations,
                                   const Eigen::VectorXd& assumed = {});

}  // namespace tandem::identification
