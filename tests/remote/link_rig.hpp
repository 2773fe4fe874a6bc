// Both ends of the network proxy in one process: a served robot with its loop's thread, and an
// owner with its own loop.
// Layer: tests.  Thread: main; the served loop has its own.
#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <thread>
#include <vector>

#include "hal/config/capabilities.hpp"
#include "hal/remote/remote_backend.hpp"
#include "hal/remote/server.hpp"
#include "tests/runtime/loop_run.hpp"
#include "tests/support/dds_domain.hpp"

namespace tandem::remote::test {

using runtime::RobotCycle;
using runtime::RunPhase;

inline constexpr std::int64_t kPeriod_ns = 1'000'000;

inline bool eventually(const std::function<bool()>& condition) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  while (std::chrono::steady_clock::now() < end) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return condition();
}

/// A participant of this program's domain.
inline std::unique_ptr<dds::Participant> participant(const std::string& node) {
  static const auto domain = [] {
    dds::Config config = dds::test::own_config();
    config.every[static_cast<std::size_t>(dds::Topic::kClock)] =
        1;  // each cycle's time is published
    return dds::Domain::open(config);
  }();
  EXPECT_TRUE(domain) << domain.error().to_string();
  auto made = dds::Participant::open(*domain, node);
  EXPECT_TRUE(made) << made.error().to_string();
  return std::move(*made);
}

/// The system's, in which a loop can be made to oversleep.
class SleepyClock final : public rt::Clock {
 public:
  /// Called by the loop that sleeps, in its `count`th sleep. Before it begins.
  void at_sleep(std::uint64_t count, std::function<void()> call) {
    count_ = count;
    call_ = std::move(call);
  }
  /// The next sleep takes so much longer. For any thread.
  void oversleep(std::int64_t by_ns) { oversleep_ns_ = by_ns; }

  std::int64_t now_ns() noexcept override { return clock_.now_ns(); }
  void sleep_until(std::int64_t deadline_ns) noexcept override {
    clock_.sleep_until(deadline_ns + longer());
  }
  void sleep_until_rung(std::int64_t deadline_ns, const rt::Doorbell& bell,
                        std::uint32_t seen) noexcept override {
    const std::int64_t longer_ns = longer();
    if (longer_ns > 0) return clock_.sleep_until(deadline_ns + longer_ns);
    clock_.sleep_until_rung(deadline_ns, bell, seen);
  }

 private:
  std::int64_t longer() {
    if (++sleeps_ == count_) call_();
    return oversleep_ns_.exchange(0);
  }

  rt::WallClock clock_;
  std::uint64_t sleeps_ = 0, count_ = 0;
  std::function<void()> call_;
  std::atomic<std::int64_t> oversleep_ns_{0};
};

/// What a run was, cycle by cycle; the room for it is there before.
class Record final : public hal::CycleObserver {
 public:
  struct Cycle {
    RunPhase phase;
    hal::StateImage state;
    hal::CommandImage command;
    hal::TruthImage truth;
  };
  explicit Record(const hal::RobotConfig& robot, std::size_t most = 2000)
      : cycles_(most,
                Cycle{RunPhase::kDone, hal::StateImage(robot.shape()),
                      hal::CommandImage(robot.shape()), hal::TruthImage(robot.joints.size(), 0)}) {}
  void take(const hal::CycleView& view) noexcept override {
    if (count_ == cycles_.size()) return;
    Cycle& one = cycles_[count_++];
    one.phase = view.phase;
    one.state.assign(view.state);
    one.command.assign(view.command);
    if (view.truth != nullptr) one.truth.assign(*view.truth);
  }
  [[nodiscard]] std::span<const Cycle> cycles() const { return {cycles_.data(), count_}; }

 private:
  std::vector<Cycle> cycles_;
  std::size_t count_ = 0;
};

/// A robot in this process with its loop on a thread, for owners in others.
class Served : public runtime::test::JointRun {
 public:
  /// @param kept  participant to use; null: one of its own
  explicit Served(const ServerConfig& config, runtime::CycleConfig cycle_config = {},
                  hal::CycleObserver* tap = nullptr,
                  hal::RobotConfig its_robot = hal::test::fake_robot(),
                  dds::Participant* kept = nullptr)
      : JointRun(std::move(its_robot)),
        participant_(kept == nullptr ? participant("served") : nullptr) {
    const hal::Robot known = hal::robot_of(robot);
    auto made =
        Server::open(kept == nullptr ? *participant_ : *kept, known, hal::initial_parameters(robot),
                     identity_of(known, "hash", kPeriod_ns), config);
    EXPECT_TRUE(made) << made.error().to_string();
    server = std::move(*made);
    const auto remote = std::make_shared<runtime::OwnerController>();
    add("remote", remote, false);
    cycle_config.after_stop = runtime::AfterStop::kWait;
    clock = &sleepy;
    truth = &backend.truth;
    observer = tap;
    owner = {server.get(), remote.get(), 0};
    JointRun::begin(cycle_config);
  }
  ~Served() {
    end();
    cycle.reset();  // it lets the server go
  }
  void begin() {
    thread_ = std::thread([this] { cycle->run(); });
  }
  /// Lets it come to its end, without asking for it.
  void join() {
    if (thread_.joinable()) thread_.join();
    server->close();
  }
  void end() {
    cycle->inbox().end_run();
    join();
  }
  [[nodiscard]] RunPhase phase() const { return cycle->progress().phase.load(); }

  SleepyClock sleepy;
  std::unique_ptr<dds::Participant> participant_;
  std::unique_ptr<Server> server;

 private:
  std::thread thread_;
};

/// An owner: a loop with a sine on joint 0, over the link.
class Owner : public runtime::test::LoopRun {
 public:
  static Result<std::unique_ptr<RemoteBackend>> connect(dds::Participant& participant,
                                                        ClientConfig config,
                                                        const hal::RobotConfig& of) {
    if (config.name.empty()) config.name = "the test's owner";
    const hal::Robot robot = hal::robot_of(of);
    return RemoteBackend::connect(participant, robot, identity_of(robot, "hash", kPeriod_ns),
                                  config);
  }

  explicit Owner(const ClientConfig& config, runtime::CycleConfig cycle_config = {},
                 hal::RobotConfig its_robot = hal::test::fake_robot(), double amplitude_rad = 0.2)
      : LoopRun(std::move(its_robot)), participant_(participant("owner")) {
    auto made = connect(*participant_, config, robot);
    EXPECT_TRUE(made) << made.error().to_string();
    if (!made) return;
    backend = std::move(*made);
    controller = add_sine({0}, "sine", true, "amplitude_rad = " + std::to_string(amplitude_rad));
    cycle_config.bring_up_cycles = ~std::uint64_t{0};
    cycle_config.loop.pacing = config.lockstep ? rt::Pacing::kSimulated : rt::Pacing::kExternal;
    begin(*backend, cycle_config);
  }

  std::unique_ptr<dds::Participant> participant_;
  std::unique_ptr<RemoteBackend> backend;
  runtime::test::Sine* controller = nullptr;
};

}  // namespace tandem::remote::test
