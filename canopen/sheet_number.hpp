// Numbers of a data sheet and the data types that they are for (CiA 306 and 301).
// Layer: canopen.  Thread: non-RT only.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "canopen/data_sheet.hpp"

namespace tandem::canopen {

/// How a sheet writes the values of a data type.
enum class SheetKind : std::uint8_t {
  kUnsigned,  ///< booleans too
  kSigned,
  kReal,
  kText,  ///< strings, domains, times, and types that are not known
};

[[nodiscard]] SheetKind sheet_kind(std::uint16_t type) noexcept;
/// Bytes on the wire; 0: not fixed, or not known.
[[nodiscard]] int sheet_type_size(std::uint16_t type) noexcept;

/// An integer as it is written: decimal, hexadecimal (0x) or octal (0), with a sign or without.
struct SheetLiteral {
  bool negative = false;
  bool hex = false;
  bool octal = false;  ///< and not the same as decimal
  std::uint64_t magnitude = 0;
};

/// The integer, a comment (;) behind it left out; none: it is no integer, or beyond 64 bit.
[[nodiscard]] std::optional<SheetLiteral> read_literal(std::string_view text) noexcept;

/// A value of a type, and whether the sheet writes it in an odd way.
struct TypedValue {
  SheetValue value{};
  bool odd = false;  ///< -1 of an unsigned type, 65535 of a signed 16 bit, octal
};

/// The literal as a number of this type; hexadecimal is taken as bit pattern of signed types.
[[nodiscard]] std::optional<TypedValue> fit(const SheetLiteral& literal,
                                            std::uint16_t type) noexcept;

/// Which of them a text is not.
enum class NumberFault : std::uint8_t { kNone, kNoNumber, kDoesNotFit };

/// "0x180", "$NODEID+0x180", "0x180 + $NodeID", "-5", "0.25" by the type. @pre not kText
[[nodiscard]] NumberFault read_value(std::string_view text, std::uint16_t type,
                                     TypedValue& out) noexcept;

/// "a whole number of 0 to 255", for messages.
[[nodiscard]] std::string expected_number(std::uint16_t type);

}  // namespace tandem::canopen
