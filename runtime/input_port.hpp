// The way of samples to one input of a controller: from whoever feeds it, through its bounds, to
// the loop, which takes the newest between two cycles.
// Layer: runtime.  Thread: made non-RT; offer() and look() any; begin(), take() the loop's.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "base/result.hpp"
#include "base/seqlock.hpp"
#include "base/triple_buffer.hpp"
#include "controllers/controller_io.hpp"
#include "hal/cycle_time.hpp"
#include "hal/outside.hpp"
#include "hal/robot.hpp"
#include "runtime/input_messages.hpp"
#include "runtime/input_plan.hpp"
#include "runtime/input_source.hpp"

namespace tandem::runtime {

/// What became of an input's samples since the controller was loaded.
struct InputCounts {
  std::uint64_t arrived = 0;     ///< reached the controller
  std::uint64_t refused = 0;     ///< beyond a bound, not finite, or of who may not
  std::uint64_t superseded = 0;  ///< a newer one came within the cycle, or before anybody looked
  std::uint64_t timed_out = 0;   ///< how often it went silent for its time-out
};

/// An input after the last cycle.
struct InputLook {
  std::vector<double> value;
  std::uint64_t sequence = 0, cycle = 0;
  bool fresh = false;
  InputCounts counts;
  std::string why;  ///< the last sample was refused; empty: none was
};

class InputPort {
 public:
  /// @param io  whose `block` it is
  /// @param controller  its name, for errors and logs
  /// Errors: a declaration that makes no sense; a source that does not fit it: components that the
  /// input lacks, a row beyond its bounds, a file that cannot be read.
  [[nodiscard]] static Result<std::shared_ptr<InputPort>> make(
      std::shared_ptr<ControllerIo> io, InputBlock& block, const std::string& controller,
      const hal::Robot& robot, std::int64_t period_ns, const InputSource* source);

  [[nodiscard]] const InputBlock& input() const noexcept { return *block_; }
  [[nodiscard]] const std::string& controller() const noexcept { return controller_; }
  [[nodiscard]] const InputSource& source() const noexcept { return source_; }
  /// What its topic's messages are. @pre source().feeder is InputFeeder::kTopic
  [[nodiscard]] const InputMessage& messages() const noexcept { return *message_; }
  /// What is known of it before the run; of other sources than timelines and files empty.
  [[nodiscard]] const InputPlan& plan() const noexcept { return plan_; }
  /// "CONTROLLER/INPUT"
  [[nodiscard]] std::string full_name() const { return controller_ + "/" + block_->name; }

  // Any thread.

  /// Whether the input may hold it. Errors name the component.
  [[nodiscard]] Status check(std::span<const double> sample) const;
  /// A sample for the next cycle; one that the loop has not taken is lost for it.
  /// @return its number, for taken(). Errors: check()'s; another source feeds this input.
  [[nodiscard]] Result<std::uint64_t> offer(InputFeeder feeder, std::span<const double> sample);
  /// From now on what is offered here is offered to `next`: the same input of a later build.
  void pass_to(std::shared_ptr<InputPort> next);
  /// The one that pass_to() named, of the latest build; null: this one is it.
  [[nodiscard]] std::shared_ptr<InputPort> heir() const;
  /// Whether both have one name, kind, components and units.
  [[nodiscard]] bool is_same_as(const InputPort& other) const noexcept;
  /// Before the loop has it: what is, or will be, offered to `former` arrives here once this one
  /// has its place, and is counted with it. @pre is_same_as(former)
  void follow(const InputPort& former);
  /// So many came that nobody looked at before newer ones took their place.
  void pass_over(std::uint64_t samples) noexcept;
  /// One came that is no sample of this input, or of who may not.
  void refuse(const Error& why);
  /// The cycle in which a sample, or a newer one, arrived; empty: not yet.
  [[nodiscard]] std::optional<std::uint64_t> taken(std::uint64_t number) const noexcept;
  [[nodiscard]] InputLook look() const;
  /// What holds without a sample.
  [[nodiscard]] std::span<const double> without() const noexcept { return without_; }

  // The loop's.

  /// The controller starts: what came before counts no more.
  /// @param waits  false: but a sample that waits does, which arrives in this cycle
  void begin(const hal::CycleTime& time, bool waits,
             const hal::Outside& outside) noexcept TANDEM_RT;
  /// Holds what `former`, which it follows, does, as old as it is there; its plan goes on where
  /// that one is. What is beyond the bounds here is as if it had never come. @rt a copy of a
  /// sample.
  void go_on_as(const InputPort& former) noexcept TANDEM_RT;
  /// Whether it holds a sample that counts: a fresh one, or the last where that stays.
  [[nodiscard]] bool holds_sample() const noexcept TANDEM_RT;
  /// Whether a sample of the build before is within the bounds here.
  [[nodiscard]] bool admits(std::span<const double> sample) const noexcept TANDEM_RT;
  /// Each cycle in which the controller is active. @param open  false: nothing is taken
  /// @return whether a sample arrived
  /// @rt one copy of a sample at most; no search longer than a binary one.
  bool take(const hal::CycleTime& time, bool open, hal::Outside& outside) noexcept TANDEM_RT;
  /// Between two cycles: a sample that waits is refused, for time went elsewhere.
  /// @return whether one did. May block
  bool forget_waiting();
  /// What its message in the log is made of: the cycle, the sequence number, the values.
  [[nodiscard]] std::span<const std::byte> message() noexcept TANDEM_RT;
  void archive(Archive& ar);

  std::int32_t channel = -1;  ///< of the log; -1: none

 private:
  struct Sample {
    std::uint64_t number = 0;
    std::uint64_t build = 0;  // whose bounds it was checked against
    std::vector<double> values;
  };
  /// What those who offer and the loop share: one for all builds that follow each other.
  struct Mail {
    explicit Mail(std::size_t values) : feed(Sample{0, 0, std::vector<double>(values)}) {}
    std::mutex mutex;  // of those who offer: number, feed's back, why
    std::string why;
    std::uint64_t number = 0;
    TripleBuffer<Sample> feed;
    std::atomic<std::uint64_t> refused{0}, superseded{0}, arrived{0}, timed_out{0};
    std::atomic<std::uint64_t> taken{0}, taken_cycle{0};
  };
  InputPort(std::shared_ptr<ControllerIo> io, InputBlock& block, std::string controller,
            std::int64_t period_ns);
  [[nodiscard]] Status check_declaration(const hal::Robot& robot);
  [[nodiscard]] Status fill_bounds(const hal::Robot& robot);
  [[nodiscard]] Status check_trajectory(std::span<const double> sample) const;
  [[nodiscard]] Status check_terms(std::span<const double> terms) const;
  [[nodiscard]] std::span<const double> next(std::uint64_t cycle,
                                             hal::Outside& outside) noexcept TANDEM_RT;
  void note_taken(std::uint64_t number, std::uint64_t cycle) noexcept TANDEM_RT;
  void hold(std::span<const double> values) noexcept TANDEM_RT;
  void show() noexcept TANDEM_RT;

  std::shared_ptr<ControllerIo> io_;  // keeps the block
  InputBlock* block_;
  std::string controller_;
  InputSource source_;
  const InputMessage* message_ = nullptr;
  std::int64_t period_ns_;
  std::uint64_t timeout_cycles_ = 0;
  std::vector<double> min_, max_;  // by component; of a trajectory by joint
  std::vector<double> max_speed_;  // of a trajectory, by joint
  std::vector<double> zero_, without_;

  std::shared_ptr<Mail> mail_;
  mutable std::mutex mutex_;
  std::shared_ptr<InputPort> next_;  // of pass_to()
  std::uint64_t build_ = 0;          // how many it follows
  bool same_bounds_ = false;         // as the one that it follows
  Seqlock<double> shown_;

  // The loop's.
  InputPlan plan_;
  std::uint64_t base_ = 0;       // cycle from which the plan counts
  std::uint64_t row_ = 0;        // of the plan: next
  std::vector<double> scratch_;  // shown and logged
};

/// The ports of what a controller has declared, in that order.
/// @param sources  who feeds them; of those that are not there InputFeeder::kCommand
/// Errors: InputPort::make()'s; too many inputs, two of a name; a source of one that is not there.
[[nodiscard]] Result<std::vector<std::shared_ptr<InputPort>>> make_input_ports(
    const std::shared_ptr<ControllerIo>& io, const std::string& controller, const hal::Robot& robot,
    std::int64_t period_ns, std::span<const InputSource> sources);

}  // namespace tandem::runtime
