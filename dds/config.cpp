// [dds] read strictly, and turned into Cyclone DDS' XML configuration.
#include "dds/config.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <filesystem>

#include "base/quoting.hpp"
#include "base/utf8.hpp"
#include "dds/ports.hpp"

namespace tandem::dds {
namespace {

// A key a line.
// clang-format off
constexpr Key<Config> kKeys[] = {
  key<&Config::enabled>("enabled", "`--dds` and `--no-dds` override it").by_default("`true`"),
  key<&Config::domain>("domain", {0, kLastDomain}, "DDS domain. `--domain` overrides it").by_default("`ROS_DOMAIN_ID`, else 0"),
  key<&Config::name_space>("namespace", "before the names of topics and services").by_default("none").within("`\"left\"`, `\"robots/left\"`"),
  key<&Config::interfaces>("interfaces", "network interfaces; with `lo` alone nothing leaves this machine").by_default("`[\"lo\"]`").within("names or addresses"),
  key<&Config::peers>("peers", "where to look for others, beside multicast").by_default("`[]`").within("addresses"),
};
// clang-format on

/// What is larger is not received: a peer must not have this process allocate without limit.
constexpr const char* kMostSampleBytes = "16 MiB";

constexpr std::size_t kLongestWord = 200;  // of a name space or address: topics have 255 in all

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

bool is_address(std::string_view text) {
  return !text.empty() && text.size() <= kLongestWord && std::ranges::all_of(text, [](char c) {
    return is_letter(c) || is_digit(c) || std::string_view("_.:%-").contains(c);
  });
}

/// "left", "robots/left": a letter first in each part.
bool is_name_space(std::string_view text) {
  char before = '/';
  for (const char c : text) {
    const bool fits =
        before == '/' ? is_letter(c) : is_letter(c) || is_digit(c) || c == '_' || c == '/';
    if (!fits) return false;
    before = c;
  }
  return before != '/' && text.size() <= kLongestWord;
}

void check_all(TomlTable& table, const std::string& key, const std::vector<std::string>& texts,
               bool (*is_one)(std::string_view), const std::string& hint) {
  for (const std::string& text : texts) {
    if (!is_one(text))
      table.error(key, "'" + std::string(whole_characters(text, kLongestWord)) + "' is none", hint);
  }
}

std::string resolved(const std::string& folder, const std::string& file) {
  return (std::filesystem::path(folder) / file).lexically_normal().string();
}

SecurityConfig read_security(TomlTable table, const std::string& folder) {
  const auto file = [&](const char* key) {
    std::string path = resolved(folder, table.text(key));
    if (table.has(key) && !std::filesystem::is_regular_file(path)) {
      table.error(key, "there is no file " + path, "docs/ros2.md says how to make them");
    }
    return path;
  };
  SecurityConfig security{.identity_ca = file("identity_ca"),
                          .identity_certificate = file("identity_certificate"),
                          .private_key = file("private_key"),
                          .permissions_ca = file("permissions_ca"),
                          .governance = file("governance"),
                          .permissions = file("permissions")};
  table.finish();
  return security;
}

void read_every(TomlTable table, Config& config) {
  for (std::size_t i = 0; i < kTopicPeriods.size(); ++i) {
    const std::string_view key = kTopicPeriods[i].key;
    const std::int64_t cycles = table.integer_or(key, -1, 0, 1'000'000);  // -1: it is not there
    if (cycles >= 0) config.every[i] = static_cast<std::uint64_t>(cycles);
  }
  table.finish();
}

#ifdef TANDEM_DDS_SECURITY_FOLDER
constexpr std::string_view kPluginFolder = TANDEM_DDS_SECURITY_FOLDER;
#else
constexpr std::string_view kPluginFolder = "";
#endif

/// @param name      of the library: "auth"
/// @param function  what its entry points end with: "authentication"
std::string plugin_xml(std::string_view name, std::string_view function) {
  const std::string path = kPluginFolder.empty()
                               ? fmt::format("dds_security_{}", name)
                               : fmt::format("{}/libdds_security_{}.so", kPluginFolder, name);
  return fmt::format(
      R"(<Library path="{}" initFunction="init_{}" finalizeFunction="finalize_{}"/>)", path,
      function, function);
}

std::string security_xml(const SecurityConfig& s) {
  return fmt::format(
      R"(<Security>
  <Authentication>
    {}
    <IdentityCA>file:{}</IdentityCA>
    <IdentityCertificate>file:{}</IdentityCertificate>
    <PrivateKey>file:{}</PrivateKey>
  </Authentication>
  <AccessControl>
    {}
    <PermissionsCA>file:{}</PermissionsCA>
    <Governance>file:{}</Governance>
    <Permissions>file:{}</Permissions>
  </AccessControl>
  <Cryptographic>{}</Cryptographic>
</Security>
)",
      plugin_xml("auth", "authentication"), xml_text(s.identity_ca),
      xml_text(s.identity_certificate), xml_text(s.private_key), plugin_xml("ac", "access_control"),
      xml_text(s.permissions_ca), xml_text(s.governance), xml_text(s.permissions),
      plugin_xml("crypto", "crypto"));
}

}  // namespace

Config read_config(TomlTable table, const std::string& folder) {
  Config config;
  config.enabled = true;
  config.domain_given = table.has("domain");
  read_keys(table, kKeys, config);
  if (!config.name_space.empty()) {
    check_all(table, "namespace", {config.name_space}, &is_name_space,
              "letters, digits and _, in parts with / between: \"left\", \"robots/left\"");
  }
  if (config.interfaces.empty()) {
    table.error("interfaces", "is empty", "[\"lo\"] keeps all on this machine");
  }
  check_all(table, "interfaces", config.interfaces, &is_address, "`ip link` lists the interfaces");
  check_all(table, "peers", config.peers, &is_address, "addresses: \"192.168.1.20\"");
  if (table.has("security")) config.security = read_security(table.table("security"), folder);
  read_every(table.table_or_empty("every"), config);
  table.finish();
  return config;
}

Result<int> environment_domain() {
  const char* given = std::getenv("ROS_DOMAIN_ID");
  if (given == nullptr || *given == 0) return 0;
  const std::string_view text = given;
  int domain = -1;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), domain);
  if (error == std::errc() && end == text.data() + text.size() && domain >= 0 &&
      domain <= kLastDomain)
    return domain;
  return fail(fmt::format("ROS_DOMAIN_ID='{}' is no DDS domain", shown(text)),
              fmt::format("0 to {}; or name the domain with --domain", kLastDomain));
}

void describe_keys(KeyPage& page) { page.add("[dds]", kKeys); }

std::uint64_t Config::cycles_between(Topic topic, std::int64_t period_ns) const {
  const auto index = static_cast<std::size_t>(topic);
  if (every[index]) return *every[index];
  const std::int64_t wanted = kTopicPeriods[index].default_ns;
  if (wanted == 0) return 0;
  return static_cast<std::uint64_t>(std::max<std::int64_t>(1, wanted / period_ns));
}

/// On the loopback interface there is no multicast: others are looked for at its address.
std::string to_xml(const Config& config, bool any_ports) {
  std::string interfaces, peers;
  for (const std::string& name : config.interfaces) {
    const bool multicast = name != "lo";
    interfaces += fmt::format("<NetworkInterface name=\"{}\" multicast=\"{}\"/>", xml_text(name),
                              multicast ? "default" : "false");
  }
  std::vector<std::string> addresses = config.peers;
  if (std::ranges::find(config.interfaces, "lo") != config.interfaces.end()) {
    addresses.insert(addresses.begin(), "127.0.0.1");
  }
  for (const std::string& peer : addresses) {
    peers += fmt::format("<Peer Address=\"{}\"/>", xml_text(peer));
  }
  return fmt::format(
      R"(<CycloneDDS><Domain>
<General>
  <Interfaces>{}</Interfaces>
  <AllowMulticast>{}</AllowMulticast>
</General>
<Discovery>
  <ParticipantIndex>{}</ParticipantIndex>
  <MaxAutoParticipantIndex>{}</MaxAutoParticipantIndex>
  <Peers>{}</Peers>
</Discovery>
<Internal><MaxSampleSize>{}</MaxSampleSize>{}</Internal>
{}</Domain></CycloneDDS>
)",
      interfaces, config.loopback_only() ? "false" : "spdp", any_ports ? "none" : "auto",
      kMostParticipants - 1, peers, kMostSampleBytes,
      config.lost_per_mille == 0
          ? ""
          : fmt::format("<Test><XmitLossiness>{}</XmitLossiness></Test>", config.lost_per_mille),
      config.security.on() ? security_xml(config.security) : "");
}

}  // namespace tandem::dds
