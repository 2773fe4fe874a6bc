// `tandem clock` against a running `tandem run`.
#include <chrono>

#include "tests/apps/running.hpp"

namespace tandem::apps {
namespace {

class Clock : public Running {
 protected:
  [[nodiscard]] nlohmann::json clock(const std::string& command) const {
    const Outcome outcome = to_run("clock " + command + " --json -");
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out, nullptr, false);
  }
};

TEST_F(Clock, StartsPausedAndRunsExactlyTheCyclesOfAStep) {
  start("--start-paused --duration 2000");
  until(R"("paused": true)");
  auto answer = clock("show");
  EXPECT_EQ(answer["cycles"], 0);
  EXPECT_EQ(answer["clock"], "simulated");
  EXPECT_TRUE(answer["realtime_factor"].is_null());
  std::uint64_t expected = 0;
  for (const std::uint64_t n : {1, 10, 300}) {
    answer = clock("step " + std::to_string(n));
    expected += n;
    EXPECT_EQ(answer["cycles"], expected);
    EXPECT_EQ(answer["standing"], true);
    EXPECT_EQ(answer["pending_steps"], 0);
    EXPECT_DOUBLE_EQ(answer["time_s"].get<double>(), static_cast<double>(expected - 1) * 1e-3);
  }
  const Outcome table = to_run("clock show");
  for (const char* text :
       {"time      0.310000 s", "cycles    311", "clock     paused", "rate      free running"}) {
    EXPECT_NE(table.out.find(text), std::string::npos) << text << "\nin: " << table.out;
  }
  EXPECT_EQ(end(), 0) << "a run that is asked to end is not kept";
}

TEST_F(Clock, ChangesTheRateAndPausesWhileTheRunGoesOn) {
  begin("");
  EXPECT_EQ(clock("rate 2.5")["rate"], 2.5);
  EXPECT_TRUE(clock("show")["realtime_factor"].is_number());
  EXPECT_EQ(to_run("clock step").err,
            "error: time is running (pause it first: tandem clock pause)\n");
  const auto paused = clock("pause");
  EXPECT_EQ(paused["standing"], true);
  EXPECT_EQ(paused["dropped_steps"], 0);
  EXPECT_EQ(clock("show")["cycles"], paused["cycles"]);
  const auto start = std::chrono::steady_clock::now();
  EXPECT_EQ(clock("resume")["paused"], false);
  const std::uint64_t before = paused["cycles"];
  auto shown = clock("show");
  while (shown["cycles"].get<std::uint64_t>() < before + 100) shown = clock("show");
  // Simulated over real time: the real time is within what has passed here.
  const std::chrono::duration<double> here = std::chrono::steady_clock::now() - start;
  const auto cycles = static_cast<double>(shown["cycles"].get<std::uint64_t>() - before - 2);
  EXPECT_GE(shown["realtime_factor"].get<double>(), cycles * 1e-3 / here.count());
  EXPECT_EQ(end(), 0);
}

TEST_F(Clock, GoesBackAndOnAgain) {
  start("--start-paused --duration 2000");
  until(R"("paused": true)");
  (void)clock("step 1500");
  const auto before = to_run("joint list joint2 --json -").out;
  auto answer = clock("rewind 0.5s");
  EXPECT_DOUBLE_EQ(answer["time_s"].get<double>(), 0.999);
  EXPECT_DOUBLE_EQ(answer["from_s"].get<double>(), 1.499);
  EXPECT_EQ(answer["past"]["from_s"], 0.0);
  EXPECT_NE(to_run("joint list joint2 --json -").out, before);
  answer = clock("goto 250ms");
  EXPECT_DOUBLE_EQ(answer["time_s"].get<double>(), 0.25);
  answer = clock("step --to 1.499s");
  EXPECT_DOUBLE_EQ(answer["time_s"].get<double>(), 1.499);
  EXPECT_EQ(to_run("joint list joint2 --json -").out, before);
  answer = clock("back-until 'phase() == running'");
  const double begins_s = answer["time_s"].get<double>();
  EXPECT_GT(begins_s, 0.01);
  (void)clock("goto " + std::to_string(begins_s - 0.001));
  answer = clock("until 'phase() == running'");
  EXPECT_DOUBLE_EQ(answer["time_s"].get<double>(), begins_s);
  struct {
    const char* asked;
    const char* says;
  } const refused[]{
      {"goto 7s", "7 s is not there yet; the run has reached"},
      {"goto -1s", "time_s: -1 s is no time of the run"},
      {"rewind 0", "by_s: goes back by more than 0 s"},
      {"rewind -1s", "by_s: goes back by more than 0 s"},
      {"rewind 5min", "the run has begun only "},
      {"goto soon", "time: 'soon' is no time (write 2.5s, 300ms, 1min, or a number of seconds)"},
      {"step --to 0.001", "has been: it is"},
      {"until 'torqu(joint2) > 1Nm'", "did you mean 'torque'"},
      {"back-until 'torque(joint2) > 1e6 Nm'", "it has not become true since 0 s"}};
  for (const auto& [asked, says] : refused) {
    const Outcome outcome = to_run(std::string("clock ") + asked);
    EXPECT_NE(outcome.err.find(says), std::string::npos) << asked << ": " << outcome.err;
  }
  EXPECT_EQ(end(), 0);
}

// What holds already was waited for in silence.
TEST_F(Clock, SaysThatAConditionWaitsAndThatItHoldsNow) {
  start("--rate 20 --start-paused --duration 2000");
  until(R"("paused": true)");
  (void)clock("step 100");
  const Outcome asked = to_run(R"(ask '{"do": "clock.until", "condition": "time() < 1000 s"}')");
  const auto answer = nlohmann::json::parse(asked.out, nullptr, false);
  EXPECT_EQ(answer["waits"], true) << asked.out;
  EXPECT_EQ(answer["note"], "it holds now, so it has to end first");
  EXPECT_EQ(clock("rewind 1ms")["standing"], true) << "which gives it up";
  (void)clock("goto 0.05s");
  const Outcome stands = to_run("clock until 'time() < 0.2 s or time() > 0.3005 s'");
  EXPECT_EQ(stands.out.find("note: it holds now, so it has to end first\n"), 0U) << stands.out;
  EXPECT_EQ(stands.out.find("note: ", 1), std::string::npos) << "once: " << stands.out;
  EXPECT_NE(stands.out.find("0.301000 s"), std::string::npos) << stands.out;
  EXPECT_EQ(end(), 0);
}

// The run stood after a refusal.
TEST_F(Clock, ARefusedJourneyStopsNothing) {
  begin("");
  const auto before = clock("show")["cycles"].get<std::uint64_t>();
  for (const char* asked : {"goto 5000s", "rewind 5000s", "back-until 'time() < 0 s'"}) {
    EXPECT_NE(to_run(std::string("clock ") + asked).status, 0) << asked;
    EXPECT_EQ(clock("show")["paused"], false) << asked;
  }
  EXPECT_GT(clock("show")["cycles"].get<std::uint64_t>(), before);
  EXPECT_EQ(end(), 0);
}

TEST_F(Clock, KeepsNoPastThatNobodyWants) {
  start("--duration 1000000");  // as fast as it can
  until(R"("phase": "running")");
  const Outcome refused = to_run("clock rewind 1ms");
  EXPECT_NE(refused.err.find("nothing of the past was kept"), std::string::npos) << refused.err;
  EXPECT_EQ(clock("show")["paused"], false) << "a refusal changes nothing";
  EXPECT_EQ(end(), 0);
}

// The pause counted as time in which the run was slow.
TEST_F(Clock, APauseIsNoTimeOfTheRun) {
  begin("");
  (void)clock("pause");
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));
  (void)clock("resume");
  EXPECT_EQ(end(), 0);
  const auto result = nlohmann::json::parse(read_text(folder_ / "run.json"), nullptr, false);
  EXPECT_GE(result["stood_seconds"].get<double>(), 1.4);
  EXPECT_EQ(result["stopped_seconds"], 0.0);
}

TEST_F(Clock, KeepsAnEmergencyStopForTheNextCycle) {
  begin("--on-fault wait");
  (void)clock("pause");
  const Outcome stop = to_run("estop");
  EXPECT_NE(stop.out.find("in the next cycle"), std::string::npos) << stop.out;
  EXPECT_EQ(clock("show")["phase"], "running");
  const Outcome early = to_run("fault reset");
  EXPECT_EQ(early.status, 2);
  EXPECT_NE(early.err.find("an emergency stop waits"), std::string::npos) << early.err;
  EXPECT_EQ(clock("step 1")["phase"], "faulted");
  const Outcome reset = to_run("fault reset");
  EXPECT_EQ(reset.status, 0) << reset.err;
  EXPECT_NE(reset.out.find("in the next cycle"), std::string::npos) << reset.out;
  (void)clock("resume");
  until(R"("resets": 1)");
  EXPECT_EQ(end(), 0);
}

TEST_F(Clock, EndsInOrderWhenItIsSignalledWhilePaused) {
  for (const auto& [name, status] : {std::pair{"INT", 130}, std::pair{"TERM", 143}}) {
    begin("");
    (void)clock("pause");
    signal(name);
    EXPECT_EQ(join(), status) << name << ": before its end";
  }
}

TEST_F(Clock, ReadsItsStartFromTheExperiment) {
  const std::string text = read_text(folder_ / "hold.toml");
  std::ofstream(folder_ / "hold.toml") << text << "\n[clock]\nstart_paused = true\nrate = 5\n";
  start("");
  until(R"("paused": true)");
  EXPECT_EQ(clock("show")["rate"], 5.0);
  EXPECT_EQ(end(), 0);
  start("--rate 0");
  until(R"("paused": true)");
  EXPECT_EQ(clock("show")["rate"], 0.0);
  EXPECT_EQ(end(), 0);
}

TEST_F(Clock, RefusesWhatIsNoRate) {
  for (const char* rate : {"0.001", "1001", "nan", "fast"}) {
    const Outcome outcome = tandem("clock rate " + std::string(rate));
    EXPECT_EQ(outcome.status, 2);
    EXPECT_NE(outcome.err.find("neither 0 nor from 0.01 to 1000"), std::string::npos)
        << outcome.err;
  }
  EXPECT_NE(tandem("run hold.toml --rate 0.001").err.find("0.01 to 1000"), std::string::npos);
}

}  // namespace
}  // namespace tandem::apps
