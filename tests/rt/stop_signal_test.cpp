#include "rt/stop_signal.hpp"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <thread>
#include <vector>

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

// They had ended a run at once, whose robot was left as it was.
TEST(StopSignal, StopsInOrderOrIgnoresEverySignalThatWouldEndTheProcess) {
  const std::vector<int> crashes{SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGTRAP, SIGSYS};
  const std::vector<int> suspend{SIGSTOP, SIGTSTP, SIGTTIN, SIGTTOU, SIGCONT};
  const std::vector<int> ignored{SIGALRM, SIGVTALRM, SIGPROF, SIGIO,   SIGPIPE,
                                 SIGXFSZ, SIGCHLD,   SIGURG,  SIGWINCH};
  for (int signal = 1; signal <= SIGRTMAX; ++signal) {
    const bool of_libc = signal >= 32 && signal < SIGRTMIN;
    const auto is_of = [signal](const std::vector<int>& some) {
      return std::ranges::find(some, signal) != some.end();
    };
    if (of_libc || signal == SIGKILL || is_of(crashes) || is_of(suspend)) continue;
    SCOPED_TRACE(signal);
    EXPECT_EXIT(
        {
          for (int one = 1; one <= SIGRTMAX; ++one) std::signal(one, SIG_DFL);
          install_stop_signals();
          install_emergency_signal();
          std::raise(signal);
          if (take_emergency_stop() == EmergencyStop::kBySignal) std::_Exit(7);
          std::_Exit(stop_requested() && stop_signal() == signal ? 5 : 6);
        },
        testing::ExitedWithCode(signal == SIGUSR1 ? 7
                                : is_of(ignored)  ? 6
                                                  : 5),
        "");
  }
}

// The kernel sends it each second once a limit is reached (RLIMIT_RTTIME): the way down takes two.
TEST(StopSignal, LeavesARunThatHasUsedUpItsTimeTheTimeToEnd) {
  EXPECT_EXIT(
      {
        install_stop_signals();
        for (int i = 0; i < 3; ++i) {
          std::raise(SIGXCPU);
          std::this_thread::sleep_for(std::chrono::nanoseconds(kOneSignal_ns + 10'000'000));
        }
        std::_Exit(stop_requested() ? 5 : 6);
      },
      testing::ExitedWithCode(5), "");
}

TEST(StopSignal, LeavesASignalToWhomItBelongs) {
  EXPECT_EXIT(
      {
        std::signal(SIGPROF, [](int) { std::_Exit(7); });
        install_stop_signals();
        std::raise(SIGPROF);
      },
      testing::ExitedWithCode(7), "");
  EXPECT_EXIT(
      {
        std::signal(SIGUSR2, [](int) { std::_Exit(7); });
        install_stop_signals();
        std::raise(SIGUSR2);
      },
      testing::ExitedWithCode(7), "");
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
