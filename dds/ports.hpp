// The UDP ports that participants of a domain take on a machine, which every user may take.
// Layer: dds.  Thread: any, non-RT.
#pragma once

#include <string>

namespace tandem::dds {

/// Participants of one domain on one machine that find each other without multicast.
inline constexpr int kMostParticipants = 120;

/// Whether a participant of `domain` still finds its two ports on this machine (RTPS 9.6.1).
[[nodiscard]] bool has_free_ports(int domain);

/// "user 1000 (238), user 0 (2)": who has how many of the domain's ports, those of discovery by
/// multicast among them, by a table like /proc/net/udp. Empty: nobody.
[[nodiscard]] std::string port_holders(const std::string& table, int domain);
/// By the kernel's tables.
[[nodiscard]] std::string port_holders(int domain);

}  // namespace tandem::dds
