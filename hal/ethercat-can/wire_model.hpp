// The time that frames need on a real bus: queues, arbitration, bit rates. Pure and deterministic.
// Layer: hal/ethercat-can.  Thread: construction non-RT; the rest one thread's.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/realtime.hpp"
#include "canopen/frame.hpp"
#include "hal/ethercat-can/frame_time.hpp"

namespace tandem {
class Archive;
}

namespace tandem::hal::can {

/// One bus with `senders` nodes. Sender 0, the master, has a first-in-first-out queue, as a socket
/// has; the others send the lowest identifier of their mailboxes first, as a board's controller
/// does. When the wire is free the lowest identifier among the queues' heads that are ready goes
/// next, at one of two alike the lower sender's, and nothing interrupts it. A frame takes its exact
/// stuffed length; it is received at the end of its EOF, and the wire is free three bits later.
///
/// ```
/// wire.push(kMaster, frame, ready_ns);
/// while (wire.next(until_ns, delivery)) …   // in the order in which they were received
/// ```
class WireModel {
 public:
  static constexpr std::size_t kMaster = 0;

  struct Delivery {
    canopen::Frame frame;
    std::size_t sender = 0;
    std::int64_t complete_ns = 0;  ///< when the receivers have it
  };

  /// @param latency_ns  of every sender's driver or firmware: from push()'s `ready_ns` until the
  ///                    frame takes part in the arbitration
  /// @param capacity    of each queue; a frame beyond it is dropped and counted
  WireModel(const BitRates& rates, std::size_t senders, std::int64_t latency_ns = 0,
            std::size_t capacity = 256);

  /// @pre sender < senders; a sender's `ready_ns` does not go back, nor behind next()'s `until_ns`
  ///      (earlier ones count as ready from then on, as nothing is sent in the past)
  bool push(std::size_t sender, const canopen::Frame& frame,
            std::int64_t ready_ns) noexcept TANDEM_RT;
  /// The next frame that is complete at `until_ns` or before. One that has begun before and ends
  /// after it is on the wire, and keeps it.
  /// @return false when there is none.
  /// @rt no allocation; O(senders + bits)
  [[nodiscard]] bool next(std::int64_t until_ns, Delivery& delivery) noexcept TANDEM_RT;

  /// Frames that wait or are on the wire.
  [[nodiscard]] std::size_t waiting() const noexcept;
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_; }

  void archive(Archive& ar);

 private:
  struct Item {
    canopen::Frame frame;
    std::int64_t ready_ns = 0;
  };
  struct Queue {
    std::vector<Item> items;
    std::size_t first = 0;
    std::size_t count = 0;

    [[nodiscard]] const Item& head() const noexcept { return items[first]; }
    [[nodiscard]] Item& at(std::size_t i) noexcept { return items[(first + i) % items.size()]; }
  };

  [[nodiscard]] bool begin(std::int64_t before_ns) noexcept;

  BitRates rates_;
  std::int64_t latency_ns_;
  std::vector<Queue> queues_;  // by sender
  Delivery on_wire_;           // when busy_
  std::int64_t free_ns_;       // when the wire is, or was, free
  std::uint64_t dropped_ = 0;
  std::uint8_t busy_ = 0;
};

}  // namespace tandem::hal::can
