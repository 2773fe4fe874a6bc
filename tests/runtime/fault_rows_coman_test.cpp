// The rows of docs/faults.md about COMAN: 29 joints on 16 boards and five buses, standing on its
// own feet in the middle of a squat. A fixed arm cannot fall, lie on the ground, or be held
// upright.
#include <csignal>
#include <thread>

#include "canopen/messages.hpp"
#include "rt/stop_signal.hpp"
#include "runtime/cycle_watchdog.hpp"
#include "tests/runtime/bundled_run.hpp"
#include "tests/runtime/fault_row.hpp"
#include "tests/support/eventually.hpp"

namespace tandem::runtime {
namespace {

using namespace test;

/// COMAN's squat, with faults that wait for a reset.
struct ComanRig : BundledRun {
  explicit ComanRig(std::function<void(Experiment&)> change = {})
      : BundledRun("coman", "squat",
                   {.duration_s = 1000.0, .on_fault = "wait", .change = std::move(change)}) {}

  /// Into the first descent.
  void descend() {
    run_to(RunPhase::kRunning);
    steps(2000);
    ASSERT_TRUE(cycle->faults().empty()) << cycle->faults()[0].text;
  }
  [[nodiscard]] sim::EmulatedRobot& robot() { return backend->robot(); }
  /// A period passes without the master.
  void without_master() { (void)robot().step(robot().now_ns() + experiment->loop.period_ns); }
  [[nodiscard]] bool board_noticed() {
    for (std::size_t b = 0; b < boards(); ++b) {
      if (robot().board(b).axis(0).objects().error_code != 0) return true;
    }
    return false;
  }
  [[nodiscard]] std::size_t boards() const { return experiment->robot.boards.size(); }
  [[nodiscard]] bool noticed() const {
    return backend->phase() == hal::Phase::kFault || !cycle->faults().empty();
  }
  void note(Outcome& found, int i, bool notices) {
    if (found.noticed < 0 && notices) found.noticed = i;
    if (found.safe < 0 && robot().safe()) found.safe = i;
    if (found.safe >= 0 && found.open < 0 && robot().powerless()) found.open = i;
  }
  Outcome watch(int cycles = 4000) {
    Outcome found;
    for (int i = 1; i <= cycles && found.open < 0; ++i) {
      if (!cycle->step()) without_master();
      note(found, i, noticed());
    }
    return found;
  }
  Outcome watch_without_master() {
    Outcome found;
    for (int i = 1; i <= 4000 && found.open < 0; ++i) {
      without_master();
      note(found, i, board_noticed());
    }
    return found;
  }
  /// To every node, on every bus, as a stranger's.
  void command_nodes(canopen::NmtCommand command) {
    const canopen::Frame frame = canopen::make_nmt(command, 0);
    for (std::size_t b = 0; b < robot().buses(); ++b)
      (void)robot().bus(b).master().send({&frame, 1});
  }
  /// Resets, and waits until every joint is held.
  void reset() {
    cycle->inbox().reset_faults();
    for (int i = 0; i < 5000 && cycle->phase() != RunPhase::kHeld; ++i) (void)cycle->step();
    ASSERT_EQ(cycle->phase(), RunPhase::kHeld) << causes();
  }
  [[nodiscard]] std::string causes() const {
    std::string all = backend->status_text();
    for (const runtime::FaultReport& fault : cycle->faults())
      all += "\n" + fault.joint + ": " + fault.text;
    return all;
  }
  [[nodiscard]] double height_m() const { return backend->plant().q()[2]; }
};

/// COMAN with a controller of the test instead of its squat.
struct OtherRig : ComanRig {
  OtherRig(const char* name, std::shared_ptr<Controller> controller,
           const std::string& its_parameters = "",
           hal::StopCategory on_stray = hal::StopCategory::kCategory1)
      : ComanRig([on_stray](Experiment& e) {
          e.controllers.clear();
          e.on_stray = on_stray;
        }) {
    EXPECT_TRUE(run->controllers().add(name, std::move(controller), parameters(its_parameters)));
  }
};

TEST(FaultRow, MasterOfComanDies) {
  ComanRig rig;
  rig.descend();
  ASSERT_TRUE(rig.robot().all_enabled());
  expect_row(rig.watch_without_master());
  for (std::size_t b = 0; b < rig.boards(); ++b) {
    EXPECT_EQ(rig.robot().board(b).axis(0).objects().error_code, 0x8700) << "board " << b;
  }
}

TEST(FaultRow, ControllerOfComanHangs) {
  const auto loaded = tandem::test::load_test_robot("coman");
  FaultRig rig(loaded.robot, loaded.kernels.get(), "stand");
  rig.run();
  std::atomic<std::int32_t> hung_in{-2};
  std::atomic<bool> back{false}, given_up{false};
  const CycleWatchdog watchdog(
      rig.cycle->heartbeat(),
      {.limit = std::chrono::milliseconds(50), .grace = std::chrono::hours(1)},
      {.on_hang =
           [&](bool) {
             hung_in = rig.host->at_work();
             rig.cycle->inbox().watchdog_stop(rig.host->at_work());
           },
       .on_return = [&] { back = true; },
       .on_given_up = [&] { given_up = true; }});
  rig.sine->hangs = true;
  std::thread loop([&] { (void)rig.cycle->step(); });  // its SYNC is the last
  EXPECT_TRUE(tandem::test::eventually([&] { return hung_in >= 0; }));
  Outcome found;
  for (int i = 1; i <= 4000 && found.open < 0; ++i) {
    rig.backend->without_master();
    bool noticed = false;
    for (std::size_t b = 0; b < rig.robot.boards.size(); ++b) {
      noticed = noticed || rig.axis(b).objects().error_code != 0;
    }
    rig.note(found, i, noticed);
  }
  expect_row(found);
  EXPECT_EQ(rig.host->name(static_cast<std::size_t>(hung_in)), "sine");
  rig.sine->hangs = false;
  loop.join();
  EXPECT_TRUE(tandem::test::eventually([&] { return back.load(); }));
  EXPECT_FALSE(given_up);
  for (int i = 0; i < 3000 && rig.cycle->step(); ++i) {
  }
  EXPECT_EQ(rig.cycle->phase(), RunPhase::kDone) << "a loop that comes back ends in order";
  EXPECT_NE(rig.causes().find("watchdog"), std::string::npos) << rig.causes();
}

TEST(FaultRow, AnotherMasterStopsTheNodesOfComan) {
  ComanRig rig;
  rig.descend();
  rig.command_nodes(canopen::NmtCommand::kStop);
  expect_row(rig.watch());
  EXPECT_NE(rig.causes().find("no complete TPDO for 10 cycles"), std::string::npos) << rig.causes();
}

TEST(FaultRow, AnotherMasterResetsTheNodesOfComan) {
  ComanRig rig;
  rig.descend();
  rig.command_nodes(canopen::NmtCommand::kResetNode);
  expect_row(rig.watch());
  EXPECT_NE(rig.causes().find("booted again by itself"), std::string::npos) << rig.causes();
}

// SIGHUP, and what a closed pipe asks for: rt::request_stop() (apps: Faults.AReaderThatGoes…).
TEST(FaultRow, TerminalOfComanIsClosed) {
  rt::clear_stop();
  rt::install_stop_signals();
  ComanRig rig;
  rig.descend();
  ASSERT_EQ(::raise(SIGHUP), 0);
  Outcome found = rig.watch();
  EXPECT_EQ(found.noticed, -1) << "it is no fault";
  expect_row(found);
  EXPECT_EQ(rig.cycle->phase(), RunPhase::kDone);
  rt::clear_stop();
}

TEST(FaultRow, ControllerOfComanWritesWithoutAClaim) {
  auto stray = std::make_shared<test::Stray>(0, false);
  stray->scribbles = false;
  OtherRig rig("stray", stray);
  rig.run_to(RunPhase::kRunning);
  rig.steps(100);
  ASSERT_FALSE(rig.noticed()) << rig.causes();
  stray->scribbles = true;
  expect_row(rig.watch());
  EXPECT_NE(rig.causes().find("the controller 'stray' wrote to this joint"), std::string::npos)
      << rig.causes();
}

// It was said twice, as a warning and as a fault, and the run ended with status 1.
TEST(StrayOfComan, ThatOnlyWarnsIsToldAndIsNoFaultThatStays) {
  auto stray = std::make_shared<test::Stray>(0, false);
  OtherRig rig("stray", stray, "", hal::StopCategory::kWarn);
  rig.run_to(RunPhase::kRunning);
  rig.steps(100);
  EXPECT_EQ(rig.cycle->phase(), RunPhase::kRunning) << rig.causes();
  const auto faults = rig.cycle->faults();
  ASSERT_FALSE(faults.empty());
  for (const runtime::FaultReport& fault : faults) EXPECT_FALSE(fault.latched) << fault.text;
}

TEST(FaultRow, JointOfComanRings) {
  ComanRig rig;
  rig.descend();
  const auto set = rig.cycle->services().set_gains("RElbj", hal::PidLoop::kPosition,
                                                   {.kp = 4e5, .kd = 4e3}, kNow);
  ASSERT_TRUE(set) << set.error().to_string();
  expect_row(rig.watch());
  EXPECT_NE(rig.causes().find("the joint oscillates"), std::string::npos) << rig.causes();
}

/// @return how high the base was when the drives were stopped
double retreat(ComanRig& rig) {
  rig.run_to(RunPhase::kRunning);
  const double standing_m = rig.height_m();
  rig.descend();
  (void)rig.cycle->inbox().emergency_stop(hal::StopCategory::kCategory2);
  Outcome found;
  double stopped_m = 0.0;
  for (int i = 1; i <= 9000 && found.open < 0; ++i) {
    (void)rig.cycle->step();
    rig.note(found, i, rig.noticed());
    if (rig.cycle->phase() == RunPhase::kRetreating) stopped_m = rig.height_m();
  }
  expect_row(found);
  EXPECT_NEAR(stopped_m, standing_m - 0.1, 0.005) << "the squat's depth";
  return stopped_m;
}

TEST(FaultRow, RetreatOfComan) {
  ComanRig rig;
  (void)retreat(rig);
}

TEST(FaultRow, RetreatOfComanWithBrakes) {
  ComanRig rig([](Experiment& e) {
    for (hal::JointConfig& joint : e.robot.joints) {
      joint.brake = hal::BrakeConfig{.torque_Nm = 60.0, .release_ms = 30, .engage_ms = 30};
    }
  });
  const double stopped_m = retreat(rig);
  rig.steps(3000);
  EXPECT_NEAR(rig.height_m(), stopped_m, 0.01) << "it stays in its squat";
  rig.reset();
  ASSERT_TRUE(rig.cycle->services().go_on(kNow));
  rig.steps(3000);
  EXPECT_EQ(rig.cycle->phase(), RunPhase::kRunning) << rig.causes();
}

TEST(FaultRow, ResetOfComanHolds) {
  ComanRig rig([](Experiment& e) {
    for (hal::JointConfig& joint : e.robot.joints) joint.on_fault = hal::StopCategory::kHold;
  });
  rig.descend();
  sim::ScenarioFault fault = of(FaultKind::kEncoderUnplug);
  fault.duration_ns = 5'000'000;
  ASSERT_EQ(rig.robot().inject(fault), Code::kOk);
  const Outcome found = rig.watch(200);
  expect_row(found);
  rig.reset();
  rig.steps(100);  // references that followed their joints' noise come to rest
  const std::uint64_t ran = rig.cycle->running_cycles();
  const std::vector<double> references(rig.cycle->command().position_rad().begin(),
                                       rig.cycle->command().position_rad().end());
  const double before_m = rig.height_m();
  rig.steps(2000);
  EXPECT_EQ(rig.cycle->phase(), RunPhase::kHeld);
  EXPECT_EQ(rig.cycle->running_cycles(), ran);
  EXPECT_TRUE(std::ranges::equal(rig.cycle->command().position_rad(), references))
      << "no reference moves";
  EXPECT_NEAR(rig.height_m(), before_m, 0.005) << "it stands where it was stopped";
  ASSERT_TRUE(rig.cycle->services().go_on(kNow));
  rig.steps(10);
  EXPECT_EQ(rig.cycle->phase(), RunPhase::kRunning);
  EXPECT_FALSE(std::ranges::equal(rig.cycle->command().position_rad(), references));
}

TEST(FaultRow, ComanFalls) {
  const auto lowered = tandem::test::load_test_robot("coman").robot.joints;
  const auto knee = std::ranges::find(lowered, "LKneeSag", &hal::JointConfig::name);
  OtherRig rig(
      "sine", std::make_shared<Sine>(std::vector{static_cast<std::size_t>(knee - lowered.begin())}),
      "amplitude_rad = 1.0");
  rig.run_to(RunPhase::kRunning);
  // The fault acts when the base passes what counts as fallen.
  const FallLimits& fall = rig.cycle->config().fall;
  const double limit_m = fall.lowest_share * fall.standing_m;
  int until = 0;
  while (until < 5000 && tilt_of(rig.backend->truth().base_quaternion()) <= fall.tilt_rad &&
         rig.backend->truth().base_position_m()[2] >= limit_m) {
    ASSERT_FALSE(rig.noticed()) << rig.causes() << " after " << until;
    (void)rig.cycle->step();
    ++until;
  }
  ASSERT_LT(until, 5000) << "it does not fall";
  Outcome found;
  for (int i = 1; i <= 4000 && found.open < 0; ++i) {
    if (i > 1) (void)rig.cycle->step();  // the last step above is the first
    rig.note(found, i, rig.noticed());
  }
  expect_row(found);
  EXPECT_NE(rig.causes().find("the robot fell"), std::string::npos) << rig.causes();
}

TEST(FaultRow, ComanLiesAfterAnEmergencyStop) {
  ComanRig rig;
  rig.descend();
  const double standing_m = rig.height_m();
  rig.cycle->inbox().emergency_stop(hal::StopCategory::kCategory1);
  rig.steps(6000);
  ASSERT_LT(rig.height_m(), 0.7 * standing_m) << "it lies";
  EXPECT_EQ(rig.cycle->faults().size(), 1U) << "that is no further fault: " << rig.causes();
  rig.reset();
  rig.steps(1000);
  EXPECT_EQ(rig.cycle->phase(), RunPhase::kHeld) << "it may lie there";
  ASSERT_TRUE(rig.cycle->services().go_on(kNow));
  Outcome found;
  for (int i = 1; i <= 4000 && found.open < 0; ++i) {
    (void)rig.cycle->step();
    rig.note(found, i, rig.cycle->phase() == RunPhase::kFaulted);
  }
  expect_row(found);
  EXPECT_NE(rig.causes().find("the controller gave up"), std::string::npos) << rig.causes();
}

}  // namespace
}  // namespace tandem::runtime
