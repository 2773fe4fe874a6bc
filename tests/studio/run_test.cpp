// `tandem run --studio` as its users have it: what a page sees is what the log has, and it may do
// what its token allows.
#include <sys/wait.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <set>

#include "base/quoting.hpp"
#include "log/log_file.hpp"
#include "tests/studio/web_client.hpp"
#include "tests/support/dds_domain.hpp"
#include "tests/support/scratch_folder.hpp"

namespace tandem::studio {
namespace {

using namespace test;

/// A run whose studio listens at a port of its own.
/// Equal as float32, gaps too.
bool same(float shown, double logged) {
  return shown == static_cast<float>(logged) || (std::isnan(shown) && std::isnan(logged));
}

class StudioRun : public testing::Test {
 protected:
  void begin(const std::string& experiment, const std::string& flags) {
    const std::string command =
        "cd " + shell_word(folder_.path()) + " && exec " +
        shell_word(TANDEM_BINARY_DIR "/bin/tandem") + " run " +
        shell_word(experiment.starts_with("/") ? experiment
                                               : TANDEM_SOURCE_DIR "/config/" + experiment) +
        " --studio=0 -q --no-socket --log . " + flags + " 2>run.txt";
    run_ = ::popen(command.c_str(), "r");
    ASSERT_NE(run_, nullptr);
    std::array<char, 200> line{};
    ASSERT_NE(std::fgets(line.data(), line.size(), run_), nullptr);
    const std::string text = line.data();
    ASSERT_TRUE(text.starts_with("studio: http://127.0.0.1:")) << text;
    port_ = static_cast<std::uint16_t>(std::stoi(text.substr(25)));
    token_ = text.substr(text.find("#token=") + 7, 32);
  }
  /// @return its exit status
  int end() {
    const int raw = ::pclose(run_);
    return WIFEXITED(raw) ? WEXITSTATUS(raw) : -1;
  }
  void enter(WebClient& client) const {
    client.say(Json{{"op", "enter"}, {"token", token_}});
    EXPECT_EQ(client.next("entered")["may"], "all");
  }

  tandem::test::ScratchFolder folder_;
  std::FILE* run_ = nullptr;
  std::uint16_t port_ = 0;
  std::string token_;
};

TEST_F(StudioRun, ShowsThePageWhatItsLogHas) {
  begin("double_pendulum/trajectory.toml", "--no-dds --duration 3");
  WebClient client(port_);
  ASSERT_TRUE(client.open());
  EXPECT_EQ(client.next("hello")["robot"], "double_pendulum");
  const std::uint32_t id = id_in(client.next("signals"), "state", "position_rad");
  client.say(Json{{"op", "subscribe"}, {"revision", 1}, {"signals", {id, id + 1}}});
  std::vector<SeenTick> ticks;
  SeenWindow window;
  std::string log;
  while (const auto message = client.read()) {
    const std::string& bytes = message->bytes;
    if (!message->binary) {
      const Json text = Json::parse(bytes);
      if (text["op"] == "ended") log = text["log"];
      continue;
    }
    if (take<std::uint8_t>(bytes, 0) == 2) {
      window = {1,
                1,
                1,
                take<std::uint32_t>(bytes, 8),
                take<std::uint32_t>(bytes, 12),
                take<double>(bytes, 16),
                take<double>(bytes, 24),
                floats_from(bytes, 32)};
      continue;
    }
    ticks.push_back({take<std::uint8_t>(bytes, 1), 1, take<std::uint32_t>(bytes, 8),
                     take<std::uint64_t>(bytes, 16), take<double>(bytes, 24),
                     floats_from(bytes, 32)});
    if (ticks.size() == 30) {
      client.say(Json{{"op", "window"},
                      {"id", 1},
                      {"signals", {id}},
                      {"from_s", 0},
                      {"to_s", 60},
                      {"points", 100'000}});
    }
  }
  EXPECT_EQ(end(), 0);
  ASSERT_GE(ticks.size(), 31U);
  const auto file = log::LogFile::open(folder_ / log);
  ASSERT_TRUE(file) << file.error().to_string();
  const auto logged =
      file->read("/tandem/state",
                 {{"position_rad", 0}, {"position_rad", 1}, {"age_cycles", 0}, {"age_cycles", 1}});
  ASSERT_TRUE(logged) << logged.error().to_string();
  auto joint = logged->columns;
  for (std::size_t j = 0; j < 2; ++j) {  // what nobody has measured yet is no number
    for (std::size_t cycle = 0; cycle < joint[j].size(); ++cycle) {
      if (joint[2 + j][cycle] > static_cast<double>(cycle)) joint[j][cycle] = std::nan("");
    }
  }
  // A studio that had no processor for a second lost cycles, and said so.
  constexpr unsigned kGap = 2;
  std::set<std::uint64_t> lost;
  std::uint64_t before = 0;
  for (const SeenTick& tick : ticks) {
    ASSERT_LT(tick.cycle, joint[0].size());
    for (std::size_t j = 0; j < 2 && tick.cycle > 0; ++j) {
      EXPECT_TRUE(same(tick.numbers[3 * j + 2], joint[j][tick.cycle])) << tick.cycle;
    }
    const bool gap = (tick.flags & kGap) != 0;
    for (std::uint64_t cycle = before; gap && cycle <= tick.cycle; ++cycle) lost.insert(cycle);
    if (before > 0 && tick.cycle > before && tick.lost == 0 && !gap) {
      float low = std::nanf(""), high = low;
      for (std::uint64_t cycle = before + 1; cycle <= tick.cycle; ++cycle) {
        low = std::fmin(low, static_cast<float>(joint[0][cycle]));
        high = std::fmax(high, static_cast<float>(joint[0][cycle]));
      }
      EXPECT_TRUE(same(tick.numbers[0], low)) << tick.cycle;
      EXPECT_TRUE(same(tick.numbers[1], high)) << tick.cycle;
    }
    before = tick.cycle;
  }
  ASSERT_EQ(window.cycles, 1U);
  ASSERT_GT(window.rows, 100U);
  const auto first = static_cast<std::size_t>(std::lround(window.first_s / window.row_s));
  std::size_t compared = 0;
  for (std::size_t row = 0; row < window.rows; ++row) {
    if (std::isnan(window.numbers[row]) && lost.contains(first + row)) continue;
    EXPECT_TRUE(same(window.numbers[row], joint[0][first + row])) << first + row;
    ++compared;
  }
  EXPECT_GT(compared, 100U) << lost.size();
}

TEST_F(StudioRun, LetsAPageDoWhatItsTokenAllows) {
  begin("double_pendulum/hold.toml", "--no-dds --duration 600");
  WebClient client(port_);
  ASSERT_TRUE(client.open());
  EXPECT_EQ(client.ask({{"do", "status"}})["ok"], true);
  const Json refused = client.ask({{"do", "clock.pause"}});
  EXPECT_EQ(refused["ok"], false);
  EXPECT_EQ(refused["hint"], "open the address with its token");
  enter(client);
  EXPECT_EQ(client.ask({{"do", "clock.pause"}})["ok"], true);
  EXPECT_EQ(client.ask({{"do", "clock.resume"}})["ok"], true);
  const Json stop{{"do", "joint.stop"}, {"joint", "joint1"}}, halt{{"do", "joint.halt"}};
  EXPECT_EQ(client.ask(stop)["hint"], "take control first");
  EXPECT_EQ(client.ask(halt)["ok"], true) << "what brakes is everybody's who may change";
  client.say(Json{{"op", "control"}, {"take", true}});
  EXPECT_NE(client.ask(stop).value("hint", ""), "take control first");
  WebClient stranger(port_);
  ASSERT_TRUE(stranger.open());
  EXPECT_EQ(stranger.ask({{"do", "run.stop"}})["ok"], false);
  EXPECT_EQ(stranger.ask({{"do", "estop"}})["ok"], true);
  bool told = false;
  while (!told) {
    const Json events = stranger.next("events");
    if (events.empty()) break;
    for (const Json& event : events["events"]) {
      told = told || event["text"].get<std::string>().find("emergency") != std::string::npos;
    }
  }
  EXPECT_TRUE(told);
  EXPECT_EQ(stranger.next("ended").value("how", "").empty(), false);
  EXPECT_EQ(end(), 1);
}

/// DDS and the page look at the second robot at once.
TEST_F(StudioRun, ShowsTheTwinBesideDds) {
  const std::string file = folder_ / "twin.toml";
  std::ofstream(file)
      << "robot = \"" TANDEM_SOURCE_DIR
         "/config/double_pendulum/robot.toml\"\n"
         "posture = \"ready\"\nduration_s = 600.0\n[[controller]]\nplugin = \"hold\"\n[parallel]\n";
  begin(file, "--dds --domain " + std::to_string(dds::test::another_domain()) + " --duration 600");
  WebClient client(port_);
  ASSERT_TRUE(client.open());
  enter(client);
  Json signals;
  const auto has = [&](const char* name) {
    return std::ranges::any_of(signals["sources"],
                               [&](const Json& source) { return source["name"] == name; });
  };
  do {
    signals = client.next("signals");
  } while (!signals.empty() && !has("parallel"));
  ASSERT_FALSE(signals.empty()) << "no twin came";
  client.say(Json{
      {"op", "subscribe"},
      {"revision", 1},
      {"signals",
       {id_in(signals, "parallel", "position_rad"), id_in(signals, "state", "position_rad")}}});
  SeenTick tick = client.tick();
  while (tick.numbers.size() < 6 || !std::isfinite(tick.numbers[2] + tick.numbers[5]) ||
         tick.numbers[2] == 0.0F) {  // the twin's first state is of before any sample
    tick = client.tick();
  }
  EXPECT_NEAR(tick.numbers[2], tick.numbers[5], 1e-3) << "both hold the same posture";
  EXPECT_EQ(client.ask({{"do", "run.stop"}})["ok"], true);
  EXPECT_EQ(end(), 0);
}

}  // namespace
}  // namespace tandem::studio
