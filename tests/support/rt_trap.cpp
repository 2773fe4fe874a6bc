#include "tests/support/rt_trap.hpp"

#include <execinfo.h>
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cstdlib>

#include "rt/scoped_realtime.hpp"
#include "rt/trap_calls.hpp"

namespace tandem::test {
namespace {

constexpr int kFrames = 24;
constexpr std::size_t kKept = 16;

struct Caught {
  const char* call;
  std::array<void*, kFrames> frames;
  int count;
};

// Written inside malloc: static storage, no constructor.
std::array<Caught, kKept> caught;
std::atomic<std::size_t> caught_count{0};
__attribute__((tls_model("initial-exec"))) thread_local bool noting = false;

std::string text_of(const Caught& one) {
  std::string text;
  char** symbols = backtrace_symbols(one.frames.data(), one.count);
  for (int i = 2; symbols != nullptr && i < one.count; ++i) {
    text += std::string("  ") + symbols[i] + "\n";
  }
  std::free(static_cast<void*>(symbols));
  return text;
}

class TrapListener : public testing::EmptyTestEventListener {
  void OnTestStart(const testing::TestInfo&) override { (void)take_rt_violations(); }
  void OnTestEnd(const testing::TestInfo&) override {
    for (const RtViolation& one : take_rt_violations()) {
      ADD_FAILURE() << "'" << one.call << "' was called inside the real-time cycle\n"
                    << one.backtrace;
    }
  }
};

// Before main: backtrace() loads its unwinder on first use, and gtest must know the listener.
const bool installed = [] {
  std::array<void*, 2> frames{};
  (void)backtrace(frames.data(), 2);
  testing::UnitTest::GetInstance()->listeners().Append(new TrapListener);
  return true;
}();

}  // namespace

std::vector<RtViolation> take_rt_violations() {
  const std::size_t count = std::min(caught_count.load(), kKept);
  std::vector<RtViolation> found;
  for (std::size_t i = 0; i < count; ++i) found.push_back({caught[i].call, text_of(caught[i])});
  caught_count.store(0);
  return found;
}

bool rt_trap_active() noexcept { return rt::traps_calls(); }

}  // namespace tandem::test

void tandem::rt::note_trapped_call(const char* call) noexcept {
  using namespace tandem::test;
  if (!rt::in_realtime() || noting) return;
  noting = true;
  const std::size_t index = caught_count.fetch_add(1);
  if (index < kKept) {
    caught[index].call = call;
    caught[index].count = backtrace(caught[index].frames.data(), kFrames);
  }
  noting = false;
}
