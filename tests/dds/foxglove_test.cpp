// Another project's decoder and the published definitions, on samples as readers get them.
#include <fmt/core.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include "base/quoting.hpp"
#include "tests/dds/raw_topic.hpp"
#include "tests/support/dds_domain.hpp"
#include "tests/support/node.hpp"
#include "tests/support/scratch_folder.hpp"

namespace tandem::dds {
namespace {

using tandem::test::kNode;

std::string hex(const test::Bytes& bytes) {
  std::string out;
  for (const std::byte byte : bytes) out += fmt::format("{:02x}", static_cast<unsigned>(byte));
  return out;
}

std::string content(const std::string& path) {
  std::stringstream out;
  out << std::ifstream(path).rdbuf();
  return out.str();
}

/// What @foxglove/rosmsg-msgs-common has of ours.
const std::set<std::string> kPublished{
    "action_msgs/msg/GoalStatusArray",
    "diagnostic_msgs/msg/DiagnosticArray",
    "geometry_msgs/msg/PoseStamped",
    "geometry_msgs/msg/Twist",
    "geometry_msgs/msg/TwistStamped",
    "geometry_msgs/msg/WrenchStamped",
    "nav_msgs/msg/Odometry",
    "rcl_interfaces/msg/Log",
    "rcl_interfaces/msg/ParameterEvent",
    "rosgraph_msgs/msg/Clock",
    "sensor_msgs/msg/Imu",
    "sensor_msgs/msg/JointState",
    "sensor_msgs/msg/Joy",
    "std_msgs/msg/Float64MultiArray",
    "std_msgs/msg/String",
    "tf2_msgs/msg/TFMessage",
    "trajectory_msgs/msg/JointTrajectory",
    "visualization_msgs/msg/MarkerArray",
};

TEST(Messages, AreDecodedByAnotherProjectWithThePublishedDefinitions) {
  const std::string folder = TANDEM_SOURCE_DIR "/tests/dds";
  if (kNode == nullptr) GTEST_SKIP() << "node is not installed";
  if (!std::filesystem::exists(TANDEM_SOURCE_DIR
                               "/tests/dds/node_modules/@foxglove/rosmsg2-serialization")) {
    GTEST_SKIP() << "@foxglove/rosmsg2-serialization is not installed (run `npm ci` in tests/dds)";
  }
  auto domain = Domain::open(test::own_config());
  ASSERT_TRUE(domain) << domain.error().to_string();
  const auto participant = Participant::open(std::move(*domain), "codec");
  const tandem::test::ScratchFolder scratch;
  const std::string path = scratch / "samples";
  std::ofstream file(path);
  for (const Type& type : types()) {
    if (type.tree->request_or_response) continue;  // no message's encoding: who asked goes first
    const test::Codec codec(**participant, type);
    const auto sample = codec.sample(test::CdrWriter(test::pattern()).sample(*type.tree));
    ASSERT_TRUE(sample) << type.ros_name;
    file << fmt::format(R"({{"type":"{}","definition":{},"published":{},"cdr":"{}"}})",
                        type.ros_name, quoted_text(type.definition),
                        kPublished.contains(type.ros_name), hex(codec.bytes(*sample)))
         << "\n";
  }
  file.close();
  const std::string command =
      fmt::format("cd {} && {} decode_samples.mjs {} > {} 2>&1", shell_word(folder),
                  shell_word(kNode), shell_word(path), shell_word(path + ".out"));
  EXPECT_EQ(std::system(command.c_str()), 0) << content(path + ".out");
  std::printf("%s", content(path + ".out").c_str());
}

}  // namespace
}  // namespace tandem::dds
