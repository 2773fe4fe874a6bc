// CAN interfaces of a test's own, and a plain socket that knows nothing of our code.
// Layer: tests.  Thread: any.
#pragma once

#include <gtest/gtest.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include "base/clock_ns.hpp"

namespace tandem::test {

/// Runs a command line; a failure of it is a failure of the test.
inline void shell(const std::string& command) {
  EXPECT_EQ(std::system(command.c_str()), 0) << command;
}

/// Calls `done` every millisecond until it answers true. @return false after `patience_s`.
template <class Done>
[[nodiscard]] bool eventually(Done done, std::int64_t patience_s = 10) {
  const std::int64_t end = clock_ns(CLOCK_MONOTONIC) + patience_s * 1'000'000'000;
  while (clock_ns(CLOCK_MONOTONIC) < end) {
    if (done()) return true;
    ::usleep(1000);
  }
  return false;
}

/// A virtual interface, up, that goes away with its test.
class VirtualCan {
 public:
  explicit VirtualCan(std::string name, int mtu = 72) : name_(std::move(name)) { add(mtu); }
  ~VirtualCan() {
    if (::if_nametoindex(name_.c_str()) != 0) remove();
  }
  VirtualCan(const VirtualCan&) = delete;
  VirtualCan& operator=(const VirtualCan&) = delete;

  void add(int mtu = 72) {
    shell("ip link add " + name_ + " type vcan && ip link set " + name_ + " mtu " +
          std::to_string(mtu) + " up");
  }
  void set(const std::string& what) const { shell("ip link set " + name_ + " " + what); }
  void remove() const { shell("ip link del " + name_); }
  [[nodiscard]] const std::string& name() const { return name_; }

 private:
  std::string name_;
};

/// A blocking raw socket that writes and reads what the kernel has, bit for bit.
class RawCan {
 public:
  explicit RawCan(const std::string& interface) : socket_(::socket(PF_CAN, SOCK_RAW, CAN_RAW)) {
    const int on = 1;
    EXPECT_EQ(::setsockopt(socket_, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &on, sizeof(on)), 0);
    sockaddr_can address{};
    address.can_family = AF_CAN;
    address.can_ifindex = static_cast<int>(::if_nametoindex(interface.c_str()));
    EXPECT_EQ(::bind(socket_, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0)
        << interface;
    const timeval patience{.tv_sec = 5, .tv_usec = 0};
    EXPECT_EQ(::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience)), 0);
  }
  ~RawCan() { ::close(socket_); }
  RawCan(const RawCan&) = delete;
  RawCan& operator=(const RawCan&) = delete;

  void write(std::uint32_t id, const std::vector<std::uint8_t>& data, bool fd = false,
             std::uint8_t flags = 0) const {
    canfd_frame frame{};
    frame.can_id = id;
    frame.len = static_cast<std::uint8_t>(data.size());
    frame.flags = flags;
    std::copy(data.begin(), data.end(), frame.data);
    const std::size_t size = fd ? CANFD_MTU : CAN_MTU;
    EXPECT_EQ(::write(socket_, &frame, size), static_cast<ssize_t>(size));
  }
  /// From now on the kernel keeps only identifiers with `bits` where `mask` is set.
  void keep_only(std::uint32_t bits, std::uint32_t mask) const {
    const can_filter filter{.can_id = bits, .can_mask = mask | CAN_EFF_FLAG | CAN_RTR_FLAG};
    EXPECT_EQ(::setsockopt(socket_, SOL_CAN_RAW, CAN_RAW_FILTER, &filter, sizeof(filter)), 0);
  }
  /// What the kernel has kept so far, in its order.
  [[nodiscard]] std::vector<canfd_frame> kept() const {
    std::vector<canfd_frame> frames;
    canfd_frame frame{};
    while (receive(frame) > 0) frames.push_back(frame);
    return frames;
  }
  /// Without waiting. @return as recv(2).
  [[nodiscard]] ssize_t receive(canfd_frame& frame) const {
    return ::recv(socket_, &frame, sizeof(frame), MSG_DONTWAIT);
  }
  [[nodiscard]] int descriptor() const { return socket_; }
  /// @return bytes that the kernel gave: 16 or 72; 0 when nothing came for five seconds.
  [[nodiscard]] std::size_t read(canfd_frame& frame) const {
    frame = {};
    const ssize_t size = ::read(socket_, &frame, sizeof(frame));
    return size < 0 ? 0 : static_cast<std::size_t>(size);
  }

 private:
  int socket_;
};

}  // namespace tandem::test
