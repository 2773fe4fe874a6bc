// A simulated robot in its loop, with what can go wrong outside of the emulated robot, too: a
// master that sleeps or dies, a bus that fails at the master's end.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "hal/ethercat-can/drive_master.hpp"
#include "hal/sim/emulated_robot.hpp"
#include "hal/sim/in_process_line.hpp"
#include "tests/runtime/loop_run.hpp"

namespace tandem::runtime::test {

/// The master's end of a bus, that can be off, or take only so many frames a cycle.
class FailingBus final : public hal::can::Bus {
 public:
  explicit FailingBus(hal::can::Bus& bus) : bus_(&bus) {}
  std::size_t send(std::span<const canopen::Frame> frames) noexcept TANDEM_RT override {
    if (state_now != hal::can::BusState::kActive) return 0;
    const std::size_t taken = std::min(frames.size(), room);
    room -= taken;
    return bus_->send(frames.first(taken));
  }
  std::size_t receive(std::span<canopen::Frame> frames) noexcept TANDEM_RT override {
    const std::size_t count = bus_->receive(frames);
    return state_now == hal::can::BusState::kActive ? count : 0;
  }
  [[nodiscard]] hal::can::BusState state() const noexcept TANDEM_RT override { return state_now; }

  hal::can::BusState state_now = hal::can::BusState::kActive;
  std::size_t queue = 512;  ///< frames that a cycle takes
  std::size_t room = 512;

 private:
  hal::can::Bus* bus_;
};

/// SimRobot with failing buses and a master that can sleep.
class FaultRobot final : public hal::Backend {
 public:
  FaultRobot(const hal::RobotConfig& robot, const tandem_kernels* kernels,
             const sim::SimRobotConfig& config)
      : period_ns_(config.period_ns) {
    auto made = sim::EmulatedRobot::create(robot, kernels, config);
    EXPECT_TRUE(made.has_value()) << made.error().to_string();
    emulated = std::move(*made);
    std::vector<hal::can::Bus*> ends;
    for (std::size_t b = 0; b < robot.buses.size(); ++b) {
      hal::can::Bus* end = &emulated->bus(b).master();
      if (robot.buses[b].kind == hal::BusKind::kEthercat) {
        auto line = sim::InProcessLine::create(robot, *emulated, b, config);
        EXPECT_TRUE(line.has_value()) << line.error().to_string();
        end = &(*line)->master();
        lines.push_back(std::move(*line));
      }
      buses.push_back(std::make_unique<FailingBus>(*end));
      ends.push_back(buses.back().get());
    }
    auto drives = hal::can::DriveMaster::create(robot, ends);
    EXPECT_TRUE(drives.has_value()) << drives.error().to_string();
    master = std::move(*drives);
  }

  [[nodiscard]] hal::Pace pace() const noexcept override { return hal::Pace::kSimulatedClock; }
  [[nodiscard]] hal::Phase phase() const noexcept override { return master->phase(); }
  [[nodiscard]] std::string status_text() const override {
    std::string text = master->status_text();
    for (const auto& line : lines) text += "\n" + line->master().status_text();
    return text;
  }
  [[nodiscard]] Code read(const hal::CycleTime& time,
                          hal::StateImage& state) noexcept TANDEM_RT override {
    for (const auto& bus : buses) bus->room = bus->queue;
    hal::CycleTime late = time;
    late.time_ns += slept_ns_;
    master->cycle_begin(late);
    for (const auto& line : lines) line->to_boards();
    const Code code = emulated->step(late.time_ns);
    for (const auto& line : lines) line->to_master();
    return code == Code::kOk ? master->receive(state) : code;
  }
  [[nodiscard]] Code write(const hal::CommandImage& command,
                           const hal::ParameterImage& parameters) noexcept TANDEM_RT override {
    return master->send(command, parameters);
  }
  void stop(hal::StopCategory category) noexcept TANDEM_RT override { master->stop(category); }
  void reset() noexcept TANDEM_RT override { master->reset(); }
  [[nodiscard]] bool shut_down() noexcept TANDEM_RT override { return master->shut_down(); }
  [[nodiscard]] bool archive(Archive&) override { return false; }
  [[nodiscard]] hal::FaultCause fault_cause(std::size_t joint) const noexcept TANDEM_RT override {
    return master->fault_cause(joint);
  }
  [[nodiscard]] hal::InjectedFault next_injected() noexcept TANDEM_RT override {
    return emulated->next_injected();
  }

  /// A period passes without the master.
  void without_master() {
    slept_ns_ += period_ns_;
    (void)emulated->step(emulated->now_ns() + period_ns_);
  }

  std::unique_ptr<sim::EmulatedRobot> emulated;
  std::vector<std::unique_ptr<sim::InProcessLine>> lines;  ///< EtherCAT buses
  std::vector<std::unique_ptr<FailingBus>> buses;
  std::unique_ptr<hal::can::DriveMaster> master;

 private:
  std::int64_t period_ns_;
  std::int64_t slept_ns_ = 0;
};

/// Cycles, the first one in which the fault acts being number 1. -1: not.
struct Outcome {
  int noticed = -1;  ///< a fault is latched
  int safe = -1;     ///< no motor drives any more: its winding is shorted, or its bridge open
  int open = -1;     ///< every bridge is open
};

/// A whole run: one joint moves on a sine, the others are held.
struct FaultRig : LoopRun {
  FaultRig(hal::RobotConfig config, const tandem_kernels* its_kernels, const std::string& posture,
           std::vector<sim::ScenarioFault> scenario = {}, std::int64_t release_ns = 100'000'000)
      : LoopRun(std::move(config), its_kernels) {
    backend = std::make_unique<FaultRobot>(
        robot, kernels,
        sim::SimRobotConfig{
            .posture = posture, .release_ns = release_ns, .faults = std::move(scenario)});
    sine = add_sine({0}, "sine", true, "amplitude_rad = 0.1");
    begin(*backend, {.settle_cycles = 150});
  }
  /// Into the motion, at its fastest.
  void run() {
    while (cycle->phase() != RunPhase::kRunning && cycle->step()) {
    }
    ASSERT_EQ(cycle->phase(), RunPhase::kRunning) << backend->status_text();
    for (int i = 0; i < 500; ++i) cycle->step();
    ASSERT_TRUE(cycle->faults().empty()) << cycle->faults()[0].text;
  }
  /// Everybody lives on as far as he can.
  void step() {
    if (!cycle->step()) backend->without_master();
  }
  void inject(sim::ScenarioFault fault) { ASSERT_EQ(backend->emulated->inject(fault), Code::kOk); }

  [[nodiscard]] const firmware::Board& board(std::size_t b) const {
    return backend->emulated->board(b);
  }
  [[nodiscard]] const firmware::Axis& axis(std::size_t b, std::size_t a = 0) const {
    return board(b).axis(a);
  }
  /// No motor has a voltage or a current any more.
  [[nodiscard]] bool powerless() const {
    const sim::Plant& plant = backend->emulated->plant();
    for (std::size_t j = 0; j < plant.joints(); ++j) {
      if (plant.joint(j).voltage_V != 0.0 || plant.joint(j).current_A != 0.0) return false;
    }
    return true;
  }
  [[nodiscard]] bool noticed() const {
    return backend->phase() == hal::Phase::kFault || !cycle->faults().empty();
  }
  /// The run with what has just been injected, until all is powerless, 4 s at most.
  Outcome watch(int cycles = 4000) {
    Outcome found;
    for (int i = 1; i <= cycles && found.open < 0; ++i) {
      step();
      note(found, i, noticed());
    }
    return found;
  }
  void note(Outcome& found, int i, bool notices) const {
    if (found.noticed < 0 && notices) found.noticed = i;
    if (found.noticed >= 0 && found.safe < 0 && backend->emulated->safe()) found.safe = i;
    if (found.safe >= 0 && found.open < 0 && powerless()) found.open = i;
  }
  [[nodiscard]] std::string causes() const {
    std::string all = backend->status_text();
    for (const FaultReport& fault : cycle->faults()) all += "\n" + fault.joint + ": " + fault.text;
    return all;
  }

  std::unique_ptr<FaultRobot> backend;
  Sine* sine;
};

}  // namespace tandem::runtime::test
