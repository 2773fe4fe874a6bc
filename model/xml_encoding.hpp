// Encodings of XML files other than UTF-8.
// Layer: model.  Thread: any.
#pragma once

#include <string>
#include <string_view>

namespace tandem::model {

/// "UTF-16", "UTF-16LE", "UTF-32BE", …: by its mark, or by how its first '<' is written. Empty: its
/// characters have 8 bits.
[[nodiscard]] std::string wide_encoding(std::string_view text);

/// What <?xml encoding="…"?> says, unless that is UTF-8 or ASCII; empty: nothing.
[[nodiscard]] std::string declared_encoding(std::string_view text);

/// The hint with the command that converts the file to UTF-8.
[[nodiscard]] std::string conversion(const std::string& encoding, const std::string& file);

}  // namespace tandem::model
