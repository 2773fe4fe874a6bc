// In lockstep a run over CAN is the in-process run, bit for bit.
#include "tests/runtime/lockstep.hpp"

#include <algorithm>

#include "base/archive.hpp"
#include "hal/sim/sim_robot.hpp"
#include "log/compare.hpp"
#include "model/kernel_library.hpp"
#include "rt/clock.hpp"
#include "rt/scoped_realtime.hpp"
#include "runtime/experiment.hpp"
#include "runtime/robot_cycle.hpp"
#include "tests/log/scratch_folder.hpp"

namespace tandem::runtime {
namespace {

using test::LockstepRobot;

/// One squat of a robot with its log, in process or over the wire.
class Squat {
 public:
  explicit Squat(const std::string& robot) {
    auto read =
        read_experiment(std::string(TANDEM_SOURCE_DIR) + "/config/" + robot + "/squat.toml");
    if (!read) {
      ADD_FAILURE() << read.error().at(0).to_string();
      return;
    }
    e = std::move(*read);
    auto loaded = model::load_kernels(std::string(TANDEM_BINARY_DIR) + "/lib/models/" + robot +
                                      "_kernels.so");
    EXPECT_TRUE(loaded) << loaded.error().to_string();
    kernels = *loaded;
    host = std::make_unique<ControllerHost>(e.robot, kernels.get(), e.loop.period_ns);
    for (const ControllerSpec& spec : e.controllers) {
      auto plugin =
          load_controller(spec.plugin, {std::string(TANDEM_BINARY_DIR) + "/lib/controllers"});
      EXPECT_TRUE(plugin) << plugin.error().to_string();
      EXPECT_TRUE(host->add(spec.name, std::move(*plugin), spec.parameters));
    }
  }
  log::LogFile run(hal::Backend& backend, const std::string& path, std::uint64_t cycles = 0) {
    log::RunInfo info{.robot = e.robot.name, .period_ns = e.loop.period_ns};
    for (const hal::JointConfig& joint : e.robot.joints) info.joints.push_back(joint.name);
    for (const hal::SensorConfig& sensor : e.robot.sensors) {
      info.sensors.push_back({sensor.name, sensor.channels()});
    }
    auto recorder = log::Recorder::open(path, info, {});
    EXPECT_TRUE(recorder) << recorder.error().to_string();
    rt::WallClock clock;
    RobotCycle cycle({e.robot, backend, *host, clock, recorder->get(), nullptr},
                     {.loop = e.loop,
                      .running_cycles = cycles == 0 ? e.cycles() : cycles,
                      .settle_cycles = e.settle_cycles()});
    cycle.run();
    for (const Fault& fault : cycle.faults()) ADD_FAILURE() << fault.text;
    EXPECT_GT(cycle.running_cycles(), 0U) << backend.status_text();
    const log::RecordingResult result = (*recorder)->close();
    EXPECT_EQ(result.dropped, 0U);
    auto file = log::LogFile::open(path);
    EXPECT_TRUE(file) << file.error().to_string();
    return *file;
  }

  Experiment e;
  model::KernelLibrary kernels;
  std::unique_ptr<ControllerHost> host;
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
void expect_same_squat(const std::string& name, std::uint64_t cycles, bool bus_timing) {
  const log::ScratchFolder folder;
  Squat in_process(name);
  sim::SimRobotConfig config = in_process.e.sim_robot_config();
  config.bus_timing = bus_timing;
  auto sim = sim::SimRobot::create(in_process.e.robot, in_process.kernels.get(), config);
  ASSERT_TRUE(sim) << sim.error().to_string();
  const log::LogFile a = in_process.run(**sim, folder / "a.mcap", cycles);

  Squat over_wire(name);
  LockstepRobot robot(over_wire.e.robot, over_wire.kernels.get(), config);
  const log::LogFile b = over_wire.run(*robot.backend, folder / "b.mcap", cycles);

  const auto compared = log::compare(a, b);
  ASSERT_TRUE(compared) << compared.error().to_string();
  ASSERT_EQ(compared->topics.size(), 3U);
  for (const log::TopicComparison& topic : compared->topics) {
    ASSERT_FALSE(topic.first) << topic.topic << ", message " << topic.first->message << ": "
                              << topic.first->signal << " is " << topic.first->a << " and "
                              << topic.first->b;
    EXPECT_EQ(topic.messages_a, topic.messages_b) << topic.topic;
  }
  expect_same_robot((*sim)->robot(), *robot.emulated);
}

TEST_P(Lockstep, ASquatFromPowerOnIsTheInProcessRunBitForBit) {
  expect_same_squat(GetParam(), 0, false);
}

TEST_P(Lockstep, TheTimeOfFramesOnTheWireIsTheSameOnEitherSide) {
  expect_same_squat(GetParam(), 1000, true);
}

TEST_P(Lockstep, AScenariosFaultsAreTheSameBitsOnEitherSide) {
  const log::ScratchFolder folder;
  Squat in_process(GetParam());
  std::vector<sim::Fault> faults(3);
  faults[0].kind = hal::FaultKind::kFrameDrop;
  faults[0].probability = 0.01;
  faults[1].kind = hal::FaultKind::kFrameDelay;
  faults[1].direction = sim::Direction::kToMaster;
  faults[1].probability = 0.01;
  faults[1].steps = 2;
  faults[2].kind = hal::FaultKind::kFrameReorder;
  faults[2].cob_id = 0x180;
  faults[2].cob_mask = 0x780;
  faults[2].probability = 0.01;
  for (sim::Fault& fault : faults) {
    fault.from = sim::FaultFrom::kEnabled;
    fault.start_ns = 1'200'000'000;
    fault.duration_ns = 500'000'000;
  }
  sim::SimRobotConfig config = in_process.e.sim_robot_config();
  config.faults = faults;
  auto sim = sim::SimRobot::create(in_process.e.robot, in_process.kernels.get(), config);
  ASSERT_TRUE(sim) << sim.error().to_string();
  const log::LogFile a = in_process.run(**sim, folder / "a.mcap", 1000);

  Squat over_wire(GetParam());
  LockstepRobot robot(over_wire.e.robot, over_wire.kernels.get(), config);
  const log::LogFile b = over_wire.run(*robot.backend, folder / "b.mcap", 1000);

  const auto compared = log::compare(a, b);
  ASSERT_TRUE(compared) << compared.error().to_string();
  for (const log::TopicComparison& topic : compared->topics) {
    if (topic.topic == "/tandem/event") continue;  // the injected ones are known in process only
    EXPECT_FALSE(topic.first) << topic.topic << ", message " << topic.first->message << ": "
                              << topic.first->signal;
    EXPECT_EQ(topic.messages_a, topic.messages_b) << topic.topic;
  }
  expect_same_robot((*sim)->robot(), *robot.emulated);
  ASSERT_EQ((*sim)->robot().faults().size(), faults.size());
  for (const sim::FaultSlot& slot : (*sim)->robot().faults()) {
    EXPECT_GT(slot.struck, 5U) << hal::to_string(slot.fault.kind);
  }
}

INSTANTIATE_TEST_SUITE_P(Robots, Lockstep, testing::Values("coman", "walkman"),
                         [](const auto& robot) { return std::string(robot.param); });

// exchange() may block, so the cycle's trap leaves it out. What waits here is the emulator's step,
// which may not allocate either: so the whole of it can stand under the trap.
TEST(LockstepRun, TheExchangeItselfAllocatesAndLocksNothing) {
  Squat squat("coman");
  LockstepRobot robot(squat.e.robot, squat.kernels.get(), squat.e.sim_robot_config());
  hal::StateImage state(squat.e.robot.shape());
  const hal::CommandImage idle(squat.e.robot.shape());
  const hal::ParameterImage gains = hal::initial_parameters(squat.e.robot);
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
  const log::ScratchFolder folder;
  Squat squat("coman");
  LockstepRobot robot(squat.e.robot, squat.kernels.get(), squat.e.sim_robot_config());
  robot.emulator_runs = false;
  rt::WallClock clock;
  RobotCycle cycle({squat.e.robot, *robot.backend, *squat.host, clock, nullptr, nullptr},
                   {.running_cycles = 10});
  cycle.run();
  ASSERT_FALSE(cycle.faults().empty());
  EXPECT_NE(cycle.faults()[0].text.find("start `tandem emulate"), std::string::npos)
      << cycle.faults()[0].text;
  EXPECT_EQ(cycle.running_cycles(), 0U);
}

TEST(RealTimeRun, DoesNotTakeALateAnswerForTheNextOne) {
  Squat squat("coman");
  LockstepRobot robot(squat.e.robot, squat.kernels.get(), squat.e.sim_robot_config(), false);
  rt::WallClock clock;
  RobotCycle cycle({squat.e.robot, *robot.backend, *squat.host, clock, nullptr, nullptr},
                   {.running_cycles = 100});
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
  Squat squat("coman");
  auto robot =
      sim::EmulatedRobot::create(squat.e.robot, squat.kernels.get(), squat.e.sim_robot_config());
  ASSERT_TRUE(robot) << robot.error().to_string();
  std::vector<std::unique_ptr<hal::can::LoopbackBus>> wires;
  std::vector<hal::can::Bus*> far;
  for (std::size_t b = 0; b < (*robot)->buses(); ++b) {
    wires.push_back(std::make_unique<hal::can::LoopbackBus>());
    far.push_back(&wires.back()->boards());
  }
  SetClock clock;
  const std::int64_t period_ns = squat.e.loop.period_ns;
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
