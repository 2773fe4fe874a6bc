// The lowest identifier among the queues' heads wins the bus and is not interrupted; each frame
// takes its exact stuffed length.
#include "hal/ethercat-can/wire_model.hpp"

#include <algorithm>
#include <limits>

#include "base/archive.hpp"

namespace tandem::hal::can {
namespace {

constexpr FrameBits kIntermission{.nominal = 3, .data = 0};

}  // namespace

WireModel::WireModel(const BitRates& rates, std::size_t senders, std::int64_t latency_ns,
                     std::size_t capacity)
    : rates_(rates),
      latency_ns_(latency_ns),
      queues_(senders),
      free_ns_(std::numeric_limits<std::int64_t>::min()) {
  for (Queue& queue : queues_) queue.items.resize(capacity);
}

bool WireModel::push(std::size_t sender, const canopen::Frame& frame,
                     std::int64_t ready_ns) noexcept TANDEM_RT {
  Queue& queue = queues_[sender];
  if (queue.count == queue.items.size()) {
    ++dropped_;
    return false;
  }
  std::size_t place = queue.count++;
  while (sender != kMaster && place > 0 && queue.at(place - 1).frame.id > frame.id) {
    queue.at(place) = queue.at(place - 1);
    --place;
  }
  queue.at(place) = {frame, ready_ns + latency_ns_};
  return true;
}

bool WireModel::next(std::int64_t until_ns, Delivery& delivery) noexcept TANDEM_RT {
  if (busy_ == 0 && !begin(until_ns)) return false;
  if (on_wire_.complete_ns > until_ns) return false;
  delivery = on_wire_;
  busy_ = 0;
  return true;
}

/// Lets the winner of the next arbitration onto the wire, when that is before `before_ns`: who is
/// ready at that very time may still be pushed.
bool WireModel::begin(std::int64_t before_ns) noexcept {
  std::int64_t start_ns = std::numeric_limits<std::int64_t>::max();
  for (const Queue& queue : queues_) {
    if (queue.count > 0) start_ns = std::min(start_ns, queue.head().ready_ns);
  }
  start_ns = std::max(start_ns, free_ns_);
  if (start_ns >= before_ns) return false;
  std::size_t winner = queues_.size();
  for (std::size_t i = 0; i < queues_.size(); ++i) {
    const Queue& queue = queues_[i];
    if (queue.count == 0 || queue.head().ready_ns > start_ns) continue;
    const bool first = winner == queues_.size();
    if (first || queue.head().frame.id < queues_[winner].head().frame.id) winner = i;
  }
  Queue& queue = queues_[winner];
  const canopen::Frame& frame = queue.head().frame;
  free_ns_ = start_ns + duration_ns(exact_frame_bits(frame), rates_);
  on_wire_ = {.frame = frame,
              .sender = winner,
              .complete_ns = free_ns_ - duration_ns(kIntermission, rates_)};
  queue.first = (queue.first + 1) % queue.items.size();
  --queue.count;
  busy_ = 1;
  return true;
}

std::size_t WireModel::waiting() const noexcept {
  std::size_t count = busy_;
  for (const Queue& queue : queues_) count += queue.count;
  return count;
}

/// Only the frames that wait: what the queues held before is no state.
void WireModel::archive(Archive& ar) {
  ar(free_ns_, dropped_, busy_);
  if (busy_ != 0) ar(on_wire_.frame, on_wire_.sender, on_wire_.complete_ns);
  for (Queue& queue : queues_) {
    std::size_t count = queue.count;
    ar(count);
    if (ar.reading()) {
      queue.first = 0;
      queue.count = std::min(count, queue.items.size());
    }
    for (std::size_t i = 0; i < queue.count; ++i) {
      ar(queue.at(i).frame, queue.at(i).ready_ns);
    }
  }
}

}  // namespace tandem::hal::can
