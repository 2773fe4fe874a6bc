// Where and with whom a process talks DDS, as the [dds] table has it.
// Plain data. docs/configuration.md documents each key.
// Layer: dds.  Thread: non-RT only.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "base/toml_reader.hpp"

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

/// [dds]
struct Config {
  bool enabled = false;                       ///< the table is there, or --dds was given
  int domain = 0;                             ///< 0 to 232, ROS_DOMAIN_ID
  std::string name_space;                     ///< "left": /left/joint_states; empty: none
  std::vector<std::string> interfaces{"lo"};  ///< names or addresses of network interfaces
  std::vector<std::string> peers;             ///< addresses to look for others at, beside multicast
  SecurityConfig security;

  /// Whether nothing leaves this machine.
  [[nodiscard]] bool loopback_only() const {
    return interfaces.size() == 1 && interfaces.front() == "lo";
  }
};

/// Reads the table; errors go to its document. An absent table gives the default.
/// @param folder  of the TOML: the security files' paths are relative to it
[[nodiscard]] Config read_config(TomlTable table, const std::string& folder);

/// Cyclone DDS' configuration of that: XML.
[[nodiscard]] std::string to_xml(const Config& config);

}  // namespace tandem::dds
