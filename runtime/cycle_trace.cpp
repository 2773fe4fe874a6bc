// The ring of stamps: where a cycle takes its place, and the copy that is read afterwards.
#include "runtime/cycle_trace.hpp"

#include <algorithm>

namespace tandem::runtime {

const char* to_string(CycleStage stage) noexcept {
  switch (stage) {
    case CycleStage::kWait: return "wait";
    case CycleStage::kExchange: return "exchange";
    case CycleStage::kRead: return "read";
    case CycleStage::kCheck: return "check";
    case CycleStage::kUpdate: return "update";
    case CycleStage::kLimit: return "limit";
    case CycleStage::kWrite: return "write";
    case CycleStage::kHandOver: return "hand over";
  }
  return "?";
}

void CycleTrace::begin(const rt::Tick& tick) noexcept TANDEM_RT {
  if (!on() || muted_) return;
  stamps_ = &ring_[count_++ % ring_.size()];
  stamps_->cycle = tick.cycle;
  stamps_->begin_ns = ended_ns_ != 0 ? ended_ns_ : tick.begin_ns;
  stamps_->end_ns.fill(tick.begin_ns);
  stamps_->wakeup_ns = tick.wakeup_ns;
  stamps_->skipped = tick.skipped;
  stamps_->late = tick.late;
  stamps_->called = 0;
}

void CycleTrace::note(std::span<const ControllerCall> calls) noexcept TANDEM_RT {
  if (stamps_ == nullptr) return;
  stamps_->called = static_cast<std::uint32_t>(std::min(calls.size(), stamps_->calls.size()));
  std::copy_n(calls.begin(), stamps_->called, stamps_->calls.begin());
}

std::vector<CycleStamps> CycleTrace::cycles() const {
  std::vector<CycleStamps> out;
  const std::uint64_t held = std::min<std::uint64_t>(count_, ring_.size());
  out.reserve(held);
  for (std::uint64_t i = count_ - held; i < count_; ++i) out.push_back(ring_[i % ring_.size()]);
  return out;
}

}  // namespace tandem::runtime
