// An emulated slave controller: registers, memory and the rules by which frames reach them.
// Test equipment; see docs/ethercat.md. Layer: firmware_emu.  Thread: the line's.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "ethercat/datagram.hpp"
#include "ethercat/registers.hpp"
#include "firmware_emu/slaves/dc_clock.hpp"

namespace tandem::firmware::esc {

inline constexpr std::size_t kMemoryBytes = 0x3000;
inline constexpr std::size_t kManagers = 8;
inline constexpr std::size_t kFmmus = 8;

/// When a frame was at a slave [ns of the line's time].
struct Passage {
  std::int64_t arrived_ns = 0;    ///< at port 0
  std::int64_t returned_ns = -1;  ///< at port 1, from the slaves behind; -1: there are none
};

/// The chip between the wire and the application. The wire's side is receive(); all else is the
/// application's. No clock of its own and no heap after construction.
class Esc {
 public:
  /// @param sii  what the information memory holds
  Esc(std::vector<std::uint8_t> sii, bool has_dc, const ClockSetup& clock);

  /// As after power-on.
  void reset(std::int64_t now_ns) noexcept TANDEM_RT;
  /// A datagram passes: its data, address and working counter change in place.
  void receive(ethercat::Datagram& datagram, const Passage& passage) noexcept TANDEM_RT;
  /// Something was plugged into a port, or out of it.
  void set_link(std::size_t port, bool up) noexcept TANDEM_RT;
  /// What takes time on the chip: the information memory, the watchdog, SYNC0.
  void process(std::int64_t now_ns) noexcept TANDEM_RT;

  /// Whether the master wrote AL control since the last call, and what.
  [[nodiscard]] bool take_al_request(std::uint16_t& request) noexcept TANDEM_RT;
  void set_al(ethercat::AlState state, bool error, ethercat::AlCode code) noexcept TANDEM_RT;

  [[nodiscard]] ethercat::SyncManager manager(std::size_t number) const noexcept TANDEM_RT;
  /// A message that the master put into sync manager 0.
  /// @return its bytes in place, until the next receive(); empty: there is none
  [[nodiscard]] std::span<const std::uint8_t> take_mailbox() noexcept TANDEM_RT;
  /// Puts a message into sync manager 1.
  /// @return false while the last one has not been read, or when it does not fit
  bool post_mailbox(std::span<const std::uint8_t> message) noexcept TANDEM_RT;
  /// Posts the last message again when the master asks for it, because it lost the frame.
  /// @return whether it asked
  bool answer_repeat() noexcept TANDEM_RT;
  /// Forgets messages in both mailboxes.
  void clear_mailboxes() noexcept TANDEM_RT;

  /// Whether sync manager 2 was written since the last call.
  [[nodiscard]] bool take_outputs() noexcept TANDEM_RT;
  /// `size` bytes of memory; empty where there is none.
  [[nodiscard]] std::span<std::uint8_t> memory(std::uint16_t start,
                                               std::size_t size) noexcept TANDEM_RT;
  /// Whether the process data watchdog has expired. It runs from arm_watchdog() on.
  [[nodiscard]] bool watchdog_expired() const noexcept { return expired_; }
  void arm_watchdog(std::int64_t now_ns) noexcept TANDEM_RT;

  [[nodiscard]] bool sync0_active() const noexcept;
  /// SYNC0 pulses since it was activated.
  [[nodiscard]] std::uint64_t sync0_pulses() const noexcept { return pulses_; }
  /// The slave's copy of the system time.
  [[nodiscard]] std::int64_t system_time_ns(std::int64_t now_ns) const noexcept TANDEM_RT;
  void archive(Archive& ar);

 private:
  [[nodiscard]] bool addressed(ethercat::Datagram& datagram) const noexcept;
  void register_datagram(ethercat::Datagram& datagram, bool mine, const Passage& passage) noexcept;
  void logical_datagram(ethercat::Datagram& datagram, const Passage& passage) noexcept;
  bool map_bits(const ethercat::Fmmu& fmmu, std::uint32_t address, std::span<std::uint8_t> data,
                bool write, const Passage& passage) noexcept;

  [[nodiscard]] bool read(std::size_t address, std::span<std::uint8_t> out, bool merge,
                          const Passage& passage) noexcept;
  [[nodiscard]] bool write(std::size_t address, std::span<const std::uint8_t> in,
                           const Passage& passage) noexcept;
  [[nodiscard]] bool no_clock_here(std::size_t address, std::size_t size) const noexcept;
  [[nodiscard]] bool managers_allow(std::size_t address, std::size_t size, bool write) noexcept;
  void managers_done(std::size_t address, std::size_t size, bool write,
                     std::int64_t now_ns) noexcept;
  void refresh(std::size_t address, std::size_t size, const Passage& passage) noexcept;
  void written(std::size_t address, std::size_t size, std::span<const std::uint8_t> in,
               const Passage& passage) noexcept;
  void written_managers(std::size_t address, std::size_t size) noexcept;
  void latch(const Passage& passage) noexcept;
  void compare_time(std::uint64_t reference_ns, const Passage& passage) noexcept;
  void run_sii() noexcept;
  void run_watchdog(std::int64_t now_ns) noexcept;
  void run_sync0(std::int64_t now_ns) noexcept;

  template <class T>
  [[nodiscard]] T at(std::size_t address) const noexcept {
    return canopen::get<T>(&memory_[address]);
  }
  template <class T>
  void set(std::size_t address, T value) noexcept {
    canopen::put(&memory_[address], value);
  }

  std::vector<std::uint8_t> sii_;
  bool has_dc_;
  DcClock clock_;
  std::array<std::uint8_t, kMemoryBytes> memory_{};
  std::array<std::uint8_t, 1536> scratch_{};       ///< of one mapped access
  std::array<std::uint8_t, 1536> last_message_{};  ///< for the master that lost it
  std::size_t last_message_bytes_ = 0;
  std::array<bool, kManagers> open_{};  ///< a mailbox that was begun and not ended
  bool al_requested_ = false;
  bool sii_requested_ = false;
  bool outputs_written_ = false;
  bool armed_ = false;
  bool expired_ = false;
  bool sync0_missed_ = false;  ///< its start had passed when it was activated
  std::int64_t fed_ns_ = 0;
  std::uint64_t pulses_ = 0;
};

}  // namespace tandem::firmware::esc
