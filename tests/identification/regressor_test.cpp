// The regressor against inverse dynamics and sensors as the kernels compute them, which is another
// formulation; base parameters against a rank by singular values.
#include "identification/regressor.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <cstdlib>

#include "identification/base_parameters.hpp"
#include "model/dynamics.hpp"
#include "model/urdf.hpp"
#include "tests/model/random_robot.hpp"

namespace tandem::identification {
namespace {

model::Tree random_tree(std::uint64_t seed, const model::RandomRobotOptions& options) {
  const model::RandomRobot robot(seed, options);
  auto read =
      model::parse_urdf(robot.urdf(), "random.urdf", {.floating_base = options.floating_base});
  if (!read) throw std::runtime_error(read.error().front().to_string());
  return std::move(read->tree);
}

model::Tree random_tree(std::uint64_t seed, int most_joints) {
  return random_tree(seed, model::options_of(seed, most_joints));
}

/// The state as the kernels take it.
struct KernelState {
  std::vector<double> q, v, vdot;
};
KernelState kernel_state(const model::Tree& tree, const Instant& at, std::uint64_t& seed) {
  KernelState state;
  if (tree.floating_base) {
    // Any orientation; the acceleration that gives `at.a`, with gravity, in it.
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(static_cast<double>(seed % 628) / 100.0,
                                                    Eigen::Vector3d(1.0, 2.0, -1.0).normalized()));
    const Eigen::Vector3d v(0.3, -0.2, 0.5);
    const Eigen::Vector3d g = turn.inverse() * Eigen::Vector3d(0.0, 0.0, -9.81);
    const Eigen::Vector3d vdot = at.a + g - at.w.cross(v);
    state.q = {0.1, 0.2, 0.3, turn.x(), turn.y(), turn.z(), turn.w()};
    state.v = {v.x(), v.y(), v.z(), at.w.x(), at.w.y(), at.w.z()};
    state.vdot = {vdot.x(), vdot.y(), vdot.z(), at.al.x(), at.al.y(), at.al.z()};
  }
  state.q.insert(state.q.end(), at.q.begin(), at.q.end());
  state.v.insert(state.v.end(), at.v.begin(), at.v.end());
  state.vdot.insert(state.vdot.end(), at.vdot.begin(), at.vdot.end());
  return state;
}

long robots() {
  const char* text = std::getenv("TANDEM_ROBOTS");
  return text == nullptr ? 60 : std::strtol(text, nullptr, 10);
}

TEST(Regressor, EqualsInverseDynamicsOfRandomTrees) {
  for (std::uint64_t seed = 0; seed < static_cast<std::uint64_t>(robots()); ++seed) {
    const model::Tree tree = random_tree(seed, 12);
    model::ModelSpec spec;
    spec.floating_base = tree.floating_base;
    const auto mechanism = model::make_mechanism(tree, spec);
    ASSERT_TRUE(mechanism) << mechanism.error().to_string();
    auto regressor = Regressor::create(tree, {});
    ASSERT_TRUE(regressor) << regressor.error().to_string();
    std::uint64_t random = seed;
    for (int i = 0; i < 3; ++i) {
      const Instant at = random_instant(*regressor, tree, 0, random);
      const KernelState state = kernel_state(tree, at, random);
      const auto tau = model::evaluate_kernel(model::Kernel::kInverseDynamics, *mechanism,
                                              {state.q, state.v, state.vdot, {}});
      Eigen::MatrixXd Y;
      Eigen::VectorXd known;
      regressor->evaluate(at, Y, known);
      const Eigen::VectorXd ours = Y * regressor->described() + known;
      ASSERT_EQ(ours.size(), static_cast<Eigen::Index>(tau[0].size()));
      double largest = 0.0;
      for (const double one : tau[0]) largest = std::max(largest, std::abs(one));
      for (Eigen::Index k = 0; k < ours.size(); ++k)
        EXPECT_NEAR(ours[k], tau[0][static_cast<std::size_t>(k)], 1e-11 * largest)
            << "robot " << seed << ", " << regressor->channels()[static_cast<std::size_t>(k)].name;
    }
  }
}

TEST(Regressor, EqualsWhatSixAxisSensorsOfRandomTreesMeasure) {
  int compared = 0;
  for (std::uint64_t seed = 0; seed < static_cast<std::uint64_t>(robots()); ++seed) {
    const model::Tree tree = random_tree(seed, 10);
    model::ModelSpec spec;
    RegressorSpec ours;
    spec.floating_base = tree.floating_base;
    for (const std::size_t l : {tree.links.size() / 2, tree.links.size() - 1}) {
      const model::Link& link = tree.links[l];
      if (link.parent < 0 || !spec.sensors.empty()) continue;
      // Now in the axes of the far side, now of the near one.
      const std::string frame =
          seed % 2 == 0 ? link.name : tree.links[static_cast<std::size_t>(link.parent)].name;
      spec.sensors.push_back({"s", link.joint, frame});
      ours.sensors.push_back({"s", link.joint, frame});
    }
    if (spec.sensors.empty()) continue;
    const auto mechanism = model::make_mechanism(tree, spec);
    ASSERT_TRUE(mechanism) << mechanism.error().to_string();
    auto regressor = Regressor::create(tree, ours);
    ASSERT_TRUE(regressor) << regressor.error().to_string();
    std::uint64_t random = seed;
    const Instant at = random_instant(*regressor, tree, 1, random);
    const KernelState state = kernel_state(tree, at, random);
    const auto wrench = model::evaluate_kernel(model::Kernel::kSensorWrenches, *mechanism,
                                               {state.q, state.v, state.vdot, {}});
    const Eigen::Map<const Eigen::Matrix<double, 6, 1>> theirs(wrench[0].data());
    Eigen::MatrixXd Y;
    Eigen::VectorXd known;
    regressor->evaluate(at, Y, known);
    const Eigen::VectorXd all = Y * regressor->described() + known;
    EXPECT_LT((all.tail<6>() - theirs).norm(), 1e-10 * (1e-6 + theirs.norm())) << "robot " << seed;
    ++compared;
  }
  EXPECT_GT(compared, robots() / 2);
}

TEST(Regressor, WhereTheGroundActsTheSensorStandsForWhatIsBeyondIt) {
  for (std::uint64_t seed = 0; seed < static_cast<std::uint64_t>(robots()); ++seed) {
    const model::Tree tree = random_tree(seed, 10);
    const model::Link& tip = tree.links.back();
    std::vector<int> path;  // from the tip to the root
    for (int l = static_cast<int>(tree.links.size()) - 1;
         tree.links[static_cast<std::size_t>(l)].parent >= 0;
         l = tree.links[static_cast<std::size_t>(l)].parent)
      path.push_back(l);
    if (path.size() < 2) continue;
    const model::Link& cut = tree.links[static_cast<std::size_t>(path[path.size() / 2])];
    const std::string frame =
        seed % 2 == 0 ? cut.name : tree.links[static_cast<std::size_t>(cut.parent)].name;
    model::ModelSpec spec;
    spec.floating_base = tree.floating_base;
    spec.sites = {{"tip", tip.name, {0.1, 0.0, 0.05}, {}, true}};
    spec.sensors = {{"s", cut.joint, frame}};
    const auto mechanism = model::make_mechanism(tree, spec);
    ASSERT_TRUE(mechanism) << mechanism.error().to_string();
    auto regressor =
        Regressor::create(tree, {.sensors = {{"s", cut.joint, frame}}, .ground_links = {tip.name}});
    ASSERT_TRUE(regressor) << regressor.error().to_string();
    std::uint64_t random = seed;
    Instant at = random_instant(*regressor, tree, 1, random);
    const KernelState state = kernel_state(tree, at, random);
    const std::vector<double> ground{30.0, -20.0, 90.0, 2.0, -1.0, 3.0};
    const auto wrench = model::evaluate_kernel(model::Kernel::kSensorWrenches, *mechanism,
                                               {state.q, state.v, state.vdot, ground});
    const auto tau = model::evaluate_kernel(model::Kernel::kInverseDynamics, *mechanism,
                                            {state.q, state.v, state.vdot, ground});
    at.wrenches[0] = Eigen::Map<const Eigen::Matrix<double, 6, 1>>(wrench[0].data());
    Eigen::MatrixXd Y;
    Eigen::VectorXd known;
    regressor->evaluate(at, Y, known);
    const Eigen::VectorXd ours = Y * regressor->described() + known;
    double largest = 1.0;
    for (const double one : tau[0]) largest = std::max(largest, std::abs(one));
    for (std::size_t c = 0; c < regressor->channels().size(); ++c) {
      const Channel& channel = regressor->channels()[c];
      const std::size_t row =
          channel.kind == Channel::Kind::kBase
              ? static_cast<std::size_t>(channel.component)
              : static_cast<std::size_t>(channel.index) + (tree.floating_base ? 6U : 0U);
      EXPECT_NEAR(ours[static_cast<Eigen::Index>(c)], tau[0][row], 1e-10 * largest)
          << "robot " << seed << ", " << channel.name;
    }
    for (const Piece& piece : regressor->pieces())
      EXPECT_NE(tree.links[static_cast<std::size_t>(piece.link)].name, tip.name);
  }
}

TEST(Regressor, FindsTheBaseMotionFromAFrameOnAnyLink) {
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    const model::Tree tree = random_tree(2 * seed + 1, 8);
    if (!tree.floating_base) continue;
    model::ModelSpec spec;
    spec.floating_base = true;
    spec.sites = {{"imu", tree.links.back().name, {}, {}, false}};
    const auto mechanism = model::make_mechanism(tree, spec);
    ASSERT_TRUE(mechanism) << mechanism.error().to_string();
    auto regressor = Regressor::create(tree, {});
    ASSERT_TRUE(regressor);
    std::uint64_t random = seed;
    Instant at = random_instant(*regressor, tree, 0, random);
    const KernelState state = kernel_state(tree, at, random);
    const auto motion = model::evaluate_kernel(model::Kernel::kSiteMotion, *mechanism,
                                               {state.q, state.v, state.vdot});
    using RowMajor3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
    const Eigen::Matrix3d back = Eigen::Map<const RowMajor3>(motion[0].data()).transpose();
    const auto vector = [&](std::size_t array, std::size_t from) {
      return Eigen::Vector3d(back * Eigen::Map<const Eigen::Vector3d>(&motion[array][from]));
    };
    const Eigen::Vector3d force =
        vector(2, 0) + back * Eigen::Vector3d(0.0, 0.0, 9.81);  // specific
    const Instant wanted = at;
    regressor->base_from_link(static_cast<int>(tree.links.size()) - 1, vector(1, 3), vector(2, 3),
                              force, at);
    EXPECT_LT((at.w - wanted.w).norm(), 1e-10) << seed;
    EXPECT_LT((at.al - wanted.al).norm(), 1e-9) << seed;
    EXPECT_LT((at.a - wanted.a).norm(), 1e-9) << seed;
  }
}

TEST(BaseParameters, OfRandomTreesAreAsManyAsTheRankBySingularValues) {
  for (std::uint64_t seed = 0; seed < static_cast<std::uint64_t>(robots()) / 2; ++seed) {
    // Right angles exactly, and axes nowhere nearly parallel: else the rank is a matter of taste.
    model::RandomRobotOptions options = model::options_of(seed, 7);
    options.near_parallel = 0.0;
    options.digits = 17;
    const model::Tree tree = random_tree(seed, options);
    auto regressor = Regressor::create(tree, {});
    ASSERT_TRUE(regressor);
    const Eigen::MatrixXd X = random_regressor(*regressor, tree, 80, seed);
    const BaseParameters base = base_parameters_of(X);
    Eigen::VectorXd lengths = X.colwise().norm();
    const double least = 1e-12 * lengths.maxCoeff();  // below it is rounding
    for (double& one : lengths) one = one > least ? 1.0 / one : 0.0;
    const Eigen::VectorXd singular =
        Eigen::JacobiSVD<Eigen::MatrixXd>(X * lengths.asDiagonal()).singularValues();
    const auto rank = (singular.array() > 1e-9 * singular[0]).count();
    EXPECT_EQ(base.count(), rank) << "robot " << seed;
    // The combinations explain another motion as well as the parameters themselves do.
    const Eigen::MatrixXd other = random_regressor(*regressor, tree, 10, seed + 1000);
    Eigen::MatrixXd few(other.rows(), base.count());
    for (Eigen::Index i = 0; i < base.count(); ++i)
      few.col(i) = other.col(base.independent[static_cast<std::size_t>(i)]);
    const Eigen::VectorXd p = regressor->described();
    const Eigen::VectorXd whole = other * p;
    EXPECT_LT((few * (base.combination * p) - whole).norm(), 1e-6 * (1e-9 + whole.norm()))
        << "robot " << seed;
  }
}

TEST(BaseParameters, OfAnArmAreAsManyAsTheLiteratureCounts) {
  // Gautier's rule for revolute joints: 7 each after the first, which has 1, the second of an axis
  // perpendicular to a vertical first one 7 less what gravity cannot show; Franka's Panda: 43.
  auto read =
      model::read_urdf(TANDEM_SOURCE_DIR "/config/panda/panda.urdf",
                       {.lock = {{"panda_finger_joint1", 0.02}, {"panda_finger_joint2", 0.02}}});
  ASSERT_TRUE(read) << read.error().front().to_string();
  auto regressor = Regressor::create(read->tree, {});
  ASSERT_TRUE(regressor);
  EXPECT_EQ(base_parameters_of(random_regressor(*regressor, read->tree, 100, 1)).count(), 43);
}

}  // namespace
}  // namespace tandem::identification
