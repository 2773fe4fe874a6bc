// Numbers of an ESI are hexadecimal behind "#x"; a place is an element and the ones around it.
#include "canopen/esi_text.hpp"

#include <algorithm>
#include <array>
#include <charconv>

#include "canopen/object_dictionary.hpp"

namespace tandem::canopen {
namespace {

constexpr int kShownLevels = 3;  // of elements, in the place of an error

std::string path_of(const EsiElement& e) {
  std::string path = printable(e.Name());
  const tinyxml2::XMLNode* at = e.Parent();
  for (int level = 1; level < kShownLevels && at != nullptr; ++level, at = at->Parent()) {
    const EsiElement* outer = at->ToElement();
    if (outer == nullptr) break;
    path = printable(outer->Name()) + "/" + path;
  }
  return path;
}

bool same(const char* text, std::string_view word) {
  return text != nullptr && same_word(trimmed(text), word);
}

struct TypeName {
  std::string_view name;
  std::uint8_t type;
};
constexpr std::array kTypeNames{
    TypeName{"BOOL", 0x01},     TypeName{"BIT", 0x01},      TypeName{"SINT", 0x02},
    TypeName{"INT8", 0x02},     TypeName{"INT", 0x03},      TypeName{"INT16", 0x03},
    TypeName{"DINT", 0x04},     TypeName{"INT32", 0x04},    TypeName{"USINT", 0x05},
    TypeName{"BYTE", 0x05},     TypeName{"UINT8", 0x05},    TypeName{"BITARR8", 0x05},
    TypeName{"UINT", 0x06},     TypeName{"WORD", 0x06},     TypeName{"UINT16", 0x06},
    TypeName{"BITARR16", 0x06}, TypeName{"UDINT", 0x07},    TypeName{"DWORD", 0x07},
    TypeName{"UINT32", 0x07},   TypeName{"BITARR32", 0x07}, TypeName{"REAL", 0x08},
    TypeName{"FLOAT", 0x08},    TypeName{"LREAL", 0x11},    TypeName{"LINT", 0x15},
    TypeName{"INT64", 0x15},    TypeName{"INT24", 0x10},    TypeName{"UINT24", 0x16},
    TypeName{"ULINT", 0x1B},    TypeName{"UINT64", 0x1B},   TypeName{"LWORD", 0x1B},
};

}  // namespace

std::optional<std::uint64_t> esi_number(std::string_view text) noexcept {
  text = trimmed(text);
  const bool hex =
      text.size() > 2 && (text[0] == '#' || text[0] == '0') && (text[1] == 'x' || text[1] == 'X');
  if (hex) text.remove_prefix(2);
  std::uint64_t value = 0;
  const char* end = text.data() + text.size();
  const auto [at, error] = std::from_chars(text.data(), end, value, hex ? 16 : 10);
  if (text.empty() || error != std::errc{} || at != end) return std::nullopt;
  return value;
}

std::string_view esi_text(const EsiElement& e) {
  const char* text = e.GetText();
  return text == nullptr ? std::string_view{} : trimmed(text);
}

std::string_view esi_text(const EsiElement& e, const char* child) {
  const EsiElement* found = e.FirstChildElement(child);
  return found == nullptr ? std::string_view{} : esi_text(*found);
}

bool esi_flag(const EsiElement& e, const char* attribute) {
  const char* text = e.Attribute(attribute);
  return same(text, "1") || same(text, "true");
}

std::optional<std::vector<std::uint8_t>> esi_bytes(std::string_view text) {
  text = trimmed(text);
  if (text.size() % 2 != 0) return std::nullopt;
  std::vector<std::uint8_t> bytes(text.size() / 2);
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const char* at = text.data() + 2 * i;
    const auto [end, error] = std::from_chars(at, at + 2, bytes[i], 16);
    if (error != std::errc{} || end != at + 2) return std::nullopt;
  }
  return bytes;
}

std::uint16_t esi_type(std::string_view name) noexcept {
  constexpr std::uint16_t kVisibleString = 0x09;
  for (const TypeName& known : kTypeNames) {
    if (same_word(known.name, name)) return known.type;
  }
  const bool string = same_word(name.substr(0, 6), "STRING");
  return string ? kVisibleString : 0;
}

std::uint16_t esi_unsigned(std::uint64_t bits) noexcept {
  switch (bits) {
    case 1: return static_cast<std::uint16_t>(DataType::kBoolean);
    case 8: return static_cast<std::uint16_t>(DataType::kUnsigned8);
    case 16: return static_cast<std::uint16_t>(DataType::kUnsigned16);
    case 32: return static_cast<std::uint16_t>(DataType::kUnsigned32);
    default: return 0;
  }
}

void EsiSheet::fail(const EsiElement& at, std::string message, std::string hint) {
  if (error) return;
  error = Error{.message = std::move(message),
                .hint = std::move(hint),
                .file = sheet.file,
                .line = at.GetLineNum(),
                .key = path_of(at)};
}

void EsiSheet::hinder(const EsiElement& at, std::string text) {
  remarks.add(at.GetLineNum(), text);
  if (sheet.hindrances.size() < bounds::kSheetRemarks.most) {
    sheet.hindrances.push_back({at.GetLineNum(), std::move(text)});
  }
}

std::uint64_t EsiSheet::number(const EsiElement& e, const char* child, std::uint64_t most,
                               std::optional<std::uint64_t> missing) {
  const EsiElement* found = e.FirstChildElement(child);
  if (found == nullptr) {
    if (!missing) fail(e, std::string("has no ") + child, "get the whole file from its maker");
    return missing.value_or(0);
  }
  const std::string_view text = esi_text(*found);
  if (text.empty() && missing) return *missing;
  const std::optional<std::uint64_t> value = esi_number(text);
  if (value && *value <= most) return *value;
  fail(*found, "'" + printable(text) + "' is no number from 0 to " + std::to_string(most),
       "expected is a decimal number, or #x and a hexadecimal one");
  return 0;
}

std::uint64_t EsiSheet::attribute(const EsiElement& e, const char* name, std::uint64_t most) {
  const char* text = e.Attribute(name);
  if (text == nullptr || trimmed(text).empty()) return 0;
  const std::optional<std::uint64_t> value = esi_number(text);
  if (value && *value <= most) return *value;
  fail(e,
       std::string(name) + " '" + printable(text) + "' is no number from 0 to " +
           std::to_string(most),
       "expected is a decimal number, or #x and a hexadecimal one");
  return 0;
}

std::uint16_t EsiSheet::index(const EsiElement& e, std::uint16_t shift) {
  const auto own = static_cast<std::uint16_t>(number(e, "Index", 0xFFFF));
  const EsiElement* element = e.FirstChildElement("Index");
  const bool shifted = own != 0 && element != nullptr && esi_flag(*element, "DependOnSlot");
  return static_cast<std::uint16_t>(shifted ? own + shift : own);
}

SheetEntry& EsiSheet::entry(std::uint16_t index, std::uint8_t sub, const EsiElement& at) {
  if (entries.size() >= kMaxSheetEntries) {
    fail(at, "the device has more than " + std::to_string(kMaxSheetEntries) + " entries",
         "is this the file of a slave?");
    return entries.begin()->second;
  }
  const auto [place, is_new] = entries.try_emplace({index, sub});
  if (is_new) {
    place->second.index = index;
    place->second.sub = sub;
    place->second.access = kRead;
    place->second.line = at.GetLineNum();
  }
  return place->second;
}

}  // namespace tandem::canopen
