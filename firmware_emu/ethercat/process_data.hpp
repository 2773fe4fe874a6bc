// A slave's process data: objects 1C00, 1C12, 1C13, 16xx and 1Axx, and the copying that they say.
// Layer: firmware_emu.  Thread: the line's; construction non-RT.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "canopen/object_dictionary.hpp"
#include "firmware_emu/ethercat/process_objects.hpp"

namespace tandem::firmware::esc {

inline constexpr std::size_t kMaxPdoEntries = 32;

/// A PDO at power-on: its object, and entries as index << 16 | sub << 8 | bits.
struct PdoSetup {
  std::uint16_t index = 0;  ///< 16xx or 1Axx
  std::vector<std::uint32_t> entries;
  bool assigned = true;
};

/// One direction. Its objects change in PREOP only: count to 0, then entries, then count.
class ProcessData final : public ProcessObjects, public canopen::ObjectOwner {
 public:
  ProcessData(Direction direction, std::span<const PdoSetup> pdos);

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

 private:
  struct Pdo {
    std::uint16_t index = 0;
    std::uint8_t count = 0;
    std::array<std::uint32_t, kMaxPdoEntries> entries{};
  };
  struct Copy {
    const canopen::ObjectEntry* entry = nullptr;  ///< none: a gap
    std::uint32_t bytes = 0;
  };

  [[nodiscard]] const Pdo* find(std::uint16_t index) const noexcept;
  [[nodiscard]] canopen::AbortCode check_entry(std::uint32_t mapped) const noexcept;
  [[nodiscard]] static std::size_t bytes_of(const Pdo& pdo) noexcept;

  Direction direction_;
  bool open_ = false;
  const canopen::ObjectDictionary* od_ = nullptr;
  std::vector<Pdo> pdos_;
  std::uint8_t assigned_count_ = 0;
  std::array<std::uint16_t, kMaxPdos> assigned_{};
  std::size_t copies_ = 0;
  std::array<Copy, kMaxPdos * kMaxPdoEntries> copy_{};
};

}  // namespace tandem::firmware::esc
