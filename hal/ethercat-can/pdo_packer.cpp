// First fit in order, as the order decides which fields share a frame.
#include "hal/ethercat-can/pdo_packer.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

#include "canopen/frame.hpp"
#include "canopen/objects.hpp"
#include "canopen/sheet_mappings.hpp"

namespace tandem::hal::can {

using canopen::PdoDirection;

namespace {

/// CiA 301: up to these indices an entry of a mapping stands for bits that nobody reads.
constexpr std::uint32_t kLastDummy = 0x0007;

std::uint32_t entry_of(const MappedField& field) {
  return canopen::mapping_entry(field.index, field.sub, field.size);
}

const MappedField* find(const std::vector<MappedField>& in, std::uint32_t entry) {
  const auto found = std::ranges::find(in, entry, entry_of);
  return found != in.end() ? &*found : nullptr;
}

/// "", or that the entry has other bits than its object.
std::string odd_length(const canopen::DataSheet& sheet, std::uint32_t entry) {
  const canopen::SheetEntry* object =
      sheet.find(static_cast<std::uint16_t>(entry >> 16), static_cast<std::uint8_t>(entry >> 8));
  const int own = object != nullptr ? canopen::bits_of(*object) : 0;
  const auto bits = static_cast<int>(entry & 0xFF);
  if (own == 0 || own == bits) return {};
  return "has " + std::to_string(own) + " bits, and is there with " + std::to_string(bits);
}

/// Reason to refuse an output that is no field of the master, and may not rest at 0.
std::string why_unknown(const canopen::DataSheet& sheet, std::uint32_t entry) {
  const std::string length = odd_length(sheet, entry);
  if (!length.empty()) return length;
  return "has no value in the sheet, and 0 may ask for something: give its Object in the "
         "Dictionary the DefaultValue that the drive has from power-on, and that is sent";
}

}  // namespace

std::size_t most_bytes(bool fd) {
  return fd ? canopen::kMaxFrameBytes : canopen::kClassicFrameBytes;
}

PdoPacker::PdoPacker(NodePlan& node, PdoDirection direction, std::size_t most_bytes,
                     std::vector<PdoSlot> slots)
    : node_(node), direction_(direction), most_bytes_(most_bytes), slots_(std::move(slots)) {}

void PdoPacker::begin(PdoGroup group, std::uint8_t transmission) {
  group_ = group;
  transmission_ = transmission;
  current_ = nullptr;
}

bool PdoPacker::add(std::span<const MappedField> block) {
  std::size_t bytes = 0;
  for (const MappedField& field : block) bytes += field.size;
  const auto fits = [&] {
    return current_ != nullptr && current_->bytes + bytes <= most_bytes_ &&
           current_->fields.size() + block.size() <= most_entries_;
  };
  while (!fits()) {
    if (!open()) return false;
  }
  for (const MappedField& field : block) append(*current_, field);
  return true;
}

PdoPlan& PdoPacker::add_fixed(const PdoSlot& slot, PdoGroup group, std::vector<MappedField> fields,
                              std::uint8_t bytes) {
  begin(group, canopen::kEverySync);
  PdoPlan& pdo = start(slot);
  pdo.mapping_written = false;
  pdo.fields = std::move(fields);
  pdo.bytes = bytes;
  current_ = nullptr;
  return pdo;
}

void PdoPacker::switch_off_the_rest() {
  for (const PdoSlot& slot : slots_) {
    if (slot.on && slot.id_writable && !used(slot)) node_.unused.push_back(plan(slot));
  }
}

bool PdoPacker::used(const PdoSlot& slot) const {
  return std::ranges::any_of(node_.pdos, [&](const PdoPlan& pdo) {
    return pdo.direction == direction_ && pdo.mapping_index == mapping_index(slot);
  });
}

bool PdoPacker::has_room(const PdoSlot& slot) const {
  if (std::ranges::count(node_.pdos, direction_, &PdoPlan::direction) >= canopen::kPdosPerNode) {
    return false;
  }
  return std::ranges::none_of(slots_, [&](const PdoSlot& other) {
    return used(other) && std::ranges::find(slot.excludes, other.number) != slot.excludes.end();
  });
}

std::uint16_t PdoPacker::mapping_index(const PdoSlot& slot) const {
  const bool receive = direction_ == PdoDirection::kReceive;
  return static_cast<std::uint16_t>(
      (receive ? canopen::object::kRpdoMapping : canopen::object::kTpdoMapping) + slot.number - 1);
}

void PdoPacker::append(PdoPlan& pdo, MappedField field) {
  field.offset = pdo.bytes;
  pdo.bytes = static_cast<std::uint8_t>(pdo.bytes + field.size);
  pdo.fields.push_back(field);
}

bool PdoPacker::open() {
  const auto serves = [&](const PdoSlot& slot) {
    return slot.mappable && slot.timely && has_room(slot);
  };
  while (next_ < slots_.size() && !serves(slots_[next_])) ++next_;
  if (next_ >= slots_.size()) return false;
  start(slots_[next_++]);
  return true;
}

PdoPlan& PdoPacker::start(const PdoSlot& slot) {
  most_entries_ = slot.most_entries;
  current_ = &node_.pdos.emplace_back(plan(slot));
  return *current_;
}

PdoPlan PdoPacker::plan(const PdoSlot& slot) const {
  PdoPlan pdo;
  pdo.group = group_;
  pdo.direction = direction_;
  // A slave's PDOs have no identifiers: those that are used are numbered here.
  const auto before = std::ranges::count(node_.pdos, direction_, &PdoPlan::direction);
  pdo.number = node_.ethercat ? static_cast<int>(before) + 1 : slot.number;
  pdo.mapping_index = mapping_index(slot);
  pdo.cob_id = direction_ == PdoDirection::kReceive ? canopen::cob::rpdo(pdo.number, node_.id)
                                                    : canopen::cob::tpdo(pdo.number, node_.id);
  pdo.transmission = slot.type_writable ? transmission_ : slot.type;
  pdo.id_written = slot.id_writable;
  pdo.type_written = slot.type_writable;
  return pdo;
}

BoardPacker::BoardPacker(NodePlan& node, const canopen::DataSheet& sheet, PdoDirection direction,
                         Spread spread)
    : node_(node),
      sheet_(sheet),
      spread_(spread),
      packer_(node, direction, most_bytes(spread != Spread::kFill),
              node.ethercat ? line_slots(sheet, direction) : pdo_slots(sheet, direction, node.id)) {
}

void BoardPacker::add(PdoGroup group, std::uint8_t transmission,
                      std::span<const WireField> fields) {
  packer_.begin(group, transmission);
  for (std::size_t axis = 0; axis < node_.joints.size(); ++axis) {
    std::vector<MappedField> block;
    for (const WireField field : fields) {
      const auto found = object_of(sheet_, node_.abilities[axis], field, static_cast<int>(axis));
      if (!found) continue;
      block.push_back(*found);
      known_.push_back(*found);
    }
    if (spread_ == Spread::kFill) {
      for (const MappedField& field : block) pack({&field, 1});
      continue;
    }
    if (spread_ == Spread::kEach) {
      packer_.begin(group, transmission);
      for (const MappedField& field : block) pack({&field, 1});
      continue;
    }
    pack(block);
  }
}

void BoardPacker::pack(std::span<const MappedField> block) {
  if (block.empty()) return;
  if (!packer_.add(block)) left_.insert(left_.end(), block.begin(), block.end());
}

/// Whether the PDO can be used as it is; the reason is kept where it cannot.
bool BoardPacker::fits(const PdoSlot& slot, PdoGroup group) {
  return node_.ethercat ? fills_line(slot, group) : fills(slot, group);
}

void BoardPacker::use_fixed(PdoGroup group) {
  unused_.clear();
  for (;;) {
    const PdoSlot* best = nullptr;
    std::size_t most = 0;
    for (const PdoSlot& slot : packer_.slots()) {
      if (slot.mappable || !slot.timely || packer_.used(slot) || !packer_.has_room(slot)) continue;
      if (taken_by(slot) == 0) continue;
      if (!fits(slot, group)) continue;
      const std::size_t takes = taken_by(slot);
      if (takes > most) best = &slot;
      most = std::max(most, takes);
    }
    if (best == nullptr) break;
    take_fixed(*best, group);
  }
  for (const PdoSlot& slot : packer_.slots()) {
    if (slot.required && !packer_.used(slot) && packer_.has_room(slot) && fits(slot, group)) {
      take_fixed(slot, group);
    }
  }
  packer_.switch_off_the_rest();
  for (const auto& [number, id] : further_pdos(sheet_, packer_.direction(), node_.id)) {
    PdoPlan& pdo = node_.unused.emplace_back();
    pdo.direction = packer_.direction();
    pdo.number = number;
    pdo.cob_id = id;
  }
}

bool BoardPacker::has_mappable() const {
  return std::ranges::any_of(packer_.slots(),
                             [](const PdoSlot& slot) { return slot.mappable && slot.timely; });
}

/// Keeps the reason.
bool BoardPacker::refuse(const PdoSlot& slot, std::uint32_t entry, std::string_view why) {
  std::array<char, 48> text{};
  const bool receive = packer_.direction() == PdoDirection::kReceive;
  (void)std::snprintf(
      text.data(), text.size(), "; %04X is not used: %04X:%02X ",
      (receive ? canopen::object::kRpdoMapping : canopen::object::kTpdoMapping) + slot.number - 1,
      entry >> 16, entry >> 8 & 0xFF);
  const std::string all = std::string(text.data()) + std::string(why);
  if (unused_.find(all) == std::string::npos) unused_ += all;
  return false;
}

/// Whether the master can send or take every byte of the PDO.
bool BoardPacker::fills(const PdoSlot& slot, PdoGroup group) {
  std::size_t bits = 0;
  for (const std::uint32_t entry : slot.mapping) {
    bits += entry & 0xFF;
    const bool known = find(known_, entry) != nullptr || entry >> 16 <= kLastDummy;
    if (known || group != PdoGroup::kCommand) continue;
    const std::string length = odd_length(sheet_, entry);
    return refuse(slot, entry, length.empty() ? "is no object that the master sends" : length);
  }
  return bits <= 8 * canopen::kClassicFrameBytes;
}

/// The same of a slave: gaps and objects of no use to the master pass, and its outputs rest.
bool BoardPacker::fills_line(const PdoSlot& slot, PdoGroup group) {
  std::size_t bits = 0;
  std::size_t bytes = 0;
  for (const std::uint32_t entry : slot.mapping) {
    const MappedField* known = find(known_, entry);
    if (known != nullptr && bits % 8 != 0) return refuse(slot, entry, "begins within a byte");
    if (known == nullptr && group == PdoGroup::kCommand && !resting_value(sheet_, entry)) {
      return refuse(slot, entry, why_unknown(sheet_, entry));
    }
    bytes += known != nullptr ? known->size : 0U;
    bits += entry & 0xFF;
  }
  if (bits % 8 != 0) return refuse(slot, slot.mapping.back(), "ends within a byte");
  if (bytes > canopen::kMaxFrameBytes)
    return refuse(slot, slot.mapping.back(), "is beyond 64 bytes");
  return true;
}

std::size_t BoardPacker::taken_by(const PdoSlot& slot) const {
  return static_cast<std::size_t>(std::ranges::count_if(
      slot.mapping, [&](std::uint32_t entry) { return find(left_, entry) != nullptr; }));
}

void BoardPacker::take_fixed(const PdoSlot& slot, PdoGroup group) {
  std::vector<MappedField> fields;
  std::size_t bits = 0;
  for (const std::uint32_t entry : slot.mapping) {
    if (const MappedField* found = find(known_, entry)) {
      fields.push_back(*found);
      fields.back().offset = static_cast<std::uint8_t>(bits / 8);
    } else if (node_.ethercat) {
      continue;  // it is in the slave's entries alone
    }
    bits += entry & 0xFF;
    std::erase_if(left_, [&](const MappedField& field) { return entry_of(field) == entry; });
  }
  PdoPlan& pdo =
      packer_.add_fixed(slot, group, std::move(fields), static_cast<std::uint8_t>(bits / 8));
  if (node_.ethercat) pdo.entries = slot.mapping;
}

}  // namespace tandem::hal::can
