// Waits for what another thread or process does.
// Layer: tests.  Thread: any.
#pragma once

#include <chrono>
#include <functional>
#include <thread>

namespace tandem::test {

/// Whether `condition` came true within 20 s, which only a failure takes.
inline bool eventually(const std::function<bool()>& condition) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (std::chrono::steady_clock::now() < end) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return false;
}

}  // namespace tandem::test
