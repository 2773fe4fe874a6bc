// The SocketCAN interfaces of a robot's buses, for both ends of the wire.
// Layer: apps/can.  Thread: open main; waiting the loop's or the emulator's.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "apps/can/interface_lock.hpp"
#include "base/result.hpp"
#include "hal/config/robot_config.hpp"
#include "hal/ethercat-can/frame_wait.hpp"
#include "hal/ethercat-can/line/packet_link.hpp"
#include "hal/ethercat-can/socket_can_bus.hpp"

namespace tandem::apps {

/// A bus that is open: one of the two is null.
struct OpenBus {
  std::string interface;
  hal::can::Bus* end = nullptr;
  const hal::can::SocketCanBus* can = nullptr;
  const hal::ecat::PacketLink* link = nullptr;
};

/// Makes this side's end of the line of [[bus]] `index`.
using MakeLine = std::function<Result<std::unique_ptr<hal::can::Bus>>(
    std::size_t index, hal::ecat::DataLink& link, hal::can::FrameWait& wait)>;

/// One socket per [[bus]], in robot.toml's order, and the wait for all of them.
class CanSockets final : public hal::can::FrameWait {
 public:
  /// Locks the interface of every bus for this side, and opens it.
  /// @param stamps  take the times of frames: nobody asks for them in lockstep
  /// @param make_line  for EtherCAT; without it there is none
  /// Errors: all of them, each with its bus.
  [[nodiscard]] static std::expected<std::unique_ptr<CanSockets>, Diagnostics> open(
      const hal::RobotConfig& robot, hal::can::SocketSide side, bool stamps,
      const MakeLine& make_line = {});

  [[nodiscard]] std::span<hal::can::Bus* const> buses() const noexcept { return ends_; }
  [[nodiscard]] std::span<const OpenBus> open_buses() const noexcept { return open_; }

  [[nodiscard]] std::int64_t now_ns() noexcept override;
  void wait(std::int64_t at_most_ns, int bus) noexcept override;
  /// After SIGINT or SIGTERM.
  [[nodiscard]] bool stopping() const noexcept override;

 private:
  CanSockets() = default;
  Status open_can(const hal::BusConfig& bus, hal::can::SocketSide side, bool stamps);
  Status open_line(const hal::BusConfig& bus, std::size_t index, const MakeLine& make_line);
  [[nodiscard]] int descriptor(std::size_t bus) const noexcept;

  std::vector<InterfaceLock> locks_;  // of distinct interfaces
  std::vector<std::unique_ptr<hal::ecat::PacketLink>> links_;
  std::vector<std::unique_ptr<hal::can::Bus>> owned_;
  std::vector<OpenBus> open_;
  std::vector<hal::can::Bus*> ends_;
};

/// Listens on every interface for a while, before anything is sent: a second master would reset the
/// nodes and take the torque from the robot that the first one moves.
/// @param period_ns  of the loop
/// Errors: a bus on which another master is at work; one that cannot be opened.
[[nodiscard]] Diagnostics listen_for_masters(const hal::RobotConfig& robot, std::int64_t period_ns);

}  // namespace tandem::apps
