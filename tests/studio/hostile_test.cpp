// The studio against those who mean no good, and browsers that another page has turned on it.
#include <sys/resource.h>

#include <list>

#include "tests/studio/studio_rig.hpp"
#include "tests/support/eventually.hpp"

namespace tandem::studio {
namespace {

using namespace test;

std::string status_of(const std::string& answer) {
  return answer.size() < 12 ? "" : answer.substr(9, 3);
}

std::string with_host(std::uint16_t port, const std::string& host, const std::string& more = "") {
  return raw_http(port, "GET / HTTP/1.1\r\nHost: " + host + "\r\nConnection: close\r\n" +
                            "Accept-Encoding: gzip\r\n" + more + "\r\n");
}

TEST(StudioHttp, GivesPageAndDescriptionWithStrictHeaders) {
  StudioRig rig;
  rig.start();
  const std::string page = get(rig.port, "/", "Accept-Encoding: gzip\r\n");
  EXPECT_EQ(status_of(page), "200");
  for (const char* header : {"Content-Security-Policy: default-src 'none'; script-src 'self'",
                             "X-Content-Type-Options: nosniff", "Referrer-Policy: no-referrer",
                             "Cache-Control: no-store", "Content-Type: text/html"}) {
    EXPECT_NE(page.find(header), std::string::npos) << header;
  }
  const std::string urdf = get(rig.port, "/robot.urdf");
  EXPECT_EQ(status_of(urdf), "200");
  EXPECT_TRUE(urdf.ends_with("\r\n\r\n<robot name=\"pair\"/>"));
  EXPECT_EQ(status_of(get(rig.port, "/?x=1", "Accept-Encoding: gzip\r\n")), "200");
  EXPECT_EQ(status_of(get(rig.port, "/../../etc/passwd")), "404");
  const std::string socket = get(rig.port, "/ws");
  EXPECT_EQ(status_of(socket), "426");
  EXPECT_NE(socket.find("of tandem.studio.v1."), std::string::npos) << "a page reads its version";
  const std::string posted =
      raw_http(rig.port, "POST / HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(rig.port) +
                             "\r\nConnection: close\r\nContent-Length: 0\r\n\r\n");
  EXPECT_EQ(status_of(posted), "405");
  EXPECT_EQ(rig.token.size(), 32U);
  for (const std::string& answer : {page, urdf, posted}) {
    EXPECT_EQ(answer.find(rig.token), std::string::npos) << "the token is nobody's to read";
  }
}

TEST(StudioHttp, AnswersUnderItsOwnNameOnly) {
  StudioRig rig;
  rig.start();
  const std::string port = ":" + std::to_string(rig.port);
  for (const std::string& host :
       {"127.0.0.1" + port, "localhost" + port, "LOCALHOST" + port, "[::1]" + port}) {
    EXPECT_EQ(status_of(with_host(rig.port, host)), "200") << host;
  }
  for (const std::string& host :
       {std::string("127.0.0.1"), std::string("localhost:1"), "evil.example" + port,
        "127.0.0.1.evil.example" + port, "localhost" + port + port, std::string(),
        "127.0.0.1" + port + ", localhost" + port}) {
    EXPECT_EQ(status_of(with_host(rig.port, host)), "421") << host;
  }
  const std::string twice = "Host: localhost" + port + "\r\n";
  EXPECT_EQ(status_of(with_host(rig.port, "evil.example", twice)), "421");
  EXPECT_EQ(status_of(raw_http(rig.port, "GET / HTTP/1.0\r\n\r\n")), "421");
}

TEST(StudioHttp, RefusesPagesOfOtherPlaces) {
  StudioRig rig;
  rig.start();
  const std::string here = "127.0.0.1:" + std::to_string(rig.port);
  EXPECT_EQ(status_of(with_host(rig.port, here, "Origin: http://" + here + "\r\n")), "200");
  for (const char* origin : {"http://evil.example", "null", "https://127.0.0.1", "http://127.0.0.1",
                             "http://localhost:8642"}) {
    EXPECT_EQ(status_of(with_host(rig.port, here, "Origin: " + std::string(origin) + "\r\n")),
              "403")
        << origin;
    WebClient client(rig.port);
    EXPECT_FALSE(client.open("tandem.studio.v1", origin));
    EXPECT_EQ(client.status(), 403U);
  }
  WebClient own(rig.port);
  EXPECT_TRUE(own.open("tandem.studio.v1", "http://" + here));
  WebClient none(rig.port), other(rig.port), several(rig.port);
  EXPECT_FALSE(none.open(""));
  EXPECT_EQ(none.status(), 400U);
  EXPECT_FALSE(other.open("tandem.studio.v9"));
  EXPECT_TRUE(several.open("other, tandem.studio.v1"));
  EXPECT_EQ(several.protocol(), "tandem.studio.v1");
}

TEST(StudioHttp, AnswersNonsenseAndGoesOn) {
  StudioRig rig;
  rig.start();
  const std::string head = "GET / HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(rig.port) + "\r\n";
  EXPECT_EQ(status_of(raw_http(rig.port, head + "X: " + std::string(9000, 'x') + "\r\n\r\n")),
            "431");
  EXPECT_EQ(status_of(raw_http(rig.port, "\r\n\r\n\x16\x03\x01\x02\r\n\r\n")), "400");
  EXPECT_EQ(status_of(raw_http(rig.port, "GET / HTTP/9.9\r\n\r\n")), "400");
  EXPECT_EQ(status_of(raw_http(rig.port, head + "Content-Length: 5\r\n\r\nhello")), "400");
  EXPECT_EQ(status_of(raw_http(rig.port, head + "Content-Length: -1\r\n\r\n")), "400");
  EXPECT_EQ(status_of(get(rig.port, "/robot.urdf")), "200");
}

TEST(StudioHttp, ClosesWhoNeverEndsItsRequest) {
  StudioRig rig;
  rig.start();
  EXPECT_EQ(raw_http(rig.port, "GET / HTTP/1.1\r\nHost: "), "") << "without an answer";
  EXPECT_EQ(status_of(get(rig.port, "/robot.urdf")), "200");
}

/// A connection that says this, and then nothing more.
void stall(std::list<Tcp::socket>& crowd, net::io_context& io, std::uint16_t port,
           const std::string& words) {
  beast::error_code ignored;
  Tcp::socket& one = crowd.emplace_back(io);
  one.connect(endpoint(port), ignored);
  net::write(one, net::buffer(words), ignored);
}

bool is_closed(Tcp::socket& socket) {
  socket.non_blocking(true);
  std::array<char, 100> some{};
  beast::error_code error;
  socket.read_some(net::buffer(some), error);
  return error && error != net::error::would_block;
}

TEST(StudioHttp, WhoComesGetsThePlaceOfWhoHasBeenSilentLongest) {
  StudioRig rig;
  rig.start();
  net::io_context io;
  std::list<Tcp::socket> silent;
  stall(silent, io, rig.port, "GET / HT");
  // The second has been heard before, the third has been answered: it begins anew.
  stall(silent, io, rig.port, "");
  stall(silent, io, rig.port,
        "GET /robot.urdf HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(rig.port) + "\r\n\r\n");
  Tcp::socket& answered = silent.back();
  std::string words(2000, '\0');
  words.resize(answered.read_some(net::buffer(words)));
  EXPECT_EQ(status_of(words), "200");
  while (silent.size() < kMostConnections) stall(silent, io, rig.port, "");
  EXPECT_EQ(status_of(get(rig.port, "/robot.urdf")), "200") << "at once, whoever is there";
  EXPECT_TRUE(tandem::test::eventually([&] { return is_closed(silent.front()); }));
  EXPECT_FALSE(is_closed(answered));
  EXPECT_FALSE(is_closed(silent.back()));
  WebClient page(rig.port);
  EXPECT_TRUE(page.open());
  // Who goes on stalling costs others their places, and never a page its own.
  for (std::size_t i = 0; i < 3 * kMostConnections; ++i) stall(silent, io, rig.port, "GET");
  EXPECT_EQ(page.ask({{"do", "status"}})["ok"], true);
  EXPECT_EQ(status_of(get(rig.port, "/robot.urdf")), "200");
}

/// As many clients as want to be, who say nothing.
class Crowd final : public Protocol {
 public:
  std::span<const std::string_view> names() const override { return kNames; }
  std::size_t most_clients() const override { return 1000; }
  std::size_t clients() const override { return clients_; }
  ClientNumber connect(std::string) override { return ++clients_; }
  void disconnect(ClientNumber) override { --clients_; }
  void receive(ClientNumber, std::string_view, bool, Clock::time_point) override {}
  void tick(Clock::time_point) override {}
  void end(std::string_view, std::string_view) override {}
  std::optional<Frame> next(ClientNumber) override { return std::nullopt; }
  Close closing(ClientNumber) const override { return Close::kNot; }
  bool is_behind(ClientNumber) const override { return false; }

 private:
  static constexpr std::string_view kNames[] = {"crowd.v1"};
  std::size_t clients_ = 0;
};

TEST(StudioHttp, WhereEveryPlaceIsAClientsTheNextHearsSo) {
  Crowd crowd;
  StudioRig rig;
  rig.start(&crowd);
  std::list<WebClient> clients;
  for (std::size_t i = 0; i < kMostConnections; ++i) {
    EXPECT_TRUE(clients.emplace_back(rig.port).open("crowd.v1"));
  }
  EXPECT_EQ(status_of(raw_http(rig.port, "")), "503");
  const std::string answer = get(rig.port, "/robot.urdf");
  EXPECT_TRUE(answer.ends_with("close one, or try later\n")) << answer;
  clients.pop_back();
  EXPECT_TRUE(
      tandem::test::eventually([&] { return status_of(get(rig.port, "/robot.urdf")) == "200"; }));
  clients.clear();
  rig.studio->finish("", "");  // the crowd goes first
}

TEST(StudioHostile, HasRoomForSoManyPagesWhateverAHundredDo) {
  StudioRig rig;
  rig.start();
  std::list<WebClient> clients;
  std::size_t open = 0;
  for (int i = 0; i < 100; ++i) {
    try {
      if (clients.emplace_back(rig.port).open()) ++open;
    } catch (const boost::system::system_error&) {  // refused before it was asked
    }
  }
  EXPECT_EQ(open, kMostClients);
  (void)clients.front().next("hello");
  EXPECT_EQ(clients.front().ask({{"do", "estop"}})["ok"], true);
  clients.clear();
  EXPECT_TRUE(tandem::test::eventually([&] {
    WebClient again(rig.port);
    return again.open();
  }));
}

/// Both ends of a connection are open files of this process. @return how many clients there can be
std::size_t room_for(std::size_t clients) {
  rlimit files{};
  (void)::getrlimit(RLIMIT_NOFILE, &files);
  files.rlim_cur = files.rlim_max;
  (void)::setrlimit(RLIMIT_NOFILE, &files);
  const std::size_t others = 2 * kMostConnections + 100;
  return std::min<std::size_t>(clients, files.rlim_cur > others ? files.rlim_cur - others : 0);
}

TEST(StudioHostile, ACrowdOfAThousandTakesNothingFromThePage) {
  const std::size_t clients = room_for(1000);
  ASSERT_GT(clients, 2 * kMostConnections);
  StudioRig rig;
  rig.start();
  const auto page = rig.client();
  const Json signals = page->next("signals");
  const std::uint32_t id = id_in(signals, "state", "cycle");
  page->say(Json{{"op", "subscribe"}, {"revision", 1}, {"signals", {id}}});
  const std::string host = "Host: 127.0.0.1:" + std::to_string(rig.port) + "\r\n";
  const std::string says[] = {
      "GET / HT",                                            // and no more: half-open
      std::string(3000, '\xff'),                             // garbage
      "GET /robot.urdf HTTP/1.1\r\n" + host + "\r\n",        // an answer that nobody reads
      "GET /ws HTTP/1.1\r\n" + host + "Upgrade: websocket",  // a page that never gets there
  };
  net::io_context io;
  std::list<Tcp::socket> crowd;
  beast::error_code ignored;
  for (std::size_t i = 0; i < clients; ++i) {
    // Those who stall come first, and take every place.
    const bool stalls = i < kMostConnections;
    Tcp::socket& one = crowd.emplace_back(io);
    one.connect(endpoint(rig.port), ignored);
    one.write_some(net::buffer(says[stalls ? 0 : i % std::size(says)]), ignored);
    if (i % 100 == 0) rig.show(i, i + 100);
  }
  EXPECT_EQ(status_of(get(rig.port, "/robot.urdf")), "200") << "beside them all";
  rig.show(1000, 1001);
  while (page->tick().cycle < 999) {
  }
  crowd.clear();
  EXPECT_TRUE(
      tandem::test::eventually([&] { return status_of(get(rig.port, "/robot.urdf")) == "200"; }));
}

TEST(StudioHostile, ClosesWhoSendsTooMuchOrNoText) {
  StudioRig rig;
  rig.start();
  const auto large = rig.client();
  large->send("\"" + std::string(kMostFromClient, 'x') + "\"");
  EXPECT_EQ(large->closed(), 1009);
  const auto broken = rig.client();
  broken->send("{\"op\": \"\xff\xfe\"}");
  EXPECT_EQ(broken->closed(), 1007);
  const auto deep = rig.client();
  deep->send(std::string(30'000, '['));
  EXPECT_NE(deep->next("error")["message"], "");
  EXPECT_EQ(rig.client()->ask({{"do", "status"}})["ok"], true);
}

TEST(StudioHostile, KeepsFewQuestionsOfAFloodAndAStopFindsItsWay) {
  StudioRig rig;
  {
    const std::lock_guard lock(rig.mutex);
    rig.holds_back = true;
  }
  rig.start();
  const auto client = rig.client();
  for (int i = 0; i < 200; ++i) {
    client->say(Json{{"op", "ask"}, {"id", i}, {"request", {{"do", "status"}}}});
  }
  for (int i = 16; i < 200; ++i) {  // all but the first are refused
    const Json answer = client->next("answer");
    EXPECT_EQ(answer["id"], i);
    EXPECT_EQ(answer["answer"]["ok"], false);
  }
  EXPECT_EQ(rig.questions().size(), 16U);
  {
    const std::lock_guard lock(rig.mutex);
    rig.holds_back = false;
  }
  EXPECT_EQ(client->ask({{"do", "estop"}}, 999)["ok"], true);
}

TEST(StudioHostile, ReadsNoMoreOfOneThatDoesNotReadItself) {
  StudioRig rig;
  rig.start();
  rig.show(0, 500);
  WebClient deaf(rig.port, 4096);
  ASSERT_TRUE(deaf.open());
  Json many = Json::array();
  for (int i = 0; i < 256; ++i) many.push_back(2);
  const std::string window = Json{{"op", "window"}, {"id", 1},   {"signals", many},
                                  {"from_s", 0},    {"to_s", 1}, {"points", 1000}}
                                 .dump();
  // Answers of a megabyte each: what is not read of the questions stays where it is.
  for (int i = 0; i < 40; ++i) deaf.send(window);
  EXPECT_EQ(rig.client()->ask({{"do", "status"}})["ok"], true);
  std::size_t windows = 0;
  while (windows < 40) {
    const std::string frame = deaf.frame(2);
    if (frame.empty()) break;
    ++windows;
  }
  EXPECT_EQ(windows, 40U) << "nothing of it is lost";
}

TEST(StudioElsewhere, AnswersNobodyWhoHasNotEntered) {
  StudioRig rig("0.0.0.0");
  rig.start();
  EXPECT_EQ(status_of(get(rig.port, "/", "Accept-Encoding: gzip\r\n")), "200");
  EXPECT_EQ(status_of(get(rig.port, "/robot.urdf")), "401");
  EXPECT_EQ(status_of(get(rig.port, "/robot.urdf", "Authorization: Bearer 0\r\n")), "401");
  EXPECT_EQ(status_of(get(rig.port, "/robot.urdf", "Authorization: Bearer " + rig.token + "\r\n")),
            "200");
  const std::string port = ":" + std::to_string(rig.port);
  EXPECT_EQ(status_of(with_host(rig.port, "192.168.1.7" + port)), "200");
  EXPECT_EQ(status_of(with_host(rig.port, "robot.example" + port)), "421");
  const auto client = rig.client();
  client->say(Json{{"op", "ask"}, {"id", 1}, {"request", {{"do", "status"}}}});
  const auto first = client->read();
  ASSERT_TRUE(first);
  EXPECT_EQ(Json::parse(first->bytes)["op"], "error") << "no hello came before";
  client->say(Json{{"op", "enter"}});
  EXPECT_EQ(client->next("error")["hint"], "open the address with its token");
  EXPECT_TRUE(rig.questions().empty());
  client->say(Json{{"op", "enter"}, {"token", rig.token}});
  EXPECT_EQ(client->next("entered")["may"], "all");
  EXPECT_EQ(client->next("hello")["robot"], "pair");
}

TEST(StudioServer, TakesTheNextFreePortAndNamesOneThatIsTaken) {
  const auto first = Server::open("127.0.0.1", 0);
  ASSERT_TRUE(first);
  const std::uint16_t port = (*first)->place().port;
  const auto again = Server::open("127.0.0.1", port);
  ASSERT_FALSE(again);
  EXPECT_NE(again.error().to_string().find(std::to_string(port)), std::string::npos);
  EXPECT_NE(again.error().to_string().find("--studio="), std::string::npos);
  const auto a = Server::open("localhost", std::nullopt),
             b = Server::open("localhost", std::nullopt);
  ASSERT_TRUE(a && b);
  EXPECT_NE((*a)->place().port, (*b)->place().port);
  EXPECT_GE((*a)->place().port, kFirstPort);
  EXPECT_LE((*b)->place().port, kLastPort);
  EXPECT_FALSE(Server::open("robot.example", std::nullopt));
  EXPECT_FALSE(Server::open("203.0.113.5", std::nullopt)) << "no address of this machine";
}

}  // namespace
}  // namespace tandem::studio
