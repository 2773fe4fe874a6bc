// The process image: the state and the command of every joint and sensor, as plain blocks.
// Layer: hal.  Thread: owned by one thread at a time; copied as bytes to hand it over.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
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

/// Bytes of one element.
[[nodiscard]] std::size_t size_of(FieldType type) noexcept;

/// One array of the block: `count` elements of `type` from byte `offset`.
struct Field {
  std::string name;  ///< with unit suffix, "position_rad"
  FieldType type;
  std::size_t count;
  std::size_t offset;
  std::string doc;  ///< one line: meaning, side, sign
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
  template <class T>
  [[nodiscard]] std::span<T> field(std::size_t offset, std::size_t count) noexcept {
    return {reinterpret_cast<T*>(reinterpret_cast<std::byte*>(block_.data()) + offset), count};
  }
  template <class T>
  [[nodiscard]] std::span<const T> field(std::size_t offset, std::size_t count) const noexcept {
    return {
        reinterpret_cast<const T*>(reinterpret_cast<const std::byte*>(block_.data()) + offset),
        count};
  }

 private:
  std::shared_ptr<const Layout> layout_;
  std::vector<double> block_;  // doubles for their alignment
};

// Declares the read and write accessor of one field.
#define TANDEM_FIELD(type, name)                                                    \
  [[nodiscard]] std::span<type> name() noexcept {                                   \
    return field<type>(name##_.offset, name##_.count);                              \
  }                                                                                 \
  [[nodiscard]] std::span<const type> name() const noexcept {                       \
    return field<type>(name##_.offset, name##_.count);                              \
  }

/// What was measured in one cycle. n = joints, c = sensor channels, s = sensors.
/// Link side unless the name says motor; positive about the URDF joint's +axis.
class StateImage : public Image {
 public:
  explicit StateImage(const ImageShape& shape);

  TANDEM_FIELD(std::uint64_t, cycle)          ///< (1) number of the loop's cycle, from 0
  TANDEM_FIELD(std::int64_t, time_ns)         ///< (1) nominal time of the cycle since the start
  TANDEM_FIELD(double, position_rad)          ///< (n) link position [rad or m]
  TANDEM_FIELD(double, velocity_rad_s)        ///< (n) link velocity
  TANDEM_FIELD(double, acceleration_rad_s2)   ///< (n) link acceleration, differenced velocity
  TANDEM_FIELD(double, torque_Nm)             ///< (n) link torque, from the spring [Nm or N]
  TANDEM_FIELD(double, motor_position_rad)    ///< (n) motor position, reflected to the link
  TANDEM_FIELD(double, motor_velocity_rad_s)  ///< (n) motor velocity, reflected to the link
  TANDEM_FIELD(double, current_A)             ///< (n) motor current
  TANDEM_FIELD(double, voltage_V)             ///< (n) motor voltage applied
  TANDEM_FIELD(double, temperature_C)         ///< (n) winding temperature
  TANDEM_FIELD(double, sensor)                ///< (c) every sensor's channels, one after another
  TANDEM_FIELD(std::uint32_t, fault)          ///< (n) 0, or the drive's CiA 402 error code
  TANDEM_FIELD(std::uint32_t, age_cycles)     ///< (n) 0 fresh, k: the sample is k cycles old
  TANDEM_FIELD(std::uint32_t, sensor_age_cycles)  ///< (s)
  TANDEM_FIELD(std::uint16_t, statusword)     ///< (n) CiA 402 statusword
  TANDEM_FIELD(std::int8_t, mode)             ///< (n) ControlMode in force, as the drive says
  TANDEM_FIELD(std::uint8_t, interaction)     ///< (n) InteractionMode in force
  TANDEM_FIELD(std::uint8_t, drive_state)     ///< (n) DriveState

  [[nodiscard]] std::size_t joints() const noexcept { return position_rad_.count; }
  /// Channels of sensor `index`, in the sensor's documented order.
  [[nodiscard]] std::span<const double> sensor_values(std::size_t index) const noexcept;
  [[nodiscard]] std::span<double> sensor_values(std::size_t index) noexcept;

 private:
  struct Slot {
    std::size_t offset = 0;
    std::size_t count = 0;
  };
  Slot cycle_, time_ns_, position_rad_, velocity_rad_s_, acceleration_rad_s2_, torque_Nm_,
      motor_position_rad_, motor_velocity_rad_s_, current_A_, voltage_V_, temperature_C_, sensor_,
      fault_, age_cycles_, sensor_age_cycles_, statusword_, mode_, interaction_, drive_state_;
  std::vector<Slot> sensors_;  // within sensor(), offset in elements
};

/// What is asked of the drives in one cycle. A reference that its mode does not use is ignored,
/// except torque_Nm, which is the feed-forward in position, velocity and impedance control.
class CommandImage : public Image {
 public:
  explicit CommandImage(const ImageShape& shape);

  TANDEM_FIELD(std::uint64_t, cycle)           ///< (1) the cycle that computed it
  TANDEM_FIELD(std::int64_t, time_ns)          ///< (1) its nominal time
  TANDEM_FIELD(double, position_rad)           ///< (n) link position reference
  TANDEM_FIELD(double, velocity_rad_s)         ///< (n) link velocity reference or feed-forward
  TANDEM_FIELD(double, torque_Nm)              ///< (n) link torque reference or feed-forward
  TANDEM_FIELD(double, voltage_V)              ///< (n) motor voltage, mode kOpenLoop
  TANDEM_FIELD(double, current_A)              ///< (n) motor current, mode kCurrent
  TANDEM_FIELD(double, stiffness_Nm_rad)       ///< (n) virtual spring, compliant
  TANDEM_FIELD(double, damping_Nms_rad)        ///< (n) virtual damper, compliant
  TANDEM_FIELD(std::int8_t, mode)              ///< (n) ControlMode wanted
  TANDEM_FIELD(std::uint8_t, interaction)      ///< (n) InteractionMode wanted
  TANDEM_FIELD(std::uint8_t, fault_reset)      ///< (n) 1: clear this joint's latched fault

  [[nodiscard]] std::size_t joints() const noexcept { return position_rad_.count; }

 private:
  struct Slot {
    std::size_t offset = 0;
    std::size_t count = 0;
  };
  Slot cycle_, time_ns_, position_rad_, velocity_rad_s_, torque_Nm_, voltage_V_, current_A_,
      stiffness_Nm_rad_, damping_Nms_rad_, mode_, interaction_, fault_reset_;
};

#undef TANDEM_FIELD

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
  [[nodiscard]] std::size_t joints() const noexcept { return revision_.size(); }

  void archive(Archive& ar);

 private:
  std::vector<PidGains> gains_;
  std::vector<std::uint32_t> revision_;
};

}  // namespace tandem::hal
