// An object that no PDO has is looked up in the sheet: what is wrong with it there is the reason.
#include "hal/ethercat-can/drive_lacks.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "canopen/objects.hpp"
#include "canopen/sheet_mappings.hpp"

namespace tandem::hal::can {
namespace {

namespace object = canopen::object;
using canopen::DataType;
using canopen::Mode;

/// An object as the master needs it.
struct Need {
  std::uint16_t index;  // of the first axis
  std::uint8_t sub;
  DataType type;
  int bits;
  canopen::Access right;
};
using enum DataType;
constexpr Need kControl{object::kControlword, 0, kUnsigned16, 16, canopen::kMapRpdo};
constexpr Need kStatus{object::kStatusword, 0, kUnsigned16, 16, canopen::kMapTpdo};
constexpr Need kPlace{object::kPosition, 0, kInteger32, 32, canopen::kMapTpdo};
constexpr std::array kTargets{
    Need{object::kTargetPosition, 0, kInteger32, 32, canopen::kMapRpdo},
    Need{object::kInterpolationData, 1, kInteger32, 32, canopen::kMapRpdo},
    Need{object::kTargetVelocity, 0, kInteger32, 32, canopen::kMapRpdo},
    Need{object::kVelocityOffset, 0, kInteger32, 32, canopen::kMapRpdo},
    Need{object::kTargetTorque, 0, kInteger16, 16, canopen::kMapRpdo},
    Need{object::kTorqueOffset, 0, kInteger16, 16, canopen::kMapRpdo},
};

/// Why the PDOs do not carry it; "": it stands in the sheet as it is needed, and in none of them.
std::string reason(const canopen::DataSheet& sheet, const Need& need, std::size_t axis) {
  const std::uint16_t index = canopen::of_axis(need.index, static_cast<int>(axis));
  const canopen::SheetEntry* entry = sheet.find(index, need.sub);
  if (entry == nullptr) return "the sheet does not have it";
  const int bits = canopen::bits_of(*entry);
  if (bits != need.bits) return fmt::format("it has {} bits, and {} are needed", bits, need.bits);
  if (entry->type != static_cast<std::uint16_t>(need.type)) {
    return fmt::format("its data type is {}, and {} is needed", entry->type,
                       static_cast<int>(need.type));
  }
  if ((entry->access & need.right) == 0) {
    return fmt::format("the sheet does not let it be in {}",
                       need.right == canopen::kMapRpdo ? "an RPDO" : "a TPDO");
  }
  for (const canopen::OddMapping& odd : canopen::odd_mappings(sheet)) {
    if (odd.mapped >> 8 == (std::uint32_t{index} << 8 | need.sub)) return odd.text;
  }
  return {};
}

std::string with_reason(const Need& need, std::size_t axis, const std::string& why) {
  std::string text = fmt::format("{:04X}", canopen::of_axis(need.index, static_cast<int>(axis)));
  if (need.sub != 0) text += fmt::format(":{}", need.sub);
  return why.empty() ? text : fmt::format("{} ({})", text, why);
}

WireField target_of(const canopen::DriveAbilities& can, Mode mode) {
  if (mode == can.position) return WireField::kTargetPosition;
  return mode == can.velocity ? WireField::kVelocityOffset : WireField::kTorqueOffset;
}

/// Targets that are in the sheet, and not as a PDO has to have them.
std::string odd_targets(const canopen::DataSheet& sheet, std::size_t axis) {
  std::string text;
  for (const Need& need : kTargets) {
    const auto index = canopen::of_axis(need.index, static_cast<int>(axis));
    if (sheet.find(index, need.sub) == nullptr) continue;
    const std::string why = reason(sheet, need, axis);
    if (!why.empty()) text += "; " + with_reason(need, axis, why);
  }
  return text;
}

}  // namespace

void drop_untargeted(NodePlan& node) {
  for (std::size_t axis = 0; axis < node.abilities.size(); ++axis) {
    canopen::DriveAbilities& can = node.abilities[axis];
    const Mode first = canopen::first_mode(can);
    for (Mode* mode : {&can.velocity, &can.torque}) {
      if (*mode == Mode::kNone || *mode == first) continue;
      if (!node.carries(axis, target_of(can, *mode))) *mode = Mode::kNone;
    }
  }
}

namespace {

/// What the sheet's remarks say of it: a PDO of another sync manager is not there for the rest.
std::string hindrances_of(const canopen::DataSheet& sheet) {
  constexpr std::size_t kMost = 4;
  std::string text;
  for (std::size_t i = 0; i < std::min(kMost, sheet.hindrances.size()); ++i) {
    text += fmt::format("; line {}: {}", sheet.hindrances[i].line, sheet.hindrances[i].text);
  }
  return text;
}

}  // namespace

std::string lacks_of(const NodePlan& node, const canopen::DataSheet& sheet, std::size_t axis) {
  std::vector<std::string> missing;
  for (const auto& [field, need] : {std::pair{WireField::kControlword, kControl},
                                    {WireField::kStatusword, kStatus},
                                    {WireField::kPosition, kPlace}}) {
    if (node.carries(axis, field)) continue;
    missing.push_back(with_reason(need, axis, reason(sheet, need, axis)));
  }
  if (!missing.empty()) {
    return fmt::format("not {}", fmt::join(missing, " and not ")) + hindrances_of(sheet);
  }
  const canopen::DriveAbilities& can = node.abilities[axis];
  const Mode first = canopen::first_mode(can);
  if (first == Mode::kNone) {
    return "no position, velocity or torque target of a cyclic mode" + odd_targets(sheet, axis) +
           hindrances_of(sheet);
  }
  if (node.carries(axis, target_of(can, first))) return {};
  return fmt::format("no target of its mode {}", static_cast<int>(first)) +
         odd_targets(sheet, axis) + hindrances_of(sheet);
}

}  // namespace tandem::hal::can
