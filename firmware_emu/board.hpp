// A control board: the firmware of one CANopen node with one or more axes.
// Layer: firmware_emu.  Thread: RT; construction non-RT.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "base/result.hpp"
#include "canopen/frame.hpp"
#include "canopen/node.hpp"
#include "canopen/object_dictionary.hpp"
#include "firmware_emu/axis.hpp"
#include "firmware_emu/setup.hpp"
#include "firmware_emu/sheet_dictionary.hpp"
#include "firmware_emu/wire.hpp"

namespace tandem::firmware {

inline constexpr std::size_t kOutboxFrames = 64;

/// Whether a Board can be built from `setup`: node id, number of axes, periods, and every number
/// finite and of the right sign. The error's key names the axis.
[[nodiscard]] Status check(const BoardSetup& setup);

/// Frames and the pins' truth in, frames and motor voltages out. One cycle at time t:
///
/// ```
/// for (const Frame& frame : what_the_bus_carries) board.receive(frame);  // SYNC among them
/// board.step(dt_ns, sense_at_t, drive);        // drive: holds from t on
/// for (const Frame& frame : board.outgoing()) bus.send(frame);
/// board.clear_outgoing();
/// ```
///
/// RPDOs that came before the SYNC take effect at the SYNC. TPDOs that the SYNC makes due are sent
/// by the step() after it and carry what the sensors say at t. No heap after construction.
class Board {
 public:
  /// @pre check(setup)
  explicit Board(const BoardSetup& setup);
  Board(const Board&) = delete;
  Board& operator=(const Board&) = delete;

  /// Takes a frame of the bus, whoever it is for. What is no data frame of CAN or CAN FD is
  /// ignored and counted (2050).
  void receive(const canopen::Frame& frame) noexcept TANDEM_RT {
    // Frames of others, most of a bus, change nothing.
    if (heartbeat_lost_ || !is_data_frame(frame) || node_.hears(frame.id)) hear(frame);
  }

  /// Advances time by `dt_ns`. The controllers run in the first call and then whenever the
  /// control period is over; in between `drive` repeats what they last said.
  ///
  /// @param dt_ns  until the next call. @pre control_period_ns is a multiple of it
  /// @param sense  (axes) truth now
  /// @param drive  (axes) written in place
  /// @rt  no allocation, lock, throw or system call; O(axes)
  void step(std::int64_t dt_ns, std::span<const AxisSense> sense,
            std::span<AxisDrive> drive) noexcept TANDEM_RT;

  /// Frames to be sent, in order, until clear_outgoing().
  [[nodiscard]] std::span<const canopen::Frame> outgoing() const noexcept {
    return outbox_.frames();
  }
  void clear_outgoing() noexcept TANDEM_RT { outbox_.clear(); }
  /// Frames lost because nobody cleared the outbox.
  [[nodiscard]] std::uint64_t dropped() const noexcept { return outbox_.dropped(); }

  [[nodiscard]] int node_id() const noexcept { return setup_.node_id; }
  [[nodiscard]] const std::string& name() const noexcept { return setup_.name; }
  [[nodiscard]] std::size_t axes() const noexcept { return axes_.size(); }
  [[nodiscard]] const Axis& axis(std::size_t index) const noexcept { return *axes_[index]; }
  [[nodiscard]] canopen::NmtState nmt_state() const noexcept { return node_.state(); }
  [[nodiscard]] std::int64_t control_period_ns() const noexcept { return setup_.control_period_ns; }
  [[nodiscard]] const canopen::ObjectDictionary& dictionary() const noexcept { return od_; }
  /// For a wire that reaches the objects without frames; no entry may be added.
  [[nodiscard]] canopen::ObjectDictionary& dictionary() noexcept { return od_; }

  /// What 1018:`sub` says from now on: the firmware was exchanged, or the whole board.
  /// A drive whose sheet has no such entry stays as it is.
  void set_identity(canopen::IdentitySub sub, std::uint32_t value) noexcept TANDEM_RT {
    const auto entry = static_cast<std::uint8_t>(sub);
    if (od_.find(canopen::object::kIdentity, entry) == nullptr) return;
    od_.set_value(canopen::object::kIdentity, entry, value);
  }
  /// What a board that stands in for another maker's drive lacks or takes otherwise.
  [[nodiscard]] const std::vector<std::string>& remarks() const noexcept {
    return sheet_.remarks();
  }

  /// Everything that changes, frames that wait to be sent included.
  void archive(Archive& ar);

 private:
  /// How long an axis has been without a command.
  struct Commands {
    std::uint32_t syncs_without = 0;
    std::uint32_t rpdos = 0;  ///< bit n-1: RPDO n carries the axis's controlword
  };

  void hear(const canopen::Frame& frame) noexcept TANDEM_RT;
  void take(canopen::NodeEvents events) noexcept;
  void find_command_rpdos() noexcept;
  void clear_when_well() noexcept;
  [[nodiscard]] canopen::ErrorCode connection(std::size_t axis) const noexcept;
  void supervise(std::size_t axis) noexcept;

  BoardSetup setup_;
  canopen::ObjectDictionary od_;
  std::vector<std::unique_ptr<Axis>> axes_;
  canopen::Node node_;
  const std::uint32_t* sync_period_us_;  ///< 1006
  SheetDictionary sheet_;
  std::vector<canopen::Frame> outbox_storage_;
  canopen::FrameSink outbox_;
  std::vector<Commands> commands_;
  std::vector<AxisDrive> drives_;
  std::uint32_t ignored_frames_ = 0;
  std::uint32_t sync_timeout_us_ = 0;  ///< 2052
  std::uint8_t cycle_counter_ = 0;     ///< 2051: the master's, echoed
  std::int64_t until_control_ns_ = 0;
  std::int64_t since_sync_ns_ = 0;
  bool offline_ = true;          ///< not operational: no command can come
  bool heartbeat_lost_ = false;  ///< the master's
  bool sync_pending_ = false;
};

}  // namespace tandem::firmware
