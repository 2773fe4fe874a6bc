// The backend's calls in the cycle. Connecting: remote_connect.cpp.
#include "hal/remote/remote_backend.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>

#include "hal/run_phase.hpp"

namespace tandem::remote {

using hal::RunPhase;
using hal::StopCategory;

namespace {

constexpr auto kSlice = std::chrono::milliseconds(20);  // exchange() looks around so often

}  // namespace

/// Whether exchange() has what it waits for, or waits in vain.
bool RemoteBackend::there() noexcept {
  if (newest_.refresh()) {
    const Seen& seen = newest_.front();
    fresh_ = first_ || seen.cycle > last_cycle_;
  }
  // One more state comes after `done`, whatever is heard of the lease meanwhile.
  if (fresh_ || (!left_in_ && (ending_ || lost_))) return true;
  const auto timeout_ns = static_cast<std::int64_t>(config_.server_timeout_s * 1e9);
  const std::int64_t heard_ns = heard_ns_.load(std::memory_order_relaxed);
  if (silence_.of(heard_ns, clock_ns(CLOCK_MONOTONIC), timeout_ns / 4) > timeout_ns) gone_ = true;
  return gone_ || (config_.interrupted && config_.interrupted());
}

void RemoteBackend::exchange(const hal::CycleTime&) noexcept {
  if (done_ && config_.lockstep && !left_in_) {
    const std::lock_guard lock(mutex_);
    left_in_ = last_cycle_;
  }
  if (pending_) send();
  if (config_.own_pace) return look();
  fresh_ = false;
  missed_now_ = 0;
  {
    std::unique_lock lock(mutex_);
    while (!there()) news_.wait_for(lock, kSlice);
    // Nobody gives the beat any more.
    if (!fresh_) news_.wait_for(lock, std::chrono::milliseconds(1));
  }
  if (!fresh_) return;
  const std::uint64_t cycle = newest_.front().cycle;
  missed_now_ = first_ || config_.lockstep ? 0 : cycle - last_cycle_ - 1;
  missed_ += first_ || done_ ? 0 : cycle - last_cycle_ - 1;
  last_cycle_ = cycle;
  first_ = false;
}

/// For a state that is there, without waiting for one.
void RemoteBackend::look() noexcept {
  fresh_ = false;
  {
    const std::lock_guard lock(mutex_);
    (void)there();
  }
  if (!fresh_) return;
  const std::uint64_t cycle = newest_.front().cycle;
  missed_ += first_ || done_ ? 0 : cycle - last_cycle_ - 1;
  last_cycle_ = cycle;
  first_ = false;
}

void RemoteBackend::post(const hal::CommandImage& command) noexcept {
  command_.assign(command);
  send();
}

Code RemoteBackend::read(const hal::CycleTime& time, hal::StateImage& state) noexcept TANDEM_RT {
  const Seen& seen = newest_.front();
  if (!fresh_) {
    for (std::uint32_t& age : state.age_cycles()) ++age;
    for (std::uint32_t& age : state.sensor_age_cycles()) ++age;
    return is_gone() ? Code::kBusOff : Code::kTimeout;
  }
  state.assign(seen.state);
  cycles_ahead_ = seen.cycle - time.cycle;
  ahead_ns_ = seen.state.time_ns()[0] - time.time_ns;
  if (seen.answered_ns != answered_ns_) {
    answered_ns_ = seen.answered_ns;
    if (answered_ns_ != 0) turn_around_.record(clock_ns(CLOCK_MONOTONIC) - answered_ns_);
  }
  if (resetting_ && seen.answered_cycle >= reset_after_) resetting_ = false;
  if (seen.reaction == StopCategory::kWarn) clearing_ = false;
  return static_cast<Code>(seen.code) == Code::kTimeout ? Code::kTimeout : Code::kOk;
}

bool RemoteBackend::is_gone() const noexcept TANDEM_RT {
  return gone_.load(std::memory_order_relaxed) || lost_.load(std::memory_order_relaxed) ||
         ending_.load(std::memory_order_relaxed);
}

hal::Phase RemoteBackend::phase() const noexcept {
  if (is_gone() || latched_ != StopCategory::kWarn) return hal::Phase::kFault;
  const Seen& seen = newest_.front();
  if (resetting_ || !seen.is_one) return hal::Phase::kBringUp;
  switch (static_cast<RunPhase>(seen.phase)) {
    case RunPhase::kRunning:
      return seen.owner == client_ ? hal::Phase::kOperational : hal::Phase::kBringUp;
    case RunPhase::kBringUp:
    case RunPhase::kSettling:
    case RunPhase::kResetting:
    case RunPhase::kHeld: return hal::Phase::kBringUp;
    case RunPhase::kRetreating:
    case RunPhase::kFaulted:
    case RunPhase::kShutDown:
    case RunPhase::kDone: break;
  }
  return hal::Phase::kFault;
}

/// For the next exchange() to send; in the server's count of cycles.
void RemoteBackend::keep(const hal::CommandImage& command) noexcept TANDEM_RT {
  command_.assign(command);
  if (!config_.own_pace) command_.cycle()[0] += cycles_ahead_;
  command_.time_ns()[0] += ahead_ns_;
  pending_ = true;
}

Code RemoteBackend::write(const hal::CommandImage& command,
                          const hal::ParameterImage& parameters) noexcept TANDEM_RT {
  live_ = phase() == hal::Phase::kOperational;
  keep(command);
  // A server in fault follows no command: it is asked for a reset, of every joint.
  const bool clears = std::ranges::any_of(command.fault_reset(), [](auto one) { return one != 0; });
  if (clears && !clears_ && !live_) ++resets_;
  clears_ = clears;
  for (std::size_t j = 0; j < joints_; ++j) {
    if (revisions_[j] == parameters.revision(j)) continue;
    revisions_[j] = parameters.revision(j);
    gains_pending_ = true;
  }
  if (!gains_pending_) return Code::kOk;
  for (std::size_t i = 0; i < gains_.size(); i += 3) {
    const hal::PidGains& gains =
        parameters.gains(i / kGainsPerJoint, static_cast<hal::PidLoop>(i % kGainsPerJoint / 3));
    gains_[i] = gains.kp;
    gains_[i + 1] = gains.ki;
    gains_[i + 2] = gains.kd;
  }
  return Code::kOk;
}

void RemoteBackend::last_command(const hal::CommandImage& command) noexcept TANDEM_RT {
  if (done_) return;
  live_ = phase() == hal::Phase::kOperational;
  keep(command);
  ends_with_command_ = true;
}

bool RemoteBackend::shut_down() noexcept TANDEM_RT {
  const Seen& seen = newest_.front();
  const bool ends = seen.is_one && hal::ends(static_cast<RunPhase>(seen.phase));
  if (is_gone() || ends || (done_ && seen.owner != client_)) return true;
  if (!done_) {
    live_ = live_ && ends_with_command_;
    pending_ = true;
  }
  done_ = true;
  return false;
}

void RemoteBackend::send() noexcept {
  const Seen& seen = newest_.front();
  pending_ = false;
  tandem_msgs::LinkCommand sample{};
  sample.run = run_;
  sample.client = client_;
  sample.sequence_number = ++sequence_;
  sample.cycle = seen.cycle;
  sample.state_ns = seen.sent_ns;
  sample.sent_ns = clock_ns(CLOCK_MONOTONIC);
  sample.live = live_;
  sample.done = done_;
  sample.stop = static_cast<std::uint8_t>(asked_);
  sample.stops = stops_;
  sample.resets = resets_;
  sample.command._buffer = reinterpret_cast<std::uint8_t*>(command_.bytes().data());
  sample.command._length = sample.command._maximum =
      static_cast<std::uint32_t>(command_.bytes().size());
  if (gains_pending_) {
    sample.gains._buffer = gains_.data();
    sample.gains._length = sample.gains._maximum = static_cast<std::uint32_t>(gains_.size());
    gains_pending_ = false;
  }
  (void)endpoints_.commands.write(sample);
}

bool RemoteBackend::command_in_force(hal::CommandImage& command) const noexcept TANDEM_RT {
  if (!newest_.front().is_one) return false;
  command.assign(newest_.front().command);
  return true;
}

/// A stop that the server has carried out already is not asked for again: its category is the
/// server's. From a reset on, until nothing is latched there, what it shows is what that clears.
void RemoteBackend::stop(StopCategory category) noexcept TANDEM_RT {
  if (category == StopCategory::kWarn) return;
  const bool known = !clearing_ && newest_.front().reaction <= category;
  if (latched_ <= category) return;
  latched_ = category;
  if (known) return;
  asked_ = category;
  ++stops_;
}

void RemoteBackend::reset() noexcept TANDEM_RT {
  latched_ = StopCategory::kWarn;
  ++resets_;
  resetting_ = clearing_ = true;
  reset_after_ = last_cycle_;
}

hal::FaultCause RemoteBackend::fault_cause(std::size_t joint) const noexcept TANDEM_RT {
  const auto told = static_cast<hal::FaultCause>(newest_.front().causes[joint]);
  return hal::is_of_drive(told) ? told : hal::FaultCause::kDrive;  // a network says anything
}

std::string RemoteBackend::fault_text(hal::FaultCause cause, std::uint32_t code) const {
  if (cause == hal::FaultCause::kDrive && config_.error_text) return config_.error_text(code);
  return Backend::fault_text(cause, code);
}

bool RemoteBackend::archive(Archive&) { return false; }

}  // namespace tandem::remote
