// THE cycle: wait -> read -> check -> update -> limit -> write -> hand over.
// Start here to read the runtime. Layer: runtime.  Thread: made non-RT; step() the RT thread's.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <vector>

#include "base/realtime.hpp"
#include "base/result.hpp"
#include "hal/backend.hpp"
#include "hal/command_limits.hpp"
#include "hal/robot_config.hpp"
#include "hal/truth.hpp"
#include "log/recorder.hpp"
#include "rt/cyclic_loop.hpp"
#include "runtime/controller_host.hpp"
#include "runtime/cycle_trace.hpp"
#include "runtime/fault.hpp"
#include "runtime/progress.hpp"
#include "runtime/run_statistics.hpp"

namespace tandem::runtime {

struct CycleConfig {
  rt::LoopConfig loop{};
  std::uint64_t running_cycles = 0;        ///< that controllers run; 0: until stopped
  std::uint64_t bring_up_cycles = 20'000;  ///< at most, then the run ends in a fault
  std::uint64_t settle_cycles = 0;         ///< every joint is held, from enabled to kRunning
  std::uint64_t shut_down_cycles = 2'000;  ///< at most
  std::uint32_t lost_after_cycles = 10;    ///< feedback older than this is a lost joint or sensor
  std::size_t trace_cycles = 0;            ///< the last that trace() keeps: 6 clock reads each
};

/// The parts that a cycle joins. All outlive it.
struct CycleParts {
  const hal::RobotConfig& robot;
  hal::Backend& backend;
  ControllerHost& controllers;
  rt::Clock& clock;
  log::Recorder* recorder = nullptr;       ///< null: nothing is logged. Not started yet.
  const hal::TruthImage* truth = nullptr;  ///< the simulation's, filled by backend.read()
};

/// A run from bring-up to shut-down, cycle by cycle:
///
///   kBringUp   -> kSettling   when the backend says that every axis follows the command
///   kSettling  -> kRunning    after settle_cycles, in which every joint is held where it is
///   kRunning   -> kShutDown   after running_cycles, when every controller is done, when a stop
///                             is requested, or in a fault (stop category 0 or 1)
///   kRunning   -> kHolding    in a fault of a joint with stop category "hold"; then, when the
///                             time is over or a stop is requested, kShutDown
///   kShutDown  -> kDone       when the drives are disabled
class RobotCycle {
 public:
  /// Adds the recorder's channels and starts it. Allocates all that the cycle needs.
  RobotCycle(const CycleParts& parts, const CycleConfig& config);

  /// One cycle. False once the run is done.
  bool step() noexcept;
  /// Steps until the run is done.
  void run() noexcept {
    while (step()) {
    }
  }
  /// Asks for the end, from any thread: the robot is shut down in order.
  void request_stop() noexcept { stop_requested_.store(true, std::memory_order_relaxed); }

  [[nodiscard]] const Progress& progress() const noexcept { return progress_; }
  [[nodiscard]] RunPhase phase() const noexcept { return phase_; }
  [[nodiscard]] const hal::StateImage& state() const noexcept { return state_; }
  [[nodiscard]] const hal::CommandImage& command() const noexcept { return command_; }

  // Results, for when the run has stopped.
  [[nodiscard]] const rt::LoopStatistics& loop() const noexcept { return loop_.statistics(); }
  [[nodiscard]] const RunStatistics& statistics() const noexcept { return statistics_; }
  [[nodiscard]] const hal::CommandLimits& limits() const noexcept { return limits_; }
  [[nodiscard]] std::vector<Fault> faults() const;
  [[nodiscard]] std::uint64_t running_cycles() const noexcept { return ran_; }
  [[nodiscard]] const CycleTrace& trace() const noexcept { return trace_; }

  /// Everything that the next step() depends on: backend, controllers, images, counters.
  /// Between two steps, with a simulated robot only; the log goes on where it is.
  /// Errors: a backend that cannot be rewound; bytes of another configuration.
  [[nodiscard]] Result<std::vector<std::byte>> save();
  [[nodiscard]] Status restore(std::span<const std::byte> snapshot);

 private:
  [[nodiscard]] rt::Tick wait() noexcept;
  void exchange() noexcept;
  void read() noexcept TANDEM_RT;
  void check(const rt::Tick& tick) noexcept TANDEM_RT;
  void update(const rt::Tick& tick) noexcept TANDEM_RT;
  void limit() noexcept TANDEM_RT;
  void write() noexcept TANDEM_RT;
  void hand_over() noexcept TANDEM_RT;
  void cycle(const rt::Tick& tick) noexcept TANDEM_RT;

  void advance_phase() noexcept TANDEM_RT;
  void check_backend(Code code) noexcept TANDEM_RT;
  void check_joints() noexcept TANDEM_RT;
  void check_sensors() noexcept TANDEM_RT;
  void fault(FaultSource source, std::int32_t index, std::uint32_t code) noexcept TANDEM_RT;
  void react(hal::StopCategory category) noexcept TANDEM_RT;
  void run_controllers() noexcept TANDEM_RT;
  void go(RunPhase next) noexcept TANDEM_RT;
  void event(log::EventKind kind, std::int32_t joint = -1,
             std::uint32_t code = 0) noexcept TANDEM_RT;
  void trace_wait(const rt::Tick& tick) noexcept TANDEM_RT;
  void mark(Stage stage) noexcept TANDEM_RT;
  void mark(Stage stage, std::int64_t now_ns) noexcept TANDEM_RT;
  void archive(Archive& ar);
  [[nodiscard]] Fault tell(const FaultRecord& record) const;

  const hal::RobotConfig* robot_;
  hal::Backend* backend_;
  ControllerHost* controllers_;
  rt::Clock* clock_;
  log::Recorder* recorder_;
  const hal::TruthImage* truth_;
  CycleConfig config_;

  rt::CyclicLoop loop_;
  hal::StateImage state_;
  hal::CommandImage command_;
  hal::ParameterImage parameters_;
  hal::CommandLimits limits_;
  RunStatistics statistics_;

  hal::CycleTime time_;
  RunPhase phase_ = RunPhase::kBringUp;
  bool started_ = false;      // the first cycle was
  bool disable_ = false;      // stop category 0: no torque at once
  bool joint_fault_ = false;  // some joint is or was in fault
  Code read_code_ = Code::kOk;
  std::uint64_t phase_began_ = 0;                                          // cycle
  std::uint64_t ran_ = 0;                                                  // cycles of kRunning
  std::vector<std::uint8_t> joint_faulted_, sensor_lost_, joint_limited_;  // noted once each
  std::array<FaultRecord, 64> faults_{};
  std::size_t fault_count_ = 0;

  log::Recorder::Channel state_channel_ = 0, command_channel_ = 0, truth_channel_ = 0;
  std::atomic<bool> stop_requested_{false};
  Progress progress_;
  CycleTrace trace_;
  CycleStamps* stamps_ = nullptr;  // this cycle's; null: not traced
  std::int64_t finished_ns_ = 0;   // clock time at which the last cycle was done; 0: none was
};

}  // namespace tandem::runtime
