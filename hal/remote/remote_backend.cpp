#include "hal/remote/remote_backend.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <span>

#include "hal/run_phase.hpp"

namespace tandem::remote {

using hal::RunPhase;
using hal::StopCategory;

namespace {

constexpr auto kSlice = std::chrono::milliseconds(20);  // exchange() looks around so often

/// For the first state, of a server that is connected: paused it sends none.
constexpr auto kFirstState = std::chrono::milliseconds(500);

bool all_finite(std::span<const double> values) {
  return std::ranges::all_of(values, [](double value) { return std::isfinite(value); });
}

/// Whether every number of it is one, and every state one that there is.
bool is_sound(const hal::StateImage& state) {
  for (const auto values :
       {state.position_rad(), state.velocity_rad_s(), state.acceleration_rad_s2(),
        state.torque_Nm(), state.motor_position_rad(), state.motor_velocity_rad_s(),
        state.current_A(), state.voltage_V(), state.temperature_C(), state.sensor()}) {
    if (!all_finite(values)) return false;
  }
  const auto up_to = [](auto last) {
    return [last](std::uint8_t one) { return one <= static_cast<std::uint8_t>(last); };
  };
  return std::ranges::all_of(state.drive_state(), up_to(hal::DriveState::kFault)) &&
         std::ranges::all_of(state.homing(), up_to(hal::HomingState::kHomed));
}

}  // namespace

Result<std::unique_ptr<RemoteBackend>> RemoteBackend::connect(dds::Participant& participant,
                                                              const hal::Robot& robot,
                                                              const LinkIdentity& identity,
                                                              const ClientConfig& config) {
  auto contact = ServerContact::find(participant, identity, config);
  if (!contact) return std::unexpected(contact.error());
  auto states = open_end<dds::Reader<tandem_msgs::LinkState>>(participant, kStateTopic);
  if (!states) return std::unexpected(states.error());
  auto commands = open_end<dds::Writer<tandem_msgs::LinkCommand>>(participant, kCommandTopic);
  if (!commands) return std::unexpected(commands.error());
  std::unique_ptr<RemoteBackend> made(
      new RemoteBackend(std::move(*contact), std::move(*states), std::move(*commands), robot));
  if (Status leased = made->contact_->take_lease(); !leased) {
    return std::unexpected(leased.error());
  }
  return made;
}

RemoteBackend::RemoteBackend(std::unique_ptr<ServerContact> contact,
                             dds::Reader<tandem_msgs::LinkState> states,
                             dds::Writer<tandem_msgs::LinkCommand> commands,
                             const hal::Robot& robot)
    : contact_(std::move(contact)),
      config_(contact_->config()),
      states_(std::move(states)),
      commands_(std::move(commands)),
      joints_(robot.joints.size()),
      senders_(states_.endpoint().get()),
      newest_(Seen{hal::StateImage(robot.shape()), hal::CommandImage(robot.shape()),
                   std::vector<std::uint8_t>(robot.joints.size())}),
      command_(robot.shape()),
      gains_(robot.joints.size() * 3 * hal::kPidLoops),
      revisions_(robot.joints.size()) {
  on_states_.emplace(states_.endpoint().get(), [this] { take_states(); });
}

std::string RemoteBackend::status_text() const {
  return contact_->status_text(static_cast<RunPhase>(phase_.load()));
}

bool RemoteBackend::first_state(hal::StateImage& state) {
  std::unique_lock lock(contact_->news().mutex);
  const auto seen = [this] {
    (void)newest_.refresh();
    return newest_.front().is_one;
  };
  if (!contact_->news().came.wait_for(lock, kFirstState, seen)) return false;
  state.assign(newest_.front().state);
  return true;
}

void RemoteBackend::take_states() {
  {
    const std::lock_guard lock(contact_->news().mutex);
    states_.take([this](const tandem_msgs::LinkState& sample, const auto& info) {
      if (!contact_->is_from(sample.run, senders_.of(info)) || !unpack(sample)) return;
      newest_.publish();
    });
  }
  contact_->news().came.notify_all();
}

/// False: not this robot's, or no numbers, which no server of it sends.
bool RemoteBackend::unpack(const tandem_msgs::LinkState& sample) {
  // The server goes on by itself after `done`: its next state is this run's last.
  if (left_in_ && sample.cycle > *left_in_ + 1) return false;
  Seen& to = newest_.back();
  if (sample.state._length != to.state.bytes().size() ||
      sample.command._length != to.command.bytes().size() || sample.causes._length != joints_) {
    return false;
  }
  std::memcpy(to.state.bytes().data(), sample.state._buffer, sample.state._length);
  std::memcpy(to.command.bytes().data(), sample.command._buffer, sample.command._length);
  if (!is_sound(to.state) || !is_sound(to.command)) return false;
  if (sample.reaction > static_cast<std::uint8_t>(StopCategory::kWarn)) return false;
  to.causes.assign(sample.causes._buffer, sample.causes._buffer + joints_);
  to.cycle = sample.cycle;
  to.owner = sample.owner;
  to.answered_cycle = sample.answered_cycle;
  to.source_cycle = sample.source_cycle;
  to.answered_ns = sample.answered_ns;
  to.sent_ns = sample.sent_ns;
  to.phase = sample.phase;
  to.code = sample.code;
  to.reaction = static_cast<hal::StopCategory>(sample.reaction);
  to.is_one = true;
  phase_ = sample.phase;
  contact_->heard();
  return true;
}

/// Whether exchange() has what it waits for, or waits in vain.
bool RemoteBackend::there() noexcept {
  if (newest_.refresh()) {
    const Seen& seen = newest_.front();
    fresh_ = first_ || seen.cycle > last_cycle_;
  }
  // One more state comes after `done`, whatever is heard of the lease meanwhile.
  if (fresh_ || (!left_in_ && contact_->is_over())) return true;
  return contact_->check_silence() || (config_.interrupted && config_.interrupted());
}

void RemoteBackend::exchange(const hal::CycleTime&) noexcept {
  if (done_ && config_.lockstep && !left_in_) {
    const std::lock_guard lock(contact_->news().mutex);
    left_in_ = last_cycle_;
  }
  if (pending_) send();
  fresh_ = false;
  missed_now_ = 0;
  {
    std::unique_lock lock(contact_->news().mutex);
    while (!there() && !config_.own_pace) contact_->news().came.wait_for(lock, kSlice);
    // Nobody gives the beat any more.
    if (!fresh_ && !config_.own_pace)
      contact_->news().came.wait_for(lock, std::chrono::milliseconds(1));
  }
  if (!fresh_) return;
  const std::uint64_t cycle = newest_.front().cycle;
  const std::uint64_t unseen = first_ ? 0 : cycle - last_cycle_ - 1;
  missed_now_ = config_.lockstep || config_.own_pace ? 0 : unseen;
  missed_ += done_ ? 0 : unseen;
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
    return contact_->is_gone() ? Code::kBusOff : Code::kTimeout;
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

hal::Phase RemoteBackend::phase() const noexcept {
  if (contact_->is_gone() || latched_ != StopCategory::kWarn) return hal::Phase::kFault;
  const Seen& seen = newest_.front();
  if (resetting_ || !seen.is_one) return hal::Phase::kBringUp;
  switch (static_cast<RunPhase>(seen.phase)) {
    case RunPhase::kRunning:
      return seen.owner == contact_->client() ? hal::Phase::kOperational : hal::Phase::kBringUp;
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
  if (contact_->is_gone() || ends || (done_ && seen.owner != contact_->client())) return true;
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
  sample.run = contact_->run();
  sample.client = contact_->client();
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
  (void)commands_.write(sample);
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
