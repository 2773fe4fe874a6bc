// The scale of a joint on a drive of another make: its sheet's, where that says one, or
// robot.toml's.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "hal/config/drive_ranges.hpp"
#include "hal/config/joint_scale.hpp"
#include "tests/hal/board_sheet.hpp"

namespace tandem::hal {
namespace {

using BoardScale = BoardSheet;

/// A sheet counts revolutions; how far one moves a slide, it does not say.
TEST_F(BoardScale, DoesNotScaleAJointThatSlides) {
  add("60A9", "0x00B44700");
  RobotDescription description{
      .moving_joints = {{"elbow", -1.0, 1.0, 1.0, 10.0}}, .other_joints = {}, .links = {}};
  auto turning = read();
  ASSERT_TRUE(turning) << turning.error()[0].to_string();
  auto slide = *turning;
  EXPECT_TRUE(complete_from_description(*turning, description).empty());
  description.moving_joints[0].slides = true;
  const Diagnostics errors = complete_from_description(slide, description);
  ASSERT_EQ(errors.size(), 3U);
  EXPECT_EQ(errors[0].key, "joint.elbow.encoder_counts_per_rev");
  EXPECT_EQ(errors[0].line, slide.joints[0].line);
  EXPECT_NE(errors[0].to_string().find("joint 'elbow' slides"), std::string::npos)
      << errors[0].to_string();
  EXPECT_EQ(errors[1].key, "joint.elbow.velocity_units_per_rev");
  EXPECT_EQ(errors[2].key, "joint.elbow.rated_torque_Nm");
  auto told = read(with(kArm, "max_torque_Nm = 10.0\n",
                        "max_torque_Nm = 10.0\nencoder_counts_per_rev = 1256637\n"
                        "velocity_units_per_rev = 1000\nrated_torque_Nm = 12\n"));
  ASSERT_TRUE(told) << told.error()[0].to_string();
  EXPECT_TRUE(complete_from_description(*told, description).empty());
}

/// A ratio with a 0, or without one of its two numbers, is neither 1 nor left out.
TEST_F(BoardScale, WithARatioThatIsNoneAsksForWhatItScales) {
  const std::string whole = sheet;
  const std::size_t shaft = sheet.find("[6091sub2]");
  for (const auto& [value, said] : {std::pair{"DefaultValue=0", "6091 is 50 / 0"},
                                    {"DefaultValue=", "6091 is 50 / not said"}}) {
    sheet = whole;
    sheet.replace(sheet.find("DefaultValue=1", shaft), 14, value);
    const auto robot = read();
    ASSERT_FALSE(robot) << value;
    ASSERT_EQ(robot.error().size(), 2U);
    EXPECT_EQ(robot.error()[0].key, "joint.elbow.encoder_counts_per_rev");
    EXPECT_NE(robot.error()[0].to_string().find(said), std::string::npos)
        << robot.error()[0].to_string();
    EXPECT_EQ(robot.error()[1].key, "joint.elbow.rated_torque_Nm");
    EXPECT_NE(robot.error()[1].to_string().find(said), std::string::npos);
  }
  sheet = whole;
  add("6092", "360000", "0");
  const std::string feed = refused();
  EXPECT_NE(feed.find("encoder_counts_per_rev"), std::string::npos) << feed;
  EXPECT_NE(feed.find("6092 is 360000 / 0"), std::string::npos) << feed;
}

TEST_F(BoardScale, AsksForAVelocityUnitThatItDoesNotKnow) {
  sheet = with(sheet, "[60B1]",
               "[60A9]\nParameterName=SI unit velocity\nObjectType=0x7\n"
               "DataType=0x0007\nAccessType=ro\nDefaultValue=0x00B44700\n"
               "PDOMapping=0\n\n[60B1]");
  const auto rpm = read();
  ASSERT_TRUE(rpm) << rpm.error()[0].to_string();
  EXPECT_EQ(rpm->joints[0].velocity_units_per_rev, 3000.0) << "60 times the gear";
  EXPECT_TRUE(rpm->joints[0].velocity_units_per_rev.of_sheet);
  sheet = with(sheet, "0x00B44700", "0x00010300");
  const std::string why = refused();
  EXPECT_NE(why.find("velocity_units_per_rev"), std::string::npos) << why;
  EXPECT_NE(why.find("60A9 is 0x00010300"), std::string::npos) << why;
  const auto told = read(joint_with("velocity_units_per_rev = 1000\n"));
  ASSERT_TRUE(told) << told.error()[0].to_string();
  EXPECT_FALSE(told->joints[0].velocity_units_per_rev.of_sheet);
}

/// The only warning, or how many there are.
std::string warned(const RobotConfig& robot) {
  const Diagnostics warnings = scale_warnings(robot);
  return warnings.size() == 1 ? warnings[0].to_string() : std::to_string(warnings.size());
}

// EPOS4's DCF has 6076 in uNm. Its number as mNm would make every torque a thousandth.
TEST_F(BoardScale, WhoseRatedTorqueIsAThousandTimesTooLargeIsRefused) {
  const RobotDescription description{
      .moving_joints = {{"elbow", -1.0, 1.0, 1.0, 10.0}}, .other_joints = {}, .links = {}};
  sheet = with(sheet, "DefaultValue=500\n", "DefaultValue=512871\n");
  auto wrong = read();
  ASSERT_TRUE(wrong) << wrong.error()[0].to_string();
  const Diagnostics errors = complete_from_description(*wrong, description);
  ASSERT_EQ(errors.size(), 1U);
  const std::string error = errors[0].to_string();
  EXPECT_NE(error.find("rated_torque_Nm"), std::string::npos) << error;
  EXPECT_NE(error.find("is it in uNm"), std::string::npos) << error;
  EXPECT_NE(error.find("to 25.64355 if the drive's 6076 is in uNm"), std::string::npos) << error;
  auto told = read(joint_with("rated_torque_Nm = 25.64355\n"));
  ASSERT_TRUE(told) << told.error()[0].to_string();
  EXPECT_TRUE(complete_from_description(*told, description).empty());
  EXPECT_EQ(warned(*told), "0") << "the remedy helps";
}

TEST_F(BoardScale, IsDoubtedWhereAnotherObjectConvertsPositions) {
  const std::string whole = sheet;
  EXPECT_EQ(warned(*read()), "0");
  for (const char* neutral : {"0", "0x00B50000", "0xFDB40000"}) {
    sheet = whole;
    if (std::string(neutral).ends_with("B40000")) add("6092", "1000", "1");
    add("60A8", neutral);
    EXPECT_EQ(warned(*read()), "0") << neutral;
  }
  sheet = whole;
  add("60A8", "0xFD410000");
  const std::string unit = warned(*read());
  EXPECT_NE(unit.find(":25: joint.elbow.encoder_counts_per_rev: 60A8 (SI unit position) is "
                      "0xFD410000 in "),
            std::string::npos)
      << unit;
  EXPECT_NE(unit.find("360000 position units per revolution; the joint has 204800"),
            std::string::npos)
      << unit;
  sheet = whole;
  add("6093", "1", "1");
  EXPECT_EQ(warned(*read()), "0");
  sheet = whole;
  add("6093", "2", "1");
  const std::string factor = warned(*read());
  EXPECT_NE(factor.find("encoder_counts_per_rev: 6093 (position factor) is 2 / 1 in "),
            std::string::npos)
      << factor;
  EXPECT_EQ(warned(*read(joint_with("encoder_counts_per_rev = 204800\n"))), "0") << "told";
}

TEST_F(BoardScale, IsDoubtedWhereAnotherObjectConvertsVelocities) {
  const std::string whole = sheet;
  add("6090", "4096", "1");
  EXPECT_EQ(warned(*read()), "0") << "as 608F";
  for (const auto& [index, name] : {std::pair{"6090", "velocity encoder resolution"},
                                    {"6094", "velocity encoder factor"},
                                    {"6095", "velocity factor 1"},
                                    {"6096", "velocity factor"}}) {
    sheet = whole;
    add(index, "60", "4096");
    const std::string why = warned(*read());
    EXPECT_NE(why.find("joint.elbow.velocity_units_per_rev: " + std::string(index) + " (" + name +
                       ") is 60 / 4096 in "),
              std::string::npos)
        << why;
    EXPECT_EQ(warned(*read(joint_with("velocity_units_per_rev = 3000\n"))), "0") << index;
  }
}

/// A drive that inverts by itself counts as it does; whether that is the joint's way, only the
/// robot.toml can say.
TEST_F(BoardScale, HasADirectionThatTheDriveMayTurnRound) {
  const std::string whole = sheet;
  RobotDescription description{
      .moving_joints = {{"elbow", -1.0, 1.0, 1.0, 10.0}}, .other_joints = {}, .links = {}};
  add("607E", "0xC0");
  auto both = read();
  ASSERT_TRUE(both);
  EXPECT_TRUE(complete_from_description(*both, description).empty());
  EXPECT_NE(warned(*both).find("joint.elbow.reversed: 607E (polarity) is 0xC0"), std::string::npos)
      << warned(*both);
  EXPECT_EQ(warned(*read(joint_with("reversed = false\n"))), "0");
  for (const char* one : {"0x80", "0x40"}) {
    sheet = whole;
    add("607E", one);
    auto robot = read(joint_with("reversed = true\n"));
    ASSERT_TRUE(robot);
    const Diagnostics errors = complete_from_description(*robot, description);
    ASSERT_EQ(errors.size(), 1U) << one;
    EXPECT_EQ(errors[0].key, "joint.elbow.reversed");
    EXPECT_NE(errors[0].message.find("607E (polarity)"), std::string::npos) << errors[0].message;
  }
}

TEST_F(BoardScale, FarFromTheSheetsIsWarnedOfWithBothNumbers) {
  const auto of = [&](const std::string& line) { return warned(*read(joint_with(line))); };
  const std::string counts = of("encoder_counts_per_rev = 4096\n");
  EXPECT_NE(counts.find(":25: joint.elbow.encoder_counts_per_rev: is 4096, and the drive's sheet "
                        "says 204800, which is 50 times as much (608F is 4096 / 1, 6091 is 50 / 1"),
            std::string::npos)
      << counts;
  const std::string torque = of("rated_torque_Nm = 1.5\n");
  EXPECT_NE(torque.find("rated_torque_Nm: is 1.5, and the drive's sheet says 25, which is 16.67 "),
            std::string::npos)
      << torque;
  EXPECT_EQ(of("encoder_counts_per_rev = 204000\n"), "0") << "0.4 % off";
  const std::string whole = sheet;
  add("60A9", "0x00B44700");
  EXPECT_NE(of("velocity_units_per_rev = 60\n").find("says 3000, which is 50 times as much"),
            std::string::npos);
  sheet = whole;
  add("60A8", "0xFD410000");
  EXPECT_NE(of("encoder_counts_per_rev = 204800\n").find("the drive's sheet says 360000"),
            std::string::npos);
  EXPECT_EQ(of("encoder_counts_per_rev = 360000\n"), "0");
  sheet = whole;
  add("6092", "1", "1");
  EXPECT_EQ(of("encoder_counts_per_rev = 4096\n"), "0") << "a 1 that the drive replaces";
}

TEST_F(BoardScale, OfOurOwnBoardsIsWholeOrWarnedOf) {
  const auto of = [&](const std::string& counts, const std::string& torque) {
    return warned(*read(with(joint_with("encoder_counts_per_rev = " + counts +
                                        "\nmotor_encoder_counts_per_rev = 36000\n"
                                        "rated_torque_Nm = " +
                                        torque + "\n"),
                             "eds = \"drive.eds\"\n", "")));
  };
  EXPECT_EQ(of("36000", "12.5"), "0");
  EXPECT_EQ(of("36000", "12.00001"), "0") << "too little to see";
  const std::string why = of("333333.33", "12.5");
  EXPECT_NE(
      why.find(":24: joint.elbow.encoder_counts_per_rev: is 333333.33, and our own boards take "
               "whole numbers (608F): they are told 333333"),
      std::string::npos)
      << why;
}

TEST_F(BoardScale, OfASlideIsNotComparedWithAShafts) {
  auto robot = read(joint_with("encoder_counts_per_rev = 1256637\nrated_torque_Nm = 30\n"));
  ASSERT_TRUE(robot);
  robot->joints[0].slides = true;
  EXPECT_EQ(warned(*robot), "0");
}

TEST_F(BoardScale, OfJointsWithTheSameSheetIsDoubtedOnce) {
  add("6093", "2", "1");
  const auto robot =
      read(with(with(kArm, "[[joint]]\n",
                     "[[board]]\nname = \"other\"\nbus = \"arm\"\neds = \"drive.eds\"\n"
                     "joints = [\"wrist\"]\n[[joint]]\n"),
                "name = \"elbow\"\nactuator", "names = [\"elbow\", \"wrist\"]\nactuator"));
  ASSERT_TRUE(robot) << robot.error()[0].to_string();
  EXPECT_NE(warned(*robot).find("joint.elbow."), std::string::npos) << warned(*robot);
  EXPECT_NE(warned(*robot).find("; so it is of 1 other joint"), std::string::npos)
      << warned(*robot);
}

/// One key with one homing: "give it a homing" had led to the same error, and to another one.
TEST_F(BoardScale, AnEncodersTurnAndAHomingAreOneOfTwo) {
  const std::string turn = "encoder_turn_counts = 2048\n";
  const std::string counts = "encoder_counts_per_rev = 4096\n";
  const std::string homing =
      "homing = { method = 35, speed_rad_s = 0.2, acceleration_rad_s2 = 1.0 }\n";
  const auto line_of = [](const std::string& text, const std::string& key) {
    return std::count(text.begin(), text.begin() + static_cast<long>(text.find(key)), '\n') + 1;
  };
  const auto said = [&](const std::string& text) {
    const auto robot = read(text);
    EXPECT_TRUE(robot.has_value()) << robot.error()[0].to_string();
    std::string all;
    for (const Error& one : check_drive_ranges(*robot, robot->joints[0])) all += one.to_string();
    return all;
  };
  const auto wide = [&](const std::string& lines) {
    return with(joint_with(lines), "max_position_rad = 1.5", "max_position_rad = 12.0");
  };
  const std::string text = wide(counts + turn);
  const std::string alone = said(text);
  EXPECT_NE(alone.find(fmt::format("robot.toml:{}: ", line_of(text, "encoder_turn_counts"))),
            std::string::npos)
      << alone;
  EXPECT_NE(alone.find("replace this key by a `homing`"), std::string::npos) << alone;
  const std::string both = said(wide(counts + turn + homing));
  EXPECT_NE(both.find("(remove this key)"), std::string::npos) << both;
  EXPECT_EQ(said(wide(counts + homing)), "") << "what both texts ask for";
  const std::string narrow = said(joint_with(counts + turn + homing));
  EXPECT_NE(narrow.find("remove this key, or set required = false"), std::string::npos) << narrow;
}

}  // namespace
}  // namespace tandem::hal
