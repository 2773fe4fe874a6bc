// controller_manager/introspection_data and controller_manager/statistics, at their readers.
#include <algorithm>
#include <atomic>
#include <map>

#include "tests/dds/publisher_rig.hpp"

namespace tandem::dds {
namespace {

using namespace test;
using pal_statistics_msgs::Statistics;
using pal_statistics_msgs::StatisticsNames;
using pal_statistics_msgs::StatisticsValues;

/// Controllers with signals, that come.
struct Introspected {
  std::atomic<std::uint64_t> version{1};
  std::mutex mutex;
  std::vector<ControllerFeed::Signals> signals;

  std::shared_ptr<hal::SignalBlock> add(const std::string& name) {
    auto block = std::make_shared<hal::SignalBlock>();
    double* const depth = block->declare("depth", "m", "", 1);
    double* const error = block->declare("error", "rad", "", 2, true);
    EXPECT_TRUE(block->close());
    *depth = 0.25;
    error[1] = 0.5;
    const std::lock_guard lock(mutex);
    signals.emplace_back(name, block);
    ++version;
    return block;
  }
  void start(PublisherRig& rig) {
    rig.publisher->start({.version = [] { return std::uint64_t{0}; },
                          .faults = [] { return std::vector<FaultEntry>(); },
                          .lost = [] { return std::uint64_t{0}; }},
                         nullptr,
                         {.version = [this] { return version.load(); },
                          .signals =
                              [this] {
                                const std::lock_guard lock(mutex);
                                return signals;
                              }});
  }
};

/// What readers of names and values know together.
struct Known {
  std::map<std::uint32_t, std::vector<std::string>> names;  // by version
  std::uint32_t version = 0;                                // of `values`
  std::vector<double> values;

  void take(Reader<StatisticsNames>& from_names, Reader<StatisticsValues>& from_values) {
    from_names.take([this](const StatisticsNames& one, const auto&) {
      EXPECT_FALSE(names.contains(one.names_version)) << "only when they change";
      names[one.names_version] = texts(one.names);
    });
    from_values.take([this](const StatisticsValues& one, const auto&) {
      version = one.names_version;
      values = list(one.values);
    });
  }
  /// Whether there are values, and they have names.
  [[nodiscard]] bool complete() const { return version != 0 && names.contains(version); }
  [[nodiscard]] bool has(const std::string& name) const {
    return complete() && std::ranges::find(names.at(version), name) != names.at(version).end();
  }
  [[nodiscard]] double at(const std::string& name) const {
    if (!has(name)) return 1e9;
    const auto& all = names.at(version);
    EXPECT_EQ(all.size(), values.size());
    return values.at(static_cast<std::size_t>(std::ranges::find(all, name) - all.begin()));
  }
};

TEST(IntrospectionTopics, HaveEveryInterfaceAndSignalByName) {
  Introspected told;
  PublisherRig rig;
  const auto block = told.add("gait");
  told.start(rig);
  auto names = rig.reader<StatisticsNames>("controller_manager/introspection_data/names", true);
  auto values = rig.reader<StatisticsValues>("controller_manager/introspection_data/values");
  Known known;
  ASSERT_TRUE(eventually([&] {
    rig.show(100);
    known.take(names, values);
    return known.complete();
  }));
  EXPECT_EQ(known.at("command_interface.joint1/position"), 0.5);
  EXPECT_EQ(known.at("command_interface.joint2/position"), 1.0);
  EXPECT_EQ(known.at("state_interface.joint2/position"), 0.2);
  EXPECT_EQ(known.at("state_interface.joint2/effort"), 6.0);
  EXPECT_EQ(known.at("state_interface.joint1/temperature"), 31.0);
  EXPECT_TRUE(std::isnan(known.at("gait.depth"))) << "it has not run";
  block->publish(100, 100'000'000);
  EXPECT_TRUE(eventually([&] {
    rig.show(200);
    known.take(names, values);
    return known.at("gait.depth") == 0.25;
  }));
  EXPECT_EQ(known.at("gait.error.joint2"), 0.5);
  EXPECT_EQ(known.version, 1U);
  told.add("jog");
  EXPECT_TRUE(eventually([&] {
    rig.show(300);
    known.take(names, values);
    return known.has("jog.depth");
  }));
  EXPECT_EQ(known.version, 2U);
  EXPECT_EQ(known.at("state_interface.joint2/position"), 0.2);
}

TEST(IntrospectionTopics, SayTheSameInOneMessage) {
  Introspected told;
  PublisherRig rig;
  told.start(rig);
  auto full = rig.reader<Statistics>("controller_manager/introspection_data/full");
  std::map<std::string, double> numbers;
  ASSERT_TRUE(eventually([&] {
    rig.show(100);
    full.take([&](const Statistics& one, const auto&) {
      for (const auto& each : list(one.statistics)) numbers[each.name] = each.value;
    });
    return !numbers.empty();
  }));
  EXPECT_EQ(numbers.size(), 2 * (7 + 9)) << "two joints, no sensors";
  EXPECT_EQ(numbers.at("command_interface.joint2/position"), 1.0);
  EXPECT_EQ(numbers.at("state_interface.joint1/velocity"), -0.2);
}

/// A joint that was not measured yet has no value.
TEST(IntrospectionTopics, HaveNoNumberForWhatIsNotKnown) {
  Introspected told;
  PublisherRig rig({.robot = "coman"});
  told.start(rig);
  rig.state.age_cycles()[0] = 1'000'000;
  auto names = rig.reader<StatisticsNames>("controller_manager/introspection_data/names", true);
  auto values = rig.reader<StatisticsValues>("controller_manager/introspection_data/values");
  Known known;
  ASSERT_TRUE(eventually([&] {
    rig.show(100);
    known.take(names, values);
    return known.complete();
  }));
  const std::string first = rig.robot.config.joints[0].name, next = rig.robot.config.joints[1].name;
  EXPECT_TRUE(std::isnan(known.at("state_interface." + first + "/position")));
  EXPECT_EQ(known.at("state_interface." + next + "/position"), 0.2);
  ASSERT_FALSE(rig.robot.config.sensors.empty());
  const hal::SensorConfig& sensor = rig.robot.config.sensors[0];
  const bool imu = sensor.type == hal::SensorType::kImu;
  EXPECT_EQ(known.at("state_interface." + sensor.name + (imu ? "/orientation.x" : "/force.x")),
            0.25);
}

TEST(IntrospectionTopics, HaveTheTimesOfLoopAndControllers) {
  Introspected told;
  PublisherRig rig({.controllers = [] {
    return std::vector<std::pair<std::string, rt::Percentiles>>{
        {"gait", {.p50 = 1000, .p99 = 20'000, .p999 = 30'000, .max = 40'000}}};
  }});
  told.start(rig);
  auto names = rig.reader<StatisticsNames>("controller_manager/statistics/names", true);
  auto values = rig.reader<StatisticsValues>("controller_manager/statistics/values");
  Known known;
  ASSERT_TRUE(eventually([&] {
    rig.show(1000);
    known.take(names, values);
    return known.complete();
  }));
  EXPECT_EQ(known.at("gait.stats/execution_time/p50"), 1.0) << "microseconds";
  EXPECT_EQ(known.at("gait.stats/execution_time/max"), 40.0);
  EXPECT_GE(known.at("controller_manager.cycles"), 1.0);
  EXPECT_TRUE(std::isnan(known.at("controller_manager.bus_time/max"))) << "it was not measured";
  EXPECT_GT(known.at("controller_manager.wakeup_time/max"), 0.0);
}

/// What is sent with these topics and without them, to nobody.
TEST(IntrospectionTopics, AreSilentWhileNobodyListens) {
  std::vector<std::uint64_t> sent;
  for (const bool there : {true, false}) {
    RigOptions options;
    if (!there) {
      options.config.every[static_cast<std::size_t>(Topic::kIntrospection)] = 0;
      options.config.every[static_cast<std::size_t>(Topic::kStatistics)] = 0;
    }
    Introspected told;
    PublisherRig rig(options);
    told.start(rig);
    rig.show_all(0, 400);
    sent.push_back(rig.publisher->stop().sent);
  }
  EXPECT_EQ(sent[0], sent[1]);
}

}  // namespace
}  // namespace tandem::dds
