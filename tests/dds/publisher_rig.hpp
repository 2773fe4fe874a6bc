// A publisher with a robot of config/, whose cycles the test makes up, and readers of its topics.
// Layer: tests.  Thread: main.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "dds/endpoint.hpp"
#include "dds/publisher.hpp"
#include "runtime/experiment.hpp"
#include "tests/support/dds_domain.hpp"
#include "tests/support/eventually.hpp"

namespace tandem::dds::test {

using tandem::test::eventually;

/// @param follows  its last joint has no drive, and goes by -2 times its first one, plus 0.5
inline robot::CompleteRobot robot_of(const std::string& name, bool follows = false) {
  auto robot = robot::read_complete_robot(TANDEM_SOURCE_DIR "/config/" + name + "/robot.toml");
  EXPECT_TRUE(robot) << robot.error().front().to_string();
  if (follows) {
    model::Tree& tree = robot->description.tree;
    model::Joint& last = tree.joints[tree.joint_index(robot->config.joints.back().name)];
    last.leader = tree.joint_index(robot->config.joints.front().name);
    last.multiplier = -2.0;
    last.offset = 0.5;
    robot->config.joints.pop_back();
    robot->config.followers = robot::followers_of(robot->config, tree);
  }
  return std::move(*robot);
}

struct RigOptions {
  std::string robot = "double_pendulum";
  bool simulated_time = true;
  bool estimated = false;                  ///< a base's estimate beside the truth
  bool parallel = false;                   ///< a second robot
  bool follows = false;                    ///< the last joint goes by the first
  std::vector<std::string> wrenches = {};  ///< sites of the estimate's; of a fixed base with it
  Config config = own_config();
  /// RunDescription::controllers
  std::function<std::vector<std::pair<std::string, rt::Percentiles>>()> controllers = {};
};

struct PublisherRig {
  explicit PublisherRig(const RigOptions& options = {})
      : robot(robot_of(options.robot, options.follows)),
        state(robot.config.shape()),
        command(robot.config.shape()),
        truth(robot.config.joints.size(), robot.config.contact.feet.size()) {
    if (options.estimated) estimate.emplace(hal::EstimateShape{.base = 1, .feet = 2, .joints = 0});
    if (!options.wrenches.empty())
      estimate.emplace(hal::EstimateShape{.base = options.estimated ? 1U : 0U,
                                          .joints = robot.config.joints.size(),
                                          .wrenches = options.wrenches.size()});
    for (std::size_t i = 0; i < state.joints(); ++i) {
      const auto x = static_cast<double>(i + 1);
      state.position_rad()[i] = 0.1 * x;
      state.velocity_rad_s()[i] = -0.2 * x;
      state.torque_Nm()[i] = 3.0 * x;
      state.temperature_C()[i] = 30.0 + x;
      state.drive_state()[i] = static_cast<std::uint8_t>(hal::DriveState::kOperationEnabled);
      command.position_rad()[i] = 0.5 * x;
    }
    for (std::size_t i = 0; i < state.sensor().size(); ++i) {
      state.sensor()[i] = 0.25 * static_cast<double>(i + 1);
    }
    auto entered = Domain::open(options.config);
    EXPECT_TRUE(entered) << entered.error().to_string();
    auto talker = Participant::open(*entered, "tandem_run");
    auto other = Participant::open(*entered, "listener");
    EXPECT_TRUE(talker && other);
    participant = std::move(*talker);
    listener = std::move(*other);
    auto made = Publisher::create(*participant, {.robot = robot.config,
                                                 .tree = robot.description.tree,
                                                 .urdf = "<robot/>",
                                                 .hal = "sim",
                                                 .version = "1.2.3",
                                                 .description_hash = "abc",
                                                 .period_ns = kPeriod_ns,
                                                 .simulated_time = options.simulated_time,
                                                 .truth = &truth,
                                                 .estimate = shown_estimate(),
                                                 .wrenches = options.wrenches,
                                                 .parallel = options.parallel,
                                                 .run = 77,
                                                 .controllers = options.controllers});
    EXPECT_TRUE(made) << made.error().to_string();
    publisher = std::move(*made);
  }

  void start(hal::ParallelSource* parallel = nullptr) {
    publisher->start({.version = [this] { return fault_version.load(); },
                      .faults =
                          [this] {
                            const std::lock_guard lock(faults_mutex);
                            return faults;
                          },
                      .lost = [] { return std::uint64_t{3}; }},
                     parallel);
  }
  /// For the publisher's thread to see.
  void set_faults(std::vector<FaultEntry> now) {
    const std::lock_guard lock(faults_mutex);
    faults = std::move(now);
    ++fault_version;
  }
  /// Shows one cycle.
  void show(std::uint64_t cycle) {
    const auto time_ns = static_cast<std::int64_t>(cycle) * kPeriod_ns;
    const hal::CycleTime time{cycle, time_ns, kPeriod_ns};
    state.cycle()[0] = command.cycle()[0] = cycle;
    state.time_ns()[0] = command.time_ns()[0] = time_ns;
    publisher->take({time,
                     phase,
                     Code::kOk,
                     state,
                     command,
                     &truth,
                     shown_estimate(),
                     {begin_ns + time_ns, 500, -1, 2000, 0, 0}});
  }
  [[nodiscard]] const hal::EstimateImage* shown_estimate() const {
    return estimate ? &*estimate : nullptr;
  }
  /// Not more of them with a topic that is due than the ring holds: 512.
  void show_all(std::uint64_t from, std::uint64_t to) {
    for (std::uint64_t cycle = from; cycle < to; ++cycle) show(cycle);
  }
  /// A reader that a sample published from now on reaches.
  template <class T>
  Reader<T> reader(const std::string& ros_name, bool transient_local = false) {
    auto made = Reader<T>::create(
        *listener, listener->topic_name(ros_name),
        {.reliable = true, .transient_local = transient_local, .depth = 5000, .user_data = {}});
    EXPECT_TRUE(made) << made.error().to_string();
    EXPECT_TRUE(eventually([&] { return made->endpoint().matched() == 1; })) << ros_name;
    return std::move(*made);
  }

  static constexpr std::int64_t kPeriod_ns = 1'000'000;
  robot::CompleteRobot robot;
  hal::StateImage state;
  hal::CommandImage command;
  hal::TruthImage truth;
  std::optional<hal::EstimateImage> estimate;
  hal::RunPhase phase = hal::RunPhase::kRunning;
  std::int64_t begin_ns = 0;
  std::atomic<std::uint64_t> fault_version{0};
  std::mutex faults_mutex;  // of `faults`, which the publisher reads until it is gone
  std::vector<FaultEntry> faults;
  std::unique_ptr<Participant> participant, listener;
  std::unique_ptr<Publisher> publisher;
};

template <class Sequence>
auto list(const Sequence& sequence) {
  return std::vector(sequence._buffer, sequence._buffer + sequence._length);
}
template <class Sequence>
std::vector<std::string> texts(const Sequence& sequence) {
  return {sequence._buffer, sequence._buffer + sequence._length};
}
template <class Span>
auto list_of(Span span) {
  return std::vector(span.begin(), span.end());
}

inline std::int64_t ns(const builtin_interfaces_msg_dds__Time_& stamp) {
  return std::int64_t{stamp.sec} * 1'000'000'000 + stamp.nanosec;
}

}  // namespace tandem::dds::test
