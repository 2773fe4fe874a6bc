// The process image: the state and the command of every joint and sensor, as plain blocks.
// Layer: hal.  Thread: owned by one thread at a time; copied as bytes to hand it over.
#pragma once

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <numeric>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace tandem {
class Archive;
}

namespace tandem::hal {

enum class FieldType : std::uint8_t { kF64, kI64, kU64, kU32, kU16, kI8, kU8 };

/// That of a C++ type.
template <class T>
[[nodiscard]] consteval FieldType field_type() {
  if constexpr (std::same_as<T, double>) return FieldType::kF64;
  if constexpr (std::same_as<T, std::int64_t>) return FieldType::kI64;
  if constexpr (std::same_as<T, std::uint64_t>) return FieldType::kU64;
  if constexpr (std::same_as<T, std::uint32_t>) return FieldType::kU32;
  if constexpr (std::same_as<T, std::uint16_t>) return FieldType::kU16;
  if constexpr (std::same_as<T, std::int8_t>) return FieldType::kI8;
  if constexpr (std::same_as<T, std::uint8_t>) return FieldType::kU8;
}

/// Bytes of one element.
[[nodiscard]] std::size_t size_of(FieldType type) noexcept;

/// One array of the block: `count` elements of `type` from byte `offset`.
struct Field {
  std::string name;  ///< on the wire (hal/wire_name.hpp), with unit suffix: "torque_nm"
  FieldType type;
  std::size_t count;
  std::size_t offset;
  std::string doc;  ///< one line: unit, meaning, side, sign
};

/// The table of an image's fields. Elements of 8 bytes come first, then 4, 2, 1, so that the
/// block has no padding and its bytes are also the little-endian CDR encoding of a message
/// whose members are these fixed-size arrays in this order.
class Layout {
 public:
  /// @pre size_of(type) is not larger than that of the field before.
  std::size_t add(std::string name, FieldType type, std::size_t count, std::string doc);
  [[nodiscard]] std::span<const Field> fields() const noexcept { return fields_; }
  [[nodiscard]] const Field* find(std::string_view name) const noexcept;
  [[nodiscard]] std::size_t bytes() const noexcept { return bytes_; }

 private:
  std::vector<Field> fields_;
  std::size_t bytes_ = 0;
};

/// How many joints, and how many channels each sensor has, in the robot configuration's order.
struct ImageShape {
  std::size_t joints = 0;
  std::vector<std::size_t> sensor_channels;

  [[nodiscard]] std::size_t channels() const noexcept;
};

/// What a joint does. The image says it to the drive, the drive says it back.
enum class ControlMode : std::int8_t {
  kIdle = 0,      ///< no torque; the drive is not enabled
  kPosition = 1,  ///< CiA 402 CSP when stiff, the manufacturer's impedance mode when compliant
  kVelocity = 2,  ///< CSV when stiff, impedance about the integrated reference when compliant
  kTorque = 3,    ///< CST on the link-side (spring) torque
  kOpenLoop = 4,  ///< motor voltage
  kCurrent = 5,   ///< motor current
};
[[nodiscard]] const char* to_string(ControlMode mode) noexcept;

/// Whether position and velocity control are rigid (PID) or yield (virtual spring and damper).
enum class InteractionMode : std::uint8_t { kStiff = 0, kCompliant = 1 };
[[nodiscard]] const char* to_string(InteractionMode mode) noexcept;

/// CiA 402 drive states, in the image's numbering.
enum class DriveState : std::uint8_t {
  kUnknown = 0,  ///< nothing heard yet
  kNotReadyToSwitchOn,
  kSwitchOnDisabled,
  kReadyToSwitchOn,
  kSwitchedOn,
  kOperationEnabled,
  kQuickStopActive,
  kFaultReactionActive,
  kFault,
};
[[nodiscard]] const char* to_string(DriveState state) noexcept;

/// A block of bytes with a layout. Copying copies the bytes and shares the layout.
class Image {
 public:
  explicit Image(std::shared_ptr<const Layout> layout);

  [[nodiscard]] const Layout& layout() const noexcept { return *layout_; }
  [[nodiscard]] std::span<const std::byte> bytes() const noexcept;
  [[nodiscard]] std::span<std::byte> bytes() noexcept;
  /// Copies the bytes of an image with an equal layout. No allocation.
  void assign(const Image& other) noexcept;

  void archive(Archive& ar);

 protected:
  /// Where a field's elements are, so that no cycle looks for its name.
  struct Slot {
    std::size_t offset = 0;
    std::size_t count = 0;
  };
  /// @param name  of the field in C++. @pre the layout has it
  [[nodiscard]] Slot slot(std::string_view name) const;

  template <class T>
  [[nodiscard]] std::span<T> field(Slot at) noexcept {
    return {reinterpret_cast<T*>(reinterpret_cast<std::byte*>(block_.data()) + at.offset),
            at.count};
  }
  template <class T>
  [[nodiscard]] std::span<const T> field(Slot at) const noexcept {
    return {
        reinterpret_cast<const T*>(reinterpret_cast<const std::byte*>(block_.data()) + at.offset),
        at.count};
  }

 private:
  std::shared_ptr<const Layout> layout_;
  std::vector<double> block_;  // doubles for their alignment
};

// A row of an image's table of fields as members: the accessors `name()`, to write and to read.
#define TANDEM_IMAGE_MEMBERS(type, name, count, doc)                                         \
 public:                                                                                     \
  [[nodiscard]] std::span<type> name() noexcept { return field<type>(name##_); }             \
  [[nodiscard]] std::span<const type> name() const noexcept { return field<type>(name##_); } \
                                                                                             \
 private:                                                                                    \
  Slot name##_;

/// What was measured in one cycle: for each row of hal/state_fields.inc the accessor of its name,
/// `std::span<double> position_rad()`.
class StateImage : public Image {
#define TANDEM_FIELD TANDEM_IMAGE_MEMBERS
#include "hal/state_fields.inc"
#undef TANDEM_FIELD

 public:
  explicit StateImage(const ImageShape& shape);

  [[nodiscard]] std::size_t joints() const noexcept { return position_rad_.count; }
  /// Channels of sensor `index`, in the sensor's documented order.
  [[nodiscard]] std::span<const double> sensor_values(std::size_t index) const noexcept;
  [[nodiscard]] std::span<double> sensor_values(std::size_t index) noexcept;

 private:
  std::vector<Slot> sensors_;  // within sensor(), offset in elements
};

/// What is asked of the drives in one cycle: the accessors of hal/command_fields.inc. A reference
/// that its mode does not use is ignored, except torque_Nm, which is the feed-forward in position,
/// velocity and impedance control.
class CommandImage : public Image {
#define TANDEM_FIELD TANDEM_IMAGE_MEMBERS
#include "hal/command_fields.inc"
#undef TANDEM_FIELD

 public:
  explicit CommandImage(const ImageShape& shape);

  [[nodiscard]] std::size_t joints() const noexcept { return position_rad_.count; }
};

/// Gains of one loop of a drive's firmware, in the units that its output needs.
struct PidGains {
  double kp = 0.0;
  double ki = 0.0;
  double kd = 0.0;

  bool operator==(const PidGains&) const = default;
};

/// The loops whose gains can be set at run time.
enum class PidLoop : std::uint8_t { kPosition = 0, kVelocity, kTorque, kCurrent };
inline constexpr std::size_t kPidLoops = 4;
[[nodiscard]] const char* to_string(PidLoop loop) noexcept;

/// The gains of every joint: what changes seldom and travels by SDO. A change raises the
/// joint's revision; the backend sends what it has not sent yet.
class ParameterImage {
 public:
  explicit ParameterImage(std::size_t joints) : gains_(joints * kPidLoops), revision_(joints) {}
  /// The gains that the drives start with (kPidLoops per joint, in PidLoop's order), revision 0.
  explicit ParameterImage(std::vector<PidGains> gains)
      : gains_(std::move(gains)), revision_(gains_.size() / kPidLoops) {}

  [[nodiscard]] const PidGains& gains(std::size_t joint, PidLoop loop) const noexcept {
    return gains_[joint * kPidLoops + static_cast<std::size_t>(loop)];
  }
  void set_gains(std::size_t joint, PidLoop loop, const PidGains& gains) noexcept {
    gains_[joint * kPidLoops + static_cast<std::size_t>(loop)] = gains;
    ++revision_[joint];
  }
  [[nodiscard]] std::uint32_t revision(std::size_t joint) const noexcept {
    return revision_[joint];
  }
  /// Changes with every joint's.
  [[nodiscard]] std::uint64_t revision() const noexcept {
    return std::accumulate(revision_.begin(), revision_.end(), std::uint64_t{0});
  }
  [[nodiscard]] std::size_t joints() const noexcept { return revision_.size(); }
  /// All gains: kPidLoops per joint, in PidLoop's order.
  [[nodiscard]] std::span<const PidGains> all() const noexcept { return gains_; }
  /// Gains and revision of one joint as they are in `from`, an image of the same joints.
  void copy_joint(std::size_t joint, const ParameterImage& from) noexcept {
    const auto first = static_cast<std::ptrdiff_t>(joint * kPidLoops);
    std::copy_n(from.gains_.begin() + first, kPidLoops, gains_.begin() + first);
    revision_[joint] = from.revision_[joint];
  }

  void archive(Archive& ar);

 private:
  std::vector<PidGains> gains_;
  std::vector<std::uint32_t> revision_;
};

}  // namespace tandem::hal
