// Clients of a control socket: of many lines, rude, silent or gone.
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "apps/clients/control_client.hpp"
#include "tests/apps/socket_fixture.hpp"

namespace tandem::apps {
namespace {

using test::Socket;

TEST_F(Socket, AnswersLineByLine) {
  const auto socket = open(path);
  const int fd = connect();
  send(fd, "{\"do\": \"echo\", \"text\": \"a\"}\n{\"do\": \"echo\", ");
  EXPECT_EQ(line(fd), "{\"ok\":true,\"text\":\"a\",\"times\":1}\n");
  send(fd, "\"text\": \"b\"}\r\nrubbish\n");
  EXPECT_EQ(line(fd), "{\"ok\":true,\"text\":\"b\",\"times\":1}\n");
  EXPECT_NE(line(fd).find("\"ok\":false"), std::string::npos);
  ::close(fd);
  const auto answer = ask(path, {{"do", "echo"}, {"text", "c"}});
  ASSERT_TRUE(answer.has_value()) << answer.error().to_string();
  EXPECT_EQ((*answer)["text"], "c");
  const auto refused = ask(path, {{"do", "ecko"}});
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().hint, "did you mean 'echo'?");
}

TEST_F(Socket, ClosesAClientWhoseLineIsTooLong) {
  const auto socket = open(path);
  const int fd = connect();
  std::thread sender([fd] {
    const std::string much(2 * kMaxControlLine, ' ');
    (void)::send(fd, much.data(), much.size(), MSG_NOSIGNAL);
  });
  EXPECT_TRUE(closed(fd));
  sender.join();
  ::close(fd);
  EXPECT_TRUE(ask(path, {{"do", "help"}}).has_value());
}

TEST_F(Socket, IsNotHeldUpByAClientThatDoesNotReadOrHalfWrites) {
  const auto socket = open(path);
  const int deaf = connect();
  for (int i = 0; i < 5; ++i) send(deaf, "{\"do\": \"long\"}\n");
  const int slow = connect();
  send(slow, "{\"do\": ");
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(ask(path, {{"do", "help"}}).has_value());
  send(slow, "\"help\"}\n");
  EXPECT_NE(line(slow).find("commands"), std::string::npos);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(line(deaf).size(), 200'022U);  // all, once it reads
  ::close(deaf);
  ::close(slow);
}

TEST_F(Socket, OutlivesClientsThatVanish) {
  const auto socket = open(path);
  for (int i = 0; i < 50; ++i) {
    const int fd = connect();
    send(fd, i % 2 == 0 ? "{\"do\": \"long\"}\n{\"do\": \"long\"}\n" : "{\"do\"");
    ::close(fd);
  }
  EXPECT_TRUE(ask(path, {{"do", "help"}}).has_value());
}

TEST_F(Socket, GivesTheQuietestClientsPlaceToANewOne) {
  const auto socket = open(path);
  std::vector<int> clients;
  for (std::size_t i = 0; i < kMaxControlClients; ++i) {
    clients.push_back(connect());
    send(clients.back(), "{\"do\": \"help\"}\n");
    EXPECT_NE(line(clients.back()), "");
  }
  send(clients.front(), "{\"do\": \"help\"}\n");
  EXPECT_NE(line(clients.front()), "");
  EXPECT_TRUE(ask(path, {{"do", "help"}}).has_value());
  EXPECT_NE(line(clients[1]).find("16 clients are there already"), std::string::npos);
  EXPECT_TRUE(closed(clients[1]));
  send(clients.front(), "{\"do\": \"help\"}\n");
  EXPECT_NE(line(clients.front()), "");
  for (const int fd : clients) ::close(fd);
}

// A client that had waited in vain for a suspended process saw the joint move once it went on.
TEST_F(Socket, DropsWhatAClientAskedForThatHasGone) {
  std::atomic<bool> at_work{false}, released{false};
  std::atomic<int> moved{0};
  registry.add({"slow", ControlEffect::kChanges, "takes its time", {}},
               [&](const Json&) -> Result<Json> {
                 at_work = true;
                 while (!released) std::this_thread::yield();
                 return Json{{"text", "slow"}};
               });
  registry.add({"move", ControlEffect::kChanges, "moves", {}}, [&](const Json&) -> Result<Json> {
    ++moved;
    return Json{{"text", "move"}};
  });
  registry.add({"stop", ControlEffect::kStops, "stops", {}}, [&](const Json&) -> Result<Json> {
    return Json{{"text", "stop"}};
  });
  const auto socket = open(path);
  const int busy = connect();
  send(busy, "{\"do\": \"slow\"}\n");
  while (!at_work) std::this_thread::yield();
  const int gone = connect();
  send(gone, "{\"do\": \"move\"}\n{\"do\": \"move\"}\n");
  ::close(gone);
  const int stays = connect();
  send(stays, "{\"do\": \"move\"}\n");
  ::shutdown(stays, SHUT_WR);    // as `nc -N` does: it still reads
  for (int i = 0; i < 2; ++i) {  // whoever came before it has been heard
    EXPECT_TRUE(ask(path, {{"do", "stop"}}).has_value());
  }
  released = true;
  EXPECT_EQ(line(stays), "{\"ok\":true,\"text\":\"move\"}\n");
  EXPECT_EQ(line(busy), "{\"ok\":true,\"text\":\"slow\"}\n");
  EXPECT_TRUE(ask(path, {{"do", "help"}}).has_value());  // after all that came before
  EXPECT_EQ(moved, 1);
  ::close(stays);
  ::close(busy);
}

TEST_F(Socket, StopsWhileAnotherCommandIsAtWorkAndManyHaveGone) {
  std::atomic<bool> at_work{false}, stopped{false};
  std::atomic<int> begun{0};
  registry.add({"begin", ControlEffect::kChanges, "begins", {}}, [&](const Json&) -> Result<Json> {
    ++begun;
    return Json{};
  });
  registry.add({"slow", ControlEffect::kChanges, "ends after a stop", {}},
               [&](const Json&) -> Result<Json> {
                 at_work = true;
                 while (!stopped) std::this_thread::yield();
                 return Json{{"text", "slow"}};
               });
  registry.add({"stop", ControlEffect::kStops, "stops", {}}, [&](const Json&) -> Result<Json> {
    return Json{{"text", "stop"}};
  });
  const auto socket = open(path);
  const int slow = connect();
  send(slow, "{\"do\": \"slow\"}\n{\"do\": \"stop\"}\n");
  while (!at_work) std::this_thread::yield();
  for (std::size_t i = 0; i < 4 * kMaxControlClients; ++i) {
    const int gone = connect();
    send(gone, "{\"do\": \"begin\"}\n");
    ::close(gone);
  }
  const int late = connect();
  send(late, "{\"do\": \"stop\"}\n");
  EXPECT_EQ(line(late), "{\"ok\":true,\"text\":\"stop\"}\n");
  stopped = true;
  EXPECT_EQ(line(slow), "{\"ok\":true,\"text\":\"slow\"}\n");
  EXPECT_EQ(line(slow), "{\"ok\":true,\"text\":\"stop\"}\n");  // in order
  EXPECT_TRUE(ask(path, {{"do", "help"}}).has_value());
  EXPECT_EQ(begun, 0) << "what waited for the slow one";
  ::close(late);
  ::close(slow);
}

// One unknown command of 100 kB had held up the thread that stops for 1.35 s.
TEST_F(Socket, StopsWhileManyAskLongQuestionsThatNobodyUnderstands) {
  std::atomic<int> stops{0};
  registry.add({"stop", ControlEffect::kStops, "stops", {}}, [&](const Json&) -> Result<Json> {
    ++stops;
    return Json{{"text", "stop"}};
  });
  const auto socket = open(path);
  constexpr std::size_t kStrangers = 12;
  const std::string question = "{\"do\": \"" + std::string(200'000, 'x') + "\"}\n";
  std::atomic<bool> enough{false};
  std::vector<std::thread> strangers;
  for (std::size_t i = 0; i < kStrangers; ++i) {
    strangers.emplace_back([&] {
      while (!enough) {
        const int fd = connect();
        (void)::send(fd, question.data(), question.size(), MSG_NOSIGNAL);
        (void)line(fd);
        ::close(fd);
      }
    });
  }
  for (int i = 0; i < 20; ++i) {
    EXPECT_TRUE(ask(path, {{"do", "stop"}}).has_value()) << "within 3 s, stop " << i;
  }
  EXPECT_EQ(stops, 20);
  enough = true;
  for (std::thread& stranger : strangers) stranger.join();
}

// Stops and ends wait for the loop on a thread of their own; what takes long does so, too.
TEST_F(Socket, HasAThreadForEachTurn) {
  std::atomic<int> released{0};
  const auto waits = [&](int number) {
    return [&released, number](const Json&) -> Result<Json> {
      while (released < number) std::this_thread::yield();
      return Json{{"number", number}};
    };
  };
  registry.add({"stop", ControlEffect::kStops, "stops", {}}, waits(1));
  registry.add({"end", ControlEffect::kEnds, "ends", {}}, waits(1));
  registry.add({"predict", ControlEffect::kReads, "takes long", {}, {.takes_long = true}},
               waits(3));
  registry.add({"move", ControlEffect::kChanges, "moves", {}}, waits(2));
  const auto socket = open(path);
  std::vector<int> clients;
  for (const char* name : {"stop", "end", "predict", "move"}) {
    clients.push_back(connect());
    send(clients.back(), std::string("{\"do\": \"") + name + "\"}\n");
  }
  released = 1;
  EXPECT_EQ(line(clients[0]), "{\"ok\":true,\"number\":1}\n");
  EXPECT_EQ(line(clients[1]), "{\"ok\":true,\"number\":1}\n");
  released = 2;
  EXPECT_EQ(line(clients[3]), "{\"ok\":true,\"number\":2}\n");
  EXPECT_TRUE(ask(path, {{"do", "help"}}).has_value());
  released = 3;
  EXPECT_EQ(line(clients[2]), "{\"ok\":true,\"number\":3}\n");
  for (const int fd : clients) ::close(fd);
}

// Its place had been the quietest one.
TEST_F(Socket, LeavesAClientThatStopsItsPlace) {
  std::atomic<bool> released{false};
  registry.add({"stop", ControlEffect::kStops, "stops", {}}, [&](const Json&) -> Result<Json> {
    while (!released) std::this_thread::yield();
    return Json{{"text", "stop"}};
  });
  const auto socket = open(path);
  const int stops = connect();
  send(stops, "{\"do\": \"stop\"}\n");
  std::vector<int> others;
  for (std::size_t i = 0; i < 3 * kMaxControlClients; ++i) others.push_back(connect());
  EXPECT_TRUE(ask(path, {{"do", "help"}}).has_value());
  released = true;
  EXPECT_EQ(line(stops), "{\"ok\":true,\"text\":\"stop\"}\n");
  for (const int fd : others) ::close(fd);
  ::close(stops);
}

// `tandem estop` said that the run had ended, and not that the stop had ended it.
TEST_F(Socket, AnswersAStopThatItsEndMeets) {
  std::atomic<bool> at_work{false}, released{false};
  registry.add({"stop", ControlEffect::kStops, "stops", {}}, [&](const Json&) -> Result<Json> {
    at_work = true;
    while (!released) std::this_thread::yield();
    return Json{{"text", "stop"}};
  });
  auto socket = open(path);
  const int first = connect(), second = connect();
  send(first, "{\"do\": \"stop\"}\n");
  while (!at_work) std::this_thread::yield();
  send(second, "{\"do\": \"stop\"}\n");
  std::thread later([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    released = true;
  });
  socket.reset();
  later.join();
  for (const int fd : {first, second}) {
    EXPECT_EQ(line(fd), "{\"ok\":true,\"text\":\"stop\"}\n");
    ::close(fd);
  }
}

// A stop that came between the wait for a start and the run found nobody.
TEST_F(Socket, IsAnsweredByWhoServesNext) {
  auto listener = ControlSocket::end(open(path));
  ASSERT_NE(listener, nullptr);
  const int early = connect();
  send(early, "{\"do\": \"echo\", \"text\": \"a\"}\n");
  {
    const auto next = ControlSocket::open(std::move(listener), registry);
    ASSERT_TRUE(next.has_value());
    EXPECT_EQ((*next)->path(), path);
    EXPECT_EQ(line(early), "{\"ok\":true,\"text\":\"a\",\"times\":1}\n");
    EXPECT_TRUE(ask(path, {{"do", "help"}}).has_value());
  }
  ::close(early);
  EXPECT_FALSE(std::filesystem::exists(path));
  EXPECT_EQ(ControlSocket::end(nullptr), nullptr);
}

// A run's studio closed before the thread of stops had answered.
TEST_F(Socket, TurnsHaveAnsweredEveryStopWhenTheyEnd) {
  std::atomic<bool> at_work{false}, released{false};
  registry.add({"stop", ControlEffect::kStops, "stops", {}}, [&](const Json&) -> Result<Json> {
    at_work = true;
    while (!released) std::this_thread::yield();
    return Json{{"text", "stop"}};
  });
  std::atomic<int> told{0};
  ControlTurns turns(registry, [&] { ++told; });
  EXPECT_EQ(turns.ask(1, 10, R"({"do": "stop"})"), ControlTurn::kUrgent);
  while (!at_work) std::this_thread::yield();
  (void)turns.ask(2, 20, R"({"do": "stop"})");
  std::thread later([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    released = true;
  });
  turns.end();
  later.join();
  (void)turns.ask(3, 30, R"({"do": "stop"})");
  (void)turns.ask(4, 40, R"({"do": "echo", "text": "a"})");
  const std::vector<ControlTurns::Answer> answers = turns.take();
  ASSERT_EQ(answers.size(), 3U);
  for (std::size_t i = 0; i < answers.size(); ++i) {
    EXPECT_EQ(answers[i].asker, i + 1);
    EXPECT_EQ(answers[i].number, 10 * (i + 1));
    EXPECT_EQ(answers[i].text, R"({"ok":true,"text":"stop"})");
  }
  EXPECT_EQ(told, 3);
}

// It had waited behind a slow one, and undone the stop that came meanwhile.
TEST_F(Socket, RefusesWhatWasAskedBeforeAStopAndComesToItsTurnAfterIt) {
  std::atomic<bool> at_work{false}, released{false};
  std::atomic<std::uint64_t> stops{0};
  std::atomic<int> resets{0};
  registry.stops_by([&] { return stops.load(); });
  registry.add({"slow", ControlEffect::kReads, "takes its time", {}},
               [&](const Json&) -> Result<Json> {
                 at_work = true;
                 while (!released) std::this_thread::yield();
                 return Json{{"text", "slow"}};
               });
  registry.add({"reset", ControlEffect::kChanges, "resets", {}}, [&](const Json&) -> Result<Json> {
    ++resets;
    return Json{{"text", "reset"}};
  });
  registry.add({"stop", ControlEffect::kStops, "stops", {}}, [&](const Json&) -> Result<Json> {
    ++stops;
    return Json{{"text", "stop"}};
  });
  const auto socket = open(path);
  const int slow = connect(), early = connect();
  send(slow, "{\"do\": \"slow\"}\n");
  while (!at_work) std::this_thread::yield();
  send(early, "{\"do\": \"reset\"}\n");
  for (int i = 0; i < 2; ++i) EXPECT_TRUE(ask(path, {{"do", "stop"}}).has_value());
  const int late = connect();
  send(late, "{\"do\": \"reset\"}\n");
  released = true;
  EXPECT_NE(line(early).find("the robot was stopped after this was asked"), std::string::npos);
  EXPECT_EQ(line(late), "{\"ok\":true,\"text\":\"reset\"}\n");
  EXPECT_EQ(resets, 1);
  for (const int fd : {slow, early, late}) ::close(fd);
}

// A process that is stopped: connect() itself had waited for ever.
TEST_F(Socket, ThatAcceptsNobodyIsNoAnswerInTime) {
  const int stopped = ::socket(AF_UNIX, SOCK_STREAM, 0);
  const auto address = control_address(path);
  const auto* raw = reinterpret_cast<const sockaddr*>(&*address);
  ASSERT_EQ(::bind(stopped, raw, sizeof *address), 0);
  ASSERT_EQ(::listen(stopped, 0), 0);
  std::vector<int> waiting;
  do waiting.push_back(::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0));
  while (::connect(waiting.back(), raw, sizeof *address) == 0);
  const auto answer = ask(path, {{"do", "estop"}});
  ASSERT_FALSE(answer.has_value());
  EXPECT_EQ(answer.error().message, "no answer within 3 s");
  for (const int fd : waiting) ::close(fd);
  ::close(stopped);
}

}  // namespace
}  // namespace tandem::apps
