#include "dds/message_definition.hpp"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <regex>
#include <sstream>

#include "dds/types.hpp"

namespace tandem::dds {
namespace {

struct Published {
  const char* type;
  const char* hash;
};

/// Hashes from public copies of what ROS 2's own generator wrote (…__description.c, …__struct.h),
/// and from tables that others keep, by GitHub repository.
constexpr Published kDefinitions[] = {
    // kuenem/Group-12_MotionPlanning-New: build/tf2_msgs/…/tf_message__description.c
    {"tf2_msgs/msg/TFMessage", "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"},
    {"builtin_interfaces/msg/Time",
     "b106235e25a4c5ed35098aa0a61a3ee9c9b18d197f398b0e4206cea9acf9c197"},
    {"geometry_msgs/msg/Quaternion",
     "8a765f66778c8ff7c8ab94afcc590a2ed5325a1d9a076ffff38fbce36f458684"},
    {"geometry_msgs/msg/Transform",
     "beb83fbe698636351461f6f35d1abb20010c43d55374d81bd041f1ba2581fddc"},
    {"geometry_msgs/msg/TransformStamped",
     "0a241f87d04668d94099cbb5ba11691d5ad32c2f29682e4eb5653424bd275206"},
    {"geometry_msgs/msg/Vector3",
     "cc12fe83e4c02719f1ce8070bfd14aecd40f75a96696a67a2a1f37f7dbb0765d"},
    {"std_msgs/msg/Header", "f49fb3ae2cf070f793645ff749683ac6b06203e41c891e17701b1cb597ce6a01"},
    // dhruvigoradia/ros2-warehouse-robot: build/control_msgs/…/dynamic_joint_state__description.c
    {"control_msgs/msg/DynamicJointState",
     "18024c98a62697680f581108eeed40b28fb4542fa0ac5a8e36f56c62b6813d26"},
    {"control_msgs/msg/InterfaceValue",
     "74a12144ef6b7af67533195cb30f7f607d3301b66950208a72d280695f3e190c"},
    // hpmicro/hpm_sdk: middleware/microros/kilted/include/std_srvs/…/trigger__description.c
    {"std_srvs/srv/Trigger", "eeff2cd6fa5ad9d27cdf4dec64818317839b62f212a91e6b5304b634b2062c5f"},
    {"std_srvs/srv/Trigger_Request",
     "d010825374ce8918e72bfd826c82603e60f45419e932ea976f807b74a863a199"},
    {"std_srvs/srv/Trigger_Response",
     "2d946c21e2fc3f1e9ca6986a8191d85fcc70097a8bb7771a053564bc47009cdf"},
    {"std_srvs/srv/Trigger_Event",
     "ec4a1d26b0575e61906890342aba9523a2360e9845857c5590fa6e23bc39e1c2"},
    {"service_msgs/msg/ServiceEventInfo",
     "41bcbbe07a75c9b52bc96bfd5c24d7f0fc0a08c0cb7921b3373c5732345a6f45"},
    // hpmicro/hpm_sdk: middleware/microros/kilted/include/rcl_interfaces/…__struct.h
    {"rcl_interfaces/srv/GetParameters",
     "bf9803d5c74cf989a5de3e0c2e99444599a627c7ff75f97b8c05b01003675cbc"},
    {"rcl_interfaces/srv/GetParameters_Request",
     "135a9e1c3d7cebef792f6687d7ddf99949b21a0bd9a320d863a9110a3f5cf4d6"},
    {"rcl_interfaces/srv/GetParameters_Response",
     "9fa773b46e39cc5d02db6224d8fd520bb9caeeffc2b27c96c1e59431baba9f2a"},
    {"rcl_interfaces/srv/GetParameterTypes",
     "da199c878688b3e530bdfe3ca8f74cb9fa0c303101e980a9e8f260e25e1c80ca"},
    {"rcl_interfaces/srv/GetParameterTypes_Request",
     "87d7ec5ef545d4daa289d500025d31fb2437bc8b8365ca367161c4dac4be33fd"},
    {"rcl_interfaces/srv/GetParameterTypes_Response",
     "ac1335dce67c478e669434f6ac2fbff34fcd529580f272d3006785ba8b54e47f"},
    {"rcl_interfaces/srv/ListParameters",
     "3e6062bfbb27bfb8730d4cef2558221f51a11646d78e7bb30a1e83afac3aad9d"},
    {"rcl_interfaces/srv/ListParameters_Request",
     "a1b0b5d6b967a5b8ac5bc8563c3ea678f349e312a6a4967227c5a96bc5ce38df"},
    {"rcl_interfaces/srv/ListParameters_Response",
     "31b937b82de3612426be79f231e386259f97e8dc843e3f2845288b4bfa296bdd"},
    {"rcl_interfaces/srv/DescribeParameters",
     "845b484d71eb0673dae682f2e3ba3c4851a65a3dcfb97bddd82c5b57e91e4cff"},
    {"rcl_interfaces/srv/DescribeParameters_Request",
     "05dd1c2bc87dec2627105c8070d6f9725c781a4f2ab852975bf105462b82b644"},
    {"rcl_interfaces/srv/DescribeParameters_Response",
     "ad6747319613c6131589e062e095b469a46cc764f7d0f12a001a49e6cd893995"},
    {"rcl_interfaces/srv/SetParameters",
     "56eed9a67e169f9cb6c1f987bc88f868c14a8fc9f743a263bc734c154015d7e0"},
    {"rcl_interfaces/srv/SetParameters_Request",
     "130d46386b7e84ea9ecf60608a4d83cbe5e5cb7c6cc5b712b7a4e3a6c254e932"},
    {"rcl_interfaces/srv/SetParameters_Response",
     "7a0e8140a0b8d98308fa81a5403a766e610af29a239caf54b7553227906fc266"},
    {"rcl_interfaces/srv/SetParametersAtomically",
     "0e192ef259c07fc3c07a13191d27002222e65e00ccec653ca05e856f79285fcd"},
    {"rcl_interfaces/srv/SetParametersAtomically_Request",
     "db0bd950ed5ed867a0e90b225e44dea382d762c0762ff3e0ee842190042a59e5"},
    {"rcl_interfaces/srv/SetParametersAtomically_Response",
     "31b1a38c5b0b9d893ee24da45f69638f4561c78461d82d52750f429b534502b8"},
    {"rcl_interfaces/msg/Log", "e28ce254ca8abc06abf92773b74602cdbf116ed34fbaf294fb9f81da9f318eac"},
    // several: rosbag2's and zenoh's tests, of topics of a Jazzy graph
    {"rcl_interfaces/msg/ParameterEvent",
     "043e627780fcad87a22d225bc2a037361dba713fca6a6b9f4b869a5aa0393204"},
    {"rcl_interfaces/msg/Parameter",
     "ddfe6442cffc462317adb5c92536a7b6dd55858c5c3e1e328165a6b73c2831af"},
    {"rcl_interfaces/msg/ParameterValue",
     "115fc089a387e23c7ecd3525c9189c379109119d6ab82e8dfbde0fdf6a7f9b68"},
    {"rcl_interfaces/msg/SetParametersResult",
     "cfcc0fb0371ee5159b403960ef4300f8f9d2f1fd6117c8666b7f9654d528a9b1"},
    // Pico-ROS/Pico-ROS-software: examples/example_types.h
    {"std_msgs/msg/String", "df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"},
    {"geometry_msgs/msg/Point", "6963084842a9b04494d6b2941d11444708d892da2f4b09843b9c43f42a7f6881"},
    {"geometry_msgs/msg/Pose", "d501954e9476cea2996984e812054b68026ae0bfae789d9a10b23daf35cc90fa"},
    {"geometry_msgs/msg/Twist", "9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a"},
    {"geometry_msgs/msg/PoseWithCovariance",
     "9a7c0fd234b7f45c6098745ecccd773ca1085670e64107135397aee31c02e1bb"},
    {"geometry_msgs/msg/TwistWithCovariance",
     "49f574f033f095d8b6cd1beaca5ca7925e296e84af1716d16c89d38b059c8c18"},
    {"nav_msgs/msg/Odometry", "3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0"},
    // several: wrench_stamped__, imu__, joint_state__ and clock__description.c,
    // diagnostic_array__struct.h
    {"geometry_msgs/msg/Wrench",
     "018e8519d57c16adbe97c9fe1460ef21fec7e31bc541de3d653a35895677ce52"},
    {"geometry_msgs/msg/WrenchStamped",
     "8dc3deaf06b2ab281f9f9a742a8961c328ca7cec16e3fd6586d3a5c83fa78f77"},
    {"sensor_msgs/msg/Imu", "7d9a00ff131080897a5ec7e26e315954b8eae3353c3f995c55faf71574000b5b"},
    {"sensor_msgs/msg/JointState",
     "a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e"},
    {"rosgraph_msgs/msg/Clock", "692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564"},
    {"diagnostic_msgs/msg/DiagnosticArray",
     "5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e"},
    // several: twist_stamped__, joint_trajectory__ and joint_trajectory_point__description.c
    {"geometry_msgs/msg/TwistStamped",
     "5f0fcd4f81d5d06ad9b4c4c63e3ea51b82d6ae4d0558f1d475229b1121db6f64"},
    {"trajectory_msgs/msg/JointTrajectory",
     "179b33eba59d676f6d967ac71fe35e7ca2f64b2f3928f4a018cec115e213796e"},
    {"trajectory_msgs/msg/JointTrajectoryPoint",
     "de8907036d8bd45aac6f30cc9044a3d4a329c42cbf719aff7d95a584cfa532d7"},
    // visualization_msgs' marker_array__description.c
    {"visualization_msgs/msg/MarkerArray",
     "86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf"},
    {"visualization_msgs/msg/Marker",
     "45b13ccf791f225962bf74e746f9644518855d783a6f42ba0cc14fde2b4f3ce0"},
    {"visualization_msgs/msg/MeshFile",
     "7710ece15a148fb7c9b546364cfb215bb06098087bd6394fe5b73a493508f8c4"},
    {"visualization_msgs/msg/UVCoordinate",
     "f27f7ed21fe360c6066944f856b801a0c0d1e94e815b6886444b42d90b196a26"},
    {"sensor_msgs/msg/CompressedImage",
     "15640771531571185e2efc8a100baf923961a4d15d5569652e6cb6691e8e371a"},
    {"std_msgs/msg/ColorRGBA", "77a7a5b9ae477306097665106e0413ba74440245b1f3d0c6d6405fe5c7813fe8"},
    // EXPECTED_HASH of those that use them: joy_state__ and
    // float64_multi_array_stamped__description.c,
    // and ten others of PoseStamped
    {"geometry_msgs/msg/PoseStamped",
     "10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8"},
    {"sensor_msgs/msg/Joy", "0d356c79cad3401e35ffeb75a96a96e08be3ef896b8b83841d73e890989372c5"},
    {"std_msgs/msg/Float64MultiArray",
     "1025ddc6b9552d191f89ef1a8d2f60f3d373e28b283d8891ddcc974e8c55397f"},
    {"std_msgs/msg/MultiArrayDimension",
     "5e773a60a4c7fc8a54985f307c7837aa2994252a126c301957a24e31282c9cbe"},
    {"std_msgs/msg/MultiArrayLayout",
     "4c66e6f78e740ac103a94cf63259f968e48c617e7699e829b63c21a5cb50dac6"},
    // saahu27/aprs: build/control_msgs/…/follow_joint_trajectory__description.c
    {"control_msgs/action/FollowJointTrajectory",
     "738ebcb7a2d7cfa42f9f1001cc99ce3a4383d1cfe508015d9be8485e4b1c66f6"},
    {"control_msgs/action/FollowJointTrajectory_Goal",
     "8a9060704b269608f5a340934cc26e66869dd14bdac29e2e7fd9ec8b9882d205"},
    {"control_msgs/action/FollowJointTrajectory_Result",
     "8002e99ed2c14c6faa522f2a93c26d744c5982f254f9e98ff9c6f19789bdb220"},
    {"control_msgs/action/FollowJointTrajectory_Feedback",
     "3fd0aaecf71725121ae1ff7f01098a5e0da581e672be18a6b2c286cb43d96b49"},
    {"control_msgs/action/FollowJointTrajectory_SendGoal",
     "b13789dddc325a7a962825c45e28c77d37237ec129dd0c34dc5994562938c57f"},
    {"control_msgs/action/FollowJointTrajectory_SendGoal_Request",
     "179c93691f1f6d1d115881ff88c3917b7cc6eac2ba4bf56766cc7c4389e19ef1"},
    {"control_msgs/action/FollowJointTrajectory_SendGoal_Response",
     "e6a48ba740ae254500129a877f0b071be8663a115da1a539b74599cc97921fbf"},
    {"control_msgs/action/FollowJointTrajectory_SendGoal_Event",
     "906dd566308db02673c73c654f69bdd84738589629c1bc2841ddb49059ed1c6f"},
    {"control_msgs/action/FollowJointTrajectory_GetResult",
     "e3ceb38e3e1867c8dc0f46014df26e90eb93422f27e9e97f936e07f94be4bc8b"},
    {"control_msgs/action/FollowJointTrajectory_GetResult_Request",
     "ecf7ea8463d3beec7084bca75216d0b01b87b6e1e4e09679bb26093041efcbe9"},
    {"control_msgs/action/FollowJointTrajectory_GetResult_Response",
     "08eefbaa146ce02ba45898d5e99160afd6c4c54a30d159aee0f2ca6035b1580f"},
    {"control_msgs/action/FollowJointTrajectory_GetResult_Event",
     "43161a489e52daaa5bbc2fa74f73f1804d099574fcf8f819170807d75472662a"},
    {"control_msgs/action/FollowJointTrajectory_FeedbackMessage",
     "80398fcb9674a79081a9906e2ccf0c804dd7cb15e22e362e606ee87186beab71"},
    {"control_msgs/msg/JointTolerance",
     "c254f9cece0f3b733017b6990fd46d1326e25242d6b8844398c97d9a88e7d648"},
    {"control_msgs/msg/JointComponentTolerance",
     "739ea7566931944d33830fa10f1bf5e7a7fbdc3172bce7a7eaac642bd6e3ffa4"},
    {"trajectory_msgs/msg/MultiDOFJointTrajectory",
     "3a18fd095292a65cfde8833c72985a30af981f3ec44494655c6267262b443a4a"},
    {"trajectory_msgs/msg/MultiDOFJointTrajectoryPoint",
     "6ada1085b5ee64eaa069b074968e69f0e27c8c5e6f5bb0586dd1c834ef0e32b8"},
    {"unique_identifier_msgs/msg/UUID",
     "1b8e8aca958cbea28fe6ef60bf6c19b683c97a9ef60bb34752067d0f2f7ab437"},
    // hpmicro/hpm_sdk: middleware/microros/kilted/include/action_msgs/…__description.c
    {"action_msgs/msg/GoalInfo",
     "6398fe763154554353930716b225947f93b672f0fb2e49fdd01bb7a7e37933e9"},
    {"action_msgs/msg/GoalStatus",
     "32f4cfd717735d17657e1178f24431c1ce996c878c515230f6c5b3476819dbb9"},
    {"action_msgs/msg/GoalStatusArray",
     "6c1684b00f177d37438febe6e709fc4e2b0d4248dca4854946f9ed8b30cda83e"},
    {"action_msgs/srv/CancelGoal",
     "573d8b0a534451d7bc2ac8c5ffde8ac14b8593b7001175d0cd6516dcbeb8689a"},
    {"action_msgs/srv/CancelGoal_Request",
     "3d3c84653c1f96918086887e1dcb236faec88b81a5b14fd4cf4840065bcdf8af"},
    {"action_msgs/srv/CancelGoal_Response",
     "35e682cf3f510e83c70a82a4aac888496dedee56773bf9d8e5e0aa81f9e1c960"},
    // rmw_dds_common's participant_entities_info__description.c
    {"rmw_dds_common/msg/ParticipantEntitiesInfo",
     "91a0593bacdcc50ea9bdcf849a938b128412cc1ea821245c663bcd26f83c295e"},
    {"rmw_dds_common/msg/Gid", "ab6f21cfbb0a6dbb837161e1110c2051a2850ed9f9c53944d7115d9bcebedf71"},
    // dhruvigoradia/ros2-warehouse-robot:
    // build/controller_manager_msgs/…/list_controllers__description.c
    {"controller_manager_msgs/msg/ChainConnection",
     "2daecd1da4b171f48b291c79747657a651eb1ab8821b68e38b1c88c736bba91c"},
    {"controller_manager_msgs/msg/ControllerState",
     "9a8780ab9814b6032978a07c6c7033cf1a7894ac8d948a6fb72afea07b04cc83"},
    {"controller_manager_msgs/srv/ListControllers",
     "4f8e36bb1fa5afdeba45c2d56ae6a2097b1493a253f961dd6290c085033bd189"},
    {"controller_manager_msgs/srv/ListControllers_Request",
     "fb985bc3dcc9b07c7d3af4b46787afa5a09ac79da6465ea42b5696f9355c1f70"},
    {"controller_manager_msgs/srv/ListControllers_Response",
     "445459f6b387bda67942d8bea4dfee82dedf12388317e68d5bc4513993799b86"},
    {"controller_manager_msgs/srv/ListControllers_Event",
     "33f64fb8f4d3a7415113d5b6a9fa74f91c732c5f4d491b0077cfe8f7ca15cb2b"},
    // Brainiac11/ros2-coding:
    // build/controller_manager_msgs/…/list_hardware_components__description.c
    {"controller_manager_msgs/msg/HardwareComponentState",
     "8723f76b60e3ea54920065e3e777d93c68b76fc12839ad6a6ca4e0a6439b384c"},
    {"controller_manager_msgs/msg/HardwareInterface",
     "b4c556991db81ca56a49338b5e8f0675a6707faee54fba161d2bbd4d963d418a"},
    {"lifecycle_msgs/msg/State",
     "dd2d02b82f3ebc858e53c431b1e6e91f3ffc71436fc81d0715214ac6ee2107a0"},
    {"controller_manager_msgs/srv/ListHardwareComponents_Request",
     "4d528f3bba24425b73c788ebcb6462bf77d40eb194b77682138f079f821faeab"},
    {"controller_manager_msgs/srv/ListHardwareComponents_Response",
     "9607f3bd43ebcfaa25ca4f506701fb2697186a986364f58649b43182d9dd1556"},
    // several: …_controller__, list_controller_types__, list_hardware_interfaces__,
    // reload_controller_libraries__ and set_hardware_component_state__description.c
    {"controller_manager_msgs/srv/ConfigureController_Request",
     "027c272c6b945317d5e057515c83c747725ccaf9d345be6f6941383f6472d3a9"},
    {"controller_manager_msgs/srv/ConfigureController_Response",
     "f22a10e36403ebf6e9a54f5fa76dddb7c0af2e5417f4ff098bb0525bf89a726d"},
    {"controller_manager_msgs/srv/ListControllerTypes_Request",
     "b6cda89b7e31f5525f7a328119f64f6bf5710db263cecb00f91e59aa9b5d41de"},
    {"controller_manager_msgs/srv/ListControllerTypes_Response",
     "4e924ba35dac47257de06fabd757aaf7bd05f47da99dc878864c9c3f9a3f721e"},
    {"controller_manager_msgs/srv/LoadController_Request",
     "7a6624df1a6c972c13c9c5b71f13eda236226b7c08f118feccbbc60ad1829216"},
    {"controller_manager_msgs/srv/LoadController_Response",
     "8ce86b422a67d8150b4a2885fcce601670c39a7fddb8601df8609ed0b931ad76"},
    {"controller_manager_msgs/srv/ReloadControllerLibraries_Request",
     "c5ae8813adda2aed0e5e5558031e6f4c7834b941aa871746e86adc1cb745cda8"},
    {"controller_manager_msgs/srv/ReloadControllerLibraries_Response",
     "bea69bb80ebbb4a00023758c51fd0e3eaf308c1ae6640fdf4bbad6793bb967d4"},
    {"controller_manager_msgs/srv/SetHardwareComponentState_Request",
     "22c9b3e32a02221d411a47dab1fda921003a96ac41e8de7d4d805e2cfd0de21d"},
    {"controller_manager_msgs/srv/SetHardwareComponentState_Response",
     "c230aa244dd97d761e27ccde7b5056ec4e28e0bb804da283e42cd37944c46592"},
    {"controller_manager_msgs/srv/UnloadController_Request",
     "90f14a0b402791210988f4931be46a62edc7f6c90d0551c54c9a7cbce1b56ea1"},
    {"controller_manager_msgs/srv/UnloadController_Response",
     "4636099a7eaa6a9f3b299504878d58d580123f738e235c9df7bc46ef7b8f3461"},
    {"controller_manager_msgs/srv/ListHardwareInterfaces_Request",
     "419a204c74b85adb602848d0f288fc756d0216f70bd30ab889c1d9b154ed8098"},
    {"controller_manager_msgs/srv/SwitchController_Request",
     "d258d35c1ce6d7469e0155900202519be21f82c2641393540babd728a09cfa50"},
};

/// What nobody has published by its hash, as far as was found: newer than the builds that are kept
/// in public. Of what is in them, the messages are above.
constexpr const char* kNotCompared[] = {
    "controller_manager_msgs/srv/CleanupController_Request",
    "controller_manager_msgs/srv/CleanupController_Response",
    "controller_manager_msgs/srv/ListHardwareInterfaces_Response",
    "controller_manager_msgs/srv/SwitchController_Response",  // older ones lack its `message`
    "pal_statistics_msgs/msg/Statistics",
    "pal_statistics_msgs/msg/StatisticsNames",
    "pal_statistics_msgs/msg/StatisticsValues",
};

TEST(MessageDefinition, HasThePublishedHash) {
  for (const Published& one : kDefinitions) {
    const MessageDefinition* definition = find_definition(one.type);
    ASSERT_NE(definition, nullptr) << one.type;
    EXPECT_EQ(type_hash(*definition), std::string("RIHS01_") + one.hash) << one.type;
  }
}

TEST(MessageDefinition, OfEveryStandardTypeIsAmongThePublished) {
  for (const Type& type : types()) {
    if (type.ros_name.starts_with("tandem_msgs/")) continue;
    const bool compared = std::ranges::any_of(
        kDefinitions, [&](const auto& one) { return type.ros_name == one.type; });
    const bool known =
        std::ranges::any_of(kNotCompared, [&](const char* one) { return type.ros_name == one; });
    EXPECT_NE(compared, known) << type.ros_name;
  }
}

/// What rosidl refuses must not be found out by whoever builds tandem_msgs.
TEST(MessageDefinition, OfOursHasNamesThatRos2Allows) {
  const std::regex type_name("tandem_msgs/(msg|srv)/[A-Z][A-Za-z0-9]*(_Request|_Response|_Event)?");
  const std::regex field_name("[a-z](_?[a-z0-9]+)*");
  for (const MessageDefinition& one : definitions()) {
    if (!one.name.starts_with("tandem_msgs/")) continue;
    EXPECT_TRUE(std::regex_match(one.name, type_name)) << one.name;
    for (const MessageField& field : one.fields) {
      EXPECT_TRUE(std::regex_match(field.name, field_name)) << one.name << ": " << field.name;
    }
  }
}

TEST(MessageDefinition, CarriesThoseThatItNeeds) {
  const std::string line(80, '=');
  EXPECT_EQ(type<rosgraph_msgs::Clock>().definition,
            "builtin_interfaces/Time clock\n" + line +
                "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n");
}

TEST(MessageDefinition, ReadsEveryFormOfAField) {
  const auto read = parse_definition("a_msgs/msg/B",
                                     "# a comment\n"
                                     "int32 LIMIT=3  # a constant\n"
                                     "\n"
                                     "float64 w 1  # a default\n"
                                     "char[4]   c\n"
                                     "string<=8[<=2] names\n"
                                     "C[] own\n"
                                     "std_msgs/Header other\n");
  ASSERT_TRUE(read) << read.error().to_string();
  ASSERT_EQ(read->size(), 1u);
  const std::vector<MessageField>& fields = read->front().fields;
  ASSERT_EQ(fields.size(), 5u);
  EXPECT_EQ(fields[0].type, MessageFieldType::kFloat64);
  EXPECT_EQ(fields[1].type, MessageFieldType::kUint8);
  EXPECT_EQ(fields[1].repeat, Repeat::kArray);
  EXPECT_EQ(fields[1].capacity, 4u);
  EXPECT_EQ(fields[2].type, MessageFieldType::kBoundedString);
  EXPECT_EQ(fields[2].string_capacity, 8u);
  EXPECT_EQ(fields[2].repeat, Repeat::kBoundedSequence);
  EXPECT_EQ(fields[2].capacity, 2u);
  EXPECT_EQ(fields[3].message_name, "a_msgs/msg/C");
  EXPECT_EQ(fields[3].repeat, Repeat::kSequence);
  EXPECT_EQ(fields[4].message_name, "std_msgs/msg/Header");
}

TEST(MessageDefinition, RefusesWhatIsNoneWithItsLine) {
  for (const char* line : {"float64", "float64[ x", "float64[0] x", "string<=x y", "float64 2x",
                           "std_msgs/msg/Header h", "1a b"}) {
    const auto read = parse_definition("a_msgs/msg/B", "bool a\n" + std::string(line) + "\n");
    ASSERT_FALSE(read) << line;
    EXPECT_EQ(read.error().line, 2) << line;
    EXPECT_EQ(read.error().file, "a_msgs/msg/B");
  }
  EXPECT_FALSE(parse_definition("a_msgs/srv/B", "bool a\n"));
  auto unknown = *parse_definition("a_msgs/msg/B", "C c\n");
  EXPECT_FALSE(resolve(unknown));
  auto circle = *parse_definition("a_msgs/msg/B", "B[] b\n");
  EXPECT_FALSE(resolve(circle));
}

// ---- the IDL that the build makes of the definitions, read as message_definition.cpp does ----

std::string idl_element(const MessageField& field) {
  switch (field.type) {
    case MessageFieldType::kMessage: {
      return field.message_name.substr(field.message_name.rfind('/') + 1) + "_";
    }
    case MessageFieldType::kInt8: return "int8";
    case MessageFieldType::kUint8:
    case MessageFieldType::kByte: return "octet";
    case MessageFieldType::kInt16: return "short";
    case MessageFieldType::kUint16: return "unsigned short";
    case MessageFieldType::kInt32: return "long";
    case MessageFieldType::kUint32: return "unsigned long";
    case MessageFieldType::kInt64: return "long long";
    case MessageFieldType::kUint64: return "unsigned long long";
    case MessageFieldType::kFloat32: return "float";
    case MessageFieldType::kFloat64: return "double";
    case MessageFieldType::kBool: return "boolean";
    case MessageFieldType::kString: return "string";
    case MessageFieldType::kBoundedString: return fmt::format("string<{}>", field.string_capacity);
  }
  return "";
}

/// Its members as IDL: "double x; sequence<octet, 3> y;"
std::string idl_members(const MessageDefinition& definition) {
  std::string out;
  if (definition.request_or_response) {
    out = "unsigned long long request_guid; long long request_sequence;";
  }
  for (const MessageField& field : definition.fields) {
    const std::string element = idl_element(field);
    if (!out.empty()) out += " ";
    switch (field.repeat) {
      case Repeat::kOne: out += element + " " + field.name + ";"; break;
      case Repeat::kArray:
        out += fmt::format("{} {}[{}];", element, field.name, field.capacity);
        break;
      case Repeat::kBoundedSequence:
        out += fmt::format("sequence<{}, {}> {};", element, field.capacity, field.name);
        break;
      case Repeat::kSequence: out += fmt::format("sequence<{}> {};", element, field.name); break;
    }
  }
  return out;
}

/// Every structure of the IDL that the build makes: "std_msgs/msg/String" -> "string data;"
std::map<std::string, std::string> structures() {
  static const std::regex kToken(R"(module (\w+) \{ module (\w+) \{|struct (\w+)_ \{ ([^}]*?) \})");
  std::map<std::string, std::string> out;
  for (const char* file :
       {TANDEM_BINARY_DIR "/dds/ros2.idl", TANDEM_BINARY_DIR "/dds/tandem_msgs.idl"}) {
    std::stringstream in;
    in << std::ifstream(file).rdbuf();
    std::string text = std::regex_replace(in.str(), std::regex("//[^\n]*"), "");
    text = std::regex_replace(text, std::regex("\\s+"), " ");
    text = std::regex_replace(text, std::regex(R"(\w+::\w+::dds_::)"), "");
    text = std::regex_replace(text, std::regex(" _(\\w)"), " $1");  // a word of IDL's own
    std::string place;
    for (std::sregex_iterator one(text.begin(), text.end(), kToken), end; one != end; ++one) {
      const std::smatch& match = *one;
      if (match[1].matched) {
        place = match[1].str() + "/" + match[2].str() + "/";
      } else {
        out[place + match[3].str()] = match[4].str();
      }
    }
  }
  return out;
}

TEST(MessageDefinition, HasFieldNamesThatRos2Allows) {
  const std::regex allowed("[a-z](_?[a-z0-9]+)*");
  for (const MessageDefinition& definition : definitions()) {
    for (const MessageField& field : definition.fields) {
      EXPECT_TRUE(std::regex_match(field.name, allowed)) << definition.name << ": " << field.name;
    }
  }
}

TEST(MessageDefinition, SaysTheSameAsTheIdl) {
  const auto idl = structures();
  EXPECT_GT(idl.size(), 40u);
  EXPECT_TRUE(idl.contains("tandem_msgs/msg/State") && idl.contains("tandem_msgs/msg/Command"));
  for (const auto& [name, members] : idl) {
    const MessageDefinition* definition = find_definition(name);
    ASSERT_NE(definition, nullptr) << name;
    EXPECT_EQ(members, idl_members(*definition)) << name;
  }
}

}  // namespace
}  // namespace tandem::dds
