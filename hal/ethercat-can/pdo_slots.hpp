// The PDOs that a drive offers, and which object of it carries which field of the image.
// Layer: hal/ethercat-can.  Thread: non-RT.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "canopen/data_sheet.hpp"
#include "canopen/drive_abilities.hpp"
#include "canopen/pdo.hpp"
#include "hal/ethercat-can/pdo_layout.hpp"

namespace tandem::hal::can {

inline constexpr std::uint16_t kAssignOutputs = 0x1C12;
inline constexpr std::uint16_t kAssignInputs = 0x1C13;

/// One PDO of a data sheet. Its identifier is that of the pre-defined connection set.
struct PdoSlot {
  int number = 1;           ///< 1 to canopen::kPdosPerNode; of a slave 1 to 512
  bool mappable = true;     ///< its mapping can be written
  bool on = false;          ///< in use from power-on
  bool id_writable = true;  ///< it can be switched on and off
  bool type_writable = true;
  std::uint8_t type = canopen::kEventProfile;  ///< transmission type from power-on
  bool timely = true;  ///< of a TPDO: it is sent at every SYNC, or can be told so
  std::uint8_t most_entries = 0;
  std::vector<std::uint32_t> mapping{};  ///< from power-on, as mapping_entry() makes them
  bool required = false;                 ///< of a slave: it is always among the process data
  std::vector<int> excludes{};  ///< of a slave: numbers of which none can be used beside it
};

/// The PDOs that a master can use: one that is off and cannot be switched on is left out, so is one
/// whose identifier is another and cannot be written. One that is not timely is only switched off.
[[nodiscard]] std::vector<PdoSlot> pdo_slots(const canopen::DataSheet& sheet,
                                             canopen::PdoDirection direction, int node_id);

/// The PDOs of a slave (1600 to 17FF, 1A00 to 1BFF), those that are its process data from power-on
/// first. Where the assignment (1C12, 1C13) cannot be written, there are no others.
[[nodiscard]] std::vector<PdoSlot> line_slots(const canopen::DataSheet& sheet,
                                              canopen::PdoDirection direction);
/// Whether a master may choose the PDOs. A sheet without 1C12 or 1C13 does not say: it may.
[[nodiscard]] bool assignment_written(const canopen::DataSheet& sheet,
                                      canopen::PdoDirection direction);
/// From 0; beyond the last: the PDO is not in the assignment from power-on.
[[nodiscard]] int place_in_assignment(const canopen::DataSheet& sheet, std::uint16_t assignment,
                                      std::uint16_t pdo);

/// What a slave's output can have that the master has no field for: its value from power-on, or 0
/// where 0 asks for nothing. None: not known.
[[nodiscard]] std::optional<std::uint32_t> resting_value(const canopen::DataSheet& sheet,
                                                         std::uint32_t entry);

/// PDOs beyond the fourth, which a master does not use, that are on from power-on and can be
/// switched off: their numbers and identifiers.
[[nodiscard]] std::vector<std::pair<int, std::uint32_t>> further_pdos(
    const canopen::DataSheet& sheet, canopen::PdoDirection direction, int node_id);

/// The object that carries `field` of an axis, without its place in a PDO; none: the drive has
/// none. Velocities and torques travel as offsets (60B1, 60B2) where the drive has them: these are
/// feed-forward in CSP and add to the target in CSV and CST. Without them as targets (60FF, 6071).
[[nodiscard]] std::optional<MappedField> object_of(const canopen::DataSheet& sheet,
                                                   const canopen::DriveAbilities& can,
                                                   WireField field, int axis);

}  // namespace tandem::hal::can
