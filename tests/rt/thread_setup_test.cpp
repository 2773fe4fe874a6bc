#include "rt/thread_setup.hpp"

#include <sched.h>
#include <unistd.h>

#include <thread>

#include "rt/cpu_latency.hpp"

namespace tandem::rt {
namespace {

/// set_up_thread() on a thread of its own, so that the test's keeps its settings.
ThreadReport set_up(const ThreadConfig& config) {
  ThreadReport report;
  std::thread([&] { report = set_up_thread(config); }).join();
  return report;
}

constexpr ThreadConfig kPlain{.policy = SchedulingPolicy::kOther,
                              .cpu = -1,
                              .lock_memory = false,
                              .prefault_heap_bytes = 64 * 1024};

TEST(ThreadSetup, AsksForNothingItWasNotTold) {
  const ThreadReport report = set_up(kPlain);
  EXPECT_TRUE(report.complete()) << report.to_string();
  EXPECT_TRUE(report.granted.empty());
}

TEST(ThreadSetup, GrantsOrExplainsEachRequest) {
  ThreadConfig config;
  config.cpu = sched_getcpu();
  const ThreadReport report = set_up(config);
  EXPECT_EQ(report.granted.size() + report.missing.size(), 3U);
  for (const Missing& one : report.missing) {
    EXPECT_FALSE(one.why.empty()) << one.what;
    EXPECT_FALSE(one.how.empty()) << one.what;
    EXPECT_NE(report.to_string().find("could not get " + one.what), std::string::npos);
  }
}

TEST(ThreadSetup, MovesTheThreadToItsCpu) {
  ThreadConfig config = kPlain;
  config.cpu = sched_getcpu();
  int cpu = -1;
  ThreadReport report;
  std::thread([&] {
    report = set_up_thread(config);
    cpu = sched_getcpu();
  }).join();
  EXPECT_TRUE(report.complete()) << report.to_string();
  EXPECT_EQ(cpu, config.cpu);
}

TEST(ThreadSetup, NamesACpuThatDoesNotExist) {
  ThreadConfig config = kPlain;
  config.cpu = 100'000;
  const ThreadReport report = set_up(config);
  ASSERT_EQ(report.missing.size(), 1U);
  EXPECT_EQ(report.missing[0].what, "CPU 100000");
}

TEST(ThreadSetup, NamesAPriorityOutOfRange) {
  ThreadConfig config = kPlain;
  config.policy = SchedulingPolicy::kFifo;
  config.priority = 500;
  const ThreadReport report = set_up(config);
  ASSERT_EQ(report.missing.size(), 1U);
  EXPECT_NE(report.missing[0].how.find("1 to 99"), std::string::npos);
}

TEST(NoCpuSleep, IsGrantedToWhoMayWriteTheDevice) {
  const NoCpuSleep awake;
  EXPECT_EQ(awake.granted(), access("/dev/cpu_dma_latency", W_OK) == 0);
}

}  // namespace
}  // namespace tandem::rt
