// The whole robot in this process: drive master, buses, boards' firmware, sensor nodes and plant,
// as one backend. Nothing of the chain is left out but the wire itself.
// Layer: hal/sim.  Thread: create non-RT; the rest the loop's thread.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "firmware_emu/board.hpp"
#include "firmware_emu/sensor_board.hpp"
#include "hal/backend.hpp"
#include "hal/ethercat-can/drive_master.hpp"
#include "hal/ethercat-can/loopback.hpp"
#include "hal/sim/plant.hpp"
#include "hal/sim/sensors.hpp"
#include "hal/sim/truth.hpp"

namespace tandem::sim {

/// How to simulate; [sim] of an experiment.
struct SimRobotConfig {
  std::int64_t period_ns = 1'000'000;  ///< of the loop
  Integrator integrator = Integrator::kSemiImplicitEuler;
  std::int64_t substep_ns = 250'000;
  std::string posture;                      ///< where the robot starts; empty: every joint at 0
  bool hold = true;                         ///< hoist and brakes until every drive is enabled
  std::int64_t release_ns = 1'000'000'000;  ///< in which the hoist lets the base down
  std::uint64_t seed = 1;                   ///< of every measurement's noise
  bool truth = true;                        ///< keep truth() up to date
  double rate_limit = 1000.0;  ///< any rate beyond it [rad/s or m/s] counts as diverged
};

/// What read() does, in this order, from cycle k-1 to cycle k.
enum class Stage : std::uint8_t {
  kPlant,         ///< physics, in sub-steps of the plant, up to the time of cycle k
  kMasterSync,    ///< the master sends SYNC k
  kSense,         ///< accelerations, forces and sensors' truth at cycle k
  kBoards,        ///< frames to the boards; firmware and controllers; their answers
  kMasterDecode,  ///< the master fills the state image
  kTruth,         ///< the true state is copied for the log
};
inline constexpr std::size_t kStages = 6;

/// Lock step: boards sample at SYNC k and compute what their bridges do until k+1, with what the
/// loop sent in cycle k-1. A board with a shorter control period than the loop's runs in between.
///
/// With `hold` the robot powers on hanging from a hoist, every joint whose bridge is off held by a
/// brake. When all axes are in Operation Enabled the hoist lets it down, while the boards hold
/// their positions; then phase() turns operational and commands are used.
class SimRobot final : public hal::Backend {
 public:
  /// @param robot    complete: limits filled in from the description
  /// @param kernels  of this robot; outlive it
  /// Errors: those of Plant, Sensors and DriveMaster; a posture, board or sensor that cannot be;
  /// a sub-step that is unstable in the posture (names the joint and the longest that is not).
  [[nodiscard]] static Result<std::unique_ptr<SimRobot>> create(const hal::RobotConfig& robot,
                                                                const tandem_kernels* kernels,
                                                                const SimRobotConfig& config);

  [[nodiscard]] hal::Pace pace() const noexcept override { return hal::Pace::kSimulatedClock; }
  [[nodiscard]] hal::Phase phase() const noexcept override;
  [[nodiscard]] std::string status_text() const override;
  [[nodiscard]] Code read(const hal::CycleTime& time,
                          hal::StateImage& state) noexcept TANDEM_RT override;
  [[nodiscard]] Code write(const hal::CommandImage& command,
                           const hal::ParameterImage& parameters) noexcept TANDEM_RT override;
  [[nodiscard]] bool shut_down() noexcept TANDEM_RT override { return master_->shut_down(); }
  [[nodiscard]] bool archive(Archive& ar) override;

  /// The true state at the last read(), when `truth` was asked for.
  [[nodiscard]] const hal::TruthImage& truth() const noexcept { return truth_; }
  [[nodiscard]] const Plant& plant() const noexcept { return plant_; }
  [[nodiscard]] const hal::can::DriveMaster& master() const noexcept { return *master_; }
  [[nodiscard]] std::span<const std::unique_ptr<hal::can::LoopbackBus>> buses() const noexcept {
    return buses_;
  }

  /// Faults to inject: joint `joint`'s link encoder gives no number for the next `cycles`.
  void unplug_encoder(std::size_t joint, std::uint32_t cycles) noexcept {
    unplugged_[joint] = cycles;
  }
  /// A cut (or mended) cable: nobody on bus `bus` hears anybody.
  void connect_bus(std::size_t bus, bool connected) noexcept {
    buses_[bus]->set_connected(connected);
  }

  /// Calls `hook(context, stage)` at the end of every stage of read(): what takes the time is
  /// bench/'s question, and no clock is read here. Null: none.
  void set_stage_hook(void (*hook)(void* context, Stage finished), void* context) noexcept {
    hook_ = hook;
    hook_context_ = context;
  }

 private:
  struct BoardNode {
    std::unique_ptr<firmware::Board> board;
    std::size_t bus;
    std::vector<std::size_t> joints;  // by axis
    std::size_t first;                // of its axes in sense_ and drive_
  };
  struct SensorNode {
    std::unique_ptr<firmware::SensorBoard> board;
    std::size_t bus;
    std::size_t first, channels;  // in sensor_truth_
  };

  SimRobot(const hal::RobotConfig& robot, const SimRobotConfig& config, Plant plant,
           Sensors sensors);
  Status add_nodes(const hal::RobotConfig& robot, const SimRobotConfig& config);

  [[nodiscard]] Code advance_to(std::int64_t time_ns) noexcept;
  void sense() noexcept;
  void deliver() noexcept;
  void run_boards() noexcept;
  void let_down(const hal::StateImage& state) noexcept;
  void finished(Stage stage) noexcept {
    if (hook_ != nullptr) hook_(hook_context_, stage);
  }

  Plant plant_;
  Sensors sensors_;
  TruthFiller truth_filler_;
  hal::TruthImage truth_;
  bool keep_truth_;
  std::vector<std::unique_ptr<hal::can::LoopbackBus>> buses_;
  std::unique_ptr<hal::can::DriveMaster> master_;
  std::vector<BoardNode> boards_;
  std::vector<SensorNode> sensor_nodes_;
  std::vector<double> supply_V_;  // per joint
  std::vector<firmware::AxisSense> sense_;
  std::vector<firmware::AxisDrive> drive_;
  std::vector<double> sensor_truth_;
  std::vector<std::uint32_t> unplugged_;  // cycles left, per joint
  hal::CommandImage posture_;             // held while the hoist lets down
  std::int64_t tick_ns_;                  // boards run every so often
  std::int64_t now_ns_ = 0;
  std::uint8_t started_ = 0, letting_down_ = 0;
  void (*hook_)(void*, Stage) = nullptr;
  void* hook_context_ = nullptr;
};

}  // namespace tandem::sim
