// PDO mappings of a data sheet that no drive can have: too many entries, too many bits.
// Layer: canopen.  Thread: non-RT only.
#pragma once

#include <string>
#include <vector>

#include "canopen/data_sheet.hpp"

namespace tandem::canopen {

struct OddMapping {
  int line = 0;      ///< of the sheet
  std::string text;  ///< "[1A00] maps 112 bits, and …"
};

/// What is wrong with the mappings (1600 to 17FF, 1A00 to 1BFF) that the sheet gives as values:
/// more entries than sub 0's HighLimit, than 64 or than the sheet defines, more bits than a frame
/// of `sheet.most_pdo_bytes` carries, but for a slave's.
[[nodiscard]] std::vector<OddMapping> odd_mappings(const DataSheet& sheet);

}  // namespace tandem::canopen
