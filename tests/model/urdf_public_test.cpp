// What public descriptions hold: a floating root, xacro's leftovers, dummies, inertias that cannot
// be, damping; and what a robot.toml may say instead.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <sstream>

#include "tests/model/urdf_fixture.hpp"

namespace tandem::model {
namespace {

std::string inertial(const std::string& mass, const std::string& moments) {
  std::string text = "<inertial><mass value=\"" + mass + "\"/><inertia";
  std::istringstream in(moments);
  for (const char* name : {"ixx", "ixy", "ixz", "iyy", "iyz", "izz"}) {
    std::string value;
    in >> value;
    text += std::string(" ") + name + "=\"" + value + "\"";
  }
  return text + "/></inertial>";
}

const std::string kGood = inertial("2", "0.02 0 0 0.02 0 0.02");

/// A trunk that floats from `world`, a dummy and a leg: Romeo's and TIAGo's way of a free base.
std::string walker(const std::string& joint = "floating", const std::string& world = {},
                   const std::string& more = {}) {
  return "<robot name='walker'>\n<link name='world'>" + world + "</link>\n<link name='trunk'>" +
         kGood + "</link>\n<link name='leg'>" + kGood + "</link>\n<joint name='free' type='" +
         joint +
         "'><parent link='world'/><child link='trunk'/></joint>\n"
         "<joint name='hip' type='revolute'><parent link='trunk'/><child link='leg'/>"
         "<limit lower='-1' upper='1' velocity='1' effort='1'/></joint>\n" +
         more +
         "<transmission name='t'><type>SimpleTransmission</type><joint name='hip'/>"
         "</transmission>\n<gazebo reference='leg'><mu1>${friction}</mu1></gazebo>\n</robot>\n";
}

const UrdfOptions kFree{.floating_base = true};

// --- a floating root ---

TEST(UrdfFloating, ARootThatFloatsIsTheFloatingBase) {
  const auto model = parse_urdf(walker(), "walker.urdf", kFree);
  ASSERT_TRUE(model.has_value()) << errors_of(walker(), kFree);
  EXPECT_TRUE(model->warnings.empty()) << to_text(model->warnings);
  EXPECT_TRUE(model->tree.floating_base);
  EXPECT_EQ(model->tree.links[0].name, "trunk");
  EXPECT_EQ(model->tree.links[0].joint, "");
  EXPECT_EQ(model->tree.bodies[0].inertia.mass_kg, 2.0);
  ASSERT_EQ(model->tree.joints.size(), 1u);
  EXPECT_EQ(model->tree.joints[0].name, "hip");
  EXPECT_EQ(model->tree.link_index("world"), -1);
}

TEST(UrdfFloating, IsTheSameTreeAsWithoutTheJoint) {
  std::string plain = replaced(walker(), "<link name='world'></link>\n", "");
  plain = replaced(plain,
                   "<joint name='free' type='floating'><parent link='world'/>"
                   "<child link='trunk'/></joint>\n",
                   "");
  const auto with_joint = parse_urdf(walker(), "walker.urdf", kFree);
  const auto without = parse_urdf(plain, "walker.urdf", kFree);
  ASSERT_TRUE(with_joint.has_value() && without.has_value());
  ASSERT_EQ(with_joint->tree.links.size(), without->tree.links.size());
  for (std::size_t i = 0; i < without->tree.links.size(); ++i) {
    EXPECT_EQ(with_joint->tree.links[i].name, without->tree.links[i].name);
    EXPECT_EQ(with_joint->tree.links[i].body, without->tree.links[i].body);
    EXPECT_EQ(with_joint->tree.links[i].in_body.p, without->tree.links[i].in_body.p);
  }
}

TEST(UrdfFloating, ContradictsAFixedBase) {
  expect_error(walker(),
               "arm.urdf:5: joint free: the joint of type 'floating' lets the base move, but "
               "robot.toml says base = \"fixed\" (set base = \"floating\" in [model], or make the "
               "joint fixed)");
}

TEST(UrdfFloating, WarnsOfAnOriginThatIsNotUsed) {
  const auto model = parse_urdf(
      replaced(walker(), "<child link='trunk'/>", "<child link='trunk'/><origin xyz='0 0 1'/>"),
      "walker.urdf", kFree);
  ASSERT_TRUE(model.has_value());
  EXPECT_EQ(to_text(model->warnings),
            "walker.urdf:5: joint free: the <origin> of the floating joint is not used "
            "(a posture says where the base starts)\n");
}

TEST(UrdfFloating, IsRefusedAnywhereElse) {
  const std::string root =
      "a joint of type 'floating' is understood only from a root without mass to the robot's "
      "base, ";
  expect_error(
      replaced(walker("fixed"), "'hip' type='revolute'", "'hip' type='floating'"),
      "arm.urdf:6: joint hip: " + root +
          "and 'trunk' is not the root (make it fixed, or describe what it carries as a "
          "robot of its own; `tandem new --lock hip` does the one, `--drop` leaves out what "
          "it carries)",
      kFree);
  expect_error(walker("floating", kGood),
               "arm.urdf:5: joint free: " + root +
                   "and 'world' has mass (remove its <inertial>, or remove the link and the joint)",
               kFree);
  expect_error(walker("floating", {},
                      "<link name='mast'/><joint name='post' type='fixed'><parent link='world'/>"
                      "<child link='mast'/></joint>\n"),
               "arm.urdf:5: joint free: " + root +
                   "and other joints leave 'world', too (let them start at 'trunk', or remove "
                   "them)",
               kFree);
}

TEST(UrdfFloating, CannotBeLocked) {
  UrdfOptions options = kFree;
  options.lock = {{"free", 0.0}};
  EXPECT_NE(errors_of(walker(), options).find("the description has no joint 'free' to lock"),
            std::string::npos);
}

// --- xacro ---

TEST(UrdfXacro, NamesTheFirstPlaceAndHowManyThereAre) {
  std::string text = with("<mass value=\"2\"/>", "<mass value=\"${mass}\"/>");
  text = replaced(text, "<mass value=\"3\"/>", "<mass value=\"${2 * mass}\"/>");
  expect_error(text,
               "arm.urdf:6: link upper: '${mass}' was left by xacro, as in one more place "
               "(expand the xacro first: xacro FILE > robot.urdf)");
}

TEST(UrdfXacro, FindsItInNamesArgumentsAndElements) {
  for (const auto& [from, to] : std::vector<std::pair<std::string, std::string>>{
           {"<link name=\"tip\"/>", "<link name=\"${prefix}tip\"/>"},
           {"<axis xyz=\"0 2 0\"/>", "<axis xyz=\"$(arg axis)\"/>"},
           {"<link name=\"post\"/>",
            "<xacro:property name=\"m\" value=\"1\"/><link name=\"post\"/>"},
           {"<link name=\"post\"/>", "<link name=\"post\"><xacro:insert_block name=\"i\"/></link>"},
           {"<link name=\"post\"/>", "<xacro:include filename=\"$(find a)/b.xacro\"/>"}}) {
    const std::string errors = errors_of(with(from, to));
    EXPECT_NE(errors.find("expand the xacro first"), std::string::npos) << errors;
    EXPECT_EQ(std::ranges::count(errors, '\n'), 1) << errors;
  }
}

TEST(UrdfXacro, LeavesVisualsAlone) {
  EXPECT_EQ(errors_of(with("<link name=\"post\"/>",
                           "<link name=\"post\"><visual><geometry><mesh filename=\"$(find a)/b\"/>"
                           "</geometry></visual></link>")),
            "");
}

// --- damping ---

TEST(UrdfDynamics, SaysHowManyJointsDampingIsNotUsed) {
  std::string text = with("effort=\"4\"/>", "effort=\"4\"/>\n<dynamics damping=\"3\"/>");
  text = replaced(text, "effort=\"10\"/>", "effort=\"10\"/><dynamics friction=\"0.1\"/>");
  const auto model = parse_urdf(text, "arm.urdf", {});
  ASSERT_TRUE(model.has_value());
  EXPECT_EQ(to_text(model->warnings),
            "arm.urdf:29: dynamics: the damping and friction of 2 joints (<dynamics>) is not used: "
            "a joint's are its actuator's (damping_Nms_rad and friction_Nm of [actuator.NAME] in "
            "robot.toml)\n");
  const auto none = parse_urdf(
      with("effort=\"4\"/>", "effort=\"4\"/>\n<dynamics damping=\"0.0\" friction=\"0\"/>"),
      "arm.urdf", {});
  EXPECT_TRUE(none->warnings.empty());
}

// --- what robot.toml says instead ---

UrdfOptions given(LinkOverride link) {
  link.line = 7;
  return {.links = {std::move(link)}, .overrides_file = "robot.toml"};
}

TEST(UrdfOverride, GivesMassCenterAndInertia) {
  const auto model =
      parse_urdf(kRobot, "arm.urdf",
                 given({.link = "upper",
                        .mass_kg = 5.0,
                        .com_m = {{0.1, 0.2, 0.3}},
                        .inertia_kg_m2 = {{0.03, 0.001, 0.002, 0.04, 0.003, 0.05}}}));
  ASSERT_TRUE(model.has_value());
  const Inertia& upper = model->tree.bodies[1].inertia;
  EXPECT_EQ(upper.mass_kg, 5.0);
  EXPECT_EQ(upper.com_m, Eigen::Vector3d(0.1, 0.2, 0.3));
  Eigen::Matrix3d about_com;
  about_com << 0.03, 0.001, 0.002, 0.001, 0.04, 0.003, 0.002, 0.003, 0.05;
  EXPECT_EQ(upper.about_com_kg_m2, about_com);
}

TEST(UrdfOverride, LeavesWhatItDoesNotGive) {
  const auto model = parse_urdf(kRobot, "arm.urdf", given({.link = "upper", .mass_kg = 5.0}));
  ASSERT_TRUE(model.has_value());
  EXPECT_EQ(model->tree.bodies[1].inertia.mass_kg, 5.0);
  EXPECT_EQ(model->tree.bodies[1].inertia.com_m, Eigen::Vector3d(0, 0, -0.5));
  EXPECT_EQ(model->tree.bodies[1].inertia.about_com_kg_m2(2, 2), 0.01);
}

TEST(UrdfOverride, OfNoMassTakesTheInertiaAway) {
  const auto model = parse_urdf(kRobot, "arm.urdf", given({.link = "lower", .mass_kg = 0.0}));
  ASSERT_TRUE(model.has_value()) << to_text(model.error());
  EXPECT_EQ(model->tree.bodies[2].inertia.mass_kg, 3.0);
  EXPECT_NEAR(model->tree.bodies[2].inertia.about_com_kg_m2(0, 0), 0.03, 1e-15);
}

TEST(UrdfOverride, MendsWhatTheDescriptionHoldsWrong) {
  const std::string negative = with("<mass value=\"3\"/>", "<mass value=\"-3\"/>");
  EXPECT_EQ(errors_of(negative, given({.link = "weight", .mass_kg = 3.0})), "");
  const std::string plate = with("ixx=\"0.03\"", "ixx=\"0.07\"");
  EXPECT_EQ(
      errors_of(plate, given({.link = "weight", .inertia_kg_m2 = {{0.03, 0, 0, 0.03, 0, 0.03}}})),
      "");
}

TEST(UrdfOverride, SuggestsTheNearestLink) {
  expect_error(kRobot,
               "robot.toml:7: model.link.uper: the description has no link 'uper' "
               "(did you mean 'upper'?)",
               given({.link = "uper", .mass_kg = 1.0}));
}

TEST(UrdfOverride, ThatCannotBeIsReportedWhereItStands) {
  EXPECT_EQ(
      errors_of(kRobot, given({.link = "weight", .inertia_kg_m2 = {{0.03, 0, 0, 0.03, 0, 0.09}}}))
          .find("robot.toml:7: model.link.weight: the inertia breaks the triangle"),
      0u);
}

// --- repair ---

const UrdfOptions kRepair{.repair_inertia = true};

/// The inertia of "weight" with these moments, repaired; and what was said.
Inertia repaired_weight(const std::string& mass, const std::string& moments, std::string& said) {
  const std::string text = replaced(
      with("<link name=\"tip\"/>", "<link name=\"tip\">" + inertial(mass, moments) + "</link>"),
      "joint name=\"end\" type=\"fixed\"", "joint name=\"end\" type=\"continuous\"");
  const auto model = parse_urdf(text, "arm.urdf", kRepair);
  EXPECT_TRUE(model.has_value()) << errors_of(text, kRepair);
  if (!model) return {};
  said = to_text(model->warnings);
  return model->tree.bodies[3].inertia;
}

/// Eigenvalues of the second moments J = tr(I)/2 1 - I, ascending.
Eigen::Vector3d second_moments(const Inertia& inertia) {
  const Eigen::Matrix3d& I = inertia.about_com_kg_m2;
  const Eigen::Matrix3d J = 0.5 * I.trace() * Eigen::Matrix3d::Identity() - I;
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(J).eigenvalues();
}

TEST(UrdfRepair, LeavesWhatIsPossibleAsItIs) {
  const auto strict = parse_urdf(kRobot, "arm.urdf", {});
  const auto repair = parse_urdf(kRobot, "arm.urdf", kRepair);
  ASSERT_TRUE(strict.has_value() && repair.has_value());
  EXPECT_TRUE(repair->warnings.empty());
  for (std::size_t i = 0; i < strict->tree.bodies.size(); ++i) {
    EXPECT_EQ(strict->tree.bodies[i].inertia.about_com_kg_m2,
              repair->tree.bodies[i].inertia.about_com_kg_m2);
  }
}

TEST(UrdfRepair, OfABrokenTriangleRaisesTheSecondMomentThatIsNegative) {
  std::string said;
  const Inertia weight = repaired_weight("3", "0.03 0 0 0.03 0 0.07", said);
  // J = diag(0.035, 0.035, -0.005): the last becomes 1e-4 of the largest, 3.5e-6.
  EXPECT_NEAR(second_moments(weight)[0], 3.5e-6, 1e-15);
  EXPECT_NEAR(second_moments(weight)[2], 0.035, 1e-15);
  EXPECT_NEAR(weight.about_com_kg_m2(0, 0), 0.0350035, 1e-15);
  EXPECT_NEAR(weight.about_com_kg_m2(2, 2), 0.07, 1e-15);
  EXPECT_EQ(said,
            "arm.urdf:22: link tip: the inertia breaks the triangle inequality: principal moments "
            "0.03, 0.03, 0.07 kg m^2; taken: 0.035, 0.035, 0.07 kg m^2 "
            "(by inertia = \"repair\" in [model]; correct it in the URDF)\n");
}

TEST(UrdfRepair, IsNearerThanAnyOtherPossibleInertia) {
  Eigen::Matrix3d wrong;
  wrong << 0.03, 0.05, -0.01, 0.05, 0.03, 0.002, -0.01, 0.002, 0.04;
  std::string said;
  const Inertia found = repaired_weight("3", "0.03 0.05 -0.01 0.03 0.002 0.04", said);
  const auto second = [](const Eigen::Matrix3d& I) {
    return Eigen::Matrix3d(0.5 * I.trace() * Eigen::Matrix3d::Identity() - I);
  };
  const Eigen::Matrix3d nearest = second(found.about_com_kg_m2);
  const double distance = (nearest - second(wrong)).norm();
  EXPECT_GE(second_moments(found)[0], 0.0);
  const double floor = second_moments(found)[0];
  std::srand(1);
  for (int i = 0; i < 500; ++i) {  // steps away that stay possible are never nearer
    Eigen::Matrix3d step = Eigen::Matrix3d::Random();
    const Eigen::Matrix3d other = nearest + 1e-3 * (step + step.transpose());
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(other);
    if (solver.eigenvalues()[0] < floor) continue;
    EXPECT_GE((other - second(wrong)).norm(), distance * (1.0 - 1e-12));
  }
}

TEST(UrdfRepair, OfAMassWithoutInertiaIsABallOfAluminium) {
  std::string said;
  const Inertia weight = repaired_weight("1", "0 0 0 0 0 0", said);
  const double radius_m = std::cbrt(3.0 / (4.0 * M_PI * 2700.0));
  EXPECT_NEAR(weight.about_com_kg_m2(0, 0), 0.4 * radius_m * radius_m, 1e-15);
  EXPECT_NE(said.find("principal moments 0, 0, 0 kg m^2; taken: 0.0007939, 0.0007939, 0.0007939"),
            std::string::npos)
      << said;
  const Inertia negative = repaired_weight("1", "-1 0 0 -1 0 -1", said);
  EXPECT_EQ(negative.about_com_kg_m2, weight.about_com_kg_m2);
}

TEST(UrdfRepair, OfAnInertiaWithoutMassDropsIt) {
  const auto model =
      parse_urdf(with("<link name=\"tip\"/>",
                      "<link name=\"tip\">" + inertial("0", "1 0 0 1 0 1") + "</link>"),
                 "arm.urdf", kRepair);
  ASSERT_TRUE(model.has_value()) << to_text(model.error());
  EXPECT_EQ(to_text(model->warnings),
            "arm.urdf:22: link tip: there is an inertia without mass; taken: none "
            "(by inertia = \"repair\" in [model]; correct it in the URDF)\n");
  EXPECT_TRUE(model->tree.links[4].inertia.about_com_kg_m2.isZero(0.0));
}

TEST(UrdfRepair, DoesNotInventAMass) {
  EXPECT_NE(errors_of(with("<mass value=\"3\"/>", "<mass value=\"-3\"/>"), kRepair)
                .find("the mass is negative"),
            std::string::npos);
}

TEST(UrdfInertia, OfWhatIsFixedToTheWorldIsNotJudged) {
  const std::string post = with("<link name=\"post\"/>",
                                "<link name=\"post\">" + inertial("9", "0 0 0 0 0 -7") + "</link>");
  EXPECT_EQ(errors_of(post), "");
  const auto model = parse_urdf(post, "arm.urdf", kRepair);
  ASSERT_TRUE(model.has_value());
  EXPECT_TRUE(model->warnings.empty()) << to_text(model->warnings);
  EXPECT_NE(errors_of(post, {.floating_base = true}), "");
  const std::string light = with(
      "<link name=\"post\"/>", "<link name=\"post\">" + inertial("-9", "1 0 0 1 0 1") + "</link>");
  EXPECT_NE(errors_of(light).find("link post: the mass is negative, -9 kg"), std::string::npos);
}

// --- robots as they are published, in small ---

/// iCub's and Allegro's hand: dummies, a negative eigenvalue, a zero inertia, a mimic, <dynamics>,
/// transmissions.
std::string hand() {
  const std::string limit = "<limit effort='1' velocity='1' lower='0' upper='1'/>";
  return "<robot name='hand'><link name='base_link'/><link name='palm'>" +
         inertial("0.4154", "1e-4 0 0 1e-4 0 1e-4") + "</link><link name='finger'>" +
         inertial("0.0119", "0.65e-6 0 0 0.5e-9 0 0.4e-6") + "</link><link name='tip'>" +
         inertial("0.0168", "0 0 0 0 0 0") + "</link><link name='skew'>" +
         inertial("0.1", "1e-5 2e-5 0 1e-5 0 1e-5") + "</link><link name='dummy'>" +
         inertial("0", "1e-6 0 0 1e-6 0 1e-6") +
         "</link><joint name='root' type='fixed'><parent link='base_link'/><child link='palm'/>"
         "</joint><joint name='j0' type='revolute'><parent link='palm'/><child link='finger'/>" +
         limit +
         "<dynamics damping='3' friction='0.01'/></joint>"
         "<joint name='j1' type='revolute'><parent link='finger'/><child link='tip'/>"
         "<origin xyz='0 0 0.04'/>" +
         limit +
         "<mimic joint='j0' multiplier='1.5'/></joint>"
         "<joint name='j2' type='continuous'><parent link='palm'/><child link='skew'/></joint>"
         "<joint name='j3' type='fixed'><parent link='skew'/><child link='dummy'/></joint>"
         "<transmission name='t'><actuator name='m'/></transmission></robot>";
}

TEST(UrdfRepair, MakesAPublishedHandUsable) {
  const std::string errors = errors_of(hand(), {.mimic_independent = true});
  EXPECT_NE(errors.find("link finger: "), std::string::npos) << errors;
  EXPECT_NE(errors.find("link tip: "), std::string::npos) << errors;
  EXPECT_NE(errors.find("link skew: "), std::string::npos) << errors;
  const auto model =
      parse_urdf(hand(), "hand.urdf", {.mimic_independent = true, .repair_inertia = true});
  ASSERT_TRUE(model.has_value()) << to_text(model.error());
  EXPECT_EQ(std::ranges::count(model->warnings, std::string(kRepaired), &Error::hint), 4);
  for (std::size_t b = 1; b < model->tree.bodies.size(); ++b) {
    EXPECT_GT(second_moments(model->tree.bodies[b].inertia)[0], 0.0) << b;
  }
}

}  // namespace
}  // namespace tandem::model
