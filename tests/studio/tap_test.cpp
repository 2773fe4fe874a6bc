// What the loop hands over in each cycle, and that it costs it no heap, lock or system call.
#include "studio/tap.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "rt/scoped_realtime.hpp"
#include "studio/sampler.hpp"
#include "tests/studio/shown_robot.hpp"
#include "tests/support/rt_trap.hpp"

namespace tandem::studio {
namespace {

using test::ShownRobot;

TEST(StudioTap, TakesACycleWithoutHeapLockOrSystemCall) {
  ShownRobot robot;
  Tap tap(robot.images(), ShownRobot::kPeriod_ns);
  hal::CycleFanOut both;  // as DDS and the studio are there at once
  both.add(&tap);
  both.add(&robot.counter);
  const auto block = test::block_of(100);
  const rt::ScopedRealtime in_cycle;  // the trap, or the sanitizer, fails the test
  for (std::uint64_t cycle = 0; cycle < 3000; ++cycle) robot.show(*both.observer(), cycle, {block});
  EXPECT_GT(tap.lost(), 0U) << "a full ring is a part of it";
}

TEST(StudioTap, ComesWhileTheLoopRuns) {
  ShownRobot robot;
  Tap tap(robot.images(), ShownRobot::kPeriod_ns);
  hal::LateObserver late;
  const auto block = test::block_of(100);
  std::thread other([&] { late.attach(tap); });
  {
    const rt::ScopedRealtime in_cycle;
    for (std::uint64_t cycle = 0; tap.taken() < 100; ++cycle) robot.show(late, cycle, {block});
  }
  other.join();
  std::uint64_t parts = 0, cycles = 0, before = 0;
  while (tap.next([&](const Tap::Signals&) { ++parts; },
                  [&](const Tap::Cycle& one) {
                    if (cycles > 0) {
                      EXPECT_EQ(one.time.cycle, before + 1);
                    }
                    ++cycles;
                    before = one.time.cycle;
                  })) {
  }
  EXPECT_EQ(cycles, 100U);
  EXPECT_GE(parts, 2 * (cycles - 1)) << "the first may lack its signals";
}

TEST(StudioTap, HandsOverEveryImageAndSignalOfACycle) {
  ShownRobot robot;
  Tap tap(robot.images(), ShownRobot::kPeriod_ns);
  const auto few = test::block_of(1), many = test::block_of(400);
  for (std::uint64_t cycle = 0; cycle < 50; ++cycle) {
    // One that is not active has no numbers in this cycle.
    if (cycle % 2 == 0) {
      robot.show(tap, cycle, {few, many});
    } else {
      robot.show(tap, cycle, {few});
    }
  }
  std::uint64_t cycle = 0;
  std::vector<std::byte> few_image(few->image().size()), many_image(many->image().size());
  std::size_t parts = 0;
  const auto signals = [&](const Tap::Signals& part) {
    auto& image = part.block == few.get() ? few_image : many_image;
    ASSERT_LE(part.at + part.bytes.size(), image.size());
    std::memcpy(image.data() + part.at, part.bytes.data(), part.bytes.size());
    ++parts;
  };
  const auto whole = [&](const Tap::Cycle& one) {
    EXPECT_EQ(one.time.cycle, cycle);
    double position = 0.0;
    std::memcpy(&position, one.parts[Tap::kState].data() + 16,
                sizeof position);  // behind cycle and time
    EXPECT_EQ(position, ShownRobot::position(cycle, 0));
    EXPECT_EQ(one.parts[Tap::kTruth].size(), robot.truth.bytes().size());
    EXPECT_TRUE(one.parts[Tap::kEstimate].empty());
    double number = 0.0;
    std::memcpy(&number, few_image.data() + 16, sizeof number);
    EXPECT_EQ(number, test::number_of(cycle, 0));
    if (cycle % 2 == 0) {
      std::memcpy(&number, many_image.data() + 16 + 8 * 399, sizeof number);
      EXPECT_EQ(number, test::number_of(cycle, 399));
    }
    EXPECT_EQ(parts, cycle % 2 == 0 ? 1U + 7U : 1U);
    parts = 0;
    ++cycle;
  };
  while (tap.next(signals, whole)) {
  }
  EXPECT_EQ(cycle, 50U);
  EXPECT_EQ(tap.lost(), 0U);
}

TEST(StudioTap, TakesAStepOfAnEmulationWithoutHeapLockOrSystemCall) {
  const ShownRobot robot;
  hal::BoardsImage boards(2, 1);
  const Tap::Images images{.truth = &robot.truth, .boards = &boards};
  Tap tap(images, ShownRobot::kPeriod_ns);
  {
    const rt::ScopedRealtime in_step;
    for (std::uint64_t step = 0; step < 3000; ++step) {
      boards.current_A()[1] = 0.5 * static_cast<double>(step);
      tap.take_step({step, static_cast<std::int64_t>(step), 1}, robot.truth, boards);
    }
  }
  EXPECT_GT(tap.lost(), 0U) << "a full ring is a part of it";
  Sampler sampler(tap, images, robot.names(), 200'000);
  (void)sampler.look({});
  ASSERT_EQ(sampler.table().sources().size(), 2U) << "neither state nor command";
  const SignalId id = test::id_of(sampler.table(), "boards.current_a.b");
  EXPECT_EQ(sampler.last()[id], static_cast<float>(0.5 * static_cast<double>(sampler.cycle())));
  EXPECT_TRUE(sampler.take_events().empty()) << "it has no phases";
}

TEST(StudioTap, CountsWhatFindsNoRoom) {
  ShownRobot robot;
  Tap tap(robot.images(), ShownRobot::kPeriod_ns);
  for (std::uint64_t cycle = 0; cycle < 5000; ++cycle) robot.show(tap, cycle, {});
  std::uint64_t taken = 0;
  const auto nothing = [](const Tap::Signals&) {};
  while (tap.next(nothing, [&](const Tap::Cycle& one) { EXPECT_EQ(one.time.cycle, taken++); })) {
  }
  EXPECT_EQ(taken + tap.lost(), 5000U);
  EXPECT_GE(taken, 1000U) << "a second has room";
}

// It was told in the tick before it, whose cycles were whole.
TEST(StudioSampler, TellsOfAGapInTheTickThatHasIt) {
  ShownRobot robot;
  Tap tap(robot.images(), ShownRobot::kPeriod_ns);
  Sampler sampler(tap, robot.images(), robot.names(), 200'000);
  for (std::uint64_t cycle = 0; cycle < 5000; ++cycle) robot.show(tap, cycle, {});
  (void)sampler.look({});
  ASSERT_LT(sampler.cycle(), 4999U);
  sampler.begin_tick();
  robot.show(tap, 5000, {});
  (void)sampler.look({});
  EXPECT_TRUE(sampler.span().gap);
  sampler.begin_tick();
  robot.show(tap, 5001, {});
  (void)sampler.look({});
  EXPECT_FALSE(sampler.span().gap);
}

TEST(StudioSampler, KeepsEachCycleAndWhatBecameOfItSinceTheTick) {
  ShownRobot robot;
  Tap tap(robot.images(), ShownRobot::kPeriod_ns);
  Sampler sampler(tap, robot.images(), robot.names(), 200'000);
  for (std::uint64_t cycle = 0; cycle < 40; ++cycle) robot.show(tap, cycle, {});
  EXPECT_FALSE(sampler.look({}));
  const SignalId id = test::id_of(sampler.table(), "state.position_rad.a");
  EXPECT_EQ(sampler.span().cycles, 40U);
  EXPECT_EQ(sampler.span().least[id], static_cast<float>(ShownRobot::position(0, 0)));
  EXPECT_EQ(sampler.span().largest[id], static_cast<float>(ShownRobot::position(39, 0)));
  EXPECT_EQ(sampler.last()[id], static_cast<float>(ShownRobot::position(39, 0)));
  EXPECT_EQ(sampler.cycle(), 39U);
  sampler.begin_tick();
  EXPECT_EQ(sampler.span().cycles, 0U);
  const Window window = sampler.history().plan(10, 19, 100);
  std::vector<float> numbers(window.numbers());
  sampler.history().read(window, id, numbers);
  ASSERT_EQ(numbers.size(), 10U);
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    EXPECT_EQ(numbers[i], static_cast<float>(ShownRobot::position(10 + i, 0)));
  }
  const std::vector<Event> events = sampler.take_events();
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].text, "phase: running");
  EXPECT_EQ(events[0].cycle, 0U);
}

TEST(StudioSampler, HasNoNumberOfWhatNobodyHasMeasured) {
  ShownRobot robot;
  robot.state = hal::StateImage{{.joints = 2, .sensor_channels = {1, 1}}};
  log::RunInfo names = robot.names();
  names.sensors = {{"foot", 1}, {"wrist", 1}};
  Tap tap(robot.images(), ShownRobot::kPeriod_ns);
  Sampler sampler(tap, robot.images(), names, 200'000);
  constexpr std::uint64_t kFirst = 20;  // b and the wrist answer from then on, then never again
  for (std::uint64_t cycle = 0; cycle < 64; ++cycle) {
    const std::uint64_t age = cycle < kFirst ? cycle + 1 : cycle - kFirst;
    robot.state.age_cycles()[1] = robot.state.sensor_age_cycles()[1] =
        static_cast<std::uint32_t>(age);
    robot.show(tap, cycle, {});
  }
  (void)sampler.look({});
  const Window each = sampler.history().plan(0, 63, 100);
  const Window merged = sampler.history().plan(0, 63, 1);  // rows of 16
  ASSERT_EQ(each.cycles, 1U);
  ASSERT_EQ(merged.cycles, 16U);
  for (const char* name : {"state.position_rad.b", "state.torque_nm.b", "state.sensor.wrist.0",
                           "command.position_rad.b"}) {
    const SignalId id = test::id_of(sampler.table(), name);
    std::vector<float> numbers(each.numbers()), spans(merged.numbers());
    sampler.history().read(each, id, numbers);
    sampler.history().read(merged, id, spans);
    for (std::size_t i = 0; i < numbers.size(); ++i)
      EXPECT_EQ(std::isnan(numbers[i]), i < kFirst) << name << " in cycle " << i;
    EXPECT_TRUE(std::isnan(spans[0]) && std::isnan(spans[1])) << name;
    EXPECT_EQ(spans[2], numbers[kFirst]) << name << ": what was measured alone counts";
    EXPECT_EQ(sampler.span().least[id], numbers[kFirst]) << name;
  }
  for (const char* name :
       {"state.position_rad.a", "state.sensor.foot.0", "state.mode.b", "state.age_cycles.b"}) {
    const SignalId id = test::id_of(sampler.table(), name);
    std::vector<float> numbers(each.numbers());
    sampler.history().read(each, id, numbers);
    EXPECT_EQ(std::ranges::count_if(numbers, [](float n) { return std::isnan(n); }), 0) << name;
  }
}

TEST(StudioSampler, HasMarksAsNumbersWithTheirLook) {
  ShownRobot robot;
  Tap tap(robot.images(), ShownRobot::kPeriod_ns);
  Sampler sampler(tap, robot.images(), robot.names(), 200'000);
  const auto block = std::make_shared<hal::MarkBlock>();
  const std::size_t arrow = block->declare(
      "push", {.shape = hal::MarkShape::kArrow, .frame = "odom", .points = 2, .size_m = 0.03});
  const std::size_t words =
      block->declare("words", {.shape = hal::MarkShape::kText, .frame = "odom"});
  ASSERT_TRUE(block->close({}, {}));
  std::vector<Feed::Marks> marks{{"wave", block}};
  std::uint64_t loads = 1;
  const Feed feed{.loads = [&] { return loads; },
                  .signals = [] { return std::vector<Feed::Signals>(); },
                  .marks = [&] { return marks; }};
  EXPECT_TRUE(sampler.look(feed));
  const auto last = [&](const std::string& name) {
    return sampler.last()[test::id_of(sampler.table(), "marks/wave." + name)];
  };
  robot.show(tap, 0, {});
  EXPECT_FALSE(sampler.look(feed));
  EXPECT_EQ(last("push.shown"), 0.0F) << "nothing is drawn yet";

  block->place(arrow, 0, {0.0, 0.0, 0.5});
  block->place(arrow, 1, {0.25, 0.0, 0.5});
  block->say(words, "ab");
  block->place(words, 0, {1.0, 2.0, 3.0});
  ASSERT_TRUE(block->show_to_viewers(1'000'000, true));
  robot.show(tap, 1, {});
  EXPECT_FALSE(sampler.look(feed));
  EXPECT_EQ(last("push.3"), 0.25F);
  EXPECT_EQ(last("push.shown"), 2.0F);
  EXPECT_EQ(last("words.shown"), 1.0F);
  EXPECT_EQ(last("words.text.1"), static_cast<float>('b'));
  EXPECT_EQ(last("words.text.2"), 0.0F);
  const Source& source = sampler.table().sources().back();
  ASSERT_EQ(source.marks.size(), 2U);
  EXPECT_EQ(source.marks[0].name, "push");
  EXPECT_EQ(source.marks[0].shape, hal::MarkShape::kArrow);
  EXPECT_EQ(source.marks[0].size_m, 0.03);

  // A place that is no number: the mark is not shown.
  block->place(arrow, 1, {std::nan(""), 0.0, 0.5});
  ASSERT_TRUE(block->show_to_viewers(2'000'000, true));
  robot.show(tap, 2, {});
  EXPECT_FALSE(sampler.look(feed));
  EXPECT_EQ(last("push.shown"), 0.0F);
  EXPECT_EQ(last("words.shown"), 1.0F);

  marks.clear();
  ++loads;
  EXPECT_TRUE(sampler.look(feed));
  EXPECT_FALSE(sampler.table().sources().back().there);
}

/// A second robot that is three cycles late, and from which there is nothing at first.
class LateTwin final : public hal::ParallelSource {
 public:
  LateTwin(const hal::StateImage& like, const hal::TruthImage& truth)
      : view{.state = like,
             .position_rad = std::vector<double>(like.joints(), 0.125),
             .velocity_rad_s = {},
             .torque_Nm = {},
             .behind_cycles = 3,
             .truth = truth} {}
  const hal::ParallelView* newest() noexcept override { return there ? &view : nullptr; }
  hal::ParallelView view;
  bool there = false;
};

TEST(StudioSampler, HasTheParallelRobotOnceItIsThere) {
  ShownRobot robot;
  Tap tap(robot.images(), ShownRobot::kPeriod_ns);
  Sampler sampler(tap, robot.images(), robot.names(), 200'000);
  LateTwin twin(robot.state, robot.truth);
  const Feed feed{.parallel = &twin};
  robot.show(tap, 0, {});
  EXPECT_FALSE(sampler.look(feed)) << "there is nothing of it yet";

  twin.there = true;
  twin.view.state.position_rad()[1] = -0.5;
  twin.view.state.age_cycles()[0] = 1;  // in cycle 0: joint 0 has not answered yet
  twin.view.truth->base_position_m()[2] = 0.75;
  EXPECT_TRUE(sampler.look(feed));
  robot.show(tap, 1, {});
  EXPECT_FALSE(sampler.look(feed));
  const auto last = [&](const std::string& name) {
    return sampler.last()[test::id_of(sampler.table(), "parallel." + name)];
  };
  const std::string joint = robot.names().joints[1];
  EXPECT_EQ(last("position_rad." + joint), -0.5F);
  EXPECT_EQ(last("difference_rad." + joint), 0.125F);
  const std::string silent = robot.names().joints[0];
  EXPECT_TRUE(std::isnan(last("position_rad." + silent))) << "its 0 is no measurement";
  EXPECT_TRUE(std::isnan(last("difference_rad." + silent)));
  EXPECT_EQ(last("base_position_m.2"), 0.75F);
  EXPECT_EQ(last("behind_cycles"), 3.0F);

  twin.view.state.position_rad()[1] = 0.25;
  twin.view.state.cycle()[0] = 1;
  twin.view.state.position_rad()[0] = 0.75;
  robot.show(tap, 2, {});
  EXPECT_FALSE(sampler.look(feed));
  EXPECT_EQ(last("position_rad." + joint), 0.25F);
  EXPECT_EQ(last("position_rad." + silent), 0.75F);
}

TEST(StudioSampler, FollowsControllersThatComeAndGo) {
  ShownRobot robot;
  Tap tap(robot.images(), ShownRobot::kPeriod_ns);
  Sampler sampler(tap, robot.images(), robot.names(), 200'000);
  std::vector<Feed::Signals> loaded;
  std::uint64_t loads = 1;
  const Feed feed{.loads = [&] { return loads; }, .signals = [&] { return loaded; }};
  const auto block = test::block_of(3);
  loaded = {{"wave", block}};
  EXPECT_TRUE(sampler.look(feed));
  const SignalId id = test::id_of(sampler.table(), "controller/wave.number.2");
  robot.show(tap, 0, {block});
  robot.show(tap, 1, {});  // it is not active
  EXPECT_FALSE(sampler.look(feed));
  EXPECT_EQ(sampler.span().largest[id], static_cast<float>(test::number_of(0, 2)));
  EXPECT_TRUE(std::isnan(sampler.last()[id])) << "what did not come has no value";

  // A new one of another shape, whose first numbers are in the ring before it is known.
  const auto next = test::block_of(5);
  loaded = {{"wave", next}};
  const auto sly = [&, calls = 0]() mutable { return calls++ == 0 ? loads : loads + 1; };
  robot.show(tap, 2, {next});
  robot.show(tap, 3, {next});
  EXPECT_TRUE(sampler.look({.loads = sly, .signals = [&] { return loaded; }}));
  const SignalId other = test::id_of(sampler.table(), "controller/wave.number.4");
  EXPECT_GT(other, id);
  EXPECT_EQ(sampler.last()[other], static_cast<float>(test::number_of(3, 4)));
  EXPECT_TRUE(std::isnan(sampler.last()[id]));
  const Window window = sampler.history().plan(0, 3, 100);
  std::vector<float> numbers(window.numbers());
  sampler.history().read(window, id, numbers);
  EXPECT_EQ(numbers[0], static_cast<float>(test::number_of(0, 2))) << "what was stays";
}

TEST(StudioTap, KeepsTheSignalsOfCyclesThatComeAgain) {
  ShownRobot robot;
  Tap tap(robot.images(), ShownRobot::kPeriod_ns);
  const auto block = test::block_of(3);
  for (std::uint64_t cycle = 90; cycle < 100; ++cycle) robot.show(tap, cycle, {block});
  for (std::uint64_t cycle = 50; cycle < 60; ++cycle) robot.show(tap, cycle, {block});
  std::size_t parts = 0, cycles = 0;
  double number = 0.0;
  while (tap.next(
      [&](const Tap::Signals& part) {
        ++parts;
        std::memcpy(&number, part.bytes.data() + 16, sizeof number);
      },
      [&](const Tap::Cycle& one) {
        ++cycles;
        EXPECT_EQ(number, test::number_of(one.time.cycle, 0));
      })) {
  }
  EXPECT_EQ(cycles, 20U);
  EXPECT_EQ(parts, 20U);
}

TEST(StudioSampler, GoesBackWithTheRun) {
  ShownRobot robot;
  Tap tap(robot.images(), ShownRobot::kPeriod_ns);
  Sampler sampler(tap, robot.images(), robot.names(), 100'000);
  for (std::uint64_t cycle = 0; cycle < 100; ++cycle) robot.show(tap, cycle, {});
  (void)sampler.look({});
  EXPECT_FALSE(sampler.take_back());
  sampler.begin_tick();
  for (std::uint64_t cycle = 100; cycle < 110; ++cycle) robot.show(tap, cycle, {});
  for (std::uint64_t cycle = 40; cycle < 60; ++cycle) robot.show(tap, cycle, {});
  for (std::uint64_t cycle = 50; cycle < 53; ++cycle) robot.show(tap, cycle, {});
  (void)sampler.look({});
  const auto back = sampler.take_back();
  ASSERT_TRUE(back);
  EXPECT_EQ(back->cycle, 40U) << "the earliest of two jumps";
  EXPECT_EQ(back->to_ns, 40'000'000);
  EXPECT_EQ(back->from_ns, 109'000'000);
  EXPECT_FALSE(sampler.take_back()) << "once";
  EXPECT_EQ(sampler.cycle(), 52U);
  EXPECT_EQ(sampler.history().newest(), 52U);
  const SignalId position = test::id_of(sampler.table(), "state.position_rad.a");
  EXPECT_FLOAT_EQ(sampler.span().largest[position], 0.52F) << "nothing of what was taken back";
}

}  // namespace
}  // namespace tandem::studio
