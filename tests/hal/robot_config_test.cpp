// What a robot.toml says by itself: read, and refused.
#include <gtest/gtest.h>

#include "tests/hal/robot_config_text.hpp"

namespace tandem::hal {
namespace {

TEST(RobotConfig, IsReadWithItsDefaults) {
  const auto robot = parse_robot_config(kRobot, "robots/leg.toml");
  ASSERT_TRUE(robot.has_value()) << errors_of(kRobot);
  EXPECT_EQ(robot->name, "leg");
  EXPECT_EQ(robot->model.urdf, "robots/leg.urdf");
  EXPECT_TRUE(robot->model.floating_base);
  EXPECT_FALSE(robot->model.mimic_independent);
  ASSERT_EQ(robot->model.lock.size(), 1u);
  EXPECT_EQ(robot->model.lock[0], (std::pair<std::string, double>("toe", 0.1)));
  EXPECT_EQ(robot->model.gravity_m_s2[2], -9.81);
  ASSERT_EQ(robot->model.sites.size(), 1u);
  EXPECT_TRUE(robot->model.sites[0].wrench);
  EXPECT_EQ(robot->model.sites[0].xyz_m[2], -0.1);
  ASSERT_EQ(robot->joints.size(), 2u);
  EXPECT_EQ(robot->joint_index("knee"), 1);
  EXPECT_EQ(robot->joint_index("nose"), -1);
  const JointConfig& hip = robot->joints[0];
  EXPECT_EQ(hip.min_position_rad, -1.5);
  EXPECT_TRUE(std::isnan(hip.max_torque_Nm));
  EXPECT_EQ(hip.encoder_counts_per_rev, 65536);
  EXPECT_EQ(hip.on_fault, StopCategory::kCategory1);
  EXPECT_EQ(robot->joints[1].on_fault, StopCategory::kHold);
  EXPECT_EQ(robot->actuator_of(hip).order, 2);
  EXPECT_EQ(robot->actuator_of(hip).spring_Nm_rad, 395.46);
  EXPECT_EQ(robot->gains_of(hip).position.gains.kp, 200.0);
  EXPECT_EQ(robot->gains_of(hip).position.output_limit, 100.0);
  EXPECT_EQ(robot->gains_of(hip).position_feedback, PositionFeedback::kMotor);
  EXPECT_EQ(robot->gains_of(hip).torque_feedforward, 1.0);
  EXPECT_EQ(robot->board("hip_board")->control_period_ns, 1'000'000);
  EXPECT_EQ(robot->bus("left")->data_bitrate, 8'000'000);
  EXPECT_EQ(robot->shape().sensor_channels, std::vector<std::size_t>{6});
  EXPECT_EQ(robot->contact.feet[0].points_m[2][1], -0.05);
  EXPECT_EQ(robot->posture("home")->position_rad, (std::vector<double>{0.0, 0.2}));
  EXPECT_EQ(robot->posture("away"), nullptr);
}

TEST(RobotConfig, KnowsWhichKeysTheFileGivesAndWhere) {
  const auto robot = parse_robot_config(
      std::string(kRobot) + "[safety]\nemergency_stop = \"category1\"\n", "leg.toml");
  ASSERT_TRUE(robot.has_value());
  EXPECT_EQ(robot->joints[0].on_fault.line, 0);
  EXPECT_EQ(robot->joints[1].on_fault.line, 50);
  EXPECT_EQ(robot->joints[1].encoder_counts_per_rev.line, 35) << "where [joint_defaults] gives it";
  EXPECT_EQ(robot->joints[1].following_error_rad.line, 0);
  EXPECT_EQ(robot->emergency_stop.line, 74) << "the same as without the key";
}

TEST(RobotConfig, ReadsTheIdentityOfABoardAndProtections) {
  std::string text = with(kRobot, "[joint_defaults]", "product_code = 0x77\nserial = 5\n");
  text = with(text, "[gains.big]", "continuous_current_A = 12\nthermal_time_s = 60\n");
  text = with(text, "[[sensor]]", "following_error_rad = 0.2\nfollowing_timeout_s = 0.5\n");
  text = with(text, "[[joint]]", "following_error_rad = 0.3\n");
  text = with(text, "[[board]]", "max_load = 0.8\n");
  const auto robot = parse_robot_config(text, "leg.toml");
  ASSERT_TRUE(robot.has_value()) << robot.error()[0].to_string();
  EXPECT_EQ(robot->boards[0].product_code, 0x77u);
  EXPECT_EQ(robot->boards[0].serial, 5u);
  EXPECT_FALSE(robot->boards[0].vendor_id.has_value());
  EXPECT_FALSE(robot->boards[0].revision.has_value());
  EXPECT_EQ(robot->actuators[0].continuous_current_A, 12.0);
  EXPECT_EQ(robot->actuators[0].thermal_time_s, 60.0);
  EXPECT_EQ(robot->actuators[0].temperature_limit_C, 120.0);
  EXPECT_EQ(robot->joints[0].following_error_rad, 0.3) << "the default's";
  EXPECT_EQ(robot->joints[1].following_error_rad, 0.2);
  EXPECT_EQ(robot->joints[1].following_timeout_s, 0.5);
  EXPECT_EQ(robot->buses[0].max_load, 0.8);
}

TEST(RobotConfig, RefusesANameThatIsNoFileName) {
  expect_error(with("name = \"leg\"", "name = \"../../leg\""),
               "robots/leg.toml:1: name: '../../leg' has other characters than letters, digits, "
               "_, - and ., but it becomes part of file names "
               "(use letters, digits, _, - and ., at most 64)");
  EXPECT_NE(errors_of(with("name = \"leg\"", "name = \".leg\"")).find("begins with ."),
            std::string::npos);
}

TEST(RobotConfig, ReadsWhatALinkWeighsInsteadOfTheDescription) {
  const auto robot = parse_robot_config(
      with("[model.lock]",
           "inertia = 'repair'\n[model.link.foot]\nmass_kg = 2\ncom_m = [0, 0.1, 0.2]\n"
           "inertia_kg_m2 = [1, 2, 3, 4, 5, 6]\n[model.link.thigh]\nmass_kg = 0\n[model.lock]"),
      "leg.toml");
  ASSERT_TRUE(robot.has_value());
  EXPECT_TRUE(robot->model.repair_inertia);
  ASSERT_EQ(robot->model.links.size(), 2u);
  const LinkConfig& foot = robot->model.links[0];
  EXPECT_EQ(foot.name, "foot");
  EXPECT_EQ(foot.line, 6);
  EXPECT_EQ(foot.mass_kg, 2.0);
  EXPECT_EQ((*foot.com_m)[1], 0.1);
  EXPECT_EQ((*foot.inertia_kg_m2)[5], 6.0);
  EXPECT_EQ(robot->model.links[1].mass_kg, 0.0);
  EXPECT_FALSE(robot->model.links[1].inertia_kg_m2.has_value());
}

TEST(RobotConfig, RefusesALinkThatWeighsWrong) {
  const auto link = [](const std::string& keys) {
    return with("[model.lock]", "[model.link.foot]\n" + keys + "\n[model.lock]");
  };
  expect_error(link("mass_kg = -1"),
               "robots/leg.toml:6: model.link.foot.mass_kg: -1 is out of range "
               "(must be at least 0)");
  expect_error(link("mas_kg = 1\nmass_kg = 1"),
               "robots/leg.toml:6: model.link.foot.mas_kg: unknown key (did you mean 'mass_kg'?)");
  expect_error(link("inertia_kg_m2 = [1, 1, 1]"),
               "robots/leg.toml:6: model.link.foot.inertia_kg_m2: has 3 numbers (give exactly 6)");
  expect_error(link("mass = 1"),
               "robots/leg.toml:6: model.link.foot.mass: unknown key (did you mean 'mass_kg'?)");
  expect_error(with("[model.lock]", "[model.link]\nmass_kg = 1\ncom_m = [0, 0, 1]\n[model.lock]"),
               "robots/leg.toml:6: model.link.mass_kg: belongs in a table with a name "
               "(write [model.link.NAME] above it)");
  expect_error(link(""),
               "robots/leg.toml:5: model.link.foot: gives nothing "
               "(give mass_kg, com_m or inertia_kg_m2, or remove it)");
}

TEST(RobotConfig, RefusesTwoBusesOnOneInterface) {
  const std::string two = with("[[bus]]",
                               "[[bus]]\nname = 'other'\ninterface = 'can7'\n[[bus]]\n"
                               "name = 'third'\ninterface = 'can7'\n[[bus]]");
  const auto robot = parse_robot_config(two, "robots/leg.toml");
  ASSERT_FALSE(robot.has_value());
  ASSERT_EQ(robot.error().size(), 1U);
  const std::string text = robot.error()[0].to_string();
  EXPECT_NE(text.find(".interface: 'can7' is the interface of bus 'other' (line "),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("), too: bus 'third' needs one of its own (give each [[bus]] another "
                      "interface)"),
            std::string::npos)
      << text;
}

TEST(RobotConfig, RefusesANumberInPlaceOfAVectorOnce) {
  expect_error(
      with("[model.lock]", "gravity_m_s2 = [0, 0, -1e9]\n[model.lock]"),
      "robots/leg.toml:5: model.gravity_m_s2: -1e+09 is out of range (must be at least -1000 and "
      "at most 1000)");
  expect_error(with("[model.lock]", "gravity_m_s2 = 9.81\n[model.lock]"),
               "robots/leg.toml:5: model.gravity_m_s2: must be a list of numbers in brackets, not "
               "floating-point (give exactly 3)");
  expect_error(with("points_m = [[0.1, 0.05, 0], [-0.1, 0.05, 0], [0, -0.05, 0]]", "points_m = 1"),
               "robots/leg.toml:69: contact.foot[0].points_m: must be a list of lists of numbers, "
               "not integer");
}

TEST(RobotConfig, RefusesATableOfAnotherNameOnceWhateverRefersToIt) {
  const auto unknown = [](int line, const std::string& key, const std::string& meant) {
    return "robots/leg.toml:" + std::to_string(line) + ": " + key +
           ": unknown key (did you mean '" + meant + "'?)";
  };
  expect_error(with("[gains.big]", "[gain.big]"), unknown(22, "gain", "gains"));
  expect_error(with("[actuator.big]", "[actuators.big]"), unknown(12, "actuators", "actuator"));
  expect_error(with("[[bus]]", "[[buses]]"), unknown(27, "buses", "bus"));
  expect_error(with("[joint_defaults]", "[joints_defaults]"),
               unknown(34, "joints_defaults", "joint_defaults"));
  expect_error("[modell]\n",
               "robots/leg.toml:1: name: this key is missing (add it to the table)\n" +
                   unknown(1, "modell", "model"));
}

TEST(RobotConfig, AsksForTheNameOfATableOnceWhateverRefersToIt) {
  expect_error(with("[gains.big]", "[gains]"),
               "robots/leg.toml:25: gains.position_feedback: belongs in a table with a name "
               "(write [gains.NAME] above it)");
  expect_error(with("[actuator.big]", "[actuator]"),
               "robots/leg.toml:13: actuator.resistance_ohm: belongs in a table with a name "
               "(write [actuator.NAME] above it)");
  expect_error(with("[posture.home]", "[posture]"),
               "robots/leg.toml:71: posture.base_height_m: belongs in a table with a name "
               "(write [posture.NAME] above it)");
}

TEST(RobotConfig, RefusesABoardDescribedTwiceOnceWhateverIsOnIt) {
  const std::string two =
      with("[joint_defaults]",
           "[[board]]\nname = \"hip_board\"\nbus = \"left\"\nnode_id = 4\n[joint_defaults]");
  expect_error(two.substr(0, two.find("axis = 1")) + two.substr(two.find("axis = 1") + 9),
               "robots/leg.toml:35: board[1].name: the board 'hip_board' is described twice "
               "(remove or rename one of them)");
}

TEST(RobotConfig, RefusesAnActuatorWithoutInertia) {
  for (const std::string order : {"0", "1", "2"}) {
    EXPECT_NE(errors_of(with("inertia_kg_m2 = 0.1387", "inertia_kg_m2 = 0\norder = " + order))
                  .find("robots/leg.toml:16: actuator.big.inertia_kg_m2: 0 is out of range "
                        "(must be greater than 0)"),
              std::string::npos)
        << order;
  }
}

TEST(RobotConfig, OfABareModelNeedsNoJoints) {
  EXPECT_EQ(errors_of("name = 'm'\n[model]\nurdf = 'm.urdf'\nbase = 'fixed'\n"), "");
}

TEST(RobotConfig, NamesAMissingFile) {
  const auto robot = read_robot_config("/nonexistent/robot.toml");
  ASSERT_FALSE(robot.has_value());
  ASSERT_EQ(robot.error().size(), 1u);
  EXPECT_EQ(robot.error()[0].file, "/nonexistent/robot.toml");
}

TEST(RobotConfig, NamesTheLineOfBrokenToml) {
  const auto robot = parse_robot_config("name = 'leg'\n[model\n", "leg.toml");
  ASSERT_FALSE(robot.has_value());
  EXPECT_EQ(robot.error()[0].line, 2);
}

TEST(RobotConfig, SuggestsTheNearestForAMisspeltKey) {
  expect_error(with("gear_ratio = 100", "gear_ratio = 100\nvoltage_limt_V = 3"),
               "robots/leg.toml:16: actuator.big.voltage_limt_V: unknown key "
               "(did you mean 'voltage_limit_V'?)");
}

TEST(RobotConfig, RefusesGainsOfTheWrongSign) {
  expect_error(with("kp = 0.3", "kp = -0.3"),
               "robots/leg.toml:24: gains.big.torque.kp: this gain has the wrong sign "
               "(gains are not negative: they act on reference minus measurement)");
}

TEST(RobotConfig, ReadsAccelerationAndJerkAndRefusesAJerkAlone) {
  const auto joint = [](const std::string& keys) {
    return with("encoder_counts_per_rev = 65536\n", "encoder_counts_per_rev = 65536\n" + keys);
  };
  const auto robot = parse_robot_config(
      joint("max_acceleration_rad_s2 = 20\nmax_jerk_rad_s3 = 400\n"), "robots/leg.toml");
  ASSERT_TRUE(robot.has_value()) << robot.error()[0].to_string();
  EXPECT_EQ(robot->joints[0].max_acceleration_rad_s2, 20.0);
  EXPECT_EQ(robot->joints[0].max_jerk_rad_s3, 400.0);
  EXPECT_NE(errors_of(joint("max_jerk_rad_s3 = 400\n")).find("needs a max_acceleration_rad_s2"),
            std::string::npos);
  EXPECT_NE(errors_of(joint("max_acceleration_rad_s2 = 0\n")).find("greater than 0"),
            std::string::npos);
}

TEST(RobotConfig, RefusesAZeroResistance) {
  expect_error(with("resistance_ohm = 0.664", "resistance_ohm = 0"),
               "robots/leg.toml:13: actuator.big.resistance_ohm: 0 is out of range "
               "(must be greater than 0)");
}

TEST(RobotConfig, RefusesAnElectricalMotorWhoseDampingLacksItsBackEmf) {
  const std::string text =
      with("resistance_ohm = 0.664", "order = 3\ninductance_H = 3e-4\nresistance_ohm = 0.064");
  EXPECT_NE(errors_of(text).find("must include the back-EMF's share"), std::string::npos);
}

TEST(RobotConfig, RefusesASpringDriveWithoutSpring) {
  expect_error(with("spring_Nm_rad = 395.46\n", ""),
               "robots/leg.toml:12: actuator.big: of order 2: spring_Nm_rad must be positive "
               "(give it, or another order)");
}

TEST(RobotConfig, RefusesNumbersThatAreNotFinite) {
  expect_error(with("damping_s_m = 10\n", "damping_s_m = nan\n"),
               "robots/leg.toml:62: contact.damping_s_m: must be finite");
}

TEST(RobotConfig, TakesALimitOfTemperatureBelowThatOfARoom) {
  const auto robot = parse_robot_config(with(kRobot, "[gains.big]", "temperature_limit_C = -40\n"),
                                        "robots/leg.toml");
  ASSERT_TRUE(robot.has_value()) << robot.error()[0].to_string();
  EXPECT_EQ(robot->actuators[0].temperature_limit_C, -40.0);
}

TEST(RobotConfig, RefusesADataPhaseThatIsSlowerThanTheArbitration) {
  const auto rates = [](const std::string& data) {
    return with(kRobot, "[[board]]", "bitrate = 500000\ndata_bitrate = " + data + "\n");
  };
  EXPECT_EQ(errors_of(rates("500000")), "");
  const std::string errors = errors_of(rates("499999"));
  EXPECT_NE(
      errors.find("bus.left.data_bitrate: is lower than the bitrate of the arbitration phase"),
      std::string::npos)
      << errors;
}

TEST(RobotConfig, RefusesReversedLimits) {
  expect_error(
      with("max_position_rad = 1.0", "max_position_rad = -2.0"),
      "robots/leg.toml:42: joint.hip.min_position_rad: the position limits are reversed or "
      "equal (min_position_rad must be less than max_position_rad)");
  expect_error(
      with("max_position_rad = 1.0", "max_position_rad = -1.5"),
      "robots/leg.toml:42: joint.hip.min_position_rad: the position limits are reversed or "
      "equal (min_position_rad must be less than max_position_rad)");
}

TEST(RobotConfig, RefusesEncodersWithoutCounts) {
  expect_error(with("\nencoder_counts_per_rev = 65536", "\nencoder_counts_per_rev = 20"),
               "robots/leg.toml:35: joint_defaults.encoder_counts_per_rev: 20 is out of range "
               "(must be at least 100 and at most 1e+12)");
  expect_error(with("\nencoder_counts_per_rev = 65536", ""),
               "robots/leg.toml:36: joint.hip.encoder_counts_per_rev: this key is missing "
               "(add it to the table, or to [joint_defaults] for all)\n"
               "robots/leg.toml:43: joint.knee.encoder_counts_per_rev: this key is missing "
               "(add it to the table, or to [joint_defaults] for all)");
}

TEST(RobotConfig, RefusesNodeIdsOffTheBus) {
  for (const std::string id : {"0", "127", "128"}) {  // 127 is the master's
    expect_error(with("node_id = 3", "node_id = " + id),
                 "robots/leg.toml:33: board.hip_board.node_id: " + id +
                     " is out of range (must be 1 to 126)");
  }
}

TEST(RobotConfig, RefusesASensorWithABoardsNodeId) {
  expect_error(with("node_id = 10", "node_id = 3"),
               "robots/leg.toml:56: sensor.foot_ft.node_id: node id 3 is taken on bus 'left' "
               "(every board and sensor of a bus needs an id of its own)");
}

TEST(RobotConfig, RefusesAJointOnTwoBoards) {
  const std::string text =
      with("[joint_defaults]",
           "[[board]]\nname = 'other'\nbus = 'left'\nnode_id = 4\n[joint_defaults]") +
      "[[joint]]\nname = 'hip'\nboard = 'other'\nactuator = 'big'\ngains = 'big'\n";
  expect_error(text,
               "robots/leg.toml:78: joint[2].name: the joint 'hip' is on two boards, 'hip_board' "
               "and 'other' (remove one of the two)");
}

TEST(RobotConfig, RefusesAnAxisTwice) {
  expect_error(with("axis = 1", "axis = 0"),
               "robots/leg.toml:47: joint.knee.axis: axis 0 of board 'hip_board' already drives "
               "joint 'hip' (give each joint of a board an axis of its own)");
}

TEST(RobotConfig, RefusesAGapInABoardsAxes) {
  expect_error(with("axis = 1", "axis = 3"),
               "robots/leg.toml:31: board.hip_board.name: the axes of board 'hip_board' have a gap "
               "(number them from 0 without a gap)");
}

TEST(RobotConfig, RefusesABoardWithoutJoint) {
  const std::string text = with(
      "[joint_defaults]", "[[board]]\nname = 'other'\nbus = 'left'\nnode_id = 4\n[joint_defaults]");
  EXPECT_NE(errors_of(text).find("no joint is on board 'other'"), std::string::npos);
}

TEST(RobotConfig, SuggestsTheNearestForAnUnknownReference) {
  const std::string text = with("axis = 1\nactuator = \"big\"\ngains = \"big\"",
                                "axis = 1\nactuator = \"bigg\"\ngains = \"bg\"");
  EXPECT_EQ(errors_of(text),
            "robots/leg.toml:48: joint.knee.actuator: there is no actuator 'bigg' "
            "(did you mean 'big'?)\n"
            "robots/leg.toml:49: joint.knee.gains: there is no gains table 'bg' "
            "(did you mean 'big'?)\n");
}

TEST(RobotConfig, RefusesAPostureOfAnUnknownJoint) {
  expect_error(with("knee = 0.2", "kne = 0.2"),
               "robots/leg.toml:72: posture.home.kne: there is no [[joint]] 'kne' "
               "(did you mean 'knee'?)");
}

TEST(RobotConfig, LeavesTheHeightOfABaseToTheDescription) {
  const auto robot = parse_robot_config(with("= 0.5\nknee", "= \"auto\"\nknee"), "leg.toml");
  ASSERT_TRUE(robot.has_value()) << robot.error()[0].to_string();
  EXPECT_TRUE(std::isnan(robot->postures[0].base_height_m));
  expect_error(with("= 0.5\nknee", "= \"atuo\"\nknee"),
               "robots/leg.toml:71: posture.home.base_height_m: 'atuo' is not one of the choices "
               "(did you mean 'auto'?)");
}

TEST(RobotConfig, ComputesNoHeightWithoutAFoot) {
  std::string text = with("= 0.5\nknee", "= \"auto\"\nknee");
  const std::size_t at = text.find("[contact]");
  text.erase(at, text.find("[posture.home]") - at);
  expect_error(text,
               "robots/leg.toml:61: posture.home.base_height_m: there is no [contact] with a foot "
               "to stand on (add one, or give a number)");
}

TEST(RobotConfig, RefusesAFootWhoseSiteTakesNoWrench) {
  EXPECT_NE(errors_of(with("wrench = true", "wrench = false")).find("takes no wrench"),
            std::string::npos);
}

TEST(RobotConfig, RefusesNoiseOfTheWrongLength) {
  EXPECT_NE(errors_of(with("noise = [1, 1, 1, 0.1, 0.1, 0.1]", "noise = [1, 1]"))
                .find("give one for each of the 6 channels"),
            std::string::npos);
}

TEST(RobotConfig, RefusesALockedJointThatIsDriven) {
  expect_error(with("toe = 0.1", "hip = 0.1"),
               "robots/leg.toml:38: joint.hip.name: the joint 'hip' is locked in [model.lock] "
               "(remove it here, or the lock)");
  expect_error(with("toe = 0.1", "knee = 0.1"),
               "robots/leg.toml:45: joint.knee.name: the joint 'knee' is locked in [model.lock] "
               "(remove it here, or the lock)");
  expect_error(with("knee = 0.2", "toe = 0.2"),
               "robots/leg.toml:72: posture.home.toe: the joint 'toe' is locked in [model.lock] "
               "(remove it here, or the lock)");
}

TEST(RobotConfig, ReportsAnOrderThatIsNoneOnce) {
  expect_error(with("spring_Nm_rad = 395.46\n", "order = 7\n"),
               "robots/leg.toml:18: actuator.big.order: 7 is out of range (must be 0 to 3)");
}

TEST(RobotConfig, RefusesNumbersFarOutOfRange) {
  for (const std::string number : {"1e300", "-1e31", "1e-300"}) {
    const std::string errors = errors_of(with("gear_ratio = 100", "gear_ratio = " + number));
    EXPECT_NE(errors.find("robots/leg.toml:15: actuator.big.gear_ratio: "), std::string::npos);
    EXPECT_NE(errors.find("is far out of range (give 0, or a size of 1e-30 to 1e30)\n"),
              std::string::npos)
        << errors;
  }
}

TEST(RobotConfig, RefusesATableOfTheWrongKindWithTheHeaderToWrite) {
  expect_error(with("[posture.home]", "[posture]\nhome = 3\n[posture.other]"),
               "robots/leg.toml:71: posture.home: belongs in a table with a name "
               "(write [posture.NAME] above it)");
  expect_error(with("[[sensor]]", "[sensor]"),
               "robots/leg.toml:52: sensor: must be an array of tables (write [[sensor]])");
}

TEST(RobotConfig, RefusesAnExperimentInItsPlace) {
  expect_error("duration_s = 1\nrobot = 'robot.toml'\n[[controller]]\nplugin = 'hold'\n",
               "robots/leg.toml:2: robot: this is an experiment, and a robot is needed "
               "(name the robot.toml that it names)");
}

TEST(RobotConfig, RefusesNamesThatCannotStandInFilesOrTopics) {
  for (const std::string name : {"a/1", "a b", ".a", "\\u00e4"}) {
    const std::string quoted = '"' + name + '"';
    const std::string shown = name.front() == '\\' ? "\u00e4" : name;
    for (const auto& [from, place] :
         {std::pair("\"sole\"\nlink", ":8: site."), std::pair("\"left\"\ninterface", ":28: bus."),
          std::pair("\"hip_board\"\nbus", ":31: board."),
          std::pair("\"foot_ft\"\ntype", ":53: sensor.")}) {
      const std::string old = from;
      const std::string text = with(old, quoted + old.substr(old.find('\n')));
      const std::string key = place + shown + ".name: '" + shown + "'";
      EXPECT_NE(errors_of(text).find("robots/leg.toml" + key), std::string::npos)
          << name << " " << place << "\n"
          << errors_of(text);
    }
  }
  expect_error(
      with("\"foot_ft\"", "\"foot-ft\""),
      "robots/leg.toml:53: sensor.foot-ft.name: 'foot-ft' has other characters than letters, "
      "digits and _, but it becomes part of a topic (use letters, digits and _)");
}

TEST(RobotConfig, RefusesAHeightOfAFixedBase) {
  const std::string text = with("base = \"floating\"", "base = \"fixed\"");
  expect_error(text,
               "robots/leg.toml:71: posture.home.base_height_m: a fixed base has no height "
               "(remove this key, or set base = \"floating\" in [model])");
  expect_error(with("base = \"floating\"", "base = \"fixd\""),
               "robots/leg.toml:4: model.base: 'fixd' is not one of the choices "
               "(did you mean 'fixed'?)");
}

TEST(RobotConfig, RefusesAStaticFrictionBelowTheSlidingOne) {
  EXPECT_NE(errors_of(with("static_friction = 0.9", "static_friction = 0.1"))
                .find("is less than sliding_friction"),
            std::string::npos);
}

TEST(RobotConfig, ReportsAllErrorsInTheFilesOrder) {
  std::string text = with("node_id = 3", "node_id = 300");
  text.replace(text.find("base = \"floating\""), 17, "base = \"flotaing\"");
  const auto robot = parse_robot_config(text, "leg.toml");
  ASSERT_FALSE(robot.has_value());
  ASSERT_GE(robot.error().size(), 2u);
  EXPECT_EQ(robot.error()[0].key, "model.base");
  EXPECT_EQ(robot.error()[0].hint, "did you mean 'floating'?");
}

TEST(RobotConfig, ReadsTheWatchOfOscillationTheTorquesRateAndTheBrake) {
  const auto plain = parse_robot_config(kRobot, "leg.toml");
  ASSERT_TRUE(plain.has_value());
  EXPECT_EQ(plain->joints[0].max_oscillation, 0.35);
  EXPECT_EQ(plain->joints[0].oscillation_time_s, 1.0);
  EXPECT_FALSE(plain->joints[0].max_torque_rate_Nm_s.has_value());
  EXPECT_FALSE(plain->joints[0].brake.has_value());
  const auto robot = parse_robot_config(
      with(kRobot, "[[sensor]]",
           "max_oscillation = 0\noscillation_time_s = 0.5\nmax_torque_rate_Nm_s = 9000\n"
           "brake = { torque_Nm = 120.5, release_ms = 40, engage_ms = 0 }\n"),
      "leg.toml");
  ASSERT_TRUE(robot.has_value()) << robot.error()[0].to_string();
  const JointConfig& joint = robot->joints[1];
  EXPECT_EQ(joint.max_oscillation, 0.0);
  EXPECT_EQ(joint.oscillation_time_s, 0.5);
  EXPECT_EQ(torque_rate_Nm_s(joint), 9000.0);
  ASSERT_TRUE(joint.brake.has_value());
  EXPECT_EQ(joint.brake->torque_Nm, 120.5);
  EXPECT_EQ(joint.brake->release_ms, 40);
  EXPECT_EQ(joint.brake->engage_ms, 0);
  EXPECT_FALSE(robot->joints[0].brake.has_value());
}

TEST(RobotConfig, ReadsTheWatchOfMotionBeyondItsLimits) {
  const auto robot = parse_robot_config(
      with(kRobot, "[[sensor]]", "max_swing = 0\nmax_excess = 0.5\nexcess_time_s = 0.2\n"),
      "leg.toml");
  ASSERT_TRUE(robot.has_value()) << robot.error()[0].to_string();
  EXPECT_EQ(robot->joints[0].max_swing, 0.25);
  EXPECT_EQ(robot->joints[0].max_excess, 0.25);
  EXPECT_EQ(robot->joints[0].excess_time_s, 0.1);
  EXPECT_EQ(robot->joints[1].max_swing, 0.0);
  EXPECT_EQ(robot->joints[1].max_excess, 0.5);
  EXPECT_EQ(robot->joints[1].excess_time_s, 0.2);
}

TEST(RobotConfig, RefusesStrangeBrakesOscillationsAndRatesWithLineAndKey) {
  struct Case {
    const char* line;
    const char* key;
  };
  for (const Case& one :
       {Case{"brake = 5", "brake"},
        Case{"brake = {}", "torque_Nm"},
        Case{"brake = { torque_Nm = 0, release_ms = 5, engage_ms = 5 }", "torque_Nm"},
        Case{"brake = { torque_Nm = nan, release_ms = 5, engage_ms = 5 }", "torque_Nm"},
        Case{"brake = { torque_Nm = inf, release_ms = 5, engage_ms = 5 }", "torque_Nm"},
        Case{"brake = { torque_Nm = 5, release_ms = -1, engage_ms = 5 }", "release_ms"},
        Case{"brake = { torque_Nm = 5, release_ms = 2.5, engage_ms = 5 }", "release_ms"},
        Case{"brake = { torque_Nm = 5, release_ms = 5 }", "engage_ms"},
        Case{"brake = { torque_Nm = 5, release_ms = 5, engage_ms = 1001 }", "engage_ms"},
        Case{"brake = { torque_Nm = 5, release_ms = 5, engage_ms = 5, colour = 1 }", "colour"},
        Case{"brake = [5, 5, 5]", "brake"},
        Case{"max_oscillation = -0.1", "max_oscillation"},
        Case{"max_oscillation = 11", "max_oscillation"},
        Case{"oscillation_time_s = 0", "oscillation_time_s"},
        Case{"max_swing = -1", "max_swing"},
        Case{"max_excess = 11", "max_excess"},
        Case{"excess_time_s = -1", "excess_time_s"},
        Case{"max_torque_rate_Nm_s = 0", "max_torque_rate_Nm_s"},
        Case{"max_torque_rate_Nm_s = -5", "max_torque_rate_Nm_s"},
        Case{"max_torque_rate_Nm_s = nan", "max_torque_rate_Nm_s"}}) {
    const std::string found = errors_of(with(kRobot, "[[sensor]]", std::string(one.line) + "\n"));
    EXPECT_NE(found.find("robots/leg.toml:"), std::string::npos) << one.line << "\n" << found;
    EXPECT_NE(found.find(one.key), std::string::npos) << one.line << "\n" << found;
  }
}

}  // namespace
}  // namespace tandem::hal
