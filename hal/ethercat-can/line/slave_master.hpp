// The master's view of one slave: its way from power-on to OP, and what it is asked after that.
// Layer: hal/ethercat-can/line.  Thread: construction non-RT; the rest the loop's thread.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "ethercat/registers.hpp"
#include "ethercat/sii.hpp"
#include "hal/ethercat-can/line/coe_client.hpp"
#include "hal/ethercat-can/line/exchange.hpp"
#include "hal/ethercat-can/line/slave_clock.hpp"
#include "hal/ethercat-can/line/slave_plan.hpp"

namespace tandem {
class Archive;
}

namespace tandem::hal::ecat {

using ethercat::LineError;

/// How far a slave is brought up.
enum class SlaveStage : std::uint8_t {
  kWait,         ///< for the scan of the line
  kReset,        ///< station address, INIT, everything off
  kFeatures,     ///< of the chip
  kSii,          ///< information memory, identity
  kPreOp,        ///< mailboxes, PREOP
  kConfigure,    ///< SDO steps
  kProcessData,  ///< sync managers and FMMUs
  kWaitClock,    ///< for the time stamps of a frame
  kClock,        ///< delay, offset, SYNC0
  kSafeOp,
  kReady,   ///< in SAFEOP; start() lets it go on
  kSettle,  ///< its clock comes near the reference, SYNC0 begins
  kOp,
  kRunning,
  kDown,  ///< error() says why
};

/// Where a slave's process data is.
struct SlaveMapping {
  std::uint32_t outputs_at = 0;  ///< logical addresses
  std::uint32_t inputs_at = 0;
  std::uint16_t outputs = 0;  ///< bytes
  std::uint16_t inputs = 0;
};

/// Non-blocking: one request at a time, on the channel that is its position.
class SlaveMaster {
 public:
  static constexpr std::uint16_t kFirstStation = 0x1001;
  static constexpr int kMisses = 3;  ///< working counters of 0 until it does not answer
  static constexpr std::int64_t kSettleTimeNs = 10'000'000'000;

  SlaveMaster(const SlavePlan& plan, std::size_t position, const SlaveMapping& mapping);

  /// Begins, or begins again.
  void restart(std::int64_t now_ns) noexcept TANDEM_RT;
  /// Waits for restart().
  void rest() noexcept TANDEM_RT { stage_ = SlaveStage::kWait; }
  /// Once per cycle, after what has come was taken.
  void process(std::int64_t now_ns, Exchange& exchange,
               ClockReference& reference) noexcept TANDEM_RT;
  /// The frame whose time stamps it waited for has passed. @pre stage() == kWaitClock
  void clocks_latched(std::int64_t now_ns) noexcept TANDEM_RT;
  /// Whether it is in PREOP as its plan says, for transfers by sdo().
  [[nodiscard]] bool waiting() const noexcept {
    return stage_ == SlaveStage::kConfigure && plan_.waits_in_preop && !goes_on_;
  }
  /// Its PDOs are mapped: it may leave PREOP. @pre waiting()
  void go_on() noexcept TANDEM_RT { goes_on_ = true; }
  /// Lets it go to OP. @pre stage() == kReady, and its process data is exchanged every cycle
  void start(std::int64_t now_ns) noexcept TANDEM_RT;
  void fail(LineError error, std::int64_t now_ns) noexcept TANDEM_RT;
  /// Something is wrong in the line: looks whether it is this slave. @pre stage() == kRunning
  void look() noexcept TANDEM_RT;
  /// Reads how far its clock is off, when it has nothing else to do.
  void ask_difference() noexcept TANDEM_RT { difference_wanted_ = clock_.present(); }

  /// For transfers of others. @pre waiting(), or stage() == kReady or kRunning
  [[nodiscard]] CoeClient& sdo() noexcept { return coe_; }
  [[nodiscard]] SlaveStage stage() const noexcept { return stage_; }
  [[nodiscard]] bool running() const noexcept { return stage_ == SlaveStage::kRunning; }
  /// Whether its process data counts.
  [[nodiscard]] bool mapped() const noexcept {
    return stage_ >= SlaveStage::kReady && stage_ != SlaveStage::kDown;
  }
  [[nodiscard]] LineError error() const noexcept { return error_; }
  /// Whether it is down for what it is: another start finds the same.
  [[nodiscard]] bool hopeless() const noexcept;
  [[nodiscard]] std::int64_t trouble_time_ns() const noexcept { return trouble_ns_; }
  [[nodiscard]] const ethercat::sii::Content& content() const noexcept { return content_; }
  [[nodiscard]] ethercat::AlState wanted() const noexcept { return wanted_; }
  [[nodiscard]] canopen::AbortCode abort_code() const noexcept { return coe_.abort_code(); }
  [[nodiscard]] const CoeStep& step() const noexcept { return steps_[step_]; }
  [[nodiscard]] bool has_clock() const noexcept { return clock_.present(); }
  [[nodiscard]] const SlaveClock& clock() const noexcept { return clock_; }
  [[nodiscard]] std::uint16_t station() const noexcept { return station_; }
  [[nodiscard]] std::size_t position() const noexcept { return position_; }
  [[nodiscard]] const SlavePlan& plan() const noexcept { return plan_; }
  void archive(Archive& ar);
  /// Why it is down, in a sentence; empty when it is not. Not RT.
  [[nodiscard]] std::string text() const;

 private:
  using Data = std::span<const std::uint8_t>;

  void ask(std::int64_t now_ns, Exchange& exchange, const ClockReference& reference) noexcept;
  void ask_reset(Exchange& exchange) noexcept;
  void ask_sii(Exchange& exchange) noexcept;
  void ask_state(Exchange& exchange) noexcept;
  void ask_process_data(Exchange& exchange) noexcept;
  void ask_running(Exchange& exchange) noexcept;
  void take(const DatagramRequest& request, std::int64_t now_ns,
            ClockReference& reference) noexcept;
  void take_sii(Data data, std::int64_t now_ns) noexcept;
  void take_state(Data data, std::int64_t now_ns, SlaveStage next) noexcept;
  void take_running(Data data, std::int64_t now_ns) noexcept;
  void configure(std::int64_t now_ns, Exchange& exchange) noexcept;
  void missed(std::int64_t now_ns) noexcept;
  void read_sii_end(std::int64_t now_ns) noexcept;
  void enter(SlaveStage stage, std::int64_t now_ns) noexcept;
  void enter_state(SlaveStage stage, ethercat::AlState state, std::int64_t now_ns) noexcept;
  [[nodiscard]] bool find_memory() noexcept;
  void put_fmmus(std::span<std::uint8_t> out) const noexcept;

  SlavePlan plan_;
  std::size_t position_;
  SlaveMapping mapping_;
  std::vector<CoeStep> steps_;
  std::uint16_t station_;

  SlaveStage stage_ = SlaveStage::kWait;
  LineError error_ = LineError::kNone;
  int part_ = 0;  ///< of the stage
  int misses_ = 0;
  std::int64_t since_ns_ = 0;  ///< when the stage began
  std::int64_t trouble_ns_ = 0;
  bool state_written_ = false;
  bool look_wanted_ = false;
  bool difference_wanted_ = false;
  bool started_step_ = false;
  bool goes_on_ = false;
  ethercat::AlState wanted_ = ethercat::AlState::kInit;
  ethercat::AlState al_state_ = ethercat::AlState::kNone;
  ethercat::AlCode al_code_ = ethercat::AlCode::kNone;
  std::size_t step_ = 0;
  std::vector<std::uint8_t> sii_;
  std::size_t category_at_ = 0;  ///< bytes
  ethercat::sii::Content content_;
  std::uint16_t outputs_memory_ = 0;
  std::uint16_t inputs_memory_ = 0;
  SlaveClock clock_;
  CoeClient coe_;
};

}  // namespace tandem::hal::ecat
