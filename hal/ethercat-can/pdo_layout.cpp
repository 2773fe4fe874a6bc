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

/// Appends blocks to a node's PDOs: one block stays whole.
class Packer {
 public:
  Packer(NodePlan& node, PdoDirection direction) : node_(node), direction_(direction) {}

  void begin(PdoGroup group, std::uint8_t transmission) {
    group_ = group;
    transmission_ = transmission;
    current_ = nullptr;
  }
  void add(std::span<const MappedField> block) {
    std::size_t bytes = 0;
    for (const MappedField& field : block) bytes += field.size;
    const bool fits = current_ != nullptr &&
                      current_->bytes + bytes <= canopen::kMaxFrameBytes &&
                      current_->fields.size() + block.size() <= canopen::kMaxMappedObjects;
    if (!fits) open();
    for (MappedField field : block) {
      field.offset = current_->bytes;
      current_->bytes = static_cast<std::uint8_t>(current_->bytes + field.size);
      current_->fields.push_back(field);
    }
  }
  [[nodiscard]] bool ok() const { return number_ <= canopen::kPdosPerNode; }

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

Error node_error(const NodePlan& node, const char* kind, std::string message, std::string hint) {
  return {.message = std::move(message),
          .hint = std::move(hint),
          .file = {},
          .key = std::string(kind) + " '" + node.name + "'"};
}

Result<NodePlan> plan_board(const RobotConfig& robot, std::size_t index) {
  const BoardConfig& board = robot.boards[index];
  NodePlan node{.name = board.name,
                .id = board.node_id,
                .heartbeat_ms = board.heartbeat_ms,
                .board = static_cast<int>(index)};
  std::vector<std::pair<int, std::size_t>> axes;
  for (std::size_t j = 0; j < robot.joints.size(); ++j) {
    if (robot.joints[j].board == board.name) axes.emplace_back(robot.joints[j].axis, j);
  }
  std::ranges::sort(axes);
  for (std::size_t a = 0; a < axes.size(); ++a) {
    if (axes[a].first != static_cast<int>(a)) {
      return std::unexpected(node_error(node, "board",
                                        "axis " + std::to_string(a) + " has no joint",
                                        "number a board's axes from 0 without gaps"));
    }
    node.joints.push_back(axes[a].second);
  }
  if (axes.size() > static_cast<std::size_t>(canopen::kMaxAxes)) {
    return std::unexpected(node_error(node, "board", "has more than 8 axes",
                                      "move joints to another board"));
  }
  const auto slow = static_cast<std::uint8_t>(std::clamp(board.slow_pdo_every, 1, 240));
  Packer receive(node, PdoDirection::kReceive);
  receive.begin(PdoGroup::kCommand, canopen::kEverySync);
  add_axes(receive, axes.size(), kCommandFields);
  receive.begin(PdoGroup::kSlowCommand, canopen::kEverySync);
  add_axes(receive, axes.size(), kSlowCommandFields);
  Packer transmit(node, PdoDirection::kTransmit);
  transmit.begin(PdoGroup::kFeedback, canopen::kEverySync);
  add_axes(transmit, axes.size(), kFeedbackFields);
  transmit.begin(PdoGroup::kSlowFeedback, slow);
  add_axes(transmit, axes.size(), kSlowFeedbackFields);
  return node;
}

Result<NodePlan> plan_sensor(const RobotConfig& robot, std::size_t index) {
  const SensorConfig& sensor = robot.sensors[index];
  NodePlan node{.name = sensor.name, .id = sensor.node_id, .sensor = static_cast<int>(index)};
  Packer transmit(node, PdoDirection::kTransmit);
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
    return std::unexpected(node_error(node, "sensor", "has more channels than four PDOs carry",
                                      "at most 64 channels of 4 bytes"));
  }
  return node;
}

Status attach(const RobotConfig& robot, const std::string& bus_name, const char* kind,
              NodePlan& node) {
  const BusConfig* bus = robot.bus(bus_name);
  if (bus == nullptr) {
    return std::unexpected(node_error(node, kind, "is on the unknown bus '" + bus_name + "'",
                                      "name one of the [[bus]] tables"));
  }
  if (!bus->fd) {
    return std::unexpected(node_error(node, kind,
                                      "is on bus '" + bus_name + "', which is classic CAN",
                                      "PDOs are laid out for CAN FD only: set fd = true"));
  }
  node.bus = static_cast<std::size_t>(bus - robot.buses.data());
  return {};
}

}  // namespace

Result<PdoLayout> make_pdo_layout(const RobotConfig& robot) {
  PdoLayout layout;
  for (std::size_t i = 0; i < robot.boards.size(); ++i) {
    auto node = plan_board(robot, i);
    if (!node) return std::unexpected(node.error());
    if (auto ok = attach(robot, robot.boards[i].bus, "board", *node); !ok) {
      return std::unexpected(ok.error());
    }
    layout.nodes.push_back(std::move(*node));
  }
  for (std::size_t i = 0; i < robot.sensors.size(); ++i) {
    auto node = plan_sensor(robot, i);
    if (!node) return std::unexpected(node.error());
    if (auto ok = attach(robot, robot.sensors[i].bus, "sensor", *node); !ok) {
      return std::unexpected(ok.error());
    }
    layout.nodes.push_back(std::move(*node));
  }
  return layout;
}

}  // namespace tandem::hal::can
