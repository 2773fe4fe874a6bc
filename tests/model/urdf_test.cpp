#include "tests/model/urdf_fixture.hpp"

#include <cmath>

namespace tandem::model {
namespace {

TEST(Urdf, BecomesATreeOfBodies) {
  const auto model = parse_urdf(kRobot, "arm.urdf", {});
  ASSERT_TRUE(model.has_value()) << errors_of(kRobot);
  const Tree& tree = model->tree;
  EXPECT_TRUE(model->warnings.empty()) << to_text(model->warnings);
  EXPECT_EQ(tree.name, "arm");
  EXPECT_FALSE(tree.floating_base);
  ASSERT_EQ(tree.joints.size(), 2u);
  const Joint& shoulder = tree.joints[0];
  EXPECT_EQ(shoulder.name, "shoulder");
  EXPECT_EQ(shoulder.type, JointType::kRevolute);
  EXPECT_EQ(shoulder.parent, 0);
  EXPECT_EQ(shoulder.axis, Eigen::Vector3d(0, 1, 0));
  EXPECT_EQ(shoulder.in_parent.p, Eigen::Vector3d(0, 0, 1));
  EXPECT_EQ(shoulder.lower, -1.0);
  EXPECT_EQ(shoulder.upper, 2.0);
  EXPECT_EQ(shoulder.velocity, 3.0);
  EXPECT_EQ(shoulder.effort, 4.0);
  EXPECT_EQ(shoulder.line, 23);
  const Joint& slide = tree.joints[1];
  EXPECT_EQ(slide.type, JointType::kPrismatic);
  EXPECT_EQ(slide.parent, 1);
  Eigen::Matrix3d quarter_turn;
  quarter_turn << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  EXPECT_EQ(slide.in_parent.R, quarter_turn) << "right angles are exact";
  ASSERT_EQ(tree.bodies.size(), 3u);
  EXPECT_EQ(tree.bodies[0].inertia.mass_kg, 0.0);
  EXPECT_EQ(tree.bodies[1].inertia.com_m, Eigen::Vector3d(0, 0, -0.5));
  EXPECT_EQ(tree.link_index("tip"), 4);
  EXPECT_EQ(tree.child_link_index("bolt"), 3);
}

TEST(Urdf, MergesWhatIsFixedIntoItsBody) {
  const auto model = parse_urdf(kRobot, "arm.urdf", {});
  ASSERT_TRUE(model.has_value());
  const Tree& tree = model->tree;
  const Inertia& merged = tree.bodies[2].inertia;  // 1 kg at 0, 3 kg at 0.2 m along z
  EXPECT_EQ(merged.mass_kg, 4.0);
  EXPECT_NEAR(merged.com_m.z(), 0.15, 1e-15);
  EXPECT_NEAR(merged.about_com_kg_m2(0, 0), 0.04 + 0.75 * 0.04, 1e-15);
  EXPECT_NEAR(merged.about_com_kg_m2(2, 2), 0.04, 1e-15);
  const Link& tip = tree.links[4];
  EXPECT_EQ(tip.body, 2);
  EXPECT_EQ(tip.moving, -1);
  EXPECT_NEAR(tip.in_body.p.z(), 0.3, 1e-15);
}

TEST(Urdf, LocksAJointAtItsPosition) {
  const auto model = parse_urdf(kRobot, "arm.urdf", {.lock = {{"slide", 0.25}}});
  ASSERT_TRUE(model.has_value());
  const Tree& tree = model->tree;
  ASSERT_EQ(tree.joints.size(), 1u);
  EXPECT_EQ(tree.bodies[1].inertia.mass_kg, 6.0);
  const Placement& lower = tree.links[2].in_body;
  EXPECT_NEAR((lower.p - Eigen::Vector3d(0, -0.25, -1)).norm(), 0.0, 1e-15);
  const auto turned = parse_urdf(kRobot, "arm.urdf", {.lock = {{"shoulder", M_PI / 2}}});
  ASSERT_TRUE(turned.has_value());
  Eigen::Matrix3d about_y;
  about_y << 0, 0, 1, 0, 1, 0, -1, 0, 0;
  EXPECT_EQ(turned->tree.links[1].in_body.R, about_y);
}

// 3.4e-15 off, which the kernels took as exact and other readers of the tree did not.
TEST(Urdf, TakesARightAngleOf14DigitsAsExact) {
  const auto full = parse_urdf(kRobot, "arm.urdf", {});
  const auto rounded =
      parse_urdf(with("rpy=\"1.5707963267948966 0 0", "rpy=\"1.5707963267949 0 0"), "arm.urdf", {});
  ASSERT_TRUE(full && rounded);
  EXPECT_EQ(rounded->tree.joints[1].in_parent.R, full->tree.joints[1].in_parent.R);
  EXPECT_EQ(rounded->right_angles.count, 0);
}

TEST(Urdf, TakesRightAnglesAsTheyAreWrittenAndExactlyOnRequest) {
  std::string few = with("rpy=\"1.5707963267948966 0 0", "rpy=\"1.5708 0 0");
  few = replaced(few, "<axis xyz=\"0 2 0\"/>", "<axis xyz=\"0 2 1e-5\"/>");
  const auto written = parse_urdf(few, "arm.urdf", {});
  const auto exact = parse_urdf(few, "arm.urdf", {.exact_right_angles = true});
  ASSERT_TRUE(written && exact);
  EXPECT_EQ(written->right_angles.count, 2);
  EXPECT_NEAR(written->right_angles.worst_rad, 5e-6, 1e-10);
  EXPECT_EQ(exact->right_angles.count, 2);
  EXPECT_NEAR(written->tree.joints[1].in_parent.R(1, 1), 1.5707963267948966 - 1.5708, 1e-13);
  EXPECT_EQ(exact->tree.joints[1].in_parent.R(1, 1), 0.0);
  EXPECT_EQ(exact->tree.joints[0].axis, Eigen::Vector3d::UnitY());
  // The tip hangs 0.3 m beyond the slide's turn, 1 m below the shoulder's axis.
  const Displacement moved = largest_displacement(written->tree, exact->tree);
  EXPECT_EQ(moved.link, "tip");
  EXPECT_GT(moved.distance_m, 0.3 * 3.673e-6);
  EXPECT_LT(moved.distance_m, 2.0 * 1.3 * (3.674e-6 + 5e-6));
  EXPECT_EQ(parse_urdf(kRobot, "arm.urdf", {})->right_angles.count, 0);
}

TEST(Urdf, CountsAnglesThatAreTooFarOffARightOneToBeTakenForIt) {
  const std::string text = with("rpy=\"1.5707963267948966 0 0", "rpy=\"1.57 0 0.001");
  for (const bool exact : {false, true}) {
    const auto read = parse_urdf(text, "arm.urdf", {.exact_right_angles = exact});
    ASSERT_TRUE(read);
    EXPECT_EQ(read->right_angles.count, 0);
    EXPECT_EQ(read->right_angles.perhaps, 1) << "a small turn is measured, not meant as none";
    EXPECT_NEAR(read->right_angles.perhaps_worst_rad, 7.963e-4, 1e-7);
    EXPECT_EQ(read->right_angles.perhaps_first, "slide");
    EXPECT_NEAR(read->tree.joints[1].in_parent.R(1, 1), std::cos(1.57), 1e-6);
  }
}

TEST(Urdf, GivesAContinuousJointNoLimits) {
  const auto model =
      parse_urdf(replaced(with("shoulder\" type=\"revolute", "shoulder\" type=\"continuous"),
                          "<limit lower=\"-1\" upper=\"2\" velocity=\"3\" effort=\"4\"/>", ""),
                 "arm.urdf", {});
  ASSERT_TRUE(model.has_value());
  EXPECT_EQ(model->tree.joints[0].type, JointType::kContinuous);
  EXPECT_TRUE(std::isinf(model->tree.joints[0].upper));
  EXPECT_TRUE(std::isinf(model->tree.joints[0].velocity));
}

TEST(Urdf, OrdersChildrenByTheirJointsNames) {
  const char* const kTwins = R"(<robot name="twins"><link name="base"/><link name="a"><inertial>
    <mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
    <link name="b"><inertial><mass value="1"/>
    <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
    <joint name="z" type="continuous"><parent link="base"/><child link="a"/></joint>
    <joint name="y" type="continuous"><parent link="base"/><child link="b"/></joint></robot>)";
  const auto model = parse_urdf(kTwins, "twins.urdf", {});
  ASSERT_TRUE(model.has_value());
  EXPECT_EQ(model->tree.joints[0].name, "y");
  EXPECT_EQ(model->tree.joints[1].name, "z");
  EXPECT_EQ(model->tree.joints[1].axis, Eigen::Vector3d(1, 0, 0)) << "URDF's default axis";
}

/// XML allows them wherever an element may be. Lines of errors stay those of the file.
TEST(Urdf, PassesOverProcessingInstructionsAndComments) {
  const std::string robot = R"(<?xml version="1.0"?>
<?xml-stylesheet href="a>b"?>
<robot name="r"><?hint one?><!-- <?not one -->
  <link name="base"><inertial><?keep x="<mass/>"
    y?><!-- a <b> --><mass value="2"/><?keep?><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>
  </inertial></link></robot><?end?>)";
  const auto model = parse_urdf(robot, "r.urdf", {});
  ASSERT_TRUE(model.has_value()) << to_text(model.error());
  EXPECT_EQ(model->tree.links[0].inertia.mass_kg, 2.0);
  std::string wrong = robot;
  wrong.replace(wrong.find("value=\"2\""), 9, "value=\"x\"");
  EXPECT_NE(errors_of(wrong).find(":5: "), std::string::npos) << errors_of(wrong);
  for (const char* open : {"<?cut", "<?xml version=\"1.0\"?>", "<?>"}) {
    std::string bad = robot;
    bad.replace(bad.find("<?keep?>"), 8, open);
    EXPECT_NE(errors_of(bad), "") << open;
  }
}

// --- what cannot be read ---

TEST(Urdf, NamesAMissingFile) {
  const auto model = read_urdf("no/such.urdf", {});
  ASSERT_FALSE(model.has_value());
  EXPECT_EQ(to_text(model.error()),
            "no/such.urdf: cannot read this file (check the path and its permissions)\n");
}

TEST(Urdf, RefusesAFolder) { EXPECT_FALSE(read_urdf(TANDEM_SOURCE_DIR, {}).has_value()); }

TEST(Urdf, RefusesAFileCutInHalf) {
  const std::string half = std::string(kRobot).substr(0, std::string(kRobot).size() / 2);
  EXPECT_NE(errors_of(half).find("not well-formed XML"), std::string::npos);
  EXPECT_NE(errors_of(half).find("may have been cut off"), std::string::npos);
  const auto model = parse_urdf(half, "arm.urdf", {});
  EXPECT_GT(model.error()[0].line, 0);
}

TEST(Urdf, RefusesAnyFileCutAnywhere) {
  const std::string whole = kRobot;
  for (std::size_t size = 0; size + 10 < whole.size(); size += 7) {
    EXPECT_NE(errors_of(whole.substr(0, size)), "") << "cut after " << size << " bytes";
  }
}

TEST(Urdf, RefusesAnEmptyFile) {
  expect_error("",
               "arm.urdf: the file is empty "
               "(restore it from its source)");
}

TEST(Urdf, RefusesAnotherRoot) {
  expect_error("<sdf/>",
               "arm.urdf:1: sdf: the root element is not <robot> "
               "(name a URDF; expand xacro and convert SDF first)");
}

TEST(Urdf, RefusesAZeroByte) {
  EXPECT_NE(errors_of(std::string("<robot\0/>", 9)).find("zero byte"), std::string::npos);
}

// They were "not UTF-8", or silently left out or taken as they are written.
TEST(Urdf, RefusesAReferenceThatStandsForNoCharacter) {
  for (const std::string wrong : {"&#xD800;", "&#x110000;", "&#0;", "&#x1;", "&#xFFFE;", "&#;",
                                  "&#x;", "&#zz;", "&#65x;", "&#x-41;", "&#99999999999;"}) {
    expect_error(with("<link name=\"tip\"/>", "<link name=\"ti" + wrong + "p\"/>"),
                 "arm.urdf:22: the character reference '" + wrong +
                     "' stands for no character (write the character itself, in UTF-8)");
  }
  EXPECT_NE(errors_of(with("<link name=\"tip\"/>", "<link name=\"ti&#65p\"/>"))
                .find("the character reference '&#65p' stands"),
            std::string::npos);
}

TEST(Urdf, TakesReferencesThatStandForCharacters) {
  std::string text = with("<link name=\"tip\"/>",
                          "<!-- &#0; --><link name=\"t&#105;&#x00000000000070;\"/><gazebo>"
                          "<![CDATA[&#zz;]]></gazebo>");
  const auto model = parse_urdf(text, "arm.urdf", {});
  ASSERT_TRUE(model.has_value()) << errors_of(text);
  EXPECT_GE(model->tree.link_index("tip"), 0);
  text = with("name=\"arm\"", "name=\"a &#xFC; &#x1F600; m\"");
  const auto named = parse_urdf(text, "arm.urdf", {});
  ASSERT_TRUE(named.has_value()) << errors_of(text);
  EXPECT_EQ(named->tree.name, "a \xC3\xBC \xF0\x9F\x98\x80 m");
}

TEST(Urdf, RefusesXacro) {
  expect_error("<robot name='x'><xacro:macro/></robot>",
               "arm.urdf:1: xacro:macro: <xacro:macro> is xacro, not URDF "
               "(expand the xacro first: xacro FILE > robot.urdf)");
}

TEST(Urdf, SuggestsTheElementThatWasMeant) {
  expect_error(with("<link name=\"post\"/>", "<link name=\"post\"/><lnik name=\"x\"/>"),
               "arm.urdf:2: lnik: unknown element <lnik> (did you mean <link>?)");
}

TEST(Urdf, WarnsOfAnElementThatItDoesNotKnow) {
  const auto model = parse_urdf(with("<link name=\"post\"/>", "<link name=\"post\"/><soft_body/>"),
                                "arm.urdf", {});
  ASSERT_TRUE(model.has_value());
  EXPECT_EQ(to_text(model->warnings), "arm.urdf:2: the element <soft_body> is not used\n");
}

TEST(Urdf, RefusesARobotWithoutLinks) {
  EXPECT_NE(errors_of("<robot name='x'/>").find("the robot has no link"), std::string::npos);
}

// --- names, attributes, numbers ---

TEST(Urdf, RefusesTwoLinksOfAName) {
  EXPECT_NE(errors_of(with("<link name=\"tip\"/>", "<link name=\"tip\"/><link name=\"upper\"/>"))
                .find("arm.urdf:22: link upper: there is another link of this name at line 3"),
            std::string::npos);
}

TEST(Urdf, RefusesTwoJointsOfAName) {
  EXPECT_NE(errors_of(with("joint name=\"end\"", "joint name=\"bolt\""))
                .find("joint bolt: there is another joint of this name at line 37"),
            std::string::npos);
}

TEST(Urdf, NamesAMissingAttribute) {
  expect_error(with("<mass value=\"2\"/>", "<mass/>"),
               "arm.urdf:6: link upper: <mass> has no attribute 'value' (add it)");
}

TEST(Urdf, NamesAMissingElement) {
  expect_error(with("<child link=\"tip\"/>", ""),
               "arm.urdf:42: joint end: <joint> has no <child> (add it)");
}

TEST(Urdf, RefusesAnElementTwice) {
  expect_error(with("<mass value=\"2\"/>", "<mass value=\"2\"/><mass value=\"3\"/>"),
               "arm.urdf:6: link upper: <inertial> has two <mass> (remove one of them)");
}

TEST(Urdf, RefusesNumbersThatAreNone) {
  expect_error(with("<mass value=\"2\"/>", "<mass value=\"2kg\"/>"),
               "arm.urdf:6: link upper: 'value' of <mass> is no number: '2kg' "
               "(write it as 1.5e-3)");
  EXPECT_NE(errors_of(with("xyz=\"0 0 -0.5\"", "xyz=\"0 0\""))
                .find("'xyz' of <origin> has 2 numbers (give 3)"),
            std::string::npos);
  EXPECT_NE(errors_of(with("xyz=\"0 0 -0.5\"", "xyz=\"\""))
                .find("'xyz' of <origin> has 0 numbers (give 3)"),
            std::string::npos);
}

// The library that interprets inertials left them out for a blank at the end, a tab or a new line,
// and called that no error: a link, or a humanoid's torso, weighed nothing.
TEST(Urdf, TakesAnyWhiteSpaceAroundNumbers) {
  const auto plain = parse_urdf(kRobot, "arm.urdf", {});
  ASSERT_TRUE(plain.has_value());
  const auto same = [&](const std::string& text) {
    const auto model = parse_urdf(text, "arm.urdf", {});
    ASSERT_TRUE(model.has_value()) << text << errors_of(text);
    EXPECT_TRUE(model->warnings.empty()) << to_text(model->warnings);
    for (std::size_t i = 0; i < plain->tree.bodies.size(); ++i) {
      const Inertia &one = plain->tree.bodies[i].inertia, &other = model->tree.bodies[i].inertia;
      EXPECT_EQ(one.mass_kg, other.mass_kg) << text;
      EXPECT_EQ(one.com_m, other.com_m) << text;
      EXPECT_EQ(one.about_com_kg_m2, other.about_com_kg_m2) << text;
    }
    for (std::size_t i = 0; i < plain->tree.joints.size(); ++i) {
      EXPECT_EQ(plain->tree.joints[i].axis, model->tree.joints[i].axis) << text;
      EXPECT_EQ(plain->tree.joints[i].in_parent.p, model->tree.joints[i].in_parent.p) << text;
    }
  };
  const std::string robot = kRobot;
  std::size_t tried = 0;
  for (const std::string name : {"value", "ixx", "izz", "xyz", "rpy"}) {
    const std::string begin = " " + name + "=\"";
    for (std::size_t at = robot.find(begin); at != std::string::npos;
         at = robot.find(begin, at + 1)) {
      const std::size_t from = at + begin.size(), to = robot.find('"', from);
      const std::string value = robot.substr(from, to - from);
      std::string tabs = value;
      std::ranges::replace(tabs, ' ', '\t');
      for (const std::string& written :
           {value + " ", " " + value, value + "\n", "\r\n" + value, tabs, value + "&#9;"}) {
        same(robot.substr(0, from) + written + robot.substr(to));
        ++tried;
      }
    }
  }
  EXPECT_GT(tried, 50U);
}

TEST(Urdf, RefusesWhatIsMisspeltInLinksAndJoints) {
  expect_error(with("<axis xyz=\"0 2 0\"/>", "<axis xyz=\"0 2 0\"/><axes xyz=\"0 1 0\"/>"),
               "arm.urdf:27: joint shoulder: unknown element <axes> in <joint> (did you mean "
               "<axis>?)");
  const std::vector<std::array<const char*, 3>> all{
      {"<link name=\"lower\">\n    <inertial>", "<link name=\"lower\">\n    <inertal>",
       "unknown element <inertal> in <link> (did you mean <inertial>?)"},
      {"<origin xyz=\"0 0 -0.5\"", "<orgin xyz=\"0 0 -0.5\"",
       "unknown element <orgin> in <inertial> (did you mean <origin>?)"},
      {"<origin xyz=\"0 0 -0.5\"", "<origin pos=\"0 0 -0.5\"",
       "unknown attribute 'pos' of <origin> (a place is given by 'xyz' and 'rpy' (roll, pitch, yaw "
       "in rad))"},
      {"<origin xyz=\"0 0 -0.5\"", "<origin xyz=\"0 0 -0.5\" quat_xyzw=\"0 0 0 1\"",
       "unknown attribute 'quat_xyzw' of <origin>"},
      {"<origin xyz=\"0 0 -0.5\"", "<origin xyz=\"0 0 -0.5\" RPY=\"0 0 1\"",
       "unknown attribute 'RPY' of <origin> (did you mean 'rpy'?)"}};
  for (const auto& [from, to, text] : all) {
    std::string robot = with(from, to);
    if (const std::size_t at = robot.find("<inertal>"); at != std::string::npos)
      robot.replace(robot.find("</inertial>", at), 11, "</inertal>");
    EXPECT_NE(errors_of(robot).find(text), std::string::npos) << errors_of(robot);
  }
  EXPECT_NE(errors_of(std::string(kRobot) + "<robot name=\"b\"/>").find("a second root element"),
            std::string::npos);
}

// What simulators and others write into links and joints is named once.
TEST(Urdf, NamesWhatItDoesNotUse) {
  const auto model = parse_urdf(
      with("<axis xyz=\"0 2 0\"/>", "<axis xyz=\"0 2 0\" frame=\"a\"/><gearing/><gearing/>"),
      "arm.urdf", {});
  ASSERT_TRUE(model.has_value());
  EXPECT_EQ(to_text(model->warnings),
            "arm.urdf:27: the attribute 'frame' of <axis> is not used\n"
            "arm.urdf:27: the element <gearing> in <joint> is not used, nor in 1 more place\n");
}

TEST(Urdf, WarnsOfDegrees) {
  const auto model = parse_urdf(with("rpy=\"0 0 0\"", "rpy=\"90 0 0\""), "arm.urdf", {});
  ASSERT_TRUE(model.has_value());
  EXPECT_NE(to_text(model->warnings)
                .find("'rpy' of <origin> is \"90 0 0\": more than a turn "
                      "(angles are in radians)"),
            std::string::npos)
      << to_text(model->warnings);
}

TEST(Urdf, RefusesNumbersThatAreNotFinite) {
  for (const char* bad : {"nan", "inf", "-inf", "1e999", "NaN"}) {
    const std::string errors =
        errors_of(with("<axis xyz=\"0 2 0\"/>", std::string("<axis xyz=\"0 ") + bad + " 0\"/>"));
    EXPECT_NE(errors.find("arm.urdf:27: joint shoulder: 'xyz' of <axis> is not finite"),
              std::string::npos)
        << errors;
  }
}

TEST(Urdf, RefusesAnAxisWithoutLength) {
  EXPECT_NE(errors_of(with("<axis xyz=\"0 2 0\"/>", "<axis xyz=\"0 0 0\"/>"))
                .find("the axis has no length"),
            std::string::npos);
}

/// The tree's joint 0 ("shoulder") or 1 ("slide"), and why its limits are not there.
struct Limits {
  Joint joint;
  std::string note;
};
Limits limits_of(const std::string& text, std::size_t joint) {
  const auto model = parse_urdf(text, "arm.urdf", {});
  EXPECT_TRUE(model.has_value()) << errors_of(text);
  if (!model) return {};
  const Joint& found = model->tree.joints[joint];
  const auto note = model->limits_notes.find(found.name);
  return {found, note == model->limits_notes.end() ? "" : note->second};
}

TEST(Urdf, LeavesLimitsThatAreMissingToTheRobotsFile) {
  const Limits none =
      limits_of(with("<limit lower=\"0\" upper=\"0.5\" velocity=\"1\" effort=\"10\"/>", ""), 1);
  EXPECT_TRUE(std::isnan(none.joint.lower) && std::isnan(none.joint.upper));
  EXPECT_TRUE(std::isnan(none.joint.velocity) && std::isnan(none.joint.effort));
  EXPECT_EQ(none.note, "the joint at arm.urdf:30 has no <limit>");
  const Limits whole = limits_of(kRobot, 1);
  EXPECT_EQ(whole.joint.upper, 0.5);
  EXPECT_EQ(whole.note, "");
}

TEST(Urdf, LeavesLimitsThatMakeNoSenseToTheRobotsFile) {
  const Limits reversed =
      limits_of(with("lower=\"-1\" upper=\"2\"", "lower=\"2\" upper=\"-1\""), 0);
  EXPECT_TRUE(std::isnan(reversed.joint.lower));
  EXPECT_EQ(reversed.joint.velocity, 3.0);
  EXPECT_EQ(reversed.note, "arm.urdf:28: lower is above upper");
  const Limits zero = limits_of(
      with("lower=\"-1\" upper=\"2\" velocity=\"3\" effort=\"4\"", "velocity=\"0\" effort=\"-4\""),
      0);
  EXPECT_TRUE(std::isnan(zero.joint.upper) && std::isnan(zero.joint.velocity));
  EXPECT_EQ(
      zero.note,
      "arm.urdf:28: lower and upper are missing, velocity is not above 0, effort is not above "
      "0");
  EXPECT_EQ(limits_of(with("lower=\"-1\" upper=\"2\"", "lower=\"2\" upper=\"2\""), 0).note,
            "arm.urdf:28: lower and upper are equal");
  const Limits partly = limits_of(with("velocity=\"3\" effort=\"4\"", ""), 0);
  EXPECT_EQ(partly.joint.upper, 2.0);
  EXPECT_EQ(partly.note, "arm.urdf:28: velocity is missing, effort is missing");
}

TEST(Urdf, LocksAJointThatHasNoLimits) {
  EXPECT_EQ(errors_of(with("<limit lower=\"0\" upper=\"0.5\" velocity=\"1\" effort=\"10\"/>", ""),
                      {.lock = {{"slide", 0.7}}}),
            "");
}

// --- joints ---

TEST(Urdf, RefusesPlanarJoints) {
  EXPECT_NE(errors_of(with("shoulder\" type=\"revolute", "shoulder\" type=\"planar"))
                .find("joints of type 'planar' are not supported"),
            std::string::npos);
}

TEST(Urdf, SuggestsTheNearestJointType) {
  EXPECT_NE(errors_of(with("shoulder\" type=\"revolute", "shoulder\" type=\"revolut"))
                .find("unknown joint type 'revolut' (did you mean 'revolute'?)"),
            std::string::npos);
}

TEST(Urdf, SuggestsTheNearestLinkOfAJoint) {
  expect_error(with("<child link=\"tip\"/>", "<child link=\"tipp\"/>"),
               "arm.urdf:42: joint end: there is no link 'tipp', its child (did you mean 'tip'?)");
}

TEST(Urdf, RefusesALinkWithTwoParents) {
  expect_error(with("<child link=\"tip\"/>", "<child link=\"upper\"/>"),
               "arm.urdf:42: link upper: has two parents, by the joints 'shoulder' and 'end': "
               "the description has a loop (remove one of the joints, and close the loop by a "
               "[[loop]] in robot.toml)");
}

TEST(Urdf, RefusesALoop) {
  const std::string errors = errors_of(with("<parent link=\"post\"/>", "<parent link=\"tip\"/>"));
  EXPECT_NE(errors.find("the links make a loop: "), std::string::npos) << errors;
  EXPECT_NE(errors.find("upper <- tip <- weight <- lower <- upper"), std::string::npos) << errors;
}

TEST(Urdf, RefusesTwoRoots) {
  expect_error(with("<link name=\"tip\"/>", "<link name=\"tip\"/>\n<link name=\"lost\"/>"),
               "arm.urdf:23: link lost: no joint leads to it, nor to 'post': the robot has two "
               "roots (connect it by a joint or remove it)");
}

TEST(Urdf, RefusesALockThatCannotBe) {
  const auto lock = [](const std::string& joint, double position) {
    return UrdfOptions{
        .lock = {{joint, position}}, .lock_lines = {{joint, 7}}, .overrides_file = "robot.toml"};
  };
  expect_error(kRobot,
               "robot.toml:7: model.lock.slid: the description has no joint 'slid' to lock "
               "(did you mean 'slide'?)",
               lock("slid", 0.0));
  expect_error(kRobot,
               "robot.toml:7: model.lock.bolt: the joint 'bolt' is fixed in the description "
               "(remove it from [model.lock])",
               lock("bolt", 0.0));
  expect_error(kRobot,
               "robot.toml:7: model.lock.slide: locks the joint at 0.700000, beyond its limits "
               "0.000000 to 0.500000 (lock it within them: arm.urdf:30)",
               lock("slide", 0.7));
}

TEST(Urdf, ReportsSeveralErrorsInTheFilesOrder) {
  const std::string text = replaced(with("<mass value=\"2\"/>", "<mass value=\"x\"/>"),
                                    "<axis xyz=\"0 2 0\"/>", "<axis xyz=\"0 0\"/>");
  const auto model = parse_urdf(text, "arm.urdf", {});
  ASSERT_FALSE(model.has_value());
  ASSERT_EQ(model.error().size(), 2u);
  EXPECT_EQ(model.error()[0].line, 6);
  EXPECT_EQ(model.error()[1].line, 27);
}

}  // namespace
}  // namespace tandem::model
