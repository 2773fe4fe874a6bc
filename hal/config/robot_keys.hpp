// The keys of robot.toml, a row each, in the order of docs/configuration.md. Missing are those of
// which ordinary code makes more than a member: references to buses, lists, tables in tables.
// Layer: hal, private to robot_config*.cpp.  Thread: non-RT only.
#pragma once

#include "base/keys.hpp"
#include "hal/config/robot_config.hpp"

namespace tandem::hal::keys {

/// Encoder counts per revolution; bits (20) would be far below.
inline constexpr Range kCounts{100.0, 1e12};
inline constexpr Range kInt16{-32768, 32767};
inline constexpr Range kInt32{-2147483648.0, 2147483647};
inline constexpr Range kUint32{0, 4294967295};

// A key a line.
// clang-format off
inline constexpr Key<RobotConfig> kRoot[] = {
  required(key<&RobotConfig::name>("name", "of the robot; part of the names of its kernels' library and of its logs").within("1 to 64 letters, digits, `_ - .`; the first is no `.` or `-`")),
};
inline constexpr Key<ModelConfig> kModel[] = {
  required(key<&ModelConfig::urdf>("urdf", "the description").within("path")),
  required(choice<&ModelConfig::floating_base>("base", "fixed|floating", "whether the root link moves freely")),
  choice<&ModelConfig::mimic_independent>("mimic", "follow|independent", "how a `<mimic>` joint is treated: as a follower of another joint, without `[[joint]]` and without a place in the process image ([urdf.md](urdf.md#mimic-joints)), or as a joint of its own"),
  choice<&ModelConfig::repair_inertia>("inertia", "strict|repair", "how a physically impossible inertia is treated: as an error, or replaced by the nearest possible one ([urdf.md](urdf.md#repair))"),
  choice<&ModelConfig::exact_right_angles>("right_angles", "as_written|exact", "how an angle within 1e-5 rad of a right one, or an axis so near a coordinate axis, is treated: as the URDF writes it, or as the exact right angle ([urdf.md](urdf.md#right-angles))"),
  key<&ModelConfig::derivatives>("derivatives", "whether the kernel library holds the derivatives of inverse and forward dynamics as well, with which compiling a humanoid takes two and a half times as long ([dynamics.md](dynamics.md#derivatives))"),
  // Three times the Sun's.
  key<&ModelConfig::gravity_m_s2>("gravity_m_s2", {-1000.0, 1000.0}, "in the world's frame; z > 0 gives a warning").by_default("`[0, 0, -9.81]`").within("3 numbers of ±1000"),
};
inline constexpr Key<LinkConfig> kLink[] = {
  key<&LinkConfig::mass_kg>("mass_kg", kNotNegative, "0 removes the URDF's inertia, too").by_default("the URDF's"),
  key<&LinkConfig::com_m>("com_m", "center of mass in the link's frame [m]").by_default("the URDF's").within("3 numbers"),
  key<&LinkConfig::inertia_kg_m2>("inertia_kg_m2", "`[ixx, ixy, ixz, iyy, iyz, izz]` about the center of mass, along the axes of the link's frame [kg m²]").by_default("the URDF's").within("6 numbers"),
};
inline constexpr Key<Site> kSite[] = {
  required(key<&Site::name>("name", "for feet, loops and wrenches to name").within("unique")),
  required(key<&Site::link>("link", "to which the frame is fixed").within("a link of the URDF")),
  key<&Site::xyz_m>("xyz_m", "origin in the link's frame").by_default("`[0, 0, 0]`").within("3 numbers"),
  key<&Site::rpy_rad>("rpy_rad", "roll, pitch, yaw about fixed axes, as in URDF").by_default("`[0, 0, 0]`").within("3 numbers"),
  key<&Site::wrench>("wrench", "an external wrench may act here; a foot's site needs it"),
};
inline constexpr Key<ActuatorConfig> kActuator[] = {
  key<&ActuatorConfig::order>("order", {0, 3}, "0 rigid, 1 electrical, 2 mechanical (spring), 3 both"),
  required(key<&ActuatorConfig::resistance_ohm>("resistance_ohm", kPositive, "R, winding")),
  key<&ActuatorConfig::inductance_H>("inductance_H", kNotNegative, "L, winding; orders 1 and 3 need it"),
  required(key<&ActuatorConfig::torque_constant_Nm_A>("torque_constant_Nm_A", kPositive, "K, of the motor before the gear")),
  required(key<&ActuatorConfig::gear_ratio>("gear_ratio", kPositive, "N")),
  required(key<&ActuatorConfig::inertia_kg_m2>("inertia_kg_m2", kPositive, "J, reflected: N² times the rotor's. Of a rigid actuator (orders 0, 1) it is part of the joint's inertia, and its brake acts on it")),
  required(key<&ActuatorConfig::damping_Nms_rad>("damping_Nms_rad", kNotNegative, "D, **including** the back-EMF's share N²K²/R, which is subtracted again where the current is a state (orders 1, 3: at least that). In orders 0 and 2 less lowers the back-EMF; below half of it `check` and `run` warn")),
  key<&ActuatorConfig::friction_Nm>("friction_Nm", kNotNegative, "dry (Coulomb) friction, where D acts: on the rotor, reflected; on the joint where there is no spring (simulation: [simulation.md](simulation.md#dry-friction))"),
  key<&ActuatorConfig::spring_Nm_rad>("spring_Nm_rad", kNotNegative, "Ks; orders 2 and 3 need it"),
  key<&ActuatorConfig::spring_damping_Nms_rad>("spring_damping_Nms_rad", kNotNegative, "Ds"),
  required(key<&ActuatorConfig::current_limit_A>("current_limit_A", kPositive, "saturation of the motor's current")),
  required(key<&ActuatorConfig::voltage_limit_V>("voltage_limit_V", kPositive, "saturation of the motor's voltage")),
  key<&ActuatorConfig::thermal_resistance_K_W>("thermal_resistance_K_W", kPositive, "winding to ambient"),
  key<&ActuatorConfig::thermal_time_constant_s>("thermal_time_constant_s", kPositive, "of the winding"),
  key<&ActuatorConfig::continuous_current_A>("continuous_current_A", kNotNegative, "the drive's I2t limit (2031): the permanently permissible current; 0: not monitored"),
  key<&ActuatorConfig::thermal_time_s>("thermal_time_s", kPositive, "time constant of that monitor"),
  key<&ActuatorConfig::temperature_limit_C>("temperature_limit_C", {-50.0, 3000.0}, "of the winding (2034): the drive faults above it"),
};
inline constexpr Key<GainsConfig> kGains[] = {
  choice<&GainsConfig::position_feedback>("position_feedback", "link|motor", "the encoder that the stiff position loop's kp and kd act on; ki always acts on the link's error"),
  key<&GainsConfig::torque_feedforward>("torque_feedforward", {0.0, 2.0}, "share of R / (N K) τ added to the voltage"),
  key<&GainsConfig::emf_compensation>("emf_compensation", {0.0, 1.0}, "share of N K θ̇ added to the voltage"),
  key<&GainsConfig::stiffness_Nm_rad>("stiffness_Nm_rad", "virtual spring of impedance mode, until a command changes it").within("≥ 0"),
  key<&GainsConfig::damping_Nms_rad>("damping_Nms_rad", "virtual damper of impedance mode").within("≥ 0"),
};
inline constexpr Key<PidGains> kPid[] = {
  key<&PidGains::kp>("kp", {}),
  key<&PidGains::ki>("ki", {}),
  key<&PidGains::kd>("kd", {}),
};
inline constexpr Key<PidConfig> kPidLimit[] = {
  key<&PidConfig::output_limit>("output_limit", kNotNegative, {}),
};
inline constexpr Key<BusConfig> kBus[] = {
  own(required(key<&BusConfig::name>("name", "for boards and sensors to name").within("unique"))),
  own(key<&BusConfig::interface>("interface", "SocketCAN interface, or the network interface of an EtherCAT line; not used in process")).by_default("the name").within("a name of Linux: 1 to 15 characters; no two buses have the same"),
  choice<&BusConfig::kind>("kind", "can|ethercat", "what wire it is. On EtherCAT the nodes' ids are their places in the line, from 1 at the master without a gap, and the three keys below are not used ([ethercat.md](ethercat.md))"),
  key<&BusConfig::fd>("fd", "CAN FD, or classic CAN: one axis a board, sensors of at most 8 channels"),
  key<&BusConfig::bitrate>("bitrate", {1e4, 1e6}, "of the arbitration phase [bit/s]"),
  key<&BusConfig::data_bitrate>("data_bitrate", {1e4, 1.2e7}, "of the data phase (FD) [bit/s]").within("`bitrate` to 12000000"),
  key<&BusConfig::max_load>("max_load", {0.01, 1.0}, "worst-case mean share of the wire's time for the cyclic traffic; more is refused ([wire.md](wire.md#bus-load))"),
};
inline constexpr Key<BoardConfig> kBoard[] = {
  own(required(key<&BoardConfig::name>("name", "for its joints to name").within("unique"))),
  key<&BoardConfig::control_period_ns>("control_period_ns", {1e4, 1e8}, "of its joint controllers. `tandem check` and runs warn of gains that are too high for it ([firmware.md](firmware.md#gains-and-the-control-period))"),
  key<&BoardConfig::heartbeat_ms>("heartbeat_ms", {1, 2e4}, "both ways; three missed ones are a time-out").within("1 to 20000; on CAN at least half the loop's `period_ns`"),
  key<&BoardConfig::command_timeout_cycles>("command_timeout_cycles", {1, 1e4}, "SYNCs without a command until the safe state"),
  key<&BoardConfig::slow_pdo_every>("slow_pdo_every", {1, 240}, "motor velocity, current, voltage and temperature every n-th SYNC"),
  key<&BoardConfig::fd>("fd", "the drive takes PDOs of up to 64 bytes in CAN FD frames: a data sheet has no word for it").within("only with `eds`, on a CAN FD bus"),
  key<&BoardConfig::keeps_configuration>("keeps_configuration", "the drive stores what it was written; a start with the same configuration does not write it again ([drives.md](drives.md#a-configuration-that-is-kept))").within("a sheet with 1010:1 and 1020"),
  key<&BoardConfig::eds>("eds", "data sheet (EDS or DCF; of an EtherCAT drive also its ESI) of a drive of another make ([drives.md](drives.md))").by_default("none: one of our own boards").within("a file, relative to this one"),
  key<&BoardConfig::vendor_id>("vendor_id", kUint32, "1018:1, which the board must report at bring-up; not other than its sheet's").by_default("that of its sheet").within("32 bits"),
  key<&BoardConfig::product_code>("product_code", kUint32, "1018:2: the same").by_default("that of its sheet").within("32 bits"),
  key<&BoardConfig::revision>("revision", kUint32, "1018:3: the major must be equal (the sheet's too), the minor at least this").by_default("that of its sheet").within("32 bits, major << 16 and minor"),
  own(key<&BoardConfig::serial>("serial", kUint32, "1018:4, to distinguish two boards of a kind")).by_default("any").within("32 bits"),
};
inline constexpr Key<JointConfig> kJoint[] = {
  own(key<&JointConfig::board>("board", "required for a joint that no board lists, and refused for others")).by_default("the board that lists the joint").within("a `[[board]]`"),
  own(key<&JointConfig::axis>("axis", {0, 7}, "goes with `board`")).within("0 to 7, unique on its board"),
  required(key<&JointConfig::actuator>("actuator", "its motor, gear and spring").within("NAME of an `[actuator.NAME]`")),
  key<&JointConfig::gains>("gains", "its drive's loops").by_default("the actuator's name").within("NAME of a `[gains.NAME]`"),
  key<&JointConfig::min_position_rad>("min_position_rad", "the drive's software limit").by_default("the URDF's; required where the URDF has no usable one").within("less than `max_position_rad`"),
  key<&JointConfig::max_position_rad>("max_position_rad", "the same").by_default("the URDF's; required where the URDF has no usable one"),
  key<&JointConfig::max_velocity_rad_s>("max_velocity_rad_s", kPositive, "limit of the command").by_default("the URDF's; required where the URDF has none above 0").within("> 0, at most 2^31 - 1 of the drive's velocity units"),
  key<&JointConfig::max_torque_Nm>("max_torque_Nm", kPositive, "limit of the command; `check` and `run` warn of a start posture in which gravity requires more torque of a joint than it has (legs excepted)").by_default("the URDF's; required where the URDF has none above 0"),
  key<&JointConfig::max_acceleration_rad_s2>("max_acceleration_rad_s2", kPositive, "of position references, of velocity references in velocity mode, and of `tandem joint move`. A stop of category \"hold\" brakes with it. References within the limits pass unchanged; others are followed as fast as the limits allow ([controllers.md](controllers.md#limits))").by_default("`max_velocity_rad_s` / 0.05 s, a guess, which can ask for more torque than the joint has"),
  key<&JointConfig::max_jerk_rad_s3>("max_jerk_rad_s3", kPositive, "of the same references; it needs the key of the acceleration").by_default("not limited"),
  key<&JointConfig::rated_torque_Nm>("rated_torque_Nm", kPositive, "torques travel as per mille of it (CiA 402 object 6076)").by_default("`max_torque_Nm`; with a board's `eds` what the sheet says, but not of a joint that slides").within("`max_torque_Nm` / 32 to 100 × `max_torque_Nm`"),
  key<&JointConfig::max_torque_rate_Nm_s>("max_torque_rate_Nm_s", kPositive, "rate limit of the drive's torque reference (CiA 402 object 6087), in every mode; it does not delay a stop. The loop's limit of commands is the same; without this key it is 100 / s × `max_torque_Nm`").by_default("1000 / s × `max_torque_Nm`").within("`max_torque_Nm` to 4e6 × `rated_torque_Nm`, per second"),
  key<&JointConfig::encoder_counts_per_rev>("encoder_counts_per_rev", kCounts, "link encoder; counts, not bits. Of a joint that slides, per 2 pi m of travel: 6.2832 times the counts per metre (an encoder of 1 um per count: 6283185)").by_default("required; with a board's `eds` what the sheet says, but not of a joint that slides").within("100 to 2^32 - 1, and the joint's limits are at most 1.9e9 counts, what 32 bits take"),
  key<&JointConfig::motor_encoder_counts_per_rev>("motor_encoder_counts_per_rev", kCounts, "motor encoder, per revolution *at the link* (of a joint that slides, per 2 pi m)").by_default("required; with a board's `eds` `encoder_counts_per_rev`").within("the same"),
  key<&JointConfig::reversed>("reversed", "the drive counts down as the joint's angle grows; torques turn with it").within("only with a board's `eds`"),
  key<&JointConfig::zero_counts>("zero_counts", kInt32, "what the drive counts where the joint is at 0; the counter may wrap around within the joint's range").within("32 bits; only with a board's `eds`"),
  key<&JointConfig::encoder_turn_counts>("encoder_turn_counts", {0, kInt32.max}, "counts after which a single-turn encoder repeats itself at power-on. The turn is the one in which the joint is within half a turn of the middle of its range ([drives.md](drives.md#units))").by_default("0: none").within("0 to 2^31 - 1, more than the joint's range in counts; only with a board's `eds`; not with a `homing` that is required"),
  key<&JointConfig::torque_noise_Nm>("torque_noise_Nm", kNotNegative, "standard deviation of the spring torque's measurement (simulation)"),
  key<&JointConfig::following_error_rad>("following_error_rad", kNotNegative, "in position mode, stiff: a larger error for longer than `following_timeout_s` is the drive's fault (6065, 6066); 0: not monitored. The loop watches every joint, too: 1.5 times the error for 0.1 s more is the joint's fault, whatever its drive does ([safety.md](safety.md#a-drive-that-ignores-its-commands)). With a board's `eds` and without this key it takes the way of 0.1 s at `max_velocity_rad_s` where that is less than 0.5").by_default("0.5; of a joint that slides the way of 0.1 s at `max_velocity_rad_s`, at most half its travel (m)"),
  key<&JointConfig::following_timeout_s>("following_timeout_s", {0.0, 65.0}, "for how long an error may be larger"),
  key<&JointConfig::max_oscillation>("max_oscillation", {0.0, 10.0}, "how much a joint may ring before the drive's fault FF03 (2039); 0: not monitored ([firmware.md](firmware.md#protections)). It is the RMS, over `oscillation_time_s`, of the motor torque's part above 10 Hz, as a share of `max_torque_Nm` (of the current limit's torque where that is less)"),
  key<&JointConfig::oscillation_time_s>("oscillation_time_s", {0.01, 60.0}, "time of that mean"),
  key<&JointConfig::max_swing>("max_swing", {0.0, 10.0}, "how much a joint may swing slowly about its reference before the drive's fault FF03 (203C): velocities of that share of `max_velocity_rad_s`, to and fro, which the loop's own work keeps up; 0: not monitored ([firmware.md](firmware.md#protections)). The loop watches every joint, too, and waits for twice as many swings"),
  key<&JointConfig::max_excess>("max_excess", {0.0, 10.0}, "by which share a joint's measured velocity, torque, and power may be beyond their limits (`max_velocity_rad_s`, `max_torque_Nm`, their product) for `excess_time_s`, in any mode, before the drive's fault 8400, 8311 or FF04 (203B); 0: not monitored. The loop watches every joint, too: twice that share for 0.1 s more is the joint's fault, whatever its drive does ([safety.md](safety.md#motion-beyond-its-limits))"),
  key<&JointConfig::excess_time_s>("excess_time_s", {0.0, 60.0}, "for how long they may"),
  key<&JointConfig::velocity_units_per_rev>("velocity_units_per_rev", kPositive, "the drive's velocity units (606C, 60FF, 60B1, 6099) at one revolution of the joint per second: 60 times the gear for a motor's rpm. Of a joint that slides, at 2 pi m/s").by_default("with a board's `eds` what 60A9 and the gear 6091 of its sheet say; else counts per second").within("> 0; only with a board's `eds`"),
  key<&JointConfig::acceleration_units_per_rev>("acceleration_units_per_rev", kPositive, "the drive's acceleration units (6083, 6084, 609A) at one revolution of the joint per second and second: the gear for a motor's revolutions per second and second").by_default("velocity units per second").within("> 0; only with a board's `eds`"),
  choice<&JointConfig::on_fault>("on_fault", "category0|category1|category2|hold|warn", "reaction of the loop when the joint's board dies or faults: cut torque at once; stop, then cut; [safe posture](safety.md#category-2-a-safe-posture-first), stop, then cut; hold position; only report"),
};
inline constexpr Key<canopen::DriveParameters> kDrive[] = {
  key<&canopen::DriveParameters::stop_deceleration_rad_s2>("stop_deceleration_rad_s2", kPositive, "the ramp of a quick stop, 6085: of stops of category 1, and of a drive that misses its master").by_default("as the drive has it; emulated: `max_velocity_rad_s` to rest in 0.25 s").within("> 0, within the limits of 6085; the drive's sheet must have the object"),
};
inline constexpr Key<BrakeConfig> kBrake[] = {
  required(key<&BrakeConfig::torque_Nm>("torque_Nm", kPositive, "its holding torque at the link")),
  required(key<&BrakeConfig::release_ms>("release_ms", {0, 1000}, "the time in which it opens")),
  required(key<&BrakeConfig::engage_ms>("engage_ms", {0, 1000}, "the time in which it closes")),
};
inline constexpr Key<StopOptions> kStopOptions[] = {
  key<&StopOptions::shutdown>("shutdown", kInt16, "605B: what the drive does when it is shut down. The drive's sheet must have the object, and the value be within its limits. Our own boards have all four, with the values of [firmware.md](firmware.md). `tandem check` shows what is set").by_default("as the drive has it").within("16 bits"),
  key<&StopOptions::disable>("disable", kInt16, "605C: when it is disabled").by_default("as the drive has it").within("16 bits"),
  key<&StopOptions::halt>("halt", kInt16, "605D: when it is halted").by_default("as the drive has it").within("16 bits"),
  key<&StopOptions::fault>("fault", kInt16, "605E: in a fault").by_default("as the drive has it").within("16 bits"),
};
inline constexpr Key<HomingConfig> kHoming[] = {
  required(key<&HomingConfig::method>("method", {-128, 127}, "CiA 402's number, 6098; one of 60E3 where the drive's sheet has that, within the limits of 6098 there. Emulated drives have 1 to 14, 17 to 30, 33 to 35 and 37 ([drives.md](drives.md#homing-in-simulation))").within("-128 to 127, not 0")),
  required(key<&HomingConfig::speed_rad_s>("speed_rad_s", kPositive, "to the switch or stop, 6099:1").within("at most the joint's `max_velocity_rad_s`, at least one of the drive's units")),
  key<&HomingConfig::zero_speed_rad_s>("zero_speed_rad_s", kPositive, "to the zero, 6099:2").by_default("a tenth of `speed_rad_s`").within("at most `speed_rad_s`, at least one of the drive's units"),
  required(key<&HomingConfig::acceleration_rad_s2>("acceleration_rad_s2", kPositive, "609A").within("at least one of the drive's units")),
  key<&HomingConfig::position_rad>("position_rad", "the joint's angle at the place that is found, 607C").within("within the joint's range, or half of its width beyond"),
  key<&HomingConfig::timeout_s>("timeout_s", {0.1, 3600.0}, "then the homing has failed"),
  key<&HomingConfig::required>("required", "until it is homed, nothing else moves the joint"),
  key<&HomingConfig::at_start>("at_start", "the run homes the joint by itself, before its controllers start").within("with `required`"),
  key<&HomingConfig::home_switch_rad>("home_switch_rad", "in simulation: the home switch is active between them").by_default("by the method").within("two angles of the joint, the lower one first"),
  key<&HomingConfig::index_rad>("index_rad", "in simulation: an angle of the joint at which the motor's encoder gives its index pulse"),
};
inline constexpr Key<PassiveConfig> kPassive[] = {
  required(key<&PassiveConfig::name>("name", "the joint").within("a moving joint of the URDF without `[[joint]]`, once")),
  key<&PassiveConfig::position_rad>("position_rad", "at the start; on a loop, the position near which the loop closes: it selects the branch"),
  key<&PassiveConfig::damping_Nms_rad>("damping_Nms_rad", {0.0, 1e6}, "of the joint (simulation)"),
  key<&PassiveConfig::friction_Nm>("friction_Nm", {0.0, 1e6}, "its dry friction (simulation: [simulation.md](simulation.md#dry-friction))"),
};
inline constexpr Key<model::KinematicLoop> kLoop[] = {
  required(key<&model::KinematicLoop::name>("name", "for messages and logs").within("unique")),
  required(choice<&model::KinematicLoop::type>("type", "ball|revolute|rod", "the sites' origins coincide; origins and axes coincide; or the sites keep their distance (a massless rod with a ball joint at either end)")),
};
inline constexpr Key<SensorConfig> kSensor[] = {
  required(key<&SensorConfig::name>("name", "part of its topic").within("unique")),
  required(choice<&SensorConfig::type>("type", "force_torque|imu", "channels: `fx fy fz` [N] `tx ty tz` [Nm]; or `qx qy qz qw`, `wx wy wz` [rad/s], `ax ay az` [m/s²]")),
  key<&SensorConfig::joint>("joint", "whose wrench is measured").by_default("required for `force_torque`").within("any joint of the URDF"),
  required(key<&SensorConfig::link>("link", "the frame of the values. For a force/torque sensor, a link that is fixed to either side of its joint").within("a link of the URDF")),
  key<&SensorConfig::noise>("noise", kNotNegative, "standard deviation (simulation), seeded. A quaternion keeps its length").by_default("none").within("≥ 0, one per channel"),
  key<&SensorConfig::bias>("bias", "constant error (simulation)").by_default("none").within("one per channel"),
  key<&SensorConfig::heartbeat_ms>("heartbeat_ms", {1, 2e4}, "as a board's").within("as a board's"),
};
inline constexpr Key<ContactConfig> kContact[] = {
  key<&ContactConfig::height_m>("height_m", "of the ground"),
  required(key<&ContactConfig::stiffness_N_m>("stiffness_N_m", kPositive, "k")),
  required(key<&ContactConfig::damping_s_m>("damping_s_m", kNotNegative, "of the normal force, see above")),
  required(key<&ContactConfig::tangential_stiffness_N_m>("tangential_stiffness_N_m", kPositive, "of the stuck point's spring")),
  required(key<&ContactConfig::tangential_damping_Ns_m>("tangential_damping_Ns_m", kNotNegative, "beside that spring")),
  required(key<&ContactConfig::sliding_friction>("sliding_friction", kNotNegative, "Coulomb coefficient")),
  key<&ContactConfig::static_friction>("static_friction", kNotNegative, "the same of a point that is stuck").by_default("`sliding_friction`").within("≥ `sliding_friction`"),
  key<&ContactConfig::stick_velocity_m_s>("stick_velocity_m_s", kPositive, "below it a sliding point sticks again"),
};
inline constexpr Key<RobotConfig> kSafety[] = {
  choice<&RobotConfig::emergency_stop>("emergency_stop", "category0|category1|category2", "the stop of the whole robot after a board's emergency stop input, SIGUSR1 or `tandem estop`: [safety.md](safety.md)"),
};
// clang-format on

}  // namespace tandem::hal::keys
