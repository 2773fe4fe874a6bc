// An EtherCAT bus of the robot in this process: both ends of its line, and the cable between them.
// Layer: hal/sim.  Thread: the loop's.
#pragma once

#include <array>
#include <memory>

#include "base/result.hpp"
#include "hal/ethercat-can/line/loopback_link.hpp"
#include "hal/ethercat-can/line_bus.hpp"
#include "hal/sim/line_boards.hpp"

namespace tandem::sim {

/// ```
/// master.cycle_begin(time);  // through master()
/// line.to_boards();
/// robot.step(time_ns);
/// line.to_master();
/// master.receive(state);
/// ```
class InProcessLine {
 public:
  /// @param emulated  outlives it
  /// Errors: those of LineBus.
  [[nodiscard]] static Result<std::unique_ptr<InProcessLine>> create(const hal::RobotConfig& robot,
                                                                     EmulatedRobot& emulated,
                                                                     std::size_t bus,
                                                                     const SimRobotConfig& config);

  [[nodiscard]] hal::can::LineBus& master() noexcept { return *master_; }
  [[nodiscard]] LineBoards& boards() noexcept { return *boards_; }
  /// What the slaves have heard.
  void to_boards() noexcept TANDEM_RT;
  /// What the boards have to say.
  void to_master() noexcept TANDEM_RT;
  /// Between two cycles.
  void archive(Archive& ar);

 private:
  InProcessLine() = default;

  hal::can::Bus* bus_ = nullptr;
  hal::ecat::LoopbackLink cable_;
  std::unique_ptr<LineBoards> boards_;
  std::unique_ptr<hal::can::LineBus> master_;
  std::array<canopen::Frame, 64> passing_{};  ///< no state
};

}  // namespace tandem::sim
