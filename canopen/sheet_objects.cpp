// Sections of objects: by index, and each as an entry with type, access, limits and value.
#include "canopen/sheet_objects.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <utility>

#include "base/counted.hpp"
#include "canopen/object_dictionary.hpp"
#include "canopen/objects.hpp"
#include "canopen/sheet_number.hpp"

namespace tandem::canopen {
namespace {

enum ObjectType : std::uint8_t {
  kNull = 0,
  kDomain = 2,
  kDefType = 5,
  kDefStruct = 6,
  kVariable = 7,
  kArray = 8,
  kRecord = 9,
};
constexpr std::uint16_t kDomainType = 0x0F;

std::optional<unsigned> hex_digits(std::string_view text) noexcept {
  unsigned value = 0;
  const char* end = text.data() + text.size();
  const auto [at, error] = std::from_chars(text.data(), end, value, 16);
  if (text.empty() || error != std::errc{} || at != end) return std::nullopt;
  return value;
}

using Contents = std::vector<std::pair<std::string, std::string_view>>;

/// Keys and values, whatever their order and case.
Contents contents_of(const IniSection& section) {
  Contents contents;
  contents.reserve(section.pairs.size());
  for (const IniPair& pair : section.pairs) {
    contents.emplace_back(small_letters(pair.key), pair.value);
  }
  std::ranges::sort(contents);
  return contents;
}

/// Puts `section` where its object has it. A second one must say the same.
Status place_section(const IniSection*& place, const IniSection& section, Remarks& remarks) {
  if (place == nullptr) {
    place = &section;
    return {};
  }
  if (contents_of(*place) == contents_of(section)) {
    remarks.add(section.line, "[" + printable(section.name) + "] comes again");
    return {};
  }
  return std::unexpected(section.error(
      {}, "is here twice with different contents, first in line " + std::to_string(place->line),
      "keep the one that the device has"));
}

/// A number of a section that is no value of the device: ObjectType, SubNumber.
/// @return `missing` when the key is not there or empty
Result<std::uint64_t> plain_number(const IniSection& section, std::string_view key,
                                   std::uint64_t missing, std::uint64_t most) {
  const std::string_view text = section.value(key);
  if (text.empty()) return missing;
  const std::optional<SheetLiteral> literal = read_literal(text);
  if (literal && !literal->negative && literal->magnitude <= most) return literal->magnitude;
  return std::unexpected(
      section.error(key, "'" + printable(text) + "' is no such number",
                    "expected is a whole number from 0 to " + std::to_string(most)));
}

Result<ObjectType> object_type(const IniSection& section) {
  const auto number = plain_number(section, "ObjectType", kVariable, 0xFF);
  if (!number) return std::unexpected(number.error());
  constexpr std::array kKnown{kNull, kDomain, kDefType, kDefStruct, kVariable, kArray, kRecord};
  const auto known = std::ranges::find(kKnown, *number);
  if (known != kKnown.end()) return *known;
  return std::unexpected(section.error(
      "ObjectType", "'" + printable(section.value("ObjectType")) + "' is no type of object",
      "expected is 0x7 (variable), 0x8 (array), 0x9 (record) or 0x2 (domain)"));
}

/// The Access bits of "rww" without those of PDOs, and with them.
struct AccessBits {
  std::string_view word;
  std::uint8_t by_sdo;
  std::uint8_t mapped;
};
constexpr std::array kAccess{
    AccessBits{"ro", kRead, kRead | kMapTpdo},
    AccessBits{"wo", kWrite, kWrite | kMapRpdo},
    AccessBits{"rw", kReadWrite, kReadWrite | kMapRpdo | kMapTpdo},
    AccessBits{"rwr", kReadWrite, kReadWrite | kMapTpdo},
    AccessBits{"rww", kReadWrite, kReadWrite | kMapRpdo},
    AccessBits{"const", kRead, kRead | kMapTpdo},
};

/// Whether a master may need the object. What is odd of another one is left out.
bool is_needed(std::uint16_t index) noexcept {
  struct Range {
    std::uint16_t first, last;
  };
  constexpr std::array kCommunication{
      Range{0x1000, 0x1006}, Range{0x100C, 0x100D}, Range{0x1010, 0x1010}, Range{0x1014, 0x1018},
      Range{0x1020, 0x1029}, Range{0x1400, 0x1BFF}, Range{0x1C00, 0x1CFF}};
  constexpr std::uint16_t kOfProfile = 0x600;  // behind it: data of motor and drive
  if (index >= 0x6000 && index < 0xA000) return (index - 0x6000) % kAxisStride < kOfProfile;
  return std::ranges::any_of(kCommunication,
                             [&](const Range& r) { return index >= r.first && index <= r.last; });
}

/// Makes entries of objects.
class EntryMaker {
 public:
  explicit EntryMaker(Remarks& remarks) : remarks_(remarks) {}

  Status add_object(std::uint16_t index, const SheetObject& object) {
    const IniSection& section = object.first();
    if (object.section == nullptr) {
      remarks_.add(section.line, "[" + printable(section.name) + "] has no section of its object");
      return add_subs(index, object);
    }
    const auto type = object_type(section);
    if (!type) return tolerate(index, std::unexpected(type.error()));
    const bool single = *type == kVariable || *type == kDomain;
    if (single && object.subs.empty()) return add_section(index, 0, section, {});
    if (single) remarks_.add(section.line, called(section) + "is a variable and has sub-indices");
    if (const Status added = add_subs(index, object); !added) return added;
    if (single || *type == kNull) return {};
    return tolerate(index, check_count(index, object));
  }

  [[nodiscard]] std::vector<SheetEntry> take() { return std::move(entries_); }

 private:
  static std::string called(const IniSection& section) {
    return "[" + printable(section.name) + "] ";
  }

  /// What is wrong with an object that nobody needs is a remark.
  Status tolerate(std::uint16_t index, Status read) {
    if (read || is_needed(index) || entries_.size() == kMaxSheetEntries) return read;
    const Error& error = read.error();
    remarks_.add(error.line, error.key + ": " + error.message + ": left out");
    return {};
  }

  Status add_subs(std::uint16_t index, const SheetObject& object) {
    for (const auto& [sub, section] : object.subs) {
      if (const Status added = add_section(index, sub, *section, {}); !added) return added;
    }
    return {};
  }

  /// Whether there are as many sub-indices as the object says; adds those that it does not write
  /// out one by one (CompactSubObj).
  Status check_count(std::uint16_t index, const SheetObject& object) {
    const IniSection& section = *object.section;
    const auto compact = plain_number(section, "CompactSubObj", 0, 0xFE);
    if (!compact) return std::unexpected(compact.error());
    if (*compact > 0) return add_compact(index, object, static_cast<unsigned>(*compact));
    const auto count = plain_number(section, "SubNumber", object.subs.size(), 0xFFFF);
    if (!count) return std::unexpected(count.error());
    if (*count != object.subs.size()) {
      remarks_.add(section.line, called(section) + "SubNumber is " + std::to_string(*count) +
                                     "; the sheet has " +
                                     counted(object.subs.size(), "sub-index", "sub-indices"));
    } else if (object.subs.empty()) {
      remarks_.add(section.line, called(section) + "has no sub-indices");
    }
    return {};
  }

  /// Sub-indices 1 to `count`, all as the object itself is declared (CiA 306: CompactSubObj).
  Status add_compact(std::uint16_t index, const SheetObject& object, unsigned count) {
    const IniSection& section = *object.section;
    if (!object.subs.contains(0)) {
      entries_.push_back({.index = index,
                          .sub = 0,
                          .type = static_cast<std::uint16_t>(DataType::kUnsigned8),
                          .access = kRead,
                          .name = "Highest sub-index supported",
                          .value = SheetValue{.number = count},
                          .low = {},
                          .high = {},
                          .text = {},
                          .line = section.line});
    }
    for (unsigned sub = 1; sub <= count; ++sub) {
      if (object.subs.contains(static_cast<std::uint8_t>(sub))) continue;
      const std::string number = std::to_string(sub);
      const IniPair* value = object.values != nullptr ? object.values->find(number) : nullptr;
      const Status added = add_section(index, static_cast<std::uint8_t>(sub), section, value);
      if (!added) return added;
      SheetEntry& entry = entries_.back();
      const IniPair* name = object.names != nullptr ? object.names->find(number) : nullptr;
      entry.name = name != nullptr ? printable(name->value) : entry.name + " " + number;
    }
    return {};
  }

  /// @param own_value  instead of the section's; may be null
  Status add_section(std::uint16_t index, std::uint8_t sub, const IniSection& section,
                     const IniPair* own_value) {
    if (entries_.size() == kMaxSheetEntries) {
      return std::unexpected(section.error(
          {}, "the sheet has more than " + std::to_string(kMaxSheetEntries) + " entries",
          "is this the sheet of a device?"));
    }
    SheetEntry entry{.index = index,
                     .sub = sub,
                     .name = printable(section.value("ParameterName")),
                     .value = {},
                     .low = {},
                     .high = {},
                     .text = {},
                     .line = section.line};
    for (const auto& read : {&EntryMaker::read_type, &EntryMaker::read_access}) {
      // Without a type or an access it is no entry.
      if (Status done = (this->*read)(section, entry); !done) return tolerate(index, done);
    }
    if (Status done = tolerate(index, read_default(section, own_value, entry)); !done) return done;
    if (Status done = tolerate(index, read_limits(section, entry)); !done) return done;
    entries_.push_back(std::move(entry));
    return {};
  }

  Status read_type(const IniSection& section, SheetEntry& entry) {
    const auto object = object_type(section);
    if (!object) return std::unexpected(object.error());
    const std::uint16_t missing = *object == kDomain ? kDomainType : 0;
    const auto type = plain_number(section, "DataType", missing, 0xFFFF);
    if (!type) return std::unexpected(type.error());
    entry.type = static_cast<std::uint16_t>(*type);
    if (entry.type == 0) remarks_.add(section.line, called(section) + "has no DataType");
    return {};
  }

  Status read_access(const IniSection& section, SheetEntry& entry) {
    const std::string_view word = section.value("AccessType");
    const auto mapping = plain_number(section, "PDOMapping", 0, 0xFF);
    if (!mapping) return std::unexpected(mapping.error());
    if (word.empty()) {
      remarks_.add(section.line, called(section) + "has no AccessType: taken as read only");
      entry.access = *mapping != 0 ? kReadTpdo : kRead;
      return {};
    }
    const auto known = std::ranges::find_if(
        kAccess, [&](const AccessBits& access) { return same_word(access.word, word); });
    if (known == kAccess.end()) {
      return std::unexpected(section.error("AccessType", "'" + printable(word) + "' is no access",
                                           "expected is ro, wo, rw, rwr, rww or const"));
    }
    entry.access = *mapping != 0 ? known->mapped : known->by_sdo;
    entry.constant = known->word == "const";
    return {};
  }

  Status read_default(const IniSection& section, const IniPair* own_value, SheetEntry& entry) {
    const IniPair* pair = own_value;
    for (const std::string_view key : {"ParameterValue", "DefaultValue"}) {
      if (pair == nullptr || pair->value.empty()) pair = section.find(key);
    }
    if (pair == nullptr || pair->value.empty()) return {};
    if (sheet_kind(entry.type) == SheetKind::kText) {
      entry.text = pair->value;
      return {};
    }
    TypedValue value;
    if (const NumberFault fault = read_value(pair->value, entry.type, value);
        fault != NumberFault::kNone) {
      return std::unexpected(wrong_number(section, *pair, entry.type, fault));
    }
    entry.value = value.value;
    if (value.odd) odd_number(*pair, value);
    return {};
  }

  static Error wrong_number(const IniSection& section, const IniPair& pair, std::uint16_t type,
                            NumberFault fault) {
    const bool integer = sheet_kind(type) != SheetKind::kReal;
    Error error = section.error(
        pair.key,
        "'" + printable(pair.value) +
            (fault == NumberFault::kNoNumber ? "' is no number" : "' does not fit the DataType"),
        "expected is " + expected_number(type) + (integer ? ", or $NODEID plus one" : ""));
    error.line = pair.line;
    return error;
  }

  void odd_number(const IniPair& pair, const TypedValue& value) {
    remarks_.add(pair.line, printable(pair.key) + ": '" + printable(pair.value) + "' is taken as " +
                                std::to_string(value.value.number));
  }

  /// A limit beyond the type limits nothing, and is left out.
  Status read_limits(const IniSection& section, SheetEntry& entry) {
    const SheetKind kind = sheet_kind(entry.type);
    if (kind != SheetKind::kSigned && kind != SheetKind::kUnsigned) return {};
    for (const auto& [key, limit] :
         {std::pair{"LowLimit", &entry.low}, {"HighLimit", &entry.high}}) {
      const IniPair* pair = section.find(key);
      if (pair == nullptr || pair->value.empty()) continue;
      TypedValue value;
      const NumberFault fault = read_value(pair->value, entry.type, value);
      if (fault == NumberFault::kNoNumber) {
        return std::unexpected(wrong_number(section, *pair, entry.type, fault));
      }
      if (fault == NumberFault::kDoesNotFit || value.value.plus_node_id) {
        remarks_.add(pair->line, printable(pair->key) + ": '" + printable(pair->value) +
                                     "' is no limit of this DataType: left out");
        continue;
      }
      if (value.odd) odd_number(*pair, value);
      *limit = value.value.number;
    }
    return {};
  }

  Remarks& remarks_;
  std::vector<SheetEntry> entries_;
};

}  // namespace

const IniSection& SheetObject::first() const noexcept {
  if (section != nullptr) return *section;
  if (!subs.empty()) return *subs.begin()->second;
  return values != nullptr ? *values : *names;
}

std::optional<SectionName> object_section(std::string_view name) noexcept {
  using Part = SectionName::Part;
  const std::optional<unsigned> index = hex_digits(name.substr(0, 4));
  if (name.size() < 4 || !index) return std::nullopt;
  SectionName result{.part = Part::kOther, .index = static_cast<std::uint16_t>(*index)};
  const std::string_view rest = name.substr(4);
  if (rest.empty()) {
    result.part = Part::kObject;
  } else if (same_word(rest, "Value")) {
    result.part = Part::kValues;
  } else if (same_word(rest, "Name")) {
    result.part = Part::kNames;
  } else if (same_word(rest.substr(0, 3), "sub")) {
    const std::optional<unsigned> sub = hex_digits(rest.substr(3));
    if (!sub || *sub > 0xFF) return std::nullopt;
    result.part = Part::kSub;
    result.sub = static_cast<std::uint8_t>(*sub);
  }
  return result;
}

Result<SheetObjects> collect_objects(std::span<const IniSection> sections, Remarks& remarks) {
  using Part = SectionName::Part;
  SheetObjects objects;
  for (const IniSection& section : sections) {
    const std::optional<SectionName> name = object_section(section.name);
    if (!name || name->part == Part::kOther || name->index < 0x1000) continue;
    SheetObject& object = objects[name->index];
    const IniSection*& place = name->part == Part::kObject   ? object.section
                               : name->part == Part::kSub    ? object.subs[name->sub]
                               : name->part == Part::kValues ? object.values
                                                             : object.names;
    if (Status placed = place_section(place, section, remarks); !placed) {
      return std::unexpected(std::move(placed.error()));
    }
  }
  return objects;
}

Result<std::vector<SheetEntry>> make_entries(const SheetObjects& objects, Remarks& remarks) {
  EntryMaker maker(remarks);
  for (const auto& [index, object] : objects) {
    if (Status added = maker.add_object(index, object); !added) {
      return std::unexpected(std::move(added.error()));
    }
  }
  std::vector<SheetEntry> entries = maker.take();
  std::ranges::sort(entries, {}, [](const SheetEntry& entry) {
    return std::pair{entry.index, entry.sub};
  });
  return entries;
}

Status check_last_section(const IniSection& last, const SheetObjects& objects) {
  const std::optional<SectionName> name = object_section(last.name);
  if (!name) return {};
  const auto found = objects.find(name->index);
  if (found == objects.end()) return {};
  const auto type = object_type(last);
  if (!type) return std::unexpected(type.error());
  const bool of_subs = *type == kArray || *type == kRecord;
  const bool compact = last.find("CompactSubObj") != nullptr;
  const bool variable = name->part == SectionName::Part::kSub ||
                        (name->part == SectionName::Part::kObject && !of_subs);
  const bool whole = variable ? *type == kDomain || (last.find("DataType") != nullptr &&
                                                     last.find("AccessType") != nullptr)
                              : compact || !found->second.subs.empty();
  const bool checked = variable || name->part == SectionName::Part::kObject;
  if (whole || !checked) return {};
  return std::unexpected(last.error({}, "the file ends in the middle of this object",
                                    "it seems to be cut off: get the whole file"));
}

}  // namespace tandem::canopen
