// A slave's stages: each asks for a register, takes the answer, and goes on. The stages' datagrams
// are in slave_master_ask.cpp, the texts in slave_text.cpp.
#include "hal/ethercat-can/line/slave_master.hpp"

#include <algorithm>
#include <utility>

namespace tandem::hal::ecat {

using canopen::get;
using ethercat::AlCode;
using ethercat::AlState;
namespace sii = ethercat::sii;

namespace {

constexpr std::size_t kLongestName = 255;
constexpr std::size_t kSiiAnswerAt = 6;  // behind control and address

AlState state_of(std::uint16_t status) noexcept {
  return static_cast<AlState>(status & ethercat::kAlStateMask);
}

}  // namespace

SlaveMaster::SlaveMaster(const SlavePlan& plan, std::size_t position, const SlaveMapping& mapping)
    : plan_(plan),
      position_(position),
      mapping_(mapping),
      steps_(make_steps(plan)),
      station_(static_cast<std::uint16_t>(kFirstStation + position)),
      clock_(station_, plan.sync0_cycle_ns) {
  sii_.reserve(2 * sii::kMaxWords + 8);
  content_.name.reserve(kLongestName);
  content_.managers.reserve(sii::kMaxSyncManagers);
}

void SlaveMaster::restart(std::int64_t now_ns) noexcept TANDEM_RT {
  error_ = LineError::kNone;
  look_wanted_ = difference_wanted_ = goes_on_ = false;
  clock_.restart();
  enter(SlaveStage::kReset, now_ns);
  wanted_ = AlState::kInit;
}

void SlaveMaster::enter(SlaveStage stage, std::int64_t now_ns) noexcept {
  stage_ = stage;
  since_ns_ = now_ns;
  part_ = 0;
  misses_ = 0;
  step_ = stage == SlaveStage::kConfigure ? 0 : step_;
  started_step_ = false;
  state_written_ = false;
}

void SlaveMaster::enter_state(SlaveStage stage, AlState state, std::int64_t now_ns) noexcept {
  enter(stage, now_ns);
  wanted_ = state;
}

void SlaveMaster::fail(LineError error, std::int64_t now_ns) noexcept TANDEM_RT {
  error_ = error;
  trouble_ns_ = now_ns;
  stage_ = SlaveStage::kDown;
}

bool SlaveMaster::hopeless() const noexcept { return stage_ == SlaveStage::kDown && lasts(error_); }

void SlaveMaster::clocks_latched(std::int64_t now_ns) noexcept TANDEM_RT {
  enter(SlaveStage::kClock, now_ns);
}

void SlaveMaster::start(std::int64_t now_ns) noexcept TANDEM_RT {
  enter(SlaveStage::kSettle, now_ns);
}

void SlaveMaster::look() noexcept TANDEM_RT { look_wanted_ = true; }

void SlaveMaster::process(std::int64_t now_ns, Exchange& exchange,
                          ClockReference& reference) noexcept TANDEM_RT {
  const bool idle_stage = stage_ == SlaveStage::kWait || stage_ == SlaveStage::kDown;
  if (idle_stage) return exchange.release(position_);
  if (stage_ == SlaveStage::kConfigure || (mapped() && coe_.busy() && part_ == 0)) {
    return configure(now_ns, exchange);
  }
  const DatagramRequest& request = exchange.at(position_);
  if (request.state == DatagramRequest::State::kLost) {
    exchange.release(position_);
    return fail(LineError::kNoAnswer, now_ns);
  }
  if (request.state == DatagramRequest::State::kDone) {
    if (request.counter == 1) {
      misses_ = 0;
      take(request, now_ns, reference);
    } else {
      missed(now_ns);
    }
    exchange.release(position_);
  }
  if (exchange.idle(position_)) ask(now_ns, exchange, reference);
}

void SlaveMaster::missed(std::int64_t now_ns) noexcept {
  if (mapped()) look_wanted_ |= std::exchange(part_, 0) >= 2;  // once more from its beginning
  if (++misses_ < kMisses) return;
  fail(stage_ == SlaveStage::kRunning ? LineError::kGone : LineError::kNoAnswer, now_ns);
}

void SlaveMaster::take(const DatagramRequest& request, std::int64_t now_ns,
                       ClockReference& reference) noexcept {
  const Data data = request.bytes();
  switch (stage_) {
    case SlaveStage::kReset:
      // Part 2 is the state; before it station address and control, after it all is switched off.
      if (part_ == 2 && state_of(get<std::uint16_t>(data.data())) != AlState::kInit) {
        if (now_ns - since_ns_ >= plan_.state_time_ns) fail(LineError::kStateTimeout, now_ns);
        return;
      }
      if (++part_ == 5) enter(SlaveStage::kFeatures, now_ns);
      return;
    case SlaveStage::kFeatures:
      clock_.found((get<std::uint16_t>(&data[8]) & ethercat::kFeatureDc) != 0);
      sii_.clear();
      category_at_ = 2 * sii::kFixedWords;
      return enter(SlaveStage::kSii, now_ns);
    case SlaveStage::kSii: return take_sii(data, now_ns);
    case SlaveStage::kPreOp:
      if (part_ == 0) {
        ++part_;
        return;
      }
      return take_state(data, now_ns, SlaveStage::kConfigure);
    case SlaveStage::kProcessData:
      if (++part_ == 2) enter(has_clock() ? SlaveStage::kWaitClock : SlaveStage::kSafeOp, now_ns);
      if (stage_ == SlaveStage::kSafeOp) wanted_ = AlState::kSafeOp;
      return;
    case SlaveStage::kClock:
      if (!clock_.take(part_++, data, now_ns, reference)) return;
      return enter_state(SlaveStage::kSafeOp, AlState::kSafeOp, now_ns);
    case SlaveStage::kSafeOp: return take_state(data, now_ns, SlaveStage::kReady);
    case SlaveStage::kOp: return take_state(data, now_ns, SlaveStage::kRunning);
    case SlaveStage::kSettle:
      clock_.take_difference(data, false);
      if (clock_.settled(reference)) return enter_state(SlaveStage::kOp, AlState::kOp, now_ns);
      if (now_ns - since_ns_ >= kSettleTimeNs) fail(LineError::kClock, now_ns);
      return;
    case SlaveStage::kReady:
    case SlaveStage::kRunning: return take_running(data, now_ns);
    default: return;
  }
}

void SlaveMaster::take_sii(Data data, std::int64_t now_ns) noexcept {
  if (part_ == 0) {  // asked for; now it is read
    part_ = 1;
    return;
  }
  const auto control = get<std::uint16_t>(data.data());
  if ((control & ethercat::kSiiBusy) != 0) {
    if (now_ns - since_ns_ >= plan_.state_time_ns) fail(LineError::kSiiUnread, now_ns);
    return;
  }
  part_ = 0;
  if ((control & ethercat::kSiiRefused) != 0) return fail(LineError::kSiiUnread, now_ns);
  const std::size_t size = (control & ethercat::kSiiReads8Bytes) != 0 ? 8 : 4;
  const Data part = data.subspan(kSiiAnswerAt, size);
  sii_.insert(sii_.end(), part.begin(), part.end());
  while (category_at_ + 4 <= sii_.size()) {
    if (get<std::uint16_t>(&sii_[category_at_]) == std::to_underlying(sii::Category::kEnd)) {
      return read_sii_end(now_ns);
    }
    category_at_ += 4 + 2 * std::size_t{get<std::uint16_t>(&sii_[category_at_ + 2])};
  }
  if (sii_.size() >= 2 * sii::kMaxWords) read_sii_end(now_ns);
}

void SlaveMaster::read_sii_end(std::int64_t now_ns) noexcept {
  const LineError unread = sii::parse(sii_, content_);
  if (unread != LineError::kNone) return fail(unread, now_ns);
  if (!matches(plan_, content_.identity)) return fail(LineError::kWrongIdentity, now_ns);
  const sii::Mailbox& box = content_.mailbox;
  const auto usable = [](std::size_t bytes) {
    return bytes >= ethercat::kMinMailboxBytes && bytes <= ethercat::kMaxMailboxBytes;
  };
  const bool coe = (content_.protocols & sii::kProtocolCoe) != 0 && usable(box.out_bytes) &&
                   usable(box.in_bytes);
  const bool asked = plan_.waits_in_preop || !steps_.empty();
  if (!coe && asked) return fail(LineError::kNoMailbox, now_ns);
  if (!find_memory()) return fail(LineError::kNoMemory, now_ns);
  coe_.reset(station_, box);
  enter_state(SlaveStage::kPreOp, AlState::kPreOp, now_ns);
}

bool SlaveMaster::find_memory() noexcept {
  outputs_memory_ = inputs_memory_ = 0;
  for (const sii::SyncManagerInfo& info : content_.managers) {
    if (info.use == ethercat::SyncManagerUse::kOutputs) outputs_memory_ = info.start;
    if (info.use == ethercat::SyncManagerUse::kInputs) inputs_memory_ = info.start;
  }
  return (mapping_.outputs == 0 || outputs_memory_ != 0) &&
         (mapping_.inputs == 0 || inputs_memory_ != 0);
}

void SlaveMaster::take_state(Data data, std::int64_t now_ns, SlaveStage next) noexcept {
  if (!state_written_) {
    state_written_ = true;
    return;
  }
  const auto status = get<std::uint16_t>(data.data());
  al_state_ = state_of(status);
  al_code_ = static_cast<AlCode>(get<std::uint16_t>(&data[4]));
  if ((status & ethercat::kAlError) != 0) return fail(LineError::kRefused, now_ns);
  if (al_state_ == wanted_) return enter(next, now_ns);
  if (now_ns - since_ns_ >= plan_.state_time_ns) fail(LineError::kStateTimeout, now_ns);
}

void SlaveMaster::configure(std::int64_t now_ns, Exchange& exchange) noexcept {
  if (waiting()) return coe_.process(now_ns, exchange, position_);
  const bool at_start = stage_ == SlaveStage::kConfigure;
  if (at_start && step_ == steps_.size()) return enter(SlaveStage::kProcessData, now_ns);
  if (at_start && !started_step_) {
    const CoeStep& step = steps_[step_];
    if (step.use == CoeUse::kWrite) {
      coe_.download(step.index, step.sub, step.bytes);
    } else {
      coe_.upload(step.index, step.sub);
    }
    started_step_ = true;
  }
  coe_.process(now_ns, exchange, position_);
  if (coe_.busy() || !at_start) return;
  const CoeStep& step = steps_[step_];
  const bool good = coe_.status() == CoeClient::Status::kDone &&
                    (step.use == CoeUse::kWrite || std::ranges::equal(step.bytes, coe_.value()));
  if (!good) return fail(LineError::kSdo, now_ns);
  ++step_;
  started_step_ = false;
}

void SlaveMaster::take_running(Data data, std::int64_t now_ns) noexcept {
  const int part = std::exchange(part_, 0);
  if (part == 1) return clock_.take_difference(data, running());
  if (part == 2) {
    const auto status = get<std::uint16_t>(data.data());
    al_state_ = state_of(status);
    al_code_ = static_cast<AlCode>(get<std::uint16_t>(&data[4]));
    const AlState right = stage_ == SlaveStage::kReady ? AlState::kSafeOp : AlState::kOp;
    if (al_state_ != right || (status & ethercat::kAlError) != 0) {
      return fail(LineError::kLeftState, now_ns);
    }
    part_ = 3;
    return;
  }
  std::array<std::uint8_t, 2 * ethercat::kFmmuBytes> right{};
  put_fmmus(right);
  if (part == 3 && !std::ranges::equal(data, right)) fail(LineError::kMappingLost, now_ns);
}

}  // namespace tandem::hal::ecat
