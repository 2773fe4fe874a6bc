#include "dds/endpoint.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>
#include <string>

#include "tests/support/dds_domain.hpp"
#include "tests/support/eventually.hpp"

namespace tandem::dds {
namespace {

using tandem::test::eventually;

TEST(Endpoint, CarriesASampleFromOneParticipantToAnother) {
  const auto domain = Domain::open(test::own_config());
  ASSERT_TRUE(domain) << domain.error().to_string();
  const auto talker = Participant::open(*domain, "talker");
  const auto listener = Participant::open(*domain, "listener");
  ASSERT_TRUE(talker && listener);
  const std::string topic = (*talker)->topic_name("chatter");
  EXPECT_EQ(topic, "rt/chatter");
  auto writer = Writer<std_msgs::String>::create(**talker, topic, {});
  auto reader = Reader<std_msgs::String>::create(**listener, topic, {});
  ASSERT_TRUE(writer && reader);
  ASSERT_TRUE(eventually([&] { return writer->endpoint().matched() == 1; }));
  std::string text = "spring";
  ASSERT_TRUE(writer->write({.data = text.data()}));
  std::string heard;
  ASSERT_TRUE(eventually([&] {
    reader->take(
        [&](const std_msgs::String& sample, const dds_sample_info_t&) { heard = sample.data; });
    return !heard.empty();
  }));
  EXPECT_EQ(heard, "spring");
}

/// What docs/ros2.md gives to ROS 2 for the loopback interface, in a domain of its own here.
TEST(Domain, IsFoundWithTheConfigurationForRos2) {
  const auto domain = Domain::open(test::own_config());
  ASSERT_TRUE(domain) << domain.error().to_string();
  const auto talker = Participant::open(*domain, "talker");
  auto writer = Writer<std_msgs::String>::create(**talker, "rt/chatter", {});
  ASSERT_TRUE(writer);
  std::stringstream in;
  in << std::ifstream(TANDEM_SOURCE_DIR "/examples/ros2/cyclonedds_loopback.xml").rdbuf();
  std::string xml = in.str();
  const std::string place = "<Discovery>";
  xml.insert(xml.find(place) + place.size(),
             "<ExternalDomainId>" + std::to_string(test::own_domain()) + "</ExternalDomainId>");
  const Entity other(dds_create_domain(1, xml.c_str()));
  ASSERT_TRUE(other.ok());
  const Entity participant(dds_create_participant(1, nullptr, nullptr));
  const auto reader = RawEndpoint::create(EndpointKind::kReader, participant.get(),
                                          type<std_msgs::String>(), "rt/chatter", {});
  ASSERT_TRUE(reader);
  EXPECT_TRUE(eventually([&] { return writer->endpoint().matched() == 1; }));
}

TEST(Domain, OfAnInterfaceThatIsNotThereIsAnErrorThatNamesIt) {
  Config config = test::own_config();
  config.interfaces = {"nosuch0"};
  const auto domain = Domain::open(config);
  ASSERT_FALSE(domain);
  EXPECT_NE(domain.error().hint.find("nosuch0"), std::string::npos) << domain.error().hint;
}

}  // namespace
}  // namespace tandem::dds
