// What a command could not write to its end leaves nothing behind: a full disk, the limit on the
// size of files, a file where a folder is needed, Ctrl-C.
#include <sys/stat.h>

#include <csignal>

#include "tests/apps/background.hpp"
#include "tests/apps/bad_input.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/scratch_folder.hpp"

namespace tandem::apps {
namespace {

class HalfMade : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    const Outcome run = tandem("run trajectory.toml --duration 1 --quiet --json run.json");
    ASSERT_EQ(run.status, 0) << run.err;
    log_ = json("run.json")["log"]["path"];
  }
  /// Files and folders of the test's folder, by their names.
  [[nodiscard]] std::vector<std::string> all() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_))
      names.push_back(entry.path().lexically_relative(folder_).string());
    std::erase_if(names, [](const std::string& name) { return name.ends_with(".txt"); });
    std::ranges::sort(names);
    return names;
  }
  /// @param texts  all are in the one error
  void expect_nothing(const std::string& arguments, const std::vector<std::string>& texts,
                      const std::string& before = {}) const {
    const auto were = all();
    const Outcome outcome = tandem(arguments, before);
    EXPECT_EQ(outcome.status, 2) << arguments << "\n" << outcome.err;
    EXPECT_EQ(error_lines(outcome.err), 1) << outcome.err;
    for (const std::string& text : texts)
      EXPECT_NE(outcome.err.find(text), std::string::npos) << text << "\nin: " << outcome.err;
    EXPECT_EQ(outcome.err.find(".new-"), std::string::npos) << outcome.err;
    EXPECT_EQ(all(), were) << arguments;
  }
  /// A gnuplot that does this; its folder is on the PATH of `environment()`.
  void fake_gnuplot(const std::string& script) const {
    std::filesystem::create_directories(folder_ / "bin");
    write_text(folder_ / "bin/gnuplot", "#!/bin/sh\n" + script);
    std::filesystem::permissions(folder_ / "bin/gnuplot", std::filesystem::perms::owner_all);
  }
  [[nodiscard]] std::string environment() const {
    return "PATH=" + shell_word((folder_ / "bin").string()) + ":$PATH";
  }
  std::string log_;
};

const std::string kMap = csv_map("allow_frozen = true");

// It ended by SIGXFSZ, and left a part of a log.
TEST_F(HalfMade, ImportedLogIsRemovedAtTheLimitOfFileSizes) {
  write_text(folder_ / "map.toml", kMap);
  ASSERT_EQ(tandem("log csv " + log_ + " --fields position_rad -o run.csv").status, 0);
  expect_nothing("log import run.csv --robot robot.toml --map map.toml -o in.mcap",
                 {"in.mcap", "File too large"}, "ulimit -f 20;");
}

TEST_F(HalfMade, TableIsRemovedAtTheLimitOfFileSizesAndOfAWrongTopic) {
  expect_nothing("log csv " + log_ + " -o a.csv", {"a.csv", "writing the CSV failed"},
                 "ulimit -f 20;");
  expect_nothing("log csv " + log_ + " --topic nonsense -o a.csv", {"nonsense"});
}

// It had status 0 and a note, and left what gnuplot had made.
TEST_F(HalfMade, PicturesAreRemovedAtTheLimitOfFileSizes) {
  expect_nothing("report " + log_ + " -o made", {"made"}, "ulimit -f 20;");
  expect_nothing("report " + log_, {"gnuplot"}, "ulimit -f 20;");
  std::filesystem::create_directory(folder_ / "there");
  write_text(folder_ / "there/mine", "");
  expect_nothing("report " + log_ + " -o there", {"there"}, "ulimit -f 20;");
}

TEST_F(HalfMade, PicturesThatGnuplotCutAreAnError) {
  fake_gnuplot("cat > /dev/null\n");
  expect_nothing("report " + log_ + " -o made", {"made/", "could not write the whole picture"},
                 environment());
}

// `identify --out`, `report -o` and `run --log` made their folders, and files needed theirs before.
TEST_F(HalfMade, FoldersThatAFileLacksAreMade) {
  ASSERT_EQ(tandem("log csv " + log_ + " --fields position_rad -o c/d/run.csv").status, 0);
  write_text(folder_ / "map.toml", kMap);
  const std::pair<std::string, std::string> commands[]{
      {"log replay " + log_ + " --robot robot.toml --out e/f/x.toml", "e/f/x.toml"},
      {"excite robot.toml --tries 1 --out g/h/x.toml", "g/h/x.toml"},
      {"log import c/d/run.csv --robot robot.toml --map map.toml -o i/j/x.mcap", "i/j/x.mcap"},
      {"log info " + log_ + " --json k/l/x.json", "k/l/x.json"},
      {"run hold.toml --duration 0.1 --no-log -q --trace m/n/t.json --json o/p/r.json",
       "m/n/t.json"},
      {"check e/f/x.toml", "e/f/x.toml"},
      {"check g/h/x.toml --json q/x.json", "q/x.json"}};
  for (const auto& [command, file] : commands) {
    const Outcome outcome = tandem(command);
    EXPECT_EQ(outcome.status, 0) << command << "\n" << outcome.err;
    EXPECT_TRUE(std::filesystem::is_regular_file(folder_ / file)) << command;
  }
  EXPECT_TRUE(json("o/p/r.json").is_object());
  for (const std::string& name : all()) EXPECT_EQ(name.find(".new-"), std::string::npos) << name;
}

TEST_F(HalfMade, FoldersAreNotLeftWithoutTheirFile) {
  expect_nothing("log replay " + log_ + " --robot robot.toml --out robot.toml/x.toml",
                 {"robot.toml/x.toml", "cannot be written"});
  expect_nothing("log csv " + log_ + " -o a/b/a.csv", {"a/b/a.csv", "writing the CSV failed"},
                 "ulimit -f 20;");
}

TEST_F(HalfMade, FileInPlaceOfAFolderIsNamed) {
  write_text(folder_ / "README.md", "mine");
  expect_nothing("report " + log_ + " -o README.md", {"README.md", "a folder is needed"});
  EXPECT_EQ(read_text(folder_ / "README.md"), "mine");
}

// It left drawings without a page.
TEST_F(HalfMade, PicturesAreRemovedAtAnInterrupt) {
  fake_gnuplot("cat > /dev/null\nkill -INT $PPID\n");
  const auto were = all();
  for (const char* output : {"", " -o made/of/folders", " -o ."}) {
    const std::string command = "cd " + shell_word(folder_.string()) + " && " + environment() +
                                " exec " + shell_word(TANDEM_BINARY_DIR "/bin/tandem") +
                                " report " + log_ + output + " >out.txt 2>err.txt";
    const int raw = std::system(("sh -c " + shell_word(command)).c_str());
    const bool interrupted = (WIFSIGNALED(raw) && WTERMSIG(raw) == SIGINT) ||
                             (WIFEXITED(raw) && WEXITSTATUS(raw) == 128 + SIGINT);
    EXPECT_TRUE(interrupted) << raw << read_text(folder_ / "err.txt");
    EXPECT_EQ(all(), were) << output;
    EXPECT_NE(read_text(folder_ / "err.txt").find("interrupted: nothing was written to "),
              std::string::npos);
  }
}

// It ended without a word as long as the logs were read.
TEST_F(HalfMade, IdentificationThatIsInterruptedEarlySaysThatNothingWasWritten) {
  // Takes seconds to read: millions of empty records of another program's.
  std::string records = "\x89MCAP0\r\n";
  while (records.size() < (std::size_t{192} << 20))
    records += std::string("\x80\0\0\0\0\0\0\0\0", 9);
  write_text(folder_ / "endless.mcap", records);
  const auto were = all();
  Background identify(folder_, "identify endless.mcap --robot robot.toml --out a/found", "early");
  const std::string draft = "a.new-" + std::to_string(identify.id());
  ASSERT_TRUE(tandem::test::eventually([&] { return std::filesystem::exists(folder_ / draft); }))
      << read_text(folder_ / "early.err");
  ASSERT_EQ(::kill(identify.id(), SIGINT), 0);
  ASSERT_TRUE(tandem::test::eventually([&] { return identify.ended(); }));
  EXPECT_EQ(identify.status(), 128 + SIGINT);
  EXPECT_EQ(read_text(folder_ / "early.err"), "\ninterrupted: nothing was written to a/found\n");
  std::filesystem::remove(folder_ / "early.err");
  EXPECT_EQ(all(), were);
}

// The first Ctrl-C was ignored: the handler of the run that was over set a flag.
TEST_F(HalfMade, ReportOfARunEndsAtTheFirstInterruptAndLeavesAllElse) {
  fake_gnuplot("cat > /dev/null\nkill -INT $PPID\nsleep 1\n");
  const Outcome run =
      tandem("run trajectory.toml --duration 1 --log runs --report --json r.json --trace t.json",
             environment());
  EXPECT_TRUE(run.status == -1 || run.status == 128 + SIGINT) << run.status << run.err;
  EXPECT_NE(run.out.find("real time"), std::string::npos) << "its table is lost: " << run.out;
  const std::string log = json("r.json")["log"]["path"];
  // It named the report alone, which sounded as if the run were lost.
  EXPECT_NE(run.err.find("interrupted: the report was not drawn. The log " + log +
                         " is whole; `tandem report " + log + "` draws its report\n"),
            std::string::npos)
      << run.err;
  EXPECT_EQ(tandem("log info " + log + " --json info.json").status, 0);
  EXPECT_TRUE(json("info.json")["complete"]);
  EXPECT_FALSE(json("t.json")["traceEvents"].empty());
  for (const std::string& name : all()) {
    EXPECT_EQ(name.find(".new-"), std::string::npos) << name;
    EXPECT_EQ(name.find("report.html"), std::string::npos) << name;
  }
}

// They stayed for ever.
TEST_F(HalfMade, WhatAKilledCommandLeftIsRemovedByTheNextOfThatName) {
  fake_gnuplot("cat > /dev/null\nkill -KILL $PPID\n");
  std::filesystem::create_directory(folder_ / "there");
  const auto were = all();
  for (const char* output : {"made/of/folders", "there"}) {
    EXPECT_NE(tandem("report " + log_ + " -o " + output, environment()).status, 0);
    EXPECT_GT(all().size(), were.size()) << output;
  }
  const auto with_drafts = all();
  EXPECT_EQ(tandem("log csv " + log_ + " -o a.csv").status, 0);
  EXPECT_EQ(all().size(), with_drafts.size() + 1) << "those of other names stay";
  std::filesystem::remove(folder_ / "a.csv");
  fake_gnuplot("cat > /dev/null\n");
  for (const char* output : {"made/of/folders", "there"})
    EXPECT_EQ(tandem("report " + log_ + " -o " + output, environment()).status, 2);
  EXPECT_EQ(all(), were);
}

// The next run has another number.
TEST_F(HalfMade, WhatAKilledReportOfARunLeftIsRemovedByTheNextRuns) {
  const auto drafts = [this] {
    const auto names = all();
    return std::ranges::count_if(names, [](const auto& one) { return one.contains(".new-"); });
  };
  fake_gnuplot("cat > /dev/null\nkill -KILL $PPID\n");
  const std::string run = "run trajectory.toml --duration 0.1 --log runs --report --quiet";
  EXPECT_NE(tandem(run, environment()).status, 0);
  EXPECT_GT(drafts(), 0);
  fake_gnuplot("cat > /dev/null\n");
  EXPECT_EQ(tandem(run, environment()).status, 0) << "the run is good, and its report is not";
  EXPECT_EQ(drafts(), 0);
}

TEST_F(HalfMade, OnlyDraftsOfItsNameWhoseProcessIsGoneAreRemoved) {
  const std::string gone = "4194305";  // more than Linux gives
  const std::vector<std::string> stay{"a.new-" + std::to_string(::getpid()) + ".csv",
                                      "a.new-1.csv",
                                      "a.new-0" + gone + ".csv",
                                      "a.new-" + gone + "x.csv",
                                      "a.new-.csv",
                                      "a.new-" + gone + ".txt.mcap",
                                      "b.new-" + gone + ".csv",
                                      "aa.new-" + gone + ".csv"};
  for (const std::string& name : stay) write_text(folder_ / name, "mine");
  auto expected = all();
  expected.emplace_back("a.csv");
  std::ranges::sort(expected);
  write_text(folder_ / ("a.new-" + gone + ".csv"), "left");
  ASSERT_EQ(tandem("log csv " + log_ + " -o a.csv").status, 0);
  EXPECT_EQ(all(), expected);
}

TEST_F(HalfMade, MeasurementsLeaveNothingWhenTheyCannotWrite) {
  fake_gnuplot("cat > /dev/null\n");
  const tandem::test::ScratchFolder scratch;
  const std::string cache = " XDG_CACHE_HOME=" + shell_word(scratch.path());
  expect_nothing("bench engines --engines tandem --scenes box --quiet -o made",
                 {"made/engines/", "could not write the whole picture"}, environment() + cache);
  const auto were = all();
  const Outcome latency =
      tandem("latency --duration 0.1 --slices 1 --load idle --policy other --quiet -o made",
             environment());
  EXPECT_EQ(latency.status, 0) << latency.err;
  EXPECT_NE(latency.err.find("no plots: made/"), std::string::npos) << latency.err;
  EXPECT_EQ(latency.err.find(".new-"), std::string::npos) << latency.err;
  EXPECT_EQ(all(), were);
  fake_gnuplot("cat > /dev/null\nkill -INT $PPID\nsleep 1\n");
  for (const char* command : {"bench engines --engines tandem --scenes box",
                              "latency --duration 0.1 --slices 1 --load idle --policy other"}) {
    const Outcome outcome =
        tandem(std::string(command) + " --quiet -o made", environment() + cache);
    EXPECT_TRUE(outcome.status == -1 || outcome.status == 128 + SIGINT) << outcome.status;
    EXPECT_EQ(all(), were) << command;
  }
}

}  // namespace
}  // namespace tandem::apps
