// The manual pages: of every command, by the tables of --help, and without a complaint of man's.
#include <set>
#include <sstream>

#include "base/process.hpp"
#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

namespace fs = std::filesystem;

class ManPages : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    ASSERT_EQ(tandem("help --man pages").status, 0);
  }
  [[nodiscard]] std::string page(const std::string& name) const {
    return read_text(folder_ / "pages" / (name + ".1"));
  }
};

TEST_F(ManPages, AreThereForEveryCommand) {
  std::set<std::string> commands{"tandem.1"}, pages;
  std::istringstream lines(tandem("__complete ''").out);
  for (std::string line; std::getline(lines, line);) {
    const std::string name = line.substr(0, line.find('\t'));
    if (name != "help") commands.insert("tandem-" + name + ".1");
  }
  for (const auto& entry : fs::directory_iterator(folder_ / "pages"))
    pages.insert(entry.path().filename().string());
  EXPECT_GT(pages.size(), 20U);
  EXPECT_EQ(pages, commands);
}

TEST_F(ManPages, SayWhatHelpSays) {
  const std::string run = page("tandem-run");
  for (const char* text :
       {"tandem\\-run \\- Run an experiment", "\\fB\\-\\-rate\\fR", ".SH OPTIONS",
        "tandem run config/coman/squat.toml \\-\\-report", ".BR tandem (1)"})
    EXPECT_NE(run.find(text), std::string::npos) << text;
  EXPECT_NE(page("tandem").find(".BR tandem\\-run (1)"), std::string::npos);
  EXPECT_NE(page("tandem").find("Exit status"), std::string::npos);
  EXPECT_NE(page("tandem-model").find(".SH TANDEM MODEL BUILD"), std::string::npos);
  EXPECT_EQ(page("tandem-report").find("after\\-run"), std::string::npos);  // which no help shows
}

TEST_F(ManPages, ArePrintedWithoutWarnings) {
  if (!program_exists("man")) GTEST_SKIP() << "there is no man";
  for (const auto& entry : fs::directory_iterator(folder_ / "pages")) {
    const std::string command = "MANWIDTH=80 MANPAGER=cat LC_ALL=C man --warnings -l " +
                                shell_word(entry.path().string()) + " >" +
                                shell_word((folder_ / "out.txt").string()) + " 2>" +
                                shell_word((folder_ / "err.txt").string()) + " </dev/null";
    EXPECT_EQ(std::system(command.c_str()), 0);
    EXPECT_EQ(read_text(folder_ / "err.txt"), "") << entry.path();
    EXPECT_GT(fs::file_size(folder_ / "out.txt"), 500U) << entry.path();
  }
}

TEST_F(ManPages, ThatCannotBeWrittenAreAnError) {
  write_text(folder_ / "file", "mine\n");
  const Outcome outcome = tandem("help --man file");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("cannot be written"), std::string::npos) << outcome.err;
  EXPECT_EQ(read_text(folder_ / "file"), "mine\n");
}

}  // namespace
}  // namespace tandem::apps
