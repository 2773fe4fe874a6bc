// Who is active, and the calls of the cycle.
#include "runtime/controller_host.hpp"

#include <algorithm>
#include <utility>

#include "runtime/cycle_log.hpp"

namespace tandem::runtime {
namespace {

CycleAnswer refuse(RejectReason why, std::size_t one) noexcept TANDEM_RT {
  return {.reason = why, .one = static_cast<std::int32_t>(one)};
}

}  // namespace

ControllerHost::Slow ControllerHost::begin_cycle(std::int64_t late_ns) noexcept TANDEM_RT {
  std::int64_t active_ns = 0, shadows_ns = 0;
  for (const ControllerCall& call : calls()) (call.shadow ? shadows_ns : active_ns) += call.took_ns;
  Slow reason{.shadow = shadows_ns > 0 && late_ns > 0 && late_ns - shadows_ns < period_ns_};
  std::int64_t longest_ns = -1;
  if (reason.shadow || (late_ns > 0 && called_ > 0 && 2 * active_ns >= late_ns)) {
    for (const ControllerCall& call : calls()) {
      if (call.shadow != reason.shadow || call.took_ns <= longest_ns) continue;
      longest_ns = call.took_ns;
      reason.controller = static_cast<std::int32_t>(call.controller);
    }
  }
  called_ = 0;
  for (std::size_t slot = 0; reason.controller >= 0 && slot < table_.size(); ++slot) {
    const HostedController* const one = table_[slot];
    if (one == nullptr || static_cast<std::int32_t>(one->id) != reason.controller) continue;
    one->times->overruns.fetch_add(1, std::memory_order_relaxed);
    if (reason.shadow) shadows_.end_late(slot);
  }
  return reason;
}

ControllerHost::ControllerHost(const hal::RobotConfig& config, const tandem_kernels* kernels,
                               std::int64_t period_ns)
    : config_(&config),
      robot_(hal::robot_of(config)),
      gains_(hal::initial_parameters(config)),
      kernels_(kernels),
      period_ns_(period_ns),
      capabilities_(robot_.joints.begin(), robot_.joints.end()),
      owner_(robot_.joints.size(), -1),
      references_(robot_, capabilities_, gains_, period_ns),
      at_rest_(robot_.shape()),
      discarded_(robot_.shape()),
      guard_(robot_.shape(), capabilities_, gains_),
      shadows_(*this) {}

std::optional<ClaimConflict> ControllerHost::find_conflict(
    const Table& table, ControllerSet active) noexcept TANDEM_RT {
  for (std::size_t b = 0; b < table.size(); ++b) {
    if (table[b] == nullptr || (active & only(b)) == 0) continue;
    for (const auto& claim : table[b]->claims) {
      for (std::size_t a = 0; a < b; ++a) {
        if (table[a] == nullptr || (active & only(a)) == 0) continue;
        if (table[a]->claimed[claim.joint] != 0) return ClaimConflict{claim.joint, a, b};
      }
    }
  }
  return std::nullopt;
}

std::size_t ControllerHost::size() const noexcept {
  return static_cast<std::size_t>(
      std::ranges::count_if(owned_, [](const auto& one) { return one != nullptr; }));
}

ControllerHost::Shown ControllerHost::shown() const noexcept TANDEM_RT {
  const std::uint64_t both = shown_.load(std::memory_order_acquire);
  return {static_cast<ControllerSet>(both), static_cast<ControllerSet>(both >> 32)};
}

void ControllerHost::show() noexcept TANDEM_RT {
  shown_.store(active_ | (std::uint64_t{done_} << 32), std::memory_order_release);
}

void ControllerHost::set_active(ControllerSet active) noexcept TANDEM_RT {
  active_ = active;
  std::ranges::fill(owner_, -1);
  for (std::size_t slot = 0; slot < table_.size(); ++slot) {
    if (!is_active(slot)) continue;
    for (const auto& claim : table_[slot]->claims) {
      owner_[claim.joint] = static_cast<std::int32_t>(slot);
      references_.abandon(claim.joint);
    }
  }
  show();
}

std::int32_t ControllerHost::claimant(std::size_t joint,
                                      ControllerSet by) const noexcept TANDEM_RT {
  for (std::size_t slot = 0; slot < table_.size(); ++slot) {
    if ((by & only(slot)) == 0 || table_[slot] == nullptr) continue;
    if (table_[slot]->claimed[joint] != 0) return static_cast<std::int32_t>(slot);
  }
  return -1;
}

CycleAnswer ControllerHost::insert(std::size_t slot,
                                   HostedController& controller) noexcept TANDEM_RT {
  table_[slot] = &controller;
  return {};
}

CycleAnswer ControllerHost::remove(std::size_t slot) noexcept TANDEM_RT {
  if (table_[slot] == nullptr) return refuse(RejectReason::kGone, slot);
  if (is_active(slot)) return refuse(RejectReason::kActive, slot);
  if (shadows_.is_one(slot)) (void)shadows_.end(slot);
  table_[slot] = nullptr;
  return {};
}

CycleAnswer ControllerHost::set_parameters(
    std::span<const ParameterChange> changes) noexcept TANDEM_RT {
  for (const ParameterChange& change : changes) {
    if (table_[change.slot] == nullptr) return refuse(RejectReason::kGone, change.slot);
  }
  for (const ParameterChange& change : changes) {
    table_[change.slot]->io->parameters.set(*change.parameter, change.value);
  }
  parameter_changes_.fetch_add(1, std::memory_order_release);
  return {};
}

void ControllerHost::tell_parameters(const hal::CycleTime& time, CycleLog& log) noexcept TANDEM_RT {
  std::size_t most = kToldParameters;
  for (HostedController* one : table_) {
    for (; one != nullptr && most > 0 && one->told < one->loaded.size(); --most) {
      const ParameterChange& its = one->loaded[one->told++];
      if (its.parameter->was_set) continue;
      log.event(time, log::EventKind::kParameterLoaded, its);
    }
  }
}

CycleAnswer ControllerHost::switch_over(ControllerSet stop, ControllerSet start, bool running,
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
    InCall(*this, *table_[slot], ControllerFunction::kStop)->stop();
    for (const auto& claim : table_[slot]->claims) references_.release(claim.joint, images);
  }
  for (std::size_t slot = 0; slot < table_.size(); ++slot) {
    if ((start & only(slot)) == 0 || !shadows_.is_one(slot)) continue;
    if (!shadows_.has_started(slot)) {
      shadows_.finish(slot, ShadowEnd::kLeads);
      continue;
    }
    shadows_.lead(slot, images.command);
    start &= ~only(slot);  // it goes on
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
    const InCall controller(*this, *table_[slot], ControllerFunction::kRetreat);
    if (controller->can_retreat() && controller->retreat(time, images.state))
      retreating |= only(slot);
  }
  if (retreating == 0) return false;
  shadows_.end_all(ShadowEnd::kStopped);
  (void)switch_over(active_ & ~retreating, 0, true, time, images);
  return true;
}

void ControllerHost::start(const hal::CycleTime& time, JointImages images) noexcept TANDEM_RT {
  references_.start(owner_, images);
  done_ = ended_ = 0;
  call_starts(active_, time, images);
}

std::size_t ControllerHost::inputs() const noexcept TANDEM_RT {
  std::size_t all = 0;
  for (const HostedController* one : table_) all += one == nullptr ? 0 : one->inputs.size();
  return all;
}

void ControllerHost::take_inputs(const hal::CycleTime& time, bool open,
                                 CycleLog& log) noexcept TANDEM_RT {
  for (std::size_t slot = 0; slot < table_.size(); ++slot) {
    if (!is_active(slot) && !shadows_.is_one(slot)) continue;
    for (const auto& port : table_[slot]->inputs) {
      if (port->take(time, open, *outside_)) log.input(time, *port);
    }
  }
}

Code ControllerHost::update(const hal::CycleTime& time, JointImages images) noexcept TANDEM_RT {
  settle_ended(images);
  references_.before_update(images.command);
  bool ends = active_ != 0;
  for (std::size_t slot = 0; slot < table_.size(); ++slot) {
    if (!is_active(slot)) continue;
    HostedController& one = *table_[slot];
    if ((done_ & only(slot)) == 0) {
      updated_ |= only(slot);
      const Code code = call_update(one, time, images);
      if (code == Code::kStopped) {
        done_ |= only(slot);
        ended_ |= only(slot);
      } else if (code != Code::kOk) {
        failed_controller_ = one.id;
        return code;
      }
    }
    ends = ends && (done_ & only(slot)) != 0 && one.of_experiment;
  }
  shadows_.offer(images.command);
  references_.after_update(images);
  show();
  return ends ? Code::kStopped : Code::kOk;
}

/// `state`, but with the joints that `start` claims, and that brake, where they come to rest.
const hal::StateImage& ControllerHost::at_rest(const hal::StateImage& state,
                                               ControllerSet start) noexcept TANDEM_RT {
  bool brakes = false;
  for (std::size_t slot = 0; slot < table_.size(); ++slot) {
    if ((start & only(slot)) == 0 || table_[slot] == nullptr) continue;
    for (const auto& claim : table_[slot]->claims) {
      const double way_rad = references_.way_rad(claim, state);
      if (way_rad == 0.0) continue;
      if (!brakes) at_rest_.assign(state);
      brakes = true;
      at_rest_.position_rad()[claim.joint] += way_rad;
      at_rest_.velocity_rad_s()[claim.joint] = 0.0;
    }
  }
  return brakes ? at_rest_ : state;
}

/// Each in the modes of its claims.
/// @param inputs_wait  false: samples that wait arrive all the same, in this cycle
void ControllerHost::call_starts(ControllerSet start, const hal::CycleTime& time,
                                 JointImages images, bool inputs_wait) noexcept TANDEM_RT {
  for (std::size_t slot = 0; slot < table_.size(); ++slot) {
    if ((start & only(slot)) == 0) continue;
    for (const auto& claim : table_[slot]->claims) references_.take_up(claim, images.command);
  }
  const hal::StateImage& shown = at_rest(images.state, start);
  for (std::size_t slot = 0; slot < table_.size(); ++slot) {
    if ((start & only(slot)) == 0) continue;
    HostedController& one = *table_[slot];
    for (const auto& port : one.inputs) port->begin(time, inputs_wait, *outside_);
    guard_.remember(images.command, gains_);
    InCall(*this, one, ControllerFunction::kStart)->start(time, shown, images.command);
    take_back(one, images.command);
  }
}

Code ControllerHost::call_update(HostedController& one, const hal::CycleTime& time,
                                 JointImages images) noexcept TANDEM_RT {
  guard_.remember(images.command, gains_);
  const Code code =
      InCall(*this, one, ControllerFunction::kUpdate)->update(time, images.state, images.command);
  one.io->parameters.seen();
  take_back(one, images.command);
  return code;
}

/// Reports each controller and joint once, and at most one a cycle: others follow in later cycles.
void ControllerHost::take_back(HostedController& one,
                               hal::CommandImage& command) noexcept TANDEM_RT {
  const std::int32_t joint =
      guard_.take_back(one.claims, one.claimed, one.strayed, command, gains_);
  if (joint < 0 || stray_) return;
  one.strayed[static_cast<std::size_t>(joint)] = 1;
  stray_ = Stray{one.id, static_cast<std::size_t>(joint)};
}

void ControllerHost::stop() noexcept TANDEM_RT {
  for (std::size_t slot = 0; slot < table_.size(); ++slot) {
    if (is_active(slot)) InCall(*this, *table_[slot], ControllerFunction::kStop)->stop();
  }
  shadows_.end_all(ShadowEnd::kStopped);
}

std::uint64_t ControllerHost::fingerprint() const noexcept {
  std::uint64_t hash = 0xCBF29CE484222325U;  // FNV-1a
  const auto add = [&hash](std::uint64_t value) { hash = (hash ^ value) * 0x100000001B3U; };
  for (std::size_t slot = 0; slot < table_.size(); ++slot) {
    if (table_[slot] == nullptr) continue;
    add(slot);
    for (const char letter : table_[slot]->name) add(static_cast<unsigned char>(letter));
    for (const char letter : table_[slot]->sha256) add(static_cast<unsigned char>(letter));
    for (const auto& claim : table_[slot]->claims) {
      add(claim.joint);
      add(static_cast<std::uint64_t>(claim.mode));
      add(static_cast<std::uint64_t>(claim.interaction));
    }
    add(table_[slot]->io->parameters.rows().size());
  }
  return hash;
}

std::size_t ControllerHost::forget_waiting() {
  std::size_t samples = 0;
  for (const HostedController* one : table_) {
    if (one == nullptr) continue;
    for (const auto& port : one->inputs) samples += port->forget_waiting() ? 1 : 0;
  }
  return samples;
}

void ControllerHost::archive(Archive& ar) {
  for (HostedController* one : table_) {
    if (one == nullptr) continue;
    one->controller->archive(ar);
    ar(*one->io, one->strayed);
    for (const auto& port : one->inputs) ar(*port);
  }
  ar(active_, done_, ended_, failed_controller_, references_, gains_);
  if (ar.reading()) {
    guard_.forget(gains_);
    parameter_changes_.fetch_add(1, std::memory_order_release);
  }
  for (std::size_t slot = 0; slot < table_.size(); ++slot) {
    if (table_[slot] == nullptr) active_ &= ~only(slot);  // bytes of something else
  }
  set_active(active_);
  ar(shadows_);
}

}  // namespace tandem::runtime
