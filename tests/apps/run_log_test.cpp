// What the log of a run says about itself.
#include "runtime/run/run_log.hpp"

#include <cmath>

#include "log/log_file.hpp"
#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

class RunLog : public Program {};

// The files were read again, by name, when the log began: it had what stood there by then.
TEST_F(RunLog, HasTheFilesThatAreRun) {
  const std::vector<std::string> names{"hold.toml", "robot.toml", "double_pendulum.urdf"};
  std::vector<std::string> texts;
  for (const std::string& name : names) texts.push_back(read_text(folder_ / name));
  auto composition = runtime::composed((folder_ / "hold.toml").string(), {});
  ASSERT_TRUE(composition) << composition.error().front().to_string();
  for (const std::string& name : names) write_text(folder_ / name, "another by now\n");
  auto recorder = runtime::open_log(**composition, (folder_ / "runs").string());
  ASSERT_TRUE(recorder) << recorder.error().to_string();
  (*recorder)->start();
  const log::RecordingResult result = (*recorder)->close();
  const auto file = log::LogFile::open(result.path);
  ASSERT_TRUE(file) << file.error().to_string();
  const auto& configuration = file->info().configuration;
  ASSERT_EQ(configuration.size(), names.size());
  for (std::size_t i = 0; i < names.size(); ++i) {
    EXPECT_TRUE(configuration[i].first.ends_with(names[i])) << configuration[i].first;
    EXPECT_EQ(configuration[i].second, texts[i]);
  }
}

// The first of them may be gone, and its number is still taken.
TEST_F(RunLog, GoesOnInSeveralFilesOfWhichTheOldestGo) {
  const std::string experiment = read_text(folder_ / "hold.toml");
  write_text(folder_ / "hold.toml",
             experiment + "\n[log]\nfile_MB = 4\ntotal_MB = 8\nwithout = [\"truth.torque_nm\"]\n");
  const std::string command = "run hold.toml --duration 40 --quiet --json ";
  ASSERT_EQ(tandem(command + "a.json").status, 0);
  const auto log = json("a.json")["log"];
  EXPECT_GT(log["files"].get<int>(), log["files_removed"].get<int>());
  EXPECT_GT(log["files_removed"].get<int>(), 0) << log;
  EXPECT_FALSE(std::filesystem::exists(folder_ / "runs/double_pendulum-hold-001.mcap"));
  std::uintmax_t bytes = 0;
  for (const auto& file : std::filesystem::directory_iterator(folder_ / "runs"))
    bytes += file.file_size();
  EXPECT_LE(bytes, 8'000'000U);
  const std::string first = log["path"];
  EXPECT_EQ(first, "runs/double_pendulum-hold-001.mcap");
  const Outcome fields = tandem("log info " + first + " --topic truth");
  ASSERT_EQ(fields.status, 0) << fields.err;
  EXPECT_EQ(fields.out.find("torque_nm"), std::string::npos) << fields.out;
  // It opens all files that are left, and every reader says what is missing.
  const std::string missing =
      "the log lacks " +
      (log["files_removed"] == 1 ? "part 1" : "parts 1 to " + log["files_removed"].dump());
  EXPECT_NE(fields.err.find(missing), std::string::npos) << fields.err;
  const Outcome info = tandem("log info " + first + " --json info.json");
  EXPECT_NE(info.out.find(missing + "; what is here is from "), std::string::npos) << info.out;
  const auto parts = json("info.json")["parts"];
  EXPECT_EQ(parts.size(),
            log["files"].get<std::size_t>() - log["files_removed"].get<std::size_t>());
  EXPECT_EQ(parts[0]["start_ns"], json("info.json")["start_ns"]);
  EXPECT_EQ(json("info.json")["missing"][0]["last"], log["files_removed"]);
  EXPECT_NE(tandem("log csv " + first + " --every 1000").err.find(missing), std::string::npos);
  EXPECT_NE(tandem("log diff " + first + " " + first).err.find(missing), std::string::npos);
  ASSERT_EQ(tandem("report " + first + " -o page").status, 0);
  // The first row that was left was "the controllers' start".
  const std::string page = read_text(folder_ / "page/report.html");
  EXPECT_NE(page.find(missing), std::string::npos);
  EXPECT_NE(page.find(" s, and does not have the controllers' start."), std::string::npos);
  EXPECT_NE(page.find("<dt>covers</dt>"), std::string::npos);
  EXPECT_EQ(page.find("controllers started"), std::string::npos);
  const std::string last = parts.back()["path"];
  const Outcome alone = tandem("log info " + last);
  EXPECT_NE(alone.out.find("of a log in several files: " + first + " opens all of them"),
            std::string::npos)
      << alone.out;
  ASSERT_EQ(tandem(command + "b.json").status, 0);
  const std::string second = json("b.json")["log"]["path"];
  EXPECT_NE(second.find("runs/double_pendulum-hold-002."), std::string::npos) << second;
  EXPECT_EQ(json("b.json")["log"]["data_sha256"], log["data_sha256"]);
}

// What a service needs: started again and again, it keeps to the limits that one run had.
TEST_F(RunLog, GoesOnWithTheBudgetOfTheRunsBefore) {
  write_text(folder_ / "hold.toml",
             read_text(folder_ / "hold.toml") +
                 "\n[log]\nfile_s = 2\ntotal_s = 6\nkeep_before_fault_s = 0\n"
                 "keep_free_share = 0.001\nbudget = \"experiment\"\n");
  for (int number = 1; number <= 4; ++number) {
    ASSERT_EQ(tandem("run hold.toml --duration 5 -q --json run.json").status, 0);
    const std::string path = json("run.json")["log"]["path"];
    EXPECT_EQ(path, "runs/double_pendulum-hold-00" + std::to_string(number) + ".mcap");
  }
  EXPECT_GT(json("run.json")["log"]["earlier_files_removed"].get<int>(), 0);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "runs/double_pendulum-hold-001.mcap"));
  const auto files = std::distance(std::filesystem::directory_iterator(folder_ / "runs"), {});
  EXPECT_LE(files, 6) << "the last 6 s, in files of up to 2 s";
  EXPECT_GE(files, 3);
}

TEST_F(RunLog, IsTheFileThatIsNamedUnlessThatIsThere) {
  auto composition = runtime::composed((folder_ / "hold.toml").string(), {});
  ASSERT_TRUE(composition);
  const std::string folder = (folder_ / "new").string();
  {
    const auto recorder = runtime::open_log(**composition, folder, "a.mcap");
    ASSERT_TRUE(recorder) << recorder.error().to_string();
    EXPECT_EQ((*recorder)->path(), folder + "/a.mcap");
  }
  const std::string before = read_text(folder_ / "new/a.mcap");
  const auto again = runtime::open_log(**composition, folder, "a.mcap");
  ASSERT_FALSE(again);
  EXPECT_NE(again.error().to_string().find("a.mcap: cannot make the log: "), std::string::npos)
      << again.error().to_string();
  EXPECT_EQ(read_text(folder_ / "new/a.mcap"), before);
}

// The log had the measured position as a reference in torque mode: an error of 0, and CI passed.
TEST_F(RunLog, HasNoReferenceThatNobodyWrote) {
  const std::string hold = read_text(folder_ / "hold.toml");
  const std::string head = hold.substr(0, hold.find("[[controller]]"));
  write_text(folder_ / "hold.toml", head +
                                        "[[controller]]\nplugin = \"gravity_compensation\"\n"
                                        "[controller.parameters]\nmode = \"torque\"\n");
  ASSERT_EQ(tandem("run hold.toml -q --duration 0.5 --json run.json").status, 0);
  const auto joint = json("run.json")["joints"]["joint1"];
  EXPECT_TRUE(joint["max_tracking_error_rad"].is_null()) << joint;
  EXPECT_TRUE(joint["rms_tracking_error_rad"].is_null()) << joint;
  const std::string path = json("run.json")["log"]["path"];
  const auto file = log::LogFile::open((folder_ / path).string());
  ASSERT_TRUE(file) << file.error().to_string();
  const auto table = file->read("/tandem/command", {{"mode", 0}, {"position_rad", 0}});
  ASSERT_TRUE(table);
  std::size_t in_torque = 0;
  for (std::size_t i = 0; i < table->time_s.size(); ++i) {
    const bool torque = table->columns[0][i] == static_cast<double>(hal::ControlMode::kTorque);
    EXPECT_EQ(std::isnan(table->columns[1][i]), torque) << table->time_s[i];
    in_torque += torque ? 1 : 0;
  }
  EXPECT_GE(in_torque, 500U);
}

TEST_F(RunLog, DoesNotBeginWhereTheDiskHasTooLittle) {
  write_text(folder_ / "hold.toml",
             read_text(folder_ / "hold.toml") + "\n[log]\nkeep_free_MB = 1e9\n");
  const Outcome run = tandem("run hold.toml --duration 0.1");
  EXPECT_EQ(run.status, 2);
  EXPECT_NE(run.err.find("and keep_free_MB = 1e+09 stay free"), std::string::npos) << run.err;
}

}  // namespace
}  // namespace tandem::apps
