#include "dds/ros_graph.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <set>
#include <string>

#include "dds/endpoint.hpp"
#include "tests/support/dds_domain.hpp"
#include "tests/support/eventually.hpp"

namespace tandem::dds {
namespace {

using tandem::test::eventually;

std::string text(const Gid& gid) {
  return {reinterpret_cast<const char*>(gid.data), sizeof(gid.data)};
}

/// What a ROS 2 process knows of the others: each one's last ros_discovery_info.
struct Listener {
  explicit Listener(std::shared_ptr<Domain> domain)
      : participant(std::move(*Participant::open(std::move(domain), "listener"))),
        reader(std::move(*Reader<rmw_dds_common::ParticipantEntitiesInfo>::create(
            *participant, "ros_discovery_info",
            {.transient_local = true, .depth = 100, .user_data = {}}))) {}

  struct Node {
    std::string name_space, name;
    std::set<std::string> readers, writers;
  };

  /// The node of a participant as it was last published.
  std::optional<Node> node_of(const Gid& gid) {
    reader.take([&](const rmw_dds_common::ParticipantEntitiesInfo& info, const auto&) {
      if (text(info.gid) != text(gid)) return;
      ASSERT_EQ(info.node_entities_info_seq._length, 1u);
      const auto& told = info.node_entities_info_seq._buffer[0];
      last = Node{.name_space = told.node_namespace,
                  .name = told.node_name,
                  .readers = gids(told.reader_gid_seq),
                  .writers = gids(told.writer_gid_seq)};
    });
    return last;
  }

  template <class Sequence>
  static std::set<std::string> gids(const Sequence& sequence) {
    std::set<std::string> out;
    for (std::uint32_t i = 0; i < sequence._length; ++i) out.insert(text(sequence._buffer[i]));
    return out;
  }

  std::unique_ptr<Participant> participant;
  Reader<rmw_dds_common::ParticipantEntitiesInfo> reader;
  std::optional<Node> last;
};

TEST(RosGraph, TellsOfANodeAndOfItsEndpointsAsTheyComeAndGo) {
  Config config = test::own_config();
  config.name_space = "left";
  const auto domain = Domain::open(config);
  ASSERT_TRUE(domain) << domain.error().to_string();
  const auto talker = Participant::open(*domain, "talker");
  ASSERT_TRUE(talker) << talker.error().to_string();
  Listener listener(*domain);
  const Gid participant = gid_of((*talker)->get());
  ASSERT_TRUE(eventually([&] { return listener.node_of(participant).has_value(); }));
  EXPECT_EQ(listener.last->name_space, "/left");
  EXPECT_EQ(listener.last->name, "talker");
  EXPECT_TRUE(listener.last->writers.empty() && listener.last->readers.empty());

  const std::string topic = (*talker)->topic_name("chatter");
  std::optional<Writer<std_msgs::String>> writer =
      std::move(*Writer<std_msgs::String>::create(**talker, topic, {}));
  const auto reader = Reader<std_msgs::String>::create(**talker, topic, {});
  ASSERT_TRUE(reader);
  const std::string writer_gid = text(gid_of(writer->endpoint().get()));
  const std::string reader_gid = text(gid_of(reader->endpoint().get()));
  ASSERT_TRUE(
      eventually([&] { return listener.node_of(participant)->readers.contains(reader_gid); }));
  EXPECT_EQ(listener.last->writers, std::set{writer_gid});
  EXPECT_EQ(listener.last->readers, std::set{reader_gid});

  writer.reset();
  ASSERT_TRUE(eventually([&] { return listener.node_of(participant)->writers.empty(); }));
  EXPECT_EQ(listener.last->readers, std::set{reader_gid});
}

TEST(RosGraph, GidsAreTheGuidsThatDiscoveryTells) {
  const auto domain = Domain::open(test::own_config());
  ASSERT_TRUE(domain) << domain.error().to_string();
  const auto talker = Participant::open(*domain, "talker");
  ASSERT_TRUE(talker);
  const auto writer = Writer<std_msgs::String>::create(**talker, "rt/chatter", {});
  const auto reader = Reader<std_msgs::String>::create(**talker, "rt/chatter", {});
  ASSERT_TRUE(writer && reader);
  dds_instance_handle_t matched = 0;
  ASSERT_TRUE(eventually(
      [&] { return dds_get_matched_publications(reader->endpoint().get(), &matched, 1) == 1; }));
  dds_builtintopic_endpoint_t* told =
      dds_get_matched_publication_data(reader->endpoint().get(), matched);
  ASSERT_NE(told, nullptr);
  const Gid gid = gid_of(writer->endpoint().get());
  EXPECT_TRUE(std::ranges::equal(gid.data, told->key.v));
  void* bytes = nullptr;
  std::size_t size = 0;
  ASSERT_TRUE(dds_qget_userdata(told->qos, &bytes, &size));
  EXPECT_EQ(std::string(static_cast<const char*>(bytes), size),
            "typehash=" + type<std_msgs::String>().hash + ";");
  dds_free(bytes);
  dds_builtintopic_free_endpoint(told);
}

TEST(RosGraph, HasNoNodeThatRosHasNot) {
  EXPECT_TRUE(is_node_name("tandem_run"));
  EXPECT_TRUE(is_node_name("_2"));
  for (const char* name : {"", "2nd", "tandem run", "tandem-run", "/tandem", "rëd"}) {
    EXPECT_FALSE(is_node_name(name)) << name;
  }
  EXPECT_FALSE(is_node_name(std::string(256, 'a')));
  const auto domain = Domain::open(test::own_config());
  ASSERT_TRUE(domain);
  const auto participant = Participant::open(*domain, "my robot");
  ASSERT_FALSE(participant);
  EXPECT_NE(participant.error().message.find("'my robot'"), std::string::npos);
}

}  // namespace
}  // namespace tandem::dds
