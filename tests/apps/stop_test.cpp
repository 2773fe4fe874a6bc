// Stops of a run whose loop hangs: what `tandem estop` answers.
#include "tests/apps/running.hpp"

namespace tandem::apps {
namespace {

class Stops : public Running {
 protected:
  /// hold.toml runs a controller that hangs for so long (0: for ever) in its 100th cycle.
  void hang(const std::string& for_s, const std::string& more = {}) const {
    edit("hold.toml", "plugin = \"hold\"",
         "name = \"lazy\"\nplugin = \"" TANDEM_BINARY_DIR
         "/tests/test_plugins/hangs.so\"\n[controller.parameters]\nfor_s = " +
             for_s + "\n" + more);
  }
};

TEST_F(Stops, AreConfirmedByTheLoopWithItsCycle) {
  begin("--on-fault wait");
  const Outcome asked = to_run("ask '{\"do\": \"estop\", \"category\": 0}'");
  const auto answer = nlohmann::json::parse(asked.out, nullptr, false);
  EXPECT_EQ(answer["confirmed"], true) << asked.out;
  EXPECT_GT(answer["cycle"], 100) << asked.out;
  EXPECT_NE(to_run("ask '{\"do\": \"status\"}'").out.find(R"("phase": "faulted")"),
            std::string::npos)
      << "what is confirmed is carried out";
  EXPECT_EQ(end(), 1);
}

// It had printed "emergency stop, category0" and returned 0.
TEST_F(Stops, AreNotConfirmedByALoopThatHangs) {
  hang("0.0");
  start("");
  until(R"("running_cycles": 99)");
  const Outcome stop = to_run("estop --category 0");
  EXPECT_EQ(stop.status, 1);
  EXPECT_EQ(stop.out, "");
  EXPECT_NE(stop.err.find("not confirmed by the loop within 1.01 s"), std::string::npos)
      << stop.err;
  signal("KILL");
  EXPECT_NE(join(), 0);
}

TEST_F(Stops, AreNotConfirmedByAProcessThatDoesNotAnswer) {
  begin("--on-fault wait");
  signal("STOP");
  const Outcome stop = to_run("estop");
  EXPECT_EQ(stop.status, 1);
  EXPECT_NE(stop.err.find("no answer in time"), std::string::npos) << stop.err;
  signal("CONT");
  until(R"("phase": "faulted")");
  EXPECT_EQ(end(), 1);
}

TEST_F(Stops, OfNoRunAreNoSuccess) { EXPECT_EQ(to_run("estop").status, 1); }

}  // namespace
}  // namespace tandem::apps
