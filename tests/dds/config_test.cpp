#include "dds/config.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "dds/ports.hpp"
#include "tests/support/little_room.hpp"

namespace tandem::dds {
namespace {

Config read(const std::string& text, Diagnostics* errors = nullptr) {
  const auto document = TomlDocument::parse(text, "test.toml");
  EXPECT_TRUE(document);
  Config config = read_config(document->root().table("dds"), document->folder());
  if (errors != nullptr) {
    *errors = document->diagnostics();
  } else {
    EXPECT_TRUE(document->diagnostics().empty()) << document->diagnostics().front().to_string();
  }
  return config;
}

TEST(DdsConfig, HasRatesThatFollowThePeriodAndKeysThatDoNot) {
  const Config config = read("[dds]\n[dds.every]\njoint_states = 7\ntf = 0\n");
  EXPECT_TRUE(config.enabled);
  EXPECT_TRUE(config.loopback_only());
  EXPECT_EQ(config.cycles_between(Topic::kJointStates, 1'000'000), 7U);
  EXPECT_EQ(config.cycles_between(Topic::kJointStates, 500'000), 7U);
  EXPECT_EQ(config.cycles_between(Topic::kTf, 1'000'000), 0U);
  EXPECT_EQ(config.cycles_between(Topic::kImu, 1'000'000), 10U);
  EXPECT_EQ(config.cycles_between(Topic::kImu, 250'000), 40U);
  EXPECT_EQ(config.cycles_between(Topic::kImu, 50'000'000), 1U);
  EXPECT_EQ(config.cycles_between(Topic::kDynamicJointStates, 1'000'000), 0U);
}

TEST(DdsConfig, RefusesAnUnknownTopicAndANegativeRate) {
  Diagnostics errors;
  (void)read("[dds.every]\njoint_state = 7\ntf = -1\n", &errors);
  ASSERT_EQ(errors.size(), 2U);
  EXPECT_EQ(errors[0].key, "dds.every.tf");
  EXPECT_EQ(errors[1].key, "dds.every.joint_state");
  EXPECT_EQ(errors[1].hint, "did you mean 'joint_states'?");
}

// Lines of a kernel's /proc/net/udp.
TEST(DdsConfig, TakesTheDomainOfTheEnvironmentWhereNothingSaysAnother) {
  EXPECT_FALSE(read("[dds]\n").domain_given);
  EXPECT_TRUE(read("[dds]\ndomain = 0\n").domain_given);
  const char* former = std::getenv("ROS_DOMAIN_ID");
  const std::string before = former == nullptr ? "" : former;
  for (const auto& [text, domain] : {std::pair{"", 0}, {"0", 0}, {"217", 217}, {"232", 232}}) {
    ::setenv("ROS_DOMAIN_ID", text, 1);
    EXPECT_EQ(environment_domain(), domain) << text;
  }
  for (const char* text : {"233", "-1", "7x", " 7", "0x7", "seven", "99999999999"}) {
    ::setenv("ROS_DOMAIN_ID", text, 1);
    ASSERT_FALSE(environment_domain()) << text;
    EXPECT_NE(environment_domain().error().to_string().find("is no DDS domain"), std::string::npos);
  }
  ::unsetenv("ROS_DOMAIN_ID");
  EXPECT_EQ(environment_domain(), 0);
  if (former != nullptr) ::setenv("ROS_DOMAIN_ID", before.c_str(), 1);
}

TEST(DdsPorts, AreCountedByWhoHasThem) {
  const std::string table =
      "   sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid  timeout "
      "inode ref pointer drops\n"
      "  170: 00000000:1CF2 00000000:0000 07 00000000:00000000 00:00000000 00000000  1000        0 "
      "41273 2 00000000c3f1d1f7 0\n"
      "  171: 0100007F:1CF3 00000000:0000 07 00000000:00000000 00:00000000 00000000 65534        0 "
      "41274 2 00000000c3f1d1f7 0\n"
      "  172: 00000000:1CF4 00000000:0000 07 00000000:00000000 00:00000000 00000000 65534        0 "
      "41275 2 00000000c3f1d1f7 0\n"
      "  173: 00000000:0035 00000000:0000 07 00000000:00000000 00:00000000 00000000     0        0 "
      "41276 2 00000000c3f1d1f7 0\n";
  EXPECT_EQ(port_holders(table, 0), "user 65534 (2), user 1000 (1)") << "7410 and on";
  EXPECT_EQ(port_holders(table, 1), "");
  EXPECT_EQ(port_holders("", 0), "");
}

TEST(DdsConfig, TakesNamesAndAddressesAndNothingElse) {
  const auto wrong = [](const std::string& key, const std::string& value) {
    Diagnostics errors;
    (void)read("[dds]\n" + key + " = " + value + "\n", &errors);
    return errors.size();
  };
  for (const char* good : {"a", "left", "robots/left_2", "A/b/c9"})
    EXPECT_EQ(wrong("namespace", "'" + std::string(good) + "'"), 0U) << good;
  for (const char* bad : {"/a", "a/", "a//b", "9a", "a/9", "_a", "a b", "a-b", "ä", "/"})
    EXPECT_EQ(wrong("namespace", "'" + std::string(bad) + "'"), 1U) << bad;
  EXPECT_EQ(wrong("peers", "['192.168.1.20', 'fe80::1%eth0', 'my-host_2.local']"), 0U);
  EXPECT_EQ(wrong("peers", "['a b', '', '<x>']"), 3U);
  EXPECT_EQ(wrong("interfaces", "['lo', 'a\"b']"), 1U);
}

/// A regular expression's stack grew with the text.
TEST(DdsConfig, NeedsNoStackForALongName) {
  const std::string name(60'000, 'a');
  const auto read_all = [&] {
    Diagnostics errors;
    (void)read("[dds]\nnamespace = '" + name + "'\npeers = ['" + name + "']\n", &errors);
    return errors.size() == 2 && errors.front().message.size() < 300;
  };
  EXPECT_IN_LITTLE_ROOM(read_all());
}

TEST(DdsConfig, OfEveryTopicIsDocumented) {
  std::ifstream in(TANDEM_SOURCE_DIR "/docs/configuration.md");
  std::ostringstream page;
  page << in.rdbuf();
  for (const TopicPeriod& rate : kTopicPeriods) {
    std::string key(1, '`');
    key.append(rate.key).append(1, '`');
    EXPECT_NE(page.str().find(key), std::string::npos) << key;
  }
}

}  // namespace
}  // namespace tandem::dds
