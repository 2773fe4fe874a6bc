// The doctor's look at the CAN and EtherCAT interfaces of a robot.
#include <fmt/core.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "apps/machine/doctor.hpp"

namespace tandem::apps {
namespace {

using Link = nlohmann::json;

constexpr int kClassicMtu = 16, kFdMtu = 72;

/// One bus of robot.toml, and what of the network belongs to it.
struct Bus {
  const hal::BusConfig& config;
  std::size_t nodes;  ///< boards and sensors on it
  const Link& link;

  [[nodiscard]] std::string kind() const {
    return link.value("/linkinfo/info_kind"_json_pointer, std::string("?"));
  }
  /// A number of `info_data`; 0 when it is not given.
  [[nodiscard]] std::int64_t number(const char* pointer) const {
    return link.value(Link::json_pointer(std::string("/linkinfo/info_data") + pointer),
                      std::int64_t{0});
  }
  [[nodiscard]] bool up() const {
    const Link flags = link.value("flags", Link::array());
    return std::ranges::find(flags, "UP") != flags.end();
  }
  [[nodiscard]] std::string name(const char* what) const {
    return fmt::format("{} {}", config.interface, what);
  }
};

/// Takes the interface down for a change, and up again.
std::string change(const Bus& bus, const std::string& words) {
  return fmt::format("ip link set {0} down; ip link set {0} {1}; ip link set {0} up",
                     bus.config.interface, words);
}

/// The words of `ip link set … type can` for robot.toml's rates.
std::string type_words(const hal::BusConfig& config) {
  std::string words = fmt::format("type can bitrate {} restart-ms 100", config.bitrate);
  if (config.fd) words += fmt::format(" dbitrate {} fd on", config.data_bitrate);
  return words;
}

void examine_state(const Bus& bus, std::vector<Finding>& out) {
  const std::string state = bus.link.value("/linkinfo/info_data/state"_json_pointer, std::string());
  const std::string value = (bus.up() ? "up" : "down") + (state.empty() ? "" : ", " + state);
  Finding finding{bus.name("state"), Health::kOk, value, {}, {}};
  if (!bus.up()) {
    finding.health = Health::kMissing;
    finding.why = "no frame can be sent";
    finding.mend = fmt::format("ip link set {} up", bus.config.interface);
  } else if (state == "BUS-OFF" || state == "STOPPED") {
    finding.health = Health::kMissing;
    finding.why = "wiring, termination or bit rate; no frame can be sent";
    finding.mend = fmt::format("ip link set {} type can restart", bus.config.interface);
  } else if (state == "ERROR-PASSIVE" || state == "ERROR-WARNING") {
    finding.health = Health::kWarning;
    finding.why = "many frames were damaged: wiring, termination, bit rate, a lonely node";
    finding.mend = fmt::format("candump -e {},0:0,#FFFFFFFF", bus.config.interface);
  }
  out.push_back(std::move(finding));
}

void examine_mtu(const Bus& bus, std::vector<Finding>& out) {
  const int mtu = bus.link.value("mtu", 0);
  Finding finding{
      bus.name("frames"), Health::kOk, mtu >= kFdMtu ? "CAN FD" : "classic CAN", {}, {}};
  if (bus.config.fd && mtu < kFdMtu) {
    finding.health = Health::kMissing;
    finding.why = fmt::format("robot.toml has CAN FD on bus {}", bus.config.name);
    finding.mend =
        change(bus, bus.kind() == "can" ? type_words(bus.config) : fmt::format("mtu {}", kFdMtu));
  } else if (mtu < kClassicMtu) {
    finding.health = Health::kMissing;
    finding.why = "it carries no CAN frames";
  }
  out.push_back(std::move(finding));
}

void examine_queue(const Bus& bus, std::vector<Finding>& out) {
  // In one cycle go out: SYNC, two RPDOs per node, a heartbeat, an SDO request per node.
  const auto wanted = static_cast<int>(3 * bus.nodes + 2);
  const int length = bus.link.value("txqlen", 0);
  Finding finding{bus.name("queue"), Health::kOk, fmt::format("{} frames", length), {}, {}};
  if (length < wanted) {
    finding.health = Health::kWarning;
    finding.why = fmt::format("a cycle can send {} frames at once; more are dropped", wanted);
    finding.mend =
        fmt::format("ip link set {} txqueuelen {}", bus.config.interface, std::max(100, wanted));
  }
  out.push_back(std::move(finding));
}

void examine_rate(const Bus& bus, const char* what, const char* pointer, std::int64_t wanted,
                  std::vector<Finding>& out) {
  const std::int64_t rate = bus.number(pointer);
  Finding finding{bus.name(what), Health::kOk, fmt::format("{} bit/s", rate), {}, {}};
  if (rate != wanted) {
    finding.health = Health::kMissing;
    finding.value = rate == 0 ? "not set" : finding.value;
    finding.why = fmt::format("robot.toml has {} bit/s on bus {}", wanted, bus.config.name);
    finding.mend = change(bus, type_words(bus.config));
  }
  out.push_back(std::move(finding));
}

void examine_restart(const Bus& bus, std::vector<Finding>& out) {
  const std::int64_t restart_ms = bus.number("/restart_ms");
  Finding finding{bus.name("restart"), Health::kOk, fmt::format("after {} ms", restart_ms), {}, {}};
  if (restart_ms == 0) {
    finding.health = Health::kWarning;
    finding.value = "by hand";
    finding.why = "after bus-off the interface stays silent";
    finding.mend = change(bus, "type can restart-ms 100");
  }
  out.push_back(std::move(finding));
}

void examine(const Bus& bus, std::vector<Finding>& out) {
  const std::string kind = bus.kind();
  Finding type{bus.name("type"), Health::kOk, kind, {}, {}};
  if (bus.link.value("link_type", std::string()) != "can") {
    type.health = Health::kMissing;
    type.why = "it is no CAN interface";
    type.mend = "give bus '" + bus.config.name + "' another interface in robot.toml";
    out.push_back(std::move(type));
    return;
  }
  if (kind == "vcan" || kind == "vxcan") {
    type.value += ": virtual, no bit rate";
  }
  out.push_back(std::move(type));
  examine_state(bus, out);
  examine_mtu(bus, out);
  examine_queue(bus, out);
  if (kind != "can") return;
  examine_rate(bus, "bit rate", "/bittiming/bitrate", bus.config.bitrate, out);
  if (bus.config.fd) {
    examine_rate(bus, "data rate", "/data_bittiming/bitrate", bus.config.data_bitrate, out);
  }
  examine_restart(bus, out);
}

/// A network interface that carries the frames of a line, and nothing else.
void examine_line(const Machine& machine, const Bus& bus, std::vector<Finding>& out) {
  const std::string& interface = bus.config.interface;
  const std::string type = bus.link.value("link_type", std::string("?"));
  if (type != "ether") {
    out.push_back({bus.name("type"), Health::kMissing, type, "it is no Ethernet interface",
                   "give bus '" + bus.config.name + "' another interface in robot.toml"});
    return;
  }
  out.push_back({bus.name("type"), Health::kOk, "Ethernet", {}, {}});
  const std::string state = bus.link.value("operstate", std::string("?"));
  Finding link{bus.name("link"), Health::kOk, state == "UP" ? "up" : state, {}, {}};
  if (!bus.up()) {
    link = {link.name, Health::kMissing, "down", "no frame can be sent",
            fmt::format("ip link set {} up", interface)};
  } else if (state != "UP" && state != "UNKNOWN") {
    link.health = Health::kMissing;
    link.why = "no slave is at the other end of the cable, or it has no power";
    link.mend = "look at the cable to the first slave";
  }
  out.push_back(std::move(link));
  constexpr int kEthernetMtu = 1500;
  const int mtu = bus.link.value("mtu", 0);
  if (mtu < kEthernetMtu) {
    out.push_back({bus.name("frames"), Health::kMissing, fmt::format("{} bytes", mtu),
                   "a frame of process data may have 1500",
                   fmt::format("ip link set {} mtu {}", interface, kEthernetMtu)});
  }
  constexpr unsigned kCapNetRaw = 13;
  if (!machine.has_capability(kCapNetRaw)) {
    out.push_back({bus.name("permission"), Health::kMissing, "none", "raw frames need CAP_NET_RAW",
                   "setcap cap_net_raw+ep $(command -v tandem), or run as root"});
  }
}

std::size_t nodes_of(const hal::RobotConfig& robot, const std::string& bus) {
  const auto on_bus = [&bus](const auto& node) { return node.bus == bus; };
  return static_cast<std::size_t>(std::ranges::count_if(robot.boards, on_bus) +
                                  std::ranges::count_if(robot.sensors, on_bus));
}

}  // namespace

std::vector<Finding> examine_interfaces(const Machine& machine, const hal::RobotConfig& robot) {
  const Link links = Link::parse(machine.interfaces(), nullptr, false);
  if (!links.is_array()) {
    return {{"CAN interfaces", Health::kWarning, "unknown", "`ip` says nothing of them",
             "apt-get install iproute2"}};
  }
  std::vector<Finding> findings;
  for (const hal::BusConfig& config : robot.buses) {
    const auto link = std::ranges::find_if(links, [&config](const Link& one) {
      return one.value("ifname", std::string()) == config.interface;
    });
    if (link == links.end()) {
      const bool line = config.kind == hal::BusKind::kEthercat;
      if (line) {
        findings.push_back({config.interface, Health::kMissing, "no such interface",
                            fmt::format("bus {} of robot.toml names it", config.name),
                            "name the machine's, which `ip link` lists, in robot.toml or by "
                            "--interface"});
        continue;
      }
      findings.push_back(
          {config.interface, Health::kMissing, "no such interface",
           fmt::format("bus {} of robot.toml names it", config.name),
           fmt::format("ip link set {0} {1}; ip link set {0} up   (virtual: ip link add {0} type "
                       "vcan; ip link set {0} mtu 72 up)",
                       config.interface, type_words(config))});
      continue;
    }
    const Bus bus{config, nodes_of(robot, config.name), *link};
    if (config.kind == hal::BusKind::kEthercat) {
      examine_line(machine, bus, findings);
    } else {
      examine(bus, findings);
    }
  }
  return findings;
}

}  // namespace tandem::apps
