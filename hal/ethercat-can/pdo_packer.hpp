// Fills a node's PDOs with fields: those that can be mapped in order, those that cannot as they
// are. Layer: hal/ethercat-can.  Thread: non-RT.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "canopen/data_sheet.hpp"
#include "hal/ethercat-can/pdo_layout.hpp"
#include "hal/ethercat-can/pdo_slots.hpp"

namespace tandem::hal::can {

/// Bytes of the largest PDO: 64 on CAN FD, 8 on classic CAN.
[[nodiscard]] std::size_t most_bytes(bool fd);

/// Appends blocks to a node's PDOs: one block stays whole.
class PdoPacker {
 public:
  /// @param node  its `pdos` and `unused` grow; outlives the packer
  PdoPacker(NodePlan& node, canopen::PdoDirection direction, std::size_t most_bytes,
            std::vector<PdoSlot> slots);

  /// The next block opens a PDO.
  void begin(PdoGroup group, std::uint8_t transmission);
  /// @return false: no PDO is left that could take it.
  [[nodiscard]] bool add(std::span<const MappedField> block);
  /// A PDO whose mapping stays as it is. @param fields  with their offsets
  PdoPlan& add_fixed(const PdoSlot& slot, PdoGroup group, std::vector<MappedField> fields,
                     std::uint8_t bytes);
  /// What is in use from power-on and carries nothing.
  void switch_off_the_rest();

  [[nodiscard]] canopen::PdoDirection direction() const { return direction_; }
  [[nodiscard]] std::span<const PdoSlot> slots() const { return slots_; }
  [[nodiscard]] bool used(const PdoSlot& slot) const;
  /// Whether the node has a PDO more, and none that the slot cannot be beside.
  [[nodiscard]] bool has_room(const PdoSlot& slot) const;

  static void append(PdoPlan& pdo, MappedField field);

 private:
  bool open();
  PdoPlan& start(const PdoSlot& slot);
  [[nodiscard]] PdoPlan plan(const PdoSlot& slot) const;
  [[nodiscard]] std::uint16_t mapping_index(const PdoSlot& slot) const;

  NodePlan& node_;
  canopen::PdoDirection direction_;
  std::size_t most_bytes_;
  std::vector<PdoSlot> slots_;
  std::size_t next_ = 0;  ///< in slots_
  PdoGroup group_ = PdoGroup::kCommand;
  std::uint8_t transmission_ = canopen::kEverySync;
  std::size_t most_entries_ = 0;
  PdoPlan* current_ = nullptr;
};

/// Packs the fields of a board's axes in one direction, as far as its sheet has objects for them.
class BoardPacker {
 public:
  /// How an axis' fields are spread over PDOs.
  enum class Spread : std::uint8_t {
    kFill,      ///< one PDO of eight bytes after the other
    kTogether,  ///< they stay together, and PDOs of up to 64 bytes take several axes
    kEach,      ///< a slave's: each axis has PDOs of its own, of its entries and up to 64 bytes
  };
  BoardPacker(NodePlan& node, const canopen::DataSheet& sheet, canopen::PdoDirection direction,
              Spread spread);

  void add(PdoGroup group, std::uint8_t transmission, std::span<const WireField> fields);
  /// PDOs whose mapping stays as it is take what found no place, first the one that takes the most.
  /// The other objects of a command must be ones that the master knows, as it has to send them.
  /// After the last add().
  void use_fixed(PdoGroup group);

  [[nodiscard]] bool has_mappable() const;
  /// PDOs that stay as they are and cannot be used: "; 1701 is not used: …".
  [[nodiscard]] const std::string& unused() const { return unused_; }
  /// What is in no PDO.
  [[nodiscard]] const std::vector<MappedField>& left() const { return left_; }

 private:
  void pack(std::span<const MappedField> block);
  [[nodiscard]] bool fills(const PdoSlot& slot, PdoGroup group);
  [[nodiscard]] std::size_t taken_by(const PdoSlot& slot) const;
  void take_fixed(const PdoSlot& slot, PdoGroup group);
  [[nodiscard]] bool fills_line(const PdoSlot& slot, PdoGroup group);
  [[nodiscard]] bool fits(const PdoSlot& slot, PdoGroup group);
  bool refuse(const PdoSlot& slot, std::uint32_t entry, std::string_view why);

  NodePlan& node_;
  const canopen::DataSheet& sheet_;
  Spread spread_;
  PdoPacker packer_;
  std::vector<MappedField> known_;  ///< all that the drive has objects for
  std::vector<MappedField> left_;   ///< of them, what is in no PDO yet
  std::string unused_;
};

}  // namespace tandem::hal::can
