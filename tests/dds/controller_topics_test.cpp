// tandem/controller/NAME and /rosout: what controllers tell, at its readers.
#include <atomic>

#include "tests/dds/publisher_rig.hpp"

namespace tandem::dds {
namespace {

using namespace test;

/// Controllers that come and go.
struct Told {
  std::atomic<std::uint64_t> version{1};
  std::mutex mutex;
  std::vector<ControllerFeed::Signals> signals;
  std::vector<hal::TextEvent> texts;

  ControllerFeed feed() {
    return {.version = [this] { return version.load(); },
            .signals =
                [this] {
                  const std::lock_guard lock(mutex);
                  return signals;
                },
            .texts =
                [this](std::uint64_t& seen, std::vector<hal::TextEvent>& out) {
                  const std::lock_guard lock(mutex);
                  for (; seen < texts.size(); ++seen) out.push_back(texts[seen]);
                }};
  }
  std::shared_ptr<hal::SignalBlock> add(const std::string& name, std::size_t numbers) {
    auto block = std::make_shared<hal::SignalBlock>();
    double* const depth = block->declare("depth", "m", "", 1);
    double* const error = block->declare("error", "rad", "", 2, true);
    (void)block->declare("com", "m", "", numbers);
    EXPECT_TRUE(block->close());
    *depth = 0.25;
    error[1] = 0.5;
    const std::lock_guard lock(mutex);
    signals.emplace_back(name, block);
    ++version;
    return block;
  }
  void clear() {
    const std::lock_guard lock(mutex);
    signals.clear();
    ++version;
  }
};

void start(PublisherRig& rig, Told& told) {
  rig.publisher->start({.version = [] { return std::uint64_t{0}; },
                        .faults = [] { return std::vector<FaultEntry>(); },
                        .lost = [] { return std::uint64_t{0}; }},
                       nullptr, told.feed());
}

TEST(ControllerTopics, HaveTheSignalsOfEachController) {
  Told told;
  PublisherRig rig;
  const auto block = told.add("my_gait", 1);
  start(rig, told);
  rig.show(0);
  auto reader = rig.reader<tandem_msgs::Signals>("tandem/controller/my_gait");
  block->publish(97, 97'000'000);
  std::size_t samples = 0;
  ASSERT_TRUE(eventually([&] {
    rig.show(100);
    reader.take([&](const tandem_msgs::Signals& message, const auto&) {
      ++samples;
      EXPECT_EQ(message.run, 77U);
      EXPECT_EQ(message.cycle, 97U);
      EXPECT_EQ(message.time_ns, 97'000'000);
      EXPECT_EQ(std::string(message.controller), "my_gait");
      EXPECT_EQ(texts(message.names),
                (std::vector<std::string>{"depth", "error.joint1", "error.joint2", "com"}));
      EXPECT_EQ(texts(message.units), (std::vector<std::string>{"m", "rad", "rad", "m"}));
      EXPECT_EQ(list(message.values)[0], 0.25);
      EXPECT_EQ(list(message.values)[2], 0.5);
      EXPECT_TRUE(std::isnan(list(message.values)[3]));
    });
    return samples > 0;
  }));
  for (int i = 0; i < 20; ++i) rig.show(200);
  rig.publisher->stop();
  reader.take([&](const tandem_msgs::Signals&, const auto&) { ++samples; });
  EXPECT_EQ(samples, 1U) << "the same cycle is not published twice";
}

TEST(ControllerTopics, ComeAndGoWithTheirControllers) {
  Told told;
  PublisherRig rig;
  start(rig, told);
  rig.show(0);
  told.add("gait", 1)->publish(1, 1);
  rig.show(10);
  auto reader = rig.reader<tandem_msgs::Signals>("tandem/controller/gait");
  told.clear();
  ASSERT_TRUE(eventually([&] {
    rig.show(20);
    return reader.endpoint().matched() == 0;
  }));
  const auto renewed = told.add("gait", 5);  // of the same name, and another shape
  std::size_t most = 0;
  std::uint64_t cycle = 2;
  ASSERT_TRUE(eventually([&] {
    ++cycle;
    renewed->publish(cycle, static_cast<std::int64_t>(cycle));
    rig.show(30);
    reader.take([&](const tandem_msgs::Signals& message, const auto&) {
      most = std::max<std::size_t>(most, message.values._length);
    });
    return most == 8;
  }));
}

TEST(ControllerTopics, GiveWordsToRosoutAlsoToALateReader) {
  Told told;
  PublisherRig rig;
  hal::TextEvent event;
  event.cycle = 3;
  event.time_ns = 3'000'000;
  event.level = hal::TextLevel::kWarn;
  event.set_controller("gait");
  event.append("stance changed 1");
  told.texts.push_back(event);
  start(rig, told);
  rig.show(0);
  auto made = Reader<rcl_interfaces::Log>::create(
      *rig.listener, "rt/rosout",
      {.reliable = true, .transient_local = true, .depth = 100, .user_data = {}});
  ASSERT_TRUE(made) << made.error().to_string();
  std::size_t lines = 0;
  ASSERT_TRUE(eventually([&] {
    made->take([&](const rcl_interfaces::Log& message, const auto&) {
      ++lines;
      EXPECT_EQ(ns(message.stamp), 3'000'000);
      EXPECT_EQ(message.level, 30);
      EXPECT_EQ(std::string(message.name), "gait");
      EXPECT_EQ(std::string(message.msg), "stance changed 1");
      EXPECT_EQ(std::string(message.function), "cycle 3");
    });
    return lines == 1;
  }));
}

}  // namespace
}  // namespace tandem::dds
