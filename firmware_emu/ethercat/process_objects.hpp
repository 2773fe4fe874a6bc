// One direction of a slave's process data: which objects say what it is, and what becomes of it.
// Layer: firmware_emu.  Thread: the line's; construction non-RT.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "canopen/object_dictionary.hpp"

namespace tandem::firmware::esc {

inline constexpr std::size_t kMaxPdos = 4;  ///< that are the process data at a time
/// What the memory of one direction has room for, three buffers of it.
inline constexpr std::size_t kMaxProcessBytes = 1024;

enum class Direction : std::uint8_t { kOutputs, kInputs };

/// The object that assigns PDOs: 1C12 or 1C13.
[[nodiscard]] constexpr std::uint16_t assignment_object(Direction direction) noexcept {
  return direction == Direction::kOutputs ? 0x1C12 : 0x1C13;
}

class ProcessObjects {
 public:
  virtual ~ProcessObjects() = default;

  /// As after power-on.
  virtual void reset() noexcept TANDEM_RT = 0;
  /// Adds its objects to `od`. @return false when `od` is full or has one of them
  virtual bool add_to(canopen::ObjectDictionary& od) = 0;
  /// Whether the objects may be written: in PREOP.
  virtual void set_open(bool open) noexcept TANDEM_RT = 0;
  /// Bytes that the assigned PDOs have together.
  [[nodiscard]] virtual std::size_t bytes() const noexcept TANDEM_RT = 0;
  /// The objects stay as they are from now on.
  virtual void compile() noexcept TANDEM_RT = 0;
  /// Outputs: what came. @pre compile(); image.size() == bytes()
  virtual void take(std::span<const std::uint8_t> image) noexcept TANDEM_RT = 0;
  /// Inputs: what goes out. @pre compile(); image.size() == bytes()
  virtual void give(std::span<std::uint8_t> image) const noexcept TANDEM_RT = 0;
  virtual void archive(Archive& ar) = 0;
};

}  // namespace tandem::firmware::esc
