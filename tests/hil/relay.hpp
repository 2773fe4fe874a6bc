// The wire between a master's interface and its boards': one frame at a time, as SerialWire has it.
// A virtual interface hands over a burst at once; a real bus does not.
// Layer: tests.  Thread: its own.
#pragma once

#include <poll.h>

#include <array>
#include <atomic>
#include <string>
#include <thread>

#include "hal/ethercat-can/socket_frame.hpp"
#include "tests/hil/can_interfaces.hpp"
#include "tests/support/serial_wire.hpp"

namespace tandem::test {

class Relay {
 public:
  /// @param master, boards  interfaces; what either end sends comes out at the other
  Relay(const std::string& master, const std::string& boards, const hal::can::BitRates& rates)
      : ends_{RawCan(master), RawCan(boards)}, wire_(rates), thread_([this] { run(); }) {}
  ~Relay() {
    over_ = true;
    thread_.join();
  }
  Relay(const Relay&) = delete;
  Relay& operator=(const Relay&) = delete;

  [[nodiscard]] std::size_t passed() const { return passed_; }

 private:
  static constexpr std::int64_t kLookNs = 10'000'000;  ///< for the end of the test

  void run() {
    while (!over_) {
      for (const bool from_master : {true, false}) take(from_master);
      const std::int64_t now_ns = clock_ns(CLOCK_MONOTONIC);
      while (const auto through = wire_.take(now_ns)) give(*through);
      sleep(wire_.through_ns().value_or(now_ns + kLookNs) - now_ns);
    }
  }
  void take(bool from_master) {
    canfd_frame in{};
    canopen::Frame frame;
    for (ssize_t size = 0; (size = ends_[from_master ? 0 : 1].receive(in)) > 0;) {
      const auto bytes = static_cast<std::size_t>(size);
      if (hal::can::from_kernel(in, bytes, frame) != hal::can::KernelFrame::kData) continue;
      wire_.offer({&frame, 1}, from_master, clock_ns(CLOCK_MONOTONIC));
    }
  }
  void give(const SerialWire::Passage& passage) {
    ends_[passage.from_master ? 1 : 0].write(
        passage.frame.id, {passage.frame.payload().begin(), passage.frame.payload().end()},
        passage.frame.fd(), (passage.frame.flags & canopen::kFlagBrs) != 0 ? CANFD_BRS : 0);
    ++passed_;
  }
  void sleep(std::int64_t ns) {
    std::array<pollfd, 2> files{};
    for (std::size_t i = 0; i < 2; ++i) files[i] = {ends_[i].descriptor(), POLLIN, 0};
    const timespec time{.tv_sec = 0, .tv_nsec = std::clamp<std::int64_t>(ns, 0, kLookNs)};
    ::ppoll(files.data(), files.size(), &time, nullptr);
  }

  std::array<RawCan, 2> ends_;
  SerialWire wire_;
  std::atomic<bool> over_{false};
  std::atomic<std::size_t> passed_{0};
  std::thread thread_;
};

}  // namespace tandem::test
