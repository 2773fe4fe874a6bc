// A simulated robot that is not the model: what the log, the run, the report and `check` say of it.
#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

constexpr char kPayloads[] =
    "[[sim.payload]]\nname = 'lead'\nlink = 'link1'\nmass_kg = 0.05\n"
    "[[sim.payload]]\nname = 'box'\nlink = 'link2'\nmass_kg = 0.1\nfrom_s = 0.6\nuntil_s = 0.9\n";

class ChangedPlant : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    write_text(folder_ / "p.toml", read_text(folder_ / "trajectory.toml") + kPayloads);
  }
  static void expect_in(const std::string& text, const std::vector<std::string>& parts) {
    for (const std::string& part : parts)
      EXPECT_NE(text.find(part), std::string::npos) << part << "\nin: " << text;
  }
};

// It was one event, "injected payload of joint2": no name, no drop, and nothing of what is there
// for good.
TEST_F(ChangedPlant, IsInEventsTableJsonAndReport) {
  const Outcome run = tandem("run p.toml --duration 1 --log l --report --json j.json");
  ASSERT_EQ(run.status, 0) << run.err;
  expect_in(run.out, {"payload lead, 0.05 kg on link1, from the start; payload box, 0.1 kg on "
                      "link2, from 0.6 s to 0.9 s"});
  EXPECT_EQ(json("j.json")["plant"][1], "payload box, 0.1 kg on link2, from 0.6 s to 0.9 s");
  const std::string events = tandem("log csv l/double_pendulum-p-001.mcap --topic event").out;
  expect_in(events, {"0,0,payload picked up,-1,1,\"payload picked up: lead, 0.05 kg on link1\"",
                     "payload picked up,-1,2,\"payload picked up: box, 0.1 kg on link2\"",
                     "payload dropped,-1,2,\"payload dropped: box\""});
  EXPECT_EQ(events.find("injected"), std::string::npos) << events;
  expect_in(read_text(folder_ / "l/double_pendulum-p-001/report.html"),
            {"picked up: box, 0.1 kg on link2, at 0.600 s", "dropped: box, at 0.900 s"});
}

// The page had the payloads' events alone.
TEST_F(ChangedPlant, IsATableOfTheReport) {
  write_text(folder_ / "c.toml", read_text(folder_ / "p.toml") +
                                     "[sim.link.link1]\nmass_kg = 1.5\n[sim.joint.joint1]\n"
                                     "friction_Nm = 0.1\n");
  const Outcome run = tandem("run c.toml --duration 0.3 --log l --report -q");
  ASSERT_EQ(run.status, 0) << run.err;
  expect_in(read_text(folder_ / "l/double_pendulum-c-001/report.html"),
            {"<h2>The simulated robot is other than the model</h2>",
             "<tr><td>link link1</td><td>mass_kg = 1.5</td></tr>",
             "<tr><td>joint joint1</td><td>friction_Nm = 0.1</td></tr>",
             "<tr><td>payload lead</td><td>0.05 kg on link1, from the start</td></tr>",
             "<tr><td>payload box</td><td>0.1 kg on link2, from 0.6 s to 0.9 s</td></tr>"});
  expect_in(tandem("log info l/double_pendulum-c-001.mcap").out,
            {"plant is other in", "link link1: mass_kg = 1.5"});
  ASSERT_EQ(tandem("run trajectory.toml --duration 0.3 --log l --report -q").status, 0);
  EXPECT_EQ(read_text(folder_ / "l/double_pendulum-trajectory-001/report.html").find("is other"),
            std::string::npos);
}

// One that a run is given has no name.
TEST_F(ChangedPlant, OfAScenarioHasItsMassAndLink) {
  write_text(
      folder_ / "s.toml",
      "[[fault]]\nkind = 'payload'\nlink = 'link2'\nmass_kg = 0.2\nat_s = 0.5\nfor_s = 0.1\n");
  const Outcome run = tandem("run hold.toml --duration 1 --log l --scenario s.toml -q");
  ASSERT_EQ(run.status, 0) << run.err;
  expect_in(tandem("log csv l/double_pendulum-hold-001.mcap --topic event").out,
            {"\"payload picked up: 0.2 kg on link2\"", "\"payload dropped: 0.2 kg on link2\""});
}

// `check` said nothing of it, and of 100 s only the run warned, without a name.
TEST_F(ChangedPlant, IsListedByCheckWhichWarnsOfTimesAfterTheEnd) {
  write_text(folder_ / "late.toml",
             read_text(folder_ / "p.toml") +
                 "[[sim.payload]]\nname = 'late'\nlink = 'link2'\nmass_kg = 1\nfrom_s = 100\n"
                 "[sim.link.link1]\nmass_kg = 1.5\n[sim.joint.joint1]\nfriction_Nm = 0.1\n");
  const Outcome check = tandem("check late.toml --json c.json");
  EXPECT_EQ(check.status, 0) << check.err;
  expect_in(check.out, {"link link1: mass_kg = 1.5", "joint joint1: friction_Nm = 0.1",
                        "payload box, 0.1 kg on link2, from 0.6 s to 0.9 s"});
  expect_in(check.err, {"late, 1 kg on link2 is never picked up", "100 s after the first SYNC"});
  EXPECT_EQ(check.err.find("box"), std::string::npos) << check.err;
  EXPECT_EQ(json("c.json")["plant"].size(), 5U);
  const Outcome run = tandem("run late.toml --duration 0.2 --no-log");
  expect_in(run.err + run.out, {"the payload late, 1 kg on link2 was never picked up"});
}

// 1600 kg in the place of 1.6 passed without a word.
TEST_F(ChangedPlant, IsWarnedOfWhereItIsHeavierThanTheRobot) {
  write_text(folder_ / "heavy.toml",
             read_text(folder_ / "trajectory.toml") +
                 "[[sim.payload]]\nname = 'box'\nlink = 'link2'\nmass_kg = 1600\nfrom_s = 100\n");
  const std::string says = "1600 kg on link2 is heavier than the whole robot, 0.701 kg";
  for (const std::string command : {"check heavy.toml", "run heavy.toml --duration 0.2 --no-log"}) {
    const Outcome outcome = tandem(command);
    expect_in(outcome.err, {"heavy.toml:", "mass_kg: " + says});
  }
  write_text(folder_ / "s.toml",
             "[[fault]]\nkind = 'payload'\nlink = 'link2'\nmass_kg = 1600\nat_s = 100\n");
  expect_in(tandem("run hold.toml --duration 0.2 --no-log --scenario s.toml").err,
            {"s.toml: ", says});
  const Outcome light = tandem("check p.toml");
  EXPECT_EQ(light.status, 0) << light.err;
  EXPECT_EQ(light.err.find("heavier"), std::string::npos) << light.err;
}

// 3 kg on the trunk of COMAN were "+9.5 %" of the weight.
TEST_F(ChangedPlant, HasTheWeightThatTheGroundCarries) {
  const std::string coman = TANDEM_SOURCE_DIR "/config/coman/";
  const auto ground = [&](const std::string& name, const std::string& times) {
    write_text(folder_ / (name + ".toml"),
               "robot = '" + coman +
                   "robot.toml'\nposture = 'stand'\nduration_s = 1.0\n[[controller]]\nplugin = "
                   "'hold'\n" +
                   times);
    const Outcome run = tandem("run " + name + ".toml --log l -q --json " + name + ".json");
    EXPECT_EQ(run.status, 0) << run.err;
    return json(name + ".json")["ground"];
  };
  const std::string box = "[[sim.payload]]\nname = 'box'\nlink = 'DWYTorso'\nmass_kg = 3\n";
  const double alone_N = ground("alone", "")["weight_N"];
  const auto always = ground("always", box);
  EXPECT_NEAR(always["weight_N"].get<double>() - alone_N, 3 * 9.81, 0.01);
  EXPECT_NEAR(always["mean_vertical_force_N"].get<double>() / always["weight_N"].get<double>(), 1.0,
              0.01);
  const auto while_it_runs = ground("later", box + "from_s = 1.5\n");
  const double more_N = while_it_runs["weight_N"].get<double>() - alone_N;
  EXPECT_GT(more_N, 5.0);
  EXPECT_LT(more_N, 25.0);
  EXPECT_NEAR(while_it_runs["mean_vertical_force_N"].get<double>() /
                  while_it_runs["weight_N"].get<double>(),
              1.0, 0.01);
  expect_in(tandem("log info l/coman-always-001.mcap").out, {"weight_N"});
  EXPECT_EQ(tandem("log info l/coman-alone-001.mcap").out.find("weight_N"), std::string::npos);
}

// The ground's damping was blamed.
TEST_F(ChangedPlant, IsBlamedForASubStepThatTheDescribedRobotCanTake) {
  write_text(folder_ / "c.toml", "robot = \"" TANDEM_SOURCE_DIR
                                 "/config/coman/robot.toml\"\nposture = 'stand'\nduration_s = 1.0\n"
                                 "[[controller]]\nplugin = 'hold'\n[sim.link.DWYTorso]\n"
                                 "mass_kg = 1e6\n");
  const Outcome check = tandem("check c.toml");
  EXPECT_EQ(check.status, 2);
  expect_in(check.err, {"c.toml:", "sim.link: ", "link DWYTorso: mass_kg = 1e+06"});
  EXPECT_EQ(check.err.find("contact."), std::string::npos) << check.err;
}

// "has no topic", with a foreign one as the hint.
TEST_F(ChangedPlant, AndItsLogSaysWhatItLeavesOut) {
  write_text(folder_ / "less.toml", read_text(folder_ / "hold.toml") +
                                        "\n[log]\nstate_every = 0\nviewers = false\n"
                                        "without = ['command.torque_nm']\n");
  ASSERT_EQ(tandem("run less.toml --duration 0.1 -q --log l").status, 0);
  const std::string log = " l/double_pendulum-less-001.mcap";
  expect_in(tandem("log csv" + log).err, {"this log leaves it out ([log] state_every = 0)"});
  expect_in(tandem("log csv" + log + " --topic tf").err, {"[log] viewers = false"});
  expect_in(tandem("report" + log).err, {"this log leaves it out ([log] state_every = 0)"});
  expect_in(tandem("log csv" + log + " --topic command --fields torque_nm").err,
            {"([log] without = [\"command.torque_nm\"])"});
  ASSERT_EQ(tandem("run hold.toml --duration 0.1 -q --log l").status, 0);
  const std::string whole = "log info l/double_pendulum-hold-001.mcap --topic ";
  expect_in(tandem(whole + "tff").err, {"did you mean '/tf'?"});
}

}  // namespace
}  // namespace tandem::apps
