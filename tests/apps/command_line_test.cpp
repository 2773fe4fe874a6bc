// Help that teaches, and messages for what was mistyped.
#include <algorithm>
#include <cstdlib>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

class CommandLine : public Program {};

TEST_F(CommandLine, HelpShowsEveryCommandWithExamples) {
  const Outcome outcome = tandem("--help");
  EXPECT_EQ(outcome.status, 0);
  for (const std::string text : {"run", "check", "model", "log", "report", "--version",
                                 "tandem run config/coman/squat.toml", "Exit status"}) {
    EXPECT_NE(outcome.out.find(text), std::string::npos) << text;
  }
}

TEST_F(CommandLine, HelpOfACommandHasExamplesOfItsOwn) {
  const Outcome outcome = tandem("model build --help");
  EXPECT_EQ(outcome.status, 0);
  EXPECT_NE(outcome.out.find("tandem model build config/coman/robot.toml"), std::string::npos);
}

// Those with subcommands had the program's examples.
TEST_F(CommandLine, HelpOfACommandWithSubcommandsHasAnExampleOfEach) {
  const std::map<std::string, std::vector<std::string>> subcommands{
      {"log", {"info", "csv", "diff", "thresholds", "import", "replay"}},
      {"model", {"build", "info"}},
      {"bench", {"engines"}},
      {"fault", {"show", "reset"}},
      {"topic", {"list", "echo", "hz"}}};
  for (const auto& [command, names] : subcommands) {
    const Outcome outcome = tandem(command + " --help");
    for (const std::string& name : names) {
      const std::string example = "tandem " + command + " " + name;
      EXPECT_NE(outcome.out.find("\n  " + example), std::string::npos) << example;
    }
    EXPECT_EQ(outcome.out.find("\n  tandem run config/coman/squat.toml"), std::string::npos);
  }
}

/// The widest line of a text, in columns.
std::size_t widest_line(const std::string& text) {
  std::istringstream lines(text);
  std::size_t widest = 0;
  for (std::string line; std::getline(lines, line);) {
    const auto columns = std::ranges::count_if(line, [](char c) { return (c & '\xC0') != '\x80'; });
    widest = std::max(widest, static_cast<std::size_t>(columns));
  }
  return widest;
}

/// The commands that a help lists: "joint" of tandem's, "move" of that.
std::vector<std::string> listed(const std::string& help) {
  std::vector<std::string> names;
  std::istringstream lines(help);
  bool lists = false;
  for (std::string line; std::getline(lines, line);) {
    if (line.empty() || line[0] != ' ')
      lists = line.starts_with("Subcommands") || line.find("(`tandem help") != std::string::npos;
    else if (lists && line[2] != ' ')
      names.push_back(line.substr(2, line.find(' ', 2) - 2));
  }
  return names;
}

// Its lines had up to 222 columns.
TEST_F(CommandLine, HelpOfEveryCommandFitsTheTerminal) {
  for (const std::string columns : {"", "COLUMNS=60", "COLUMNS=200"}) {
    const std::size_t most = columns == "COLUMNS=60" ? 60 : columns.empty() ? 80 : 120;
    const std::string all = tandem("--help", columns).out;
    EXPECT_LE(widest_line(all), most);
    EXPECT_GT(listed(all).size(), 30U);
    for (const std::string& command : listed(all)) {
      const std::string help = tandem(command + " --help", columns).out;
      EXPECT_LE(widest_line(help), most) << help;
      if (!columns.empty()) continue;
      for (const std::string& verb : listed(help))
        EXPECT_LE(widest_line(tandem(command + " " + verb + " --help").out), most) << verb;
    }
  }
}

TEST_F(CommandLine, HelpHasEveryCommandUnderATask) {
  const std::string see = tandem("help see").out;
  EXPECT_TRUE(see.starts_with("See what it does (`tandem help see`):\n")) << see;
  for (const char* name : {"top", "studio", "report", "topic"})
    EXPECT_EQ(std::ranges::count(listed(see), name), 1) << name;
  EXPECT_EQ(std::ranges::count(listed(tandem("help debug").out), "clock"), 1);
  EXPECT_NE(tandem("help test").out.find("Test it: also check, sweep"), std::string::npos);
}

TEST_F(CommandLine, AnExampleIsOneCommandHoweverNarrowTheTerminalIs) {
  const std::string help = tandem("controller load --help", "COLUMNS=40").out;
  EXPECT_NE(help.find("  tandem controller load hold \\\n      --name rest \\\n"
                      "      --set 'duration_s = 2.0'\n"),
            std::string::npos)
      << help;
}

TEST_F(CommandLine, HelpMayComeFirst) {
  for (const std::string command : {"", "model build"}) {
    const Outcome outcome = tandem("help " + command);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_EQ(outcome.out, tandem(command + " --help").out);
  }
  const Outcome unknown = tandem("help joint mvoe");
  EXPECT_EQ(unknown.status, 2);
  EXPECT_EQ(unknown.out, "");
  EXPECT_NE(unknown.err.find("unknown command 'mvoe': did you mean 'move'?"), std::string::npos)
      << unknown.err;
  EXPECT_EQ(tandem("help nonsense").status, 2);
}

TEST_F(CommandLine, ABundledRobotThatIsMissedByALetterIsSuggested) {
  const Outcome outcome = tandem("new nothing.urdf --like comman");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("did you mean 'coman'?"), std::string::npos) << outcome.err;
}

TEST_F(CommandLine, VersionIsPrinted) {
  const Outcome outcome = tandem("--version");
  EXPECT_EQ(outcome.status, 0);
  EXPECT_TRUE(outcome.out.starts_with("tandem 0.")) << outcome.out;
}

TEST_F(CommandLine, AnUnknownFlagSuggestsTheNearest) {
  const Outcome outcome = tandem("run hold.toml --sede 3");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("unknown flag '--sede': did you mean '--seed'?"), std::string::npos)
      << outcome.err;
}

TEST_F(CommandLine, AnUnknownCommandSuggestsTheNearest) {
  const Outcome outcome = tandem("rnu hold.toml");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("unknown command 'rnu': did you mean 'run'?"), std::string::npos)
      << outcome.err;
}

// The help of all of `tandem` was the answer, with status 0.
TEST_F(CommandLine, HelpOfAnUnknownCommandIsRefused) {
  const Outcome outcome = tandem("nonsense --help");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_EQ(outcome.out, "");
  EXPECT_NE(outcome.err.find("unknown command 'nonsense'"), std::string::npos) << outcome.err;
  EXPECT_NE(tandem("joint mvoe --help").err.find("did you mean 'move'?"), std::string::npos);
  EXPECT_EQ(tandem("joint mvoe -h").status, 2);
  for (const char* command : {"run --help hold.toml", "run hold.toml --help", "joint --help move",
                              "--help joint", "joint move --help", "run --seed --help"}) {
    EXPECT_EQ(tandem(command).err.find("unknown"), std::string::npos) << command;
  }
}

TEST_F(CommandLine, AnUnknownSubcommandSuggestsTheNearest) {
  const Outcome outcome = tandem("log csb some.mcap");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("did you mean 'csv'?"), std::string::npos) << outcome.err;
}

TEST_F(CommandLine, AMissingArgumentIsNamed) {
  const Outcome outcome = tandem("run");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("experiment"), std::string::npos) << outcome.err;
}

TEST_F(CommandLine, ARateBeyondItsRangeIsRefused) {
  EXPECT_EQ(tandem("run hold.toml --rate=-1").status, 2);
  EXPECT_EQ(tandem("run hold.toml --rate fast").status, 2);
}

// `log thresholds --from nan` gave thresholds, `excite --period nan` an experiment of nan seconds.
TEST_F(CommandLine, OfNumbersThatAreNotFiniteAreRefused) {
  for (const char* command :
       {"log thresholds a.mcap --from", "log thresholds a.mcap --per-hour",
        "log replay a.mcap --robot r.toml --out e.toml --from",
        "identify a.mcap --robot r --out o --cutoff", "excite r.toml --out e.toml --period",
        "excite r.toml --out e.toml --share", "predict --horizon", "clock rate",
        "run hold.toml --rate", "run hold.toml --duration", "joint move elbow",
        "topic hz /tf --wait"}) {
    for (const char* number : {"nan", "inf", "1e999"}) {
      const Outcome outcome = tandem(command + std::string(" ") + number);
      EXPECT_EQ(outcome.status, 2) << command;
      EXPECT_NE(outcome.err.find(number), std::string::npos) << command << ": " << outcome.err;
    }
  }
}

TEST_F(CommandLine, IsCompletedByBashFromItsHelp) {
  const auto completed = [this](const std::string& words, int word) {
    const std::string script =
        "source " + shell_word(TANDEM_SOURCE_DIR "/scripts/completion.bash") + "; COMP_WORDS=(" +
        shell_word(TANDEM_BINARY_DIR "/bin/tandem") + " " + words +
        ") COMP_CWORD=" + std::to_string(word) + "; _tandem; echo -n ${COMPREPLY[@]}";
    const std::string file = (folder_ / "completed.txt").string();
    EXPECT_EQ(std::system(("bash -c " + shell_word(script) + " > " + shell_word(file)).c_str()), 0);
    return read_text(file);
  };
  EXPECT_EQ(completed("joi", 1), "joint");
  EXPECT_EQ(completed("joint mo", 2), "move");
  EXPECT_EQ(completed("joint move elbow --sp", 4), "--speed");
  EXPECT_EQ(completed("joint move elbow --to 30deg --w", 6), "--wait");
}

// What `tandem` does without `tandem-tools`: a copy of it alone.
TEST_F(CommandLine, WithoutTheToolsItSaysWhatToBuildBeforeAnythingRuns) {
  std::filesystem::create_directory(folder_ / "bin");
  std::filesystem::copy_file(TANDEM_BINARY_DIR "/bin/tandem", folder_ / "bin/tandem");
  const auto alone = [this](const std::string& arguments) {
    const std::string command = "cd " + shell_word(folder_.string()) + " && bin/tandem " +
                                arguments + " >out.txt 2>err.txt </dev/null";
    const int raw = std::system(command.c_str());
    return Outcome{WIFEXITED(raw) ? WEXITSTATUS(raw) : -1, read_text(folder_ / "out.txt"),
                   read_text(folder_ / "err.txt")};
  };
  for (const char* command :
       {"log info a.mcap --json failed.json", "new double_pendulum.urdf", "doctor",
        "run hold.toml --duration 0.1 --log runs --report", "report a.mcap"}) {
    const Outcome outcome = alone(command);
    EXPECT_EQ(outcome.status, 2) << command;
    EXPECT_NE(outcome.err.find("bin/tandem-tools: "), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.err.find("--target tandem-tools"), std::string::npos) << outcome.err;
  }
  EXPECT_EQ(json("failed.json")["ok"], false);
  EXPECT_FALSE(has_log());
  EXPECT_EQ(alone("check robot.toml").status, 0);
  EXPECT_EQ(alone("log info --help").out, tandem("log info --help").out);
  EXPECT_NE(alone("log csb").err.find("did you mean 'csv'?"), std::string::npos);
}

TEST_F(CommandLine, TheToolsAloneRunNoRobot) {
  const std::string tools = shell_word(TANDEM_BINARY_DIR "/bin/tandem-tools");
  const std::string file = shell_word((folder_ / "said.txt").string());
  for (const char* command : {" run hold.toml", " clock show", " topic list"}) {
    const int raw = std::system((tools + command + " > " + file + " 2>&1").c_str());
    EXPECT_EQ(WEXITSTATUS(raw), 2) << command;
    EXPECT_NE(read_text(folder_ / "said.txt").find("say `tandem`"), std::string::npos) << command;
  }
  EXPECT_EQ(std::system((tools + " eds show --help > " + file).c_str()), 0);
}

TEST_F(CommandLine, RateAndRealTimeExcludeEachOther) {
  EXPECT_EQ(tandem("run hold.toml --rate 2 --realtime").status, 2);
}

TEST_F(CommandLine, ARunIsAskedByOneWay) {
  for (const char* command : {"estop", "fault show", "controller list", "joint list", "sensor list",
                              "clock show", "ask '{}'", "inject kind=bus_down"}) {
    const Outcome both = tandem(command + std::string(" --dds --socket /tmp/run.sock"));
    EXPECT_EQ(both.status, 2) << command;
    EXPECT_NE(both.err.find("--socket excludes --dds"), std::string::npos) << both.err;
    const Outcome domain = tandem(command + std::string(" --domain 7"));
    EXPECT_EQ(domain.status, 2) << command;
    EXPECT_NE(domain.err.find("--domain requires --dds"), std::string::npos) << domain.err;
  }
}

// The list was split at every comma.
TEST_F(CommandLine, ListsTakeNamesWithCommasByThemselves) {
  edit("double_pendulum.urdf", "\"joint1\"", "\"a,b\"");
  edit("robot.toml", "\"joint1\"", "\"a,b\"");
  edit("robot.toml", "names = [\"joint1\"", "names = [\"a,b\"");
  edit("robot.toml", "\njoint1 = 0.5", "\n\"a,b\" = 0.5");
  const std::string excite = "excite robot.toml --out e.toml --tries 1 --json e.json --joints ";
  const auto moved = [&](const std::string& joints) {
    const Outcome outcome = tandem(excite + joints);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return json("e.json")["joints"].dump();
  };
  EXPECT_EQ(moved("'a,b'"), R"(["a,b"])");
  EXPECT_EQ(moved("joint2 --joints 'a,b'"), R"(["a,b","joint2"])");
  EXPECT_EQ(moved("joint2,"), R"(["joint2"])");
  const Outcome split = tandem(excite + "'a,b,joint2'");
  EXPECT_EQ(split.status, 2);
  EXPECT_NE(split.err.find("no joint 'a'"), std::string::npos) << split.err;
}

}  // namespace
}  // namespace tandem::apps
