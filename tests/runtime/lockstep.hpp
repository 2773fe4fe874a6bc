// A CAN backend and an emulator in one thread: the wire between them is a pair of queues, and
// waiting for frames lets the other side run. Everything of a lockstep run but the kernel.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "hal/ethercat-can/can_backend.hpp"
#include "hal/ethercat-can/line/loopback_link.hpp"
#include "hal/ethercat-can/line_bus.hpp"
#include "hal/ethercat-can/loopback.hpp"
#include "hal/sim/emulator.hpp"
#include "hal/sim/line_boards.hpp"
#include "runtime/run/run.hpp"

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
      if (robot.buses[b].kind == hal::BusKind::kEthercat) {
        add_line(robot, b, config, near, far);
        continue;
      }
      wires.push_back(std::make_unique<hal::can::LoopbackBus>());
      near.push_back(&wires.back()->master());
      ears.push_back(std::make_unique<Ear>(wires.back()->boards()));
      far.push_back(ears.back().get());
    }
    emulator = std::make_unique<sim::Emulator>(*emulated, far, nothing_,
                                               sim::EmulatorConfig{config.period_ns, true});
    auto can = hal::can::CanBackend::create(
        robot, near, *this,
        {.lockstep = lockstep, .lockstep_timeout_ns = 1000, .past_timeout_ns = 200});
    EXPECT_TRUE(can.has_value()) << can.error().to_string();
    backend = std::move(*can);
    master = backend.get();
  }

  /// The emulator's end of a CAN bus: one of an older version has no ear for its past.
  struct Ear final : hal::can::ForwardingBus {
    using ForwardingBus::ForwardingBus;
    std::size_t receive(std::span<canopen::Frame> frames) noexcept TANDEM_RT override {
      const std::size_t count = ForwardingBus::receive(frames);
      for (canopen::Frame& one : frames.first(count)) {
        if (one.id != canopen::cob::kPastOrder) continue;
        ++orders;
        if (deaf) one.id = 0x7E;  // nobody's
      }
      return count;
    }
    bool deaf = false;
    std::uint64_t orders = 0;
  };

  std::vector<std::unique_ptr<hal::can::LoopbackBus>> wires;  ///< CAN
  std::vector<std::unique_ptr<Ear>> ears;                     ///< of these
  std::unique_ptr<sim::EmulatedRobot> emulated;
  std::unique_ptr<sim::Emulator> emulator;
  std::unique_ptr<hal::can::CanBackend> backend;
  hal::can::CanBackend* master;  ///< that, wherever it is moved to
  bool emulator_runs = true;
  std::int64_t waits = 0;  ///< so far; the time that the backend sees

 private:
  void add_line(const hal::RobotConfig& robot, std::size_t bus, const sim::SimRobotConfig& config,
                std::vector<hal::can::Bus*>& near, std::vector<hal::can::Bus*>& far) {
    cables_.push_back(std::make_unique<hal::ecat::LoopbackLink>());
    auto line = hal::can::LineBus::create(robot, bus, cables_.back()->master(),
                                          {.period_ns = config.period_ns, .lockstep = true});
    EXPECT_TRUE(line.has_value()) << line.error().to_string();
    near.push_back(line->get());
    lines_.push_back(std::move(*line));
    slaves_.push_back(std::make_unique<sim::LineBoards>(
        *emulated, bus, cables_.back()->slaves(),
        sim::LineBoards::Config{.period_ns = config.period_ns, .seed = config.seed}));
    far.push_back(slaves_.back().get());
  }

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
  std::vector<std::unique_ptr<hal::ecat::LoopbackLink>> cables_;  ///< EtherCAT
  std::vector<std::unique_ptr<hal::can::LineBus>> lines_;
  std::vector<std::unique_ptr<sim::LineBoards>> slaves_;
};

/// Puts the wire and its emulated robot, made in `place`, before a run.
/// @param deaf  it has no ear for orders about its past
inline Run::Connect over(std::optional<LockstepRobot>& place, bool lockstep = true,
                         bool deaf = false) {
  return [&place, lockstep, deaf](Composition& c) -> Diagnostics {
    place.emplace(c.experiment.robot, c.kernels.get(), c.experiment.sim_robot_config(), lockstep);
    for (const auto& ear : place->ears) ear->deaf = deaf;
    c.backend = std::move(place->backend);
    return {};
  };
}

}  // namespace tandem::runtime::test
