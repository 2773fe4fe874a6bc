// THE cycle: wait -> read -> check -> update -> limit -> write -> hand over.
// Start here to read the runtime. Layer: runtime.  Thread: made non-RT; step() the RT thread's.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "hal/text_event.hpp"
#include "runtime/cycle_requests.hpp"
#include "runtime/cycle_trace.hpp"
#include "runtime/hand_over.hpp"
#include "runtime/heartbeat.hpp"
#include "runtime/owner_follower.hpp"

namespace tandem::runtime {

/// A run from bring-up to shut-down, cycle by cycle. step() is the cycle. RunMachine says which
/// phase comes next, FaultWatch what is wrong with the robot, JointArbiter who leads a joint.
class RobotCycle {
 public:
  /// Adds the recorder's channels and starts it. Allocates all that the cycle needs.
  RobotCycle(const CycleParts& parts, const CycleConfig& config);

  /// One cycle. False once the run is done.
  bool step() noexcept { return begin() && finish(); }
  /// The halves of step(), for who commands joints between them, in the thread of the loop: the
  /// state is read and checked, and the controllers come next. Both are false once the run is done.
  bool begin() noexcept;
  /// @pre begin() was called, and was true
  bool finish() noexcept;
  /// Between the halves, in the thread of the loop: carries out what services() were asked for, as
  /// finish() would now, and shows them the state that was read. @pre as finish()'s
  void attend() noexcept;
  /// Steps until the run is done.
  void run() noexcept {
    while (step()) {
    }
  }
  /// For any thread: the end of the run, a reset, an emergency stop; simulated time.
  [[nodiscard]] Inbox& inbox() noexcept { return now_.inbox; }
  [[nodiscard]] const Inbox& inbox() const noexcept { return now_.inbox; }
  /// For any other thread: controllers and joints, while the run goes on.
  [[nodiscard]] RunServices& services() noexcept { return services_; }
  /// For any thread: whether the loop still cycles.
  [[nodiscard]] const Heartbeat& heartbeat() const noexcept { return heartbeat_; }
  [[nodiscard]] Heartbeat& heartbeat() noexcept { return heartbeat_; }

  [[nodiscard]] const Progress& progress() const noexcept { return now_.progress; }
  [[nodiscard]] RunPhase phase() const noexcept { return now_.run.phase(); }
  [[nodiscard]] const hal::StateImage& state() const noexcept { return now_.state; }
  [[nodiscard]] const hal::CommandImage& command() const noexcept { return arbiter_.command(); }
  /// While simulated time stands: shows the last cycle once more, to one who did not see it. Any
  /// thread but the loop's. @return false: time goes on, or there was no cycle yet
  bool show_last_cycle(hal::CycleObserver& observer) const;
  /// Who led `joint` in the last cycle. Between two steps.
  [[nodiscard]] JointLead lead(std::size_t joint) const noexcept { return arbiter_.lead(joint); }

  /// For ControllerHost::name(): whose command was the first of `joint` that a limit changed; -1:
  /// no controller's. Between two steps.
  [[nodiscard]] std::int32_t limited(std::size_t joint) const noexcept {
    return std::max(limited_[joint].controller, -1);
  }
  /// What that was; of kind kNone where there was none.
  [[nodiscard]] const hal::LimitMet& first_limited(std::size_t joint) const noexcept {
    return limited_[joint].met;
  }

  /// Every fault so far, in the order of their times. Any thread.
  [[nodiscard]] std::vector<FaultReport> faults() const;
  /// A joint's first command that a limit changed; once more when it is the first one of a
  /// controller, as in the log.
  struct LimitReport {
    double time_s = 0.0;
    std::uint64_t cycle = 0;
    std::string joint;
    std::string text;  ///< "the position reference 4 rad is beyond 3.14 rad, by 'squat'"
  };
  /// Those after the first `seen`, which counts on. Any thread.
  [[nodiscard]] std::vector<LimitReport> limits_met(std::uint64_t& seen) const;
  [[nodiscard]] const FaultLog& fault_log() const noexcept { return now_.faults; }
  /// A drive's error code in words, with the cause that the run has latched of its joint; empty for
  /// 0. Any thread.
  [[nodiscard]] std::string drive_fault(std::size_t joint, std::uint32_t code) const;

  // Results, for when the run has stopped.
  [[nodiscard]] const rt::CycleStatistics& loop() const noexcept { return now_.loop.statistics(); }
  [[nodiscard]] const RunStatistics& statistics() const noexcept { return shown_.statistics(); }
  [[nodiscard]] const CycleConfig& config() const noexcept { return now_.config; }
  [[nodiscard]] std::uint64_t running_cycles() const noexcept { return arbiter_.running_cycles(); }
  [[nodiscard]] const CycleTrace& trace() const noexcept { return trace_; }

  /// Everything that the next step() depends on: backend, controllers, images, counters.
  /// Between two steps, or the halves of one; with a simulated robot only; the log goes on where it
  /// is. A snapshot of between the halves is restored between halves.
  /// Errors: a backend that cannot be rewound; bytes of another configuration; another identity, or
  /// other controllers than those that were loaded then (nothing has changed after those).
  [[nodiscard]] Result<std::vector<std::byte>> save();
  [[nodiscard]] Status restore(std::span<const std::byte> snapshot);
  /// What save() answers, into `ar`, which may be bounded; without `backend` all but its part,
  /// which comes last. Between two steps. Errors: save()'s
  [[nodiscard]] Status write_down(Archive& ar, bool backend);
  /// What of the state that was written down or restored last another process keeps.
  [[nodiscard]] const hal::KeptElsewhere& kept_elsewhere() const noexcept {
    return kept_elsewhere_;
  }
  /// That is gone back to no more. Between two steps; may block.
  void forget(const hal::KeptElsewhere& kept) noexcept { now_.backend.forget(kept); }
  /// Number of the cycle that the next step() makes. Between two steps.
  [[nodiscard]] std::uint64_t next_cycle() const noexcept { return now_.loop.next_cycle(); }

  // For a TimeMachine, in the thread of the loop, between two steps.

  /// While on, step() plays a cycle that has been, with no more than the cycles before it: other
  /// threads are neither heard nor told, and nothing is logged, counted, paced or watched.
  void replay(bool on) noexcept;
  /// The last cycle, as its observers saw it.
  [[nodiscard]] hal::CycleView last_view() const noexcept { return shown_.view(); }
  /// Time went to another moment. What waits for the next cycle was meant for one of another
  /// future: it is dropped, and whoever waits is told; so are people and the log. What was said
  /// after this moment is shown no more. May block.
  void forget_waiting();
  /// Shows the last cycle to all who watch, as its hand-over did.
  void show_again() noexcept;
  /// Whether a cycle has taken something of other threads since this was asked.
  [[nodiscard]] bool take_heard() noexcept { return std::exchange(now_.outside.came, false); }
  /// Which ones are loaded, as restore() compares them.
  [[nodiscard]] std::uint64_t controllers() const noexcept {
    return now_.controllers.fingerprint();
  }
  /// The events, where they are no part of save(); null: they are, or there are none.
  [[nodiscard]] Events* events_apart() noexcept;
  /// The first of them that restore() would begin anew; empty: none.
  [[nodiscard]] std::string unarchived() const;
  /// A stop or the end of the run waits to be heard.
  [[nodiscard]] bool is_urgent() const noexcept;

 private:
  // The cycle, in this order.
  void show_snapshot() noexcept;
  void travel() noexcept;
  void await_tick() noexcept;
  void hear() noexcept TANDEM_RT;
  void wait() noexcept;
  void exchange() noexcept;
  void read() noexcept TANDEM_RT;
  void check() noexcept TANDEM_RT;
  void advance_phase() noexcept TANDEM_RT;
  void ask_events() noexcept;
  void take_inbox() noexcept TANDEM_RT;
  void update() noexcept TANDEM_RT;
  void limit() noexcept TANDEM_RT;
  void note_limits() noexcept TANDEM_RT;
  void write() noexcept TANDEM_RT;
  void hand_over() noexcept TANDEM_RT;

  void archive(Archive& ar);

  hal::KeptElsewhere kept_elsewhere_;
  CycleNow now_;
  DriveResets resets_;
  JointHoming homing_;
  JointArbiter arbiter_;
  WaitingControllers waiting_;
  FaultResponse response_;
  OwnerFollower owner_;
  CycleRequests requests_;
  RunServices services_;
  HandOver shown_;
  CycleTrace trace_;
  Heartbeat heartbeat_;

  std::optional<hal::TextEvent> forgotten_;  // for the log, with the next cycle
  bool started_ = false;                     // the first cycle was
  bool ends_with_command_ = false;           // controllers wrote in this cycle
  static constexpr std::int32_t kNever = -2;
  struct Limited {
    hal::LimitMet met{};
    std::int32_t controller = kNever;  // whose command it was
    std::int32_t padding = 0;
  };
  std::vector<Limited> limited_;           // by joint: noted once each
  std::vector<std::uint64_t> limits_met_;  // by joint: how often so far
  std::int64_t took_ns_ = 0;               // of the last cycle, from its grid point
};

}  // namespace tandem::runtime
