// Figures as pictures and as a page, with gnuplot as it is installed.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

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
  figure.levels = {{"the limit", 40.0, false}};
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

TEST(Script, BreaksALineWhereASampleIsMissing) {
  Figure figure = ramp("gap");
  figure.curves[0].y[1] = std::numeric_limits<double>::quiet_NaN();
  const std::string script = gnuplot_script({&figure, 1}, "/tmp");
  EXPECT_NE(script.find("0 0\n\n0.02 1\n"), std::string::npos);
  EXPECT_EQ(script.find("nan"), std::string::npos);
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
