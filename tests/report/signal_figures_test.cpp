// The figures of what controllers told: which there are, and what is in them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include "hal/signal_block.hpp"
#include "log/recorder.hpp"
#include "report/gnuplot.hpp"
#include "report/run_figures.hpp"
#include "tests/log/scratch_folder.hpp"

namespace tandem::report {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr int kSamples = 50;

/// A log of some controllers' signals, and its figures.
class SignalFigures : public testing::Test {
 protected:
  SignalFigures() {
    run_.path = folder_ / "run.mcap";
    run_.info.joints = {"shoulder", "elbow"};
    auto opened = log::Recorder::open(run_.path, run_.info, {});
    EXPECT_TRUE(opened) << opened.error().to_string();
    recorder_ = std::move(*opened);
    recorder_->start();
  }
  /// @param write  what the k-th sample has
  template <class Write>
  void log_of(const std::string& controller, hal::SignalBlock& block, const Write& write) {
    ASSERT_TRUE(block.close());
    const auto channel = recorder_->add_late_channel(
        "/tandem/controller/" + controller, "tandem/msg/Signals" + std::to_string(++types_),
        recorder_->ros2msg_of(block.layout()));
    for (int k = 0; k < kSamples; ++k) {
      write(k);
      block.publish(static_cast<std::uint64_t>(k), 1'000'000 * k);
      ASSERT_TRUE(recorder_->push(channel, 1'000'000 * k, block.image()));
    }
  }
  std::vector<Figure> figures() {
    (void)recorder_->close();
    auto made = signal_figures(run_, remarks_);
    EXPECT_TRUE(made) << made.error().to_string();
    return made ? std::move(*made) : std::vector<Figure>();
  }
  static std::vector<std::string> labels(const Figure& figure) {
    std::vector<std::string> all;
    for (const Curve& curve : figure.curves) all.push_back(curve.label);
    return all;
  }

  const log::ScratchFolder folder_;
  RunData run_;
  std::unique_ptr<log::Recorder> recorder_;
  std::vector<std::string> remarks_;
  int types_ = 0;
};

TEST_F(SignalFigures, HaveAPictureForEachSignalOfEachController) {
  hal::SignalBlock gait, arm;
  double* const depth = gait.declare("depth", "m", "of the crouch", 1);
  double* const count = gait.declare("count", "", "updates so far", 1);
  double* const error = arm.declare("error", "rad", "reference less position", 2, true);
  log_of("gait", gait, [&](int k) { *depth = 0.01 * k, *count = k; });
  log_of("arm", arm, [&](int k) { error[0] = k, error[1] = -k; });
  const auto all = figures();
  ASSERT_EQ(all.size(), 3U);
  EXPECT_EQ(all[0].name, "signal_gait-depth");
  EXPECT_EQ(all[0].title, "gait.depth: of the crouch");
  EXPECT_EQ(all[0].y_label, "depth [m]");
  EXPECT_EQ(all[0].x_label, "time since the first SYNC [s]");
  EXPECT_EQ(labels(all[0]), std::vector<std::string>{""}) << "one curve needs no legend";
  ASSERT_EQ(all[0].curves[0].y.size(), static_cast<std::size_t>(kSamples));
  EXPECT_EQ(all[0].curves[0].y.back(), 0.49);
  EXPECT_EQ(all[0].curves[0].x.back(), 0.049);
  EXPECT_EQ(all[1].y_label, "count") << "it has no unit";
  EXPECT_EQ(labels(all[2]), (std::vector<std::string>{"error.shoulder", "error.elbow"}));
  EXPECT_NE(all[2].curves[0].style, all[2].curves[1].style);
  const std::string pictures = folder_ / "report";
  std::filesystem::create_directory(pictures);
  ASSERT_TRUE(draw(all, pictures));
  for (const Figure& figure : all) {
    for (const char* ending : {".svg", ".png"})
      EXPECT_TRUE(std::filesystem::exists(pictures + "/" + figure.name + ending)) << figure.name;
  }
  const std::string svg = log::content(pictures + "/signal_arm-error.svg");
  EXPECT_NE(svg.find("error.elbow"), std::string::npos) << "the legend is in the picture";
}

TEST_F(SignalFigures, OfTwoControllersAreNotTakenForOneAnother) {
  hal::SignalBlock one, other;
  double* const first = one.declare("b_c", "m", "", 1);
  double* const second = other.declare("c", "m", "", 1);
  log_of("a", one, [&](int k) { *first = k; });
  log_of("a_b", other, [&](int k) { *second = -k; });
  const auto all = figures();
  ASSERT_EQ(all.size(), 2U);
  EXPECT_NE(all[0].name, all[1].name) << "it is a file's";
}

TEST_F(SignalFigures, ShowWhatIsANumber) {
  hal::SignalBlock gait;
  double* const never = gait.declare("never", "m", "", 1);
  double* const late = gait.declare("late", "m", "", 1);
  double* const some = gait.declare("some", "m", "", 3);
  double* const endless = gait.declare("endless", "m", "", 1);
  log_of("gait", gait, [&](int k) {
    *never = kNaN;
    if (k >= 10) *late = k == 20 ? kNaN : 1.0 + k;
    some[0] = k;
    some[2] = 2.0 * k;
    *endless = k == 5 ? std::numeric_limits<double>::infinity() : 0.5 * k;
  });
  const auto all = figures();
  ASSERT_EQ(all.size(), 3U);
  EXPECT_EQ(all[0].name, "signal_gait-late");
  const std::vector<double>& y = all[0].curves[0].y;
  EXPECT_TRUE(std::isnan(y[9]) && std::isnan(y[20])) << "its line has gaps";
  EXPECT_EQ(y[10], 11.0);
  EXPECT_EQ(labels(all[1]), (std::vector<std::string>{"some.2", "some.0"}));
  const std::string pictures = folder_ / "report";
  std::filesystem::create_directory(pictures);
  const Status drawn = draw(all, pictures);
  EXPECT_TRUE(drawn) << drawn.error().to_string();
}

TEST_F(SignalFigures, OfAConstantAreDrawn) {
  hal::SignalBlock gait;
  double* const zero = gait.declare("zero", "m", "", 1);
  double* const small = gait.declare("small", "m", "", 2);
  log_of("gait", gait, [&](int) { *zero = 0.0, small[0] = 1e-300, small[1] = 1e300; });
  const auto all = figures();
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[1].curves.size(), 2U);
  const std::string pictures = folder_ / "report";
  std::filesystem::create_directory(pictures);
  const Status drawn = draw(all, pictures);
  ASSERT_TRUE(drawn) << drawn.error().to_string();
  EXPECT_TRUE(std::filesystem::exists(pictures + "/signal_gait-zero.svg"));
}

TEST_F(SignalFigures, OfManyNumbersShowTheLargestChanges) {
  hal::SignalBlock gait;
  double* const place = gait.declare("place", "m", "of all", 9);
  log_of("gait", gait, [&](int k) {
    for (int i = 0; i < 9; ++i) place[i] = (i % 3 == 0 ? 0.001 : 1.0) * k;
    place[4] = 1e6;  // large, and it does not change
  });
  const auto all = figures();
  ASSERT_EQ(all.size(), 1U);
  EXPECT_EQ(all[0].title, "gait.place: of all (the largest changes)");
  EXPECT_EQ(labels(all[0]), (std::vector<std::string>{"place.1", "place.2", "place.5", "place.7",
                                                      "place.8", "place.0"}));
  EXPECT_EQ(all[0].curves.back().style, CurveStyle::kStill) << "it changes by a thousandth of them";
}

// A joint that stood still was bold, and the one that moved a thin dashed line.
TEST_F(SignalFigures, DrawTheJointThatMovesInAFullLine) {
  run_.info.joints = {"hip", "knee", "ankle", "toe", "wrist", "neck"};
  hal::SignalBlock gait;
  double* const error = gait.declare("error", "rad", "reference less position", 6, true);
  log_of("gait", gait, [&](int k) {
    for (int j = 0; j < 6; ++j) error[j] = 0.1 * j;
    error[3] = std::sin(0.2 * k);
  });
  const auto all = figures();
  ASSERT_EQ(all.size(), 1U);
  ASSERT_EQ(all[0].curves.size(), 6U);
  EXPECT_EQ(all[0].curves[0].label, "error.toe");
  EXPECT_EQ(all[0].curves[0].style, CurveStyle::kMeasured);
  for (std::size_t k = 1; k < 6; ++k)
    EXPECT_EQ(all[0].curves[k].style, CurveStyle::kStill) << all[0].curves[k].label;
  const std::string pictures = folder_ / "report";
  std::filesystem::create_directory(pictures);
  ASSERT_TRUE(draw(all, pictures));
}

TEST_F(SignalFigures, BeyondTwelveAreARemark) {
  hal::SignalBlock gait;
  std::vector<double*> many;
  for (int i = 0; i < 20; ++i) many.push_back(gait.declare("s" + std::to_string(i), "", "", 1));
  log_of("gait", gait, [&](int k) {
    for (double* one : many) *one = k;
  });
  EXPECT_EQ(figures().size(), 12U);
  ASSERT_EQ(remarks_.size(), 1U);
  EXPECT_TRUE(remarks_[0].starts_with("8 more signals")) << remarks_[0];
}

/// Beside the signals are the marks, and a channel without a sample.
TEST_F(SignalFigures, AreOfSignalsAlone) {
  hal::SignalBlock gait, idle;
  double* const depth = gait.declare("depth", "m", "", 1);
  (void)idle.declare("depth", "m", "", 1);
  log_of("gait", gait, [&](int k) { *depth = k; });
  ASSERT_TRUE(idle.close());
  (void)recorder_->add_late_channel("/tandem/controller/idle", "tandem/msg/SignalsIdle",
                                    recorder_->ros2msg_of(idle.layout()));
  const auto marks = recorder_->add_late_channel("/tandem/controller/gait/marks",
                                                 "std_msgs/msg/Float64", "float64 data\n");
  const double data = 0.0;
  for (int k = 0; k < kSamples; ++k)
    ASSERT_TRUE(recorder_->push(marks, 1'000'000 * k, std::as_bytes(std::span(&data, 1))));
  EXPECT_EQ(figures().size(), 1U);
}

}  // namespace
}  // namespace tandem::report
