// Fast DDS with its own generator's types, both ways: another implementation of every layer.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "dds/cdr.hpp"
#include "dds/service_server.hpp"
#include "tests/dds/fastdds.hpp"
#include "tests/dds/raw_topic.hpp"
#include "tests/support/eventually.hpp"

namespace tandem::dds {
namespace {

using tandem::test::eventually;
using test::Bytes;

/// Every type of a topic that is ROS 2's own.
std::vector<const Type*> standard_types() {
  std::vector<const Type*> out;
  for (const Type& type : types()) {
    if (!type.ros_name.starts_with("tandem_msgs/") && !type.tree->request_or_response) {
      out.push_back(&type);
    }
  }
  return out;
}

std::string topic_of(const char* prefix, const Type& type) {
  std::string name = type.ros_name;
  std::ranges::replace(name, '/', '_');
  return std::string(prefix) + name;
}

/// Without the four bytes that name the encoding, and without padding at the end, of which Fast DDS
/// says and does another thing.
Bytes payload(const Bytes& bytes, std::size_t size) {
  return {bytes.begin() + 4,
          bytes.begin() + static_cast<std::ptrdiff_t>(std::min(bytes.size(), size))};
}

class FastDds : public testing::Test {
 protected:
  void SetUp() override {
    if (!test::have_fastdds()) GTEST_SKIP() << test::kNoFastDds;
    auto domain = Domain::open(test::own_config());
    ASSERT_TRUE(domain) << domain.error().to_string();
    participant_ = std::move(*Participant::open(std::move(*domain), "cyclone"));
  }

  [[nodiscard]] RawEndpoint make(EndpointKind kind, const Type& type, const std::string& topic,
                                 const Qos& qos = {}) const {
    return std::move(*RawEndpoint::create(kind, participant_->get(), type, topic, qos));
  }

  std::unique_ptr<Participant> participant_;
};

TEST_F(FastDds, HearsEveryStandardTypeAsItWasSent) {
  std::vector<std::string> arguments;
  for (const Type* type : standard_types()) {
    arguments.insert(arguments.end(),
                     {"hear", "reliable", type->ros_name, topic_of("rt/to_fast/", *type)});
  }
  test::FastDdsPeer peer(arguments);
  std::vector<RawEndpoint> writers;
  std::vector<test::TypedSample> samples;
  for (const Type* type : standard_types()) {
    const test::Codec codec(*participant_, *type);
    auto sample = codec.sample(test::CdrWriter(test::pattern()).sample(*type->tree));
    ASSERT_TRUE(sample);
    samples.push_back(std::move(*sample));
    writers.push_back(make(EndpointKind::kWriter, *type, topic_of("rt/to_fast/", *type),
                           {.transient_local = true, .depth = 1, .user_data = {}}));
    ASSERT_EQ(dds_write(writers.back().entity.get(), samples.back().get()), DDS_RETCODE_OK);
  }
  std::set<std::string> heard;
  EXPECT_TRUE(eventually([&] {
    for (std::size_t i = 0; i < writers.size(); ++i) {
      dds_write(writers[i].entity.get(), samples[i].get());
    }
    for (const std::string& line : peer.lines()) heard.insert(line);
    return heard.size() == writers.size();
  }));
  for (const Type* type : standard_types()) {
    const std::string start = topic_of("rt/to_fast/", *type) + " pattern ";
    EXPECT_TRUE(std::ranges::any_of(heard, [&](const std::string& line) {
      return line.starts_with(start);
    })) << type->ros_name;
  }
}

TEST_F(FastDds, IsHeardInEveryStandardTypeAsItSends) {
  std::vector<std::string> arguments;
  std::vector<RawEndpoint> readers;
  for (const Type* type : standard_types()) {
    const std::string topic = topic_of("rt/from_fast/", *type);
    arguments.insert(arguments.end(), {"say", "reliable", type->ros_name, topic});
    readers.push_back(make(EndpointKind::kReader, *type, topic));
  }
  const test::FastDdsPeer peer(arguments);
  for (std::size_t i = 0; i < readers.size(); ++i) {
    const Type& type = *standard_types()[i];
    std::vector<Bytes> taken;
    ASSERT_TRUE(eventually([&] {
      taken = test::take_bytes(readers[i].entity.get());
      return !taken.empty();
    })) << type.ros_name;
    Bytes expected = test::CdrWriter(test::pattern()).sample(*type.tree);
    const std::size_t size = expected.size() - static_cast<std::size_t>(expected[3]);
    EXPECT_EQ(payload(taken.front(), size), payload(expected, size)) << type.ros_name;
    EXPECT_TRUE(decode(*type.tree, taken.front())) << type.ros_name;
  }
}

/// ROS 2's common subscribers of what Tandem offers: sensor data (best effort), the default
/// (reliable, volatile), and a late one that wants what was said before it came.
TEST_F(FastDds, SubscribesWithRosQualitiesOfService) {
  const Type& type = dds::type<std_msgs::String>();
  const auto sensor = make(EndpointKind::kWriter, type, "rt/sensor", {});
  const auto plain = make(EndpointKind::kWriter, type, "rt/plain", {});
  const auto latched = make(EndpointKind::kWriter, type, "rt/robot_description",
                            {.transient_local = true, .depth = 1, .user_data = {}});
  const test::Codec codec(*participant_, type);
  const auto sample = codec.sample(test::CdrWriter(test::pattern()).sample(*type.tree));
  ASSERT_TRUE(sample);
  dds_write(latched.entity.get(), sample->get());  // once, before anybody is there
  std::vector<std::string> arguments;
  for (const char* word : {"hear", "best_effort", "std_msgs/msg/String", "rt/sensor", "hear",
                           "reliable", "std_msgs/msg/String", "rt/plain", "hear", "latched",
                           "std_msgs/msg/String", "rt/robot_description"}) {
    arguments.emplace_back(word);
  }
  test::FastDdsPeer peer(arguments);
  std::set<std::string> heard;
  EXPECT_TRUE(eventually([&] {
    dds_write(sensor.entity.get(), sample->get());
    dds_write(plain.entity.get(), sample->get());
    for (const std::string& line : peer.lines()) heard.insert(line);
    return heard.size() == 3;
  }));
  EXPECT_EQ(heard, (std::set<std::string>{"rt/sensor pattern 1", "rt/plain pattern 1",
                                          "rt/robot_description pattern 1"}));
}

/// Its request and the reply that it waits for have the same header: leaves 1 and 2.
TEST_F(FastDds, CallsAService) {
  using Response = std_srvs::Trigger_Response;
  const auto server = std::move(*ServiceServer::open(*participant_));
  const auto added = server->add<std_srvs::Trigger_Request, Response>(
      "reset", [](const std_srvs::Trigger_Request&, const Asker&) {
        return ServiceWork<Response>{.at_once = false,
                                     .answer = [](Response& reply, ReplyMemory& memory) {
                                       reply.success = true;
                                       reply.message = memory.text("s4");
                                     }};
      });
  ASSERT_TRUE(added && server->start());
  test::FastDdsPeer peer({"say", "reliable", "std_srvs/srv/Trigger_Request", "rq/resetRequest",
                          "hear", "reliable", "std_srvs/srv/Trigger_Response", "rr/resetReply"});
  std::vector<std::string> heard;
  ASSERT_TRUE(eventually([&] { return !(heard = peer.lines()).empty(); }));
  EXPECT_EQ(heard.front(), "rr/resetReply pattern 4");
}

}  // namespace
}  // namespace tandem::dds
