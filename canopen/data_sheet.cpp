// A data sheet as a whole: what it says of the device, its lists of objects, and whether it is
// complete.
#include "canopen/data_sheet.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <set>
#include <utility>

#include "base/open_file.hpp"
#include "canopen/esi.hpp"
#include "canopen/ini_text.hpp"
#include "canopen/objects.hpp"
#include "canopen/sheet_mappings.hpp"
#include "canopen/sheet_number.hpp"
#include "canopen/sheet_objects.hpp"

namespace tandem::canopen {
namespace {

constexpr std::array<std::string_view, 3> kLists{"MandatoryObjects", "OptionalObjects",
                                                 "ManufacturerObjects"};

std::string hex4(std::uint16_t index) {
  std::array<char, 8> text{};
  std::snprintf(text.data(), text.size(), "%04X", index);
  return text.data();
}

/// "2060, 20A0 and 12 more".
std::string some_of(const std::vector<std::uint16_t>& indices) {
  constexpr std::size_t kMost = 8;
  std::string text;
  for (std::size_t i = 0; i < std::min(kMost, indices.size()); ++i) {
    text += (i > 0 ? ", " : "") + hex4(indices[i]);
  }
  if (indices.size() > kMost) text += " and " + std::to_string(indices.size() - kMost) + " more";
  return text;
}

/// Reads the sections into a sheet.
class SheetReader {
 public:
  explicit SheetReader(std::string_view file) { sheet_.file = file; }

  Result<DataSheet> read(std::string_view text) {
    if (text.size() > kMaxSheetBytes) {
      return fail("has " + std::to_string(text.size()) + " bytes, and a data sheet may have " +
                      std::to_string(kMaxSheetBytes),
                  "name the EDS, DCF or ESI of the device");
    }
    auto sections = read_ini(text, remarks_);
    if (!sections) return std::unexpected(std::move(sections.error()));
    sections_ = std::move(*sections);
    for (const auto& step : {&SheetReader::read_objects, &SheetReader::check_lists,
                             &SheetReader::read_device, &SheetReader::read_commissioning}) {
      if (Status done = (this->*step)(); !done) return std::unexpected(std::move(done.error()));
    }
    read_identity();
    read_dummies();
    for (const OddMapping& odd : odd_mappings(sheet_)) remarks_.add(odd.line, odd.text);
    sheet_.remarks = remarks_.take();
    return std::move(sheet_);
  }

 private:
  [[nodiscard]] const IniSection* section(std::string_view name) const {
    for (const IniSection& section : sections_) {
      if (same_word(section.name, name)) return &section;
    }
    return nullptr;
  }

  Status read_objects() {
    auto objects = collect_objects(sections_, remarks_);
    if (!objects) return std::unexpected(std::move(objects.error()));
    objects_ = std::move(*objects);
    if (objects_.empty()) {
      return fail("has no section of an object, such as [1000]: it is no data sheet",
                  "name the EDS, DCF or ESI of the device");
    }
    if (Status keys = check_keys(sections_, remarks_); !keys) return keys;
    if (Status whole = check_last_section(sections_.back(), objects_); !whole) return whole;
    auto entries = make_entries(objects_, remarks_);
    if (!entries) return std::unexpected(std::move(entries.error()));
    sheet_.entries = std::move(*entries);
    return {};
  }

  /// The objects of a list that are not defined.
  Status read_list(const IniSection& list, std::vector<std::uint16_t>& missing) {
    std::uint64_t count = 0;
    for (const IniPair& pair : list.pairs) {
      if (pair.key.find_first_not_of("0123456789") != std::string_view::npos) continue;
      const std::optional<SheetLiteral> index = read_literal(pair.value);
      if (!index || index->negative || index->magnitude > 0xFFFF) {
        Error error = list.error(pair.key, "'" + printable(pair.value) + "' is no object's index",
                                 "expected is a number from 0x1000 to 0xFFFF");
        error.line = pair.line;
        return std::unexpected(std::move(error));
      }
      ++count;
      const auto number = static_cast<std::uint16_t>(index->magnitude);
      if (number < 0x1000) continue;
      if (!listed_.insert(number).second) {
        remarks_.add(pair.line, hex4(number) + " is listed twice");
      } else if (!objects_.contains(number)) {
        missing.push_back(number);
      }
    }
    const std::optional<SheetLiteral> said = read_literal(list.value("SupportedObjects"));
    if (said && said->magnitude == count) return {};
    if (&list == &sections_.back()) {
      return std::unexpected(list.error({}, "the file ends in the middle of this list",
                                        "it seems to be cut off: get the whole file"));
    }
    remarks_.add(list.line, "[" + printable(list.name) + "] SupportedObjects is '" +
                                printable(list.value("SupportedObjects")) + "'; listed are " +
                                std::to_string(count));
    return {};
  }

  /// A sheet that was cut off lists more than it defines.
  Status check_lists() {
    std::vector<std::uint16_t> missing;
    const IniSection* last = nullptr;
    for (const std::string_view name : kLists) {
      const IniSection* list = section(name);
      if (list == nullptr) {
        remarks_.add(0, "there is no section [" + std::string(name) + "]");
        continue;
      }
      const std::size_t before = missing.size();
      if (Status read = read_list(*list, missing); !read) return read;
      if (missing.size() > before) last = list;
    }
    if (missing.size() > std::max<std::size_t>(4, listed_.size() / 10)) {
      return std::unexpected(last->error({},
                                         std::to_string(missing.size()) + " of " +
                                             std::to_string(listed_.size()) +
                                             " listed objects are not defined: " + some_of(missing),
                                         "the file seems to be cut off: get the whole file"));
    }
    if (!missing.empty()) remarks_.add(0, "listed, but not defined: " + some_of(missing));
    std::vector<std::uint16_t> extra;
    for (const auto& [index, object] : objects_) {
      if (!listed_.contains(index)) extra.push_back(index);
    }
    if (!extra.empty()) remarks_.add(0, "defined, but not listed: " + some_of(extra));
    return {};
  }

  /// A number of [DeviceInfo] or [DeviceComissioning]; none: it is missing, empty, or remarked.
  std::optional<std::uint32_t> number_of(const IniSection& section, std::string_view key) {
    const IniPair* pair = section.find(key);
    if (pair == nullptr || pair->value.empty()) return std::nullopt;
    const std::optional<SheetLiteral> literal = read_literal(pair->value);
    if (literal && !literal->negative && literal->magnitude <= 0xFFFFFFFF) {
      return static_cast<std::uint32_t>(literal->magnitude);
    }
    remarks_.add(pair->line, printable(pair->key) + ": '" + printable(pair->value) +
                                 "' is no number from 0 to 4294967295: left out");
    return std::nullopt;
  }

  Status read_device() {
    if (const IniSection* info = section("FileInfo")) {
      sheet_.description = printable(info->value("Description"));
    }
    const IniSection* device = section("DeviceInfo");
    if (device == nullptr) {
      remarks_.add(0, "there is no section [DeviceInfo]");
      return {};
    }
    sheet_.vendor_name = printable(device->value("VendorName"));
    sheet_.product_name = printable(device->value("ProductName"));
    sheet_.vendor = number_of(*device, "VendorNumber");
    sheet_.product = number_of(*device, "ProductNumber");
    sheet_.revision = number_of(*device, "RevisionNumber");
    sheet_.lss = number_of(*device, "LSS_Supported").value_or(0) != 0;
    if (const auto bits = number_of(*device, "Granularity"); bits && *bits <= 64) {
      sheet_.granularity = static_cast<int>(*bits);
    }
    for (const int rate : {10, 20, 50, 100, 125, 250, 500, 800, 1000}) {
      const std::string key = "BaudRate_" + std::to_string(rate);
      if (number_of(*device, key).value_or(0) != 0) sheet_.bit_rates_kbit_s.push_back(rate);
    }
    count_pdos(*device, "NrOfRXPDO", object::kRpdoParameter);
    count_pdos(*device, "NrOfTXPDO", object::kTpdoParameter);
    return {};
  }

  /// Whether there are as many PDOs as said.
  void count_pdos(const IniSection& device, std::string_view key, std::uint16_t first) {
    const std::optional<std::uint32_t> said = number_of(device, key);
    const auto begin = objects_.lower_bound(first);
    const auto end = objects_.lower_bound(static_cast<std::uint16_t>(first + 0x200));
    const auto count = std::distance(begin, end);
    if (!said || *said == count) return;
    remarks_.add(device.find(key)->line, std::string(key) + " is " + std::to_string(*said) +
                                             ", and there are " + std::to_string(count) + " from " +
                                             hex4(first));
  }

  /// What a DCF says beside the objects. CiA 306 spells the section with one m, many with two.
  Status read_commissioning() {
    const IniSection* own = section("DeviceComissioning");
    if (own == nullptr) own = section("DeviceCommissioning");
    if (own == nullptr) return {};
    if (const auto id = number_of(*own, "NodeID")) {
      if (*id >= 1 && *id <= kMaxNodeId) {
        sheet_.node_id = static_cast<int>(*id);
      } else {
        remarks_.add(own->find("NodeID")->line,
                     "NodeID " + std::to_string(*id) + " is none from 1 to 127: left out");
      }
    }
    if (const auto rate = number_of(*own, "Baudrate"); rate && *rate > 0 && *rate <= 1'000'000) {
      sheet_.bit_rate_kbit_s = static_cast<int>(*rate);
    }
    return {};
  }

  /// What 1018 says counts more than [DeviceInfo]; a zero says nothing.
  void read_identity() {
    const std::array<std::pair<const char*, std::optional<std::uint32_t>*>, 3> members{
        {{"VendorNumber", &sheet_.vendor},
         {"ProductNumber", &sheet_.product},
         {"RevisionNumber", &sheet_.revision}}};
    std::uint8_t sub = 0;
    for (const auto& [key, member] : members) {
      if (*member == 0U) member->reset();
      const SheetEntry* entry = sheet_.find(object::kIdentity, ++sub);
      if (entry == nullptr || !entry->value || entry->value->number == 0) continue;
      const auto number = static_cast<std::uint32_t>(entry->value->number);
      if (*member && **member != number) {
        remarks_.add(entry->line, "1018:" + std::to_string(sub) + " is " + std::to_string(number) +
                                      ", and " + key + " is " + std::to_string(**member));
      }
      *member = number;
    }
  }

  void read_dummies() {
    const IniSection* usage = section("DummyUsage");
    if (usage == nullptr) return;
    for (std::uint16_t type = 1; type <= 0x1B; ++type) {
      if (number_of(*usage, "Dummy" + hex4(type)).value_or(0) != 0) sheet_.dummies.push_back(type);
    }
  }

  DataSheet sheet_;
  Remarks remarks_;
  std::vector<IniSection> sections_;
  SheetObjects objects_;
  std::set<std::uint16_t> listed_;
};

/// What a file begins with that is no text, and what to do about it.
struct OtherFile {
  std::string_view begin;
  const char* what;
  const char* hint;
};
constexpr std::array kOtherFiles{
    OtherFile{"PK\x03\x04", "is a ZIP archive", "unpack it, and name the EDS, DCF or ESI in it"},
    OtherFile{"\x1F\x8B", "is a gzip archive", "unpack it, and name the EDS, DCF or ESI in it"},
    OtherFile{"Rar!", "is a RAR archive", "unpack it, and name the EDS, DCF or ESI in it"},
    OtherFile{"7z\xBC\xAF", "is a 7z archive", "unpack it, and name the EDS, DCF or ESI in it"},
    OtherFile{"%PDF", "is a PDF, and no data sheet for programs",
              "ask the maker for the drive's EDS, DCF or ESI"},
};

Status refuse_other_file(std::string_view text) {
  for (const OtherFile& other : kOtherFiles) {
    if (text.starts_with(other.begin)) return fail(other.what, other.hint);
  }
  return {};
}

}  // namespace

int SheetEntry::size() const noexcept { return sheet_type_size(type); }

const SheetEntry* DataSheet::find(std::uint16_t index, std::uint8_t sub) const noexcept {
  const auto at =
      std::ranges::lower_bound(entries, std::pair{index, sub}, {}, [](const SheetEntry& entry) {
        return std::pair{entry.index, entry.sub};
      });
  return at != entries.end() && at->index == index && at->sub == sub ? &*at : nullptr;
}

bool DataSheet::has(std::uint16_t index) const noexcept {
  const auto at = std::ranges::lower_bound(entries, index, {}, &SheetEntry::index);
  return at != entries.end() && at->index == index;
}

std::optional<std::int64_t> DataSheet::value(std::uint16_t index, std::uint8_t sub,
                                             int id) const noexcept {
  const SheetEntry* entry = find(index, sub);
  if (entry == nullptr || !entry->value) return std::nullopt;
  return entry->value->of(id);
}

Result<DataSheet> read_data_sheet(std::string_view text, std::string_view file,
                                  const DeviceChoice& choice) {
  if (Status other = refuse_other_file(text); !other) {
    other.error().file = file;
    return std::unexpected(std::move(other.error()));
  }
  auto sheet = is_xml(text) ? read_esi(text, file, choice) : SheetReader(file).read(text);
  if (!sheet) sheet.error().file = file;
  return sheet;
}

Result<DataSheet> load_data_sheet(const std::string& file, const DeviceChoice& choice) {
  constexpr std::string_view kXml = ".xml";
  const bool xml = file.size() > kXml.size() &&
                   same_word(std::string_view(file).substr(file.size() - kXml.size()), kXml);
  const Result<std::string> text = read_file(file, "name the EDS, DCF or ESI of a device",
                                             xml ? bounds::kEsiBytes.most : kMaxSheetBytes);
  if (!text) return std::unexpected(text.error());
  return read_data_sheet(*text, file, choice);
}

}  // namespace tandem::canopen
