// `tandem log` and `tandem report` on the log of a short run.
#include <algorithm>

#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

class LogAndReport : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    const Outcome outcome = tandem("run trajectory.toml --duration 0.5 --quiet");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
  }
  [[nodiscard]] nlohmann::json json_of_info() const {
    return nlohmann::json::parse(tandem("log info " + log_ + " --json -").out);
  }
  const std::string log_ = "runs/double_pendulum-trajectory-001.mcap";
};

TEST_F(LogAndReport, InfoTellsTopicsAndMetadata) {
  const Outcome outcome = tandem("log info " + log_ + " --json -");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json["complete"], true);
  EXPECT_EQ(json["metadata"]["robot"], "double_pendulum");
  EXPECT_GE(json["topics"]["/tandem/state"]["messages"].get<int>(), 500);
  EXPECT_EQ(json["data_sha256"].get<std::string>().size(), 64U);
}

TEST_F(LogAndReport, ReportDestroysNoPageThatItDidNotWrite) {
  std::filesystem::create_directories(folder_ / "mine");
  write_text(folder_ / "mine/report.html", "<!doctype html>\n<title>mine</title>\n");
  const Outcome refused = tandem("report " + log_ + " -o mine");
  EXPECT_EQ(refused.status, 2);
  EXPECT_NE(refused.err.find("no page of `tandem report`: it would be lost"), std::string::npos)
      << refused.err;
  EXPECT_EQ(read_text(folder_ / "mine/report.html"), "<!doctype html>\n<title>mine</title>\n");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "mine/overview.png"));
  for (const char* again : {"once", "twice"})
    EXPECT_EQ(tandem("report " + log_ + " -o own").status, 0) << again << ": its own page is";
}

TEST_F(LogAndReport, InfoTellsTheHashOnce) {
  const Outcome outcome = tandem("log info " + log_);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const std::string hash = json_of_info()["data_sha256"];
  const std::size_t first = outcome.out.find(hash);
  ASSERT_NE(first, std::string::npos) << outcome.out;
  EXPECT_EQ(outcome.out.find(hash, first + 1), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("double_pendulum, 2 joints, 0 sensors"), std::string::npos);
}

TEST_F(LogAndReport, InfoOfALogThatIsCutTellsWhatOfItCanBeRead) {
  const auto whole = std::filesystem::file_size(folder_ / log_);
  bool was_empty = false;
  for (const auto bytes : {whole / 2, whole / 8, whole / 16, std::uintmax_t{20'000}}) {
    std::filesystem::resize_file(folder_ / log_, bytes);
    const Outcome info = tandem("log info " + log_ + " --json info.json");
    ASSERT_EQ(info.status, 0) << bytes << info.err;
    EXPECT_EQ(json("info.json")["complete"], false);
    EXPECT_NE(info.out.find("cut after " + std::to_string(bytes) + " bytes"), std::string::npos)
        << info.out;
    const int messages = json("info.json")["messages"];
    was_empty = was_empty || messages == 0;
    const std::string readable = messages == 0 ? "the settings of its run, and no message"
                                               : std::to_string(messages) + " messages, up to ";
    EXPECT_NE(info.out.find(readable), std::string::npos) << info.out;
    EXPECT_EQ(info.out.find("fields") != std::string::npos, messages > 0) << info.out;
  }
  EXPECT_TRUE(was_empty) << "its first chunk is not whole";
}

// The table of a killed run looked like one of a shorter run.
TEST_F(LogAndReport, CsvAndDiffOfALogThatIsCutSaySo) {
  EXPECT_EQ(tandem("log csv " + log_).err, "");
  std::filesystem::copy_file(folder_ / log_, folder_ / "cut.mcap");
  std::filesystem::resize_file(folder_ / "cut.mcap",
                               std::filesystem::file_size(folder_ / log_) / 2);
  const std::string note =
      "note: cut.mcap: the log is cut: its run was killed, or the copy is not whole; what can be "
      "read ends at ";
  const Outcome csv = tandem("log csv cut.mcap");
  EXPECT_EQ(csv.status, 0);
  EXPECT_TRUE(csv.err.starts_with(note)) << csv.err;
  EXPECT_GT(std::ranges::count(csv.out, '\n'), 100);
  const Outcome diff = tandem("log diff " + log_ + " cut.mcap");
  EXPECT_EQ(diff.status, 1);
  EXPECT_TRUE(diff.err.starts_with(note)) << diff.err;
}

TEST_F(LogAndReport, InfoOfATopicListsItsFieldsWithUnits) {
  const Outcome outcome = tandem("log info " + log_ + " --topic truth");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("position_rad"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("rad/s"), std::string::npos) << outcome.out;
  const Outcome absent = tandem("log info " + log_ + " --topic truht");
  EXPECT_EQ(absent.status, 2);
  EXPECT_NE(absent.err.find("/tandem/truht"), std::string::npos) << absent.err;
  const Outcome foreign = tandem("log info " + log_ + " --topic /joint_states");
  EXPECT_EQ(foreign.status, 2);
  EXPECT_NE(foreign.err.find("sensor_msgs/msg/JointState"), std::string::npos) << foreign.err;
}

TEST_F(LogAndReport, CsvWritesTheFieldsAskedFor) {
  const Outcome outcome = tandem("log csv " + log_ + " --fields position_rad");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_TRUE(outcome.out.starts_with("time_s,position_rad.joint1,position_rad.joint2\n"))
      << outcome.out.substr(0, 100);
  EXPECT_GE(std::ranges::count(outcome.out, '\n'), 501);
}

TEST_F(LogAndReport, CsvDoesNotWriteOverTheLog) {
  const Outcome outcome = tandem("log csv " + log_ + " -o " + log_);
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("this is the log itself"), std::string::npos) << outcome.err;
  EXPECT_EQ(tandem("log info " + log_).status, 0);
  const std::string robot = read_text(folder_ / "robot.toml");
  for (const std::string& command :
       {"log csv " + log_ + " -o robot.toml", std::string("model build robot.toml -o robot.toml"),
        "report " + log_ + " --json robot.toml"}) {
    const Outcome over = tandem(command);
    EXPECT_EQ(over.status, 2) << command;
    EXPECT_NE(over.err.find("it would be lost"), std::string::npos) << over.err;
    EXPECT_EQ(over.out, "") << command;
  }
  EXPECT_EQ(read_text(folder_ / "robot.toml"), robot);
}

TEST_F(LogAndReport, CsvSuggestsTheNearestTopic) {
  const Outcome outcome = tandem("log csv " + log_ + " --topic sttae");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("did you mean '/tandem/state'?"), std::string::npos) << outcome.err;
}

TEST_F(LogAndReport, AFileThatIsNoLogIsRefused) {
  EXPECT_EQ(tandem("log info hold.toml").status, 2);
  EXPECT_EQ(tandem("report hold.toml").status, 2);
}

TEST_F(LogAndReport, ReportDrawsAPageAndPictures) {
  const Outcome outcome = tandem("report " + log_ + " --json report.json");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto files = json("report.json");
  const std::string page = read_text(folder_ / files["report"].get<std::string>());
  EXPECT_NE(page.find("<svg"), std::string::npos);
  EXPECT_NE(page.find("inverse dynamics"), std::string::npos);
  EXPECT_NE(page.find("0.500 s"), std::string::npos) << "without the time before the controllers";
  EXPECT_GE(files["images"].size(), 4U);
  for (const auto& image : files["images"]) {
    EXPECT_TRUE(read_text(folder_ / image.get<std::string>()).starts_with("\x89PNG"));
  }
}

TEST_F(LogAndReport, ReportTellsTheFaultAtTheTimeThatTheRunTold) {
  write_text(folder_ / "faults.toml",
             "[[fault]]\nkind = \"encoder_unplug\"\njoint = \"joint2\"\nafter_enabled_s = 1.2\n");
  const Outcome run = tandem(
      "run hold.toml --duration 2 --scenario faults.toml --log faulted --report --json run.json");
  ASSERT_EQ(run.status, 1) << run.err;
  const auto fault = json("run.json")["fault_log"][0];
  char told[64];
  std::snprintf(told, sizeof told, ", at %.3f s</dd>", fault["time_s"].get<double>());
  const std::string page = read_text(folder_ / "faulted/double_pendulum-hold-001/report.html");
  const std::string line = "<dt>fault</dt><dd>joint2: " + fault["cause"].get<std::string>() + told;
  EXPECT_NE(page.find(line), std::string::npos) << line;
  EXPECT_NE(page.find("Times count from the run's first SYNC"), std::string::npos);
  EXPECT_NE(page.find("<dt>controllers started</dt>"), std::string::npos);
}

// The report is drawn by another program, and says where it is as the run would.
TEST_F(LogAndReport, ReportOfARunIsNamedWhereTheRunsTableIs) {
  const std::string run = "run hold.toml --duration 0.2 --log ";
  const std::string page = "report  a/double_pendulum-hold-001/report.html";
  const Outcome told = tandem(run + "a --report");
  EXPECT_EQ(told.status, 0) << told.err;
  EXPECT_GT(told.out.find("\n  " + page + "\n  plots   "), told.out.find("real time")) << told.out;
  const Outcome beside = tandem(run + "b --report --json -");
  EXPECT_EQ(beside.status, 0);
  EXPECT_TRUE(nlohmann::json::parse(beside.out).contains("log"));
  EXPECT_NE(beside.err.find("  report  b/"), std::string::npos) << beside.err;
  const Outcome quiet = tandem(run + "c --report --quiet");
  EXPECT_EQ(quiet.status, 0);
  EXPECT_EQ(quiet.out + quiet.err, "");
  EXPECT_TRUE(std::filesystem::exists(folder_ / "c/double_pendulum-hold-001/report.html"));
}

TEST_F(LogAndReport, ReportOfClosedLoopsHasTheirErrorsAndTheTorqueThroughThem) {
  const Outcome run =
      tandem("run " + shell_word(TANDEM_SOURCE_DIR "/config/parallel_ankle/move.toml") +
             " --duration 0.5 --log . --report");
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_NE(run.out.find("\n\n  closed loops"), std::string::npos) << run.out;
  const std::string page = read_text(folder_ / "parallel_ankle-move-001/report.html");
  for (const std::string text : {"<h2>Closed loops</h2>", "<td>rod_left</td>", "<td>rod_right</td>",
                                 "2 joints, 2 more passive", "and by inverse dynamics"}) {
    EXPECT_NE(page.find(text), std::string::npos) << text;
  }
}

TEST_F(LogAndReport, AKilledRunLeavesALogThatIsReadAndDrawn) {
  const std::string log = (folder_ / "killed/double_pendulum-trajectory-001.mcap").string();
  const std::string kill_when_it_has_written =
      "cd " + shell_word(folder_.string()) + "; " + shell_word(TANDEM_BINARY_DIR "/bin/tandem") +
      " run trajectory.toml --duration 60 --realtime --log killed --quiet & "
      "for i in $(seq 300); do [ $(stat -c %s " +
      shell_word(log) +
      " 2>/dev/null || echo 0) -gt 300000 ] "
      "&& break; sleep 0.1; done; kill -9 $!; wait";
  std::system(kill_when_it_has_written.c_str());
  const Outcome info = tandem("log info " + shell_word(log) + " --json -");
  ASSERT_EQ(info.status, 0) << info.err;
  const auto json = nlohmann::json::parse(info.out);
  EXPECT_EQ(json["complete"], false);
  EXPECT_GT(json["topics"]["/tandem/state"]["messages"].get<int>(), 100);
  const Outcome report = tandem("report " + shell_word(log));
  EXPECT_EQ(report.status, 0) << report.err;
  EXPECT_NE(report.err.find("it is cut"), std::string::npos) << report.err;
  EXPECT_NE(read_text(folder_ / "killed/double_pendulum-trajectory-001/report.html")
                .find("The log is cut after "),
            std::string::npos)
      << "under the title";
}

// Nothing of it was read.
TEST_F(LogAndReport, ALogWithOneWrongBitIsReadAndSaysWhatIsLeftOut) {
  ASSERT_EQ(tandem("run trajectory.toml --duration 1.5 --quiet").status, 0);
  const std::string log = "runs/double_pendulum-trajectory-002.mcap";
  std::string bytes = read_text(folder_ / log);
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 4);
  write_text(folder_ / "runs/bad.mcap", bytes);
  const std::string left_out = ": its checksum is wrong; its messages are left out";
  const Outcome info = tandem("log info runs/bad.mcap --json info.json");
  ASSERT_EQ(info.status, 0) << info.err;
  EXPECT_NE(info.out.find(left_out), std::string::npos) << info.out;
  EXPECT_EQ(json("info.json")["complete"], false);
  const auto damage = json("info.json")["parts"][0]["damage"][0];
  EXPECT_EQ(damage["loses_messages"], true);
  EXPECT_GT(damage["end_ns"].get<double>(), damage["start_ns"].get<double>());
  for (const char* const command : {"log csv runs/bad.mcap", "report runs/bad.mcap"}) {
    const Outcome outcome = tandem(command);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.err.find(left_out), std::string::npos) << command << "\n" << outcome.err;
  }
  EXPECT_NE(read_text(folder_ / "runs/bad/report.html").find(left_out), std::string::npos);
  const Outcome diff = tandem("log diff " + log + " runs/bad.mcap");
  EXPECT_EQ(diff.status, 2);
  EXPECT_NE(diff.err.find("it is not comparable bit for bit: chunk of"), std::string::npos)
      << diff.err;
}

TEST_F(LogAndReport, ReportLaysTwoLogsOverEachOther) {
  ASSERT_EQ(tandem("run hold.toml --duration 0.5 --quiet").status, 0);
  const Outcome outcome =
      tandem("report " + log_ + " runs/double_pendulum-hold-001.mcap -o both --json report.json");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const std::string page = read_text(folder_ / "both/report.html");
  for (const char* const one :
       {"report/joint_position.measured", "B/report/joint_position.measured", "data-log=\"A/\"",
        "data-log=\"B/\"", "double_pendulum-hold-001.mcap"})
    EXPECT_NE(page.find(one), std::string::npos) << one;
}

}  // namespace
}  // namespace tandem::apps
