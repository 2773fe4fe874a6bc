// Ethernet frames pass through the slaves in order; the boards hear of it once a cycle.
#include "hal/sim/line_boards.hpp"

#include <algorithm>

#include "base/split_mix.hpp"
#include "canopen/drive_abilities.hpp"
#include "canopen/messages.hpp"
#include "ethercat/datagram.hpp"

namespace tandem::sim {

using canopen::Frame;
using ethercat::AlState;
using firmware::esc::BoardData;

namespace {

constexpr std::size_t kFramesAtOnce = 64;
constexpr std::size_t kOwnObjects = 16;  // besides those of PDOs
constexpr double kWorstDrift_ppm = 20.0;
constexpr std::int64_t kJitterNs = 10;
constexpr std::int64_t kSilenceNs = 100'000'000;  // as the watchdog of the outputs

/// What the node's own object 1018 says; 0 where its sheet has no such entry.
std::uint32_t identity(const canopen::ObjectDictionary& dictionary, canopen::IdentitySub sub) {
  const auto entry = static_cast<std::uint8_t>(sub);
  const bool there = dictionary.find(canopen::object::kIdentity, entry) != nullptr;
  return there ? dictionary.value<std::uint32_t>(canopen::object::kIdentity, entry) : 0;
}

}  // namespace

LineBoards::LineBoards(EmulatedRobot& robot, std::size_t bus, hal::ecat::DataLink& link,
                       const Config& config)
    : robot_(&robot),
      bus_(bus),
      link_(&link),
      config_(config),
      came_(kFramesAtOnce),
      back_(kFramesAtOnce),
      storage_(),
      inbox_(storage_) {
  std::vector<EmulatedRobot::Node> nodes = robot.nodes(bus);
  std::ranges::sort(nodes, {}, &EmulatedRobot::Node::id);
  for (const EmulatedRobot::Node& node : nodes) add_seat(node, config);
  std::vector<firmware::esc::Slave*> slaves;
  for (const Seat& seat : seats_) slaves.push_back(seat.slave.get());
  line_ = std::make_unique<firmware::esc::SlaveLine>(std::move(slaves));
  storage_.resize(seats_.size() * (2 + canopen::kPdosPerNode) + 2);
  inbox_ = canopen::FrameSink(storage_);
}

void LineBoards::add_seat(const EmulatedRobot::Node& node, const Config& config) {
  Seat& seat = seats_.emplace_back();
  seat.node = node;
  using Way = firmware::esc::ProcessDirection;
  const auto pdos = [&](Way way) {
    return firmware::esc::power_on_pdos(way, node.sheet, *node.dictionary);
  };
  const std::vector<firmware::esc::PdoSetup> out = pdos(Way::kOutputs);
  const std::vector<firmware::esc::PdoSetup> in = pdos(Way::kInputs);
  seat.objects = std::make_unique<canopen::ObjectDictionary>(kOwnObjects + BoardData::objects(out) +
                                                             BoardData::objects(in));
  const auto data = [&](Way way, std::span<const firmware::esc::PdoSetup> of) {
    const std::uint16_t assignment = firmware::esc::assignment_object(way);
    const bool assigns = node.sheet == nullptr || !node.sheet->has(assignment) ||
                         canopen::writable(*node.sheet, assignment, 0);
    return std::make_unique<BoardData>(way, of, assigns, *node.dictionary, node.id);
  };
  auto outputs = data(Way::kOutputs, out);
  auto inputs = data(Way::kInputs, in);
  seat.outputs = outputs.get();
  seat.inputs = inputs.get();
  std::uint64_t random = config.seed + static_cast<std::uint64_t>(node.id);
  const double unit = static_cast<double>(split_mix(random) >> 11) * 0x1p-53;
  const firmware::esc::SlaveSetup setup{
      .identity = {.vendor = ethercat::sii::kNobodysVendor,
                   .product = identity(*node.dictionary, canopen::kProduct),
                   .revision = identity(*node.dictionary, canopen::kRevision)},
      .name = node.name,
      .outputs = out,
      .inputs = in,
      .clock = {.drift_ppm = kWorstDrift_ppm * (2.0 * unit - 1.0),
                .jitter_ns = kJitterNs,
                .started_ns = static_cast<std::int64_t>(split_mix(random) >> 34),
                .seed = split_mix(random)}};
  seat.slave = std::make_unique<firmware::esc::Slave>(setup, *seat.objects, *node.dictionary,
                                                      std::move(outputs), std::move(inputs));
}

std::size_t LineBoards::receive(std::span<Frame> frames) noexcept TANDEM_RT {
  if (!in_cycle_) fetch();
  const std::span<const Frame> waiting = inbox_.frames().subspan(given_);
  const std::size_t count = std::min(frames.size(), waiting.size());
  std::copy_n(waiting.begin(), count, frames.begin());
  given_ += count;
  if (given_ == inbox_.frames().size()) {
    inbox_.clear();
    given_ = 0;
  }
  return count;
}

/// Takes frames, and lets them pass up to one that begins a cycle.
void LineBoards::fetch() noexcept {
  if (first_ == count_) {
    first_ = 0;
    count_ = link_->receive(came_);
  }
  if (config_.clock != nullptr) now_ns_ = config_.clock->now_ns();
  pass();
  if (first_ == count_) return;
  in_cycle_ = true;
  begin_cycle();
}

/// A cycle's frames have one index, and logical addresses that go up. A frame that is sent again
/// has the same.
bool LineBoards::begins_cycle(hal::ecat::FrameBuffer& frame) noexcept {
  ethercat::FrameReader reader(frame.frame());
  ethercat::Datagram datagram;
  while (reader.next(datagram)) {
    const bool reads = datagram.command() == ethercat::Command::kLrw ||
                       datagram.command() == ethercat::Command::kLrd;
    if (!reads) continue;
    const bool fresh = datagram.index() != cycle_index_;
    cycle_index_ = datagram.index();
    return fresh;
  }
  return false;
}

/// Up to the next cycle's frame; what comes back is sent.
void LineBoards::pass() noexcept {
  back_count_ = 0;
  if (in_cycle_ && late_.size != 0) {
    put_back(late_);
    late_.size = 0;
  }
  for (; first_ < count_; ++first_) {
    if (takes_order(came_[first_])) continue;
    if (!in_cycle_ && begins_cycle(came_[first_])) break;
    in_cycle_ = false;
    pass(came_[first_]);
  }
  if (back_count_ > 0) (void)link_->send(std::span(back_).first(back_count_));
}

/// In lockstep an order about the past is the emulator's: what came before it has passed.
bool LineBoards::takes_order(hal::ecat::FrameBuffer& frame) noexcept {
  if (config_.clock != nullptr) return false;
  const auto order = hal::ecat::parse_nop_frame(frame);
  if (!order || order->id != canopen::cob::kPastOrder) return false;
  std::copy_n(frame.bytes.begin() + 6, master_.size(), master_.begin());
  master_[0] |= ethercat::kProcessedMark;
  inbox_.push(*order);
  return true;
}

void LineBoards::pass(hal::ecat::FrameBuffer& frame) noexcept {
  using hal::FaultKind;
  FaultInjection& faults = robot_->injection();
  const auto fate = [&](FrameDirection direction) {
    return faults.any() ? faults.fate(direction, bus_) : FaultKind::kNone;
  };
  const FaultKind out = fate(FrameDirection::kToBoards);
  if (out == FaultKind::kFrameDrop || !line_->pass(frame.frame(), now_ns_)) return;
  if (out == FaultKind::kFrameDuplicate) put_back(frame);
  const FaultKind back = fate(FrameDirection::kToMaster);
  if (back == FaultKind::kFrameDrop) return;
  if (back == FaultKind::kFrameDuplicate) put_back(frame);
  if (out == FaultKind::kFrameDelay || back == FaultKind::kFrameDelay) {
    late_ = frame;
    return;
  }
  put_back(frame);
}

void LineBoards::put_back(const hal::ecat::FrameBuffer& frame) noexcept {
  if (back_count_ == back_.size()) return;
  back_[back_count_].size = frame.size;
  std::copy_n(frame.bytes.begin(), frame.size, back_[back_count_++].bytes.begin());
}

/// A cable leads to the board that a fault names, or to the first slave.
void LineBoards::set_cables() noexcept {
  for (std::size_t place = 0; place < seats_.size(); ++place) {
    const bool cut = std::ranges::any_of(robot_->injection().slots(), [&](const FaultSlot& slot) {
      const bool here = slot.active != 0 && slot.fault.kind == hal::FaultKind::kBusDown &&
                        static_cast<std::size_t>(slot.fault.bus) == bus_;
      const bool first = slot.fault.board < 0;
      return here && (first ? place == 0 : seats_[place].node.board == slot.fault.board);
    });
    line_->set_cable(place, !cut);
  }
}

void LineBoards::begin_cycle() noexcept {
  now_ns_ = config_.clock != nullptr ? config_.clock->now_ns() : now_ns_ + config_.period_ns;
  cycle_ns_ = now_ns_;
  if (robot_->injection().any()) set_cables();
  for (std::size_t place = 0; place < seats_.size(); ++place) run(seats_[place], place);
  inbox_.push(canopen::make_sync());
}

void LineBoards::run(Seat& seat, std::size_t place) noexcept {
  line_->set_power(place, *seat.node.powered != 0, now_ns_);
  if (*seat.node.powered == 0) return;
  seat.slave->process(now_ns_);
  tell_state(seat);
  if (!seat.outputs->fresh() || seat.slave->state() != AlState::kOp) return;
  for (const BoardData::Part& part : seat.outputs->parts()) {
    inbox_.push(seat.outputs->frame_of(part));
  }
}

void LineBoards::tell_state(Seat& seat) noexcept {
  using canopen::NmtCommand;
  const AlState before = std::exchange(seat.state, seat.slave->state());
  if (before == seat.state) return;
  const auto tell = [&](NmtCommand command) {
    inbox_.push(canopen::make_nmt(command, seat.node.id));
  };
  if (seat.state == AlState::kInit) {
    tell(NmtCommand::kResetNode);
  } else if (seat.state == AlState::kOp) {
    tell(NmtCommand::kStart);
  } else if (before == AlState::kOp) {
    tell(NmtCommand::kEnterPreOperational);
  }
}

std::size_t LineBoards::send(std::span<const Frame> frames) noexcept TANDEM_RT {
  for (const Frame& frame : frames) {
    if (frame.id == canopen::cob::kPastAnswer) {
      hal::ecat::make_nop_frame(frame, master_, answer_);
      (void)link_->send({&answer_, 1});
      continue;
    }
    const std::size_t place = (frame.id & 0x7F) - 1;
    if (place >= seats_.size()) continue;
    if ((frame.id & 0x780) == canopen::cob::kHeartbeat) watch_boot_up(seats_[place], frame);
    for (const BoardData::Part& part : seats_[place].inputs->parts()) {
      if (part.cob_id != frame.id || frame.length < part.bytes) continue;
      seats_[place].inputs->take_frame(part, frame);
    }
  }
  return frames.size();
}

/// A board that booted by itself takes its slave along.
void LineBoards::watch_boot_up(Seat& seat, const Frame& frame) noexcept {
  const auto message = canopen::parse_heartbeat(frame);
  const bool boots = message && message->state == canopen::NmtState::kBootUp;
  if (!boots || seat.slave->state() < AlState::kSafeOp) return;
  seat.slave->fail(AlState::kInit, ethercat::AlCode::kUnspecified);
  seat.state = AlState::kInit;
}

/// On a wire, slaves also serve a master that has no process data: who scans, looks at clocks, or
/// has just ended with INIT. Between two cycles of a running one they are left alone.
void LineBoards::idle() noexcept {
  if (config_.clock == nullptr) return;
  for (Seat& seat : seats_) {
    const bool alone = seat.slave->state() < AlState::kSafeOp || now_ns_ - cycle_ns_ > kSilenceNs;
    if (alone && *seat.node.powered != 0) seat.slave->process(now_ns_);
  }
}

void LineBoards::end_step() noexcept TANDEM_RT {
  if (!in_cycle_) return idle();
  for (Seat& seat : seats_) {
    if (*seat.node.powered != 0) seat.slave->publish();
  }
  pass();
  for (Seat& seat : seats_) {  // what the cycle's messages ask for
    if (*seat.node.powered != 0) seat.slave->process(now_ns_);
  }
}

void LineBoards::archive(Archive& ar) {
  ar(*line_, in_cycle_, cycle_index_, now_ns_, late_.size);
  late_.size = std::min(late_.size, late_.bytes.size());
  ar.raw(late_.bytes.data(), late_.size);
  for (Seat& seat : seats_) ar(seat.state);
  if (!ar.reading()) return;
  first_ = count_ = given_ = 0;
  inbox_.clear();
}

hal::can::BusStatistics LineBoards::statistics() const noexcept TANDEM_RT {
  const hal::ecat::LinkStatistics link = link_->statistics();
  return {.sent = link.sent, .received = link.received, .send_refused = link.refused};
}

}  // namespace tandem::sim
