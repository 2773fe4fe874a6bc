// The texts of fault causes that every backend shares.
#include "hal/backend.hpp"

#include <cstdio>

namespace tandem::hal {

std::string sentence_of(FaultCause cause) {
  const CauseRow row = row_of(cause);
  return std::string(row.words) + (*row.advice != 0 ? ": " : "") + row.advice;
}

std::string Backend::fault_text(FaultCause cause, std::uint32_t code) const {
  if (std::string said = sentence_of(cause); !said.empty()) return said;
  char text[48];
  std::snprintf(text, sizeof text, "the drive reports error 0x%04X", code);
  return text;
}

}  // namespace tandem::hal
