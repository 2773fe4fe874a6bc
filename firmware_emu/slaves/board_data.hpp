// Process data of a board whose firmware speaks CANopen: its PDOs travel between it and the slave
// as frames. Layer: firmware_emu.  Thread: the line's; construction non-RT.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "canopen/data_sheet.hpp"
#include "canopen/frame.hpp"
#include "firmware_emu/slaves/process_data.hpp"

namespace tandem::firmware::esc {

/// The PDOs of a slave at power-on, in one direction: those of its sheet; of one of our boards four
/// that can be mapped. Where the sheet assigns none, the first ones are, an axis each: 6040, 607A,
/// 6060 and a gap; 6041, 6064, 606C, 6077, 6061 and a gap; of a sensor its channels.
/// @param sheet  null: a board or a sensor of ours
[[nodiscard]] std::vector<PdoSetup> power_on_pdos(ProcessDirection direction,
                                                  const canopen::DataSheet* sheet,
                                                  const canopen::ObjectDictionary& board);

/// Assignment and mappings are the slave's. In PREOP the board's PDOs are off; on the way to SAFEOP
/// its first ones get the objects of those that are assigned, without the gaps, and are on.
class BoardData final : public ProcessData {
 public:
  /// A PDO between slave and board.
  struct Part {
    std::uint32_t cob_id = 0;
    std::uint8_t bytes = 0;
    std::size_t first = 0;  ///< of copies()
    std::size_t count = 0;
  };

  /// @param board  the board's dictionary; outlives this
  BoardData(ProcessDirection direction, std::span<const PdoSetup> pdos, bool assigns,
            canopen::ObjectDictionary& board, int node_id);

  bool add_to(canopen::ObjectDictionary& od) override;
  void set_open(bool open) noexcept TANDEM_RT override;
  void compile() noexcept TANDEM_RT override;
  void take(std::span<const std::uint8_t> image) noexcept TANDEM_RT override;
  void give(std::span<std::uint8_t> image) const noexcept TANDEM_RT override;
  void archive(Archive& ar) override;

  /// The assigned PDOs, in their order.
  [[nodiscard]] std::span<const Part> parts() const noexcept { return {parts_.data(), count_}; }
  /// Outputs, as the board's RPDO.
  [[nodiscard]] canopen::Frame frame_of(const Part& part) const noexcept;
  /// Inputs, from the board's TPDO.
  void take_frame(const Part& part, const canopen::Frame& frame) noexcept;
  /// Whether take() was called since the last call.
  [[nodiscard]] bool fresh() noexcept { return std::exchange(fresh_, false); }

 private:
  [[nodiscard]] std::uint32_t cob_id(int number) const noexcept;
  void switch_pdo(int number, bool on) noexcept;
  void map_pdo(int number, const Part& part) noexcept;
  void make_parts() noexcept;

  canopen::ObjectDictionary* board_;
  int node_;
  bool fresh_ = false;
  std::size_t count_ = 0;
  std::array<Part, kMaxPdos> parts_{};
  std::array<std::uint8_t, kMaxProcessBytes> image_{};
};

}  // namespace tandem::firmware::esc
