// What a board got and what it answered, as bytes: a recording made on a PC is played to the same
// firmware on a microcontroller. Little endian, without padding.
//
// Asked:    magic, setup, then for each step its number of frames, the frames, the time until the
//           next step, and of each axis what its pins say. It ends where the bytes end.
// Answered: for each step the number of frames, the frames, and of each axis what its bridge does.
//
// Layer: firmware_emu.  Thread: any.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

#include "canopen/frame.hpp"
#include "firmware_emu/board.hpp"
#include "firmware_emu/setup.hpp"

namespace tandem::firmware::recording {

static_assert(std::endian::native == std::endian::little);

inline constexpr std::uint32_t kMagic = 0x3152'4254;  // "TBR1"

// A stream is what has `bool raw(void* bytes, std::size_t size)`: it writes them somewhere, or
// fills them, and says whether it could.

/// A number, whatever width the machine gives its type: `Wire` is the one in the recording.
template <class Wire, class Stream, class T>
[[nodiscard]] bool number(Stream& stream, T& value) {
  Wire wire = static_cast<Wire>(value);
  if (!stream.raw(&wire, sizeof wire)) return false;
  value = static_cast<T>(wire);
  return true;
}

template <class Stream>
[[nodiscard]] bool transfer(Stream& stream, AxisSetup& a) {
  return stream.raw(&a.parameters, sizeof a.parameters) && number<std::uint32_t>(stream, a.modes) &&
         number<std::uint8_t>(stream, a.reversed) && number<std::int32_t>(stream, a.zero_counts) &&
         number<std::int32_t>(stream, a.turn_counts) &&
         number<std::uint8_t>(stream, a.counts_from_power_on) &&
         number<std::uint64_t>(stream, a.homing_methods) &&
         number<double>(stream, a.home_switch_from_rad) &&
         number<double>(stream, a.home_switch_to_rad) && number<double>(stream, a.index_rad) &&
         number<double>(stream, a.index_pitch_rad) &&
         number<double>(stream, a.velocity_units_per_rev) &&
         number<double>(stream, a.acceleration_units_per_rev) &&
         number<double>(stream, a.torque_noise_Nm) && number<double>(stream, a.torque_quantum_Nm);
}

/// All but a sheet: a board that stands in for another make is not recorded.
template <class Stream>
[[nodiscard]] bool transfer(Stream& stream, BoardSetup& b) {
  std::uint32_t magic = kMagic, letters = static_cast<std::uint32_t>(b.name.size());
  std::uint32_t axes = static_cast<std::uint32_t>(b.axes.size());
  if (!stream.raw(&magic, sizeof magic) || magic != kMagic) return false;
  if (!number<std::uint32_t>(stream, letters) || letters > 255) return false;
  b.name.resize(letters);
  if (!stream.raw(b.name.data(), letters) || !number<std::int32_t>(stream, b.node_id) ||
      !number<std::uint32_t>(stream, b.vendor) || !number<std::uint32_t>(stream, b.product) ||
      !number<std::uint32_t>(stream, b.revision) || !number<std::uint32_t>(stream, b.serial) ||
      !number<std::int64_t>(stream, b.control_period_ns) ||
      !number<std::uint32_t>(stream, b.max_pdo_bytes) || !number<std::uint64_t>(stream, b.seed) ||
      !number<std::uint32_t>(stream, axes) ||
      axes > static_cast<std::uint32_t>(canopen::kMaxAxes)) {
    return false;
  }
  b.axes.resize(axes);
  for (AxisSetup& axis : b.axes) {
    if (!transfer(stream, axis)) return false;
  }
  return true;
}

/// Its length's bytes alone.
template <class Stream>
[[nodiscard]] bool transfer(Stream& stream, canopen::Frame& frame) {
  return number<std::uint16_t>(stream, frame.id) && number<std::uint8_t>(stream, frame.length) &&
         number<std::uint8_t>(stream, frame.flags) && frame.length <= canopen::kMaxFrameBytes &&
         stream.raw(frame.data.data(), frame.length);
}

template <class Stream>
[[nodiscard]] bool transfer(Stream& stream, AxisSense& s) {
  return number<double>(stream, s.link_position_rad) &&
         number<double>(stream, s.motor_position_rad) &&
         number<double>(stream, s.spring_torque_Nm) && number<double>(stream, s.current_A) &&
         number<double>(stream, s.temperature_C) && number<double>(stream, s.bus_voltage_V) &&
         number<std::uint8_t>(stream, s.emergency_stop);
}

template <class Stream>
[[nodiscard]] bool transfer(Stream& stream, AxisDrive& d) {
  return number<double>(stream, d.voltage_V) && number<std::uint8_t>(stream, d.enabled) &&
         number<std::uint8_t>(stream, d.brake_open);
}

/// What a step is asked.
template <class Stream>
bool ask(Stream& stream, std::span<const canopen::Frame> frames, std::int64_t dt_ns,
         std::span<const AxisSense> sense) {
  auto count = static_cast<std::uint32_t>(frames.size());
  bool ok = number<std::uint32_t>(stream, count);
  for (canopen::Frame frame : frames) ok = ok && transfer(stream, frame);
  ok = ok && number<std::int64_t>(stream, dt_ns);
  for (AxisSense one : sense) ok = ok && transfer(stream, one);
  return ok;
}

/// What it answers.
template <class Stream>
bool answer(Stream& stream, std::span<const canopen::Frame> frames,
            std::span<const AxisDrive> drives) {
  auto count = static_cast<std::uint32_t>(frames.size());
  bool ok = number<std::uint32_t>(stream, count);
  for (canopen::Frame frame : frames) ok = ok && transfer(stream, frame);
  for (AxisDrive drive : drives) ok = ok && transfer(stream, drive);
  return ok;
}

enum class Played : std::uint8_t { kToItsEnd, kCutOff, kAnswersNotWritten };

/// Plays what comes after the setup to a board. No heap after construction.
class Player {
 public:
  Player(Board& board, std::size_t axes)
      : board_(&board), frames_(kMostFrames), sense_(axes), drives_(axes) {}

  /// @param asked, answered  streams; `asked` is behind the setup
  /// @param timed  begin() and end() are called around what is the board's own work of each step
  template <class Asked, class Answered, class Timed>
  [[nodiscard]] Played play(Asked& asked, Answered& answered, Timed& timed) {
    for (std::uint32_t count = 0; number<std::uint32_t>(asked, count);) {
      if (!take(asked, count)) return Played::kCutOff;
      timed.begin();
      for (std::uint32_t i = 0; i < count; ++i) board_->receive(frames_[i]);
      board_->step(dt_ns_, sense_, drives_);
      timed.end();
      if (!answer(answered, board_->outgoing(), drives_)) return Played::kAnswersNotWritten;
      board_->clear_outgoing();
    }
    return Played::kToItsEnd;
  }

 private:
  static constexpr std::size_t kMostFrames = 256;  // in a step

  template <class Asked>
  [[nodiscard]] bool take(Asked& asked, std::uint32_t count) {
    if (count > frames_.size()) return false;
    for (std::uint32_t i = 0; i < count; ++i) {
      frames_[i] = {};
      if (!transfer(asked, frames_[i])) return false;
    }
    if (!number<std::int64_t>(asked, dt_ns_)) return false;
    for (AxisSense& one : sense_) {
      if (!transfer(asked, one)) return false;
    }
    return true;
  }

  Board* board_;
  std::vector<canopen::Frame> frames_;
  std::vector<AxisSense> sense_;
  std::vector<AxisDrive> drives_;
  std::int64_t dt_ns_ = 0;
};

}  // namespace tandem::firmware::recording
