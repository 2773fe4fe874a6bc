// What comes back waits in a ring; one late frame waits beside it.
#include "hal/ethercat-can/line/in_process_link.hpp"

#include <algorithm>
#include <utility>

namespace tandem::hal::ecat {

InProcessLink::InProcessLink(ethercat::Medium& medium) : medium_(&medium), waiting_(kWaiting) {}

void InProcessLink::set_fate(FrameFate fate, std::uint32_t frames) noexcept {
  fate_ = fate;
  fated_ = frames;
}

std::size_t InProcessLink::send(std::span<const FrameBuffer> frames) noexcept TANDEM_RT {
  statistics_.count_sent(frames);
  for (const FrameBuffer& frame : frames) {
    FrameFate fate = FrameFate::kPass;
    if (fated_ > 0) {
      --fated_;
      fate = fate_;
    }
    if (fate == FrameFate::kLoseBefore) continue;
    passing_ = frame;
    const bool back = medium_->pass(passing_.frame(), now_ns_);
    if (!back || fate == FrameFate::kLoseAfter) continue;
    if (fate == FrameFate::kLate && late_.size == 0) {
      late_ = passing_;
      continue;
    }
    put(passing_);
    if (fate == FrameFate::kTwice) put(passing_);
    if (late_.size != 0) {
      put(late_);
      late_.size = 0;
    }
  }
  return frames.size();
}

void InProcessLink::put(const FrameBuffer& frame) noexcept {
  if (count_ == waiting_.size()) return;
  waiting_[(first_ + count_++) % waiting_.size()] = frame;
}

std::size_t InProcessLink::receive(std::span<FrameBuffer> frames) noexcept TANDEM_RT {
  std::size_t taken = 0;
  while (taken < frames.size() && count_ > 0) {
    frames[taken++] = waiting_[first_];
    first_ = (first_ + 1) % waiting_.size();
    --count_;
  }
  statistics_.count_received(frames.first(taken));
  return taken;
}

void InProcessLink::archive(Archive& ar) {
  ar(now_ns_, fate_, fated_, statistics_, waiting_, first_, count_, late_);
}

}  // namespace tandem::hal::ecat
