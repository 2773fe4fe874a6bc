// Parameters of a controller that are set while a run goes on: between which cycles, all or none,
// and again after a restore.
#include <bit>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "log/log_file.hpp"
#include "tests/log/scratch_folder.hpp"
#include "tests/runtime/swing_loop.hpp"

namespace tandem::runtime {
namespace {

using test::kNow;
using Wishes = std::vector<ParameterWish>;

/// Holds the joint at where it was, and `offset_rad` more. It counts the changes that it sees.
class Tuned : public Controller {
 public:
  Status configure(ControllerSetup& setup) override {
    offset_rad_ = setup.parameter("offset_rad", {.unit = "rad",
                                                 .min = -0.2,
                                                 .max = 0.2,
                                                 .otherwise = 0,
                                                 .live = true,
                                                 .doc = "beside where it was"});
    share_ = setup.parameter(
        "share", {.min = 0, .max = 1, .otherwise = 1, .live = true, .doc = "of the offset"});
    word_ = setup.parameter("word", {.choices = {"here", "there"},
                                     .otherwise = "here",
                                     .live = true,
                                     .doc = "there: the other way"});
    count_ = setup.parameter(
        "count",
        {.min = 1, .max = 9, .whole = true, .otherwise = 3, .live = true, .doc = "of nothing"});
    on_ = setup.parameter("on", {.otherwise = true, .live = true, .doc = "false: no offset"});
    length_m_ = setup.parameter("length_m", {.otherwise = 0.5, .doc = "fixed"});
    gains_ = setup.list_parameters("gains", {"x", "y", "z.0"},
                                   {{.min = 0, .max = 9, .otherwise = 1, .live = true}});
    setup.claim(0, hal::ControlMode::kPosition);
    return {};
  }
  void start(const hal::CycleTime&, const hal::StateImage& state,
             hal::CommandImage&) noexcept override {
    here_rad_ = state.position_rad()[0];
  }
  Code update(const hal::CycleTime& time, const hal::StateImage&,
              hal::CommandImage& command) noexcept override {
    if (offset_rad_.changed() || share_.changed()) {
      ++changes;
      changed_in = time.cycle;
    }
    const double way = word_.is("there") ? -1.0 : 1.0;
    command.position_rad()[0] = here_rad_ + (on_.on() ? way * share_ * offset_rad_ : 0.0);
    return Code::kOk;
  }
  void archive(Archive& ar) override { ar(here_rad_); }

  std::uint64_t changed_in = 0;
  int changes = 0;

 private:
  Parameter offset_rad_, share_, word_, count_, on_, length_m_;
  std::vector<Parameter> gains_;
  double here_rad_ = 0.0;
};

struct ParameterRun : testing::Test, test::SwingLoop {
  void SetUp() override {
    add("tuned", tuned);
    begin({.settle_cycles = 200});
    run_to(RunPhase::kRunning);
    steps(100);
  }
  [[nodiscard]] Result<RequestResult> set(const Wishes& wishes) const {
    return services().set_parameters(wishes, kNow);
  }
  /// Why not; empty: it is asked for.
  [[nodiscard]] std::string refusal(const std::string& parameter, ParameterValue value) const {
    const auto asked = set({{"tuned", parameter, std::move(value)}});
    return asked ? "" : asked.error().to_string();
  }
  [[nodiscard]] double value(const std::string& name) const {
    const auto all = services().parameters("tuned");
    for (const ParameterStatus& one : *all)
      if (one.name == name) return one.value;
    return kNotGiven;
  }
  [[nodiscard]] std::vector<double> references(int cycles) {
    std::vector<double> all;
    for (int i = 0; i < cycles; ++i) {
      steps(1);
      all.push_back(reference(0));
    }
    return all;
  }

  std::shared_ptr<Tuned> tuned = std::make_shared<Tuned>();
};

TEST_F(ParameterRun, IsSetBetweenTwoCyclesAndTheAnswerSaysWhich) {
  ASSERT_TRUE(set({{"tuned", "offset_rad", 0.01}}));
  EXPECT_EQ(value("offset_rad"), 0.0) << "nobody has stepped";
  steps(1);
  EXPECT_EQ(value("offset_rad"), 0.01);
  EXPECT_EQ(tuned->changes, 1);
  EXPECT_EQ(tuned->changed_in, cycle->state().cycle()[0]);
  steps(10);
  EXPECT_EQ(tuned->changes, 1) << "a change is one for a single update()";
  const auto asked = while_cycling([&] {
    return services().set_parameters({{"tuned", "share", 0.5}}, std::chrono::seconds(20));
  });
  ASSERT_TRUE(asked);
  EXPECT_TRUE(asked->done);
  EXPECT_EQ(asked->cycle, tuned->changed_in);
}

TEST_F(ParameterRun, SetsAllOrNone) {
  EXPECT_FALSE(set({{"tuned", "offset_rad", 0.1}, {"tuned", "share", 2.0}}));
  EXPECT_FALSE(set({{"tuned", "offset_rad", 0.1}, {"tuned", "offset_rad", 0.2}}));
  EXPECT_FALSE(set({{"tuned", "offset_rad", 0.1}, {"other", "kp", 0.2}}));
  EXPECT_FALSE(set({}));
  EXPECT_FALSE(set(Wishes(kMostParameterChanges + 1, {"tuned", "share", 0.2})));
  steps(2);
  EXPECT_EQ(value("offset_rad"), 0.0);
  EXPECT_EQ(tuned->changes, 0);
  ASSERT_TRUE(set({{"tuned", "offset_rad", 0.1},
                   {"tuned", "word", "there"},
                   {"tuned", "count", 4},
                   {"tuned", "on", false}}));
  steps(1);
  EXPECT_EQ(value("offset_rad"), 0.1);
  EXPECT_EQ(value("word"), 1.0);
  EXPECT_EQ(value("count"), 4.0);
  EXPECT_EQ(value("on"), 0.0);
  EXPECT_TRUE(cycle->faults().empty());
}

TEST_F(ParameterRun, SetsAListAllElementsAtOnceOrEachByItself) {
  const auto gains = [&] {
    return std::vector<double>{value("gains.x"), value("gains.y"), value("gains.z.0")};
  };
  using Values = std::vector<double>;
  ASSERT_TRUE(set({{"tuned", "gains", 4}}));
  steps(1);
  EXPECT_EQ(gains(), Values({4, 4, 4}));
  ASSERT_TRUE(set({{"tuned", "gains", Values{1, 2, 3}}}));
  steps(1);
  EXPECT_EQ(gains(), Values({1, 2, 3}));
  const auto snapshot = cycle->save();
  ASSERT_TRUE(snapshot);
  ASSERT_TRUE(set({{"tuned", "gains.z.0", 5}, {"tuned", "share", 0.5}}));
  steps(1);
  EXPECT_EQ(gains(), Values({1, 2, 5}));
  ASSERT_TRUE(cycle->restore(*snapshot));
  EXPECT_EQ(gains(), Values({1, 2, 3}));

  EXPECT_EQ(refusal("gains", Values{1, 2}),
            "tuned.gains: has 3 elements, not 2 (give one number for all, or one for each of x, y, "
            "z.0)");
  EXPECT_NE(refusal("gains", Values{}), "");
  EXPECT_NE(refusal("gains", Values(10'000, 1.0)), "");
  EXPECT_EQ(refusal("gains", Values{1, 10, 2}), "tuned.gains.y: 10 is out of range (give 0 to 9)");
  EXPECT_EQ(refusal("gains", Values{1, std::nan(""), 2}),
            "tuned.gains.y: has to be finite (give 0 to 9)");
  EXPECT_EQ(refusal("gains", 10), "tuned.gains.x: 10 is out of range (give 0 to 9)");
  EXPECT_EQ(refusal("gains", true), "tuned.gains.x: is a number, not true (give 0 to 9)");
  EXPECT_EQ(refusal("gains.y", Values{1, 2, 3}),
            "tuned.gains.y: is a number, not a list (give 0 to 9)");
  EXPECT_EQ(refusal("share", Values{1}), "tuned.share: is a number, not a list (give 0 to 1)");
  EXPECT_EQ(refusal("gain", 1),
            "tuned.gain: the controller has no such parameter (did you mean 'gains'?)");
  EXPECT_EQ(refusal("gains.w", 1),
            "tuned.gains.w: the controller has no such parameter (known: gains.x, gains.y, "
            "gains.z.0)");
  EXPECT_FALSE(set({{"tuned", "gains", 2}, {"tuned", "gains.y", 3}})) << "y is named twice";
  EXPECT_FALSE(set(Wishes(kMostParameterChanges / 3 + 1, {"tuned", "gains", 2})));
  EXPECT_FALSE(set(Wishes(10'000, {"tuned", "share", 0.2})));
  steps(2);
  EXPECT_EQ(gains(), Values({1, 2, 3})) << "all or none";
  EXPECT_EQ(cycle->phase(), RunPhase::kRunning);
}

TEST_F(ParameterRun, GoesOnWhenAControllerThatDeclaresThemWronglyIsLoaded) {
  /// Declares "kp" as `declare` does.
  struct Wrong : Controller {
    explicit Wrong(void (*it)(ControllerSetup&)) : declare(it) {}
    Status configure(ControllerSetup& setup) override {
      declare(setup);
      return {};
    }
    void start(const hal::CycleTime&, const hal::StateImage&,
               hal::CommandImage&) noexcept override {}
    Code update(const hal::CycleTime&, const hal::StateImage&,
                hal::CommandImage&) noexcept override {
      return Code::kOk;
    }
    void (*declare)(ControllerSetup&);
  };
  const auto refused = [&](void (*declare)(ControllerSetup&), const std::string& text = "") {
    const auto parameters = TomlDocument::parse(text, "p.toml");
    const auto asked =
        services().load("wrong", std::make_shared<Wrong>(declare), *parameters, kNow);
    EXPECT_FALSE(asked);
    EXPECT_FALSE(services().parameters("wrong"));
    return asked ? "" : asked.error().message;
  };
  EXPECT_NE(refused([](ControllerSetup& setup) {
              for (int i = 0; i < 2; ++i) (void)setup.parameter("kp", {.otherwise = 1});
            }).find("kp: the controller declares this parameter twice"),
            std::string::npos);
  EXPECT_NE(refused([](ControllerSetup& setup) {
              (void)setup.parameter("kp", {.min = 0, .max = 5, .otherwise = 6});
            }).find("kp: has a default outside its range"),
            std::string::npos);
  EXPECT_NE(
      refused([](ControllerSetup& setup) {
        (void)setup.joint_parameters("kp", std::vector<std::size_t>{0, 0}, {{.otherwise = 1}});
      }).find("kp: has two elements of one name"),
      std::string::npos);
  EXPECT_NE(refused([](ControllerSetup& setup) {
              for (int i = 0; i < 10'000; ++i)
                (void)setup.parameter("p" + std::to_string(i), {.otherwise = 1});
            }).find("more than 1024 parameters"),
            std::string::npos);
  const auto one = [](ControllerSetup& setup) {
    (void)setup.list_parameters("kp", {"x", "y"}, {{.min = 0, .otherwise = 1}});
  };
  for (const char* text :
       {"kp = [1, 2, 3]", "kp = nan", "kp = [1, 'x']", "kp = -1", "kp = {z = 1}"})
    EXPECT_NE(refused(one, text).find("p.toml:1: kp"), std::string::npos) << text;
  steps(3);
  EXPECT_EQ(cycle->phase(), RunPhase::kRunning);
  EXPECT_TRUE(cycle->faults().empty());
}

TEST_F(ParameterRun, SaysWhyAValueDoesNotFitAndWhatWould) {
  EXPECT_EQ(refusal("offset_rad", 0.3),
            "tuned.offset_rad: 0.3 is out of range (give -0.2 to 0.2 rad)");
  EXPECT_EQ(refusal("offset_rad", std::nan("")),
            "tuned.offset_rad: has to be finite (give -0.2 to 0.2 rad)");
  EXPECT_EQ(refusal("ofset_rad", 0.1),
            "tuned.ofset_rad: the controller has no such parameter (did you mean 'offset_rad'?)");
  EXPECT_EQ(refusal("offset_rad", true),
            "tuned.offset_rad: is a number, not true (give -0.2 to 0.2 rad)");
  EXPECT_EQ(refusal("offset_rad", "much"),
            "tuned.offset_rad: is a number, not 'much' (give -0.2 to 0.2 rad)");
  EXPECT_EQ(refusal("offset_rad", ParameterValue()),
            "tuned.offset_rad: is a number, not nothing (give -0.2 to 0.2 rad)");
  EXPECT_EQ(refusal("count", 2.5),
            "tuned.count: 2.5 is no whole number (give whole numbers, 1 to 9)");
  EXPECT_EQ(refusal("on", 1), "tuned.on: is true or false, not 1 (give true or false)");
  EXPECT_EQ(refusal("word", "thre"),
            "tuned.word: 'thre' is none of its words (did you mean 'there'?)");
  EXPECT_EQ(refusal("length_m", 0.4),
            "tuned.length_m: is not live: it is read when the controller is loaded (give it in the "
            "experiment's file, or unload the controller and load it with another value)");
  EXPECT_EQ(set({{"tnued", "share", 0.5}}).error().to_string(),
            "tnued: no controller 'tnued' is loaded (did you mean 'tuned'?)");
  steps(3);
  EXPECT_EQ(tuned->changes, 0);
  EXPECT_EQ(cycle->phase(), RunPhase::kRunning);
}

TEST_F(ParameterRun, IsSetOfAControllerThatIsNotActiveToo) {
  ASSERT_TRUE(services().switch_controllers({"tuned"}, {}, kNow));
  steps(50);
  ASSERT_TRUE(set({{"tuned", "share", 0.25}}));
  steps(50);
  EXPECT_EQ(value("share"), 0.25);
  EXPECT_EQ(tuned->changes, 0);
  ASSERT_TRUE(services().switch_controllers({}, {"tuned"}, kNow));
  steps(2);
  EXPECT_EQ(tuned->changes, 1) << "its first update() after it";
}

TEST_F(ParameterRun, IsWithdrawnWithAStopOfTheSameCycle) {
  ASSERT_TRUE(set({{"tuned", "share", 0.25}}));
  cycle->inbox().emergency_stop(hal::StopCategory::kCategory1);
  steps(2);
  EXPECT_EQ(value("share"), 1.0);
}

TEST_F(ParameterRun, IsRefusedWhenTooManyWaitAndThoseAreSetInTheirOrder) {
  for (std::size_t i = 1; i <= Inbox::kCapacity; ++i)
    ASSERT_TRUE(set({{"tuned", "share", 1.0 / static_cast<double>(i)}})) << i;
  const auto asked = set({{"tuned", "share", 0.9}});
  ASSERT_FALSE(asked);
  EXPECT_EQ(asked.error().message, "the loop has not come to the last 16 requests");
  steps(1);
  EXPECT_EQ(value("share"), 1.0 / static_cast<double>(Inbox::kCapacity));
  EXPECT_EQ(tuned->changes, 1) << "one cycle";
  EXPECT_TRUE(set({{"tuned", "share", 0.9}}));
}

TEST_F(ParameterRun, GoesWithItsControllerWhenThatIsUnloaded) {
  ASSERT_TRUE(services().switch_controllers({"tuned"}, {}, kNow));
  steps(1);
  ASSERT_TRUE(set({{"tuned", "share", 0.25}}));
  ASSERT_TRUE(services().unload("tuned", kNow));  // asked for behind it
  EXPECT_FALSE(set({{"tuned", "share", 0.5}}));
  steps(2);
  EXPECT_FALSE(services().parameters("tuned"));
}

TEST_F(ParameterRun, IsPartOfASnapshotWhetherItIsSetBeforeOrAfter) {
  ASSERT_TRUE(set({{"tuned", "offset_rad", 0.05}}));
  steps(20);
  const auto snapshot = cycle->save();
  ASSERT_TRUE(snapshot) << snapshot.error().to_string();
  const auto first = references(200);
  ASSERT_TRUE(set({{"tuned", "offset_rad", -0.1}}));
  const auto other = references(200);
  ASSERT_TRUE(cycle->restore(*snapshot));
  EXPECT_EQ(value("offset_rad"), 0.05);
  EXPECT_EQ(references(200), first);
  ASSERT_TRUE(set({{"tuned", "offset_rad", -0.1}}));
  EXPECT_EQ(references(200), other);

  ASSERT_TRUE(set({{"tuned", "share", 0.125}}));
  const auto waits = cycle->save();
  ASSERT_TRUE(waits);
  const int seen = tuned->changes;
  steps(1);
  EXPECT_EQ(tuned->changes, seen + 1) << "what is asked for is no part of it";
}

TEST(ParameterLog, HasTheNameTheCycleAndEveryBitOfTheValue) {
  const log::ScratchFolder folder;
  const std::string path = folder / "set.mcap";
  auto file = log::Recorder::open(path, {.joints = {"swing"}}, {});
  ASSERT_TRUE(file);
  test::SwingLoop run;
  run.recorder = file->get();
  run.add("tu.ned", std::make_shared<Tuned>());
  run.begin({.settle_cycles = 200});
  run.run_to(RunPhase::kRunning);
  const double values[]{0.1 + 0.05, -0.0, 5e-324, 0.2, 1.0 / 7.0};
  std::vector<std::uint64_t> cycles;
  for (const double value : values) {
    ASSERT_TRUE(run.services().set_parameters(
        {{"tu.ned", "offset_rad", value}, {"tu.ned", "word", "there"}}, kNow));
    run.steps(3);
    cycles.push_back(run.cycle->state().cycle()[0] - 2);
  }
  EXPECT_EQ((*file)->close().dropped, 0U);
  std::size_t found = 0;
  const auto log = log::LogFile::open(path);
  ASSERT_TRUE(log);
  const auto events = log->events();
  ASSERT_TRUE(events);
  for (const log::EventText& event : *events) {
    if (event.event.kind != log::EventKind::kParameterSet) continue;
    const auto set = log::parameter_of(event.text);
    ASSERT_TRUE(set) << event.text;
    const bool first = found % 2 == 0;
    EXPECT_EQ(set->name, first ? "tu.ned.offset_rad" : "tu.ned.word");
    ASSERT_LT(found / 2, std::size(values));
    if (first) {
      EXPECT_EQ(std::bit_cast<std::uint64_t>(set->value),
                std::bit_cast<std::uint64_t>(values[found / 2]));
    } else {
      EXPECT_EQ(set->word, "there") << "it was its index, 1";
    }
    EXPECT_EQ(event.event.cycle, cycles[found / 2]);
    ++found;
  }
  EXPECT_EQ(found, 2 * std::size(values));
}

/// Joined by blanks what the log says of parameters that came, and those that were set.
std::string told(const std::string& path) {
  const auto log = log::LogFile::open(path);
  const auto events = log->events();
  std::string all;
  for (const log::EventText& event : *events) {
    const bool loaded = event.event.kind == log::EventKind::kParameterLoaded;
    if (!loaded && event.event.kind != log::EventKind::kParameterSet) continue;
    const auto it = log::parameter_of(event.text);
    EXPECT_TRUE(it) << event.text;
    if (!it) continue;
    all += (all.empty() ? "" : " ") +
           ((loaded ? "+" : "~") + it->name + "=" +
            (it->word.empty() ? std::to_string(it->value).substr(0, 4) : it->word));
  }
  return all;
}

TEST(ParameterLog, HasWhatAControllerThatComesLaterStartsWith) {
  const log::ScratchFolder folder;
  const std::string path = folder / "load.mcap";
  auto file = log::Recorder::open(path, {.joints = {"swing"}}, {});
  ASSERT_TRUE(file);
  test::SwingLoop run;
  run.recorder = file->get();
  run.add("tuned", std::make_shared<Tuned>());
  run.begin({.settle_cycles = 200});
  run.run_to(RunPhase::kRunning);
  const auto parameters = TomlDocument::parse("share = 0.5\ngains = [1, 2, 3]", "p.toml");
  ASSERT_TRUE(run.services().load("later", std::make_shared<Tuned>(), *parameters, kNow));
  run.steps(3);
  ASSERT_TRUE(run.services().set_parameters({{"later", "gains.y", 4}}, kNow));
  run.steps(3);
  EXPECT_EQ((*file)->close().dropped, 0U);
  EXPECT_EQ(told(path),
            "+later.offset_rad=0.00 +later.share=0.50 +later.word=here +later.count=3.00 "
            "+later.on=true +later.length_m=0.50 +later.gains.x=1.00 +later.gains.y=2.00 "
            "+later.gains.z.0=3.00 ~later.gains.y=4.00");
}

/// Declares two lists of 20 numbers.
struct Many : Tuned {
  Status configure(ControllerSetup& setup) override {
    std::vector<std::string> names;
    for (int i = 0; i < 20; ++i) names.push_back(std::to_string(i));
    for (const char* name : {"a", "b"})
      (void)setup.list_parameters(name, names, {{.otherwise = 1, .live = true}});
    return {};
  }
};

TEST(ParameterLog, HasNotMoreOfThemInACycleThanItsRingHasRoomFor) {
  const log::ScratchFolder folder;
  const std::string path = folder / "many.mcap";
  auto file = log::Recorder::open(path, {.joints = {"swing"}}, {});
  ASSERT_TRUE(file);
  test::SwingLoop run;
  run.recorder = file->get();
  run.add("tuned", std::make_shared<Tuned>());
  run.begin({.settle_cycles = 200});
  run.run_to(RunPhase::kRunning);
  const auto parameters = TomlDocument::parse("", "p.toml");
  ASSERT_TRUE(run.services().load("many", std::make_shared<Many>(), *parameters, kNow));
  run.steps(1);
  // What is set before it is told has that event alone: the last one says what is in force.
  ASSERT_TRUE(run.services().set_parameters({{"many", "b.19", 2}}, kNow));
  run.steps(5);
  EXPECT_EQ((*file)->close().dropped, 0U);
  std::map<std::uint64_t, std::size_t> by_cycle;
  const auto log = log::LogFile::open(path);
  const auto events = log->events();
  for (const log::EventText& event : *events) {
    if (event.event.kind == log::EventKind::kParameterLoaded) ++by_cycle[event.event.cycle];
  }
  std::vector<std::size_t> counts;
  for (const auto& [cycle, count] : by_cycle) counts.push_back(count);
  EXPECT_EQ(counts, (std::vector<std::size_t>{16, 16, 7}));
  EXPECT_NE(told(path).find("~many.b.19=2"), std::string::npos);
  EXPECT_EQ(told(path).find("+many.b.19="), std::string::npos);
}

}  // namespace
}  // namespace tandem::runtime
