// Reads [[fault]] tables strictly, names resolved to indices of the robot; a line of words becomes
// such a table first.
#include "hal/sim/scenario.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>

#include "base/toml_reader.hpp"
#include "hal/sim/payload.hpp"
#include "hal/sim/push_row.hpp"

namespace tandem::sim {

using hal::FaultKind;

namespace {

constexpr double kLongest_s = 1e6;
constexpr std::int64_t kMostCycles = 1'000'000'000;
constexpr std::int64_t kAnyU32 = std::numeric_limits<std::uint32_t>::max();

/// What every reading needs.
struct Context {
  const hal::RobotConfig& robot;
  std::int64_t period_ns;
  const model::Tree* tree;
};

std::int64_t ns(double seconds) { return std::llround(seconds * 1e9); }

template <class Items>
std::int32_t index_of(TomlTable& table, const char* key, const Items& items) {
  std::vector<std::string> known;
  for (const auto& item : items) known.push_back(item.name);
  return index_in(table, key, known);
}

void read_times(TomlTable& table, const Context& context, ScenarioFault& fault) {
  const bool at_s = table.has("at_s"), at_cycle = table.has("at_cycle");
  const bool after = table.has("after_enabled_s");
  if (at_s + at_cycle + after > 1) {
    table.error(at_s ? "at_s" : "at_cycle", "a fault begins once",
                "keep one of at_s, at_cycle and after_enabled_s");
  }
  fault.start_ns = ns(table.number_or("at_s", 0.0, {0.0, kLongest_s}));
  if (at_cycle) {
    fault.start_ns = table.integer_or("at_cycle", 0, 0, kMostCycles) * context.period_ns;
  }
  if (after) {
    fault.from = FaultFrom::kEnabled;
    fault.start_ns = ns(table.number_or("after_enabled_s", 0.0, {0.0, kLongest_s}));
  }
  if (table.has("for_s") && table.has("for_cycles")) {
    table.error("for_s", "a fault lasts once", "keep one of for_s and for_cycles");
  }
  if (table.has("for_s")) {
    fault.duration_ns = ns(table.number_or("for_s", 0.0, {0.0, kLongest_s}));
  }
  if (table.has("for_cycles")) {
    fault.duration_ns = table.integer_or("for_cycles", 1, 1, kMostCycles) * context.period_ns;
  }
}

/// A board or a sensor: one of them has to be named.
void read_node(TomlTable& table, const hal::RobotConfig& robot, ScenarioFault& fault) {
  const bool board = table.has("board");
  if (board && table.has("sensor")) {
    (void)table.text("sensor");
    table.error("sensor", "a fault is of one node, and `board` names another",
                "leave one of both out, or write a second [[fault]]");
  } else if (table.has("sensor")) {
    fault.sensor = index_of(table, "sensor", robot.sensors);
    return;
  }
  fault.board = index_of(table, "board", robot.boards);
}

/// Which way, how often: of frames on any wire.
void read_share(TomlTable& table, ScenarioFault& fault) {
  const std::string way = table.choice_or("direction", "both", {"to_boards", "to_master", "both"});
  if (way == "to_boards") fault.direction = FrameDirection::kToBoards;
  if (way == "to_master") fault.direction = FrameDirection::kToMaster;
  fault.probability = table.number_or("probability", 1.0, {0.0, 1.0, true});
  fault.count = static_cast<std::uint32_t>(table.integer_or("count", 0, 0, kAnyU32));
  fault.seed = static_cast<std::uint64_t>(
      table.integer_or("seed", 0, 0, std::numeric_limits<std::int64_t>::max()));
}

/// On an EtherCAT bus a frame goes through every slave.
void read_line_frames(TomlTable& table, ScenarioFault& fault) {
  if (fault.node_id != 0) {
    table.error(fault.board >= 0 ? "board" : "sensor", "an Ethernet frame is of no single node",
                "name the bus; for one slave there is board_kill, board_reset and bus_down");
  }
  if (fault.kind == FaultKind::kFrameCorrupt || fault.kind == FaultKind::kFrameReorder) {
    table.error("kind", "Ethernet drops frames that are damaged, and a line keeps their order",
                "use frame_drop, frame_delay or frame_duplicate");
  }
  if (fault.kind == FaultKind::kFrameDelay) {
    fault.steps = static_cast<std::uint32_t>(table.integer_or("steps", 1, 1, 1));
  }
  read_share(table, fault);
}

void read_frames(TomlTable& table, const hal::RobotConfig& robot, ScenarioFault& fault) {
  if (table.has("bus")) fault.bus = index_of(table, "bus", robot.buses);
  if (table.has("board") || table.has("sensor")) {  // the node's frames, on its bus
    read_node(table, robot, fault);
    const auto of = [&](const auto& node) {
      fault.node_id = static_cast<std::uint32_t>(node.node_id);
      const auto bus = std::ranges::find(robot.buses, node.bus, &hal::BusConfig::name);
      fault.bus = static_cast<std::int32_t>(bus - robot.buses.begin());
    };
    if (fault.board >= 0) of(robot.boards[static_cast<std::size_t>(fault.board)]);
    if (fault.sensor >= 0) of(robot.sensors[static_cast<std::size_t>(fault.sensor)]);
  }
  const bool line = fault.bus >= 0 && robot.buses[static_cast<std::size_t>(fault.bus)].kind ==
                                          hal::BusKind::kEthercat;
  if (line) return read_line_frames(table, fault);
  if (table.has("cob_id")) {
    fault.cob_id = static_cast<std::uint32_t>(table.integer("cob_id", 0, 0x7FF));
    fault.cob_mask = static_cast<std::uint32_t>(table.integer_or("cob_mask", 0x7FF, 1, 0x7FF));
  }
  read_share(table, fault);
  if (fault.kind == FaultKind::kFrameDelay) {
    fault.steps = static_cast<std::uint32_t>(table.integer("steps", 1, 1'000'000));
  }
  if (fault.kind == FaultKind::kFrameCorrupt) {
    fault.length = static_cast<std::int32_t>(table.integer_or("length", -1, 0, 64));
    fault.bits = static_cast<std::uint32_t>(table.integer_or("bits", 1, 1, 512));
  }
}

/// Reads the bus, and on EtherCAT the board whose cable is cut; without it, the first slave's is.
void read_cable(TomlTable& table, const hal::RobotConfig& robot, ScenarioFault& fault) {
  fault.bus = index_of(table, "bus", robot.buses);
  if (fault.bus < 0 || !table.has("board")) return;
  const hal::BusConfig& bus = robot.buses[static_cast<std::size_t>(fault.bus)];
  fault.board = index_of(table, "board", robot.boards);
  if (bus.kind != hal::BusKind::kEthercat) {
    table.error("board", "a CAN bus is down for all of its nodes", "leave the board out");
  } else if (fault.board >= 0 &&
             robot.boards[static_cast<std::size_t>(fault.board)].bus != bus.name) {
    table.error("board", "it is on another bus", "name a board of bus '" + bus.name + "'");
  }
}

void read_joint(TomlTable& table, const hal::RobotConfig& robot, ScenarioFault& fault) {
  fault.joint = index_of(table, "joint", robot.joints);
  const bool encoder = fault.kind == FaultKind::kEncoderFreeze ||
                       fault.kind == FaultKind::kEncoderJump ||
                       fault.kind == FaultKind::kEncoderUnplug;
  if (encoder && table.choice_or("encoder", "link", {"link", "motor"}) == "motor") {
    fault.encoder = EncoderSide::kMotor;
  }
  if (fault.kind == FaultKind::kEncoderJump) fault.value = table.number("rad", {-1e3, 1e3});
  if (fault.kind == FaultKind::kMotorOverheat) {
    fault.value = table.number("celsius", {-50.0, 1000.0});
  }
  if (fault.kind != FaultKind::kSpringBreak || fault.joint < 0) return;
  const hal::JointConfig& joint = robot.joints[static_cast<std::size_t>(fault.joint)];
  if (robot.actuator_of(joint).order < 2) {
    table.error("joint", "the actuator of '" + joint.name + "' is rigid: it has no spring",
                "choose a joint whose actuator is of order 2 or 3");
  }
}

void read_target(TomlTable& table, const Context& context, ScenarioFault& fault) {
  const hal::RobotConfig& robot = context.robot;
  switch (fault.kind) {
    case FaultKind::kNone: return;
    case FaultKind::kFrameDrop:
    case FaultKind::kFrameDelay:
    case FaultKind::kFrameDuplicate:
    case FaultKind::kFrameCorrupt:
    case FaultKind::kFrameReorder: return read_frames(table, robot, fault);
    case FaultKind::kBoardKill:
    case FaultKind::kBoardReset: return read_node(table, robot, fault);
    case FaultKind::kBoardIdentity:
    case FaultKind::kBoardRevision:
      fault.board = index_of(table, "board", robot.boards);
      fault.number = static_cast<std::uint32_t>(table.integer(
          fault.kind == FaultKind::kBoardIdentity ? "product" : "revision", 0, kAnyU32));
      return;
    case FaultKind::kBoardDuplicate:
    case FaultKind::kEmergencyStop: fault.board = index_of(table, "board", robot.boards); return;
    case FaultKind::kSupplySag:
      fault.board = index_of(table, "board", robot.boards);
      fault.value = table.number("volts", {0.0, 1e4});
      return;
    case FaultKind::kEncoderFreeze:
    case FaultKind::kEncoderJump:
    case FaultKind::kEncoderUnplug:
    case FaultKind::kMotorOverheat:
    case FaultKind::kSpringBreak: return read_joint(table, robot, fault);
    case FaultKind::kBusDown: return read_cable(table, robot, fault);
    case FaultKind::kPush: return read_push(table, robot, context.tree, fault);
    case FaultKind::kPayload: return read_payload(table, robot, context.tree, fault);
  }
}

FaultKind read_kind(TomlTable& table) {
  std::vector<std::string> known;
  for (const std::string_view name : hal::kFaultNames) known.emplace_back(name);
  known.erase(known.begin());  // "none"
  const std::string name = table.choice("kind", known);
  const auto found = std::ranges::find(known, name);
  return found == known.end() ? FaultKind::kNone
                              : static_cast<FaultKind>(found - known.begin() + 1);
}

ScenarioFault read_row(TomlTable& table, const Context& context, FaultKind kind) {
  ScenarioFault fault;
  fault.kind = kind;
  read_times(table, context, fault);
  read_target(table, context, fault);
  const bool ramps = fault.kind == FaultKind::kSupplySag || fault.kind == FaultKind::kMotorOverheat;
  if (ramps) fault.ramp_ns = ns(table.number_or("ramp_s", 0.0, {0.0, kLongest_s}));
  // Once and for all, so that an end would have no meaning.
  const bool momentary =
      fault.kind == FaultKind::kBoardReset || fault.kind == FaultKind::kSpringBreak;
  if (momentary && fault.duration_ns >= 0) {
    table.error(table.has("for_s") ? "for_s" : "for_cycles",
                std::string(to_string(fault.kind)) + " happens once", "leave the duration out");
  }
  if (momentary) fault.duration_ns = 0;
  if (fault.kind != FaultKind::kNone) table.finish();  // else its keys cannot be known
  return fault;
}

/// As TOML takes it: a number, a boolean and what is quoted stay.
bool is_literal(std::string_view value) {
  if (value == "true" || value == "false" || value.starts_with('"') || value.starts_with('['))
    return true;
  const bool digit = std::ranges::any_of(value, [](char c) { return c >= '0' && c <= '9'; });
  const bool number =
      value.find_first_not_of("0123456789+-._eExabcdefABCDEF") == std::string_view::npos;
  const bool starts = !value.empty() &&
                      (value[0] == '-' || value[0] == '+' || (value[0] >= '0' && value[0] <= '9'));
  return digit && number && starts;
}

std::expected<std::vector<ScenarioFault>, Diagnostics> read(Result<TomlDocument> document,
                                                            const hal::RobotConfig& robot,
                                                            std::int64_t period_ns,
                                                            const model::Tree* tree) {
  if (!document) return std::unexpected(Diagnostics{document.error()});
  TomlTable root = document->root();
  const Context context{robot, period_ns, tree};
  std::vector<ScenarioFault> faults;
  for (TomlTable& table : root.tables("fault"))
    faults.push_back(read_row(table, context, read_kind(table)));
  for (TomlTable& table : root.tables("push"))
    faults.push_back(read_row(table, context, FaultKind::kPush));
  if (faults.empty()) {
    root.error("fault", "there is no fault", "add [[fault]] with kind = \"board_kill\", for one");
    return std::unexpected(document->diagnostics());  // what else is there is of another kind
  }
  if (faults.size() > FaultInjection::kMostFaults) {
    root.error("fault", std::to_string(faults.size()) + " faults are too many",
               "at most " + std::to_string(FaultInjection::kMostFaults));
  }
  root.finish();
  Diagnostics errors = document->diagnostics();
  if (errors.empty()) return faults;
  sort_by_line(errors);
  return std::unexpected(std::move(errors));
}

}  // namespace

ScenarioFault read_fault(TomlTable& table, const hal::RobotConfig& robot, std::int64_t period_ns,
                         const model::Tree* tree, hal::FaultKind kind) {
  return read_row(table, {robot, period_ns, tree},
                  kind == FaultKind::kNone ? read_kind(table) : kind);
}

std::expected<std::vector<ScenarioFault>, Diagnostics> read_scenario(const std::string& file,
                                                                     const hal::RobotConfig& robot,
                                                                     std::int64_t period_ns,
                                                                     const model::Tree* tree) {
  return read(TomlDocument::load(file), robot, period_ns, tree);
}

std::expected<std::vector<ScenarioFault>, Diagnostics> parse_scenario(std::string_view text,
                                                                      const std::string& file,
                                                                      const hal::RobotConfig& robot,
                                                                      std::int64_t period_ns,
                                                                      const model::Tree* tree) {
  return read(TomlDocument::parse(text, file), robot, period_ns, tree);
}

std::string scenario_of_words(std::span<const std::string> words) {
  std::string text = "[[fault]]\n";
  for (const std::string& word : words) {
    const std::size_t equals = word.find('=');
    const bool toml = equals == std::string::npos || word.find_first_of(" \n") < word.find('[');
    if (toml) {
      text += word + "\n";
      continue;
    }
    const std::string value = word.substr(equals + 1);
    text += word.substr(0, equals) + " = " + (is_literal(value) ? value : '"' + value + '"') + "\n";
  }
  return text;
}

}  // namespace tandem::sim
