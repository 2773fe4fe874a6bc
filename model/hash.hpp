// SHA-256 as text.
// Layer: model.  Thread: any.
#pragma once

#include <string>
#include <string_view>

namespace tandem::model {

/// SHA-256 of the bytes, 64 hexadecimal digits.
[[nodiscard]] std::string sha256_hex(std::string_view text);

}  // namespace tandem::model
