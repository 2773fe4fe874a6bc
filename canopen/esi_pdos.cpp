// PDOs of an ESI as the objects that a master sees: mappings 16xx and 1Axx, the assignment 1C12 and
// 1C13, and what the PDOs carry.
#include <algorithm>
#include <array>
#include <cstdio>
#include <string>

#include "base/bounds.hpp"
#include "canopen/esi_text.hpp"
#include "canopen/object_dictionary.hpp"
#include "canopen/objects.hpp"

namespace tandem::canopen {
namespace {

constexpr std::uint16_t kAssignOutputs = 0x1C12;
constexpr std::uint16_t kAssignInputs = 0x1C13;
constexpr std::size_t kUsualEntries = 8;  // that can be mapped, where the file does not say more
constexpr std::uint64_t kWholeByte = 8;

void set_number(SheetEntry& entry, DataType type, std::uint8_t access, std::int64_t value) {
  entry.type = static_cast<std::uint16_t>(type);
  entry.access = access;
  entry.value = SheetValue{.number = value};
}

class PdoReader {
 public:
  PdoReader(EsiSheet& esi, const EsiElement& pdo, bool receive, EsiShift shift)
      : esi_(esi), pdo_(pdo), receive_(receive), shift_(shift) {}

  void read() {
    const std::uint16_t first = receive_ ? object::kRpdoMapping : object::kTpdoMapping;
    index_ = esi_.index(pdo_, shift_.pdo);
    if (index_ < first || index_ >= first + 0x200) {
      return esi_.fail(pdo_, "its index is none of a PDO in this direction",
                       receive_ ? "expected is #x1600 to #x17FF" : "expected is #x1A00 to #x1BFF");
    }
    if (of_another_manager()) return;
    if (++esi_.pdos > bounds::kEsiPdos.most) {
      return esi_.fail(pdo_, beyond(bounds::kEsiPdos).message, "is this the file of a slave?");
    }
    for (const EsiElement* entry = pdo_.FirstChildElement("Entry"); entry != nullptr;
         entry = entry->NextSiblingElement("Entry")) {
      read_entry(*entry);
    }
    if (mapping_.size() > bounds::kEsiPdoEntries.most) {
      return esi_.fail(pdo_, beyond(bounds::kEsiPdoEntries).message, "");
    }
    add_mapping();
    add_rules();
  }

 private:
  void read_entry(const EsiElement& entry) {
    const std::uint16_t index = esi_.index(entry, shift_.object);
    const auto sub = static_cast<std::uint8_t>(esi_.number(entry, "SubIndex", 0xFF, 0));
    const std::uint64_t bits = esi_.number(entry, "BitLen", 0xFFFF);
    if (bits == 0) return esi_.fail(entry, "has no bits (BitLen)", "a gap has an index 0 and bits");
    // A mapping's entry has eight bits for the length. What is longer can only be passed over.
    std::uint64_t rest = bits;
    for (; rest > 0xFF; rest -= 31 * kWholeByte) mapping_.push_back(31 * kWholeByte);
    if (bits > 0xFF || index < 0x1000) {
      mapping_.push_back(static_cast<std::uint32_t>(rest));
      return;
    }
    mapping_.push_back(static_cast<std::uint32_t>(index << 16 | sub << 8) |
                       static_cast<std::uint32_t>(bits));
    add_object(entry, index, sub, bits);
  }

  /// What a PDO carries is an object, also where the file has no dictionary, or none of it there.
  void add_object(const EsiElement& entry, std::uint16_t index, std::uint8_t sub,
                  std::uint64_t bits) {
    const bool known = esi_.entries.contains({index, sub});
    SheetEntry& object = esi_.entry(index, sub, entry);
    if (!known || object.type == 0) {
      const std::uint16_t named = esi_type(esi_text(entry, "DataType"));
      object.type = named != 0 ? named : esi_unsigned(bits);
      object.name = printable(esi_text(entry, "Name"));
    }
    if (!known && receive_) object.access = kReadWrite;
    object.access |= receive_ ? kMapRpdo : kMapTpdo;
  }

  void add_mapping() {
    const bool fixed = esi_flag(pdo_, "Fixed") || !esi_.configures;
    const std::uint8_t access = fixed ? kRead : kReadWrite;
    std::size_t room = mapping_.size();
    if (!fixed) {
      const auto last = esi_.entries.upper_bound({index_, 0xFE});
      const bool listed = last != esi_.entries.begin() && std::prev(last)->first.first == index_ &&
                          std::prev(last)->first.second > 0;
      room = std::max(room, listed ? std::prev(last)->first.second : kUsualEntries);
    }
    SheetEntry& count = esi_.entry(index_, 0, pdo_);
    set_number(count, DataType::kUnsigned8, access, static_cast<std::int64_t>(mapping_.size()));
    count.name = printable(esi_text(pdo_, "Name"));
    for (std::size_t i = 0; i < std::min(room, bounds::kEsiPdoEntries.most); ++i) {
      set_number(esi_.entry(index_, static_cast<std::uint8_t>(i + 1), pdo_), DataType::kUnsigned32,
                 access, i < mapping_.size() ? std::int64_t{mapping_[i]} : 0);
    }
  }

  /// 1C12 and 1C13 have those of sync managers 2 and 3 alone.
  bool of_another_manager() {
    if (pdo_.Attribute("Sm") == nullptr) return false;
    const std::uint64_t own = receive_ ? 2 : 3;
    const std::uint64_t manager = esi_.attribute(pdo_, "Sm", 0xFF);
    if (manager == own) return false;
    std::array<char, 8> name{};
    (void)std::snprintf(name.data(), name.size(), "%04X", unsigned{index_});
    esi_.hinder(pdo_, std::string("PDO ") + name.data() + " is not used: it is of sync manager " +
                          std::to_string(manager) + " (Sm), and " +
                          (receive_ ? "outputs are of 2" : "inputs are of 3"));
    return true;
  }

  /// Whether it is among the process data from power-on, and the PDOs that it does not go with.
  void add_rules() {
    if (pdo_.Attribute("Sm") != nullptr) assign(receive_ ? kAssignOutputs : kAssignInputs);
    if (esi_flag(pdo_, "Mandatory")) esi_.sheet.mandatory.push_back(index_);
    for (const EsiElement* other = pdo_.FirstChildElement("Exclude"); other != nullptr;
         other = other->NextSiblingElement("Exclude")) {
      const auto number = esi_number(esi_text(*other));
      if (!number || *number > 0xFFFF) {
        return esi_.fail(*other, "'" + printable(esi_text(*other)) + "' is no PDO");
      }
      const std::uint64_t shift = esi_flag(*other, "DependOnSlot") ? shift_.pdo : 0;
      esi_.sheet.excludes.emplace_back(index_, static_cast<std::uint16_t>(*number + shift));
    }
  }

  void assign(std::uint16_t assignment) {
    SheetEntry& count = esi_.entry(assignment, 0, pdo_);
    const std::int64_t before = esi_.assigned[receive_ ? 0 : 1]++;
    if (before >= 0xFE) return;
    set_number(count, DataType::kUnsigned8, kRead, before + 1);
    set_number(esi_.entry(assignment, static_cast<std::uint8_t>(before + 1), pdo_),
               DataType::kUnsigned16, kRead, index_);
  }

  EsiSheet& esi_;
  const EsiElement& pdo_;
  bool receive_;
  EsiShift shift_;
  std::uint16_t index_ = 0;
  std::vector<std::uint32_t> mapping_;
};

}  // namespace

void read_esi_pdos(EsiSheet& esi, const EsiElement& parent, EsiShift shift) {
  for (const auto& [name, receive] : {std::pair{"RxPdo", true}, {"TxPdo", false}}) {
    for (const EsiElement* pdo = parent.FirstChildElement(name); pdo != nullptr;
         pdo = pdo->NextSiblingElement(name)) {
      PdoReader(esi, *pdo, receive, shift).read();
    }
  }
}

void add_esi_assignment(EsiSheet& esi, const EsiElement& at) {
  const std::uint8_t access = esi.assigns ? kReadWrite : kRead;
  for (const std::uint16_t assignment : {kAssignOutputs, kAssignInputs}) {
    const std::int64_t used = esi.assigned[assignment == kAssignOutputs ? 0 : 1];
    SheetEntry& count = esi.entry(assignment, 0, at);
    set_number(count, DataType::kUnsigned8, access, used);
    count.name = assignment == kAssignOutputs ? "Outputs: PDOs" : "Inputs: PDOs";
    for (auto i = esi.entries.upper_bound({assignment, 0});
         i != esi.entries.end() && i->first.first == assignment; ++i) {
      i->second.access = access;
      if (i->first.second > used) i->second.value.reset();
    }
  }
}

}  // namespace tandem::canopen
