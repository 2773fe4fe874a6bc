// Simulated time cannot deadlock: thousands of random sequences of everything that can be asked of
// the clock, by peers that come and go at the same time, against a real cycle on its own thread.
// Each must end, after exactly the cycles that were asked for.
//
// TANDEM_CLOCK_SEED=n runs sequence n alone.
#include <fmt/core.h>
#include <fmt/ranges.h>

#include <condition_variable>
#include <cstdlib>
#include <mutex>
#include <random>
#include <thread>

#include "tests/runtime/loop_run.hpp"

namespace tandem::runtime {
namespace {

constexpr std::uint64_t kBringUp = 2, kShutDown = 3;  // cycles
constexpr std::int64_t kLong_ns = 60'000'000'000;

enum class Act : std::uint8_t { kPause, kResume, kStep, kRate, kLook, kAwait, kReset, kGains };
enum class End : std::uint8_t {
  kItself,   ///< time goes on until the run is over
  kSteps,    ///< the same, in steps
  kPaused,   ///< asked to end while it stands
  kRunning,  ///< asked to end whatever it does
  kSignal,   ///< a stop signal while it stands
};

struct Ask {
  Act act;
  std::uint64_t steps = 0;
  double rate = 0.0;
};

std::string in_words(const Ask& ask) {
  switch (ask.act) {
    case Act::kPause: return "pause";
    case Act::kResume: return "resume";
    case Act::kStep: return fmt::format("step {}", ask.steps);
    case Act::kRate: return fmt::format("rate {:g}", ask.rate);
    case Act::kLook: return "look";
    case Act::kAwait: return "await";
    case Act::kReset: return "reset";
    case Act::kGains: return "gains";
  }
  return "?";
}

/// All that a seed decides.
struct Sequence {
  std::uint32_t seed;
  bool start_paused;
  double rate;
  std::uint64_t running_cycles;
  std::vector<std::vector<Ask>> peers;
  std::vector<Ask> last;  // of one peer that stays when the others have left
  End end;

  explicit Sequence(std::uint32_t number);
  [[nodiscard]] bool resumes() const;
  /// Cycles of a run that ends by itself.
  [[nodiscard]] std::uint64_t total() const { return kBringUp - 1 + running_cycles + kShutDown; }
  [[nodiscard]] std::string to_string() const;
};

Sequence::Sequence(std::uint32_t number) : seed(number) {
  std::mt19937 random(number);
  const auto below = [&random](std::uint32_t n) {
    return static_cast<std::uint32_t>(random() % n);
  };
  const double rates[] = {0.0, 0.0, 1000.0, 200.0, 20.0, 1.0, 0.01};
  start_paused = below(2) == 0;
  rate = rates[below(7)];
  running_cycles = 1 + below(200);
  const bool only_steps = start_paused && below(3) == 0;
  const auto ask = [&] {
    Ask one{.act = static_cast<Act>(below(8))};
    if (only_steps && one.act == Act::kResume) one.act = Act::kStep;
    one.steps = 1 + below(30);
    one.rate = rates[below(7)];
    return one;
  };
  peers.resize(below(6));
  for (auto& peer : peers) {
    for (std::uint32_t i = below(13); i > 0; --i) peer.push_back(ask());
  }
  for (std::uint32_t i = below(4); i > 0; --i) last.push_back(ask());
  end = below(100) == 0 ? End::kSignal : static_cast<End>(below(4));
}

bool Sequence::resumes() const {
  bool any = !start_paused;
  for (const auto& peer : peers) {
    for (const Ask& ask : peer) any = any || ask.act == Act::kResume;
  }
  for (const Ask& ask : last) any = any || ask.act == Act::kResume;
  return any;
}

std::string Sequence::to_string() const {
  const auto words = [](const std::vector<Ask>& asks) {
    std::vector<std::string> texts;
    for (const Ask& ask : asks) texts.push_back(in_words(ask));
    return fmt::format("{}", fmt::join(texts, ", "));
  };
  const char* const ends[] = {"by itself", "in steps", "asked while it stands", "asked any time",
                              "by a signal"};
  std::string text =
      fmt::format("TANDEM_CLOCK_SEED={}: {}, rate {:g}, {} cycles", seed,
                  start_paused ? "started paused" : "started running", rate, running_cycles);
  for (const auto& peer : peers) text += "\n  peer: " + words(peer);
  return text + "\n  last: " + words(last) + "\n  ends: " + ends[static_cast<int>(end)];
}

/// Ends the program when a sequence hangs: its threads cannot be joined any more.
class Watchdog {
 public:
  Watchdog() : thread_([this] { watch(); }) {}
  ~Watchdog() {
    {
      const std::lock_guard lock(mutex_);
      over_ = true;
    }
    wake_.notify_all();
    thread_.join();
  }
  void begin(const Sequence& sequence) {
    const std::lock_guard lock(mutex_);
    text_ = sequence.to_string();
    began_ = std::chrono::steady_clock::now();
  }

 private:
  void watch() {
    std::unique_lock lock(mutex_);
    while (!wake_.wait_for(lock, std::chrono::seconds(1), [this] { return over_; })) {
      if (std::chrono::steady_clock::now() - began_ < std::chrono::seconds(60)) continue;
      fmt::print(stderr, "this sequence hangs:\n{}\n", text_);
      std::fflush(stderr);
      std::abort();
    }
  }

  std::mutex mutex_;
  std::condition_variable wake_;
  std::string text_;
  std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now();
  bool over_ = false;
  std::thread thread_;
};

/// One run of the sequence; the loop's thread lives from construction to done().
struct Played : test::JointRun {
  explicit Played(const Sequence& s) {
    backend.bring_up_cycles = kBringUp;
    backend.shut_down_cycles = kShutDown;
    add_sine();
    begin({.loop = {.rate = s.rate, .start_paused = s.start_paused},
           .running_cycles = s.running_cycles});
    loop = std::thread([this] {
      cycle->run();
      over.store(true);
    });
  }
  rt::ClockControl& control() { return cycle->inbox().clock(); }
  void ask(const Ask& one);
  /// Cycles at which it stands; empty when the run was over before.
  std::optional<std::uint64_t> pause();

  std::atomic<std::uint64_t> asked_for{0}, dropped{0};  // cycles of steps
  std::atomic<bool> over{false};
  std::thread loop;
};

void Played::ask(const Ask& one) {
  switch (one.act) {
    case Act::kPause:
      if (const auto done = control().pause()) dropped += *done;
      break;
    case Act::kResume: (void)control().resume(); break;
    case Act::kStep:
      if (control().step(one.steps)) asked_for += one.steps;
      break;
    case Act::kRate: (void)control().set_rate(one.rate); break;
    case Act::kLook: EXPECT_LE(control().state().rate, rt::kFastest); break;
    case Act::kAwait: (void)control().await_standing(100'000); break;
    case Act::kReset: cycle->inbox().reset_faults(); break;
    case Act::kGains:
      (void)cycle->services().set_gains("elbow", hal::PidLoop::kPosition, {.kp = 1.0},
                                        RunServices::Patience{0});
      break;
  }
}

std::optional<std::uint64_t> Played::pause() {
  ask({.act = Act::kPause});
  while (!over.load()) {
    if (control().await_standing(1'000'000)) return control().state().next_cycle;
  }
  return std::nullopt;
}

void peers_come_and_go(const Sequence& s, Played& run) {
  std::vector<std::thread> peers;
  for (const auto& asks : s.peers) {
    peers.emplace_back([&run, &asks] {
      for (const Ask& one : asks) run.ask(one);
    });
  }
  for (std::thread& peer : peers) peer.join();
  for (const Ask& one : s.last) run.ask(one);
}

/// Brings the run to its end. @return the cycles that it must have had; empty: any number.
std::optional<std::uint64_t> end(const Sequence& s, Played& run) {
  if (s.end == End::kRunning) {
    run.cycle->inbox().end_run();
    return std::nullopt;
  }
  const std::optional<std::uint64_t> stands_at = run.pause();
  if (!stands_at) return s.total();
  if (!s.resumes()) {
    EXPECT_EQ(*stands_at, run.asked_for.load() - run.dropped.load());
  }
  const std::uint64_t left = s.total() - *stands_at;
  (void)run.control().set_rate(0.0);
  switch (s.end) {
    case End::kItself: (void)run.control().resume(); return s.total();
    case End::kSteps: {
      const std::uint64_t first = left / 2;
      if (first > 0) {
        EXPECT_TRUE(run.control().step(first));
        EXPECT_TRUE(run.control().await_standing(kLong_ns));
        EXPECT_EQ(run.control().state().next_cycle, *stands_at + first);
      }
      EXPECT_TRUE(run.control().step(left - first));
      return s.total();
    }
    case End::kPaused: run.cycle->inbox().end_run(); break;
    case End::kSignal: rt::request_stop(); break;
    case End::kRunning: break;
  }
  return *stands_at + std::min(left, kShutDown);
}

void play(const Sequence& s) {
  Played run(s);
  peers_come_and_go(s, run);
  const std::optional<std::uint64_t> expected = end(s, run);
  run.loop.join();
  rt::clear_stop();
  EXPECT_EQ(run.cycle->phase(), RunPhase::kDone);
  EXPECT_TRUE(run.cycle->faults().empty());
  const std::uint64_t cycles = run.cycle->loop().cycles;
  EXPECT_LE(cycles, s.total());
  EXPECT_EQ(cycles, expected.value_or(cycles));
  EXPECT_EQ(run.cycle->loop().skipped, 0U);
}

TEST(ClockSequences, AllEndAfterTheCyclesThatWereAskedFor) {
  Watchdog watchdog;
  const char* only = std::getenv("TANDEM_CLOCK_SEED");
  const auto first = only == nullptr ? 1U : static_cast<std::uint32_t>(std::stoul(only));
  const char* many = std::getenv("TANDEM_CLOCK_SEQUENCES");  // make test-all: 20,000
  const auto all = many == nullptr ? 3000U : static_cast<std::uint32_t>(std::stoul(many));
  const std::uint32_t count = only == nullptr ? all : 1;
  for (std::uint32_t seed = first; seed < first + count; ++seed) {
    const Sequence sequence(seed);
    watchdog.begin(sequence);
    play(sequence);
    ASSERT_FALSE(testing::Test::HasFailure()) << sequence.to_string();
  }
}

}  // namespace
}  // namespace tandem::runtime
