// An operator in real time: what its loop sees of a robot that another loop has, over DDS and a
// declared network of 100 ms each way.
#include <cmath>

#include "hal/remote/live_link.hpp"
#include "tests/remote/link_rig.hpp"

namespace tandem::remote {
namespace {

using namespace test;

constexpr std::uint64_t kDelay = 100, kPlayout = 250;  // cycles; one way, and there and back

runtime::CycleConfig real_time(std::uint64_t running = 0) {
  runtime::CycleConfig config;
  config.loop.rate = 1.0;
  config.running_cycles = running;
  return config;
}

ServerConfig robots_end() {
  ServerConfig config;
  config.playout = {.delay_cycles = kPlayout, .brake_cycles = 50};
  config.max_age_cycles = 50'000;  // of a busy machine
  config.lease_timeout_s = 30.0;
  return config;
}

/// Fails when its time does not go on by one period at a time, as the boards of a simulated robot
/// do.
class StrictTwin final : public runtime::test::FirstOrderRobot {
 public:
  using FirstOrderRobot::FirstOrderRobot;
  Code read(const hal::CycleTime& time, hal::StateImage& state) noexcept override {
    const bool goes_on = reads_++ == 0 || time.time_ns == last_ns_ + kPeriod_ns;
    last_ns_ = time.time_ns;
    const Code code = FirstOrderRobot::read(time, state);
    return goes_on ? code : Code::kFault;
  }

 private:
  std::uint64_t reads_ = 0;
  std::int64_t last_ns_ = 0;
};

/// An operator's loop with a sine on joint 0.
class Operator : public runtime::test::LoopRun {
 public:
  Operator(bool predict, std::uint64_t running, std::vector<Outage> outages = {})
      : LoopRun(hal::test::fake_robot()),
        participant_(participant("operator")),
        record(robot, 20'000) {
    ClientConfig client;
    client.own_pace = true;
    client.robot_end.playout_cycles = robots_end().playout->shown_after_cycles();
    auto made = Owner::connect(*participant_, client, robot);
    EXPECT_TRUE(made) << made.error().to_string();
    TeleConfig config;
    config.up = config.down = {.delay_s = 0.1, .loss = 0.05};
    config.predict = predict;
    config.playout_ns = 150'000'000;
    config.outages = std::move(outages);
    OperatorEnd::End twin;
    if (predict) twin.robot = std::make_unique<StrictTwin>(robot);
    link = std::make_unique<LiveLink>(hal::robot_of(robot), std::move(*made), std::move(twin),
                                      config, 100'000'000, kPlayout, kPeriod_ns);
    add_sine();
    runtime::CycleConfig wanted = real_time(running);
    wanted.bring_up_cycles = ~std::uint64_t{0};
    wanted.loop.pacing = rt::Pacing::kWallClock;
    clock = &sleepy;
    observer = &record;
    begin(*link, wanted);
  }
  /// RMS difference of what the operator saw and what it asked for, of joint 0 [rad], once the
  /// first command can have been seen.
  [[nodiscard]] double error() const {
    double sum = 0.0;
    std::size_t running = 0, count = 0;
    for (const Record::Cycle& one : record.cycles()) {
      if (one.phase != RunPhase::kRunning || ++running < 600) continue;
      const double error = one.state.position_rad()[0] - one.command.position_rad()[0];
      sum += error * error;
      ++count;
    }
    return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, count)));
  }

  std::unique_ptr<dds::Participant> participant_;
  Record record;
  std::unique_ptr<LiveLink> link;
  SleepyClock sleepy;
};

TEST(LiveLink, TheOperatorSeesThePredictedRobot) {
  double errors[2];
  for (const bool predict : {true, false}) {
    Served served(robots_end(), real_time());
    served.begin();
    Operator one(predict, 1200);
    one.cycle->run();
    served.end();
    EXPECT_TRUE(one.cycle->faults().empty());
    EXPECT_TRUE(served.cycle->faults().empty());
    errors[predict ? 0 : 1] = one.error();
    const TeleFigures figures = one.link->figures();
    EXPECT_GT(figures.up.lost, 20U);
    if (!predict) continue;
    EXPECT_GT(figures.compared, 100U);
    EXPECT_LT(figures.worst_prediction_rad, 0.05) << "a state against the twin under its command";
  }
  RecordProperty("predicted_rad", std::to_string(errors[0]));
  RecordProperty("last_state_rad", std::to_string(errors[1]));
  EXPECT_GT(errors[1], 4.0 * errors[0]);
  EXPECT_GT(errors[1], 0.02) << "the robot moves";
}

/// The twin makes up what the operator's loop has left out, in a time of its own.
TEST(LiveLink, APauseOfTheOperatorsProcessEndsNothing) {
  Served served(robots_end(), real_time());
  served.begin();
  Operator one(true, 1200);
  one.sleepy.at_sleep(700, [&one] { one.sleepy.oversleep(30 * kPeriod_ns); });
  one.cycle->run();
  served.end();
  EXPECT_GE(one.cycle->loop().skipped, 20U);
  for (const runtime::FaultReport& fault : one.cycle->faults()) ADD_FAILURE() << fault.text;
  for (const runtime::FaultReport& fault : served.cycle->faults()) ADD_FAILURE() << fault.text;
  EXPECT_LT(one.link->figures().worst_prediction_rad, 0.05);
}

/// The process of a simulated robot stood, and its clock with it.
TEST(LiveLink, TheNumbersFollowAJumpOfTheRobotsClock) {
  Served served(robots_end(), real_time());
  served.begin();
  Operator one(true, 2000);
  one.sleepy.at_sleep(500, [&served] { served.sleepy.oversleep(150 * kPeriod_ns); });
  one.cycle->run();
  served.end();
  for (const runtime::FaultReport& fault : one.cycle->faults())
    EXPECT_FALSE(fault.latched) << fault.text;
  EXPECT_TRUE(served.cycle->faults().empty());
  EXPECT_LT(one.link->figures().clock_cycles, -100);
  EXPECT_LT(one.link->figures().unanswered_cycles, 500U) << "the robot follows again";
}

/// Half a percent is a hundred times what quartz has.
TEST(LiveLink, TheNumbersFollowTheRobotsClock) {
  runtime::CycleConfig slow;
  slow.loop.rate = 0.995;
  Served served(robots_end(), slow);
  served.begin();
  Operator one(true, 1500);
  one.cycle->run();
  served.end();
  EXPECT_TRUE(one.cycle->faults().empty());
  EXPECT_LT(one.link->figures().clock_cycles, -3);
  EXPECT_LT(one.link->figures().worst_prediction_rad, 0.05);
}

/// The robot's end rests by itself, and follows again; the operator goes on meanwhile.
TEST(LiveLink, TheRobotHoldsWhenTheLinkIsGone) {
  Record record(hal::test::fake_robot(), 60'000);
  Served served(robots_end(), real_time(), &record);
  served.begin();
  Operator one(true, 1700, {{400'000'000, 1'000'000'000}});
  one.cycle->run();
  served.end();
  EXPECT_TRUE(one.cycle->faults().empty());
  EXPECT_TRUE(served.cycle->faults().empty());
  ASSERT_NE(served.server->playout(), nullptr);
  EXPECT_GE(served.server->playout()->holds(), 1U);
  EXPECT_GT(served.server->playout()->starved_cycles(), 200U);
  EXPECT_GT(one.link->figures().most_silent_cycles, 200U) << "600 ms: fewer where a PC is too slow";
  std::size_t rest = 0, most = 0;
  double step = 0.0;
  const auto cycles = record.cycles();
  for (std::size_t i = 1; i < cycles.size(); ++i) {
    if (cycles[i].phase != RunPhase::kRunning || cycles[i - 1].phase != RunPhase::kRunning)
      continue;
    const double moved =
        std::abs(cycles[i].command.position_rad()[0] - cycles[i - 1].command.position_rad()[0]);
    rest = moved == 0.0 ? rest + 1 : 0;
    most = std::max(most, rest);
    step = std::max(step, moved);
  }
  EXPECT_GT(most, 200U) << "it holds";
  EXPECT_LT(step, 0.02) << "and returns without a step";
}

/// The robot has held since, and the hand has moved on: a person takes it again, nobody else.
TEST(LiveLink, DoesNotTakeTheRobotAgainThatItHasLost) {
  ServerConfig config = robots_end();
  config.max_age_cycles = 500;
  Served served(config, real_time());
  served.begin();
  Operator one(true, 20'000);
  while (one.cycle->phase() != RunPhase::kRunning && one.cycle->step()) {
  }
  for (int i = 0; i < 300; ++i) (void)one.cycle->step();
  ASSERT_TRUE(eventually([&] { return served.server->losses() == 1; })) << "nothing comes";
  one.cycle->run();  // and the link is back
  EXPECT_FALSE(one.cycle->faults().empty());
  EXPECT_NE(one.link->status_text().find("took the robot away"), std::string::npos)
      << one.link->status_text();
  EXPECT_EQ(served.server->lease().owner(), 0U);
  EXPECT_EQ(served.server->losses(), 1U) << "it had it once";
  EXPECT_EQ(served.phase(), RunPhase::kRunning) << "the robot holds";
  served.end();
}

}  // namespace
}  // namespace tandem::remote
