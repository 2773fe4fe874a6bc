// Sums every frame's worst-case stuffed length over a cycle, and searches what would fit: a longer
// period, a higher data bit rate, CAN FD, or more buses.
#include "hal/ethercat-can/bus_load.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "canopen/frame.hpp"
#include "hal/ethercat-can/node_master.hpp"
#include "hal/ethercat-can/pdo_layout.hpp"

namespace tandem::hal::can {
namespace {

/// Time for one SDO exchange of every node is kept free so often.
constexpr double kSdoEveryNs = 100e6;
constexpr std::int64_t kMostPeriodNs = 100'000'000;  ///< that a remedy proposes

using Kind = BusLoadRow::Kind;
using Nodes = std::vector<const NodePlan*>;

constexpr std::int64_t kEthernetRate = 100'000'000;
/// Bytes beside a frame's data: preamble, addresses, type, header, a datagram's 12, check sum, gap.
constexpr double kFrameOverhead = 8 + 14 + 2 + 12 + 4 + 12;
constexpr double kDataPerFrame = 1400.0;  ///< of process data
constexpr double kLeastData = 32.0;       ///< the shortest frame has 64 bytes

FrameBits worst_of(std::size_t bytes) {
  const int length = canopen::frame_length(bytes);
  return worst_frame_bits(length, bytes > canopen::kClassicFrameBytes);
}

/// Adds frames up to a row, and rows up to a bus.
class Sum {
 public:
  Sum(const BusConfig& bus, std::int64_t period_ns) {
    load_.bus = bus.name;
    load_.kind = bus.kind;
    load_.fd = bus.fd;
    load_.rates = {.nominal = bus.bitrate, .data = bus.data_bitrate};
    if (bus.kind == BusKind::kEthercat) load_.rates = {kEthernetRate, kEthernetRate};
    load_.period_ns = period_ns;
    load_.max_load = bus.max_load;
  }
  /// @param per_cycle  of such frames, mean
  void frame(std::size_t bytes, double per_cycle) {
    const FrameBits bits = worst_of(bytes);
    row_.frames += per_cycle;
    row_.bits += per_cycle * (bits.nominal + bits.data);
    row_.time_us += per_cycle * static_cast<double>(duration_ns(bits, load_.rates)) * 1e-3;
  }
  /// Bytes in datagrams of EtherCAT frames.
  void ethernet(std::size_t bytes, double per_cycle) {
    const double frames = std::ceil(static_cast<double>(bytes) / kDataPerFrame);
    const double all = std::max(static_cast<double>(bytes), kLeastData) + frames * kFrameOverhead;
    row_.frames += per_cycle * frames;
    row_.bits += per_cycle * 8.0 * all;
    row_.time_us += per_cycle * 8.0 * all * 1e6 / kEthernetRate;
  }
  void row(std::string what, Kind kind) {
    row_.what = std::move(what);
    row_.kind = kind;
    if (row_.frames > 0.0) load_.rows.push_back(row_);
    const double share = row_.time_us / load_.period_us();
    if (kind == Kind::kUrgent) load_.urgent_us += row_.time_us;
    if (kind != Kind::kOnChange) load_.load += share;
    load_.most_load += share;
    row_ = {};
  }
  void pdos(const Nodes& nodes, PdoGroup group, std::string what, Kind kind) {
    for (const NodePlan* node : nodes) {
      for (const PdoPlan& pdo : node->pdos) {
        if (pdo.group == group) frame(pdo.bytes, 1.0 / pdo.transmission);
      }
    }
    row(std::move(what), kind);
  }
  [[nodiscard]] const BusLoad& load() const { return load_; }

 private:
  BusLoad load_;
  BusLoadRow row_;
};

/// A cycle's process data both ways, then the outputs by themselves.
BusLoad load_of_line(const BusConfig& bus, const Nodes& nodes, std::int64_t period_ns) {
  std::size_t outputs = 0;
  std::size_t inputs = 0;
  for (const NodePlan* node : nodes) {
    for (const PdoPlan& pdo : node->pdos) {
      const bool receive = pdo.direction == canopen::PdoDirection::kReceive;
      (receive ? outputs : inputs) += wire_bytes(pdo);
    }
  }
  constexpr std::size_t kStateAndClock = 12 + 2 + 12 + 8;
  constexpr std::size_t kMessage = 128 + 12;
  Sum sum(bus, period_ns);
  sum.ethernet(outputs + inputs + kStateAndClock, 1.0);
  sum.row("process data", Kind::kUrgent);
  sum.ethernet(outputs, 1.0);
  sum.row("outputs", Kind::kUrgent);
  sum.ethernet(nodes.size() * kMessage, static_cast<double>(period_ns) / kSdoEveryNs);
  sum.row("messages, reserved", Kind::kMean);
  return sum.load();
}

BusLoad load_of(const BusConfig& bus, const Nodes& nodes, std::int64_t period_ns) {
  if (bus.kind == BusKind::kEthercat) return load_of_line(bus, nodes, period_ns);
  Sum sum(bus, period_ns);
  sum.frame(0, 1.0);
  sum.row("SYNC", Kind::kUrgent);
  sum.pdos(nodes, PdoGroup::kCommand, "commands", Kind::kUrgent);
  sum.pdos(nodes, PdoGroup::kFeedback, "feedback", Kind::kUrgent);
  sum.pdos(nodes, PdoGroup::kSensor, "sensors", Kind::kUrgent);
  sum.pdos(nodes, PdoGroup::kSlowFeedback, "slow feedback", Kind::kMean);
  const double period_ms = static_cast<double>(period_ns) * 1e-6;
  int shortest_ms = 0;
  for (const NodePlan* node : nodes) {
    sum.frame(1, period_ms / node->heartbeat_ms);
    shortest_ms = shortest_ms == 0 ? node->heartbeat_ms : std::min(shortest_ms, node->heartbeat_ms);
  }
  if (shortest_ms > 0) sum.frame(1, period_ms / shortest_ms);
  sum.row("heartbeats", Kind::kMean);
  // Every node's exchange within the time that the master waits for an answer.
  const double exchanges = static_cast<double>(period_ns) / kSdoEveryNs;
  for (std::size_t n = 0; n < nodes.size(); ++n) sum.frame(8, 2.0 * exchanges);
  sum.row("SDO, reserved", Kind::kMean);
  sum.pdos(nodes, PdoGroup::kSlowCommand, "slow commands", Kind::kOnChange);
  return sum.load();
}

Nodes nodes_of(const PdoLayout& layout, std::size_t bus) {
  Nodes nodes;
  for (const NodePlan& node : layout.nodes) {
    if (node.bus == bus) nodes.push_back(&node);
  }
  return nodes;
}

/// What the boards' control periods all divide; periods of a loop are its multiples, when they are
/// longer than these.
std::int64_t common_control_period(const RobotConfig& robot) {
  std::int64_t common_ns = 1;
  for (const BoardConfig& board : robot.boards) {
    common_ns = std::lcm(common_ns, board.control_period_ns);
    if (common_ns > kMostPeriodNs) break;
  }
  return common_ns;
}

/// The shortest longer period, in steps of 50 us up to 100 ms, that goes with every board's control
/// period.
std::optional<std::int64_t> feasible_period(const RobotConfig& robot, const BusConfig& bus,
                                            const Nodes& nodes, std::int64_t period_ns) {
  constexpr std::int64_t kStepNs = 50'000;
  const std::int64_t common_ns = common_control_period(robot);
  if (common_ns > kMostPeriodNs) return {};
  const std::int64_t step_ns = std::gcd(common_ns, kStepNs) < kStepNs ? common_ns : kStepNs;
  const auto goes_with = [&](std::int64_t ns) {
    return std::ranges::all_of(robot.boards, [&](const BoardConfig& board) {
      return ns % board.control_period_ns == 0 || board.control_period_ns % ns == 0;
    });
  };
  for (std::int64_t ns = (period_ns / step_ns + 1) * step_ns; ns <= kMostPeriodNs; ns += step_ns) {
    if (goes_with(ns) && load_of(bus, nodes, ns).fits()) return ns;
  }
  return {};
}

std::string period_text(const RobotConfig& robot, std::int64_t period_ns) {
  const std::int64_t common_ns = common_control_period(robot);
  return fmt::format("period_ns = {}", period_ns) +
         (period_ns % common_ns == 0 ? fmt::format(" or a longer multiple of {}", common_ns) : "");
}

/// The lowest higher data bit rate that transceivers are sold for.
std::optional<std::int64_t> feasible_data_rate(BusConfig bus, const Nodes& nodes,
                                               std::int64_t period_ns) {
  for (const std::int64_t rate : {2'000'000, 4'000'000, 5'000'000, 8'000'000}) {
    if (bus.kind != BusKind::kCan || !bus.fd || rate <= bus.data_bitrate) continue;
    bus.data_bitrate = rate;
    if (load_of(bus, nodes, period_ns).fits()) return rate;
  }
  return {};
}

/// Whether the same nodes would do on CAN FD: their PDOs are laid out anew.
bool feasible_as_fd(const RobotConfig& robot, std::size_t index, std::int64_t period_ns) {
  if (robot.buses[index].fd || robot.buses[index].kind != BusKind::kCan) return false;
  RobotConfig other = robot;
  other.buses[index].fd = true;
  const auto layout = make_pdo_layout(other);
  return layout && load_of(other.buses[index], nodes_of(*layout, index), period_ns).fits();
}

/// First fit in the configuration's order. @return the nodes of each bus; empty when one node
/// alone is too much.
std::vector<Nodes> spread(const BusConfig& bus, const Nodes& nodes, std::int64_t period_ns) {
  std::vector<Nodes> buses;
  for (const NodePlan* node : nodes) {
    const auto takes = [&](const Nodes& on) {
      Nodes with = on;
      with.push_back(node);
      return load_of(bus, with, period_ns).fits();
    };
    const auto found = std::ranges::find_if(buses, takes);
    if (found != buses.end()) {
      found->push_back(node);
    } else if (takes({})) {
      buses.push_back({node});
    } else {
      return {};
    }
  }
  return buses;
}

std::string spread_text(const std::vector<Nodes>& buses) {
  std::string text = fmt::format("{} buses:", buses.size());
  for (const Nodes& bus : buses) {
    for (const NodePlan* node : bus) text += (node == bus.front() ? " (" : ", ") + node->name;
    text += ")";
  }
  return text;
}

std::string remedy_of(const RobotConfig& robot, std::size_t index, const Nodes& nodes,
                      std::int64_t period_ns) {
  const BusConfig& bus = robot.buses[index];
  std::vector<std::string> ways;
  if (const auto ns = feasible_period(robot, bus, nodes, period_ns)) {
    ways.push_back(period_text(robot, *ns));
  }
  if (const auto rate = feasible_data_rate(bus, nodes, period_ns)) {
    ways.push_back(fmt::format("data_bitrate = {}", *rate));
  }
  if (feasible_as_fd(robot, index, period_ns)) ways.emplace_back("fd = true");
  if (const auto buses = spread(bus, nodes, period_ns); buses.size() > 1) {
    ways.push_back(spread_text(buses));
  }
  return ways.empty() ? "no period up to 100 ms would do: move boards to other buses"
                      : fmt::format("any of these fits: {}", fmt::join(ways, "; "));
}

std::string rates_text(const BusLoad& load) {
  const double nominal = static_cast<double>(load.rates.nominal) * 1e-6;
  const double data = static_cast<double>(load.rates.data) * 1e-6;
  const bool two = load.kind == BusKind::kCan && load.fd;
  return fmt::format("{} {:g}{} Mbit/s", wire_name(load.kind, load.fd), nominal,
                     two ? fmt::format("/{:g}", data) : "");
}

/// "SYNC 55 + commands 540 + … = 1130 us of 1000 us".
std::string arithmetic(const BusLoad& load, bool urgent_only) {
  std::vector<std::string> terms;
  for (const BusLoadRow& row : load.rows) {
    if (row.kind == Kind::kOnChange || (urgent_only && row.kind != Kind::kUrgent)) continue;
    terms.push_back(fmt::format("{} {:.1f}", row.what, row.time_us));
  }
  const double sum_us = urgent_only ? load.urgent_us : load.load * load.period_us();
  return fmt::format("{} = {:.1f} us of {:g} us", fmt::join(terms, " + "), sum_us,
                     load.period_us());
}

}  // namespace

std::string wire_name(BusKind kind, bool fd) {
  if (kind == BusKind::kEthercat) return "EtherCAT";
  return fd ? "CAN FD" : "classic CAN";
}

Result<std::vector<BusLoad>> bus_loads(const RobotConfig& robot, std::int64_t period_ns) {
  const auto layout = make_pdo_layout(robot);
  if (!layout) return std::unexpected(layout.error());
  std::vector<BusLoad> loads;
  for (std::size_t b = 0; b < robot.buses.size(); ++b) {
    const Nodes nodes = nodes_of(*layout, b);
    loads.push_back(load_of(robot.buses[b], nodes, period_ns));
    if (!loads.back().fits()) loads.back().remedy = remedy_of(robot, b, nodes, period_ns);
  }
  return loads;
}

Diagnostics check_bus_load(const RobotConfig& robot, std::int64_t period_ns) {
  const auto loads = bus_loads(robot, period_ns);
  if (!loads) return {loads.error()};
  Diagnostics errors;
  for (std::size_t b = 0; b < loads->size(); ++b) {
    const BusLoad& load = (*loads)[b];
    if (load.fits()) continue;
    const bool urgent = load.urgent_us > load.period_us();
    errors.push_back(
        {.message = fmt::format("{} cannot carry {}: {}{}", rates_text(load),
                                urgent ? "what every cycle needs" : "its mean load",
                                arithmetic(load, urgent),
                                urgent ? ""
                                       : fmt::format(", {:.1f} % with at most {:g} %",
                                                     100.0 * load.load, 100.0 * load.max_load)),
         .hint = load.remedy,
         .file = robot.file,
         .line = robot.buses[b].line,
         .key = "bus '" + load.bus + "'"});
  }
  return errors;
}

}  // namespace tandem::hal::can
