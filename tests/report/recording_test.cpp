// Logs as the page has them: which signals, and what a page cannot be made to do by their names.
#include "report/recording.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "apps/text/console.hpp"
#include "hal/signal_block.hpp"
#include "log/recorder.hpp"
#include "report/differences.hpp"
#include "report/page.hpp"
#include "report/recorded_page.hpp"
#include "report/report.hpp"
#include "tests/log/scratch_folder.hpp"
#include "tests/report/unpacked.hpp"

namespace tandem::report {
namespace {

const std::string kHostile = "</script><script>alert(1)</script><!-- \u2028 \" ' & \\";

/// A log of two joints and a controller, and what is recorded of it.
class Recorded : public testing::Test {
 protected:
  std::string make_log(const std::string& name, std::size_t cycles, double offset = 0.0) const {
    const std::string path = folder_ / name;
    log::RunInfo info;
    info.robot = "pair";
    info.hal = "sim";
    info.joints = {"shoulder", kHostile};
    info.period_ns = 1'000'000;
    auto recorder = *log::Recorder::open(path, info, {.ring_slots = 8192});
    hal::StateImage state({.joints = 2, .sensor_channels = {}});
    hal::SignalBlock block;
    double* const depth = block.declare("depth", "m", "of " + kHostile, 1);
    EXPECT_TRUE(block.close());
    const auto channel = recorder->add_channel("/tandem/state", "tandem/msg/State", state.layout());
    const auto signals =
        recorder->add_channel("/tandem/controller/squat", "tandem/msg/Squat", block.layout());
    recorder->start();
    for (std::size_t i = 0; i < cycles; ++i) {
      const auto time_ns = static_cast<std::int64_t>(1'000'000 * i);
      state.position_rad()[0] = offset + std::sin(0.7 * static_cast<double>(i));
      state.position_rad()[1] = i == 7 ? NAN : 1.0;
      state.mode()[0] = static_cast<std::int8_t>(i / 4);
      EXPECT_TRUE(recorder->push(channel, time_ns, state.bytes()));
      *depth = 0.5;
      block.publish(i, time_ns);
      EXPECT_TRUE(recorder->push(signals, time_ns, block.image()));
    }
    (void)recorder->close();
    return path;
  }
  static studio::RunDescription pair() {
    studio::RunDescription run;
    run.robot.name = kHostile;
    run.urdf = "<robot name='pair'>" + kHostile + "</robot>";
    run.experiment = kHostile;
    return run;
  }
  const log::ScratchFolder folder_;
};

TEST_F(Recorded, HasTheSignalsOfARunWithTheirNumbers) {
  const auto file = log::LogFile::open(make_log("a.mcap", 40));
  ASSERT_TRUE(file);
  const auto recording = Recording::read({.run = pair(), .logs = {{.file = &*file}}});
  ASSERT_TRUE(recording) << recording.error().to_string();
  const auto json = apps::Json::parse(recording->text(kMostReportBytes).json);
  EXPECT_EQ(json["grid"]["rows"], 40);
  EXPECT_EQ(json["grid"]["cycles"], 1);
  std::map<std::string, std::size_t> ids;
  for (const auto& source : json["signals"]["sources"]) {
    std::size_t id = source["first"];
    for (const auto& field : source["fields"]) {
      for (std::size_t i = 0; i < field["count"]; ++i) {
        const std::string element = field["elements"].is_null() ? "" : field["elements"][i];
        ids[source["name"].get<std::string>() + "." + field["name"].get<std::string>() + "." +
            element] = id++;
      }
    }
  }
  Packed packed{.grid = {.rows = 40}, .signals = {}, .bytes = json["data"]};
  for (const auto& code : json["codes"]) {
    if (code.is_array()) {
      packed.signals.emplace_back(Codes{code[0], code[1], code[2]});
    } else {
      packed.signals.emplace_back(code.is_null() ? NAN : code.get<double>());
    }
  }
  const auto all = unpacked(packed);
  ASSERT_EQ(all.size(), packed.signals.size());
  const auto& position = all.at(ids.at("state.position_rad.shoulder")).least;
  for (std::size_t i = 0; i < 40; ++i)
    EXPECT_NEAR(position.at(i), std::sin(0.7 * double(i)), 2.0 / 65534);
  EXPECT_TRUE(std::isnan(all.at(ids.at("state.position_rad." + kHostile)).least.at(7)));
  EXPECT_EQ(all.at(ids.at("state.mode.shoulder")).least.at(39), 9.0);
  EXPECT_EQ(all.at(ids.at("controller/squat.depth.")).least.at(5), 0.5);
}

TEST_F(Recorded, HasFewerRowsWhereItMustBeSmall) {
  const auto file = log::LogFile::open(make_log("a.mcap", 1500));
  ASSERT_TRUE(file);
  const auto recording = Recording::read({.run = pair(), .logs = {{.file = &*file}}});
  ASSERT_TRUE(recording);
  const Recording::Text whole = recording->text(kMostReportBytes);
  EXPECT_EQ(whole.grid.rows, 1500U);
  const Recording::Text small = recording->text(whole.json.size() - 100);
  EXPECT_LT(small.json.size(), whole.json.size() - 100);
  EXPECT_LT(small.grid.rows, 1500U);
  EXPECT_GE(small.grid.rows * small.grid.cycles, 1500U) << "all of the time is there";
}

TEST_F(Recorded, OfSeveralLogsHasTheSecondBesideTheFirst) {
  const auto a = log::LogFile::open(make_log("a.mcap", 40));
  const auto b = log::LogFile::open(make_log("b.mcap", 40, 5.0));
  ASSERT_TRUE(a && b);
  const auto recording = Recording::read(
      {.run = pair(), .logs = {{.file = &*a}, {.file = &*b, .prefix = "B/", .later_s = 0.0102}}});
  ASSERT_TRUE(recording);
  const auto json = apps::Json::parse(recording->text(kMostReportBytes).json);
  EXPECT_EQ(json["grid"]["rows"], 50) << "from the first one's start to the second one's end";
  std::vector<std::string> names;
  for (const auto& source : json["signals"]["sources"]) names.push_back(source["name"]);
  EXPECT_EQ(names, (std::vector<std::string>{"state", "controller/squat", "B/state",
                                             "B/controller/squat"}));
}

// The second log's curve was drawn as one more signal of the first.
TEST_F(Recorded, OfSeveralLogsAFigureIsASourceOfEach) {
  const auto a = log::LogFile::open(make_log("a.mcap", 40));
  const auto b = log::LogFile::open(make_log("b.mcap", 40, 5.0));
  ASSERT_TRUE(a && b);
  Figure figure{
      .name = "joint_position", .title = "joint", .x_label = "t [s]", .y_label = "q [deg]"};
  const std::vector<double> x{0.0, 0.01, 0.02};
  figure.curves = {{"measured", CurveStyle::kMeasured, x, {1.0, 2.0, 3.0}, 'A'},
                   {"measured", CurveStyle::kSecond, x, {4.0, 5.0, 6.0}, 'B'},
                   {"reference", CurveStyle::kReference, x, {7.0, 8.0, 9.0}, 'A'}};
  const auto recording = Recording::read(
      {.run = pair(), .logs = {{.file = &*a}, {.file = &*b, .prefix = "B/"}}, .figures = {figure}});
  ASSERT_TRUE(recording);
  const auto json = apps::Json::parse(recording->text(kMostReportBytes).json);
  EXPECT_EQ(json["figures"][0]["series"],
            (apps::Json{"report/joint_position.measured", "report/joint_position.reference",
                        "B/report/joint_position.measured"}));
  const auto& table = recording->table();
  for (const auto& [name, first] :
       {std::pair{"report/joint_position", 1.0F}, std::pair{"B/report/joint_position", 4.0F}}) {
    const auto source = std::ranges::find(table.sources(), name, &studio::Source::name);
    ASSERT_NE(source, table.sources().end()) << name;
    EXPECT_EQ(recording->spans().least(source->first)[0], first);
  }
  for (const PageTable& one : largest_differences(*recording))
    for (const auto& row : one.rows) EXPECT_FALSE(row[0].starts_with("report/")) << row[0];
}

TEST_F(Recorded, SaysThatALogHasNoNumbers) {
  const auto file = log::LogFile::open(make_log("empty.mcap", 0));
  ASSERT_TRUE(file);
  const auto recording = Recording::read({.run = pair(), .logs = {{.file = &*file}}});
  ASSERT_FALSE(recording);
  EXPECT_NE(recording.error().to_string().find("this log has no numbers"), std::string::npos);
}

TEST_F(Recorded, OfASingleCycleIsAPage) {
  const auto file = log::LogFile::open(make_log("one.mcap", 1));
  ASSERT_TRUE(file);
  const auto recording = Recording::read({.run = pair(), .logs = {{.file = &*file}}});
  ASSERT_TRUE(recording);
  EXPECT_EQ(recording->text(kMostReportBytes).grid.rows, 1U);
}

// A joint's name ended the element that it is in.
TEST_F(Recorded, LetsNoNameOutOfItsPlace) {
  if (!has_studio_page()) GTEST_SKIP() << "built without the studio's page";
  const auto file = log::LogFile::open(make_log("a.mcap", 40));
  ASSERT_TRUE(file);
  Figure figure{.name = "depth", .title = kHostile, .x_label = "time [s]", .y_label = "m [m]"};
  figure.curves = {{kHostile, CurveStyle::kMeasured, {0.0, 0.01}, {1.0, 2.0}}};
  const auto recording =
      Recording::read({.run = pair(), .logs = {{.file = &*file}}, .figures = {figure}});
  ASSERT_TRUE(recording);
  const std::string json = recording->text(kMostReportBytes).json;
  EXPECT_EQ(json.find('<'), std::string::npos);
  EXPECT_EQ(apps::Json::parse(json)["figures"][0]["title"], kHostile);
  Page page{.title = kHostile, .lead = kHostile, .facts = {{kHostile, kHostile}}, .tables = {}};
  const auto html = recorded_page(page, {}, folder_ / ".", *recording);
  ASSERT_TRUE(html);
  EXPECT_LT(html->size(), kMostReportBytes);
  EXPECT_EQ(html->find("<script>alert"), std::string::npos);
  std::size_t ends = 0;
  for (std::size_t at = 0; (at = html->find("</script", at)) != std::string::npos; ++at) ++ends;
  EXPECT_EQ(ends, 2U) << "the recording's and the page's own";
  EXPECT_EQ(html->find(" src="), html->find(" src=x")) << "nothing is loaded";
}

// It was an error that said what the log lacks, and nothing was to be seen.
TEST_F(Recorded, OfALogWithoutItsRobotsFilesHasThePageAndSaysWhatItLacks) {
  const auto none = [](const RunData&) { return nullptr; };
  const auto report = read_any(make_log("a.mcap", 40), {}, none);
  if (!has_studio_page()) {
    EXPECT_FALSE(report);
    return;
  }
  ASSERT_TRUE(report) << report.error().to_string();
  const auto files = make_report(folder_ / "a.mcap", {}, folder_ / "out", none);
  ASSERT_TRUE(files) << files.error().to_string();
  EXPECT_TRUE(files->images.empty());
  ASSERT_EQ(files->remarks.size(), 1U);
  EXPECT_NE(files->remarks[0].find("does not carry its robot's configuration"), std::string::npos);
  const std::string page = log::content(files->page);
  EXPECT_NE(page.find("Its numbers and events alone"), std::string::npos);
  EXPECT_NE(page.find("\"name\":\"controller/squat\""), std::string::npos);
  EXPECT_FALSE(read_any(make_log("empty.mcap", 0), {}, none)) << "it has no number either";
}

TEST_F(Recorded, GivesWindowsAtTheGrainOfTheLog) {
  const auto file = log::LogFile::open(make_log("a.mcap", 1500));
  ASSERT_TRUE(file);
  const auto recording =
      Recording::read({.run = pair(), .logs = {{.file = &*file}}, .most = kServedRows});
  ASSERT_TRUE(recording);
  const auto of = [&](const std::string& name) {
    std::size_t id = 0;
    while (id < recording->table().size() &&
           recording->table().name(static_cast<studio::SignalId>(id)) != name)
      ++id;
    return id;
  };
  const auto number = [](const std::string& frame, std::size_t i) {
    float value = NAN;
    std::memcpy(&value, frame.data() + 32 + 4 * i, sizeof value);
    return value;
  };
  const std::size_t shoulder = of("state.position_rad.shoulder");
  const std::string fine = recording->window({shoulder, 1U << 20U}, 0.7, 0.709, 100);
  ASSERT_EQ(fine.size(), 32U + 2 * 4 * 11) << "two signals of one number a row";
  EXPECT_FLOAT_EQ(number(fine, 3), static_cast<float>(std::sin(0.7 * 703)));
  EXPECT_TRUE(std::isnan(number(fine, 11))) << "there is no such signal";
  const std::string coarse = recording->window({shoulder}, 0.0, 2.0, 10);
  EXPECT_EQ(coarse.size(), 32U + 2 * 4 * 20);
  double least = 1.0, largest = -1.0;
  for (int i = 0; i < 75; ++i) {
    least = std::min(least, std::sin(0.7 * i));
    largest = std::max(largest, std::sin(0.7 * i));
  }
  EXPECT_FLOAT_EQ(number(coarse, 0), static_cast<float>(least));
  EXPECT_FLOAT_EQ(number(coarse, 1), static_cast<float>(largest));
  EXPECT_EQ(recording->window({shoulder}, 5.0, 4.0, 10).size(), 32U);
}

TEST_F(Recorded, HasTheGroundAsAGridOfHeights) {
  const auto file = log::LogFile::open(make_log("a.mcap", 40));
  ASSERT_TRUE(file);
  studio::RunDescription run = pair();
  hal::ContactConfig& contact = run.robot.contact;
  contact.stiffness_N_m = 1e4;
  contact.height_m = 0.5;
  const auto ground = [&] {
    const auto recording = Recording::read({.run = run, .logs = {{.file = &*file}}});
    EXPECT_TRUE(recording);
    return apps::Json::parse(recording->text(kMostReportBytes).json)["hello"]["ground"];
  };
  EXPECT_EQ(ground(), apps::Json({{"height_m", 0.5}})) << "it is level";
  contact.terrain.add(hal::GroundShape{.name = "slope", .slope_rad = 0.1});
  contact.patches.push_back({.name = "ice", .x_m = {0, 1}, .y_m = {0, 1}});
  const apps::Json sloped = ground();
  EXPECT_EQ(sloped["terrain"]["x_m"], apps::Json({-10.0, 10.0})) << "a plane needs no more";
  const double end = std::round(1e5 * 10.0 * std::tan(0.1)) / 1e5;
  EXPECT_EQ(sloped["terrain"]["height_m"], apps::Json({-end, end, -end, end}));
  EXPECT_EQ(sloped["terrain"]["coarser"], false);
  EXPECT_EQ(sloped["patches"][0]["name"], "ice");
}

TEST_F(Recorded, HasDifferencesInTheUnitOfTheJointsKind) {
  const auto a = log::LogFile::open(make_log("a.mcap", 40));
  const auto b = log::LogFile::open(make_log("b.mcap", 40, 5.0));
  ASSERT_TRUE(a && b);
  for (const auto& [slides, unit] : {std::pair{false, "rad"}, std::pair{true, "m"}}) {
    studio::RunDescription run = pair();
    run.robot.joints.resize(2);
    run.robot.joints[0].name = "shoulder";
    run.robot.joints[0].slides = slides;
    run.robot.joints[1].slides = !slides;
    const auto recording =
        Recording::read({.run = run, .logs = {{.file = &*a}, {.file = &*b, .prefix = "B/"}}});
    ASSERT_TRUE(recording);
    const auto tables = largest_differences(*recording);
    ASSERT_EQ(tables.size(), 1U);
    EXPECT_EQ(tables[0].rows[0][2], unit);
  }
}

TEST_F(Recorded, SaysWhereTwoLogsPart) {
  const std::string first = make_log("a.mcap", 40), second = make_log("b.mcap", 40, 5.0);
  const auto a = log::LogFile::open(first), b = log::LogFile::open(second);
  ASSERT_TRUE(a && b);
  const auto recording =
      Recording::read({.run = pair(), .logs = {{.file = &*a}, {.file = &*b, .prefix = "B/"}}});
  ASSERT_TRUE(recording);
  const auto tables = largest_differences(*recording);
  ASSERT_EQ(tables.size(), 1U);
  ASSERT_EQ(tables[0].rows.size(), 1U) << "the others are the same";
  EXPECT_EQ(tables[0].rows[0][0], "state.position_rad.shoulder");
  EXPECT_EQ(tables[0].rows[0][1], "5");
  EXPECT_EQ(tables[0].rows[0][2], "rad or m") << "nobody has said what kind its joints are of";
  const auto table = first_differences(first, second, 'B');
  ASSERT_TRUE(table);
  ASSERT_EQ(table->rows.size(), 2U);
  EXPECT_EQ(table->rows[0][3], "position_rad.shoulder");
  EXPECT_EQ(table->rows[1][3], "the same");
}

}  // namespace
}  // namespace tandem::report
