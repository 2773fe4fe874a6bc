#include <functional>

#include "base/bounds.hpp"
#include "model/urdf.hpp"
#include "tests/support/little_room.hpp"

namespace tandem::model {
namespace {

const std::string kMass =
    "<inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/>"
    "</inertial>";

std::string copies_of(std::size_t count, const std::function<std::string(std::size_t)>& one) {
  std::string text;
  for (std::size_t i = 0; i < count; ++i) text += one(i);
  return text;
}

std::string in_robot(const std::string& text) {
  return "<robot name='r'>\n<link name='l0'/>\n" + text + "</robot>";
}

/// A tree of joints, each below another.
std::string tree_of(std::size_t count) {
  return in_robot(copies_of(count, [](std::size_t i) {
    const std::string own = std::to_string(i + 1), above = std::to_string(i / 2);
    return "<link name='l" + own + "'>" + kMass + "</link><joint name='j" + own +
           "' type='continuous'><parent link='l" + above + "'/><child link='l" + own +
           "'/><axis xyz='0 0 1'/></joint>\n";
  }));
}

Diagnostics met_in(const std::string& text) {
  const auto read = parse_urdf(text, "robot.urdf", {});
  return read ? Diagnostics{} : read.error();
}

std::string first_met(const std::string& text) {
  const Diagnostics errors = met_in(text);
  return errors.empty() ? "" : errors.front().to_string();
}

TEST(UrdfBounds, RefuseWhatIsDeepLongOrManyAtItsLine) {
  const auto same = [](const std::string& text) { return [text](std::size_t) { return text; }; };
  EXPECT_EQ(first_met(in_robot(copies_of(100, same("<b>")))),
            "robot.urdf:3: has more than 64 levels of elements (no more is read)");
  EXPECT_EQ(first_met(in_robot("<link name='" + std::string(70'000, 'x') + "'/>")),
            "robot.urdf:3: has more than 65536 bytes in a tag (no more is read)");
  EXPECT_EQ(first_met(in_robot("<link name='" + std::string(300, 'x') + "'/>")),
            "robot.urdf:3: link: has more than 256 bytes in a name (no more is read)");
  EXPECT_EQ(
      first_met(in_robot(
          "\n<a " +
          copies_of(65, [](std::size_t i) { return " a" + std::to_string(i) + "='=>='"; }) + "/>")),
      "robot.urdf:4: has more than 64 attributes of an element (no more is read)");
  EXPECT_EQ(first_met(in_robot(copies_of(150'001, same("<b c='1'/>")))),
            "robot.urdf:3: has more than 300000 elements and attributes (no more is read)");
}

TEST(UrdfBounds, CountTheJointsThatMoveAndTheLinks) {
  EXPECT_EQ(first_met(tree_of(300)), "");
  EXPECT_EQ(first_met(tree_of(301)),
            "robot.urdf:303: joint j301: has more than 300 joints that move (no more is read)");
  const std::string links = in_robot(copies_of(
      5'000, [](std::size_t i) { return "<link name='m" + std::to_string(i) + "'/>\n"; }));
  EXPECT_EQ(first_met(links), "robot.urdf:5002: has more than 5000 links (no more is read)");
}

/// What stands in comments, texts and quotes is neither a level nor an element.
TEST(UrdfBounds, LeaveWhatIsNoElement) {
  const std::string tags(1'000, '<');
  EXPECT_EQ(
      first_met(in_robot(
          "<!-- " + tags + "--><gazebo><![CDATA[" + tags + "]]></gazebo><material name='>>>'/>" +
          copies_of(100, [](std::size_t) { return "<a><b/></a>"; }) + "<link name='l1'>" + kMass +
          "</link><joint name='j' type='continuous'>"
          "<parent link='l0'/><child link='l1'/><axis xyz='0 0 1'/></joint>")),
      "");
}

/// A hundred megabytes took 6.6 GB, 3,000 joints most of a minute.
TEST(UrdfBounds, HoldBeforeMemoryIsTaken) {
  const std::string attribute = in_robot("<a b='" + std::string(100 << 20, ' ') + "'/>");
  EXPECT_IN_LITTLE_ROOM(met_in(attribute).size() == 1);
  const std::string elements = in_robot(copies_of(5'000'000, [](std::size_t) { return "<a/>"; }));
  EXPECT_IN_LITTLE_ROOM(met_in(elements).size() == 1);
  EXPECT_IN_LITTLE_ROOM(met_in(tree_of(3'000)).size() == 1);
}

TEST(UrdfBounds, OfErrorsListSomeAndCountTheRest) {
  const Diagnostics errors = met_in(in_robot(
      "<link name='a'>" + copies_of(20'000, [](std::size_t) { return "<visuall/>"; }) + "</link>"));
  ASSERT_EQ(errors.size(), bounds::kErrors.most + 1);
  EXPECT_EQ(errors.back().message, "19950 more are not listed");
}

}  // namespace
}  // namespace tandem::model
