// Who may command the robot: at most one at a time, for as long as it says so.
// Layer: hal/remote.  Thread: any; revoke() and owner() are fit for the loop.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <mutex>
#include <string>

#include "base/realtime.hpp"

namespace tandem::remote {

/// Exclusive. An owner keeps it by being heard; who takes it away from a silent one is the loop,
/// since that goes with a reaction. Times are of one monotonic clock.
class Lease {
 public:
  /// True when it is the client's now, or was already. @pre client != 0
  bool acquire(std::uint64_t client, const std::string& name, std::int64_t now_ns);
  /// Gives it back. False: it was not the client's.
  bool release(std::uint64_t client) noexcept TANDEM_RT {
    return owner_.compare_exchange_strong(client, 0, std::memory_order_acq_rel);
  }
  /// The owner lives.
  void heard(std::int64_t now_ns) noexcept TANDEM_RT {
    heard_ns_.store(now_ns, std::memory_order_relaxed);
  }

  /// 0: nobody.
  [[nodiscard]] std::uint64_t owner() const noexcept TANDEM_RT {
    return owner_.load(std::memory_order_acquire);
  }
  /// When the owner was heard last.
  [[nodiscard]] std::int64_t heard_ns() const noexcept TANDEM_RT {
    return heard_ns_.load(std::memory_order_relaxed);
  }
  /// Name of the owner, or of the last one.
  [[nodiscard]] std::string name() const;
  /// Leases given so far.
  [[nodiscard]] std::uint64_t given() const noexcept {
    return given_.load(std::memory_order_relaxed);
  }

 private:
  std::atomic<std::uint64_t> owner_{0};
  std::atomic<std::int64_t> heard_ns_{0};
  std::atomic<std::uint64_t> given_{0};
  mutable std::mutex mutex_;  // of the name
  std::string name_;
};

/// How long somebody has been silent while the one who listens was awake. A process that was
/// stopped has heard nobody meanwhile: that is no silence of the others.
class Silence {
 public:
  /// @param heard_ns  when somebody was heard last
  /// @param most_ns   of the time since the call before that counts
  /// @return [ns] since the first call with this `heard_ns`
  std::int64_t of(std::int64_t heard_ns, std::int64_t now_ns,
                  std::int64_t most_ns) noexcept TANDEM_RT {
    silent_ns_ = heard_ns == heard_ns_ ? silent_ns_ + std::min(now_ns - looked_ns_, most_ns) : 0;
    heard_ns_ = heard_ns;
    looked_ns_ = now_ns;
    return silent_ns_;
  }

 private:
  std::int64_t heard_ns_ = 0, looked_ns_ = 0, silent_ns_ = 0;
};

/// What becomes of a command that arrives.
enum class Verdict : std::uint8_t {
  kTaken,
  kNoLease,     ///< its sender is not the owner, or speaks to an earlier run
  kOutOfOrder,  ///< not newer than the last: a duplicate, or overtaken
  kStale,       ///< it answers a cycle that is too old, or one that has not been
  kMalformed,   ///< not this robot's size, or not finite
};
inline constexpr std::size_t kVerdicts = 5;
[[nodiscard]] const char* to_string(Verdict verdict) noexcept;

}  // namespace tandem::remote
