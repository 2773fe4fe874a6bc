// Names of every COB-ID, object index, mode and bit on the wire. docs/wire.md explains them.
// Layer: canopen.  Thread: any.
#pragma once

#include <cstdint>
#include <string_view>

namespace tandem::canopen {

/// COB-IDs of the pre-defined connection set (CiA 301); add the node id where there is one.
namespace cob {
inline constexpr std::uint32_t kNmt = 0x000;
inline constexpr std::uint32_t kSync = 0x080;
inline constexpr std::uint32_t kTime = 0x100;
inline constexpr std::uint32_t kPastOrder = 0x101;   ///< ours, in lockstep: PastOrderMessage
inline constexpr std::uint32_t kPastAnswer = 0x102;  ///< ours: PastAnswerMessage
inline constexpr std::uint32_t kEmergency = 0x080;
inline constexpr std::uint32_t kSdoResponse = 0x580;  ///< server to client
inline constexpr std::uint32_t kSdoRequest = 0x600;   ///< client to server
inline constexpr std::uint32_t kHeartbeat = 0x700;
inline constexpr std::uint32_t kInvalid = 0x80000000;  ///< bit 31 of a COB-ID object: not in use
inline constexpr std::uint32_t kNoRtr = 0x40000000;    ///< bit 30 of a TPDO's: no remote request
inline constexpr std::uint32_t kIdMask = 0x7FF;

/// Transmit (node to master) PDO `number` of node `id`. @pre 1 <= number <= 4
[[nodiscard]] constexpr std::uint32_t tpdo(int number, int id) noexcept {
  return 0x180u + 0x100u * static_cast<std::uint32_t>(number - 1) + static_cast<std::uint32_t>(id);
}
/// Receive (master to node) PDO `number` of node `id`. @pre 1 <= number <= 4
[[nodiscard]] constexpr std::uint32_t rpdo(int number, int id) noexcept {
  return 0x200u + 0x100u * static_cast<std::uint32_t>(number - 1) + static_cast<std::uint32_t>(id);
}
/// Whether CiA 301 keeps an identifier for itself, so that no PDO may have it: NMT, the default
/// SDOs, heartbeats and what is reserved.
[[nodiscard]] constexpr bool restricted(std::uint32_t id) noexcept {
  return id <= 0x07F || (id >= 0x101 && id <= 0x180) || (id >= 0x581 && id <= 0x5FF) ||
         (id >= 0x601 && id <= 0x67F) || (id >= 0x6E0 && id <= 0x6FF) || id >= 0x701;
}
}  // namespace cob

inline constexpr std::int64_t kNsPerMs = 1'000'000;  ///< heartbeats' and timers' objects are in ms

inline constexpr int kMaxNodeId = 127;
inline constexpr int kMaxAxes = 8;      ///< of one board: CiA 402's index space
inline constexpr int kPdosPerNode = 4;  ///< each way, of the pre-defined connection set

/// PDO transmission types (sub 2 of 1400.. and 1800..): 1 to 240 mean every n-th SYNC.
inline constexpr std::uint8_t kSynchronousAcyclic = 0;
inline constexpr std::uint8_t kEverySync = 1;
inline constexpr std::uint8_t kEventManufacturer = 254;
inline constexpr std::uint8_t kEventProfile = 255;

/// Object indices. Those from kErrorCode to kSupportedModes and the manufacturer's per-axis ones
/// are axis 0's: see of_axis().
namespace object {
// CiA 301: communication
inline constexpr std::uint16_t kDeviceType = 0x1000;           // u32
inline constexpr std::uint16_t kErrorRegister = 0x1001;        // u8
inline constexpr std::uint16_t kErrorHistory = 0x1003;         // u8 count, u32[8]
inline constexpr std::uint16_t kSyncId = 0x1005;               // u32
inline constexpr std::uint16_t kSyncPeriod = 0x1006;           // u32 [us]
inline constexpr std::uint16_t kDeviceName = 0x1008;           // string
inline constexpr std::uint16_t kHardwareVersion = 0x1009;      // string
inline constexpr std::uint16_t kSoftwareVersion = 0x100A;      // string
inline constexpr std::uint16_t kGuardTime = 0x100C;            // u16 [ms]
inline constexpr std::uint16_t kLifeTimeFactor = 0x100D;       // u8: guard times without a request
inline constexpr std::uint16_t kStoreParameters = 0x1010;      // u32: 1 all of them
inline constexpr std::uint16_t kEmergencyId = 0x1014;          // u32
inline constexpr std::uint16_t kHeartbeatConsumer = 0x1016;    // u32[]: node << 16 | time [ms]
inline constexpr std::uint16_t kHeartbeatProducer = 0x1017;    // u16 [ms]
inline constexpr std::uint16_t kIdentity = 0x1018;             // u32: IdentitySub
inline constexpr std::uint16_t kVerifyConfiguration = 0x1020;  // u32: 1 date, 2 time of it
inline constexpr std::uint16_t kErrorBehaviour = 0x1029;       // u8[1]: on a communication error
inline constexpr std::uint16_t kRpdoParameter = 0x1400;        // + number - 1
inline constexpr std::uint16_t kRpdoMapping = 0x1600;
inline constexpr std::uint16_t kTpdoParameter = 0x1800;
inline constexpr std::uint16_t kTpdoMapping = 0x1A00;

// CiA 402, axis 0
inline constexpr std::uint16_t kAbortConnectionOption = 0x6007;  // i16
inline constexpr std::uint16_t kErrorCode = 0x603F;              // u16
inline constexpr std::uint16_t kControlword = 0x6040;            // u16
inline constexpr std::uint16_t kStatusword = 0x6041;             // u16
inline constexpr std::uint16_t kQuickStopOption = 0x605A;        // i16
inline constexpr std::uint16_t kShutdownOption = 0x605B;         // i16
inline constexpr std::uint16_t kDisableOption = 0x605C;          // i16
inline constexpr std::uint16_t kHaltOption = 0x605D;             // i16
inline constexpr std::uint16_t kFaultReactionOption = 0x605E;    // i16
inline constexpr std::uint16_t kMode = 0x6060;                   // i8
inline constexpr std::uint16_t kModeDisplay = 0x6061;            // i8
inline constexpr std::uint16_t kPosition = 0x6064;               // i32 [link counts]
inline constexpr std::uint16_t kFollowingErrorWindow = 0x6065;   // u32 [link counts]
inline constexpr std::uint16_t kFollowingErrorTimeout = 0x6066;  // u16 [ms]
inline constexpr std::uint16_t kVelocity = 0x606C;               // i32 [link counts/s]
inline constexpr std::uint16_t kTargetTorque = 0x6071;           // i16 [per mille of rated]
inline constexpr std::uint16_t kMaxTorque = 0x6072;              // u16 [per mille of rated]
inline constexpr std::uint16_t kRatedTorque = 0x6076;            // u32 [mNm]
inline constexpr std::uint16_t kTorque = 0x6077;                 // i16 [per mille of rated]
inline constexpr std::uint16_t kTargetPosition = 0x607A;         // i32 [link counts]
inline constexpr std::uint16_t kHomeOffset = 0x607C;             // i32 [link counts]
inline constexpr std::uint16_t kSoftwareLimits = 0x607D;         // i32: 1 min, 2 max [link counts]
inline constexpr std::uint16_t kMaxProfileVelocity = 0x607F;     // u32 [link counts/s]
inline constexpr std::uint16_t kProfileVelocity = 0x6081;        // u32 [link counts/s]
inline constexpr std::uint16_t kProfileAcceleration = 0x6083;    // u32 [link counts/s^2]
inline constexpr std::uint16_t kProfileDeceleration = 0x6084;    // u32 [link counts/s^2]
inline constexpr std::uint16_t kMotionProfileType = 0x6086;      // i16: 0 a trapezoid
inline constexpr std::uint16_t kQuickStopDeceleration = 0x6085;  // u32 [link counts/s^2]
inline constexpr std::uint16_t kTorqueSlope = 0x6087;            // u32 [per mille of rated / s]
inline constexpr std::uint16_t kPolarity = 0x607E;               // u8: bit 7 position, 6 velocity
inline constexpr std::uint16_t kEncoderResolution = 0x608F;      // u32: 1 counts, 2 per revolutions
inline constexpr std::uint16_t kVelocityResolution = 0x6090;     // u32: as 608F, of velocities
inline constexpr std::uint16_t kGearRatio = 0x6091;       // u32: 1 motor, 2 shaft revolutions
inline constexpr std::uint16_t kFeedConstant = 0x6092;    // u32: 1 feed, 2 shaft revolutions
inline constexpr std::uint16_t kPositionFactor = 0x6093;  // u32: 1 numerator, 2 divisor
inline constexpr std::uint16_t kVelocityEncoderFactor = 0x6094;  // u32: the same
inline constexpr std::uint16_t kVelocityFactor1 = 0x6095;        // u32: the same
inline constexpr std::uint16_t kVelocityFactor = 0x6096;         // u32: the same
inline constexpr std::uint16_t kHomingMethod = 0x6098;           // i8
inline constexpr std::uint16_t kHomingMethods = 0x60E3;          // i8: 1 to n, those that it has
inline constexpr std::uint16_t kHomingSpeeds = 0x6099;           // u32: 1 to the switch, 2 to zero
inline constexpr std::uint16_t kHomingAcceleration = 0x609A;     // u32 [link counts/s^2]
inline constexpr std::uint16_t kPositionUnit = 0x60A8;           // u32: SI unit of positions
inline constexpr std::uint16_t kVelocityUnit = 0x60A9;           // u32: SI unit of velocities
inline constexpr std::uint16_t kPositionOffset = 0x60B0;         // i32 [link counts]
inline constexpr std::uint16_t kVelocityOffset = 0x60B1;         // i32 [link counts/s]
inline constexpr std::uint16_t kTorqueOffset = 0x60B2;           // i16 [per mille of rated]
inline constexpr std::uint16_t kInterpolationData = 0x60C1;      // i32: 1 the position
inline constexpr std::uint16_t kInterpolationPeriod = 0x60C2;    // u8 units, i8 power of ten [s]
inline constexpr std::uint16_t kFollowingError = 0x60F4;         // i32 [link counts]
inline constexpr std::uint16_t kDigitalInputs = 0x60FD;          // u32: digital_input
inline constexpr std::uint16_t kDigitalOutputs = 0x60FE;         // u32: 1 digital_output
inline constexpr std::uint16_t kTargetVelocity = 0x60FF;         // i32 [link counts/s]
inline constexpr std::uint16_t kSupportedModes = 0x6502;         // u32

// The manufacturer's, axis 0
inline constexpr std::uint16_t kMotorPosition = 0x2000;     // i32 [motor counts]
inline constexpr std::uint16_t kMotorVelocity = 0x2001;     // i32 [motor counts/s]
inline constexpr std::uint16_t kCurrent = 0x2002;           // i16 [10 mA]
inline constexpr std::uint16_t kVoltage = 0x2003;           // i16 [10 mV]
inline constexpr std::uint16_t kTemperature = 0x2004;       // i16 [0.1 degC]
inline constexpr std::uint16_t kStiffness = 0x2010;         // f32 [Nm/rad]
inline constexpr std::uint16_t kDamping = 0x2011;           // f32 [Nms/rad]
inline constexpr std::uint16_t kTargetVoltage = 0x2012;     // i16 [10 mV]
inline constexpr std::uint16_t kTargetCurrent = 0x2013;     // i16 [10 mA]
inline constexpr std::uint16_t kPositionGains = 0x2020;     // f32: PidSub
inline constexpr std::uint16_t kVelocityGains = 0x2021;     // f32: PidSub
inline constexpr std::uint16_t kTorqueGains = 0x2022;       // f32: PidSub
inline constexpr std::uint16_t kCurrentGains = 0x2023;      // f32: PidSub
inline constexpr std::uint16_t kFeedForward = 0x2024;       // f32: FeedForwardSub
inline constexpr std::uint16_t kPositionFeedback = 0x2025;  // u8: 0 link encoder, 1 motor's
inline constexpr std::uint16_t kMotorData = 0x2026;         // f32: MotorDataSub
inline constexpr std::uint16_t kEstimators = 0x2027;        // f32 [Hz]: link, motor, torque rate
inline constexpr std::uint16_t kTransferTime = 0x2028;      // f32 [s]
inline constexpr std::uint16_t kLimits = 0x2030;            // f32: LimitSub
inline constexpr std::uint16_t kI2t = 0x2031;               // f32: I2tSub
inline constexpr std::uint16_t kCommandTimeout = 0x2032;    // u16 [SYNCs], 0: never
inline constexpr std::uint16_t kMotorResolution = 0x2033;   // u32 [motor counts per link rev]
inline constexpr std::uint16_t kTemperatureLimit = 0x2034;  // i16 [0.1 degC]
inline constexpr std::uint16_t kUndervoltage = 0x2035;      // f32 [V]
inline constexpr std::uint16_t kStopTime = 0x2036;          // f32 [s]
inline constexpr std::uint16_t kPositionMargin = 0x2037;    // f32 [rad]
inline constexpr std::uint16_t kMismatch = 0x2038;          // f32: 1 window [rad], 2 time [s]
inline constexpr std::uint16_t kOscillation = 0x2039;       // f32: OscillationSub
inline constexpr std::uint16_t kBrake = 0x203A;             // u16: BrakeSub
inline constexpr std::uint16_t kExcess = 0x203B;            // f32: ExcessSub
inline constexpr std::uint16_t kSwing = 0x203C;             // f32 [rad/s], 0: not watched

// The manufacturer's, of a board
inline constexpr std::uint16_t kCycleCounter = 0x2051;  // u8: by RPDO, echoed by TPDO
inline constexpr std::uint16_t kSyncTimeout = 0x2052;   // u32 [us], 0: by 1006 and 2032

// The manufacturer's, of a sensor node
inline constexpr std::uint16_t kSensorChannels = 0x2100;  // f32[]: sub 1 to n, SI units
}  // namespace object

inline constexpr std::uint16_t kAxisStride = 0x800;

/// The index of axis `axis`'s object whose index on axis 0 is `index` (0x2000.. and 0x6000..).
/// @pre 0 <= axis < kMaxAxes
[[nodiscard]] constexpr std::uint16_t of_axis(std::uint16_t index, int axis) noexcept {
  return static_cast<std::uint16_t>(index + kAxisStride * axis);
}

/// Sub-indices of a PDO's communication parameter, 1400.. and 1800...
enum PdoParameterSub : std::uint8_t {
  kPdoCobId = 1,
  kPdoType = 2,
  kPdoInhibit = 3,  ///< [100 us]
  kPdoEvent = 5,    ///< [ms]
};
/// Sub-indices of the gain objects.
enum PidSub : std::uint8_t { kPidKp = 1, kPidKi, kPidKd, kPidOutputLimit };
/// Sub-indices of object::kFeedForward.
enum FeedForwardSub : std::uint8_t {
  kTorqueToVoltage = 1,  ///< [V/Nm] times the link torque reference
  kEmfCompensation,      ///< [Vs/rad] times the motor velocity, reflected to the link
};
/// Sub-indices of object::kMotorData.
enum MotorDataSub : std::uint8_t {
  kMotorResistance = 1,  ///< [ohm]
  kMotorTorqueConstant,  ///< N K [Nm/A] at the link, also [Vs/rad]
  kMotorSpring,          ///< [Nm/rad]; 0: rigid
};
/// Sub-indices of object::kLimits.
enum LimitSub : std::uint8_t {
  kVoltageLimit = 1,  ///< [V] of the motor
  kCurrentLimit,      ///< [A] of the motor, peak
  kTorqueLimit,       ///< [Nm] of the link torque reference
  kVelocityLimit,     ///< [rad/s] of the link
};
/// Sub-indices of object::kI2t.
enum I2tSub : std::uint8_t {
  kContinuousCurrent = 1,  ///< [A] that the motor can carry for ever
  kThermalTime,            ///< [s] time constant of the winding
};
/// Sub-indices of object::kOscillation.
enum OscillationSub : std::uint8_t {
  kOscillationLimit = 1,  ///< [Nm] RMS of the motor torque's fast part; 0: not watched
  kOscillationTime,       ///< [s] over which the mean is taken
};
/// Sub-indices of object::kExcess.
enum ExcessSub : std::uint8_t {
  kExcessShare = 1,  ///< of the limits, by which motion may be beyond them; 0: not watched
  kExcessTime,       ///< [s] for which it may
};
/// Sub-indices of object::kBrake.
enum BrakeSub : std::uint8_t {
  kBrakeFitted = 1,  ///< 1: the motor has a spring-applied brake; 0: none
  kBrakeRelease,     ///< [ms] from its coil's current until it is open
  kBrakeEngage,      ///< [ms] from the current's end until it holds
};
/// Sub-indices of object::kIdentity.
enum IdentitySub : std::uint8_t { kVendor = 1, kProduct, kRevision, kSerial };

/// Identity of our emulated nodes (1018). The vendor id is not one that CiA has given out.
inline constexpr std::uint32_t kTandemVendor = 0x7A4D;
inline constexpr std::uint32_t kBoardProduct = 0x0402;
inline constexpr std::uint32_t kSensorProduct = 0x0404;
inline constexpr std::uint32_t kTandemRevision = 0x00010000;    ///< major 1, minor 0
inline constexpr std::uint32_t kDriveDeviceType = 0x00020192;   ///< servo drive, profile 402
inline constexpr std::uint32_t kSensorDeviceType = 0x00020194;  ///< analogue inputs, profile 404

/// Modes of operation (6060). Negative numbers are the manufacturer's.
enum class Mode : std::int8_t {
  kVelocityImpedance = -4,  ///< spring and damper about the integrated velocity reference
  kCurrent = -3,
  kOpenLoop = -2,   ///< motor voltage
  kImpedance = -1,  ///< spring and damper about the position reference
  kNone = 0,
  kPp = 1,    ///< profile position
  kPv = 3,    ///< profile velocity
  kTq = 4,    ///< profile torque
  kHm = 6,    ///< homing
  kIp = 7,    ///< interpolated position, target 60C1:1
  kCsp = 8,   ///< cyclic synchronous position
  kCsv = 9,   ///< cyclic synchronous velocity
  kCst = 10,  ///< cyclic synchronous torque
};

/// Bit of mode `mode` in 6502. @pre mode >= 1
[[nodiscard]] constexpr std::uint32_t mode_bit(Mode mode) noexcept {
  return 1u << (static_cast<int>(mode) - 1);
}
/// 6502 of our boards: homing, CSP, CSV and CST; bits 16 to 19 are the manufacturer's modes -1 to
/// -4.
inline constexpr std::uint32_t kTandemModes = 1U << 5 | 0x7U << 7 | 0xFU << 16;

/// Bits of the controlword (6040).
namespace controlword {
inline constexpr std::uint16_t kSwitchOn = 1u << 0;
inline constexpr std::uint16_t kEnableVoltage = 1u << 1;
inline constexpr std::uint16_t kQuickStop = 1u << 2;  ///< active low
inline constexpr std::uint16_t kEnableOperation = 1u << 3;
inline constexpr std::uint16_t kEnableInterpolation = 1u << 4;  ///< mode 7: follow 60C1
inline constexpr std::uint16_t kNewSetPoint = 1u << 4;          ///< mode 1: rising edge
inline constexpr std::uint16_t kChangeAtOnce = 1u << 5;         ///< mode 1: not after the last one
inline constexpr std::uint16_t kStartHoming = 1u << 4;          ///< mode 6: rising edge; 0: no more
inline constexpr std::uint16_t kFaultReset = 1u << 7;           ///< rising edge
inline constexpr std::uint16_t kHalt = 1u << 8;

// The commands of CiA 402
inline constexpr std::uint16_t kCommandDisableVoltage = 0x0000;
inline constexpr std::uint16_t kCommandQuickStop = 0x0002;
inline constexpr std::uint16_t kCommandShutdown = 0x0006;
inline constexpr std::uint16_t kCommandSwitchOn = 0x0007;
inline constexpr std::uint16_t kCommandEnableOperation = 0x000F;
inline constexpr std::uint16_t kCommandFaultReset = 0x0080;
}  // namespace controlword

/// Bits of the statusword (6041).
namespace statusword {
inline constexpr std::uint16_t kReadyToSwitchOn = 1u << 0;
inline constexpr std::uint16_t kSwitchedOn = 1u << 1;
inline constexpr std::uint16_t kOperationEnabled = 1u << 2;
inline constexpr std::uint16_t kFault = 1u << 3;
inline constexpr std::uint16_t kVoltageEnabled = 1u << 4;
inline constexpr std::uint16_t kQuickStop = 1u << 5;  ///< active low
inline constexpr std::uint16_t kSwitchOnDisabled = 1u << 6;
inline constexpr std::uint16_t kWarning = 1u << 7;
inline constexpr std::uint16_t kRemote = 1u << 9;
inline constexpr std::uint16_t kTargetReached = 1u << 10;
inline constexpr std::uint16_t kInternalLimit = 1u << 11;
inline constexpr std::uint16_t kSetPointTaken = 1u << 12;   ///< mode 1, until bit 4 falls
inline constexpr std::uint16_t kFollowsCommand = 1u << 12;  ///< CSP, CSV, CST and ours
inline constexpr std::uint16_t kFollowingError = 1u << 13;  ///< CSP
inline constexpr std::uint16_t kHomingAttained = 1u << 12;  ///< homing; with bit 10: it is over
inline constexpr std::uint16_t kHomingError = 1u << 13;     ///< homing
}  // namespace statusword

/// Bits of the digital inputs (60FD).
namespace digital_input {
inline constexpr std::uint32_t kInterlock = 1u << 3;  ///< the emergency stop's
}  // namespace digital_input

/// Bits of the digital outputs (60FE:1).
namespace digital_output {
inline constexpr std::uint32_t kSetBrake = 1u << 0;  ///< the brake's coil has no current
}  // namespace digital_output

/// Emergency and drive error codes (EMCY, 1003, 603F): CiA 301 and 402.
enum class ErrorCode : std::uint16_t {
  kNone = 0x0000,
  kGeneric = 0x1000,
  kOverCurrent = 0x2310,  ///< continuous over-current
  kI2t = 0x2350,          ///< load level fault: I2t, thermal state
  kVoltage = 0x3100,
  kDriveTemperature = 0x4310,
  kSoftware = 0x6000,
  kParameter = 0x6320,
  kPositionSensor = 0x7300,
  kSensorMismatch = 0x7320,  ///< position: two sensors contradict each other
  kCommunicationOverrun = 0x8110,
  kHeartbeatLost = 0x8130,  ///< life guard or heartbeat error
  kBusOffRecovered = 0x8140,
  kPdoTooShort = 0x8210,  ///< PDO not processed due to length error
  kPdoTooLong = 0x8220,
  kSyncLost = 0x8700,         ///< sync controller
  kCommandTimeout = 0xFF01,   ///< ours: SYNCs came without commands
  kEmergencyInput = 0xFF02,   ///< ours: the interlock input (60FD bit 3) is active
  kOscillation = 0xFF03,      ///< ours: the joint rings (2039) or swings (203C)
  kExcessPower = 0xFF04,      ///< ours: more mechanical power than the limits allow (203B)
  kVelocityControl = 0x8400,  ///< velocity (limit) exceeded
  kExcessTorque = 0x8311,     ///< more torque than the limit allows
  kFollowingError = 0x8611,
  kPositionLimit = 0x8612,  ///< reference or position limit
};

/// In words ("following error"), for messages; empty for one that our boards do not have.
[[nodiscard]] const char* to_string(ErrorCode code) noexcept;

/// What a code that CiA 301 or CiA 402 define says; of one that they do not, what its class says.
[[nodiscard]] std::string_view error_words(std::uint16_t code) noexcept;

/// Bits of the error register (1001).
namespace error_register {
inline constexpr std::uint8_t kGeneric = 1u << 0;
inline constexpr std::uint8_t kCurrent = 1u << 1;
inline constexpr std::uint8_t kVoltage = 1u << 2;
inline constexpr std::uint8_t kTemperature = 1u << 3;
inline constexpr std::uint8_t kCommunication = 1u << 4;
inline constexpr std::uint8_t kProfile = 1u << 5;
inline constexpr std::uint8_t kManufacturer = 1u << 7;
}  // namespace error_register

}  // namespace tandem::canopen
