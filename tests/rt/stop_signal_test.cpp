#include "rt/stop_signal.hpp"

#include <csignal>
#include <cstdlib>

namespace tandem::rt {
namespace {

TEST(StopSignal, TurnsSigtermAndSigintIntoAFlag) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    clear_stop();
    install_stop_signals();
    EXPECT_FALSE(stop_requested());
    std::raise(signal);
    EXPECT_TRUE(stop_requested());
    EXPECT_EQ(stop_signal(), signal);
    if (signal != SIGHUP) std::raise(SIGHUP);
    EXPECT_EQ(stop_signal(), signal) << "the first one is the cause";
  }
  clear_stop();
  EXPECT_EQ(stop_signal(), 0);
  request_stop();
  EXPECT_EQ(stop_signal(), 0) << "no signal did that";
  clear_stop();
  EXPECT_FALSE(stop_requested());
}

TEST(StopSignal, LetsASecondSignalEndAHungProgram) {
  EXPECT_EXIT(
      {
        install_stop_signals();
        std::raise(SIGTERM);
        std::raise(SIGTERM);
      },
      testing::KilledBySignal(SIGTERM), "");
}

void end_with_7(int) { std::_Exit(7); }

TEST(StopSignal, GivesASecondSignalToWhomTheFirstBelonged) {
  EXPECT_EXIT(
      {
        std::signal(SIGINT, end_with_7);
        install_stop_signals();
        install_stop_signals();
        std::raise(SIGINT);
        std::raise(SIGINT);
      },
      testing::ExitedWithCode(7), "");
}

TEST(StopSignal, GivesTheFirstSignalBack) {
  EXPECT_EXIT(
      {
        std::signal(SIGTERM, end_with_7);
        install_stop_signals();
        remove_stop_signals();
        std::raise(SIGTERM);
      },
      testing::ExitedWithCode(7), "");
  EXPECT_EXIT(
      {
        std::signal(SIGINT, SIG_IGN);  // as a shell starts what is in its background
        install_stop_signals();
        remove_stop_signals();
        std::raise(SIGINT);
      },
      testing::KilledBySignal(SIGINT), "");
}

TEST(StopSignal, LeavesAClosedTerminalIgnoredUnderNohup) {
  std::signal(SIGHUP, SIG_IGN);
  clear_stop();
  install_stop_signals();
  std::raise(SIGHUP);
  EXPECT_FALSE(stop_requested());
  std::signal(SIGHUP, SIG_DFL);
}

}  // namespace
}  // namespace tandem::rt
