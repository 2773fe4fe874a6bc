// The step's frames on their way out: to the master, heartbeats also to the other nodes; when [sim]
// bus_timing is on each takes its time in a WireModel per bus.
#include <algorithm>

#include "hal/sim/emulated_robot.hpp"

namespace tandem::sim {
namespace {

constexpr std::size_t kWireCapacity = 128;  // frames that a node has ready

}  // namespace

void EmulatedRobot::add_wires(const hal::RobotConfig& robot, const SimRobotConfig& config) {
  for (const hal::BusConfig& bus : robot.buses) {
    const hal::can::BitRates rates{.nominal = bus.bitrate, .data = bus.data_bitrate};
    wires_.push_back(
        {hal::can::WireModel(rates, other_sender() + 1, config.bus_latency_ns, kWireCapacity)});
  }
}

/// The master's frames of the cycle before, then SYNC: before the time of the step goes by.
void EmulatedRobot::load_wires(std::int64_t time_ns) noexcept {
  const std::int64_t before_ns = std::min(now_ns_ + answer_window_ns_, time_ns);
  for (std::size_t b = 0; b < wires_.size(); ++b) {
    Wire& wire = wires_[b];
    const std::span<const canopen::Frame> waiting = buses_[b]->to_boards();
    const std::size_t count = up_to_sync(waiting);
    bool synced = false;
    for (const canopen::Frame& frame : waiting.first(count)) {
      synced = synced || is_sync(frame);
      const bool taken = wire.model.push(kMasterSender, frame, synced ? time_ns : before_ns);
      if (taken && is_sync(frame)) wire.sync_waits = 1;
    }
    buses_[b]->take_to_boards(count);
  }
}

/// What is complete by then reaches its receivers; with `to_sync` no more than SYNC, whose time the
/// nodes' answers have.
void EmulatedRobot::carry(std::size_t bus, std::int64_t until_ns, bool to_sync) noexcept {
  Wire& wire = wires_[bus];
  hal::can::WireModel::Delivery delivery;
  while (wire.model.next(until_ns, delivery)) {
    if (delivery.sender != kMasterSender) {
      (void)buses_[bus]->boards().send({&delivery.frame, 1});
      pass_heartbeat(bus, delivery.frame);
      continue;
    }
    pass_to_boards(bus, delivery.frame);
    if (!is_sync(delivery.frame)) continue;
    wire.sync_waits = 0;
    wire.answers_ns = std::max(wire.answers_ns, delivery.complete_ns);
    if (to_sync) return;
  }
}

/// What a node has to say goes to the master: at once, or over the wire.
void EmulatedRobot::put_out(std::size_t bus, std::size_t sender,
                            std::span<const canopen::Frame> frames) noexcept {
  if (wires_.empty()) {
    (void)buses_[bus]->boards().send(frames);
    for (const canopen::Frame& frame : frames) pass_heartbeat(bus, frame);
    return;
  }
  Wire& wire = wires_[bus];
  for (const canopen::Frame& frame : frames) {
    (void)wire.model.push(sender, frame, wire.answers_ns);
  }
}

/// The other nodes of a bus hear a node's heartbeat: their 1016 may name it.
void EmulatedRobot::pass_heartbeat(std::size_t bus, const canopen::Frame& frame) noexcept {
  constexpr std::uint32_t kNodeBits = 0x7F;
  if ((frame.id & ~kNodeBits) != canopen::cob::kHeartbeat) return;
  const auto from = static_cast<int>(frame.id & kNodeBits);
  for (const std::size_t b : attached_[bus].boards) {
    const bool hears = boards_[b].powered != 0 && boards_[b].board->node_id() != from;
    if (hears) boards_[b].board->receive(frame);
  }
  for (const std::size_t s : attached_[bus].sensors) {
    const bool hears = sensor_nodes_[s].powered != 0 && sensor_nodes_[s].board->node_id() != from;
    if (hears) sensor_nodes_[s].board->receive(frame);
  }
}

}  // namespace tandem::sim
