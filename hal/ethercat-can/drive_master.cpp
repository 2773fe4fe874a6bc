// The cyclic part: frames in, whole samples only, state image; command image, frames out. The
// stages from bring-up to shut-down are in drive_master_stages.cpp.
#include "hal/ethercat-can/drive_master.hpp"

#include <algorithm>
#include <bit>
#include <utility>

#include "base/archive.hpp"
#include "canopen/messages.hpp"
#include "hal/ethercat-can/drive_master_impl.hpp"

namespace tandem::hal::can {

using canopen::Frame;
using canopen::PdoDirection;

namespace {

/// Cycles in succession with two answers of one node that are tolerated.
constexpr std::uint32_t kDoubledCycles = 10;

}  // namespace

void DriveMaster::Impl::begin(const CycleTime& time) noexcept TANDEM_RT {
  dt_ns = begun ? time.time_ns - now_ns : time.period_ns;
  now_ns = time.time_ns;
  if (!begun) {
    for (Node& node : nodes) {
      const int periods = node.timeout_cycles == 0 ? 0 : node.timeout_cycles + 1;
      node.master.set_times(time.period_ns, periods * time.period_ns);
      node.master.restart(now_ns);
    }
    for (Port& port : ports) port.next_heartbeat_ns = now_ns;
    started_ns = now_ns;
    begun = true;
  }
  ++counter;
  for (Port& port : ports) {
    port.sink.push(canopen::make_sync());
    if (port.heartbeat_ns == 0 || now_ns < port.next_heartbeat_ns) continue;
    port.sink.push(canopen::make_heartbeat(kMasterNodeId, canopen::NmtState::kOperational));
    const std::int64_t behind_ns = now_ns - port.next_heartbeat_ns;
    port.next_heartbeat_ns += (behind_ns / port.heartbeat_ns + 1) * port.heartbeat_ns;
  }
}

void DriveMaster::Impl::take_frames(Port& port) noexcept TANDEM_RT {
  for (std::size_t taken = 0; taken < kMaxFramesPerCycle;) {
    const std::size_t count = port.bus->receive(inbox);
    const std::span<const std::int64_t> times = port.bus->received_ns();
    for (std::size_t i = 0; i < count; ++i) {
      dispatch(port, inbox[i], i < times.size() ? times[i] : 0);
    }
    taken += count;
    if (count < inbox.size()) return;
  }
}

void DriveMaster::Impl::dispatch(Port& port, const Frame& frame,
                                 std::int64_t at_ns) noexcept TANDEM_RT {
  using namespace canopen;
  if (frame.id > cob::kIdMask || (frame.flags & (kFlagRtr | kFlagError)) != 0) return;
  const std::int16_t index = port.nodes[frame.id & 0x7F];
  if (index < 0) return;
  Node& node = nodes[static_cast<std::size_t>(index)];
  const std::uint32_t function = frame.id & 0x780;
  switch (function) {
    case cob::kEmergency: on_emergency(node, frame); break;
    case 0x180:
    case 0x280:
    case 0x380:
    case 0x480: on_tpdo(node, static_cast<int>(function >> 8), frame, at_ns); break;
    case cob::kSdoResponse: node.master.on_sdo(frame, port.sink); break;
    case cob::kHeartbeat:
      if (const auto message = parse_heartbeat(frame)) {
        node.master.on_heartbeat(message->state, now_ns);
      }
      break;
    default: break;
  }
}

/// The parts of a sample count only one after the other in one cycle: one that is late, or whose
/// predecessor is missing, is left out, so that no sample is made of two.
void DriveMaster::Impl::on_tpdo(Node& node, int number, const Frame& frame,
                                std::int64_t at_ns) noexcept TANDEM_RT {
  const Receive& pdo = node.receives[static_cast<std::size_t>(number - 1)];
  const bool listening = node.master.running() || node.master.stage() == NodeStage::kStarting;
  if (!pdo.in_use || !listening || frame.length < pdo.bytes) return;
  if (number == 1) ++node.answers;
  node.master.on_tpdo(now_ns);
  if (pdo.part >= 0) {
    if (pdo.part != 0 && pdo.part != node.next_part) return;
    node.next_part = pdo.part + 1;
  }
  const bool whole = node.next_part == node.plan.parts;
  for (const canopen::PdoCopy& copy : pdo.copies) copy.from_wire(frame.data.data());
  for (const std::size_t joint : pdo.joints) joint_fresh[joint] = whole ? 1 : 0;
  if (pdo.echo) on_echo(node, node.echo, at_ns);
  if (pdo.channels && whole) node.channels = node.sample;
}

void DriveMaster::Impl::on_echo(Node& node, std::uint8_t echo,
                                std::int64_t at_ns) noexcept TANDEM_RT {
  const auto trip = static_cast<std::uint8_t>(counter - echo);
  if (trip == 0 || trip > node.counters_sent) return;  // it has not had a command yet
  ++node.trip_cycles[std::min<std::size_t>(trip, RoundTrip::kMostCycles - 1)];
  const std::int64_t sent_ns = ports[node.plan.bus].sent_ns[echo];
  if (trip == 1 && sent_ns != 0 && at_ns > sent_ns) node.trip_time.record(at_ns - sent_ns);
}

/// Byte 3 is the axis on our boards, and the maker's own on others: without an axis of that number
/// it may be of any of them, and is kept for warnings().
void DriveMaster::Impl::on_emergency(Node& node, const Frame& frame) noexcept TANDEM_RT {
  const auto message = canopen::parse_emergency(frame);
  if (!message) return;
  const auto code = static_cast<std::uint16_t>(message->code);
  const bool of_axis = message->manufacturer[0] < node.plan.joints.size();
  const bool told = of_axis && !shutting_down;  // a robot that sinks at its end is no news
  for (std::size_t axis = 0; axis < node.plan.joints.size(); ++axis) {
    if (code == 0 || !of_axis || message->manufacturer[0] == axis) {
      axes[node.plan.joints[axis]].on_emergency(code, told);
    }
  }
  if (code == 0 || of_axis) return;
  ++node.emergencies;
  node.emergency = *message;
}

/// A late answer and the next may come in one cycle; time and again it is two nodes that answer.
void DriveMaster::Impl::watch_doubles(Node& node) noexcept TANDEM_RT {
  node.doubled_cycles = node.answers > 1 ? node.doubled_cycles + 1 : 0;
  node.answers = 0;
  if (node.master.running() && node.doubled_cycles > kDoubledCycles) {
    node.master.fail(FaultCause::kTwoBoards, now_ns);
  }
}

/// A board whose answers or heartbeats are lost may hear and move on: it stops by itself now, not
/// when it has missed its commands for long enough.
void DriveMaster::Impl::stop_when_lost(Node& node) noexcept TANDEM_RT {
  if (node.master.stage() != NodeStage::kDown || node.counters_sent == 0) return;
  node.counters_sent = 0;
  if (shutting_down || node.plan.board < 0) return;
  ports[node.plan.bus].sink.push(canopen::make_nmt(canopen::NmtCommand::kStop, node.plan.id));
}

void DriveMaster::Impl::process_nodes() noexcept TANDEM_RT {
  for (Node& node : nodes) {
    const bool waits = node.master.stage() == NodeStage::kWaitBootUp;
    if (waits && ports[node.plan.bus].bus->gives_up(node.plan.id)) {
      node.master.fail(FaultCause::kNoBootUp, now_ns);
    }
    node.master.process(now_ns, dt_ns, ports[node.plan.bus].sink);
    const bool complete =
        node.plan.board >= 0
            ? std::ranges::all_of(node.plan.joints, [&](auto j) { return joint_fresh[j] != 0; })
            : node.next_part == node.plan.parts;
    node.next_part = 0;
    watch_doubles(node);
    node.silent_cycles = complete ? 0 : node.silent_cycles + 1;
    if (!complete && stage == MasterStage::kRunning && !shutting_down) ++node.missed;
    // A node may tell that it runs before the SYNC that its first sample answers.
    node.unanswered = complete || !node.master.running() ? 0 : node.unanswered + 1;
    if (node.timeout_cycles == 0) continue;
    if (node.unanswered > static_cast<std::uint32_t>(node.timeout_cycles)) {
      node.master.fail(FaultCause::kBoardSilent, now_ns);
    }
  }
  for (Node& node : nodes) stop_when_lost(node);
  for (std::size_t joint = 0; joint < axes.size(); ++joint) {
    axes[joint].received(joint_fresh[joint] != 0, now_ns);
    joint_fresh[joint] = 0;
  }
}

void DriveMaster::Impl::fill(StateImage& state) noexcept TANDEM_RT {
  for (std::size_t joint = 0; joint < axes.size(); ++joint) axes[joint].fill(state, joint);
  for (const Node& node : nodes) {
    if (node.plan.sensor < 0) continue;
    const auto sensor = static_cast<std::size_t>(node.plan.sensor);
    for (std::size_t i = 0; i < node.channels.size(); ++i) {
      state.sensor()[node.first_channel + i] = static_cast<double>(node.channels[i]);
    }
    state.sensor_age_cycles()[sensor] = node.silent_cycles;
  }
}

void DriveMaster::Impl::write_pdos() noexcept TANDEM_RT {
  for (Node& node : nodes) {
    if (!node.master.running()) {
      node.counters_sent = 0;
      continue;
    }
    if (node.counters_sent < 0xFF) ++node.counters_sent;
    for (Send& pdo : node.sends) {
      const bool due = pdo.in_every_cycle || pdo.sent == 0 ||
                       std::ranges::any_of(pdo.copies, [&](const canopen::PdoCopy& copy) {
                         return copy.differs(pdo.frame.data.data());
                       });
      if (!due) continue;
      Frame* frame = ports[node.plan.bus].sink.next();
      if (frame == nullptr) continue;
      *frame = pdo.frame;
      for (const canopen::PdoCopy& copy : pdo.copies) copy.to_wire(frame->data.data());
      if (pdo.in_every_cycle) continue;
      for (const canopen::PdoCopy& copy : pdo.copies) copy.to_wire(pdo.frame.data.data());
      pdo.sent = 1;
    }
  }
}

bool DriveMaster::Impl::flush() noexcept TANDEM_RT {
  bool all = true;
  for (Port& port : ports) {
    const auto frames = port.sink.frames();
    if (!frames.empty()) {
      all = port.bus->send(frames) == frames.size() && all;
      port.sent_ns[counter] = port.bus->sent_ns();  // the commands are a cycle's last
    }
    port.sink.clear();
  }
  return all;
}

Code DriveMaster::Impl::receive_code() const noexcept TANDEM_RT {
  for (const Port& port : ports) {
    if (!usable(port.bus->state())) return Code::kBusOff;
  }
  if (stage == MasterStage::kFaulted || stage == MasterStage::kFailed) return Code::kFault;
  if (stage != MasterStage::kRunning) return Code::kOk;
  const bool silent = std::ranges::any_of(nodes, [](const Node& n) { return n.silent_cycles > 0; });
  return silent ? Code::kTimeout : Code::kOk;
}

DriveMaster::DriveMaster(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
DriveMaster::~DriveMaster() = default;

Result<std::unique_ptr<DriveMaster>> DriveMaster::create(const RobotConfig& robot,
                                                         std::span<Bus* const> buses) {
  if (buses.size() != robot.buses.size()) {
    return fail("the drive master was given " + std::to_string(buses.size()) + " buses for " +
                    std::to_string(robot.buses.size()) + " [[bus]] tables",
                "give one bus end per table, in the tables' order");
  }
  auto layout = make_pdo_layout(robot);
  if (!layout) return std::unexpected(layout.error());
  return std::unique_ptr<DriveMaster>(
      new DriveMaster(std::make_unique<Impl>(robot, std::move(*layout), buses)));
}

void DriveMaster::cycle_begin(const CycleTime& time) noexcept TANDEM_RT {
  impl_->begin(time);
  (void)impl_->flush();
}

Code DriveMaster::receive(StateImage& state) noexcept TANDEM_RT {
  Impl& m = *impl_;
  for (Impl::Port& port : m.ports) m.take_frames(port);
  m.process_nodes();
  if (!m.shutting_down) {
    m.advance();
    const bool braked = std::exchange(m.brakes, false);
    if (m.stage != Impl::MasterStage::kRunning && !(braked && m.holds())) {
      m.make_commands(nullptr);
      m.write_pdos();
    }
  }
  m.watch_stops();
  for (Impl::Node& node : m.nodes) m.ask_cause(node);
  (void)m.flush();
  m.fill(state);
  return m.receive_code();
}

Code DriveMaster::send(const CommandImage& command,
                       const ParameterImage& parameters) noexcept TANDEM_RT {
  Impl& m = *impl_;
  if (m.shutting_down) return Code::kOk;
  if (m.stage == Impl::MasterStage::kFailed) return Code::kFault;
  if (m.stage == Impl::MasterStage::kBooting || m.stage == Impl::MasterStage::kEnabling)
    return Code::kOk;
  m.take_resets(command);
  if (m.stage == Impl::MasterStage::kFaulted && !m.holds()) return Code::kFault;
  m.brakes = m.holds();
  m.make_commands(&command);
  m.write_pdos();
  for (Impl::Node& node : m.nodes) {
    if (m.stage != Impl::MasterStage::kRunning || !node.master.running() || node.asking >= 0)
      continue;
    node.gains.send(parameters, node.master.sdo(), m.ports[node.plan.bus].sink);
  }
  const bool taken = m.flush();
  if (m.stage == Impl::MasterStage::kFaulted) return Code::kFault;
  if (!taken) ++m.unsent;
  return taken ? Code::kOk : Code::kQueueFull;
}

FaultCause DriveMaster::fault_cause(std::size_t joint) const noexcept TANDEM_RT {
  return impl_->cause(joint);
}

bool DriveMaster::home(std::size_t joint) noexcept TANDEM_RT {
  Impl& m = *impl_;
  const auto& homing = m.robot.joints[joint].homing;
  if (!homing || m.stage != Impl::MasterStage::kRunning || m.shutting_down) return false;
  return m.axes[joint].home(static_cast<std::int64_t>(homing->timeout_s * 1e9), m.now_ns);
}

void DriveMaster::stop_homing(std::size_t joint) noexcept TANDEM_RT {
  impl_->axes[joint].stop_homing(impl_->now_ns);
}

Homing DriveMaster::homing(std::size_t joint) const noexcept TANDEM_RT {
  return impl_->axes[joint].homing();
}

void DriveMaster::stop(StopCategory category) noexcept TANDEM_RT { impl_->stop(category); }
void DriveMaster::reset() noexcept TANDEM_RT { impl_->reset(); }

bool DriveMaster::shut_down() noexcept TANDEM_RT {
  const bool done = impl_->shut_down();
  (void)impl_->flush();
  return done;
}

Phase DriveMaster::phase() const noexcept {
  if (impl_->resetting) return Phase::kBringUp;
  switch (impl_->stage) {
    case Impl::MasterStage::kBooting:
    case Impl::MasterStage::kEnabling: return Phase::kBringUp;
    case Impl::MasterStage::kRunning: return Phase::kOperational;
    case Impl::MasterStage::kFaulted:
    case Impl::MasterStage::kFailed: return Phase::kFault;
  }
  return Phase::kFault;
}

DriveMaster::NodeSet DriveMaster::answering(std::size_t bus) const noexcept TANDEM_RT {
  NodeSet nodes;
  for (const Impl::Node& node : impl_->nodes) {
    const bool starts = impl_->stage == Impl::MasterStage::kBooting && !node.plan.ethercat &&
                        node.master.stage() == NodeStage::kStarting;
    if (node.plan.bus == bus && (node.master.running() || starts)) {
      nodes.set(static_cast<std::size_t>(node.plan.id));
    }
  }
  return nodes;
}

std::size_t DriveMaster::completes(std::size_t bus, const Frame& frame) const noexcept TANDEM_RT {
  if (frame.id > canopen::cob::kIdMask) return 0;
  const std::size_t node = frame.id & 0x7F;
  return impl_->ports[bus].last_tpdo[node] == (frame.id & 0x780) ? node : 0;
}

std::string DriveMaster::status_text() const { return impl_->status(); }

std::vector<std::string> DriveMaster::warnings() const { return impl_->warnings(); }

std::vector<std::string> DriveMaster::wire_texts() const {
  std::vector<std::string> texts;
  for (std::size_t b = 0; b < impl_->ports.size(); ++b) {
    const std::string text = impl_->ports[b].bus->measured_text();
    if (!text.empty()) texts.push_back("bus " + impl_->robot.buses[b].name + ": " + text);
  }
  return texts;
}

const StartUp& DriveMaster::start_up() const noexcept { return impl_->start_up; }

std::vector<RoundTrip> DriveMaster::round_trips() const {
  std::vector<RoundTrip> trips;
  for (const Impl::Node& node : impl_->nodes) {
    if (node.plan.board < 0) continue;
    trips.push_back({.node = node.plan.name,
                     .bus = impl_->robot.buses[node.plan.bus].name,
                     .id = node.plan.id,
                     .cycles = node.trip_cycles,
                     .time = node.trip_time});
  }
  return trips;
}

void DriveMaster::archive(Archive& ar) { impl_->archive(ar); }

void DriveMaster::Impl::archive(Archive& ar) {
  ar(stage, reaction, brakes, latched, resetting, begun, shutting_down, counter, now_ns, dt_ns,
     shut_down_since_ns, axes);
  for (Port& port : ports) ar(port.next_heartbeat_ns);
  for (Node& node : nodes) {
    for (Send& pdo : node.sends) ar(pdo.frame, pdo.sent);
    ar(node.master, node.channels, node.silent_cycles, node.unanswered, node.doubled_cycles,
       node.counters_sent, node.recovering, node.asking, node.gains);
  }
}

}  // namespace tandem::hal::can
