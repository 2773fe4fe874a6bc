// Figures as pictures and as a page, with gnuplot as it is installed.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

#include "report/alarm_figures.hpp"
#include "report/gnuplot.hpp"
#include "report/page.hpp"

namespace tandem::report {
namespace {

namespace fs = std::filesystem;

/// A folder of its own for each test, removed at the end.
class Drawing : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(TANDEM_BINARY_DIR) / "test_report" / info->name();
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  [[nodiscard]] std::string read(const std::string& name) const {
    std::ifstream in(folder_ / name, std::ios::binary);
    std::ostringstream text;
    text << in.rdbuf();
    return text.str();
  }
  fs::path folder_;
};

Figure ramp(const std::string& name) {
  Curve curve{"measured", CurveStyle::kMeasured, {}, {}};
  for (int i = 0; i <= 100; ++i) {
    curve.x.push_back(0.01 * i);
    curve.y.push_back(0.5 * i);
  }
  Figure figure;
  figure.name = name;
  figure.title = "A \"ramp\" of joint_1";
  figure.x_label = "time [s]";
  figure.y_label = "position [deg]";
  figure.curves = {curve};
  figure.levels = {{"the limit", 40.0}};
  return figure;
}

TEST(Decimation, KeepsTheExtremesOfALongCurve) {
  Curve curve{"noise", CurveStyle::kMeasured, {}, {}};
  for (int i = 0; i < 10'000; ++i) {
    curve.x.push_back(i);
    curve.y.push_back(i == 4321 ? 100.0 : (i == 8765 ? -100.0 : 0.0));
  }
  const Curve small = decimated(curve, 500);
  EXPECT_LE(small.x.size(), 500U);
  EXPECT_EQ(*std::ranges::max_element(small.y), 100.0);
  EXPECT_EQ(*std::ranges::min_element(small.y), -100.0);
  EXPECT_TRUE(std::ranges::is_sorted(small.x));
}

TEST(Decimation, LeavesAShortCurveAsItIs) {
  const Curve curve{"short", CurveStyle::kMeasured, {0, 1, 2}, {5, 6, 7}};
  EXPECT_EQ(decimated(curve, 500).y, curve.y);
}

// There had been a straight line from the last sample to the next.
TEST(Gaps, EndALineWhereSamplesAreMissing) {
  Figure figure = ramp("gap");
  for (std::size_t i = 50; i < 101; ++i) figure.curves[0].x[i] += 0.045;
  break_at_gaps(figure);
  ASSERT_EQ(figure.curves[0].x.size(), 102U);
  EXPECT_TRUE(std::isnan(figure.curves[0].y[50]));
  break_at_gaps(figure = ramp("whole"));
  EXPECT_EQ(figure.curves[0].x.size(), 101U);
}

TEST(Decimation, KeepsGaps) {
  Curve curve{"gaps", CurveStyle::kMeasured, {}, {}};
  for (int i = 0; i < 10'000; ++i) {
    curve.x.push_back(i);
    curve.y.push_back(i == 3000 || i == 3005 || i >= 9000 ? std::nan("") : i);
  }
  const Curve small = decimated(curve, 500);
  EXPECT_LE(small.x.size(), 505U);
  EXPECT_EQ(std::ranges::count_if(small.y, [](double y) { return std::isnan(y); }), 3);
  for (std::size_t i = 1; i < small.x.size(); ++i) {
    const bool over = small.x[i - 1] < 3000 && small.x[i] > 3000;
    EXPECT_FALSE(over) << small.x[i - 1] << " is joined to " << small.x[i];
  }
  EXPECT_NEAR(*std::ranges::max_element(small.x), 9000, 1);
}

TEST(Script, BreaksALineWhereASampleIsMissing) {
  Figure figure = ramp("gap");
  figure.curves[0].y[1] = std::numeric_limits<double>::quiet_NaN();
  const std::string script = gnuplot_script({&figure, 1}, "/tmp");
  EXPECT_NE(script.find("0 0\n\n0.02 1\n"), std::string::npos);
  EXPECT_EQ(script.find("nan"), std::string::npos);
}

/// The numbers of `set Xtics nomirror (…)`, without that of "0".
std::vector<double> ticks_of(const std::string& script, const std::string& axis) {
  const std::string key = "set " + axis + "tics nomirror (";
  const std::size_t at = script.find(key) + key.size();
  std::istringstream list(script.substr(at, script.find(')', at) - at));
  std::vector<double> numbers;
  for (std::string one; std::getline(list, one, ',');)
    if (one.find('"') == std::string::npos) numbers.push_back(std::stod(one));
  return numbers;
}

// There had been one number on each axis, and factors with many alarms, or none, were missing.
TEST(Alarms, AreAllInThePictureBetweenReadableNumbers) {
  const AlarmCurve curve{"push", {12477, 6954, 1840, 818, 0}, {1, 1, 1, 2, 3}, {1, 1, 2, 3, NAN}};
  const std::vector<Figure> figures = alarm_figures("alarms", "Time", {&curve, 1});
  const std::vector<double> x = figures[0].curves[0].x;
  EXPECT_EQ(std::vector(x.begin(), x.end() - 1), std::vector<double>({12477, 6954, 1840, 818}));
  EXPECT_EQ(x.back(), figures[0].zero_x);
  EXPECT_LT(x.back(), 818 / 3.0);
  EXPECT_TRUE(std::isnan(figures[1].curves[0].y.back()));
  const std::string script = gnuplot_script({figures.data(), 1}, "/tmp");
  for (const char* axis : {"x", "y"}) {
    const std::vector<double> ticks = ticks_of(script, axis);
    EXPECT_GE(ticks.size(), 4U) << axis;
    EXPECT_LE(ticks.size(), 10U) << axis;
  }
  EXPECT_NE(script.find("(\"0\" "), std::string::npos);
}

TEST(Alarms, OfWhichNoneWasCountedAreDrawn) {
  const AlarmCurve curve{"push", {0, 0}, {1, 2}, {1, 2}};
  const std::vector<Figure> figures = alarm_figures("alarms", "Time", {&curve, 1});
  EXPECT_EQ(figures[0].curves[0].x, std::vector<double>(2, figures[0].zero_x));
  EXPECT_GT(figures[0].zero_x, 0.0);
}

TEST_F(Drawing, MakesSvgAndPngOfEachFigureAndAnOverview) {
  const std::vector<Figure> figures{ramp("one"), ramp("two"), ramp("three")};
  const Status drawn = draw(figures, folder_.string());
  ASSERT_TRUE(drawn.has_value()) << drawn.error().to_string();
  for (const std::string name : {"one", "two", "three"}) {
    EXPECT_NE(read(name + ".svg").find("joint_1"), std::string::npos);
    EXPECT_TRUE(read(name + ".png").starts_with("\x89PNG"));
  }
  EXPECT_TRUE(read("overview.png").starts_with("\x89PNG"));
  EXPECT_FALSE(fs::exists(folder_ / "gnuplot.err"));
}

/// The number behind `key` in the script.
double number_after(const std::string& script, const std::string& key) {
  const std::size_t at = script.find(key);
  EXPECT_NE(at, std::string::npos) << key;
  return at == std::string::npos ? NAN : std::stod(script.substr(at + key.size()));
}

TEST(Script, LeavesRoomForTheWidestNumberBesideTheLabel) {
  for (const double factor : {1.0, 1e-5, 1e5, -1e9}) {
    Figure figure = ramp("wide");
    for (double& y : figure.curves[0].y) y = factor * (1000.0 + y);
    figure.levels.clear();
    const std::string script = gnuplot_script({&figure, 1}, "/tmp");
    const double axis = 760.0 * number_after(script, "set lmargin at screen ");
    const double label = 760.0 * number_after(script, "\"position [deg]\" at screen ");
    const bool exponent = script.find("set format y '%g'") != std::string::npos;
    const std::size_t at = script.find("set format y '%.");
    ASSERT_TRUE(exponent || at != std::string::npos);
    const int decimals = exponent ? 0 : std::stoi(script.substr(at + 16));
    char widest[64];
    if (exponent) {
      std::snprintf(widest, sizeof widest, "-1.02e+12");
    } else {
      std::snprintf(widest, sizeof widest, "%.*f", decimals, factor * 1049.0);
    }
    EXPECT_GT(label, 0.5 * 13.0);
    EXPECT_GT(axis - label, 13.0 + 7.0 * static_cast<double>(std::strlen(widest))) << widest;
  }
}

TEST(Script, PutsTheKeyAboveTheAxesHoweverManyRowsItHas) {
  Figure figure = ramp("many");
  const double few = number_after(gnuplot_script({&figure, 1}, "/tmp"), "set tmargin at screen ");
  for (int i = 0; i < 8; ++i) {
    figure.curves.push_back(figure.curves[0]);
    figure.curves.back().label = "a_rather_long_name_of_a_sensor_" + std::to_string(i);
  }
  const std::string script = gnuplot_script({&figure, 1}, "/tmp");
  const int columns = static_cast<int>(number_after(script, " left top horizontal maxcols "));
  EXPECT_EQ(columns, 2);
  const double many = number_after(script, "set tmargin at screen ");
  EXPECT_GT(430.0 * (few - many), 4.0 * 13.0 * 1.2) << "ten texts in five rows, two in one";
}

TEST(Script, WhatFollowsAFaultDoesNotWidenTheRange) {
  Figure figure = ramp("fault");
  figure.levels.clear();
  figure.curves[0].y.back() = 1e6;
  figure.marks = {{"fault", 0.99}};
  figure.range_until_x = 0.98;
  const std::string script = gnuplot_script({&figure, 1}, "/tmp");
  EXPECT_LT(number_after(script.substr(script.find("set yrange")), ":"), 60.0);
  EXPECT_NE(script.find("set arrow from 0.99, graph 0 to 0.99, graph 1"), std::string::npos);
  EXPECT_NE(script.find("title \"fault\""), std::string::npos);
}

TEST_F(Drawing, RunsNothingOfWhatALogNames) {
  const std::string touched = (folder_ / "touched").string();
  for (const std::string& name :
       {"`touch " + touched + "`", "'; system('touch " + touched + "'); #",
        "\"; system(\"touch " + touched + "\"); #", "\\'`touch " + touched + "`",
        "EOD\nsystem('touch " + touched + "')\n", "@touch $(touch " + touched + ")",
        "a\nsystem \"touch " + touched + "\""}) {
    Figure figure = ramp("named");
    figure.title = figure.x_label = figure.y_label = figure.curves[0].label = name;
    figure.levels = {{name, 1.0}};
    figure.marks = {{name, 0.5}};
    figure.notes = {{name, 0.5, 0.5}};
    const Status drawn = draw({&figure, 1}, folder_.string());
    EXPECT_TRUE(drawn.has_value()) << name << ": " << drawn.error().to_string();
    EXPECT_FALSE(fs::exists(touched)) << name;
    EXPECT_TRUE(read("named.png").starts_with("\x89PNG")) << name;
    EXPECT_NE(read("named.svg").find("touch"), std::string::npos) << "it is drawn as it is";
  }
}

TEST_F(Drawing, AFolderThatLooksLikeAPipeIsAFolder) {
  const fs::path before = fs::current_path();
  fs::current_path(folder_);
  fs::create_directory("| touch touched; #");
  const std::vector<Figure> figures{ramp("one")};
  const Status drawn = draw(figures, "| touch touched; #");
  fs::current_path(before);
  EXPECT_TRUE(drawn.has_value()) << drawn.error().to_string();
  EXPECT_FALSE(fs::exists(folder_ / "touched"));
  EXPECT_TRUE(fs::exists(folder_ / "| touch touched; #" / "one.png"));
}

TEST_F(Drawing, SaysWhatToInstallWhenGnuplotIsMissing) {
  const std::string path = std::getenv("PATH");
  setenv("PATH", folder_.c_str(), 1);
  const std::vector<Figure> figures{ramp("one")};
  const Status drawn = draw(figures, folder_.string());
  setenv("PATH", path.c_str(), 1);
  ASSERT_FALSE(drawn.has_value());
  EXPECT_NE(drawn.error().to_string().find("gnuplot-nox"), std::string::npos);
}

TEST_F(Drawing, HandsOnWhatGnuplotComplainsAbout) {
  const std::vector<Figure> figures{ramp("no/such/folder")};
  const Status drawn = draw(figures, folder_.string());
  ASSERT_FALSE(drawn.has_value());
  EXPECT_NE(drawn.error().to_string().find("cannot open file"), std::string::npos)
      << drawn.error().to_string();
}

TEST_F(Drawing, PageNeedsNothingBesideIt) {
  const std::vector<Figure> figures{ramp("one"), ramp("two")};
  ASSERT_TRUE(draw(figures, folder_.string()).has_value());
  Page page;
  page.title = "coman <squat>";
  page.facts = {{"seed", "1"}};
  page.tables = {{"Tracking", "RMS", {"joint", "rms [deg]"}, {{"LKneeSag", "0.12"}}}};
  const Status written = write_page(page, figures, folder_.string());
  ASSERT_TRUE(written.has_value()) << written.error().to_string();
  const std::string html = read("report.html");
  EXPECT_NE(html.find("coman &lt;squat&gt;"), std::string::npos);
  EXPECT_NE(html.find("LKneeSag"), std::string::npos);
  EXPECT_NE(html.find("id=\"one_gnuplot_canvas\""), std::string::npos);
  EXPECT_NE(html.find("id=\"two_gnuplot_canvas\""), std::string::npos);
  for (const std::string reference : {"src=", "href=\"http", "<link", "<script", "@import"}) {
    EXPECT_EQ(html.find(reference), std::string::npos) << reference;
  }
}

}  // namespace
}  // namespace tandem::report
