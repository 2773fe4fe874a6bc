// What the PDOs of a drive lack for a master that drives it in every cycle, in words.
// Layer: hal/ethercat-can.  Thread: non-RT.
#pragma once

#include <cstddef>
#include <string>

#include "canopen/data_sheet.hpp"
#include "hal/ethercat-can/pdo_layout.hpp"

namespace tandem::hal::can {

/// Takes the modes out of the node's abilities whose target is in none of its PDOs, but for the one
/// that an axis is switched on in: that one cannot be done without.
void drop_untargeted(NodePlan& node);

/// What keeps an axis from being switched on, seen or moved with what the node's PDOs carry, each
/// object with the reason: "not 6064 (it has 16 bits, and 32 are needed)". "": nothing.
[[nodiscard]] std::string lacks_of(const NodePlan& node, const canopen::DataSheet& sheet,
                                   std::size_t axis);

}  // namespace tandem::hal::can
