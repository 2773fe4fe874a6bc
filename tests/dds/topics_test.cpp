// Each topic's content against the process image.
#include <Eigen/Geometry>
#include <map>

#include "hal/config/capabilities.hpp"
#include "model/dynamics.hpp"
#include "model/mechanism.hpp"
#include "model/sites.hpp"
#include "tests/dds/publisher_rig.hpp"

namespace tandem::dds {
namespace {

using namespace test;

/// The samples of one topic that cycle 20 leads to.
template <class T, class Use>
void publish_and_take(PublisherRig& rig, const std::string& topic, Use use) {
  auto reader = rig.reader<T>(topic);
  rig.start();
  rig.show(20);
  rig.publisher->stop();
  EXPECT_EQ(reader.take([&](const T& sample, const auto&) { use(sample); }), 1U);
}

class EveryRobot : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(, EveryRobot, testing::Values("double_pendulum", "coman"));

TEST_P(EveryRobot, HasJointStatesInTheImagesOrder) {
  PublisherRig rig({.robot = GetParam()});
  publish_and_take<sensor_msgs::JointState>(rig, "joint_states", [&](const auto& message) {
    std::vector<std::string> names;
    for (const hal::JointConfig& joint : rig.robot.config.joints) names.push_back(joint.name);
    EXPECT_EQ(texts(message.name), names);
    EXPECT_EQ(list(message.position), list_of(rig.state.position_rad()));
    EXPECT_EQ(list(message.velocity), list_of(rig.state.velocity_rad_s()));
    EXPECT_EQ(list(message.effort), list_of(rig.state.torque_Nm()));
    EXPECT_EQ(ns(message.header.stamp), 20'000'000);
    EXPECT_STREQ(message.header.frame_id, "");
  });
}

// robot_state_publisher drew such joints nowhere.
TEST(JointTopics, HaveTheJointsThatFollowOthers) {
  PublisherRig rig({.follows = true});
  ASSERT_EQ(rig.state.joints(), 1U);
  publish_and_take<sensor_msgs::JointState>(rig, "joint_states", [&](const auto& message) {
    EXPECT_EQ(texts(message.name), (std::vector<std::string>{"joint1", "joint2"}));
    EXPECT_EQ(list(message.position), (std::vector<double>{0.1, -2.0 * 0.1 + 0.5}));
    EXPECT_EQ(list(message.velocity), (std::vector<double>{-0.2, 0.4}));
    EXPECT_EQ(list(message.effort).front(), 3.0);
    EXPECT_TRUE(std::isnan(list(message.effort).back())) << "nobody measures it";
  });
}

TEST(JointTopics, AFollowersPlaceIsItsMultiplierAndItsOffset) {
  hal::RobotConfig robot;
  robot.joints.resize(2);
  robot.joints[0].name = "a";
  robot.joints[1].name = "b";
  model::Tree tree;
  tree.joints.resize(3);
  tree.joints[0].name = "driven_by_nobody";
  tree.joints[1].name = "b";
  tree.joints[2].name = "c";
  tree.joints[2].leader = 1;
  tree.joints[2].multiplier = -2.0;
  tree.joints[2].offset = 0.5;
  const auto found = robot::followers_of(robot, tree);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].name, "c");
  EXPECT_EQ(found[0].leader, 1U) << "in the image, not in the tree";
  EXPECT_EQ(found[0].multiplier, -2.0);
  EXPECT_EQ(found[0].offset, 0.5);
  tree.joints[2].leader = 0;
  EXPECT_TRUE(robot::followers_of(robot, tree).empty());
}

/// A second robot that is always one cycle behind.
class OneBehind final : public hal::ParallelSource {
 public:
  explicit OneBehind(const hal::StateImage& like) : view{like, {0.1, 0.2}, {0.3, 0.4}, {0.5, 0.6}} {
    view.state.time_ns()[0] = 19'000'000;
  }
  const hal::ParallelView* newest() noexcept override { return &view; }
  hal::ParallelView view;
};

TEST(ParallelTopics, HaveTheSecondRobotAndItsDifferenceAtItsOwnTime) {
  PublisherRig rig({.parallel = true});
  OneBehind second(rig.state);
  auto states = rig.reader<sensor_msgs::JointState>("parallel/joint_states");
  auto differences = rig.reader<sensor_msgs::JointState>("parallel/difference");
  rig.start(&second);
  rig.show(20);
  rig.publisher->stop();
  EXPECT_EQ(states.take([&](const auto& message, const auto&) {
    EXPECT_EQ(list(message.position), list_of(second.view.state.position_rad()));
    EXPECT_EQ(ns(message.header.stamp), 19'000'000);
  }),
            1U);
  EXPECT_EQ(differences.take([&](const auto& message, const auto&) {
    EXPECT_EQ(list(message.position), second.view.position_rad);
    EXPECT_EQ(list(message.velocity), second.view.velocity_rad_s);
    EXPECT_EQ(list(message.effort), second.view.torque_Nm);
  }),
            1U);
}

TEST_P(EveryRobot, HasDynamicJointStatesWhenTheyAreAskedFor) {
  Config config = own_config();
  config.every[static_cast<std::size_t>(Topic::kDynamicJointStates)] = 5;
  PublisherRig rig({.robot = GetParam(), .config = config});
  publish_and_take<control_msgs::DynamicJointState>(
      rig, "dynamic_joint_states", [&](const auto& message) {
        const auto joints = list(message.interface_values);
        ASSERT_EQ(joints.size(), rig.state.joints());
        for (std::size_t j = 0; j < joints.size(); ++j) {
          EXPECT_EQ(message.joint_names._buffer[j], rig.robot.config.joints[j].name);
          std::map<std::string, double> values;
          const auto names = texts(joints[j].interface_names);
          for (std::size_t i = 0; i < names.size(); ++i) {
            values[names[i]] = joints[j].values._buffer[i];
          }
          EXPECT_EQ(values.size(), 9U);
          EXPECT_EQ(values["position"], rig.state.position_rad()[j]);
          EXPECT_EQ(values["effort"], rig.state.torque_Nm()[j]);
          EXPECT_EQ(values["temperature"], rig.state.temperature_C()[j]);
        }
      });
}

/// A drive of another maker, whose sheet has no object of a current, a voltage or a temperature.
TEST(Topics, OfADriveThatDoesNotTellAValueHaveNone) {
  Config config = own_config();
  config.every[static_cast<std::size_t>(Topic::kDynamicJointStates)] = 5;
  PublisherRig rig({.robot = "double_pendulum_interpolated", .config = config});
  ASSERT_FALSE(hal::motor_feedback(rig.robot.config)[0].temperature);
  publish_and_take<control_msgs::DynamicJointState>(
      rig, "dynamic_joint_states", [&](const auto& message) {
        const auto joint = list(message.interface_values)[0];
        const auto names = texts(joint.interface_names);
        for (std::size_t i = 0; i < names.size(); ++i) {
          const bool of_motor = names[i] == "temperature" || names[i] == "voltage";
          EXPECT_EQ(std::isnan(joint.values._buffer[i]), of_motor || names[i] == "current")
              << names[i];
        }
      });
}

TEST(Topics, OfDiagnosticsSayWhatADriveDoesNotTell) {
  Config config = own_config();
  config.every[static_cast<std::size_t>(Topic::kDiagnostics)] = 5;
  PublisherRig rig({.robot = "double_pendulum_interpolated", .config = config});
  rig.state.temperature_C()[0] = 1e3;  // it is none, and cannot be too hot
  publish_and_take<diagnostic_msgs::DiagnosticArray>(rig, "diagnostics", [&](const auto& message) {
    std::size_t not_known = 0;
    for (const auto& status : list(message.status)) {
      if (std::string(status.name) != "tandem: joint " + rig.robot.config.joints[0].name) continue;
      EXPECT_EQ(status.level, 0) << status.message;
      for (const auto& value : list(status.values)) {
        not_known += std::string(value.value) == "not known" ? 1 : 0;
      }
    }
    EXPECT_EQ(not_known, 2U) << "temperature and current";
  });
}

TEST_P(EveryRobot, HasTheWholeStateAndCommand) {
  PublisherRig rig({.robot = GetParam()});
  auto commands = rig.reader<tandem_msgs::Command>("tandem/command");
  publish_and_take<tandem_msgs::State>(rig, "tandem/state", [&](const auto& s) {
    EXPECT_EQ(s.run, 77U);
    EXPECT_EQ(s.cycle, 20U);
    EXPECT_EQ(s.time_ns, 20'000'000);
    EXPECT_EQ(s.phase, static_cast<std::uint8_t>(hal::RunPhase::kRunning));
    EXPECT_EQ(list(s.position_rad), list_of(rig.state.position_rad()));
    EXPECT_EQ(list(s.velocity_rad_s), list_of(rig.state.velocity_rad_s()));
    EXPECT_EQ(list(s.acceleration_rad_s2), list_of(rig.state.acceleration_rad_s2()));
    EXPECT_EQ(list(s.torque_nm), list_of(rig.state.torque_Nm()));
    EXPECT_EQ(list(s.motor_position_rad), list_of(rig.state.motor_position_rad()));
    EXPECT_EQ(list(s.motor_velocity_rad_s), list_of(rig.state.motor_velocity_rad_s()));
    EXPECT_EQ(list(s.current_a), list_of(rig.state.current_A()));
    EXPECT_EQ(list(s.voltage_v), list_of(rig.state.voltage_V()));
    EXPECT_EQ(list(s.temperature_c), list_of(rig.state.temperature_C()));
    EXPECT_EQ(list(s.sensor), list_of(rig.state.sensor()));
    EXPECT_EQ(list(s.fault), list_of(rig.state.fault()));
    EXPECT_EQ(list(s.age_cycles), list_of(rig.state.age_cycles()));
    EXPECT_EQ(list(s.sensor_age_cycles), list_of(rig.state.sensor_age_cycles()));
    EXPECT_EQ(list(s.statusword), list_of(rig.state.statusword()));
    EXPECT_EQ(list(s.mode), list_of(rig.state.mode()));
    EXPECT_EQ(list(s.interaction), list_of(rig.state.interaction()));
    EXPECT_EQ(list(s.drive_state), list_of(rig.state.drive_state()));
  });
  EXPECT_EQ(commands.take([&](const tandem_msgs::Command& c, const auto&) {
    EXPECT_EQ(c.cycle, 20U);
    EXPECT_EQ(list(c.position_rad), list_of(rig.command.position_rad()));
    EXPECT_EQ(list(c.mode), list_of(rig.command.mode()));
    EXPECT_EQ(list(c.fault_reset), list_of(rig.command.fault_reset()));
  }),
            1U);
}

TEST(ImageMessages, HaveEveryFieldOfTheImages) {
  const hal::ImageShape shape{.joints = 3, .sensor_channels = {6, 10}};
  const hal::StateImage state(shape);
  const hal::CommandImage command(shape);
  for (const auto& [name, image] :
       {std::pair<const char*, const hal::Image*>{"tandem_msgs/msg/State", &state},
        {"tandem_msgs/msg/Command", &command}}) {
    const MessageDefinition* definition = find_definition(name);
    ASSERT_NE(definition, nullptr);
    for (const hal::Field& field : image->layout().fields()) {
      const auto found = std::ranges::find(definition->fields, field.name, &MessageField::name);
      ASSERT_NE(found, definition->fields.end()) << name << " has no " << field.name;
      const bool one = found->repeat == Repeat::kOne;
      EXPECT_EQ(one, field.count == 1) << field.name;
    }
  }
}

std::size_t sensor_of(const hal::RobotConfig& robot, hal::SensorType type) {
  for (std::size_t s = 0; s < robot.sensors.size(); ++s) {
    if (robot.sensors[s].type == type) return s;
  }
  ADD_FAILURE() << robot.name << " has no such sensor";
  return 0;
}

TEST(Topics, OfAnImuHaveItsLinksFrameAndNoCovariance) {
  PublisherRig rig({.robot = "coman"});
  const std::size_t imu = sensor_of(rig.robot.config, hal::SensorType::kImu);
  const hal::SensorConfig& config = rig.robot.config.sensors[imu];
  const auto v = rig.state.sensor_values(imu);
  publish_and_take<sensor_msgs::Imu>(rig, "imu/" + config.name, [&](const auto& m) {
    EXPECT_EQ(m.header.frame_id, config.link);
    EXPECT_EQ(ns(m.header.stamp), 20'000'000);
    EXPECT_EQ(
        (std::vector{m.orientation.x, m.orientation.y, m.orientation.z, m.orientation.w,
                     m.angular_velocity.x, m.angular_velocity.y, m.angular_velocity.z,
                     m.linear_acceleration.x, m.linear_acceleration.y, m.linear_acceleration.z}),
        list_of(v));
    for (int i = 0; i < 9; ++i) {
      EXPECT_EQ(m.orientation_covariance[i], 0.0);
      EXPECT_EQ(m.angular_velocity_covariance[i], 0.0);
      EXPECT_EQ(m.linear_acceleration_covariance[i], 0.0);
    }
  });
}

TEST(Topics, OfAnImuWithoutOrientationSaySoInItsCovariance) {
  PublisherRig rig({.robot = "coman"});
  const std::size_t imu = sensor_of(rig.robot.config, hal::SensorType::kImu);
  for (std::size_t i = 0; i < 4; ++i) rig.state.sensor_values(imu)[i] = 0.0;
  const std::string topic = "imu/" + rig.robot.config.sensors[imu].name;
  publish_and_take<sensor_msgs::Imu>(rig, topic, [&](const auto& m) {
    EXPECT_EQ(m.orientation_covariance[0], -1.0);
    EXPECT_EQ(m.orientation.w, 1.0);
  });
}

TEST(Topics, OfAForceSensorSkipOldSamplesAndWhatIsNotFinite) {
  PublisherRig rig({.robot = "coman"});
  const std::size_t ft = sensor_of(rig.robot.config, hal::SensorType::kForceTorque);
  const hal::SensorConfig& config = rig.robot.config.sensors[ft];
  auto reader = rig.reader<geometry_msgs::WrenchStamped>("wrench/" + config.name);
  rig.start();
  rig.show(20);
  rig.state.sensor_age_cycles()[ft] = 3;
  rig.show(30);
  rig.state.sensor_age_cycles()[ft] = 10;  // this one has been published already
  rig.show(40);
  rig.state.sensor_age_cycles()[ft] = 0;
  rig.state.sensor_values(ft)[2] = std::nan("");
  rig.show(50);
  rig.publisher->stop();
  std::vector<std::int64_t> stamps;
  reader.take([&](const geometry_msgs::WrenchStamped& m, const auto&) {
    EXPECT_EQ(m.header.frame_id, config.link);
    stamps.push_back(ns(m.header.stamp));
    EXPECT_EQ(m.wrench.force.x, rig.state.sensor_values(ft)[0]);
    EXPECT_EQ(m.wrench.torque.z, rig.state.sensor_values(ft)[5]);
  });
  EXPECT_EQ(stamps, (std::vector<std::int64_t>{20'000'000, 27'000'000}));
}

void set_base(hal::TruthImage& truth) {
  const Eigen::Quaterniond q = Eigen::Quaterniond(0.8, 0.1, -0.3, 0.5).normalized();
  const double position[] = {1.0, -2.0, 0.5}, turned[] = {q.x(), q.y(), q.z(), q.w()};
  const double velocity[] = {0.1, 0.2, 0.3, 0.4, 0.5, 0.6};
  std::ranges::copy(position, truth.base_position_m().begin());
  std::ranges::copy(turned, truth.base_quaternion().begin());
  std::ranges::copy(velocity, truth.base_velocity().begin());
}

TEST(Topics, OfOdometryHaveTheTwistInTheChildsFrame) {
  PublisherRig rig({.robot = "coman"});
  set_base(rig.truth);
  publish_and_take<nav_msgs::Odometry>(rig, "odom", [&](const auto& m) {
    EXPECT_STREQ(m.header.frame_id, "odom");
    EXPECT_EQ(m.child_frame_id, rig.robot.description.tree.links[0].name);
    EXPECT_EQ(m.pose.pose.position.y, -2.0);
    EXPECT_EQ(m.pose.pose.orientation.w, rig.truth.base_quaternion()[3]);
    EXPECT_EQ(m.twist.twist.linear.z, 0.3);
    EXPECT_EQ(m.twist.twist.angular.x, 0.4);
    EXPECT_EQ(m.pose.covariance[0], 0.0);
  });
}

TEST(Topics, OfOdometryAreTheEstimateWhereThereIsOne) {
  PublisherRig rig({.robot = "coman", .estimated = true});
  set_base(rig.truth);
  hal::EstimateImage& estimate = *rig.estimate;
  estimate.base_valid()[0] = 1;
  estimate.base_position_m()[1] = 7.0;
  estimate.base_quaternion()[3] = 1.0;
  estimate.base_velocity()[5] = -0.5;
  publish_and_take<nav_msgs::Odometry>(rig, "odom", [&](const auto& m) {
    EXPECT_EQ(m.pose.pose.position.y, 7.0);
    EXPECT_EQ(m.pose.pose.orientation.w, 1.0);
    EXPECT_EQ(m.twist.twist.angular.z, -0.5);
  });
}

// The image has the wrench in W's axes about the site; the message has it in its frame.
TEST(Topics, OfAnExternalWrenchHaveItInTheFrameOfTheSitesLink) {
  PublisherRig rig({.robot = "panda", .wrenches = {"hand"}});
  const model::Tree& tree = rig.robot.description.tree;
  hal::SiteConfig& site = rig.robot.config.model.sites.front();
  ASSERT_EQ(site.name, "hand");
  const double f[] = {12.0, -20.0, 15.0}, m[] = {1.0, 2.0, -3.0};
  std::ranges::copy(f, rig.estimate->external_force_N().begin());
  std::ranges::copy(m, rig.estimate->external_moment_Nm().begin());
  // Where the link is, by another way: the kernels' algorithms.
  model::ModelSpec spec;
  spec.sites.push_back({.name = "link", .link = site.link});
  const auto mechanism = model::make_mechanism(tree, spec);
  ASSERT_TRUE(mechanism);
  std::vector<double> q(7);
  for (std::size_t j = 0; j < 7; ++j) {
    const int at = rig.robot.config.joint_index(mechanism->joint_names[j]);
    q[j] = rig.state.position_rad()[static_cast<std::size_t>(at)];
  }
  const std::vector<double> zero(7, 0.0);
  const auto pose =
      model::evaluate_kernel(model::Kernel::kSiteMotion, *mechanism, {q, zero, zero})[0];
  const Eigen::Matrix3d R =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(pose.data());
  const Eigen::Vector3d force = R.transpose() * Eigen::Vector3d(f);
  const Eigen::Vector3d moment =
      R.transpose() * Eigen::Vector3d(m) + Eigen::Vector3d(site.xyz_m.data()).cross(force);
  publish_and_take<geometry_msgs::WrenchStamped>(rig, "external_wrench/hand", [&](const auto& w) {
    EXPECT_EQ(w.header.frame_id, site.link);
    EXPECT_EQ(ns(w.header.stamp), 20'000'000);
    EXPECT_NEAR(w.wrench.force.x, force.x(), 1e-9);
    EXPECT_NEAR(w.wrench.force.y, force.y(), 1e-9);
    EXPECT_NEAR(w.wrench.force.z, force.z(), 1e-9);
    EXPECT_NEAR(w.wrench.torque.x, moment.x(), 1e-9);
    EXPECT_NEAR(w.wrench.torque.y, moment.y(), 1e-9);
    EXPECT_NEAR(w.wrench.torque.z, moment.z(), 1e-9);
  });
}

TEST(Topics, OfAnExternalWrenchAreSilentUntilTheBasesEstimateHasStarted) {
  PublisherRig rig({.robot = "coman", .estimated = true, .wrenches = {"imu"}});
  auto reader = rig.reader<geometry_msgs::WrenchStamped>("external_wrench/imu");
  rig.start();
  rig.show(20);
  rig.estimate->base_valid()[0] = 1;
  rig.estimate->base_quaternion()[3] = 1.0;
  rig.show(30);
  rig.publisher->stop();
  std::vector<std::int64_t> stamps;
  reader.take([&](const geometry_msgs::WrenchStamped& w, const auto&) {
    stamps.push_back(ns(w.header.stamp));
  });
  EXPECT_EQ(stamps, std::vector<std::int64_t>{30'000'000});
}

/// Frames as a listener puts them together: each link's placement in the root of its chain.
class Listener {
 public:
  void hear(const tf2_msgs::TFMessage& message) {
    for (const auto& t : list(message.transforms)) {
      const auto& [p, q] = t.transform;
      edges_[t.child_frame_id] = {
          t.header.frame_id,
          {Eigen::Quaterniond(q.w, q.x, q.y, q.z).toRotationMatrix(), {p.x, p.y, p.z}}};
    }
  }
  [[nodiscard]] std::size_t size() const { return edges_.size(); }
  [[nodiscard]] model::Placement find(const std::string& frame) const {
    const auto edge = edges_.find(frame);
    if (edge == edges_.end()) return {};
    return find(edge->second.first) * edge->second.second;
  }

 private:
  std::map<std::string, std::pair<std::string, model::Placement>> edges_;
};

TEST_P(EveryRobot, HasFramesThatAreTheModelsKinematics) {
  PublisherRig rig({.robot = GetParam()});
  set_base(rig.truth);
  const model::Tree& tree = rig.robot.description.tree;
  Listener listener;
  auto fixed = rig.reader<tf2_msgs::TFMessage>("tf_static", true);
  publish_and_take<tf2_msgs::TFMessage>(rig, "tf", [&](const auto& message) {
    EXPECT_EQ(message.transforms._length, rig.state.joints() + (tree.floating_base ? 1 : 0));
    EXPECT_EQ(ns(message.transforms._buffer[0].header.stamp), 20'000'000);
    listener.hear(message);
  });
  fixed.take([&](const tf2_msgs::TFMessage& message, const auto&) { listener.hear(message); });
  EXPECT_EQ(listener.size(), tree.links.size()) << "each in another, and the root in odom";

  // The same from the generated kernels' algorithms: a site in every link's frame.
  model::ModelSpec spec;
  for (const model::Link& link : tree.links) {
    spec.sites.push_back({.name = link.name, .link = link.name});
  }
  const auto mechanism = model::make_mechanism(tree, spec);
  ASSERT_TRUE(mechanism) << mechanism.error().to_string();
  std::vector<double> q(static_cast<std::size_t>(mechanism->nq())), pose(12 * tree.links.size()),
      still(static_cast<std::size_t>(mechanism->nv())), rest(6 * tree.links.size());
  if (tree.floating_base) {
    std::ranges::copy(rig.truth.base_position_m(), q.begin());
    std::ranges::copy(rig.truth.base_quaternion(), q.begin() + 3);
  }
  for (std::size_t j = 0; j < rig.state.joints(); ++j) {
    const int joint = tree.joint_index(rig.robot.config.joints[j].name);
    q[static_cast<std::size_t>(mechanism->q_index(joint))] = rig.state.position_rad()[j];
  }
  model::site_motion<double>(*mechanism, q, still, still, pose, rest, rest);
  for (std::size_t i = 0; i < tree.links.size(); ++i) {
    const model::Placement found = listener.find(tree.links[i].name);
    const double* expected = pose.data() + 12 * i;
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) {
        EXPECT_NEAR(found.R(row, column), expected[3 * row + column], 1e-12) << tree.links[i].name;
      }
      EXPECT_NEAR(found.p[row], expected[9 + row], 1e-12) << tree.links[i].name;
    }
  }
}

TEST(Topics, OfFramesLeaveOutAJointThatHasNoPosition) {
  PublisherRig rig;
  rig.state.position_rad()[0] = std::nan("");
  publish_and_take<tf2_msgs::TFMessage>(rig, "tf", [&](const auto& message) {
    EXPECT_EQ(message.transforms._length, rig.state.joints() - 1);
  });
}

/// Levels and messages by name.
std::map<std::string, std::pair<int, std::string>> statuses(
    const diagnostic_msgs::DiagnosticArray& message) {
  std::map<std::string, std::pair<int, std::string>> found;
  for (const auto& status : list(message.status)) {
    found[status.name] = {status.level, status.message};
  }
  return found;
}

TEST(Topics, OfDiagnosticsSayWhichJointAndBoardIsNotWell) {
  PublisherRig rig({.robot = "coman"});
  const auto& joints = rig.robot.config.joints;
  rig.state.fault()[0] = 0x8611;
  rig.state.age_cycles()[5] = 40;
  rig.state.temperature_C()[8] = 107.9;
  rig.state.temperature_C()[9] = 108.0;  // docs/faults.md: with a warning from 108
  rig.robot.config.joints[10].homing = hal::HomingConfig{};
  rig.state.homing()[10] = static_cast<std::uint8_t>(hal::HomingState::kNotHomed);
  rig.state.homing()[11] = static_cast<std::uint8_t>(hal::HomingState::kHomed);
  rig.set_faults(
      {{12, 0.012, joints[12].name, joints[12].board, "following error",
        hal::StopCategory::kCategory1, true, 0.0},
       {13, 0.013, joints[12].name, joints[12].board, "hot, too", hal::StopCategory::kWarn, true,
        0.0},
       {13, 0.013, joints[13].name, joints[13].board, "hot", hal::StopCategory::kWarn, true, 0.0}});
  auto reader = rig.reader<diagnostic_msgs::DiagnosticArray>("diagnostics");
  auto faults = rig.reader<tandem_msgs::Faults>("tandem/faults", true);
  rig.start();
  ASSERT_TRUE(eventually([&] { return faults.take([](const auto&, const auto&) {}) > 0; }));
  rig.phase = hal::RunPhase::kFaulted;
  std::size_t heard = 0;
  ASSERT_TRUE(eventually([&] {  // until the fault has been read, too
    rig.show(1000 * ++heard);
    bool told = false;
    reader.take([&](const diagnostic_msgs::DiagnosticArray& message, const auto&) {
      const auto found = statuses(message);
      const auto of = [&](std::size_t j) { return found.at("tandem: joint " + joints[j].name); };
      told = of(12) == std::pair<int, std::string>(2, "following error");
      EXPECT_EQ(of(0), (std::pair<int, std::string>(2, "fault 0x8611")));
      EXPECT_EQ(of(1).first, 0);
      EXPECT_EQ(of(5), (std::pair<int, std::string>(3, "no feedback for 40 cycles")));
      EXPECT_EQ(of(8).first, 0);
      EXPECT_EQ(of(9),
                (std::pair<int, std::string>(1, "the winding is hot: 108 of at most 120 C")));
      EXPECT_EQ(of(10).first, 1);
      EXPECT_TRUE(of(10).second.ends_with(", not homed")) << of(10).second;
      EXPECT_EQ(of(11).first, 0);
      if (told) {
        EXPECT_EQ(of(13), (std::pair<int, std::string>(1, "hot"))) << "it stops nothing";
      }
      EXPECT_EQ(found.at("tandem: run").first, 2);
      EXPECT_EQ(found.at("tandem: board " + joints[0].board).first, 2);
      EXPECT_EQ(found.at("tandem: board " + joints[0].board).second,
                joints[0].name + ": fault 0x8611");
    });
    return told;
  }));
}

}  // namespace
}  // namespace tandem::dds
