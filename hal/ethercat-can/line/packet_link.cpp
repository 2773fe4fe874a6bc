// AF_PACKET, bound to one interface and EtherCAT's EtherType; sendmmsg and recvmmsg.
#include "hal/ethercat-can/line/packet_link.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <linux/ethtool.h>
#include <linux/if_packet.h>
#include <linux/sockios.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "base/own_system_call.hpp"

namespace tandem::hal::ecat {

namespace {

constexpr std::size_t kBatch = 32;
constexpr int kQueueBytes = 1 << 20;

std::unexpected<Error> refuse_interface(const std::string& interface, const std::string& what,
                                        const std::string& hint) {
  return fail(fmt::format("EtherCAT interface {}: {}", interface, what), hint);
}

/// Closes what was opened when the rest fails.
struct OpenPacketSocket {
  int descriptor;
  ~OpenPacketSocket() {
    if (descriptor >= 0) ::close(descriptor);
  }
  int release() { return std::exchange(descriptor, -1); }
};

Result<int> make_packet_socket(const std::string& interface) {
  const int made =
      ::socket(AF_PACKET, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, htons(ethercat::kEtherType));
  if (made >= 0) return made;
  if (errno == EPERM || errno == EACCES) {
    return refuse_interface(interface, "no permission to open a raw socket (CAP_NET_RAW)",
                            "run as root, or give the program the capability: "
                            "sudo setcap cap_net_raw+ep …");
  }
  if (errno == EAFNOSUPPORT) {
    return refuse_interface(interface, "this kernel has no packet sockets",
                            "sudo modprobe af_packet, or a kernel with CONFIG_PACKET");
  }
  return refuse_interface(interface, fmt::format("cannot open a socket: {}", std::strerror(errno)),
                          {});
}

/// Whether something answers at the other end of the cable. The driver knows it at once,
/// IFF_RUNNING follows some time later.
bool has_link(ifreq request, int socket) {
  const bool running = (request.ifr_flags & IFF_RUNNING) != 0;
  ethtool_value link{.cmd = ETHTOOL_GLINK, .data = 0};
  request.ifr_data = reinterpret_cast<char*>(&link);
  return ::ioctl(socket, SIOCETHTOOL, &request) == 0 ? link.data != 0 : running;
}

/// The interface's index and address, after it was looked at.
struct Found {
  int index = 0;
  ethercat::MacAddress address{};
};

Result<Found> find_interface(const std::string& interface, int socket) {
  ifreq request{};
  std::copy_n(interface.begin(), std::min<std::size_t>(interface.size(), IFNAMSIZ - 1),
              std::begin(request.ifr_name));
  Found found;
  if (::ioctl(socket, SIOCGIFINDEX, &request) != 0) {
    return refuse_interface(interface, "there is no such interface",
                            "ip -brief link lists the interfaces");
  }
  found.index = request.ifr_ifindex;
  if (::ioctl(socket, SIOCGIFHWADDR, &request) != 0 ||
      request.ifr_hwaddr.sa_family != ARPHRD_ETHER) {
    return refuse_interface(interface, "is no Ethernet interface",
                            "ip -brief link lists the interfaces");
  }
  std::memcpy(found.address.data(), request.ifr_hwaddr.sa_data, found.address.size());
  found.address[0] &= static_cast<std::uint8_t>(~ethercat::kProcessedMark);
  if (::ioctl(socket, SIOCGIFFLAGS, &request) != 0 || (request.ifr_flags & IFF_UP) == 0) {
    return refuse_interface(interface, "is down", fmt::format("sudo ip link set {} up", interface));
  }
  if (!has_link(request, socket)) {
    return refuse_interface(interface, "has no link: nothing answers at the other end of its cable",
                            "plug the cable of the first slave in, and switch the slave on");
  }
  return found;
}

}  // namespace

struct PacketLink::Batch {
  std::array<mmsghdr, kBatch> messages{};
  std::array<iovec, kBatch> parts{};
};

PacketLink::PacketLink(int socket, const ethercat::MacAddress& address)
    : socket_(socket), address_(address), batch_(std::make_unique<Batch>()) {
  for (std::size_t i = 0; i < kBatch; ++i) {
    batch_->messages[i].msg_hdr.msg_iov = &batch_->parts[i];
    batch_->messages[i].msg_hdr.msg_iovlen = 1;
  }
}

PacketLink::~PacketLink() { ::close(socket_); }

Result<std::unique_ptr<PacketLink>> PacketLink::open(const std::string& interface) {
  if (interface.empty() || interface.size() >= IFNAMSIZ) {
    return refuse_interface(interface,
                            fmt::format("an interface's name has 1 to {} characters", IFNAMSIZ - 1),
                            "ip -brief link lists the interfaces");
  }
  const auto made = make_packet_socket(interface);
  if (!made) return std::unexpected(made.error());
  OpenPacketSocket socket{*made};
  const auto found = find_interface(interface, *made);
  if (!found) return std::unexpected(found.error());
  sockaddr_ll address{};
  address.sll_family = AF_PACKET;
  address.sll_protocol = htons(ethercat::kEtherType);
  address.sll_ifindex = found->index;
  if (::bind(*made, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    return refuse_interface(interface, fmt::format("cannot be bound to: {}", std::strerror(errno)),
                            "is it still there? ip -brief link");
  }
  // Larger queues help a loaded machine; without permission for them the system's size does.
  (void)::setsockopt(*made, SOL_SOCKET, SO_RCVBUF, &kQueueBytes, sizeof(kQueueBytes));
  (void)::setsockopt(*made, SOL_SOCKET, SO_SNDBUF, &kQueueBytes, sizeof(kQueueBytes));
  return std::unique_ptr<PacketLink>(new PacketLink(socket.release(), found->address));
}

std::size_t PacketLink::send(std::span<const FrameBuffer> frames) noexcept TANDEM_RT {
  std::size_t done = 0;
  while (done < frames.size()) {
    const std::size_t count = std::min(kBatch, frames.size() - done);
    for (std::size_t i = 0; i < count; ++i) {
      const FrameBuffer& frame = frames[done + i];
      // The kernel only reads them.
      batch_->parts[i] = {const_cast<std::uint8_t*>(frame.bytes.data()), frame.size};
    }
    TANDEM_OWN_SYSTEM_CALL;
    const int sent =
        ::sendmmsg(socket_, batch_->messages.data(), static_cast<unsigned>(count), MSG_DONTWAIT);
    if (sent <= 0) break;
    done += static_cast<std::size_t>(sent);
  }
  statistics_.count_sent(frames.first(done));
  statistics_.refused += frames.size() - done;
  return done;
}

std::size_t PacketLink::receive(std::span<FrameBuffer> frames) noexcept TANDEM_RT {
  std::size_t taken = 0;
  while (taken < frames.size()) {
    const std::size_t count = std::min(kBatch, frames.size() - taken);
    for (std::size_t i = 0; i < count; ++i) {
      FrameBuffer& frame = frames[taken + i];
      batch_->parts[i] = {frame.bytes.data(), frame.bytes.size()};
    }
    TANDEM_OWN_SYSTEM_CALL;
    const int got = ::recvmmsg(socket_, batch_->messages.data(), static_cast<unsigned>(count),
                               MSG_DONTWAIT, nullptr);
    if (got <= 0) break;
    for (std::size_t i = 0; i < static_cast<std::size_t>(got); ++i) {
      frames[taken + i].size = batch_->messages[i].msg_len;
    }
    taken += static_cast<std::size_t>(got);
    if (static_cast<std::size_t>(got) < count) break;
  }
  statistics_.count_received(frames.first(taken));
  return taken;
}

}  // namespace tandem::hal::ecat
