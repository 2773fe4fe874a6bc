// THE cycle: wait -> read -> check -> update -> limit -> write -> hand over.
// Start here to read the runtime. Layer: runtime.  Thread: made non-RT; step() the RT thread's.
#pragma once

#include <cstdint>
#include <vector>

#include "base/realtime.hpp"
#include "base/result.hpp"
#include "hal/backend.hpp"
#include "hal/command_limits.hpp"
#include "hal/config/robot_config.hpp"
#include "hal/cycle_observer.hpp"
#include "hal/truth.hpp"
#include "log/recorder.hpp"
#include "rt/clock_control.hpp"
#include "rt/cyclic_loop.hpp"
#include "runtime/after_stop.hpp"
#include "runtime/command_delay.hpp"
#include "runtime/controller_host.hpp"
#include "runtime/cycle_trace.hpp"
#include "runtime/fall_watch.hpp"
#include "runtime/fault.hpp"
#include "runtime/heartbeat.hpp"
#include "runtime/owner_controller.hpp"
#include "runtime/progress.hpp"
#include "runtime/requests.hpp"
#include "runtime/run_services.hpp"
#include "runtime/run_statistics.hpp"

namespace tandem::runtime {

struct CycleConfig {
  rt::LoopConfig loop{};
  std::uint64_t running_cycles = 0;        ///< that controllers run; 0: until stopped
  std::uint64_t bring_up_cycles = 20'000;  ///< at most, then the run ends in a fault
  std::uint64_t settle_cycles = 0;         ///< every joint is held, from enabled to kRunning
  std::uint64_t shut_down_cycles = 2'000;  ///< at most
  AfterStop after_stop = AfterStop::kEnd;
  AfterReset after_reset = AfterReset::kHold;
  /// Of a controller that writes what it has not claimed, which never reaches a drive.
  hal::StopCategory on_stray = hal::StopCategory::kWarn;
  std::uint64_t retreat_cycles = 5'000;  ///< at most, in a stop of category 2
  std::uint32_t lost_after_cycles = 10;  ///< feedback older than this is a lost joint or sensor
  std::uint32_t delay_cycles = 0;        ///< between the controllers and the limits
  FallLimits fall = {};                  ///< watched where there is truth
  std::size_t trace_cycles = 0;          ///< the last that trace() keeps: 6 clock reads each
};

/// The parts that a cycle joins. All outlive it.
struct CycleParts {
  const hal::RobotConfig& robot;
  hal::Backend& backend;
  ControllerHost& controllers;
  rt::Clock& clock;
  log::Recorder* recorder = nullptr;       ///< null: nothing is logged. Not started yet.
  const hal::TruthImage* truth = nullptr;  ///< the simulation's, filled by backend.read()
  hal::CycleObserver* observer = nullptr;  ///< null: nobody watches
  RemoteCommandParts owner = {};           ///< for one in another process
};

/// A run from bring-up to shut-down, cycle by cycle:
///
///   kBringUp   -> kSettling   when the backend says that every axis follows the command
///   kSettling  -> kRunning    after settle_cycles, in which every joint is held where it is
///   kRunning   -> kShutDown   after running_cycles, when every active controller is done (there is
///                             one, and all came with the experiment), when the end is requested,
///                             or in a fault with AfterStop::kEnd
///   any        -> kFaulted    in a fault of category "hold", 0 or 1: the stop is carried out and
///                             latched. Bring-up and shut-down excepted.
///   kRunning   -> kRetreating in a fault of category 2, when a controller can bring the robot to a
///                             safe posture; to kFaulted when it has, or after retreat_cycles. With
///                             none that can it is category 1.
///   kFaulted   -> kResetting  when a reset is requested: every joint is enabled where it is
///   kResetting -> kHeld       when they follow; back to kFaulted when a cause is still there.
///                             kSettling with AfterReset::kContinue, or when no controller was
///                             active
///   kHeld      -> kRunning    when a controller is started, or all that were active, none jumps
///   kShutDown  -> kDone       when the drives are disabled
class RobotCycle {
 public:
  /// Adds the recorder's channels and starts it. Allocates all that the cycle needs.
  RobotCycle(const CycleParts& parts, const CycleConfig& config);
  ~RobotCycle();
  RobotCycle(const RobotCycle&) = delete;
  RobotCycle& operator=(const RobotCycle&) = delete;

  /// One cycle. False once the run is done.
  bool step() noexcept;
  /// Steps until the run is done.
  void run() noexcept {
    while (step()) {
    }
  }
  /// For any thread: the end of the run, a reset, an emergency stop.
  [[nodiscard]] Requests& requests() noexcept { return requests_; }

  /// For any other thread: controllers and joints, while the run goes on.
  [[nodiscard]] RunServices& services() noexcept { return services_; }

  /// For any thread: pause, resume, step and rate of simulated time.
  [[nodiscard]] rt::ClockControl& clock_control() noexcept { return clock_control_; }
  [[nodiscard]] const rt::ClockControl& clock_control() const noexcept { return clock_control_; }

  /// For any thread: whether the loop still cycles.
  [[nodiscard]] const Heartbeat& heartbeat() const noexcept { return heartbeat_; }

  [[nodiscard]] const Progress& progress() const noexcept { return progress_; }
  [[nodiscard]] RunPhase phase() const noexcept { return phase_; }
  [[nodiscard]] const hal::StateImage& state() const noexcept { return state_; }
  [[nodiscard]] const hal::CommandImage& command() const noexcept { return command_; }

  /// Every fault so far, in the order of their times. Any thread.
  [[nodiscard]] std::vector<Fault> faults() const;
  [[nodiscard]] const FaultLog& fault_log() const noexcept { return faults_; }

  // Results, for when the run has stopped.
  [[nodiscard]] const rt::LoopStatistics& loop() const noexcept { return loop_.statistics(); }
  [[nodiscard]] const RunStatistics& statistics() const noexcept { return statistics_; }
  [[nodiscard]] const hal::CommandLimits& limits() const noexcept { return limits_; }
  [[nodiscard]] std::uint64_t running_cycles() const noexcept { return ran_; }
  [[nodiscard]] const CycleTrace& trace() const noexcept { return trace_; }

  /// Everything that the next step() depends on: backend, controllers, images, counters.
  /// Between two steps, with a simulated robot only; the log goes on where it is.
  /// Errors: a backend that cannot be rewound; bytes of another configuration; other controllers
  /// than those that were loaded then (nothing has changed after that one).
  [[nodiscard]] Result<std::vector<std::byte>> save();
  [[nodiscard]] Status restore(std::span<const std::byte> snapshot);

 private:
  [[nodiscard]] rt::Tick wait() noexcept;
  void exchange(rt::Tick& tick) noexcept;
  void read() noexcept TANDEM_RT;
  void check(const rt::Tick& tick) noexcept TANDEM_RT;
  void update(const rt::Tick& tick) noexcept TANDEM_RT;
  void limit() noexcept TANDEM_RT;
  void write() noexcept TANDEM_RT;
  void hand_over() noexcept TANDEM_RT;
  void show() noexcept TANDEM_RT;
  void sense(const rt::Tick& tick) noexcept TANDEM_RT;
  void act(const rt::Tick& tick) noexcept TANDEM_RT;

  void advance_phase() noexcept TANDEM_RT;
  void check_backend(Code code) noexcept TANDEM_RT;
  void check_joints() noexcept TANDEM_RT;
  void check_sensors() noexcept TANDEM_RT;
  void check_fall() noexcept TANDEM_RT;
  [[nodiscard]] bool time_is_over(std::uint64_t in_phase) const noexcept TANDEM_RT;

  // robot_cycle_owner.cpp
  void await_owner() noexcept;
  void follow_owner() noexcept TANDEM_RT;
  void seat_owner(bool owned) noexcept TANDEM_RT;
  void take_gains(const hal::ParameterImage& wanted) noexcept TANDEM_RT;
  [[nodiscard]] bool has_owner() const noexcept TANDEM_RT;
  [[nodiscard]] hal::PortView port_view() noexcept TANDEM_RT;

  // robot_cycle_services.cpp
  void take_services() noexcept TANDEM_RT;
  [[nodiscard]] LoopAnswer leave_hold(ControllerSet stop, ControllerSet start) noexcept TANDEM_RT;
  [[nodiscard]] LoopAnswer go_on() noexcept TANDEM_RT;
  [[nodiscard]] LoopAnswer carry_out(const LoopRequest& request) noexcept TANDEM_RT;
  void note_service(const LoopRequest& request) noexcept TANDEM_RT;
  void show_joints() noexcept TANDEM_RT;

  // robot_cycle_faults.cpp
  void take_requests() noexcept TANDEM_RT;
  void emergency_stop(EmergencyInput input, hal::StopCategory category,
                      std::int32_t controller = -1) noexcept TANDEM_RT;
  [[nodiscard]] bool in_fault(std::size_t joint) const noexcept TANDEM_RT;
  [[nodiscard]] bool is_lost(std::size_t joint) const noexcept TANDEM_RT;
  void fault(FaultRecord record) noexcept TANDEM_RT;
  void react(hal::StopCategory category) noexcept TANDEM_RT;
  [[nodiscard]] bool retreat() noexcept TANDEM_RT;
  void begin_reset() noexcept TANDEM_RT;
  void watch_reset() noexcept TANDEM_RT;
  void reset_done() noexcept TANDEM_RT;
  void hold_back() noexcept TANDEM_RT;
  void reset_failed() noexcept TANDEM_RT;
  [[nodiscard]] bool is_there(const FaultRecord& record) const noexcept TANDEM_RT;

  void run_controllers() noexcept TANDEM_RT;
  void go_on_retreating() noexcept TANDEM_RT;
  void controllers_answered(Code code) noexcept TANDEM_RT;
  void start_controllers() noexcept TANDEM_RT;
  [[nodiscard]] bool go_on_from_robot() noexcept TANDEM_RT;
  void stamp(hal::CommandImage& command) const noexcept TANDEM_RT;
  /// The image that controllers write.
  [[nodiscard]] hal::CommandImage& controlled() noexcept TANDEM_RT {
    return delay_.on() ? wanted_ : command_;
  }
  void go(RunPhase next) noexcept TANDEM_RT;
  void event(log::EventKind kind, std::int32_t joint = -1,
             std::uint32_t code = 0) noexcept TANDEM_RT;
  void trace_wait(const rt::Tick& tick) noexcept TANDEM_RT;
  void mark(Stage stage) noexcept TANDEM_RT;
  void mark(Stage stage, std::int64_t now_ns) noexcept TANDEM_RT;
  void archive(Archive& ar);
  [[nodiscard]] Fault tell(std::size_t number) const;

  const hal::RobotConfig* robot_;
  hal::Backend* backend_;
  ControllerHost* controllers_;
  rt::Clock* clock_;
  log::Recorder* recorder_;
  const hal::TruthImage* truth_;
  hal::CycleObserver* observer_;
  RemoteCommandParts seat_;
  CycleConfig config_;

  rt::Doorbell bell_;  // rings when a loop that blocks has something to look at
  rt::ClockControl clock_control_;
  rt::CyclicLoop loop_;
  hal::StateImage state_;
  hal::CommandImage command_;
  hal::CommandImage wanted_;  // by the controllers, when what they want is delayed
  CommandDelay delay_;
  hal::ParameterImage parameters_;
  hal::CommandLimits limits_;
  RunStatistics statistics_;
  FallWatch fall_watch_;

  hal::CycleTime time_;
  std::int64_t begin_ns_ = 0;  // clock time
  std::int64_t wakeup_ns_ = -1;
  RunPhase phase_ = RunPhase::kBringUp;
  bool started_ = false;                                   // the first cycle was
  bool controlling_ = false;                               // controllers are started
  ControllerSet held_back_ = 0;                            // active before the reset
  ControllerSet before_retreat_ = 0;                       // active then
  bool joint_fault_ = false;                               // of some joint one is latched
  hal::StopCategory reaction_ = hal::StopCategory::kWarn;  // the hardest that is latched
  Code read_code_ = Code::kOk;
  std::uint64_t phase_began_ = 0;                                          // cycle
  std::uint64_t spent_ = 0;                                                // of running_cycles
  std::uint64_t ran_ = 0;                                                  // cycles of kRunning
  std::vector<std::uint8_t> joint_faulted_, sensor_lost_, joint_limited_;  // noted once each
  std::vector<std::uint8_t> causes_;                                       // for the owner
  FaultLog faults_;

  log::Recorder::Channel state_channel_ = 0, command_channel_ = 0, truth_channel_ = 0;
  Requests requests_{bell_};
  Progress progress_;
  Heartbeat heartbeat_;
  LoopMailbox mailbox_;
  RunServices services_;
  std::vector<JointStatus> looks_;
  CycleTrace trace_;
  CycleStamps* stamps_ = nullptr;  // this cycle's; null: not traced
  std::int64_t finished_ns_ = 0;   // clock time at which the last cycle was done; 0: none was
};

}  // namespace tandem::runtime
