// Acquiring the lease takes a mutex, on DDS threads; the loop only reads and clears the atomic
// owner.
#include "hal/remote/lease.hpp"

namespace tandem::remote {

bool Lease::acquire(std::uint64_t client, const std::string& name, std::int64_t now_ns) {
  const std::lock_guard lock(mutex_);
  std::uint64_t nobody = 0;
  if (owner() == client) {
    heard(now_ns);
    return true;
  }
  if (owner() != 0) return false;
  name_ = name;
  heard(now_ns);  // before others see the owner
  if (!owner_.compare_exchange_strong(nobody, client, std::memory_order_acq_rel)) return false;
  given_.fetch_add(1, std::memory_order_relaxed);
  return true;
}

std::string Lease::name() const {
  const std::lock_guard lock(mutex_);
  return name_;
}

const char* to_string(Verdict verdict) noexcept {
  switch (verdict) {
    case Verdict::kTaken: return "taken";
    case Verdict::kNoLease: return "without_lease";
    case Verdict::kOutOfOrder: return "out_of_order";
    case Verdict::kStale: return "stale";
    case Verdict::kMalformed: return "malformed";
  }
  return "?";
}

}  // namespace tandem::remote
