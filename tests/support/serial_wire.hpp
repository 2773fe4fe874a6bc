// A CAN bus as its wire is: one frame at a time, the lowest identifier first, each as long as its
// bits take. What queues in memory and virtual interfaces hand over at once, comes in turns here.
// Layer: tests.  Thread: one.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
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

  /// Frames that a node wants to send from `now_ns` on.
  void offer(std::span<const canopen::Frame> frames, bool from_master, std::int64_t now_ns) {
    for (const canopen::Frame& frame : frames) waiting_.push_back({{frame, from_master}, now_ns});
  }
  /// What is through by `now_ns`, if something is. The wire has gone to the next one when it was:
  /// who looks late finds as many frames through as if it had looked in time.
  [[nodiscard]] std::optional<Passage> take(std::int64_t now_ns) {
    if (!passing_) arbitrate();
    if (!passing_ || now_ns < through_ns_) return std::nullopt;
    const std::optional<Passage> through = passing_;
    passing_.reset();
    arbitrate();
    return through;
  }
  /// When the frame on the wire is through; nothing while there is none.
  [[nodiscard]] std::optional<std::int64_t> through_ns() const {
    return passing_ ? std::optional(through_ns_) : std::nullopt;
  }

 private:
  struct Waiting {
    Passage passage;
    std::int64_t since_ns = 0;
  };

  void arbitrate() {
    if (waiting_.empty()) return;
    const std::int64_t begin_ns =
        std::max(through_ns_, std::ranges::min(waiting_, {}, &Waiting::since_ns).since_ns);
    const auto rank = [&](const Waiting& one) {  // the first of equal ones is taken
      return std::pair(one.since_ns > begin_ns, one.passage.frame.id);
    };
    const auto lowest = std::ranges::min_element(waiting_, {}, rank);
    passing_ = lowest->passage;
    waiting_.erase(lowest);
    through_ns_ = begin_ns + duration_ns(hal::can::exact_frame_bits(passing_->frame), rates_);
  }

  hal::can::BitRates rates_;
  std::vector<Waiting> waiting_;
  std::optional<Passage> passing_;
  std::int64_t through_ns_ = 0;  ///< of the last one, while none passes
};

}  // namespace tandem::test
