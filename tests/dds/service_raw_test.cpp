// The service mapping spoken by hand, in Cyclone DDS' C API and in bytes: what a ROS 2 client of
// Cyclone's middleware sends and gets, and what a broken one sends.
#include <dds/ddsi/ddsi_serdata.h>
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cstring>
#include <vector>

#include "dds/service_client.hpp"
#include "dds/service_server.hpp"
#include "tests/support/dds_domain.hpp"
#include "tests/support/eventually.hpp"

namespace tandem::dds {
namespace {

using std::chrono::milliseconds;
using tandem::test::eventually;
using RawRequest = std_srvs_srv_dds__Trigger_Request_;
using RawResponse = std_srvs_srv_dds__Trigger_Response_;
using Octets = std::vector<std::uint8_t>;

/// A client or a server of "reset" that knows nothing of our wrapper.
struct RawEnd {
  RawEnd(int domain, const dds_topic_descriptor_t& out, const char* out_topic,
         const dds_topic_descriptor_t& in, const char* in_topic)
      : participant(dds_create_participant(static_cast<dds_domainid_t>(domain), nullptr, nullptr)) {
    dds_qos_t* qos = dds_create_qos();  // as rmw_qos_profile_services_default
    dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
    dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 10);
    writer = dds_create_writer(participant,
                               dds_create_topic(participant, &out, out_topic, nullptr, nullptr),
                               qos, nullptr);
    reader = dds_create_reader(
        participant, dds_create_topic(participant, &in, in_topic, nullptr, nullptr), qos, nullptr);
    dds_delete_qos(qos);
  }
  ~RawEnd() { dds_delete(participant); }
  RawEnd(const RawEnd&) = delete;
  RawEnd& operator=(const RawEnd&) = delete;

  [[nodiscard]] bool connected() const {
    return dds_get_matched_subscriptions(writer, nullptr, 0) > 0 &&
           dds_get_matched_publications(reader, nullptr, 0) > 0;
  }
  /// The next sample with its encoding's header.
  [[nodiscard]] Octets take_bytes() const {
    ddsi_serdata* data = nullptr;
    dds_sample_info_t info;
    if (dds_takecdr(reader, &data, 1, &info, DDS_ANY_STATE) != 1) return {};
    Octets bytes(ddsi_serdata_size(data));
    ddsi_serdata_to_ser(data, 0, bytes.size(), bytes.data());
    ddsi_serdata_unref(data);
    return bytes;
  }

  dds_entity_t participant, writer = 0, reader = 0;
};

struct RawService : ::testing::Test {
  RawService() {
    config.name_space = "left";
    auto opened = Domain::open(config);
    if (!opened) throw std::runtime_error(opened.error().to_string());
    domain = *opened;
    participant = std::move(*Participant::open(domain, "server"));
  }
  void serve() {
    server = std::move(*ServiceServer::open(*participant));
    using Work = ServiceWork<std_srvs::Trigger_Response>;
    for (const char* name : {"reset", "stop"}) {
      const auto added = server->add<std_srvs::Trigger_Request, std_srvs::Trigger_Response>(
          name, [this](const std_srvs::Trigger_Request&, const Asker&) {
            return Work{.at_once = false,
                        .answer = [this](std_srvs::Trigger_Response& reply, ReplyMemory& memory) {
                          while (hold) std::this_thread::sleep_for(milliseconds(1));
                          reply.success = true;
                          reply.message = memory.text("done");
                        }};
          });
      ASSERT_TRUE(added) << added.error().to_string();
    }
    ASSERT_TRUE(server->start());
  }
  [[nodiscard]] std::unique_ptr<RawEnd> client(
      const dds_topic_descriptor_t& request = std_srvs_srv_dds__Trigger_Request__desc) const {
    return std::make_unique<RawEnd>(config.domain, request, "rq/left/resetRequest",
                                    std_srvs_srv_dds__Trigger_Response__desc, "rr/left/resetReply");
  }
  static std::string ask(
      ServiceClient<std_srvs::Trigger_Request, std_srvs::Trigger_Response>& one) {
    std::string text;
    const Status done =
        one.call({}, milliseconds(20'000),
                 [&text](const std_srvs::Trigger_Response& reply) { text = reply.message; });
    return done ? text : done.error().to_string();
  }

  Config config = test::own_config();
  std::shared_ptr<Domain> domain;
  std::atomic<bool> hold{false};
  std::unique_ptr<Participant> participant;
  std::unique_ptr<ServiceServer> server;
};

TEST_F(RawService, AnswersWithTheHeaderOfTheRequestByteForByte) {
  serve();
  const auto raw = client();
  ASSERT_TRUE(eventually([&] { return raw->connected(); }));
  const RawRequest request{0x1122334455667788, 7, 0};
  ASSERT_EQ(dds_write(raw->writer, &request), DDS_RETCODE_OK);
  Octets reply;
  ASSERT_TRUE(eventually([&] { return !(reply = raw->take_bytes()).empty(); }));
  const Octets expected{0x00, 0x01, 0x00, 0x00,                          // little-endian CDR
                        0x88, 0x77, 0x66, 0x55, 0x44, 0x33, 0x22, 0x11,  // guid
                        0x07, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,  // sequence
                        0x01, 0x00, 0x00, 0x00,                          // success, alignment
                        0x05, 0x00, 0x00, 0x00, 'd',  'o',  'n',  'e',  0x00};
  ASSERT_GE(reply.size(), expected.size());  // it may be padded to four bytes
  reply.resize(expected.size());
  reply[3] = 0;  // how many bytes of padding there are
  EXPECT_EQ(reply, expected);
}

TEST_F(RawService, AnswersAClientThatAsksBeforeItCanHear) {
  serve();
  const auto raw = client();
  dds_delete(raw->reader);
  ASSERT_TRUE(
      eventually([&] { return dds_get_matched_subscriptions(raw->writer, nullptr, 0) > 0; }));
  const RawRequest request{1, 1, 0};
  ASSERT_EQ(dds_write(raw->writer, &request), DDS_RETCODE_OK);
  ASSERT_TRUE(eventually([&] { return server->counts().requests == 1; }));
  raw->reader = dds_create_reader(
      raw->participant,
      dds_create_topic(raw->participant, &std_srvs_srv_dds__Trigger_Response__desc,
                       "rr/left/resetReply", nullptr, nullptr),
      nullptr, nullptr);
  // Without a reliable reader nothing is sent again: it is connected when the reply goes out.
  EXPECT_TRUE(eventually([&] { return !raw->take_bytes().empty(); }));
}

TEST_F(RawService, OutlivesRequestsOfAnotherLayout) {
  serve();
  dds_topic_descriptor_t other = std_msgs_msg_dds__String__desc;
  other.m_typename = std_srvs_srv_dds__Trigger_Request__desc.m_typename;
  const auto raw = client(other);
  ASSERT_TRUE(eventually([&] { return raw->connected(); }));
  for (int i = 0; i < 20; ++i) {
    std::string text(static_cast<std::size_t>(i), 'x');
    const std_msgs_msg_dds__String_ sample{text.data()};
    dds_write(raw->writer, &sample);
  }
  auto polite = ServiceClient<std_srvs::Trigger_Request, std_srvs::Trigger_Response>::create(
      *participant, "reset");
  ASSERT_TRUE(polite);
  EXPECT_EQ(ask(*polite), "done");
}

TEST_F(RawService, IsNotHeldUpByAClientThatFloods) {
  serve();
  const auto raw = client();
  ASSERT_TRUE(eventually([&] { return raw->connected(); }));
  hold = true;
  for (std::int64_t i = 0; i < 5000; ++i) {
    const RawRequest request{1, i, 0};
    dds_write(raw->writer, &request);
  }
  ASSERT_TRUE(eventually([&] { return server->counts().dropped > 0; }));
  hold = false;
  auto other = ServiceClient<std_srvs::Trigger_Request, std_srvs::Trigger_Response>::create(
      *participant, "stop");
  ASSERT_TRUE(other);
  EXPECT_EQ(ask(*other), "done");
  const ServiceServer::Counts counts = server->counts();
  EXPECT_GT(counts.dropped, counts.replies) << "the flood is not done";
}

// A stop that a run's end met had no answer where its reader was not found yet.
TEST_F(RawService, AtItsEndSendsTheReplyThatWaitsForItsReader) {
  server = std::move(*ServiceServer::open(*participant));
  ASSERT_TRUE((server->add<std_srvs::Trigger_Request, std_srvs::Trigger_Response>(
      "stop", [](const std_srvs::Trigger_Request&, const Asker&) {
        return ServiceWork<std_srvs::Trigger_Response>{
            .at_once = true, .answer = [](std_srvs::Trigger_Response& reply, ReplyMemory& memory) {
              reply.message = memory.text("stopped");
            }};
      })));
  ASSERT_TRUE(server->start(true));
  RawEnd asks(config.domain, std_srvs_srv_dds__Trigger_Request__desc, "rq/left/stopRequest",
              std_srvs_srv_dds__Trigger_Response__desc, "rr/left/elsewhere");
  ASSERT_TRUE(
      eventually([&] { return dds_get_matched_subscriptions(asks.writer, nullptr, 0) > 0; }));
  const RawRequest request{1, 7, 0};
  dds_write(asks.writer, &request);
  ASSERT_TRUE(eventually([&] { return server->counts().requests == 1; }));
  std::thread end([this] { server.reset(); });
  std::this_thread::sleep_for(milliseconds(100));
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  asks.reader = dds_create_reader(
      asks.participant,
      dds_create_topic(asks.participant, &std_srvs_srv_dds__Trigger_Response__desc,
                       "rr/left/stopReply", nullptr, nullptr),
      qos, nullptr);
  dds_delete_qos(qos);
  end.join();
  EXPECT_TRUE(eventually([&] { return !asks.take_bytes().empty(); }));
}

TEST_F(RawService, RepliesThatAreNotForItAreIgnoredByAClient) {
  RawEnd raw(config.domain, std_srvs_srv_dds__Trigger_Response__desc, "rr/left/resetReply",
             std_srvs_srv_dds__Trigger_Request__desc, "rq/left/resetRequest");
  auto polite = ServiceClient<std_srvs::Trigger_Request, std_srvs::Trigger_Response>::create(
      *participant, "reset");
  ASSERT_TRUE(polite);
  std::thread impostor([&raw] {
    Octets request;
    if (!eventually([&] { return !(request = raw.take_bytes()).empty(); })) return;
    std::uint64_t guid = 0;
    std::int64_t sequence = 0;
    std::memcpy(&guid, &request[4], sizeof guid);
    std::memcpy(&sequence, &request[12], sizeof sequence);
    std::string wrong = "wrong", right = "right";
    const std::array<RawResponse, 4> replies{RawResponse{guid + 1, sequence, true, wrong.data()},
                                             RawResponse{guid, sequence + 1, true, wrong.data()},
                                             RawResponse{guid, sequence - 1, true, wrong.data()},
                                             RawResponse{guid, sequence, true, right.data()}};
    for (const RawResponse& reply : replies) dds_write(raw.writer, &reply);
  });
  EXPECT_EQ(ask(*polite), "right");
  EXPECT_EQ(polite->ignored(), 3U);
  impostor.join();
}

}  // namespace
}  // namespace tandem::dds
