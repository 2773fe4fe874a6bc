// What of a run becomes samples, and when.
#include "dds/publisher.hpp"

#include "base/clock_ns.hpp"
#include "rt/scoped_realtime.hpp"
#include "tests/dds/publisher_rig.hpp"
#include "tests/support/rt_trap.hpp"

namespace tandem::dds {
namespace {

using namespace test;

TEST(Publisher, PublishesEveryNthCycleExactly) {
  Config config = own_config();
  config.every[static_cast<std::size_t>(Topic::kState)] = 7;
  config.every[static_cast<std::size_t>(Topic::kCommand)] = 1;
  config.every[static_cast<std::size_t>(Topic::kTf)] = 0;
  PublisherRig rig({.config = config});
  auto states = rig.reader<tandem_msgs::State>("tandem/state");
  auto commands = rig.reader<tandem_msgs::Command>("tandem/command");
  auto joints = rig.reader<sensor_msgs::JointState>("joint_states");
  rig.start();
  std::uint64_t next = 0;
  const auto take_commands = [&] {
    commands.take([&](const tandem_msgs::Command& c, const auto&) { EXPECT_EQ(c.cycle, next++); });
  };
  for (std::uint64_t cycle = 0; cycle < 3000; cycle += 100) {  // less than the ring holds
    rig.show_all(cycle, cycle + 100);
    ASSERT_TRUE(eventually([&] { return take_commands(), next == cycle + 100; }));
  }
  const PublishCounts counts = rig.publisher->stop();
  EXPECT_EQ(counts.dropped, 0U);
  EXPECT_EQ(counts.refused, 0U);
  std::vector<std::uint64_t> seen, every;
  for (std::uint64_t cycle = 0; cycle < 3000; cycle += 7) every.push_back(cycle);
  states.take([&](const tandem_msgs::State& s, const auto&) { seen.push_back(s.cycle); });
  EXPECT_EQ(seen, every);
  std::int64_t stamp = 0;
  joints.take([&](const sensor_msgs::JointState& j, const auto&) {
    EXPECT_EQ(ns(j.header.stamp), stamp);
    stamp += 10'000'000;
  });
  EXPECT_EQ(stamp, 3'000'000'000);
}

TEST(Publisher, DropsAndCountsWhatItsThreadIsTooSlowFor) {
  PublisherRig rig;
  auto states = rig.reader<tandem_msgs::State>("tandem/state");
  auto statistics = rig.reader<tandem_msgs::LoopStatistics>("tandem/statistics");
  for (std::uint64_t cycle = 0; cycle < 10'000; ++cycle) rig.show(cycle);  // nobody empties it
  rig.start();
  std::uint64_t received = 0, last = 0;
  const auto take = [&] {
    states.take([&](const tandem_msgs::State& s, const auto&) {
      EXPECT_EQ(s.cycle % 10, 0U);
      last = s.cycle;
      ++received;
    });
  };
  ASSERT_TRUE(eventually([&] { return take(), received == 512; }));  // what the ring holds
  rig.show(11'000);
  const PublishCounts counts = rig.publisher->stop();
  take();
  EXPECT_GT(counts.dropped, 0U);
  EXPECT_EQ(last, 11'000U);
  EXPECT_EQ(received + counts.dropped, 1001U);
  std::uint64_t told = 0;
  statistics.take([&](const tandem_msgs::LoopStatistics& s, const auto&) { told = s.dropped; });
  EXPECT_EQ(told, counts.dropped);
}

// Samples that waited were published behind the jump, with stamps that did not come yet.
TEST(Publisher, PublishesNothingOfAFutureThatWasForgotten) {
  PublisherRig rig;
  auto states = rig.reader<tandem_msgs::State>("tandem/state");
  auto clock = rig.reader<rosgraph_msgs::Clock>("clock");
  rig.show_all(0, 301);
  rig.show(105);
  rig.show_all(106, 121);
  rig.start();
  std::vector<std::uint64_t> cycles;
  const auto take = [&] {
    states.take([&](const tandem_msgs::State& s, const auto&) { cycles.push_back(s.cycle); });
  };
  EXPECT_TRUE(eventually([&] { return take(), !cycles.empty() && cycles.back() == 120; }));
  (void)rig.publisher->stop();
  EXPECT_EQ(cycles, (std::vector<std::uint64_t>{0, 10, 20, 30, 40, 50, 60, 70, 80, 90, 100, 105,
                                                110, 120}));
  clock.take(
      [&](const rosgraph_msgs::Clock& c, const auto&) { EXPECT_LE(ns(c.clock), 120'000'000); });
}

TEST(Publisher, TakesACycleWithoutHeapLockOrSystemCall) {
  PublisherRig rig;
  rig.start();
  const rt::ScopedRealtime in_cycle;  // the trap, or the sanitizer, fails the test
  for (std::uint64_t cycle = 0; cycle < 2000; ++cycle) rig.show(cycle);
}

TEST(Publisher, TellsTheSimulationsTimeAlsoWhileItStandsStill) {
  PublisherRig rig;
  auto clock = rig.reader<rosgraph_msgs::Clock>("clock");
  rig.start();
  std::vector<std::int64_t> times;
  const auto take = [&] {
    clock.take([&](const rosgraph_msgs::Clock& c, const auto&) { times.push_back(ns(c.clock)); });
  };
  ASSERT_TRUE(eventually([&] { return take(), times.size() >= 3; }));  // nothing has run yet
  EXPECT_EQ(times, std::vector<std::int64_t>(times.size(), 0));
  times.clear();
  rig.show_all(0, 51);
  ASSERT_TRUE(eventually([&] { return take(), !times.empty() && times.back() == 50'000'000; }));
  times.clear();
  ASSERT_TRUE(eventually([&] { return take(), times.size() >= 5; }));  // paused
  EXPECT_EQ(times, std::vector<std::int64_t>(times.size(), 50'000'000));
  times.clear();
  rig.show_all(51, 101);
  rig.publisher->stop();
  take();
  std::erase(times, 50'000'000);
  EXPECT_EQ(times, (std::vector<std::int64_t>{60'000'000, 70'000'000, 80'000'000, 90'000'000,
                                              100'000'000}));
}

TEST(Publisher, HasTheMomentThatTimeGoesBackToOnEveryTopic) {
  PublisherRig rig;
  auto clock = rig.reader<rosgraph_msgs::Clock>("clock");
  auto joints = rig.reader<sensor_msgs::JointState>("joint_states");
  rig.start();
  rig.show_all(0, 101);
  rig.show_all(43, 44);  // no cycle in which a topic is due; time stands there
  rig.publisher->stop();
  std::vector<std::int64_t> times, stamps;
  clock.take([&](const rosgraph_msgs::Clock& c, const auto&) { times.push_back(ns(c.clock)); });
  joints.take([&](const auto& j, const auto&) { stamps.push_back(ns(j.header.stamp)); });
  ASSERT_FALSE(times.empty() || stamps.empty());
  EXPECT_EQ(times.back(), 43'000'000);
  EXPECT_EQ(stamps.back(), 43'000'000);
}

TEST(Publisher, StampsTheWallClocksTimeWhereTimeIsNotSimulated) {
  PublisherRig rig({.simulated_time = false});
  auto joints = rig.reader<sensor_msgs::JointState>("joint_states");
  rig.begin_ns = clock_ns(CLOCK_MONOTONIC);
  const std::int64_t wall_ns = clock_ns(CLOCK_REALTIME);
  rig.start();
  rig.show_all(0, 100);
  rig.publisher->stop();
  std::vector<std::int64_t> stamps;
  joints.take([&](const auto& j, const auto&) { stamps.push_back(ns(j.header.stamp)); });
  ASSERT_EQ(stamps.size(), 10U);
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    // The grid point, not when the cycle woke up (500 ns later) or its sample was sent.
    EXPECT_EQ(stamps[i] - stamps[0], static_cast<std::int64_t>(i) * 10'000'000);
  }
  EXPECT_NEAR(static_cast<double>(stamps[0] - wall_ns), -500.0, 1e9);
}

TEST(Publisher, HasNoClockWhereTimeIsNotSimulated) {
  PublisherRig rig({.simulated_time = false});
  auto clock = Reader<rosgraph_msgs::Clock>::create(*rig.listener, "rt/clock", {});
  auto joints = rig.reader<sensor_msgs::JointState>("joint_states");  // discovery has been
  ASSERT_TRUE(clock);
  EXPECT_EQ(clock->endpoint().matched(), 0U);
}

TEST(Publisher, GivesLateReadersWhatDoesNotChange) {
  PublisherRig rig({.robot = "coman"});
  rig.start();
  rig.show_all(0, 20);
  auto robots = rig.reader<tandem_msgs::Robot>("tandem/robot", true);
  auto descriptions = rig.reader<std_msgs::String>("robot_description", true);
  auto frames = rig.reader<tf2_msgs::TFMessage>("tf_static", true);
  auto faults = rig.reader<tandem_msgs::Faults>("tandem/faults", true);
  std::size_t seen = 0;
  ASSERT_TRUE(eventually([&] {
    return (seen += robots.take([&](const tandem_msgs::Robot& r, const auto&) {
             EXPECT_EQ(r.run, 77U);
             EXPECT_STREQ(r.name, "coman");
             EXPECT_STREQ(r.hal, "sim");
             EXPECT_STREQ(r.version, "1.2.3");
             EXPECT_STREQ(r.description_hash, "abc");
             EXPECT_EQ(r.period_ns, 1'000'000);
             std::vector<std::string> joints;
             for (const auto& joint : rig.robot.config.joints) joints.push_back(joint.name);
             EXPECT_EQ(texts(r.joints), joints);
             EXPECT_EQ(r.sensors._length, rig.robot.config.sensors.size());
             EXPECT_EQ(r.sensor_channels._length, rig.robot.config.sensors.size());
           })) == 1;
  }));
  ASSERT_TRUE(eventually([&] {
    return descriptions.take([](const std_msgs::String& s, const auto&) {
      EXPECT_STREQ(s.data, "<robot/>");
    }) == 1;
  }));
  ASSERT_TRUE(eventually([&] {
    return frames.take([](const tf2_msgs::TFMessage& tf, const auto&) {
      EXPECT_GT(tf.transforms._length, 0U);
    }) == 1;
  }));
  ASSERT_TRUE(eventually([&] {
    return faults.take([](const tandem_msgs::Faults& f, const auto&) {
      EXPECT_EQ(f.faults._length, 0U);
    }) == 1;
  }));
}

TEST(Publisher, TellsFaultsWhenTheyComeAndGo) {
  PublisherRig rig;
  auto reader = rig.reader<tandem_msgs::Faults>("tandem/faults", true);
  rig.start();
  std::vector<bool> latched;
  const auto take = [&] {
    reader.take([&](const tandem_msgs::Faults& message, const auto&) {
      if (message.faults._length == 0) return;
      const auto& fault = message.faults._buffer[0];
      EXPECT_EQ(fault.cycle, 12U);
      EXPECT_STREQ(fault.joint, "joint1");
      EXPECT_STREQ(fault.category, "category1");
      EXPECT_STREQ(fault.text, "its board is silent");
      EXPECT_EQ(message.lost, 3U);
      latched.push_back(fault.latched);
    });
  };
  FaultEntry fault{
      12,   0.012, "joint1", "board", "its board is silent", hal::StopCategory::kCategory1,
      true, 0.0};
  rig.set_faults({fault});
  ASSERT_TRUE(eventually([&] { return take(), latched == std::vector{true}; }));
  fault.latched = false;
  rig.set_faults({fault});
  ASSERT_TRUE(eventually([&] { return take(), latched == std::vector{true, false}; }));
}

TEST(Publisher, MakesHistogramsOfEveryCycleWhateverTheTopicsRate) {
  PublisherRig rig;
  auto reader = rig.reader<tandem_msgs::LoopStatistics>("tandem/statistics");
  rig.start();
  rig.show_all(0, 2001);
  rig.publisher->stop();
  std::vector<std::uint64_t> cycles;
  reader.take([&](const tandem_msgs::LoopStatistics& s, const auto&) {
    cycles.push_back(s.cycle);
    EXPECT_EQ(s.cycles, s.cycle + 1);
    EXPECT_EQ(s.wakeup.count, s.cycles);
    EXPECT_EQ(s.work.count, s.cycle);  // that of the last cycle is not known yet
    EXPECT_EQ(s.bus.count, 0U);
    std::uint64_t sum = 0;
    for (const auto& bin : list(s.wakeup.bins)) sum += bin.count;
    EXPECT_EQ(sum, s.wakeup.count);
    EXPECT_EQ(s.wakeup.max_ns, 500);
  });
  EXPECT_EQ(cycles, (std::vector<std::uint64_t>{0, 1000, 2000}));
}

TEST(Publisher, RefusesSensorsWhoseNamesAreTheSameInRos) {
  PublisherRig rig({.robot = "coman"});
  ASSERT_GE(rig.robot.config.sensors.size(), 2U);
  rig.robot.config.sensors[0].name = "left foot";
  rig.robot.config.sensors[1].name = "left.foot";
  const auto made = Publisher::create(
      *rig.listener, {.robot = rig.robot.config, .tree = rig.robot.description.tree});
  ASSERT_FALSE(made);
  EXPECT_NE(made.error().to_string().find("left_foot"), std::string::npos);
}

}  // namespace
}  // namespace tandem::dds
