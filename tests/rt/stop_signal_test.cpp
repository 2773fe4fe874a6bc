#include "rt/stop_signal.hpp"

#include <csignal>

namespace tandem::rt {
namespace {

TEST(StopSignal, TurnsSigtermAndSigintIntoAFlag) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    clear_stop();
    install_stop_signals();
    EXPECT_FALSE(stop_requested());
    std::raise(signal);
    EXPECT_TRUE(stop_requested());
  }
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
