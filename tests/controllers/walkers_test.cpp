// Standing, squatting and weighing on any number of feet, of any shape, with any leg.
#include <Eigen/Dense>
#include <cmath>
#include <ostream>

#include "controllers/stance.hpp"
#include "tests/controllers/harness.hpp"
#include "tests/controllers/walker.hpp"
#include "tests/support/rt_trap.hpp"

namespace tandem {
namespace test {
void PrintTo(const Walker& walker, std::ostream* out) { *out << walker.name; }
}  // namespace test
namespace {

using test::Walker;

const std::vector<std::array<double, 3>> kBall{{0, 0, 0}};
const std::vector<std::array<double, 3>> kBlade{{0.1, 0, 0}, {-0.06, 0, 0}};
const std::vector<std::array<double, 3>> kSole{
    {0.12, 0.05, 0}, {0.12, -0.05, 0}, {-0.06, -0.05, 0}, {-0.06, 0.05, 0}};
const std::vector<test::LegJoint> kThree{{'x', 0, 0}, {'y', 0.4, -0.4}, {'y', 0.4, 0.8}};
const std::vector<test::LegJoint> kSix{{'z', 0, 0},     {'x', 0, 0},      {'y', 0.4, -0.4},
                                       {'y', 0.4, 0.8}, {'y', 0.0, -0.4}, {'x', 0.08, 0}};
const std::vector<test::LegJoint> kSeven{{'z', 0, 0},   {'x', 0, 0},     {'y', 0.2, -0.4},
                                         {'z', 0.2, 0}, {'y', 0.4, 0.8}, {'y', 0.0, -0.4},
                                         {'x', 0.08, 0}};
const std::vector<test::LegJoint> kFive{
    {'x', 0, 0}, {'y', 0.4, -0.4}, {'y', 0.4, 0.8}, {'y', 0.0, -0.4}, {'x', 0.08, 0}};
const std::vector<test::LegJoint> kFour{
    {'x', 0, 0}, {'y', 0.4, -0.4}, {'y', 0.4, 0.8}, {'y', 0.08, -0.4}};
const std::vector<test::LegJoint> kFlat{{'y', 0.4, -0.4}, {'y', 0.4, 0.8}, {'y', 0.08, -0.4}};
const std::vector<test::LegJoint> kTwo{{'y', 0.4, -0.4}, {'y', 0.4, 0.8}};

const std::vector<Walker> kWalkers{
    {"hopper", 1, kThree, kBall, 5},
    {"tripod", 3, kThree, kBall, 11},
    {"quadruped", 4, kThree, kBall, 14},
    {"hexapod", 6, kThree, kBall, 20},
    {"flat_quadruped", 4, kTwo, kBall, 10},  // nothing moves a foot sideways
    {"humanoid", 2, kSix, kSole, 14},
    {"seven_joints", 2, kSeven, kSole, 14},  // one joint a leg is left where it is
    {"five_joints", 2, kFive, kSole, 12},    // the feet may yaw
    {"four_joints", 2, kFour, kSole, 10},    // and roll
    {"flat_biped", 2, kFlat, kSole, 8},      // no sideways either
    {"on_blades", 2, kSix, kBlade, 12},      // the feet may roll about the blade
    {"on_balls", 2, kSix, kBall, 8},
};

class Walkers : public testing::TestWithParam<Walker> {
 protected:
  // The interpreted kernels allocate; generated ones prove the controllers in squat_robots_test.
  void TearDown() override { static_cast<void>(test::take_rt_violations()); }
  test::WalkerRobot one{GetParam()};
  const tandem_kernels& kernels = *one.kernels.get();
  Stance stance =
      Stance::make(hal::robot_of(one.robot), &kernels, foot_names(hal::robot_of(one.robot)))
          .value();
  double height = stance.place(one.robot.postures[0].position_rad);

  /// Two more steps than it needs: to rounding.
  void stand(double down_m) {
    ASSERT_TRUE(stance.solve(height - down_m, 50).converged) << down_m;
    ASSERT_TRUE(stance.solve(height - down_m, 50).converged) << down_m;
  }
  [[nodiscard]] std::vector<FootContact> feet() const {
    return find_feet(hal::robot_of(one.robot), kernels, foot_names(hal::robot_of(one.robot)))
        .value();
  }
};

TEST_P(Walkers, KeepTheirFeetAndTheirBalanceAllTheWayDown) {
  EXPECT_EQ(stance.equations(), GetParam().equations);
  for (int i = 0; i <= 10; ++i) {
    stand(0.01 * i);
    ASSERT_LT(stance.residual(), 1e-9);
    ASSERT_LT(stance.slip_m(), 1e-9);
    double c[3], cdot[3];
    std::vector<double> J(3UL * kernels.nv), rest(kernels.nv);
    kernels.center_of_mass(stance.q().data(), rest.data(), c, cdot, J.data());
    EXPECT_NEAR(c[0], 0.0, 1e-9) << "over the middle of the feet";
    EXPECT_NEAR(c[1], 0.0, 1e-9);
    EXPECT_NEAR(stance.q()[2], height - 0.01 * i, 1e-15);
  }
}

TEST_P(Walkers, MoveAsTheirPositionsChange) {
  const double h = 1e-5;
  stand(0.05 - h);
  const std::vector<double> before(stance.q().begin(), stance.q().end());
  stand(0.05 + h);
  const std::vector<double> after(stance.q().begin(), stance.q().end());
  stand(0.05);
  stance.move(-1.0);
  for (std::size_t i = 6; i < kernels.nv; ++i) {
    EXPECT_NEAR(stance.v()[i], (after[i + 1] - before[i + 1]) / (2 * h), 1e-5) << i;
  }
}

TEST_P(Walkers, AreCarriedByTheirFeetAlone) {
  stand(0.05);
  const std::vector<double> rest(kernels.nv);
  stance.carry(rest);
  // The same once more, with the forces on the points as wrenches on the feet.
  const std::vector<FootContact> all = feet();
  Support support(all);
  std::vector<double> pose(12UL * kernels.sites), twist(6UL * kernels.sites), acc(twist);
  std::vector<double> J(6UL * kernels.nv * kernels.sites), tau(kernels.nv);
  kernels.site_motion(stance.q().data(), rest.data(), rest.data(), pose.data(), twist.data(),
                      acc.data());
  kernels.site_jacobians(stance.q().data(), J.data());
  kernels.bias(stance.q().data(), rest.data(), tau.data());
  support.carry(kernels, stance.q(), pose, J, tau);
  std::vector<double> wrench(6UL * kernels.wrenches);
  double carried = 0.0;
  for (const Support::Point& point : support.points()) {
    EXPECT_GE(point.force_N.z(), 0.0) << "the ground only pushes";
    carried += point.force_N.z();
    const std::size_t site = all[point.foot].site;
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> R(&pose[12 * site]);
    Eigen::Map<Eigen::Vector3d>(&wrench[6 * point.foot]) += R.transpose() * point.force_N;
    Eigen::Map<Eigen::Vector3d>(&wrench[6 * point.foot + 3]) +=
        point.in_site_m.cross(R.transpose() * point.force_N);
  }
  EXPECT_NEAR(carried, kernels.mass_kg * 9.81, 1e-9);
  std::vector<double> with(kernels.nv);
  kernels.inverse_dynamics(stance.q().data(), rest.data(), rest.data(), wrench.data(), with.data());
  for (std::size_t i = 0; i < kernels.nv; ++i) {
    EXPECT_NEAR(with[i], i < 6 ? 0.0 : tau[i], 1e-6) << i << ": nothing is left for the base";
    EXPECT_NEAR(stance.tau()[i], tau[i], 1e-9) << i;
  }
}

TEST_P(Walkers, SquatUnderTheirController) {
  test::Harness run(one.robot, "squat",
                    "depth_m = 0.1\nperiod_s = 0.4\nsettle_s = 0.0\n"
                    "approach_s = 0.1\n",
                    &kernels);
  run.time.period_ns = 5'000'000;
  ASSERT_EQ(run.problem(), "");
  std::ranges::copy(one.robot.postures[0].position_rad, run.state.position_rad().begin());
  run.start();
  EXPECT_EQ(run.run(1.0), Code::kStopped);
}

TEST_P(Walkers, AreWeighedAsTheyStand) {
  stand(0.0);
  stance.carry(std::vector<double>(kernels.nv));
  test::Harness run(one.robot, "gravity_compensation", "ramp_s = 0.001\n", &kernels);
  ASSERT_EQ(run.problem(), "");
  const ModelMap& map = stance.map();
  for (std::size_t j = 0; j < map.joints(); ++j) {
    run.state.position_rad()[j] = stance.q()[map.q_index(j)];
  }
  run.start();
  ASSERT_EQ(run.run(0.003), Code::kOk);
  for (std::size_t j = 0; j < map.joints(); ++j) {
    EXPECT_NEAR(run.command.torque_Nm()[j], stance.tau()[map.v_index(j)], 1e-6) << j;
  }
}

INSTANTIATE_TEST_SUITE_P(Any, Walkers, testing::ValuesIn(kWalkers),
                         [](const auto& made) { return made.param.name; });

/// Feet of one point each at given places on the ground, and a load above them.
class SupportTest : public testing::Test {
 protected:
  struct Load {
    double x_m = 0.0, y_m = 0.0;  // where 100 N press
    double ahead_N = 0.0, yaw_Nm = 0.0;
  };
  static std::vector<Eigen::Vector3d> share(const std::vector<std::array<double, 2>>& places,
                                            const Load& load) {
    std::vector<FootContact> feet;
    std::vector<double> pose;
    for (const auto& at : places) {
      feet.push_back({.name = "foot", .site = feet.size(), .points_m = {{0, 0, 0}}});
      pose.insert(pose.end(), {1, 0, 0, 0, 1, 0, 0, 0, 1, at[0], at[1], 0.0});
    }
    tandem_kernels kernels{};
    kernels.nv = 6;
    std::vector<double> q{0, 0, 0, 0, 0, 0, 1}, J(36 * places.size());
    // What the base needs: a force up, at (x, y).
    std::vector<double> tau{load.ahead_N, 0, 100, 100 * load.y_m, -100 * load.x_m, load.yaw_Nm};
    Support support(feet);
    support.carry(kernels, q, pose, J, tau);
    std::vector<Eigen::Vector3d> forces;
    for (const Support::Point& point : support.points()) forces.push_back(point.force_N);
    return forces;
  }
  const std::vector<std::array<double, 2>> square{{1, 1}, {1, -1}, {-1, 1}, {-1, -1}};
};

TEST_F(SupportTest, AQuadrupedsLoadIsSharedByTheLeastSquaresPlane) {
  const auto forces = share(square, {.x_m = 0.2, .y_m = -0.4});
  // n = 25 (1 + 0.2 x - 0.4 y) solves the three equations with the least sum of squares.
  const double expected[] = {20.0, 40.0, 10.0, 30.0};
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(forces[i].z(), expected[i], 1e-9) << i;
}

TEST_F(SupportTest, ThreeFeetCarryByTheirLevers) {
  const auto forces = share({{0, 0}, {1, 0}, {0, 1}}, {.x_m = 0.5, .y_m = 0.2});
  EXPECT_NEAR(forces[0].z(), 30.0, 1e-9);
  EXPECT_NEAR(forces[1].z(), 50.0, 1e-9);
  EXPECT_NEAR(forces[2].z(), 20.0, 1e-9);
}

TEST_F(SupportTest, NoFootPullsNearTheEdgeOfTheFeet) {
  // The plane would have the two hind feet pull with 15 N.
  const auto forces = share(square, {.x_m = 0.9, .y_m = 0.4});
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Vector2d first = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_GE(forces[i].z(), 0.0) << i;
    sum += forces[i];
    first += forces[i].z() * Eigen::Vector2d(square[i][0], square[i][1]);
  }
  EXPECT_NEAR(sum.z(), 100.0, 1e-9);
  EXPECT_NEAR(first.x(), 90.0, 1e-9);
  EXPECT_NEAR(first.y(), 40.0, 1e-9);
}

TEST_F(SupportTest, ATippingRobotStandsOnItsNearestFeet) {
  const auto forces = share(square, {.x_m = 3.0});
  EXPECT_NEAR(forces[0].z(), 50.0, 1e-9);
  EXPECT_NEAR(forces[1].z(), 50.0, 1e-9);
  EXPECT_EQ(forces[2].z(), 0.0);
  EXPECT_EQ(forces[3].z(), 0.0);
}

TEST_F(SupportTest, ASingleFootCarriesAll) {
  EXPECT_NEAR(share({{0.3, 0.1}}, {.x_m = 0.5})[0].z(), 100.0, 1e-9);
}

TEST_F(SupportTest, PushAndTurnAreSharedAsTheFeetCarry) {
  const Load load{.x_m = 0.2, .y_m = -0.4, .ahead_N = 12.0, .yaw_Nm = 7.0};
  const auto forces = share(square, load);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double yaw_Nm = 0.0;
  for (std::size_t i = 0; i < 4; ++i) {
    sum += forces[i];
    yaw_Nm += square[i][0] * forces[i].y() - square[i][1] * forces[i].x();
  }
  EXPECT_NEAR(sum.x(), 12.0, 1e-9);
  EXPECT_NEAR(sum.y(), 0.0, 1e-9);
  EXPECT_NEAR(yaw_Nm, 7.0, 1e-9);
}

TEST(Feet, HaveTheShapeOfTheirPoints) {
  const auto shape = [](std::vector<std::array<double, 3>> points) {
    test::WalkerRobot one(Walker{"", 1, kThree, std::move(points)});
    const FootContact foot = find_feet(hal::robot_of(one.robot), *one.kernels.get(),
                                       foot_names(hal::robot_of(one.robot)))
                                 .value()
                                 .front();
    return std::pair{foot.shape, foot.axis};
  };
  EXPECT_EQ(shape(kBall).first, FootShape::kPoint);
  EXPECT_EQ(shape({{0, 0, 0}, {0.004, 0, 0}, {0, 0.004, 0}}).first, FootShape::kPoint);
  EXPECT_EQ(shape(kBlade).first, FootShape::kLine);
  EXPECT_NEAR(std::abs(shape(kBlade).second[0]), 1.0, 1e-12);
  EXPECT_EQ(shape(kSole).first, FootShape::kSurface);
  EXPECT_NEAR(std::abs(shape(kSole).second[2]), 1.0, 1e-12);
}

TEST(Feet, AreRefusedByNameWithWhatToDo) {
  const auto problem = [](const char* parameters, bool feet = true, bool floating = true) {
    test::WalkerRobot one(Walker{"", 4, kThree, kBall});
    if (!feet) one.robot.contact.feet.clear();
    tandem_kernels kernels = *one.kernels.get();
    kernels.floating_base = floating ? 1 : 0;
    return test::Harness(one.robot, "squat",
                         std::string("depth_m = 0.1\nperiod_s = 1.0\n") + parameters, &kernels)
        .problem();
  };
  EXPECT_EQ(problem("", false),
            "the robot has no foot to stand on (give each a [[contact.foot]] in "
            "walker/robot.toml: its site and its points)");
  EXPECT_EQ(problem("feet = ['foot0', 'fooot1']\n"),
            "the robot has no foot 'fooot1' (did you mean 'foot1'?)");
  EXPECT_EQ(problem("feet = ['foot0', 'foot0']\n"), "the foot 'foot0' stands twice (name it once)");
  EXPECT_EQ(problem("", true, false),
            "only a robot with a floating base stands on feet (choose another controller)");
}

}  // namespace
}  // namespace tandem
