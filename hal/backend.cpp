// The texts of fault causes that every backend shares.
#include "hal/backend.hpp"

#include <cstdio>

namespace tandem::hal {

std::string Backend::fault_text(FaultCause cause, std::uint32_t code) const {
  static constexpr const char* kTexts[] = {
#define TANDEM_FAULT_CAUSE(name, whose, text, meaning) text,
#include "hal/fault_causes.inc"
#undef TANDEM_FAULT_CAUSE
  };
  if (cause != FaultCause::kDrive) return kTexts[static_cast<std::size_t>(cause)];
  char text[48];
  std::snprintf(text, sizeof text, "the drive reports error 0x%04X", code);
  return text;
}

}  // namespace tandem::hal
