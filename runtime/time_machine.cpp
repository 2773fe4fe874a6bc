// The loop serves between two cycles; whoever asks waits for its answer.
#include "runtime/time_machine.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <new>
#include <utility>

#include "base/clock_ns.hpp"
#include "runtime/events.hpp"
#include "runtime/robot_cycle.hpp"

namespace tandem::runtime {
namespace {

constexpr auto kPatience = std::chrono::milliseconds(20);
constexpr std::int64_t kStands_ns = 1'000'000'000;  // at most, from the answer on

std::uint64_t cycles_of(std::int64_t ns, std::int64_t period_ns) {
  return static_cast<std::uint64_t>(std::max<std::int64_t>(1, ns / period_ns));
}

std::string moment_text(const RobotCycle& cycle, std::uint64_t next) {
  const auto period_ns = static_cast<double>(cycle.config().loop.period_ns);
  return fmt::format("{:.6g} s", 1e-9 * period_ns * static_cast<double>(next == 0 ? 0 : next - 1));
}

/// @param next  the cycle that it does not come to
std::unexpected<Error> is_over(const RobotCycle& cycle, std::uint64_t next) {
  return fail("the run is over before " + moment_text(cycle, next),
              "give an earlier moment, or a longer --duration");
}

std::uint64_t hash_of(std::span<const std::byte> bytes) {
  std::uint64_t hash = 0xCBF29CE484222325U;  // FNV-1a
  for (const std::byte one : bytes) {
    hash = (hash ^ static_cast<std::uint64_t>(one)) * 0x100000001B3U;
  }
  return hash;
}

Status lacks_archive(const std::string& controller) {
  return fail("the controller '" + controller + "' has members, and no archive() that keeps them",
              "give it one (docs/controllers.md), or unload it");
}

/// While one exists the loop plays what has been.
class Replay {
 public:
  explicit Replay(RobotCycle& cycle) : cycle_(&cycle) { cycle_->replay(true); }
  ~Replay() { cycle_->replay(false); }
  Replay(const Replay&) = delete;
  Replay& operator=(const Replay&) = delete;

 private:
  RobotCycle* cycle_;
};

}  // namespace

TimeMachine::TimeMachine(std::int64_t period_ns, std::size_t budget_bytes, bool keeps)
    : apart_(cycles_of(kApart_ns, period_ns)),
      soon_(cycles_of(kSoon_ns, period_ns)),
      logged_apart_(cycles_of(kLogged_ns, period_ns)),
      logged_soon_(cycles_of(kLoggedSoon_ns, period_ns)),
      keeps_(keeps),
      kept_(budget_bytes) {}

KeptPast TimeMachine::past() const {
  const std::lock_guard lock(mutex_);
  KeptPast past{.keeps = keeps_.load(std::memory_order_relaxed),
                .count = kept_.all().size(),
                .bytes = kept_.bytes(),
                .budget_bytes = kept_.budget_bytes(),
                .no_more = why_no_more_.message.empty() ? "" : why_no_more_.to_string()};
  if (past.count == 0) return past;
  past.oldest = kept_.all().front().cycle;
  past.newest = kept_.all().back().cycle;
  return past;
}

Status TimeMachine::has_past() const {
  if (past().count > 0) return {};
  const std::lock_guard lock(mutex_);
  if (!why_no_more_.message.empty()) {
    return fail("nothing of the past is kept: " + why_no_more_.message, why_no_more_.hint);
  }
  return fail("nothing of the past was kept: the run went as fast as it can, and nobody asked",
              "begin it with --checkpoints 64MB, or at --rate 1; from tandem clock pause on it is "
              "kept, too");
}

Result<Travel> TimeMachine::go_to(RobotCycle& cycle, std::uint64_t next) {
  return ask(cycle, {.kind = Request::Kind::kGo, .cycles = next});
}

Result<Travel> TimeMachine::go_back(RobotCycle& cycle, std::uint64_t cycles) {
  return ask(cycle, {.kind = Request::Kind::kGoBack, .cycles = cycles});
}

Result<Travel> TimeMachine::back_until(RobotCycle& cycle, CycleCondition holds) {
  return ask(cycle, {.kind = Request::Kind::kSearch, .holds = std::move(holds)});
}

Result<Travel> TimeMachine::ask(RobotCycle& cycle, Request request) {
  const std::lock_guard one(asks_);
  abandoned_.store(false, std::memory_order_relaxed);
  if (request.kind != Request::Kind::kWatch) {
    if (const Status kept = has_past(); !kept) return std::unexpected(kept.error());
  }
  rt::ClockControl& clock = cycle.inbox().clock();
  const bool stood = clock.state().paused;
  if (const auto paused = clock.pause(); !paused) return std::unexpected(paused.error());
  Result<Travel> answer = wait_for(cycle, request);
  if (!answer && !stood) (void)clock.resume();
  return answer;
}

Result<Travel> TimeMachine::wait_for(RobotCycle& cycle, Request& request) {
  rt::ClockControl& clock = cycle.inbox().clock();
  std::unique_lock lock(mutex_);
  request_ = &request;
  wanted_.store(true, std::memory_order_release);
  if (const Status called = clock.call(); !called) {
    wanted_.store(false, std::memory_order_release);
    request_ = nullptr;
    return std::unexpected(called.error());
  }
  while (!answered_.wait_for(lock, kPatience, [&] { return request.answer.has_value(); })) {
    if (cycle.progress().phase.load() != RunPhase::kDone) continue;
    request_ = nullptr;
    return fail("the run is over", "start another one: tandem run … --start-paused");
  }
  lock.unlock();
  (void)clock.await_standing(kStands_ns);
  return std::move(*request.answer);
}

Result<Awaited> TimeMachine::until(RobotCycle& cycle, CycleCondition holds, std::string words) {
  Awaited begun{.replaced = awaited()};
  const auto watched = ask(
      cycle, {.kind = Request::Kind::kWatch, .holds = std::move(holds), .words = std::move(words)});
  if (!watched) return std::unexpected(watched.error());
  begun.holds_now = watched->holds;
  if (Status resumed = cycle.inbox().clock().resume(); !resumed)
    return std::unexpected(resumed.error());
  return begun;
}

Result<std::string> TimeMachine::give_up(RobotCycle& cycle) {
  std::string before = awaited();
  if (before.empty()) return fail("no condition is waited for", "tandem clock until CONDITION");
  const bool stood = cycle.inbox().clock().state().paused;
  const auto none = ask(cycle, {.kind = Request::Kind::kWatch});
  if (!none) return std::unexpected(none.error());
  if (stood) return before;
  if (Status resumed = cycle.inbox().clock().resume(); !resumed)
    return std::unexpected(resumed.error());
  return before;
}

std::string TimeMachine::met_words() const {
  const std::lock_guard lock(mutex_);
  return met_words_;
}

std::string TimeMachine::awaited() const {
  const std::lock_guard lock(mutex_);
  return awaited_;
}

Status TimeMachine::begin(RobotCycle& cycle, Checkpoint from, std::uint64_t next) {
  const std::string lacking = cycle.unarchived();
  if (!lacking.empty()) return lacks_archive(lacking);
  if (from.expects != (expectations_ == nullptr ? 0 : expectations_->fingerprint())) {
    return fail("[[expect]] has other rows than that run had",
                "they are judged from its beginning: give the experiment the same");
  }
  // It names what differs; where nothing does, the cycles are played from there.
  if (Status restored = cycle.restore(from.bytes); !restored) return restored;
  Travel travel;
  const RunPhase phase = cycle.phase();
  if (const Status played = play(cycle, from, next, travel); !played) return played;
  // Its duration may be shorter than it was.
  if (hal::ends(cycle.phase()) && !hal::ends(phase)) return is_over(cycle, next);
  reached_ = next;
  if (keeps_.load(std::memory_order_relaxed)) kept_.add(std::move(from));
  return {};
}

std::optional<std::uint64_t> TimeMachine::met() const noexcept {
  const std::uint64_t met = met_.load(std::memory_order_acquire);
  return met == Checkpoint::kNever ? std::nullopt : std::optional(met);
}

// The loop's.

void TimeMachine::attend(RobotCycle& cycle) noexcept {
  if (until_) watch(cycle);
  if (keeps_.load(std::memory_order_relaxed) || log_.state) note(cycle);
  if (wanted_.load(std::memory_order_acquire)) serve(cycle);
  forget_gone(cycle);
}

std::optional<log::Branch> TimeMachine::begins(std::uint64_t next) noexcept {
  if (next >= reached_) {
    reached_ = next + 1;
    return std::nullopt;
  }
  unlogged_ = std::exchange(arrived_, std::nullopt);
  logged_ = false;
  due_ = unlogged_ ? next + logged_apart_ : next;
  const std::lock_guard lock(mutex_);
  kept_.forget_after(next);
  if (Checkpoint* const last = kept_.last(); last != nullptr && last->heard >= next) {
    last->heard = Checkpoint::kNever;
  }
  reached_ = next + 1;
  return log::Branch{.cycle = next, .snapshot = snapshot_};
}

void TimeMachine::await(CycleCondition holds, std::string words) {
  until_ = std::move(holds);
  const std::lock_guard lock(mutex_);
  awaited_ = std::move(words);
}

/// What holds already has to end before it becomes true.
void TimeMachine::watch(RobotCycle& cycle) {
  const bool holds = until_(cycle.last_view());
  if (std::exchange(held_, holds) || !holds) return;
  {
    const std::lock_guard lock(mutex_);
    met_words_ = awaited_;
  }
  await({}, {});
  met_.store(cycle.next_cycle(), std::memory_order_release);
  (void)cycle.inbox().clock().pause();
}

/// The cycle before this moment is done: what it heard, and whether its state is kept.
void TimeMachine::note(RobotCycle& cycle) {
  const bool heard = cycle.take_heard();
  if (std::exchange(seen_, cycle.next_cycle()) == cycle.next_cycle()) return;
  if (keeps_.load(std::memory_order_relaxed)) note_kept(cycle, heard);
  try {
    if (log_.state) note_logged(cycle, heard);
  } catch (const std::bad_alloc&) {
    log_ = {};
  }
}

void TimeMachine::note_kept(RobotCycle& cycle, bool heard) {
  const std::uint64_t next = cycle.next_cycle();
  Checkpoint* const last = kept_.last();
  if (last != nullptr && heard) last->heard = std::min(last->heard, next - 1);
  const std::uint64_t apart = last != nullptr && last->heard != Checkpoint::kNever ? soon_ : apart_;
  if (last == nullptr || next >= last->cycle + apart) take(cycle);
}

void TimeMachine::note_logged(RobotCycle& cycle, bool heard) {
  const std::uint64_t next = cycle.next_cycle();
  if (unlogged_) {
    log_.state(*std::exchange(unlogged_, std::nullopt));
    logged_ = true;
  }
  if (heard && std::exchange(logged_, false)) {
    if (log_.heard) log_.heard(next - 1);
    due_ = std::min(due_, next + logged_soon_);
  }
  if (next < due_) return;
  if (const auto one = capture(cycle)) {
    log_.state(*one);
    logged_ = true;
  }
  due_ = next + logged_apart_;
}

/// Where there is no memory for it, there are no more.
void TimeMachine::take(RobotCycle& cycle) {
  try {
    auto one = capture(cycle);
    if (!one) return keep_no_more(one.error());
    // What waits for the next cycle may be in this state already; in those before it is not.
    Checkpoint* const last = kept_.last();
    if (cycle.take_heard() && last != nullptr) last->heard = std::min(last->heard, one->cycle);
    const std::lock_guard lock(mutex_);
    kept_.add(std::move(*one));
    why_no_more_ = {};
  } catch (const std::bad_alloc&) {
    keep_no_more({.message = "there is no memory for another state",
                  .hint = "give this process more, or --checkpoints less",
                  .file = {},
                  .key = {}});
  }
}

void TimeMachine::keep_no_more(const Error& why) {
  keeps_.store(false);
  const std::lock_guard lock(mutex_);
  why_no_more_ = why;
}

/// States that other processes keep for checkpoints that are no more.
void TimeMachine::forget_gone(RobotCycle& cycle) {
  for (const hal::KeptElsewhere& one : kept_.take_gone()) cycle.forget(one);
}

/// The state at this moment. Errors: RobotCycle::save()'s
Result<Checkpoint> TimeMachine::capture(RobotCycle& cycle) {
  archive_.clear();
  if (Status written = cycle.write_down(archive_, true); !written)
    return std::unexpected(std::move(written.error()));
  const std::span<const std::byte> bytes = archive_.bytes();
  Checkpoint one{.cycle = cycle.next_cycle(),
                 .controllers = cycle.controllers(),
                 .bytes = {bytes.begin(), bytes.end()}};
  if (expectations_ != nullptr) {
    Archive judged;
    expectations_->archive(judged);
    one.expects = expectations_->fingerprint();
    one.judged.assign(judged.bytes().begin(), judged.bytes().end());
  }
  if (Events* const apart = cycle.events_apart(); apart != nullptr) {
    Archive happened;
    apart->archive(happened);
    one.happened.assign(happened.bytes().begin(), happened.bytes().end());
  }
  one.elsewhere = cycle.kept_elsewhere();
  return one;
}

void TimeMachine::serve(RobotCycle& cycle) {
  Request* request = nullptr;
  {
    const std::lock_guard lock(mutex_);
    wanted_.store(false, std::memory_order_release);
    request = std::exchange(request_, nullptr);
  }
  if (request == nullptr) return;  // nobody waits any more
  const std::int64_t begin_ns = clock_ns(CLOCK_MONOTONIC);
  Result<Travel> answer = serve(cycle, *request);
  if (answer) answer->took_ns = clock_ns(CLOCK_MONOTONIC) - begin_ns;
  if (std::exchange(seen_, cycle.next_cycle()) != cycle.next_cycle()) arrive(cycle);
  const std::lock_guard lock(mutex_);
  request->answer = std::move(answer);
  answered_.notify_all();
}

Result<Travel> TimeMachine::serve(RobotCycle& cycle, Request& request) {
  const std::uint64_t here = cycle.next_cycle();
  met_.store(Checkpoint::kNever, std::memory_order_release);
  if (request.kind == Request::Kind::kWatch) {
    await(std::move(request.holds), std::move(request.words));
    held_ = until_ && until_(cycle.last_view());
    return Travel{.from = here, .to = here, .holds = held_};
  }
  await({}, {});  // it was about the time that would have come
  if (request.kind == Request::Kind::kGo) return go(cycle, request.cycles);
  if (request.kind == Request::Kind::kSearch) return search(cycle, request.holds);
  if (request.cycles < here) return go(cycle, here - request.cycles);
  return fail("the run has begun only " + moment_text(cycle, here) + " ago", "go back less far");
}

/// At another moment, which all who watch are shown.
void TimeMachine::arrive(RobotCycle& cycle) {
  cycle.forget_waiting();
  arrived_.reset();
  try {
    if (cycle.kept_elsewhere().number != 0) {
      // That part goes to no log, and the number by which it is kept is no state.
      archive_.clear();
      if (cycle.write_down(archive_, false)) snapshot_ = hash_of(archive_.bytes());
    } else if (auto one = capture(cycle)) {
      arrived_ = std::move(*one);
      snapshot_ = hash_of(arrived_->bytes);
    }
  } catch (const std::bad_alloc&) {
    arrived_.reset();  // the branch's log then begins without a state
  }
  cycle.show_again();
}

Status TimeMachine::may_travel(const RobotCycle& cycle) const {
  if (cycle.is_urgent()) return fail("a stop was asked for just now", "ask again");
  const std::string lacking = cycle.unarchived();
  return lacking.empty() ? Status() : lacks_archive(lacking);
}

Result<Travel> TimeMachine::go(RobotCycle& cycle, std::uint64_t next) {
  if (const Status may = may_travel(cycle); !may) return std::unexpected(may.error());
  const std::uint64_t from = cycle.next_cycle();
  if (next > std::max(reached_, from)) {
    return fail(moment_text(cycle, next) + " is not there yet; the run has reached " +
                    moment_text(cycle, std::max(reached_, from)),
                "step to it: tandem clock step --to TIME");
  }
  if (next < kept_.all().front().cycle) {
    return fail(moment_text(cycle, next) + " is before the oldest checkpoint, of " +
                    moment_text(cycle, kept_.all().front().cycle),
                "begin the run with --checkpoints, which keeps its first cycle");
  }
  if (from >= reached_) take(cycle);  // to come back to
  const Checkpoint& start = *kept_.before(next);
  Travel travel{.from = from, .to = std::min(next, start.heard), .asked = next};
  const Status played = play(cycle, start, travel.to, travel);
  if (!played) return std::unexpected(played.error());
  return travel;
}

Result<Travel> TimeMachine::search(RobotCycle& cycle, const CycleCondition& holds) {
  if (const Status may = may_travel(cycle); !may) return std::unexpected(may.error());
  const std::uint64_t from = cycle.next_cycle();
  if (from >= reached_) take(cycle);  // to come back to
  Travel travel{.from = from, .to = from, .asked = from};
  bool later = false;        // whether it holds at the beginning of the stretch after this one
  std::uint64_t end = from;  // of this one
  const auto all = kept_.all();
  const auto first_after = std::ranges::lower_bound(all, from, {}, &Checkpoint::cycle);
  for (auto start = first_after; start != all.begin();) {
    --start;
    std::optional<std::uint64_t> hit;
    bool at_start = false, before = false;
    const auto look = [&] {
      const bool now = holds(cycle.last_view());
      if (cycle.next_cycle() == start->cycle) {
        at_start = now;
      } else if (now && !before && cycle.next_cycle() < from) {
        hit = cycle.next_cycle();
      }
      before = now;
    };
    const Status played = play(cycle, *start, std::min(end, start->heard), travel, look);
    if (!played) {
      (void)play(cycle, *kept_.before(from), from, travel);
      return std::unexpected(played.error());
    }
    if (!hit && later && !before && end < from) hit = end;  // in a cycle that heard others
    if (hit) {
      travel.to = travel.asked = *hit;
      const Status there = play(cycle, *kept_.before(*hit), *hit, travel);
      if (!there) return std::unexpected(there.error());
      return travel;
    }
    later = at_start;
    end = start->cycle;
  }
  if (const Status back = play(cycle, *kept_.before(from), from, travel); !back) {
    return std::unexpected(back.error());
  }
  return fail("it has not become true since " + moment_text(cycle, all.front().cycle) +
                  ", the oldest moment that is kept",
              later                   ? "it was true there already"
              : all.front().cycle > 0 ? "keep more of it: --checkpoints 1GB"
                                      : "that is the beginning of the run");
}

/// Restores `from`, and plays on to the moment `to`. @param after  each moment on the way, that of
/// `from` included. A search may be long: a stop ends it
Status TimeMachine::play(RobotCycle& cycle, const Checkpoint& from, std::uint64_t to,
                         Travel& travel, const std::function<void()>& after) {
  if (from.controllers != cycle.controllers()) {
    return fail("at " + moment_text(cycle, from.cycle) + " other controllers were loaded than now",
                "go to a later moment, or load and unload what was loaded then");
  }
  if (Status restored = cycle.restore(from.bytes); !restored) return restored;
  if (expectations_ != nullptr) {
    Archive judged(from.judged);
    expectations_->archive(judged);
  }
  if (after) after();
  const Replay again(cycle);
  while (cycle.next_cycle() < to) {
    if (after && cycle.is_urgent()) return fail("a stop was asked for meanwhile", "ask again");
    if (after && abandoned_.load(std::memory_order_relaxed)) {
      return fail("the search was ended: somebody paused", "ask again");
    }
    if (cycle.phase() == RunPhase::kDone) return is_over(cycle, to);
    (void)cycle.step();
    ++travel.replayed;
    if (cycle.take_heard()) {
      return fail(
          "the emulated robot was given something meanwhile, which was not there before: "
          "time stands at " +
              moment_text(cycle, cycle.next_cycle()),
          "ask again, and inject nothing until the answer comes");
    }
    if (expectations_ != nullptr) expectations_->take(cycle.last_view());
    if (after) after();
  }
  return {};
}

}  // namespace tandem::runtime
