// The kernel's raw CAN sockets within this process: the system calls that SocketCanBus makes, with
// an emulated robot on the other end. Everything of ours runs as it is; the time within a call is
// told, so that it can be left out.
#pragma once

#include <linux/can.h>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "hal/sim/emulated_robot.hpp"

namespace tandem::bench {

/// While one lives, sockets of the interfaces `names` lead to the robot's buses, in this order.
/// The robot steps when SYNC has come on every bus. Its answers arrive bus by bus, one at each
/// wait, as they would on wires of different load; what nobody waits for has come when a frame is
/// sent.
class FakeCanKernel {
 public:
  FakeCanKernel(sim::EmulatedRobot& robot, std::vector<std::string> names, std::int64_t period_ns);
  ~FakeCanKernel();
  FakeCanKernel(const FakeCanKernel&) = delete;
  FakeCanKernel& operator=(const FakeCanKernel&) = delete;

  /// Time spent within system calls, sleeping included, and how many of them there were.
  [[nodiscard]] std::int64_t inside_ns() const noexcept { return inside_ns_; }
  [[nodiscard]] std::uint64_t calls() const noexcept { return calls_; }

  // For the system calls.
  [[nodiscard]] static FakeCanKernel* active() noexcept;
  /// The bus of a descriptor; -1: not one of ours.
  [[nodiscard]] int bus_of(int descriptor) const noexcept;
  [[nodiscard]] int open_socket() noexcept;
  /// The index of an interface, from 1; 0: there is none of that name.
  [[nodiscard]] int interface(const char* name) const noexcept;
  void bind_socket(int descriptor, int index) noexcept;
  void take(std::size_t bus, const canfd_frame& frame, std::size_t bytes) noexcept;
  /// The next answer that has arrived; false: none. @param bytes  that the frame takes
  [[nodiscard]] bool give(std::size_t bus, canfd_frame& frame, std::size_t& bytes) noexcept;
  /// Lets the answers of one of the buses arrive. @return that bus; -1: nothing is to come
  [[nodiscard]] int wait(std::span<const int> buses) noexcept;
  void count(std::int64_t inside_ns) noexcept {
    inside_ns_ += inside_ns;
    ++calls_;
  }

 private:
  struct Port {
    std::string name;
    int descriptor = -1;
    bool sync = false;  ///< has come since the last step
    std::vector<canopen::Frame> coming, arrived;
    std::size_t given = 0;
  };
  void step() noexcept;
  static void arrive(Port& port) noexcept;

  sim::EmulatedRobot* robot_;
  std::vector<Port> ports_;
  std::int64_t period_ns_, time_ns_ = 0;
  int next_descriptor_;
  std::int64_t inside_ns_ = 0;
  std::uint64_t calls_ = 0;
};

}  // namespace tandem::bench
