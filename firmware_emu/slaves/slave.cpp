// State machine as ETG.1000.6: checks on the way up, always allowed on the way down.
#include "firmware_emu/slaves/slave.hpp"

#include <algorithm>
#include <utility>

namespace tandem::firmware::esc {

using ethercat::AlCode;
using ethercat::AlState;
using ethercat::SyncManager;
using ethercat::SyncManagerUse;
namespace sii = ethercat::sii;

namespace {

constexpr std::uint16_t kLargestMailbox = 1024;

std::size_t default_bytes(const std::vector<PdoSetup>& pdos) {
  std::size_t bits = 0;
  for (const PdoSetup& pdo : pdos) {
    if (!pdo.assigned) continue;
    for (const std::uint32_t entry : pdo.entries) bits += entry & 0xFF;
  }
  return (bits + 7) / 8;
}

bool is_state(std::uint8_t number) noexcept {
  return number == 1 || number == 2 || number == 3 || number == 4 || number == 8;
}

}  // namespace

Status check(const SlaveSetup& setup) {
  const auto refuse = [](const std::string& what, const std::string& hint) {
    return fail_at("ethercat", what, hint);
  };
  if (setup.mailbox_bytes < ethercat::kMinMailboxBytes || setup.mailbox_bytes > kLargestMailbox) {
    return refuse("the mailbox has " + std::to_string(setup.mailbox_bytes) + " bytes",
                  "it has 23 to 1024");
  }
  for (const auto* pdos : {&setup.outputs, &setup.inputs}) {
    const std::uint16_t base = pdos == &setup.outputs ? 0x1600 : 0x1A00;
    const auto used = std::ranges::count(*pdos, true, &PdoSetup::assigned);
    if (used > static_cast<std::ptrdiff_t>(kMaxPdos) || pdos->size() > kMaxPdoObjects) {
      return refuse("too many PDOs", "4 each way at most, of 512");
    }
    if (default_bytes(*pdos) > kMaxProcessBytes) {
      return refuse("the process data is too long", "1024 bytes each way at most");
    }
    for (const PdoSetup& pdo : *pdos) {
      if (pdo.entries.size() > (pdo.fixed ? kMostPdoEntries : kMaxPdoEntries)) {
        return refuse("too many entries in a PDO", "32 at most, 254 of a fixed one");
      }
      if (pdo.index < base || pdo.index > base + 0x1FF) {
        return refuse("a PDO's object has a wrong index", "1600 to 17FF, and 1A00 to 1BFF");
      }
    }
  }
  return {};
}

sii::Content sii_content(const SlaveSetup& setup) {
  const std::uint16_t box = setup.mailbox_bytes;
  const auto in_at = static_cast<std::uint16_t>(kMailboxAt + box);
  const auto outputs = static_cast<std::uint16_t>(default_bytes(setup.outputs));
  const auto inputs = static_cast<std::uint16_t>(default_bytes(setup.inputs));
  return {
      .identity = setup.identity,
      .alias = 0,
      .mailbox = {.out_start = kMailboxAt, .out_bytes = box, .in_start = in_at, .in_bytes = box},
      .protocols = sii::kProtocolCoe,
      .name = setup.name,
      .managers = {
          {kMailboxAt, box, ethercat::kControlMailboxOut, true, SyncManagerUse::kMailboxOut},
          {in_at, box, ethercat::kControlMailboxIn, true, SyncManagerUse::kMailboxIn},
          {kOutputsAt, outputs, ethercat::kControlOutputs, outputs != 0, SyncManagerUse::kOutputs},
          {kInputsAt, inputs, ethercat::kControlInputs, inputs != 0, SyncManagerUse::kInputs}}};
}

Slave::Slave(const SlaveSetup& setup, canopen::ObjectDictionary& od)
    : Slave(setup, od, od, std::make_unique<ProcessData>(ProcessDirection::kOutputs, setup.outputs),
            std::make_unique<ProcessData>(ProcessDirection::kInputs, setup.inputs)) {}

Slave::Slave(const SlaveSetup& setup, canopen::ObjectDictionary& od,
             canopen::ObjectDictionary& application, std::unique_ptr<ProcessObjects> outputs,
             std::unique_ptr<ProcessObjects> inputs)
    : state_delay_ns_(setup.state_delay_ns),
      mailbox_bytes_(setup.mailbox_bytes),
      outputs_(std::move(outputs)),
      inputs_(std::move(inputs)),
      coe_(od, application, setup.mailbox_bytes),
      esc_(sii::build(sii_content(setup)), setup.has_dc, setup.clock) {
  od.add_value(0x1C00, 0, std::uint8_t{4});
  for (std::uint8_t number = 1; number <= 4; ++number) od.add_value(0x1C00, number, number);
  outputs_->add_to(od);
  inputs_->add_to(od);
}

void Slave::reset(std::int64_t now_ns) noexcept TANDEM_RT {
  esc_.reset(now_ns);
  enter(AlState::kInit, now_ns);
  requested_ = false;
  error_ = false;
  code_ = AlCode::kNone;
}

void Slave::process(std::int64_t now_ns) noexcept TANDEM_RT {
  esc_.process(now_ns);
  take_process_data();  // a master may ask for OP in the frame of its first outputs
  take_state_request(now_ns);
  if (state_ == AlState::kOp && outputs_->bytes() != 0 && esc_.watchdog_expired()) {
    fail(AlState::kSafeOp, AlCode::kWatchdog);
  }
  run_mailbox();
}

void Slave::take_state_request(std::int64_t now_ns) noexcept {
  std::uint16_t request = 0;
  if (esc_.take_al_request(request)) {
    const auto wanted = static_cast<std::uint8_t>(request & 0x1F);
    if (!requested_ || wanted != request_) requested_ns_ = now_ns;  // asked again, it waits on
    request_ = wanted;
    requested_ = true;
  }
  if (!requested_ || now_ns - requested_ns_ < state_delay_ns_) return;
  requested_ = false;
  change(request_, now_ns);
}

void Slave::change(std::uint8_t request, std::int64_t now_ns) noexcept {
  const bool acknowledges = (request & ethercat::kAlError) != 0;
  if (error_ && !acknowledges) return;
  const std::uint8_t number = request & ethercat::kAlStateMask;
  const auto wanted = static_cast<AlState>(number);
  AlCode code = is_state(number) ? try_enter(wanted) : AlCode::kUnknownState;
  const bool may_come = code == AlCode::kNoOutputs || code == AlCode::kNoSync;
  if (may_come && now_ns - requested_ns_ < kOpWaitNs) {
    requested_ = true;
    return;
  }
  error_ = code != AlCode::kNone;
  code_ = code;
  if (!error_ && wanted != state_) enter(wanted, now_ns);
  esc_.set_al(state_, error_, code_);
}

AlCode Slave::try_enter(AlState wanted) const noexcept {
  if (wanted == AlState::kBoot) return AlCode::kNoBoot;
  if (wanted <= state_) return AlCode::kNone;  // down, or where it is
  const bool next = (state_ == AlState::kInit && wanted == AlState::kPreOp) ||
                    (state_ == AlState::kPreOp && wanted == AlState::kSafeOp) ||
                    (state_ == AlState::kSafeOp && wanted == AlState::kOp);
  if (!next) return AlCode::kInvalidChange;
  if (wanted == AlState::kPreOp) return mailbox_is_right() ? AlCode::kNone : AlCode::kMailbox;
  if (wanted == AlState::kSafeOp) {
    const auto fits = [](const SyncManager& one, std::size_t bytes, bool writes) {
      if (bytes == 0) return !one.active;
      return one.active && !one.mailbox() && one.written() == writes && one.length == bytes &&
             one.start >= ethercat::reg::kRam && one.start + bytes <= kMemoryBytes;
    };
    if (!fits(esc_.manager(2), outputs_->bytes(), true)) return AlCode::kOutputs;
    if (!fits(esc_.manager(3), inputs_->bytes(), false)) return AlCode::kInputs;
    return AlCode::kNone;
  }
  if (outputs_->bytes() != 0 && !heard_outputs_) return AlCode::kNoOutputs;
  if (esc_.sync0_active() && esc_.sync0_pulses() == 0) return AlCode::kNoSync;
  return AlCode::kNone;
}

bool Slave::mailbox_is_right() const noexcept {
  const SyncManager out = esc_.manager(0);
  const SyncManager in = esc_.manager(1);
  const auto right = [this](const SyncManager& one, std::uint16_t start) {
    return one.active && one.mailbox() && one.start == start && one.length == mailbox_bytes_;
  };
  return right(out, kMailboxAt) && out.written() &&
         right(in, static_cast<std::uint16_t>(kMailboxAt + mailbox_bytes_)) && !in.written();
}

void Slave::enter(AlState state, std::int64_t now_ns) noexcept {
  if (state == AlState::kInit || state_ == AlState::kInit) {
    outputs_->reset();
    inputs_->reset();
    coe_.reset();
    esc_.clear_mailboxes();
    last_counter_ = 0;
    answer_bytes_ = 0;
  }
  if (state == AlState::kSafeOp && state_ == AlState::kPreOp) {
    outputs_->compile();
    inputs_->compile();
    heard_outputs_ = false;
  }
  if (state == AlState::kOp) esc_.arm_watchdog(now_ns);
  outputs_->set_open(state == AlState::kPreOp);
  inputs_->set_open(state == AlState::kPreOp);
  state_ = state;
}

void Slave::fail(AlState state, AlCode code) noexcept TANDEM_RT {
  state_ = state;
  error_ = true;
  code_ = code;
  esc_.set_al(state, true, code);
}

void Slave::run_mailbox() noexcept {
  if (state_ == AlState::kInit) return;
  if (esc_.answer_repeat()) return;
  if (answer_bytes_ == 0) {
    const std::span<const std::uint8_t> request = esc_.take_mailbox();
    if (request.empty()) return;
    ethercat::MailboxHeader header;
    const bool whole = ethercat::read_mailbox(request, header);
    // The same counter again: the master did not hear that the first one came.
    if (whole && header.counter != 0 && header.counter == last_counter_) return;
    if (whole) last_counter_ = header.counter;
    answer_bytes_ = coe_.answer(request, answer_);
  }
  if (answer_bytes_ != 0 && esc_.post_mailbox({answer_.data(), answer_bytes_})) answer_bytes_ = 0;
}

void Slave::take_process_data() noexcept {
  if (!esc_.take_outputs()) return;
  heard_outputs_ = true;
  if (state_ != AlState::kOp) return;
  const SyncManager manager = esc_.manager(2);
  const std::span<const std::uint8_t> image = esc_.memory(manager.start, manager.length);
  if (image.size() != outputs_->bytes() || image.empty()) return;
  outputs_->take(image);
  ++taken_;
}

void Slave::publish() noexcept TANDEM_RT {
  if (state_ != AlState::kSafeOp && state_ != AlState::kOp) return;
  const SyncManager manager = esc_.manager(3);
  const std::span<std::uint8_t> image = esc_.memory(manager.start, manager.length);
  if (image.size() == inputs_->bytes() && !image.empty()) inputs_->give(image);
}

void Slave::archive(Archive& ar) {
  outputs_->archive(ar);
  inputs_->archive(ar);
  ar(coe_, esc_, state_, code_, error_, requested_, heard_outputs_, request_, last_counter_,
     requested_ns_, taken_, answer_bytes_, answer_);
}

}  // namespace tandem::firmware::esc
