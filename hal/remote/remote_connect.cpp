// How a client finds a server, gets the robot, keeps it, and gives it back.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <span>

#include "hal/homing.hpp"
#include "hal/remote/remote_backend.hpp"
#include "hal/run_phase.hpp"

namespace tandem::remote {
namespace {

using SteadyClock = std::chrono::steady_clock;
using hal::StopCategory;
constexpr double kLongestLease_s = 1e9;  // that a clock can count
/// For the first state, of a server that is connected: paused it sends none.
constexpr auto kFirstState = std::chrono::milliseconds(500);
constexpr auto kAgain = std::chrono::milliseconds(100);
/// For a second server, of which each is heard ten times a second.
constexpr auto kLookAround = std::chrono::milliseconds(300);

SteadyClock::time_point in_seconds(double seconds) {
  return SteadyClock::now() +
         std::chrono::duration_cast<SteadyClock::duration>(std::chrono::duration<double>(seconds));
}

std::string text(const char* of_sample) { return of_sample == nullptr ? "" : of_sample; }

template <class Sequence>
std::vector<std::string> texts(const Sequence& sequence) {
  std::vector<std::string> all;
  for (std::uint32_t i = 0; i < sequence._length; ++i) all.push_back(text(sequence._buffer[i]));
  return all;
}

std::string seconds(double value) {
  std::string text = std::to_string(value);
  return text.substr(0, text.find('.') + 2) + " s";
}

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

Status same_protocol(std::uint32_t here, std::uint32_t there) {
  if (here == there) return {};
  const bool older = there < here;
  return fail(std::string("the server is of ") + (older ? "an older" : "a newer") +
                  " version of Tandem: the link's protocol is " + std::to_string(there) +
                  " there, " + std::to_string(here) + " here",
              std::string("install the same version on both; the older one is ") +
                  (older ? "the server's" : "this one"));
}

std::unexpected<Error> interrupted() {
  return fail("interrupted before it had the robot", "nothing was moved");
}

}  // namespace

Result<std::unique_ptr<RemoteBackend>> RemoteBackend::connect(dds::Participant& participant,
                                                              const hal::Robot& robot,
                                                              const Identity& identity,
                                                              const ClientConfig& config) {
  const auto name = [&](const char* topic) { return participant.topic_name(topic); };
  auto server =
      dds::Reader<tandem_msgs::LinkServer>::create(participant, name(kServerTopic), link_qos());
  if (!server) return std::unexpected(server.error());
  auto robot_end =
      dds::Reader<tandem_msgs::LinkRobotEnd>::create(participant, name(kRobotEndTopic), link_qos());
  if (!robot_end) return std::unexpected(robot_end.error());
  auto state =
      dds::Reader<tandem_msgs::LinkState>::create(participant, name(kStateTopic), link_qos());
  if (!state) return std::unexpected(state.error());
  auto requests =
      dds::Writer<tandem_msgs::LinkRequest>::create(participant, name(kRequestTopic), link_qos());
  if (!requests) return std::unexpected(requests.error());
  auto commands =
      dds::Writer<tandem_msgs::LinkCommand>::create(participant, name(kCommandTopic), link_qos());
  if (!commands) return std::unexpected(commands.error());
  std::unique_ptr<RemoteBackend> made(
      new RemoteBackend({std::move(*server), std::move(*robot_end), std::move(*state),
                         std::move(*requests), std::move(*commands)},
                        robot, config));
  if (Status found = made->find_server(identity); !found) return std::unexpected(found.error());
  if (Status same = made->same_robot_end(); !same) return std::unexpected(same.error());
  if (Status leased = made->take_lease(); !leased) return std::unexpected(leased.error());
  return made;
}

RemoteBackend::RemoteBackend(Endpoints endpoints, const hal::Robot& robot, ClientConfig config)
    : endpoints_(std::move(endpoints)),
      config_(std::move(config)),
      joints_(robot.joints.size()),
      server_senders_(endpoints_.server.endpoint().get()),
      robot_end_senders_(endpoints_.robot_end.endpoint().get()),
      state_senders_(endpoints_.state.endpoint().get()),
      newest_(Seen{hal::StateImage(robot.shape()), hal::CommandImage(robot.shape()),
                   std::vector<std::uint8_t>(robot.joints.size())}),
      command_(robot.shape()),
      gains_(robot.joints.size() * 3 * hal::kPidLoops),
      revisions_(robot.joints.size()) {
  run_ = config_.server;
  on_told_.emplace(endpoints_.server.endpoint().get(), [this] { take_told(); });
}

RemoteBackend::~RemoteBackend() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  closes_.notify_all();
  if (renewing_.joinable()) renewing_.join();
  on_told_.reset();
  on_robot_end_.reset();
  on_states_.reset();
  if (!leased_ || gone_) return;
  ask(Action::kRelease);
  dds_wait_for_acks(endpoints_.requests.endpoint().get(), DDS_MSECS(500));
}

Status RemoteBackend::find_server(const Identity& identity) {
  const auto deadline = in_seconds(config_.connect_timeout_s);
  std::unique_lock lock(mutex_);
  const auto found = [this] { return told_ && !told_->ending; };
  while (!found() && SteadyClock::now() < deadline) {
    if (config_.interrupted && config_.interrupted()) break;
    news_.wait_for(lock, kAgain);
  }
  if (!found()) {
    if (config_.interrupted && config_.interrupted()) return interrupted();
    return fail("no server was found within " + seconds(config_.connect_timeout_s),
                "start `tandem serve` of the same version, with the same [dds] domain and "
                "namespace");
  }
  if (config_.server == 0) news_.wait_for(lock, kLookAround, [this] { return several_; });
  if (several_) {
    return fail("several servers were found",
                "give each a [dds] namespace or domain of its own, or end all but one");
  }
  if (Status same = same_protocol(identity.protocol, told_->identity.protocol); !same) return same;
  if (const std::string other = difference(identity, told_->identity); !other.empty()) {
    return fail("the server's robot is not this one: " + other,
                "run both with the same robot.toml, description and period");
  }
  if (told_->lockstep != config_.lockstep) {
    return told_->lockstep ? fail("the server runs in lockstep", "add --lockstep here")
                           : fail("the server does not run in lockstep",
                                  "leave --lockstep out here, or start `tandem serve --lockstep`");
  }
  run_ = told_->run;
  server_ = told_->sender;
  return {};
}

/// Both ends count with one play-out, or with none; and what is predicted is what the robot does.
Status RemoteBackend::same_robot_end() {
  on_robot_end_.emplace(endpoints_.robot_end.endpoint().get(), [this] { take_robot_end(); });
  const auto deadline = in_seconds(config_.connect_timeout_s);
  std::unique_lock lock(mutex_);
  while (!robot_end_) {
    if (config_.interrupted && config_.interrupted()) return interrupted();
    if (SteadyClock::now() > deadline) {
      return fail("the server did not describe its end of the link within " +
                      seconds(config_.connect_timeout_s),
                  "is it still running?");
    }
    news_.wait_for(lock, kAgain);
  }
  const std::string other = difference(config_.robot_end, *robot_end_);
  if (other.empty()) return {};
  return fail("the server's link is not this one: " + other,
              "give both ends the same [teleoperation], or neither");
}

Status RemoteBackend::take_lease() {
  on_states_.emplace(endpoints_.state.endpoint().get(), [this] { take_states(); });
  const auto deadline = in_seconds(config_.connect_timeout_s);
  std::unique_lock lock(mutex_);
  while (told_->owner != client_) {
    if (told_->owner != 0) {
      return fail("the robot is owned by " + told_->owner_name,
                  "wait until it gives it back, or end it");
    }
    if (config_.interrupted && config_.interrupted()) return interrupted();
    if (SteadyClock::now() > deadline) {
      return fail("the server gave no lease within " + seconds(config_.connect_timeout_s),
                  "is it still running? Is this its user, on its machine, and its control socket "
                  "where it is looked for (no --socket there)? Else [remote] trust "
                  "(docs/security.md)");
    }
    const std::uint64_t before = told_count_;
    lock.unlock();
    if (config_.before_asking) config_.before_asking();
    ask(Action::kAcquire);
    lock.lock();
    news_.wait_for(lock, kAgain, [&] { return told_count_ != before; });
  }
  leased_ = true;
  renewing_ = std::thread([this] { renew(); });
  return {};
}

bool RemoteBackend::first_state(hal::StateImage& state) {
  std::unique_lock lock(mutex_);
  const auto seen = [this] {
    (void)newest_.refresh();
    return newest_.front().is_one;
  };
  if (!news_.wait_for(lock, kFirstState, seen)) return false;
  state.assign(newest_.front().state);
  return true;
}

void RemoteBackend::ask(Action action) {
  tandem_msgs::LinkRequest sample{};
  sample.run = run_;
  sample.client = client_;
  sample.protocol = kLinkProtocol;
  sample.action = static_cast<std::uint8_t>(action);
  sample.name = config_.name.data();
  (void)endpoints_.requests.write(sample);
}

void RemoteBackend::renew() {
  std::unique_lock lock(mutex_);
  while (!closing_) {
    const std::chrono::duration<double> pause(told_->lease_timeout_s / 4.0);
    lock.unlock();
    if (!lost_) ask(Action::kRenew);
    lock.lock();
    closes_.wait_for(lock, pause, [this] { return closing_; });
  }
}

void RemoteBackend::take_told() {
  {
    const std::lock_guard lock(mutex_);
    endpoints_.server.take([this](const tandem_msgs::LinkServer& sample, const auto& info) {
      const std::optional<Sender>& sender = server_senders_.of(info);
      if (!(sample.lease_timeout_s > 0.0 && sample.lease_timeout_s <= kLongestLease_s)) return;
      if (!sender || (run_ != 0 && sample.run != run_)) return;  // another server
      if (server_ && sender != server_) return;                  // somebody who says he is this one
      const bool other = told_ && (sample.run != told_->run || sender != told_->sender);
      if (other && !told_->ending && !sample.ending) several_ = true;
      told_ = Told{.identity = {.protocol = sample.protocol,
                                .robot = text(sample.robot),
                                .description_hash = text(sample.description_hash),
                                .period_ns = sample.period_ns,
                                .joints = texts(sample.joints),
                                .sensors = texts(sample.sensors),
                                .state_bytes = sample.state_bytes,
                                .command_bytes = sample.command_bytes},
                   .run = sample.run,
                   .owner = sample.owner,
                   .sender = sender,
                   .owner_name = text(sample.owner_name),
                   .status = text(sample.status),
                   .lease_timeout_s = sample.lease_timeout_s,
                   .lockstep = sample.lockstep,
                   .ending = sample.ending};
      ++told_count_;
      heard_ns_ = clock_ns(CLOCK_MONOTONIC);
      if (!leased_) return;
      if (sample.ending) ending_ = true;
      if (sample.owner != client_) lost_ = true;
    });
  }
  news_.notify_all();
}

void RemoteBackend::take_robot_end() {
  {
    const std::lock_guard lock(mutex_);
    endpoints_.robot_end.take([this](const tandem_msgs::LinkRobotEnd& sample, const auto& info) {
      if (sample.run != run_ || !server_ || robot_end_senders_.of(info) != server_) return;
      constexpr std::string_view kIs = " = ";
      RobotEnd end{.playout_cycles = sample.playout_cycles};
      for (const std::string& line : texts(sample.controllers)) {
        const std::size_t at = std::min(line.find(kIs), line.size());
        end.controllers[line.substr(0, at)] = line.substr(std::min(at + kIs.size(), line.size()));
      }
      robot_end_ = std::move(end);
    });
  }
  news_.notify_all();
}

void RemoteBackend::take_states() {
  {
    const std::lock_guard lock(mutex_);
    endpoints_.state.take([this](const tandem_msgs::LinkState& sample, const auto& info) {
      const bool from_it = sample.run == run_ && server_ && state_senders_.of(info) == server_;
      if (!from_it || !unpack(sample)) return;
      newest_.publish();
    });
  }
  news_.notify_all();
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
  heard_ns_ = clock_ns(CLOCK_MONOTONIC);
  return true;
}

std::string RemoteBackend::status_text() const {
  const std::lock_guard lock(mutex_);
  if (gone_) {
    return "no message from the server for " + seconds(config_.server_timeout_s);
  }
  if (ending_ || hal::ends(static_cast<hal::RunPhase>(phase_.load()))) {
    return "the server's run is over";
  }
  if (lost_) return "the server took the robot away: no command in time, or a stop there";
  if (told_ && !told_->status.empty()) return "at the server: " + told_->status;
  if (phase_ == static_cast<std::uint8_t>(hal::RunPhase::kFaulted)) {
    return "the server has stopped the robot";
  }
  if (phase_ == static_cast<std::uint8_t>(hal::RunPhase::kHeld)) {
    return "the server holds the robot after a reset: tandem controller start there";
  }
  return "the server brings the robot up";
}

}  // namespace tandem::remote
