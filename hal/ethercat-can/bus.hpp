// One CAN bus as a protocol master or a board sees it: frames out, frames in.
// Layer: hal/ethercat-can.  Thread: RT, one at each end.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "base/realtime.hpp"
#include "canopen/frame.hpp"

namespace tandem {
class Archive;
}

namespace tandem::hal::can {

enum class BusState : std::uint8_t {
  kActive = 0,
  kOverloaded,    ///< works, but within the last second frames were lost in a full queue
  kErrorPassive,  ///< still works, errors are frequent
  kBusOff,        ///< the controller has taken itself off the bus: nothing is sent or received
  kDown,          ///< the interface is there, and down
  kGone,          ///< the interface is not there (any more)
};

/// Whether frames can pass.
[[nodiscard]] constexpr bool usable(BusState state) noexcept {
  return state <= BusState::kErrorPassive;
}

/// What has passed since the bus was opened.
struct BusStatistics {
  std::uint64_t sent = 0;          ///< frames taken for sending
  std::uint64_t received = 0;      ///< data frames
  std::uint64_t send_refused = 0;  ///< frames that were lost because the queue or the bus was down
  std::uint64_t queue_full = 0;    ///< times that the transmit queue took less than was given
  std::uint64_t receive_lost = 0;  ///< frames that came faster than they were taken
  std::uint64_t error_frames = 0;  ///< that the controller's driver reported
  std::uint64_t ignored = 0;       ///< frames that no node of ours sends: 29-bit, remote, malformed
  std::uint64_t recoveries = 0;    ///< times that the bus became usable again
};

/// One end of a bus. Never blocks.
class Bus {
 public:
  virtual ~Bus() = default;

  /// Hands frames over for sending, in order.
  /// @return how many were taken; the rest is dropped, and counted by the bus.
  virtual std::size_t send(std::span<const canopen::Frame> frames) noexcept TANDEM_RT = 0;
  /// Takes what has arrived, oldest first.
  /// @return how many; less than frames.size() means that nothing more is there.
  virtual std::size_t receive(std::span<canopen::Frame> frames) noexcept TANDEM_RT = 0;
  [[nodiscard]] virtual BusState state() const noexcept TANDEM_RT = 0;
  /// Asks once more for what the cycle has not brought, where the wire can.
  virtual void ask_again() noexcept TANDEM_RT {}
  /// As Backend::clock_shift_ns(); 0: the wire has no clock.
  [[nodiscard]] virtual std::int64_t clock_shift_ns() const noexcept TANDEM_RT { return 0; }
  /// Whether the node cannot come up, however often it is reset: status_text() says why.
  [[nodiscard]] virtual bool gives_up(int /*node*/) const noexcept TANDEM_RT { return false; }
  /// All that the nodes of this end say in a step has been sent.
  virtual void end_step() noexcept TANDEM_RT {}
  /// What this end remembers between two cycles of lockstep, when every frame was taken. Not RT.
  virtual void archive(Archive& /*ar*/) {}

  /// When the frames of the last receive() reached this machine [ns, the clock of sent_ns()], in
  /// their order; empty when the bus does not know.
  [[nodiscard]] virtual std::span<const std::int64_t> received_ns() const noexcept TANDEM_RT {
    return {};
  }
  /// When the last send() handed its frames over; 0 when the bus does not know.
  [[nodiscard]] virtual std::int64_t sent_ns() const noexcept TANDEM_RT { return 0; }

  /// How long its wire was busy with frames since it was asked last [ns]; 0: the bus does not know.
  [[nodiscard]] virtual std::int64_t take_wire_ns() noexcept TANDEM_RT { return 0; }
  [[nodiscard]] virtual BusStatistics statistics() const noexcept TANDEM_RT { return {}; }
  /// What this kind of wire alone can tell of the run so far, in a sentence; empty: nothing. Not
  /// RT.
  [[nodiscard]] virtual std::string measured_text() const { return {}; }
  /// Why state() is not kActive, with what to do about it; empty while it is. Not RT.
  [[nodiscard]] virtual std::string status_text() const { return {}; }
};

/// Passes every call on to `to`, which outlives it. Who stands between a master and its bus derives
/// from it and overrides what it changes, so that a call that is new in Bus reaches the wire.
class ForwardingBus : public Bus {
 public:
  explicit ForwardingBus(Bus& to) noexcept : to_(&to) {}

  std::size_t send(std::span<const canopen::Frame> frames) noexcept TANDEM_RT override {
    return to_->send(frames);
  }
  std::size_t receive(std::span<canopen::Frame> frames) noexcept TANDEM_RT override {
    return to_->receive(frames);
  }
  [[nodiscard]] BusState state() const noexcept TANDEM_RT override { return to_->state(); }
  void ask_again() noexcept TANDEM_RT override { to_->ask_again(); }
  [[nodiscard]] std::int64_t clock_shift_ns() const noexcept TANDEM_RT override {
    return to_->clock_shift_ns();
  }
  [[nodiscard]] bool gives_up(int node) const noexcept TANDEM_RT override {
    return to_->gives_up(node);
  }
  void end_step() noexcept TANDEM_RT override { to_->end_step(); }
  void archive(Archive& ar) override { to_->archive(ar); }
  [[nodiscard]] std::span<const std::int64_t> received_ns() const noexcept TANDEM_RT override {
    return to_->received_ns();
  }
  [[nodiscard]] std::int64_t sent_ns() const noexcept TANDEM_RT override { return to_->sent_ns(); }
  [[nodiscard]] std::int64_t take_wire_ns() noexcept TANDEM_RT override {
    return to_->take_wire_ns();
  }
  [[nodiscard]] BusStatistics statistics() const noexcept TANDEM_RT override {
    return to_->statistics();
  }
  [[nodiscard]] std::string measured_text() const override { return to_->measured_text(); }
  [[nodiscard]] std::string status_text() const override { return to_->status_text(); }

 private:
  Bus* to_;
};

}  // namespace tandem::hal::can
