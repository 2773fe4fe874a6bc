// Simulated time goes back: to a moment, or to the last cycle in which something became true.
// Layer: runtime.  Thread: attend() and begins() the loop's; the rest any other.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include "base/archive.hpp"
#include "base/result.hpp"
#include "hal/cycle_observer.hpp"
#include "log/info.hpp"
#include "runtime/checkpoints.hpp"
#include "runtime/condition/expectations.hpp"

namespace tandem::runtime {

class RobotCycle;

/// Whether something holds after a cycle: asked in the thread of the loop, between two cycles.
using CycleCondition = std::function<bool(const hal::CycleView&)>;

/// Where time went. A moment is named by the cycle that comes next; its time is that of the cycle
/// before.
struct Travel {
  std::uint64_t from = 0, to = 0;
  std::uint64_t asked = 0;     ///< for; not `to` where what came from outside cannot be replayed
  std::uint64_t replayed = 0;  ///< cycles that were played again
  std::int64_t took_ns = 0;
  bool holds = false;  ///< of until(): its condition does already
};

/// What until() has begun.
struct Awaited {
  std::string replaced;    ///< words of the one that waited until now, which is given up; or empty
  bool holds_now = false;  ///< it has to end before it can become true
};

/// What can be gone back to.
struct KeptPast {
  bool keeps = false;  ///< checkpoints are taken
  std::size_t count = 0, bytes = 0, budget_bytes = 0;
  std::uint64_t oldest = 0, newest = 0;  ///< moments, where count is not 0
  std::string no_more;  ///< why no more are taken; empty: nothing stands in the way
};

/// Keeps checkpoints of a run in simulated time, and takes it back to any cycle since the first:
/// restores the one before, and plays the cycles from there on again, to the same bits. What other
/// threads gave a cycle cannot be played again: the next checkpoint comes soon after it.
class TimeMachine {
 public:
  /// They are this far apart at most [ns], and come so soon after a cycle that heard something.
  static constexpr std::int64_t kApart_ns = 1'000'000'000, kSoon_ns = 20'000'000;
  static constexpr std::size_t kBudget_bytes = 64'000'000;
  /// The same of those that go to the log.
  static constexpr std::int64_t kLogged_ns = 5'000'000'000, kLoggedSoon_ns = 1'000'000'000;

  /// @param keeps  from the first cycle on; else from keep() on
  TimeMachine(std::int64_t period_ns, std::size_t budget_bytes, bool keeps);

  /// From now on there are checkpoints.
  void keep() noexcept { keeps_.store(true, std::memory_order_relaxed); }
  [[nodiscard]] KeptPast past() const;
  /// Errors: nothing was kept yet.
  [[nodiscard]] Status has_past() const;

  /// Before the first cycle: expectations are judged by the branch that the run is in.
  void judge_by(Expectations* expectations) noexcept { expectations_ = expectations; }

  /// Keeps states in the run's log; in the thread of the loop, between two cycles.
  struct StateLog {
    std::function<void(const Checkpoint&)> state{};
    /// This cycle was given something from outside and cannot be played again. Told once for each
    /// state, of the first such cycle after it.
    std::function<void(std::uint64_t cycle)> heard{};
  };
  /// Before the first cycle: states go to the log, too, whether they are kept here or not.
  /// @param apart  cycles from one to the next; 0: kLogged_ns
  void log_to(StateLog log, std::uint64_t apart = 0) {
    log_ = std::move(log);
    if (apart > 0) logged_apart_ = apart;
  }
  /// Before the first cycle: the run goes on from a state of another one, from its cycle `next` on.
  /// Errors: RobotCycle::restore()'s; other [[expect]]; a controller lacks an archive().
  [[nodiscard]] Status begin(RobotCycle& cycle, Checkpoint from, std::uint64_t next);

  // They pause simulated time, and block until it stands there. After an error it is where it was,
  // and goes on if it did before.

  /// `next` is the cycle that comes next then: at most the newest that the run has reached.
  /// Errors: it is beyond; before the oldest checkpoint; other controllers were loaded then, or one
  /// lacks an archive(); the run is over.
  [[nodiscard]] Result<Travel> go_to(RobotCycle& cycle, std::uint64_t next);
  /// So many cycles back from where the run is when it stands. Errors: go_to()'s.
  [[nodiscard]] Result<Travel> go_back(RobotCycle& cycle, std::uint64_t cycles);
  /// To where `holds` has become true last: the cycle after the one in which it did.
  /// Errors: go_to()'s; it has not since the oldest checkpoint; a stop was asked for meanwhile.
  [[nodiscard]] Result<Travel> back_until(RobotCycle& cycle, CycleCondition holds);
  /// Lets time go on, and pauses it after the cycle in which `holds` becomes true. Does not wait.
  /// @param words  what it is, for awaited()
  [[nodiscard]] Result<Awaited> until(RobotCycle& cycle, CycleCondition holds, std::string words);
  /// Gives up the condition of until(); time stands or goes on as it did. @return its words
  [[nodiscard]] Result<std::string> give_up(RobotCycle& cycle);
  /// The condition that time goes on until, in words; empty: there is none. Any thread, at once.
  [[nodiscard]] std::string awaited() const;
  /// The moment after the cycle in which the condition of the last until() became true; none: it
  /// has not, or time went elsewhere since. Any thread, at once, as the next.
  [[nodiscard]] std::optional<std::uint64_t> met() const noexcept;
  /// That condition, in words.
  [[nodiscard]] std::string met_words() const;
  /// Ends a search that goes on: time stays where it is.
  void abandon() noexcept { abandoned_.store(true, std::memory_order_relaxed); }

  // The loop's.

  /// Between two cycles: keeps the state, goes where somebody wants. Blocks, and takes heap.
  void attend(RobotCycle& cycle) noexcept;
  /// `next` begins. @return what its log is, where the run has gone back and goes on otherwise
  [[nodiscard]] std::optional<log::Branch> begins(std::uint64_t next) noexcept;

 private:
  struct Request {
    enum class Kind : std::uint8_t { kGo, kGoBack, kSearch, kWatch } kind;
    std::uint64_t cycles = 0;  // to the moment, or back
    CycleCondition holds{};    // instead; of kWatch empty: none any more
    std::string words{};       // of it
    std::optional<Result<Travel>> answer{};
  };
  [[nodiscard]] Result<Travel> ask(RobotCycle& cycle, Request request);
  [[nodiscard]] Result<Travel> wait_for(RobotCycle& cycle, Request& request);
  void serve(RobotCycle& cycle);
  [[nodiscard]] Result<Travel> serve(RobotCycle& cycle, Request& request);
  void arrive(RobotCycle& cycle);
  void watch(RobotCycle& cycle);
  void await(CycleCondition holds, std::string words);
  void note(RobotCycle& cycle);
  void note_kept(RobotCycle& cycle, bool heard);
  void note_logged(RobotCycle& cycle, bool heard);
  void take(RobotCycle& cycle);
  void keep_no_more(const Error& why);
  void forget_gone(RobotCycle& cycle);
  [[nodiscard]] Result<Checkpoint> capture(RobotCycle& cycle);
  [[nodiscard]] Status may_travel(const RobotCycle& cycle) const;
  [[nodiscard]] Result<Travel> go(RobotCycle& cycle, std::uint64_t next);
  [[nodiscard]] Result<Travel> search(RobotCycle& cycle, const CycleCondition& holds);
  [[nodiscard]] Status play(RobotCycle& cycle, const Checkpoint& from, std::uint64_t to,
                            Travel& travel, const std::function<void()>& after = {});

  const std::uint64_t apart_, soon_;  // cycles
  std::uint64_t logged_apart_;
  const std::uint64_t logged_soon_;
  std::atomic<bool> keeps_;

  std::mutex asks_;  // one at a time
  mutable std::mutex mutex_;
  std::condition_variable answered_;
  Request* request_ = nullptr;
  std::atomic<bool> wanted_{false};  // request_
  std::atomic<bool> abandoned_{false};
  std::atomic<std::uint64_t> met_{Checkpoint::kNever};
  std::string awaited_, met_words_;  // under mutex_: until_, and the last one that came true
  Checkpoints kept_;                 // the loop writes it, under mutex_
  Error why_no_more_;                // of kept_; without a message: there are more

  Expectations* expectations_ = nullptr;  // watch each live cycle by themselves

  // The loop's.
  Archive archive_;
  std::uint64_t seen_ = Checkpoint::kNever;  // the moment of the last attend()
  std::uint64_t reached_ = 0;                // the newest moment of this branch
  std::uint64_t snapshot_ = 0;               // hash of the state that time went back to
  StateLog log_;                             // empty: there is no log
  bool logged_ = false;                      // a state, and no cycle since has heard anything
  std::optional<Checkpoint> arrived_;        // the state that time went back to, for a branch
  std::optional<Checkpoint> unlogged_;       // it, until that branch's log has begun
  std::uint64_t due_ = 0;                    // the moment whose state is logged next
  CycleCondition until_;                     // empty: time goes on as it does
  bool held_ = false;                        // until_, after the cycle before
};

}  // namespace tandem::runtime
