// In lockstep a run over CAN is the in-process run, bit for bit.
#include "tests/runtime/lockstep.hpp"

#include <algorithm>

#include "base/archive.hpp"
#include "log/compare.hpp"
#include "rt/scoped_realtime.hpp"
#include "tests/log/scratch_folder.hpp"
#include "tests/rt/fake_clock.hpp"
#include "tests/runtime/bundled_run.hpp"

namespace tandem::runtime {
namespace {

using test::LockstepRobot;
using test::over;

/// A squat with its log, in process or over `wire`; `cycles` 0: all of it.
struct LoggedSquat {
  LoggedSquat(const std::string& robot, const std::string& path, std::uint64_t cycles,
              std::optional<LockstepRobot>* wire, bool bus_timing = false)
      : path_(path), recorder(log::Recorder::open(path, {.robot = robot}, {})) {
    Overrides overrides{.change = [=](Experiment& e) {
      e.sim.bus_timing = bus_timing;
      e.sim.ground_truth = false;
      if (cycles > 0) e.duration_s = 1e-3 * static_cast<double>(cycles);
    }};
    if (wire != nullptr) overrides.hal = "can";
    overrides.lockstep = wire != nullptr;
    squat = std::make_unique<BundledRun>(robot, "squat", overrides,
                                         RunParts{.recorder = recorder.value().get()},
                                         wire == nullptr ? Run::Connect() : over(*wire));
  }
  log::LogFile run() {
    squat->cycle->run();
    for (const FaultReport& fault : squat->cycle->faults()) ADD_FAILURE() << fault.text;
    EXPECT_GT(squat->cycle->running_cycles(), 0U);
    EXPECT_EQ((*recorder)->close().dropped, 0U);
    auto file = log::LogFile::open(path_);
    EXPECT_TRUE(file) << file.error().to_string();
    return *file;
  }

  std::string path_;
  Result<std::unique_ptr<log::Recorder>> recorder;
  std::unique_ptr<BundledRun> squat;
};

/// The plants, to the last bit: what the log of a run over CAN does not have.
void expect_same_robot(sim::EmulatedRobot& a, sim::EmulatedRobot& b) {
  Archive one, other;
  const_cast<sim::Plant&>(a.plant()).archive(one);  // it is written from
  const_cast<sim::Plant&>(b.plant()).archive(other);
  EXPECT_TRUE(std::ranges::equal(one.bytes(), other.bytes()));
}

class Lockstep : public testing::TestWithParam<const char*> {};

/// `cycles` of a squat in process and over the wire, compared; 0: all of it.
void expect_same_squat(const std::string& name, std::uint64_t cycles, bool bus_timing,
                       const std::vector<sim::ScenarioFault>& faults = {}) {
  const log::ScratchFolder folder;
  std::optional<LockstepRobot> wire;
  LoggedSquat in_process(name, folder / "a.mcap", cycles, nullptr, bus_timing);
  LoggedSquat over_wire(name, folder / "b.mcap", cycles, &wire, bus_timing);
  sim::EmulatedRobot& robot = in_process.squat->backend->robot();
  for (const sim::ScenarioFault& fault : faults) {
    ASSERT_EQ(robot.inject(fault), Code::kOk);
    ASSERT_EQ(wire->emulated->inject(fault), Code::kOk);
  }
  const log::LogFile a = in_process.run();
  const log::LogFile b = over_wire.run();
  const auto compared = log::compare(a, b);
  ASSERT_TRUE(compared) << compared.error().to_string();
  ASSERT_EQ(compared->topics.size(), 4U) << "state, command, events, the squat's signals";
  for (const log::TopicComparison& topic : compared->topics) {
    // Injected faults are known in process only.
    if (!faults.empty() && topic.topic == "/tandem/event") continue;
    ASSERT_FALSE(topic.first) << topic.topic << ", message " << topic.first->message << ": "
                              << topic.first->signal << " is " << topic.first->a << " and "
                              << topic.first->b;
    EXPECT_EQ(topic.messages_a, topic.messages_b) << topic.topic;
  }
  expect_same_robot(robot, *wire->emulated);
  ASSERT_EQ(robot.faults().size(), faults.size());
  for (const sim::FaultSlot& slot : robot.faults()) {
    EXPECT_GT(slot.struck, 5U) << hal::to_string(slot.fault.kind);
  }
}

TEST_P(Lockstep, ASquatFromPowerOnIsTheInProcessRunBitForBit) {
  expect_same_squat(GetParam(), 0, false);
}

TEST_P(Lockstep, TheTimeOfFramesOnTheWireIsTheSameOnEitherSide) {
  expect_same_squat(GetParam(), 1000, true);
}

TEST_P(Lockstep, AScenariosFaultsAreTheSameBitsOnEitherSide) {
  std::vector<sim::ScenarioFault> faults(3);
  faults[0].kind = hal::FaultKind::kFrameDrop;
  faults[0].probability = 0.01;
  faults[1].kind = hal::FaultKind::kFrameDelay;
  faults[1].direction = sim::FrameDirection::kToMaster;
  faults[1].probability = 0.01;
  faults[1].steps = 2;
  faults[2].kind = hal::FaultKind::kFrameReorder;
  faults[2].cob_id = 0x180;
  faults[2].cob_mask = 0x780;
  faults[2].probability = 0.01;
  for (sim::ScenarioFault& fault : faults) {
    fault.from = sim::FaultFrom::kEnabled;
    fault.start_ns = 1'200'000'000;
    fault.duration_ns = 500'000'000;
  }
  expect_same_squat(GetParam(), 1000, false, faults);
}

INSTANTIATE_TEST_SUITE_P(Robots, Lockstep, testing::Values("coman", "walkman"),
                         [](const auto& robot) { return std::string(robot.param); });

// exchange() may block, so the cycle's trap leaves it out. What waits here is the emulator's step,
// which may not allocate either: so the whole of it can stand under the trap.
TEST(LockstepRun, TheExchangeItselfAllocatesAndLocksNothing) {
  BundledRun squat("coman", "squat");
  const Experiment& e = *squat.experiment;
  LockstepRobot robot(e.robot, &squat.run->kernels(), e.sim_robot_config());
  hal::StateImage state(e.robot.shape());
  const hal::CommandImage idle(e.robot.shape());
  const hal::ParameterImage gains = hal::initial_parameters(e.robot);
  hal::CycleTime time;
  for (; time.cycle < 500; ++time.cycle) {
    time.time_ns = static_cast<std::int64_t>(time.cycle) * time.period_ns;
    {
      const rt::ScopedRealtime in_exchange;
      robot.backend->exchange(time);
    }
    ASSERT_EQ(robot.backend->read(time, state), Code::kOk) << robot.backend->status_text();
    ASSERT_EQ(robot.backend->write(idle, gains), Code::kOk);
  }
  EXPECT_EQ(robot.backend->phase(), hal::Phase::kOperational);
}

TEST(LockstepRun, AnEmulatorThatIsGoneIsAFaultThatSaysWhatToDo) {
  std::optional<LockstepRobot> wire;
  BundledRun squat("coman", "squat", {.duration_s = 0.01, .hal = "can", .lockstep = true}, {},
                   over(wire));
  wire->emulator_runs = false;
  RobotCycle& cycle = *squat.cycle;
  cycle.run();
  ASSERT_FALSE(cycle.faults().empty());
  EXPECT_NE(cycle.faults()[0].text.find("start `tandem emulate"), std::string::npos)
      << cycle.faults()[0].text;
  EXPECT_EQ(cycle.running_cycles(), 0U);
}

TEST(RealTimeRun, DoesNotTakeALateAnswerForTheNextOne) {
  std::optional<LockstepRobot> wire;
  rt::FakeClock clock;  // never late, whatever else the computer does
  BundledRun squat("coman", "squat", {.duration_s = 0.1, .hal = "can"}, {.clock = &clock},
                   over(wire, false));
  LockstepRobot& robot = *wire;
  RobotCycle& cycle = *squat.cycle;
  while (cycle.phase() == RunPhase::kBringUp) {
    ASSERT_TRUE(cycle.step());
    (void)robot.emulator->poll(0);  // boards that nobody waits for answer all the same
  }
  const auto waits_of_a_cycle = [&] {
    const std::int64_t before = robot.waits;
    EXPECT_TRUE(cycle.step());
    return robot.waits - before;
  };
  EXPECT_GT(waits_of_a_cycle(), 0);
  robot.emulator_runs = false;
  (void)waits_of_a_cycle();
  EXPECT_EQ(cycle.state().age_cycles()[0], 1U);
  robot.emulator_runs = true;
  (void)robot.emulator->poll(0);  // too late for its own cycle
  for (int k = 0; k < 5; ++k) EXPECT_GT(waits_of_a_cycle(), 0) << k;
  EXPECT_EQ(cycle.state().age_cycles()[0], 0U);
}

/// The wall clock of an emulator that never sleeps.
struct SetClock final : hal::can::FrameWait {
  std::int64_t now_ns() noexcept override { return ns; }
  void wait(std::int64_t, int) noexcept override {}
  std::int64_t ns = 1'000'000'000;
};

// A master that is late and dies between its SYNCs: the boards of the other buses stop sooner than
// the last SYNC would say.
TEST(RealTimeEmulator, CountsABoardsSilenceFromTheLastSyncOfItsOwnBus) {
  BundledRun squat("coman", "squat");
  const Experiment& e = *squat.experiment;
  auto robot = sim::EmulatedRobot::create(e.robot, &squat.run->kernels(), e.sim_robot_config());
  ASSERT_TRUE(robot) << robot.error().to_string();
  std::vector<std::unique_ptr<hal::can::LoopbackBus>> wires;
  std::vector<hal::can::Bus*> far;
  for (std::size_t b = 0; b < (*robot)->buses(); ++b) {
    wires.push_back(std::make_unique<hal::can::LoopbackBus>());
    far.push_back(&wires.back()->boards());
  }
  SetClock clock;
  const std::int64_t period_ns = e.loop.period_ns;
  sim::Emulator emulator(**robot, far, clock, {period_ns, false});
  const auto sync = [&](std::size_t buses) {
    const canopen::Frame frame = canopen::make_sync();
    for (std::size_t b = 0; b < buses; ++b) (void)wires[b]->master().send({&frame, 1});
  };
  const sim::EmulatorStatistics& seen = emulator.statistics();
  ASSERT_EQ(emulator.poll(0), Code::kOk) << "powered on";
  sync(far.size());
  ASSERT_EQ(emulator.poll(0), Code::kOk);
  EXPECT_EQ(seen.silent_steps, 0U);
  clock.ns += 6 * period_ns;  // both slept
  sync(1);
  ASSERT_EQ(emulator.poll(0), Code::kTimeout) << "waits for the other buses";
  clock.ns += period_ns / 2;
  ASSERT_EQ(emulator.poll(0), Code::kOk);
  const std::uint64_t made_up = seen.steps - 2;
  ASSERT_GE(made_up, 6U);
  EXPECT_EQ(seen.silent_steps, made_up - 1) << "SYNC was for the first of them";
  for (std::size_t b = 0; b < seen.boards.size(); ++b) {
    const bool had_sync = (*robot)->bus_of(b) == 0;
    EXPECT_EQ(seen.boards[b].silent_steps, had_sync ? made_up - 1 : made_up) << "board " << b;
    EXPECT_EQ(seen.boards[b].safe_after_steps, 1U) << "never enabled";
  }
}

}  // namespace
}  // namespace tandem::runtime
