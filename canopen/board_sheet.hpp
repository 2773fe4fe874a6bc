// The data sheet of our own control boards, as far as a master uses it.
// Layer: canopen.  Thread: non-RT only.
#pragma once

#include <memory>

#include "canopen/data_sheet.hpp"

namespace tandem::canopen {

/// Our firmware's objects that a master reads, writes or maps, for all eight axes; a board without
/// a sheet of its own is one of these. What `tandem eds` writes has more: all that the firmware
/// has.
[[nodiscard]] std::shared_ptr<const DataSheet> tandem_board_sheet();

}  // namespace tandem::canopen
