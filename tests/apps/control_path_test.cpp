// Where control sockets lie: who may change the folder, stale files, and other users' sockets.
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <thread>

#include "apps/clients/control_client.hpp"
#include "tests/apps/socket_fixture.hpp"
#include "tests/support/needs_root.hpp"

namespace tandem::apps {
namespace {

using test::Socket;

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

/// The environment of another shell, service or cron job.
struct OtherSurroundings : Socket {
  OtherSurroundings() {
    ::unsetenv("TANDEM_SOCKETS");
    in("one");
  }
  ~OtherSurroundings() override { ::unsetenv("XDG_RUNTIME_DIR"); }
  void in(const std::string& name) const {
    std::filesystem::create_directory(folder + "/" + name);
    ::setenv("XDG_RUNTIME_DIR", (folder + "/" + name).c_str(), 1);
  }
  static bool finds(const std::string& socket) {
    const auto found = find_control_sockets("run");
    return found && std::ranges::find(*found, socket) != found->end();
  }
};

// `tandem estop` said that there was nobody, or stopped one run and returned 0, while another run
// of the same user moved its robot.
TEST_F(OtherSurroundings, DoNotHideARun) {
  const auto first = open(default_control_path("run"));
  EXPECT_EQ(first->path(), folder + "/one/tandem/run-" + std::to_string(::getpid()) + ".sock");
  EXPECT_TRUE(finds(first->path()));
  in("two");
  EXPECT_TRUE(finds(first->path()));
  ::unsetenv("XDG_RUNTIME_DIR");
  EXPECT_TRUE(finds(first->path()));
  ::setenv("XDG_RUNTIME_DIR", (folder + "/none").c_str(), 1);
  EXPECT_TRUE(finds(first->path()));
}

// Also where there is no /proc.
TEST_F(OtherSurroundings, AreLookedThroughInEveryUsualPlace) {
  const std::string user = std::to_string(::geteuid());
  const std::vector<std::string> all{folder + "/one/tandem", "/run/user/" + user + "/tandem",
                                     "/tmp/tandem-" + user, "/run/tandem/tandem"};
  EXPECT_EQ(control_folders(), all);
  ::unsetenv("XDG_RUNTIME_DIR");
  EXPECT_EQ(control_folders().front(), all[2]);
  EXPECT_EQ(control_folders().size(), 3U) << "each once";
}

TEST_F(OtherSurroundings, GiveTheSameSocketTwoPathsAndItIsAskedOnce) {
  const auto first = open(default_control_path("run"));
  std::filesystem::create_directory_symlink(folder + "/one", folder + "/link");
  ::setenv("XDG_RUNTIME_DIR", (folder + "/link").c_str(), 1);
  const auto found = find_control_sockets("run").value_or(std::vector<std::string>{});
  EXPECT_EQ(std::ranges::count_if(
                found, [this](const std::string& one) { return one.starts_with(folder); }),
            1);
}

TEST(ListeningPaths, AreThoseOfSocketsThatAccept) {
  const std::string table =
      "Num       RefCount Protocol Flags    Type St Inode Path\n"
      "0000000000000000: 00000002 00000000 00010000 0001 01 17 /run/a b/run-1.sock\n"
      "0000000000000000: 00000003 00000000 00000000 0001 03 18 /run/connected.sock\n"
      "0000000000000000: 00000002 00000000 00010000 0001 01 19 @abstract\n"
      "0000000000000000: 00000002 00000000 00010000 0001 01 20 relative.sock\n"
      "0000000000000000: 00000002 00000000 00010000 0001 01 21\n"
      "nonsense\n";
  EXPECT_EQ(listening_paths(table), std::vector<std::string>{"/run/a b/run-1.sock"});
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
  for (const std::string& inside : {open_folder + "/t.sock", inner + "/t.sock"}) {
    EXPECT_EQ(refusal(inside).find(named), 0U) << refusal(inside);
    EXPECT_NE(refusal(inside).find("chmod go-w " + open_folder +
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
  if (::geteuid() != 0) GTEST_SKIP() << tandem::test::needs_root("to give a folder away");
  const std::string theirs = folder + "/theirs";
  std::filesystem::create_directory(theirs);
  ASSERT_EQ(::chown(theirs.c_str(), 65534, 0), 0);
  EXPECT_NE(refusal(theirs + "/s.sock").find("belongs to user 65534"), std::string::npos);
  ASSERT_EQ(::chmod(theirs.c_str(), 01755), 0);
  EXPECT_NE(refusal(theirs + "/s.sock").find("belongs to user 65534"), std::string::npos);
  ASSERT_EQ(::chown(theirs.c_str(), 0, 65534), 0);
  ASSERT_EQ(::chmod(theirs.c_str(), 0775), 0);
  EXPECT_NE(refusal(theirs + "/s.sock").find("may be changed by group 65534: "), std::string::npos);
  ASSERT_EQ(::chown(theirs.c_str(), 0, 0), 0);
  EXPECT_NE(open(theirs + "/s.sock"), nullptr) << "this user's own group may";
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
    if (::geteuid() != 0) GTEST_SKIP() << tandem::test::needs_root("to act as two users");
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

// `sudo tandem estop --socket` of a user's run.
TEST_F(Impostor, IsNobodyWhomRootNamesInTheFolderOfItsOwner) {
  const std::string where = folder + "/of/s.sock";
  listen_as_stranger(where);
  EXPECT_TRUE(ask(where, {{"do", "estop"}}).has_value());
  ASSERT_EQ(::chmod((folder + "/of").c_str(), 0777), 0);
  EXPECT_FALSE(ask(where, {{"do", "estop"}}).has_value());
}

// "is the process running?"
TEST_F(Impostor, IsToldWhoseTheSocketIs) {
  const auto mine = open(path);
  ASSERT_EQ(::chmod(folder.c_str(), 0755), 0);
  const auto told = [&] {
    const auto answer = ask(path, {{"do", "help"}});
    const bool said =
        !answer && answer.error().message.find("is another user's") != std::string::npos;
    return said ? 1 : 0;
  };
  EXPECT_EQ(as_user(kStranger, told), 1);
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
