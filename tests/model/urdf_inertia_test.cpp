#include "tests/model/urdf_fixture.hpp"

namespace tandem::model {
namespace {

const char* const kHint =
    "(check the six moments, their signs and their reference point; inertia = \"repair\" in "
    "[model] takes the nearest possible one, and `tandem check --repair` shows it)";

TEST(UrdfInertia, RefusesACentreOfMassInMillimetres) {
  EXPECT_NE(errors_of(with("xyz=\"0 0 -0.5\"", "xyz=\"0 0 -500\""))
                .find("arm.urdf:3: link upper: the centre of mass is 500 m from the link's frame "
                      "(lengths are in metres)"),
            std::string::npos)
      << errors_of(with("xyz=\"0 0 -0.5\"", "xyz=\"0 0 -500\""));
}

TEST(UrdfInertia, RefusesANegativeMass) {
  expect_error(
      with("<mass value=\"3\"/>", "<mass value=\"-3\"/>"),
      "arm.urdf:16: link weight: the mass is negative, -3 kg (masses are zero or positive)");
}

TEST(UrdfInertia, RefusesAMassThatNoRobotHas) {
  expect_error(
      with("<mass value=\"3\"/>", "<mass value=\"3e29\"/>"),
      "arm.urdf:16: link weight: the mass is 3e+29 kg, more than any robot has (masses are "
      "in kilograms)");
}

TEST(UrdfInertia, RefusesAnInertiaInOtherUnits) {
  EXPECT_NE(
      errors_of(with("ixx=\"0.03\"", "ixx=\"30000\"")).find("is that of a body of more than 10 m"),
      std::string::npos);
}

TEST(UrdfInertia, RefusesAnInertiaThatIsNotPositiveDefinite) {
  EXPECT_EQ(errors_of(with("ixx=\"0.03\" ixy=\"0\"", "ixx=\"0.03\" ixy=\"0.05\"")),
            std::string("arm.urdf:16: link weight: the inertia is not positive definite: "
                        "principal moments -0.02, 0.03, 0.08 kg m^2 ") +
                kHint + "\n");
}

TEST(UrdfInertia, RefusesAnInertiaThatBreaksTheTriangleInequality) {
  EXPECT_EQ(errors_of(with("ixx=\"0.03\"", "ixx=\"0.07\"")),
            std::string("arm.urdf:16: link weight: the inertia breaks the triangle inequality: "
                        "principal moments 0.03, 0.03, 0.07 kg m^2 ") +
                kHint + "\n");
}

TEST(UrdfInertia, AcceptsAThinPlateWhoseInertiaIsRounded) {
  EXPECT_EQ(errors_of(with("ixx=\"0.03\"", "ixx=\"0.06000001\"")), "");
}

TEST(UrdfInertia, WarnsOfAnImpossibleInertiaOfANegligibleLink) {
  const auto model = parse_urdf(
      with("<link name=\"tip\"/>",
           "<link name=\"tip\"><inertial><mass value=\"0.01\"/><inertia ixx=\"0\" ixy=\"0\" "
           "ixz=\"0\" iyy=\"0\" iyz=\"0\" izz=\"1e-4\"/></inertial></link>"),
      "arm.urdf", {});
  ASSERT_TRUE(model.has_value());
  ASSERT_EQ(model->warnings.size(), 1u);
  EXPECT_EQ(model->warnings[0].key, "link tip");
  EXPECT_EQ(model->warnings[0].line, 22);
  EXPECT_NEAR(model->tree.bodies[2].inertia.mass_kg, 4.01, 1e-12) << "it is still used";
}

TEST(UrdfInertia, RefusesABodyThatItsNegligibleLinksMakeImpossible) {
  const std::string errors = errors_of(
      with("<link name=\"tip\"/>",
           "<link name=\"tip\"><inertial><mass value=\"0.01\"/><inertia ixx=\"0\" ixy=\"0\" "
           "ixz=\"0\" iyy=\"0\" iyz=\"0\" izz=\"5\"/></inertial></link>"));
  EXPECT_NE(errors.find("link lower: with all that is fixed to it, the inertia breaks the "
                        "triangle inequality"),
            std::string::npos)
      << errors;
}

TEST(UrdfInertia, MergesDummiesOfNoMassAtAll) {
  EXPECT_EQ(
      errors_of(with("<link name=\"tip\"/>",
                     "<link name=\"tip\"><inertial><mass value=\"1e-6\"/><inertia ixx=\"0\" "
                     "ixy=\"0\" ixz=\"0\" iyy=\"0\" iyz=\"0\" izz=\"0\"/></inertial></link>")),
      "");
}

TEST(UrdfInertia, RefusesAMovingJointThatCarriesNoMass) {
  expect_error(
      replaced(with("joint name=\"end\" type=\"fixed\"", "joint name=\"end\" type=\"continuous\""),
               "<origin xyz=\"0 0 0.1\"/>", ""),
      "arm.urdf:42: joint end: the joint moves nothing that has mass "
      "(give link 'tip' mass and inertia, lock the joint or make it fixed; `tandem new` has "
      "--density, --lock and --drop for that)");
}

TEST(UrdfInertia, AcceptsAMasslessLinkBetweenMovingJoints) {
  const char* const kCardan = R"(<robot name="cardan"><link name="base"/><link name="cross"/>
    <link name="bob"><inertial><mass value="1"/>
    <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
    <joint name="x" type="continuous"><parent link="base"/><child link="cross"/></joint>
    <joint name="y" type="continuous"><parent link="cross"/><child link="bob"/>
    <axis xyz="0 1 0"/></joint></robot>)";
  const auto model = parse_urdf(kCardan, "cardan.urdf", {});
  ASSERT_TRUE(model.has_value()) << to_text(model.error());
  EXPECT_EQ(model->tree.bodies[1].inertia.mass_kg, 0.0);
  EXPECT_NE(to_text(model->warnings)
                .find("1 link has no mass, though between two joints that move: cross"),
            std::string::npos)
      << to_text(model->warnings);
}

TEST(UrdfInertia, RefusesAFloatingBaseWithoutMass) {
  EXPECT_NE(errors_of(kRobot, {.floating_base = true}).find("the floating base has no mass"),
            std::string::npos);
}

}  // namespace
}  // namespace tandem::model
