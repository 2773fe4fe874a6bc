// Where and with whom a process talks DDS, as the [dds] table has it.
// Plain data. docs/configuration.md documents each key.
// Layer: dds.  Thread: non-RT only.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/keys.hpp"
#include "base/result.hpp"

namespace tandem::dds {

/// [dds.security]: files of DDS Security 1.1, paths relative to the TOML's folder. All or none.
struct SecurityConfig {
  std::string identity_ca;           ///< PEM: certificate of who vouches for identities
  std::string identity_certificate;  ///< PEM: this process'
  std::string private_key;           ///< PEM
  std::string permissions_ca;        ///< PEM: certificate of who signed the next two
  std::string governance;            ///< S/MIME
  std::string permissions;           ///< S/MIME

  [[nodiscard]] bool on() const { return !identity_ca.empty(); }
};

/// The topics whose rate can be chosen.
enum class Topic : std::uint8_t {
  kJointStates,
  kDynamicJointStates,
  kImu,
  kWrench,
  kClock,
  kTf,
  kOdom,
  kDiagnostics,
  kState,
  kCommand,
  kStatistics,
  kParallel,  ///< of the robot beside this one, when there is one
  kSignals,   ///< of every controller that declares some
  kMarks,     ///< the same
  kIntrospection,
};
struct TopicPeriod {
  std::string_view key;     ///< of [dds.every]
  std::int64_t default_ns;  ///< between two samples, unless the key says otherwise; 0: none
};
inline constexpr std::array<TopicPeriod, 15> kTopicPeriods{{
    {"joint_states", 10'000'000},
    {"dynamic_joint_states", 0},
    {"imu", 10'000'000},
    {"wrench", 10'000'000},
    {"clock", 10'000'000},
    {"tf", 20'000'000},
    {"odom", 20'000'000},
    {"diagnostics", 1'000'000'000},
    {"state", 10'000'000},
    {"command", 10'000'000},
    {"statistics", 1'000'000'000},
    {"parallel", 10'000'000},
    {"signals", 10'000'000},
    {"marks", 20'000'000},
    {"introspection", 10'000'000},
}};

/// [dds]
struct Config {
  bool enabled = false;                       ///< the table is there, or --dds was given
  int domain = 0;                             ///< 0 to 232
  bool domain_given = false;                  ///< else it is environment_domain()
  std::string name_space;                     ///< "left": /left/joint_states; empty: none
  std::vector<std::string> interfaces{"lo"};  ///< names or addresses of network interfaces
  std::vector<std::string> peers;             ///< addresses to look for others at, beside multicast
  SecurityConfig security;
  int lost_per_mille = 0;  ///< of the packets that it sends, on purpose: for tests, no key
  /// [dds.every]: cycles of the loop between two samples, 0: none; empty: kTopicPeriods' default.
  std::array<std::optional<std::uint64_t>, kTopicPeriods.size()> every;

  /// A sample of `topic` belongs to every cycle whose number this divides; 0: to none.
  [[nodiscard]] std::uint64_t cycles_between(Topic topic, std::int64_t period_ns) const;

  /// The DDS topic of a ROS 2 topic in the namespace: "joint_states" is "rt/joint_states", or
  /// "rt/left/joint_states".
  [[nodiscard]] std::string topic_name(const std::string& ros_name) const {
    return name_space.empty() ? "rt/" + ros_name : "rt/" + name_space + "/" + ros_name;
  }

  /// Whether nothing leaves this machine.
  [[nodiscard]] bool loopback_only() const {
    return interfaces.size() == 1 && interfaces.front() == "lo";
  }
};

/// The greatest domain: the ports of a greater one would be beyond 65535.
inline constexpr int kLastDomain = 232;

/// ROS_DOMAIN_ID of this process' environment, 0 without it. Error: it is no domain.
[[nodiscard]] Result<int> environment_domain();

/// Reads the table; errors go to its document. An absent table gives the default.
/// @param folder  of the TOML: the security files' paths are relative to it
[[nodiscard]] Config read_config(TomlTable table, const std::string& folder);
/// The keys of [dds], for docs/configuration.md.
void describe_keys(KeyPage& page);

/// Cyclone DDS' configuration of that: XML.
/// @param any_ports  its UDP ports are any that are free, where others do not look for it
[[nodiscard]] std::string to_xml(const Config& config, bool any_ports = false);

}  // namespace tandem::dds
