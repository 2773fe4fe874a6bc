// ControllerHost: which controllers are there, and which of them are active.
#include "runtime/controller_host.hpp"

namespace tandem::runtime {
namespace {

LoopAnswer refuse(RejectReason why, std::size_t one) noexcept TANDEM_RT {
  return {.reason = why, .one = static_cast<std::int32_t>(one)};
}

}  // namespace

std::int32_t ControllerHost::claimant(std::size_t joint,
                                      ControllerSet by) const noexcept TANDEM_RT {
  for (std::size_t slot = 0; slot < table_.size(); ++slot) {
    if ((by & only(slot)) == 0 || table_[slot] == nullptr) continue;
    if (table_[slot]->claimed[joint] != 0) return static_cast<std::int32_t>(slot);
  }
  return -1;
}

LoopAnswer ControllerHost::insert(std::size_t slot,
                                  HostedController& controller) noexcept TANDEM_RT {
  table_[slot] = &controller;
  return {};
}

LoopAnswer ControllerHost::remove(std::size_t slot) noexcept TANDEM_RT {
  if (table_[slot] == nullptr) return refuse(RejectReason::kGone, slot);
  if (is_active(slot)) return refuse(RejectReason::kActive, slot);
  table_[slot] = nullptr;
  return {};
}

LoopAnswer ControllerHost::switch_over(ControllerSet stop, ControllerSet start, bool running,
                                       const hal::CycleTime& time,
                                       JointImages images) noexcept TANDEM_RT {
  const ControllerSet after = (active_ & ~stop) | start;
  for (std::size_t slot = 0; slot < table_.size(); ++slot) {
    const bool named = ((stop | start) & only(slot)) != 0;
    if (named && table_[slot] == nullptr) return refuse(RejectReason::kGone, slot);
    if (named && is_active(slot) != ((stop & only(slot)) != 0)) {
      return refuse(RejectReason::kActive, slot);
    }
  }
  if (const auto conflict = find_conflict(table_, after)) {
    return {.reason = RejectReason::kConflict,
            .joint = static_cast<std::int32_t>(conflict->joint),
            .one = static_cast<std::int32_t>(conflict->one),
            .other = static_cast<std::int32_t>(conflict->other)};
  }
  done_ &= ~(stop | start);
  ended_ &= ~(stop | start);
  set_active(after);
  if (!running) return {};
  for (std::size_t j = 0; j < capabilities_.size(); ++j) {
    if (claimant(j, stop | start) < 0) continue;
    references_.transfer().begin(j, images.state, images.command);
  }
  for (std::size_t slot = 0; slot < table_.size(); ++slot) {
    if ((stop & only(slot)) == 0) continue;
    enter(*table_[slot]).stop();
    for (const auto& claim : table_[slot]->claims) references_.release(claim.joint, images);
  }
  call_starts(start, time, images);
  return {};
}

/// The joints of controllers that were done in the cycle before: one that ended in motion brakes.
void ControllerHost::settle_ended(JointImages images) noexcept TANDEM_RT {
  for (std::size_t slot = 0; ended_ != 0 && slot < table_.size(); ++slot) {
    if ((ended_ & only(slot)) == 0 || table_[slot] == nullptr || !is_active(slot)) continue;
    for (const auto& claim : table_[slot]->claims) references_.end(claim.joint, images);
  }
  ended_ = 0;
}

bool ControllerHost::retreat(const hal::CycleTime& time, JointImages images) noexcept TANDEM_RT {
  ControllerSet retreating = 0;
  for (std::size_t slot = 0; slot < table_.size(); ++slot) {
    if (!is_active(slot) || (done_ & only(slot)) != 0) continue;
    Controller& controller = enter(*table_[slot]);
    if (controller.can_retreat() && controller.retreat(time, images.state))
      retreating |= only(slot);
  }
  leave_calls();
  if (retreating == 0) return false;
  (void)switch_over(active_ & ~retreating, 0, true, time, images);
  return true;
}

}  // namespace tandem::runtime
