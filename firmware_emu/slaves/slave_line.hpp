// Slaves in a row: the cables between them, and the way that a frame takes.
// Test equipment; see docs/ethercat.md. Layer: firmware_emu.  Thread: the line's.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "ethercat/medium.hpp"
#include "firmware_emu/slaves/slave.hpp"

namespace tandem::firmware::esc {

/// From one slave to the next, processing included.
inline constexpr std::int64_t kDefaultHopNs = 300;

/// Cable n leads to slave n: cable 0 from the master to the first one. A frame turns back where a
/// cable is cut or a slave has no power, and does not come back when that is before the first.
class SlaveLine final : public ethercat::Medium {
 public:
  /// @param slaves  in the order of the line; they outlive it
  explicit SlaveLine(std::vector<Slave*> slaves, std::int64_t hop_ns = kDefaultHopNs);

  bool pass(std::span<std::uint8_t> frame, std::int64_t now_ns) noexcept TANDEM_RT override;
  /// process() and publish() of every slave that has power.
  void process(std::int64_t now_ns) noexcept TANDEM_RT;

  [[nodiscard]] std::size_t size() const noexcept { return slaves_.size(); }
  [[nodiscard]] Slave& slave(std::size_t position) noexcept { return *slaves_[position]; }
  /// Cuts or mends cable `number`. @pre number < size()
  void set_cable(std::size_t number, bool whole) noexcept TANDEM_RT;
  /// Switches a slave off, or on again as after power-on. @pre position < size()
  void set_power(std::size_t position, bool on, std::int64_t now_ns) noexcept TANDEM_RT;
  /// How many slaves a frame reaches.
  [[nodiscard]] std::size_t reached() const noexcept;
  /// Frames that were no EtherCAT frames, and passed as they were.
  [[nodiscard]] std::uint64_t malformed() const noexcept { return malformed_; }
  /// The slaves and the line.
  void archive(Archive& ar);

 private:
  void update_links() noexcept;

  std::vector<Slave*> slaves_;
  std::int64_t hop_ns_;
  std::vector<std::uint8_t> cable_whole_;
  std::vector<std::uint8_t> powered_;
  std::uint64_t malformed_ = 0;
};

}  // namespace tandem::firmware::esc
