// What the master reads and writes by SDO to make a node ready, as a list made beforehand.
// Layer: hal/ethercat-can.  Thread: made non-RT; immutable afterwards.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

#include "canopen/bytes.hpp"
#include "hal/config/robot_config.hpp"
#include "hal/ethercat-can/interpolation_period.hpp"
#include "hal/ethercat-can/pdo_layout.hpp"

namespace tandem::hal::can {

/// What a transfer is for.
enum class SdoUse : std::uint8_t {
  kWrite,          ///< download
  kCheck,          ///< upload, and compare with `bytes`
  kCheckRevision,  ///< the same, but a later minor (the lower 16 bits) is right too
  kCheckProfile,   ///< the lower 16 bits are 402, the profile's number in 1000; or `bytes`, whole
  kCheckBits,      ///< every bit of `bytes` is set; an object that is not there passes
  kVerify,  ///< upload of 1020: with `bytes` in it, what the drive keeps is not written again
  kStore,   ///< download to 1010: it keeps what was written; a refusal is tolerated
};

/// One transfer of 1 to 4 bytes.
struct SdoStep {
  SdoUse use = SdoUse::kWrite;
  std::uint8_t sub = 0;
  std::uint16_t index = 0;
  std::int8_t axis = -1;  ///< for messages; -1: the node's own object
  bool kept = true;       ///< a write that a drive keeps: not a demand, as the mode is
  std::uint8_t size = 0;
  std::array<std::uint8_t, 4> bytes{};
  InterpolationLimits period{};  ///< of 60C2: what its drive takes
  bool of_file = false;          ///< a slave's file asks for it (InitCmd)

  [[nodiscard]] std::span<const std::uint8_t> value() const noexcept {
    return {bytes.data(), size};
  }
  /// Whether a check that read this is passed.
  [[nodiscard]] bool accepts(std::span<const std::uint8_t> read) const noexcept TANDEM_RT;
};
static_assert(std::has_unique_object_representations_v<SdoStep>, "no padding in a snapshot");

template <class T>
[[nodiscard]] SdoStep write_step(std::uint16_t index, std::uint8_t sub, T value, int axis = -1) {
  SdoStep step{.sub = sub,
               .index = index,
               .axis = static_cast<std::int8_t>(axis),
               .size = static_cast<std::uint8_t>(sizeof(T))};
  canopen::put(step.bytes.data(), value);
  return step;
}

/// The node's identity, PDO mapping, axes and heartbeats, in the order in which they are sent; of
/// all that a board's sheet lacks there is no step.
/// Object 1020 of a board that keeps its configuration is left 0 until name_configuration().
/// A board's SYNC time-out (2052) and interpolation period (60C2) are left 0: the period is known
/// when the first cycle begins.
[[nodiscard]] std::vector<SdoStep> make_configuration(const RobotConfig& robot,
                                                      const NodePlan& node);

/// Whether the sheet's dictionary has another value of 1018:sub than the device is to have. Files
/// of EtherCAT slaves have such: then the slave's information memory tells, and not the object.
[[nodiscard]] bool is_disputed(const canopen::DataSheet& sheet, std::uint8_t sub,
                               std::uint32_t wanted);

/// Fills 1020's two numbers in, where they are: a hash of every write that the drive keeps. So they
/// change with the configuration, and with nothing else.
void name_configuration(std::span<SdoStep> steps) noexcept TANDEM_RT;

/// How many of a heartbeat's periods may pass without it.
inline constexpr int kHeartbeatPeriods = 3;

}  // namespace tandem::hal::can
