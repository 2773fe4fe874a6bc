// Process data of a board whose firmware speaks CANopen: the PDOs are its own, and travel between
// it and the slave as frames. Layer: firmware_emu.  Thread: the line's; construction non-RT.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>

#include "firmware_emu/ethercat/process_objects.hpp"

namespace tandem::firmware::esc {

/// Its own object is the assignment; the mappings are the board's. In PREOP the board's PDOs are
/// off, so that their mappings can be written; from SAFEOP on those that are assigned are on.
class BoardData final : public ProcessObjects, public canopen::ObjectOwner {
 public:
  /// A PDO's place in the process data.
  struct Part {
    std::uint32_t cob_id = 0;
    std::size_t offset = 0;
    std::size_t bytes = 0;
  };

  /// @param board  the board's dictionary; outlives this
  BoardData(Direction direction, canopen::ObjectDictionary& board, int node_id) noexcept;

  bool add_to(canopen::ObjectDictionary& od) override;
  void set_open(bool open) noexcept TANDEM_RT override;
  [[nodiscard]] std::size_t bytes() const noexcept TANDEM_RT override;
  void compile() noexcept TANDEM_RT override;
  void take(std::span<const std::uint8_t> image) noexcept TANDEM_RT override;
  void give(std::span<std::uint8_t> image) const noexcept TANDEM_RT override;
  void archive(Archive& ar) override;

  /// The assigned PDOs, in their order.
  [[nodiscard]] std::span<const Part> parts() const noexcept { return {parts_.data(), count_}; }
  [[nodiscard]] std::span<std::uint8_t> bytes_of(const Part& part) noexcept {
    return std::span(image_).subspan(part.offset, part.bytes);
  }
  /// Whether take() was called since the last call.
  [[nodiscard]] bool fresh() noexcept { return std::exchange(fresh_, false); }

  canopen::AbortCode check(const canopen::ObjectEntry& entry,
                           const std::uint8_t* bytes) noexcept TANDEM_RT override;
  void written(const canopen::ObjectEntry&) noexcept TANDEM_RT override {}

 private:
  [[nodiscard]] int number_of(std::uint16_t index) const noexcept;
  [[nodiscard]] std::size_t mapped_bytes(std::uint16_t index) const noexcept;
  [[nodiscard]] std::uint32_t cob_id(int number) const noexcept;
  void switch_pdo(int number, bool on) noexcept;

  Direction direction_;
  canopen::ObjectDictionary* board_;
  int node_;
  bool open_ = false;
  bool fresh_ = false;
  std::uint8_t assigned_count_ = 0;
  std::array<std::uint16_t, kMaxPdos> assigned_{};
  std::size_t count_ = 0;
  std::array<Part, kMaxPdos> parts_{};
  std::array<std::uint8_t, kMaxProcessBytes> image_{};
};

}  // namespace tandem::firmware::esc
