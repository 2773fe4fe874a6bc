// What a state of the robot makes of the prediction.
#include "hal/remote/prediction.hpp"

#include <gtest/gtest.h>

#include "hal/remote/answers.hpp"

namespace tandem::remote {
namespace {

constexpr std::int64_t kCycle_ns = 1'000'000;

hal::StateImage at(double position_rad) {
  hal::StateImage state({.joints = 1, .sensor_channels = {}});
  state.position_rad()[0] = position_rad;
  return state;
}

TEST(Prediction, ComparesAStateWithTheTwinUnderTheSameCommand) {
  TwinCorrection prediction(1, 10, kCycle_ns, kCycle_ns);
  prediction.start();
  prediction.keep(5, at(1.0));  // after command 4
  prediction.keep(6, at(2.0));
  prediction.correct(at(1.5), 4, 1);
  EXPECT_EQ(prediction.compared(), 1U);
  EXPECT_EQ(prediction.worst_rad(), 0.5);
}

/// The operator's loop may leave numbers out: what stands in their places is of older commands.
TEST(Prediction, AStateUnderACommandWhoseTwinIsNotKnownCorrectsNothing) {
  TwinCorrection prediction(1, 10, kCycle_ns, kCycle_ns);
  prediction.start();
  for (std::uint64_t number = 0; number < 15; ++number) prediction.keep(number, at(1.0));
  for (std::uint64_t number = 22; number < 26; ++number) prediction.keep(number, at(1.0));
  prediction.correct(at(9.0), 16, 1);  // left out
  prediction.correct(at(9.0), 4, 1);   // overwritten
  prediction.correct(at(9.0), 25, 1);  // not given yet
  EXPECT_EQ(prediction.compared(), 0U);
  EXPECT_EQ(prediction.worst_rad(), 0.0);
  prediction.start();
  prediction.correct(at(9.0), 24, 1);  // of the link before
  EXPECT_EQ(prediction.compared(), 0U);
}

TEST(Answers, TellStatesThatShowNoNewerCommandFromSilence) {
  using hal::FaultCause;
  Answers answers(100);
  answers.start(1000);
  for (std::uint64_t cycle = 1000; cycle <= 1400; ++cycle) {
    if (cycle <= 1100 || cycle > 1300)
      answers.take(std::min<std::uint64_t>(cycle - 300, 750), cycle);
    answers.count(cycle);
    if (cycle == 1150) {
      EXPECT_EQ(answers.loss(), FaultCause::kNone);
    }
    if (cycle == 1200) {
      EXPECT_EQ(answers.loss(), FaultCause::kLinkStates);
    }
    if (cycle == 1400) {
      EXPECT_EQ(answers.loss(), FaultCause::kLinkCommands);
    }
  }
  EXPECT_EQ(answers.most_silent(), 200U);
  EXPECT_EQ(answers.most_unanswered(), 350U) << "since command 750 was seen in force";
  answers.take(751, 1401);
  answers.count(1401);
  EXPECT_EQ(answers.loss(), FaultCause::kNone);
}

TEST(Answers, ALoopThatStoodBlamesNobody) {
  Answers answers(100);
  answers.start(0);
  answers.left_out(5000);
  answers.count(5050);
  EXPECT_EQ(answers.loss(), hal::FaultCause::kNone);
  EXPECT_EQ(answers.silent(), 50U);
}

}  // namespace
}  // namespace tandem::remote
