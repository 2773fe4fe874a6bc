#include "model/urdf_write.hpp"

#include <gtest/gtest.h>

#include "model/placements.hpp"

namespace tandem::model {
namespace {

Inertia inertia() {
  Inertia result;
  result.mass_kg = 1.5;
  result.com_m = {0.1, 0.0, -0.25};
  result.about_com_kg_m2 = Eigen::Vector3d(1.0, 2.0, 3.0).asDiagonal();
  return result;
}

constexpr const char* kParts[] = {R"(<origin xyz="0.1 0 -0.25" rpy="0 0 0"/>)",
                                  R"(<mass value="1.5"/>)",
                                  R"(<inertia ixx="1" ixy="0" ixz="0" iyy="2" iyz="0" izz="3"/>)"};

TEST(UrdfWrite, KeepsEveryByteThatIsNotAnInertials) {
  const std::string before = R"(<?xml version="1.0"?>
<!-- <link name="arm"><inertial/></link> a > b -->
<robot name='r'>
   <link name = "base" />
	<link
	   name="arm">  <!-- mine -->
	<visual><geometry><box size="1 1 1"></box></geometry></visual>
	  <inertial> <!-- by CAD -->
	    )",
                    after = R"(
	  </inertial>
	</link>
   <joint name="j" type="fixed"><parent link="base"/><child link="arm"/></joint>
</robot>
)";
  const std::string old =
      R"(<inertia ixx="9" ixy="0" ixz="0" iyy="9" iyz="0" izz="9"></inertia><mass
	      value='2'/>   <origin rpy="1 2 3"/>)";
  const auto written = with_inertias(before + old + after, {{"arm", inertia()}});
  ASSERT_TRUE(written) << written.error().to_string();
  EXPECT_EQ(*written, before + kParts[2] + kParts[1] + "   " + kParts[0] + after);
}

TEST(UrdfWrite, AddsWhatIsMissing) {
  const std::string inner = std::string("\n    <inertial>\n      ") + kParts[0] + "\n      " +
                            kParts[1] + "\n      " + kParts[2] + "\n    </inertial>";
  const auto written = [](const std::string& link) {
    const auto text = with_inertias("<robot>\n  " + link + "\n</robot>", {{"a<b", inertia()}});
    return text ? *text : text.error().to_string();
  };
  const auto robot = [](const std::string& link) { return "<robot>\n  " + link + "\n</robot>"; };
  EXPECT_EQ(written("<link name='a&lt;b'/>"),
            robot("<link name='a&lt;b'>" + inner + "\n  </link>"));
  EXPECT_EQ(written("<link name='a&lt;b'>\n  </link>"),
            robot("<link name='a&lt;b'>" + inner + "\n  </link>"));
  EXPECT_EQ(written("<link name='a&lt;b'>\n    <inertial/>\n  </link>"),
            robot("<link name='a&lt;b'>" + inner + "\n  </link>"));
  EXPECT_EQ(written("<link name='a&lt;b'>\n    <inertial>\n    </inertial>\n  </link>"),
            robot("<link name='a&lt;b'>" + inner + "\n  </link>"));
}

TEST(UrdfWrite, NamesALinkThatIsNotThere) {
  const auto written = with_inertias("<robot><link name='a'/></robot>", {{"b", inertia()}});
  ASSERT_FALSE(written);
  EXPECT_NE(written.error().to_string().find("'b'"), std::string::npos);
  EXPECT_FALSE(with_inertias("<robot><link></robot>", {}));
}

TEST(UrdfWrite, LeavesOutALimbByItsLinkOrItsJoint) {
  const std::string head = "<robot name='r'>\n  <link name='base'/>\n  <link name='arm'/>\n",
                    tool = "  <link name='tool'>\n  </link>\n  <link name='tip'/>\n",
                    arm =
                        "  <joint name='j' type='fixed'><parent link='base'/><child link='arm'/>"
                        "</joint>\n",
                    rest =
                        "  <joint name='t' type='fixed'><parent link='arm'/><child link='tool'/>"
                        "</joint>\n  <joint name='u' type='fixed'><parent link='tool'/><child "
                        "link='tip'/></joint>\n",
                    end = "  <link name='other'/><gazebo/>\n</robot>\n";
  const std::string robot = head + tool + arm + rest + end;
  for (const char* name : {"tool", "t"}) {
    const auto left = without_limbs(robot, {name});
    ASSERT_TRUE(left) << left.error().to_string();
    EXPECT_EQ(*left, head + arm + end) << name;
  }
  EXPECT_EQ(without_limbs(robot, {"t", "tip", "tool"}).value_or(""), head + arm + end);
  EXPECT_EQ(without_limbs(robot, {"base"}).error().message,
            "'base' is the root: nothing would be left");
  EXPECT_EQ(without_limbs(robot, {"tol"}).error().hint, "did you mean 'tool'?");
}

TEST(UrdfWrite, LeavesNoFollowerWithoutItsLeader) {
  const std::string left =
      "<joint name='l' type='revolute'><parent link='b'/><child link='lf'/></joint>";
  const std::string right =
      "<joint name='r' type='revolute'><parent link='b'/><child link='rf'/><mimic "
      "joint='l'/></joint>";
  const std::string robot = "<robot name='g'><link name='b'/><link name='lf'/><link name='rf'/>" +
                            left + right + "</robot>";
  const auto refused = without_limbs(robot, {"lf"});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().message, "joint 'r' mimics joint 'l', which goes away");
  EXPECT_NE(refused.error().hint.find("--drop r"), std::string::npos);
  EXPECT_EQ(without_limbs(robot, {"lf"}, {"r"}).value_or(""),
            "<robot name='g'><link name='b'/><link name='rf'/><joint name='r' "
            "type='revolute'><parent link='b'/><child link='rf'/></joint></robot>");
  EXPECT_TRUE(without_limbs(robot, {"rf"})) << "a leader needs no follower";
  EXPECT_TRUE(without_limbs(robot, {"l", "r"}));
}

TEST(UrdfWrite, FixesAJointWhereItStands) {
  const std::string head = "<robot name='r'>\n  <link name='a'/>\n  <link name='b'/>\n  ",
                    tail = "\n  <link name='c'/>\n</robot>\n";
  const std::string joint =
      "<joint type='revolute' name='a&lt;b'><child link='b'/><origin xyz='9 9 9'/>\n"
      "    <parent link='a' ></parent><mimic joint='x'/><limit lower='0'/></joint>";
  Placement at;
  at.p = {0.1, -0.0, -0.25};
  at.R = Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const auto fixed = with_fixed(head + joint + tail, {{"a<b", at}});
  ASSERT_TRUE(fixed) << fixed.error().to_string();
  EXPECT_EQ(*fixed, head +
                        "<joint name=\"a&lt;b\" type=\"fixed\">\n"
                        "    <origin xyz=\"0.1 0 -0.25\" rpy=\"0 0 0.5\"/>\n"
                        "    <parent link='a' ></parent>\n    <child link='b'/>\n  </joint>" +
                        tail);
  EXPECT_EQ(with_fixed(head + joint + tail, {}).value_or(""), head + joint + tail);
  EXPECT_EQ(with_fixed(head + joint + tail, {{"d", at}}).error().message,
            "the description has no joint 'd'");
  EXPECT_FALSE(with_fixed(head + "<joint name='j'><parent link='a'/></joint>" + tail, {{"j", at}}));
  EXPECT_FALSE(with_fixed("<robot><joint></robot>", {}));
}

// Also where the pitch is a right angle, and yaw and roll are one.
TEST(UrdfWrite, WritesEveryDirectionAsItIsRead) {
  for (const double pitch : {-1.2, 0.0, 0.7, M_PI / 2, -M_PI / 2}) {
    for (const double roll : {-2.0, 0.0, 0.3}) {
      const Placement whole = placement_of({}, {roll, pitch, 2.5});
      const Placement again = placement_of({}, rpy_of(whole.R));
      EXPECT_TRUE(again.R.isApprox(whole.R, 1e-12)) << roll << ' ' << pitch;
    }
  }
}

}  // namespace
}  // namespace tandem::model
