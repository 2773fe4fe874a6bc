// The cyclic part: frames in, whole samples only, state image; command image, frames out. The
// stages from bring-up to shut-down are in drive_master_stages.cpp.
#include "hal/ethercat-can/drive_master.hpp"

#include <algorithm>
#include <utility>

#include "base/archive.hpp"
#include "base/seen_count.hpp"
#include "canopen/messages.hpp"
#include "hal/ethercat-can/drive_master_impl.hpp"

namespace tandem::hal::can {

using canopen::Frame;

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
    case 0x480: {
      const bool listening = node.master.running() || node.master.stage() == NodeStage::kStarting;
      const auto number = static_cast<int>(function >> 8);
      if (listening && node.exchange.take(number, frame, at_ns, joint_fresh)) {
        node.master.on_tpdo(now_ns);
      }
      break;
    }
    case cob::kSdoResponse: node.master.on_sdo(frame, port.sink); break;
    case cob::kHeartbeat:
      if (const auto message = parse_heartbeat(frame)) {
        node.master.on_heartbeat(message->state, now_ns);
      }
      break;
    default: break;
  }
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

/// A board whose answers or heartbeats are lost may hear and move on: it stops by itself now, not
/// when it has missed its commands for long enough.
void DriveMaster::Impl::stop_when_lost(Node& node) noexcept TANDEM_RT {
  if (node.master.stage() != NodeStage::kDown || !node.exchange.end_commands()) return;
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
    const bool complete = node.exchange.end_cycle(joint_fresh);
    if (node.master.running() && node.exchange.doubled()) {
      node.master.fail(FaultCause::kTwoBoards, now_ns);
    }
    if (!complete && stage == MasterStage::kRunning && !shutting_down) count_up(node.missed);
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
    std::ranges::copy(node.exchange.channels(), state.sensor().subspan(node.first_channel).begin());
    state.sensor_age_cycles()[sensor] = node.exchange.silent_cycles();
  }
}

void DriveMaster::Impl::write_pdos() noexcept TANDEM_RT {
  for (Node& node : nodes) {
    if (node.master.running()) {
      node.exchange.write(ports[node.plan.bus].sink);
    } else {
      (void)node.exchange.end_commands();
    }
  }
}

/// A fault whose cause no PDO tells: 603F has it, and on EtherCAT the emergency that waits in the
/// mailbox comes first.
void DriveMaster::Impl::ask_cause(Node& node) noexcept TANDEM_RT {
  canopen::SdoClient& sdo = node.master.sdo();
  if (!node.master.running()) {
    node.asking = -1;
    return;
  }
  if (sdo.status() == canopen::SdoClient::Status::kBusy) return;
  if (node.asking >= 0) {
    const std::size_t joint = node.plan.joints[static_cast<std::size_t>(node.asking)];
    node.asking = -1;
    const bool read = sdo.status() == canopen::SdoClient::Status::kDone && sdo.value().size() >= 2;
    if (read) axes[joint].take_cause(canopen::get<std::uint16_t>(sdo.value().data()));
  }
  for (std::size_t axis = 0; axis < node.plan.joints.size(); ++axis) {
    AxisMaster& asked = axes[node.plan.joints[axis]];
    if (!asked.wants_cause()) continue;
    asked.cause_asked();
    node.asking = static_cast<std::int16_t>(axis);
    node.gains.give_way();
    sdo.upload(canopen::of_axis(canopen::object::kErrorCode, static_cast<int>(axis)), 0,
               ports[node.plan.bus].sink);
    return;
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
  const bool silent =
      std::ranges::any_of(nodes, [](const Node& n) { return n.exchange.silent_cycles() > 0; });
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
    const bool idle = node.master.running() && node.asking < 0;
    if (m.stage != Impl::MasterStage::kRunning || !idle) continue;
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
                     .cycles = node.exchange.round_trip().cycles,
                     .time = node.exchange.round_trip().time,
                     .answer = node.exchange.round_trip().answer});
  }
  return trips;
}

std::vector<NodeFigures> DriveMaster::node_figures() const {
  std::vector<NodeFigures> all;
  for (const Impl::Node& node : impl_->nodes) {
    const RoundTrip& trip = node.exchange.round_trip();
    NodeFigures& one = all.emplace_back(NodeFigures{.node = node.plan.name,
                                                    .bus = node.plan.bus,
                                                    .id = node.plan.id,
                                                    .missed = seen(node.missed),
                                                    .answer = trip.answer.percentiles()});
    for (std::size_t i = 2; i < trip.cycles.size(); ++i) one.late += seen(trip.cycles[i]);
  }
  return all;
}

void DriveMaster::archive(Archive& ar) {
  Impl& m = *impl_;
  ar(m.stage, m.reaction, m.brakes, m.latched, m.resetting, m.begun, m.shutting_down, m.counter,
     m.now_ns, m.dt_ns, m.shut_down_since_ns, m.axes);
  for (Impl::Port& port : m.ports) ar(port.next_heartbeat_ns);
  for (Impl::Node& node : m.nodes) {
    ar(node.master, node.exchange, node.gains, node.unanswered, node.recovering, node.asking);
    ar(node.missed, node.emergencies, node.emergency);
  }
  ar(m.unsent);
}

}  // namespace tandem::hal::can
