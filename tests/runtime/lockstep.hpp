// A CAN backend and an emulator in one thread: the wire between them is a pair of queues, and
// waiting for frames lets the other side run. Everything of a lockstep run but the kernel.
#pragma once

#include <memory>
#include <vector>

#include "hal/ethercat-can/can_backend.hpp"
#include "hal/ethercat-can/loopback.hpp"
#include "hal/sim/emulator.hpp"

namespace tandem::runtime::test {

class LockstepRobot final : private hal::can::FrameWait {
 public:
  LockstepRobot(const hal::RobotConfig& robot, const tandem_kernels* kernels,
                const sim::SimRobotConfig& config, bool lockstep = true) {
    auto made = sim::EmulatedRobot::create(robot, kernels, config);
    EXPECT_TRUE(made.has_value()) << made.error().to_string();
    emulated = std::move(*made);
    std::vector<hal::can::Bus*> near, far;
    for (std::size_t b = 0; b < robot.buses.size(); ++b) {
      wires.push_back(std::make_unique<hal::can::LoopbackBus>());
      near.push_back(&wires.back()->master());
      far.push_back(&wires.back()->boards());
    }
    emulator = std::make_unique<sim::Emulator>(*emulated, far, nothing_,
                                               sim::EmulatorConfig{config.period_ns, true});
    auto can = hal::can::CanBackend::create(robot, near, *this,
                                            {.lockstep = lockstep, .lockstep_timeout_ns = 1000});
    EXPECT_TRUE(can.has_value()) << can.error().to_string();
    backend = std::move(*can);
  }

  std::vector<std::unique_ptr<hal::can::LoopbackBus>> wires;
  std::unique_ptr<sim::EmulatedRobot> emulated;
  std::unique_ptr<sim::Emulator> emulator;
  std::unique_ptr<hal::can::CanBackend> backend;
  bool emulator_runs = true;
  std::int64_t waits = 0;  ///< so far; the time that the backend sees

 private:
  /// The emulator never has to wait: it is polled when there is something to do.
  class Nothing final : public FrameWait {
   public:
    std::int64_t now_ns() noexcept override { return 0; }
    void wait(std::int64_t, int) noexcept override {}
  };

  std::int64_t now_ns() noexcept override { return waits; }
  void wait(std::int64_t, int) noexcept override {
    ++waits;
    if (emulator_runs) (void)emulator->poll(0);
  }

  Nothing nothing_;
};

}  // namespace tandem::runtime::test
