// What opening a CAN socket and using it share. Private to socket_can_*.cpp.
// Layer: hal/ethercat-can.  Thread: any.
#pragma once

#include <linux/can.h>
#include <sys/socket.h>
#include <sys/uio.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <ctime>
#include <span>
#include <string>

#include "hal/ethercat-can/socket_can_bus.hpp"

namespace tandem::hal::can {

inline constexpr std::size_t kBatchFrames = 64;

/// The arguments of recvmmsg and sendmmsg, and what they point to.
struct SocketCanBus::Batch {
  /// Room for a time-stamp and for the count of lost frames.
  static constexpr std::size_t kControlBytes =
      CMSG_SPACE(sizeof(timespec)) + CMSG_SPACE(sizeof(std::uint32_t));
  struct alignas(cmsghdr) Control {
    std::array<char, kControlBytes> bytes;
  };

  std::array<mmsghdr, kBatchFrames> messages{};
  std::array<iovec, kBatchFrames> parts{};
  std::array<canfd_frame, kBatchFrames> frames{};
  std::array<Control, kBatchFrames> control{};
  std::size_t used = kBatchFrames;  ///< messages whose control part the kernel has written over

  Batch() noexcept {
    for (std::size_t i = 0; i < kBatchFrames; ++i) {
      parts[i] = {.iov_base = &frames[i], .iov_len = sizeof(canfd_frame)};
      messages[i].msg_hdr.msg_iov = &parts[i];
      messages[i].msg_hdr.msg_iovlen = 1;
    }
  }
  Batch(const Batch&) = delete;
  Batch& operator=(const Batch&) = delete;

  /// One recvmmsg() of at most `count`. Only what the last one has used is made ready again: in a
  /// cycle few messages come, and the others' memory is better left out of the caches.
  int receive(int socket, std::size_t count) noexcept {
    for (std::size_t i = 0; i < used; ++i) {
      messages[i].msg_hdr.msg_control = control[i].bytes.data();
      messages[i].msg_hdr.msg_controllen = control[i].bytes.size();
    }
    const int got =
        ::recvmmsg(socket, messages.data(), static_cast<unsigned>(count), MSG_DONTWAIT, nullptr);
    used = got < 0 ? 1 : static_cast<std::size_t>(got);
    return got;
  }
};

/// An interface as the kernel has it now.
struct InterfaceFacts {
  int index = 0;
  bool is_can = false;
  bool up = false;
  int mtu = 0;  ///< 16: classic, 72: FD
};
/// Four system calls. @return errno, 0 when all are read; ENODEV when there is no such interface.
[[nodiscard]] int read_interface(int socket, const std::string& name,
                                 InterfaceFacts& facts) noexcept;
inline constexpr std::uint64_t kReadInterfaceCalls = 4;

/// The kernel drops a socket's filters with its interface: set before each bind_to().
/// @return errno; 0 when they are set.
[[nodiscard]] int set_filters(int socket, std::span<const can_filter> filters) noexcept;

/// @return errno; 0 when the socket is bound.
[[nodiscard]] int bind_to(int socket, int index) noexcept;

}  // namespace tandem::hal::can
