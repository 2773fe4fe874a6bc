// The control socket: strict questions, rude clients, stale files.
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <thread>

#include "apps/clients/control_client.hpp"
#include "apps/control/remote_gate.hpp"
#include "apps/control/run_control.hpp"
#include "apps/transport/control_path.hpp"
#include "apps/transport/control_socket.hpp"

namespace tandem::apps {
namespace {

using std::string_literals::operator""s;

void add_commands(ControlRegistry& registry) {
  registry.add("echo", ControlEffect::kChanges, "says it again",
               {{.name = "text", .required = true, .doc = "what to say"},
                {.name = "times", .type = ControlKey::Type::kInteger, .doc = "1 to 3"}},
               [](const Json& request) -> Result<Json> {
                 const int times = request.value("times", 1);
                 if (times > 3) return fail("too often", "three times at most");
                 return Json{{"text", request["text"]}, {"times", times}};
               });
  registry.add("long", ControlEffect::kReads, "an answer of 200 kB", {},
               [](const Json&) -> Result<Json> {
                 return Json{{"text", std::string(200'000, 'x')}};
               });
  registry.add("throw", ControlEffect::kReads, "throws", {},
               [](const Json&) -> Result<Json> { throw std::runtime_error("out of luck"); });
}

struct Answers : ::testing::Test {
  Answers() { add_commands(registry); }
  [[nodiscard]] std::string error(const std::string& question) const {
    const Json answer = registry.answer(question);
    EXPECT_EQ(answer["ok"], false) << answer;
    return answer.value("error", ""s) + " | " + answer.value("hint", ""s);
  }
  ControlRegistry registry;
};

TEST_F(Answers, CarryWhatTheCommandFound) {
  const Json answer = registry.answer(R"({"do": "echo", "text": "hello", "times": 2})");
  EXPECT_EQ(answer.dump(), R"({"ok":true,"text":"hello","times":2})");
}

TEST_F(Answers, ListTheCommandsWithTheirKeys) {
  const Json answer = registry.answer(R"({"do": "help"})");
  ASSERT_EQ(answer["commands"].size(), 4U);
  EXPECT_EQ(answer["commands"][0]["do"], "help");
  EXPECT_EQ(answer["commands"][1]["keys"]["times"], "integer, optional: 1 to 3");
  EXPECT_EQ(answer["commands"][0]["effect"], "reads");
  EXPECT_EQ(answer["commands"][1]["effect"], "changes");
}

TEST_F(Answers, KnowWhatACommandDoesBeforeItIsAsked) {
  EXPECT_EQ(registry.effect("help"), ControlEffect::kReads);
  EXPECT_EQ(registry.effect("echo"), ControlEffect::kChanges);
  EXPECT_EQ(registry.effect("nothing"), std::nullopt);
}

TEST_F(Answers, RefuseWhatTheGateOfWhoAsksDoesNotLetThrough) {
  const ControlRegistry::Gate gate = [](const std::string& name, ControlEffect effect,
                                        const Json&) -> Status {
    if (effect == ControlEffect::kReads) return {};
    return fail(name + " is not for everybody", "ask somebody else");
  };
  EXPECT_EQ(registry.answer(R"({"do": "help"})", gate)["ok"], true);
  const Json refused = registry.answer(R"({"do": "echo", "text": "x"})", gate);
  EXPECT_EQ(refused["ok"], false);
  EXPECT_EQ(refused["error"], "echo is not for everybody");
  EXPECT_EQ(registry.answer(R"({"do": "echo"})", gate)["error"], "echo: \"text\" is missing");
}

TEST_F(Answers, ToAStopComeWhileAnotherCommandIsAtWork) {
  std::atomic<bool> at_work{false}, stopped{false};
  registry.add("slow", ControlEffect::kChanges, "ends after a stop", {},
               [&](const Json&) -> Result<Json> {
                 at_work = true;
                 while (!stopped) std::this_thread::yield();
                 return Json::object();
               });
  registry.add("stop", ControlEffect::kStops, "stops", {}, [&](const Json&) -> Result<Json> {
    stopped = true;
    return Json::object();
  });
  EXPECT_TRUE(registry.stops(R"({"do": "stop"})"));
  EXPECT_FALSE(registry.stops(R"({"do": "slow"})"));
  EXPECT_FALSE(registry.stops("rubbish"));
  std::thread slow([&] { EXPECT_EQ(registry.answer(R"({"do": "slow"})")["ok"], true); });
  while (!at_work) std::this_thread::yield();
  EXPECT_EQ(registry.answer(R"({"do": "stop"})")["ok"], true);
  slow.join();
}

TEST_F(Answers, ToWhatIsNoJsonObjectAreErrors) {
  for (const char* text : {"", "help", "{\"do\": \"help\"", "{\"do\": \"help\"} x", "\xff\xfe",
                           "[]", "null", "3", "{'do': 'help'}", "{\"do\": \"help\",}"}) {
    EXPECT_NE(error(text).find("no JSON"), std::string::npos) << text;
  }
  EXPECT_NE(error(std::string(100'000, '[')).find("no JSON"), std::string::npos);
  EXPECT_EQ(error(R"({"do": "help", "do": "help"})"),
            "the key \"do\" is there twice | give it once");
}

TEST_F(Answers, NameTheNearestCommandAndKey) {
  EXPECT_EQ(error(R"({"do": "hepl"})"), "unknown command \"hepl\" | did you mean 'help'?");
  EXPECT_EQ(error(R"({"do": "echo", "test": "x"})"),
            "echo: unknown key \"test\" | did you mean 'text'?");
  EXPECT_NE(error(R"({"do": 3})").find("does not name a command"), std::string::npos);
  EXPECT_NE(error(R"({})").find("does not name a command"), std::string::npos);
}

TEST_F(Answers, RefuseWrongTypesAndMissingKeys) {
  EXPECT_EQ(error(R"({"do": "echo", "text": 3})"),
            "echo: \"text\" is not of type text | what to say");
  EXPECT_EQ(error(R"({"do": "echo", "text": "x", "times": 1.5})"),
            "echo: \"times\" is not of type integer | 1 to 3");
  EXPECT_EQ(error(R"({"do": "echo"})"), "echo: \"text\" is missing | what to say");
}

TEST_F(Answers, CarryWhatAHandlerRefusesOrThrows) {
  EXPECT_EQ(error(R"({"do": "echo", "text": "x", "times": 4})"), "too often | three times at most");
  EXPECT_NE(error(R"({"do": "throw"})").find("out of luck"), std::string::npos);
}

TEST(RemoteGate, LetsReadingAndStopsThroughAndTheRestWhenItIsAllowed) {
  using runtime::RemoteCommand;
  const auto off = remote_gate({.command = RemoteCommand::kOff}, {});
  EXPECT_TRUE(off("status", ControlEffect::kReads, {}));
  EXPECT_TRUE(off("estop", ControlEffect::kStops, {}));
  const Status refused = off("clock.pause", ControlEffect::kChanges, {});
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().hint.find("[remote] command"), std::string::npos);
  for (const RemoteCommand command : {RemoteCommand::kLocal, RemoteCommand::kNetwork}) {
    EXPECT_TRUE(remote_gate({.command = command}, {})("clock.pause", ControlEffect::kChanges, {}));
  }
}

// Another user of the machine had a library of theirs loaded, and its constructor ran as root.
TEST(RemoteGate, LetsNoCodeInUnlessAskedForAndThenByNameOnly) {
  const auto error = [](bool load, const Json& request) {
    const auto gate = remote_gate({.command = runtime::RemoteCommand::kLocal, .load = load}, {});
    const Status status = gate("controller.load", ControlEffect::kChanges, request);
    return status ? "" : status.error().message;
  };
  EXPECT_EQ(error(false, {{"plugin", "hold"}}),
            "controller.load: this process loads no code over DDS");
  EXPECT_EQ(error(true, {{"plugin", "hold"}}), "");
  for (const char* path : {"/tmp/x.so", "./x.so", "a/hold", "../hold"}) {
    EXPECT_EQ(error(true, {{"plugin", path}}), "controller.load: a path is not taken over DDS");
  }
}

TEST(RemoteGate, RefusesChangesOfControllersAndJointsWhileSomebodyOwnsTheRobot) {
  std::string owner;
  const auto gate =
      remote_gate({.command = runtime::RemoteCommand::kLocal}, [&owner] { return owner; });
  EXPECT_TRUE(gate("controller.stop", ControlEffect::kChanges, {}));
  owner = "squat on robot-pc";
  for (const char* name : {"controller.stop", "joint.set", "joint.reset"}) {
    const Status refused = gate(name, ControlEffect::kChanges, {});
    ASSERT_FALSE(refused) << name;
    EXPECT_EQ(refused.error().message, name + ": 'squat on robot-pc' commands the robot"s);
  }
  EXPECT_TRUE(gate("controller.list", ControlEffect::kReads, {}));
  EXPECT_TRUE(gate("fault.reset", ControlEffect::kChanges, {}));
  EXPECT_TRUE(gate("estop", ControlEffect::kStops, {}));
}

/// A folder of its own for the default paths, and a client that speaks bytes.
struct Socket : ::testing::Test {
  Socket() {
    add_commands(registry);
    char name[] = "/tmp/tandem-test-XXXXXX";
    folder = ::mkdtemp(name);
    ::setenv("XDG_RUNTIME_DIR", folder.c_str(), 1);
    path = folder + "/s.sock";
  }
  ~Socket() override { std::filesystem::remove_all(folder); }

  [[nodiscard]] std::unique_ptr<ControlSocket> open(const std::string& where) const {
    auto socket = ControlSocket::open(where, registry);
    EXPECT_TRUE(socket.has_value()) << socket.error().to_string();
    return socket ? std::move(*socket) : nullptr;
  }
  [[nodiscard]] std::string refusal(const std::string& where) const {
    const auto socket = ControlSocket::open(where, registry);
    EXPECT_FALSE(socket.has_value());
    return socket ? "" : socket.error().to_string();
  }
  [[nodiscard]] int connect() const {
    const int fd = ::socket(AF_UNIX, SOCK_STREAM, 0);
    const auto address = control_address(path);
    EXPECT_EQ(::connect(fd, reinterpret_cast<const sockaddr*>(&*address), sizeof *address), 0);
    return fd;
  }
  static void send(int fd, const std::string& text) {
    ASSERT_EQ(::send(fd, text.data(), text.size(), MSG_NOSIGNAL),
              static_cast<ssize_t>(text.size()));
  }
  /// Up to the end of the next line, or of the connection.
  static std::string line(int fd) {
    std::string text;
    char byte = 0;
    while (!text.ends_with('\n') && ::recv(fd, &byte, 1, 0) == 1) text += byte;
    return text;
  }
  /// True when the other end has closed; unread answers are thrown away.
  static bool closed(int fd) {
    char bytes[4096];
    ssize_t count = 0;
    do count = ::recv(fd, bytes, sizeof bytes, 0);
    while (count > 0);
    return count == 0 || errno == ECONNRESET;
  }

  ControlRegistry registry;
  std::string folder, path;
};

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

TEST_F(Socket, IsTheUsersAloneAndGoesWithItsProcess) {
  struct stat found {};
  const std::string own = default_control_path("run");
  {
    const auto socket = open(own);
    ASSERT_EQ(::stat(own.c_str(), &found), 0);
    EXPECT_EQ(found.st_mode & 0777, 0600U);
    ASSERT_EQ(::stat(control_folder().c_str(), &found), 0);
    EXPECT_EQ(found.st_mode & 0777, 0700U);
  }
  EXPECT_NE(::stat(own.c_str(), &found), 0);
  ASSERT_EQ(::chmod(control_folder().c_str(), 0755), 0);
  EXPECT_NE(refusal(own).find("no folder of this user alone"), std::string::npos);
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
  EXPECT_TRUE(closed(clients[1]));
  send(clients.front(), "{\"do\": \"help\"}\n");
  EXPECT_NE(line(clients.front()), "");
  for (const int fd : clients) ::close(fd);
}

// A client that had waited in vain for a suspended process saw the joint move once it went on.
TEST_F(Socket, DropsWhatAClientAskedForThatHasGone) {
  std::atomic<bool> at_work{false}, released{false};
  std::atomic<int> moved{0};
  registry.add("stop", ControlEffect::kStops, "takes its time", {},
               [&](const Json&) -> Result<Json> {
                 at_work = true;
                 while (!released) std::this_thread::yield();
                 return Json{{"text", "stop"}};
               });
  registry.add("move", ControlEffect::kChanges, "moves", {}, [&](const Json&) -> Result<Json> {
    ++moved;
    return Json{{"text", "move"}};
  });
  const auto socket = open(path);
  const int busy = connect();
  send(busy, "{\"do\": \"stop\"}\n");
  while (!at_work) std::this_thread::yield();  // the socket's own thread: it reads nothing now
  const int gone = connect();
  send(gone, "{\"do\": \"move\"}\n{\"do\": \"move\"}\n");
  ::close(gone);
  const int stays = connect();
  send(stays, "{\"do\": \"move\"}\n");
  ::shutdown(stays, SHUT_WR);  // as `nc -N` does: it still reads
  released = true;
  EXPECT_EQ(line(stays), "{\"ok\":true,\"text\":\"move\"}\n");
  EXPECT_EQ(line(busy), "{\"ok\":true,\"text\":\"stop\"}\n");
  EXPECT_TRUE(ask(path, {{"do", "help"}}).has_value());  // after all that came before
  EXPECT_EQ(moved, 1);
  ::close(stays);
  ::close(busy);
}

TEST_F(Socket, StopsWhileAnotherCommandIsAtWorkAndManyHaveGone) {
  std::atomic<bool> at_work{false}, stopped{false};
  std::atomic<int> begun{0};
  registry.add("begin", ControlEffect::kChanges, "begins", {}, [&](const Json&) -> Result<Json> {
    ++begun;
    return Json{};
  });
  registry.add("slow", ControlEffect::kChanges, "ends after a stop", {},
               [&](const Json&) -> Result<Json> {
                 at_work = true;
                 while (!stopped) std::this_thread::yield();
                 return Json{{"text", "slow"}};
               });
  registry.add("stop", ControlEffect::kStops, "stops", {}, [&](const Json&) -> Result<Json> {
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

TEST_F(Socket, ReplacesTheFileOfADeadProcessAndNothingElse) {
  const int dead = ::socket(AF_UNIX, SOCK_STREAM, 0);
  const auto address = control_address(path);
  ASSERT_EQ(::bind(dead, reinterpret_cast<const sockaddr*>(&*address), sizeof *address), 0);
  ::close(dead);
  EXPECT_FALSE(ask(path, {{"do", "help"}}).has_value());
  const auto socket = open(path);
  EXPECT_TRUE(ask(path, {{"do", "help"}}).has_value());
  EXPECT_NE(refusal(path).find("another process listens"), std::string::npos);
  EXPECT_TRUE(ask(path, {{"do", "help"}}).has_value());  // and it still does

  std::ofstream(folder + "/file") << "precious";
  EXPECT_NE(refusal(folder + "/file").find("no socket"), std::string::npos);
  EXPECT_EQ(std::filesystem::file_size(folder + "/file"), 8U);
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

TEST_F(Socket, RefusesPathsThatCannotBe) {
  EXPECT_NE(refusal(folder + "/" + std::string(100, 'x')).find("107 are possible"),
            std::string::npos);
  EXPECT_NE(refusal(folder + "/none/s.sock").find("cannot listen"), std::string::npos);
  EXPECT_NE(refusal("").find("path is empty"), std::string::npos);
}

TEST_F(Socket, IsAConditionWhereARobotMoves) {
  std::filesystem::create_directory(control_folder());
  ASSERT_EQ(::chmod(control_folder().c_str(), 0755), 0);
  const auto simulated = serve(registry, {.path = {}, .kind = "run"});
  ASSERT_TRUE(simulated.has_value());
  EXPECT_EQ(*simulated, nullptr);
  const auto robot = serve(registry, {.path = {}, .kind = "run", .needed = true});
  ASSERT_FALSE(robot.has_value());
  EXPECT_EQ(robot.error().message.find("`tandem estop` would not reach this robot: "), 0U);
  const std::string nowhere = folder + "/none/s.sock";
  const auto named = serve(registry, {.path = nowhere, .kind = "run", .needed = true});
  ASSERT_FALSE(named.has_value());
  EXPECT_EQ(named.error().message.find("`tandem estop` would not reach this robot: cannot listen"),
            0U);
}

TEST_F(Socket, IsFoundWhenItIsTheOnlyOne) {
  EXPECT_NE(find_control_socket("", "run").error().message.find("no running `tandem run`"),
            std::string::npos);
  const auto one = open(default_control_path("run"));
  const auto other = open(control_folder() + "/emulate-7.sock");
  EXPECT_EQ(find_control_socket("", "run").value_or(""), one->path());
  EXPECT_EQ(find_control_socket("/a/path", "run").value_or(""), "/a/path");
  const auto both = find_control_socket("", "");
  ASSERT_FALSE(both.has_value());
  EXPECT_NE(both.error().message.find("2 running"), std::string::npos);
  EXPECT_NE(both.error().hint.find(other->path()), std::string::npos);
}

TEST_F(Socket, OfADeadProcessIsRemovedByWhoLooks) {
  { const auto makes_the_folder = open(default_control_path("run")); }
  path = control_folder() + "/run-999999999.sock";  // beyond the greatest process id
  const int dead = ::socket(AF_UNIX, SOCK_STREAM, 0);
  const auto address = control_address(path);
  ASSERT_EQ(::bind(dead, reinterpret_cast<const sockaddr*>(&*address), sizeof *address), 0);
  ::close(dead);
  EXPECT_TRUE(running_control_sockets("run").empty());
  EXPECT_FALSE(std::filesystem::exists(path));
}

/// Runs `work` as user `uid` in a process of its own.  @return what `work` returned, -1 on failure
int as_user(uid_t uid, const std::function<int()>& work) {
  const pid_t child = ::fork();
  if (child == 0)
    ::_exit(::setresgid(uid, uid, uid) == 0 && ::setresuid(uid, uid, uid) == 0 ? work() : 111);
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

/// A stranger who listens where a run of this user would, and says "ok" to everything.
struct Impostor : Socket {
  static constexpr uid_t kStranger = 65534, kVictim = 65533;
  void SetUp() override {
    if (::geteuid() != 0) GTEST_SKIP() << "only root can act as two users";
    ASSERT_EQ(::chmod(folder.c_str(), 01777), 0);
  }
  void TearDown() override {
    if (child > 0) {
      ::kill(child, SIGKILL);
      ::waitpid(child, nullptr, 0);
    }
  }
  void listen_as_stranger(const std::string& where) {
    child = ::fork();
    if (child == 0) {
      (void)!::setresuid(kStranger, kStranger, kStranger);
      std::filesystem::create_directories(std::filesystem::path(where).parent_path());
      ::chmod(std::filesystem::path(where).parent_path().c_str(), 0755);
      const int fd = ::socket(AF_UNIX, SOCK_STREAM, 0);
      const auto address = control_address(where);
      (void)!::bind(fd, reinterpret_cast<const sockaddr*>(&*address), sizeof *address);
      ::chmod(where.c_str(), 0777);
      ::listen(fd, 4);
      for (;;) {
        const int client = ::accept(fd, nullptr, nullptr);
        static const char kAnswer[] = "{\"ok\": true}\n";
        char question[4096];
        (void)!::recv(client, question, sizeof question, 0);
        (void)!::send(client, kAnswer, sizeof kAnswer - 1, MSG_NOSIGNAL);
        ::close(client);
      }
    }
    while (!control_socket_alive(where)) std::this_thread::yield();
  }
  pid_t child = 0;
};

// `tandem estop` had told this one of it, printed success and returned 0.
TEST_F(Impostor, IsNotToldOfAnEmergencyStop) {
  const std::string where = control_folder() + "/run-1.sock";
  listen_as_stranger(where);
  const auto found = find_control_socket("", "run");
  ASSERT_FALSE(found.has_value());
  EXPECT_NE(found.error().message.find("its owner is user 65534"), std::string::npos)
      << found.error().message;
  EXPECT_EQ(as_user(kVictim, [&] { return ask(where, {{"do", "estop"}}).has_value() ? 1 : 0; }), 0);
  EXPECT_EQ(as_user(kStranger, [&] { return ask(where, {{"do", "x"}}).has_value() ? 0 : 1; }), 0);
}

TEST_F(Impostor, CannotTakeTheFolderOfARunToCome) {
  listen_as_stranger(control_folder() + "/run-1.sock");
  EXPECT_NE(refusal(default_control_path("run")).find("no folder of this user alone"),
            std::string::npos);
}

// Neither end uses a socket that somebody else could have put there, or could replace.
TEST_F(Socket, LiesInNoFolderThatOthersMayChange) {
  const std::string open_folder = folder + "/open", inner = open_folder + "/inner";
  std::filesystem::create_directories(inner);
  const std::string where = open_folder + "/s.sock";
  const auto served = open(where);
  ASSERT_EQ(::chmod(open_folder.c_str(), 0777), 0);
  const std::string named =
      "the socket's folder " + open_folder + " may be changed by everybody (its mode is 777): ";
  const auto told = ask(where, {{"do", "help"}});
  ASSERT_FALSE(told.has_value());
  EXPECT_EQ(told.error().message.find(named), 0U) << told.error().to_string();
  for (const std::string& path : {open_folder + "/t.sock", inner + "/t.sock"}) {
    EXPECT_EQ(refusal(path).find(named), 0U) << refusal(path);
    EXPECT_NE(refusal(path).find("chmod go-w " + open_folder +
                                 "; or choose another folder with "
                                 "--socket"),
              std::string::npos);
  }
  const auto simulated = serve(registry, {.path = open_folder + "/t.sock", .kind = "run"});
  ASSERT_FALSE(simulated.has_value()) << "a run goes on without a socket only by --no-socket";
  ASSERT_EQ(::chmod(open_folder.c_str(), 01777), 0);  // as /tmp
  EXPECT_TRUE(ask(where, {{"do", "help"}}).has_value());
  EXPECT_NE(open(open_folder + "/t.sock"), nullptr);
}

// It was a note, and `tandem estop --socket` of the same path reached nobody.
TEST_F(Socket, ThatIsNamedAndCannotBeMadeIsAnError) {
  const std::string long_name = folder + "/" + std::string(120, 'x') + ".sock";
  for (const std::string& named : {long_name, folder}) {
    const auto socket = serve(registry, {.path = named, .kind = "run"});
    ASSERT_FALSE(socket.has_value()) << named;
    EXPECT_NE(socket.error().to_string().find("--socket"), std::string::npos)
        << socket.error().to_string();
  }
  const auto none = serve(registry, {.path = long_name, .kind = "run", .wanted = false});
  ASSERT_TRUE(none.has_value());
  EXPECT_EQ(*none, nullptr);
}

TEST_F(Socket, LiesInNoFolderOfAnotherUserOrGroup) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can give a folder away";
  const std::string theirs = folder + "/theirs";
  std::filesystem::create_directory(theirs);
  ASSERT_EQ(::chown(theirs.c_str(), 65534, 0), 0);
  EXPECT_NE(refusal(theirs + "/s.sock").find("belongs to user 65534"), std::string::npos);
  ASSERT_EQ(::chmod(theirs.c_str(), 01755), 0);
  EXPECT_NE(refusal(theirs + "/s.sock").find("belongs to user 65534"), std::string::npos);
  ASSERT_EQ(::chown(theirs.c_str(), 0, 65534), 0);
  ASSERT_EQ(::chmod(theirs.c_str(), 0775), 0);
  EXPECT_NE(refusal(theirs + "/s.sock").find("may be changed by group 65534 (its mode is 775)"),
            std::string::npos);
  ASSERT_EQ(::chown(theirs.c_str(), 0, 0), 0);
  EXPECT_NE(open(theirs + "/s.sock"), nullptr) << "this user's own group may";
}

// `sudo tandem estop --socket` of a user's run.
TEST_F(Impostor, IsNobodyWhomRootNamesInTheFolderOfItsOwner) {
  const std::string where = folder + "/of/s.sock";
  listen_as_stranger(where);
  EXPECT_TRUE(ask(where, {{"do", "estop"}}).has_value());
  ASSERT_EQ(::chmod((folder + "/of").c_str(), 0777), 0);
  EXPECT_FALSE(ask(where, {{"do", "estop"}}).has_value());
}

TEST_F(Impostor, FindsTheSocketOfARunShut) {
  const auto mine = open(path);
  ASSERT_EQ(::chmod(path.c_str(), 0777), 0);  // as if its mode did not hold
  const auto estop = [&] { return ask(path, {{"do", "help"}}).has_value() ? 1 : 0; };
  EXPECT_EQ(as_user(kStranger, estop), 0);
  EXPECT_TRUE(ask(path, {{"do", "help"}}).has_value());
}

}  // namespace
}  // namespace tandem::apps
