// Numbers with what they count: "1 joint", "29 joints".
// Layer: base.  Thread: any, non-RT.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace tandem {

/// "1 joint", "2 joints", "0 joints".
/// @param many  of more than one, or none, when it is not `one` with an s: "inertias", "feet"
[[nodiscard]] inline std::string counted(std::uint64_t number, std::string_view one,
                                         std::string_view many = {}) {
  std::string text = std::to_string(number) + " ";
  if (number != 1 && !many.empty()) return text.append(many);
  text += one;
  return number == 1 ? text : text + "s";
}

}  // namespace tandem
