// Which field of which axis or sensor sits in which PDO of which node, and where in it.
// Layer: hal/ethercat-can.  Thread: made non-RT; immutable afterwards.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "canopen/drive_abilities.hpp"
#include "canopen/pdo.hpp"
#include "hal/config/robot_config.hpp"

namespace tandem::hal::can {

/// What travels cyclically.
enum class WireField : std::uint8_t {
  // Command: RPDO, every SYNC
  kControlword = 0,
  kMode,
  kTargetPosition,
  kVelocityOffset,
  kTorqueOffset,
  // Slow command: RPDO, when something in it changed
  kTargetVoltage,
  kTargetCurrent,
  kStiffness,
  kDamping,
  kCycleCounter,  ///< command: the low byte of the master's count of SYNCs; of the board
  // Feedback: TPDO, every SYNC
  kStatusword,
  kPosition,
  kVelocity,
  kTorque,
  kMotorPosition,
  // Slow feedback: TPDO, every n-th SYNC
  kMotorVelocity,
  kCurrent,
  kVoltage,
  kTemperature,
  kModeDisplay,
  kErrorCode,
  kCycleEcho,  ///< slow feedback: the counter of the command in force; of the board
  // Sensor: TPDO, every SYNC
  kSensorChannel,
};

/// Whether the field is a part of a sample; one that is not counts when it comes.
[[nodiscard]] constexpr bool is_sampled(WireField field) noexcept {
  return field <= WireField::kMotorPosition || field == WireField::kSensorChannel;
}

/// When a PDO is sent.
enum class PdoGroup : std::uint8_t { kCommand, kSlowCommand, kFeedback, kSlowFeedback, kSensor };

/// How master and node know that the other is there.
enum class NodeWatch : std::uint8_t {
  kHeartbeat,  ///< the node produces one (1017), and consumes the master's where it can (1016)
  kGuarding,   ///< the master asks, the node answers, and misses being asked (100C, 100D)
  kNothing,    ///< only its TPDOs tell that the node is there
};

/// One mapped object.
struct MappedField {
  WireField field = WireField::kControlword;
  std::uint8_t axis = 0;    ///< of the node's axes; a sensor's channel, from 0
  std::uint8_t offset = 0;  ///< of its first byte in the PDO
  std::uint8_t size = 0;    ///< bytes
  std::uint16_t index = 0;  ///< of the object, the axis' offset included
  std::uint8_t sub = 0;
};

/// One PDO of a node.
struct PdoPlan {
  PdoGroup group = PdoGroup::kCommand;
  canopen::PdoDirection direction = canopen::PdoDirection::kReceive;  ///< as the node sees it
  int number = 1;                   ///< 1 to canopen::kPdosPerNode, of its direction
  std::uint16_t mapping_index = 0;  ///< 1600, 1A00 and on; on EtherCAT any of the slave's
  std::uint32_t cob_id = 0;
  std::uint8_t transmission = canopen::kEverySync;
  std::uint8_t bytes = 0;  ///< mapped; the frame may be longer
  std::uint8_t part = 0;   ///< feedback, sensor: of the NodePlan::parts of a sample, from 0
  bool id_written = true;  ///< its COB-ID object can be written; else it is the right one already
  bool type_written = true;
  bool mapping_written = true;
  std::vector<MappedField> fields;
  /// EtherCAT, a PDO that stays as it is: the slave's entries, also those that nobody here reads or
  /// commands. `fields` and `bytes` are without them.
  std::vector<std::uint32_t> entries{};
};

/// Bytes of the PDO as the node has it.
[[nodiscard]] std::size_t wire_bytes(const PdoPlan& pdo);
/// The entries that the node has in this PDO, as mapping_entry() makes them.
[[nodiscard]] std::vector<std::uint32_t> entries_of(const PdoPlan& pdo);

/// The object that a PDO's mapping is: 1600, 1A00 and on.
[[nodiscard]] std::uint16_t mapping_object(const PdoPlan& pdo) noexcept;

/// One node: a board with its axes, or a sensor.
struct NodePlan {
  std::string name;       ///< of the board or the sensor
  std::size_t bus = 0;    ///< index in RobotConfig::buses
  bool ethercat = false;  ///< its bus is a line of slaves
  int id = 0;
  int heartbeat_ms = 50;
  int board = -1;                     ///< index in RobotConfig::boards; -1: a sensor
  int sensor = -1;                    ///< index in RobotConfig::sensors; -1: a board
  int parts = 1;                      ///< TPDOs that one sample of an axis, or of the sensor, takes
  std::vector<std::size_t> joints{};  ///< by axis: index in RobotConfig::joints
  std::vector<PdoPlan> pdos{};    ///< commands first, then slow commands, feedback, slow feedback
  std::vector<PdoPlan> unused{};  ///< in use from power-on: bring-up switches them off
  /// By axis: what its sheet offers.
  std::vector<canopen::DriveAbilities> abilities{};
  std::int64_t boot_time_ns = 1'500'000'000;   ///< from a reset to its boot-up, at most
  std::int64_t start_time_ns = 1'000'000'000;  ///< from NMT start to operational, at most
  NodeWatch watch = NodeWatch::kHeartbeat;

  /// Whether a PDO has this field of an axis.
  [[nodiscard]] bool carries(std::size_t axis, WireField field) const;
};

/// Every node, boards first, in the configuration's order.
struct PdoLayout {
  std::vector<NodePlan> nodes;
};

/// Lays the PDOs of every board and sensor out; numbers and COB-IDs are the pre-defined ones. A
/// board's fields are those that its sheet has objects for, in the PDOs that the sheet offers.
///
/// On CAN FD an axis' block stays whole, and blocks follow one another in frames of at most 64
/// bytes. On EtherCAT an axis has one PDO each way, with all of its fields in it, or as many as its
/// slave needs for them. In frames of
/// eight bytes the fields fill one PDO after the other; one axis of our own
/// boards takes all eight PDOs, two of them for each sample. Where a PDO's mapping cannot be
/// written, it is used as it is.
/// Errors: axes of a board with gaps, more axes or channels than a node's PDOs can carry on its
/// bus, a sheet that describes no CiA 402 drive with a cyclic mode.
[[nodiscard]] Result<PdoLayout> make_pdo_layout(const RobotConfig& robot);

}  // namespace tandem::hal::can
