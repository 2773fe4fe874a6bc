// `tandem run --dds` as another DDS sees it.
#include "tests/apps/running.hpp"
#include "tests/dds/fastdds.hpp"
#include "tests/support/eventually.hpp"

namespace tandem::apps {
namespace {

using tandem::test::eventually;

TEST_F(Running, IsHeardByFastDdsWithRosQualitiesOfService) {
  if (!dds::test::have_fastdds()) GTEST_SKIP() << dds::test::kNoFastDds;
  begin("--dds --domain " + std::to_string(dds::test::own_domain()));
  dds::test::FastDdsPeer peer({
      "hear",
      "best_effort",
      "sensor_msgs/msg/JointState",
      "rt/joint_states",
      "hear",
      "reliable",
      "rosgraph_msgs/msg/Clock",
      "rt/clock",
      "hear",
      "reliable",
      "tf2_msgs/msg/TFMessage",
      "rt/tf",
      "hear",
      "reliable",
      "diagnostic_msgs/msg/DiagnosticArray",
      "rt/diagnostics",
      "hear",
      "latched",
      "std_msgs/msg/String",
      "rt/robot_description",
      "hear",
      "latched",
      "rmw_dds_common/msg/ParticipantEntitiesInfo",
      "ros_discovery_info",
  });
  // The first one is sent before there are endpoints: itself, its name, then those.
  constexpr int kWholeGraph = 16 + 2 + 10 * 16;
  std::map<std::string, int> values;  // of the last sample of a topic
  EXPECT_TRUE(eventually([&] {
    for (const std::string& line : peer.lines()) {
      std::istringstream in(line);
      std::string topic, kind;
      in >> topic >> kind;
      in >> values[topic];
      EXPECT_EQ(kind, "other") << line;
    }
    return values.size() == 6 && values["ros_discovery_info"] > kWholeGraph;
  })) << values.size()
      << " topics, a graph of " << values["ros_discovery_info"];
  EXPECT_EQ(values["rt/joint_states"], 3 + 2 * 4);  // stamp, frame; name and three of two joints
  EXPECT_EQ(values["rt/clock"], 2);
  EXPECT_EQ(values["rt/tf"], 2 * (3 + 1 + 7));
  EXPECT_EQ(values["rt/robot_description"], 1);
  EXPECT_GT(values["rt/diagnostics"], 10);
  EXPECT_EQ(end(), 0);
}

}  // namespace
}  // namespace tandem::apps
