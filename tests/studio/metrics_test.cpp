// GET /metrics of a run: Prometheus' text format, the rows that there are, and the bundled alerts.
#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "apps/run/metrics.hpp"
#include "base/quoting.hpp"
#include "tests/studio/web_client.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/scratch_folder.hpp"

namespace tandem::studio {
namespace {

constexpr char kExamples[] = TANDEM_SOURCE_DIR "/examples/prometheus/";

std::string text_of_file(const std::string& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

/// What a page of metrics says.
struct Page {
  std::string head, body;
  std::map<std::string, std::string> types;
  std::map<std::string, double> samples;  ///< with their labels

  /// Every line is one of the format's; each sample is of a metric that is declared above it.
  explicit Page(const std::string& answer) {
    const std::size_t end = answer.find("\r\n\r\n");
    head = answer.substr(0, end);
    body = end == std::string::npos ? "" : answer.substr(end + 4);
    static const std::regex kSample(
        R"(([a-z_]+?)(_bucket|_sum|_count)?(\{([a-z]+="(\\.|[^"\\])*",?)+\})? ([-+.e0-9]+|NaN))");
    std::istringstream lines(body);
    for (std::string line; std::getline(lines, line);) {
      std::istringstream words(line);
      std::string sharp, what, name, type;
      if (line.starts_with("# ")) {
        words >> sharp >> what >> name >> type;
        EXPECT_TRUE(what == "HELP" || what == "TYPE") << line;
        if (what == "TYPE") {
          EXPECT_TRUE(types.emplace(name, type).second) << "declared twice: " << line;
        }
        continue;
      }
      std::smatch parts;
      if (!std::regex_match(line, parts, kSample)) {
        ADD_FAILURE() << "is no sample: " << line;
        continue;
      }
      const bool histogram = types.contains(parts[1]) && types[parts[1]] == "histogram";
      EXPECT_TRUE(types.contains(parts[1].str() + (histogram ? "" : parts[2].str()))) << line;
      const std::string key = line.substr(0, line.rfind(' '));
      EXPECT_TRUE(samples.emplace(key, std::stod(parts[6])).second) << "twice: " << line;
    }
  }
};

class Metrics : public testing::Test {
 protected:
  void begin(const std::string& flags) {
    const std::string command = "cd " + shell_word(folder_.path()) + " && echo $$ >pid && exec " +
                                shell_word(TANDEM_BINARY_DIR "/bin/tandem") + " run " +
                                shell_word(TANDEM_SOURCE_DIR "/config/double_pendulum/hold.toml") +
                                " --studio=0 -q --no-socket " + flags + " 2>run.txt";
    run_ = ::popen(command.c_str(), "r");
    ASSERT_NE(run_, nullptr);
    std::array<char, 200> line{};
    ASSERT_NE(std::fgets(line.data(), line.size(), run_), nullptr);
    const std::string text = line.data();
    ASSERT_TRUE(text.starts_with("studio: http://127.0.0.1:")) << text;
    port_ = static_cast<std::uint16_t>(std::stoi(text.substr(25)));
  }
  void TearDown() override {
    if (run_ == nullptr) return;
    ::kill(std::stoi(text_of_file(folder_ / "pid")), SIGTERM);
    ::pclose(run_);
  }
  [[nodiscard]] Page page() const { return Page(test::get(port_, "/metrics")); }

  tandem::test::ScratchFolder folder_;
  std::FILE* run_ = nullptr;
  std::uint16_t port_ = 0;
};

TEST_F(Metrics, SayHowARunIs) {
  begin("--rate 5 --duration 25 --log .");
  ASSERT_TRUE(tandem::test::eventually(
      [&] { return page().samples["tandem_phase{phase=\"running\"}"] == 1.0; }));
  Page first = page();
  EXPECT_NE(first.head.find("200 OK"), std::string::npos) << first.head;
  EXPECT_NE(first.head.find("Content-Type: text/plain; version=0.0.4"), std::string::npos);
  EXPECT_EQ(first.samples["tandem_phase{phase=\"faulted\"}"], 0.0);
  EXPECT_EQ(first.samples["tandem_period_seconds"], 0.001);
  EXPECT_GT(first.samples["tandem_disk_size_bytes"], first.samples["tandem_disk_free_bytes"] - 1);
  EXPECT_EQ(first.samples["tandem_log_failed"], 0.0);
  EXPECT_EQ(first.samples["tandem_controller_active{controller=\"hold\"}"], 1.0);
  EXPECT_GT(first.samples["tandem_winding_celsius{joint=\"joint1\"}"], 0.0);
  // Its buckets add up.
  const std::string bucket = "tandem_cycle_seconds_bucket{le=\"";
  EXPECT_GT(first.samples["tandem_cycle_seconds_count"], 0.0);
  EXPECT_EQ(first.samples[bucket + "+Inf\"}"], first.samples["tandem_cycle_seconds_count"]);
  EXPECT_LE(first.samples[bucket + "1e-06\"}"], first.samples[bucket + "1\"}"]);
  ASSERT_TRUE(tandem::test::eventually([&] {
    return page().samples["tandem_cycles_total"] > first.samples["tandem_cycles_total"];
  }));
}

TEST_F(Metrics, CountFaultsByTheirCause) {
  std::ofstream(folder_ / "dies.toml")
      << "[[fault]]\nkind = \"board_kill\"\nboard = \"board_1\"\nafter_enabled_s = 1.0\n";
  begin("--rate 20 --duration endless --on-fault wait --no-log --scenario dies.toml");
  ASSERT_TRUE(tandem::test::eventually(
      [&] { return page().samples["tandem_phase{phase=\"faulted\"}"] == 1.0; }));
  Page stopped = page();
  double faults = 0.0;
  for (const auto& [name, value] : stopped.samples)
    if (name.starts_with("tandem_faults_total{cause=")) faults += value;
  EXPECT_GT(faults, 0.0) << stopped.body;
  EXPECT_EQ(stopped.samples["tandem_faults_latched"], faults);
  EXPECT_FALSE(stopped.types.contains("tandem_disk_free_bytes")) << "there is no log";
}

// --- examples/prometheus ---

TEST(Alerts, NameMetricsThatThereAre) {
  std::set<std::string> rows;
  for (const apps::MetricRow& row : apps::metric_rows()) rows.insert(row.name);
  const std::string text = text_of_file(std::string(kExamples) + "alerts.yml");
  const std::regex name("tandem_[a-z_]+");
  std::size_t found = 0;
  for (auto at = std::sregex_iterator(text.begin(), text.end(), name); at != std::sregex_iterator();
       ++at, ++found)
    EXPECT_TRUE(rows.contains(at->str())) << at->str();
  EXPECT_GT(found, 8U);
  for (const char* about : {"tandem_overruns_total", "tandem_faults_latched", "tandem_disk_free"})
    EXPECT_NE(text.find(about), std::string::npos) << about;
}

class Promtool : public Metrics {
 protected:
  void SetUp() override {
    if (std::system("command -v promtool >/dev/null 2>&1") != 0)
      GTEST_SKIP() << "promtool is not installed (Debian: prometheus)";
  }
};

TEST_F(Promtool, TakesTheAlertsAndTheConfiguration) {
  EXPECT_EQ(std::system(("promtool check rules " +
                         shell_word(std::string(kExamples) + "alerts.yml") + " >/dev/null")
                            .c_str()),
            0);
  EXPECT_EQ(std::system(("promtool check config " +
                         shell_word(std::string(kExamples) + "prometheus.yml") + " >/dev/null")
                            .c_str()),
            0);
}

TEST_F(Promtool, TakesWhatARunSays) {
  begin("--rate 5 --duration 10 --log .");
  ASSERT_TRUE(tandem::test::eventually(
      [&] { return page().samples["tandem_phase{phase=\"running\"}"] == 1.0; }));
  std::ofstream(folder_ / "metrics.txt") << page().body;
  EXPECT_EQ(
      std::system(
          ("promtool check metrics <" + shell_word(folder_ / "metrics.txt") + " >&2").c_str()),
      0);
}

}  // namespace
}  // namespace tandem::studio
