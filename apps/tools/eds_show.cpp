// `tandem eds show`: what a drive is and can, by its data sheet.
#include "apps/tools/eds_show.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "apps/text/console.hpp"
#include "apps/tools/sheet_facts.hpp"
#include "base/counted.hpp"
#include "canopen/data_sheet.hpp"
#include "canopen/drive_abilities.hpp"
#include "canopen/object_dictionary.hpp"
#include "canopen/objects.hpp"
#include "firmware_emu/board.hpp"
#include "hal/ethercat-can/drive_use.hpp"

namespace tandem::apps {
namespace {

using canopen::DataSheet;
using canopen::SheetEntry;

constexpr std::size_t kWidth = 96;             // of lists, in characters
constexpr std::int64_t kExtendedId = 1 << 29;  // of a COB-ID: it has 29 bits
constexpr std::int64_t kExtendedMask = kExtendedId - 1;

std::string joined(const std::vector<std::string>& words) {
  return words.empty() ? "-" : fmt::format("{}", fmt::join(words, " "));
}

std::string known_hex(const std::optional<std::uint32_t>& number) {
  return number ? fmt::format("0x{:X}", *number) : "not said";
}

std::string device_name(const DataSheet& sheet) {
  const std::string product = sheet.product_name.empty() ? "a device" : sheet.product_name;
  return sheet.vendor_name.empty() ? product : product + " of " + sheet.vendor_name;
}

std::string profile_text(const SheetFacts& facts) {
  if (!facts.device_type) return "not said (1000 has no value)";
  const std::uint32_t profile = *facts.device_type & 0xFFFF;
  return fmt::format("CiA {} (1000 is 0x{:08X}){}", profile, *facts.device_type,
                     facts.axes > 0 ? ", " + counted(facts.axes, "axis", "axes") : "");
}

std::string watch_text(const SheetFacts& facts) {
  std::vector<std::string> ways;
  if (facts.heartbeat_consumers > 0) {
    ways.push_back(
        fmt::format("watches {} (1016)", counted(facts.heartbeat_consumers, "heartbeat")));
  }
  if (facts.heartbeat_producer) ways.emplace_back("sends a heartbeat (1017)");
  if (facts.node_guarding) ways.emplace_back("node guarding (100C, 100D)");
  return ways.empty() ? "no heartbeat, no node guarding" : fmt::format("{}", fmt::join(ways, ", "));
}

std::string sheet_text(const DataSheet& sheet) {
  std::string text = counted(sheet.entries.size(), "entry", "entries");
  if (sheet.node_id) text += fmt::format(", of node {}", *sheet.node_id);
  if (sheet.bit_rate_kbit_s) text += fmt::format(", {} kbit/s", *sheet.bit_rate_kbit_s);
  return text;
}

/// What only an EtherCAT slave has.
void add_slave(Facts& table, const DataSheet& sheet) {
  std::vector<std::string> managers;
  for (const canopen::SheetManager& one : sheet.managers) {
    managers.push_back(fmt::format("{} {} at 0x{:04X}", one.use.empty() ? "-" : one.use,
                                   counted(one.bytes, "byte"), one.start));
  }
  table.add("managers",
            managers.empty() ? "not said" : fmt::format("{}", fmt::join(managers, ", ")));
  const bool chosen = canopen::writable(sheet, 0x1C12, 0) || canopen::writable(sheet, 0x1C13, 0);
  table.add("assignment", chosen ? "the master may choose the PDOs (1C12, 1C13)"
                                 : "the PDOs are those from power-on (1C12, 1C13)");
  std::vector<std::string> modes;
  for (const canopen::SheetDcMode& mode : sheet.dc_modes) {
    modes.push_back(fmt::format("{} ({})", mode.name,
                                mode.sync1()   ? "SYNC0 and SYNC1"
                                : mode.sync0() ? "SYNC0"
                                               : "no pulses"));
  }
  table.add("clock", modes.empty() ? "none" : fmt::format("{}", fmt::join(modes, ", ")));
}

void print_facts(std::FILE* out, const DataSheet& sheet, const SheetFacts& facts) {
  Facts table;
  table.add("device", device_name(sheet));
  table.add("identity", fmt::format("vendor {}, product {}, revision {}", known_hex(sheet.vendor),
                                    known_hex(sheet.product), known_hex(sheet.revision)));
  table.add("profile", profile_text(facts));
  table.add("sheet", sheet_text(sheet));
  if (sheet.ethercat) {
    add_slave(table, sheet);
    table.print(out);
    return;
  }
  table.add("bit rates", sheet.bit_rates_kbit_s.empty()
                             ? "not said"
                             : fmt::format("{} kbit/s", fmt::join(sheet.bit_rates_kbit_s, ", ")));
  table.add("node id", sheet.lss ? "can be set over the bus (LSS)" : "is set at the device");
  table.add("watching", watch_text(facts));
  table.print(out);
}

void print_modes(std::FILE* out, const SheetFacts& facts) {
  if (facts.axes == 0) {
    fmt::print(out, "\nNo drive of CiA 402: there is no controlword (6040).\n");
    return;
  }
  fmt::print(out, "\n{}\n",
             facts.modes_said
                 ? "Modes of operation, by 6502:"
                 : "Modes that the objects allow (only the drive's 6502 says which it has):");
  Table table({"mode", "", "needs", "lacks", "has also"});
  table.align_left();
  for (const SheetMode& mode : facts.modes) {
    std::string lacks = mode.lacks.empty() ? "-" : fmt::format("{}", fmt::join(mode.lacks, ", "));
    table.add({std::to_string(mode.number), mode.name, joined(mode.needs), std::move(lacks),
               joined(mode.also)});
  }
  table.print(out);
  if (!facts.lacks.empty()) {
    fmt::print(out, "  every mode needs, and the drive lacks: {}\n", fmt::join(facts.lacks, ", "));
  }
  if (!facts.own_modes.empty()) {
    fmt::print(out, "  and the manufacturer's own: bits {} of 6502\n",
               fmt::join(facts.own_modes, ", "));
  }
}

/// "0x200+id", "off".
std::string cob_id_text(const std::optional<canopen::SheetValue>& id) {
  if (!id) return "not said";
  if ((id->number & canopen::cob::kInvalid) != 0) return "off";
  const std::int64_t bits = (id->number & kExtendedId) != 0 ? kExtendedMask : canopen::cob::kIdMask;
  return fmt::format("0x{:X}{}", id->number & bits, id->plus_node_id ? "+id" : "");
}

/// By their objects; there are no COB-IDs.
void print_slave_pdos(std::FILE* out, const SheetFacts& facts) {
  Table table({"PDO", "from power-on", "entries", "carries"});
  table.align_left();
  for (const SheetPdo& pdo : facts.pdos) {
    const int first = pdo.receive ? canopen::object::kRpdoMapping : canopen::object::kTpdoMapping;
    table.add({fmt::format("{:04X}", first + pdo.number - 1),
               pdo.assigned ? (pdo.receive ? "outputs" : "inputs") : "-",
               std::to_string(pdo.entries) + (pdo.mapping_writable ? "*" : ""),
               joined(pdo.carries)});
  }
  table.print(out);
}

void print_pdos(std::FILE* out, const SheetFacts& facts) {
  fmt::print(out, "\nPDOs (with *: the master may change it):\n");
  if (facts.ethercat) return print_slave_pdos(out, facts);
  Table table({"PDO", "COB-ID", "type", "entries", "carries"});
  table.align_left();
  const auto star = [](bool writable) { return writable ? "*" : ""; };
  for (const SheetPdo& pdo : facts.pdos) {
    const std::string type = pdo.transmission ? std::to_string(*pdo.transmission) : "not said";
    table.add({fmt::format("{} {}", pdo.receive ? "RPDO" : "TPDO", pdo.number),
               cob_id_text(pdo.cob_id) + star(pdo.cob_id_writable),
               type + star(pdo.transmission_writable),
               std::to_string(pdo.entries) + star(pdo.mapping_writable), joined(pdo.carries)});
  }
  table.print(out);
}

/// Names of objects, in lines of readable length.
void print_list(std::FILE* out, const char* title, const std::vector<const SheetEntry*>& entries) {
  fmt::print(out, "\n{}{}\n", title, entries.empty() ? " none" : "");
  std::string line;
  for (const SheetEntry* entry : entries) {
    const std::string name = object_text(*entry);
    if (line.size() + name.size() + 1 > kWidth) {
      fmt::print(out, " {}\n", line);
      line.clear();
    }
    line += " " + name;
  }
  if (!line.empty()) fmt::print(out, " {}\n", line);
}

void print_units(std::FILE* out, const SheetFacts& facts) {
  fmt::print(out, "\nUnits:{}\n",
             facts.units.empty() ? " no object tells them; they stand in the drive's manual" : "");
  if (facts.units.empty()) return;
  Table table({"object", "name", "value"});
  table.align_left();
  for (const SheetEntry* entry : facts.units) {
    table.add({object_text(*entry), entry->name,
               entry->value ? std::to_string(entry->value->number) : "not said"});
  }
  table.print(out);
}

void print_use(std::FILE* out, const Result<hal::can::DriveUse>& use) {
  if (!use) {
    fmt::print(out, "\nTandem's master cannot drive it: {}\n", use.error().message);
    return;
  }
  fmt::print(out, "\nWhat Tandem's master does with it:\n");
  Facts table;
  for (const hal::can::DriveFact& fact : use->does) table.add(fact.what, fact.how);
  table.print(out);
  fmt::print(out, "\nWhat it misses:{}\n", use->misses.empty() ? " nothing" : "");
  for (const std::string& text : use->misses) fmt::print(out, "  {}\n", text);
}

/// The drive in simulation and in `tandem emulate`.
struct StandIn {
  std::vector<int> modes{};            ///< 6060, of the first axis
  std::vector<std::string> remarks{};  ///< what it lacks, or takes otherwise than the sheet says
};

Result<StandIn> stand_in_of(const DataSheet& sheet, const SheetFacts& facts) {
  firmware::BoardSetup setup;
  setup.axes.resize(static_cast<std::size_t>(std::clamp(facts.axes, 1, canopen::kMaxAxes)));
  if (Status good = firmware::check_sheet(sheet, setup.axes.size()); !good) {
    return std::unexpected(good.error());
  }
  setup.sheet = std::make_shared<const DataSheet>(sheet);
  const std::uint32_t modes = firmware::emulated_modes(sheet, 0);
  StandIn made{.remarks = firmware::Board(setup).remarks()};
  for (int bit = 0; bit < 16; ++bit) {
    if ((modes >> bit & 1U) != 0) made.modes.push_back(bit + 1);
  }
  return made;
}

void print_stand_in(std::FILE* out, const Result<StandIn>& simulated) {
  if (!simulated) {
    fmt::print(out, "\nIt cannot be simulated: {}\n", simulated.error().message);
    return;
  }
  fmt::print(out, "\nIn simulation it has the modes {}.{}\n", fmt::join(simulated->modes, ", "),
             simulated->remarks.empty() ? "" : " Otherwise than the sheet says:");
  for (const std::string& text : simulated->remarks) fmt::print(out, "  {}\n", text);
}

void print_sheet(std::FILE* out, const DataSheet& sheet, const SheetFacts& facts,
                 const Result<hal::can::DriveUse>& use, const Result<StandIn>& simulated) {
  print_facts(out, sheet, facts);
  print_modes(out, facts);
  print_use(out, use);
  print_stand_in(out, simulated);
  print_pdos(out, facts);
  print_list(out, "Into RPDOs:", facts.into_rpdo);
  print_list(out, "Into TPDOs:", facts.into_tpdo);
  print_units(out, facts);
  if (sheet.remarks.empty()) return;
  fmt::print(out, "\nWhat is odd in the sheet:\n");
  for (const std::string& remark : sheet.remarks) fmt::print(out, "  {}\n", remark);
}

template <class T>
Json known(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json modes_json(const SheetFacts& facts) {
  Json list = Json::array();
  for (const SheetMode& mode : facts.modes) {
    list.push_back({{"mode", mode.number},
                    {"name", mode.name},
                    {"needs", mode.needs},
                    {"lacks", mode.lacks},
                    {"has_also", mode.also}});
  }
  return list;
}

Json pdos_json(const SheetFacts& facts) {
  Json list = Json::array();
  for (const SheetPdo& pdo : facts.pdos) {
    list.push_back({{"pdo", fmt::format("{} {}", pdo.receive ? "RPDO" : "TPDO", pdo.number)},
                    {"cob_id", pdo.cob_id ? Json(pdo.cob_id->number) : Json(nullptr)},
                    {"plus_node_id", pdo.cob_id && pdo.cob_id->plus_node_id},
                    {"cob_id_writable", pdo.cob_id_writable},
                    {"transmission", known(pdo.transmission)},
                    {"transmission_writable", pdo.transmission_writable},
                    {"entries", pdo.entries},
                    {"mapping_writable", pdo.mapping_writable},
                    {"assigned", pdo.assigned},
                    {"carries", pdo.carries}});
  }
  return list;
}

Json objects_json(const std::vector<const SheetEntry*>& entries) {
  Json list = Json::array();
  for (const SheetEntry* entry : entries) {
    list.push_back({{"object", object_text(*entry)},
                    {"name", entry->name},
                    {"size_bytes", entry->size()},
                    {"value", entry->value ? Json(entry->value->number) : Json(nullptr)}});
  }
  return list;
}

Json use_json(const Result<hal::can::DriveUse>& use) {
  if (!use)
    return {{"refused", use.error().message}, {"does", Json::array()}, {"misses", Json::array()}};
  Json does = Json::array();
  for (const hal::can::DriveFact& fact : use->does) {
    does.push_back({{"what", fact.what}, {"how", fact.how}});
  }
  return {{"refused", nullptr}, {"does", does}, {"misses", use->misses}};
}

Json stand_in_json(const Result<StandIn>& simulated) {
  if (!simulated) {
    return {{"refused", simulated.error().message},
            {"modes", Json::array()},
            {"remarks", Json::array()}};
  }
  return {{"refused", nullptr}, {"modes", simulated->modes}, {"remarks", simulated->remarks}};
}

Json dc_modes_json(const DataSheet& sheet) {
  Json list = Json::array();
  for (const canopen::SheetDcMode& mode : sheet.dc_modes) {
    list.push_back({{"name", mode.name}, {"assign_activate", mode.activate}});
  }
  return list;
}

Json sheet_json(const DataSheet& sheet, const SheetFacts& facts,
                const Result<hal::can::DriveUse>& use, const Result<StandIn>& simulated) {
  Json json{{"file", sheet.file},
            {"vendor_name", sheet.vendor_name},
            {"product_name", sheet.product_name},
            {"description", sheet.description},
            {"vendor", known(sheet.vendor)},
            {"product", known(sheet.product)},
            {"revision", known(sheet.revision)},
            {"device_type", known(facts.device_type)},
            {"axes", facts.axes},
            {"sheet_entries", sheet.entries.size()},
            {"node_id", known(sheet.node_id)},
            {"bit_rate_kbit_s", known(sheet.bit_rate_kbit_s)},
            {"bit_rates_kbit_s", sheet.bit_rates_kbit_s},
            {"lss", sheet.lss},
            {"ethercat", sheet.ethercat},
            {"dc_modes", dc_modes_json(sheet)},
            {"heartbeat_consumers", facts.heartbeat_consumers},
            {"heartbeat_producer", facts.heartbeat_producer},
            {"node_guarding", facts.node_guarding}};
  json["modes_said"] = facts.modes_said;
  json["modes"] = modes_json(facts);
  json["own_modes"] = facts.own_modes;
  json["master"] = use_json(use);
  json["simulation"] = stand_in_json(simulated);
  json["lacks"] = facts.lacks;
  json["pdos"] = pdos_json(facts);
  json["into_rpdo"] = objects_json(facts.into_rpdo);
  json["into_tpdo"] = objects_json(facts.into_tpdo);
  json["units"] = objects_json(facts.units);
  json["remarks"] = sheet.remarks;
  return json;
}

}  // namespace

Exit eds_show(const EdsOptions& options) {
  const auto sheet = canopen::load_data_sheet(
      options.sheet, {.product = options.product, .revision = options.revision});
  if (!sheet) return refuse(sheet.error());
  const SheetFacts facts = sheet_facts(*sheet);
  const auto use = hal::can::use_of(*sheet);
  const auto simulated = stand_in_of(*sheet, facts);
  print_sheet(human_output(options.json), *sheet, facts, use, simulated);
  const Status written = write_json(options.json, sheet_json(*sheet, facts, use, simulated));
  return written ? Exit::kDone : refuse(written.error());
}

}  // namespace tandem::apps
