// The whole robot in this process: drive master, buses, boards' firmware, sensor nodes and plant,
// as one backend. Nothing of the chain is left out but the wire itself.
// Layer: hal/sim.  Thread: create non-RT; the rest the loop's thread.
#pragma once

#include <atomic>
#include <memory>
#include <string>

#include "base/spsc_ring.hpp"
#include "hal/ethercat-can/drive_backend.hpp"
#include "hal/sim/emulated_robot.hpp"
#include "hal/sim/in_process_line.hpp"
#include "hal/sim/truth.hpp"

namespace tandem::sim {

/// The emulated robot with its master: in lock step, SYNC k starts a step.
class SimRobot final : public hal::can::DriveBackend {
 public:
  /// Errors: those of EmulatedRobot and DriveMaster.
  [[nodiscard]] static Result<std::unique_ptr<SimRobot>> create(const hal::RobotConfig& robot,
                                                                const tandem_kernels* kernels,
                                                                const SimRobotConfig& config);

  [[nodiscard]] hal::Pace pace() const noexcept override { return hal::Pace::kSimulatedClock; }
  [[nodiscard]] hal::Phase phase() const noexcept override;
  [[nodiscard]] std::string status_text() const override;
  [[nodiscard]] Code read(const hal::CycleTime& time,
                          hal::StateImage& state) noexcept TANDEM_RT override;
  [[nodiscard]] hal::InjectedFault next_injected() noexcept TANDEM_RT override;
  void heed(hal::Outside& outside) noexcept override { outside_ = &outside; }
  std::size_t forget_waiting() noexcept override;
  [[nodiscard]] bool archive(Archive& ar) override;

  /// The true state at the last read(), when `truth` was asked for.
  [[nodiscard]] const hal::TruthImage& truth() const noexcept { return truth_; }
  [[nodiscard]] const Plant& plant() const noexcept { return robot_->plant(); }
  [[nodiscard]] EmulatedRobot& robot() noexcept { return *robot_; }

  /// Injects a fault from one other thread: it is added before the next cycle.
  /// @return false: too many wait.
  [[nodiscard]] bool post(const ScenarioFault& fault);

  void set_stage_hook(StageHook hook) noexcept {
    hook_ = hook;
    robot_->set_stage_hook(hook);
  }

 private:
  SimRobot(std::unique_ptr<EmulatedRobot> robot, std::vector<std::unique_ptr<InProcessLine>> lines,
           std::unique_ptr<hal::can::DriveMaster> master, bool keep_truth);

  std::unique_ptr<EmulatedRobot> robot_;
  std::vector<std::unique_ptr<InProcessLine>> lines_;  ///< EtherCAT
  TruthFiller truth_filler_;
  hal::TruthImage truth_;
  bool keep_truth_;
  SpscRing posted_{sizeof(ScenarioFault), 16};
  std::atomic<std::size_t> room_;  // for faults, after the last cycle
  hal::Outside own_outside_;
  hal::Outside* outside_ = &own_outside_;
  StageHook hook_;
};

}  // namespace tandem::sim
