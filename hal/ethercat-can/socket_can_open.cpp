// Opening a CAN socket, and the texts of what can be wrong with it.
#include <fmt/format.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "canopen/objects.hpp"
#include "hal/ethercat-can/drive_master.hpp"
#include "hal/ethercat-can/socket_can_impl.hpp"

namespace tandem::hal::can {

namespace cob = canopen::cob;

namespace {

/// What the kernel charges a socket for one waiting frame.
constexpr std::size_t kQueuedFrameBytes = 768;
constexpr std::uint32_t kFunctionMask = 0x780;

/// Closes what was opened when the rest fails.
struct OpenSocket {
  int descriptor;
  ~OpenSocket() {
    if (descriptor >= 0) ::close(descriptor);
  }
  int release() { return std::exchange(descriptor, -1); }
};

/// How to set this interface up.
std::string set_up(const SocketCanOptions& options) {
  return fmt::format(
      "sudo ip link set {0} up type can bitrate 1000000{1}; or, without hardware: "
      "sudo ip link add {0} type vcan && sudo ip link set {0} mtu 72 up (docs/can.md)",
      options.interface, options.fd ? " dbitrate 8000000 fd on" : "");
}

std::unexpected<Error> refuse(const SocketCanOptions& options, const std::string& what,
                              const std::string& hint) {
  return fail(fmt::format("CAN interface {}: {}", options.interface, what), hint);
}

Result<int> make_socket(const SocketCanOptions& options) {
  const int made = ::socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
  if (made >= 0) return made;
  switch (errno) {
    case EAFNOSUPPORT:
      return refuse(options, "this kernel has no CAN",
                    "sudo modprobe can_raw; if there is no such module, use a kernel with "
                    "CONFIG_CAN. In process (tandem run without --hal can) no CAN is needed");
    case EPROTONOSUPPORT:
      return refuse(options, "this kernel has no raw CAN sockets", "sudo modprobe can_raw");
    case EPERM:
    case EACCES:
      return refuse(options, "no permission to open a CAN socket",
                    "run as root, or give the program CAP_NET_RAW: sudo setcap cap_net_raw+ep …");
    default:
      return refuse(options, fmt::format("cannot open a socket: {}", std::strerror(errno)), {});
  }
}

Result<int> check_interface(const SocketCanOptions& options, int socket) {
  InterfaceFacts facts;
  const int error = read_interface(socket, options.interface, facts);
  if (error == ENODEV) return refuse(options, "there is no such interface", set_up(options));
  if (error != 0) {
    return refuse(options, fmt::format("cannot be looked at: {}", std::strerror(error)), {});
  }
  if (!facts.is_can) {
    return refuse(options, "is no CAN interface", "ip -brief link show type can lists those");
  }
  if (options.fd && facts.mtu < static_cast<int>(CANFD_MTU)) {
    return refuse(options, "carries classic frames only, and its bus is configured as CAN FD",
                  fmt::format("sudo ip link set {0} down, then: sudo ip link set {0} type can "
                              "bitrate 1000000 dbitrate 8000000 fd on (real), or sudo ip link set "
                              "{0} mtu 72 (virtual), then: sudo ip link set {0} up",
                              options.interface));
  }
  if (!facts.up) {
    return refuse(options, "is down",
                  fmt::format("sudo ip link set {} up (a real one needs its bit rates first: "
                              "docs/can.md)",
                              options.interface));
  }
  return facts.index;
}

template <class T>
bool set(int socket, int level, int name, const T& value) {
  return ::setsockopt(socket, level, name, &value, sizeof(value)) == 0;
}

/// The kernel doubles what it is asked for, up to twice its limit; root may go beyond.
bool size_queue(int socket, int name, int forced_name, std::size_t frames) {
  const int wanted = static_cast<int>(frames * kQueuedFrameBytes);
  int size = 0;
  for (const int option : {name, forced_name}) {
    (void)set(socket, SOL_SOCKET, option, wanted / 2);
    socklen_t length = sizeof(size);
    if (::getsockopt(socket, SOL_SOCKET, name, &size, &length) == 0 && size >= wanted) return true;
  }
  return false;
}

Status size_queues(const SocketCanOptions& options, int socket) {
  const auto too_long = [&](const char* what, std::size_t frames, const char* limit) {
    return refuse(options,
                  fmt::format("the system does not grant a {} queue of {} frames", what, frames),
                  fmt::format("sudo sysctl net.core.{}={}", limit, frames * kQueuedFrameBytes / 2));
  };
  if (!size_queue(socket, SO_RCVBUF, SO_RCVBUFFORCE, options.receive_queue)) {
    return too_long("receive", options.receive_queue, "rmem_max");
  }
  if (!size_queue(socket, SO_SNDBUF, SO_SNDBUFFORCE, options.send_queue)) {
    return too_long("send", options.send_queue, "wmem_max");
  }
  return {};
}

/// What the kernel lets through: only 11-bit identifiers, and data frames but for the remote
/// requests that a board may have to answer: for its TPDOs, and node guarding. A board hears every
/// heartbeat: 1016 may name any node.
std::vector<can_filter> filters(SocketSide side) {
  std::vector<can_filter> all;
  const auto let = [&](std::uint32_t id, std::uint32_t mask, std::uint32_t remote = 0) {
    all.push_back({.can_id = id | remote, .can_mask = mask | CAN_EFF_FLAG | CAN_RTR_FLAG});
  };
  if (side == SocketSide::kMaster) {
    // 081 to 0FF, without SYNC: by the highest bit of the node id
    for (std::uint32_t bit = 1; bit <= 0x40; bit <<= 1) {
      let(cob::kEmergency | bit, cob::kIdMask & ~(bit - 1));
    }
    for (int number = 1; number <= canopen::kPdosPerNode; ++number) {
      let(cob::tpdo(number, 0), kFunctionMask);
    }
    let(cob::kSdoResponse, kFunctionMask);
    let(cob::kHeartbeat, kFunctionMask);
    let(cob::kTime, cob::kIdMask);
    let(cob::kPastAnswer, cob::kIdMask);
  } else if (side == SocketSide::kBoards) {
    let(cob::kNmt, cob::kIdMask);
    let(cob::kSync, cob::kIdMask);
    let(cob::kPastOrder, cob::kIdMask);
    for (int number = 1; number <= canopen::kPdosPerNode; ++number) {
      let(cob::rpdo(number, 0), kFunctionMask);
      let(cob::tpdo(number, 0), kFunctionMask, CAN_RTR_FLAG);
    }
    let(cob::kSdoRequest, kFunctionMask);
    let(cob::kHeartbeat, kFunctionMask);
    let(cob::kHeartbeat, kFunctionMask, CAN_RTR_FLAG);
  } else if (side == SocketSide::kWitness) {
    all.push_back({.can_id = 0, .can_mask = 0});
  }
  return all;
}

Status configure(const SocketCanOptions& options, std::span<const can_filter> filter, int socket) {
  if (auto sized = size_queues(options, socket); !sized) return sized;
  const can_err_mask_t every_error = options.side == SocketSide::kSender ? 0 : CAN_ERR_MASK;
  const int on = 1;
  const bool done = set(socket, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, on) &&
                    set(socket, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, every_error) &&
                    set_filters(socket, filter) == 0 &&
                    set(socket, SOL_SOCKET, SO_TIMESTAMPNS, on) &&
                    set(socket, SOL_SOCKET, SO_RXQ_OVFL, on);
  if (done) return {};
  return refuse(options,
                fmt::format("the kernel refuses a socket option: {}", std::strerror(errno)),
                "CAN FD, filters and error frames need Linux 3.6 or newer");
}

}  // namespace

Result<std::unique_ptr<SocketCanBus>> SocketCanBus::open(const SocketCanOptions& options) {
  if (options.interface.empty() || options.interface.size() >= IFNAMSIZ) {
    return refuse(options, fmt::format("an interface's name has 1 to {} characters", IFNAMSIZ - 1),
                  "ip -brief link show type can lists the interfaces");
  }
  const auto made = make_socket(options);
  if (!made) return std::unexpected(made.error());
  OpenSocket socket{*made};
  const auto index = check_interface(options, *made);
  if (!index) return std::unexpected(index.error());
  std::vector<can_filter> filter = filters(options.side);
  if (const auto configured = configure(options, filter, *made); !configured) {
    return std::unexpected(configured.error());
  }
  if (const int error = bind_to(*made, *index); error != 0) {
    return refuse(options, fmt::format("cannot be bound to: {}", std::strerror(error)),
                  set_up(options));
  }
  return std::unique_ptr<SocketCanBus>(
      new SocketCanBus(options, std::move(filter), socket.release(), *index));
}

std::string SocketCanBus::status_text() const {
  const std::string& name = options_.interface;
  const Told told = told_.load(std::memory_order_relaxed);
  switch (told.state) {
    case BusState::kActive: return {};
    case BusState::kGone:
      return fmt::format("CAN interface {0} was removed; waiting for it to come back ({1})", name,
                         set_up(options_));
    case BusState::kDown:
      if (told.link == Link::kClassicOnly) {
        return fmt::format(
            "CAN interface {0} carries classic frames only; waiting for CAN FD "
            "(down, then fd on or mtu 72, then up: docs/can.md)",
            name);
      }
      return fmt::format("CAN interface {0} is down (sudo ip link set {0} up)", name);
    case BusState::kBusOff:
      return fmt::format(
          "CAN interface {0} is bus-off: its controller met too many errors (check "
          "wiring, termination and bit rates; then sudo ip link set {0} type can "
          "restart, or down and up; restart-ms 100 does it by itself)",
          name);
    case BusState::kErrorPassive:
      return fmt::format(
          "CAN interface {0} is error-passive: frames fail often (check wiring, "
          "termination, bit rates, and that another node is on)",
          name);
    case BusState::kOverloaded: break;
  }
  if (told.loss_error == 0) {
    return fmt::format(
        "CAN interface {}: received frames were lost: they came faster than they were taken", name);
  }
  if (told.loss_error == ENOBUFS || told.loss_error == EAGAIN) {
    return fmt::format(
        "CAN interface {0}: its transmit queue is full, frames were lost "
        "(sudo ip link set {0} txqueuelen 1000; check the bus load: tandem check --bus)",
        name);
  }
  return fmt::format("CAN interface {}: the kernel refuses frames: {}", name,
                     std::strerror(told.loss_error));
}

int read_interface(int socket, const std::string& name, InterfaceFacts& facts) noexcept {
  ifreq request{};
  name.copy(request.ifr_name, IFNAMSIZ - 1);
  if (::ioctl(socket, SIOCGIFINDEX, &request) != 0) return errno;
  facts.index = request.ifr_ifindex;
  if (::ioctl(socket, SIOCGIFHWADDR, &request) != 0) return errno;
  facts.is_can = request.ifr_hwaddr.sa_family == ARPHRD_CAN;
  if (::ioctl(socket, SIOCGIFFLAGS, &request) != 0) return errno;
  facts.up = (request.ifr_flags & IFF_UP) != 0;
  if (::ioctl(socket, SIOCGIFMTU, &request) != 0) return errno;
  facts.mtu = request.ifr_mtu;
  return 0;
}

int set_filters(int socket, std::span<const can_filter> filters) noexcept {
  const auto bytes = static_cast<socklen_t>(filters.size_bytes());
  return ::setsockopt(socket, SOL_CAN_RAW, CAN_RAW_FILTER, filters.data(), bytes) == 0 ? 0 : errno;
}

int bind_to(int socket, int index) noexcept {
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = index;
  const auto* generic = reinterpret_cast<const sockaddr*>(&address);
  return ::bind(socket, generic, sizeof(address)) == 0 ? 0 : errno;
}

}  // namespace tandem::hal::can
