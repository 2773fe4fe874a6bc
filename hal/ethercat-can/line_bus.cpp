// Frames of the drive master to the line, and the line's news back as frames.
#include "hal/ethercat-can/line_bus.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/archive.hpp"
#include "canopen/bytes.hpp"
#include "canopen/sdo_bytes.hpp"
#include "hal/ethercat-can/pdo_slots.hpp"
#include "hal/ethercat-can/sdo_sequence.hpp"

namespace tandem::hal::can {

using canopen::AbortCode;
using canopen::Frame;
using canopen::NmtState;
using canopen::PdoDirection;
using ecat::CoeClient;
using ecat::LineError;
using ecat::SlaveMaster;
using ecat::SlaveStage;

namespace {

/// A slave tells in a cycle: state, an emergency, an answer, and its TPDOs.
constexpr std::size_t kFramesPerSlave = 5 + canopen::kPdosPerNode;

/// The plan of each node of the bus, by its place in the line.
Result<std::vector<const NodePlan*>> in_order(const RobotConfig& robot, const PdoLayout& layout,
                                              std::size_t bus) {
  std::vector<const NodePlan*> nodes;
  for (const NodePlan& node : layout.nodes) {
    if (node.bus == bus) nodes.push_back(&node);
  }
  std::ranges::sort(nodes, {}, &NodePlan::id);
  for (std::size_t place = 0; place < nodes.size(); ++place) {
    if (nodes[place]->id == static_cast<int>(place) + 1) continue;
    return std::unexpected(
        Error{.message = "has no node in place " + std::to_string(place + 1) + " of its line",
              .hint = "number its boards and sensors from 1 at the master, without a gap",
              .file = robot.file,
              .line = robot.buses[bus].line,
              .key = "bus '" + robot.buses[bus].name + "'"});
  }
  return nodes;
}

/// An ESI tells whether the slave has a clock and a mode that follows it; other sheets do not.
bool follows_sync0(const canopen::DataSheet* sheet) {
  if (sheet == nullptr) return true;
  if (sheet->dc_modes.empty()) return sheet->managers.empty();
  return std::ranges::any_of(sheet->dc_modes, &canopen::SheetDcMode::sync0);
}

/// What the slave's information memory has to say, where its object 1018 cannot.
ethercat::sii::Identity identity_of(const BoardConfig& board) {
  const canopen::DataSheet& sheet = *board.sheet;
  const auto told = [&](canopen::IdentitySub sub, std::optional<std::uint32_t> configured,
                        std::optional<std::uint32_t> of_sheet) {
    const std::uint32_t wanted = configured.value_or(of_sheet.value_or(0));
    return is_disputed(sheet, sub, wanted) ? wanted : 0;
  };
  return {.vendor = told(canopen::kVendor, board.vendor_id, sheet.vendor),
          .product = told(canopen::kProduct, board.product_code, sheet.product),
          .revision = told(canopen::kRevision, board.revision, sheet.revision)};
}

ecat::SlavePlan plan_of(const NodePlan& node, const canopen::DataSheet* sheet,
                        std::int64_t period_ns) {
  ecat::SlavePlan plan{.name = node.name,
                       .waits_in_preop = true,
                       .sync0_cycle_ns = follows_sync0(sheet) ? period_ns : 0};
  for (const PdoPlan& pdo : node.pdos) {
    ecat::SlavePdo one{.index = mapping_object(pdo), .entries = entries_of(pdo), .fixed = true};
    (pdo.direction == PdoDirection::kReceive ? plan.outputs : plan.inputs)
        .push_back(std::move(one));
  }
  return plan;
}

}  // namespace

Result<std::unique_ptr<LineBus>> LineBus::create(const RobotConfig& robot, std::size_t bus,
                                                 ecat::DataLink& link, const Config& config) {
  const auto layout = make_pdo_layout(robot);
  if (!layout) return std::unexpected(layout.error());
  const auto nodes = in_order(robot, *layout, bus);
  if (!nodes) return std::unexpected(nodes.error());
  std::vector<ecat::SlavePlan> plans;
  std::vector<Slave> slaves;
  for (const NodePlan* node : *nodes) {
    const canopen::DataSheet* sheet =
        node->board >= 0 ? robot.boards[static_cast<std::size_t>(node->board)].sheet.get()
                         : nullptr;
    plans.push_back(plan_of(*node, sheet, config.period_ns));
    if (sheet != nullptr) {
      plans.back().identity = identity_of(robot.boards[static_cast<std::size_t>(node->board)]);
    }
    Slave& slave = slaves.emplace_back();
    slave.id = node->id;
    slave.heartbeat_ns = std::int64_t{node->heartbeat_ms} * 1'000'000;
    std::size_t outputs = 0;
    std::size_t inputs = 0;
    for (const PdoPlan& pdo : node->pdos) {
      add_pdo(pdo, sheet, pdo.direction == PdoDirection::kReceive ? outputs : inputs, slave);
    }
  }
  auto line = ecat::LineMaster::create(link, plans);
  if (!line) return std::unexpected(line.error());
  return std::unique_ptr<LineBus>(new LineBus(link, std::move(*line), std::move(slaves), config));
}

/// @param bits  of the direction so far
void LineBus::add_pdo(const PdoPlan& plan, const canopen::DataSheet* sheet, std::size_t& bits,
                      Slave& slave) {
  const bool receive = plan.direction == PdoDirection::kReceive;
  Pdo& pdo = (receive ? slave.outputs : slave.inputs)
                 .emplace_back(Pdo{.cob_id = plan.cob_id, .bytes = plan.bytes});
  for (const std::uint32_t entry : entries_of(plan)) {
    const auto at = static_cast<std::uint16_t>(bits / 8);
    bits += entry & 0xFF;
    const auto field = std::ranges::find_if(plan.fields, [&](const MappedField& one) {
      return canopen::mapping_entry(one.index, one.sub, one.size) == entry;
    });
    if (field != plan.fields.end()) {
      pdo.copies.push_back({.at = at, .offset = field->offset, .bytes = field->size});
    } else if (receive && sheet != nullptr) {
      const std::uint32_t value = resting_value(*sheet, entry).value_or(0);
      if (value != 0 && (entry & 0x7) == 0) {
        slave.rests.push_back(
            {.at = at, .bytes = static_cast<std::uint8_t>((entry & 0xFF) / 8), .value = value});
      }
    }
  }
}

LineBus::LineBus(ecat::DataLink& link, std::unique_ptr<ecat::LineMaster> line,
                 std::vector<Slave> slaves, const Config& config)
    : link_(&link),
      line_(std::move(line)),
      slaves_(std::move(slaves)),
      config_(config),
      storage_(2 * slaves_.size() * kFramesPerSlave + 2),
      inbox_(storage_) {}

std::size_t LineBus::send(std::span<const Frame> frames) noexcept TANDEM_RT {
  namespace cob = canopen::cob;
  bool outputs = false;
  for (const Frame& frame : frames) {
    const std::size_t slave = (frame.id & 0x7F) - 1;  // 0 wraps: none has it
    if (frame.id == cob::kNmt) {
      command(frame);
    } else if (frame.id == cob::kSync) {
      begin_cycle();
    } else if (frame.id == cob::kPastOrder) {
      line_->post(frame);
      asked_ = true;
    } else if (slave < slaves_.size() && (frame.id & 0x780) == cob::kSdoRequest) {
      request(slave, frame);
    } else if (slave < slaves_.size()) {
      outputs = output(slave, frame) || outputs;
    }
  }
  if (outputs) line_->write();
  return frames.size();
}

void LineBus::command(const Frame& frame) noexcept {
  const std::uint8_t node = frame.data[1];
  for (std::size_t i = 0; i < slaves_.size(); ++i) {
    if (node == 0 || node == slaves_[i].id) command(i, frame.data[0]);
  }
  const bool over = std::ranges::all_of(slaves_, &Slave::left);
  if (over) line_->stop();
}

void LineBus::command(std::size_t i, std::uint8_t nmt) noexcept {
  using canopen::NmtCommand;
  Slave& slave = slaves_[i];
  SlaveMaster& master = line_->slave(i);
  slave.op_wanted = false;
  slave.left = false;
  switch (static_cast<NmtCommand>(nmt)) {
    case NmtCommand::kStart:
      slave.op_wanted = true;
      if (master.waiting()) master.go_on();
      return;
    case NmtCommand::kStop: std::ranges::fill(line_->outputs(i), std::uint8_t{0}); return;
    case NmtCommand::kEnterPreOperational: slave.left = true; return;
    default: slave.reset_wanted = true; return;
  }
}

/// What the drive master asks for has one to four bytes.
void LineBus::request(std::size_t i, const Frame& frame) noexcept {
  Slave& slave = slaves_[i];
  SlaveMaster& master = line_->slave(i);
  const bool hears = master.waiting() || master.running() || master.stage() == SlaveStage::kReady;
  const std::uint8_t command = frame.data[0];
  const int specifier = command >> 5;
  if (!hears || (specifier != 1 && specifier != 2)) return;
  slave.index = canopen::get<std::uint16_t>(&frame.data[1]);
  slave.sub = frame.data[3];
  slave.sdo_reads = specifier == 2;
  slave.sdo_waits = true;
  if (slave.sdo_reads) return master.sdo().upload(slave.index, slave.sub);
  const std::size_t unused = (command & canopen::kSizeGiven) != 0 ? (command >> 2) & 3U : 0U;
  master.sdo().download(slave.index, slave.sub, std::span(frame.data).subspan(4, 4 - unused));
}

bool LineBus::output(std::size_t i, const Frame& frame) noexcept {
  for (const Pdo& pdo : slaves_[i].outputs) {
    if (pdo.cob_id != frame.id || frame.length < pdo.bytes) continue;
    const std::span<std::uint8_t> image = line_->outputs(i);
    for (const Copy& copy : pdo.copies) {
      std::copy_n(frame.data.begin() + copy.offset, copy.bytes, image.begin() + copy.at);
    }
    for (const Rest& rest : slaves_[i].rests) {
      std::array<std::uint8_t, 4> bytes{};
      canopen::put(bytes.data(), rest.value);
      std::copy_n(bytes.begin(), rest.bytes, image.begin() + rest.at);
    }
    return true;
  }
  return false;
}

void LineBus::begin_cycle() noexcept {
  if (!taken_) {  // it has not come back whole, and will not any more
    (void)line_->collect();
    take_cycle();
  }
  if (now_ns_ == 0) line_->restart(0);  // frames go round from the first cycle on
  now_ns_ += config_.period_ns;
  restart();
  for (std::size_t i = 0; i < slaves_.size(); ++i) {
    SlaveMaster& slave = line_->slave(i);
    if (slaves_[i].op_wanted && slave.stage() == SlaveStage::kReady) slave.start(now_ns_);
  }
  line_->send(now_ns_);
  taken_ = asked_ = false;
}

/// All at once when nobody was started yet; else each by itself, while the others run.
void LineBus::restart() noexcept {
  const auto wanted = std::ranges::count(slaves_, true, &Slave::reset_wanted);
  if (wanted == 0) return;
  const bool all = wanted == static_cast<std::ptrdiff_t>(slaves_.size());
  if (all) line_->restart(now_ns_);
  for (std::size_t i = 0; i < slaves_.size(); ++i) {
    Slave& slave = slaves_[i];
    if (!slave.reset_wanted) continue;
    if (!all) line_->restart(i, now_ns_);
    slave.reset_wanted = slave.booted = slave.sdo_waits = false;
    slave.told = NmtState::kBootUp;
    std::ranges::fill(line_->outputs(i), std::uint8_t{0});
  }
}

std::size_t LineBus::receive(std::span<Frame> frames) noexcept TANDEM_RT {
  const bool complete = (!taken_ || asked_) && line_->collect();
  if (config_.lockstep) {
    while (const auto past = line_->take_posted(canopen::cob::kPastAnswer)) inbox_.push(*past);
  }
  if (!taken_ && (config_.lockstep ? line_->settled() : complete)) take_cycle();
  const std::span<const Frame> waiting = inbox_.frames().subspan(given_);
  const std::size_t count = std::min(waiting.size(), frames.size());
  std::copy_n(waiting.begin(), count, frames.begin());
  given_ += count;
  if (given_ == inbox_.frames().size()) {
    inbox_.clear();
    given_ = 0;
  }
  return count;
}

void LineBus::take_cycle() noexcept {
  taken_ = true;
  const ecat::CycleReport& cycle = line_->receive(now_ns_);
  const bool valid = cycle.valid;
  follow_clock(cycle);
  for (std::size_t i = 0; i < slaves_.size(); ++i) {
    tell_state(i);
    tell_emergency(i);
    tell_sdo(i);
    if (valid && line_->slave(i).running()) tell_inputs(i);
  }
  if (config_.lockstep && line_->settled()) inbox_.push(canopen::make_time(now_ns_));
}

/// SYNC0 comes at multiples of the period. An eighth of the error each cycle: the frames' jitter is
/// not the clock's.
void LineBus::follow_clock(const ecat::CycleReport& cycle) noexcept {
  shift_ns_ = 0;
  if (!cycle.complete || cycle.reference_ns == 0) return;
  const std::int64_t period_ns = config_.period_ns;
  const auto wanted_ns = static_cast<std::int64_t>(kAfterSync0 * static_cast<double>(period_ns));
  const auto at_ns =
      static_cast<std::int64_t>(cycle.reference_ns % static_cast<std::uint64_t>(period_ns));
  std::int64_t late_ns = at_ns - wanted_ns;
  if (late_ns > period_ns / 2) late_ns -= period_ns;
  shift_ns_ = -late_ns / 8;
}

std::int64_t LineBus::clock_shift_ns() const noexcept TANDEM_RT { return shift_ns_; }

bool LineBus::gives_up(int node) const noexcept TANDEM_RT {
  const auto place = static_cast<std::size_t>(node - 1);
  if (place >= slaves_.size()) return false;
  return line_->error() == ecat::LineError::kSecondMaster || line_->slave(place).hopeless();
}

void LineBus::tell_state(std::size_t i) noexcept {
  Slave& slave = slaves_[i];
  const SlaveMaster& master = line_->slave(i);
  const bool there =
      !(master.stage() == SlaveStage::kDown &&
        (master.error() == LineError::kGone || master.error() == LineError::kNoAnswer));
  if (!slave.booted) {
    if (!master.waiting()) return;
    slave.booted = true;
    inbox_.push(canopen::make_heartbeat(slave.id, NmtState::kBootUp));
  }
  if (!there) return;
  const NmtState state = master.running()                      ? NmtState::kOperational
                         : master.stage() == SlaveStage::kDown ? NmtState::kStopped
                                                               : NmtState::kPreOperational;
  if (state == slave.told && now_ns_ - slave.told_ns < slave.heartbeat_ns) return;
  slave.told = state;
  slave.told_ns = now_ns_;
  inbox_.push(canopen::make_heartbeat(slave.id, state));
}

/// The mailbox is read when an answer is waited for: what lay before it came with it.
void LineBus::tell_emergency(std::size_t i) noexcept {
  Slave& slave = slaves_[i];
  const CoeClient& sdo = line_->slave(i).sdo();
  if (std::exchange(slave.emergencies, sdo.emergencies()) == sdo.emergencies()) return;
  Frame frame;
  frame.id = canopen::cob::kEmergency + static_cast<std::uint32_t>(slave.id);
  frame.length = 8;
  std::ranges::copy(sdo.emergency(), frame.data.begin());
  inbox_.push(frame);
}

void LineBus::tell_sdo(std::size_t i) noexcept {
  Slave& slave = slaves_[i];
  CoeClient& sdo = line_->slave(i).sdo();
  if (!slave.sdo_waits || sdo.busy()) return;
  slave.sdo_waits = false;
  AbortCode code = sdo.status() == CoeClient::Status::kDone ? AbortCode::kNone : sdo.abort_code();
  const std::span<const std::uint8_t> value = sdo.value();
  const bool fits = !slave.sdo_reads || (!value.empty() && value.size() <= 4);
  if (code == AbortCode::kNone && !fits) code = AbortCode::kOutOfMemory;
  const auto answer = [&](int specifier, std::uint8_t bits) {
    return canopen::sdo_frame(canopen::cob::kSdoResponse, slave.id,
                              static_cast<std::uint8_t>(specifier << 5 | bits), slave.index,
                              slave.sub);
  };
  Frame frame;
  if (code != AbortCode::kNone) {
    frame = answer(canopen::kAbort, 0);
    canopen::put(&frame.data[4], static_cast<std::uint32_t>(code));
  } else if (slave.sdo_reads) {
    const auto unused = static_cast<std::uint8_t>((4 - value.size()) << 2);
    frame = answer(2, unused | canopen::kExpedited | canopen::kSizeGiven);
    std::ranges::copy(value, &frame.data[4]);
  } else {
    frame = answer(3, 0);
  }
  inbox_.push(frame);
}

void LineBus::tell_inputs(std::size_t i) noexcept {
  const std::span<const std::uint8_t> inputs = line_->inputs(i);
  for (const Pdo& pdo : slaves_[i].inputs) {
    Frame frame;
    frame.id = pdo.cob_id;
    frame.length = canopen::frame_length(pdo.bytes);
    if (frame.length > canopen::kClassicFrameBytes) {
      frame.flags = canopen::kFlagFd | canopen::kFlagBrs;
    }
    for (const Copy& copy : pdo.copies) {
      std::copy_n(inputs.begin() + copy.at, copy.bytes, frame.data.begin() + copy.offset);
    }
    inbox_.push(frame);
  }
}

void LineBus::archive(Archive& ar) {
  ar(*line_, now_ns_, taken_);
  for (Slave& s : slaves_) {
    ar(s.reset_wanted, s.op_wanted, s.booted, s.left, s.sdo_waits, s.sdo_reads, s.index, s.sub,
       s.told, s.told_ns, s.emergencies);
  }
  if (!ar.reading()) return;
  inbox_.clear();
  given_ = 0;
  asked_ = false;
}

std::string LineBus::status_text() const {
  std::string text;
  for (const char letter : line_->text()) text += letter == '\n' ? "; " : std::string(1, letter);
  return text.substr(0, text.size() - std::min<std::size_t>(text.size(), 2));
}

std::string LineBus::measured_text() const {
  const ecat::LineStatistics line = line_->statistics();
  std::string text = fmt::format("{} of {} cycles lost, {} frames sent again", line.lost,
                                 line.cycles, line.resent);
  const SlaveMaster* worst = nullptr;
  std::int32_t most_ns = -1;
  for (std::size_t i = 0; i < slaves_.size(); ++i) {
    const SlaveMaster& slave = line_->slave(i);
    const ecat::ClockFigures& off = slave.clock().figures();
    const std::int32_t off_ns = std::max(-off.least, off.most);
    if (off.count == 0 || off_ns <= most_ns) continue;
    worst = &slave;
    most_ns = off_ns;
  }
  if (worst == nullptr) return text;
  return text + fmt::format(
                    "; the clocks follow the first slave's within {} ns, worst {} with {} "
                    "to {} ns",
                    most_ns, worst->plan().name, worst->clock().figures().least,
                    worst->clock().figures().most);
}

BusStatistics LineBus::statistics() const noexcept TANDEM_RT {
  const ecat::LineStatistics line = line_->statistics();
  const ecat::LinkStatistics wire = link_->statistics();
  return {.sent = wire.sent,
          .received = wire.received,
          .send_refused = wire.refused,
          .receive_lost = line.lost,
          .ignored = line.malformed + line.strangers,
          .recoveries = line_->mended()};
}

}  // namespace tandem::hal::can
