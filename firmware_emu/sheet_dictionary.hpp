// The dictionary of a board that stands in for another maker's drive: what the drive's sheet lists.
// Layer: firmware_emu.  Thread: setup non-RT; restore RT.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "base/realtime.hpp"
#include "base/result.hpp"
#include "canopen/data_sheet.hpp"
#include "canopen/object_dictionary.hpp"

namespace tandem::firmware {

/// Leaves in a board's dictionary what a sheet lists, with the sheet's types, rights, limits and
/// power-on values.
///
/// The objects by which a drive is commanded, watched and mapped keep the board's variables; every
/// other one of the sheet is a plain value, read and written without further effect. Objects of
/// the board that the sheet has not are no longer in the dictionary; the board goes on using their
/// variables.
class SheetDictionary {
 public:
  /// Changes nothing: the board is one of ours.
  SheetDictionary() = default;
  /// @param axes  of the board
  /// @param od    with all of the board's own entries, and room for those of the sheet
  SheetDictionary(const canopen::DataSheet& sheet, int node_id, std::size_t axes,
                  canopen::ObjectDictionary& od);

  /// Power-on values of all objects (reset node), or of the communication objects alone.
  void restore_all() const noexcept TANDEM_RT { restore(0xFFFF); }
  void restore_communication() const noexcept TANDEM_RT { restore(0x1FFF); }

  /// What the stand-in lacks or takes otherwise than the sheet says, a sentence each.
  [[nodiscard]] const std::vector<std::string>& remarks() const noexcept { return remarks_; }

 private:
  struct PowerOn {
    const canopen::ObjectEntry* entry = nullptr;
    std::uint32_t bits = 0;
  };

  void restore(std::uint16_t last_index) const noexcept TANDEM_RT;
  void check_mappings(const canopen::ObjectDictionary& od);
  [[nodiscard]] std::uint32_t power_on_bits(std::uint16_t index, std::uint8_t sub) const noexcept;

  std::vector<PowerOn> power_on_;  ///< in the order in which they are written
  std::vector<std::string> remarks_;
};

/// Whether a board can stand in for the drive of the sheet, with this many axes.
/// Errors: controlword or statusword of an axis are missing, or none of its modes is emulated.
[[nodiscard]] Status check_sheet(const canopen::DataSheet& sheet, std::size_t axes);

/// The modes of an axis that are emulated: bits of 6502, where the sheet has its value; else a mode
/// is there when its objects are. @param axis  from 0
[[nodiscard]] std::uint32_t emulated_modes(const canopen::DataSheet& sheet, int axis);

}  // namespace tandem::firmware
