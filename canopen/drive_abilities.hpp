// What a CiA 402 drive can do for a cyclic master, as its data sheet tells.
// Layer: canopen.  Thread: non-RT only.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "canopen/data_sheet.hpp"
#include "canopen/object_dictionary.hpp"
#include "canopen/objects.hpp"

namespace tandem::canopen {

/// The entry, if the sheet has it with this type. A manufacturer's object (2000 to 5FFF) must also
/// have the name that our boards' sheets give it: every maker has other objects there.
[[nodiscard]] const SheetEntry* offered(const DataSheet& sheet, std::uint16_t index,
                                        std::uint8_t sub, DataType type);
/// The same, and a PDO may carry it. @param right  kMapRpdo or kMapTpdo
[[nodiscard]] bool mappable(const DataSheet& sheet, std::uint16_t index, std::uint8_t sub,
                            DataType type, Access right);
/// Whether a master may write the entry by SDO, whatever its type.
[[nodiscard]] bool writable(const DataSheet& sheet, std::uint16_t index, std::uint8_t sub);

/// Whether a master may write the mapping of a PDO: it is switched off for that, by its COB-ID.
/// Where the sheet has none (EtherCAT), nothing has to be switched.
/// @param parameter  14xx or 18xx; its mapping is 200h above
[[nodiscard]] bool remappable(const DataSheet& sheet, std::uint16_t parameter);

/// Modes and features that one axis of a drive has.
struct DriveAbilities {
  bool machine = false;  ///< 6040 and 6041 can be in PDOs: it is a CiA 402 drive
  /// For positions kCsp, kIp or kPp; for velocities kCsv or kPv; for torques kCst; each kNone: not
  /// at all. The profile modes are for a drive without a cyclic one.
  Mode position = Mode::kNone;
  Mode velocity = Mode::kNone;
  Mode torque = Mode::kNone;
  // Our own firmware's extras, which no CiA standard has
  bool impedance = false;
  bool open_loop = false;
  bool current = false;
  bool settings = false;  ///< it takes a robot.toml's scales, gains and protections
  /// Mode 6: its method (6098) can be set, and its mode be changed in a PDO.
  bool homing = false;
  /// 6060 cannot be in a PDO: the mode is set at start-up and stays.
  bool one_mode = false;
};

/// The mode in which an axis is switched on: of positions where it has one, else of velocities,
/// else of torques.
[[nodiscard]] constexpr Mode first_mode(const DriveAbilities& can) noexcept {
  return can.position != Mode::kNone   ? can.position
         : can.velocity != Mode::kNone ? can.velocity
                                       : can.torque;
}

/// It moves in profile modes: by ramps of its own, which the master sets.
[[nodiscard]] constexpr bool moves_by_profile(const DriveAbilities& can) noexcept {
  return can.position == Mode::kPp || can.velocity == Mode::kPv;
}

/// A value of the drive that a scale was computed from.
struct UnitObject {
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  std::uint32_t value = 0;
};

/// What an axis' numbers mean, as far as the sheet has values for it.
struct DriveUnits {
  /// Position units (6064, 607A) per revolution of the driven shaft: 6092:1 / 6092:2, or where the
  /// sheet has no 6092, 608F:1 / 608F:2 times the gear 6091:1 / 6091:2, which is 1 where it has no
  /// 6091. A ratio with a 0, or without one of its numbers, tells nothing.
  std::optional<double> counts_per_rev;
  /// 6076, at the motor, times the gear as above.
  std::optional<double> rated_torque_Nm;
  std::vector<UnitObject> position;  ///< what counts_per_rev was computed from
  std::vector<UnitObject> torque;    ///< what rated_torque_Nm was computed from
  /// Velocity units (606C, 60FF, 60B1) at one revolution of the driven shaft per second, by 60A9
  /// and the gear 6091; empty: position units per second.
  std::optional<double> velocity_per_rev;
  std::vector<UnitObject> velocity;  ///< what velocity_per_rev was computed from
  /// A value of 60A9 that does not tell what a velocity is, or not without the gear 6091; else 0.
  std::uint32_t unknown_velocity = 0;
};

/// The homing methods of an axis, as 60E3 lists them; empty: not said. @param axis  from 0
[[nodiscard]] std::vector<int> homing_methods(const DataSheet& sheet, int axis);

/// Sub 1 over sub 2 of an object; none: one of the two is not there, has no value, or is 0.
[[nodiscard]] std::optional<double> ratio(const DataSheet& sheet, std::uint16_t index);
/// @param axis  from 0
[[nodiscard]] DriveUnits units_of(const DataSheet& sheet, int axis);
/// For messages: "608F is 4096 / 1, 6091 is 50 / 0, 6092 is not there".
/// @param objects  of the first axis
[[nodiscard]] std::string values_of(const DataSheet& sheet, int axis,
                                    std::span<const std::uint16_t> objects);

/// Modes go by 6502 where the sheet has its value; else a mode is there when its objects are.
/// @param axis  from 0
[[nodiscard]] DriveAbilities abilities_of(const DataSheet& sheet, int axis);

}  // namespace tandem::canopen
