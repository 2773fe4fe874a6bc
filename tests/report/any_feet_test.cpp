// Figures of robots with any number of feet: the ground's forces come from the log's truth.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <ranges>

#include "controllers/stance.hpp"
#include "hal/config/capabilities.hpp"
#include "report/logged_torque.hpp"
#include "report/run_figures.hpp"
#include "tests/controllers/walker.hpp"

namespace tandem::report {
namespace {

const std::vector<test::LegJoint> kLeg{{'x', 0, 0}, {'y', 0.4, -0.4}, {'y', 0.4, 0.8}};

/// A walker that stands still for 0.2 s, and what its log says of it.
class AnyFeet : public testing::TestWithParam<int> {
 protected:
  static constexpr std::size_t kRows = 41;
  explicit AnyFeet(int legs = GetParam()) : walker{"", legs, kLeg, {{0, 0, 0}}}, one(walker) {
    const tandem_kernels& kernels = *one.kernels.get();
    const std::vector<FootContact> feet =
        find_feet(hal::robot_of(one.robot), kernels, foot_names(hal::robot_of(one.robot))).value();
    stance.place(one.robot.postures[0].position_rad);
    EXPECT_TRUE(stance.solve(0.7, 50).converged);
    const std::vector<double> rest(kernels.nv);
    stance.carry(rest);
    run.robot = one.robot;
    run.tree = model::parse_urdf(test::walker_urdf(walker), "walker.urdf", {.floating_base = true})
                   .value()
                   .tree;
    run.step_s = 0.005;
    for (std::size_t row = 0; row < kRows; ++row)
      run.time_s.push_back(run.step_s * static_cast<double>(row));
    const ModelMap& map = stance.map();
    for (std::size_t j = 0; j < map.joints(); ++j) {
      run.position_rad.push_back(constant(stance.q()[map.q_index(j)]));
      run.torque_Nm.push_back(constant(stance.tau()[map.v_index(j)]));
      run.velocity_rad_s.push_back(constant(0.0));
      run.reference_rad.push_back(run.position_rad.back());
    }
    for (std::size_t i = 0; i < 7; ++i) run.base.push_back(constant(stance.q()[i]));
    for (std::size_t i = 0; i < 6; ++i) run.base.push_back(constant(0.0));
    tell_the_ground(feet);
  }

  static std::vector<double> constant(double value) { return std::vector<double>(kRows, value); }

  /// The forces on the feet that carry the robot, as the simulation would log them.
  void tell_the_ground(const std::vector<FootContact>& feet) {
    const tandem_kernels& k = *one.kernels.get();
    std::vector<double> pose(12UL * k.sites), twist(6UL * k.sites), acc(twist), rest(k.nv);
    std::vector<double> J(6UL * k.nv * k.sites), tau(k.nv);
    k.site_motion(stance.q().data(), rest.data(), rest.data(), pose.data(), twist.data(),
                  acc.data());
    k.site_jacobians(stance.q().data(), J.data());
    k.bias(stance.q().data(), rest.data(), tau.data());
    Support support(feet);
    support.carry(k, stance.q(), pose, J, tau);
    for (std::size_t foot = 0; foot < feet.size(); ++foot) {
      for (Eigen::Index i = 0; i < 3; ++i) {
        run.foot_position_m.push_back(constant(support.points()[foot].position_m[i]));
        run.foot_force_N.push_back(constant(support.points()[foot].force_N[i]));
        run.foot_moment_Nm.push_back(constant(0.0));
      }
    }
  }
  const Figure& figure(const std::string& name) {
    figures = figures_of(run, {}, one.kernels.get());
    return *std::ranges::find(figures, name, &Figure::name);
  }

  test::Walker walker;
  test::WalkerRobot one;
  Stance stance = Stance::make(hal::robot_of(one.robot), one.kernels.get(),
                               foot_names(hal::robot_of(one.robot)))
                      .value();
  RunData run;
  std::vector<Figure> figures;
};

TEST_P(AnyFeet, InverseDynamicsKnowsWhatTheGroundCarries) {
  for (int joint = 0; joint < 3; ++joint) {
    const Result<Curve> curve = inverse_dynamics_curve(run, joint, *one.kernels.get());
    ASSERT_TRUE(curve.has_value()) << curve.error().to_string();
    ASSERT_EQ(curve->y.size(), kRows);
    for (const double torque_Nm : curve->y) {
      ASSERT_NEAR(torque_Nm, run.torque_Nm[static_cast<std::size_t>(joint)][0], 1e-6) << joint;
    }
  }
  EXPECT_TRUE(figure("joint_torque").title.ends_with(": torque, measured and by inverse dynamics"));
}

TEST_P(AnyFeet, EveryFootsForceIsDrawnBesideItsShareOfTheWeight) {
  const Figure& force = figure("foot_force");
  EXPECT_EQ(force.curves.size(), static_cast<std::size_t>(GetParam()));
  ASSERT_EQ(force.levels.size(), 1U);
  EXPECT_NEAR(force.levels[0].y * GetParam(), one.kernels.get()->mass_kg * 9.81, 1e-9);
  run.result = {{"weight_N", "400"}};  // of a plant that is not the model
  EXPECT_NEAR(figure("foot_force").levels[0].y * GetParam(), 400.0, 1e-9);
  const std::vector<FootFigures> feet = run.feet();
  ASSERT_EQ(feet.size(), static_cast<std::size_t>(GetParam()));
  double sum_N = 0.0;
  for (const FootFigures& foot : feet) {
    sum_N += foot.mean_force_N;
    EXPECT_EQ(foot.slip_m, 0.0);
  }
  EXPECT_NEAR(sum_N, one.kernels.get()->mass_kg * 9.81, 1e-6);
}

TEST_P(AnyFeet, WithoutTruthNoMisleadingTorqueIsDrawn) {
  run.base.clear();
  run.foot_position_m.clear();
  run.foot_force_N.clear();
  run.foot_moment_Nm.clear();
  EXPECT_FALSE(inverse_dynamics_curve(run, 0, *one.kernels.get()).has_value());
  const Figure& torque = figure("joint_torque");
  EXPECT_EQ(torque.title,
            run.robot.joints[static_cast<std::size_t>(subjects_of(run).torque_of)].name +
                ": torque, measured (no inverse dynamics: the log lacks the base's "
                "motion)");
  EXPECT_EQ(torque.curves.size(), 1U);
  EXPECT_EQ(figures.size(), 3U) << "position, torque, posture";
}

TEST_P(AnyFeet, OfAStillRobotStartAndEndAreEnough) {
  const Figure& posture = figure("posture");
  ASSERT_EQ(posture.notes.size(), 4U) << "two moments and their times";
}

TEST_P(AnyFeet, PosturesBesideEachOtherDoNotTouch) {
  for (std::size_t row = 0; row < kRows; ++row) {
    run.base[2][row] -= 0.05 * static_cast<double>(row) / kRows;  // it goes down
  }
  const Figure& posture = figure("posture");
  const Curve& legs = *std::ranges::find(posture.curves, "legs", &Curve::label);
  const std::size_t each = legs.x.size() / 4;  // start, half way, lowest, end
  const auto [low, high] =
      std::ranges::minmax(legs.y | std::views::filter([](double z) { return std::isfinite(z); }));
  double last = -1e300;
  for (std::size_t one_posture = 0; one_posture < 4; ++one_posture) {
    double left = 1e300, right = -1e300;
    for (std::size_t i = each * one_posture; i < each * (one_posture + 1); ++i) {
      if (!std::isfinite(legs.x[i])) continue;
      left = std::min(left, legs.x[i]);
      right = std::max(right, legs.x[i]);
    }
    EXPECT_GT(left, last);
    last = right;
    const std::size_t first = each * one_posture;
    if (one_posture == 0) continue;
    EXPECT_GT(legs.x[first] - legs.x[first - each], 0.5 * (high - low)) << "no crowd of thin ones";
  }
}

INSTANTIATE_TEST_SUITE_P(Legs, AnyFeet, testing::Values(1, 3, 4, 6));

TEST(NoFeet, ArmsAreDrawnByTheJointsThatMoveMost) {
  RunData run;
  const test::Walker walker{"", 1, kLeg, {{0, 0, 0}}};
  run.robot = test::walker_robot(walker);
  run.robot.model.floating_base = false;
  run.robot.contact.feet.clear();
  run.tree = model::parse_urdf(test::walker_urdf(walker), "walker.urdf", {}).value().tree;
  run.step_s = 0.01;
  run.time_s = {0.0, 0.01};
  run.position_rad = {{0.0, 0.1}, {0.0, 0.3}, {0.0, 0.2}};
  run.velocity_rad_s = run.torque_Nm = run.reference_rad = run.position_rad;
  const Subjects subjects = subjects_of(run);
  EXPECT_EQ(subjects.position_of, 1);
  EXPECT_EQ(subjects.torque_of, 2);
  const std::vector<Figure> figures = figures_of(run, {}, nullptr);
  ASSERT_EQ(figures.size(), 3U);
  EXPECT_EQ(figures[0].title, run.robot.joints[1].name + ": position against its reference");
  EXPECT_EQ(figures[1].title, run.robot.joints[2].name + ": torque, measured");
}

// The joints that the experiment names stood still in every figure while the arms waved.
TEST(NoFeet, JointsThatStandGiveWayToThoseThatMove) {
  RunData run;
  const test::Walker walker{"", 1, kLeg, {{0, 0, 0}}};
  run.robot = test::walker_robot(walker);
  run.tree = model::parse_urdf(test::walker_urdf(walker), "walker.urdf", {}).value().tree;
  run.position_of = run.torque_of = run.robot.joints[0].name;
  run.time_s = {0.0, 0.01};
  run.position_rad = {{0.0, 0.009}, {0.0, 0.2}, {0.0, 0.3}};
  Subjects subjects = subjects_of(run);
  EXPECT_EQ(subjects.position_of, 2);
  EXPECT_EQ(subjects.torque_of, 1);
  run.position_rad[0][1] = 0.011;
  subjects = subjects_of(run);
  EXPECT_EQ(subjects.position_of, 0) << "it moves: what the experiment names is shown";
  run.position_rad = {{0.0, 0.0}, {0.0, 0.001}, {0.0, 0.001}};
  EXPECT_EQ(subjects_of(run).position_of, 0) << "nothing moves";
}

// foot_force.png of an arm, and "-0.00 s" below its first posture.
TEST(NoFeet, TheSensorsOfAnArmAreNoFeetsAndItsStartIsAtZero) {
  RunData run;
  const test::Walker walker{"", 1, kLeg, {{0, 0, 0}}};
  run.robot = test::walker_robot(walker);
  run.robot.model.floating_base = false;
  run.robot.contact.feet.clear();
  run.robot.sensors = {{}};
  run.robot.sensors[0].name = "wrist";
  run.robot.sensors[0].type = hal::SensorType::kForceTorque;
  run.tree = model::parse_urdf(test::walker_urdf(walker), "walker.urdf", {}).value().tree;
  run.step_s = 0.001;
  run.time_s = {-0.001, 1.0};
  run.position_rad = {{0.0, 0.1}, {0.0, 0.3}, {0.0, 0.2}};
  run.velocity_rad_s = run.torque_Nm = run.reference_rad = run.position_rad;
  run.sensor.assign(6, {0.0, 1.0});
  const std::vector<Figure> figures = figures_of(run, {}, nullptr);
  const auto has = [&](const char* name) {
    return std::ranges::find(figures, name, &Figure::name) != figures.end();
  };
  EXPECT_TRUE(has("sensor_force"));
  EXPECT_FALSE(has("foot_force"));
  const auto posture = std::ranges::find(figures, "posture", &Figure::name);
  ASSERT_NE(posture, figures.end());
  EXPECT_GE(std::ranges::count(posture->notes, "0.00 s", &Note::text), 1);
  EXPECT_EQ(std::ranges::count(posture->notes, "-0.00 s", &Note::text), 0);
}

}  // namespace
}  // namespace tandem::report
