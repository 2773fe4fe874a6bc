// A run on the kernel's CAN whose emulated robot goes back in time with it, in lockstep: the bits
// of a run in one process that was never interrupted.
#include <sys/socket.h>
#include <sys/un.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <random>

#include "log/log_file.hpp"
#include "tests/hil/process.hpp"

namespace tandem {
namespace {

using test::Process;
using test::tandem;

/// Asks a run over its control socket: a line of JSON each way.
class Asker {
 public:
  explicit Asker(const std::string& path) : socket_(::socket(AF_UNIX, SOCK_STREAM, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    const auto* generic = reinterpret_cast<const sockaddr*>(&address);
    there_ = test::eventually([&] { return ::connect(socket_, generic, sizeof address) == 0; }, 60);
  }
  ~Asker() { ::close(socket_); }
  Asker(const Asker&) = delete;
  Asker& operator=(const Asker&) = delete;

  [[nodiscard]] bool there() const { return there_; }
  [[nodiscard]] nlohmann::json ask(const nlohmann::json& question) const {
    const std::string line = question.dump() + "\n";
    if (::send(socket_, line.data(), line.size(), MSG_NOSIGNAL) < 0) return {{"ok", false}};
    std::string text;
    char byte = 0;
    while (!text.ends_with('\n') && ::recv(socket_, &byte, 1, 0) == 1) text += byte;
    return text.empty() ? nlohmann::json{{"ok", false}} : nlohmann::json::parse(text);
  }
  /// Up to `time_s`; false: it does not come there.
  [[nodiscard]] bool step_to(double time_s) const {
    if (!ask({{"do", "clock.step"}, {"to_s", time_s}}).value("ok", false)) return false;
    return test::eventually(
        [&] {
          return ask({{"do", "clock.show"}}).value("standing", false);
        },
        300);
  }
  /// @return why not; empty: time stands there
  [[nodiscard]] std::string go_to(double time_s) const {
    const auto answer = ask({{"do", "clock.goto"}, {"time_s", time_s}});
    if (!answer.value("ok", false)) return answer.dump();
    const double at_s = answer["time_s"];
    return std::abs(at_s - time_s) < 1e-9 ? "" : "it stands at " + std::to_string(at_s) + " s";
  }

 private:
  int socket_;
  bool there_ = false;
};

class HilTravel : public test::OwnFolder {
 protected:
  [[nodiscard]] std::string file(const std::string& name) const { return folder_ / name; }
  const std::string squat_ = TANDEM_SOURCE_DIR "/config/coman/squat.toml";
};

/// All numbers of a topic by their times.
std::map<std::int64_t, std::vector<double>> rows_of(const std::string& path,
                                                    const std::string& topic) {
  std::map<std::int64_t, std::vector<double>> rows;
  const auto log = log::LogFile::open(path);
  EXPECT_TRUE(log) << log.error().to_string();
  if (!log) return rows;
  std::vector<log::Column> columns;
  for (const log::LoggedTopic& one : log->topics()) {
    if (one.name != topic) continue;
    for (const hal::Field& field : one.layout.fields()) {
      for (std::size_t i = 0; i < field.count; ++i) columns.push_back({field.name, i});
    }
  }
  const auto read = log->read(topic, columns);
  EXPECT_TRUE(read) << read.error().to_string();
  if (!read) return rows;
  for (std::size_t row = 0; row < read->time_s.size(); ++row) {
    auto& numbers = rows[std::llround(read->time_s[row] * 1e9)];
    for (const auto& column : read->columns) numbers.push_back(column[row]);
  }
  return rows;
}

/// NaN is NaN.
bool same(const std::vector<double>& a, const std::vector<double>& b) {
  return std::ranges::equal(
      a, b, [](double x, double y) { return x == y || (std::isnan(x) && std::isnan(y)); });
}

/// 0: none are asked for.
int travels() {
  const char* wanted = std::getenv("TANDEM_TRAVELS");
  return wanted == nullptr ? 0 : std::stoi(wanted);
}

/// COMAN in the middle of its squat goes to random cycles, then back to where it was, or on from
/// there.
TEST_F(HilTravel, ToAnyCycleAndOnIsTheRunThatWasNeverInterrupted) {
  if (travels() == 0) GTEST_SKIP() << "in make test-all: TANDEM_TRAVELS=100, takes minutes";
  const std::filesystem::path memory = std::filesystem::temp_directory_path() / "travel";
  std::filesystem::create_directories(memory);
  Process alone(tandem({"run", squat_, "--quiet", "--no-socket", "--duration", "3", "--log",
                        memory / "whole"}),
                file("whole.txt"));
  ASSERT_EQ(alone.wait(), 0) << alone.output();

  Process robot(
      tandem({"emulate", squat_, "--lockstep", "--no-socket", "--json", file("robot.json")}),
      file("robot.txt"));
  ASSERT_TRUE(robot.says("Ctrl-C")) << robot.output();
  const std::string socket = memory / "run.sock";
  Process master(
      tandem({"run", squat_, "--hal", "can", "--lockstep", "--socket", socket, "--start-paused",
              "--duration", "3", "--log", memory / "far", "--json", file("run.json")}),
      file("run.txt"));
  {
    const Asker run(socket);
    ASSERT_TRUE(run.there()) << master.output();
    double reached_s = 2.2;
    ASSERT_TRUE(run.step_to(reached_s)) << master.output();
    std::mt19937 dice(5);  // NOLINT: the same each time
    for (int i = 0; i < travels(); ++i) {
      const double there_s = 1e-3 * static_cast<double>(dice() % std::lround(1e3 * reached_s));
      ASSERT_EQ(run.go_to(there_s), "") << "travel " << i << master.output();
      if (i % 3 == 0) {
        ASSERT_EQ(run.go_to(there_s), "") << "again";
      }
      if (i % 4 == 1) {  // a branch, in which nothing changes
        reached_s = std::max(there_s + 0.05, 2.0 + 0.05 * (i % 3));
        ASSERT_TRUE(run.step_to(reached_s)) << master.output();
      } else {
        ASSERT_EQ(run.go_to(reached_s), "") << "back to where it was";
      }
    }
    ASSERT_EQ(run.go_to(1.9), "");
    ASSERT_TRUE(run.ask({{"do", "clock.resume"}}).value("ok", false));
  }
  ASSERT_EQ(master.wait(), 0) << master.output();
  ASSERT_EQ(robot.interrupt(), 0) << robot.output();
  const auto summary = nlohmann::json::parse(test::text_of(file("run.json")));
  EXPECT_EQ(summary["faults"].size(), 0U);
  EXPECT_EQ(summary["warnings"].size(), 0U) << summary["warnings"];

  const std::string whole = memory / "whole" / "coman-squat-001.mcap";
  std::size_t logs = 0;
  for (const char* topic : {"/tandem/state", "/tandem/command"}) {
    const auto expected = rows_of(whole, topic);
    ASSERT_GT(expected.size(), 3'000U) << topic;
    std::int64_t last_ns = 0;
    for (const auto& entry : std::filesystem::directory_iterator(memory / "far")) {
      if (entry.path().extension() != ".mcap") continue;
      ++logs;
      const auto rows = rows_of(entry.path(), topic);
      EXPECT_GT(rows.size(), 0U) << entry.path();
      for (const auto& [time_ns, numbers] : rows) {
        const auto its = expected.find(time_ns);
        ASSERT_NE(its, expected.end()) << entry.path() << " " << time_ns;
        ASSERT_TRUE(same(numbers, its->second))
            << topic << " of " << entry.path() << " parts at " << time_ns << " ns";
        last_ns = std::max(last_ns, time_ns);
      }
    }
    EXPECT_EQ(last_ns, expected.rbegin()->first) << "to the end";
  }
  EXPECT_GE(logs, 4U) << "the trunk and a branch at least";
  std::filesystem::remove_all(memory);
}

/// The boards' states are in their process' memory: no log has them.
TEST_F(HilTravel, FromALogItIsRefusedInWords) {
  Process run(tandem({"run", squat_, "--hal", "can", "--lockstep", "--no-socket", "--no-log",
                      "--from", "runs/none.mcap@1s"}),
              file("run.txt"));
  EXPECT_EQ(run.wait(), 2) << run.output();
  EXPECT_NE(
      run.output().find("this run cannot go on from a log: its boards are in another process"),
      std::string::npos)
      << run.output();
}

}  // namespace
}  // namespace tandem
