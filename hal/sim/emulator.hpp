// The emulated robot on buses that lead out of the process: decides when it steps.
// Layer: hal/sim.  Thread: one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "canopen/messages.hpp"
#include "hal/ethercat-can/bus.hpp"
#include "hal/ethercat-can/frame_wait.hpp"
#include "hal/sim/emulated_robot.hpp"

namespace tandem::sim {

struct EmulatorConfig {
  std::int64_t period_ns = 1'000'000;  ///< of a step; the master's SYNC period
  bool lockstep = false;
  std::size_t kept_bytes = 4'000'000'000;  ///< that states for the master may take
};

/// How a board stops without SYNC, in steps since SYNC came last on its bus. 0: not (yet). A master
/// that dies between two SYNCs of a cycle leaves some buses with an older last SYNC than others.
struct BoardStop {
  std::uint64_t silent_steps = 0;      ///< so far
  std::uint64_t safe_after_steps = 0;  ///< until none of its motors drove any more
  std::uint64_t open_after_steps = 0;  ///< until every one of its bridges was open
};

/// What has passed.
struct EmulatorStatistics {
  std::uint64_t steps = 0;
  std::uint64_t steps_without_sync = 0;  ///< real time: the boards' own clocks went on
  std::uint64_t slipped = 0;             ///< real time: periods that were too many to be made up
  // Since SYNC came last on any bus: steps, and after how many of them no motor drove any more, and
  // every bridge was open. 0: not (yet).
  std::uint64_t silent_steps = 0;
  std::uint64_t safe_after_steps = 0;
  std::uint64_t open_after_steps = 0;
  std::vector<BoardStop> boards;  ///< each by itself, in the robot's order
  std::uint64_t frames_in = 0;
  std::uint64_t frames_out = 0;
  std::uint64_t frames_lost = 0;  ///< answers that a bus did not take
};

/// Looks on as the emulation steps.
class StepWatcher {
 public:
  virtual ~StepWatcher() = default;
  /// A step is over, and its answers are on the wire: none of them waits for this.
  /// @param so_far  this step included
  /// @param synced  SYNC came for it on a bus
  /// @rt on the emulation's thread: no allocation, lock or system call
  virtual void stepped(const EmulatorStatistics& so_far, bool synced) noexcept TANDEM_RT = 0;
};

/// In lockstep a step is made when SYNC has come on every bus; after its answers TIME goes out on
/// every bus. Without a master time stands still. Between two steps the master may order, on every
/// bus and as the last frame there, that the state be kept, gone back to or forgotten; the answer
/// goes out on every bus. In real time there is no such order.
///
/// In real time a step is made when SYNC has come on every bus, or half a period after the first of
/// them; and when none came for a period and a half, because the boards have clocks of their own:
/// from then on one a period.
/// Periods that the process slept through are made up, a few at most.
class Emulator {
 public:
  /// @param buses  the boards' end of each of the robot's buses, in their order; outlive it, as
  ///               robot and wait do
  Emulator(EmulatedRobot& robot, std::span<hal::can::Bus* const> buses, hal::can::FrameWait& wait,
           const EmulatorConfig& config);

  /// Takes what has come, steps if it is time to, else waits, `patience_ns` at most.
  /// @return kOk: a step was made; kTimeout: none yet; kDiverged: none will be any more.
  [[nodiscard]] Code poll(std::int64_t patience_ns) noexcept;
  /// Before the first step. @param watcher  outlives the steps
  void watch(StepWatcher& watcher) noexcept { watcher_ = &watcher; }

  /// Adds a fault between two steps: EmulatedRobot::inject(). In lockstep the master hears that
  /// something came, for it cannot be played again.
  [[nodiscard]] Code inject(const ScenarioFault& fault) noexcept;
  /// States that are kept for the master, and the memory that they take.
  [[nodiscard]] std::size_t kept() const noexcept { return kept_.size(); }
  [[nodiscard]] std::size_t kept_bytes() const noexcept;

  [[nodiscard]] const EmulatorStatistics& statistics() const noexcept { return statistics_; }
  /// Simulated time of the last step; the first step is at 0.
  [[nodiscard]] std::int64_t time_ns() const noexcept { return robot_->now_ns(); }

 private:
  struct Port {
    hal::can::Bus* bus;
    bool sync = false;  ///< one has come since the last step, or is that of the step
    /// That came last, and was not carried out yet.
    std::optional<canopen::PastOrderMessage> order{};
  };
  /// When a step is due without any further frame.
  struct Due {
    std::int64_t at_ns;
    bool now;
    int bus;  ///< on which the frame would come, or kAnyBus
  };

  void collect() noexcept;
  void take(Port& port, std::size_t bus, std::span<const canopen::Frame> frames) noexcept;
  void obey() noexcept;
  void tell(const canopen::PastAnswerMessage& answer) noexcept;
  void tell_heard() noexcept;
  [[nodiscard]] canopen::PastAnswerMessage carry_out(
      const canopen::PastOrderMessage& order) noexcept;
  [[nodiscard]] canopen::PastRefusal keep(std::uint32_t number) noexcept;
  [[nodiscard]] canopen::PastRefusal go_back(std::span<const std::byte> state) noexcept;
  void archive(Archive& ar);
  [[nodiscard]] Due due(std::int64_t now_ns) const noexcept;
  [[nodiscard]] Code step(std::int64_t now_ns) noexcept;
  [[nodiscard]] std::int64_t periods_to(std::int64_t now_ns) noexcept;
  void answer() noexcept;
  void watch_silence() noexcept;

  EmulatedRobot* robot_;
  std::vector<Port> ports_;
  hal::can::FrameWait* wait_;
  StepWatcher* watcher_ = nullptr;
  EmulatorConfig config_;
  EmulatorStatistics statistics_;
  std::vector<canopen::Frame> batch_;
  std::int64_t next_time_ns_ = 0;   ///< simulated
  std::int64_t stepped_ns_ = 0;     ///< wall clock: of the last step
  std::int64_t first_sync_ns_ = 0;  ///< wall clock: of those that wait; 0: none waits
  bool running_ = false;            ///< the first step was made
  bool heard_ = false;              ///< something from outside, since the last step
  std::map<std::uint32_t, std::vector<std::byte>> kept_;
};

}  // namespace tandem::sim
