// A robot whose joints follow their references with one time constant: enough for the loop, and
// as clean of heap and locks as a real backend. Faults can be injected.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/archive.hpp"
#include "hal/backend.hpp"
#include "hal/config/robot_config.hpp"
#include "hal/truth.hpp"

namespace tandem::runtime::test {

class FirstOrderRobot : public hal::Backend {
 public:
  static constexpr double kShare = 0.05;  // of the error that a cycle corrects

  explicit FirstOrderRobot(const hal::RobotConfig& robot, std::size_t feet = 0)
      : truth(robot.joints.size(), feet),
        position_(robot.joints.size(), 0.1),
        velocity_(robot.joints.size()),
        command_(robot.shape()) {}

  // What a test may change between two cycles.
  std::uint64_t bring_up_cycles = 20;
  std::uint64_t shut_down_cycles = 3;
  Code answer = Code::kOk;  // of read()
  double sag_rad = 0.0;     // a joint at rest stands so far below its reference
  int faulted_joint = -1, lost_joint = -1, lost_sensor = -1;
  std::uint32_t fault_code = 0x7310;                     // of a faulted joint
  bool latch_on_fault = false;                           // phase() turns kFault with a joint
  hal::TruthImage truth;                                 // its feet and base are the test's to set
  std::uint64_t idle_writes = 0;                         // commands with every joint idle
  bool reset_clears = true;                              // false: the cause is still there
  bool resets_alone = true;                              // one joint's drive can be reset
  std::uint64_t single_resets = 0;                       // that write() was told of
  hal::FaultCause cause = hal::FaultCause::kDrive;       // of a faulted joint
  std::uint64_t stops = 0;                               // calls of stop()
  hal::StopCategory latched = hal::StopCategory::kWarn;  // by stop()

  hal::Pace pace() const noexcept override { return hal::Pace::kSimulatedClock; }
  hal::Phase phase() const noexcept override {
    if (cycles_ < bring_up_cycles) return hal::Phase::kBringUp;
    if (latched != hal::StopCategory::kWarn) return hal::Phase::kFault;
    if (latch_on_fault && faulted_joint >= 0) return hal::Phase::kFault;
    if (enabling_ > 0) return hal::Phase::kBringUp;
    return hal::Phase::kOperational;
  }
  std::string status_text() const override {
    return cycles_ < bring_up_cycles ? "elbow (node 2): waiting for 6041" : "the bus is cut";
  }

  Code read(const hal::CycleTime& time, hal::StateImage& state) noexcept override {
    ++cycles_;
    if (enabling_ > 0) --enabling_;
    const double dt = static_cast<double>(time.period_ns) * 1e-9;
    for (std::size_t j = 0; j < position_.size(); ++j) {
      const double before = position_[j];
      const bool faulted = faulted_joint == static_cast<int>(j);
      if (follows() && !faulted &&
          command_.mode()[j] == static_cast<std::int8_t>(hal::ControlMode::kPosition)) {
        position_[j] += kShare * (command_.position_rad()[j] - sag_rad - position_[j]);
      }
      velocity_[j] = (position_[j] - before) / dt;
      const bool lost = lost_joint == static_cast<int>(j);
      state.age_cycles()[j] = lost ? state.age_cycles()[j] + 1 : 0;
      if (lost) continue;
      state.position_rad()[j] = position_[j];
      state.velocity_rad_s()[j] = velocity_[j];
      state.mode()[j] = command_.mode()[j];
      state.fault()[j] = faulted ? fault_code : 0;
      state.drive_state()[j] =
          static_cast<std::uint8_t>(faulted     ? hal::DriveState::kFault
                                    : follows() ? hal::DriveState::kOperationEnabled
                                                : hal::DriveState::kSwitchOnDisabled);
    }
    for (std::size_t s = 0; s < state.sensor_age_cycles().size(); ++s) {
      const bool lost = lost_sensor == static_cast<int>(s);
      state.sensor_age_cycles()[s] = lost ? state.sensor_age_cycles()[s] + 1 : 0;
    }
    truth.cycle()[0] = time.cycle;
    truth.time_ns()[0] = time.time_ns;
    return answer;
  }
  Code write(const hal::CommandImage& command, const hal::ParameterImage&) noexcept override {
    command_.assign(command);
    for (std::size_t j = 0; j < position_.size(); ++j) {
      if (command.fault_reset()[j] == 0) continue;
      ++single_resets;
      if (reset_clears && faulted_joint == static_cast<int>(j)) faulted_joint = -1;
    }
    bool idle = true;
    for (const std::int8_t mode : command.mode()) idle = idle && mode == 0;
    if (idle) ++idle_writes;
    return Code::kOk;
  }
  void stop(hal::StopCategory category) noexcept override {
    latched = std::min(latched, category);
    ++stops;
    enabling_ = 0;
  }
  void reset() noexcept override {
    if (!reset_clears) return;
    latched = hal::StopCategory::kWarn;
    faulted_joint = lost_joint = -1;
    enabling_ = kEnablingCycles;
  }
  bool resets_one_joint() const noexcept override { return resets_alone; }
  hal::FaultCause fault_cause(std::size_t) const noexcept override { return cause; }
  bool shut_down() noexcept override { return ++shutting_down_ >= shut_down_cycles; }
  bool archive(Archive& ar) override {
    ar(position_, velocity_, command_, truth, cycles_, shutting_down_, enabling_, latched);
    return can_rewind;
  }
  bool can_rewind = true;
  void push(std::size_t joint, double position) { position_[joint] = position; }

 private:
  static constexpr std::uint64_t kEnablingCycles = 5;  // that a reset takes
  [[nodiscard]] bool follows() const {
    return enabling_ == 0 && latched >= hal::StopCategory::kHold;
  }

  std::vector<double> position_, velocity_;
  hal::CommandImage command_;
  std::uint64_t cycles_ = 0, shutting_down_ = 0, enabling_ = 0;
};

}  // namespace tandem::runtime::test
