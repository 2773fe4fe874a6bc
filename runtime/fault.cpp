#include "runtime/fault.hpp"

namespace tandem::runtime {

void FaultLog::note(const FaultRecord& record) noexcept TANDEM_RT {
  static_assert(std::size(hal::kCauseRows) <= 64, "a bit each");
  if (record.cause != hal::FaultCause::kNone)
    noted_ |= std::uint64_t{1} << static_cast<unsigned>(record.cause);
  const std::size_t at = size_.load(std::memory_order_relaxed);
  if (at == kCapacity) {
    lost_.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  records_[at] = record;
  cleared_ns_[at].store(kLatched, std::memory_order_relaxed);
  size_.store(at + 1, std::memory_order_release);  // readers see what is complete
}

void FaultLog::clear(std::size_t index, std::int64_t time_ns) noexcept TANDEM_RT {
  cleared_ns_[index].store(time_ns, std::memory_order_relaxed);
}

std::size_t FaultLog::latched() const noexcept TANDEM_RT {
  std::size_t count = 0;
  for (std::size_t i = 0; i < size(); ++i) count += cleared_ns(i) == kLatched ? 1 : 0;
  return count;
}

void FaultLog::archive(Archive& ar) {
  std::uint64_t size = size_.load();
  std::uint64_t lost = lost_.load();
  ar(records_, size, lost, noted_);
  for (auto& cleared : cleared_ns_) {
    std::int64_t time_ns = cleared.load();
    ar(time_ns);
    cleared = time_ns;
  }
  size_ = size > kCapacity ? kCapacity : size;  // bytes of a snapshot are anybody's
  lost_ = lost;
}

}  // namespace tandem::runtime
