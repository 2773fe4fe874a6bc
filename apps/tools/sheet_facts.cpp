// CiA 402's modes and the objects that each needs; PDOs by their parameters and mappings.
#include "apps/tools/sheet_facts.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <span>

#include "canopen/drive_abilities.hpp"
#include "canopen/object_dictionary.hpp"
#include "canopen/objects.hpp"

namespace tandem::apps {
namespace {

using canopen::DataSheet;
using canopen::SheetEntry;
namespace object = canopen::object;

constexpr int kMaxPdos = 512;
constexpr std::uint16_t kGuardTime = 0x100C;
constexpr std::uint16_t kLifeTimeFactor = 0x100D;

/// An object that a mode needs, and the PDO that a cyclic mode needs it in: RPDO, TPDO, or none.
struct Need {
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  std::uint8_t mapped = 0;
};

struct ModeFacts {
  int number;
  const char* name;
  std::array<Need, 2> needs;
  std::array<std::uint16_t, 4> also;
};

constexpr std::array kModes{
    ModeFacts{1, "profile position", {{{0x607A}, {0x6081}}}, {0x6083, 0x6084}},
    ModeFacts{2, "velocity (frequency converters)", {{{0x6042}, {0x6044}}}, {0x6046, 0x6048}},
    ModeFacts{3, "profile velocity", {{{0x60FF}, {0x606C}}}, {0x6083, 0x6084}},
    ModeFacts{4, "profile torque", {{{0x6071}, {0x6077}}}, {0x6087}},
    ModeFacts{6, "homing", {{{0x6098}, {0x6099}}}, {0x609A, 0x607C}},
    ModeFacts{7,
              "interpolated position",
              {{{0x60C1, 1, canopen::kMapRpdo}, {0x6064, 0, canopen::kMapTpdo}}},
              {0x60C2}},
    ModeFacts{8,
              "cyclic synchronous position",
              {{{0x607A, 0, canopen::kMapRpdo}, {0x6064, 0, canopen::kMapTpdo}}},
              {0x60B0, 0x60B1, 0x60B2, 0x60C2}},
    ModeFacts{9,
              "cyclic synchronous velocity",
              {{{0x60FF, 0, canopen::kMapRpdo}, {0x606C, 0, canopen::kMapTpdo}}},
              {0x60B1, 0x60B2, 0x60C2}},
    ModeFacts{10,
              "cyclic synchronous torque",
              {{{0x6071, 0, canopen::kMapRpdo}, {0x6077, 0, canopen::kMapTpdo}}},
              {0x60B2, 0x60C2}},
};

/// What every mode needs: controlword, statusword, the mode and its display.
constexpr std::array<Need, 4> kEveryMode{
    {{0x6040, 0, canopen::kMapRpdo}, {0x6041, 0, canopen::kMapTpdo}, {0x6060}, {0x6061}}};

/// Rated current and torque, polarity, encoders, gear, feed, SI units of position and velocity; and
/// of the profile's first edition: notations, dimensions, factors.
constexpr std::array<std::uint16_t, 18> kUnits{0x6075, 0x6076, 0x607E, 0x6089, 0x608A, 0x608B,
                                               0x608C, 0x608D, 0x608E, 0x608F, 0x6090, 0x6091,
                                               0x6092, 0x6093, 0x6094, 0x6097, 0x60A8, 0x60A9};

std::string text_of(std::uint16_t index, std::uint8_t sub) {
  return sub == 0 ? fmt::format("{:04X}", index) : fmt::format("{:04X}:{:X}", index, sub);
}

/// Whether the drive has it, as SheetMode::lacks names it otherwise.
std::optional<std::string> lack(const DataSheet& sheet, const Need& need) {
  const std::string name = text_of(need.index, need.sub);
  const SheetEntry* entry = sheet.find(need.index, need.sub);
  if (entry == nullptr)
    return need.mapped == 0 && sheet.has(need.index) ? std::nullopt : std::optional(name);
  if (need.mapped == 0 || (entry->access & need.mapped) != 0) return std::nullopt;
  return fmt::format("{} in {}", name, need.mapped == canopen::kMapRpdo ? "an RPDO" : "a TPDO");
}

SheetMode mode_of(const DataSheet& sheet, const ModeFacts& facts) {
  SheetMode mode{.number = facts.number, .name = facts.name, .needs = {}, .also = {}, .lacks = {}};
  for (const Need& need : facts.needs) {
    mode.needs.push_back(text_of(need.index, need.sub));
    if (auto missing = lack(sheet, need)) mode.lacks.push_back(std::move(*missing));
  }
  for (const std::uint16_t index : facts.also) {
    if (index != 0 && sheet.has(index)) mode.also.push_back(text_of(index, 0));
  }
  return mode;
}

/// Without 6502 nobody tells the modes: those whose objects are there may exist. A cyclic mode
/// shares its objects with a profile mode, and is told from it by the cycle's time (60C2); on
/// EtherCAT by its being there.
bool may_exist(const DataSheet& sheet, const SheetMode& mode) {
  const bool cyclic = mode.number >= static_cast<int>(canopen::Mode::kCsp);
  return mode.lacks.empty() &&
         (!cyclic || sheet.ethercat || sheet.has(object::kInterpolationPeriod));
}

void add_modes(const DataSheet& sheet, SheetFacts& facts) {
  if (facts.axes == 0) return;
  for (const Need& need : kEveryMode) {
    if (auto missing = lack(sheet, need)) facts.lacks.push_back(std::move(*missing));
  }
  const auto bits = sheet.value(object::kSupportedModes, 0, 0);
  facts.modes_said = bits.value_or(0) != 0;
  for (const ModeFacts& known : kModes) {
    SheetMode mode = mode_of(sheet, known);
    const bool there =
        facts.modes_said ? (*bits >> (known.number - 1) & 1) != 0 : may_exist(sheet, mode);
    if (there) facts.modes.push_back(std::move(mode));
  }
  for (int bit = 16; bit < 32 && facts.modes_said; ++bit) {
    if ((*bits >> bit & 1) != 0) facts.own_modes.push_back(bit);
  }
}

bool writable(const SheetEntry* entry) {
  return entry != nullptr && (entry->access & canopen::kWrite) != 0;
}

/// The entries of a mapping object, and what they are by default.
void add_mapping(const DataSheet& sheet, std::uint16_t mapping, SheetPdo& pdo) {
  constexpr std::uint16_t kToParameter =
      canopen::object::kRpdoMapping - canopen::object::kRpdoParameter;
  pdo.mapping_writable =
      sheet.granularity != 0 &&
      canopen::remappable(sheet, static_cast<std::uint16_t>(mapping - kToParameter));
  const std::int64_t used = sheet.value(mapping, 0, 0).value_or(0);
  for (int sub = 1; sub <= 0x40; ++sub) {
    const SheetEntry* entry = sheet.find(mapping, static_cast<std::uint8_t>(sub));
    if (entry == nullptr) continue;
    pdo.entries = sub;
    if (sub > used || !entry->value || entry->value->number == 0) continue;
    const auto mapped = static_cast<std::uint32_t>(entry->value->number);
    if (mapped >> 16 == 0) {
      pdo.carries.push_back(fmt::format("({} bit)", mapped & 0xFF));
      continue;
    }
    pdo.carries.push_back(
        text_of(static_cast<std::uint16_t>(mapped >> 16), static_cast<std::uint8_t>(mapped >> 8)));
  }
  const SheetEntry* count = sheet.find(mapping, 0);
  const std::int64_t most = count != nullptr ? count->high.value_or(0) : 0;
  if (most > 0) pdo.entries = static_cast<int>(std::min<std::int64_t>(pdo.entries, most));
}

void add_pdos(const DataSheet& sheet, bool receive, SheetFacts& facts) {
  const std::uint16_t parameters = receive ? object::kRpdoParameter : object::kTpdoParameter;
  const std::uint16_t mappings = receive ? object::kRpdoMapping : object::kTpdoMapping;
  for (int n = 0; n < kMaxPdos; ++n) {
    const auto parameter = static_cast<std::uint16_t>(parameters + n);
    const auto mapping = static_cast<std::uint16_t>(mappings + n);
    if (!sheet.has(parameter) && !sheet.has(mapping)) continue;
    SheetPdo pdo{
        .receive = receive, .number = n + 1, .cob_id = {}, .transmission = {}, .carries = {}};
    if (const SheetEntry* id = sheet.find(parameter, 1)) pdo.cob_id = id->value;
    pdo.cob_id_writable = writable(sheet.find(parameter, 1));
    if (const auto type = sheet.value(parameter, 2, 0)) pdo.transmission = static_cast<int>(*type);
    pdo.transmission_writable = writable(sheet.find(parameter, 2));
    add_mapping(sheet, mapping, pdo);
    const std::uint16_t assignment = receive ? 0x1C12 : 0x1C13;
    const auto used = sheet.value(assignment, 0, 0).value_or(0);
    for (int sub = 1; sub <= used && sheet.ethercat; ++sub) {
      pdo.assigned |= sheet.value(assignment, static_cast<std::uint8_t>(sub), 0) == mapping;
    }
    facts.pdos.push_back(std::move(pdo));
  }
}

}  // namespace

std::string object_text(const SheetEntry& entry) { return text_of(entry.index, entry.sub); }

SheetFacts sheet_facts(const DataSheet& sheet) {
  SheetFacts facts;
  if (const auto type = sheet.value(object::kDeviceType, 0, 0); type.value_or(0) != 0) {
    facts.device_type = static_cast<std::uint32_t>(*type);
  }
  for (int axis = 0; axis < canopen::kMaxAxes; ++axis) {
    if (sheet.has(canopen::of_axis(object::kControlword, axis))) ++facts.axes;
  }
  facts.ethercat = sheet.ethercat;
  add_modes(sheet, facts);
  add_pdos(sheet, true, facts);
  add_pdos(sheet, false, facts);
  for (const SheetEntry& entry : sheet.entries) {
    if ((entry.access & canopen::kMapRpdo) != 0) facts.into_rpdo.push_back(&entry);
    if ((entry.access & canopen::kMapTpdo) != 0) facts.into_tpdo.push_back(&entry);
    const bool sum = entry.sub == 0 && sheet.find(entry.index, 1) != nullptr;
    if (std::ranges::find(kUnits, entry.index) != kUnits.end() && !sum)
      facts.units.push_back(&entry);
    if (entry.index == object::kHeartbeatConsumer && entry.sub > 0) ++facts.heartbeat_consumers;
  }
  facts.heartbeat_producer = sheet.has(object::kHeartbeatProducer);
  facts.node_guarding = sheet.has(kGuardTime) && sheet.has(kLifeTimeFactor);
  return facts;
}

}  // namespace tandem::apps
