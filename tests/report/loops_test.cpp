// Figures of robots with closed loops and with followers.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "model/urdf.hpp"
#include "report/close_passive.hpp"
#include "report/logged_torque.hpp"
#include "report/posture.hpp"
#include "report/run_figures.hpp"
#include "tests/support/test_robot.hpp"

namespace tandem::report {
namespace {

/// The four-bar linkage whose crank turns at a constant rate, by plane geometry alone.
class TurningLinkage : public testing::Test {
 protected:
  static constexpr double kGround_m = 0.3, kCrank_m = 0.1, kCoupler_m = 0.28, kRocker_m = 0.2;
  static constexpr double kRate_rad_s = 2.0, kStep_s = 0.005;
  static constexpr int kRows = 601;

  struct Angles {  // of crank, coupler and rocker, from +x towards +z
    double crank, coupler, rocker;
  };
  /// The upper branch: the pin is where two circles meet.
  static Angles angles(double crank) {
    const double x = kGround_m - kCrank_m * std::cos(crank);
    const double z = -kCrank_m * std::sin(crank);
    const double d = std::hypot(x, z);
    const double to_rocker = std::atan2(z, x);
    const double at_crank =
        std::acos((kCoupler_m * kCoupler_m + d * d - kRocker_m * kRocker_m) / (2 * kCoupler_m * d));
    const double coupler = to_rocker + at_crank;
    return {crank, coupler,
            std::atan2(kCoupler_m * std::sin(coupler) - z, kCoupler_m * std::cos(coupler) - x)};
  }
  /// Kinetic and potential energy while the crank turns at kRate_rad_s, figures of the URDF.
  static double energy(double crank) {
    constexpr double kH = 1e-4;  // of the differences [rad]
    struct Bar {
      double mass_kg, inertia_kg_m2, com_m, x, z, angle;
    };
    const auto bars = [](double at) -> std::array<Bar, 3> {
      const Angles a = angles(at);
      return {Bar{0.2, 0.00017, 0.05, 0.0, 0.0, a.crank},
              Bar{0.4, 0.0026, 0.14, kCrank_m * std::cos(at), kCrank_m * std::sin(at), a.coupler},
              Bar{0.3, 0.001, 0.1, kGround_m, 0.0, a.rocker}};
    };
    const auto x = [](const Bar& b) { return b.x + b.com_m * std::cos(b.angle); };
    const auto z = [](const Bar& b) { return b.z + b.com_m * std::sin(b.angle); };
    const auto here = bars(crank), before = bars(crank - kH), after = bars(crank + kH);
    double sum = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      const double per_s = kRate_rad_s / (2.0 * kH);
      const double vx = (x(after[i]) - x(before[i])) * per_s;
      const double vz = (z(after[i]) - z(before[i])) * per_s;
      const double turned = std::remainder(after[i].angle - before[i].angle, 2 * M_PI) * per_s;
      sum += 0.5 * here[i].mass_kg * (vx * vx + vz * vz) +
             0.5 * here[i].inertia_kg_m2 * turned * turned + here[i].mass_kg * 9.81 * z(here[i]);
    }
    return sum;
  }

  TurningLinkage() : robot(test::load_test_robot("four_bar")) {
    run.robot = robot.robot;
    run.tree = model::read_urdf(TANDEM_SOURCE_DIR "/config/four_bar/four_bar.urdf", {})->tree;
    run.step_s = kStep_s;
    run.position_rad.resize(1);
    run.passive_rad.resize(2);
    run.loop_error = {std::vector<double>(kRows, 0.0), std::vector<double>(kRows, 0.0)};
    for (int row = 0; row < kRows; ++row) {
      const double crank = 1.0 + kRate_rad_s * kStep_s * row;
      const Angles a = angles(crank);
      run.time_s.push_back(kStep_s * row);
      run.position_rad[0].push_back(crank);
      run.passive_rad[0].push_back(a.coupler - a.crank);
      run.passive_rad[1].push_back(a.rocker);
      constexpr double kH = 1e-4;
      torque_Nm.push_back((energy(crank + kH) - energy(crank - kH)) / (2.0 * kH));
    }
    run.velocity_rad_s = {std::vector<double>(kRows, kRate_rad_s)};
    run.torque_Nm = {torque_Nm};
    run.reference_rad = run.position_rad;
    run.base.assign(13, std::vector<double>(kRows, 0.0));
    std::ranges::fill(run.base[6], 1.0);
  }

  test::TestRobot robot;
  RunData run;
  std::vector<double> torque_Nm;  ///< by the balance of power
};

TEST_F(TurningLinkage, NeedsTheTorqueThatItsEnergyTells) {
  const Result<Curve> curve = inverse_dynamics_curve(run, 0, *robot.kernels.get());
  ASSERT_TRUE(curve.has_value()) << curve.error().to_string();
  ASSERT_EQ(curve->y.size(), torque_Nm.size());
  const double largest = *std::ranges::max_element(torque_Nm);
  ASSERT_GT(largest, 0.2);
  // The acceleration is differenced over 0.1 s, at the ends over half of it.
  for (std::size_t i = 20; i + 20 < torque_Nm.size(); ++i) {
    EXPECT_NEAR(curve->y[i], torque_Nm[i], 0.02 * largest) << "at " << curve->x[i] << " s";
  }
}

// Accelerations had been differenced over the gap.
TEST_F(TurningLinkage, HasNoTorqueWhereSamplesAreMissing) {
  const auto cut = [](std::vector<double>& values) {
    values.erase(values.begin() + kRows / 3, values.begin() + kRows / 2);
  };
  for (Columns* columns : {&run.position_rad, &run.velocity_rad_s, &run.torque_Nm,
                           &run.reference_rad, &run.base, &run.passive_rad, &run.loop_error}) {
    for (std::vector<double>& column : *columns) cut(column);
  }
  // It turns faster before it: a difference over the gap is a brake.
  for (std::size_t row = 0; row < kRows / 3; ++row) run.velocity_rad_s[0][row] *= 2.0;
  cut(run.time_s);
  const Result<Curve> curve = inverse_dynamics_curve(run, 0, *robot.kernels.get());
  ASSERT_TRUE(curve.has_value()) << curve.error().to_string();
  ASSERT_EQ(curve->y.size(), run.rows() + 1);
  EXPECT_TRUE(std::isnan(curve->y[kRows / 3]));
  const std::size_t missing = kRows / 2 - kRows / 3;
  for (std::size_t i = kRows / 3 + 1; i + 20 < curve->y.size(); ++i)
    EXPECT_NEAR(curve->y[i], torque_Nm[i - 1 + missing], 0.004) << "at " << curve->x[i] << " s";
}

TEST_F(TurningLinkage, WithoutTruthSaysWhyThereIsNoInverseDynamics) {
  run.base.clear();
  run.passive_rad.clear();
  run.loop_error.clear();
  const std::vector<Figure> figures = figures_of(run, {}, robot.kernels.get());
  EXPECT_EQ(figures[1].title,
            "crank: torque, measured (no inverse dynamics: the log lacks the position of coupler)");
}

TEST_F(TurningLinkage, WithoutTruthIsClosedFromTheMeasuredCrank) {
  const Columns truth = run.passive_rad;
  run.base.clear();
  run.passive_rad.clear();
  run.loop_error.clear();
  const Status closed = close_passive(run, *robot.kernels.get());
  ASSERT_TRUE(closed.has_value()) << closed.error().to_string();
  ASSERT_EQ(run.passive_rad.size(), truth.size());
  for (std::size_t i = 0; i < truth.size(); ++i) {
    for (std::size_t row = 0; row < run.rows(); ++row) {
      ASSERT_NEAR(std::remainder(run.passive_rad[i][row] - truth[i][row], 2 * M_PI), 0.0, 1e-9)
          << i << " at row " << row;
    }
  }
  const std::vector<Figure> figures = figures_of(run, {}, robot.kernels.get());
  EXPECT_EQ(figures[1].title, "crank: torque, measured and by inverse dynamics");
}

TEST_F(TurningLinkage, WithoutTruthAndKernelsIsDrawnAsFarAsItIsKnown) {
  run.base.clear();
  run.passive_rad.clear();
  run.loop_error.clear();
  const Figure posture = figures_of(run, {}, nullptr).back();
  EXPECT_TRUE(posture.title.ends_with(", without what passive joints move")) << posture.title;
  for (const double z : posture.curves.front().y) EXPECT_FALSE(std::abs(z) > kCrank_m);
}

TEST_F(TurningLinkage, IsDrawnClosedAndAboveItsLabels) {
  const Figure posture = figures_of(run, {}, robot.kernels.get()).back();
  ASSERT_EQ(posture.curves.size(), 1U);
  const Curve& bars = posture.curves.front();
  const Angles start = angles(1.0);
  const double pin_x = kGround_m + kRocker_m * std::cos(start.rocker);
  const double pin_z = kRocker_m * std::sin(start.rocker);
  int ends = 0;  // of coupler and of rocker
  for (std::size_t i = 0; i < bars.x.size(); ++i) {
    ends += std::hypot(bars.x[i] - pin_x, bars.y[i] - pin_z) < 1e-9 ? 1 : 0;
  }
  EXPECT_EQ(ends, 2);
  for (const Note& note : posture.notes) {
    for (const double z : bars.y) EXPECT_FALSE(z < note.y) << note.text;
  }
}

TEST(Ankle, IsDrawnWithItsRods) {
  const test::TestRobot robot = test::load_test_robot("parallel_ankle");
  const auto tree =
      model::read_urdf(TANDEM_SOURCE_DIR "/config/parallel_ankle/parallel_ankle.urdf", {})->tree;
  const std::vector<PostureSample> upright{{"", 0.0, {}, {0.0, 0.0, 0.0, 0.0}}};
  const Figure figure = posture_figure(tree, robot.robot, upright);
  const Curve& sticks = figure.curves.front();
  int rods = 0;  // from the front: both from a crank's tip straight down, left and right
  for (std::size_t i = 1; i < sticks.x.size(); ++i) {
    const bool down = std::abs(sticks.x[i] - sticks.x[i - 1]) < 1e-12;
    rods += down && std::abs(sticks.y[i] - sticks.y[i - 1] + 0.25) < 1e-12 &&
                    std::abs(std::abs(sticks.x[i]) - 0.05) < 1e-12
                ? 1
                : 0;
  }
  EXPECT_EQ(rods, 2);
}

/// The first sample of a log is a cycle before its start.
TEST(Ankle, BeginsAtNoNegativeZero) {
  const test::TestRobot robot = test::load_test_robot("parallel_ankle");
  const auto tree =
      model::read_urdf(TANDEM_SOURCE_DIR "/config/parallel_ankle/parallel_ankle.urdf", {})->tree;
  const std::vector<PostureSample> first{{"", -0.001, {}, {0.0, 0.0, 0.0, 0.0}}};
  const Figure figure = posture_figure(tree, robot.robot, first);
  EXPECT_TRUE(std::ranges::any_of(figure.notes, [](const Note& n) { return n.text == "0.00 s"; }));
}

/// The Panda, whose second finger follows the first.
class Gripper : public testing::Test {
 protected:
  Gripper() {
    const auto robot = hal::read_robot_config(TANDEM_SOURCE_DIR "/config/panda/robot.toml");
    run.robot = *robot;
    run.robot.joints.push_back(run.robot.joints.back());
    run.robot.joints.back().name = "panda_finger_joint1";
    run.tree = model::read_urdf(TANDEM_SOURCE_DIR "/config/panda/panda.urdf", {})->tree;
    run.step_s = 0.01;
    run.time_s = {0.0, 0.01};
    run.position_rad.assign(8, {0.0, 0.0});
    run.position_rad.back() = {0.01, 0.03};
    run.velocity_rad_s = run.torque_Nm = run.reference_rad = run.position_rad;
    run.reference_rad.back() = {0.012, 0.032};
    run.position_of = run.torque_of = "panda_finger_joint1";
  }
  RunData run;
};

TEST_F(Gripper, MovesBothFingersApart) {
  const std::size_t first = static_cast<std::size_t>(run.tree.joint_index("panda_finger_joint1"));
  const std::size_t second = static_cast<std::size_t>(run.tree.joint_index("panda_finger_joint2"));
  for (std::size_t row = 0; row < 2; ++row) {
    const auto bodies = body_placements(run.tree, run.robot, {"", 0.0, {}, run.positions(row)});
    EXPECT_NEAR((bodies[first + 1].p - bodies[second + 1].p).norm(),
                2.0 * run.position_rad.back()[row], 1e-12);
  }
}

TEST_F(Gripper, IsDrawnInMillimetresAndNewtons) {
  const std::vector<Figure> figures = figures_of(run, {}, nullptr);
  EXPECT_EQ(figures[0].y_label, "position [mm]");
  EXPECT_NEAR(figures[0].curves[0].y[1], 30.0, 1e-12);
  EXPECT_EQ(figures[1].y_label, "force [N]");
  EXPECT_EQ(figures[1].title, "panda_finger_joint1: force, measured");
  for (const Curve& curve : figures[2].curves) EXPECT_NE(curve.label, "arms and head");
}

TEST_F(Gripper, OfAFaultedRunShowsTheFaultAndWhatFollowedButCountsIt) {
  run.time_s = {1.25, 1.30, 1.35, 1.40};
  for (Columns* columns : {&run.position_rad, &run.velocity_rad_s, &run.torque_Nm}) {
    columns->assign(8, {0.0, 0.0, 9.0, 9.0});
  }
  run.reference_rad.assign(8, {0.0, 0.0, 0.0, 0.0});
  run.faults = {{1.30, "panda_finger_joint1", "a short circuit"}, {1.40, "", "more"}};
  EXPECT_EQ(run.rows_before_stop(), 2U);
  for (const Tracking& one : run.tracking()) {
    EXPECT_EQ(one.max_rad, 0.0);
    EXPECT_EQ(one.max_torque_Nm, 0.0);
  }
  const std::vector<Figure> figures = figures_of(run, {}, nullptr);
  for (const Figure& figure : {figures[0], figures[1]}) {
    ASSERT_EQ(figure.marks.size(), 1U);
    EXPECT_EQ(figure.x_label, "time since the first SYNC [s]");
    EXPECT_EQ(figure.marks[0].x, 1.30);
    EXPECT_GE(figure.range_until_x, 1.30) << "the moment of the fault was cut off";
    EXPECT_LT(figure.range_until_x, 1.35);
    EXPECT_EQ(figure.curves[0].x, run.time_s) << "what followed is drawn";
  }
  EXPECT_EQ(figures[2].notes.back().text, "1.30 s");
}

// A payload that came and went left no trace in a figure.
TEST_F(Gripper, OfARunThatPicksSomethingUpMarksWhen) {
  run.time_s = {1.0, 2.0};
  run.marks = {{0.0, "payload picked up", "payload picked up: tool"},
               {1.2, "payload picked up", "payload picked up: box"},
               {1.3, "payload picked up", "payload picked up: can"},
               {1.7, "payload dropped", "payload dropped: box"}};
  const Figure figure = figures_of(run, {}, nullptr).front();
  ASSERT_EQ(figure.marks.size(), 3U) << "what is there before the first row is no mark";
  EXPECT_EQ(figure.marks[0].label, "payload picked up");
  EXPECT_EQ(figure.marks[1].label, "");
  EXPECT_EQ(figure.marks[2].label, "payload dropped");
  EXPECT_EQ(figure.marks[2].x, 1.7);
  EXPECT_FALSE(figure.marks[2].fault);
}

// A board whose encoder is unplugged repeats what it measured last, and age_cycles stays 0.
TEST_F(Gripper, WhatABoardRepeatsWithoutASensorIsNotDrawnAsMeasured) {
  run.drive_fault.assign(8, {0.0, 0.0});
  EXPECT_EQ(figures_of(run, {}, nullptr)[0].curves[0].y.size(), 2U);
  EXPECT_TRUE(std::isfinite(figures_of(run, {}, nullptr)[0].curves[0].y[1]));
  run.drive_fault.back() = {0.0, 0x7300};
  const std::vector<Figure> figures = figures_of(run, {}, nullptr);
  for (const std::size_t figure : {0U, 1U}) {
    EXPECT_TRUE(std::isfinite(figures[figure].curves[0].y[0]));
    EXPECT_TRUE(std::isnan(figures[figure].curves[0].y[1])) << figures[figure].name;
  }
}

// It was "[deg, mm]" of any robot.
TEST_F(Gripper, DifferencesHaveTheUnitsOfWhatIsDrawn) {
  RunData second = run;
  for (auto& column : second.position_rad) column[1] += 0.001;
  second.torque_Nm = second.position_rad;
  second.position_rad.back()[1] += 1.0;
  const std::vector<Figure> figures = difference_figures(run, second);
  EXPECT_EQ(figures[0].y_label, "difference [deg, mm]");
  second.position_rad.back() = run.position_rad.back();
  second.torque_Nm.back() = run.torque_Nm.back();
  const std::vector<Figure> turning = difference_figures(run, second);
  EXPECT_EQ(turning[0].y_label, "difference [deg]");
  EXPECT_EQ(turning[1].y_label, "difference [Nm]");
}

// An empty frame had been drawn, and "against its reference" stood above none.
TEST_F(Gripper, OfARecordingOnlyWhatItHasIsDrawnAndNamed) {
  run.info.hal = "import";
  run.robot.sensors = {{}};
  run.robot.sensors[0].name = "flange";
  run.robot.sensors[0].type = hal::SensorType::kForceTorque;
  run.robot.sensors[0].link = "panda_link8";
  const std::vector<double> none(run.rows(), std::numeric_limits<double>::quiet_NaN());
  run.sensor.assign(run.robot.sensors[0].channels(), none);
  run.reference_rad.assign(run.position_rad.size(), none);
  std::vector<Figure> figures = figures_of(run, {}, nullptr);
  ASSERT_EQ(figures.size(), 3U) << "position, torque, posture";
  EXPECT_TRUE(figures[0].title.ends_with(": position")) << figures[0].title;
  EXPECT_EQ(figures[0].curves.size(), 1U);
  EXPECT_EQ(figures[0].x_label, "time since the recording's start [s]");
  run.torque_Nm.assign(run.position_rad.size(), none);
  figures = figures_of(run, {}, nullptr);
  EXPECT_EQ(figures.size(), 2U) << "position, posture";
}

// They had been those of its own log, beside an axis that has the first one's.
TEST_F(Gripper, TimesOfAShiftedRunsPosturesAreThoseOfTheAxis) {
  RunData later = run;
  for (double& time_s : later.time_s) time_s = 2.0 * time_s + 5.0;
  later.drawn_slower = 0.5;
  later.drawn_later_s = -2.5;
  const Curve drawn = figures_of(run, {&later}, nullptr)[0].curves.back();
  for (std::size_t row = 0; row < run.rows(); ++row)
    EXPECT_NEAR(drawn.x.at(row), run.time_s[row], 1e-12);
  const Figure posture = figures_of(run, {&later}, nullptr).back();
  std::vector<std::string> times;
  for (std::size_t i = 1; i < posture.notes.size(); i += 2) times.push_back(posture.notes[i].text);
  ASSERT_EQ(times.size() % 2, 0U);
  const std::size_t each = times.size() / 2;
  for (std::size_t i = 0; i < each; ++i) EXPECT_EQ(times[i], times[each + i]);
}

// A replay's way to its first place was drawn at times before the recording's first.
TEST_F(Gripper, OfARunThatIsDrawnInPartTheRestIsNowhere) {
  run.time_s = {1.0, 1.5, 2.0, 2.5};
  for (Columns* columns :
       {&run.position_rad, &run.velocity_rad_s, &run.torque_Nm, &run.reference_rad})
    columns->assign(8, {0.0, 0.1, 0.3, 0.4});
  RunData replay = run;
  replay.drawn_later_s = -1.6;
  replay.drawn_from_s = -0.15;
  replay.drawn_to_s = 0.5;
  const std::vector<Figure> figures = figures_of(run, {&replay}, nullptr);
  for (std::size_t f = 0; f < 2; ++f) {
    const Curve& drawn = figures[f].curves[1];
    ASSERT_EQ(drawn.x.size(), 2U);
    EXPECT_NEAR(drawn.x[0], -0.1, 1e-12);
    EXPECT_NEAR(drawn.x[1], 0.4, 1e-12);
    EXPECT_NEAR(drawn.y[0], f == 0 ? 100.0 : 0.1, 1e-12);
    EXPECT_EQ(figures[f].curves[0].x, run.time_s);
  }
  std::vector<std::string> notes;
  for (const Note& note : figures.back().notes) notes.push_back(note.text);
  const auto start = std::ranges::find(notes, "start B");
  ASSERT_NE(start, notes.end());
  EXPECT_EQ(*(start + 1), "-0.10 s");
}

// Half the weight stood there, too, which no sensor comes to: the curves were flat below it.
TEST(Feet, WithSensorsHaveTheirShareOfTheWeightAboveTheFootAlone) {
  RunData run;
  run.robot = *hal::read_robot_config(TANDEM_SOURCE_DIR "/config/coman/robot.toml");
  model::UrdfOptions options;
  options.floating_base = true;
  run.tree = model::read_urdf(TANDEM_SOURCE_DIR "/config/coman/coman.urdf", options)->tree;
  run.step_s = 0.01;
  run.time_s = {0.0, 0.01};
  run.position_rad.assign(run.robot.joints.size(), {0.0, 0.0});
  run.velocity_rad_s = run.torque_Nm = run.reference_rad = run.position_rad;
  std::size_t channels = 0;
  for (const hal::SensorConfig& sensor : run.robot.sensors) channels += sensor.channels();
  run.sensor.assign(channels, {0.0, 0.0});
  const std::vector<Figure> figures = figures_of(run, {}, nullptr);
  const auto force = std::ranges::find(figures, "foot_force", &Figure::name);
  ASSERT_NE(force, figures.end());
  double mass_kg = 0.0, foot_kg = 0.0;
  for (const model::Link& link : run.tree.links) {
    mass_kg += link.inertia.mass_kg;
    foot_kg += link.name == "RFoot" ? link.inertia.mass_kg : 0.0;
  }
  ASSERT_GT(foot_kg, 0.1);
  ASSERT_EQ(force->levels.size(), 1U);
  EXPECT_NEAR(force->levels[0].y, (0.5 * mass_kg - foot_kg) * 9.81, 0.01);
}

// It had been taken for the run's end.
TEST_F(Gripper, AFaultThatIsOnlyReportedEndsNothing) {
  run.time_s = {1.25, 1.30, 1.35, 1.40};
  for (Columns* columns : {&run.position_rad, &run.velocity_rad_s, &run.torque_Nm}) {
    columns->assign(8, {0.0, 0.0, 9.0, 9.0});
  }
  run.faults = {{1.30, "panda_finger_joint1", "collision", false}, {1.35, "", "collision", false}};
  EXPECT_EQ(run.rows_before_stop(), 4U);
  const std::vector<Figure> figures = figures_of(run, {}, nullptr);
  ASSERT_EQ(figures[0].marks.size(), 2U);
  EXPECT_EQ(figures[0].marks[0].label, "fault, reported");
  EXPECT_EQ(figures[0].marks[1].x, 1.35);
  EXPECT_EQ(figures[0].range_until_x, std::numeric_limits<double>::infinity());
  EXPECT_EQ(figures[2].notes.back().text, "1.40 s");
}

TEST_F(Gripper, TellsWhichJointsSlide) {
  for (const Tracking& one : run.tracking()) {
    EXPECT_EQ(one.slides, one.joint == "panda_finger_joint1") << one.joint;
  }
}

}  // namespace
}  // namespace tandem::report
