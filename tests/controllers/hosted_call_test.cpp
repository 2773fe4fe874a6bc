#include "controllers/hosted_call.hpp"

#include <gtest/gtest.h>
#include <sys/ptrace.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/support/eventually.hpp"

namespace tandem {
namespace {

using std::chrono::milliseconds;

/// A call of 300 ms within a limit of 100 ms.
bool slow_call_is_in_time() {
  const auto slow = []() -> Status {
    std::this_thread::sleep_for(milliseconds(300));
    return {};
  };
  return bounded_call("slow", milliseconds(100), slow).has_value();
}

TEST(BoundedCall, IsGivenUpAfterItsLimit) { EXPECT_FALSE(slow_call_is_in_time()); }

// 18 s at a breakpoint in configure(): "did not return within 15000 ms".
TEST(BoundedCall, WaitsAsLongAsADebuggerHasTheProcess) {
  const pid_t child = ::fork();
  if (child == 0) {
    if (!test::eventually(is_debugged)) ::_exit(2);
    ::_exit(slow_call_is_in_time() ? 0 : 1);
  }
  ASSERT_FALSE(is_debugged()) << "this test cannot be debugged";
  ASSERT_EQ(::ptrace(PTRACE_SEIZE, child, nullptr, nullptr), 0);
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST(BoundedCall, WaitsWhileLimitsOfTimeAreWaived) {
  const pid_t child = ::fork();
  if (child == 0) {
    waive_time_limits();
    ::_exit(slow_call_is_in_time() ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

}  // namespace
}  // namespace tandem
