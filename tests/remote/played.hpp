// One run of a random sequence: a served robot in lockstep, and what must be true of it.
// Layer: tests.  Thread: any; its loop has its own.
#pragma once

#include <fmt/core.h>

#include <mutex>
#include <optional>

#include "dds/publisher.hpp"
#include "tests/remote/link_rig.hpp"
#include "tests/remote/peer_sequence.hpp"

namespace tandem::remote::test {

using std::chrono::milliseconds;

inline constexpr std::uint64_t kShutDown = 3;  // cycles

/// Counts the cycles that have ended.
class Watch final : public hal::CycleObserver {
 public:
  void take(const hal::CycleView& view) noexcept override {
    if (publisher) publisher->take(view);
    count.fetch_add(1);
  }
  std::atomic<std::uint64_t> count{0};
  std::unique_ptr<dds::Publisher> publisher;
};

/// One run of a sequence. complaints() lists what goes wrong.
class Played {
 public:
  Played(const PeerSequence& sequence, dds::Participant& server, dds::Participant& listener);
  ~Played() { end(); }

  void require(bool so, const std::string& what) {
    if (so) return;
    const std::lock_guard lock(mutex_);
    complaints_ += "\n  " + what;
  }
  [[nodiscard]] std::string complaints() const {
    const std::lock_guard lock(mutex_);
    return complaints_;
  }
  [[nodiscard]] bool over() const { return served.phase() == RunPhase::kDone; }
  rt::ClockControl& control() { return served.cycle->inbox().clock(); }
  void ask(const Deed<Ask>& one);
  /// Cycles at which it stands; empty when the run was over before.
  std::optional<std::uint64_t> stand();
  void pause() {
    if (const auto done = control().pause()) dropped += *done;
  }
  void step(std::uint64_t cycles) {
    if (control().step(cycles)) asked_for += cycles;
  }
  void stands_still(std::uint64_t at);
  void clock_tells(std::uint64_t cycles);
  void end();

  const PeerSequence& sequence;
  Watch watch;
  Served served;
  std::atomic<std::uint64_t> asked_for{0}, dropped{0};  // cycles of steps

 private:
  const hal::RobotConfig robot_ = hal::test::fake_robot();
  model::Tree tree_;
  std::optional<dds::Reader<dds::rosgraph_msgs::Clock>> clock_;
  mutable std::mutex mutex_;
  std::string complaints_;
};

inline Played::Played(const PeerSequence& s, dds::Participant& server, dds::Participant& listener)
    : sequence(s), served(s.server, s.cycle, &watch, hal::test::fake_robot(), &server) {
  served.backend.bring_up_cycles = 2;
  served.backend.shut_down_cycles = kShutDown;
  if (s.watches_clock) {
    tree_.links.emplace_back().name = "base";
    auto made =
        dds::Publisher::create(server, {.robot = robot_, .tree = tree_, .simulated_time = true});
    auto reader = dds::Reader<dds::rosgraph_msgs::Clock>::create(
        listener, listener.topic_name("clock"), {.reliable = true, .depth = 5000, .user_data = {}});
    require(made && reader, "the clock's topic cannot be made");
    watch.publisher = std::move(*made);
    clock_ = std::move(*reader);
    watch.publisher->start({.version = [] { return std::uint64_t{0}; },
                            .faults = [] { return std::vector<dds::FaultEntry>(); },
                            .lost = [] { return std::uint64_t{0}; }});
  }
  served.begin();
}

inline void Played::ask(const Deed<Ask>& one) {
  switch (one.what) {
    case Ask::kPause: pause(); break;
    case Ask::kResume: (void)control().resume(); break;
    case Ask::kStep: step(one.amount); break;
    case Ask::kRate: (void)control().set_rate(one.rate); break;
    case Ask::kReset: served.cycle->inbox().reset_faults(); break;
    case Ask::kStop:
      served.cycle->inbox().emergency_stop(one.amount % 2 == 0 ? hal::StopCategory::kCategory0
                                                               : hal::StopCategory::kCategory1);
      break;
    case Ask::kLook: (void)control().await_standing(100'000); break;
    case Ask::kWait: std::this_thread::sleep_for(std::chrono::microseconds(100 * one.amount));
  }
}

inline std::optional<std::uint64_t> Played::stand() {
  while (!over()) {
    if (control().await_standing(1'000'000)) return control().state().next_cycle;
  }
  return std::nullopt;
}

/// Whatever peers do meanwhile.
inline void Played::stands_still(std::uint64_t at) {
  require(watch.count == at, fmt::format("{} cycles ended, {} began", watch.count, at));
  std::this_thread::sleep_for(milliseconds(1));
  if (clock_) clock_tells(at);
  require(control().state().standing, "it does not stand any more");
  require(watch.count == at, fmt::format("{} cycles, paused at {}", watch.count, at));
}

/// The time of the last cycle, again and again.
inline void Played::clock_tells(std::uint64_t cycles) {
  const auto expected_ns =
      static_cast<std::int64_t>(cycles - std::min<std::uint64_t>(cycles, 1)) * kPeriod_ns;
  int times = 0;
  std::int64_t told_ns = -1;
  const bool told = eventually([&] {
    clock_->take([&](const dds::rosgraph_msgs::Clock& sample, const auto&) {
      told_ns = std::int64_t{sample.clock.sec} * 1'000'000'000 + sample.clock.nanosec;
      if (told_ns == expected_ns) ++times;
    });
    return times >= 2;
  });
  require(told, fmt::format("the clock tells {} ns, not {} ns", told_ns, expected_ns));
  require(told_ns == expected_ns, fmt::format("the clock goes on to {} ns", told_ns));
}

inline void Played::end() {
  served.end();
  if (watch.publisher) watch.publisher->stop();
  watch.publisher.reset();
}

}  // namespace tandem::remote::test
