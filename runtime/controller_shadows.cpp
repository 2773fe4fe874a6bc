#include "runtime/controller_shadows.hpp"

#include <cmath>
#include <limits>
#include <thread>

#include "runtime/controller_host.hpp"

namespace tandem::runtime {
namespace {

constexpr std::int64_t kNeverDue = std::numeric_limits<std::int64_t>::max();

}  // namespace

const char* to_string(SwitchState state) noexcept {
  switch (state) {
    case SwitchState::kNone: return "none";
    case SwitchState::kWaits: return "waits";
    case SwitchState::kDone: return "done";
    case SwitchState::kTimeOut: return "time out";
    case SwitchState::kGivenUp: return "given up";
    case SwitchState::kRefused: return "refused";
  }
  return "?";
}

ControllerShadows::ControllerShadows(ControllerHost& host)
    : host_(host),
      led_(host.robot_.shape()),
      guard_(host.robot_.shape(), host.capabilities_, host.gains_),
      gains_(host.gains_) {}

SwitchLook ControllerShadows::last_switch() const noexcept {
  SwitchLook look;
  while (!shown_switch_.read({&look, 1})) std::this_thread::yield();
  return look;
}

Shadow& ControllerShadows::at(std::size_t slot) const noexcept TANDEM_RT {
  return *host_.table_[slot]->shadow;
}

void ControllerShadows::show() noexcept TANDEM_RT { shown_.store(set_, std::memory_order_release); }

// At a cycle's boundary.

CycleAnswer ControllerShadows::begin(std::size_t slot,
                                     const hal::CycleTime& time) noexcept TANDEM_RT {
  const auto refused = [slot](RejectReason why) {
    return CycleAnswer{.reason = why, .one = static_cast<std::int32_t>(slot)};
  };
  HostedController* const one = host_.table_[slot];
  if (one == nullptr) return refused(RejectReason::kGone);
  if (host_.is_active(slot) || is_one(slot)) return refused(RejectReason::kActive);
  set_ |= only(slot);
  starting_ |= only(slot);
  compared_ &= ~only(slot);
  for (const auto& port : one->inputs) port->begin(time, true, *host_.outside_);
  one->shadow->begin(time.cycle);
  one->shadow->show();
  show();
  return {};
}

CycleAnswer ControllerShadows::end(std::size_t slot) noexcept TANDEM_RT {
  const auto one = static_cast<std::int32_t>(slot);
  if (host_.table_[slot] == nullptr) return {.reason = RejectReason::kGone, .one = one};
  if (!is_one(slot)) return {.reason = RejectReason::kNoShadow, .one = one};
  finish(slot, ShadowEnd::kRequested);
  return {};
}

void ControllerShadows::end_all(ShadowEnd why) noexcept TANDEM_RT {
  for (std::size_t slot = 0; set_ != 0 && slot < kMostControllers; ++slot) {
    if (is_one(slot)) finish(slot, why);
  }
}

void ControllerShadows::finish(std::size_t slot, ShadowEnd why, std::int32_t joint,
                               Code code) noexcept TANDEM_RT {
  HostedController& one = *host_.table_[slot];
  if (has_started(slot) && why != ShadowEnd::kLeads) {
    const bool within = std::exchange(at_work_, true);
    ControllerHost::InCall(host_, one, ControllerFunction::kStop)->stop();
    at_work_ = within;
  }
  set_ &= ~only(slot);
  starting_ &= ~only(slot);
  compared_ &= ~only(slot);
  if (why != ShadowEnd::kRequested && why != ShadowEnd::kLeads) ended_ |= only(slot);
  one.shadow->look.end = why;
  one.shadow->look.joint = joint;
  one.shadow->look.code = code;
  one.shadow->show();
  if (waiting_ && (waiting_->start & only(slot)) != 0)
    (void)give_up(SwitchEnd::kNoShadow, look_.cycle);
  show();
}

void ControllerShadows::lead(std::size_t slot, hal::CommandImage& command) noexcept TANDEM_RT {
  for (const auto& claim : host_.table_[slot]->claims)
    copy_joint(command, at(slot).wants, claim.joint);
  finish(slot, ShadowEnd::kLeads);
}

CycleAnswer ControllerShadows::wait_for(const WaitingSwitch& wanted,
                                        std::uint64_t cycle) noexcept TANDEM_RT {
  if (waiting_) return {.reason = RejectReason::kWaits};
  for (std::size_t slot = 0; slot < kMostControllers; ++slot) {
    const auto one = static_cast<std::int32_t>(slot);
    if ((wanted.start & only(slot)) != 0 && !is_one(slot))
      return {.reason = RejectReason::kNoShadow, .one = one};
    if ((wanted.stop & only(slot)) != 0 && !host_.is_active(slot))
      return {.reason = RejectReason::kActive, .one = one};
  }
  waiting_ = wanted;
  look_ = {.asked = cycle, .cycle = cycle, .state = SwitchState::kWaits};
  shown_switch_.write({&look_, 1});
  return {};
}

bool ControllerShadows::agree(std::uint64_t cycle) noexcept TANDEM_RT {
  bool agrees = true;
  look_.cycle = cycle;
  look_.joint = -1;
  look_.difference = 0.0;
  for (std::size_t slot = 0; slot < kMostControllers; ++slot) {
    if ((waiting_->start & only(slot)) == 0) continue;
    if ((compared_ & only(slot)) == 0) {
      agrees = false;
      continue;
    }
    const auto& claims = host_.table_[slot]->claims;
    for (std::size_t i = 0; i < claims.size(); ++i) {
      const JointDifference& one = at(slot).joints[i];
      const auto used = references_of(one.mode);
      const bool same =
          one.mode == one.commanded_mode && one.interaction == one.commanded_interaction;
      const double apart = !same ? std::numeric_limits<double>::quiet_NaN()
                           : used.empty()
                               ? 0.0
                               : std::abs(one.now[static_cast<std::size_t>(used.front())]);
      agrees = agrees && apart <= waiting_->within;
      // Another mode is farther away than any number.
      const bool farther = !(apart <= look_.difference);
      if (std::isnan(look_.difference) || !farther) continue;
      look_.difference = apart;
      look_.joint = static_cast<std::int32_t>(claims[i].joint);
    }
  }
  shown_switch_.write({&look_, 1});
  return agrees;
}

bool ControllerShadows::lost_its_premise() const noexcept TANDEM_RT {
  for (std::size_t slot = 0; waiting_ && slot < kMostControllers; ++slot)
    if ((waiting_->stop & only(slot)) != 0 && !host_.is_active(slot)) return true;
  return false;
}

CycleAnswer ControllerShadows::give_up(SwitchEnd why, std::uint64_t cycle) noexcept TANDEM_RT {
  if (!waiting_) return {.reason = RejectReason::kNoneWaits};
  settle(SwitchState::kGivenUp, cycle);
  switch_end_ = why;
  return {};
}

void ControllerShadows::settle(SwitchState state, std::uint64_t cycle) noexcept TANDEM_RT {
  waiting_.reset();
  look_.state = state;
  look_.cycle = cycle;
  shown_switch_.write({&look_, 1});
}

// The cycle.

void ControllerShadows::offer(const hal::CommandImage& led) noexcept TANDEM_RT {
  if (set_ == 0) return;
  led_.assign(led);
  offered_ = true;
}

bool ControllerShadows::has_room(const Shadow& shadow,
                                 std::int64_t due_ns) const noexcept TANDEM_RT {
  if (!real_time_ || host_.clock_ == nullptr) return true;
  return host_.clock_->now_ns() + shadow.took_ns + tail_ns_ <= due_ns;
}

void ControllerShadows::run(const hal::CycleTime& time, const hal::StateImage& state,
                            std::int64_t due_ns) noexcept TANDEM_RT {
  compared_ = 0;
  done_ns_ = -1;
  if (!std::exchange(offered_, false)) return;
  real_time_ = due_ns != kNeverDue;
  keep_gains();
  for (std::size_t slot = 0; set_ != 0 && slot < kMostControllers; ++slot) {
    if (!is_one(slot)) continue;
    Shadow& shadow = at(slot);
    if (has_room(shadow, due_ns)) {
      shadow.missed_in_a_row = 0;
      call(slot, time, state);
      continue;
    }
    ++shadow.look.missed;
    if (++shadow.missed_in_a_row == kMostMissed) finish(slot, ShadowEnd::kLate);
  }
}

void ControllerShadows::end_late(std::size_t slot) noexcept TANDEM_RT {
  if (real_time_ && is_one(slot)) finish(slot, ShadowEnd::kLate);
}

void ControllerShadows::note_end_of_cycle(std::int64_t now_ns) noexcept TANDEM_RT {
  if (done_ns_ >= 0) tail_ns_ = now_ns - done_ns_;
}

void ControllerShadows::call(std::size_t slot, const hal::CycleTime& time,
                             const hal::StateImage& state) noexcept TANDEM_RT {
  HostedController& one = *host_.table_[slot];
  Shadow& shadow = *one.shadow;
  const std::int64_t begin_ns = host_.clock_ == nullptr ? 0 : host_.clock_->now_ns();
  std::int32_t stray = -1;
  at_work_ = true;
  const Code code = call(one, (starting_ & only(slot)) != 0, time, state, stray);
  starting_ &= ~only(slot);
  host_.updated_ |= only(slot);
  ++shadow.look.calls;
  const std::int32_t not_finite = shadow.not_finite(one.claims);
  if (code == Code::kStopped) {
    finish(slot, ShadowEnd::kDone);
  } else if (code != Code::kOk) {
    finish(slot, ShadowEnd::kCode, -1, code);
  } else if (stray >= 0) {
    finish(slot, ShadowEnd::kStray, stray);
  } else if (not_finite >= 0) {
    finish(slot, ShadowEnd::kNotFinite, not_finite);
  } else {
    shadow.compare(one.claims, led_, host_.owner_);
    compared_ |= only(slot);
    shadow.show();
  }
  at_work_ = false;
  put_gains_back();
  done_ns_ = host_.clock_ == nullptr ? 0 : host_.clock_->now_ns();
  shadow.took_ns = done_ns_ - begin_ns;
}

/// As ControllerHost calls an active one, but with a command of its own.
Code ControllerShadows::call(HostedController& one, bool starts, const hal::CycleTime& time,
                             const hal::StateImage& state, std::int32_t& stray) noexcept TANDEM_RT {
  hal::CommandImage& wants = one.shadow->wants;
  for (std::size_t j = 0; j < one.claimed.size(); ++j) {
    if (starts || one.claimed[j] == 0) copy_joint(wants, led_, j);
  }
  wants.cycle()[0] = time.cycle;
  wants.time_ns()[0] = time.time_ns;
  const auto take_back = [&] {
    const std::int32_t joint =
        guard_.take_back(one.claims, one.claimed, one.strayed, wants, host_.gains_);
    if (stray < 0) stray = joint;
  };
  if (starts) {
    for (const auto& claim : one.claims) host_.references_.take_up(claim, wants);
    guard_.remember(wants, host_.gains_);
    ControllerHost::InCall(host_, one, ControllerFunction::kStart)->start(time, state, wants);
    take_back();
  }
  guard_.remember(wants, host_.gains_);
  const Code code =
      ControllerHost::InCall(host_, one, ControllerFunction::kUpdate)->update(time, state, wants);
  one.io->parameters.seen();
  take_back();
  return code;
}

void ControllerShadows::keep_gains() noexcept TANDEM_RT {
  for (std::size_t j = 0; j < gains_.joints(); ++j) {
    if (gains_.revision(j) != host_.gains_.revision(j)) gains_.copy_joint(j, host_.gains_);
  }
}

/// What a shadow sets of its joints' drives is not set.
void ControllerShadows::put_gains_back() noexcept TANDEM_RT {
  for (std::size_t j = 0; j < gains_.joints(); ++j) {
    if (gains_.revision(j) != host_.gains_.revision(j)) host_.gains_.copy_joint(j, gains_);
  }
}

void ControllerShadows::archive(Archive& ar) {
  bool waits = waiting_.has_value();
  WaitingSwitch waiting = waiting_.value_or(WaitingSwitch{});
  ar(set_, starting_, compared_, waits, waiting, look_, switch_end_);
  if (set_ != 0) ar(led_);
  for (std::size_t slot = 0; slot < kMostControllers; ++slot) {
    if (host_.table_[slot] == nullptr) set_ &= ~only(slot);  // bytes of something else
    if (is_one(slot)) ar(at(slot));
  }
  if (!ar.reading()) return;
  if (waits) {
    waiting_ = waiting;
  } else {
    waiting_.reset();
  }
  offered_ = false;
  ended_ = 0;
  guard_.forget(host_.gains_);
  gains_ = host_.gains_;
  for (std::size_t slot = 0; slot < kMostControllers; ++slot) {
    if (is_one(slot)) at(slot).show();
  }
  shown_switch_.write({&look_, 1});
  show();
}

}  // namespace tandem::runtime
