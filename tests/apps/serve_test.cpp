// `tandem serve` and `tandem run --hal dds` as two processes: the same bits as one, and what
// follows when one of them is killed.
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <thread>
#include <vector>

#include "apps/transport/control_path.hpp"
#include "tests/apps/background.hpp"
#include "tests/apps/program.hpp"
#include "tests/support/dds_domain.hpp"
#include "tests/support/needs_root.hpp"

namespace tandem::apps {
namespace {

class Serve : public Program {
 protected:
  [[nodiscard]] static std::string domain() {
    return " --domain " + std::to_string(dds::test::own_domain());
  }
  [[nodiscard]] static std::string coman() {
    return shell_word(TANDEM_SOURCE_DIR "/config/coman/squat.toml");
  }

  void TearDown() override {
    programs_.clear();
    Program::TearDown();
  }

  /// Starts `tandem ARGUMENTS` in the background, until the test is over; its process id.
  pid_t begin(const std::string& arguments, const std::string& name) {
    return programs_.emplace_back(folder_, arguments, name).id();
  }
  static bool eventually(const std::function<bool()>& condition) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (std::chrono::steady_clock::now() < end) {
      if (condition()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    return condition();
  }
  /// Until the process has ended.
  bool ended(pid_t process) {
    const auto one = std::ranges::find(programs_, process, &Background::id);
    return one != programs_.end() && eventually([&] { return one->ended(); });
  }
  [[nodiscard]] nlohmann::json ask(const std::string& socket, const std::string& what) const {
    const Outcome outcome = tandem("ask '{\"do\": \"" + what + "\"}' --socket " + socket);
    return nlohmann::json::parse(outcome.out, nullptr, false);
  }

  /// The logs of an experiment in one process, and over DDS in lockstep: all but what controllers
  /// tell, who are in the owner's process.
  void compare(const std::string& experiment, const std::string& arguments) {
    const Outcome alone = tandem("run " + experiment + arguments + " --quiet --json alone.json");
    ASSERT_EQ(alone.status, 0) << alone.err;
    const pid_t server =
        begin("serve " + experiment + domain() + " --lockstep --once --quiet --json served.json",
              "serve");
    const Outcome owner = tandem("run " + experiment + domain() + arguments +
                                 " --hal dds --lockstep --no-log --no-socket --quiet");
    EXPECT_EQ(owner.status, 0) << owner.err;
    ASSERT_TRUE(ended(server));
    const auto here = json("alone.json"), there = json("served.json");
    const Outcome same = tandem("log diff " + here["log"]["path"].get<std::string>() + " " +
                                there["log"]["path"].get<std::string>());
    EXPECT_EQ(same.status, 0) << same.out;
    EXPECT_NE(same.out.find("the same, bit for bit"), std::string::npos) << same.out;
    EXPECT_GT(there["remote"]["commands"]["taken"].get<int>(), 1000);
    EXPECT_EQ(there["log"]["dropped"], 0);
  }

  std::vector<Background> programs_;
};

/// Whether it is there, and is no zombie that nobody has waited for.
bool is_running(pid_t process) {
  const std::string stat = read_text("/proc/" + std::to_string(process) + "/stat");
  return !stat.empty() && !stat.contains(") Z ");
}

// Servers of tests that failed stayed behind.
TEST_F(Serve, InTheBackgroundEndsWithItsTestHoweverThatEnds) {
  const std::string serve = "serve trajectory.toml" + domain() + " --no-log --quiet --no-socket";
  const std::string trusting = "\n[remote]\ntrust = \"domain\"\n";
  std::ofstream(folder_ / "trajectory.toml", std::ios::app) << trusting;
  pid_t left = 0;
  {
    Background server(folder_, serve, "left");
    left = server.id();
    EXPECT_TRUE(is_running(left));
  }
  EXPECT_FALSE(is_running(left));
  const pid_t killed = ::fork();
  if (killed == 0) {
    const Background server(folder_, serve, "killed");
    std::ofstream(folder_ / "pid") << server.id() << std::endl;
    ::raise(SIGKILL);
  }
  ::waitpid(killed, nullptr, 0);
  left = std::stoi(read_text(folder_ / "pid"));
  EXPECT_TRUE(eventually([left] { return !is_running(left); }));
}

TEST_F(Serve, InLockstepGivesTheBitsOfOneProcess) { compare("trajectory.toml", " --duration 2"); }

TEST_F(Serve, InLockstepWithADelayGivesTheBitsOfOneDelayedProcess) {
  compare("trajectory.toml", " --duration 2 --delay-cycles 2");
}

TEST_F(Serve, OfASquatInLockstepGivesTheBitsOfOneProcess) { compare(coman(), " --duration 0.5"); }

/// A robot of another process, and its exact twin in the owner's: also in the last cycle, after
/// which the server goes on without an owner.
TEST_F(Serve, OfATwinIsTheSameToTheLastBit) {
  const std::string twin = shell_word(TANDEM_SOURCE_DIR "/config/coman/squat_twin.toml");
  for (int repeat = 0; repeat < 4; ++repeat) {
    const pid_t server =
        begin("serve " + twin + domain() + " --lockstep --once --quiet --no-log", "serve");
    const Outcome owner =
        tandem("run " + twin + domain() +
               " --duration 0.1 --hal dds --lockstep --no-log --no-socket --quiet --json run.json");
    EXPECT_EQ(owner.status, 0) << owner.err;
    EXPECT_TRUE(ended(server));
    const auto parallel = json("run.json")["parallel"];
    EXPECT_EQ(parallel["unequal"], 0) << "first in cycle " << parallel["first_unequal"];
    EXPECT_GT(parallel["compared"].get<int>(), 1000) << "bring-up included";
  }
}

/// The domain is every user's of this machine; the robot is not.
TEST_F(Serve, AnotherUserOfTheMachineMovesNothing) {
  const std::string other = "setpriv --reuid 65534 --regid 65534 --clear-groups";
  if (::geteuid() != 0 || tandem("--version", other).status != 0) {
    GTEST_SKIP() << test::needs_root("setpriv, and a folder that others may read");
  }
  const pid_t server = begin("serve trajectory.toml" + domain() + " --no-log --quiet", "serve");
  const std::string socket = control_folder() + "/run-" + std::to_string(server) + ".sock";
  ASSERT_TRUE(eventually([&] { return ask(socket, "status").is_object(); }));
  const Outcome owner =
      tandem("run trajectory.toml" + domain() + " --hal dds --no-log --quiet --no-socket", other);
  EXPECT_EQ(owner.status, 2) << owner.out;
  EXPECT_NE(owner.err.find("the server gave no lease"), std::string::npos) << owner.err;
  for (const char* command :
       {"joint set joint1 --mode idle", "fault reset", "ask '{\"do\": \"run.stop\"}'"}) {
    const Outcome refused = tandem(std::string(command) + " --dds" + domain(), other);
    EXPECT_EQ(refused.status, 2) << command << refused.out;
    EXPECT_NE(refused.err.find("takes no commands from a stranger"), std::string::npos)
        << command << ": " << refused.err;
  }
  const Outcome socket_of_ours = tandem("estop --socket " + socket, other);
  EXPECT_NE(socket_of_ours.status, 0) << "the folder is closed to others";
  EXPECT_EQ(ask(socket, "status").value("phase", ""), "running");
  const Outcome stop = tandem("estop --dds" + domain(), other);
  EXPECT_EQ(stop.status, 1) << "nobody vouches to that user for who confirms";
  EXPECT_NE(stop.err.find("the stop was sent"), std::string::npos) << stop.err;
  EXPECT_EQ(ask(socket, "status").value("phase", ""), "faulted") << "everybody may stop a robot";
  ASSERT_EQ(::kill(server, SIGTERM), 0);
  EXPECT_TRUE(ended(server));
}

TEST_F(Serve, WithoutASocketNobodyCouldBeAdmitted) {
  const Outcome outcome = tandem("serve trajectory.toml --no-socket --no-log");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("no process can be admitted to this robot (leave out --no-socket"),
            std::string::npos)
      << outcome.err;
}

TEST_F(Serve, AnOwnerThatIsKilledLeavesTheDeclaredReaction) {
  std::ofstream(folder_ / "trajectory.toml", std::ios::app)
      << "\n[remote]\ncommand = \"local\"\non_lost = \"category1\"\nmax_age_cycles = 200\n";
  const pid_t server =
      begin("serve trajectory.toml" + domain() + " --realtime --no-log --quiet", "serve");
  const std::string socket = control_folder() + "/run-" + std::to_string(server) + ".sock";
  const pid_t owner = begin("run trajectory.toml" + domain() + " --hal dds --no-log --quiet " +
                                "--duration 600 --socket ./o.sock",
                            "owner");
  ASSERT_TRUE(eventually([&] {
    const auto status = ask("./o.sock", "status");
    return status.is_object() && status.value("phase", "") == "running";
  })) << read_text(folder_ / "owner.err");
  ASSERT_EQ(::kill(owner, SIGKILL), 0);
  nlohmann::json faults;
  EXPECT_TRUE(eventually([&] {
    faults = ask(socket, "fault.show");
    return faults.is_object() && faults.value("phase", "") == "faulted";
  }));
  EXPECT_NE(faults.dump().find("the remote owner's commands stopped"), std::string::npos)
      << faults.dump();
  ASSERT_EQ(::kill(server, SIGTERM), 0);
  EXPECT_TRUE(ended(server));
}

TEST_F(Serve, AServerThatIsKilledEndsItsOwnerInAFault) {
  const pid_t server =
      begin("serve trajectory.toml" + domain() + " --realtime --no-log --quiet", "serve");
  const pid_t owner = begin("run trajectory.toml" + domain() + " --hal dds --no-log --quiet " +
                                "--duration 600 --socket ./o.sock",
                            "owner");
  ASSERT_TRUE(eventually([&] {
    const auto status = ask("./o.sock", "status");
    return status.is_object() && status.value("phase", "") == "running";
  })) << read_text(folder_ / "owner.err");
  ASSERT_EQ(::kill(server, SIGKILL), 0);
  EXPECT_TRUE(ended(owner));
  EXPECT_NE(read_text(folder_ / "owner.err").find("no message from the server for"),
            std::string::npos)
      << read_text(folder_ / "owner.err");
}

}  // namespace
}  // namespace tandem::apps
