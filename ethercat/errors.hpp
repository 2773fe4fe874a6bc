// What can be wrong with an EtherCAT line: its frames, its slaves, their memories, its cables.
// Layer: ethercat.  Thread: any.
#pragma once

#include <cstdint>

#include "base/realtime.hpp"

namespace tandem::ethercat {

/// A row each in ethercat/errors.inc.
enum class LineError : std::uint8_t {
#define TANDEM_LINE_ERROR(name, lasts, words) name,
#include "ethercat/errors.inc"
#undef TANDEM_LINE_ERROR
};

/// The error in words; empty where the caller writes them, with figures.
[[nodiscard]] const char* to_string(LineError error) noexcept;
/// Whether another try does not mend it.
[[nodiscard]] bool lasts(LineError error) noexcept TANDEM_RT;

}  // namespace tandem::ethercat
