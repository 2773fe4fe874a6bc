// A former build of a controller gives its place, and where it can its state, to the new one.
#include <algorithm>

#include "runtime/controller_host.hpp"

namespace tandem::runtime {
namespace {

bool same_claims(const HostedController& one, const HostedController& other) noexcept TANDEM_RT {
  return std::ranges::equal(one.claims, other.claims, [](const auto& a, const auto& b) {
    return a.joint == b.joint && a.mode == b.mode && a.interaction == b.interaction &&
           a.with_modes == b.with_modes;
  });
}

/// Signals and marks, which stay until they are written.
void carry_shown(const HostedController& former, HostedController& next) noexcept TANDEM_RT {
  Succession& to = *next.succession;
  const ControllerIo& was = *former.io;
  ControllerIo& is = *next.io;
  to.signals.carry(was.signals.image(), is.signals.image(), is.signals);
  to.marks.carry(was.marks.bytes(), is.marks.bytes(), is.marks);
}

/// What it declared is the host's, and goes over by itself: also when its own state does not.
Kept hand_over(HostedController& former, HostedController& next) noexcept TANDEM_RT {
  Succession& to = *next.succession;
  carry_shown(former, next);
  next.io->texts = former.io->texts;
  for (const auto& [was, is] : to.parameters) next.io->parameters.take_over(*was, *is);
  if (!to.wanted) return Kept::kNotWanted;
  if (former.lacks_archive || next.lacks_archive) return Kept::kNoArchive;
  if (!same_claims(former, next)) return Kept::kOtherClaims;
  if (!to.controller.take(*former.controller, *next.controller)) return Kept::kOtherState;
  for (const auto& [was, is] : to.inputs) is->go_on_as(*was);
  return Kept::kState;
}

}  // namespace

CycleAnswer ControllerHost::replace(std::size_t slot, HostedController& next, bool running,
                                    const hal::CycleTime& time,
                                    JointImages images) noexcept TANDEM_RT {
  HostedController* const former = table_[slot];
  if (former == nullptr) {
    return {.reason = RejectReason::kGone, .one = static_cast<std::int32_t>(slot)};
  }
  if (shadows_.is_one(slot)) {
    shadows_.finish(slot, ShadowEnd::kReplaced);
    next.shadow->look = former->shadow->look;  // why it ended is asked of the new one
    next.shadow->show();
  }
  table_[slot] = &next;
  if (const auto conflict = find_conflict(table_, active_)) {
    table_[slot] = former;
    const std::size_t other = conflict->one == slot ? conflict->other : conflict->one;
    return {.reason = RejectReason::kTaken,
            .joint = static_cast<std::int32_t>(conflict->joint),
            .one = static_cast<std::int32_t>(slot),
            .other = static_cast<std::int32_t>(other)};
  }
  next.succession->kept = hand_over(*former, next);
  parameter_changes_.fetch_add(1, std::memory_order_release);
  done_ &= ~only(slot);
  ended_ &= ~only(slot);
  set_active(active_);
  if (!is_active(slot) || !running) return {};
  for (std::size_t j = 0; j < capabilities_.size(); ++j) {
    if (former->claimed[j] == 0 && next.claimed[j] == 0) continue;
    references_.transfer().begin(j, images.state, images.command);
  }
  InCall(*this, *former, ControllerFunction::kStop)->stop();
  if (next.succession->kept == Kept::kState) {
    go_on_as(*former, next, time, images);
    return {};
  }
  for (const auto& claim : former->claims) references_.release(claim.joint, images);
  call_starts(only(slot), time, images, false);
  return {};
}

/// It is started, for what its archive() leaves out, and then has the state all the same. What it
/// writes at its start is not commanded.
void ControllerHost::go_on_as(const HostedController& former, HostedController& next,
                              const hal::CycleTime& time, JointImages images) noexcept TANDEM_RT {
  discarded_.assign(images.command);
  guard_.remember(discarded_, gains_);
  InCall(*this, next, ControllerFunction::kStart)->start(time, images.state, discarded_);
  take_back(next, discarded_);
  (void)next.succession->controller.give(*next.controller);
  carry_shown(former, next);
}

}  // namespace tandem::runtime
