// Integers, reals and node ids of data sheets, each against its type's width.
#include "canopen/sheet_number.hpp"

#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <limits>
#include <string>

#include "canopen/ini_text.hpp"

namespace tandem::canopen {
namespace {

constexpr std::string_view kNodeId = "$nodeid";

struct TypeFacts {
  SheetKind kind = SheetKind::kText;
  int size = 0;
};

/// By the type's number in CiA 301; what is not named is a text.
constexpr std::array<TypeFacts, 0x1C> kTypes = [] {
  using enum SheetKind;
  std::array<TypeFacts, 0x1C> types{};
  types[0x01] = {kUnsigned, 1};  // boolean
  types[0x02] = {kSigned, 1};
  types[0x03] = {kSigned, 2};
  types[0x04] = {kSigned, 4};
  types[0x05] = {kUnsigned, 1};
  types[0x06] = {kUnsigned, 2};
  types[0x07] = {kUnsigned, 4};
  types[0x08] = {kReal, 4};
  types[0x0C] = {kText, 6};  // time of day
  types[0x0D] = {kText, 6};  // time difference
  types[0x10] = {kSigned, 3};
  types[0x11] = {kReal, 8};
  types[0x12] = {kSigned, 5};
  types[0x13] = {kSigned, 6};
  types[0x14] = {kSigned, 7};
  types[0x15] = {kSigned, 8};
  types[0x16] = {kUnsigned, 3};
  types[0x18] = {kUnsigned, 5};
  types[0x19] = {kUnsigned, 6};
  types[0x1A] = {kUnsigned, 7};
  types[0x1B] = {kUnsigned, 8};
  return types;
}();

TypeFacts facts_of(std::uint16_t type) noexcept {
  return type < kTypes.size() ? kTypes[type] : TypeFacts{};
}

/// The largest number of `bytes` bytes.
std::uint64_t all_ones(int bytes) noexcept {
  return std::numeric_limits<std::uint64_t>::max() >> (64 - 8 * bytes);
}

std::optional<std::uint64_t> digits(std::string_view text, int base) noexcept {
  std::uint64_t value = 0;
  const char* end = text.data() + text.size();
  const auto [at, error] = std::from_chars(text.data(), end, value, base);
  if (text.empty() || error != std::errc{} || at != end) return std::nullopt;
  return value;
}

NumberFault read_real(std::string_view text, int size, TypedValue& out) noexcept {
  if (text.starts_with("0x") || text.starts_with("0X")) {  // the bit pattern
    const auto pattern = digits(text.substr(2), 16);
    if (!pattern) return NumberFault::kNoNumber;
    out.value.number = static_cast<std::int64_t>(*pattern);
    return *pattern <= all_ones(size) ? NumberFault::kNone : NumberFault::kDoesNotFit;
  }
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0.0;
  const char* end = text.data() + text.size();
  const auto [at, error] = std::from_chars(text.data(), end, value);
  if (error == std::errc::result_out_of_range) return NumberFault::kDoesNotFit;
  if (text.empty() || error != std::errc{} || at != end || !std::isfinite(value)) {
    return NumberFault::kNoNumber;
  }
  if (size == 8) {
    out.value.number = std::bit_cast<std::int64_t>(value);
    return NumberFault::kNone;
  }
  if (std::abs(value) > static_cast<double>(std::numeric_limits<float>::max())) {
    return NumberFault::kDoesNotFit;
  }
  out.value.number = std::bit_cast<std::uint32_t>(static_cast<float>(value));
  return NumberFault::kNone;
}

/// What is added to the node's id; none: `text` does not have it, or something else with it.
std::optional<std::string_view> beside_node_id(std::string_view text) noexcept {
  if (text.size() < kNodeId.size()) return std::nullopt;
  if (same_word(text.substr(0, kNodeId.size()), kNodeId)) {
    const std::string_view rest = trimmed(text.substr(kNodeId.size()));
    if (rest.empty()) return "0";
    if (rest.front() == '+') return trimmed(rest.substr(1));
    return std::nullopt;
  }
  const std::size_t at = text.size() - kNodeId.size();
  if (!same_word(text.substr(at), kNodeId)) return std::nullopt;
  const std::string_view rest = trimmed(text.substr(0, at));
  if (!rest.ends_with('+')) return std::nullopt;
  return trimmed(rest.substr(0, rest.size() - 1));
}

/// Without what C writes behind a number: 0x10UL, 5u.
std::string_view without_suffix(std::string_view text) noexcept {
  const std::size_t end = text.find_last_not_of("uUlL");
  const std::size_t size = end == std::string_view::npos ? 0 : end + 1;
  return size == 0 || text.size() - size > 3 ? text : text.substr(0, size);
}

}  // namespace

SheetKind sheet_kind(std::uint16_t type) noexcept { return facts_of(type).kind; }
int sheet_type_size(std::uint16_t type) noexcept { return facts_of(type).size; }

std::optional<SheetLiteral> read_literal(std::string_view text) noexcept {
  text = trimmed(text.substr(0, text.find(';')));
  SheetLiteral literal;
  if (text.starts_with('-') || text.starts_with('+')) {
    literal.negative = text.front() == '-';
    text.remove_prefix(1);
  }
  text = without_suffix(text);
  literal.hex = text.starts_with("0x") || text.starts_with("0X");
  std::optional<std::uint64_t> value =
      digits(literal.hex ? text.substr(2) : text, literal.hex ? 16 : 10);
  if (!value) return std::nullopt;
  if (!literal.hex && text.size() > 1 && text.front() == '0') {
    const auto octal = digits(text, 8);  // none when it has an 8 or 9
    literal.octal = octal != value;
    if (octal) value = octal;
  }
  literal.magnitude = *value;
  return literal;
}

std::optional<TypedValue> fit(const SheetLiteral& literal, std::uint16_t type) noexcept {
  const auto [kind, size] = facts_of(type);
  if (kind == SheetKind::kText || kind == SheetKind::kReal) return std::nullopt;
  const std::uint64_t most = all_ones(size);
  const std::uint64_t sign = most / 2 + 1;
  const std::uint64_t number = literal.negative ? 0 - literal.magnitude : literal.magnitude;
  TypedValue result;
  result.odd = literal.octal;
  if (literal.negative ? literal.magnitude > sign : literal.magnitude > most) return std::nullopt;
  if (kind == SheetKind::kUnsigned) {
    result.odd = result.odd || (literal.negative && literal.magnitude != 0);
    result.value.number = static_cast<std::int64_t>(number & most);
    return result;
  }
  const bool pattern = !literal.negative && literal.magnitude >= sign;
  result.odd = result.odd || (pattern && !literal.hex);
  result.value.number = static_cast<std::int64_t>(pattern ? number | ~most : number);
  return result;
}

NumberFault read_value(std::string_view text, std::uint16_t type, TypedValue& out) noexcept {
  text = trimmed(text.substr(0, text.find(';')));
  const auto [kind, size] = facts_of(type);
  if (kind == SheetKind::kReal) return read_real(text, size, out);
  const std::optional<std::string_view> beside = beside_node_id(text);
  const std::optional<SheetLiteral> literal = read_literal(beside.value_or(text));
  if (!literal) return NumberFault::kNoNumber;
  const std::optional<TypedValue> typed = fit(*literal, type);
  if (!typed) return NumberFault::kDoesNotFit;
  out = *typed;
  out.value.plus_node_id = beside.has_value();
  return NumberFault::kNone;
}

std::string expected_number(std::uint16_t type) {
  const auto [kind, size] = facts_of(type);
  if (kind == SheetKind::kReal) return "a number, such as 0.25";
  const std::uint64_t most = all_ones(size == 0 ? 8 : size);
  if (kind != SheetKind::kSigned) return "a whole number from 0 to " + std::to_string(most);
  return "a whole number from -" + std::to_string(most / 2 + 1) + " to " + std::to_string(most / 2);
}

}  // namespace tandem::canopen
