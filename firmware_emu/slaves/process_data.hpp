// A slave's process data: objects 1C00, 1C12, 1C13, 16xx and 1Axx, and the copying that they say.
// Layer: firmware_emu.  Thread: the line's; construction non-RT.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "canopen/object_dictionary.hpp"

namespace tandem::firmware::esc {

inline constexpr std::size_t kMaxPdos = 4;  ///< that are the process data at a time
/// What the memory of one direction has room for, three buffers of it.
inline constexpr std::size_t kMaxProcessBytes = 1024;

enum class ProcessDirection : std::uint8_t { kOutputs, kInputs };

/// The object that assigns PDOs: 1C12 or 1C13.
[[nodiscard]] constexpr std::uint16_t assignment_object(ProcessDirection direction) noexcept {
  return direction == ProcessDirection::kOutputs ? 0x1C12 : 0x1C13;
}

/// One direction of a slave's process data: which objects say what it is, and what becomes of it.
class ProcessObjects {
 public:
  virtual ~ProcessObjects() = default;

  /// As after power-on.
  virtual void reset() noexcept TANDEM_RT = 0;
  /// Adds its objects to `od`. @return false when `od` is full or has one of them
  virtual bool add_to(canopen::ObjectDictionary& od) = 0;
  /// Whether the objects may be written: in PREOP.
  virtual void set_open(bool open) noexcept TANDEM_RT = 0;
  /// Bytes that the assigned PDOs have together.
  [[nodiscard]] virtual std::size_t bytes() const noexcept TANDEM_RT = 0;
  /// The objects stay as they are from now on.
  virtual void compile() noexcept TANDEM_RT = 0;
  /// Outputs: what came. @pre compile(); image.size() == bytes()
  virtual void take(std::span<const std::uint8_t> image) noexcept TANDEM_RT = 0;
  /// Inputs: what goes out. @pre compile(); image.size() == bytes()
  virtual void give(std::span<std::uint8_t> image) const noexcept TANDEM_RT = 0;
  virtual void archive(Archive& ar) = 0;
};

inline constexpr std::size_t kMaxPdoEntries = 32;    ///< of a mapping that can be written
inline constexpr std::size_t kMostPdoEntries = 254;  ///< of a fixed one
inline constexpr std::size_t kMaxPdoObjects = 512;

/// A PDO at power-on: its object, and entries as index << 16 | sub << 8 | bits. An entry of index 0
/// is a gap of that many bits.
struct PdoSetup {
  std::uint16_t index = 0;  ///< 16xx or 1Axx
  std::vector<std::uint32_t> entries;
  bool assigned = true;
  bool fixed = false;  ///< its mapping cannot be written

  /// Entries that it has room for.
  [[nodiscard]] std::size_t room() const noexcept {
    return fixed ? entries.size() : std::max(entries.size(), kMaxPdoEntries);
  }
};

/// One direction. Its objects change in PREOP only: count to 0, then entries, then count.
class ProcessData : public ProcessObjects, public canopen::ObjectOwner {
 public:
  /// @param assigns  the assignment can be written
  ProcessData(ProcessDirection direction, std::span<const PdoSetup> pdos, bool assigns = true);
  /// Entries that add_to() adds.
  [[nodiscard]] static std::size_t objects(std::span<const PdoSetup> pdos) noexcept;

  void reset() noexcept TANDEM_RT override;

  /// The objects that it then maps are in `od` too.
  bool add_to(canopen::ObjectDictionary& od) override;
  void set_open(bool open) noexcept TANDEM_RT override { open_ = open; }
  [[nodiscard]] std::size_t bytes() const noexcept TANDEM_RT override;
  /// Finds the mapped objects, before copying begins.
  void compile() noexcept TANDEM_RT override;
  /// Into the objects.
  void take(std::span<const std::uint8_t> image) noexcept TANDEM_RT override;
  /// What the objects hold.
  void give(std::span<std::uint8_t> image) const noexcept TANDEM_RT override;
  void archive(Archive& ar) override;

  canopen::AbortCode check(const canopen::ObjectEntry& entry,
                           const std::uint8_t* bytes) noexcept TANDEM_RT override;
  void written(const canopen::ObjectEntry&) noexcept TANDEM_RT override {}

 protected:
  struct Copy {
    const canopen::ObjectEntry* entry = nullptr;
    std::uint32_t mapped = 0;  ///< index << 16 | sub << 8 | bits
    std::size_t at = 0;        ///< in the process data
    std::uint8_t pdo = 0;      ///< of the assigned ones, from 0
  };

  /// The objects of the assigned PDOs in their order; gaps are left out.
  void lay_out() noexcept;
  [[nodiscard]] std::span<const Copy> copies() const noexcept { return {copy_.data(), copies_}; }
  [[nodiscard]] std::size_t assigned() const noexcept { return assigned_count_; }
  [[nodiscard]] bool is_open() const noexcept { return open_; }
  [[nodiscard]] ProcessDirection direction() const noexcept { return direction_; }
  /// The dictionary of the objects that are mapped; by default the one of add_to().
  void map_from(const canopen::ObjectDictionary& od) noexcept { od_ = &od; }
  void archive_objects(Archive& ar);

 private:
  struct Pdo {
    std::uint16_t index = 0;
    std::uint8_t count = 0;
    bool fixed = false;
    std::vector<std::uint32_t> entries{};
    std::vector<std::uint32_t> power_on{};
  };

  [[nodiscard]] const Pdo* find(std::uint16_t index) const noexcept;
  [[nodiscard]] canopen::AbortCode check_entry(std::uint32_t mapped, std::size_t at) const noexcept;
  [[nodiscard]] static std::size_t bits_of(const Pdo& pdo) noexcept;

  ProcessDirection direction_;
  bool assigns_;
  bool open_ = false;
  const canopen::ObjectDictionary* od_ = nullptr;
  std::vector<Pdo> pdos_;
  std::uint8_t assigned_count_ = 0;
  std::array<std::uint16_t, kMaxPdos> assigned_{};
  std::uint8_t power_on_count_ = 0;
  std::array<std::uint16_t, kMaxPdos> power_on_{};
  std::size_t copies_ = 0;
  std::vector<Copy> copy_;
};

}  // namespace tandem::firmware::esc
