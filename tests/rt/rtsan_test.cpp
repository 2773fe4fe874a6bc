// Proves that the preset "rtsan" catches what it is there for.
#include <cstdlib>

#include "base/realtime.hpp"
#include "rt/clock.hpp"
#include "rt/cyclic_loop.hpp"

#if defined(__has_feature)
#if __has_feature(realtime_sanitizer)
#define TANDEM_RTSAN 1
#endif
#endif

namespace tandem::rt {
namespace {

class Component {
 public:
  virtual ~Component() = default;
  virtual void update() noexcept TANDEM_RT = 0;
};

/// A plugin's author may forget the mark on the override: the contract's holds.
class Allocating final : public Component {
 public:
  void update() noexcept override {
    void* volatile block = std::malloc(16);
    std::free(block);
  }
};

class RealtimeSanitizer : public testing::Test {
 protected:
  void SetUp() override {
#ifndef TANDEM_RTSAN
    GTEST_SKIP() << "built without -fsanitize=realtime (preset rtsan)";
#endif
  }
};

TEST_F(RealtimeSanitizer, StopsAnOverrideThatAllocates) {
  EXPECT_DEATH(
      {
        Allocating component;
        static_cast<Component&>(component).update();
      },
      "RealtimeSanitizer");
}

TEST_F(RealtimeSanitizer, AllowsTheLoopsOwnCallsInTheCycle) {
  WallClock clock;
  CyclicLoop loop({.period_ns = 1'000'000, .pacing = Pacing::kSimulated}, clock);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(loop.wait().cycle, static_cast<std::uint64_t>(i));
    loop.finish();
  }
}

}  // namespace
}  // namespace tandem::rt
