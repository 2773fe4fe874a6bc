// PDO mappings of a data sheet that no drive can have: too many entries, too many bits, objects in
// another length.
// Layer: canopen.  Thread: non-RT only.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "canopen/data_sheet.hpp"

namespace tandem::canopen {

struct OddMapping {
  int line = 0;              ///< of the sheet
  std::string text;          ///< "[1A00] maps 112 bits, and …"
  std::uint32_t mapped = 0;  ///< the entry that is wrong; 0: the mapping is, as a whole
};

/// That a mapping's entry of this object has; 0: any.
[[nodiscard]] int bits_of(const SheetEntry& object) noexcept;

/// What is wrong with the mappings (1600 to 17FF, 1A00 to 1BFF) that the sheet gives as values:
/// more entries than sub 0's HighLimit, than 64 or than the sheet defines, an object that the sheet
/// lacks or that has other bits, more bits than a frame of `sheet.most_pdo_bytes` carries, but for
/// a slave's.
[[nodiscard]] std::vector<OddMapping> odd_mappings(const DataSheet& sheet);

}  // namespace tandem::canopen
