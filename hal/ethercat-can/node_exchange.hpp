// What a node and the master exchange every cycle: its PDOs as lists of copies, whole samples only.
// Layer: hal/ethercat-can.  Thread: connect() non-RT; the rest the loop's.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "base/realtime.hpp"
#include "canopen/frame.hpp"
#include "canopen/pdo_copy.hpp"
#include "hal/ethercat-can/axis_master.hpp"
#include "hal/ethercat-can/drive_master.hpp"
#include "hal/ethercat-can/pdo_layout.hpp"

namespace tandem::hal::can {

class NodeExchange {
 public:
  using SentTimes = std::array<std::int64_t, 256>;  ///< by counter

  /// Finds the variable behind every field of the node's PDOs. What is passed and the exchange
  /// itself keep their places from now on.
  /// @param axes     by joint
  /// @param counter  of SYNCs; goes out with the commands
  /// @param sent_ns  when a counter's commands were handed over
  void connect(const NodePlan& plan, std::span<AxisMaster> axes, std::uint8_t& counter,
               const SentTimes& sent_ns);

  /// The parts of a sample count only one after the other in one cycle: one that is late, or whose
  /// predecessor is missing, is left out, so that no sample is made of two.
  /// @param fresh  by joint: a whole sample came in this cycle
  /// @return false: not a TPDO of the node's
  bool take(int number, const canopen::Frame& frame, std::int64_t at_ns,
            std::span<std::uint8_t> fresh) noexcept TANDEM_RT;
  /// Once a cycle, after its frames. @return whether every axis', or the sensor's, sample is whole
  bool end_cycle(std::span<const std::uint8_t> fresh) noexcept TANDEM_RT;
  /// Sends what is due.
  void write(canopen::FrameSink& out) noexcept TANDEM_RT;
  /// The node is not in operation. @return whether it has had commands since its start
  bool end_commands() noexcept TANDEM_RT {
    return std::exchange(counters_sent_, std::uint8_t{0}) != 0;
  }
  /// It is configured anew: what is sent when it changes is sent.
  void restart() noexcept TANDEM_RT {
    for (Send& pdo : sends_) pdo.sent = 0;
  }

  /// A late answer and the next may come in one cycle; time and again it is two nodes that answer.
  [[nodiscard]] bool doubled() const noexcept TANDEM_RT { return doubled_cycles_ > kDoubledCycles; }
  /// Without a whole sample.
  [[nodiscard]] std::uint32_t silent_cycles() const noexcept TANDEM_RT { return silent_cycles_; }
  /// A sensor's.
  [[nodiscard]] std::span<const float> channels() const noexcept TANDEM_RT { return channels_; }
  /// Its measurements alone.
  [[nodiscard]] const RoundTrip& round_trip() const noexcept { return trip_; }

  void archive(Archive& ar);

 private:
  /// Cycles in succession with two answers that are tolerated.
  static constexpr std::uint32_t kDoubledCycles = 10;
  /// An RPDO's plan, compiled.
  struct Send {
    canopen::Frame frame;  ///< identifier and length; of what is sent when it changes, the last one
    std::vector<canopen::PdoCopy> storage{};
    canopen::PdoCopies copies{};
    bool in_every_cycle = true;
    std::uint8_t sent = 0;  ///< since the node's start; of what is sent when it changes
  };
  /// A TPDO's.
  struct Receive {
    std::vector<canopen::PdoCopy> storage{};
    canopen::PdoCopies copies{};
    std::vector<std::size_t> joints{};  ///< of a sample: whose
    bool in_use = false;
    bool echo = false;       ///< one of the copies is echo_
    bool channels = false;   ///< they are a sensor's
    std::uint8_t bytes = 0;  ///< mapped
    int part = -1;           ///< of the NodePlan::parts of a sample; -1: of none
  };

  [[nodiscard]] Receive compile(const PdoPlan& pdo, std::vector<canopen::PdoCopy> copies) const;
  void on_echo(std::int64_t at_ns) noexcept TANDEM_RT;
  void on_sample(std::int64_t at_ns) noexcept TANDEM_RT;

  const NodePlan* plan_ = nullptr;
  const std::uint8_t* counter_ = nullptr;
  const SentTimes* sent_ns_ = nullptr;
  std::vector<Send> sends_;                                ///< in the plan's order
  std::array<Receive, canopen::kPdosPerNode> receives_{};  ///< by number - 1
  std::vector<float> channels_;
  std::vector<float> sample_;  ///< of them, while it is not whole; no state
  int next_part_ = 0;          ///< of this cycle's sample
  std::uint32_t silent_cycles_ = 0;
  std::uint32_t answers_ = 0;         ///< this cycle's first TPDOs
  std::uint32_t doubled_cycles_ = 0;  ///< in succession, with several of them
  std::uint8_t counters_sent_ = 0;    ///< since the node's start; stays at 255
  std::uint8_t echo_ = 0;             ///< the counter that came last; no state
  RoundTrip trip_;                    ///< no state
};

}  // namespace tandem::hal::can
