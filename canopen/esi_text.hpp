// Elements of an ESI as numbers, texts and entries; what canopen/esi*.cpp share.
// Layer: canopen.  Thread: non-RT only.
#pragma once

#include <tinyxml2.h>

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "canopen/data_sheet.hpp"
#include "canopen/ini_text.hpp"

namespace tandem::canopen {

using EsiElement = tinyxml2::XMLElement;

/// "#x1A00", "0x1A00" or decimal; none: it is no such number.
[[nodiscard]] std::optional<std::uint64_t> esi_number(std::string_view text) noexcept;
/// Its text without blanks around it.
[[nodiscard]] std::string_view esi_text(const EsiElement& e);
/// The text of a child; empty: there is none.
[[nodiscard]] std::string_view esi_text(const EsiElement& e, const char* child);
/// "1", "true".
[[nodiscard]] bool esi_flag(const EsiElement& e, const char* attribute);
/// Hexadecimal digits in pairs; none: they are not.
[[nodiscard]] std::optional<std::vector<std::uint8_t>> esi_bytes(std::string_view text);

/// What an index is shifted by where it depends on a module's slot.
struct EsiShift {
  std::uint16_t object = 0;
  std::uint16_t pdo = 0;
};

/// A sheet in the making. The first error stays, and reading goes on to its end.
struct EsiSheet {
  DataSheet sheet;
  Remarks remarks;
  std::optional<Error> error{};
  std::map<std::pair<std::uint16_t, std::uint8_t>, SheetEntry> entries{};
  std::map<std::string_view, const EsiElement*> types{};  ///< DataTypes by name
  bool assigns = true;                                    ///< 1C12 and 1C13 can be written
  bool configures = true;  ///< mappings can be written, but those of fixed PDOs
  std::size_t pdos = 0;
  std::array<std::int64_t, 2> assigned{};  ///< PDOs from power-on: outputs, inputs

  void fail(const EsiElement& at, std::string message, std::string hint = {});
  /// A remark that `tandem check` warns of.
  void hinder(const EsiElement& at, std::string text);
  /// A number of a child. @param missing  where there is no such child; none: that is an error
  std::uint64_t number(const EsiElement& e, const char* child, std::uint64_t most,
                       std::optional<std::uint64_t> missing = {});
  /// The same of an attribute, which is 0 where it is missing.
  std::uint64_t attribute(const EsiElement& e, const char* name, std::uint64_t most);
  /// The child Index, moved by `shift` where it depends on the slot.
  std::uint16_t index(const EsiElement& e, std::uint16_t shift);
  /// The entry; a new one where there is none. Beyond kMaxSheetEntries an error, and one of no use.
  SheetEntry& entry(std::uint16_t index, std::uint8_t sub, const EsiElement& at);
};

/// The data type's number in CiA 301 by its name in IEC 61131 or in ETG's lists; 0: no plain one.
[[nodiscard]] std::uint16_t esi_type(std::string_view name) noexcept;

/// The unsigned type of this length, or BOOLEAN for a bit; 0: there is none.
[[nodiscard]] std::uint16_t esi_unsigned(std::uint64_t bits) noexcept;

/// The objects of Profile/Dictionary below `parent`, a Device or Module.
void read_esi_objects(EsiSheet& esi, const EsiElement& parent, EsiShift shift);
/// The RxPdo and TxPdo of `parent`, after its objects.
void read_esi_pdos(EsiSheet& esi, const EsiElement& parent, EsiShift shift);
/// 1C12 and 1C13 after all PDOs. @param at  the device
void add_esi_assignment(EsiSheet& esi, const EsiElement& at);

}  // namespace tandem::canopen
