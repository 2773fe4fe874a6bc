// What `tandem joint move` and `joint stop` say where nothing moves: of a joint at rest, while
// simulated time is paused, and before controllers run.
#include "tests/apps/background.hpp"
#include "tests/apps/running.hpp"
#include "tests/support/eventually.hpp"

namespace tandem::apps {
namespace {

class JointAtRest : public Running {
 protected:
  static void expect(const std::string& text, const std::string& words) {
    EXPECT_NE(text.find(words), std::string::npos) << "'" << words << "' is not in: " << text;
  }
  [[nodiscard]] nlohmann::json joint1() const {
    const Outcome list = to_run("joint list joint1 --json -");
    return nlohmann::json::parse(list.out, nullptr, false)["joints"][0];
  }
  /// What Ctrl-C leaves of a motion that is waited for: once the command has said what it waits
  /// for.
  [[nodiscard]] Outcome interrupted_move() const {
    return tandem("joint move joint1 --to 0.3 --wait --socket " + socket_,
                  R"(sh -c '"$@" & for i in $(seq 400); do grep -q "will move" out.txt && break;)"
                  R"( sleep 0.05; done; kill -INT $!; wait $!' sh)");
  }
  void begin_paused() {
    begin("");
    EXPECT_EQ(to_run("controller stop hold").status, 0);
    EXPECT_EQ(to_run("clock pause").status, 0);
  }
};

// It had said "its motion to 0.3 rad has ended"; the joint moved once the run went on.
TEST_F(JointAtRest, WhileTimeIsPausedHasNotBegunItsMotion) {
  begin_paused();
  const Outcome move = interrupted_move();
  EXPECT_EQ(move.status, 1);
  expect(move.out,
         "asked for; it will happen in the loop's next cycle, or be refused by it, as time "
         "stands: then the run's output and its log tell");
  expect(move.out, "joint1 will move from ");
  expect(move.err,
         "joint1 has not begun to move to 0.3 rad: it begins when the run goes on (tandem clock "
         "resume); `tandem joint stop joint1` takes the motion back");
  EXPECT_EQ(to_run("clock step 1").status, 0);
  EXPECT_EQ(joint1()["moving"], true) << "what was accepted stands";
  EXPECT_EQ(end(), 0);
}

TEST_F(JointAtRest, WhileTimeIsPausedIsKeptThereByAStop) {
  begin_paused();
  const double before = joint1()["commanded_position_rad"];
  EXPECT_EQ(interrupted_move().status, 1);
  const Outcome stop = to_run("joint stop joint1");
  EXPECT_EQ(stop.status, 0) << stop.err;
  expect(stop.out, "joint1 brakes then; a motion that has not begun is taken back");
  EXPECT_EQ(to_run("clock step 100").status, 0);
  const nlohmann::json joint = joint1();
  EXPECT_EQ(joint["moving"], false) << joint;
  EXPECT_NEAR(joint["commanded_position_rad"], before, 1e-3);
  EXPECT_EQ(end(), 0);
}

// It had said that the joint brakes.
TEST_F(JointAtRest, DoesNotBrake) {
  begin("");
  EXPECT_EQ(to_run("controller stop hold").status, 0);
  EXPECT_EQ(to_run("joint stop joint1").out.find("brakes"), std::string::npos);
  expect(to_run("joint stop joint1").out, "joint1 is at rest");
  EXPECT_EQ(end(), 0);
}

// The waiting had gone on for as long as the joint, which nothing held any more, swung.
TEST_F(JointAtRest, HasNotArrivedWhenAFaultEndsItsMotion) {
  begin("--on-fault wait");
  EXPECT_EQ(to_run("controller stop hold").status, 0);
  Background move(folder_, "joint move joint1 --to 3 --speed 0.001 --wait --socket " + socket_,
                  "move");
  EXPECT_TRUE(test::eventually([&] { return joint1().value("moving", false); }));
  EXPECT_EQ(to_run("estop --category 0").status, 0);
  EXPECT_TRUE(test::eventually([&] { return move.ended(); }));
  EXPECT_EQ(move.status(), 1);
  const std::string said = read_text(folder_ / "move.err");
  expect(said, "its motion to 3 rad has ended at ");
  expect(said, "its drive is not enabled any more: tandem fault show");
  EXPECT_EQ(end(), 1);
}

// `joint move --wait` had said that it has arrived, 4 rad off.
TEST_F(JointAtRest, WithoutStiffnessIsNotSentAnywhere) {
  begin("");
  EXPECT_EQ(to_run("controller stop hold").status, 0);
  EXPECT_EQ(to_run("joint set joint1 --interaction compliant --stiffness 0").status, 0);
  const Outcome move = to_run("joint move joint1 --to 0.3 --wait");
  EXPECT_EQ(move.status, 2);
  expect(move.err,
         "joint1: is compliant without stiffness: nothing would move it (tandem joint "
         "set joint1 --stiffness, or --interaction stiff)");
  EXPECT_EQ(end(), 0);
}

// It had been sent to `tandem fault reset`, which had nothing to reset.
TEST_F(JointAtRest, UntilTheRobotHasSettledIsNotSentToAFault) {
  edit("hold.toml", "[[controller]]", "[hal]\nsettle_s = 600.0\n\n[[controller]]");
  start("--rate 20 --duration 2000");
  until(R"("phase": "settling")");
  expect(to_run("joint move joint1 --to 0.3").err,
         "joint1: the joints are held until the robot has settled at its start (wait a moment, "
         "then ask again)");
  EXPECT_EQ(end(), 0);
}

}  // namespace
}  // namespace tandem::apps
