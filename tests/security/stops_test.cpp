// Stops under attack: by strangers who answer in a run's place, who ask more than anybody reads,
// who take its names and ports; and ends of a run that nobody meant as one.
#include <fcntl.h>
#include <fmt/core.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include "apps/clients/control_client.hpp"
#include "apps/transport/dds_services.hpp"
#include "base/quoting.hpp"
#include "dds/service_client.hpp"
#include "tests/apps/background.hpp"
#include "tests/apps/program.hpp"
#include "tests/support/dds_domain.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/needs_root.hpp"
#include "tests/support/socket_path.hpp"

namespace tandem::apps {
namespace {

using namespace dds::tandem_msgs;
using tandem::test::eventually;

/// Serves tandem/ask, tandem/stop and tandem/emergency_stop, and confirms every stop.
struct Liar {
  explicit Liar(dds::Participant& participant) {
    registry.add({"estop",
                  ControlEffect::kStops,
                  "stops nothing",
                  {{.name = "category", .type = ControlKey::Type::kInteger, .doc = "0 to 2"}}},
                 [this](const Json&) -> Result<Json> {
                   ++asked;
                   return Json{{"category", "category1"}, {"confirmed", true}, {"cycle", 1}};
                 });
    auto opened = DdsServices::open(participant, registry, {}, admission);
    EXPECT_TRUE(opened) << opened.error().to_string();
    if (opened) services = std::move(*opened);
  }
  std::atomic<int> asked = 0;
  ControlRegistry registry;
  DdsAdmission admission{true};
  std::unique_ptr<DdsServices> services;
};

/// A run with its socket in the default place of a folder of the test's own.
class StopUnderAttack : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    char name[] = "/tmp/tandem-stops-XXXXXX";
    runtime_ = ::mkdtemp(name);
    ::setenv("TANDEM_SOCKETS", (runtime_ + "/tandem").c_str(), 1);
  }
  void TearDown() override {
    if (run_ && !run_->ended()) {  // killed it would stay in the domain for a while
      for (const int number : {SIGCONT, SIGTERM}) (void)::kill(run_->id(), number);
      (void)eventually([&] { return run_->ended(); });
    }
    run_.reset();
    std::filesystem::remove_all(runtime_);
    Program::TearDown();
  }
  [[nodiscard]] static std::string domain() {
    return " --domain " + std::to_string(dds::test::own_domain());
  }
  /// `tandem run hold.toml FLAGS`, until its controllers run.
  void begin(const std::string& flags, const std::string& phase = "running") {
    run_.emplace(
        folder_,
        "run hold.toml --no-log -q --on-fault wait --duration 2000 --json run.json " + flags,
        "run");
    EXPECT_TRUE(eventually([&] { return status().value("phase", "") == phase; }))
        << read_text(folder_ / "run.err");
  }
  [[nodiscard]] nlohmann::json ask(const std::string& question) const {
    return nlohmann::json::parse(tandem("ask '" + question + "'").out, nullptr, false);
  }
  [[nodiscard]] nlohmann::json status() const {
    const auto answer = ask(R"({"do": "status"})");
    return answer.is_object() ? answer : nlohmann::json::object();
  }
  void signal(int number) const { ASSERT_EQ(::kill(run_->id(), number), 0); }
  /// The run's exit status, soon.
  [[nodiscard]] int ended() {
    EXPECT_TRUE(eventually([&] { return run_->ended(); }));
    return run_->status().value_or(-1);
  }
  /// Beside others, which have files of their own for what is printed.
  [[nodiscard]] int tandem_in_shell(const std::string& arguments) const {
    const std::string program = shell_word(TANDEM_BINARY_DIR "/bin/tandem");
    return std::system(
        ("cd " + shell_word(folder_.string()) + " && " + program + " " + arguments).c_str());
  }
  [[nodiscard]] Outcome stop_over_dds(const std::string& flags = {}) const {
    return tandem("estop --dds" + domain() + " " + flags);
  }

  std::string runtime_;
  std::optional<Background> run_;
};

std::unique_ptr<dds::Participant> join(const std::string& node) {
  static const auto domain = dds::Domain::open(dds::test::own_config());
  EXPECT_TRUE(domain) << domain.error().to_string();
  auto joined = dds::Participant::open(*domain, node);
  EXPECT_TRUE(joined) << joined.error().to_string();
  return std::move(*joined);
}

bool has(const std::string& text, const std::string& words) {
  return text.find(words) != std::string::npos;
}

// Who answers.

TEST_F(StopUnderAttack, IsConfirmedOverDdsByTheRunThatItsSocketVouchesFor) {
  begin("--rate 20 --dds" + domain());
  const Outcome stop = stop_over_dds();
  EXPECT_EQ(stop.status, 0) << stop.err;
  EXPECT_TRUE(has(stop.out, "emergency stop, category 1")) << stop.out;
  EXPECT_EQ(status().value("phase", ""), "faulted");
}

// It printed "tandem_run (process …): emergency stop, category 1", with status 0; the run went on.
TEST_F(StopUnderAttack, IsNotConfirmedByAStrangerWhileTheRunIsSuspended) {
  begin("--rate 20 --dds" + domain());
  signal(SIGSTOP);
  const auto participant = join("tandem_run");
  Liar liar(*participant);
  const Outcome stop = stop_over_dds();
  EXPECT_GE(liar.asked, 1);
  EXPECT_EQ(stop.status, 1) << stop.out;
  EXPECT_EQ(stop.out, "");
  EXPECT_TRUE(has(stop.err, "the stop was sent, and participant " +
                                dds::to_text(dds::id_of(*participant)) + " says"))
      << stop.err;
  EXPECT_TRUE(has(stop.err, "press its emergency stop or cut its power")) << stop.err;
  EXPECT_TRUE(has(stop.err, "does not answer: if it is in this domain, it is not stopped"))
      << stop.err;
  signal(SIGCONT);
}

TEST_F(StopUnderAttack, InADomainOfNobodyNamesTheRunThatIsOnThisMachine) {
  begin("--rate 20");
  const Outcome stop = stop_over_dds();
  EXPECT_EQ(stop.status, 1);
  EXPECT_TRUE(has(stop.err, "warning: tandem run hold.toml")) << stop.err;
  EXPECT_TRUE(has(stop.err, "is not stopped: tandem estop, without --dds")) << stop.err;
  EXPECT_EQ(status().value("phase", ""), "running");
}

TEST_F(StopUnderAttack, OfARunIsNoSuccessBesideAStrangerWhoConfirms) {
  begin("--rate 20 --dds" + domain());
  const auto participant = join("tandem_run");
  Liar liar(*participant);
  const Outcome stop = stop_over_dds();
  EXPECT_EQ(stop.status, 1);
  EXPECT_TRUE(has(stop.out, "emergency stop, category 1")) << "the run's: " << stop.out;
  EXPECT_TRUE(has(stop.err, "there is no proof")) << stop.err;
  EXPECT_EQ(status().value("phase", ""), "faulted");
}

TEST_F(StopUnderAttack, IsConfirmedByAnybodyWhereTheDomainIsTrusted) {
  const auto participant = join("another_robot");
  Liar liar(*participant);
  const Outcome stop = stop_over_dds("--trust-domain");
  EXPECT_EQ(stop.status, 0) << stop.err;
  EXPECT_TRUE(has(stop.out, "another_robot")) << stop.out;
}

// What is asked meanwhile.

/// Asks a service for an unknown command of 120 kB, so often.
void flood(int times, const std::string& service) {
  const auto participant = join("flooder");
  auto client = dds::ServiceClient<Ask_Request, Ask_Response>::create(*participant, service);
  ASSERT_TRUE(client) << client.error().to_string();
  std::string question = "{\"do\": \"" + std::string(120'000, 'x') + "\"}";
  for (int i = 0; i < times; ++i) {
    (void)client->call(Ask_Request{0, 0, question.data()}, std::chrono::milliseconds(100),
                       [](const Ask_Response&) {});
  }
}

// 160 such questions, and the stop got no answer.
TEST_F(StopUnderAttack, IsAnsweredOverDdsWhileStrangersAskLongQuestions) {
  begin("--rate 20 --dds" + domain());
  std::vector<std::thread> strangers;
  for (const char* service : {"tandem/ask", "tandem/stop"}) {
    for (int i = 0; i < 4; ++i) strangers.emplace_back([=] { flood(40, service); });
  }
  for (int i = 0; i < 3; ++i) {
    const Outcome stop = stop_over_dds();
    EXPECT_EQ(stop.status, 0) << stop.err;
  }
  for (std::thread& stranger : strangers) stranger.join();
  EXPECT_EQ(status().value("phase", ""), "faulted");
}

TEST_F(StopUnderAttack, HasAServiceForItselfThatTakesNothingElse) {
  begin("--rate 20 --dds" + domain());
  const auto participant = join("tester");
  auto client = dds::ServiceClient<Ask_Request, Ask_Response>::create(*participant, "tandem/stop");
  ASSERT_TRUE(client) << client.error().to_string();
  const auto answer = [&](std::string question) {
    nlohmann::json got;
    const Status asked = client->call(Ask_Request{0, 0, question.data()}, std::chrono::seconds(20),
                                      [&](const Ask_Response& reply) {
                                        got = nlohmann::json::parse(reply.answer, nullptr, false);
                                      });
    EXPECT_TRUE(asked) << asked.error().to_string();
    return got;
  };
  EXPECT_EQ(answer(R"({"do": "status"})")["error"], "tandem/stop takes emergency stops only");
  EXPECT_EQ(answer(R"({"do": "run.stop"})")["ok"], false);
  EXPECT_EQ(answer(std::string(5'000'000, ' '))["ok"], false);
  EXPECT_EQ(status().value("phase", ""), "running");
  EXPECT_EQ(answer(R"({"do": "estop", "category": 0})")["category"], "category0");
  EXPECT_EQ(status().value("phase", ""), "faulted");
}

// They held it up for 20 s.
TEST_F(StopUnderAttack, TheEndOfARunWaitsForNoParametersThatNobodyKnows) {
  begin("--rate 20");
  std::string keys;
  for (int i = 0; i < 25'000; ++i) keys += fmt::format("k{:05}=1\n", i);
  const Json question{
      {"do", "controller.load"}, {"plugin", "hold"}, {"name", "odd"}, {"parameters", keys}};
  const std::string socket = fmt::format("{}/tandem/run-{}.sock", runtime_, run_->id());
  std::thread load([&] { EXPECT_FALSE(tandem::apps::ask(socket, question)); });
  const Outcome end = tandem("ask '{\"do\": \"run.stop\"}'");
  EXPECT_EQ(end.status, 0) << "within 5 s: " << end.err;
  signal(SIGKILL);  // the run ends in order when it has read them
  load.join();
}

// Operators waited for it, 2 s each time.
TEST_F(StopUnderAttack, OperatorsWaitForNoPrediction) {
  begin("--start-paused", "bring-up");
  std::atomic<bool> predicted{false};
  std::thread predict([&] {
    (void)tandem_in_shell("predict >predict.txt 2>&1");
    predicted = true;
  });
  EXPECT_TRUE(eventually([&] { return std::filesystem::exists(folder_ / "predict.txt"); }));
  int answers = 0;
  while (!predicted) {
    if (status().contains("phase")) ++answers;
  }
  predict.join();
  EXPECT_TRUE(has(read_text(folder_ / "predict.txt"), "the run has made no cycle"))
      << read_text(folder_ / "predict.txt");
  EXPECT_GE(answers, 3) << "in 2 s";
}

// Its reset had come after the stop of its cycle: 300 cycles later every drive was enabled.
TEST_F(StopUnderAttack, WinsOverAResetOfItsCycle) {
  begin("--rate 20");
  EXPECT_EQ(tandem("estop").status, 0);
  EXPECT_EQ(tandem("clock pause").status, 0);
  EXPECT_TRUE(eventually([&] { return status().value("paused", false); }));
  EXPECT_EQ(ask(R"({"do": "fault.reset"})")["ok"], true);
  EXPECT_EQ(tandem("estop --category 0").status, 0);
  EXPECT_EQ(tandem("clock step 300").status, 0);
  EXPECT_TRUE(eventually([&] { return ask(R"({"do": "clock.show"})").value("standing", false); }));
  EXPECT_EQ(status()["phase"], "faulted");
  EXPECT_EQ(status()["latched"], 2);
  EXPECT_EQ(status()["failed_resets"], 1) << "whoever asked is told";
}

// How a run ends.

// They ended the process at once, and left the drives as they were.
TEST_F(StopUnderAttack, SignalsEndARunInOrderOrNotAtAll) {
  for (const int number : {SIGQUIT, SIGUSR2, SIGXCPU, SIGRTMIN + 3}) {
    begin("--rate 20");
    signal(number);
    EXPECT_EQ(ended(), 128 + number);
    EXPECT_TRUE(json("run.json").contains("cycles")) << "it has written its summary";
  }
  begin("--rate 20");
  for (const int number : {SIGALRM, SIGVTALRM, SIGPROF, SIGIO, SIGPIPE, SIGXFSZ}) signal(number);
  EXPECT_EQ(status().value("phase", ""), "running");
  signal(SIGTERM);
  EXPECT_EQ(ended(), 128 + SIGTERM);
}

// The thread that talks waited for a descriptor that was gone: neither SIGTERM nor anything but
// SIGKILL ended the run.
TEST_F(StopUnderAttack, AControllerThatClosesEveryDescriptorIsEnded) {
  edit("hold.toml", "plugin = \"hold\"",
       "plugin = \"" TANDEM_BINARY_DIR
       "/tests/test_plugins/hangs.so\"\n[controller.parameters]\ncrash = \"close\"");
  for (const char* flags : {"", "--dds"}) {
    SCOPED_TRACE(flags);
    run_.emplace(folder_,
                 "run hold.toml --no-log -q --rate 20 --duration 2000 " + std::string(flags) +
                     (*flags == '\0' ? "" : domain()),
                 "run");
    const std::string descriptors = fmt::format("/proc/{}/fd", run_->id());
    const auto closed = [&] {
      std::error_code error;
      int others = 0, all = 0;
      for (const auto& one : std::filesystem::directory_iterator(descriptors, error)) {
        ++all;
        if (std::stoi(one.path().filename().string()) > 2) ++others;
      }
      return all > 0 && others == 0;
    };
    ASSERT_TRUE(eventually(closed)) << read_text(folder_ / "run.err");
    signal(SIGTERM);
    for (int i = 0; i < 2 && !eventually([&] { return run_->ended(); }); ++i) {
    }  // the guard waits as long
    const int status = ended();
    EXPECT_TRUE(status == 128 + SIGTERM || status == 1) << status;
    run_.reset();
  }
}

/// Runs `tandem ARGUMENTS` as a user who runs nothing else, with so many threads.
/// @param sockets  where nothing is, or that user's folder
int run_with_threads(const std::filesystem::path& folder, rlim_t most, const std::string& sockets,
                     const std::string& arguments) {
  const uid_t user = 40'000 + static_cast<uid_t>(::getpid() % 20'000);
  const pid_t child = ::fork();
  if (child == 0) {
    const rlimit limit{most, most};
    const int out = ::open((folder / "threads.txt").c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
    (void)::dup2(out, STDOUT_FILENO);
    (void)::dup2(out, STDERR_FILENO);
    if (::chdir(folder.c_str()) != 0 || ::setgid(65534) != 0 || ::setuid(user) != 0 ||
        ::setrlimit(RLIMIT_NPROC, &limit) != 0) {
      ::_exit(99);
    }
    ::setenv("TANDEM_SOCKETS", sockets.c_str(), 1);
    const std::string program = shell_word(TANDEM_BINARY_DIR "/bin/tandem");
    ::execl("/bin/sh", "sh", "-c", ("exec " + program + " " + arguments).c_str(), nullptr);
    ::_exit(98);
  }
  int raw = 0;
  ::waitpid(child, &raw, 0);
  return WIFEXITED(raw) ? WEXITSTATUS(raw) : 128 + WTERMSIG(raw);
}

// It ended by abort(), with status 134; and later still did where it has a socket.
TEST_F(StopUnderAttack, ARunThatGetsNoThreadsSaysWhatToDo) {
  if (::geteuid() != 0) GTEST_SKIP() << test::needs_root("a user who has no other processes");
  std::filesystem::permissions(folder_, std::filesystem::perms::all);
  const std::string sockets = test::socket_path("-threads");
  if (run_with_threads(folder_, 1000, sockets, "--version") != 0) {
    GTEST_SKIP() << "another user cannot run this build: a folder above it is closed";
  }
  int refused = 0, done = 0;
  for (const std::string& doors :
       {std::string(" --no-socket"), " --no-socket --dds" + domain(), std::string()}) {
    for (rlim_t most = 1; most < 40; ++most) {
      SCOPED_TRACE(fmt::format("{} threads{}", most, doors));
      const int status = run_with_threads(
          folder_, most, sockets, "run hold.toml --no-log -q --duration 0.1 --no-build" + doors);
      const std::string told = read_text(folder_ / "threads.txt");
      EXPECT_TRUE(status == 0 || status == 2) << status << ": " << told;
      EXPECT_TRUE(status == 0 || has(told, "threads")) << told;
      EXPECT_FALSE(has(told, "no control socket")) << told;
      ++(status == 0 ? done : refused);
      if (status == 0) break;
    }
  }
  EXPECT_GT(refused, 3);
  EXPECT_EQ(done, 3);
  std::filesystem::remove_all(sockets);
}

// Whose ports.

/// All UDP ports of the participants of the test's domain that are free.
std::vector<int> take_ports() {
  std::vector<int> sockets;
  for (int i = 0; i < 240; ++i) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port =
        htons(static_cast<std::uint16_t>(7400 + 250 * dds::test::own_domain() + 10 + i));
    const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (::bind(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) {
      sockets.push_back(socket);
    } else {
      ::close(socket);
    }
  }
  return sockets;
}

// No command found a port any more: "are too many processes in it?", and nobody was stopped.
TEST_F(StopUnderAttack, ReachesARunWhoseDomainHasNoPortLeft) {
  begin("--rate 20 --dds" + domain());
  const std::vector<int> sockets = take_ports();
  const Outcome stop = stop_over_dds();
  for (const int one : sockets) ::close(one);
  EXPECT_GT(sockets.size(), 200U);
  EXPECT_EQ(stop.status, 0) << stop.err;
  EXPECT_TRUE(has(stop.err, fmt::format("by user {} (", ::geteuid()))) << stop.err;
  EXPECT_EQ(status().value("phase", ""), "faulted");
}

}  // namespace
}  // namespace tandem::apps
