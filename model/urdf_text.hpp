// What keeps a description's text from being a URDF: its encoding, references to characters, xacro.
// Layer: model, private to urdf*.cpp.  Thread: any, non-RT.
#pragma once

#include <tinyxml2.h>

#include <optional>
#include <string>
#include <string_view>

#include "base/result.hpp"

namespace tandem::model {

/// "UTF-16", "UTF-16LE", "UTF-32BE", …: by its mark, or by how its first '<' is written. Empty: its
/// characters have 8 bits.
[[nodiscard]] std::string wide_encoding(std::string_view text);

/// What <?xml encoding="…"?> says, unless that is UTF-8 or ASCII; empty: nothing.
[[nodiscard]] std::string declared_encoding(std::string_view text);

/// The hint with the command that converts the file to UTF-8.
[[nodiscard]] std::string conversion(const std::string& encoding, const std::string& file);

/// An error at the first reference that stands for no character of XML 1.0: of none, of half of a
/// pair, or unreadable. tinyxml2 takes them as nothing, as what is no UTF-8, or as the text that
/// they are. Comments and CDATA have no references.
[[nodiscard]] std::optional<Error> find_wrong_reference(std::string_view text,
                                                        const std::string& file);

/// One error for the whole file, at the first element of xacro's or the first attribute with
/// `${…}` or `$(…)` that matters: one of a link or joint, but not in visuals and collisions.
[[nodiscard]] std::optional<Error> find_xacro(const tinyxml2::XMLElement& robot,
                                              const std::string& file);

}  // namespace tandem::model
