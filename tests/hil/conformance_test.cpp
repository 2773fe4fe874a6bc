// The HAL's conformance suite on a real CAN stack, in lockstep: the emulated swing with its board
// and sensor nodes on one end of an interface, the drive master and the suite on the other.
#include <mutex>
#include <set>
#include <thread>

#include "apps/can/can_sockets.hpp"
#include "hal/ethercat-can/can_backend.hpp"
#include "hal/sim/emulator.hpp"
#include "tests/hal/conformance.hpp"
#include "tests/sim/swing_robot.hpp"

namespace tandem::hal::test {
namespace {

template <class T>
T opened(std::expected<T, Diagnostics> made) {
  if (!made) throw std::runtime_error(made.error().front().to_string());
  return std::move(*made);
}
template <class T>
T opened(Result<T> made) {
  if (!made) throw std::runtime_error(made.error().to_string());
  return std::move(*made);
}

/// A bus of its own: the suite compares robots side by side.
class Interface {
 public:
  Interface() {
    while (!in_use().insert(name_).second) ++name_.back();
  }
  ~Interface() { in_use().erase(name_); }
  Interface(const Interface&) = delete;
  Interface& operator=(const Interface&) = delete;
  [[nodiscard]] const std::string& name() const { return name_; }

 private:
  static std::set<std::string>& in_use() {
    static std::set<std::string> names;
    return names;
  }
  std::string name_ = "can0";
};

/// The boards' end, which answers every SYNC on a thread of its own, and the master's sockets.
class SwingOnCan {
 public:
  SwingOnCan() {
    robot.buses[0].interface = interface_.name();
    emulated_ = opened(sim::EmulatedRobot::create(robot, tandem::test::swing_kernels(2), {}));
    boards_ = opened(apps::CanSockets::open(robot, can::SocketSide::kBoards, false));
    emulator_.emplace(*emulated_, boards_->buses(), *boards_,
                      sim::EmulatorConfig{.lockstep = true});
    master = opened(apps::CanSockets::open(robot, can::SocketSide::kMaster, false));
    thread_ = std::jthread([this](const std::stop_token& stop) { answer(stop); });
  }
  /// For the boards' next step.
  void inject(const sim::ScenarioFault& fault) {
    const std::lock_guard lock(mutex_);
    faults_.push_back(fault);
  }

 private:
  Interface interface_;  // let go last

 public:
  RobotConfig robot = tandem::test::swing_robot(2);
  std::unique_ptr<apps::CanSockets> master;

 private:
  void answer(const std::stop_token& stop) {
    constexpr std::int64_t kPatience_ns = 5'000'000;
    while (!stop.stop_requested() && emulator_->poll(kPatience_ns) != Code::kDiverged) {
      const std::lock_guard lock(mutex_);
      for (const sim::ScenarioFault& fault : faults_)
        EXPECT_EQ(emulated_->inject(fault), Code::kOk);
      faults_.clear();
    }
  }

  std::unique_ptr<sim::EmulatedRobot> emulated_;
  std::unique_ptr<apps::CanSockets> boards_;
  std::optional<sim::Emulator> emulator_;
  std::mutex mutex_;
  std::vector<sim::ScenarioFault> faults_;
  std::jthread thread_;  // ends first
};

ConformanceRobot make_swing_on_can() {
  auto swing = std::make_shared<SwingOnCan>();
  ConformanceRobot made;
  made.robot = swing->robot;
  made.backend = opened(can::CanBackend::create(swing->robot, swing->master->buses(),
                                                *swing->master, {.lockstep = true}));
  made.provoke_fault = [raw = swing.get()](std::size_t j) {
    sim::ScenarioFault unplugged;
    unplugged.kind = hal::FaultKind::kEncoderUnplug;
    unplugged.joint = static_cast<std::int32_t>(j);
    unplugged.duration_ns = 3'000'000;
    raw->inject(unplugged);
  };
  made.keep = swing;
  return made;
}

INSTANTIATE_TEST_SUITE_P(HilCan, BackendConformance,
                         testing::Values(ConformanceCase{"swing", make_swing_on_can}),
                         [](const auto& made) { return made.param.name; });

}  // namespace
}  // namespace tandem::hal::test
