// DDS Security with certificates that the openssl command line made: who has them talks, who has
// not hears nothing.
#include <fmt/core.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>

#include "base/quoting.hpp"
#include "dds/cdr.hpp"
#include "dds/domain.hpp"
#include "dds/raw_endpoint.hpp"
#include "dds/service_layout.hpp"
#include "tests/dds/raw_topic.hpp"
#include "tests/support/dds_domain.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/scratch_folder.hpp"

namespace tandem::dds {
namespace {

using tandem::test::eventually;

/// A participant with sockets of its own, as if it were another process.
struct Member {
  /// @param number  of Cyclone DDS's domain in this process; on the wire it is own_domain()
  Member(dds_domainid_t number, const Config& config) {
    std::string xml = to_xml(config);
    const std::string place = "<Discovery>";
    xml.insert(xml.find(place) + place.size(),
               fmt::format("<ExternalDomainId>{}</ExternalDomainId>", config.domain));
    domain = Entity(dds_create_domain(number, xml.c_str()));
    participant = Entity(dds_create_participant(number, nullptr, nullptr));
    if (!participant.ok()) return;
    const Type& string = type<std_msgs::String>();
    writer = std::move(*RawEndpoint::create(EndpointKind::kWriter, participant.get(), string,
                                            "rt/from_" + std::to_string(number), {}));
    for (int other = 1; other <= 3; ++other) {
      readers.push_back(
          std::move(*RawEndpoint::create(EndpointKind::kReader, participant.get(), string,
                                         "rt/from_" + std::to_string(other), {})));
    }
  }

  void say() {
    std::string text = "spring";
    const std_msgs::String sample{.data = text.data()};
    dds_write(writer.entity.get(), &sample);
  }
  [[nodiscard]] bool hears(int other) const {
    return !test::take_bytes(readers.at(static_cast<std::size_t>(other - 1)).entity.get()).empty();
  }

  Entity domain;
  Entity participant;
  RawEndpoint writer;
  std::vector<RawEndpoint> readers;
};

class Security : public testing::Test {
 protected:
  void SetUp() override {
#ifndef TANDEM_DDS_SECURITY
    GTEST_SKIP() << "Cyclone DDS has no security plugins here";
#endif
    if (std::system("openssl version > /dev/null 2>&1") != 0) {
      GTEST_SKIP() << "the openssl command is not installed";
    }
    make_files(folder_.path());
  }
  static void make_files(const std::string& folder) {
    const std::string command = fmt::format(
        "{} {} > /dev/null 2>&1", shell_word(TANDEM_SOURCE_DIR "/examples/dds_security/make-files"),
        shell_word(folder));
    ASSERT_EQ(std::system(command.c_str()), 0) << command;
  }

  [[nodiscard]] Config secured() const {
    Config config = test::own_config();
    config.security = {.identity_ca = folder_ / "ca.pem",
                       .identity_certificate = folder_ / "robot.pem",
                       .private_key = folder_ / "robot.key",
                       .permissions_ca = folder_ / "ca.pem",
                       .governance = folder_ / "governance.p7s",
                       .permissions = folder_ / "permissions.p7s"};
    return config;
  }

  const tandem::test::ScratchFolder folder_;
};

TEST_F(Security, LetsTwoWithCertificatesTalkAndNobodyElseHear) {
  Member one(1, secured());
  Member two(2, secured());
  Member stranger(3, test::own_config());
  ASSERT_TRUE(one.participant.ok() && two.participant.ok() && stranger.participant.ok());
  bool there = false, back = false;
  EXPECT_TRUE(eventually([&] {
    one.say();
    two.say();
    stranger.say();
    there = there || two.hears(1);
    back = back || one.hears(2);
    return there && back;
  }));
  // The stranger has been there as long, saw them come, and had its chance.
  Member other_stranger(4, test::own_config());
  EXPECT_TRUE(eventually([&] {
    stranger.say();
    return other_stranger.hears(3);
  })) << "those without certificates hear each other";
  EXPECT_FALSE(stranger.hears(1));
  EXPECT_FALSE(stranger.hears(2));
  EXPECT_FALSE(one.hears(3));
  EXPECT_FALSE(two.hears(3));
}

/// The replies to Fast DDS come from the same writer, and are the others' to ignore here as well.
TEST_F(Security, CarriesRepliesOfServices) {
  Member one(1, secured());
  Member two(2, secured());
  ASSERT_TRUE(one.participant.ok() && two.participant.ok());
  const Type& replies = type<std_srvs::Trigger_Response>();
  const ddsi_sertype* layout = nullptr;
  const auto writer = RawEndpoint::create(
      EndpointKind::kWriter, one.participant.get(), replies, "rr/resetReply", {},
      [&layout](dds_entity_t participant, const Type& type, const char* name) {
        return create_service_topic(participant, type, name, &layout);
      });
  const auto reader = RawEndpoint::create(EndpointKind::kReader, two.participant.get(), replies,
                                          "rr/resetReply", {});
  ASSERT_TRUE(writer && reader);
  std::string text = "done";
  const std_srvs::Trigger_Response reply{7, 8, true, text.data()};
  std::vector<test::Bytes> heard;
  EXPECT_TRUE(eventually([&] {
    EXPECT_TRUE(write_reply(writer->entity.get(), layout, &reply,
                            FastCall{.client = {1}, .sequence = 1, .parameter = 0x800f}));
    EXPECT_TRUE(write_reply(writer->entity.get(), layout, &reply, std::nullopt));
    for (test::Bytes& one_more : test::take_bytes(reader->entity.get())) {
      heard.push_back(std::move(one_more));
    }
    return heard.size() >= 3;
  }));
  for (const test::Bytes& one_of_them : heard) {
    const auto read = decode(*replies.tree, one_of_them);
    ASSERT_TRUE(read) << "of the other layout";
    EXPECT_EQ(std::get<std::string>(find(*read, "message")->of), text);
  }
}

TEST_F(Security, WithACertificateOfAnotherAuthorityIsAStranger) {
  const std::string own = folder_.path();
  Config foreign = secured();
  const std::string other = own + "/other";
  make_files(other);
  for (std::string* file : {&foreign.security.identity_ca, &foreign.security.identity_certificate,
                            &foreign.security.private_key, &foreign.security.permissions_ca,
                            &foreign.security.governance, &foreign.security.permissions}) {
    file->insert(own.size(), "/other");
  }
  Member one(1, secured());
  Member two(2, secured());
  Member stranger(3, foreign);
  ASSERT_TRUE(one.participant.ok() && two.participant.ok() && stranger.participant.ok());
  EXPECT_TRUE(eventually([&] {
    one.say();
    stranger.say();
    return two.hears(1);
  }));
  EXPECT_FALSE(stranger.hears(1));
  EXPECT_FALSE(two.hears(3));
}

}  // namespace
}  // namespace tandem::dds
