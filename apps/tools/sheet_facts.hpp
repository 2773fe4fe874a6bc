// What a drive can, read from its data sheet: modes, PDOs, units, who watches whom.
// Layer: apps/tools.  Thread: main.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "canopen/data_sheet.hpp"

namespace tandem::apps {

/// A mode of operation (6060) of the first axis.
struct SheetMode {
  int number = 0;
  std::string name;                ///< "cyclic synchronous position"
  std::vector<std::string> needs;  ///< objects: "607A", "60C1:1"
  std::vector<std::string> also;   ///< objects that help in this mode, and that the drive has
  /// Objects of `needs` it lacks: "607A", or "607A in an RPDO" where a cyclic mode cannot get it.
  std::vector<std::string> lacks;
};

/// A PDO that the sheet has.
struct SheetPdo {
  bool receive = false;  ///< RPDO
  int number = 0;        ///< from 1
  std::optional<canopen::SheetValue> cob_id;
  bool cob_id_writable = false;
  std::optional<int> transmission;
  bool transmission_writable = false;
  int entries = 0;  ///< the most that it can carry
  bool mapping_writable = false;
  bool assigned = false;             ///< of a slave: it is among the process data from power-on
  std::vector<std::string> carries;  ///< as the sheet has it: "6040", "60C1:1"
};

/// Everything of a sheet that a user of the drive asks first.
struct SheetFacts {
  std::optional<std::uint32_t> device_type;  ///< 1000; its low 16 bits are the profile's number
  int axes = 0;                              ///< those with a controlword
  std::vector<std::string> lacks;            ///< of what every mode needs, as SheetMode::lacks
  bool modes_said = false;                   ///< by 6502; else they are guessed from the objects
  std::vector<SheetMode> modes;
  std::vector<int> own_modes;  ///< the manufacturer's bits of 6502, 16 to 31
  bool ethercat = false;       ///< PDOs are those of a slave
  std::vector<SheetPdo> pdos;
  std::vector<const canopen::SheetEntry*> into_rpdo;
  std::vector<const canopen::SheetEntry*> into_tpdo;
  std::vector<const canopen::SheetEntry*> units;
  int heartbeat_consumers = 0;  ///< sub-indices of 1016
  bool heartbeat_producer = false;
  bool node_guarding = false;
};

/// @pre `sheet` outlives the answer
[[nodiscard]] SheetFacts sheet_facts(const canopen::DataSheet& sheet);

/// "607A", "60C1:1".
[[nodiscard]] std::string object_text(const canopen::SheetEntry& entry);

}  // namespace tandem::apps
