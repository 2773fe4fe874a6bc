// Packs the blocks of axes and channels into PDOs: up to 64 bytes with several axes on CAN FD,
// eight bytes with one axis on classic CAN.
#include "hal/ethercat-can/pdo_layout.hpp"

#include <algorithm>
#include <array>
#include <span>

#include "canopen/drive_abilities.hpp"
#include "canopen/frame.hpp"
#include "canopen/objects.hpp"
#include "hal/ethercat-can/drive_lacks.hpp"
#include "hal/ethercat-can/pdo_packer.hpp"

namespace tandem::hal::can {

namespace {

namespace object = canopen::object;
using canopen::PdoDirection;

/// How long a slave's clock may take to come near the reference, and its way to OP.
constexpr std::int64_t kSlaveStartNs = 15'000'000'000;

// In the order in which they are packed.
constexpr std::array kCommandBlock{WireField::kControlword, WireField::kMode,
                                   WireField::kTargetPosition, WireField::kVelocityOffset,
                                   WireField::kTorqueOffset};
constexpr std::array kFeedbackBlock{WireField::kStatusword, WireField::kPosition,
                                    WireField::kVelocity, WireField::kTorque,
                                    WireField::kMotorPosition};
// The same where they fill frames of eight bytes.
constexpr std::array kShortCommands{WireField::kControlword, WireField::kTargetPosition,
                                    WireField::kTorqueOffset, WireField::kVelocityOffset,
                                    WireField::kMode};
constexpr std::array kShortFeedback{WireField::kStatusword, WireField::kPosition,
                                    WireField::kTorque, WireField::kVelocity,
                                    WireField::kMotorPosition};
// The same in one PDO of an axis.
constexpr std::array kAllCommands{
    WireField::kControlword,    WireField::kMode,         WireField::kTargetPosition,
    WireField::kVelocityOffset, WireField::kTorqueOffset, WireField::kTargetVoltage,
    WireField::kTargetCurrent,  WireField::kStiffness,    WireField::kDamping};
constexpr std::array kAllFeedback{
    WireField::kStatusword,    WireField::kPosition,      WireField::kVelocity, WireField::kTorque,
    WireField::kMotorPosition, WireField::kMotorVelocity, WireField::kCurrent,  WireField::kVoltage,
    WireField::kTemperature,   WireField::kModeDisplay,   WireField::kErrorCode};
constexpr std::array kSlowCommands{WireField::kTargetVoltage, WireField::kTargetCurrent,
                                   WireField::kStiffness, WireField::kDamping};
constexpr std::array kSlowFeedback{WireField::kMotorVelocity, WireField::kCurrent,
                                   WireField::kVoltage,       WireField::kTemperature,
                                   WireField::kModeDisplay,   WireField::kErrorCode};

/// In frames of eight bytes a sample is made of all its TPDOs; on CAN FD every axis is whole in
/// one.
void number_parts(NodePlan& node) {
  int parts = 0;
  for (PdoPlan& pdo : node.pdos) {
    if (pdo.group == PdoGroup::kFeedback) pdo.part = static_cast<std::uint8_t>(parts++);
  }
  node.parts = std::max(1, parts);
}

/// The counter ends the first frame of its group that has a byte left.
void add_counter(NodePlan& node, PdoGroup group, WireField field, bool fd) {
  for (PdoPlan& pdo : node.pdos) {
    if (pdo.group != group || pdo.bytes >= most_bytes(fd)) continue;
    PdoPacker::append(pdo, {.field = field, .size = 1, .index = object::kCycleCounter});
    return;
  }
}

Error node_error(const RobotConfig& robot, const NodePlan& node, std::string message,
                 std::string hint) {
  const bool board = node.board >= 0;
  return {.message = std::move(message),
          .hint = std::move(hint),
          .file = robot.file,
          .line = board ? robot.boards[static_cast<std::size_t>(node.board)].line
                        : robot.sensors[static_cast<std::size_t>(node.sensor)].line,
          .key = (board ? "board '" : "sensor '") + node.name + "'"};
}

Result<const BusConfig*> attach(const RobotConfig& robot, const std::string& name, NodePlan& node) {
  const BusConfig* bus = robot.bus(name);
  if (bus == nullptr) {
    return std::unexpected(node_error(robot, node, "is on the unknown bus '" + name + "'",
                                      "name one of the [[bus]] tables"));
  }
  node.bus = static_cast<std::size_t>(bus - robot.buses.data());
  node.ethercat = bus->kind == BusKind::kEthercat;
  if (node.ethercat) node.start_time_ns = kSlaveStartNs;
  return bus;
}

Status assign_axes(const RobotConfig& robot, NodePlan& node) {
  std::vector<std::pair<int, std::size_t>> axes;
  for (std::size_t j = 0; j < robot.joints.size(); ++j) {
    if (robot.joints[j].board == node.name) axes.emplace_back(robot.joints[j].axis, j);
  }
  std::ranges::sort(axes);
  for (std::size_t a = 0; a < axes.size(); ++a) {
    if (axes[a].first != static_cast<int>(a)) {
      return std::unexpected(node_error(robot, node, "axis " + std::to_string(a) + " has no joint",
                                        "number a board's axes from 0 without gaps"));
    }
    node.joints.push_back(axes[a].second);
  }
  if (axes.size() > static_cast<std::size_t>(canopen::kMaxAxes)) {
    return std::unexpected(
        node_error(robot, node, "has more than 8 axes", "move joints to another board"));
  }
  return {};
}

/// A heartbeat each way is best; a drive that consumes none may be guarded.
NodeWatch watch_of(const canopen::DataSheet& sheet) {
  const bool produces = writable(sheet, object::kHeartbeatProducer, 0);
  const bool consumes = writable(sheet, object::kHeartbeatConsumer, 1);
  const bool guarded =
      writable(sheet, object::kGuardTime, 0) && writable(sheet, object::kLifeTimeFactor, 0);
  if (produces && (consumes || !guarded)) return NodeWatch::kHeartbeat;
  return guarded ? NodeWatch::kGuarding : NodeWatch::kNothing;
}

/// "", or that the drive's own modes (6502) make their own way to a target.
std::string profile_modes(const canopen::DataSheet& sheet, std::size_t axis) {
  using canopen::Mode;
  const auto modes =
      sheet.value(canopen::of_axis(object::kSupportedModes, static_cast<int>(axis)), 0, 0);
  std::string names;
  for (const auto& [mode, name] : {std::pair{Mode::kPp, "profile position"},
                                   {Mode::kPv, "profile velocity"},
                                   {Mode::kTq, "profile torque"}}) {
    const bool has = (modes.value_or(0) & canopen::mode_bit(mode)) != 0;
    if (has) names += (names.empty() ? "" : ", ") + std::string(name);
  }
  return names.empty()
             ? ""
             : ". Its modes (6502) make their own way to a target (" + names +
                   "). The master uses profile position with a 6081 and a ramp (6083 or 6084) "
                   "that it can write, and profile velocity with a ramp and with a watch "
                   "for a dead master (1016, or 100C and 100D)";
}

/// Errors: an axis cannot be switched on, seen or moved with what the PDOs carry.
/// @param unused  why PDOs that carry something of them are not used; may be empty
Status check_drive(const RobotConfig& robot, const NodePlan& node, const canopen::DataSheet& sheet,
                   const std::string& unused) {
  using canopen::Mode;
  for (std::size_t axis = 0; axis < node.joints.size(); ++axis) {
    const std::string what = lacks_of(node, sheet, axis);
    if (what.empty()) continue;
    const bool moves = canopen::first_mode(node.abilities[axis]) != Mode::kNone;
    return std::unexpected(node_error(
        robot, node,
        "cannot be driven in every cycle: the PDOs of its sheet " + sheet.file + " carry of axis " +
            std::to_string(axis) + " " + what + unused + (moves ? "" : profile_modes(sheet, axis)),
        node.ethercat ? "`tandem eds show` lists what the drive offers; a PDO that is Fixed, or "
                        "whose CoE has no PdoConfig, keeps its entries"
                      : "`tandem eds show` lists what the drive offers; a PDO whose COB-ID is read "
                        "only keeps its mapping"));
  }
  return {};
}

/// The sheet's PDOs are too few, or too short, for what the axes need.
Status too_narrow(const RobotConfig& robot, const NodePlan& node, bool fd) {
  const std::size_t axes = node.joints.size();
  if (fd || axes < 2) {
    return std::unexpected(node_error(robot, node,
                                      "offers too few PDOs for its commands and feedback",
                                      "`tandem eds show` lists the PDOs of its sheet"));
  }
  return std::unexpected(node_error(
      robot, node,
      "has " + std::to_string(axes) + " axes, and its bus is classic CAN: in frames of " +
          "8 bytes one axis takes all eight PDOs of a node",
      "give each axis a board of its own, or set fd = true for the bus '" +
          robot.buses[node.bus].name + "' (line " + std::to_string(robot.buses[node.bus].line) +
          ")"));
}

/// Errors: a direction's PDOs that can be mapped do not take all that has to be in them. A slave's
/// may: whether the rest is enough is seen when all are laid out.
/// @param unused  appended to: PDOs that cannot be used, with the reason
Status pack(const RobotConfig& robot, const BoardConfig& board, BoardPacker::Spread spread,
            NodePlan& node, std::string& unused) {
  using enum BoardPacker::Spread;
  const canopen::DataSheet& sheet = *board.sheet;
  const bool fill = spread == kFill;
  const auto slow = static_cast<std::uint8_t>(std::clamp(board.slow_pdo_every, 1, 240));
  BoardPacker receive(node, sheet, PdoDirection::kReceive, spread);
  receive.add(PdoGroup::kCommand, canopen::kEverySync,
              fill              ? std::span<const WireField>(kShortCommands)
              : spread == kEach ? std::span<const WireField>(kAllCommands)
                                : std::span<const WireField>(kCommandBlock));
  if (spread != kEach) receive.add(PdoGroup::kSlowCommand, canopen::kEverySync, kSlowCommands);
  const auto narrow = [&](const BoardPacker& packer) {
    return spread != kEach && packer.has_mappable() && !packer.left().empty();
  };
  if (narrow(receive)) return too_narrow(robot, node, !fill);
  receive.use_fixed(PdoGroup::kCommand);
  BoardPacker transmit(node, sheet, PdoDirection::kTransmit, spread);
  transmit.add(PdoGroup::kFeedback, canopen::kEverySync,
               fill              ? std::span<const WireField>(kShortFeedback)
               : spread == kEach ? std::span<const WireField>(kAllFeedback)
                                 : std::span<const WireField>(kFeedbackBlock));
  if (narrow(transmit)) return too_narrow(robot, node, !fill);
  if (spread != kEach) transmit.add(PdoGroup::kSlowFeedback, slow, kSlowFeedback);
  transmit.use_fixed(PdoGroup::kFeedback);
  unused = receive.unused() + transmit.unused();
  return {};
}

/// An assignment that cannot be written has an order of its own.
void put_in_order(NodePlan& node, const canopen::DataSheet& sheet) {
  const auto place = [&](const PdoPlan& pdo) {
    const bool receive = pdo.direction == PdoDirection::kReceive;
    const std::uint16_t assignment = receive ? kAssignOutputs : kAssignInputs;
    const int fixed = assignment_written(sheet, pdo.direction)
                          ? 0
                          : place_in_assignment(sheet, assignment, pdo.mapping_index);
    return std::pair{receive ? 0 : 1, fixed};
  };
  std::ranges::stable_sort(node.pdos, {}, place);
}

/// Whether an axis' sample is in more than one PDO.
bool has_several_parts(const NodePlan& node) {
  const auto feedback = std::ranges::count(node.pdos, PdoGroup::kFeedback, &PdoPlan::group);
  return feedback > static_cast<std::ptrdiff_t>(node.joints.size());
}

Status pack_board(const RobotConfig& robot, const BoardConfig& board, bool fd, NodePlan& node) {
  using enum canopen::Access;
  using enum BoardPacker::Spread;
  const canopen::DataSheet& sheet = *board.sheet;
  const BoardPacker::Spread spread = node.ethercat ? kEach : fd ? kTogether : kFill;
  std::string unused;
  if (Status packed = pack(robot, board, spread, node, unused); !packed) return packed;
  if (node.ethercat) put_in_order(node, sheet);
  const bool spread_out = node.ethercat && has_several_parts(node);
  if (spread == kFill || spread_out) number_parts(node);
  const auto type = canopen::DataType::kUnsigned8;
  if (canopen::mappable(sheet, object::kCycleCounter, 0, type, kMapRpdo)) {
    add_counter(node, PdoGroup::kCommand, WireField::kCycleCounter, fd);
    add_counter(node, spread == kEach ? PdoGroup::kFeedback : PdoGroup::kSlowFeedback,
                WireField::kCycleEcho, fd);
  }
  node.watch = node.ethercat ? NodeWatch::kHeartbeat : watch_of(sheet);
  node.boot_time_ns = board.boot_time_ns;
  drop_untargeted(node);
  return check_drive(robot, node, sheet, unused);
}

Result<NodePlan> plan_board(const RobotConfig& robot, std::size_t index) {
  const BoardConfig& board = robot.boards[index];
  NodePlan node{.name = board.name,
                .id = board.node_id,
                .heartbeat_ms = board.heartbeat_ms,
                .board = static_cast<int>(index)};
  const auto bus = attach(robot, board.bus, node);
  if (!bus) return std::unexpected(bus.error());
  if (auto assigned = assign_axes(robot, node); !assigned) {
    return std::unexpected(assigned.error());
  }
  for (std::size_t axis = 0; axis < node.joints.size(); ++axis) {
    node.abilities.push_back(canopen::abilities_of(*board.sheet, static_cast<int>(axis)));
  }
  const bool fd = (*bus)->fd && board.sheet->most_pdo_bytes > 8;
  if (auto packed = pack_board(robot, board, fd, node); !packed) {
    return std::unexpected(packed.error());
  }
  return node;
}

/// A sensor of ours has all four TPDOs to be mapped.
std::vector<PdoSlot> sensor_slots() {
  std::vector<PdoSlot> slots(canopen::kPdosPerNode);
  for (int number = 1; number <= canopen::kPdosPerNode; ++number) {
    PdoSlot& slot = slots[static_cast<std::size_t>(number - 1)];
    slot.number = number;
    slot.most_entries = static_cast<std::uint8_t>(canopen::kMaxMappedObjects);
  }
  return slots;
}

Result<NodePlan> plan_sensor(const RobotConfig& robot, std::size_t index) {
  const SensorConfig& sensor = robot.sensors[index];
  NodePlan node{.name = sensor.name,
                .id = sensor.node_id,
                .heartbeat_ms = sensor.heartbeat_ms,
                .sensor = static_cast<int>(index)};
  const auto bus = attach(robot, sensor.bus, node);
  if (!bus) return std::unexpected(bus.error());
  const bool fd = (*bus)->fd;
  PdoPacker transmit(node, PdoDirection::kTransmit, most_bytes(fd), sensor_slots());
  transmit.begin(PdoGroup::kSensor, canopen::kEverySync);
  bool fits = true;
  for (std::size_t channel = 0; channel < sensor.channels(); ++channel) {
    const MappedField field{.field = WireField::kSensorChannel,
                            .axis = static_cast<std::uint8_t>(channel),
                            .size = 4,
                            .index = object::kSensorChannels,
                            .sub = static_cast<std::uint8_t>(channel + 1)};
    fits = transmit.add({&field, 1}) && fits;
  }
  if (!fits) {
    const std::size_t most = canopen::kPdosPerNode * most_bytes(fd) / 4;
    return std::unexpected(
        node_error(robot, node,
                   "has " + std::to_string(sensor.channels()) + " channels, and four PDOs on a " +
                       (fd ? "CAN FD" : "classic CAN") + " bus carry " + std::to_string(most),
                   fd ? "split the sensor" : "move it to a bus with fd = true"));
  }
  node.parts = static_cast<int>(node.pdos.size());
  for (PdoPlan& pdo : node.pdos) pdo.part = static_cast<std::uint8_t>(pdo.number - 1);
  return node;
}

}  // namespace

std::uint16_t mapping_object(const PdoPlan& pdo) noexcept { return pdo.mapping_index; }

std::size_t wire_bytes(const PdoPlan& pdo) {
  if (pdo.entries.empty()) return pdo.bytes;
  std::size_t bits = 0;
  for (const std::uint32_t entry : pdo.entries) bits += entry & 0xFF;
  return (bits + 7) / 8;
}

std::vector<std::uint32_t> entries_of(const PdoPlan& pdo) {
  if (!pdo.entries.empty()) return pdo.entries;
  std::vector<std::uint32_t> entries;
  for (const MappedField& field : pdo.fields) {
    entries.push_back(canopen::mapping_entry(field.index, field.sub, field.size));
  }
  return entries;
}

bool NodePlan::carries(std::size_t axis, WireField field) const {
  return std::ranges::any_of(pdos, [&](const PdoPlan& pdo) {
    return std::ranges::any_of(
        pdo.fields, [&](const MappedField& f) { return f.axis == axis && f.field == field; });
  });
}

Result<PdoLayout> make_pdo_layout(const RobotConfig& robot) {
  PdoLayout layout;
  for (std::size_t i = 0; i < robot.boards.size(); ++i) {
    auto node = plan_board(robot, i);
    if (!node) return std::unexpected(node.error());
    layout.nodes.push_back(std::move(*node));
  }
  for (std::size_t i = 0; i < robot.sensors.size(); ++i) {
    auto node = plan_sensor(robot, i);
    if (!node) return std::unexpected(node.error());
    layout.nodes.push_back(std::move(*node));
  }
  return layout;
}

}  // namespace tandem::hal::can
