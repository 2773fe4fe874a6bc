#include "rt/stop_signal.hpp"

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <thread>

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

/// Until a signal is no more the same one.
void wait_for_another() {
  std::this_thread::sleep_for(std::chrono::nanoseconds(kOneSignal_ns + 10'000'000));
}

TEST(StopSignal, TakesTwoInQuickSuccessionForOne) {
  EXPECT_EXIT(
      {
        install_stop_signals();
        for (int i = 0; i < 3; ++i) std::raise(SIGINT);
        std::_Exit(stop_requested() ? 5 : 6);
      },
      testing::ExitedWithCode(5), "");
}

TEST(StopSignal, LetsASecondSignalEndAHungProgram) {
  EXPECT_EXIT(
      {
        install_stop_signals();
        std::raise(SIGTERM);
        wait_for_another();
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
        wait_for_another();
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
