// THE cycle: wait -> read -> check -> update -> limit -> write -> hand over.
// Start here to read the runtime. Layer: runtime.  Thread: made non-RT; step() the RT thread's.
#pragma once

#include <cstdint>
#include <vector>

#include "base/realtime.hpp"
#include "base/result.hpp"
#include "estimation/estimator.hpp"
#include "hal/backend.hpp"
#include "hal/command_limits.hpp"
#include "hal/config/robot_config.hpp"
#include "hal/cycle_observer.hpp"
#include "hal/truth.hpp"
#include "log/recorder.hpp"
#include "runtime/command_delay.hpp"
#include "runtime/controller_host.hpp"
#include "runtime/cycle_config.hpp"
#include "runtime/cycle_log.hpp"
#include "runtime/cycle_trace.hpp"
#include "runtime/fault.hpp"
#include "runtime/fault_watch.hpp"
#include "runtime/heartbeat.hpp"
#include "runtime/inbox.hpp"
#include "runtime/owner_controller.hpp"
#include "runtime/progress.hpp"
#include "runtime/run_machine.hpp"
#include "runtime/run_services.hpp"
#include "runtime/run_statistics.hpp"
#include "runtime/snapshot_port.hpp"

namespace tandem::runtime {

/// The parts that a cycle joins. All outlive it.
struct CycleParts {
  const hal::RobotConfig& robot;
  hal::Backend& backend;
  ControllerHost& controllers;
  rt::Clock& clock;
  log::Recorder* recorder = nullptr;           ///< null: nothing is logged. Not started yet.
  const hal::TruthImage* truth = nullptr;      ///< the simulation's, filled by backend.read()
  hal::CycleObserver* observer = nullptr;      ///< null: nobody watches
  RemoteCommandParts owner = {};               ///< for one in another process
  estimation::Estimator* estimator = nullptr;  ///< null: nothing is estimated
  SnapshotPort* snapshots = nullptr;           ///< null: nobody wants any while it runs
};

/// A run from bring-up to shut-down, cycle by cycle. step() is the cycle; RunMachine says which
/// phase comes next, FaultWatch what is wrong with the robot, Inbox what others ask for.
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
  /// For any thread: the end of the run, a reset, an emergency stop; simulated time.
  [[nodiscard]] Inbox& inbox() noexcept { return inbox_; }
  [[nodiscard]] const Inbox& inbox() const noexcept { return inbox_; }

  /// For any other thread: controllers and joints, while the run goes on.
  [[nodiscard]] RunServices& services() noexcept { return services_; }

  /// For any thread: whether the loop still cycles.
  [[nodiscard]] const Heartbeat& heartbeat() const noexcept { return heartbeat_; }
  [[nodiscard]] Heartbeat& heartbeat() noexcept { return heartbeat_; }

  [[nodiscard]] const Progress& progress() const noexcept { return progress_; }
  [[nodiscard]] RunPhase phase() const noexcept { return run_.phase(); }
  [[nodiscard]] const hal::StateImage& state() const noexcept { return state_; }
  [[nodiscard]] const hal::CommandImage& command() const noexcept { return command_; }

  /// Every fault so far, in the order of their times. Any thread.
  [[nodiscard]] std::vector<Fault> faults() const;
  [[nodiscard]] const FaultLog& fault_log() const noexcept { return faults_; }
  /// A drive's error code in words, with the cause that the run has latched of its joint; empty for
  /// 0. Any thread.
  [[nodiscard]] std::string drive_fault(std::size_t joint, std::uint32_t code) const;

  // Results, for when the run has stopped.
  [[nodiscard]] const rt::LoopStatistics& loop() const noexcept { return loop_.statistics(); }
  [[nodiscard]] const RunStatistics& statistics() const noexcept { return statistics_; }
  [[nodiscard]] const hal::CommandLimits& limits() const noexcept { return limits_; }
  [[nodiscard]] const CycleConfig& config() const noexcept { return config_; }
  [[nodiscard]] std::uint64_t running_cycles() const noexcept { return ran_; }
  [[nodiscard]] const CycleTrace& trace() const noexcept { return trace_; }

  /// Everything that the next step() depends on: backend, controllers, images, counters.
  /// Between two steps, with a simulated robot only; the log goes on where it is.
  /// Errors: a backend that cannot be rewound; bytes of another configuration; other controllers
  /// than those that were loaded then (nothing has changed after that one).
  [[nodiscard]] Result<std::vector<std::byte>> save();
  [[nodiscard]] Status restore(std::span<const std::byte> snapshot);
  /// What save() answers, into `ar`, which may be bounded; without `backend` all but its part,
  /// which comes last. Between two steps. @return false: the backend cannot be saved
  [[nodiscard]] bool write_down(Archive& ar, bool backend);

 private:
  // The cycle, in this order: robot_cycle.cpp.
  [[nodiscard]] rt::Tick wait() noexcept;
  void exchange(rt::Tick& tick) noexcept;
  void read() noexcept TANDEM_RT;
  void check(const rt::Tick& tick) noexcept TANDEM_RT;
  void update(const rt::Tick& tick) noexcept TANDEM_RT;
  void limit() noexcept TANDEM_RT;
  void write() noexcept TANDEM_RT;
  void hand_over() noexcept TANDEM_RT;

  // Their parts.
  void show_snapshot() noexcept;
  void check_backend(Code code) noexcept TANDEM_RT;
  void check_collisions() noexcept TANDEM_RT;
  void check_link() noexcept TANDEM_RT;
  [[nodiscard]] const hal::EstimateImage* estimate() const noexcept TANDEM_RT;
  void advance_phase() noexcept TANDEM_RT;
  void run_controllers() noexcept TANDEM_RT;
  void retreat_further() noexcept TANDEM_RT;
  void controllers_answered(Code code) noexcept TANDEM_RT;
  void start_controllers() noexcept TANDEM_RT;
  [[nodiscard]] bool go_on_from_robot() noexcept TANDEM_RT;
  [[nodiscard]] hal::CommandImage& controlled() noexcept TANDEM_RT;
  void stamp(hal::CommandImage& command) const noexcept TANDEM_RT;
  void offer_measured(hal::CommandImage& command) noexcept TANDEM_RT;
  void note_written(const hal::CommandImage& command) noexcept TANDEM_RT;
  [[nodiscard]] const hal::CommandImage& told() noexcept TANDEM_RT;
  void show() noexcept TANDEM_RT;
  void show_joints() noexcept TANDEM_RT;
  void show_sensors() noexcept TANDEM_RT;
  void show_gains() noexcept TANDEM_RT;
  void on(RunEvent event, bool holds_back = false) noexcept TANDEM_RT;
  void event(log::EventKind kind, std::int32_t joint = -1,
             std::uint32_t code = 0) noexcept TANDEM_RT;

  // What others ask for: robot_cycle_inbox.cpp.
  void take_inbox() noexcept TANDEM_RT;
  void take_requests() noexcept TANDEM_RT;
  [[nodiscard]] LoopAnswer carry_out(const LoopRequest& request) noexcept TANDEM_RT;
  [[nodiscard]] LoopAnswer may_lead(std::size_t joint, bool drives) const noexcept TANDEM_RT;
  [[nodiscard]] LoopAnswer may_start(ControllerSet start) const noexcept TANDEM_RT;
  [[nodiscard]] LoopAnswer leave_hold(ControllerSet stop, ControllerSet start) noexcept TANDEM_RT;
  [[nodiscard]] LoopAnswer go_on() noexcept TANDEM_RT;
  void log_request(const LoopRequest& request) noexcept TANDEM_RT;

  // An owner in another process: robot_cycle_owner.cpp.
  void await_owner() noexcept;
  hal::RemoteCommand follow_owner() noexcept TANDEM_RT;
  void assign_owner(bool owned) noexcept TANDEM_RT;
  void take_from_owner() noexcept TANDEM_RT;
  void take_gains(const hal::ParameterImage& wanted) noexcept TANDEM_RT;
  [[nodiscard]] bool has_owner() const noexcept TANDEM_RT;
  [[nodiscard]] hal::PortView port_view() noexcept TANDEM_RT;

  // From a fault to its reset: robot_cycle_faults.cpp.
  void fault(FaultRecord record) noexcept TANDEM_RT;
  void emergency_stop(EmergencyInput input, hal::StopCategory category,
                      std::int32_t controller = -1) noexcept TANDEM_RT;
  void react(hal::StopCategory category) noexcept TANDEM_RT;
  [[nodiscard]] bool retreat() noexcept TANDEM_RT;
  void note_stop() noexcept TANDEM_RT;
  /// A stop was latched in this cycle.
  [[nodiscard]] bool stops_now() const noexcept TANDEM_RT { return stopped_before_ > time_.cycle; }
  void begin_reset(std::uint64_t known) noexcept TANDEM_RT;
  void watch_reset() noexcept TANDEM_RT;
  void reset_done() noexcept TANDEM_RT;
  void reset_failed() noexcept TANDEM_RT;
  void hold_back() noexcept TANDEM_RT;
  [[nodiscard]] LoopAnswer reset_drive(std::size_t joint) noexcept TANDEM_RT;
  void set_gains(const LoopRequest& request) noexcept TANDEM_RT;
  void watch_drive_resets() noexcept TANDEM_RT;
  void hold_drives_in_reset(hal::CommandImage& command) noexcept TANDEM_RT;
  void drive_is_well(std::size_t joint) noexcept TANDEM_RT;

  // Joints whose position has to be found first: robot_cycle_homing.cpp.
  [[nodiscard]] LoopAnswer home_joint(std::size_t joint) noexcept TANDEM_RT;
  void watch_homing() noexcept TANDEM_RT;
  void home_at_start() noexcept TANDEM_RT;
  void hold_unhomed(hal::CommandImage& command) noexcept TANDEM_RT;
  void wait_for_homing() noexcept TANDEM_RT;
  [[nodiscard]] bool ends_unhomed() noexcept TANDEM_RT;
  /// The fault of a joint that controllers cannot have: why its homing failed, or that there was
  /// none.
  void not_homed(std::size_t joint) noexcept TANDEM_RT;
  [[nodiscard]] bool has_to_be_homed(std::size_t joint) const noexcept TANDEM_RT;
  [[nodiscard]] bool claims_unhomed(ControllerSet controllers) const noexcept TANDEM_RT;

  void archive(Archive& ar);

  const hal::RobotConfig* robot_;
  hal::Backend* backend_;
  ControllerHost* controllers_;
  rt::Clock* clock_;
  const hal::TruthImage* truth_;
  hal::CycleObserver* observer_;
  RemoteCommandParts owner_;
  estimation::Estimator* estimator_;
  SnapshotPort* snapshots_;
  CycleConfig config_;

  Inbox inbox_;
  rt::CyclicLoop loop_;
  RunMachine run_;

  hal::StateImage state_;
  hal::CommandImage command_;
  hal::CommandImage wanted_;  // by the controllers, when what they want is delayed
  hal::CommandImage told_;    // to log and statistics, when that is not command_
  // In this cycle, position references of joints outside position control.
  std::vector<std::uint8_t> written_;
  std::vector<double> written_rad_;
  CommandDelay delay_;
  hal::CommandLimits limits_;

  FaultWatch watch_;
  FaultLog faults_;
  CycleLog log_;
  RunStatistics statistics_;
  CycleTrace trace_;
  Progress progress_;
  Heartbeat heartbeat_;
  RunServices services_;
  std::vector<JointStatus> joints_;    // as services_ shows them
  std::uint64_t shown_gains_ = 0;      // their revision, as services_ shows them
  std::vector<SensorStatus> sensors_;  // the same

  hal::CycleTime time_;        // this cycle's
  std::int64_t begin_ns_ = 0;  // clock time
  std::int64_t wakeup_ns_ = -1;
  Code read_code_ = Code::kOk;
  bool started_ = false;                     // the first cycle was
  bool controlling_ = false;                 // controllers are started
  bool ends_with_command_ = false;           // controllers wrote in this cycle
  bool brakes_ = false;                      // a stop has found joints that nobody has any more
  ControllerSet held_back_ = 0;              // active before the reset
  ControllerSet before_retreat_ = 0;         // active then
  std::uint64_t ran_ = 0;                    // cycles of kRunning
  std::uint64_t stopped_before_ = 0;         // Progress::stopped_before
  std::vector<std::uint8_t> joint_limited_;  // noted once each
  std::vector<std::uint8_t> causes_;         // for the owner
  std::uint64_t reset_cycles_;               // that the reset of one drive may take
  std::vector<std::uint64_t> resets_;        // by joint: cycles that are left of it
  std::vector<std::size_t> homes_;           // the joints that have a homing
  std::vector<hal::Homing> homings_;         // by joint: as the backend said last
  bool homes_at_start_ = false;              // joints whose homing nobody has to ask for
};

}  // namespace tandem::runtime
