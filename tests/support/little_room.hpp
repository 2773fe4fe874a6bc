// A process with little stack and memory, for what must not need much whatever it reads.
#pragma once

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cstdlib>

namespace tandem::test {

/// From now on 512 KiB of stack and `memory_MiB` in all, except under a sanitizer, which needs
/// more.
inline void take_room(rlim_t memory_MiB = 500) {
  const rlimit stack{512 << 10, 512 << 10};
  [[maybe_unused]] const rlimit memory{memory_MiB << 20, memory_MiB << 20};
  ::setrlimit(RLIMIT_STACK, &stack);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  ::setrlimit(RLIMIT_AS, &memory);
#endif
}

/// Whether `holds` says so in a process of its own with little room. One that crashes fails.
#define EXPECT_IN_LITTLE_ROOM(holds)            \
  EXPECT_EXIT(                                  \
      {                                         \
        ::tandem::test::take_room();            \
        std::_Exit((holds) ? EXIT_SUCCESS : 1); \
      },                                        \
      testing::ExitedWithCode(EXIT_SUCCESS), "")

}  // namespace tandem::test
