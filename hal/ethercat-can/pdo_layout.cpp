// Packs the blocks of axes and channels into PDOs: up to 64 bytes with several axes on CAN FD,
// eight bytes with one axis on classic CAN.
#include "hal/ethercat-can/pdo_layout.hpp"

#include <algorithm>
#include <array>
#include <span>

#include "canopen/frame.hpp"
#include "canopen/objects.hpp"

namespace tandem::hal::can {

namespace {

namespace object = canopen::object;
using canopen::PdoDirection;

struct FieldSpec {
  WireField field;
  std::uint16_t index;  // of axis 0
  std::uint8_t size;
};

constexpr std::array kCommandFields{
    FieldSpec{WireField::kControlword, object::kControlword, 2},
    FieldSpec{WireField::kMode, object::kMode, 1},
    FieldSpec{WireField::kTargetPosition, object::kTargetPosition, 4},
    FieldSpec{WireField::kVelocityOffset, object::kVelocityOffset, 4},
    FieldSpec{WireField::kTorqueOffset, object::kTorqueOffset, 2},
};
constexpr std::array kSlowCommandFields{
    FieldSpec{WireField::kTargetVoltage, object::kTargetVoltage, 2},
    FieldSpec{WireField::kTargetCurrent, object::kTargetCurrent, 2},
    FieldSpec{WireField::kStiffness, object::kStiffness, 4},
    FieldSpec{WireField::kDamping, object::kDamping, 4},
};
constexpr std::array kFeedbackFields{
    FieldSpec{WireField::kStatusword, object::kStatusword, 2},
    FieldSpec{WireField::kPosition, object::kPosition, 4},
    FieldSpec{WireField::kVelocity, object::kVelocity, 4},
    FieldSpec{WireField::kTorque, object::kTorque, 2},
    FieldSpec{WireField::kMotorPosition, object::kMotorPosition, 4},
};
constexpr std::array kSlowFeedbackFields{
    FieldSpec{WireField::kMotorVelocity, object::kMotorVelocity, 4},
    FieldSpec{WireField::kCurrent, object::kCurrent, 2},
    FieldSpec{WireField::kVoltage, object::kVoltage, 2},
    FieldSpec{WireField::kTemperature, object::kTemperature, 2},
    FieldSpec{WireField::kModeDisplay, object::kModeDisplay, 1},
    FieldSpec{WireField::kErrorCode, object::kErrorCode, 2},
};

// Classic CAN: one axis, a PDO each.
constexpr std::array kClassicCommand1{kCommandFields[0], kCommandFields[2], kCommandFields[4]};
constexpr std::array kClassicCommand2{kCommandFields[3], kCommandFields[1]};
constexpr std::array kClassicSlowCommand1{kSlowCommandFields[0], kSlowCommandFields[1],
                                          kSlowCommandFields[2]};
constexpr std::array kClassicSlowCommand2{kSlowCommandFields[3]};
constexpr std::array kClassicFeedback1{kFeedbackFields[0], kFeedbackFields[1], kFeedbackFields[3]};
constexpr std::array kClassicFeedback2{kFeedbackFields[2], kFeedbackFields[4]};
constexpr std::array kClassicSlowFeedback1{kSlowFeedbackFields[0], kSlowFeedbackFields[1],
                                           kSlowFeedbackFields[2]};
constexpr std::array kClassicSlowFeedback2{kSlowFeedbackFields[3], kSlowFeedbackFields[4],
                                           kSlowFeedbackFields[5]};

std::size_t most_bytes(bool fd) {
  return fd ? canopen::kMaxFrameBytes : canopen::kClassicFrameBytes;
}

/// Appends blocks to a node's PDOs: one block stays whole.
class Packer {
 public:
  Packer(NodePlan& node, PdoDirection direction, bool fd)
      : node_(node), direction_(direction), most_bytes_(most_bytes(fd)) {}

  /// The next block opens a PDO.
  void begin(PdoGroup group, std::uint8_t transmission) {
    group_ = group;
    transmission_ = transmission;
    current_ = nullptr;
  }
  void add(std::span<const MappedField> block) {
    std::size_t bytes = 0;
    for (const MappedField& field : block) bytes += field.size;
    const bool fits = current_ != nullptr && current_->bytes + bytes <= most_bytes_ &&
                      current_->fields.size() + block.size() <= canopen::kMaxMappedObjects;
    if (!fits) open();
    for (const MappedField& field : block) append(*current_, field);
  }
  [[nodiscard]] bool ok() const { return number_ <= canopen::kPdosPerNode; }

  static void append(PdoPlan& pdo, MappedField field) {
    field.offset = pdo.bytes;
    pdo.bytes = static_cast<std::uint8_t>(pdo.bytes + field.size);
    pdo.fields.push_back(field);
  }

 private:
  void open() {
    ++number_;
    PdoPlan pdo;
    pdo.group = group_;
    pdo.direction = direction_;
    pdo.number = number_;
    pdo.cob_id = direction_ == PdoDirection::kReceive ? canopen::cob::rpdo(number_, node_.id)
                                                      : canopen::cob::tpdo(number_, node_.id);
    pdo.transmission = transmission_;
    current_ = &node_.pdos.emplace_back(std::move(pdo));
  }

  NodePlan& node_;
  PdoDirection direction_;
  std::size_t most_bytes_;
  PdoGroup group_ = PdoGroup::kCommand;
  std::uint8_t transmission_ = canopen::kEverySync;
  int number_ = 0;
  PdoPlan* current_ = nullptr;
};

void add_axes(Packer& packer, std::size_t axes, std::span<const FieldSpec> specs) {
  for (std::size_t axis = 0; axis < axes; ++axis) {
    std::vector<MappedField> block;
    for (const FieldSpec& spec : specs) {
      block.push_back({.field = spec.field,
                       .axis = static_cast<std::uint8_t>(axis),
                       .size = spec.size,
                       .index = canopen::of_axis(spec.index, static_cast<int>(axis))});
    }
    packer.add(block);
  }
}

/// Several axes share a frame.
void lay_out_fd(NodePlan& node, std::uint8_t slow) {
  const std::size_t axes = node.joints.size();
  Packer receive(node, PdoDirection::kReceive, true);
  receive.begin(PdoGroup::kCommand, canopen::kEverySync);
  add_axes(receive, axes, kCommandFields);
  receive.begin(PdoGroup::kSlowCommand, canopen::kEverySync);
  add_axes(receive, axes, kSlowCommandFields);
  Packer transmit(node, PdoDirection::kTransmit, true);
  transmit.begin(PdoGroup::kFeedback, canopen::kEverySync);
  add_axes(transmit, axes, kFeedbackFields);
  transmit.begin(PdoGroup::kSlowFeedback, slow);
  add_axes(transmit, axes, kSlowFeedbackFields);
}

/// One axis takes every PDO.
void lay_out_classic(NodePlan& node, std::uint8_t slow) {
  using Pdo = std::pair<PdoGroup, std::span<const FieldSpec>>;
  Packer receive(node, PdoDirection::kReceive, false);
  for (const auto& [group, fields] :
       {Pdo{PdoGroup::kCommand, kClassicCommand1}, Pdo{PdoGroup::kCommand, kClassicCommand2},
        Pdo{PdoGroup::kSlowCommand, kClassicSlowCommand1},
        Pdo{PdoGroup::kSlowCommand, kClassicSlowCommand2}}) {
    receive.begin(group, canopen::kEverySync);
    add_axes(receive, 1, fields);
  }
  Packer transmit(node, PdoDirection::kTransmit, false);
  for (const auto& [group, fields] :
       {Pdo{PdoGroup::kFeedback, kClassicFeedback1}, Pdo{PdoGroup::kFeedback, kClassicFeedback2},
        Pdo{PdoGroup::kSlowFeedback, kClassicSlowFeedback1},
        Pdo{PdoGroup::kSlowFeedback, kClassicSlowFeedback2}}) {
    transmit.begin(group, group == PdoGroup::kFeedback ? canopen::kEverySync : slow);
    add_axes(transmit, 1, fields);
  }
  node.parts = 2;
  for (PdoPlan& pdo : node.pdos) {
    if (pdo.group == PdoGroup::kFeedback) pdo.part = static_cast<std::uint8_t>(pdo.number - 1);
  }
}

/// The counter ends the first frame of its group that has a byte left.
void add_counter(NodePlan& node, PdoGroup group, WireField field, bool fd) {
  for (PdoPlan& pdo : node.pdos) {
    if (pdo.group != group || pdo.bytes >= most_bytes(fd)) continue;
    Packer::append(pdo, {.field = field, .size = 1, .index = object::kCycleCounter});
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
  return bus;
}

Status assign_axes(const RobotConfig& robot, bool fd, NodePlan& node) {
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
  if (!fd && axes.size() > 1) {
    return std::unexpected(node_error(
        robot, node,
        "has " + std::to_string(axes.size()) + " axes, and its bus is classic CAN: in frames of " +
            "8 bytes one axis takes all eight PDOs of a node",
        "give each axis a board of its own, or set fd = true for the bus '" +
            robot.buses[node.bus].name + "' (line " + std::to_string(robot.buses[node.bus].line) +
            ")"));
  }
  return {};
}

Result<NodePlan> plan_board(const RobotConfig& robot, std::size_t index) {
  const BoardConfig& board = robot.boards[index];
  NodePlan node{.name = board.name,
                .id = board.node_id,
                .heartbeat_ms = board.heartbeat_ms,
                .board = static_cast<int>(index)};
  const auto bus = attach(robot, board.bus, node);
  if (!bus) return std::unexpected(bus.error());
  const bool fd = (*bus)->fd;
  if (auto assigned = assign_axes(robot, fd, node); !assigned) {
    return std::unexpected(assigned.error());
  }
  const auto slow = static_cast<std::uint8_t>(std::clamp(board.slow_pdo_every, 1, 240));
  if (fd) {
    lay_out_fd(node, slow);
  } else if (!node.joints.empty()) {
    lay_out_classic(node, slow);
  }
  add_counter(node, PdoGroup::kCommand, WireField::kCycleCounter, fd);
  add_counter(node, PdoGroup::kSlowFeedback, WireField::kCycleEcho, fd);
  return node;
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
  Packer transmit(node, PdoDirection::kTransmit, fd);
  transmit.begin(PdoGroup::kSensor, canopen::kEverySync);
  for (std::size_t channel = 0; channel < sensor.channels(); ++channel) {
    const MappedField field{.field = WireField::kSensorChannel,
                            .axis = static_cast<std::uint8_t>(channel),
                            .size = 4,
                            .index = object::kSensorChannels,
                            .sub = static_cast<std::uint8_t>(channel + 1)};
    transmit.add({&field, 1});
  }
  if (!transmit.ok()) {
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
