// A stop wins over everything that was asked before it and in its cycle: every stop, from every way
// into the loop, with every other request, in both orders.
#include <csignal>
#include <functional>
#include <string>

#include "rt/stop_signal.hpp"
#include "tests/runtime/loop_run.hpp"

namespace tandem::runtime {
namespace {

using hal::StopCategory;
using Kind = CycleRequest::Kind;

/// An owner in another process, that a test speaks for.
struct PlayedOwner final : hal::RemoteCommandPort {
  bool lockstep() const noexcept override { return false; }
  void send(const hal::PortView&) noexcept override {}
  std::int64_t wait_until_ns(const hal::PortView&) noexcept override { return 0; }
  hal::RemoteCommand exchange(const hal::PortView& view) noexcept override {
    hal::RemoteCommand now = wish;
    if (now.reset) now.reset_cycle = view.time.cycle;
    wish = {};
    return now;
  }
  void on_news(std::function<void()>) override {}
  hal::RemoteCommand wish;
};

/// A run past bring-up that waits for a reset after a stop, with two controllers (one active), an
/// owner who may come, and room for more.
struct Robot : test::JointRun {
  static hal::RobotConfig stopped_by(StopCategory category) {
    hal::RobotConfig robot = hal::test::fake_robot();
    robot.emergency_stop = category;
    for (hal::JointConfig& joint : robot.joints) {
      joint.on_fault = category == StopCategory::kCategory2 ? StopCategory::kCategory1 : category;
    }
    return robot;
  }
  explicit Robot(StopCategory emergency_stop) : JointRun(stopped_by(emergency_stop)) {
    active = add_sine();
    second = add_sine({1}, "second", false);
    auto remote = std::make_shared<OwnerController>();
    add("remote", remote, false);
    owner = {&port, remote.get(), 2};
    begin({.after_stop = AfterStop::kWait, .after_reset = AfterReset::kHold});
    steps(50);
    EXPECT_EQ(cycle->phase(), RunPhase::kRunning);
  }
  ~Robot() { cycle.reset(); }  // it lets the port go
  [[nodiscard]] bool enabled() const {
    for (const std::uint8_t drive : cycle->state().drive_state()) {
      if (drive == static_cast<std::uint8_t>(hal::DriveState::kOperationEnabled)) return true;
    }
    return false;
  }
  [[nodiscard]] bool follows() const { return enabled() && backend.latched == StopCategory::kWarn; }

  PlayedOwner port;
  test::Sine *active = nullptr, *second = nullptr;
};

/// What a stop comes to, and how it is given.
struct Stop {
  std::string name;
  StopCategory category;
  std::function<void(Robot&)> give;
};
std::vector<Stop> stops() {
  std::vector<Stop> all;
  for (const StopCategory category :
       {StopCategory::kCategory0, StopCategory::kCategory1, StopCategory::kCategory2}) {
    const std::string name = hal::to_string(category);
    const auto in_words = [&](const char* way) { return std::string(way) + ", " + name; };
    // The socket's and the services' `estop` is this call, whoever carried it here.
    all.push_back({in_words("request"), category,
                   [category](Robot& r) { r.cycle->inbox().emergency_stop(category); }});
    all.push_back(
        {in_words("owner"), category, [category](Robot& r) { r.port.wish.stop = category; }});
    all.push_back({in_words("signal"), category, [](Robot&) { (void)std::raise(SIGUSR1); }});
    all.push_back({in_words("owner that is lost"), category, [category](Robot& r) {
                     r.port.wish.loss = hal::FaultCause::kOwnerSilent;
                     r.port.wish.on_loss = category;
                   }});
  }
  all.push_back({"owner, hold", StopCategory::kHold,
                 [](Robot& r) { r.port.wish.stop = StopCategory::kHold; }});
  for (const StopCategory category :
       {StopCategory::kCategory0, StopCategory::kCategory1, StopCategory::kHold}) {
    all.push_back({"board input, " + std::string(hal::to_string(category)), category, [](Robot& r) {
                     r.backend.fault_code = 0xFF02;
                     r.backend.faulted_joint = 2;
                   }});
  }
  return all;
}

struct Other {
  std::string name;
  bool resets;  ///< every fault
  std::function<void(Robot&)> ask;
};
std::vector<Other> others() {
  std::vector<Other> all{
      {"reset", true, [](Robot& r) { r.cycle->inbox().reset_faults(); }},
      {"owner's reset", true, [](Robot& r) { r.port.wish.reset = true; }},
      {"owner's command", false, [](Robot& r) { r.port.wish.live = true; }},
  };
  const auto request = [&](const char* name, CycleRequest one) {
    one.number = 77;
    all.push_back({name, false, [one](Robot& r) { EXPECT_TRUE(r.cycle->inbox().ask(one)); }});
  };
  request("start", {.kind = Kind::kSwitch, .start = 2});
  request("exchange", {.kind = Kind::kSwitch, .start = 2, .stop = 1});
  request("go on", {.kind = Kind::kGoOn});
  request("mode", {.kind = Kind::kJoint, .joint = 1, .wish = {.mode = 1, .interaction = 0}});
  request("impedance", {.kind = Kind::kJoint, .joint = 1, .wish = {.stiffness_Nm_rad = 1.0}});
  request("gains", {.kind = Kind::kGains, .joint = 1, .gains = {.kp = 1.0}});
  request("recover", {.kind = Kind::kRecover, .joint = 1});
  request("move", {.kind = Kind::kMove, .joint = 1, .move = {.target_rad = 0.3}});
  request("drive reset", {.kind = Kind::kReset, .joint = 2});
  request("home", {.kind = Kind::kHome, .joint = 1});
  request("free", {.kind = Kind::kRemove, .slot = 1});
  return all;
}

/// Where the run stands when both come.
struct Situation {
  std::string name;
  std::function<void(Robot&)> reach;
};
std::vector<Situation> situations() {
  const auto stop_before = [](Robot& r) {
    r.cycle->inbox().emergency_stop(StopCategory::kCategory1);
    r.steps(20);
  };
  return {{"running", [](Robot&) {}},
          {"faulted", stop_before},
          {"resetting",
           [=](Robot& r) {
             stop_before(r);
             r.cycle->inbox().reset_faults();
             r.until(RunPhase::kResetting);
           }},
          {"held", [=](Robot& r) {
             stop_before(r);
             r.cycle->inbox().reset_faults();
             r.until(RunPhase::kHeld);
           }}};
}

void expect_stopped(Robot& r, const Stop& stop, const Other& other) {
  const std::uint64_t resets = r.cycle->progress().resets.load();
  r.steps(1);
  const int updates = r.active->updates + r.second->updates;
  while (const auto answer = r.cycle->inbox().take_answer()) {
    EXPECT_TRUE(other.name == "free" || answer->reason == RejectReason::kStopped);
  }
  EXPECT_TRUE(!other.resets || r.cycle->progress().failed_resets.load() >= 1) << "told so";
  r.steps(300);
  EXPECT_EQ(r.cycle->phase(), RunPhase::kFaulted);
  EXPECT_EQ(r.cycle->progress().resets.load(), resets);
  EXPECT_GE(r.cycle->progress().latched.load(), 1U);
  EXPECT_EQ(r.active->updates + r.second->updates, updates) << "no controller runs";
  // There is nobody who can retreat: category 2 is category 1.
  EXPECT_LE(r.backend.latched, std::min(stop.category, StopCategory::kHold));
  EXPECT_FALSE(r.follows());
  EXPECT_TRUE(stop.category == StopCategory::kHold || !r.enabled());
  EXPECT_EQ(r.backend.single_resets, 0U);
}

TEST(AStop, WinsOverEverythingOfItsCycleWhateverComesFirst) {
  rt::install_emergency_signal();
  int pairs = 0;
  for (const Situation& situation : situations()) {
    for (const Stop& stop : stops()) {
      for (const Other& other : others()) {
        for (const bool stop_first : {false, true}) {
          SCOPED_TRACE(situation.name + ": " + stop.name + " and " + other.name +
                       (stop_first ? ", the stop first" : ", the stop last"));
          Robot r(stop.category);
          situation.reach(r);
          if (stop_first) stop.give(r);
          other.ask(r);
          if (!stop_first) stop.give(r);
          expect_stopped(r, stop, other);
          ++pairs;
          ASSERT_FALSE(::testing::Test::HasFailure());
        }
      }
    }
  }
  RecordProperty("pairs", pairs);
  std::printf("%d pairs\n", pairs);
}

/// The end of the run takes the robot to rest, too: both are carried out.
TEST(AStop, AndTheEndOfTheRunAreBothCarriedOut) {
  rt::install_emergency_signal();
  for (const Stop& stop : stops()) {
    for (const bool stop_first : {false, true}) {
      SCOPED_TRACE(stop.name);
      Robot r(stop.category);
      if (stop_first) stop.give(r);
      r.cycle->inbox().end_run();
      if (!stop_first) stop.give(r);
      r.steps(1);
      EXPECT_LE(r.backend.latched, std::min(stop.category, StopCategory::kHold));
      r.until(RunPhase::kDone);
      EXPECT_GE(r.cycle->progress().latched.load(), 1U);
    }
  }
}

/// While a robot retreats (category 2) nothing is started; a stop of its own still ends that.
TEST(AStop, OfCategory2KeepsARetreatThatAResetOfItsCycleWouldEnd) {
  for (const Other& other : others()) {
    if (other.name == "owner's command") continue;  // an owner takes the place of who retreats
    SCOPED_TRACE(other.name);
    Robot r(StopCategory::kCategory2);
    r.active->retreats = true;
    r.cycle->inbox().emergency_stop(StopCategory::kCategory2);
    other.ask(r);
    r.steps(1);
    EXPECT_EQ(r.cycle->phase(), RunPhase::kRetreating);
    while (const auto answer = r.cycle->inbox().take_answer()) {
      EXPECT_NE(answer->reason, RejectReason::kNone);
      if (other.name == "free") break;
    }
    EXPECT_EQ(r.cycle->progress().resets.load(), 0U);
  }
}

TEST(AStop, EndsAResetInEachOfItsCycles) {
  rt::install_emergency_signal();
  for (int into = 0; into < 12; ++into) {
    for (const Stop& stop : stops()) {
      SCOPED_TRACE(stop.name + ", cycles into the reset: " + std::to_string(into));
      Robot r(stop.category);
      r.cycle->inbox().emergency_stop(StopCategory::kCategory1);
      r.steps(20);
      r.cycle->inbox().reset_faults();
      r.steps(into);
      stop.give(r);
      r.steps(300);
      EXPECT_EQ(r.cycle->phase(), RunPhase::kFaulted);
      EXPECT_FALSE(r.follows());
      EXPECT_LE(r.backend.latched, std::min(stop.category, StopCategory::kHold));
    }
  }
}

/// A joint's fault only warned, and its drive is being reset when the stop comes.
TEST(AStop, EndsTheResetOfOneDrive) {
  for (int into = 0; into < 6; ++into) {
    Robot r(StopCategory::kCategory1);
    for (hal::JointConfig& joint : r.robot.joints) joint.on_fault = StopCategory::kWarn;
    r.backend.reset_clears = false;
    r.backend.faulted_joint = 2;
    r.steps(5);
    ASSERT_EQ(r.cycle->phase(), RunPhase::kRunning);
    EXPECT_TRUE(r.cycle->inbox().ask({.number = 1, .kind = Kind::kReset, .joint = 2}));
    r.steps(into + 1);
    ASSERT_EQ(r.cycle->inbox().take_answer()->reason, RejectReason::kNone);
    ASSERT_EQ(r.cycle->services().joints()[2].look.resetting, 1);
    r.cycle->inbox().emergency_stop(StopCategory::kCategory0);
    r.steps(1);
    EXPECT_EQ(r.cycle->services().joints()[2].look.resetting, 0);
    const std::uint64_t told = r.backend.single_resets;
    r.steps(100);
    EXPECT_EQ(r.backend.single_resets, told) << "the drive is told no more";
    EXPECT_EQ(r.cycle->phase(), RunPhase::kFaulted);
    EXPECT_FALSE(r.enabled());
  }
}

/// It knew of the first stop alone. A stop by signal, board or owner counts as one by request.
TEST(AStop, WinsOverAResetThatWasAskedForBeforeItAndComesLater) {
  rt::install_emergency_signal();
  for (const Stop& stop : stops()) {
    SCOPED_TRACE(stop.name);
    Robot r(stop.category);
    r.cycle->inbox().emergency_stop(StopCategory::kCategory1);
    r.steps(20);
    const std::uint64_t known = r.cycle->progress().stopped_before.load();
    EXPECT_GT(known, 0U);
    stop.give(r);
    r.steps(20);
    r.backend.faulted_joint = -1;
    r.cycle->inbox().reset_faults(known);  // it waited in a queue until now
    r.steps(50);
    EXPECT_EQ(r.cycle->phase(), RunPhase::kFaulted);
    EXPECT_EQ(r.cycle->progress().failed_resets.load(), 1U);
    r.cycle->inbox().reset_faults(r.cycle->progress().stopped_before.load());
    r.until(RunPhase::kHeld);
  }
}

TEST(AStop, IsKnownToARestoredRun) {
  Robot r(StopCategory::kCategory1);
  r.cycle->inbox().emergency_stop(StopCategory::kCategory1);
  r.steps(20);
  const auto saved = r.cycle->save();
  ASSERT_TRUE(saved);
  const std::uint64_t known = r.cycle->progress().stopped_before.load();
  r.cycle->inbox().emergency_stop(StopCategory::kCategory0);
  r.steps(20);
  ASSERT_TRUE(r.cycle->restore(*saved));
  EXPECT_EQ(r.cycle->progress().stopped_before.load(), known);
}

}  // namespace
}  // namespace tandem::runtime
