// Locked memory, prefaulted heap and stack, CPU affinity, scheduling policy, in that order; what
// the system refuses goes into the report with its remedy.
#include "rt/thread_setup.hpp"

#include <alloca.h>
#include <linux/capability.h>
#include <malloc.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>

namespace tandem::rt {
namespace {

std::string reason(int error) { return std::strerror(error); }

void set_scheduling(const ThreadConfig& config, ThreadReport& report) {
  if (config.policy == SchedulingPolicy::kOther) return;
  const bool fifo = config.policy == SchedulingPolicy::kFifo;
  const std::string what = std::string(fifo ? "SCHED_FIFO" : "SCHED_RR") + " priority " +
                           std::to_string(config.priority);
  const sched_param param{.sched_priority = config.priority};
  const int error = pthread_setschedparam(pthread_self(), fifo ? SCHED_FIFO : SCHED_RR, &param);
  if (error == 0) {
    report.granted.push_back(what);
    return;
  }
  const std::string how = error == EINVAL
                              ? "give a priority from 1 to 99"
                              : "allow it: 'rtprio " + std::to_string(config.priority) +
                                    "' for the user in /etc/security/limits.d/, then log in again";
  report.missing.push_back({what, reason(error), how});
}

void set_affinity(const ThreadConfig& config, ThreadReport& report) {
  if (config.cpu < 0) return;
  const std::string what = "CPU " + std::to_string(config.cpu);
  cpu_set_t set;
  CPU_ZERO(&set);
  int error = EINVAL;
  if (config.cpu < CPU_SETSIZE) {
    CPU_SET(static_cast<std::size_t>(config.cpu), &set);
    error = pthread_setaffinity_np(pthread_self(), sizeof set, &set);
  }
  if (error == 0) {
    report.granted.push_back(what);
    return;
  }
  report.missing.push_back({what, reason(error),
                            "choose one of the " + std::to_string(sysconf(_SC_NPROCESSORS_ONLN)) +
                                " CPUs that this process may use (`taskset -p $$`)"});
}

/// CAP_IPC_LOCK, which no limit holds: root's, as a rule, or given to a service.
bool has_ipc_lock() {
  __user_cap_header_struct head{.version = _LINUX_CAPABILITY_VERSION_3, .pid = 0};
  __user_cap_data_struct sets[_LINUX_CAPABILITY_U32S_3]{};
  if (syscall(SYS_capget, &head, sets) != 0) return false;
  return (sets[CAP_TO_INDEX(CAP_IPC_LOCK)].effective & CAP_TO_MASK(CAP_IPC_LOCK)) != 0;
}

void lock_memory(const ThreadConfig& config, ThreadReport& report) {
  if (!config.lock_memory) return;
  // mlockall can succeed under a small limit and let later allocations fail: ask first.
  rlimit limit{};
  getrlimit(RLIMIT_MEMLOCK, &limit);
  const bool unlimited = limit.rlim_cur == RLIM_INFINITY || has_ipc_lock();
  if (unlimited && mlockall(MCL_CURRENT | MCL_FUTURE) == 0) {
    report.granted.emplace_back("locked memory");
    return;
  }
  const std::string why =
      unlimited ? reason(errno) : "the limit is " + std::to_string(limit.rlim_cur / 1024) + " KiB";
  report.missing.push_back(
      {"locked memory", why,
       "allow it: 'memlock unlimited' for the user in /etc/security/limits.d/, then log in again"});
}

// Touches each page below the current frame, so that no cycle meets a fresh stack page.
[[gnu::noinline]] void prefault_stack(std::size_t bytes) {
  rlimit limit{};
  getrlimit(RLIMIT_STACK, &limit);
  if (limit.rlim_cur != RLIM_INFINITY) bytes = std::min<std::size_t>(bytes, limit.rlim_cur / 2);
  if (bytes == 0) return;
  auto* pages = static_cast<volatile std::byte*>(alloca(bytes));
  for (std::size_t i = 0; i < bytes; i += 4096) pages[i] = std::byte{0};
}

void prefault_heap(std::size_t bytes) {
  if (bytes == 0) return;
  mallopt(M_TRIM_THRESHOLD, -1);  // keep what was touched
  mallopt(M_MMAP_MAX, 0);         // and serve big blocks from it
  if (void* block = std::malloc(bytes); block != nullptr) {
    auto* pages = static_cast<volatile std::byte*>(block);
    for (std::size_t i = 0; i < bytes; i += 4096) pages[i] = std::byte{0};
    std::free(block);
  }
}

}  // namespace

std::string ThreadReport::to_string() const {
  std::string text;
  for (const Missing& one : missing) {
    text += "could not get " + one.what + ": " + one.why + " (" + one.how + ")\n";
  }
  return text;
}

ThreadReport set_up_thread(const ThreadConfig& config) {
  ThreadReport report;
  lock_memory(config, report);
  prefault_heap(config.prefault_heap_bytes);
  prefault_stack(config.prefault_stack_bytes);
  set_affinity(config, report);
  set_scheduling(config, report);
  return report;
}

}  // namespace tandem::rt
