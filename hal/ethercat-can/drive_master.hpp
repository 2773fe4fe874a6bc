// The master of every drive and sensor node: bring-up, cyclic exchange, supervision, shut-down.
// Layer: hal/ethercat-can.  Thread: create() non-RT; the rest the loop's thread.
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/realtime.hpp"
#include "base/result.hpp"
#include "hal/backend.hpp"
#include "hal/config/robot_config.hpp"
#include "hal/ethercat-can/bus.hpp"
#include "hal/homing.hpp"
#include "hal/image.hpp"
#include "rt/histogram.hpp"

namespace tandem {
class Archive;
}

namespace tandem::hal::can {

/// How long a board's answers to commands took since the start; its slow TPDO echoes the counter
/// of the command in force.
struct RoundTrip {
  static constexpr std::size_t kMostCycles = 16;

  std::string node;
  std::string bus;
  int id = 0;
  /// [i]: echoes that came i SYNCs after their command was sent; the last: that many or more.
  /// A command takes effect at the next SYNC and is answered in its cycle: 1 is on time.
  std::array<std::uint64_t, kMostCycles> cycles{};
  /// From handing the command over to its echo's arrival, where the bus knows its times. An echo
  /// that is older than a cycle is not in it.
  rt::Histogram time;
  /// From handing SYNC over to the arrival of the sample that it asked for, in the same cycle,
  /// where the bus knows its times. Sensor nodes have it, too.
  rt::Histogram answer;
};

/// How a node has answered so far.
struct NodeFigures {
  std::string node;
  std::size_t bus = 0;  ///< in RobotConfig::buses
  int id = 0;
  std::uint64_t missed = 0;  ///< cycles of operation without its whole sample
  std::uint64_t late = 0;  ///< echoes of commands that came a SYNC later than they should, or more
  rt::Percentiles answer;  ///< RoundTrip::answer's; all 0: not known
};

/// What the first start took, from the first cycle to the one in which every axis was enabled.
struct StartUp {
  std::int64_t duration_ns = 0;  ///< 0: not every axis was enabled yet
  std::size_t axes = 0;
  std::uint64_t sent = 0;      ///< frames, on all buses
  std::uint64_t received = 0;  ///< the same
};

/// Brings all nodes to operation at once, then exchanges the process image with them.
///
/// One cycle, in this order, from the first cycle to the last:
/// ```
/// master.cycle_begin(time);        // SYNC k and the heartbeat go out
/// …                                // in process: deliver frames, boards sample and answer
/// code = master.receive(state);    // decodes what has come; goes on with bring-up
/// code = master.send(command, parameters);
/// ```
/// SYNC k is sent at the start of cycle k; boards sample at it and their TPDOs are expected in
/// the same cycle; the RPDOs that cycle k sends take effect at SYNC k+1. What bring-up, a fault's
/// reaction and shut_down() have to send they send by themselves, whether send() is called or not.
/// A stop of category hold follows send()'s command as long as that brakes (AxisMaster::kHold).
///
/// Bring-up of every node, all in parallel: reset, boot-up, identity (1000, 1018), configuration
/// by SDO (scales, limits, gains, PDO mapping, heartbeats), NMT start; when all nodes run, each
/// axis walks to Operation Enabled in CSP with its own measured position as target, so that
/// nothing moves. A node or axis that does not follow in time ends it with Phase::kFault.
///
/// In operation a fault latches per joint, with cause and time, and the stop category of the
/// joints concerned is carried out: 0 opens every bridge, 1 quick-stops every axis, hold keeps
/// every healthy axis at its position, warn only reports. stop() latches the same without a fault.
/// reset() clears all of it: drives are reset, a board that was lost is configured anew, and every
/// axis is enabled at its measured position. CommandImage::fault_reset does that for one joint, but
/// leaves what stop() latched.
class DriveMaster {
 public:
  /// @param robot  complete: limits filled in from the description.
  /// @param buses  the master's end of each of robot.buses, in that order; outlive the master.
  /// Errors: those of make_pdo_layout().
  [[nodiscard]] static Result<std::unique_ptr<DriveMaster>> create(const RobotConfig& robot,
                                                                   std::span<Bus* const> buses);
  ~DriveMaster();
  DriveMaster(const DriveMaster&) = delete;
  DriveMaster& operator=(const DriveMaster&) = delete;

  /// Sends SYNC, and the master's heartbeat when it is due. Cycles may be left out (an overrun):
  /// time-outs go by `time.time_ns`.
  void cycle_begin(const CycleTime& time) noexcept TANDEM_RT;

  /// Takes every frame that has arrived and fills the whole of `state` but cycle and time.
  /// A joint whose TPDO did not come keeps its values and ages by a cycle.
  /// @return kOk; kTimeout (in operation: a node missed this cycle); kBusOff; kFault.
  /// @rt no allocation; O(nodes + frames), at most kMaxFramesPerCycle per bus.
  Code receive(StateImage& state) noexcept TANDEM_RT;

  /// Operation: encodes the command, clamped to the wire's range, and sends at most one parameter
  /// per node that has changed. During bring-up: nothing. In a fault: only looks for resets.
  /// @return kOk, kQueueFull (the bus did not take all), kFault.
  Code send(const CommandImage& command, const ParameterImage& parameters) noexcept TANDEM_RT;

  /// Latches a stop, and sends it at once. kWarn: nothing. During bring-up: ends it.
  void stop(StopCategory category) noexcept TANDEM_RT;
  /// Clears every latched fault and stop, and enables every axis again. phase() is kBringUp until
  /// they are, or until one cannot be. Without effect after a bring-up that failed.
  void reset() noexcept TANDEM_RT;

  /// Begins the homing of a joint that follows its command: mode 6, bit 4. Meanwhile, and until the
  /// command has had the joint idle and then not any more, the joint does not follow it. A fault
  /// and a stop end it.
  /// @return false: not in operation, or the joint has no homing, or does not follow
  bool home(std::size_t joint) noexcept TANDEM_RT;
  /// Halts it; the joint stays where it comes to rest, and is not homed.
  void stop_homing(std::size_t joint) noexcept TANDEM_RT;
  [[nodiscard]] Homing homing(std::size_t joint) const noexcept TANDEM_RT;

  /// Category 1: quick stop, then disabled, then NMT pre-operational. Once per cycle instead of
  /// send(), until it answers true.
  [[nodiscard]] bool shut_down() noexcept TANDEM_RT;

  [[nodiscard]] Phase phase() const noexcept;
  [[nodiscard]] FaultCause fault_cause(std::size_t joint) const noexcept TANDEM_RT;
  /// A drive's error code: "following error (error code 0x8611)".
  [[nodiscard]] static std::string error_text(std::uint32_t code);
  /// By node-ID.
  using NodeSet = std::bitset<128>;
  /// Nodes on bus `bus` whose answer to the next SYNC is worth waiting for: those in operation, and
  /// at the first start those on CAN that were told to start.
  [[nodiscard]] NodeSet answering(std::size_t bus) const noexcept TANDEM_RT;
  /// The node on bus `bus` whose answer to SYNC is whole with `frame`, the last TPDO of its sample;
  /// 0: nobody's.
  [[nodiscard]] std::size_t completes(std::size_t bus,
                                      const canopen::Frame& frame) const noexcept TANDEM_RT;
  /// What bring-up waits for, or the cause of a fault: names node, board, joint and object.
  [[nodiscard]] std::string status_text() const;

  /// What went wrong and was tolerated, a sentence each: feedback that did not come, counted by
  /// node; commands that a bus did not take; the last gain that a board refused, with the object
  /// and why. Empty when nothing did. Not RT.
  [[nodiscard]] std::vector<std::string> warnings() const;

  /// "bus line: …" of every bus that has something to tell of its wire. Not RT.
  [[nodiscard]] std::vector<std::string> wire_texts() const;
  /// A measurement, no state: not in a snapshot.
  [[nodiscard]] const StartUp& start_up() const noexcept;
  /// Round trips of every board, in the configuration's order. A measurement, no state: not in a
  /// snapshot. Not RT.
  [[nodiscard]] std::vector<RoundTrip> round_trips() const;
  /// Every node, in the layout's order. Any thread, beside the loop. Not RT.
  [[nodiscard]] std::vector<NodeFigures> node_figures() const;

  void archive(Archive& ar);

 private:
  struct Impl;
  explicit DriveMaster(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::hal::can
