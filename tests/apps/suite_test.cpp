// `tandem run` and `tandem test` with experiments that say what they expect.
#include <map>
#include <thread>

#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

class Suite : public Program {
 protected:
  /// An experiment of `name` with these rows.
  void expects(const std::string& name, const std::string& rows) const {
    write_text(folder_ / (name + ".toml"), read_text(folder_ / "hold.toml") + "\n" + rows);
  }
  void SetUp() override {
    Program::SetUp();
    std::filesystem::remove(folder_ / "trajectory.toml");
  }
};

constexpr char kGood[] =
    "[[expect]]\nname = \"slow\"\nalways = \"abs(velocity(joint1)) < 1000rad/s\"\n";
constexpr char kBad[] =
    "[[expect]]\nname = \"fast\"\neventually = \"velocity(joint1) > 1000rad/s\"\n";

TEST_F(Suite, ARunTellsItsMarginsAndFailsWithOne) {
  expects("good", kGood);
  const Outcome good = tandem("run good.toml --json good.json --log .");
  EXPECT_EQ(good.status, 0) << good.err;
  const auto one = json("good.json")["expectations"];
  ASSERT_EQ(one.size(), 1U);
  EXPECT_EQ(one[0]["name"], "slow");
  EXPECT_EQ(one[0]["passed"], true);
  EXPECT_EQ(one[0]["unit"], "rad/s");
  EXPECT_GT(one[0]["margin"], 900.0);
  EXPECT_LT(one[0]["margin"], 1000.0 + 1e-9);
  EXPECT_NE(good.out.find("slow"), std::string::npos) << good.out;
  std::string log;
  for (const auto& entry : std::filesystem::directory_iterator(folder_))
    if (entry.path().extension() == ".mcap") log = entry.path().filename().string();
  const Outcome info = tandem("log info " + log);
  EXPECT_NE(info.out.find("slow: passed, margin"), std::string::npos) << info.out << info.err;

  expects("bad", std::string(kGood) + kBad);
  const Outcome bad = tandem("run bad.toml --no-log --json bad.json");
  EXPECT_EQ(bad.status, 1);
  EXPECT_NE(bad.err.find("expected: fast: failed, it never held, margin -"), std::string::npos)
      << bad.err;
  EXPECT_EQ(json("bad.json")["expectations"][1]["passed"], false);
  EXPECT_TRUE(tandem("run hold.toml --no-log --json none.json").status == 0);
  EXPECT_TRUE(json("none.json")["expectations"].is_null());
}

TEST_F(Suite, AWrongNameIsFoundBeforeAnythingMoves) {
  expects("typo", "[[expect]]\nalways = \"velocty(joint1) < 1rad/s\"\n");
  for (const char* command : {"check typo.toml", "run typo.toml --no-log"}) {
    const Outcome outcome = tandem(command);
    EXPECT_EQ(outcome.status, 2) << command;
    EXPECT_NE((outcome.err + outcome.out).find("did you mean 'velocity'"), std::string::npos)
        << outcome.err;
  }
}

TEST_F(Suite, OneThatCrashesCostsThatOne) {
  std::filesystem::create_directories(folder_ / "suite");
  for (const char* file : {"double_pendulum.urdf", "robot.toml", "hold.toml"})
    std::filesystem::copy_file(folder_ / file, folder_ / "suite" / file);
  expects("suite/good", kGood);
  expects("suite/bad", std::string(kGood) + kBad);
  expects("suite/crashes", kGood);
  edit("suite/crashes.toml", "\"hold\"",
       "\"" TANDEM_BINARY_DIR "/tests/test_plugins/crashes_when_opened.so\"");
  write_text(folder_ / "suite/broken.toml", "robot = [");
  const Outcome outcome = tandem("test suite --jobs 3 --json suite.json --junit out/suite.xml");
  EXPECT_EQ(outcome.status, 1) << outcome.err;
  const auto suite = json("suite.json");
  EXPECT_EQ(suite["passed"], 1) << outcome.out << outcome.err;
  EXPECT_EQ(suite["failed"], 3);
  EXPECT_EQ(suite["skipped"], 1);
  std::map<std::string, nlohmann::json> tests;
  for (const auto& one : suite["tests"]) tests[one["file"]] = one;
  EXPECT_EQ(tests["suite/good.toml"]["passed"], true);
  EXPECT_EQ(tests["suite/bad.toml"]["expectations"].size(), 2U);
  EXPECT_EQ(tests["suite/bad.toml"]["reason"], "");
  EXPECT_NE(tests["suite/crashes.toml"]["reason"].dump().find("rash"), std::string::npos)
      << tests["suite/crashes.toml"]["reason"];
  EXPECT_NE(tests["suite/broken.toml"]["reason"].dump().find("not valid TOML"), std::string::npos);
  EXPECT_EQ(tests["suite/hold.toml"]["reason"], "it has no [[expect]], and nothing happens in it");
  EXPECT_TRUE(tests["suite/hold.toml"]["passed"].is_null());
  EXPECT_FALSE(tests.contains("suite/robot.toml")) << "it is no experiment";
  const std::string xml = read_text(folder_ / "out/suite.xml");
  EXPECT_NE(xml.find("<failure message=\"failed, it never held"), std::string::npos) << xml;
  EXPECT_NE(xml.find("<skipped message=\"it has no [[expect]], and nothing happens in it\"/>"),
            std::string::npos);
  EXPECT_EQ(xml.find("message=\"crashed\""), std::string::npos) << "each has ended";
  // The command that repeats it does so.
  const std::string again = tests["suite/bad.toml"]["command"];
  ASSERT_TRUE(again.starts_with("tandem "));
  EXPECT_EQ(tandem(again.substr(7)).status, 1);
}

TEST_F(Suite, OneThatHangsIsEndedAndIsCrashedUntilThen) {
  expects("hangs", kGood);
  edit("hangs.toml", "duration_s = ", "duration_s = \"endless\" # ");
  // The first XML that is there at all.
  const std::string look = "cd " + shell_word(folder_.string()) +
                           " && for i in $(seq 3000); do test -e x.xml && cp x.xml begin.xml && "
                           "exit; sleep 0.01; done";
  std::thread looking([&look] { EXPECT_EQ(std::system(look.c_str()), 0); });
  const Outcome outcome = tandem("test hangs.toml --timeout 0.5 --junit x.xml");
  looking.join();
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.err.find("it was ended after 0.5 s"), std::string::npos) << outcome.err;
  EXPECT_NE(read_text(folder_ / "begin.xml").find("<error message=\"crashed\"/>"),
            std::string::npos);
  const std::string end = read_text(folder_ / "x.xml");
  EXPECT_EQ(end.find("message=\"crashed\""), std::string::npos) << end;
  EXPECT_NE(end.find("<error message=\"it was ended after 0.5 s\">"), std::string::npos) << end;
}

TEST_F(Suite, OfTheBundledRobotsPasses) {
  const Outcome outcome =
      tandem("test --json suite.json " + shell_word(TANDEM_SOURCE_DIR "/config/suite"));
  EXPECT_EQ(outcome.status, 0) << outcome.out << outcome.err;
  EXPECT_EQ(json("suite.json")["passed"], 7);
}

TEST_F(Suite, RefusesWhatIsNoSuite) {
  for (const char* wrong : {"", "nowhere", "hold.toml", "robot.toml", "--jobs 0 .", "--timeout 0 .",
                            "--timeout no .", "--junit '' ."}) {
    const Outcome outcome = tandem(std::string("test ") + wrong);
    EXPECT_EQ(outcome.status, 2) << wrong << outcome.err;
    EXPECT_FALSE(outcome.err.empty()) << wrong;
  }
}

}  // namespace
}  // namespace tandem::apps
