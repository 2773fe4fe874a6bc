// Reads 14xx to 1Axx of a sheet, and finds the objects behind the image's fields in it.
#include "hal/ethercat-can/pdo_slots.hpp"

#include <algorithm>
#include <array>

#include "canopen/objects.hpp"

namespace tandem::hal::can {
namespace {

using namespace canopen;
namespace object = canopen::object;
using enum canopen::DataType;

struct PlainField {
  WireField field;
  std::uint16_t index;  // of axis 0
  DataType type;
};
constexpr std::array kPlainCommands{
    PlainField{WireField::kControlword, object::kControlword, kUnsigned16},
    PlainField{WireField::kMode, object::kMode, kInteger8},
    PlainField{WireField::kTargetVoltage, object::kTargetVoltage, kInteger16},
    PlainField{WireField::kTargetCurrent, object::kTargetCurrent, kInteger16},
    PlainField{WireField::kStiffness, object::kStiffness, kReal32},
    PlainField{WireField::kDamping, object::kDamping, kReal32},
};
constexpr std::array kFeedback{
    PlainField{WireField::kStatusword, object::kStatusword, kUnsigned16},
    PlainField{WireField::kPosition, object::kPosition, kInteger32},
    PlainField{WireField::kVelocity, object::kVelocity, kInteger32},
    PlainField{WireField::kTorque, object::kTorque, kInteger16},
    PlainField{WireField::kMotorPosition, object::kMotorPosition, kInteger32},
    PlainField{WireField::kMotorVelocity, object::kMotorVelocity, kInteger32},
    PlainField{WireField::kCurrent, object::kCurrent, kInteger16},
    PlainField{WireField::kVoltage, object::kVoltage, kInteger16},
    PlainField{WireField::kTemperature, object::kTemperature, kInteger16},
    PlainField{WireField::kModeDisplay, object::kModeDisplay, kInteger8},
    PlainField{WireField::kErrorCode, object::kErrorCode, kUnsigned16},
};

std::uint8_t bytes_of(DataType type) {
  switch (type) {
    case kInteger8:
    case kUnsigned8: return 1;
    case kInteger16:
    case kUnsigned16: return 2;
    default: return 4;
  }
}

/// Finds the objects of one axis.
class Finder {
 public:
  Finder(const DataSheet& sheet, int axis) : sheet_(sheet), axis_(axis) {}

  [[nodiscard]] std::optional<MappedField> operator()(WireField field, std::uint16_t index,
                                                      std::uint8_t sub, DataType type,
                                                      Access right) const {
    const std::uint16_t at = of_axis(index, axis_);
    if (!mappable(sheet_, at, sub, type, right)) return {};
    return MappedField{.field = field,
                       .axis = static_cast<std::uint8_t>(axis_),
                       .size = bytes_of(type),
                       .index = at,
                       .sub = sub};
  }

 private:
  const DataSheet& sheet_;
  int axis_;
};

/// @param number  of the node's value, without its id where the sheet leaves that to the node
std::uint32_t identifier(const SheetEntry* entry, std::uint32_t otherwise, int node_id) {
  return entry != nullptr && entry->value ? static_cast<std::uint32_t>(entry->value->of(node_id))
                                          : otherwise;
}

std::vector<std::uint32_t> default_mapping(const DataSheet& sheet, std::uint16_t mapping) {
  std::vector<std::uint32_t> entries;
  const auto count = sheet.value(mapping, 0, 0).value_or(0);
  for (int sub = 1; sub <= count; ++sub) {
    const auto entry = sheet.value(mapping, static_cast<std::uint8_t>(sub), 0);
    if (!entry) return {};
    entries.push_back(static_cast<std::uint32_t>(*entry));
  }
  return entries;
}

std::uint8_t entries_of(const DataSheet& sheet, std::uint16_t mapping) {
  std::uint8_t most = 0;
  while (most < kMaxMappedObjects && canopen::writable(sheet, mapping, most + 1u)) ++most;
  const SheetEntry* count = sheet.find(mapping, 0);
  const std::int64_t limit = count != nullptr ? count->high.value_or(0) : 0;
  return limit > 0 ? static_cast<std::uint8_t>(std::min<std::int64_t>(most, limit)) : most;
}

}  // namespace

std::vector<PdoSlot> pdo_slots(const DataSheet& sheet, PdoDirection direction, int node_id) {
  const bool receive = direction == PdoDirection::kReceive;
  std::vector<PdoSlot> slots;
  for (int number = 1; number <= kPdosPerNode; ++number) {
    const auto offset = static_cast<std::uint16_t>(number - 1);
    const auto parameter = static_cast<std::uint16_t>(
        (receive ? object::kRpdoParameter : object::kTpdoParameter) + offset);
    const auto mapping = static_cast<std::uint16_t>(
        (receive ? object::kRpdoMapping : object::kTpdoMapping) + offset);
    const SheetEntry* id = sheet.find(parameter, 1);
    if (id == nullptr) continue;
    const std::uint32_t own = receive ? cob::rpdo(number, node_id) : cob::tpdo(number, node_id);
    const std::uint32_t from_power_on = identifier(id, own | cob::kInvalid, node_id);
    PdoSlot slot{.number = number,
                 .mappable = canopen::remappable(sheet, parameter),
                 .on = (from_power_on & cob::kInvalid) == 0,
                 .id_writable = writable(sheet, parameter, 1),
                 .type_writable = writable(sheet, parameter, 2),
                 .type = static_cast<std::uint8_t>(
                     sheet.value(parameter, 2, node_id).value_or(kEventProfile)),
                 .most_entries = entries_of(sheet, mapping),
                 .mapping = default_mapping(sheet, mapping)};
    slot.timely = receive || slot.type_writable || slot.type == kEverySync;
    const bool ours = slot.on && (from_power_on & cob::kIdMask) == own;
    if (!slot.id_writable && !ours) continue;
    if (slot.mappable ? slot.most_entries == 0 : slot.mapping.empty()) continue;
    slots.push_back(std::move(slot));
  }
  return slots;
}

bool assignment_written(const DataSheet& sheet, PdoDirection direction) {
  const auto assignment = direction == PdoDirection::kReceive ? kAssignOutputs : kAssignInputs;
  return !sheet.has(assignment) || writable(sheet, assignment, 0);
}

int place_in_assignment(const DataSheet& sheet, std::uint16_t assignment, std::uint16_t pdo) {
  const auto count = static_cast<int>(sheet.value(assignment, 0, 0).value_or(0));
  for (int place = 0; place < count; ++place) {
    if (sheet.value(assignment, static_cast<std::uint8_t>(place + 1), 0) == pdo) return place;
  }
  return count;
}

std::vector<PdoSlot> line_slots(const DataSheet& sheet, PdoDirection direction) {
  const bool receive = direction == PdoDirection::kReceive;
  const std::uint16_t first = receive ? object::kRpdoMapping : object::kTpdoMapping;
  const std::uint16_t assignment = receive ? kAssignOutputs : kAssignInputs;
  const bool chosen = assignment_written(sheet, direction);
  const auto assigned = static_cast<int>(sheet.value(assignment, 0, 0).value_or(0));
  std::vector<std::pair<int, PdoSlot>> found;
  for (const SheetEntry& entry : sheet.entries) {
    const int number = entry.index - first + 1;
    if (entry.sub != 0 || number < 1 || number > 0x200) continue;
    const int place = place_in_assignment(sheet, assignment, entry.index);
    if (!chosen && place == assigned) continue;
    PdoSlot slot{.number = number,
                 .mappable = writable(sheet, entry.index, 0) && writable(sheet, entry.index, 1),
                 .id_writable = false,
                 .type_writable = false,
                 .type = kEverySync,
                 .most_entries = entries_of(sheet, entry.index),
                 .mapping = default_mapping(sheet, entry.index)};
    slot.required =
        !chosen || std::ranges::find(sheet.mandatory, entry.index) != sheet.mandatory.end();
    for (const auto& [one, other] : sheet.excludes) {
      if (one == entry.index) slot.excludes.push_back(other - first + 1);
      if (other == entry.index) slot.excludes.push_back(one - first + 1);
    }
    if (slot.mappable ? slot.most_entries == 0 : slot.mapping.empty()) continue;
    found.emplace_back(place, std::move(slot));
  }
  std::ranges::stable_sort(found, {}, &std::pair<int, PdoSlot>::first);
  std::vector<PdoSlot> slots;
  for (auto& [place, slot] : found) slots.push_back(std::move(slot));
  return slots;
}

std::optional<std::uint32_t> resting_value(const DataSheet& sheet, std::uint32_t entry) {
  const auto index = static_cast<std::uint16_t>(entry >> 16);
  const auto sub = static_cast<std::uint8_t>(entry >> 8);
  if (index < 0x1000) return 0;  // a gap
  if ((entry & 0xFF) > 32) return {};
  const auto said = sheet.value(index, sub, 0);
  if (said && *said != 0) return static_cast<std::uint32_t>(*said);
  // Targets of other modes, offsets, touch probes, outputs: none of them asks for anything at 0.
  constexpr std::array<std::uint16_t, 11> kNothingAtZero{
      object::kTargetPosition,
      object::kTargetVelocity,
      object::kTargetTorque,
      object::kPositionOffset,
      object::kVelocityOffset,
      object::kTorqueOffset,
      object::kProfileVelocity,
      object::kProfileAcceleration,
      object::kProfileDeceleration,
      0x60B8,  // touch probe function
      0x60FE,  // digital outputs
  };
  const bool nothing = index >= 0x6000 && index < 0xA000 &&
                       std::ranges::find(kNothingAtZero, 0x6000 + (index - 0x6000) % kAxisStride) !=
                           kNothingAtZero.end();
  return nothing ? std::optional<std::uint32_t>(0) : std::nullopt;
}

std::vector<std::pair<int, std::uint32_t>> further_pdos(const DataSheet& sheet,
                                                        PdoDirection direction, int node_id) {
  constexpr int kMostPdos = 512;
  const auto first =
      direction == PdoDirection::kReceive ? object::kRpdoParameter : object::kTpdoParameter;
  std::vector<std::pair<int, std::uint32_t>> found;
  for (const SheetEntry& entry : sheet.entries) {
    const int number = entry.index - first + 1;
    if (entry.sub != 1 || number <= kPdosPerNode || number > kMostPdos) continue;
    const std::uint32_t id = identifier(&entry, cob::kInvalid, node_id);
    if ((id & cob::kInvalid) == 0 && (entry.access & kWrite) != 0) found.emplace_back(number, id);
  }
  return found;
}

std::optional<MappedField> object_of(const DataSheet& sheet, const DriveAbilities& can,
                                     WireField field, int axis) {
  const Finder find(sheet, axis);
  const bool follows = can.position == Mode::kCsp;
  const bool profile = moves_by_profile(can);
  switch (field) {
    case WireField::kTargetPosition:
      if (follows || can.position == Mode::kPp)
        return find(field, object::kTargetPosition, 0, kInteger32, kMapRpdo);
      if (can.position == Mode::kIp)
        return find(field, object::kInterpolationData, 1, kInteger32, kMapRpdo);
      return {};
    case WireField::kVelocityOffset: {
      if (can.velocity == Mode::kPv)
        return find(field, object::kTargetVelocity, 0, kInteger32, kMapRpdo);
      if (!follows && can.velocity == Mode::kNone) return {};
      auto found = find(field, object::kVelocityOffset, 0, kInteger32, kMapRpdo);
      if (found || can.velocity == Mode::kNone) return found;
      return find(field, object::kTargetVelocity, 0, kInteger32, kMapRpdo);
    }
    case WireField::kTorqueOffset: {
      if (profile) return {};
      if (!follows && can.velocity == Mode::kNone && can.torque == Mode::kNone) return {};
      auto found = find(field, object::kTorqueOffset, 0, kInteger16, kMapRpdo);
      if (found || can.torque == Mode::kNone) return found;
      return find(field, object::kTargetTorque, 0, kInteger16, kMapRpdo);
    }
    default: break;
  }
  for (const PlainField& plain : kPlainCommands) {
    if (plain.field == field) return find(field, plain.index, 0, plain.type, kMapRpdo);
  }
  for (const PlainField& plain : kFeedback) {
    if (plain.field == field) return find(field, plain.index, 0, plain.type, kMapTpdo);
  }
  return {};
}

}  // namespace tandem::hal::can
