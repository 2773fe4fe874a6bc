// Tries the ports of every participant, and counts the users of those that are taken.
#include "dds/ports.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <map>
#include <sstream>
#include <utility>
#include <vector>

namespace tandem::dds {
namespace {

constexpr int kBase = 7400, kPerDomain = 250, kFirst = 10, kEach = 2, kLast = 65535;

bool is_free(int port) {
  const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (socket < 0) return true;  // that is another trouble
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_ANY);
  const bool free =
      ::bind(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  ::close(socket);
  return free;
}

/// A file of the kernel's; empty where there is none.
std::string text_of(const char* file) {
  std::string text;
  const int descriptor = ::open(file, O_RDONLY | O_CLOEXEC);
  std::array<char, 4096> part{};
  for (ssize_t count = 1; descriptor >= 0 && count > 0;) {
    count = ::read(descriptor, part.data(), part.size());
    if (count > 0) text.append(part.data(), static_cast<std::size_t>(count));
  }
  if (descriptor >= 0) ::close(descriptor);
  return text;
}

}  // namespace

bool has_free_ports(int domain) {
  for (int i = 0; i < kMostParticipants; ++i) {
    const int port = kBase + kPerDomain * domain + kFirst + kEach * i;
    if (port + 1 > kLast) return false;
    if (is_free(port) && is_free(port + 1)) return true;
  }
  return false;
}

std::string port_holders(const std::string& table, int domain) {
  const long first = kBase + kPerDomain * domain;
  std::map<std::string, int> counts;  // by user
  std::istringstream lines(table);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream fields(line);
    std::string number, local, remote, state, queues, timer, retransmits, user;
    fields >> number >> local >> remote >> state >> queues >> timer >> retransmits >> user;
    const std::size_t colon = local.find(':');
    if (!fields || colon == std::string::npos) continue;
    const long port = std::strtol(local.c_str() + colon + 1, nullptr, 16);
    if (port >= first && port < first + kFirst + kEach * kMostParticipants) ++counts[user];
  }
  std::vector<std::pair<std::string, int>> users(counts.begin(), counts.end());
  std::ranges::stable_sort(users, std::greater{}, &std::pair<std::string, int>::second);
  std::string text;
  for (const auto& [user, count] : users) {
    text += fmt::format("{}user {} ({})", text.empty() ? "" : ", ", user, count);
  }
  return text;
}

std::string port_holders(int domain) {
  return port_holders(text_of("/proc/net/udp") + text_of("/proc/net/udp6"), domain);
}

}  // namespace tandem::dds
