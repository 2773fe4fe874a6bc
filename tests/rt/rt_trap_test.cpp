#include "tests/support/rt_trap.hpp"

#include <unistd.h>

#include <condition_variable>
#include <cstdlib>
#include <mutex>
#include <thread>

#include "base/spsc_ring.hpp"
#include "rt/scoped_realtime.hpp"

namespace tandem::test {
namespace {

class RtTrap : public testing::Test {
 protected:
  void SetUp() override {
    if (!rt_trap_active()) GTEST_SKIP() << "the sanitizer's run-time interposes these calls";
  }
};

/// The calls caught while `work` runs inside the cycle.
template <class Work>
std::vector<std::string> caught(Work work) {
  {
    const rt::ScopedRealtime in_cycle;
    work();
  }
  std::vector<std::string> calls;
  for (const RtViolation& one : take_rt_violations()) calls.push_back(one.call);
  return calls;
}

using Calls = std::vector<std::string>;

TEST_F(RtTrap, CatchesNewAndDelete) {
  EXPECT_EQ(caught([] {
              int* volatile block = new int(3);
              delete block;
            }),
            (Calls{"malloc", "free"}));
}

TEST_F(RtTrap, CatchesTheCAllocators) {
  EXPECT_EQ(caught([] {
              void* volatile block = std::calloc(4, 4);
              block = std::realloc(block, 400);
              std::free(block);
            }),
            (Calls{"calloc", "realloc", "free"}));
  EXPECT_EQ(caught([] {
              void* block = nullptr;
              if (posix_memalign(&block, 64, 128) == 0) std::free(block);
            }),
            (Calls{"posix_memalign", "free"}));
}

TEST_F(RtTrap, CatchesAGrowingVector) {
  std::vector<int> numbers;
  EXPECT_FALSE(caught([&] { numbers.push_back(1); }).empty());
}

TEST_F(RtTrap, CatchesLocksAndWaits) {
  std::mutex mutex;
  EXPECT_EQ(caught([&] { const std::lock_guard lock(mutex); }), Calls{"pthread_mutex_lock"});
  std::condition_variable condition;
  std::unique_lock lock(mutex);
  EXPECT_FALSE(caught([&] { condition.wait_for(lock, std::chrono::microseconds(1)); }).empty());
}

TEST_F(RtTrap, CatchesSleepingAndFileCalls) {
  EXPECT_EQ(caught([] { usleep(1); }), Calls{"usleep"});
  EXPECT_EQ(caught([] { EXPECT_EQ(write(STDERR_FILENO, "", 0), 0); }), Calls{"write"});
}

TEST_F(RtTrap, NamesThePlaceOfTheCall) {
  {
    const rt::ScopedRealtime in_cycle;
    void* volatile block = std::malloc(1);  // volatile: else the compiler removes the pair
    std::free(block);
  }
  const std::vector<RtViolation> found = take_rt_violations();
  ASSERT_FALSE(found.empty());
  EXPECT_NE(found[0].backtrace.find("rt_trap_test"), std::string::npos) << found[0].backtrace;
}

TEST_F(RtTrap, LeavesOtherThreadsAndTheTimeOutsideTheCycleAlone) {
  bool in_other_thread = true;
  {
    const rt::ScopedRealtime in_cycle;
    in_other_thread = false;
  }
  std::thread([&] { in_other_thread = rt::in_realtime(); }).join();
  EXPECT_FALSE(in_other_thread);
  delete new int(4);
  EXPECT_TRUE(take_rt_violations().empty());
}

TEST_F(RtTrap, FindsNothingInTheWaitFreeRing) {
  SpscRing ring(64, 8);
  EXPECT_EQ(caught([&] {
              for (int i = 0; i < 20; ++i) {
                if (!ring.begin_push().empty()) ring.end_push();
              }
            }),
            Calls{});
}

}  // namespace
}  // namespace tandem::test
