#include "hal/text_event.hpp"

#include "base/quoting.hpp"

namespace tandem::hal {

std::string TextEvent::words() const {
  std::string words = shown(text(), 4 * kLongestText);
  if (left_out > 0) {
    words += " (" + std::to_string(left_out) + " before it were too many, and are left out)";
  }
  return words;
}

}  // namespace tandem::hal
