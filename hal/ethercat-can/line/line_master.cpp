// Every cycle carries, besides the process data, a broadcast read of the slaves' states: its
// working counter says how far frames come, its data whether a slave is not in OP.
#include "hal/ethercat-can/line/line_master.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace tandem::hal::ecat {

using ethercat::Command;
using ethercat::register_address;
namespace reg = ethercat::reg;

namespace {

constexpr std::uint8_t kFirstCyclicIndex = Exchange::kIndices;
constexpr std::size_t kMostFramesOfCycle = 32;

/// What is broadcast before the slaves are spoken to one by one: no addresses of an earlier
/// master, addressing by alias off, and the information memory is the master's.
struct Clearing {
  std::uint16_t offset = 0;
  std::uint8_t bytes = 0;
};
constexpr std::array kClearings{Clearing{reg::kStation, 2}, Clearing{reg::kDlControl + 3, 1},
                                Clearing{reg::kSiiConfig, 1}};

std::vector<SlaveMaster> make_slaves(const std::vector<SlavePlan>& plans,
                                     const ProcessImage& image) {
  std::vector<SlaveMaster> slaves;
  slaves.reserve(plans.size());
  for (std::size_t i = 0; i < plans.size(); ++i) slaves.emplace_back(plans[i], i, image.mapping(i));
  return slaves;
}

}  // namespace

Result<std::unique_ptr<LineMaster>> LineMaster::create(DataLink& link,
                                                       const std::vector<SlavePlan>& plans) {
  if (const Status status = check(plans); !status) return std::unexpected(status.error());
  return std::unique_ptr<LineMaster>(new LineMaster(link, plans));
}

LineMaster::LineMaster(DataLink& link, const std::vector<SlavePlan>& plans)
    : link_(&link),
      image_(plans),
      slaves_(make_slaves(plans, image_)),
      exchange_(plans.size() + 1),
      batch_(kMostFramesOfCycle),
      came_(kMostFramesOfCycle) {}

void LineMaster::restart(std::int64_t now_ns) noexcept TANDEM_RT {
  // What came before is no second master's frame of this scan. Bounded: a stranger may flood.
  constexpr int kMostRounds = 4;
  for (int i = 0; i < kMostRounds && link_->receive(came_) == came_.size(); ++i) {
  }
  scan_ = Scan::kCount;
  stopped_ = false;
  scan_ns_ = now_ns;
  part_ = 0;
  error_ = LineError::kNone;
  reference_ = {};
  latching_ = false;
  short_reach_ = full_reach_ = 0;
  cycle_ = {};
  for (std::size_t channel = 0; channel <= size(); ++channel) exchange_.release(channel);
  for (SlaveMaster& slave : slaves_) slave.rest();
}

void LineMaster::restart(std::size_t slave, std::int64_t now_ns) noexcept TANDEM_RT {
  if (scan_ != Scan::kDone || slaves_[slave].station() == reference_.station) {
    return restart(now_ns);
  }
  exchange_.release(slave);
  slaves_[slave].restart(now_ns);
}

void LineMaster::start(std::int64_t now_ns) noexcept TANDEM_RT {
  for (SlaveMaster& slave : slaves_) {
    if (slave.stage() == SlaveStage::kReady) slave.start(now_ns);
  }
}

bool LineMaster::all(SlaveStage stage) const noexcept TANDEM_RT {
  return std::ranges::all_of(slaves_, [stage](const SlaveMaster& slave) {
    return slave.stage() >= stage && slave.stage() != SlaveStage::kDown;
  });
}

bool LineMaster::collect() noexcept TANDEM_RT {
  for (std::size_t count = came_.size(); count == came_.size();) {
    count = link_->receive(came_);
    for (std::size_t i = 0; i < count; ++i) take_frame(came_[i]);
  }
  return watch_back_ && image_.complete();
}

void LineMaster::take_frame(FrameBuffer& frame) noexcept {
  if (ethercat::check_frame(frame.frame()) != ethercat::LineError::kNone) {
    ++statistics_.malformed;
    return;
  }
  ethercat::MacAddress source{};
  std::copy_n(frame.bytes.begin() + 6, source.size(), source.begin());
  source[0] &= static_cast<std::uint8_t>(~ethercat::kProcessedMark);
  if (source != link_->address()) {
    ++statistics_.strangers;
    if (scan_ == Scan::kCount || scan_ == Scan::kClear) {  // it was there first
      error_ = LineError::kSecondMaster;
      scan_ = Scan::kFailed;
      sent_ = false;
      stopped_ = true;
    }
    return;
  }
  if (const auto posted = parse_nop_frame(frame)) {
    if (posted_count_ < posted_.size()) posted_[posted_count_++] = *posted;
    return;
  }
  ethercat::FrameReader reader(frame.frame());
  ethercat::Datagram datagram;
  while (reader.next(datagram)) {
    const bool cyclic = datagram.index() >= kFirstCyclicIndex;
    if (!(cyclic ? take_own(datagram) : exchange_.take(datagram))) ++statistics_.stray;
  }
}

bool LineMaster::take_own(const ethercat::Datagram& datagram) noexcept {
  if (datagram.index() != index_) return false;
  if (datagram.command() == Command::kLwr && writes_ > 0) {
    --writes_;
    return true;
  }
  if (datagram.command() == Command::kLrw) return image_.take(datagram);
  if (datagram.command() == Command::kFrmw && datagram.data().size() == 8) {
    if (datagram.working_counter() == 0 || !reference_.set) return true;
    reference_.time_ns = canopen::get<std::uint64_t>(datagram.data().data());
    return true;
  }
  const bool watch = datagram.command() == Command::kBrd && datagram.data().size() == 2;
  if (!watch || watch_back_) return false;
  watch_back_ = true;
  cycle_.reached = datagram.working_counter();
  states_ = datagram.data()[0];
  return true;
}

const CycleReport& LineMaster::receive(std::int64_t now_ns) noexcept TANDEM_RT {
  const bool complete = collect();
  exchange_.age(now_ns);
  if (!sent_) return cycle_;
  ++statistics_.cycles;
  cycle_.complete = complete;
  cycle_.counter = image_.counter();
  cycle_.expected = image_.expected();
  cycle_.valid = complete && cycle_.counter >= cycle_.expected;
  cycle_.reference_ns = reference_.time_ns;
  cycle_.lost_in_row = complete ? 0 : cycle_.lost_in_row + 1;
  cycle_.short_in_row = complete && !cycle_.valid ? cycle_.short_in_row + 1
                        : complete                ? 0
                                                  : cycle_.short_in_row;
  statistics_.lost += complete ? 0 : 1;
  statistics_.shorts += complete && !cycle_.valid ? 1 : 0;
  if (scan_ == Scan::kDone) judge(now_ns);
  return cycle_;
}

std::size_t LineMaster::resend() noexcept TANDEM_RT {
  if (!sent_ || (watch_back_ && image_.complete())) return 0;
  batch_.begin(link_->address());
  image_.send(batch_);
  if (!watch_back_) add_watch();
  const std::size_t sent = link_->send(batch_.finish());
  statistics_.resent += sent;
  return sent;
}

void LineMaster::add_watch() noexcept {
  (void)batch_.add(Command::kBrd, index_, register_address(0, reg::kAlStatus), 2);
}

void LineMaster::send(std::int64_t now_ns) noexcept TANDEM_RT {
  if (scan_ == Scan::kIdle || stopped_) return;
  if (scan_ != Scan::kDone) scan(now_ns);
  if (scan_ == Scan::kDone) {
    run_clocks(now_ns);
    for (SlaveMaster& slave : slaves_) slave.process(now_ns, exchange_, reference_);
  }
  index_ = static_cast<std::uint8_t>(kFirstCyclicIndex + (index_ + 1) % Exchange::kIndices);
  watch_back_ = false;
  writes_ = 0;
  image_.begin(index_, slaves_);
  batch_.begin(link_->address());
  if (reference_.set) {
    (void)batch_.add(Command::kFrmw, index_, register_address(reference_.station, reg::kSystemTime),
                     8);
  }
  add_watch();
  image_.send(batch_);
  exchange_.collect(batch_, now_ns);
  (void)link_->send(batch_.finish());
  sent_ = true;
}

void LineMaster::write() noexcept TANDEM_RT {
  if (!sent_ || stopped_ || writes_ != 0) return;
  batch_.begin(link_->address());
  writes_ = image_.write(batch_);
  (void)link_->send(batch_.finish());
}

void LineMaster::post(const canopen::Frame& frame) noexcept TANDEM_RT {
  make_nop_frame(frame, link_->address(), post_);
  (void)link_->send({&post_, 1});
}

std::optional<canopen::Frame> LineMaster::take_posted(std::uint32_t id) noexcept TANDEM_RT {
  while (posted_count_ > 0) {
    const canopen::Frame first = posted_[0];
    std::copy(posted_.begin() + 1, posted_.end(), posted_.begin());
    --posted_count_;
    if (first.id == id) return first;
  }
  return std::nullopt;
}

void LineMaster::stop() noexcept TANDEM_RT {
  constexpr std::array<std::uint8_t, 2> kInit{
      std::uint8_t{std::to_underlying(ethercat::AlState::kInit) | ethercat::kAlError}, 0};
  if (!sent_) return;
  batch_.begin(link_->address());
  const auto data =
      batch_.add(Command::kBwr, index_, register_address(0, reg::kAlControl), kInit.size());
  std::ranges::copy(kInit, data.begin());
  (void)link_->send(batch_.finish());
  stopped_ = true;
}

bool LineMaster::settled() const noexcept {
  return watch_back_ && image_.complete() && writes_ == 0 && !exchange_.under_way();
}

void LineMaster::scan(std::int64_t now_ns) noexcept {
  if (scan_ == Scan::kClear) return clear(now_ns);
  if (scan_ != Scan::kCount || !sent_) return;
  // The cycle's broadcast counts the slaves; twice the same, because they may be starting.
  const bool right = watch_back_ && cycle_.reached == size();
  part_ = right ? part_ + 1 : 0;
  if (part_ >= 2) {
    scan_ = Scan::kClear;
    scan_is_slow_ = false;
    part_ = 0;
    return clear(now_ns);
  }
  scan_is_slow_ = now_ns - scan_ns_ >= kSlowScanNs;
  if (now_ns - scan_ns_ < kScanTimeNs) return;
  found_ = watch_back_ ? cycle_.reached : 0;
  error_ = found_ == 0 ? LineError::kSilent
                       : (found_ < size() ? LineError::kTooFew : LineError::kTooMany);
  scan_ = Scan::kFailed;
}

void LineMaster::clear(std::int64_t now_ns) noexcept {
  static constexpr std::array<std::uint8_t, 2> kZeros{};
  const std::size_t channel = size();
  const DatagramRequest& request = exchange_.at(channel);
  if (request.state == DatagramRequest::State::kDone) {
    part_ += request.counter == size() ? 1 : 0;
    exchange_.release(channel);
  }
  if (request.state == DatagramRequest::State::kLost) exchange_.release(channel);
  if (now_ns - scan_ns_ >= 2 * kScanTimeNs) {
    error_ = LineError::kSilent;
    scan_ = Scan::kFailed;
    return;
  }
  if (!exchange_.idle(channel)) return;
  const auto part = static_cast<std::size_t>(part_);
  if (part < kClearings.size()) {
    return exchange_.write(channel, Command::kBwr, register_address(0, kClearings[part].offset),
                           std::span(kZeros).first(kClearings[part].bytes));
  }
  for (SlaveMaster& slave : slaves_) slave.restart(now_ns);
  scan_ = Scan::kDone;
}

// The first slave with a clock is the reference. When nobody is on the way to a later latch, one
// broadcast gives every slave that waits its time stamps; the reference reads its own first.
void LineMaster::run_clocks(std::int64_t now_ns) noexcept {
  const std::size_t channel = size();
  const DatagramRequest& request = exchange_.at(channel);
  if (latching_ && request.state != DatagramRequest::State::kWanted &&
      request.state != DatagramRequest::State::kSent) {
    const bool done = request.state == DatagramRequest::State::kDone;
    exchange_.release(channel);
    latching_ = false;
    for (SlaveMaster& slave : slaves_) {
      if (!done || slave.stage() != SlaveStage::kWaitClock) continue;
      slave.clocks_latched(now_ns);
      if (slave.station() == reference_.station) return;  // the others after it
    }
  }
  if (latching_) return;
  bool waits = false;
  for (const SlaveMaster& slave : slaves_) {
    if (slave.waiting()) continue;
    if (slave.stage() < SlaveStage::kWaitClock || slave.stage() == SlaveStage::kClock) return;
    waits |= slave.stage() == SlaveStage::kWaitClock;
  }
  if (!waits) return;
  const auto first = std::ranges::find_if(slaves_, &SlaveMaster::has_clock);
  if (reference_.station == 0) reference_.station = first->station();
  exchange_.write(channel, Command::kBwr, register_address(0, reg::kReceiveTime),
                  std::array<std::uint8_t, 4>{});
  latching_ = true;
}

void LineMaster::judge(std::int64_t now_ns) noexcept {
  judge_line(now_ns);
  if (cycle_.lost_in_row == 0 && error_ == LineError::kNone) judge_slaves();
  // One clock after another is asked how far it is off.
  turn_ = (turn_ + 1) % size();
  if (slaves_[turn_].running()) slaves_[turn_].ask_difference();
}

void LineMaster::judge_line(std::int64_t now_ns) noexcept {
  if (cycle_.lost_in_row >= kSilentCycles && error_ != LineError::kSilent) {
    error_ = LineError::kSilent;
    for (SlaveMaster& slave : slaves_) slave.fail(LineError::kGone, now_ns);
    return;
  }
  if (!watch_back_) return;
  const bool whole = cycle_.reached >= size();
  short_reach_ = whole ? 0 : short_reach_ + 1;
  full_reach_ = whole ? full_reach_ + 1 : 0;
  if (short_reach_ >= kCertain && (error_ == LineError::kNone || broken_cable_ > cycle_.reached)) {
    error_ = LineError::kCable;
    broken_cable_ = cycle_.reached;
    for (std::size_t i = broken_cable_; i < size(); ++i) {
      if (slaves_[i].stage() != SlaveStage::kDown) slaves_[i].fail(LineError::kGone, now_ns);
    }
  }
  if (error_ != LineError::kNone && full_reach_ >= kCertain) {
    error_ = LineError::kNone;
    ++mended_;
  }
}

void LineMaster::judge_slaves() noexcept {
  const bool all_run = std::ranges::all_of(slaves_, &SlaveMaster::running);
  const bool wrong_state = all_run && states_ != std::to_underlying(ethercat::AlState::kOp);
  if (!wrong_state && cycle_.short_in_row < kCertain) return;
  for (SlaveMaster& slave : slaves_) {
    if (slave.running()) slave.look();
  }
}

LineStatistics LineMaster::statistics() const noexcept TANDEM_RT {
  LineStatistics all = statistics_;
  all.repeated = exchange_.repeated();
  return all;
}

std::string LineMaster::text() const {
  std::string all;
  const auto say = [&](const std::string& line) { all += line + "\n"; };
  const std::string expected = std::to_string(size());
  switch (error_) {
    case LineError::kNone:
      if (scan_is_slow_ && cycle_.reached < size()) {
        say(std::to_string(cycle_.reached) + " of " + expected + " slaves answer: look at slave " +
            std::to_string(cycle_.reached) + " (" + slaves_[cycle_.reached].plan().name +
            ") and the cable to it");
      }
      break;
    case LineError::kSilent:
      say("no frame comes back: the cable from the master to slave 0 (" + slaves_[0].plan().name +
          ") is cut, or the slave has no power");
      break;
    case LineError::kTooFew:
      say(std::to_string(found_) + " of " + expected + " slaves answer: look at slave " +
          std::to_string(found_) + " (" + slaves_[found_].plan().name + ") and the cable to it");
      break;
    case LineError::kTooMany:
      say(std::to_string(found_) + " slaves answer, " + expected + " are described");
      break;
    case LineError::kSecondMaster: say(to_string(error_)); return all;
    case LineError::kCable:
      say(broken_cable_ == 0
              ? std::string("the cable from the master to slave 0 is cut")
              : "the cable from slave " + std::to_string(broken_cable_ - 1) + " (" +
                    slaves_[broken_cable_ - 1].plan().name + ") to slave " +
                    std::to_string(broken_cable_) + " (" + slaves_[broken_cable_].plan().name +
                    ") is cut, or the latter has no power");
      break;
    default: break;
  }
  if (statistics_.strangers != 0) say("a second master is on the wire");
  for (const SlaveMaster& slave : slaves_) {
    if (slave.stage() == SlaveStage::kDown) say(slave.text());
  }
  return all;
}

}  // namespace tandem::hal::ecat
