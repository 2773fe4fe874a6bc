// The XML file of an EtherCAT slave (ESI, ETG.2000) as a data sheet.
// Layer: canopen.  Thread: non-RT only.
#pragma once

#include <string_view>

#include "canopen/data_sheet.hpp"

namespace tandem::canopen {

/// Whether the text begins as XML does, or with the mark of UTF-16.
[[nodiscard]] bool is_xml(std::string_view text) noexcept;

/// Reads one device. Its dictionary's objects become entries, and so do those of its PDOs: 16xx and
/// 1Axx have the PDO's entries as values (read only where the PDO is fixed), 1C12 and 1C13 those
/// that are the process data from power-on. Modules (slots) are those that the file has as default.
/// Errors: those of read_data_sheet().
[[nodiscard]] Result<DataSheet> read_esi(std::string_view text, std::string_view file,
                                         const DeviceChoice& choice);

}  // namespace tandem::canopen
