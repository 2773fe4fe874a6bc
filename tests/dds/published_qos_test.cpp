// Qualities of service of a run's topics against those that ROS 2's own programs publish with, and
// read with.
#include <algorithm>
#include <map>
#include <string_view>

#include "dds/discovery.hpp"
#include "dds/service.hpp"
#include "tests/dds/publisher_rig.hpp"

namespace tandem::dds {
namespace {

using namespace test;

/// A profile of ROS 2. Depths matter where late readers get samples from before.
struct Profile {
  bool reliable = true;
  bool transient_local = false;
  std::int32_t depth = 10;
};
// ros2/rmw: rmw/include/rmw/qos_profiles.h
constexpr Profile kDefault{}, kServices{}, kSensorData{.reliable = false, .depth = 5},
    kParameterEvents{.depth = 1000};
// "System default" is the middleware's: of writers reliable and volatile, keep last 1.
constexpr Profile kSystemDefault{.depth = 1};

/// What a topic is published with elsewhere.
struct Published {
  std::string_view topic;
  Profile profile;
};
constexpr Published kPublished[] = {
    // ros-controls/ros2_controllers: joint_state_broadcaster
    {"rt/joint_states", kSystemDefault},
    {"rt/dynamic_joint_states", kSystemDefault},
    // ros/robot_state_publisher
    {"rt/robot_description", {.transient_local = true, .depth = 1}},
    // ros2/geometry2: tf2_ros/include/tf2_ros/qos.hpp
    {"rt/tf", {.depth = 100}},
    {"rt/tf_static", {.transient_local = true, .depth = 1}},
    // ros2/rmw
    {"rt/parameter_events", kParameterEvents},
    {"rt/diagnostics", kDefault},
    {"rt/clock", kDefault},
    // ros2/rcl: rcl/include/rcl/logging_rosout.h. Its depth is 1000.
    {"rt/rosout", {.transient_local = true, .depth = 100}},
    // ros2/rmw_dds_common
    {"ros_discovery_info", {.transient_local = true, .depth = 1}},
    // pal-robotics/pal_statistics, which keeps all
    {"rt/controller_manager/introspection_data/full", kDefault},
    {"rt/controller_manager/introspection_data/names", {.transient_local = true, .depth = 1}},
    {"rt/controller_manager/introspection_data/values", kDefault},
    {"rt/controller_manager/statistics/names", {.transient_local = true, .depth = 1}},
    {"rt/controller_manager/statistics/values", kDefault},
};

RigOptions every_topic() {
  RigOptions options{.robot = "coman"};
  options.config.every[static_cast<std::size_t>(Topic::kDynamicJointStates)] = 10;
  return options;
}

/// The topics that the listener has discovered, by name, once all of kPublished are among them.
std::map<std::string, TopicInfo, std::less<>> discovered(const PublisherRig& rig) {
  auto discovery = Discovery::open(*rig.listener);
  EXPECT_TRUE(discovery) << discovery.error().to_string();
  std::map<std::string, TopicInfo, std::less<>> found;
  EXPECT_TRUE(eventually([&] {
    for (TopicInfo& one : discovery->topics()) found[one.topic] = one;
    return std::ranges::all_of(kPublished,
                               [&](const Published& one) { return found.contains(one.topic); });
  }));
  return found;
}

TEST(PublishedQos, IsNoLessThanThatOfRos2) {
  PublisherRig rig(every_topic());
  rig.start();
  const auto found = discovered(rig);
  for (const Published& one : kPublished) {
    const auto topic = found.find(one.topic);
    ASSERT_NE(topic, found.end()) << one.topic;
    const Qos& qos = topic->second.qos;
    EXPECT_TRUE(qos.reliable || !one.profile.reliable) << one.topic;
    EXPECT_EQ(qos.transient_local, one.profile.transient_local) << one.topic;
    if (one.profile.transient_local) {
      EXPECT_EQ(qos.depth, one.profile.depth) << one.topic;
    }
  }
}

/// Readers of ROS 2's usual profiles, and of the topic's own elsewhere.
TEST(PublishedQos, IsEnoughForReadersOfEveryProfile) {
  PublisherRig rig(every_topic());
  rig.start();
  const auto found = discovered(rig);
  std::size_t tried = 0;
  for (const auto& [name, topic] : found) {
    if (topic.writers == 0) continue;
    const auto* const type = find_type(topic.type);
    ASSERT_NE(type, nullptr) << topic.type;
    std::vector<Profile> profiles{kDefault, kSensorData, kSystemDefault};
    const auto own = std::ranges::find(kPublished, std::string_view(name), &Published::topic);
    if (own != std::end(kPublished)) profiles.push_back(own->profile);
    for (const Profile& profile : profiles) {
      auto reader = RawEndpoint::create(EndpointKind::kReader, rig.listener->get(), *type, name,
                                        {.reliable = profile.reliable,
                                         .transient_local = profile.transient_local,
                                         .depth = profile.depth,
                                         .user_data = {}});
      ASSERT_TRUE(reader) << name;
      EXPECT_TRUE(eventually([&] {
        return dds_get_matched_publications(reader->entity.get(), nullptr, 0) > 0;
      })) << name;
      ++tried;
    }
  }
  EXPECT_GT(tried, 60U);
}

TEST(PublishedQos, OfServicesIsThatOfRos2) {
  const Qos qos = service_qos(kServices.depth, "");
  EXPECT_EQ(qos.reliable, kServices.reliable);
  EXPECT_EQ(qos.transient_local, kServices.transient_local);
  EXPECT_EQ(qos.depth, kServices.depth);
}

}  // namespace
}  // namespace tandem::dds
