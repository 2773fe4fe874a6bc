// `tandem log export`: a copy of a run's log at a lower rate, read by us and by another reader.
#include <cmath>
#include <set>

#include "log/log_file.hpp"
#include "tests/apps/program.hpp"
#include "tests/support/node.hpp"

namespace tandem::apps {
namespace {

using tandem::test::kNode;

const std::string kReader = TANDEM_SOURCE_DIR "/tests/log";

/// Time and bytes of each message.
using Messages = std::vector<std::pair<std::int64_t, std::vector<std::byte>>>;

class LogExport : public Program {
 protected:
  /// Runs `hold.toml` with more lines. @return its log
  [[nodiscard]] std::string logged(const std::string& name, double seconds,
                                   const std::string& more = {}) const {
    write_text(folder_ / (name + ".toml"), read_text(folder_ / "hold.toml") + more);
    const Outcome run =
        tandem("run " + name + ".toml --duration " + std::to_string(seconds) + " --json - --quiet");
    EXPECT_EQ(run.status, 0) << run.err;
    return nlohmann::json::parse(run.out)["log"]["path"];
  }
  [[nodiscard]] log::LogFile opened(const std::string& file) const {
    auto log = log::LogFile::open((folder_ / file).string());
    EXPECT_TRUE(log) << log.error().message;
    return std::move(*log);
  }
  [[nodiscard]] static Messages messages_of(const log::LogFile& log, const std::string& topic) {
    Messages all;
    const Status read =
        log.for_each(topic, [&](std::int64_t time_ns, std::span<const std::byte> body) {
          all.emplace_back(time_ns, std::vector<std::byte>(body.begin(), body.end()));
        });
    EXPECT_TRUE(read) << topic;
    return all;
  }
  /// The first message of every slot of so many nanoseconds.
  [[nodiscard]] static Messages first_of_each(const Messages& all, std::int64_t slot_ns) {
    Messages first;
    for (const auto& one : all) {
      if (first.empty() || one.first / slot_ns != first.back().first / slot_ns)
        first.push_back(one);
    }
    return first;
  }
  void expect_refused(const std::string& arguments, const std::vector<std::string>& words) const {
    const Outcome refused = tandem(arguments);
    EXPECT_EQ(refused.status, 2) << arguments;
    for (const std::string& word : words)
      EXPECT_NE(refused.err.find(word), std::string::npos) << word << "\nin: " << refused.err;
  }
};

TEST_F(LogExport, KeepsTheFirstImageOfEverySlotAndAllElseWhole) {
  const std::string path = logged("run", 1.0);
  const Outcome done = tandem("log export " + path + " --rate 100 -o small.mcap");
  ASSERT_EQ(done.status, 0) << done.err;
  EXPECT_NE(done.out.find("small.mcap: "), std::string::npos) << done.out;
  EXPECT_NE(done.out.find(" at 100 Hz, all else whole"), std::string::npos) << done.out;
  const log::LogFile whole = opened(path), small = opened("small.mcap");
  std::set<std::string> thinned;
  for (const log::LoggedTopic& topic : whole.topics()) {
    if (topic.messages == 0) continue;
    const Messages all = messages_of(whole, topic.name), kept = messages_of(small, topic.name);
    EXPECT_EQ(small.find(topic.name)->type, topic.type);
    const bool each_cycle = topic.messages > 500;
    EXPECT_EQ(kept, each_cycle ? first_of_each(all, 10'000'000) : all) << topic.name;
    if (each_cycle) thinned.insert(topic.name);
  }
  EXPECT_EQ(thinned, (std::set<std::string>{"/tandem/command", "/tandem/state", "/tandem/truth"}));
  EXPECT_EQ(small.events()->size(), whole.events()->size());
  EXPECT_EQ(small.info().joints, whole.info().joints);
  EXPECT_EQ(small.info().configuration, whole.info().configuration);
  EXPECT_EQ(small.info().reduced, "to 100 Hz, of " +
                                      std::filesystem::path(path).filename().string() +
                                      " (data_sha256 " + whole.data_sha256() + ")");
  EXPECT_EQ(log::value_of(small.result(), "data_sha256"), small.data_sha256());
  EXPECT_EQ(log::value_of(small.result(), "messages"), std::to_string(small.messages()));
  EXPECT_FALSE(small.truncated());
  EXPECT_NE(tandem("log info small.mcap").out.find("reduced "), std::string::npos);
  EXPECT_EQ(tandem("report small.mcap").status, 0) << "which says that it is reduced";
}

TEST_F(LogExport, IsReadByTheFormatsOwnReader) {
  if (kNode == nullptr) GTEST_SKIP() << "node is not installed";
  if (!std::filesystem::exists(kReader + "/node_modules/@mcap/core"))
    GTEST_SKIP() << "@mcap/core is not installed (run `npm ci` in tests/log)";
  const std::string path = logged("run", 1.0, "\n[log]\ncompression = \"zstd\"\n");
  const Outcome done = tandem("log export " + path + " --rate 30");
  ASSERT_EQ(done.status, 0) << done.err;
  const std::string copy = std::filesystem::path(path).replace_extension().string() + "-30Hz.mcap";
  const log::LogFile small = opened(copy);
  const std::string command = "cd " + shell_word(folder_.string()) + " && " + shell_word(kNode) +
                              " " + shell_word(kReader + "/validate_mcap.mjs") + " " + copy + " " +
                              std::to_string(small.messages()) + " >read.txt 2>&1";
  EXPECT_EQ(std::system(command.c_str()), 0) << read_text(folder_ / "read.txt");
  const Messages state = messages_of(small, "/tandem/state");
  for (std::size_t i = 1; i + 1 < state.size(); ++i) {  // 33 and 34 ms
    EXPECT_NEAR(static_cast<double>(state[i].first - state[i - 1].first), 1e9 / 30.0, 1e6) << i;
  }
}

TEST_F(LogExport, ReadsALogOfSeveralFilesAsOne) {
  const std::string one = logged("one", 12.0);
  const std::string several = logged("several", 12.0, "\n[log]\nfile_MB = 4\n");
  EXPECT_GT(opened(several).parts().size(), 1U);
  ASSERT_EQ(tandem("log export " + one + " --rate 50 -o a.mcap").status, 0);
  ASSERT_EQ(tandem("log export " + several + " --rate 50 -o b.mcap").status, 0);
  EXPECT_EQ(opened("a.mcap").data_sha256(), opened("b.mcap").data_sha256());
  EXPECT_EQ(opened("b.mcap").info().part, 0U);
  EXPECT_EQ(log::value_of(opened("b.mcap").result(), "continued"), "");
  expect_refused("log export " + several + " --rate 50 -o " +
                     std::filesystem::path(several).replace_extension(".2.mcap").string(),
                 {"this is the log itself", "-o"});
}

TEST_F(LogExport, CopiesATimeAndSomeTopics) {
  const std::string path = logged("run", 1.0);
  ASSERT_EQ(tandem("log export " + path +
                   " --rate 100 --from 0.5 --to 0.8 --topics state,tf_static -o part.mcap")
                .status,
            0);
  const log::LogFile part = opened("part.mcap");
  std::set<std::string> topics;
  for (const log::LoggedTopic& topic : part.topics()) topics.insert(topic.name);
  EXPECT_EQ(topics, (std::set<std::string>{"/tandem/state", "/tf_static"}));
  EXPECT_EQ(part.find("/tandem/state")->first_ns, 500'000'000);
  EXPECT_EQ(part.find("/tandem/state")->last_ns, 800'000'000);
  EXPECT_EQ(part.find("/tandem/state")->messages, 31U);
  EXPECT_EQ(part.find("/tf_static")->messages, 1U) << "it was before, and still holds";
  expect_refused("log csv part.mcap --topic truth", {"has no topic", "this log is reduced"});
}

TEST_F(LogExport, IsRefusedByWhoNeedsEverySample) {
  const std::string path = logged("run", 1.0);
  ASSERT_EQ(tandem("log export " + path + " --rate 100 -o small.mcap").status, 0);
  for (const char* command :
       {"log replay small.mcap --robot robot.toml --out r.toml",
        "identify small.mcap --robot robot.toml --out identified", "log thresholds small.mcap"}) {
    expect_refused(command, {"small.mcap", "lacks samples", "to 100 Hz, of "});
  }
  const Outcome csv = tandem("log csv small.mcap");
  EXPECT_EQ(csv.status, 0);
  EXPECT_NE(csv.err.find("warning: small.mcap: this log is reduced to 100 Hz"), std::string::npos)
      << csv.err;
}

// A copy of a killed run's log looks like that of a shorter run.
TEST_F(LogExport, SaysThatTheLogIsCut) {
  const std::string path = logged("run", 1.0);
  const std::string export_it = "log export " + path + " --rate 100 -o copy.mcap";
  EXPECT_EQ(tandem(export_it).err, "");
  std::filesystem::resize_file(folder_ / path, std::filesystem::file_size(folder_ / path) / 2);
  const Outcome cut = tandem(export_it);
  EXPECT_EQ(cut.status, 0);
  EXPECT_NE(cut.err.find("note: " + path + ": the log is cut: "), std::string::npos) << cut.err;
}

TEST_F(LogExport, RefusesWhatCannotBe) {
  const std::string path = logged("run", 1.0), other = logged("other", 0.2);
  const std::string export_it = "log export " + path;
  expect_refused(export_it, {"--rate"});
  expect_refused(export_it + " --rate 0", {"the rate is not above 0"});
  expect_refused(export_it + " --rate -5", {"the rate is not above 0"});
  expect_refused(export_it + " --rate nan", {"--rate"});
  expect_refused(export_it + " --rate 1001.5", {"1001.5 Hz is above the log's, 1000 Hz"});
  expect_refused(export_it + " --rate 100 -o " + path, {"this is the log itself"});
  expect_refused(export_it + " --rate 100 -o " + other, {"no reduced log: it would be lost"});
  expect_refused(export_it + " --rate 100 -o hold.toml", {"no reduced log: it would be lost"});
  expect_refused(export_it + " --rate 100 -o /dev/full", {"/dev/full", "No space left"});
  expect_refused(export_it + " --rate 100 --from 50", {"nothing of these topics in this time"});
  expect_refused(export_it + " --rate 100 --from 0.5 --to 0.2", {"from is behind to"});
  expect_refused(export_it + " --rate 100 --topics stat", {"has no topic", "state"});
  expect_refused("log export nobody.mcap --rate 100", {"nobody.mcap"});
  const Outcome full = tandem(export_it + " --rate 500 -o little.mcap", "ulimit -f 40;");
  EXPECT_EQ(full.status, 2);
  EXPECT_NE(full.err.find("File too large"), std::string::npos) << full.err;
  EXPECT_NE(full.err.find("little.mcap"), std::string::npos) << full.err;
  EXPECT_FALSE(std::filesystem::exists(folder_ / "little.mcap")) << "half a copy was left";
  ASSERT_EQ(tandem(export_it + " --rate 100 -o again.mcap").status, 0);
  EXPECT_EQ(tandem(export_it + " --rate 50 -o again.mcap").status, 0) << "a copy may be replaced";
}

}  // namespace
}  // namespace tandem::apps
