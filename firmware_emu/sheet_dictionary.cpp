// Which entries of a sheet keep a variable of the board, which are plain values, and which values
// they have after power-on.
#include "firmware_emu/sheet_dictionary.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <optional>

#include "base/counted.hpp"
#include "base/quoting.hpp"
#include "canopen/bytes.hpp"
#include "canopen/drive_abilities.hpp"
#include "canopen/objects.hpp"
#include "canopen/pdo.hpp"
#include "canopen/sheet_number.hpp"

namespace tandem::firmware {
namespace {

using namespace canopen;
namespace co = canopen::object;

/// "6060:1".
std::string text_of(std::uint16_t index, int sub) {
  std::array<char, 16> text{};
  (void)std::snprintf(text.data(), text.size(), "%04X:%d", unsigned{index}, sub);
  return text.data();
}

/// What a board's object takes from the sheet for its value at power-on.
enum class Start : std::uint8_t { kBoards, kSheets };

struct Bound {
  std::uint16_t index;
  Start start;
};

// Objects of the device profile. Scales, limits and protections are the robot.toml's: what the
// sheet has of those is a plain value.
constexpr std::array kOfAxis{
    Bound{co::kAbortConnectionOption, Start::kSheets},
    Bound{co::kErrorCode, Start::kBoards},
    Bound{co::kControlword, Start::kBoards},
    Bound{co::kStatusword, Start::kBoards},
    Bound{co::kQuickStopOption, Start::kSheets},
    Bound{co::kShutdownOption, Start::kSheets},
    Bound{co::kDisableOption, Start::kSheets},
    Bound{co::kHaltOption, Start::kSheets},
    Bound{co::kFaultReactionOption, Start::kSheets},
    Bound{co::kMode, Start::kSheets},
    Bound{co::kModeDisplay, Start::kBoards},
    Bound{co::kPosition, Start::kBoards},
    Bound{co::kVelocity, Start::kBoards},
    Bound{co::kTargetTorque, Start::kBoards},
    Bound{co::kTorque, Start::kBoards},
    Bound{co::kTargetPosition, Start::kBoards},
    Bound{co::kVelocityOffset, Start::kBoards},
    Bound{co::kTorqueOffset, Start::kBoards},
    Bound{co::kInterpolationPeriod, Start::kSheets},
    Bound{co::kFollowingError, Start::kBoards},
    Bound{co::kTargetVelocity, Start::kBoards},
};

bool is_pdo_mapping(std::uint16_t index) {
  return (index >= co::kRpdoMapping && index < co::kRpdoMapping + 0x200) ||
         (index >= co::kTpdoMapping && index < co::kTpdoMapping + 0x200);
}

bool is_communication(std::uint16_t index) { return index >= 0x1000 && index < 0x2000; }

bool is_makers(std::uint16_t index) { return index >= 0x2000 && index < 0x6000; }

/// The objects that CiA 301 gives a number of sub-indices of its own: the board's number would be
/// another.
bool is_number_of_subs(const SheetEntry& entry) {
  return entry.sub == 0 && entry.type == static_cast<std::uint16_t>(DataType::kUnsigned8) &&
         !is_pdo_mapping(entry.index) && entry.index != co::kErrorHistory &&
         entry.index != co::kErrorRegister;
}

std::optional<Start> start_of_communication(std::uint16_t index) {
  switch (index) {
    case co::kDeviceType: return {};
    case co::kErrorRegister:
    case co::kErrorHistory:
    case co::kSyncId:
    case co::kDeviceName:
    case co::kHardwareVersion:
    case co::kSoftwareVersion:
    case co::kEmergencyId:
    case co::kIdentity: return Start::kBoards;
    default: return Start::kSheets;
  }
}

std::optional<Start> start_of_profile(std::uint16_t index, std::size_t axes) {
  for (std::size_t a = 0; a < axes; ++a) {
    for (const Bound& bound : kOfAxis) {
      if (of_axis(bound.index, static_cast<int>(a)) == index) return bound.start;
    }
  }
  return {};
}

/// Whether, and with which value, the entry keeps the board's variable.
std::optional<Start> start_of(const DataSheet& sheet, const SheetEntry& entry,
                              const ObjectEntry& ours, std::size_t axes) {
  if (is_number_of_subs(entry)) return {};
  if (is_communication(entry.index)) return start_of_communication(entry.index);
  if (is_makers(entry.index)) {
    const bool same = offered(sheet, entry.index, entry.sub, ours.type) != nullptr;
    return same ? std::optional{Start::kBoards} : std::nullopt;
  }
  return start_of_profile(entry.index, axes);
}

/// The profile's objects that are more than a variable and whose owner entered them are all bound.
bool is_profile_mode_object(const ObjectEntry& ours, std::size_t axes) {
  constexpr std::array kOf{
      co::kProfileVelocity, co::kProfileAcceleration, co::kProfileDeceleration, co::kHomeOffset,
      co::kHomingMethod,    co::kHomingSpeeds,        co::kHomingAcceleration,  co::kTorqueSlope};
  for (std::size_t a = 0; a < axes; ++a) {
    for (const std::uint16_t index : kOf) {
      if (of_axis(index, static_cast<int>(a)) == ours.index) return true;
    }
  }
  return false;
}

std::optional<DataType> plain_type(const SheetEntry& entry) {
  const int size = entry.size();
  const bool number = entry.type >= static_cast<std::uint16_t>(DataType::kBoolean) &&
                      entry.type <= static_cast<std::uint16_t>(DataType::kReal32);
  if (number && (size == 1 || size == 2 || size == 4)) return static_cast<DataType>(entry.type);
  return {};
}

ObjectRange range_of(const SheetEntry& entry, ObjectRange range) {
  // Sheets of real drives limit a consumer's time alone: its node stands above these 16 bits.
  if (entry.index == co::kHeartbeatConsumer && entry.high && *entry.high <= 0xFFFF) return range;
  if (entry.low) range.min = std::max(range.min, static_cast<double>(*entry.low));
  if (entry.high) range.max = std::min(range.max, static_cast<double>(*entry.high));
  return range;
}

/// The set-points of mode 7 are the axis' target position: 60C1:1 is its variable too.
const ObjectEntry* variable_of(const ObjectDictionary& od, const SheetEntry& entry,
                               std::size_t axes) {
  for (std::size_t a = 0; entry.sub == 1 && a < axes; ++a) {
    const int axis = static_cast<int>(a);
    if (entry.index == of_axis(co::kInterpolationData, axis)) {
      return od.find(of_axis(co::kTargetPosition, axis), 0);
    }
  }
  return od.find(entry.index, entry.sub);
}

/// An entry of the stand-in, and whose value it starts with.
struct MadeEntry {
  ObjectEntry entry;
  Start start = Start::kSheets;
  bool plain = false;
};

std::optional<MadeEntry> bound_entry(const DataSheet& sheet, const SheetEntry& entry,
                                     const ObjectEntry& ours, std::size_t axes) {
  std::optional<Start> start = start_of(sheet, entry, ours, axes);
  if (ours.index != entry.index) start = Start::kBoards;  // a second name of a demand
  if (is_profile_mode_object(ours, axes) && ours.owner == nullptr) start = Start::kSheets;
  if (!start) return {};
  if (ours.type == DataType::kVisibleString) return MadeEntry{ours, Start::kBoards};
  if (entry.size() != ours.size) return {};
  MadeEntry made{ours, *start};
  made.entry.index = entry.index;
  made.entry.sub = entry.sub;
  made.entry.type = static_cast<DataType>(entry.type);
  made.entry.access = entry.access;
  made.entry.range = range_of(entry, ours.range);
  if (entry.index == co::kSyncId || entry.index == co::kEmergencyId) {  // they cannot be moved
    std::array<std::uint8_t, 4> bytes{};
    ours.encode(bytes.data());
    made.entry.range.min = made.entry.range.max = get<std::uint32_t>(bytes.data());
  }
  return made;
}

std::optional<MadeEntry> plain_entry(const SheetEntry& entry, ObjectDictionary& od) {
  const auto type = plain_type(entry);
  void* value = type ? od.hold(0) : nullptr;
  if (value == nullptr) return {};
  // What is stored by 1010 and restored by 1011 would not be kept over power-off.
  const bool stores = entry.index == 0x1010 || entry.index == 0x1011;
  return MadeEntry{
      .entry = {.index = entry.index,
                .sub = entry.sub,
                .type = *type,
                .access = stores ? std::uint8_t{kRead} : entry.access,
                .size = static_cast<std::uint16_t>(entry.size()),
                .data = value,
                .range = *type == DataType::kReal32 ? ObjectRange{} : range_of(entry, {})},
      .start = Start::kSheets,
      .plain = true};
}

/// Whether the slave in front of the board has the object: its PDOs, and the sync managers' lists
/// of them. The board behind it keeps its own PDOs.
bool is_slaves(const DataSheet& sheet, std::uint16_t index) {
  return sheet.ethercat && index >= co::kRpdoParameter && index < 0x1D00;
}

/// Sorted. What has no place in the stand-in is left out.
std::vector<MadeEntry> entries_of(const DataSheet& sheet, std::size_t axes, ObjectDictionary& od) {
  std::vector<MadeEntry> made;
  for (const ObjectEntry& own : od.entries()) {
    if (is_slaves(sheet, own.index)) made.push_back({own, Start::kBoards});
  }
  for (const SheetEntry& entry : sheet.entries) {
    if (is_slaves(sheet, entry.index)) continue;
    const ObjectEntry* ours = variable_of(od, entry, axes);
    auto bound = ours != nullptr ? bound_entry(sheet, entry, *ours, axes) : std::nullopt;
    if (!bound) bound = plain_entry(entry, od);
    if (bound) made.push_back(*bound);
  }
  for (const std::uint16_t dummy : sheet.dummies) {  // fillers of an RPDO: nothing reads them
    auto filler = plain_entry({.index = dummy, .type = dummy, .access = kMapRpdo}, od);
    if (filler) made.push_back(*filler);
  }
  std::ranges::sort(made, {}, [](const MadeEntry& m) {
    return (std::uint32_t{m.entry.index} << 8) | m.entry.sub;
  });
  return made;
}

/// What the sheet says that the entry holds at power-on. A drive knows its profile and its modes
/// where the sheet leaves them to it.
std::optional<std::int64_t> value_of(const DataSheet& sheet, const ObjectEntry& entry, int node_id,
                                     std::size_t axes) {
  constexpr std::int64_t kServoDrive = 0x0002'0192;  // CiA 402
  const auto value = sheet.value(entry.index, entry.sub, node_id);
  if (value && *value != 0) return value;
  if (entry.index == co::kDeviceType) return kServoDrive;
  for (std::size_t a = 0; a < axes; ++a) {
    const int axis = static_cast<int>(a);
    if (entry.index == of_axis(co::kSupportedModes, axis)) return emulated_modes(sheet, axis);
  }
  return value;
}

/// A mapping's entries come before its number, and both before what switches the PDO on.
int order(const ObjectEntry& entry) {
  if (is_pdo_mapping(entry.index)) return entry.sub == 0 ? 1 : 0;
  return 2;
}

}  // namespace

SheetDictionary::SheetDictionary(const DataSheet& sheet, int node_id, std::size_t axes,
                                 ObjectDictionary& od) {
  const std::vector<MadeEntry> made = entries_of(sheet, axes, od);
  std::vector<ObjectEntry> entries;
  for (const MadeEntry& one : made) entries.push_back(one.entry);
  od.replace(std::move(entries));
  const auto told = [&](std::uint16_t index) { return !is_slaves(sheet, index); };
  const auto all =
      static_cast<std::size_t>(std::ranges::count_if(sheet.entries, told, &SheetEntry::index)) +
      sheet.dummies.size();
  const auto kept = static_cast<std::size_t>(
      std::ranges::count_if(made, [&](const MadeEntry& one) { return told(one.entry.index); }));
  if (kept < all) {
    remarks_.push_back(counted(all - kept, "entry is", "entries are") +
                       " left out: texts, domains, numbers of 24 or more than 32 bit");
  }
  for (const MadeEntry& one : made) {
    const auto value = value_of(sheet, one.entry, node_id, axes);
    if (one.start == Start::kBoards || !value) continue;
    const auto number = static_cast<double>(*value);
    const bool fits = number >= one.entry.range.min && number <= one.entry.range.max;
    if (!one.plain && !fits && !is_communication(one.entry.index)) {
      remarks_.push_back(text_of(one.entry.index, one.entry.sub) +
                         " starts with the firmware's value, not with " + std::to_string(*value));
      continue;
    }
    power_on_.push_back(
        {od.find(one.entry.index, one.entry.sub), static_cast<std::uint32_t>(*value)});
  }
  std::ranges::stable_sort(power_on_, {}, [](const PowerOn& p) { return order(*p.entry); });
  check_mappings(od);
  restore_all();
}

std::uint32_t SheetDictionary::power_on_bits(std::uint16_t index, std::uint8_t sub) const noexcept {
  const auto at = std::ranges::find_if(
      power_on_, [&](const PowerOn& p) { return p.entry->index == index && p.entry->sub == sub; });
  return at == power_on_.end() ? 0 : at->bits;
}

// A mapping that cannot be carried out is empty, and its PDO is switched off.
void SheetDictionary::check_mappings(const ObjectDictionary& od) {
  for (PowerOn& count : power_on_) {
    if (!is_pdo_mapping(count.entry->index) || count.entry->sub != 0) continue;
    const std::uint16_t index = count.entry->index;
    bool good = count.bits <= kMaxMappedObjects;
    std::uint32_t bits = 0;
    for (std::uint32_t sub = 1; good && sub <= count.bits; ++sub) {
      const std::uint32_t mapped = power_on_bits(index, static_cast<std::uint8_t>(sub));
      const ObjectEntry* entry =
          od.find(static_cast<std::uint16_t>(mapped >> 16), static_cast<std::uint8_t>(mapped >> 8));
      good = entry != nullptr && entry->type != DataType::kVisibleString &&
             (mapped & 0xFF) == 8U * entry->size;
      bits += mapped & 0xFF;
    }
    if (good && bits <= 64) continue;
    remarks_.push_back("the mapping " + text_of(index, 0) +
                       " is too long, or names what the stand-in lacks: it starts empty");
    count.bits = 0;
  }
}

void SheetDictionary::restore(std::uint16_t last_index) const noexcept TANDEM_RT {
  for (const PowerOn& value : power_on_) {
    if (value.entry->index > last_index) continue;
    std::array<std::uint8_t, 4> bytes{};
    put(bytes.data(), value.bits);
    value.entry->decode(bytes.data());
    if (value.entry->owner != nullptr) value.entry->owner->written(*value.entry);
  }
}

std::uint32_t emulated_modes(const DataSheet& sheet, int axis) {
  constexpr std::uint32_t kEmulated = 0x3ED;  // all but vl (2): 1, 3, 4, 6 to 10
  const auto has = [&](std::uint16_t index, std::uint8_t sub = 0) {
    return sheet.find(of_axis(index, axis), sub) != nullptr;
  };
  const std::uint16_t listed = of_axis(co::kSupportedModes, axis);
  if (const auto modes = sheet.value(listed, 0, 1); modes && *modes != 0) {
    return static_cast<std::uint32_t>(*modes) & kEmulated;
  }
  const DriveAbilities can = abilities_of(sheet, axis);
  std::uint32_t modes = 0;
  for (const Mode mode : {can.position, can.velocity, can.torque}) {
    if (mode != Mode::kNone) modes |= mode_bit(mode);
  }
  if (has(co::kInterpolationData, 1)) modes |= mode_bit(Mode::kIp);
  if (has(co::kTargetPosition) && has(co::kProfileVelocity)) modes |= mode_bit(Mode::kPp);
  if (has(co::kTargetVelocity) && has(co::kProfileAcceleration)) modes |= mode_bit(Mode::kPv);
  if (has(co::kTargetTorque) && has(co::kTorqueSlope)) modes |= mode_bit(Mode::kTq);
  if (has(co::kHomingMethod)) modes |= mode_bit(Mode::kHm);
  return modes;
}

Status check_sheet(const DataSheet& sheet, std::size_t axes) {
  const auto bad = [&](std::string message) {
    return fail_at(sheet.file, std::move(message),
                   "`tandem eds show " + shell_word(sheet.file) + "` shows what the drive has");
  };
  for (std::size_t a = 0; a < axes; ++a) {
    const int axis = static_cast<int>(a);
    for (const std::uint16_t index : {co::kControlword, co::kStatusword}) {
      const SheetEntry* entry = sheet.find(of_axis(index, axis));
      if (entry == nullptr || entry->size() != 2) {
        return bad("axis " + std::to_string(a) + " has no " + text_of(of_axis(index, axis), 0) +
                   " of 16 bit: it is no CiA 402 drive");
      }
    }
    if (emulated_modes(sheet, axis) == 0) {
      return bad("axis " + std::to_string(a) + " has no mode that is emulated");
    }
  }
  return {};
}

}  // namespace tandem::firmware
