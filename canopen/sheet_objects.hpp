// The objects of a data sheet: sections such as [6040] and [1018sub1], made into entries.
// Layer: canopen.  Thread: non-RT only.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "canopen/data_sheet.hpp"
#include "canopen/ini_text.hpp"

namespace tandem::canopen {

/// The sections of one object.
struct SheetObject {
  const IniSection* section = nullptr;             ///< [1018]; null: it has sub-indices alone
  std::map<std::uint8_t, const IniSection*> subs;  ///< [1018sub1]
  const IniSection* values = nullptr;              ///< [1018Value], beside CompactSubObj
  const IniSection* names = nullptr;               ///< [1018Name]

  /// The first section of it that there is.
  [[nodiscard]] const IniSection& first() const noexcept;
};

using SheetObjects = std::map<std::uint16_t, SheetObject>;

/// "1018" and "1018sub1" in whatever case; none: another section.
struct SectionName {
  enum class Part : std::uint8_t { kObject, kSub, kValues, kNames, kOther } part{};
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
};
[[nodiscard]] std::optional<SectionName> object_section(std::string_view name) noexcept;

/// Sorts the sections by object. Data types (below 0x1000) are left out.
/// Errors: a section twice with different contents.
[[nodiscard]] Result<SheetObjects> collect_objects(std::span<const IniSection> sections,
                                                   Remarks& remarks);

/// The entries of all objects, sorted.
/// Errors: those of numbers, access and object types; more than kMaxSheetEntries.
[[nodiscard]] Result<std::vector<SheetEntry>> make_entries(const SheetObjects& objects,
                                                           Remarks& remarks);

/// An error when `last`, the file's last section, ends too early: the file was cut off.
[[nodiscard]] Status check_last_section(const IniSection& last, const SheetObjects& objects);

}  // namespace tandem::canopen
