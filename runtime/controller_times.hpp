// How long each controller's calls of the cycle take, by the names of all that ever were loaded.
// Layer: runtime.  Thread: times are recorded by the loop; the rest any.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "rt/histogram.hpp"

namespace tandem::runtime {

/// One name's. Percentiles and `overruns` may be read while the loop counts.
struct ControllerTimes {
  std::string name;
  rt::Histogram calls;  ///< of each call in the cycle: start, update, retreat, stop
  std::atomic<std::uint64_t> overruns{0};  ///< late cycles that it was the reason for
};

/// One call of the cycle, on the loop's clock.
struct ControllerCall {
  std::uint32_t controller = 0;  ///< for ControllerNames::name()
  std::int64_t begin_ns = 0, took_ns = 0;
  bool shadow = false;  ///< of one that commands nothing
};

/// Every name that a controller ever was loaded by, by number, also when it is gone. Later ones of
/// the name, and later builds, are counted on with it. Shared by those who tell of it later.
class ControllerNames {
 public:
  [[nodiscard]] std::uint32_t add(const std::string& name) {
    const std::lock_guard lock(mutex_);
    for (std::size_t id = 0; id < all_.size(); ++id)
      if (all_[id]->name == name) return static_cast<std::uint32_t>(id);
    all_.push_back(std::make_shared<ControllerTimes>());
    all_.back()->name = name;
    return static_cast<std::uint32_t>(all_.size() - 1);
  }
  /// Empty: there was none.
  [[nodiscard]] std::string name(std::size_t id) const {
    const std::lock_guard lock(mutex_);
    return id < all_.size() ? all_[id]->name : std::string();
  }
  /// The same without the heap, as a signal handler needs it; stays. Null: there was none.
  [[nodiscard]] const char* text(std::size_t id) const noexcept {
    const std::lock_guard lock(mutex_);
    return id < all_.size() ? all_[id]->name.c_str() : nullptr;
  }
  [[nodiscard]] std::vector<std::shared_ptr<ControllerTimes>> all() const {
    const std::lock_guard lock(mutex_);
    return all_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<std::shared_ptr<ControllerTimes>> all_;
};

}  // namespace tandem::runtime
