// A robot as its robot.toml describes it: joints, actuators, boards, buses, sensors, contact.
// Plain data, read once, shared by every room. docs/configuration.md documents each key.
// Layer: hal.  Thread: non-RT to read; immutable afterwards.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.hpp"
#include "base/toml_reader.hpp"
#include "canopen/data_sheet.hpp"
#include "canopen/drive_parameters.hpp"
#include "hal/config/terrain.hpp"
#include "hal/image.hpp"
#include "hal/robot.hpp"
#include "hal/stop_category.hpp"
#include "model/kinematic_loop.hpp"

namespace tandem::hal {

/// What to say to a URDF in the place of a robot.toml.
inline constexpr const char* kRobotOfXml = "`tandem new FILE` makes a robot of a URDF";

/// [[site]]: a named frame of the model.
struct SiteConfig : Site {
  int line = 0;  ///< in the TOML, for messages
};

/// [model.link.NAME]: mass and inertia instead of the URDF's; what is not given stays the URDF's.
struct LinkConfig {
  std::string name;               ///< of the URDF
  std::optional<double> mass_kg;  ///< 0: no inertia either, unless the next but one gives it
  std::optional<std::array<double, 3>> com_m;          ///< in the link's frame
  std::optional<std::array<double, 6>> inertia_kg_m2;  ///< ixx ixy ixz iyy iyz izz about the com,
                                                       ///< along the link's axes
  int line = 0;                                        ///< in the TOML, for messages
  // Where an experiment says it ([parallel.link.NAME]): empty in robot.toml.
  std::string file{};  ///< of `line`
  std::string key{};   ///< dotted
};

/// [model]
struct ModelConfig {
  std::string urdf;  ///< path, resolved against the TOML's folder
  bool floating_base = false;
  bool mimic_independent = false;   ///< mimic = "independent"; the default is "follow"
  bool repair_inertia = false;      ///< inertia = "repair"; the default "strict" is an error
  bool exact_right_angles = false;  ///< right_angles = "exact"; the default is "as_written"
  bool derivatives = false;         ///< the library holds kernels of the dynamics' derivatives
  std::vector<std::pair<std::string, double>> lock;  ///< joint -> fixed position [rad or m]
  std::map<std::string, int> lock_lines;  ///< joint of it -> line in the TOML, for messages
  std::vector<LinkConfig> links;
  std::array<double, 3> gravity_m_s2{0.0, 0.0, -9.81};
  int gravity_line = 0;  ///< in the TOML, for messages
  std::vector<SiteConfig> sites;
};

/// [actuator.NAME]: motor, gear and spring; reflected to the link side but for R, L, K.
struct ActuatorConfig {
  std::string name;
  int order = 2;  ///< 0 rigid, 1 electrical, 2 mechanical (SEA), 3 both
  double resistance_ohm = 0.0;
  double inductance_H = 0.0;
  double torque_constant_Nm_A = 0.0;  ///< of the motor, before the gear
  double gear_ratio = 1.0;
  double inertia_kg_m2 = 0.0;           ///< J
  double damping_Nms_rad = 0.0;         ///< D, the back-EMF's share N^2 K^2 / R included
  double friction_Nm = 0.0;             ///< dry (Coulomb) friction, where D acts (simulation)
  double spring_Nm_rad = 0.0;           ///< Ks (orders 2, 3)
  double spring_damping_Nms_rad = 0.0;  ///< Ds (orders 2, 3)
  double current_limit_A = 0.0;
  double voltage_limit_V = 0.0;
  double thermal_resistance_K_W = 1.0;  ///< winding to ambient
  double thermal_time_constant_s = 60.0;
  double continuous_current_A = 0.0;   ///< the drive's I2t limit; 0: not watched
  double thermal_time_s = 30.0;        ///< time constant of that watch
  double temperature_limit_C = 120.0;  ///< of the winding
  int damping_line = 0;                ///< in the TOML, for messages

  /// N K, at the link: also the back-EMF [Vs/rad].
  [[nodiscard]] double torque_per_A() const noexcept { return gear_ratio * torque_constant_Nm_A; }
};

/// What its order lacks ("inductance_H must be positive"), or empty.
[[nodiscard]] std::string actuator_problem(const ActuatorConfig& actuator);

/// One loop of the firmware.
struct PidConfig {
  PidGains gains;
  double output_limit = 0.0;  ///< 0: the joint's or the actuator's own limit
};

/// Which encoder the stiff position loop's proportional and derivative terms act on.
enum class PositionFeedback : std::uint8_t {
  kLink = 0,   ///< e = q_ref - q
  kMotor = 1,  ///< e = q_ref + tau_ff / Ks - theta: collocated, so stable on any load; the
               ///< integral still acts on the link's error
};

/// [gains.NAME]: the firmware's loops of one kind of joint. One cascade serves every mode
/// (docs/firmware.md): position, velocity and impedance give a link torque [Nm], the torque loop
/// makes it a motor voltage [V], with feed-forward of the motor's resistance and back-EMF.
struct GainsConfig {
  std::string name;
  int line = 0;
  PidConfig position;  ///< [Nm/rad, Nm/(rad s), Nms/rad] on link position
  PidConfig velocity;  ///< [Nms/rad, Nm/rad, Nms^2/rad] on link velocity
  PidConfig torque;    ///< [V/Nm, V/(Nm s), Vs/Nm] on the spring's torque
  PidConfig current;   ///< [V/A, V/(A s), Vs/A]
  PositionFeedback position_feedback = PositionFeedback::kLink;
  double torque_feedforward = 1.0;  ///< share of R / (N K) tau_ref added to the voltage
  double emf_compensation = 0.0;    ///< share of N K theta' added to the voltage, 0 to 1
  double stiffness_Nm_rad = 0.0;    ///< impedance mode's defaults
  double damping_Nms_rad = 0.0;
};

/// A joint's `brake`: a spring presses it on, current in its coil lifts it.
struct BrakeConfig {
  double torque_Nm =
      0.0;             ///< that it holds; on the link's side of the gear, the motor's of a spring
  int release_ms = 0;  ///< from the coil's current until it is open
  int engage_ms = 0;   ///< from the current's end until it holds
};

/// A joint's `homing`: how its drive finds the joint's place (CiA 402's homing mode).
struct HomingConfig {
  int method = 0;                    ///< 6098: -128 to 127, not 0
  double speed_rad_s = 0.0;          ///< 6099:1, to the switch or stop
  double zero_speed_rad_s = 0.0;     ///< 6099:2, to the zero; default a tenth of the above
  double acceleration_rad_s2 = 0.0;  ///< 609A
  double position_rad = 0.0;         ///< the joint's angle at the place that is found: 607C
  double timeout_s = 60.0;
  bool required = true;   ///< until it is done, nothing else moves the joint
  bool at_start = false;  ///< it is done once the drives are enabled, without a request
  /// In simulation: where the home switch is active, the joint's angles; empty: by the method.
  std::optional<std::array<double, 2>> home_switch_rad = {};
  double index_rad = 0.0;  ///< in simulation: where the motor's encoder gives an index pulse
  int line = 0;            ///< in the TOML, for messages
};

/// A joint's `stop_options`: 605B to 605E of its drive; what is empty stays as the drive has it.
struct StopOptions {
  std::optional<int> shutdown;  ///< 605B
  std::optional<int> disable;   ///< 605C
  std::optional<int> halt;      ///< 605D
  std::optional<int> fault;     ///< 605E
};

/// In which a joint may reach its largest velocity where nobody says how fast: harder than bundled
/// experiments move, softer than a step.
inline constexpr double kFullSpeed_s = 0.05;

/// What a table leaves open, until the description or a drive's sheet completes it.
inline constexpr double kUnset = std::numeric_limits<double>::quiet_NaN();

/// [[joint]]
struct JointConfig {
  std::string name;  ///< URDF joint
  std::string board;
  int axis = 0;  ///< on its board, from 0
  std::string actuator;
  std::string gains;
  double min_position_rad = kUnset;  ///< this and the next three: until
  double max_position_rad = kUnset;  ///< complete_from_description() the URDF's
  double max_velocity_rad_s = kUnset;
  double max_torque_Nm = kUnset;  ///< the torque reference's limit
  /// Limit of references. Without the key: the largest velocity in kFullSpeed_s.
  double max_acceleration_rad_s2 = std::numeric_limits<double>::infinity();
  double max_jerk_rad_s3 = std::numeric_limits<double>::infinity();  ///< the same; not limited
  /// CiA 402 6076: torques travel as per mille of it; default: max_torque_Nm.
  Given<double> rated_torque_Nm = {kUnset};
  std::optional<double> max_torque_rate_Nm_s = {};  ///< of the torque reference
  Given<double> encoder_counts_per_rev = {kUnset};  ///< link encoder
  double motor_encoder_counts_per_rev = kUnset;     ///< motor encoder, per revolution at the link
  double torque_noise_Nm = 0.0;  ///< standard deviation of the spring torque's measurement
  /// In CSP, beyond it for longer than the next: a fault; 0 rad: not watched.
  Given<double> following_error_rad = {0.5};
  double following_timeout_s = 0.1;
  /// Settings of its drive that are keys as they are; NaN: no key. See drive_parameters().
  canopen::DriveParameters drive = canopen::DriveParameters::unsaid();
  double max_oscillation = 0.35;    ///< RMS of the motor torque's fast part over the most that the
                                    ///< drive gives; 0: not watched
  double oscillation_time_s = 1.0;  ///< of that mean
  double max_swing =
      0.25;  ///< of the maximum velocity: a swing about the reference; 0: not watched
  double max_excess = 0.25;    ///< by which motion may be beyond its limits; 0: not watched
  double excess_time_s = 0.1;  ///< for which it may
  std::optional<BrakeConfig> brake = {};
  std::optional<HomingConfig> homing = {};  ///< none: its encoder is absolute
  Given<bool> reversed = {};                ///< the drive counts down as the joint's angle grows
  std::int32_t zero_counts = 0;             ///< what the drive counts where the joint is at 0
  /// Counts after which the encoder repeats itself at power-on (a single-turn one); 0: it does not.
  Given<std::int32_t> encoder_turn_counts = {};
  StopOptions stop_options = {};
  /// The drive's velocity units at one revolution of the joint per second; 0: its counts per
  /// second.
  Given<double> velocity_units_per_rev = {};
  double acceleration_units_per_rev = 0.0;  ///< of its accelerations; 0: the former per second
  bool slides = false;  ///< prismatic: m and N; the URDF's, by complete_from_description()
  Given<StopCategory> on_fault = {StopCategory::kCategory1};  ///< when its board dies or faults
  int line = 0;                                               ///< in the TOML, for messages
};

/// By how much a drive lets its torque reference change (6087): max_torque_rate_Nm_s, or without
/// one max_torque_Nm in a millisecond. CommandLimits allows less then.
[[nodiscard]] double torque_rate_Nm_s(const JointConfig& joint) noexcept;

/// max_oscillation in torque, object 2039:1 [Nm]: of max_torque_Nm, or of what the current limit
/// gives where that is less.
[[nodiscard]] double oscillation_limit_Nm(const JointConfig& joint, const ActuatorConfig& actuator);

/// [[passive]]: a joint that moves but has no motor and no encoder. It is in the dynamics and
/// nowhere else: not in the process image, not on a board.
struct PassiveConfig {
  std::string name;           ///< URDF joint
  double position_rad = 0.0;  ///< at the start; where loops close, from near here
  double damping_Nms_rad = 0.0;
  double friction_Nm = 0.0;  ///< dry (Coulomb) friction
  int line = 0;              ///< in the TOML, for messages
};

/// [[loop]]
struct KinematicLoopConfig : model::KinematicLoop {
  int line = 0;  ///< in the TOML, for messages
};

/// [[bus]]
/// What a [[bus]] is made of.
enum class BusKind : std::uint8_t {
  kCan,
  kEthercat,  ///< a line of slaves; a node's id is its place in the line, from 1 at the master
};

struct BusConfig {
  std::string name;
  std::string interface;  ///< "can0", "eth1": unused in process
  BusKind kind = BusKind::kCan;
  bool fd = true;
  std::int64_t bitrate = 1'000'000;
  std::int64_t data_bitrate = 8'000'000;
  double max_load = 0.9;  ///< mean share of the wire's time that may be used
  int line = 0;           ///< in the TOML, for messages
};

/// Under which the master sends its heartbeat: no node of a bus has it.
inline constexpr int kMasterNodeId = 127;

/// [[board]]
struct BoardConfig {
  std::string name;
  std::string bus;
  int node_id = 0;                             ///< 1 to 126
  std::int64_t control_period_ns = 1'000'000;  ///< of its joint controllers
  int heartbeat_ms = 50;                       ///< both ways; time-out is three of them
  int command_timeout_cycles = 10;             ///< SYNCs without a command until the safe state
  std::int64_t boot_time_ns = 1'500'000'000;   ///< from a reset to the boot-up message, at most
  int slow_pdo_every = 1;                      ///< motor velocity, current, … every n-th SYNC
  bool keeps_configuration = false;  ///< it stores (1010) and names (1020) what it was written
  bool fd = false;                   ///< of a drive of another make: it takes PDOs of CAN FD
  std::string eds;  ///< path of its data sheet, against the TOML's folder; empty: one of our own
  std::shared_ptr<const canopen::DataSheet> sheet = canopen::tandem_board_sheet();
  // 1018, as the board has to identify itself; without a value that of the sheet, or any serial
  std::optional<std::uint32_t> vendor_id, product_code;
  std::optional<std::uint32_t> revision;  ///< major << 16 | minor: that major, at least that minor
  std::optional<std::uint32_t> serial;
  int line = 0;  ///< in the TOML, for messages
};

/// [[sensor]]: a node of its own. Its channels: channels_of().
struct SensorConfig {
  std::string name;
  SensorType type = SensorType::kForceTorque;
  std::string bus;
  int node_id = 0;
  std::string joint;          ///< force_torque: measures the wrench through this joint
  std::string link;           ///< the frame it is expressed in
  std::vector<double> noise;  ///< standard deviation per channel; empty: none
  std::vector<double> bias;   ///< per channel; empty: none
  int heartbeat_ms = 50;      ///< as a board's
  int line = 0;               ///< in the TOML, for messages

  [[nodiscard]] std::size_t channels() const { return channels_of(type); }
};

/// [[sim.patch]]: a rectangle of the simulated ground that is other than the rest.
struct GroundPatch {
  std::string name;
  std::array<double, 2> x_m{}, y_m{};  ///< from and to, in W
  double static_friction = 0.0, sliding_friction = 0.0;
  double stiffness_share = 1.0;  ///< of the ground's stiffnesses

  [[nodiscard]] bool holds(double x, double y) const noexcept {
    return x >= x_m[0] && x <= x_m[1] && y >= y_m[0] && y <= y_m[1];
  }
};

/// [contact]: compliant ground at z = height. Per point.
struct ContactConfig {
  double height_m = 0.0;
  double stiffness_N_m = 0.0;
  double damping_s_m = 0.0;  ///< Fz = k d (1 + damping * d'), never below zero
  double tangential_stiffness_N_m = 0.0;
  double tangential_damping_Ns_m = 0.0;
  double static_friction = 0.0;
  double sliding_friction = 0.0;
  double stick_velocity_m_s = 0.01;  ///< regularisation between static and sliding
  std::vector<Foot> feet;            ///< [[contact.foot]]
  std::vector<GroundPatch> patches;  ///< the first that holds a point counts
  Terrain terrain;                   ///< added to the plane
  std::map<std::string, int> lines;  ///< key -> line in the TOML, for messages
};

/// [posture.NAME]: joints that it does not name are at 0. base_height_m is NaN for "auto", until it
/// is computed from the description.
struct PostureConfig : Posture {
  int line = 0;  ///< in the TOML, for messages
};

/// The whole robot.toml.
struct RobotConfig {
  std::string file;  ///< the TOML's path
  std::string name;
  ModelConfig model;
  std::vector<ActuatorConfig> actuators;
  std::vector<GainsConfig> gains;
  std::vector<BusConfig> buses;
  std::vector<BoardConfig> boards;
  std::vector<JointConfig> joints;  ///< the process image's order
  std::vector<PassiveConfig> passive;
  std::vector<Follower> followers;  ///< of the description, once that completed this
  std::vector<KinematicLoopConfig> loops;
  std::vector<SensorConfig> sensors;  ///< the process image's order
  ContactConfig contact;
  std::vector<PostureConfig> postures;
  Given<StopCategory> emergency_stop = {StopCategory::kCategory1};  ///< [safety]; 0, 1 or 2

  [[nodiscard]] ImageShape shape() const;
  /// Index in `joints`, or -1.
  [[nodiscard]] int joint_index(std::string_view name) const;
  /// What to say of a name that is not in `joints`: of a follower, whom it follows.
  [[nodiscard]] Error no_joint(std::string_view name) const;
  [[nodiscard]] int sensor_index(std::string_view name) const;
  [[nodiscard]] const ActuatorConfig& actuator_of(const JointConfig& joint) const;
  [[nodiscard]] const GainsConfig& gains_of(const JointConfig& joint) const;
  /// Whether a [[passive]] names this joint.
  [[nodiscard]] bool is_passive(std::string_view name) const;
  /// The loops without their lines, and the passive joints' names, as the model takes them.
  [[nodiscard]] std::vector<model::KinematicLoop> loop_specs() const {
    return {loops.begin(), loops.end()};
  }
  [[nodiscard]] std::vector<std::string> passive_names() const;
  /// What a fault of joint `joint` for `cause` stops: an emergency stop the robot, any other fault
  /// what the joint says. A stop that is not obeyed stops the robot whatever the joint says.
  [[nodiscard]] StopCategory category_of(std::size_t joint, FaultCause cause) const noexcept {
    if (cause == FaultCause::kEmergencyInput) return emergency_stop;
    const StopCategory own = joints[joint].on_fault;
    return cause == FaultCause::kIgnoresStop ? std::min(own, StopCategory::kCategory1) : own;
  }
  /// Null when no joint of that name follows another.
  [[nodiscard]] const Follower* follower(std::string_view name) const;
  [[nodiscard]] const BoardConfig* board(std::string_view name) const;
  [[nodiscard]] const BusConfig* bus(std::string_view name) const;
  [[nodiscard]] const PostureConfig* posture(std::string_view name) const;
};

/// Every [TABLE.NAME] of `links`, a table of links: [model.link.NAME], [parallel.link.NAME].
[[nodiscard]] std::vector<LinkConfig> read_links(TomlTable links);

/// Reads and checks a robot.toml by itself (not against its URDF: model/ and apps/ do that).
/// Errors, all of them at once: unreadable, no TOML, unknown or missing keys, out of range,
/// a reference to a board, bus, actuator or gains table that does not exist, a joint on two
/// boards or twice, an axis twice, a node id twice on a bus, a gain of the wrong sign.
[[nodiscard]] std::expected<RobotConfig, Diagnostics> read_robot_config(const std::string& file);
/// A place that names a joint where there is no [[joint]] of that name. Which of the two is
/// misspelt, only the description knows.
struct JointReference {
  std::string joint;
  Error error;  ///< without a hint when the nearest name is one
};
/// The same, but appends the errors and answers what could be read in spite of them: references
/// may lead nowhere and names be empty. Only for finding errors in what comes next.
///
/// @param loose  in: empty; out: errors that are not among `errors`; check_names() judges them
[[nodiscard]] RobotConfig read_robot_config(const Result<TomlDocument>& document,
                                            Diagnostics& errors,
                                            std::vector<JointReference>& loose);
/// The same from memory; `file` names it in errors and gives the folder of relative paths.
[[nodiscard]] std::expected<RobotConfig, Diagnostics> parse_robot_config(std::string_view text,
                                                                         const std::string& file);

/// A moving joint as the URDF describes it. Infinite where none is needed, NaN where the URDF
/// lacks a limit or gives one that makes no sense.
struct JointDescription {
  std::string name;
  double min_position_rad;
  double max_position_rad;
  double max_velocity_rad_s;
  double max_torque_Nm;
  std::string limits_note = {};  ///< what is wrong with the URDF's limits, and where; or empty
  bool slides = false;           ///< prismatic: m and N
};

/// A joint that mimics another, and where it lets that one go. Infinite where it sets no limit.
struct FollowerDescription {
  std::string name;
  std::string leader;
  double min_leader_rad;
  double max_leader_rad;
};

/// The names in a URDF that a robot.toml may refer to.
struct RobotDescription {
  std::vector<JointDescription> moving_joints;  ///< without the locked ones
  std::vector<std::string> other_joints;        ///< fixed and locked
  std::vector<std::string> links;
  std::vector<FollowerDescription> followers{};
};

/// The names of joints and links that the URDF lacks, each with the nearest; empty names are passed
/// over. A configuration that has errors of its own can be checked so far.
///
/// @param loose  as read_robot_config() found them: what follows from a misspelt [[joint]] is
///               passed over, and the nearest names of the others are the description's
[[nodiscard]] Diagnostics check_names(const RobotConfig& robot, const RobotDescription& description,
                                      const std::vector<JointReference>& loose = {});
/// The same where there is no description to ask: the nearest names are those of [[joint]]s.
[[nodiscard]] Diagnostics check_names(const RobotConfig& robot,
                                      const std::vector<JointReference>& loose);

/// Checks the configuration against its URDF and fills what it leaves to that: limits, and which
/// joints slide.
/// A joint without position limits (continuous) gets what its 32-bit encoder can count.
/// Errors: a [[joint]] that is not a moving joint of the URDF (the nearest name is suggested) or
/// follows another, a moving joint without [[joint]], [[passive]] or lock, a site or sensor on an
/// unknown link or joint, a limit that neither gives, a limit beyond the wire's range or beyond
/// what a follower allows, a posture beyond the limits.
[[nodiscard]] Diagnostics complete_from_description(RobotConfig& robot,
                                                    const RobotDescription& description);

/// Puts the interfaces of the command line in the place of robot.toml's: "can0=vcan0".
/// Errors: no such form, an interface that no bus has (the nearest is suggested).
[[nodiscard]] Status replace_interfaces(RobotConfig& robot,
                                        std::span<const std::string> replacements);

}  // namespace tandem::hal
