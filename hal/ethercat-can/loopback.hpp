// A bus inside the process: what the master sends the boards receive, and the other way round.
// Layer: hal/ethercat-can.  Thread: the one that owns the simulated robot.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/realtime.hpp"
#include "hal/ethercat-can/bus.hpp"

namespace tandem {
class Archive;
}

namespace tandem::hal::can {

/// Two first-in-first-out queues of fixed capacity. The order is the order of sending, so that a
/// run depends on nothing else. Boards on the same bus do not hear each other.
///
/// ```
/// master.cycle_begin(time);                       // through bus.master()
/// for (const Frame& frame : bus.to_boards()) …    // every board sees every frame
/// bus.take_to_boards(bus.to_boards().size());
/// bus.boards().send(frames_of_a_board);
/// ```
class LoopbackBus {
 public:
  /// @param capacity  most frames in flight each way; a frame beyond it is dropped and counted.
  explicit LoopbackBus(std::size_t capacity = 512);
  LoopbackBus(const LoopbackBus&) = delete;
  LoopbackBus& operator=(const LoopbackBus&) = delete;

  [[nodiscard]] Bus& master() noexcept { return master_; }
  [[nodiscard]] Bus& boards() noexcept { return boards_; }

  /// The frames that wait for the boards, in place, oldest first.
  [[nodiscard]] std::span<const canopen::Frame> to_boards() const noexcept TANDEM_RT {
    return to_boards_.frames();
  }
  /// The first `count` of them are delivered.
  void take_to_boards(std::size_t count) noexcept TANDEM_RT { to_boards_.drop(count); }

  [[nodiscard]] std::uint64_t dropped() const noexcept {
    return to_boards_.dropped + to_master_.dropped;
  }
  /// Frames that have passed, both ways.
  [[nodiscard]] std::uint64_t passed() const noexcept {
    return to_boards_.passed + to_master_.passed;
  }
  /// A cut cable: while off, frames of both ends are lost.
  void set_connected(bool connected) noexcept { connected_ = connected; }

  /// The frames in flight.
  void archive(Archive& ar);

 private:
  struct Queue {
    explicit Queue(std::size_t capacity) : storage(capacity) {}
    [[nodiscard]] std::span<const canopen::Frame> frames() const noexcept {
      return {storage.data() + first, count};
    }
    std::size_t push(std::span<const canopen::Frame> frames) noexcept;
    std::size_t pop(std::span<canopen::Frame> frames) noexcept;
    void drop(std::size_t frames) noexcept;
    void archive(Archive& ar);

    std::vector<canopen::Frame> storage;
    std::size_t first = 0;  ///< of those that wait; goes back to 0 when none does
    std::size_t count = 0;
    std::uint64_t dropped = 0;
    std::uint64_t passed = 0;
  };
  class End final : public Bus {
   public:
    End(LoopbackBus& bus, Queue& out, Queue& in) noexcept : bus_(bus), out_(out), in_(in) {}
    std::size_t send(std::span<const canopen::Frame> frames) noexcept TANDEM_RT override;
    std::size_t receive(std::span<canopen::Frame> frames) noexcept TANDEM_RT override;
    [[nodiscard]] BusState state() const noexcept TANDEM_RT override { return BusState::kActive; }
    [[nodiscard]] BusStatistics statistics() const noexcept TANDEM_RT override {
      return {.sent = out_.passed, .received = in_.passed};
    }

   private:
    LoopbackBus& bus_;
    Queue& out_;
    Queue& in_;
  };

  Queue to_boards_;
  Queue to_master_;
  bool connected_ = true;
  End master_{*this, to_boards_, to_master_};
  End boards_{*this, to_master_, to_boards_};
};

}  // namespace tandem::hal::can
