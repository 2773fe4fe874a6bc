// Services asked by Fast DDS in its own layout, as rmw_fastrtps_cpp asks: plain members, and a
// reply whose inline QoS names the request.
#include <gtest/gtest.h>

#include <atomic>
#include <csignal>
#include <thread>

#include "dds/cdr.hpp"
#include "dds/service_client.hpp"
#include "dds/service_server.hpp"
#include "tests/dds/fastdds_caller.hpp"
#include "tests/support/dds_domain.hpp"

namespace tandem::dds {
namespace {

using std::chrono::milliseconds;
using tandem::test::eventually;
using test::Octets;

/// CDR, little-endian, of std_srvs/srv/Trigger's request: one byte that nobody reads.
const Octets kTrigger{0, 1, 0, 0, 0};

/// tandem_msgs/srv/Ask's request or reply: a text.
Octets text_payload(const std::string& text) {
  const auto size = static_cast<std::uint32_t>(text.size() + 1);
  Octets out{0, 1, 0, 0};
  for (int i = 0; i < 4; ++i) out.push_back(static_cast<std::uint8_t>(size >> 8 * i));
  out.insert(out.end(), text.begin(), text.end());
  out.push_back(0);
  return out;
}

/// Without padding: its fourth byte says how much there is.
Octets unpadded(Octets payload) {
  if (payload.size() < 4) return payload;
  payload.resize(payload.size() - payload[3]);
  payload[3] = 0;
  return payload;
}

class FastService : public testing::Test {
 protected:
  void SetUp() override {
    if (!test::have_fastdds_caller()) GTEST_SKIP() << test::kNoFastDds;
    if (!answers_fast_dds()) GTEST_SKIP() << "built for another version of Cyclone DDS";
    serve(test::own_config());
  }

  void serve(const Config& config) {
    server_.reset();
    participant_.reset();
    domain_.reset();
    domain_ = *Domain::open(config);
    participant_ = std::move(*Participant::open(domain_, "server"));
    server_ = std::move(*ServiceServer::open(*participant_));
    ASSERT_TRUE((server_->add<std_srvs::Trigger_Request, std_srvs::Trigger_Response>(
        "reset", [this](const std_srvs::Trigger_Request&, const Asker& asker) {
          asker_ = asker;
          return ServiceWork<std_srvs::Trigger_Response>{
              .answer = [](std_srvs::Trigger_Response& reply, ReplyMemory& memory) {
                reply.success = true;
                reply.message = memory.text("done");
              }};
        })));
    // Says what it was asked, in as many words as it was asked for.
    ASSERT_TRUE((server_->add<tandem_msgs::Ask_Request, tandem_msgs::Ask_Response>(
        "ask", [this](const tandem_msgs::Ask_Request& request, const Asker&) {
          return ServiceWork<tandem_msgs::Ask_Response>{
              .answer = [this, text = std::string(request.request)](
                            tandem_msgs::Ask_Response& reply, ReplyMemory& memory) {
                while (hold_) std::this_thread::sleep_for(milliseconds(1));
                const std::size_t times = text == "much" ? 10'000 : 1;
                std::string all;
                for (std::size_t i = 0; i < times; ++i) all += text;
                reply.answer = memory.text(all);
              }};
        })));
    ASSERT_TRUE(server_->start());
  }

  static test::FastDdsCaller caller(int asks, bool trigger = false) {
    std::vector<std::string> arguments;
    if (trigger) arguments = {"/reset", "std_srvs/srv/Trigger"};
    for (int i = 0; i < asks; ++i) {
      arguments.insert(arguments.end(), {"/ask", "tandem_msgs/srv/Ask"});
    }
    return test::FastDdsCaller(arguments);
  }

  using AskClient = ServiceClient<tandem_msgs::Ask_Request, tandem_msgs::Ask_Response>;
  static std::string ask(AskClient& client, std::string text) {
    std::string answer;
    const Status done = client.call(
        {.request_guid = 0, .request_sequence = 0, .request = text.data()}, milliseconds(20'000),
        [&](const tandem_msgs::Ask_Response& reply) { answer = reply.answer; });
    return done ? answer : done.error().to_string();
  }

  std::atomic<bool> hold_{false};
  std::shared_ptr<Domain> domain_;
  std::unique_ptr<Participant> participant_;
  std::unique_ptr<ServiceServer> server_;
  Asker asker_;
};

TEST_F(FastService, AnswersByteForByteWithoutCyclonesHeader) {
  auto client = caller(0, true);
  const std::string participant = client.participant();
  ASSERT_TRUE(client.ready(0));
  const Octets expected{0, 1, 0, 0,  // little-endian CDR
                        1, 0, 0, 0,  // success, alignment
                        5, 0, 0, 0, 'd', 'o', 'n', 'e', 0};
  EXPECT_EQ(unpadded(client.call(0, kTrigger)), expected);
  ASSERT_TRUE(asker_);
  EXPECT_EQ(to_text(*asker_), participant);
}

TEST_F(FastService, AnswersEveryRequestOfALongSession) {
  auto client = caller(1);
  ASSERT_TRUE(client.ready(0));
  for (int i = 0; i < 50; ++i) {
    const Octets payload = text_payload(std::string(static_cast<std::size_t>(i * i * 4), 'q'));
    ASSERT_EQ(unpadded(client.call(0, payload)), payload) << i;
  }
  EXPECT_EQ(server_->counts().replies, 50U);
}

TEST_F(FastService, GivesEachClientItsOwnReplyAndNoOther) {
  auto first = caller(2), second = caller(1);
  ASSERT_TRUE(first.ready(0) && first.ready(1) && second.ready(0));
  hold_ = true;  // so that all of them wait at once
  const std::string a = first.send(0, text_payload("a")), b = first.send(1, text_payload("b")),
                    c = second.send(0, text_payload("c"));
  ASSERT_TRUE(eventually([&] { return server_->counts().requests == 3; }));
  hold_ = false;
  EXPECT_EQ(unpadded(first.reply(0, a)), text_payload("a"));
  EXPECT_EQ(unpadded(first.reply(1, b)), text_payload("b"));
  EXPECT_EQ(unpadded(second.reply(0, c)), text_payload("c"));
  // A reply goes to everybody; who it is not for sees so.
  for (int i = 0; i < 2; ++i) EXPECT_FALSE(first.line("0 other").empty());
  EXPECT_TRUE(first.take("0 reply").empty());
}

/// Replies of several packets; the first alone has the inline QoS.
TEST_F(FastService, AnswersAtLength) {
  auto client = caller(1);
  ASSERT_TRUE(client.ready(0));
  std::string all;
  for (int i = 0; i < 10'000; ++i) all += "much";
  EXPECT_EQ(unpadded(client.call(0, text_payload("much"))), text_payload(all));
}

TEST_F(FastService, ServesClientsOfBothLayoutsAtOnce) {
  auto fast = caller(1);
  // Beside the server, where Cyclone DDS says that it cannot read Fast DDS's replies.
  auto cyclone = AskClient::create(*participant_, "ask");
  ASSERT_TRUE(cyclone && fast.ready(0));
  for (int i = 0; i < 10; ++i) {
    const std::string text = "both " + std::to_string(i);
    EXPECT_EQ(unpadded(fast.call(0, text_payload(text))), text_payload(text));
    EXPECT_EQ(ask(*cyclone, text), text);
  }
}

TEST_F(FastService, CountsWhatIsNoRequestAndGoesOn) {
  auto client = caller(1, true);
  ASSERT_TRUE(client.ready(0) && client.ready(1));
  const std::vector<Octets> bad{
      {0, 1, 0, 0},                                              // nothing in it
      {0, 1, 0, 0, 9, 0, 0, 0, 'x', 0},                          // a text longer than the payload
      {0, 1, 0, 0, 0xff, 0xff, 0xff, 0xff, 'x', 0},              // much longer
      {0, 1, 0, 0, 2, 0, 0, 0, 'x', 'y'},                        // a text without an end
      {0, 1, 0, 0, 2, 0, 0, 0, 'x', 0, 1, 2, 3, 4, 5, 6, 7, 8},  // more than there is
      {7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7},                      // no encoding at all
      {0, 3, 0, 0, 2, 0, 0, 0, 'x', 0},                          // a parameter list
      Octets(3000, 0),
  };
  for (std::size_t i = 0; i < bad.size(); ++i) {
    client.send(1, bad[i]);
    EXPECT_TRUE(eventually([&] { return server_->counts().malformed == i + 1; }))
        << test::to_hex(bad[i]);
  }
  EXPECT_EQ(unpadded(client.call(1, text_payload("well"))), text_payload("well"));
  EXPECT_FALSE(client.call(0, kTrigger).empty());
  EXPECT_EQ(server_->counts().malformed, bad.size());
}

TEST_F(FastService, ReadsBigEndianRequests) {
  auto client = caller(1);
  ASSERT_TRUE(client.ready(0));
  EXPECT_EQ(unpadded(client.call(0, {0, 0, 0, 0, 0, 0, 0, 3, 'h', 'i', 0})), text_payload("hi"));
}

/// A request comes before the first heartbeat of its writer, where that is lost or late: Cyclone
/// DDS left out what came so from Fast DDS, and there never was an answer.
TEST_F(FastService, AnswersTheFirstRequestOfAClientWhateverIsLost) {
  Config config = test::own_config();
  config.lost_per_mille = 100;
  serve(config);
  for (int i = 0; i < 8; ++i) {
    auto client = caller(1);
    ASSERT_TRUE(client.ready(0));
    const Octets payload = text_payload("first " + std::to_string(i));
    EXPECT_EQ(unpadded(client.call(0, payload)), payload);
  }
}

TEST_F(FastService, ForgetsAClientThatVanishes) {
  auto other = caller(1);
  ASSERT_TRUE(other.ready(0));
  hold_ = true;
  {
    auto gone = caller(1);
    ASSERT_TRUE(gone.ready(0));
    gone.send(0, text_payload("gone"));
    ASSERT_TRUE(eventually([&] { return server_->counts().requests == 1; }));
    gone.say("drop 0");
  }
  const std::string number = other.send(0, text_payload("here"));
  hold_ = false;
  EXPECT_EQ(unpadded(other.reply(0, number)), text_payload("here"));
  EXPECT_EQ(server_->counts().requests, 2U);
}

TEST_F(FastService, OutlivesAClientThatIsKilled) {
  auto other = caller(1);
  ASSERT_TRUE(other.ready(0));
  {
    auto killed = caller(1);
    ASSERT_TRUE(killed.ready(0));
    killed.send(0, text_payload("killed"));
    ::kill(killed.pid(), SIGKILL);
  }
  for (int i = 0; i < 20; ++i) {
    ASSERT_EQ(unpadded(other.call(0, text_payload("here"))), text_payload("here"));
  }
}

}  // namespace
}  // namespace tandem::dds
