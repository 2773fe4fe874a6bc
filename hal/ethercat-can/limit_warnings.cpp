#include "hal/ethercat-can/limit_warnings.hpp"

#include <fmt/format.h>

#include <array>
#include <utility>
#include <vector>

#include "canopen/drive_abilities.hpp"
#include "canopen/objects.hpp"

namespace tandem::hal::can {
namespace {

namespace object = canopen::object;
using canopen::Mode;
using canopen::SheetEntry;

/// What the master sends every cycle, or sets at the start: index and sub-index.
constexpr std::array<std::pair<std::uint16_t, std::uint8_t>, 10> kSent{
    {{object::kMode, 0},
     {object::kTargetPosition, 0},
     {object::kInterpolationData, 1},
     {object::kTargetVelocity, 0},
     {object::kVelocityOffset, 0},
     {object::kTargetTorque, 0},
     {object::kTorqueOffset, 0},
     {object::kInterpolationPeriod, 1},
     {object::kInterpolationPeriod, 2},
     {object::kHomeOffset, 0}}};

Error warning_at(const canopen::DataSheet& sheet, const SheetEntry& entry, std::string message,
                 std::string hint) {
  return {.message = std::move(message),
          .hint = std::move(hint),
          .file = sheet.file,
          .line = entry.line,
          .key = entry.sub == 0 ? fmt::format("{:04X}", entry.index)
                                : fmt::format("{:04X}:{:X}", entry.index, entry.sub)};
}

void warn_of_reversed(const canopen::DataSheet& sheet, int axis, Diagnostics& warnings) {
  for (const auto& [index, sub] : kSent) {
    const SheetEntry* entry = sheet.find(canopen::of_axis(index, axis), sub);
    if (entry == nullptr || !entry->low || !entry->high || *entry->low <= *entry->high) continue;
    warnings.push_back(warning_at(
        sheet, *entry,
        fmt::format("its LowLimit, {}, is more than its HighLimit, {}: no value is within",
                    *entry->low, *entry->high),
        "correct the sheet; a drive that has these limits refuses what it is sent"));
  }
}

void warn_of_modes(const NodePlan& node, const canopen::DataSheet& sheet, int axis,
                   Diagnostics& warnings) {
  const SheetEntry* entry = sheet.find(canopen::of_axis(object::kMode, axis));
  if (entry == nullptr) return;
  const bool reversed = entry->low && entry->high && *entry->low > *entry->high;
  if (reversed) return;  // has been said
  const canopen::DriveAbilities& can = node.abilities[static_cast<std::size_t>(axis)];
  std::vector<int> beyond;
  for (const Mode mode : {can.position, can.velocity, can.torque}) {
    const int number = static_cast<int>(mode);
    const bool out = (entry->low && number < *entry->low) || (entry->high && number > *entry->high);
    if (mode != Mode::kNone && out) beyond.push_back(number);
  }
  if (beyond.empty()) return;
  warnings.push_back(
      warning_at(sheet, *entry,
                 fmt::format("its limits do not take mode {}, in which the drive is used",
                             fmt::join(beyond, ", ")),
                 "correct the sheet; a drive that has these limits stays in another mode"));
}

}  // namespace

Diagnostics limit_warnings(const NodePlan& node, const canopen::DataSheet& sheet) {
  Diagnostics warnings;
  for (std::size_t a = 0; a < node.abilities.size(); ++a) {
    const int axis = static_cast<int>(a);
    warn_of_reversed(sheet, axis, warnings);
    warn_of_modes(node, sheet, axis, warnings);
  }
  return warnings;
}

}  // namespace tandem::hal::can
