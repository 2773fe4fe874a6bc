// A CAN bus as its wire is: one frame at a time, the lowest identifier first, each as long as its
// bits take. What queues in memory and virtual interfaces hand over at once, comes in turns here.
// Layer: tests.  Thread: one.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "hal/ethercat-can/frame_time.hpp"

namespace tandem::test {

class SerialWire {
 public:
  struct Passage {
    canopen::Frame frame;
    bool from_master = false;
  };

  explicit SerialWire(const hal::can::BitRates& rates) : rates_(rates) {}

  /// Frames that a node wants to send.
  void offer(std::span<const canopen::Frame> frames, bool from_master) {
    for (const canopen::Frame& frame : frames) waiting_.push_back({frame, from_master});
  }
  /// What is through by `now_ns`, if something is. The wire goes to the next one from then on.
  [[nodiscard]] std::optional<Passage> take(std::int64_t now_ns) {
    if (!passing_) arbitrate(now_ns);
    if (!passing_ || now_ns < through_ns_) return std::nullopt;
    const std::optional<Passage> through = passing_;
    passing_.reset();
    arbitrate(now_ns);
    return through;
  }
  /// When the frame on the wire is through; nothing while there is none.
  [[nodiscard]] std::optional<std::int64_t> through_ns() const {
    return passing_ ? std::optional(through_ns_) : std::nullopt;
  }

 private:
  void arbitrate(std::int64_t now_ns) {
    const auto lowest = std::ranges::min_element(  // the first of equal ones
        waiting_, {}, [](const Passage& passage) { return passage.frame.id; });
    if (lowest == waiting_.end()) return;
    passing_ = *lowest;
    waiting_.erase(lowest);
    through_ns_ = now_ns + duration_ns(hal::can::exact_frame_bits(passing_->frame), rates_);
  }

  hal::can::BitRates rates_;
  std::vector<Passage> waiting_;
  std::optional<Passage> passing_;
  std::int64_t through_ns_ = 0;
};

}  // namespace tandem::test
