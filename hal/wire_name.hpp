// What a field of ours is called outside of C++: in logs, over DDS, in tables.
// Layer: hal.  Thread: any, non-RT.
#pragma once

#include <string>
#include <string_view>

namespace tandem::hal {

/// The C++ name in lower case, since ROS 2 allows nothing else: "torque_Nm" becomes "torque_nm".
[[nodiscard]] inline std::string wire_name(std::string_view name) {
  std::string lower(name);
  for (char& c : lower) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return lower;
}

}  // namespace tandem::hal
