// The layout of PDOs and the abilities, told.
#include "hal/ethercat-can/drive_use.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <memory>
#include <optional>
#include <set>

#include "base/counted.hpp"
#include "canopen/drive_abilities.hpp"
#include "canopen/objects.hpp"
#include "canopen/sheet_mappings.hpp"
#include "hal/config/joint_scale.hpp"
#include "hal/ethercat-can/limit_warnings.hpp"

namespace tandem::hal::can {
namespace {

namespace object = canopen::object;
using canopen::DataSheet;
using canopen::Mode;

std::string object_text(const MappedField& field) {
  return field.sub == 0 ? fmt::format("{:04X}", field.index)
                        : fmt::format("{:04X}:{:X}", field.index, field.sub);
}

/// The object that carries the field of the first axis; "" when none does.
std::string carrier(const NodePlan& node, WireField field) {
  for (const PdoPlan& pdo : node.pdos) {
    for (const MappedField& mapped : pdo.fields) {
      if (mapped.axis == 0 && mapped.field == field) return object_text(mapped);
    }
  }
  return {};
}

const char* name_of(Mode mode) {
  switch (mode) {
    case Mode::kPp: return "profile position";
    case Mode::kPv: return "profile velocity";
    case Mode::kIp: return "interpolated position";
    case Mode::kCsp: return "CSP";
    case Mode::kCsv: return "CSV";
    default: return "CST";
  }
}

std::string mode_text(Mode mode, const std::string& target) {
  return fmt::format("mode {} ({}), target {}", static_cast<int>(mode), name_of(mode), target);
}

void tell_modes(const NodePlan& node, DriveUse& use) {
  const canopen::DriveAbilities& can = node.abilities[0];
  const bool profile = canopen::moves_by_profile(can);
  const auto tell = [&](const char* what, Mode mode, WireField field) {
    if (mode == Mode::kNone) {
      use.misses.push_back(
          fmt::format("{} control: no {} for it", what, profile ? "mode" : "cyclic mode"));
    } else {
      use.does.push_back({what, mode_text(mode, carrier(node, field))});
    }
  };
  tell("position", can.position, WireField::kTargetPosition);
  tell("velocity", can.velocity, WireField::kVelocityOffset);
  tell("torque", can.torque, WireField::kTorqueOffset);
  if (can.one_mode) {
    use.misses.push_back("change of mode: 6060 cannot be in a PDO, the first mode stays");
  }
  if (!can.impedance) use.misses.push_back("compliant joints: no object for a stiffness");
}

void tell_pdos(const NodePlan& node, DriveUse& use) {
  for (const PdoPlan& pdo : node.pdos) {
    std::string text;
    for (const MappedField& field : pdo.fields) {
      text += (text.empty() ? "" : " ") + object_text(field);
    }
    const bool receive = pdo.direction == canopen::PdoDirection::kReceive;
    const std::string name =
        node.ethercat
            ? fmt::format("{} {:04X}", receive ? "outputs" : "inputs", mapping_object(pdo))
            : fmt::format("{} {}", receive ? "RPDO" : "TPDO", pdo.number);
    use.does.push_back(
        {name, fmt::format("{} ({}{})", text.empty() ? "-" : text, counted(wire_bytes(pdo), "byte"),
                           pdo.mapping_written ? "" : ", as it is")});
  }
}

/// A joint's `stop_options` with their objects.
std::array<std::pair<std::uint16_t, std::optional<int>>, 4> options_of(const StopOptions& chosen) {
  return {{{object::kShutdownOption, chosen.shutdown},
           {object::kDisableOption, chosen.disable},
           {object::kHaltOption, chosen.halt},
           {object::kFaultReactionOption, chosen.fault}}};
}

/// What of it is set; empty: nothing.
std::string set_text(const StopOptions& chosen) {
  std::string text;
  for (const auto& [index, option] : options_of(chosen)) {
    if (!option) continue;
    text += fmt::format("{}{:04X} is set to {}", text.empty() ? "" : ", ", index, *option);
  }
  return text;
}

/// What the drive does by itself when it is stopped: what the master writes, else the sheet's
/// value.
std::string stops_text(const DataSheet& sheet, int axis, const StopOptions& chosen) {
  const auto value = [&](std::uint16_t index) -> std::string {
    const auto found = sheet.value(canopen::of_axis(index, axis), 0, 0);
    return found ? fmt::format("{}", static_cast<std::int16_t>(*found)) : "the drive's";
  };
  const bool quick = canopen::writable(sheet, canopen::of_axis(object::kQuickStopOption, axis), 0);
  std::string text =
      "605A " + (quick ? std::string("is set to 2") : value(object::kQuickStopOption));
  for (const auto& [index, option] : options_of(chosen)) {
    if (sheet.find(canopen::of_axis(index, axis)) == nullptr) continue;
    text += fmt::format(", {:04X} ", index) +
            (option ? fmt::format("is set to {}", *option) : value(index));
  }
  return text;
}

void tell_feedback(const NodePlan& node, DriveUse& use) {
  const auto miss = [&](WireField field, const char* text) {
    if (!node.carries(0, field)) use.misses.emplace_back(text);
  };
  miss(WireField::kVelocity, "velocity feedback: it is the difference of positions");
  miss(WireField::kTorque, "torque feedback: it stays 0");
  miss(WireField::kModeDisplay, "the mode's display: it is taken to be the one that was sent");
  miss(WireField::kErrorCode, "the error code: a fault's cause is its emergency message's");
}

/// What would let a joint move on unseen.
/// @param line  EtherCAT, where the drive watches its outputs (sync manager 2) and the master its
/// state
std::vector<std::string> unwatched(const NodePlan& node, const DataSheet& sheet, bool line) {
  std::vector<std::string> out;
  if (!line && node.watch == NodeWatch::kNothing) {
    out.emplace_back(
        "the drive does not notice when the master dies, and the master watches its TPDOs alone: "
        "it has neither heartbeats (1016, 1017) nor guarding (100C, 100D)");
  } else if (!line && node.watch == NodeWatch::kHeartbeat &&
             !canopen::writable(sheet, object::kHeartbeatConsumer, 1)) {
    out.emplace_back(
        "the drive does not notice when the master dies: it has no heartbeat consumer "
        "(1016) and no guarding (100C, 100D)");
  }
  const bool has_reaction = sheet.find(object::kAbortConnectionOption) != nullptr;
  if (!has_reaction) {
    out.emplace_back("what the drive does when the connection is lost is its own: no 6007");
  }
  return out;
}

/// A bus that is faster or slower than the sheet allows; one without bit rates says nothing.
void warn_of_bit_rate(const BusConfig& bus, const BoardConfig& board, const std::string& file,
                      Diagnostics& warnings) {
  const std::vector<int>& rates = board.sheet->bit_rates_kbit_s;
  const auto is_the_bus = [&](int kbit) { return 1000 * kbit == bus.bitrate; };
  if (rates.empty() || std::ranges::any_of(rates, is_the_bus)) return;
  warnings.push_back(
      {.message = fmt::format("bus '{}' has {} bit/s; the sheet {} has {} kbit/s", bus.name,
                              bus.bitrate, board.eds, fmt::join(rates, ", ")),
       .hint = "set [[bus]] bitrate to one that the drive has",
       .file = file,
       .line = bus.line,
       .key = "board '" + board.name + "'"});
}

/// A slave that is synchronous to pulses which the master does not send.
void warn_of_clock(const BoardConfig& board, const std::string& file, Diagnostics& warnings) {
  const auto& modes = board.sheet->dc_modes;
  const auto needs_more = [](const canopen::SheetDcMode& mode) { return mode.sync1(); };
  if (modes.empty() || !std::ranges::all_of(modes, needs_more)) return;
  warnings.push_back({.message = "each of its drive's clock modes needs SYNC1, and SYNC0 alone is "
                                 "sent",
                      .hint = "set the drive to follow SYNC0, if it can",
                      .file = file,
                      .line = board.line,
                      .key = "board '" + board.name + "'"});
}

/// A mapping that no drive can have: the sheet is another one's, or wrong.
void warn_of_mappings(const DataSheet& sheet, Diagnostics& warnings) {
  for (canopen::OddMapping& odd : canopen::odd_mappings(sheet)) {
    warnings.push_back({.message = std::move(odd.text),
                        .hint = "is it the sheet of this drive? Where the mapping can be written, "
                                "the master writes its own",
                        .file = sheet.file,
                        .line = odd.line,
                        .key = {}});
  }
}

/// Modes of the sheet whose target is in no PDO that is used: a joint that is asked for one would
/// not move.
void warn_of_modes(const NodePlan& node, const BoardConfig& board, const std::string& file,
                   Diagnostics& warnings) {
  for (std::size_t axis = 0; axis < node.abilities.size(); ++axis) {
    const auto of_sheet = canopen::abilities_of(*board.sheet, static_cast<int>(axis));
    const canopen::DriveAbilities& can = node.abilities[axis];
    for (const auto& [said, has] :
         {std::pair{of_sheet.velocity, can.velocity}, {of_sheet.torque, can.torque}}) {
      if (said == has) continue;
      warnings.push_back({.message = fmt::format(
                              "axis {}: no PDO that is used has a target of mode {}, which its "
                              "sheet has: a controller that asks for it does not move the joint",
                              axis, static_cast<int>(said)),
                          .hint = "use the drive in its mode " +
                                  std::to_string(static_cast<int>(canopen::first_mode(can))),
                          .file = file,
                          .line = board.line,
                          .key = "board '" + board.name + "'"});
    }
  }
}

/// A drive by its objects that does not call itself one.
void warn_of_profile(const DataSheet& sheet, Diagnostics& warnings) {
  const canopen::SheetEntry* type = sheet.find(object::kDeviceType);
  if (type == nullptr || !type->value) return;
  const auto number = static_cast<std::uint32_t>(type->value->number);
  if ((number & 0xFFFF) == (canopen::kDriveDeviceType & 0xFFFF)) return;
  warnings.push_back(
      {.message = fmt::format("is 0x{:08X}: not profile 402 (0x0192). Its objects are those of a "
                              "CiA 402 drive, and it is used as one",
                              number),
       .hint = "the drive must answer this value, or one with profile 402: is it the sheet of this "
               "drive?",
       .file = sheet.file,
       .line = type->line,
       .key = "1000"});
}

/// "", or that it moves in profile modes, and in which.
std::string profile_text(const DataSheet& sheet, int axis) {
  const canopen::DriveAbilities can = canopen::abilities_of(sheet, axis);
  if (!canopen::moves_by_profile(can)) return {};
  std::string text = "by ramps of its own: ";
  for (const Mode mode : {can.position, can.velocity}) {
    if (mode == Mode::kNone) continue;
    text += fmt::format("{} (mode {}), ", name_of(mode), static_cast<int>(mode));
  }
  return text + "no torque; ";
}

}  // namespace

DriveUse use_of(const NodePlan& node, const DataSheet& sheet) {
  DriveUse use;
  tell_modes(node, use);
  tell_pdos(node, use);
  use.does.push_back({"watching", node.ethercat ? "its state; it watches its outputs (watchdog)"
                                  : node.watch == NodeWatch::kHeartbeat ? "heartbeats"
                                  : node.watch == NodeWatch::kGuarding  ? "node guarding"
                                                                        : "its TPDOs alone"});
  use.does.push_back({"stops", stops_text(sheet, 0, {})});
  use.does.push_back({"homing", node.abilities[0].homing ? "mode 6, where a joint has `homing`"
                                                         : "by the drive's own program alone"});
  tell_feedback(node, use);
  for (std::string& text : unwatched(node, sheet, node.ethercat))
    use.misses.push_back(std::move(text));
  return use;
}

Result<DriveUse> use_of(const DataSheet& sheet) {
  RobotConfig robot;
  robot.buses.push_back({.name = "bus", .interface = "can0", .fd = false});
  if (sheet.ethercat) robot.buses[0].kind = BusKind::kEthercat;
  BoardConfig board;
  board.name = "drive";
  board.bus = "bus";
  board.node_id = 1;
  board.eds = sheet.file;
  board.sheet = std::make_shared<const DataSheet>(sheet);
  robot.boards.push_back(std::move(board));
  JointConfig joint;
  joint.name = "joint";
  joint.board = "drive";
  robot.joints.push_back(joint);
  const auto layout = make_pdo_layout(robot);
  if (!layout) {
    Error error = layout.error();
    error.key.clear();
    return std::unexpected(std::move(error));
  }
  return use_of(layout->nodes[0], sheet);
}

std::vector<DriveFact> drive_facts(const RobotConfig& robot) {
  std::vector<DriveFact> facts;
  std::vector<std::size_t> others;  // by fact: joints besides the first
  for (const JointConfig& joint : robot.joints) {
    const BoardConfig* board = robot.board(joint.board);
    if (board == nullptr) continue;
    const bool own = board->eds.empty();  // all else is as docs/firmware.md says
    std::string how = own ? set_text(joint.stop_options)
                          : stops_text(*board->sheet, joint.axis, joint.stop_options);
    if (how.empty()) continue;
    if (!own) how = profile_text(*board->sheet, joint.axis) + how;
    if (joint.brake && !own) how += "; its brake is the drive's own";
    if (joint.homing && !own) {
      how += fmt::format("; homed by method {}{}", joint.homing->method,
                         joint.homing->required ? ", before anything else moves it" : "");
    }
    const auto same = std::ranges::find(facts, how, &DriveFact::how);
    if (same != facts.end()) {
      ++others[static_cast<std::size_t>(same - facts.begin())];
      continue;
    }
    facts.push_back({joint.name, std::move(how)});
    others.push_back(0);
  }
  for (std::size_t i = 0; i < facts.size(); ++i) {
    if (others[i] > 0) facts[i].what += fmt::format(" and {}", counted(others[i], "other"));
  }
  return facts;
}

Diagnostics sheet_warnings(const RobotConfig& robot) {
  Diagnostics warnings;
  std::set<std::string> seen;
  for (const BoardConfig& board : robot.boards) {
    if (board.eds.empty() || !seen.insert(board.eds).second) continue;
    for (const canopen::SheetHindrance& one : board.sheet->hindrances) {
      warnings.push_back({.message = one.text,
                          .hint = "ask the drive's maker for its whole file, or correct it",
                          .file = board.eds,
                          .line = one.line,
                          .key = {}});
    }
  }
  return warnings;
}

Result<Diagnostics> drive_warnings(const RobotConfig& robot) {
  const auto layout = make_pdo_layout(robot);
  if (!layout) return std::unexpected(layout.error());
  Diagnostics warnings = scale_warnings(robot);
  std::set<std::string> seen;  // sheets that several boards have
  for (const NodePlan& node : layout->nodes) {
    if (node.board < 0) continue;
    const BoardConfig& board = robot.boards[static_cast<std::size_t>(node.board)];
    if (board.eds.empty()) continue;
    if (seen.insert(board.eds).second) {
      warn_of_mappings(*board.sheet, warnings);
      warn_of_profile(*board.sheet, warnings);
      std::ranges::move(limit_warnings(node, *board.sheet), std::back_inserter(warnings));
    }
    warn_of_modes(node, board, robot.file, warnings);
    const auto bus = std::ranges::find(robot.buses, board.bus, &BusConfig::name);
    const bool line = bus != robot.buses.end() && bus->kind == BusKind::kEthercat;
    if (bus != robot.buses.end() && !line) warn_of_bit_rate(*bus, board, robot.file, warnings);
    if (line) warn_of_clock(board, robot.file, warnings);
    for (std::string& text : unwatched(node, *board.sheet, line)) {
      warnings.push_back({.message = std::move(text),
                          .hint = "set the drive's own time-out",
                          .file = robot.file,
                          .line = board.line,
                          .key = "board '" + board.name + "'"});
    }
  }
  return warnings;
}

}  // namespace tandem::hal::can
