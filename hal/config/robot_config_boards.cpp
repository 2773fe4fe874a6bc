// [[bus]] and [[board]]: node ids that count up along a bus, and the axes of the joints that they
// list.
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>

#include "canopen/drive_abilities.hpp"
#include "canopen/frame.hpp"
#include "canopen/objects.hpp"
#include "hal/config/robot_config_read.hpp"

namespace tandem::hal {
namespace {

constexpr std::size_t kMostAxes = 8;
constexpr double kOwnBoot_s = 1.5;
constexpr double kSheetBoot_s = 6.0;  // drives that need five are known

BusConfig read_bus(TomlTable& table) {
  BusConfig bus;
  read_keys(table, keys::kBus, bus);
  return bus;
}

void add_bus(TomlTable& table, RobotConfig& robot) {
  BusConfig bus = read_bus(table);
  bus.line = table.line();
  check_own_name(table, bus.name);
  check_unique(table, robot.buses, bus.name, "bus");
  if (!table.has("interface")) bus.interface = bus.name;
  const std::string problem = interface_name_problem(bus.interface);
  if (table.has("interface") && !problem.empty()) {
    table.error("interface", "'" + bus.interface + "' " + problem,
                "name it as `ip link` does, for instance \"can0\"");
  }
  const auto same = std::ranges::find(robot.buses, bus.interface, &BusConfig::interface);
  if (same != robot.buses.end()) {
    table.error(table.has("interface") ? "interface" : "name",
                "'" + bus.interface + "' is the interface of bus '" + same->name + "' (line " +
                    std::to_string(same->line) + "), too: bus '" + bus.name +
                    "' needs one of its own",
                "give each [[bus]] another interface");
  }
  if (bus.fd && bus.data_bitrate < bus.bitrate) {
    table.error("data_bitrate", "is lower than the bitrate of the arbitration phase",
                "raise it, or set fd = false");
  }
  robot.buses.push_back(bus);
}

BoardConfig read_board(TomlTable& table) {
  BoardConfig board;
  read_keys(table, keys::kBoard, board);
  const double usual_s = board.eds.empty() ? kOwnBoot_s : kSheetBoot_s;
  board.boot_time_ns = std::llround(1e9 * table.number_or("boot_time_s", usual_s, {0.1, 60.0}));
  return board;
}

/// The data sheets of a robot's drives, each read once.
class Sheets {
 public:
  /// Reads the data sheet that the board names. What is wrong with it is said of the first board.
  void read(TomlTable& table, const std::string& robot_file, BoardConfig& board) {
    if (board.eds.empty()) return;
    namespace fs = std::filesystem;
    const std::string path = (fs::path(robot_file).parent_path() / board.eds).string();
    const canopen::DeviceChoice choice{.product = board.product_code, .revision = board.revision};
    const auto [known, is_new] = read_.try_emplace({path, choice.product, choice.revision});
    if (is_new) {
      if (auto sheet = canopen::load_data_sheet(path, choice); sheet) {
        known->second = std::move(*sheet);
      } else {
        table.error("eds", sheet.error().to_string(), "`tandem eds show` checks a sheet by itself");
      }
    }
    if (!known->second) return;
    board.eds = path;
    auto sheet = std::make_shared<canopen::DataSheet>(*known->second);
    if (board.fd) {
      sheet->most_pdo_bytes = static_cast<int>(canopen::kMaxFrameBytes);
    }
    board.sheet = std::move(sheet);
  }

 private:
  using Key = std::tuple<std::string, std::optional<std::uint32_t>, std::optional<std::uint32_t>>;
  std::map<Key, std::optional<canopen::DataSheet>> read_;  // none: it has an error
};

/// On a line of slaves PDOs are those of a slave, whichever kind of sheet tells them.
void set_wire(TomlTable& table, const RobotConfig& robot, BoardConfig& board) {
  const BusConfig* bus = robot.bus(board.bus);
  if (board.eds.empty() || bus == nullptr) return;
  const bool line = bus->kind == BusKind::kEthercat;
  if (line == board.sheet->ethercat) return;
  if (!line) {
    table.error("eds", "is the file of an EtherCAT slave, and its bus '" + bus->name + "' is CAN",
                "name the drive's EDS or DCF, or set kind = \"ethercat\" of the bus");
    return;
  }
  auto sheet = std::make_shared<canopen::DataSheet>(*board.sheet);
  sheet->ethercat = true;
  sheet->most_pdo_bytes = static_cast<int>(canopen::kMaxFrameBytes);
  board.sheet = std::move(sheet);
}

/// Whether the sheet is of the drive that robot.toml describes.
void check_identity(TomlTable& table, const BoardConfig& board) {
  if (board.eds.empty()) return;
  const canopen::DataSheet& sheet = *board.sheet;
  const auto other = [&](const char* key, std::uint32_t wanted, std::uint32_t said) {
    table.error(
        key, "is " + hex(wanted) + ", and its drive's sheet (" + board.eds + ") is of " + hex(said),
        "get the sheet of this drive, or remove the key: then the sheet's counts");
  };
  const auto compare = [&](const char* key, std::optional<std::uint32_t> wanted,
                           std::optional<std::uint32_t> said, std::uint32_t shift) {
    if (wanted && said && *wanted >> shift != *said >> shift) other(key, *wanted, *said);
  };
  compare("vendor_id", board.vendor_id, sheet.vendor, 0);
  compare("product_code", board.product_code, sheet.product, 0);
  compare("revision", board.revision, sheet.revision, 16);
}

/// What only a drive of another make may, or can, be told.
void check_drive_keys(TomlTable& table, const RobotConfig& robot, const BoardConfig& board) {
  const BusConfig* bus = robot.bus(board.bus);
  if (table.has("fd") && board.eds.empty()) {
    table.error("fd", "is for drives of other makers: our own boards take what their bus has",
                "remove this key, or set fd of the bus");
  } else if (board.fd && bus != nullptr && bus->kind == BusKind::kEthercat) {
    table.error("fd", "its bus '" + bus->name + "' is EtherCAT: PDOs are as long as the drive's",
                "remove this key");
  } else if (board.fd && bus != nullptr && !bus->fd) {
    table.error("fd", "its bus '" + bus->name + "' is no CAN FD bus",
                "remove this key, or set fd = true of the bus");
  }
  if (!board.keeps_configuration) return;
  using canopen::writable;
  namespace object = canopen::object;
  const bool names = writable(*board.sheet, object::kVerifyConfiguration, 1) &&
                     writable(*board.sheet, object::kVerifyConfiguration, 2);
  const bool stores = writable(*board.sheet, object::kStoreParameters, 1);
  if (names && stores) return;
  table.error("keeps_configuration",
              std::string("its drive cannot: ") + (names ? "1010:1" : "1020") +
                  " is missing in its sheet, or cannot be written",
              "remove this key: the configuration is written at every start");
}

/// The joints that the board lists: each once, and on this board alone.
std::vector<std::string> read_list(TomlTable& table, const std::string& board,
                                   const std::vector<BoardTable>& others) {
  std::vector<std::string> joints = table.texts_or("joints", {});
  if (joints.size() > kMostAxes) {
    table.error("joints", "lists " + std::to_string(joints.size()) + " joints",
                "a board has at most " + std::to_string(kMostAxes) + " axes");
  }
  for (auto joint = joints.begin(); joint != joints.end(); ++joint) {
    if (std::find(joints.begin(), joint, *joint) != joint) {
      table.error("joints", "the joint '" + *joint + "' is listed twice", "remove one of the two");
    }
    for (const BoardTable& other : others) {
      if (std::ranges::find(other.joints, *joint) == other.joints.end()) continue;
      table.error(
          "joints",
          "the joint '" + *joint + "' is on two boards, '" + other.board + "' and '" + board + "'",
          "remove one of the two");
    }
  }
  return joints;
}

/// @param bus  whose table holds this one; empty for a [[board]]
void add_board(TomlTable table, const std::string& bus, NodeIds& ids,
               std::vector<BoardTable>& boards, Sheets& sheets, RobotConfig& robot) {
  BoardConfig board = read_board(table);
  board.line = table.line();
  check_own_name(table, board.name);
  check_unique(table, robot.boards, board.name, "board");
  sheets.read(table, robot.file, board);
  check_identity(table, board);
  board.bus = read_bus_name(table, bus);
  check_reference(table, "bus", board.bus, robot.buses, "bus");
  set_wire(table, robot, board);
  check_drive_keys(table, robot, board);
  board.node_id = ids.read(table, board.bus);
  std::vector<std::string> joints = read_list(table, board.name, boards);
  table.finish();
  boards.push_back({std::move(table), board.name, std::move(joints)});
  robot.boards.push_back(std::move(board));
}

}  // namespace

std::vector<BoardTable> read_buses(TomlTable& root, NodeIds& ids, RobotConfig& robot,
                                   std::vector<SensorTable>& sensors) {
  const TomlTable bus_defaults = read_defaults(root, "bus_defaults", read_bus);
  const TomlTable board_defaults = read_defaults(root, "board_defaults", read_board);
  std::vector<BoardTable> boards;
  Sheets sheets;
  for (TomlTable& bus : root.tables("bus")) {
    bus.inherit(bus_defaults);
    add_bus(bus, robot);
    const std::string name = robot.buses.back().name;
    for (TomlTable& board : bus.tables("boards")) {
      board.inherit(board_defaults);
      add_board(board, name, ids, boards, sheets, robot);
    }
    for (TomlTable& sensor : bus.tables("sensors")) sensors.push_back({std::move(sensor), name});
    bus.finish();
  }
  for (TomlTable& board : root.tables("board")) {
    board.inherit(board_defaults);
    add_board(board, {}, ids, boards, sheets, robot);
  }
  return boards;
}

std::vector<AxisAssignment> axes_listed_by(std::span<const BoardTable> boards) {
  std::vector<AxisAssignment> listed;
  for (const BoardTable& board : boards) {
    for (std::size_t axis = 0; axis < board.joints.size(); ++axis) {
      listed.push_back({board.joints[axis], board.board, static_cast<int>(axis)});
    }
  }
  return listed;
}

void check_boards(std::span<BoardTable> boards, const RobotConfig& robot,
                  std::vector<JointReference>& loose) {
  for (const BoardTable& board : boards) {
    for (const std::string& joint : board.joints) {
      if (robot.joint_index(joint) >= 0) continue;
      loose.push_back(
          {joint, board.table.error_at("joints", "there is no [[joint]] '" + joint + "'")});
    }
  }
  for (BoardTable& board : boards) {
    std::set<int> axes;
    for (std::size_t axis = 0; axis < board.joints.size(); ++axis) {
      axes.insert(static_cast<int>(axis));
    }
    for (const JointConfig& joint : robot.joints) {
      if (joint.board == board.board) axes.insert(joint.axis);
    }
    if (axes.empty() && (board.table.has_errors() || !loose.empty()))
      continue;  // its joint is lost
    if (axes.empty()) {
      board.table.error("name", "no joint is on board '" + board.board + "'",
                        "list its joints, or remove the board");
    } else if (*axes.rbegin() + 1 != static_cast<int>(axes.size())) {
      board.table.error("name", "the axes of board '" + board.board + "' have a gap",
                        "number them from 0 without a gap");
    }
  }
}

Status replace_interfaces(RobotConfig& robot, std::span<const std::string> replacements) {
  std::vector<std::string> known;
  for (const BusConfig& bus : robot.buses) known.push_back(bus.interface);
  for (const std::string& text : replacements) {
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == text.size()) {
      return fail("--interface " + text + " is not of the form FROM=TO",
                  "for instance --interface can0=vcan0");
    }
    const std::string from = text.substr(0, equals);
    if (std::ranges::find(known, from) == known.end()) {
      return fail("no bus of " + robot.file + " has the interface '" + from + "'",
                  suggest(from, known));
    }
    const std::string to = text.substr(equals + 1);
    if (const std::string problem = interface_name_problem(to); !problem.empty()) {
      return fail("--interface " + text + ": '" + to + "' " + problem,
                  "name an interface that `ip link` lists");
    }
    for (std::size_t b = 0; b < known.size(); ++b) {
      if (known[b] == from) robot.buses[b].interface = to;
    }
  }
  return {};
}

}  // namespace tandem::hal
