// `eds` of a board: its drive's data sheet, and the units that it gives a joint.
#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "hal/config/capabilities.hpp"
#include "hal/config/drive_ranges.hpp"
#include "tests/hal/board_sheet.hpp"

namespace tandem::hal {
namespace {

TEST_F(BoardSheet, GivesTheDrivesIdentityAndUnits) {
  const auto robot = read();
  ASSERT_TRUE(robot) << robot.error()[0].to_string();
  const BoardConfig& board = robot->boards[0];
  EXPECT_EQ(board.sheet->vendor, 0xFFF1U);
  EXPECT_EQ(board.boot_time_ns, 6'000'000'000);
  const JointConfig& joint = robot->joints[0];
  EXPECT_EQ(joint.encoder_counts_per_rev, 4096.0 * 50.0) << "608F times 6091";
  EXPECT_EQ(joint.rated_torque_Nm, 25.0) << "0.5 Nm at the motor, 6076, times 6091";
  EXPECT_TRUE(joint.encoder_counts_per_rev.of_sheet && joint.rated_torque_Nm.of_sheet)
      << "to be compared with the drive";
}

TEST_F(BoardSheet, IsOverruledByTheRobotsUnits) {
  const auto robot = read(with(kArm, "max_torque_Nm = 10.0\n",
                               "max_torque_Nm = 10.0\nencoder_counts_per_rev = 36000\n"
                               "rated_torque_Nm = 12\n"));
  ASSERT_TRUE(robot) << robot.error()[0].to_string();
  const JointConfig& joint = robot->joints[0];
  EXPECT_EQ(joint.encoder_counts_per_rev, 36000.0);
  EXPECT_EQ(joint.rated_torque_Nm, 12.0);
  EXPECT_FALSE(joint.encoder_counts_per_rev.of_sheet || joint.rated_torque_Nm.of_sheet);
}

TEST_F(BoardSheet, LetsAJointHaveADirectionAndAZero) {
  const std::string turned =
      with(kArm, "max_torque_Nm = 10.0\n",
           "max_torque_Nm = 10.0\nreversed = true\nzero_counts = -2147483648\n");
  const auto robot = read(turned);
  ASSERT_TRUE(robot) << robot.error()[0].to_string();
  EXPECT_TRUE(robot->joints[0].reversed);
  EXPECT_EQ(robot->joints[0].zero_counts, std::numeric_limits<std::int32_t>::min());
  const auto own = read(with(with(turned, "eds = \"drive.eds\"\n", ""), "reversed = true\n",
                             "reversed = true\nencoder_counts_per_rev = 36000\n"
                             "motor_encoder_counts_per_rev = 36000\n"));
  ASSERT_FALSE(own);
  ASSERT_EQ(own.error().size(), 2U);
  EXPECT_NE(own.error()[0].to_string().find("reversed: is for drives of other makers"),
            std::string::npos)
      << own.error()[0].to_string();
}

TEST_F(BoardSheet, WithoutUnitsAsksForThemByName) {
  sheet = with(sheet, "DefaultValue=4096", "DefaultValue=1");
  sheet = with(sheet, "DefaultValue=50\n", "DefaultValue=1\n");
  const std::string counts = refused();
  EXPECT_NE(counts.find("encoder_counts_per_rev"), std::string::npos) << counts;
  EXPECT_NE(counts.find("'elbow'"), std::string::npos) << counts;
  sheet = with(sheet, "DefaultValue=500\n", "DefaultValue=0\n");
  const auto both = read();
  ASSERT_FALSE(both);
  ASSERT_EQ(both.error().size(), 2U);
  EXPECT_NE(both.error()[1].to_string().find("6076 is 0, 6091 is 1 / 1"), std::string::npos)
      << both.error()[1].to_string();
}

TEST_F(BoardSheet, ThatCannotBeReadIsRefusedWithItsOwnLine) {
  sheet = with(sheet, "AccessType=const", "AccessType=sometimes");
  const std::string error = refused();
  EXPECT_NE(error.find("robot.toml"), std::string::npos) << error;
  EXPECT_NE(error.find("drive.eds:"), std::string::npos) << error;
  EXPECT_NE(error.find("sometimes"), std::string::npos) << error;
  const std::string missing = refused(with(kArm, "eds = \"drive.eds\"", "eds = \"other.eds\""));
  EXPECT_NE(missing.find("other.eds"), std::string::npos) << missing;
  const std::string folder_of_it = refused(with(kArm, "eds = \"drive.eds\"", "eds = \".\""));
  EXPECT_NE(folder_of_it.find("is a folder"), std::string::npos) << folder_of_it;
}

TEST_F(BoardSheet, OfTwoBoardsSaysOnceWhatIsWrongWithIt) {
  const std::string second =
      with(with(kArm, "[[joint]]\n",
                "[[board]]\nname = \"other\"\nbus = \"arm\"\neds = \"drive.eds\"\n"
                "joints = [\"wrist\"]\n[[joint]]\n"),
           "name = \"elbow\"\nactuator", "names = [\"elbow\", \"wrist\"]\nactuator");
  EXPECT_EQ(refused(second), "taken");
  sheet = with(sheet, "AccessType=const", "AccessType=sometimes");
  EXPECT_NE(refused(second).find("sometimes"), std::string::npos) << refused(second);
}

TEST_F(BoardSheet, OfAnotherDriveThanTheRobotsIsRefused) {
  const auto of = [](const std::string& key) {
    return with(kArm, "eds = \"drive.eds\"\n", "eds = \"drive.eds\"\n" + key + "\n");
  };
  for (const auto& [key, part] :
       {std::pair{"vendor_id = 0xFFF2", "vendor_id: is 0x0000FFF2, and its drive's sheet ("},
        {"product_code = 0x65", "product_code: is 0x00000065"},
        {"revision = 0x00020000", "revision: is 0x00020000"}}) {
    const std::string error = refused(of(key));
    EXPECT_NE(error.find(part), std::string::npos) << error;
    EXPECT_NE(error.find("drive.eds) is of 0x"), std::string::npos) << error;
  }
  EXPECT_EQ(refused(of("vendor_id = 0xFFF1")), "taken");
  EXPECT_EQ(refused(of("revision = 0x00010007")), "taken") << "a later minor revision";
}

TEST_F(BoardSheet, IsOnAnInterfaceThatLinuxCanHave) {
  const auto of = [](const std::string& name) {
    return with(kArm, "fd = false\n", "fd = false\ninterface = \"" + name + "\"\n");
  };
  EXPECT_EQ(refused(of("enp0s31f6")), "taken");
  const std::string error = refused(of("a_name_that_has_thirty_letters"));
  EXPECT_NE(error.find("is longer than 15 characters"), std::string::npos) << error;
  EXPECT_NE(error.find("robot.toml:20: bus.arm.interface: "), std::string::npos) << error;
}

TEST_F(BoardSheet, LetsAJointBeHomed) {
  const auto robot =
      read(joint_with("homing = { method = -3, speed_rad_s = 0.5, acceleration_rad_s2 = 2.0, "
                      "position_rad = 1.5 }\n"));
  ASSERT_TRUE(robot) << robot.error()[0].to_string();
  const auto& homing = robot->joints[0].homing;
  ASSERT_TRUE(homing.has_value());
  EXPECT_EQ(homing->method, -3);
  EXPECT_DOUBLE_EQ(homing->zero_speed_rad_s, 0.05);
  EXPECT_EQ(homing->timeout_s, 60.0);
  EXPECT_TRUE(homing->required && !homing->at_start);
  EXPECT_FALSE(homing->home_switch_rad.has_value());
  EXPECT_EQ(homing->index_rad, 0.0);
}

TEST_F(BoardSheet, LetsAHomingHaveSwitchesInSimulation) {
  const std::string homing =
      "homing = { method = 8, speed_rad_s = 0.5, acceleration_rad_s2 = 2.0, home_switch_rad = "
      "[-0.2, 0.1], index_rad = 0.03 }\n";
  const auto robot = read(joint_with(homing));
  ASSERT_TRUE(robot) << robot.error()[0].to_string();
  EXPECT_EQ(robot->joints[0].homing->home_switch_rad, (std::array{-0.2, 0.1}));
  EXPECT_EQ(robot->joints[0].homing->index_rad, 0.03);
  EXPECT_NE(refused(joint_with(with(homing, "[-0.2, 0.1]", "[0.1, -0.2]"))).find("is no range"),
            std::string::npos);
  EXPECT_NE(refused(joint_with(with(homing, "[-0.2, 0.1]", "[0.1]"))).find("home_switch_rad"),
            std::string::npos);
}

TEST_F(BoardSheet, ThatListsHomingMethodsHasNoOther) {
  const std::string variable =
      "\nParameterName=Method\nObjectType=0x7\nDataType=0x0002\n"
      "AccessType=ro\nDefaultValue=";
  sheet +=
      "[60E3]\nParameterName=Supported homing methods\nObjectType=0x8\nSubNumber=3\n"
      "[60E3sub0]" +
      with(variable, "0x0002", "0x0005") + "2\n[60E3sub1]" + variable + "35\n[60E3sub2]" +
      variable + "-3\n";
  const auto of = [](const std::string& method) {
    return joint_with("homing = { method = " + method +
                      ", speed_rad_s = 0.5, acceleration_rad_s2 = 2.0 }\n");
  };
  EXPECT_EQ(refused(of("35")), "taken");
  EXPECT_EQ(refused(of("-3")), "taken");
  const std::string error = refused(of("17"));
  EXPECT_NE(error.find("the drive of joint 'elbow' has no method 17: 60E3 of "), std::string::npos)
      << error;
  EXPECT_NE(error.find("lists 35, -3"), std::string::npos) << error;
}

/// It had been looked at in the drive's units of velocity.
TEST_F(BoardSheet, RefusesAHomingsAccelerationThatIsNothingInTheDrivesUnitsOfAcceleration) {
  const std::string homing =
      "homing = { method = 17, speed_rad_s = 0.5, acceleration_rad_s2 = 2.0 }\n";
  const auto problems = [&](const std::string& units) {
    auto robot = read(joint_with("acceleration_units_per_rev = " + units + "\n" + homing)).value();
    JointConfig& joint = robot.joints[0];
    joint.min_position_rad = -1.0;
    joint.max_position_rad = 1.0;
    joint.max_velocity_rad_s = 2.0;
    std::string all;
    for (const Error& one : check_drive_ranges(robot, joint)) all += one.to_string() + "\n";
    return all;
  };
  EXPECT_EQ(problems("100.0"), "");
  const std::string error = problems("0.1");
  EXPECT_NE(error.find("homing.acceleration_rad_s2: 2 would be 0.0318 of the drive's units"),
            std::string::npos)
      << error;
}

TEST_F(BoardSheet, RefusesAHomingThatIsNoneOrThatTheDriveHasNot) {
  const std::string homing =
      "homing = { method = 17, speed_rad_s = 0.5, acceleration_rad_s2 = 2.0 }\n";
  const auto why = [&](const std::string& from, const std::string& to) {
    return refused(joint_with(with(homing, from, to)));
  };
  EXPECT_NE(why("17", "0").find("0 is no homing"), std::string::npos);
  EXPECT_NE(why("17", "128").find("method"), std::string::npos);
  EXPECT_NE(why("0.5", "-0.5").find("speed_rad_s"), std::string::npos);
  EXPECT_NE(why("2.0", "nan").find("acceleration_rad_s2"), std::string::npos);
  EXPECT_NE(why("17,", "17, required = false, at_start = true,").find("at_start"),
            std::string::npos);
  EXPECT_NE(why("method = 17,", "").find("method"), std::string::npos);
  const std::string whole = sheet;
  sheet = with(sheet, "0x000003EF", "0x000003CF");  // 6502 without bit 5
  EXPECT_NE(refused(joint_with(homing)).find("the drive of joint 'elbow' cannot be homed"),
            std::string::npos);
  sheet = with(whole, "[607C]", "[607B]");
  sheet = with(sheet, "=0x607C", "=0x607B");
  EXPECT_TRUE(read(joint_with(homing))) << "home is at 0";
  EXPECT_NE(why("2.0 }", "2.0, position_rad = 0.1 }").find("no home offset (607C)"),
            std::string::npos);
}

/// Numbers that the sheet's limits or 32 bits exclude; with the joint's limits, so after the rest.
TEST_F(BoardSheet, NumbersBeyondItsLimitsAreRefused) {
  auto robot =
      read(joint_with("homing = { method = 37, speed_rad_s = 0.5, acceleration_rad_s2 = 2.0 }\n"
                      "stop_options = { fault = 2 }\n"));
  ASSERT_TRUE(robot) << robot.error()[0].to_string();
  JointConfig& joint = robot->joints[0];
  joint.min_position_rad = -1.0;
  joint.max_position_rad = 1.0;
  joint.max_velocity_rad_s = 2.0;
  EXPECT_TRUE(check_drive_ranges(*robot, joint).empty());
  auto limited = std::make_shared<canopen::DataSheet>(*robot->boards[0].sheet);
  for (canopen::SheetEntry& entry : limited->entries) {
    if (entry.index == 0x6098) entry.high = 35;
    if (entry.index == 0x605E) entry.high = 1;
  }
  robot->boards[0].sheet = limited;
  const Diagnostics beyond = check_drive_ranges(*robot, joint);
  ASSERT_EQ(beyond.size(), 2U);
  EXPECT_EQ(beyond[0].key, "joint.elbow.homing.method");
  EXPECT_NE(beyond[0].message.find("37 is more than 35, the limit of 6098"), std::string::npos);
  EXPECT_EQ(beyond[1].key, "joint.elbow.stop_options.fault");
  robot->boards[0].sheet = canopen::tandem_board_sheet();
  for (const double units : {1e-9, 1e15}) {
    joint.velocity_units_per_rev = units;
    const Diagnostics unusable = check_drive_ranges(*robot, joint);
    ASSERT_FALSE(unusable.empty());
    EXPECT_EQ(unusable[0].key, "joint.elbow.velocity_units_per_rev");
  }
}

TEST_F(BoardSheet, TakesStopOptionsThatTheDriveHas) {
  const auto robot = read(joint_with("stop_options = { shutdown = 1, fault = -2 }\n"));
  ASSERT_TRUE(robot) << robot.error()[0].to_string();
  EXPECT_EQ(robot->joints[0].stop_options.shutdown, 1);
  EXPECT_EQ(robot->joints[0].stop_options.fault, -2);
  EXPECT_FALSE(robot->joints[0].stop_options.halt.has_value());
  sheet = with(sheet, "[605D]", "[605F]");
  sheet = with(sheet, "=0x605D", "=0x605F");
  const std::string why = refused(joint_with("stop_options = { halt = 1 }\n"));
  EXPECT_NE(why.find("halt: the drive of joint 'elbow' has no such option (605D)"),
            std::string::npos)
      << why;
}

/// Our own boards have the options too; their limits are the firmware's.
TEST_F(BoardSheet, OfOurOwnHasStopOptions) {
  const auto of = [&](const std::string& options) {
    return read(with(joint_with("encoder_counts_per_rev = 36000\n"
                                "motor_encoder_counts_per_rev = 36000\nstop_options = " +
                                options + "\n"),
                     "eds = \"drive.eds\"\n", ""));
  };
  const auto robot = of("{ shutdown = 1, disable = 0, halt = 2, fault = -1 }");
  ASSERT_TRUE(robot) << robot.error()[0].to_string();
  EXPECT_TRUE(check_drive_ranges(*robot, robot->joints[0]).empty());
  const auto beyond = of("{ halt = 3, fault = -2 }");
  ASSERT_TRUE(beyond);
  const Diagnostics errors = check_drive_ranges(*beyond, beyond->joints[0]);
  ASSERT_EQ(errors.size(), 2U);
  EXPECT_EQ(errors[0].key, "joint.elbow.stop_options.halt");
  EXPECT_NE(errors[0].message.find("3 is more than 2, the limit of 605D in our own boards"),
            std::string::npos)
      << errors[0].message;
  EXPECT_EQ(errors[1].key, "joint.elbow.stop_options.fault");
}

TEST_F(BoardSheet, TakesADecelerationOfQuickStopsThatTheDriveHas) {
  const auto errors = [&](const std::string& rad_s2, bool ours) {
    std::string text = joint_with(
        "encoder_counts_per_rev = 36000\n"
        "motor_encoder_counts_per_rev = 36000\n"
        "stop_deceleration_rad_s2 = " +
        rad_s2 + "\n");
    if (ours) text = with(text, "eds = \"drive.eds\"\n", "");
    const auto robot = read(text);
    EXPECT_TRUE(robot) << robot.error()[0].to_string();
    EXPECT_EQ(robot->joints[0].drive.stop_deceleration_rad_s2, std::stod(rad_s2));
    return check_drive_ranges(*robot, robot->joints[0]);
  };
  EXPECT_TRUE(errors("20", true).empty());
  const Diagnostics small = errors("1e-5", true);
  ASSERT_EQ(small.size(), 1U);
  EXPECT_EQ(small[0].key, "joint.elbow.stop_deceleration_rad_s2");
  EXPECT_EQ(errors("1e9", true).size(), 1U) << "more than 32 bits";
  const Diagnostics none = errors("20", false);
  ASSERT_EQ(none.size(), 1U) << "the sheet has no 6085";
  EXPECT_NE(none[0].message.find("6085 cannot be written"), std::string::npos) << none[0].message;
  EXPECT_NE(refused(joint_with("stop_deceleration_rad_s2 = 0\n")), "");
}

TEST_F(BoardSheet, KeepsAConfigurationWhereItCan) {
  const std::string why = refused(board_with("keeps_configuration = true\n"));
  EXPECT_NE(why.find("its drive cannot: 1010:1 is missing"), std::string::npos) << why;
}

TEST_F(BoardSheet, TakesFramesOfCanFdWhereTheBusHasThem) {
  const std::string why = refused(board_with("fd = true\n"));
  EXPECT_NE(why.find("its bus 'arm' is no CAN FD bus"), std::string::npos) << why;
  const auto robot = read(with(board_with("fd = true\n"), "fd = false", "fd = true"));
  ASSERT_TRUE(robot) << robot.error()[0].to_string();
  EXPECT_EQ(robot->boards[0].sheet->most_pdo_bytes, 64);
  const auto all = read(with(kArm, "fd = false", "fd = true") + "[board_defaults]\nfd = true\n");
  ASSERT_TRUE(all) << all.error()[0].to_string();
  EXPECT_EQ(all->boards[0].sheet->most_pdo_bytes, 64);
  const std::string ours = with(board_with("fd = true\n"), "eds = \"drive.eds\"\n", "");
  EXPECT_FALSE(read(ours));
}

/// One device of two, on a bus that has slaves.
TEST_F(BoardSheet, OfASlaveIsForItsBusAndItsProduct) {
  const auto device = [](const char* product) {
    return std::string("<Device><Type ProductCode=\"") + product +
           R"(" RevisionNo="1">D</Type><Profile><ProfileNo>402</ProfileNo></Profile>
<RxPdo Sm="2"><Index>#x1600</Index><Entry><Index>#x6040</Index><BitLen>16</BitLen></Entry>
<Entry><Index>#x607A</Index><BitLen>32</BitLen><DataType>DINT</DataType></Entry></RxPdo>
<TxPdo Sm="3"><Index>#x1A00</Index><Entry><Index>#x6041</Index><BitLen>16</BitLen></Entry>
<Entry><Index>#x6064</Index><BitLen>32</BitLen><DataType>DINT</DataType></Entry></TxPdo></Device>)";
  };
  sheet = "<EtherCATInfo><Vendor><Id>7</Id></Vendor><Descriptions><Devices>" + device("#x10") +
          device("#x20") + "</Devices></Descriptions></EtherCATInfo>";
  const std::string joint = "encoder_counts_per_rev = 36000\nrated_torque_Nm = 12\n";
  const auto robot = [&](const std::string& board, const std::string& bus) {
    const std::string text = with(board_with(board), kLast, kLast + joint);
    return with(text, "fd = false\n", bus);
  };
  const std::string line = "kind = \"ethercat\"\ninterface = \"eth1\"\n";
  EXPECT_NE(refused(robot("", line)).find("has 2 devices: 0x00000010"), std::string::npos);
  const auto taken = read(robot("product_code = 0x20\n", line));
  ASSERT_TRUE(taken) << taken.error()[0].to_string();
  EXPECT_EQ(taken->boards[0].sheet->product, 0x20U);
  EXPECT_TRUE(taken->boards[0].sheet->ethercat);
  const std::string can = refused(robot("product_code = 0x20\n", "fd = false\n"));
  EXPECT_NE(can.find("is the file of an EtherCAT slave, and its bus 'arm' is CAN"),
            std::string::npos)
      << can;
  const std::string fd = refused(robot("product_code = 0x20\nfd = true\n", line));
  EXPECT_NE(fd.find("PDOs are as long as the drive's"), std::string::npos) << fd;
  EXPECT_EQ(fd.find("fd = true"), std::string::npos) << "no advice that leads nowhere: " << fd;
}

TEST_F(BoardSheet, LetsAControllerClaimOnlyTheDrivesModes) {
  const auto robot = read();
  ASSERT_TRUE(robot);
  EXPECT_TRUE(check_capability(*robot, 0, ControlMode::kPosition));
  EXPECT_TRUE(check_capability(*robot, 0, ControlMode::kVelocity)) << "its loops are its own";
  EXPECT_TRUE(check_capability(*robot, 0, ControlMode::kTorque));
  for (const auto mode : {ControlMode::kOpenLoop, ControlMode::kCurrent}) {
    EXPECT_FALSE(check_capability(*robot, 0, mode));
  }
  const Status soft =
      check_capability(*robot, 0, ControlMode::kPosition, InteractionMode::kCompliant);
  ASSERT_FALSE(soft);
  EXPECT_NE(soft.error().to_string().find("joint 'elbow'"), std::string::npos);
  EXPECT_NE(soft.error().to_string().find("tandem eds show"), std::string::npos);
}

}  // namespace
}  // namespace tandem::hal
