// An emulated slave: controller, state machine, mailbox and process data before an object
// dictionary. Test equipment; see docs/ethercat.md. Layer: firmware_emu.  Thread: the line's.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "base/result.hpp"
#include "canopen/object_dictionary.hpp"
#include "ethercat/sii.hpp"
#include "firmware_emu/slaves/coe_server.hpp"
#include "firmware_emu/slaves/esc.hpp"
#include "firmware_emu/slaves/process_data.hpp"

namespace tandem::firmware::esc {

/// Where the memory of an emulated slave begins.
inline constexpr std::uint16_t kMailboxAt = 0x1000;
inline constexpr std::uint16_t kOutputsAt = 0x1800;
inline constexpr std::uint16_t kInputsAt = 0x2400;

struct SlaveSetup {
  ethercat::sii::Identity identity{.vendor = ethercat::sii::kNobodysVendor};
  std::string name;
  std::uint16_t mailbox_bytes = 128;  ///< each way, kMinMailboxBytes to 1024
  std::vector<PdoSetup> outputs{};    ///< 16xx, of which at most kMaxPdos are assigned
  std::vector<PdoSetup> inputs{};     ///< 1Axx, the same
  bool has_dc = true;
  ClockSetup clock;
  std::int64_t state_delay_ns = 0;  ///< how long the application takes to change its state
};

/// How long the request for OP waits for outputs and for the first SYNC0, before it is refused.
inline constexpr std::int64_t kOpWaitNs = 1'000'000'000;

/// Whether a Slave can be built from `setup`.
[[nodiscard]] Status check(const SlaveSetup& setup);

/// The information memory of such a slave.
[[nodiscard]] ethercat::sii::Content sii_content(const SlaveSetup& setup);

/// One cycle of its application at time t: process(t), then what the application does with its
/// objects, then publish(). No heap after construction.
class Slave {
 public:
  /// Adds 1C00, 1C12, 1C13 and the PDOs' objects to `od`, which has the rest already and outlives
  /// the slave. @pre check(setup)
  Slave(const SlaveSetup& setup, canopen::ObjectDictionary& od);
  /// A slave whose process data is another's; of setup its PDOs are in the information memory.
  /// @param application  answers for what is not in `od`
  Slave(const SlaveSetup& setup, canopen::ObjectDictionary& od,
        canopen::ObjectDictionary& application, std::unique_ptr<ProcessObjects> outputs,
        std::unique_ptr<ProcessObjects> inputs);
  Slave(const Slave&) = delete;
  Slave& operator=(const Slave&) = delete;

  /// As after power-on; the application's own objects stay as they are.
  void reset(std::int64_t now_ns) noexcept TANDEM_RT;
  /// State changes, messages, new outputs into their objects.
  void process(std::int64_t now_ns) noexcept TANDEM_RT;
  /// The inputs' objects into the memory that the master reads.
  void publish() noexcept TANDEM_RT;

  [[nodiscard]] Esc& controller() noexcept { return esc_; }
  [[nodiscard]] const Esc& controller() const noexcept { return esc_; }
  [[nodiscard]] ethercat::AlState state() const noexcept { return state_; }
  [[nodiscard]] ethercat::AlCode code() const noexcept { return code_; }
  /// Times that new outputs were taken.
  [[nodiscard]] std::uint64_t outputs_taken() const noexcept { return taken_; }
  /// Leaves the state with an error, as an application does that has one of its own.
  void fail(ethercat::AlState state, ethercat::AlCode code) noexcept TANDEM_RT;
  void archive(Archive& ar);

 private:
  void take_state_request(std::int64_t now_ns) noexcept;
  void change(std::uint8_t request, std::int64_t now_ns) noexcept;
  [[nodiscard]] ethercat::AlCode try_enter(ethercat::AlState state) const noexcept;
  [[nodiscard]] bool mailbox_is_right() const noexcept;
  void enter(ethercat::AlState state, std::int64_t now_ns) noexcept;
  void run_mailbox() noexcept;
  void take_process_data() noexcept;

  std::int64_t state_delay_ns_;
  std::uint16_t mailbox_bytes_;
  std::unique_ptr<ProcessObjects> outputs_;
  std::unique_ptr<ProcessObjects> inputs_;
  CoeServer coe_;
  Esc esc_;
  ethercat::AlState state_ = ethercat::AlState::kInit;
  ethercat::AlCode code_ = ethercat::AlCode::kNone;
  bool error_ = false;
  bool requested_ = false;
  bool heard_outputs_ = false;  ///< since SAFEOP
  std::uint8_t request_ = 0;
  std::uint8_t last_counter_ = 0;  ///< of the master's messages
  std::int64_t requested_ns_ = 0;
  std::uint64_t taken_ = 0;
  std::size_t answer_bytes_ = 0;  ///< waiting for room in the mailbox
  std::array<std::uint8_t, 1536> answer_{};
};

}  // namespace tandem::firmware::esc
