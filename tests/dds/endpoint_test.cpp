#include "dds/endpoint.hpp"

#include <gtest/gtest.h>

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

TEST(Domain, OfAnInterfaceThatIsNotThereIsAnErrorThatNamesIt) {
  Config config = test::own_config();
  config.interfaces = {"nosuch0"};
  const auto domain = Domain::open(config);
  ASSERT_FALSE(domain);
  EXPECT_NE(domain.error().hint.find("nosuch0"), std::string::npos) << domain.error().hint;
}

}  // namespace
}  // namespace tandem::dds
