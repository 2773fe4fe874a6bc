// Objects of an ESI's dictionary. A record's or array's sub-indices stand in its data type, their
// values in the object, in the same order.
#include <algorithm>
#include <bit>
#include <string>

#include "canopen/esi_text.hpp"
#include "canopen/object_dictionary.hpp"
#include "canopen/sheet_number.hpp"

namespace tandem::canopen {
namespace {

/// ro, wo, rw and where a PDO may carry it, as Flags of `e` say; where they do not, `otherwise`.
std::uint8_t access_of(EsiSheet& esi, const EsiElement& e, std::uint8_t otherwise) {
  const EsiElement* flags = e.FirstChildElement("Flags");
  if (flags == nullptr) return otherwise;
  std::uint8_t access = otherwise & kReadWrite;
  if (const EsiElement* word = flags->FirstChildElement("Access")) {
    const std::string_view text = esi_text(*word);
    if (same_word(text, "rw")) {
      access = kReadWrite;
    } else if (same_word(text, "wo")) {
      access = kWrite;
    } else if (same_word(text, "ro") || text.empty()) {
      access = kRead;
    } else {
      esi.fail(*word, "'" + printable(text) + "' is no access", "expected is ro, wo or rw");
    }
  }
  const std::string mapped = small_letters(esi_text(*flags, "PdoMapping"));
  if (mapped.find('r') != std::string::npos) access |= kMapRpdo;
  if (mapped.find('t') != std::string::npos) access |= kMapTpdo;
  return access;
}

/// Follows BaseType from a name to a plain type, or to the DataType that has sub-indices.
struct Resolved {
  std::uint16_t type = 0;
  const EsiElement* parts = nullptr;  ///< a DataType with SubItem or ArrayInfo
};

Resolved resolve(EsiSheet& esi, const EsiElement& at, std::string_view name) {
  for (std::size_t depth = 0; depth <= bounds::kEsiTypes.most; ++depth) {
    if (const std::uint16_t plain = esi_type(name)) return {.type = plain};
    const auto found = esi.types.find(name);
    if (found == esi.types.end()) return {};
    const EsiElement& type = *found->second;
    if (type.FirstChildElement("SubItem") || type.FirstChildElement("ArrayInfo")) {
      return {.parts = &type};
    }
    name = esi_text(type, "BaseType");
    if (name.empty()) return {};
  }
  esi.fail(at, beyond(bounds::kEsiTypes).message, "a data type stands for itself");
  return {};
}

/// The values of an object or of one of its sub-indices.
class Values {
 public:
  Values(EsiSheet& esi, const EsiElement* info) : esi_(esi), info_(info) {}

  void put(SheetEntry& entry) const {
    if (info_ == nullptr) return;
    entry.value = read(entry, "DefaultData", "DefaultValue");
    if (sheet_kind(entry.type) == SheetKind::kText) {
      entry.text = printable(esi_text(*info_, "DefaultString"));
    }
    const SheetKind kind = sheet_kind(entry.type);
    if (kind != SheetKind::kSigned && kind != SheetKind::kUnsigned) return;
    if (const auto low = read(entry, "MinData", "MinValue")) entry.low = low->number;
    if (const auto high = read(entry, "MaxData", "MaxValue")) entry.high = high->number;
  }

 private:
  /// A value that is none does not make a sheet useless: it is unknown.
  [[nodiscard]] std::optional<SheetValue> read(const SheetEntry& entry, const char* data,
                                               const char* value) const {
    if (sheet_kind(entry.type) == SheetKind::kText) return {};
    const EsiElement* const in_bytes = info_->FirstChildElement(data);
    const EsiElement* const plain = info_->FirstChildElement(value);
    const EsiElement* const from = in_bytes != nullptr ? in_bytes : plain;
    if (from == nullptr || esi_text(*from).empty()) return {};
    if (const auto found = in_bytes != nullptr ? of_bytes(entry, *from) : of_number(entry, *from)) {
      return found;
    }
    esi_.remarks.add(from->GetLineNum(), std::string(from->Name()) + " '" +
                                             printable(esi_text(*from), 40) +
                                             "' is none of its type: left out");
    return {};
  }

  static std::optional<SheetValue> of_bytes(const SheetEntry& entry, const EsiElement& from) {
    const auto bytes = esi_bytes(esi_text(from));
    if (!bytes || bytes->size() < static_cast<std::size_t>(entry.size())) return {};
    SheetLiteral pattern{.hex = true};
    for (int i = entry.size(); i-- > 0;) {
      pattern.magnitude = pattern.magnitude << 8 | (*bytes)[static_cast<std::size_t>(i)];
    }
    if (sheet_kind(entry.type) == SheetKind::kReal) {
      return SheetValue{.number = static_cast<std::int64_t>(pattern.magnitude)};
    }
    const auto typed = fit(pattern, entry.type);
    return typed ? std::optional(typed->value) : std::nullopt;
  }

  static std::optional<SheetValue> of_number(const SheetEntry& entry, const EsiElement& from) {
    std::string text(esi_text(from));
    if (text.starts_with("#x") || text.starts_with("#X")) text[0] = '0';
    TypedValue typed;
    if (read_value(text, entry.type, typed) != NumberFault::kNone) return {};
    return typed.value.plus_node_id ? std::nullopt : std::optional(typed.value);
  }

  EsiSheet& esi_;
  const EsiElement* info_;
};

/// Info/SubItem after Info/SubItem.
class SubValues {
 public:
  explicit SubValues(const EsiElement* info)
      : next_(info != nullptr ? info->FirstChildElement("SubItem") : nullptr) {}
  const EsiElement* next() {
    const EsiElement* item = next_;
    if (item == nullptr) return nullptr;
    next_ = item->NextSiblingElement("SubItem");
    return item->FirstChildElement("Info");
  }

 private:
  const EsiElement* next_;
};

class ObjectReader {
 public:
  ObjectReader(EsiSheet& esi, const EsiElement& object, std::uint16_t index)
      : esi_(esi),
        object_(object),
        index_(index),
        info_(object.FirstChildElement("Info")),
        values_(info_) {}

  void read() {
    const Resolved type = resolve(esi_, object_, esi_text(object_, "Type"));
    const std::uint8_t access = access_of(esi_, object_, kRead);
    if (type.parts == nullptr) {
      add(0, type.type, access, esi_text(object_, "Name"), info_);
    } else if (type.parts->FirstChildElement("SubItem") != nullptr) {
      read_parts(*type.parts, access);
    } else {
      add(0, 0, access, esi_text(object_, "Name"), nullptr);  // an array in one entry
    }
  }

 private:
  void add(std::uint8_t sub, std::uint16_t type, std::uint8_t access, std::string_view name,
           const EsiElement* info) {
    SheetEntry& entry = esi_.entry(index_, sub, object_);
    entry.type = type;
    entry.access = access;
    entry.name = printable(name);
    Values(esi_, info).put(entry);
  }

  void read_parts(const EsiElement& type, std::uint8_t otherwise) {
    for (const EsiElement* item = type.FirstChildElement("SubItem"); item != nullptr;
         item = item->NextSiblingElement("SubItem")) {
      const std::uint8_t access = access_of(esi_, *item, otherwise);
      const Resolved part = resolve(esi_, *item, esi_text(*item, "Type"));
      if (part.parts != nullptr && part.parts->FirstChildElement("ArrayInfo") != nullptr) {
        read_elements(*part.parts, *item, access);
        continue;
      }
      const auto sub = static_cast<std::uint8_t>(esi_.number(*item, "SubIdx", 0xFF, 0));
      add(sub, part.type, access, sub == 0 ? std::string_view{} : esi_text(*item, "Name"),
          values_.next());
    }
    // The object's own name is that of its sub 0, as in an EDS.
    if (const auto first = esi_.entries.find({index_, 0}); first != esi_.entries.end()) {
      first->second.name = printable(esi_text(object_, "Name"));
    }
  }

  void read_elements(const EsiElement& array, const EsiElement& item, std::uint8_t access) {
    const EsiElement& bounds = *array.FirstChildElement("ArrayInfo");
    const std::uint64_t first = esi_.number(bounds, "LBound", 0xFF, 1);
    const std::uint64_t count = esi_.number(bounds, "Elements", 0xFFFF, 0);
    const Resolved element = resolve(esi_, array, esi_text(array, "BaseType"));
    for (std::uint64_t sub = first; sub < first + count && sub <= 0xFE; ++sub) {
      add(static_cast<std::uint8_t>(sub), element.type, access, esi_text(item, "Name"),
          values_.next());
    }
  }

  EsiSheet& esi_;
  const EsiElement& object_;
  std::uint16_t index_;
  const EsiElement* info_;
  SubValues values_;
};

void read_dictionary(EsiSheet& esi, const EsiElement& dictionary, EsiShift shift) {
  esi.types.clear();
  if (const EsiElement* types = dictionary.FirstChildElement("DataTypes")) {
    for (const EsiElement* type = types->FirstChildElement("DataType"); type != nullptr;
         type = type->NextSiblingElement("DataType")) {
      esi.types.emplace(esi_text(*type, "Name"), type);
    }
  }
  const EsiElement* objects = dictionary.FirstChildElement("Objects");
  if (objects == nullptr) return;
  for (const EsiElement* object = objects->FirstChildElement("Object"); object != nullptr;
       object = object->NextSiblingElement("Object")) {
    const std::uint16_t index = esi.index(*object, shift.object);
    if (index >= 0x1000) ObjectReader(esi, *object, index).read();
  }
}

}  // namespace

void read_esi_objects(EsiSheet& esi, const EsiElement& parent, EsiShift shift) {
  for (const EsiElement* profile = parent.FirstChildElement("Profile"); profile != nullptr;
       profile = profile->NextSiblingElement("Profile")) {
    if (const EsiElement* other = profile->FirstChildElement("DictionaryFile")) {
      esi.hinder(*other, "the objects are in '" + printable(esi_text(*other)) +
                             "': only those of PDOs are known");
    }
    if (const EsiElement* own = profile->FirstChildElement("Dictionary")) {
      read_dictionary(esi, *own, shift);
    }
  }
}

}  // namespace tandem::canopen
