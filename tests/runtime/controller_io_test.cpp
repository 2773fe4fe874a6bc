// What a controller tells beside its command: signals, words and marks, from its declaration to the
// log.
#include <cmath>
#include <limits>
#include <set>

#include "dds/cdr.hpp"
#include "dds/message_definition.hpp"
#include "log/csv.hpp"
#include "log/log_file.hpp"
#include "log/schema.hpp"
#include "tests/log/scratch_folder.hpp"
#include "tests/runtime/loop_run.hpp"

namespace tandem::runtime {
namespace {

using namespace test;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Tells of each update.
class Teller : public Controller {
 public:
  explicit Teller(std::size_t joint = 0, std::size_t numbers = 3)
      : joint_(joint), numbers_(numbers) {}
  Status configure(ControllerSetup& setup) override {
    setup.claim(joint_, hal::ControlMode::kPosition);
    count_ = setup.signal("count", "", "updates so far");
    place_ = setup.signals("place", "m", "of something", numbers_);
    error_ = setup.joint_signals("error", "rad", "of each joint");
    once_ = setup.signal("once", "s", "written in the tenth update only");
    log_ = setup.text_events();
    arrow_ = setup.mark("push", {.shape = hal::MarkShape::kArrow, .frame = "hand"});
    words_ = setup.mark("words", {.shape = hal::MarkShape::kText, .frame = "hand"});
    return {};
  }
  void start(const hal::CycleTime&, const hal::StateImage& state,
             hal::CommandImage&) noexcept override {
    middle_rad_ = state.position_rad()[joint_];
  }
  Code update(const hal::CycleTime&, const hal::StateImage&,
              hal::CommandImage& command) noexcept override {
    command.position_rad()[joint_] = middle_rad_;
    ++updates_;
    count_ = static_cast<double>(updates_);
    place_.set(std::array{1.0, 2.0, kNaN});
    place_.set(99, 5.0);  // nowhere
    for (std::size_t j = 0; j < error_.size(); ++j) error_.set(j, 10.0 * static_cast<double>(j));
    if (updates_ == 10) once_ = 4.5;
    for (int i = 0; i < lines; ++i) log_("stance changed", i, true, 0.25, "left", kNaN);
    if (updates_ == 20) {
      arrow_.set(0, {0.0, 0.0, 0.0});
      arrow_.set(1, {0.0, 0.5, 1.0});
      words_.set(0, {0.0, 0.0, 2.0});
      words_.say("ouch");
    }
    return Code::kOk;
  }
  void archive(Archive& ar) override { ar(updates_, middle_rad_); }

  int lines = 0;  ///< said in each update

 private:
  std::size_t joint_, numbers_;
  Signal count_, place_, error_, once_;
  TextEvents log_;
  Mark arrow_, words_;
  std::int64_t updates_ = 0;
  double middle_rad_ = 0.0;
};

/// Declares what the test says.
struct Declares : Controller {
  explicit Declares(std::function<void(ControllerSetup&)> what) : declare(std::move(what)) {}
  Status configure(ControllerSetup& setup) override { return declare(setup), Status(); }
  void start(const hal::CycleTime&, const hal::StateImage&, hal::CommandImage&) noexcept override {}
  Code update(const hal::CycleTime&, const hal::StateImage&, hal::CommandImage&) noexcept override {
    return Code::kOk;
  }
  std::function<void(ControllerSetup&)> declare;
};

/// What add() says of it.
std::string problem(std::function<void(ControllerSetup&)> declare,
                    std::vector<std::string> links = {}) {
  hal::RobotConfig config = hal::test::fake_robot();
  hal::SiteConfig& palm = config.model.sites.emplace_back();
  palm.name = "palm";
  palm.link = "hand";
  JointRun run(std::move(config));
  run.host->draw_in(std::move(links));
  const TomlDocument nothing = TomlDocument::parse("", "test.toml").value();
  const Status added =
      run.host->add("gait", std::make_shared<Declares>(std::move(declare)), nothing.root());
  return added ? "" : added.error().to_string();
}

struct LoggedRun : JointRun {
  LoggedRun() {
    auto opened =
        log::Recorder::open(folder / "run.mcap", {.joints = {"shoulder", "elbow", "wrist"}}, {});
    EXPECT_TRUE(opened);
    own = std::move(*opened);
    recorder = own.get();
  }
  Teller* add_teller(const std::string& name = "gait") {
    auto teller = std::make_shared<Teller>();
    add(name, teller);
    return teller.get();
  }
  log::LogFile logged() {
    (void)own->close();
    auto file = log::LogFile::open(folder / "run.mcap");
    EXPECT_TRUE(file) << file.error().to_string();
    return std::move(*file);
  }

  log::ScratchFolder folder;
  std::unique_ptr<log::Recorder> own;
};

/// Bodies of a topic's messages, with the encoding's bytes in front.
std::vector<dds::Value> decoded(const log::LogFile& file, const std::string& topic,
                                const char* type) {
  std::vector<dds::Value> all;
  const Status read = file.for_each(topic, [&](std::int64_t, std::span<const std::byte> body) {
    std::vector<std::byte> bytes(log::kCdrHeader.begin(), log::kCdrHeader.end());
    bytes.insert(bytes.end(), body.begin(), body.end());
    auto value = dds::decode(*dds::find_definition(type), bytes);
    ASSERT_TRUE(value) << value.error().to_string();
    all.push_back(std::move(*value));
  });
  EXPECT_TRUE(read) << read.error().to_string();
  return all;
}
template <class T>
T get(const dds::Value& message, const char* member) {
  const dds::Value* found = dds::find(message, member);
  return found == nullptr ? T() : std::get<T>(found->of);
}

TEST(Signals, AreLoggedInEveryCycleOfTheirController) {
  LoggedRun run;
  run.add_teller();
  run.begin({.running_cycles = 50});
  run.cycle->run();
  const log::LogFile file = run.logged();
  const auto table = file.read(
      "/tandem/controller/gait",
      {{"cycle"}, {"count"}, {"place", 0}, {"place", 1}, {"place", 2}, {"error", 2}, {"once"}});
  ASSERT_TRUE(table) << table.error().to_string();
  const std::size_t rows = table->time_s.size(), last = rows - 1;
  ASSERT_NEAR(static_cast<double>(rows), 50.0, 1.0);
  const auto& columns = table->columns;
  for (std::size_t row = 0; row < rows; ++row) {
    EXPECT_EQ(columns[0][row], columns[0][0] + static_cast<double>(row));
    EXPECT_EQ(columns[1][row], static_cast<double>(row + 1));
  }
  EXPECT_EQ(columns[2][last], 1.0);
  EXPECT_EQ(columns[3][last], 2.0);
  EXPECT_TRUE(std::isnan(columns[4][last])) << "a NaN is shown as it is";
  EXPECT_EQ(columns[5][last], 20.0);
  EXPECT_TRUE(std::isnan(columns[6][8])) << "nothing was written yet";
  EXPECT_EQ(columns[6][9], 4.5);
  EXPECT_EQ(columns[6][last], 4.5) << "a signal keeps its number";
  const log::LoggedTopic* topic = file.find("/tandem/controller/gait");
  EXPECT_EQ(topic->layout.find("error")->doc, "[rad] by joint: of each joint");
  EXPECT_EQ(topic->layout.find("place")->doc, "[m] of something");
  std::ostringstream csv;
  EXPECT_TRUE(log::write_csv(file, topic->name, 1, csv));
  EXPECT_NE(csv.str().find("error.elbow"), std::string::npos) << csv.str().substr(0, 200);
}

TEST(Signals, OfARewoundRunAreTheSame) {
  LoggedRun run;
  run.add_teller();
  run.begin({.running_cycles = 1000});
  run.until(RunPhase::kRunning);
  run.steps(20);
  const auto snapshot = run.cycle->save();
  ASSERT_TRUE(snapshot);
  run.steps(30);
  ASSERT_TRUE(run.cycle->restore(*snapshot));
  run.steps(30);
  const auto table =
      run.logged().read("/tandem/controller/gait", {{"cycle"}, {"count"}, {"error", 1}, {"once"}});
  ASSERT_TRUE(table);
  const std::size_t rows = table->time_s.size();
  ASSERT_GT(rows, 60U);
  for (const auto& column : table->columns) {
    for (std::size_t i = 1; i <= 30; ++i) EXPECT_EQ(column[rows - i], column[rows - 30 - i]);
  }
  EXPECT_EQ(table->columns[3].back(), 4.5) << "written before the snapshot, in no cycle since";
}

// A snapshot from before the signal was written, restored after: it is NaN again.
TEST(Signals, AreStateOfASnapshot) {
  LoggedRun run;
  run.add_teller();
  run.begin({.running_cycles = 1000});
  run.until(RunPhase::kRunning);
  run.steps(3);
  const auto snapshot = run.cycle->save();
  run.steps(20);
  ASSERT_TRUE(run.cycle->restore(*snapshot));
  run.steps(2);
  const auto table = run.logged().read("/tandem/controller/gait", {{"once"}});
  ASSERT_TRUE(table);
  EXPECT_TRUE(std::isnan(table->columns[0].back()));
}

TEST(Signals, OfAControllerThatIsLoadedLaterHaveTheirOwnChannel) {
  LoggedRun run;
  run.add_teller();
  run.begin({.running_cycles = 1000});
  run.until(RunPhase::kRunning);
  const TomlDocument nothing = TomlDocument::parse("", "test.toml").value();
  const auto load = [&](std::size_t numbers) {
    ASSERT_TRUE(run.services().load("late", std::make_shared<Teller>(1, numbers), nothing, kNow));
    run.steps(2);
    ASSERT_TRUE(run.services().switch_controllers({}, {"late"}, kNow));
    run.steps(10);
    ASSERT_TRUE(run.services().switch_controllers({"late"}, {}, kNow));
    run.steps(2);
    ASSERT_TRUE(run.services().unload("late", kNow));
    run.steps(2);
  };
  load(3);
  load(3);  // as before: the same channel
  load(7);  // another shape, as of a new build
  const log::LogFile file = run.logged();
  const auto rows = [&](const char* topic) {
    const auto table = file.read(topic, {{"count"}});
    EXPECT_TRUE(table) << table.error().to_string();
    return table ? table->time_s.size() : 0;
  };
  EXPECT_EQ(rows("/tandem/controller/late"), 20U);
  EXPECT_EQ(rows("/tandem/controller/late_2"), 10U);
  EXPECT_EQ(file.find("/tandem/controller/late_2")->layout.find("place")->count, 7U);
  EXPECT_EQ(file.find("/tandem/controller/late_3"), nullptr);
}

TEST(Signals, AreShownToOtherThreads) {
  JointRun run;
  run.add("gait", std::make_shared<Teller>());
  run.begin({.running_cycles = 1000});
  const auto before = run.services().signals();
  ASSERT_EQ(before.size(), 1U);
  EXPECT_EQ(before[0].block->look().time_ns, -1) << "it has not run yet";
  run.steps(100);
  const auto look = before[0].block->look();
  EXPECT_EQ(look.cycle, 99U);
  EXPECT_GT(look.values[0], 0.0);
  EXPECT_EQ(before[0].block->number_names({}).size(), look.values.size());
}

// A handle may outlive host and run.
TEST(Signals, CannotDangle) {
  auto teller = std::make_shared<Teller>();
  hal::StateImage state({.joints = 3, .sensor_channels = {}});
  hal::CommandImage command({.joints = 3, .sensor_channels = {}});
  {
    JointRun run;
    run.add("gait", teller);
  }
  teller->lines = 1;
  EXPECT_EQ(teller->update({}, state, command), Code::kOk);  // under a sanitizer, too
}

TEST(Signals, ThatCannotBeAreErrorsWithControllerAndSignal) {
  const auto twice = problem([](ControllerSetup& setup) {
    (void)setup.signal("depth", "m", "");
    (void)setup.signal("depth", "m", "");
  });
  EXPECT_NE(twice.find("gait: its signal 'depth' is declared twice"), std::string::npos) << twice;
  for (const char* name :
       {"", "Depth", "1st", "a b", "a__b", "a_", "cycle", "time_ns", "ü", "a\n"}) {
    const auto said = problem([&](ControllerSetup& setup) { (void)setup.signal(name, "m", ""); });
    EXPECT_NE(said.find("gait: its signal '"), std::string::npos) << name << said;
    EXPECT_NE(said.find("has a name that"), std::string::npos) << name << said;
  }
  EXPECT_NE(problem([](ControllerSetup& s) { (void)s.signal("a", "m\nfloat64 b", ""); }), "");
  EXPECT_NE(problem([](ControllerSetup& s) { (void)s.signals("a", "m", "", 0); }), "");
  const auto many = problem([](ControllerSetup& setup) {
    for (int i = 0; i < 10'000; ++i) (void)setup.signal("s" + std::to_string(i), "", "");
  });
  EXPECT_NE(many.find("gait: its signal 's500' is one signal too many"), std::string::npos) << many;
  EXPECT_NE(problem([](ControllerSetup& s) { (void)s.signals("a", "m", "", std::size_t(-1)); }),
            "");
  EXPECT_EQ(problem([](ControllerSetup& s) { (void)s.signals("a", "m", "one # line", 500); }), "");
}

TEST(TextEvents, AreEventsAndLinesOfRosout) {
  LoggedRun run;
  Teller* const teller = run.add_teller();
  run.begin({.running_cycles = 1000});
  run.until(RunPhase::kRunning);
  teller->lines = 1;
  run.steps(2);
  teller->lines = 0;
  run.steps(5);
  std::uint64_t seen = 0;
  std::vector<hal::TextEvent> shown;
  EXPECT_EQ(run.services().texts().read(seen, shown), 0U);
  ASSERT_EQ(shown.size(), 2U);
  EXPECT_EQ(shown[0].controller(), "gait");
  const log::LogFile file = run.logged();
  std::vector<log::EventText> said;
  const auto events = file.events();
  ASSERT_TRUE(events);
  for (const auto& event : *events) {
    if (event.event.kind == log::EventKind::kText) said.push_back(event);
  }
  ASSERT_EQ(said.size(), 2U);
  EXPECT_EQ(said[0].text, "gait: stance changed 0 true 0.25 left nan");
  EXPECT_EQ(said[1].event.cycle, said[0].event.cycle + 1);
  const auto lines = decoded(file, "/rosout", "rcl_interfaces/msg/Log");
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_EQ(get<std::string>(lines[0], "name"), "gait");
  EXPECT_EQ(get<std::string>(lines[0], "msg"), "stance changed 0 true 0.25 left nan");
  EXPECT_EQ(get<std::string>(lines[0], "function"), "cycle " + std::to_string(said[0].event.cycle));
  EXPECT_EQ(get<std::uint64_t>(lines[0], "level"), 20U);
}

TEST(TextEvents, AFloodIsBoundedAndCounted) {
  LoggedRun run;
  Teller* const teller = run.add_teller();
  run.begin({.running_cycles = 10'000});
  run.until(RunPhase::kRunning);
  teller->lines = 100;
  run.steps(2000);  // 2 s: 200,000 lines
  teller->lines = 0;
  run.steps(1000);
  teller->lines = 1;
  run.steps(1);
  const log::LogFile file = run.logged();
  std::size_t said = 0;
  std::string last;
  const auto events = file.events();
  ASSERT_TRUE(events);
  for (const auto& event : *events) {
    if (event.event.kind != log::EventKind::kText) continue;
    ++said;
    last = event.text;
  }
  EXPECT_NEAR(static_cast<double>(said), 50.0 + 40.0 + 1.0, 2.0)
      << "at once, 20 a second, and the last one";
  EXPECT_EQ(run.services().texts().count(), said);
  EXPECT_EQ(run.cycle->statistics().texts().said, said);
  EXPECT_EQ(run.cycle->statistics().texts().left_out, 200'001 - said);
  EXPECT_NE(last.find(" before it were too many"), std::string::npos) << last;
  EXPECT_EQ(run.host->owned()[0]->io->texts.left_out(), 200'000 - (said - 1));
}

// Those of a controller that was unloaded, and those left out after the last line, count as well.
TEST(TextEvents, AreCountedForTheWholeRun) {
  LoggedRun run;
  run.add_teller("other")->lines = 0;
  run.begin({.running_cycles = 10'000});
  run.until(RunPhase::kRunning);
  EXPECT_EQ(run.cycle->statistics().texts().said, 0U);
  auto teller = std::make_shared<Teller>(1);
  teller->lines = 20;
  const TomlDocument nothing = TomlDocument::parse("", "test.toml").value();
  ASSERT_TRUE(run.services().load("late", teller, nothing, kNow));
  run.steps(2);
  ASSERT_TRUE(run.services().switch_controllers({}, {"late"}, kNow));
  run.steps(1);
  const auto snapshot = run.cycle->save();
  const TextFigures once = run.cycle->statistics().texts();
  EXPECT_EQ(once.said, 8U) << "of one cycle at most";
  EXPECT_EQ(once.left_out, 12U);
  run.steps(3);
  ASSERT_TRUE(run.cycle->restore(*snapshot));
  EXPECT_EQ(run.cycle->statistics().texts().said, once.said) << "of the run that is, once";
  run.steps(1);
  ASSERT_TRUE(run.services().switch_controllers({"late"}, {}, kNow));
  run.steps(2);
  ASSERT_TRUE(run.services().unload("late", kNow));
  run.steps(2);
  const TextFigures all = run.cycle->statistics().texts();
  EXPECT_GE(all.said, 16U);
  EXPECT_EQ((all.said + all.left_out) % 20, 0U) << "each update said 20";
}

TEST(TextEvents, ThatAreTooLongAreCutBetweenCharacters) {
  hal::TextEvent event;
  std::string text;
  for (int i = 0; i < 100; ++i) text += "ü";
  event.append("x");
  event.append(text);
  EXPECT_EQ(event.text().size(), 159U);
  event.append("yz");
  EXPECT_EQ(event.text().substr(157), "üy");
}

TEST(Marks, AreMarkersForViewers) {
  LoggedRun run;
  run.add_teller();
  run.begin({.running_cycles = 200});
  run.cycle->run();
  const auto messages =
      decoded(run.logged(), "/tandem/controller/gait/marks", "visualization_msgs/msg/MarkerArray");
  ASSERT_NEAR(static_cast<double>(messages.size()), 10.0, 1.0) << "50 a second";
  const auto markers = [&](const dds::Value& message) {
    return get<dds::Value::List>(message, "markers");
  };
  const auto first = markers(messages.front());
  ASSERT_EQ(first.size(), 2U);
  EXPECT_EQ(get<std::int64_t>(first[0], "action"), 2) << "not shown yet: deleted";
  const auto last = markers(messages.back());
  EXPECT_EQ(get<std::int64_t>(last[0], "action"), 0);
  EXPECT_EQ(get<std::int64_t>(last[0], "type"), 0);
  EXPECT_EQ(get<std::string>(last[0], "ns"), "gait/push");
  const auto points = get<dds::Value::List>(last[0], "points");
  ASSERT_EQ(points.size(), 2U);
  EXPECT_EQ(get<double>(points[1], "z"), 1.0);
  EXPECT_EQ(get<std::string>(*dds::find(last[0], "header"), "frame_id"), "hand");
  EXPECT_EQ(get<std::int64_t>(last[1], "type"), 9);
  EXPECT_EQ(get<std::string>(last[1], "text"), "ouch");
  const dds::Value pose = *dds::find(last[1], "pose");
  EXPECT_EQ(get<double>(*dds::find(pose, "position"), "z"), 2.0);
}

TEST(Marks, ThatCannotBeAreErrorsWithControllerAndMark) {
  const auto of = [](const hal::MarkStyle& style, int times = 1) {
    return problem([&](ControllerSetup& setup) {
      for (int i = 0; i < times; ++i) (void)setup.mark("m", style);
    });
  };
  EXPECT_EQ(of({.frame = "hand"}), "");
  for (const std::string& said :
       {of({.frame = ""}), of({.frame = "hand"}, 2), of({.frame = "hand", .points = 0}),
        of({.frame = "hand", .points = 5000}), of({.frame = "hand", .size_m = kNaN}),
        of({.frame = "hand", .rgba = {2.0F, 0.0F, 0.0F, 1.0F}})}) {
    EXPECT_NE(said.find("gait: its mark 'm' "), std::string::npos) << said;
  }
}

TEST(Marks, AreInALinkASiteOrTheWorld) {
  const auto in = [](const char* frame) {
    return problem([&](ControllerSetup& setup) { (void)setup.mark("push", {.frame = frame}); },
                   {"base", "hand"});
  };
  for (const char* frame : {"hand", "base", "palm", "odom"}) EXPECT_EQ(in(frame), "") << frame;
  const auto of = [&](const char* frame, const std::string& hint) {
    const std::string said = in(frame);
    EXPECT_NE(said.find("gait: its mark 'push' is in the frame '" + std::string(frame) + "'"),
              std::string::npos)
        << said;
    EXPECT_NE(said.find(hint), std::string::npos) << said;
  };
  of("hnad", "'hand'");
  of("plam", "'palm'");
  of("world", "\"odom\"");
  of("something else", "known: odom, palm, base, hand");
}

/// What a viewer of the log has after all messages: namespaces of the marks.
std::set<std::string> seen_in(const log::LogFile& file, const std::string& topic) {
  std::set<std::string> seen;
  for (const auto& message : decoded(file, topic, "visualization_msgs/msg/MarkerArray")) {
    for (const auto& marker : get<dds::Value::List>(message, "markers")) {
      const auto space = get<std::string>(marker, "ns");
      get<std::int64_t>(marker, "action") == 2 ? (void)seen.erase(space) : (void)seen.insert(space);
    }
  }
  return seen;
}

TEST(Marks, OfAStoppedControllerAreDeleted) {
  const auto after = [](bool stops, bool starts) {
    LoggedRun run;
    run.add_teller();
    run.begin({.running_cycles = 1000});
    run.until(RunPhase::kRunning);
    run.steps(100);
    if (stops) {
      EXPECT_TRUE(run.services().switch_controllers({"gait"}, {}, kNow));
    }
    run.steps(100);
    if (starts) {
      EXPECT_TRUE(run.services().switch_controllers({}, {"gait"}, kNow));
    }
    run.steps(100);
    return seen_in(run.logged(), "/tandem/controller/gait/marks");
  };
  const std::set<std::string> both{"gait/push", "gait/words"};
  EXPECT_EQ(after(false, false), both);
  EXPECT_EQ(after(true, false), std::set<std::string>());
  EXPECT_EQ(after(true, true), both) << "they are what they were";
}

/// One of that name and other marks: the log does not take its points for the former's.
TEST(Marks, OfANewBuildHaveTheirOwnChannel) {
  struct Draws : Declares {
    explicit Draws(const char* mark)
        : Declares([=, this](ControllerSetup& setup) { made = setup.mark(mark, {.frame = "a"}); }) {
    }
    Code update(const hal::CycleTime&, const hal::StateImage&,
                hal::CommandImage&) noexcept override {
      made.set(0, {1.0, 2.0, 3.0});
      return Code::kOk;
    }
    Mark made;
  };
  LoggedRun run;
  run.add_teller("other");
  run.begin({.running_cycles = 10'000});
  run.until(RunPhase::kRunning);
  const TomlDocument nothing = TomlDocument::parse("", "test.toml").value();
  for (const char* mark : {"one", "one", "two"}) {
    ASSERT_TRUE(run.services().load("late", std::make_shared<Draws>(mark), nothing, kNow));
    run.steps(2);
    ASSERT_TRUE(run.services().switch_controllers({}, {"late"}, kNow));
    run.steps(30);
    if (std::string_view(mark) == "two") break;
    ASSERT_TRUE(run.services().switch_controllers({"late"}, {}, kNow));
    run.steps(30);
    ASSERT_TRUE(run.services().unload("late", kNow));
    run.steps(2);
  }
  const log::LogFile file = run.logged();
  EXPECT_EQ(seen_in(file, "/tandem/controller/late/marks"), std::set<std::string>());
  EXPECT_EQ(seen_in(file, "/tandem/controller/late/marks_2"), std::set<std::string>{"late/two"});
  EXPECT_EQ(file.find("/tandem/controller/late/marks_3"), nullptr);
}

}  // namespace
}  // namespace tandem::runtime
