// Limbs that are built alike, found and put into lanes: on robots at hand, and on random limbs and
// what they are in a mirror.
#include "model/lanes.hpp"

#include <gtest/gtest.h>

#include <fmt/format.h>

#include <cstdlib>

#include "model/kernel_build.hpp"
#include "tests/model/random_robot.hpp"
#include "tests/model/reference.hpp"
#include "tests/support/scratch_folder.hpp"

namespace tandem::model {
namespace {

// Seen in a mirror in the plane y = 0.
const Eigen::Vector3d kMirror{1.0, -1.0, 1.0};
Placement mirrored(const Placement& placement) {
  return {kMirror.asDiagonal() * placement.R * kMirror.asDiagonal(),
          kMirror.asDiagonal() * placement.p};
}
Inertia mirrored(const Inertia& inertia) {
  return {inertia.mass_kg, kMirror.asDiagonal() * inertia.com_m,
          kMirror.asDiagonal() * inertia.about_com_kg_m2 * kMirror.asDiagonal()};
}

// A random limb on a floating body, and after it the same limb in a mirror.
Tree with_its_mirror(std::uint64_t seed, const RandomRobotOptions& options) {
  const RandomRobot robot(seed, options);
  auto read = parse_urdf(robot.urdf(), "random.urdf", {.floating_base = true});
  if (!read) throw std::runtime_error(read.error().front().to_string());
  Tree tree = std::move(read->tree);
  const std::size_t joints = tree.joints.size();
  const std::size_t links = tree.links.size();
  for (std::size_t j = 0; j < joints; ++j) {
    Joint joint = tree.joints[j];
    joint.name += "_mirrored";
    joint.parent += joint.parent == 0 ? 0 : static_cast<int>(joints);
    joint.in_parent = mirrored(joint.in_parent);
    // Whichever way round it is written, it is the same joint.
    const double sign = j % 2 == 0 ? 1.0 : -1.0;
    joint.axis = sign * (kMirror.asDiagonal() * joint.axis);
    tree.joints.push_back(joint);
    Body body = tree.bodies[j + 1];
    body.name += "_mirrored";
    body.inertia = mirrored(body.inertia);
    tree.bodies.push_back(body);
  }
  for (std::size_t l = 1; l < links; ++l) {
    Link link = tree.links[l];
    if (link.body == 0) continue;
    link.name += "_mirrored";
    link.joint += "_mirrored";
    link.body += static_cast<int>(joints);
    link.in_body = mirrored(link.in_body);
    link.inertia = mirrored(link.inertia);
    link.parent =
        tree.link_index(tree.links[static_cast<std::size_t>(link.parent)].name + "_mirrored");
    link.moving += link.moving < 0 ? 0 : static_cast<int>(joints);
    tree.links.push_back(link);
  }
  return tree;
}

// No axes that are parallel but for rounding: that of the mirrored limb has other last bits, which
// may be one more turn to make.
constexpr RandomRobotOptions kLimb{.joints = 7,
                                   .floating_base = true,
                                   .branching = 0.2,
                                   .near_parallel = 0.0,
                                   .right_angles = 1.0,
                                   .digits = 17,
                                   .mass_decades = 1.0};

TEST(LimbPairs, OfARandomLimbAndItsMirrorAreAllTheirJoints) {
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    const Tree tree = with_its_mirror(seed, kLimb);
    const int joints = static_cast<int>(tree.joints.size()) / 2;
    int paired = 0;
    for (const LimbPair& pair : find_limb_pairs(tree)) {
      ASSERT_EQ(pair.first.size(), pair.second.size());
      for (std::size_t k = 0; k < pair.first.size(); ++k, ++paired)
        EXPECT_EQ(pair.second[k] - pair.first[k], joints) << "seed " << seed;
    }
    EXPECT_EQ(paired, joints) << "seed " << seed;
  }
}

TEST(LimbPairs, NeedMassesThatDifferByATenthAtMost) {
  Tree tree = with_its_mirror(3, kLimb);
  const auto joints_in_pairs = [&] {
    std::size_t count = 0;
    for (const LimbPair& pair : find_limb_pairs(tree)) count += pair.first.size();
    return count;
  };
  ASSERT_EQ(joints_in_pairs(), tree.joints.size() / 2);
  tree.bodies.back().inertia.mass_kg *= 1.09;
  EXPECT_EQ(joints_in_pairs(), tree.joints.size() / 2);
  tree.bodies.back().inertia.mass_kg *= 1.09;
  EXPECT_LT(joints_in_pairs(), tree.joints.size() / 2);
}

struct Kernels {
  Mechanism m;
  explicit Kernels(const std::string& robot) {
    const ReferenceRobot& reference = reference_robot(robot);
    m = *make_mechanism(reference_tree(reference), reference_spec(reference));
  }
  explicit Kernels(Mechanism mechanism) : m(std::move(mechanism)) {}
  EmittedKernel emit(Kernel kernel) const {
    Graph graph;
    const TracedKernel traced = trace_kernel(kernel, m, graph);
    SineTable sines;
    return emit_kernel(graph, traced, m, sines, 500);
  }
  // Instructions left, of each operation without lanes.
  double left(Kernel kernel) const {
    const OperationCount count = emit(kernel).count;
    return 1.0 - count.pairs / static_cast<double>(count.add + count.mul + count.div + count.sqrt);
  }
};

TEST(Lanes, HoldTheLimbsOfTheRobotsThatHaveThem) {
  const Kernels coman("coman");
  EXPECT_LT(coman.left(Kernel::kForwardDynamics), 0.60);
  EXPECT_LT(coman.left(Kernel::kInverseDynamics), 0.60);
  EXPECT_LT(coman.left(Kernel::kMassMatrix), 0.55);
  const Kernels walkman("walkman");
  EXPECT_LT(walkman.left(Kernel::kForwardDynamics), 0.60);
  EXPECT_LT(walkman.left(Kernel::kMassMatrix), 0.57);
  // Two legs share what the other two round apart.
  EXPECT_LT(Kernels("anymal_c").left(Kernel::kForwardDynamics), 0.57);
  const Kernels icub("icub");  // axes of one limb are off by 1e-9 rad
  EXPECT_LT(icub.left(Kernel::kForwardDynamics), 0.68);
  EXPECT_LT(icub.left(Kernel::kMassMatrix), 0.70);
}

// A body on four legs that are equal but for signs, to the last digit.
Tree equal_legs() {
  std::string urdf = R"(<robot name="legs"><link name="base"><inertial><mass value="20"/>
      <inertia ixx="0.5" iyy="1.1" izz="1.3" ixy="0" ixz="0" iyz="0"/></inertial></link>)";
  const auto body = [](const std::string& name, double mass, double x, double y, double z) {
    return fmt::format(R"(<link name="{}"><inertial><origin xyz="{} {} {}"/><mass value="{}"/>
        <inertia ixx="{}" iyy="{}" izz="{}" ixy="0" ixz="0" iyz="0"/></inertial></link>)",
                       name, x, y, z, mass, 0.011 * mass, 0.012 * mass, 0.005 * mass);
  };
  const auto joint = [](const std::string& name, const std::string& parent, const char* axis,
                        const std::string& origin) {
    return fmt::format(R"(<joint name="{0}_joint" type="revolute"><parent link="{1}"/>
        <child link="{0}"/><origin {2}/><axis xyz="{3}"/>
        <limit lower="-3" upper="3" effort="40" velocity="20"/></joint>)",
                       name, parent, origin, axis);
  };
  for (const int front : {1, -1}) {
    for (const int left : {1, -1}) {
      const std::string leg = fmt::format("{}_{}", front > 0 ? "front" : "hind", left);
      urdf += body(leg + "_hip", 1.2, 0.02 * front, 0.03 * left, 0.001) +
              body(leg + "_thigh", 2.1, 0.01, 0.02 * left, -0.1) +
              body(leg + "_shank", 0.4, 0.015, 0.0, -0.14) +
              joint(leg + "_hip", "base", "1 0 0",
                    fmt::format(R"(xyz="{} {} 0.02" rpy="0 0 {}")", 0.31 * front, 0.11 * left,
                                0.5 * front * left)) +
              joint(leg + "_thigh", leg + "_hip", "0 1 0",
                    fmt::format(R"(xyz="{} {} 0")", 0.05 * front, 0.08 * left)) +
              joint(leg + "_shank", leg + "_thigh", "0 1 0", R"(xyz="0 0 -0.29")");
    }
  }
  auto read = parse_urdf(urdf + "</robot>", "legs.urdf", {.floating_base = true});
  if (!read) throw std::runtime_error(read.error().front().to_string());
  return std::move(read->tree);
}

TEST(Lanes, HoldLegsThatAreEqualAndShareAcross) {
  const Kernels legs(*make_mechanism(equal_legs(), {}));
  ASSERT_EQ(legs.m.limbs.size(), 2u);
  EXPECT_LT(legs.left(Kernel::kForwardDynamics), 0.60);
  EXPECT_LT(legs.left(Kernel::kInverseDynamics), 0.60);
}

bool has(const EmittedKernel& kernel, const std::string& word) {
  for (const std::string& part : kernel.parts)
    if (part.find(word) != std::string::npos) return true;
  return false;
}

TEST(Lanes, AreNotWrittenForRobotsWithoutSuchLimbs) {
  for (const char* robot : {"double_pendulum", "ur5e"}) {
    const Kernels kernels(robot);
    EXPECT_TRUE(kernels.m.limbs.empty()) << robot;
    EXPECT_FALSE(has(kernels.emit(Kernel::kForwardDynamics), "two")) << robot;
  }
}

// A vector's second lane is held with the sign that its uses want: none of them changes it.
TEST(Lanes, HaveTheSignsThatTheirUsesNeed) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Kernels random(*make_mechanism(with_its_mirror(seed, kLimb), {}));
    for (const Kernel kernel : {Kernel::kForwardDynamics, Kernel::kMassMatrix}) {
      EXPECT_TRUE(has(random.emit(kernel), "two")) << "seed " << seed;
      EXPECT_FALSE(has(random.emit(kernel), "flip(")) << "seed " << seed;
      EXPECT_LT(random.left(kernel), 0.72) << "seed " << seed;
    }
  }
}

// Builds the library, which compares every kernel with the algorithms on the described frames.
TEST(Lanes, ComputeWhatTheDescriptionsOfRandomMirroredRobotsSay) {
  const test::ScratchFolder folder;
  const char* robots = std::getenv("TANDEM_MIRRORED");
  const std::uint64_t count = robots == nullptr ? 3 : std::strtoull(robots, nullptr, 10);
  for (std::uint64_t seed = 0; seed < count; ++seed) {
    const std::string library = folder / ("random" + std::to_string(seed) + ".so");
    const auto built = build_kernels(
        with_its_mirror(seed, kLimb), {},
        {.library = library, .compiler = {}, .jobs = 0, .progress = {}, .waiting = {}});
    EXPECT_TRUE(built) << built.error().to_string();
  }
}

}  // namespace
}  // namespace tandem::model
