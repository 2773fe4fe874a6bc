// What shells offer for a command line of `tandem`: the program's answers, and each shell once.
#include <algorithm>
#include <set>
#include <sstream>

#include "base/process.hpp"
#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

const char kBin[] = TANDEM_BINARY_DIR "/bin";

class Completion : public Program {
 protected:
  /// The words of `tandem __complete WORDS`, and ":files".
  std::set<std::string> offered(const std::string& words) const {
    const Outcome outcome = tandem("__complete " + words);
    EXPECT_EQ(outcome.status, 0) << words << outcome.err;
    return lines_of(outcome.out);
  }
  static std::set<std::string> lines_of(const std::string& text) {
    std::set<std::string> all;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) all.insert(line.substr(0, line.find('\t')));
    return all;
  }
  /// What `shell -c SCRIPT` prints, with this build's `tandem` first in PATH.
  std::set<std::string> printed(const std::string& shell, const std::string& script) const {
    write_text(folder_ / "script", script);
    const std::string command = "cd " + shell_word(folder_.string()) +
                                " && HOME=" + shell_word(folder_.string()) +
                                " XDG_CONFIG_HOME= XDG_DATA_HOME= PATH=" + shell_word(kBin) +
                                ":\"$PATH\" " + shell + " script >out.txt 2>err.txt </dev/null";
    EXPECT_EQ(std::system(command.c_str()), 0) << read_text(folder_ / "err.txt");
    return lines_of(read_text(folder_ / "out.txt"));
  }
  static std::string script_of(const std::string& shell) {
    return shell_word(TANDEM_SOURCE_DIR "/scripts/completion." + shell);
  }
};

TEST_F(Completion, OffersCommandsAndTheirSubcommands) {
  const auto commands = offered("''");
  for (const char* command : {"run", "check", "model", "joint", "help", "doctor"})
    EXPECT_TRUE(commands.contains(command)) << command;
  EXPECT_FALSE(commands.contains("__complete"));
  EXPECT_EQ(offered("ru"), std::set<std::string>{"run"});
  EXPECT_TRUE(offered("model ''").contains("build"));
  EXPECT_TRUE(offered("joint m").contains("move"));
  EXPECT_TRUE(offered("help m").contains("machine"));  // a task
  EXPECT_TRUE(offered("help m").contains("model"));
  EXPECT_EQ(offered("help model b"), std::set<std::string>{"build"});
}

TEST_F(Completion, OffersFlagsAndTheirChoices) {
  const auto flags = offered("run --");
  for (const char* flag : {"--rate", "--hal", "--no-log", "--studio", "--help"})
    EXPECT_TRUE(flags.contains(flag)) << flag;
  EXPECT_FALSE(offered("report --").contains("--after-run"));  // which no help shows
  const std::set<std::string> backends{"can", "dds", "ethercat", "sim"};
  EXPECT_EQ(offered("run --hal ''"), backends);
  EXPECT_EQ(offered("run coman/squat --hal s"), std::set<std::string>{"sim"});
  EXPECT_EQ(offered("run --hal=e"), std::set<std::string>{"--hal=ethercat"});
  EXPECT_TRUE(offered("joint set LElbj --mode ''").contains("torque"));
  EXPECT_TRUE(offered("run --rate ''").empty());  // any number
  EXPECT_TRUE(offered("run --no-such-flag=").empty());
}

TEST_F(Completion, OffersBundledNamesAndFiles) {
  const auto squats = offered("run coman/sq");
  EXPECT_TRUE(squats.contains("coman/squat"));
  EXPECT_TRUE(squats.contains(":files"));
  EXPECT_FALSE(offered("run ''").contains("coman"));  // which is no experiment
  EXPECT_TRUE(offered("model info ''").contains("coman"));
  EXPECT_TRUE(offered("sweep ''").contains("studies/coman_push"));
  EXPECT_TRUE(offered("sweep ''").contains("status"));
  EXPECT_TRUE(offered("check ''").contains("panda"));
  EXPECT_TRUE(offered("controller new nod --robot ''").contains("double_pendulum"));
  EXPECT_EQ(offered("report ''"), std::set<std::string>{":files"});
  EXPECT_TRUE(offered("clock show ''").empty());  // takes no argument
  EXPECT_TRUE(offered("run x.toml ''").empty());  // has its one
  EXPECT_FALSE(offered("run -- --").contains("--rate"));
}

TEST_F(Completion, AnswersToNonsense) {
  EXPECT_TRUE(offered("").empty());
  EXPECT_TRUE(offered("no such command ''").empty());
  EXPECT_TRUE(offered("--hal= '=' \"$(printf '\\t\\377')\"").empty());
}

TEST_F(Completion, InBash) {
  const auto line = [&](const std::string& words, int at) {
    return printed("bash --norc",
                   "source " + script_of("bash") + "\nCOMP_WORDS=(" + words +
                       ") COMP_CWORD=" + std::to_string(at) +
                       "\n_tandem\nprintf '%s\\n' \"${COMPREPLY[@]}\"\ncomplete -p tandem");
  };
  const auto commands = line("tandem mod", 1);
  EXPECT_TRUE(commands.contains("model"));
  EXPECT_TRUE(commands.contains("complete -F _tandem tandem"));
  EXPECT_TRUE(line("tandem run --hal = s", 4).contains("sim"));
  EXPECT_TRUE(line("tandem run --hal =", 3).contains("can"));
  const auto files = line("tandem run h", 2);
  EXPECT_TRUE(files.contains("hold.toml")) << "of the folder";
  EXPECT_TRUE(line("tandem run coman/sq", 2).contains("coman/squat"));
}

TEST_F(Completion, InZsh) {
  if (!program_exists("zsh")) GTEST_SKIP() << "there is no zsh";
  const auto found =
      printed("zsh -f",
              "_describe() { printf '%s\\n' \"${(@P)2}\"; }\n_files() { print FILES; }\n"
              "words=(tandem run coman/sq) CURRENT=3\nsource " +
                  script_of("zsh"));
  EXPECT_TRUE(found.contains("coman/squat:bundled")) << read_text(folder_ / "out.txt");
  EXPECT_TRUE(found.contains("FILES"));
  const auto choices =
      printed("zsh -f",
              "_describe() { printf '%s\\n' \"${(@P)2}\"; }\n_files() { print FILES; }\n"
              "words=(tandem run --hal '') CURRENT=4\nsource " +
                  script_of("zsh"));
  EXPECT_TRUE(choices.contains("sim:")) << read_text(folder_ / "out.txt");
  EXPECT_FALSE(choices.contains("FILES"));
}

TEST_F(Completion, InFish) {
  if (!program_exists("fish")) GTEST_SKIP() << "there is no fish";
  const std::string source = "source " + script_of("fish") + "\n";
  const auto found = printed("fish --no-config", source + "complete -C 'tandem run coman/sq'");
  EXPECT_TRUE(found.contains("coman/squat")) << read_text(folder_ / "out.txt");
  EXPECT_TRUE(
      printed("fish --no-config", source + "complete -C 'tandem run h'").contains("hold.toml"));
  EXPECT_EQ(printed("fish --no-config", source + "complete -C 'tandem run --hal s'"),
            std::set<std::string>{"sim"});
}

}  // namespace
}  // namespace tandem::apps
