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

/// One PDO of a data sheet. Its identifier is that of the pre-defined connection set.
struct PdoSlot {
  int number = 1;           ///< 1 to canopen::kPdosPerNode
  bool mappable = true;     ///< its mapping can be written
  bool on = false;          ///< in use from power-on
  bool id_writable = true;  ///< it can be switched on and off
  bool type_writable = true;
  std::uint8_t type = canopen::kEventProfile;  ///< transmission type from power-on
  bool timely = true;  ///< of a TPDO: it is sent at every SYNC, or can be told so
  std::uint8_t most_entries = 0;
  std::vector<std::uint32_t> mapping{};  ///< from power-on, as mapping_entry() makes them
};

/// The PDOs that a master can use: one that is off and cannot be switched on is left out, so is one
/// whose identifier is another and cannot be written. One that is not timely is only switched off.
[[nodiscard]] std::vector<PdoSlot> pdo_slots(const canopen::DataSheet& sheet,
                                             canopen::PdoDirection direction, int node_id);

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
