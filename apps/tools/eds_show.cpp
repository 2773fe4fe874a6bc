// `tandem eds show`: what a drive is and can, by its data sheet.
#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "apps/text/figures.hpp"
#include "apps/tools/commands.hpp"
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

/// The facts of a data sheet.
struct SheetReport {
  DataSheet sheet{};
  SheetFacts facts{};
  Result<hal::can::DriveUse> use{};
  Result<StandIn> simulated{};
};

void print_sheet(std::FILE* out, const SheetReport& report) {
  const auto& [sheet, facts, use, simulated] = report;
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

std::int64_t number_of(const canopen::SheetValue& value) { return value.number; }

template <class T>
std::optional<std::string> refused(const Result<T>& result) {
  return result ? std::nullopt : std::optional(result.error().message);
}

}  // namespace

static void figures(Figures& f, const canopen::SheetDcMode& mode) {
  f("name", mode.name);
  f("assign_activate", "bit 9 SYNC0, bit 10 SYNC1", mode.activate);
}

static void figures(Figures& f, const SheetMode& mode) {
  f("mode", "6060", mode.number);
  f("name", mode.name);
  f("needs", "objects", mode.needs);
  f("lacks", mode.lacks);
  f("has_also", mode.also);
}

static void figures(Figures& f, const hal::can::DriveFact& fact) {
  f("what", fact.what);
  f("how", fact.how);
}

static void figures(Figures& f, const SheetPdo& pdo) {
  f("pdo", "`RPDO 1`", fmt::format("{} {}", pdo.receive ? "RPDO" : "TPDO", pdo.number));
  f("cob_id", "null: not said; with bits 30 and 31", pdo.cob_id.transform(number_of));
  f("plus_node_id", "the id is added to it", pdo.cob_id && pdo.cob_id->plus_node_id);
  f("cob_id_writable", pdo.cob_id_writable);
  f("transmission", "null: not said", pdo.transmission);
  f("transmission_writable", pdo.transmission_writable);
  f("entries", "at most", pdo.entries);
  f("mapping_writable", pdo.mapping_writable);
  f("assigned", "of an ESI: it is among the process data from power-on", pdo.assigned);
  f("carries", "objects; of an ESI also gaps, `(8 bit)`", pdo.carries);
}

static void figures(Figures& f, const SheetEntry* entry) {
  f("object", "`60C1:1`", [&] { return object_text(*entry); });
  f("name", [&] { return entry->name; });
  f("size_bytes", "0: not fixed", [&] { return entry->size(); });
  f("value", "without the node's id; reals as bits; null: not said",
    [&] { return entry->value.transform(number_of); });
}

static void figures(Figures& f, const SheetReport& report) {
  const DataSheet& sheet = report.sheet;
  const SheetFacts& facts = report.facts;
  f("file", sheet.file);
  f("vendor_name", "may be empty, as the next two", sheet.vendor_name);
  f("product_name", sheet.product_name);
  f("description", sheet.description);
  f("vendor", "1018, else `[DeviceInfo]`; null: not said", sheet.vendor);
  f("product", sheet.product);
  f("revision", sheet.revision);
  f("device_type", "1000; its low 16 bits are the profile's number", facts.device_type);
  f("axes", "controlwords (6040, 6840, …); 0: no drive", facts.axes);
  f("sheet_entries", "sub-indices", sheet.entries.size());
  f("node_id", "a DCF's own", sheet.node_id);
  f("bit_rate_kbit_s", "a DCF's own", sheet.bit_rate_kbit_s);
  f("bit_rates_kbit_s", "that the device takes", sheet.bit_rates_kbit_s);
  f("lss", "its id can be set over the bus", sheet.lss);
  f("ethercat", "it is the file of an EtherCAT slave (ESI)", sheet.ethercat);
  f("dc_modes", "of an ESI", sheet.dc_modes);
  f("heartbeat_consumers", "sub-indices of 1016", facts.heartbeat_consumers);
  f("heartbeat_producer", "1017", facts.heartbeat_producer);
  f("node_guarding", "100C and 100D", facts.node_guarding);
  f("modes_said", "by 6502; `false`: `modes` are what the objects allow", facts.modes_said);
  f("modes", "of the first axis", facts.modes);
  f("own_modes", "the manufacturer's bits of 6502", facts.own_modes);
  f("master", "what Tandem's master does with the drive", [&](Figures& master) {
    const hal::can::DriveUse can = report.use.value_or(hal::can::DriveUse());
    master("refused", "why it cannot drive it; null: it can", refused(report.use));
    master("does", can.does);
    master("misses", can.misses);
  });
  f("simulation", "the drive in simulation", [&](Figures& stand_in) {
    const StandIn can = report.simulated.value_or(StandIn());
    stand_in("refused", "why it cannot be simulated; null: it can", refused(report.simulated));
    stand_in("modes", "6060, of the first axis", can.modes);
    stand_in("remarks", "what it lacks, or takes otherwise than the sheet says", can.remarks);
  });
  f("lacks", "of every mode's 6040 in an RPDO, 6041 in a TPDO, 6060 and 6061", facts.lacks);
  f("pdos", facts.pdos);
  f("into_rpdo", "objects", facts.into_rpdo);
  f("into_tpdo", "objects", facts.into_tpdo);
  f("units", "objects", facts.units);
  f("remarks", "what is odd in the sheet", sheet.remarks);
}

std::vector<Figures::Row> eds_figures() { return Figures::rows_of<SheetReport>(); }

Exit eds_show(const EdsOptions& options) {
  auto sheet = canopen::load_data_sheet(options.sheet,
                                        {.product = options.product, .revision = options.revision});
  if (!sheet) return refuse(sheet.error());
  SheetReport report{.sheet = std::move(*sheet)};
  report.facts = sheet_facts(report.sheet);
  report.use = hal::can::use_of(report.sheet);
  report.simulated = stand_in_of(report.sheet, report.facts);
  print_sheet(human_output(options.json), report);
  return end_with_json(options.json, figures_json(report));
}

}  // namespace tandem::apps
