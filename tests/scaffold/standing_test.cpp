// The posture that a robot stands in, looked at from its own files.
#include "scaffold/standing.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "model/placements.hpp"
#include "tests/scaffold/robots.hpp"

namespace tandem::scaffold {
namespace {

class StandingRobots : public ::testing::TestWithParam<PublicRobot> {};

Eigen::VectorXd posture_of(const NewRobot& robot) {
  Eigen::VectorXd q(static_cast<Eigen::Index>(robot.tree.joints.size()));
  for (std::size_t j = 0; j < robot.config.joints.size(); ++j) {
    q[robot.tree.joint_index(robot.config.joints[j].name)] =
        robot.config.postures[0].position_rad[j];
  }
  return q;
}

/// Every contact point above the ground.
std::vector<Eigen::Vector3d> points_of(const NewRobot& robot, const Posed& posed) {
  std::vector<Eigen::Vector3d> points;
  for (const FoundFoot& foot : robot.feet) {
    const model::Placement sole = posed.link(foot.link) * foot.sole_in_link;
    for (const Eigen::Vector3d& p : foot.points) {
      points.emplace_back(sole.R * p + sole.p + Eigen::Vector3d(0.0, 0.0, robot.stands_m));
    }
  }
  return points;
}

TEST_P(StandingRobots, TouchTheGroundWithEveryPointOfTheirSoles) {
  const NewRobot robot = made(GetParam());
  EXPECT_TRUE(robot.config.model.floating_base);
  ASSERT_EQ(robot.feet.size(), GetParam().feet);
  const Posed posed(robot.tree, posture_of(robot));
  for (const Eigen::Vector3d& p : points_of(robot, posed)) EXPECT_NEAR(p.z(), 0.0, 2e-4);
}

TEST_P(StandingRobots, GetSitesThatLieAsTheirSolesDo) {
  const NewRobot robot = made(GetParam());
  ASSERT_EQ(robot.config.model.sites.size(), robot.feet.size());
  for (std::size_t i = 0; i < robot.feet.size(); ++i) {
    const hal::SiteConfig& site = robot.config.model.sites[i];
    const model::Placement sole = model::placement_of(site.xyz_m, site.rpy_rad);
    EXPECT_LT((sole.R - robot.feet[i].sole_in_link.R).norm(), 1e-7) << site.name;
    EXPECT_LT((sole.p - robot.feet[i].sole_in_link.p).norm(), 1e-5) << site.name;
  }
}

TEST_P(StandingRobots, KeepTheirMassOverTheirFeetAndTheirJointsWithinLimits) {
  const NewRobot robot = made(GetParam());
  const Eigen::VectorXd q = posture_of(robot);
  const Posed posed(robot.tree, q);
  const Eigen::Vector3d com = posed.whole().com_m;
  // A convex polygon around the centre of mass has corners beyond it in every direction.
  const std::vector<Eigen::Vector3d> points = points_of(robot, posed);
  for (double angle = 0.0; angle < 6.28; angle += 0.1) {
    const Eigen::Vector3d way(std::cos(angle), std::sin(angle), 0.0);
    const double farthest =
        std::ranges::max(points, {}, [&](const Eigen::Vector3d& p) { return p.dot(way); }).dot(way);
    EXPECT_GT(farthest - com.dot(way), 0.02);
  }
  for (Eigen::Index j = 0; j < q.size(); ++j) {
    EXPECT_GT(q[j], robot.tree.joints[j].lower) << robot.tree.joints[j].name;
    EXPECT_LT(q[j], robot.tree.joints[j].upper) << robot.tree.joints[j].name;
  }
}

TEST_P(StandingRobots, AreTheSameEachTime) {
  EXPECT_EQ(robot_text(made(GetParam()), "a.urdf", "a.urdf"),
            robot_text(made(GetParam()), "a.urdf", "a.urdf"));
}

INSTANTIATE_TEST_SUITE_P(, StandingRobots,
                         ::testing::ValuesIn(kPublicRobots.begin() + 3, kPublicRobots.end()),
                         [](const auto& test) { return std::string(test.param.name); });

TEST(Standing, BendsTheKneesOfAQuadrupedToItsMiddle) {
  const NewRobot robot = made(kPublicRobots[3]);
  const Eigen::VectorXd q = posture_of(robot);
  const Posed posed(robot.tree, q);
  const auto x_of = [&](const char* joint) {
    return posed.origin(robot.tree.joint_index(joint)).x();
  };
  EXPECT_LT(x_of("LF_KFE"), x_of("LF_HFE"));
  EXPECT_GT(x_of("LH_KFE"), x_of("LH_HFE"));
  EXPECT_NEAR(q[robot.tree.joint_index("LF_KFE")], q[robot.tree.joint_index("RF_KFE")], 0.02);
}

}  // namespace
}  // namespace tandem::scaffold
