#include <cmath>
#include <numbers>

#include "controllers/min_jerk.hpp"
#include "controllers/segment.hpp"
#include "tests/controllers/harness.hpp"
#include "tests/hal/fake_backend.hpp"

namespace tandem {
namespace {

const char* const kTwo = R"(joints = ['shoulder', 'wrist']
[[waypoint]]
time_s = 1.0
position_rad = [0.5, -0.5]
[[waypoint]]
time_s = 2.0
position_rad = [1.0, 0.5]
[[waypoint]]
time_s = 3.0
position_rad = [1.2, 0.0]
)";

TEST(Quintic, MeetsBothEndsAndIsItsOwnDerivative) {
  const TrajectoryPoint from{0.3, -0.4, 0.0}, to{1.0, 0.7, 0.0};
  const TrajectoryPoint first = quintic(from, to, 2.0, 0.0), last = quintic(from, to, 2.0, 2.0);
  EXPECT_NEAR(first.position, 0.3, 1e-12);
  EXPECT_NEAR(first.velocity, -0.4, 1e-12);
  EXPECT_NEAR(last.position, 1.0, 1e-12);
  EXPECT_NEAR(last.velocity, 0.7, 1e-12);
  EXPECT_NEAR(first.acceleration, 0.0, 1e-12);
  EXPECT_NEAR(last.acceleration, 0.0, 1e-12);
  const double h = 1e-6;
  for (const double t : {0.2, 0.9, 1.7}) {
    const TrajectoryPoint before = quintic(from, to, 2.0, t - h),
                          after = quintic(from, to, 2.0, t + h);
    const TrajectoryPoint now = quintic(from, to, 2.0, t);
    EXPECT_NEAR(now.velocity, (after.position - before.position) / (2 * h), 1e-8);
    EXPECT_NEAR(now.acceleration, (after.velocity - before.velocity) / (2 * h), 1e-7);
  }
}

TEST(Quintic, IsTheMinimumJerkProfileBetweenRests) {
  for (const double t : {0.1, 0.5, 0.8}) {
    EXPECT_NEAR(quintic({}, {2.0, 0.0, 0.0}, 1.0, t).position, 2.0 * min_jerk(t).s, 1e-12);
  }
}

TEST(JointTrajectory, ReachesEveryWayPointInTimeAndRestsThere) {
  test::Harness run(hal::test::fake_robot(), "joint_trajectory", kTwo);
  ASSERT_EQ(run.problem(), "");
  run.state.position_rad()[0] = 0.1;
  run.start();
  ASSERT_EQ(run.step(), Code::kOk);
  EXPECT_EQ(run.command.position_rad()[0], 0.1);
  ASSERT_EQ(run.run(1.0), Code::kOk);
  EXPECT_NEAR(run.command.position_rad()[0], 0.5, 1e-9);
  EXPECT_NEAR(run.command.velocity_rad_s()[0], 0.0, 1e-9);
  ASSERT_EQ(run.run(1.0), Code::kOk);
  EXPECT_NEAR(run.command.position_rad()[2], 0.5, 1e-9);
  ASSERT_EQ(run.run(2.0), Code::kOk);
  EXPECT_EQ(run.command.position_rad()[0], 1.2);
  EXPECT_EQ(run.command.position_rad()[2], 0.0);
  EXPECT_EQ(run.setup.claims().size(), 2U);
}

TEST(JointTrajectory, RunsThroughWayPointsWithoutAJumpOfVelocity) {
  test::Harness run(hal::test::fake_robot(), "joint_trajectory",
                    std::string("interpolation = 'quintic'\nstop_at_end = true\n") + kTwo);
  ASSERT_EQ(run.problem(), "");
  run.start();
  double last_position = 0.0, last_velocity = 0.0;
  for (int i = 0; i < 3000; ++i) {
    ASSERT_EQ(run.step(), Code::kOk);
    const double position = run.command.position_rad()[0];
    const double velocity = run.command.velocity_rad_s()[0];
    ASSERT_NEAR(velocity, last_velocity, 0.02) << i;
    if (i > 0) {
      ASSERT_NEAR(velocity, (position - last_position) * 1e3, 0.01) << i;
    }
    if (i == 2000) {  // (1.2 - 0.5) / 2 s on the way
      EXPECT_NEAR(position, 1.0, 1e-9);
      EXPECT_NEAR(velocity, 0.35, 1e-9);
    }
    last_position = position;
    last_velocity = velocity;
  }
  EXPECT_EQ(run.step(), Code::kStopped);
  EXPECT_EQ(run.command.position_rad()[0], 1.2);
}

std::string problem_of(const std::string& text) {
  return test::Harness(hal::test::fake_robot(), "joint_trajectory", text).problem();
}

TEST(JointTrajectory, RefusesWhatTheJointsCannotDo) {
  EXPECT_EQ(problem_of("joints = ['wrist']\n"),
            "experiment.toml:1: there is no way-point (add [[controller.parameters.waypoint]] with "
            "time_s and position_rad)");
  EXPECT_EQ(problem_of("joints = ['wrist']\n[[waypoint]]\ntime_s = 1\nposition_rad = [1.7]\n"),
            "experiment.toml:4: waypoint[0].position_rad: joint 'wrist' leaves its limits (stay "
            "within -1.500000 and 1.500000; in radians, or metres of a slide)");
  EXPECT_EQ(
      problem_of("joints = ['wrist']\n[[waypoint]]\ntime_s = 1\nposition_rad = [60]\n"
                 "[[waypoint]]\ntime_s = 2\nposition_rad = [90]\n[[waypoint]]\ntime_s = 3\n"
                 "position_rad = [0]\n"),
      "experiment.toml:4: waypoint[0].position_rad: joint 'wrist' leaves its limits, here and "
      "in 1 later way-point (stay within -1.500000 and 1.500000; in radians, or metres of a "
      "slide)")
      << "one message for a column in degrees";
  EXPECT_EQ(problem_of("joints = ['shoulder', 'wrst']\n[[waypoint]]\ntime_s = 1\n"
                       "position_rad = [9, 9]\n[[waypoint]]\ntime_s = 2\nposition_rad = [9, 9]\n")
                .find("\n"),
            std::string::npos)
      << "with a joint misspelt, who knows whose the numbers are";
  EXPECT_EQ(
      problem_of("joints = ['wrist', 'elbow']\n[[waypoint]]\ntime_s = 1\n"
                 "position_rad = [9]\n[[waypoint]]\ntime_s = 2\nposition_rad = [9]\n"),
      "experiment.toml:4: waypoint[0].position_rad: has 1 number for 2 joints, here and in 1 "
      "later way-point (give one each for wrist, elbow; or name those that move in `joints`)");
  EXPECT_EQ(problem_of("[[waypoint]]\ntime_s = 1\nposition_rad = [60, 90, 45]\n[[waypoint]]\n"
                       "time_s = 2\nposition_rad = [0, 0, 0]\n"),
            "experiment.toml:3: waypoint[0].position_rad: joint 'shoulder' and 2 more leave their "
            "limits (stay within -1.500000 and 1.500000; in radians, or metres of a slide)")
      << "one message for a way-point in degrees";
  EXPECT_EQ(problem_of("joints = ['wrist']\n[[waypoint]]\ntime_s = 1\nposition_rad = [1, 2]\n"),
            "experiment.toml:4: waypoint[0].position_rad: has 2 numbers for 1 joint "
            "(give one each for wrist; or name those that move in `joints`)");
  EXPECT_EQ(problem_of("joints = ['wrist']\n[[waypoint]]\ntime_s = 1\nposition_rad = [0.0]\n"
                       "[[waypoint]]\ntime_s = 1\nposition_rad = [0.0]\n"),
            "experiment.toml:6: waypoint[1].time_s: is the time of the way-point before (a joint "
            "cannot be at two places at once: remove one of the two, or move it)");
  EXPECT_EQ(problem_of("joints = ['wrist']\n[[waypoint]]\ntime_s = 2\nposition_rad = [0.0]\n"
                       "[[waypoint]]\ntime_s = 1\nposition_rad = [0.0]\n"),
            "experiment.toml:6: waypoint[1].time_s: is not later than the way-point before (sort "
            "them by time)");
  EXPECT_EQ(problem_of("joints = ['wrist']\n[[waypoint]]\ntime_s = 1\nposition_rad = [0.0]\n"
                       "[[waypoint]]\ntime_s = 1.5\nposition_rad = [1.0]\n"),
            "experiment.toml:6: waypoint[1].time_s: joint 'wrist' would need 3.75 rad/s on the "
            "way, its limit is 2 (give it 0.938 s or more after the way-point before)");
  EXPECT_EQ(problem_of("joints = ['wrist']\n[[waypoint]]\ntime_s = -1\nposition_rad = [0.0]\n")
                .find("\n"),
            std::string::npos)
      << "one error for one number";
  EXPECT_EQ(problem_of("joints = ['wrist']\n[[waypoint]]\ntime_s = -1\nposition_rad = [0.0]\n"
                       "[[waypoint]]\ntime_s = -1\nposition_rad = [0.0]\n")
                .find("way-point before"),
            std::string::npos)
      << "the second error followed from the first";
  const std::string through =
      "joints = ['wrist']\ninterpolation = 'quintic'\n[[waypoint]]\ntime_s = 0\n"
      "position_rad = [0.0]\n[[waypoint]]\ntime_s = TIME\nposition_rad = [1.0]\n";
  const auto at = [&](const char* time_s) {
    std::string text = through;
    return problem_of(text.replace(text.find("TIME"), 4, time_s));
  };
  EXPECT_EQ(at("0.5"),
            "experiment.toml:7: waypoint[1].time_s: joint 'wrist' would need 3.75 rad/s on the "
            "way, its limit is 2 (give it more time: with all times 1.88 times as long it fits)");
  EXPECT_EQ(at("0.94"), "") << "1.88 times as long";
  EXPECT_EQ(problem_of("interpolation = 'qintic'\n"),
            "experiment.toml:1: interpolation: 'qintic' is not one of the choices (did you mean "
            "'quintic'?)");
}

TEST(JointTrajectory, RefusesAFirstWayPointTooFarFromAKnownStart) {
  const std::vector<double> start{1.0, -1.0, 0.1};
  const auto problem = [&](const std::string& time_s, std::span<const double> start_rad) {
    return test::Harness(hal::test::fake_robot(), "joint_trajectory",
                         "joints = ['wrist', 'shoulder']\n[[waypoint]]\ntime_s = " + time_s +
                             "\nposition_rad = [0.0, 0.0]\n",
                         nullptr, start_rad)
        .problem();
  };
  EXPECT_EQ(problem("0.05", start),
            "experiment.toml:3: waypoint[0].time_s: joint 'shoulder' would need 37.5 rad/s on the "
            "way from the start, its limit is 2, and 1 more are too fast (time_s = 0.938 or more; "
            "and move the later ones)");
  EXPECT_EQ(problem("0.938", start), "") << "the time that was said is enough";
  EXPECT_NE(problem("0.937", start), "");
  EXPECT_EQ(problem("0.05", {}), "") << "of a start that is not known nothing is said";
}

TEST(JointTrajectory, GoesOnFromASnapshot) {
  test::Harness run(hal::test::fake_robot(), "joint_trajectory", kTwo);
  run.state.position_rad()[0] = 0.1;
  run.start();
  run.run(1.5);
  Archive saved;
  run.controller().archive(saved);
  test::Harness other(hal::test::fake_robot(), "joint_trajectory", kTwo);
  Archive restored(saved.bytes());
  other.controller().archive(restored);
  ASSERT_TRUE(restored.ok() && restored.at_end());
  other.time = run.time;
  run.run(0.3);
  other.run(0.3);
  EXPECT_EQ(other.command.position_rad()[0], run.command.position_rad()[0]);
}

TEST(Segment, MeetsEverythingThatAPlannersPointSaysAndIsItsOwnDerivative) {
  const TrajectoryPoint from{0.3, -0.4, 0.9}, to{1.0, 0.7, -1.3};
  const double h = 1e-6, T = 0.5;
  for (const auto& piece : {quintic_through, cubic}) {
    const bool bends = piece == quintic_through;
    const TrajectoryPoint first = piece(from, to, T, 0.0), last = piece(from, to, T, T);
    EXPECT_NEAR(first.position, 0.3, 1e-12);
    EXPECT_NEAR(first.velocity, -0.4, 1e-12);
    EXPECT_NEAR(last.position, 1.0, 1e-12);
    EXPECT_NEAR(last.velocity, 0.7, 1e-12);
    if (bends) {
      EXPECT_NEAR(first.acceleration, 0.9, 1e-12);
      EXPECT_NEAR(last.acceleration, -1.3, 1e-11);
    }
    for (const double t : {0.1, 0.25, 0.4}) {
      const TrajectoryPoint before = piece(from, to, T, t - h), after = piece(from, to, T, t + h);
      const TrajectoryPoint now = piece(from, to, T, t);
      EXPECT_NEAR(now.velocity, (after.position - before.position) / (2 * h), 1e-7);
      EXPECT_NEAR(now.acceleration, (after.velocity - before.velocity) / (2 * h), 1e-6);
    }
  }
}

/// As planners write it: the start, then points with velocities (and accelerations).
std::string plan(bool accelerations) {
  std::string text = "joints = ['wrist']\ninterpolation = 'quintic'\nstop_at_end = true\n";
  for (int i = 0; i <= 20; ++i) {  // 0.8 rad in 2 s
    const MinJerk at = min_jerk(0.05 * i);
    text += "[[waypoint]]\ntime_s = " + std::to_string(0.1 * i);
    text += "\nposition_rad = [" + std::to_string(0.8 * at.s);
    text += "]\nvelocity_rad_s = [" + std::to_string(0.4 * at.ds) + "]\n";
    if (accelerations) text += "acceleration_rad_s2 = [" + std::to_string(0.2 * at.dds) + "]\n";
  }
  return text;
}

TEST(JointTrajectory, FollowsAPlanThatBeginsWhereTheJointStands) {
  for (const bool accelerations : {false, true}) {
    test::Harness run(hal::test::fake_robot(), "joint_trajectory", plan(accelerations));
    ASSERT_EQ(run.problem(), "");
    run.start();
    for (int i = 0; i < 2000; ++i) {
      ASSERT_EQ(run.step(), Code::kOk);
      const MinJerk at = min_jerk(0.5e-3 * i);
      ASSERT_NEAR(run.command.position_rad()[2], 0.8 * at.s, 1e-5) << i;
      ASSERT_NEAR(run.command.velocity_rad_s()[2], 0.4 * at.ds, 1e-3) << i;
    }
    EXPECT_EQ(run.step(), Code::kStopped);
  }
}

TEST(JointTrajectory, LeadsAJointThatStandsElsewhereToThePlansStartFirst) {
  test::Harness run(hal::test::fake_robot(), "joint_trajectory", plan(true));
  run.state.position_rad()[2] = -0.5;
  run.start();
  ASSERT_EQ(run.step(), Code::kOk);
  EXPECT_EQ(run.command.position_rad()[2], -0.5);
  double fastest = 0.0, before = -0.5;
  int cycles = 1;
  while (run.step() == Code::kOk) {
    ++cycles;
    const double now = run.command.position_rad()[2];
    if (before < 0.0) fastest = std::max(fastest, (now - before) * 1e3);
    before = now;
  }
  EXPECT_NEAR(fastest, 1.0, 1e-2) << "half of the joint's speed";
  EXPECT_NEAR(cycles, 938 + 2000, 2) << "the plan begins when it is there";
}

TEST(JointTrajectory, RefusesAPlanThatCannotBeMeant) {
  const auto with = [](const std::string& from, const std::string& to) {
    std::string text = plan(true);
    text.replace(text.find(from), from.size(), to);
    return problem_of(text);
  };
  EXPECT_NE(with("velocity_rad_s = [0.000000]", "velocity_rad_s = [0.1]").find("begins in motion"),
            std::string::npos);
  EXPECT_NE(with("acceleration_rad_s2 = [0.000000]\n", "").find("some not"), std::string::npos);
  EXPECT_NE(with("velocity_rad_s = [0.000000]", "velocity_rad_s = [0, 0]").find("has 2 numbers"),
            std::string::npos);
  EXPECT_NE(with("'quintic'", "'min_jerk'").find("set interpolation = \"quintic\""),
            std::string::npos);
  std::string ends = plan(false);
  ends.replace(ends.rfind("[0.000000]"), 10, "[0.2]");
  EXPECT_NE(problem_of(ends).find("ends in motion"), std::string::npos);
  EXPECT_NE(problem_of("joints = ['wrist']\ninterpolation = 'quintic'\n[[waypoint]]\ntime_s = 1\n"
                       "position_rad = [1]\nacceleration_rad_s2 = [0]\n")
                .find("needs velocity_rad_s"),
            std::string::npos);
}

TEST(JointTrajectory, GoesTheShorterWayRoundWhereItIsAsked) {
  hal::RobotConfig robot = hal::test::fake_robot();
  robot.joints[2].min_position_rad = -7412.0;
  robot.joints[2].max_position_rad = 7412.0;
  const std::string way =
      "[[waypoint]]\ntime_s = 1\nposition_rad = [-3.1, 0]\n"
      "[[waypoint]]\ntime_s = 2\nposition_rad = [3.1, 1.0]\n";
  const auto end = [&](const std::string& key, double from_rad) {
    test::Harness run(robot, "joint_trajectory", "joints = ['wrist', 'elbow']\n" + key + way);
    EXPECT_EQ(run.problem(), "");
    run.state.position_rad()[2] = from_rad;
    run.start();
    double fastest = 0.0;
    for (int i = 0; i < 3000; ++i) {
      EXPECT_EQ(run.step(), Code::kOk);
      fastest = std::max(fastest, std::abs(run.command.velocity_rad_s()[2]));
    }
    EXPECT_LT(fastest, 2.0);
    EXPECT_EQ(run.command.position_rad()[1], 1.0) << "a joint with ends goes the way it has";
    return run.command.position_rad()[2];
  };
  const double turn = 2.0 * std::numbers::pi;
  EXPECT_NE(
      test::Harness(robot, "joint_trajectory", "joints = ['wrist', 'elbow']\n" + way).problem(), "")
      << "the long way is too fast";
  EXPECT_NEAR(end("angle_wraparound = true\n", 3.1), 3.1, 1e-9);
  EXPECT_NEAR(end("angle_wraparound = true\n", 3.1 + 10.0 * turn), 3.1 + 10.0 * turn, 1e-9);
  EXPECT_NEAR(end("angle_wraparound = true\n", -3.1), 3.1 - turn, 1e-9);
}

// x0 + 0.1 (cos w t - 1) + 0.2 sin w t - 0.1 sin 2 w t, w = pi: from rest to rest.
const char* const kSeries = R"(joints = ['shoulder']
interpolation = 'fourier'
period_s = 2.0
periods = 2
[[harmonic]]
cos_rad = [0.1]
sin_rad = [0.2]
[[harmonic]]
cos_rad = [0.0]
sin_rad = [-0.1]
)";

TEST(JointTrajectory, FollowsAFourierSeriesAndRestsAtItsEnd) {
  test::Harness run(hal::test::fake_robot(), "joint_trajectory", kSeries);
  ASSERT_EQ(run.problem(), "");
  run.state.position_rad()[0] = 0.3;
  run.start();
  for (int i = 0; i < 4500; ++i) {
    ASSERT_EQ(run.step(), Code::kOk);
    const double w = std::numbers::pi, t = 1e-3 * std::min(i, 4000);
    const double position_rad =
        0.3 + 0.1 * (std::cos(w * t) - 1.0) + 0.2 * std::sin(w * t) - 0.1 * std::sin(2.0 * w * t);
    const double velocity_rad_s =
        w * (-0.1 * std::sin(w * t) + 0.2 * std::cos(w * t) - 0.2 * std::cos(2.0 * w * t));
    ASSERT_NEAR(run.command.position_rad()[0], position_rad, 1e-12) << i;
    ASSERT_NEAR(run.command.velocity_rad_s()[0], velocity_rad_s, 1e-12) << i;
  }
  EXPECT_EQ(run.command.velocity_rad_s()[0], 0.0);
}

TEST(JointTrajectory, RefusesASeriesThatStartsInMotionIsTooFastOrLacksNumbers) {
  const auto problem = [](std::string text, const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
    return test::Harness(hal::test::fake_robot(), "joint_trajectory", text).problem();
  };
  EXPECT_NE(problem(kSeries, "sin_rad = [-0.1]", "sin_rad = [0.1]").find("does not start at rest"),
            std::string::npos);
  EXPECT_NE(problem(kSeries, "period_s = 2.0", "period_s = 0.02").find("rad/s, its limit is"),
            std::string::npos);
  EXPECT_NE(problem(kSeries, "cos_rad = [0.1]", "cos_rad = [0.1, 0.2]").find("has 2 numbers for 1"),
            std::string::npos);
  EXPECT_NE(problem(kSeries, "[[harmonic]]\ncos_rad = [0.0]\nsin_rad = [-0.1]\n", "")
                .find("does not start at rest"),
            std::string::npos);
}

/// The torque of the last cycle would stay.
TEST(JointTrajectory, LeavesNoTorqueBehindWhenItsDampingIsSetToZero) {
  test::Harness run(hal::test::fake_robot(), "joint_trajectory",
                    std::string("link_damping_Nms_rad = 4.0\n") + kTwo);
  ASSERT_EQ(run.problem(), "");
  run.start();
  run.state.velocity_rad_s()[2] = 0.5;
  ASSERT_EQ(run.run(0.1), Code::kOk);
  EXPECT_LT(run.command.torque_Nm()[2], -1.0);
  run.set("link_damping_Nms_rad", 0.0);
  ASSERT_EQ(run.step(), Code::kOk);
  EXPECT_EQ(run.command.torque_Nm()[2], 0.0);
}

TEST(JointTrajectory, EndsWhenItIsToldToAfterItsEnd) {
  test::Harness run(hal::test::fake_robot(), "joint_trajectory", kTwo);
  ASSERT_EQ(run.problem(), "");
  run.start();
  ASSERT_EQ(run.run(3.2), Code::kOk);
  run.set("stop_at_end", 1.0);
  EXPECT_EQ(run.step(), Code::kStopped);
}

}  // namespace
}  // namespace tandem
