// The master's view of one node: its way from reset to operation, and its heartbeat after that.
// Layer: hal/ethercat-can.  Thread: construction non-RT; the rest the loop's thread.
#pragma once

#include <cstdint>
#include <vector>

#include "base/realtime.hpp"
#include "canopen/messages.hpp"
#include "canopen/sdo.hpp"
#include "hal/ethercat-can/sdo_sequence.hpp"
#include "hal/stop_category.hpp"

namespace tandem::hal::can {

/// How far a node is brought up.
enum class NodeStage : std::uint8_t {
  kWaitBootUp,
  kConfigure,
  kReady,     ///< configured; start() lets it run
  kStarting,  ///< NMT start is sent
  kRunning,
  kDown,  ///< error() says why
};

/// Non-blocking: frames and time in, frames out, at most one SDO request per call.
class NodeMaster {
 public:
  static constexpr std::int64_t kSdoAnswerNs = 500'000'000;
  static constexpr int kSdoTries = 3;
  static constexpr std::int64_t kStoreNs = 5'000'000'000;  ///< until a drive has stored
  static constexpr int kReboots = 3;

  /// @param boot_time_ns  from a reset to the node's boot-up at most; after it the node is reset
  ///                      once more, after twice the time it is given up
  /// @param start_time_ns  from NMT start to operational at most
  NodeMaster(int id, int heartbeat_ms, std::int64_t boot_time_ns, NodeWatch watch,
             std::vector<SdoStep> steps, std::int64_t start_time_ns = 1'000'000'000);

  /// The values for the objects 60C2 (the period, see check_interpolation()) and 2052 (the
  /// time-out; 0: none). Before the first restart().
  void set_times(std::int64_t period_ns, std::int64_t sync_timeout_ns) noexcept TANDEM_RT;
  /// Begins, or begins again, with a reset of the node.
  void restart(std::int64_t now_ns) noexcept TANDEM_RT;
  void on_heartbeat(canopen::NmtState state, std::int64_t now_ns) noexcept TANDEM_RT;
  /// Its answer to a SYNC, which it gives in operation alone: where its heartbeat would come too
  /// late to tell that it has started.
  void on_tpdo(std::int64_t now_ns) noexcept TANDEM_RT;
  void on_sdo(const canopen::Frame& frame, canopen::FrameSink& out) noexcept TANDEM_RT;
  /// Once per cycle, after the cycle's frames.
  void process(std::int64_t now_ns, std::int64_t dt_ns, canopen::FrameSink& out) noexcept TANDEM_RT;
  /// NMT start. @pre stage() == kReady
  void start(std::int64_t now_ns, canopen::FrameSink& out) noexcept TANDEM_RT;
  /// Takes it out of operation with this error; nothing is sent.
  void fail(FaultCause error, std::int64_t now_ns) noexcept TANDEM_RT;

  /// The client for transfers at run time. @pre stage() == kRunning
  [[nodiscard]] canopen::SdoClient& sdo() noexcept { return sdo_; }

  [[nodiscard]] NodeStage stage() const noexcept { return stage_; }
  [[nodiscard]] bool running() const noexcept { return stage_ == NodeStage::kRunning; }
  [[nodiscard]] FaultCause error() const noexcept { return error_; }
  [[nodiscard]] std::int64_t trouble_time_ns() const noexcept { return trouble_ns_; }
  [[nodiscard]] canopen::NmtState nmt_state() const noexcept { return nmt_; }
  [[nodiscard]] canopen::AbortCode abort_code() const noexcept { return abort_code_; }
  /// Its configuration was there already, and was not written.
  [[nodiscard]] bool unchanged() const noexcept { return unchanged_; }
  /// Why it did not store its configuration; kNone: it did, or was not asked to.
  [[nodiscard]] canopen::AbortCode store_code() const noexcept { return store_code_; }
  /// What the failed check read.
  [[nodiscard]] std::uint32_t read_value() const noexcept { return read_value_; }
  [[nodiscard]] std::size_t step() const noexcept { return step_; }
  [[nodiscard]] const std::vector<SdoStep>& steps() const noexcept { return steps_; }

  void archive(Archive& ar);

 private:
  void configure(std::int64_t now_ns, std::int64_t dt_ns, canopen::FrameSink& out) noexcept;
  void step_answered(std::int64_t now_ns) noexcept;
  [[nodiscard]] bool step_passed(std::int64_t now_ns) noexcept;
  [[nodiscard]] bool skips(const SdoStep& step) const noexcept;
  void request(canopen::FrameSink& out) noexcept;
  void watch_heartbeat(std::int64_t now_ns) noexcept;
  void guard(std::int64_t now_ns, canopen::FrameSink& out) noexcept;
  void enter(NodeStage stage, std::int64_t now_ns) noexcept;

  int id_;
  std::int64_t heartbeat_timeout_ns_;
  std::int64_t boot_time_ns_;
  std::int64_t start_time_ns_;
  NodeWatch watch_;
  std::vector<SdoStep> steps_;

  NodeStage stage_ = NodeStage::kWaitBootUp;
  FaultCause error_ = FaultCause::kNone;
  canopen::NmtState nmt_ = canopen::NmtState::kBootUp;
  bool requested_ = false;  ///< the step's request is out
  bool unchanged_ = false;
  canopen::AbortCode store_code_ = canopen::AbortCode::kNone;
  int tries_ = 0;
  int reboots_ = 0;
  std::size_t step_ = 0;
  std::int64_t since_ns_ = 0;  ///< when the stage began
  std::int64_t next_reset_ns_ = 0;
  std::int64_t next_guard_ns_ = 0;
  std::int64_t heard_ns_ = 0;    ///< last heartbeat
  std::int64_t booted_ns_ = -1;  ///< last boot-up
  std::int64_t trouble_ns_ = 0;
  canopen::AbortCode abort_code_ = canopen::AbortCode::kNone;
  std::uint32_t read_value_ = 0;
  canopen::SdoClient sdo_;
};

}  // namespace tandem::hal::can
