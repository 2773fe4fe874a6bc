// What was predicted is what then happens, bit for bit, unless something disturbs it.
#include <future>

#include "tests/internal_model/swing_run.hpp"

namespace tandem::internal_model {
namespace {

using runtime::RunPhase;
using test::RunOptions;
using test::SwingFork;
using test::SwingRun;

constexpr std::int64_t kHorizon_ns = 200'000'000;

/// A run whose loop goes on while a tool asks.
struct Predicted {
  explicit Predicted(RunOptions options = {}) : run(options, &service) {
    service.attach(*run.cycle, options.beside ? &*run.beside : nullptr,
                   [like = options]() -> Result<std::unique_ptr<Fork>> {
                     return std::make_unique<SwingFork>(like);
                   });
  }
  ~Predicted() { service.close(); }

  /// Asks while cycles go on, `ahead` of which are noted from the first predicted one on.
  Result<Answer> ask(std::int64_t horizon_ns = kHorizon_ns) {
    auto answer = std::async(std::launch::async, [&] { return service.predict(horizon_ns); });
    while (answer.wait_for(std::chrono::microseconds(100)) != std::future_status::ready) {
      if (!run.cycle->step()) break;
      note();
    }
    return answer.get();
  }
  void note() {
    cycles.push_back(run.cycle->state().cycle()[0]);
    position.push_back(run.cycle->state().position_rad()[0]);
    torque.push_back(run.cycle->state().torque_Nm()[0]);
    reference.push_back(run.cycle->command().position_rad()[0]);
  }
  /// Steps on until the prediction is over, and compares. @return cycles that were not the same
  int differing(const hal::Prediction& p) {
    while (cycles.back() + 1 < p.first_cycle + p.cycles) {
      if (!run.cycle->step()) break;
      note();
    }
    int different = 0, compared = 0;
    for (std::size_t i = 0; i < cycles.size(); ++i) {
      if (cycles[i] < p.first_cycle || cycles[i] >= p.first_cycle + p.cycles) continue;
      const std::size_t row = cycles[i] - p.first_cycle;
      ++compared;
      if (p.position_rad[row] != position[i] || p.torque_Nm[row] != torque[i] ||
          p.reference_rad[row] != reference[i]) {
        ++different;
      }
    }
    EXPECT_EQ(compared, static_cast<int>(p.cycles));
    return different;
  }

  PredictionService service{test::kPeriod_ns};
  SwingRun run;
  std::vector<std::uint64_t> cycles;
  std::vector<double> position, torque, reference;
};

TEST(Prediction, OfASimulationIsWhatThenHappensBitForBit) {
  Predicted one({.cycles = 100'000, .beside = false});
  one.run.run_to(RunPhase::kRunning);
  for (int again = 0; again < 3; ++again) {
    const auto answer = one.ask();
    ASSERT_TRUE(answer) << answer.error().to_string();
    EXPECT_EQ(answer->prediction.cycles, 200U);
    EXPECT_EQ(answer->prediction.end, hal::PredictionEnd::kHorizon);
    EXPECT_GT(answer->prediction.cpu_s, 0.0);
    EXPECT_TRUE(answer->faults.empty());
    EXPECT_EQ(one.differing(answer->prediction), 0);
  }
}

TEST(Prediction, ByTheExactTwinIsWhatThenHappensBitForBit) {
  Predicted one({.cycles = 100'000});
  one.run.run_to(RunPhase::kRunning);
  const auto answer = one.ask();
  ASSERT_TRUE(answer) << answer.error().to_string();
  EXPECT_EQ(one.differing(answer->prediction), 0);
}

/// The internal model is another robot: what it does is not what the first will do.
TEST(Prediction, ByAnotherRobotIsNear) {
  Predicted one({.cycles = 100'000, .kp = 300.0});
  one.run.run_to(RunPhase::kRunning);
  one.run.steps(100);
  const auto answer = one.ask();
  ASSERT_TRUE(answer) << answer.error().to_string();
  const hal::Prediction& p = answer->prediction;
  EXPECT_GT(one.differing(p), 100);
  for (std::size_t i = 0; i < p.cycles; ++i)
    EXPECT_NEAR(p.position_rad[i], p.reference_rad[i], 0.2);
}

TEST(Prediction, DiffersOnceSomethingDisturbsTheRun) {
  Predicted one({.cycles = 100'000, .beside = false});
  one.run.run_to(RunPhase::kRunning);
  const auto answer = one.ask(1'000'000'000);
  ASSERT_TRUE(answer);
  one.run.cycle->inbox().emergency_stop(hal::StopCategory::kCategory1);
  EXPECT_GT(one.differing(answer->prediction), 100);
}

TEST(Prediction, EndsWhereTheRunWillEnd) {
  Predicted one({.cycles = 300, .beside = false});
  one.run.run_to(RunPhase::kRunning);
  const auto answer = one.ask(hal::kMostHorizon_ns);
  ASSERT_TRUE(answer) << answer.error().to_string();
  EXPECT_EQ(answer->prediction.end, hal::PredictionEnd::kRunOver);
  EXPECT_LT(answer->prediction.cycles, 2000U);
  EXPECT_GT(answer->prediction.cycles, 10U);
}

TEST(Prediction, RefusesAHorizonOutOfRange) {
  Predicted one({.cycles = 1000, .beside = false});
  for (const std::int64_t wrong :
       {std::int64_t{0}, std::int64_t{-5}, test::kPeriod_ns - 1, hal::kMostHorizon_ns + 1}) {
    const auto answer = one.service.predict(wrong);
    ASSERT_FALSE(answer) << wrong;
    EXPECT_NE(answer.error().message.find("out of range"), std::string::npos);
  }
}

TEST(Prediction, OfARunThatEndsMeanwhileIsAnErrorAndNothingHangs) {
  Predicted one({.cycles = 100'000, .beside = false});
  auto answer = std::async(std::launch::async, [&] { return one.service.predict(kHorizon_ns); });
  std::this_thread::sleep_for(std::chrono::milliseconds(20));  // no cycle comes
  one.service.close();
  const auto late = answer.get();
  ASSERT_FALSE(late);
  EXPECT_EQ(late.error().message, "the run ended before its prediction was there");
  EXPECT_FALSE(one.service.predict(kHorizon_ns)) << "nor later";
}

TEST(Prediction, OfARunWithOtherControllersIsAnError) {
  Predicted one({.cycles = 100'000, .beside = false});
  one.run.run_to(RunPhase::kRunning);
  auto more = one.run.host->configure(
      "more", std::make_shared<runtime::test::Sine>(std::vector<std::size_t>{}),
      runtime::test::parameters("amplitude_rad = 0.1"));
  ASSERT_TRUE(more) << more.error().to_string();
  one.run.host->owned()[1] = std::move(*more);
  ASSERT_EQ(one.run.host->insert(1, *one.run.host->owned()[1]).reason,
            runtime::RejectReason::kNone);
  const auto answer = one.ask();
  ASSERT_FALSE(answer);
  EXPECT_NE(answer.error().message.find("other controllers"), std::string::npos)
      << answer.error().to_string();
}

/// Moves as the sine does, and asks for what will come in every tenth cycle.
class Asks final : public runtime::test::Sine {
 public:
  Asks() : Sine({0}) {}
  Status configure(ControllerSetup& setup) override {
    predictor = setup.predictor;
    if (const Status prepared = predictor->prepare(50'000'000); !prepared) return prepared;
    return Sine::configure(setup);
  }
  Code update(const hal::CycleTime& time, const hal::StateImage& state,
              hal::CommandImage& command) noexcept override {
    if (const hal::Prediction* seen = predictor->newest()) {
      ++seen_cycles;
      // Row 0 is the first cycle after the one that asked.
      const std::uint64_t row = time.cycle - seen->first_cycle;
      if (row < seen->cycles && seen->position_rad[row] != state.position_rad()[0]) ++wrong;
    }
    if (time.cycle % 10 == 0) asked += predictor->ask(50'000'000) ? 1 : 0;
    return Sine::update(time, state, command);
  }
  hal::Predictor* predictor = nullptr;
  int asked = 0, seen_cycles = 0, wrong = 0;
};

TEST(Prediction, ForAControllerIsThereInTheNextCycleOfSimulatedTime) {
  for (const bool beside : {false, true}) {
    auto asks = std::make_shared<Asks>();
    PredictionService service(test::kPeriod_ns);
    RunOptions options{.cycles = 200, .beside = beside, .predictor = &service, .controller = asks};
    SwingRun run(options, &service);
    service.attach(
        *run.cycle, beside ? &*run.beside : nullptr,
        [&]() -> Result<std::unique_ptr<Fork>> { return std::make_unique<SwingFork>(options); });
    run.cycle->run();
    service.close();
    EXPECT_GE(asks->asked, 20);
    EXPECT_GE(asks->seen_cycles, 189) << "from the cycle after the first question on";
    EXPECT_EQ(asks->wrong, 0);
  }
}

/// Asks for ten seconds, and 20 cycles later for 50 ms.
class ChangesItsMind final : public runtime::test::Sine {
 public:
  ChangesItsMind() : Sine({0}) {}
  Status configure(ControllerSetup& setup) override {
    predictor = setup.predictor;
    if (const Status prepared = predictor->prepare(hal::kMostHorizon_ns); !prepared)
      return prepared;
    return Sine::configure(setup);
  }
  Code update(const hal::CycleTime& time, const hal::StateImage& state,
              hal::CommandImage& command) noexcept override {
    if (cycle == 10) (void)predictor->ask(hal::kMostHorizon_ns);
    if (cycle == 30) (void)predictor->ask(50'000'000);
    ++cycle;
    if (const hal::Prediction* seen = predictor->newest(); seen != nullptr && first == 0)
      first = seen->cycles;
    return Sine::update(time, state, command);
  }
  hal::Predictor* predictor = nullptr;
  int cycle = 0;
  std::size_t first = 0;  // cycles of the first answer
};

TEST(Prediction, ThatIsNewerCancelsTheOneBeforeOnTheWallClock) {
  auto asks = std::make_shared<ChangesItsMind>();
  PredictionService service(test::kPeriod_ns);
  RunOptions options{
      .cycles = 100'000, .pace = hal::Pace::kWallClock, .predictor = &service, .controller = asks};
  SwingRun run(options, &service);
  service.attach(*run.cycle, &*run.beside, [&]() -> Result<std::unique_ptr<Fork>> {
    return std::make_unique<SwingFork>(options);
  });
  run.run_to(RunPhase::kRunning);
  for (int i = 0; i < 60'000 && asks->first == 0; ++i) {
    run.steps(1);
    std::this_thread::sleep_for(std::chrono::microseconds(100));
  }
  EXPECT_EQ(asks->first, 50U) << "the one of ten seconds never came";
  service.close();
}

/// On the wall clock the loop writes itself down under the traps, and waits for nobody.
TEST(Prediction, OnTheWallClockTakesNoHeapAndNoLockInTheCycle) {
  auto asks = std::make_shared<Asks>();
  PredictionService service(test::kPeriod_ns);
  RunOptions options{
      .cycles = 300, .pace = hal::Pace::kWallClock, .predictor = &service, .controller = asks};
  SwingRun run(options, &service);
  service.attach(*run.cycle, &*run.beside, [&]() -> Result<std::unique_ptr<Fork>> {
    return std::make_unique<SwingFork>(options);
  });
  run.run_to(RunPhase::kRunning);
  for (int i = 0; i < 20'000 && asks->seen_cycles == 0; ++i) {
    run.steps(1);
    std::this_thread::sleep_for(std::chrono::microseconds(100));
  }
  EXPECT_GT(asks->seen_cycles, 0) << "an answer came";
  EXPECT_GT(asks->asked, 0);
  service.close();
  // The trap's own check fails the test for any violation.
}

}  // namespace
}  // namespace tandem::internal_model
