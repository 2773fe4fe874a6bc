// A served run in lockstep cannot deadlock with any number of peers, present or not: random
// sequences of peers over DDS that take the lease, answer, fall silent, die and come back, while
// operators pause, step, resume, scale, stop and reset. Each must end, after exactly the cycles
// that were asked for.
//
// TANDEM_PEER_SEED=n plays sequence n alone, TANDEM_PEER_COUNT=n the first n.
#include <fmt/core.h>

#include <cstdlib>
#include <mutex>

#include "hal/config/capabilities.hpp"
#include "tests/remote/played.hpp"

namespace tandem::remote {
namespace {

using namespace test;

constexpr std::size_t kLanes = 6;  // sequences at a time: they mostly wait

std::int64_t in_ms(std::int64_t ms) { return clock_ns(CLOCK_MONOTONIC) + ms * 1'000'000; }

/// A process with its loop, that comes and goes.
class Peer {
 public:
  Peer(Played& run, std::unique_ptr<dds::Participant>& participant)
      : run_(&run), participant_(&participant), robot_(hal::test::fake_robot()) {}
  void act(const Deed<Act>& one);
  /// Answers whatever comes, and joins again whenever the robot was taken away, until `left`.
  void stay(const std::atomic<bool>& left);
  void join(double patience_s, const std::atomic<bool>& left);
  /// Cycles, for at most so long.
  void answer(std::uint32_t cycles, std::int64_t patience_ms);
  void die();

 private:
  void answer_one();

  Played* run_;
  std::unique_ptr<dds::Participant>* participant_;
  const hal::RobotConfig robot_;
  std::unique_ptr<RemoteBackend> backend_;
  std::atomic<std::int64_t> until_ns_{0};
  hal::CycleTime time_{0, 0, kPeriod_ns};
  hal::StateImage state_{robot_.shape()};
  hal::CommandImage command_{robot_.shape()};
  const hal::ParameterImage parameters_ = hal::initial_parameters(robot_);
};

void Peer::join(double patience_s, const std::atomic<bool>& left) {
  if (backend_ != nullptr) return;
  ClientConfig config;
  config.lockstep = true;
  config.server = run_->served.server->number();
  config.connect_timeout_s = patience_s;
  config.interrupted = [this, &left] {
    return run_->over() || left || clock_ns(CLOCK_MONOTONIC) > until_ns_;
  };
  until_ns_ = in_ms(static_cast<std::int64_t>(patience_s * 1e3));
  auto made = Owner::connect(**participant_, config, robot_);
  if (made) backend_ = std::move(*made);
}

void Peer::answer(std::uint32_t cycles, std::int64_t patience_ms) {
  until_ns_ = in_ms(patience_ms);
  for (; cycles > 0 && backend_ != nullptr && clock_ns(CLOCK_MONOTONIC) < until_ns_; --cycles)
    answer_one();
}

void Peer::answer_one() {
  ++time_.cycle;
  time_.time_ns += kPeriod_ns;
  backend_->exchange(time_);
  const Code code = backend_->read(time_, state_);
  if (code == Code::kBusOff) backend_.reset();  // lost, or the run is over
  if (code != Code::kOk) return;
  (void)backend_->command_in_force(command_);
  command_.cycle()[0] = time_.cycle;
  command_.time_ns()[0] = time_.time_ns;
  (void)backend_->write(command_, parameters_);
}

/// Nothing can be sent from then on.
void Peer::die() {
  dds_delete((*participant_)->get());
  backend_.reset();
  *participant_ = participant("peer");
}

void Peer::act(const Deed<Act>& one) {
  static const std::atomic<bool> never{false};
  switch (one.what) {
    case Act::kJoin: return join(0.02, never);
    case Act::kAnswer: return answer(one.amount, one.amount);
    case Act::kSilent: return std::this_thread::sleep_for(milliseconds(2 * one.amount));
    case Act::kRelease: return backend_.reset();
    case Act::kDie: return one.amount > 10 || backend_ != nullptr ? die() : void();
    default: break;
  }
  if (backend_ == nullptr) return;
  if (one.what == Act::kStop) backend_->stop(hal::StopCategory::kCategory1);
  if (one.what == Act::kReset) backend_->reset();
  if (one.what == Act::kDone) {
    (void)backend_->shut_down();
    backend_->last_command(command_);
  }
  answer(2, 5);
}

void Peer::stay(const std::atomic<bool>& left) {
  while (!left && !run_->over()) {
    join(0.2, left);
    answer(1000, 20);
  }
  backend_.reset();
}

void operators_come_and_go(Played& run) {
  std::vector<std::thread> operators;
  for (const auto& asks : run.sequence.operators) {
    operators.emplace_back([&run, &asks] {
      for (const auto& one : asks) run.ask(one);
    });
  }
  for (std::thread& one : operators) one.join();
}

/// Steps when nobody else asks for any, and looks that nothing but them happens.
void step_exactly(Played& run) {
  run.pause();
  std::optional<std::uint64_t> at = run.stand();
  if (at) run.stands_still(*at);
  if (at && !run.sequence.resumes() && !run.sequence.in_fault) {
    run.require(*at == run.asked_for - run.dropped, "other cycles than those of steps");
  }
  for (const std::uint32_t steps : run.sequence.steps) {
    if (!at) return;
    run.step(steps);
    const auto then = run.stand();
    if (!then) return;
    run.require(*then == *at + steps, fmt::format("step {} from {} to {}", steps, *at, *then));
    run.stands_still(*then);
    at = then;
  }
}

/// Latched, with time going on and nobody there.
void stop_for_good(Played& run) {
  (void)run.control().resume();
  const auto stopped = [&run] { return run.served.phase() == RunPhase::kFaulted || run.over(); };
  for (std::uint64_t since = run.watch.count; !run.over();) {
    if (!stopped()) {
      run.served.cycle->inbox().emergency_stop(hal::StopCategory::kCategory1);
      since = run.watch.count;
    }
    if (run.watch.count > since + 10) return;
    std::this_thread::sleep_for(milliseconds(1));
  }
}

/// With time going on, whatever is latched is reset until the run is over.
void end_by_itself(Played& run) {
  (void)run.control().set_rate(0.0);
  (void)run.control().resume();
  while (!run.over()) {
    if (run.served.phase() == RunPhase::kFaulted) run.served.cycle->inbox().reset_faults();
    std::this_thread::sleep_for(milliseconds(1));
  }
}

/// A run that is asked to end has the cycle at work, and those of the shut-down.
void end_while_paused(Played& run) {
  run.pause();
  const std::uint64_t before = run.watch.count;
  run.served.end();
  const std::uint64_t cycles = run.watch.count;
  run.require(cycles <= before + 1 + kShutDown,
              fmt::format("paused after {} cycles, ended after {}", before, cycles));
}

void bring_to_its_end(Played& run) {
  switch (run.sequence.end) {
    case End::kItself: return end_by_itself(run);
    case End::kPaused:
    case End::kLonely: return end_while_paused(run);
    case End::kAsked: return run.served.end();
  }
}

void join_all(std::vector<std::thread>& threads) {
  for (std::thread& one : threads) one.join();
  threads.clear();
}

/// Participants that stay from one sequence to the next.
struct Lane {
  std::unique_ptr<dds::Participant> server = participant("served");
  std::unique_ptr<dds::Participant> listener = participant("listener");
  std::array<std::unique_ptr<dds::Participant>, 4> peers{participant("peer"), participant("peer"),
                                                         participant("peer"), participant("owner")};
};

/// @return what was wrong; empty: nothing
std::string play(const PeerSequence& sequence, Lane& lane) {
  Played run(sequence, *lane.server, *lane.listener);
  std::vector<std::thread> peers, owner;
  for (std::size_t p = 0; p < sequence.peers.size(); ++p) {
    peers.emplace_back([&run, &sequence, &lane, p] {
      Peer peer(run, lane.peers[p]);
      for (const auto& one : sequence.peers[p]) peer.act(one);
    });
  }
  operators_come_and_go(run);
  (void)run.control().set_rate(0.0);
  std::atomic<bool> left{false};
  if (sequence.has_owner) {
    if (sequence.owner_late) {
      run.pause();
      run.step(5);
    }
    owner.emplace_back([&] { Peer(run, lane.peers.back()).stay(left); });
    step_exactly(run);
  } else if (sequence.in_fault) {
    join_all(peers);
    stop_for_good(run);
    step_exactly(run);
  }
  if (sequence.end == End::kItself) join_all(peers);
  bring_to_its_end(run);
  left = true;
  join_all(peers);
  join_all(owner);
  run.end();
  run.require(run.over(), "it is not over");
  return run.complaints();
}

/// Hands the sequences out, and ends the program when one hangs: its threads cannot be joined.
class Sequences {
 public:
  Sequences(std::uint32_t first, std::uint32_t count) : next_(first), end_(first + count) {}
  void play_all() {
    std::vector<std::thread> lanes;
    for (std::size_t i = 0; i < kLanes; ++i) lanes.emplace_back([this, i] { play_lane(i); });
    std::thread watchdog([this] { watch(); });
    join_all(lanes);
    over_ = true;
    watchdog.join();
  }

 private:
  struct At {
    std::string sequence;
    std::chrono::steady_clock::time_point since;
  };

  void play_lane(std::size_t number) {
    Lane lane;
    for (std::uint32_t seed = next_++; seed < end_ && !failed_; seed = next_++) {
      const PeerSequence sequence(seed);
      // The topic `clock` is one publisher's at a time.
      std::unique_lock clock(clock_mutex_, std::defer_lock);
      if (sequence.watches_clock) clock.lock();
      begin(number, sequence.to_string());
      const std::string wrong = play(sequence, lane);
      begin(number, {});
      if (wrong.empty()) continue;
      failed_ = true;
      ADD_FAILURE() << sequence.to_string() << wrong;
    }
  }
  void begin(std::size_t lane, std::string sequence) {
    const std::lock_guard lock(mutex_);
    at_[lane] = {std::move(sequence), std::chrono::steady_clock::now()};
  }
  void watch() {
    while (!over_) {
      std::this_thread::sleep_for(milliseconds(50));
      const std::lock_guard lock(mutex_);
      for (const At& at : at_) {
        const auto took = std::chrono::steady_clock::now() - at.since;
        if (at.sequence.empty() || took < std::chrono::seconds(60)) continue;
        fmt::print(stderr, "this sequence hangs:\n{}\n", at.sequence);
        std::fflush(stderr);
        std::abort();
      }
    }
  }

  std::atomic<std::uint32_t> next_;
  std::uint32_t end_;
  std::atomic<bool> failed_{false}, over_{false};
  std::mutex mutex_, clock_mutex_;
  std::array<At, kLanes> at_;
};

std::uint32_t number_of(const char* variable, std::uint32_t otherwise) {
  const char* text = std::getenv(variable);
  return text == nullptr ? otherwise : static_cast<std::uint32_t>(std::stoul(text));
}

TEST(PeerSequences, AllEndAfterTheCyclesThatWereAskedFor) {
  const std::uint32_t only = number_of("TANDEM_PEER_SEED", 0);
  const std::uint32_t count = number_of("TANDEM_PEER_COUNT", TANDEM_PEER_SEQUENCES);
  if (only == 0) return Sequences(1, count).play_all();
  Sequences(only, 1).play_all();
}

}  // namespace
}  // namespace tandem::remote
