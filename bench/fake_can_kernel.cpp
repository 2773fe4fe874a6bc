#include "bench/fake_can_kernel.hpp"

#include <linux/can/raw.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdarg>
#include <cstring>
#include <ctime>

#include "base/clock_ns.hpp"
#include "canopen/objects.hpp"
#include "hal/ethercat-can/socket_frame.hpp"

namespace tandem::bench {
namespace {

FakeCanKernel* active_kernel = nullptr;

constexpr int kFirstDescriptor = 1'000'000;  // beyond any real one
constexpr std::size_t kRoom = 1024;          // frames of a bus in one cycle

/// Takes the time from its construction to its end as the kernel's.
class Inside {
 public:
  explicit Inside(FakeCanKernel& kernel) noexcept : kernel_(kernel) {}
  ~Inside() { kernel_.count(clock_ns(CLOCK_MONOTONIC) - began_ns_); }
  Inside(const Inside&) = delete;
  Inside& operator=(const Inside&) = delete;

 private:
  FakeCanKernel& kernel_;
  std::int64_t began_ns_ = clock_ns(CLOCK_MONOTONIC);
};

int refuse(int error) noexcept {
  errno = error;
  return -1;
}

/// The kernel's receive time-stamp.
void stamp(msghdr& message) noexcept {
  cmsghdr* item = CMSG_FIRSTHDR(&message);
  if (item == nullptr) return;
  timespec now{};
  ::clock_gettime(CLOCK_REALTIME, &now);
  item->cmsg_level = SOL_SOCKET;
  item->cmsg_type = SCM_TIMESTAMPNS;
  item->cmsg_len = CMSG_LEN(sizeof now);
  std::memcpy(CMSG_DATA(item), &now, sizeof now);
  message.msg_controllen = CMSG_SPACE(sizeof now);
}

}  // namespace

FakeCanKernel::FakeCanKernel(sim::EmulatedRobot& robot, std::vector<std::string> names,
                             std::int64_t period_ns)
    : robot_(&robot), period_ns_(period_ns), next_descriptor_(kFirstDescriptor) {
  for (std::string& name : names) {
    Port port;
    port.name = std::move(name);
    port.coming.reserve(kRoom);
    port.arrived.reserve(kRoom);
    ports_.push_back(std::move(port));
  }
  active_kernel = this;
}

FakeCanKernel::~FakeCanKernel() { active_kernel = nullptr; }

FakeCanKernel* FakeCanKernel::active() noexcept { return active_kernel; }

int FakeCanKernel::bus_of(int descriptor) const noexcept {
  if (descriptor < kFirstDescriptor) return -1;
  for (std::size_t b = 0; b < ports_.size(); ++b) {
    if (ports_[b].descriptor == descriptor) return static_cast<int>(b);
  }
  return -1;
}

int FakeCanKernel::open_socket() noexcept { return next_descriptor_++; }

int FakeCanKernel::interface(const char* name) const noexcept {
  for (std::size_t b = 0; b < ports_.size(); ++b) {
    if (ports_[b].name == name) return static_cast<int>(b) + 1;
  }
  return 0;
}

void FakeCanKernel::bind_socket(int descriptor, int index) noexcept {
  ports_[static_cast<std::size_t>(index - 1)].descriptor = descriptor;
}

void FakeCanKernel::take(std::size_t bus, const canfd_frame& frame, std::size_t bytes) noexcept {
  canopen::Frame taken;
  if (hal::can::from_kernel(frame, bytes, taken) != hal::can::KernelFrame::kData) return;
  for (Port& port : ports_) arrive(port);  // what nobody waited for has come by now
  (void)robot_->bus(bus).master().send({&taken, 1});
  if (taken.id != canopen::cob::kSync) return;
  ports_[bus].sync = true;
  if (std::ranges::all_of(ports_, &Port::sync)) step();
}

void FakeCanKernel::step() noexcept {
  (void)robot_->step(time_ns_);
  time_ns_ += period_ns_;
  for (std::size_t b = 0; b < ports_.size(); ++b) {
    Port& port = ports_[b];
    port.sync = false;
    canopen::Frame frame;
    while (robot_->bus(b).master().receive({&frame, 1}) == 1) port.coming.push_back(frame);
  }
}

void FakeCanKernel::arrive(Port& port) noexcept {
  if (port.coming.empty()) return;
  port.arrived.erase(port.arrived.begin(),
                     port.arrived.begin() + static_cast<std::ptrdiff_t>(port.given));
  port.given = 0;
  port.arrived.insert(port.arrived.end(), port.coming.begin(), port.coming.end());
  port.coming.clear();
}

bool FakeCanKernel::give(std::size_t bus, canfd_frame& frame, std::size_t& bytes) noexcept {
  Port& port = ports_[bus];
  if (port.given == port.arrived.size()) return false;
  bytes = hal::can::to_kernel(port.arrived[port.given++], true, frame);
  return true;
}

int FakeCanKernel::wait(std::span<const int> buses) noexcept {
  for (const int bus : buses) {
    Port& port = ports_[static_cast<std::size_t>(bus)];
    if (port.given == port.arrived.size() && port.coming.empty()) continue;
    arrive(port);
    return bus;
  }
  return -1;
}

}  // namespace tandem::bench

// ---- The system calls, in the place of libc's.

using tandem::bench::FakeCanKernel;
using tandem::bench::Inside;
using tandem::bench::refuse;

extern "C" {

int socket(int domain, int type, int protocol) noexcept {
  FakeCanKernel* kernel = FakeCanKernel::active();
  if (kernel != nullptr && domain == PF_CAN) return kernel->open_socket();
  return static_cast<int>(syscall(SYS_socket, domain, type, protocol));
}

int bind(int descriptor, const sockaddr* address, socklen_t size) noexcept {
  FakeCanKernel* kernel = FakeCanKernel::active();
  if (kernel == nullptr || descriptor < tandem::bench::kFirstDescriptor) {
    return static_cast<int>(syscall(SYS_bind, descriptor, address, size));
  }
  sockaddr_can can{};
  std::memcpy(&can, address, std::min<std::size_t>(size, sizeof can));
  kernel->bind_socket(descriptor, can.can_ifindex);
  return 0;
}

int ioctl(int descriptor, unsigned long request, ...) noexcept {
  va_list arguments;
  va_start(arguments, request);
  void* argument = va_arg(arguments, void*);
  va_end(arguments);
  FakeCanKernel* kernel = FakeCanKernel::active();
  if (kernel == nullptr || descriptor < tandem::bench::kFirstDescriptor) {
    return static_cast<int>(syscall(SYS_ioctl, descriptor, request, argument));
  }
  auto& facts = *static_cast<ifreq*>(argument);
  const int index = kernel->interface(facts.ifr_name);
  if (index == 0) return refuse(ENODEV);
  if (request == SIOCGIFINDEX) facts.ifr_ifindex = index;
  if (request == SIOCGIFHWADDR) facts.ifr_hwaddr.sa_family = ARPHRD_CAN;
  if (request == SIOCGIFFLAGS) facts.ifr_flags = IFF_UP;
  if (request == SIOCGIFMTU) facts.ifr_mtu = CANFD_MTU;
  return 0;
}

int setsockopt(int descriptor, int level, int name, const void* value, socklen_t size) noexcept {
  if (descriptor >= tandem::bench::kFirstDescriptor) return 0;
  return static_cast<int>(syscall(SYS_setsockopt, descriptor, level, name, value, size));
}

int getsockopt(int descriptor, int level, int name, void* value, socklen_t* size) noexcept {
  if (descriptor < tandem::bench::kFirstDescriptor) {
    return static_cast<int>(syscall(SYS_getsockopt, descriptor, level, name, value, size));
  }
  const int answer = name == SO_ERROR ? 0 : 1 << 30;  // room for every queue
  std::memcpy(value, &answer, sizeof answer);
  return 0;
}

int close(int descriptor) {
  if (descriptor >= tandem::bench::kFirstDescriptor) return 0;
  return static_cast<int>(syscall(SYS_close, descriptor));
}

int sendmmsg(int descriptor, mmsghdr* messages, unsigned count, int /*flags*/) {
  FakeCanKernel& kernel = *FakeCanKernel::active();
  const Inside inside(kernel);
  const auto bus = static_cast<std::size_t>(kernel.bus_of(descriptor));
  for (unsigned i = 0; i < count; ++i) {
    const iovec& part = *messages[i].msg_hdr.msg_iov;
    messages[i].msg_len = static_cast<unsigned>(part.iov_len);
    kernel.take(bus, *static_cast<const canfd_frame*>(part.iov_base), part.iov_len);
  }
  return static_cast<int>(count);
}

int recvmmsg(int descriptor, mmsghdr* messages, unsigned count, int /*flags*/,
             timespec* /*timeout*/) {
  FakeCanKernel& kernel = *FakeCanKernel::active();
  const Inside inside(kernel);
  const auto bus = static_cast<std::size_t>(kernel.bus_of(descriptor));
  unsigned given = 0;
  for (; given < count; ++given) {
    msghdr& message = messages[given].msg_hdr;
    std::size_t bytes = 0;
    if (!kernel.give(bus, *static_cast<canfd_frame*>(message.msg_iov->iov_base), bytes)) break;
    messages[given].msg_len = static_cast<unsigned>(bytes);
    tandem::bench::stamp(message);
  }
  return given == 0 ? refuse(EAGAIN) : static_cast<int>(given);
}

int ppoll(pollfd* waits, nfds_t count, const timespec* timeout, const sigset_t* mask) {
  FakeCanKernel* kernel = FakeCanKernel::active();
  if (kernel == nullptr) {
    return static_cast<int>(syscall(SYS_ppoll, waits, count, timeout, mask, sizeof(*mask)));
  }
  const Inside inside(*kernel);
  int buses[64];
  std::size_t ours = 0;
  for (nfds_t i = 0; i < count && ours < 64; ++i) {
    const int bus = kernel->bus_of(waits[i].fd);
    if (bus >= 0) buses[ours++] = bus;
  }
  const int ready = kernel->wait({buses, ours});
  for (nfds_t i = 0; i < count; ++i) {
    waits[i].revents = kernel->bus_of(waits[i].fd) == ready && ready >= 0 ? POLLIN : 0;
  }
  return ready >= 0 ? 1 : 0;
}

int clock_nanosleep(clockid_t clock, int flags, const timespec* until, timespec* rest) {
  FakeCanKernel* kernel = FakeCanKernel::active();
  const auto sleep = [&] {
    const long answer = syscall(SYS_clock_nanosleep, clock, flags, until, rest);
    return answer == 0 ? 0 : errno;
  };
  if (kernel == nullptr) return sleep();
  const Inside inside(*kernel);
  return sleep();
}

}  // extern "C"
