// Services between a server and clients of ours, and clients that know no manners.
#include <gtest/gtest.h>

#include <atomic>
#include <future>

#include "dds/service_client.hpp"
#include "dds/service_server.hpp"
#include "tests/support/dds_domain.hpp"
#include "tests/support/eventually.hpp"

namespace tandem::dds {
namespace {

using std::chrono::milliseconds;
using tandem::test::eventually;
using test::own_config;
using Request = std_srvs::Trigger_Request;
using Response = std_srvs::Trigger_Response;
using Client = ServiceClient<Request, Response>;
using Work = ServiceWork<Response>;

constexpr milliseconds kLong{20'000};

/// A server with two services, "echo" and "stop", in a domain of this program's own.
struct Services : ::testing::Test {
  Services() : domain(Domain::open(own_config())) {
    if (!domain) ADD_FAILURE() << domain.error().to_string();
    server_side = join("server");
    client_side = join("client");
    serve();
  }
  [[nodiscard]] std::unique_ptr<Participant> join(const std::string& node) const {
    auto made = Participant::open(*domain, node);
    EXPECT_TRUE(made) << made.error().to_string();
    return made ? std::move(*made) : nullptr;
  }
  void serve() {
    auto opened = ServiceServer::open(*server_side);
    ASSERT_TRUE(opened) << opened.error().to_string();
    server = std::move(*opened);
    const auto echo = server->add<Request, Response>("echo", [this](const Request& request,
                                                                    const Asker&) {
      const auto number = request.request_sequence;
      return Work{.at_once = false, .answer = [this, number](Response& reply, ReplyMemory& memory) {
                    while (hold) std::this_thread::sleep_for(milliseconds(1));
                    ++echoed;
                    reply.success = true;
                    reply.message = memory.text(std::to_string(number));
                  }};
    });
    const auto stop = server->add<Request, Response>("stop", [this](const Request&, const Asker&) {
      return Work{.at_once = true, .answer = [this](Response& reply, ReplyMemory& memory) {
                    ++stopped;
                    reply.success = true;
                    reply.message = memory.text("stopped");
                  }};
    });
    const auto later =
        server->add<Request, Response>("later", [this](const Request&, const Asker&) {
          return Work{.at_once = true,
                      .answer = [](Response& reply,
                                   ReplyMemory& memory) { reply.message = memory.text("at last"); },
                      .ready = [this] { return ready.load(); }};
        });
    ASSERT_TRUE(echo && stop && later);
    ASSERT_TRUE(server->start());
  }
  [[nodiscard]] static Client client_of(Participant& participant, const std::string& name) {
    auto client = Client::create(participant, name);
    if (!client) throw std::runtime_error(client.error().to_string());
    return std::move(*client);
  }
  /// The reply's text, or the error's.
  static std::string call(Client& client, milliseconds patience = kLong) {
    std::string text;
    const Status done =
        client.call({}, patience, [&text](const Response& reply) { text = reply.message; });
    return done ? text : done.error().to_string();
  }

  Result<std::shared_ptr<Domain>> domain;
  std::atomic<bool> hold{false}, ready{false};
  std::atomic<int> echoed{0}, stopped{0};
  std::unique_ptr<Participant> server_side, client_side;
  std::unique_ptr<ServiceServer> server;  // goes before what its work uses
};

/// A request that waits holds up no other.
TEST_F(Services, MayAnswerLater) {
  Client later = client_of(*client_side, "later"), stop = client_of(*client_side, "stop");
  std::future<std::string> answered = std::async(std::launch::async, [&] { return call(later); });
  ASSERT_TRUE(eventually([&] { return server->counts().requests == 1; }));
  EXPECT_EQ(call(stop), "stopped");
  EXPECT_TRUE(eventually([&] { return server->counts().replies == 1; }));
  ready = true;
  server->wake();
  EXPECT_EQ(answered.get(), "at last");
}

TEST_F(Services, AnswerEveryRequestOnce) {
  Client client = client_of(*client_side, "echo");
  for (int i = 1; i <= 20; ++i) EXPECT_EQ(call(client), std::to_string(i));
  EXPECT_EQ(echoed, 20);
  EXPECT_TRUE(eventually([&] { return server->counts().replies == 20; }));
  EXPECT_EQ(client.ignored(), 0U);
}

TEST_F(Services, AnswerTheFirstRequestOfEveryNewClient) {
  for (int i = 0; i < 10; ++i) {
    const auto participant = join("passing");
    Client client = client_of(*participant, "echo");
    EXPECT_EQ(call(client), "1");
  }
}

TEST_F(Services, KeepClientsApartThatAskAtOnce) {
  std::vector<std::future<int>> asking;
  for (int c = 0; c < 4; ++c) {
    asking.push_back(std::async(std::launch::async, [this] {
      const auto participant = join("one_of_four");
      Client client = client_of(*participant, "echo");
      int right = 0;
      for (int i = 1; i <= 25; ++i) right += call(client) == std::to_string(i) ? 1 : 0;
      return right;
    }));
  }
  for (auto& one : asking) EXPECT_EQ(one.get(), 25);
  EXPECT_EQ(echoed, 100);
}

TEST_F(Services, ThatNobodyServesAreAnErrorThatSaysWhatToStart) {
  Client client = client_of(*client_side, "nothing");
  const std::string error = call(client, milliseconds(50));
  EXPECT_NE(error.find("no process serves /nothing"), std::string::npos) << error;
  EXPECT_NE(error.find("--dds"), std::string::npos) << error;
}

TEST_F(Services, ThatTakeTooLongAreAnErrorAndTheirLateReplyIsNoOthers) {
  Client client = client_of(*client_side, "echo");
  EXPECT_EQ(call(client), "1");
  hold = true;
  const std::string error = call(client, milliseconds(50));
  EXPECT_NE(error.find("no answer within 0.05 s"), std::string::npos) << error;
  hold = false;
  EXPECT_EQ(call(client), "3");
  EXPECT_EQ(client.ignored(), 1U);
}

TEST_F(Services, AreStoppedWhileAnotherRequestIsAtWork) {
  Client slow = client_of(*client_side, "echo");
  EXPECT_EQ(call(slow), "1");
  hold = true;
  auto answer = std::async(std::launch::async, [&] { return call(slow); });
  Client stop = client_of(*client_side, "stop");
  EXPECT_EQ(call(stop), "stopped");
  EXPECT_EQ(echoed, 1);
  hold = false;
  EXPECT_EQ(answer.get(), "2");
}

TEST_F(Services, ThatGoAwayInACallAreAnError) {
  Client client = client_of(*client_side, "echo");
  EXPECT_EQ(call(client), "1");
  hold = true;
  auto answer = std::async(std::launch::async, [&] { return call(client); });
  ASSERT_TRUE(eventually([&] { return server->counts().requests == 2; }));
  hold = false;  // the work ends, and the server with it
  server.reset();
  const std::string text = answer.get();
  EXPECT_TRUE(text == "2" || text.find("went away") != std::string::npos) << text;
  EXPECT_NE(call(client, milliseconds(50)).find("no process serves"), std::string::npos);
}

TEST_F(Services, OfTwoProcessesAreNotAsked) {
  const auto participant = join("second");
  auto second = ServiceServer::open(*participant);
  ASSERT_TRUE(second);
  ASSERT_TRUE(((*second)->add<Request, Response>(
      "stop", [](const Request&, const Asker&) { return Work{}; })));
  Client client = client_of(*client_side, "stop");
  ASSERT_TRUE(eventually([&] { return client.servers() == 2; }));
  const std::string error = call(client);
  EXPECT_NE(error.find("2 processes serve /stop"), std::string::npos) << error;
  EXPECT_EQ(stopped, 0);
}

TEST_F(Services, AreFoundInEveryNamespace) {
  auto finder = ServiceFinder::create(*client_side);
  ASSERT_TRUE(finder);
  std::vector<FoundService> found;
  ASSERT_TRUE(eventually([&] { return !(found = finder->find("echo")).empty(); }));
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].name_space, "");
  EXPECT_EQ(found[0].node, "server");
  EXPECT_EQ(found[0].pid, std::to_string(::getpid()));
  EXPECT_TRUE(finder->find("cho").empty()) << "part of a name";
  server.reset();
  EXPECT_TRUE(eventually([&] { return finder->find("echo").empty(); }));
}

TEST_F(Services, ForgetClientsThatLeftBeforeTheirReply) {
  hold = true;
  {
    const auto participant = join("leaves");
    Client client = client_of(*participant, "echo");
    EXPECT_NE(call(client, milliseconds(200)), "1");
    ASSERT_TRUE(eventually([&] { return server->counts().requests == 1; }));
  }
  hold = false;
  ASSERT_TRUE(eventually([&] { return server->counts().unclaimed == 1; }));
  Client client = client_of(*client_side, "echo");
  EXPECT_EQ(call(client), "1");
}

}  // namespace
}  // namespace tandem::dds
