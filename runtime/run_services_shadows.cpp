// Asking the loop for switches, at once or once shadows agree, for shadows and for another link.
#include <cmath>
#include <thread>
#include <utility>

#include "runtime/run_services.hpp"

namespace tandem::runtime {

Result<RequestResult> RunServices::begin_shadow(const std::string& name, Patience patience) {
  return ask_of_shadow(name, true, patience);
}

Result<RequestResult> RunServices::end_shadow(const std::string& name, Patience patience) {
  return ask_of_shadow(name, false, patience);
}

Result<RequestResult> RunServices::ask_of_shadow(const std::string& name, bool begins,
                                                 Patience patience) {
  Lock lock(mutex_);
  collect();
  if (Status phase = check_phase(); !phase) return std::unexpected(phase.error());
  const Result<std::size_t> slot = slot_of(name);
  if (!slot) return std::unexpected(slot.error());
  const bool runs = (host_->shadows().shown() & only(*slot)) != 0;
  if (begins && runs) {
    return fail_at(name, "is a shadow already", "tandem controller difference " + name);
  }
  if (begins && (planned() & only(*slot)) != 0) {
    return fail_at(name, "is active: a shadow runs beside the active ones",
                   "load it once more under another name: tandem controller load LIBRARY --name " +
                       name + "2");
  }
  return ask(lock,
             {.kind = begins ? CycleRequest::Kind::kShadow : CycleRequest::Kind::kEndShadow,
              .slot = static_cast<std::uint32_t>(*slot)},
             patience);
}

Result<RequestResult> RunServices::switch_when(const std::vector<std::string>& stop,
                                               const std::vector<std::string>& start, double within,
                                               std::int64_t wait_ns, Patience patience) {
  return ask_to_switch(stop, start,
                       {.kind = CycleRequest::Kind::kSwitchWhen,
                        .within = within,
                        .cycles = static_cast<std::uint64_t>(wait_ns / host_->period_ns())},
                       patience);
}

Result<RequestResult> RunServices::cancel_switch(Patience patience) {
  Lock lock(mutex_);
  collect();
  if (Status phase = check_phase(); !phase) return std::unexpected(phase.error());
  return ask(lock, {.kind = CycleRequest::Kind::kSwitchWhen}, patience);
}

Result<RequestResult> RunServices::ask_to_switch(const std::vector<std::string>& stop,
                                                 const std::vector<std::string>& start,
                                                 CycleRequest request, Patience patience) {
  Lock lock(mutex_);
  collect();
  if (Status phase = check_phase(); !phase) return std::unexpected(phase.error());
  const Result<ControllerSet> leaving = set_of(stop);
  if (!leaving) return std::unexpected(leaving.error());
  const Result<ControllerSet> coming = set_of(start);
  if (!coming) return std::unexpected(coming.error());
  if ((*leaving | *coming) == 0) {
    return fail("no controller is named", "name those to stop, to start, or both");
  }
  if (request.kind == CycleRequest::Kind::kSwitchWhen && *coming == 0) {
    return fail("no controller is to start, so nothing can agree",
                "name the shadow with --start, or switch without --when-within");
  }
  if (Status able = check_switch(*leaving, *coming); !able) return std::unexpected(able.error());
  request.start = *coming;
  request.stop = *leaving;
  return ask(lock, request, patience);
}

Result<RequestResult> RunServices::set_link(const hal::LinkChange& change, Patience patience) {
  Lock lock(mutex_);
  collect();
  if (Status phase = check_phase(); !phase) return std::unexpected(phase.error());
  if (!linked_) return std::unexpected(refusal({.reason = RejectReason::kNoLink}));
  return ask(lock, {.kind = CycleRequest::Kind::kLink, .link = change}, patience);
}

std::vector<ShadowStatus> RunServices::shadows() {
  const Lock lock(mutex_);
  collect();
  const ControllerSet shown = host_->shadows().shown();
  std::vector<ShadowStatus> all;
  for (std::size_t slot = 0; slot < kMostControllers; ++slot) {
    const auto& one = host_->owned()[slot];
    if (one == nullptr || one->leaves) continue;
    ShadowStatus status{.name = one->name,
                        .runs = (shown & only(slot)) != 0,
                        .look = {},
                        .claims = one->claims,
                        .joints = std::vector<JointDifference>(one->claims.size()),
                        .owners = {}};
    while (!one->shadow->shown.read({&status.look, 1})) std::this_thread::yield();
    while (!one->shadow->shown_joints.read(status.joints)) std::this_thread::yield();
    for (const JointDifference& joint : status.joints)
      status.owners.push_back(controller_name(joint.owner));
    if (status.runs || status.look.end != ShadowEnd::kNone) all.push_back(std::move(status));
  }
  return all;
}

}  // namespace tandem::runtime
