// The texts of fault causes that every backend shares.
#include "hal/backend.hpp"

#include <cstdio>
#include <iterator>

namespace tandem::hal {

std::string Backend::fault_text(FaultCause cause, std::uint32_t code) const {
  static constexpr const char* kTexts[] = {
#define TANDEM_FAULT_CAUSE(name, whose, text, meaning) text,
#include "hal/fault_causes.inc"
#undef TANDEM_FAULT_CAUSE
  };
  // One that comes over a network may be none.
  const auto row = static_cast<std::size_t>(cause);
  if (cause != FaultCause::kDrive && row < std::size(kTexts)) return kTexts[row];
  char text[48];
  std::snprintf(text, sizeof text, "the drive reports error 0x%04X", code);
  return text;
}

}  // namespace tandem::hal
