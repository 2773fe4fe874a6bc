// The loop's side of the link, and the checks of what arrives.
#include "hal/remote/server.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace tandem::remote {

using hal::FaultCause;
using hal::RunPhase;
using hal::StopCategory;

namespace {

constexpr std::int64_t kLook_ns = 50'000'000;  // a waiting cycle looks around so often
constexpr std::size_t kCommands = 256;         // that may come within one cycle
constexpr std::uint64_t kMostMadeUp = 1000;    // cycles of the loop that play-out makes up

std::int64_t ns(double seconds) { return static_cast<std::int64_t>(seconds * 1e9); }

}  // namespace

Result<std::unique_ptr<Server>> Server::open(dds::Participant& participant, const hal::Robot& robot,
                                             const hal::ParameterImage& gains,
                                             LinkIdentity identity, const ServerConfig& config) {
  auto server = open_end<dds::Writer<tandem_msgs::LinkServer>>(participant, kServerTopic);
  if (!server) return std::unexpected(server.error());
  auto robot_end = open_end<dds::Writer<tandem_msgs::LinkRobotEnd>>(participant, kRobotEndTopic);
  if (!robot_end) return std::unexpected(robot_end.error());
  auto state = open_end<dds::Writer<tandem_msgs::LinkState>>(participant, kStateTopic);
  if (!state) return std::unexpected(state.error());
  auto requests = open_end<dds::Reader<tandem_msgs::LinkRequest>>(participant, kRequestTopic);
  if (!requests) return std::unexpected(requests.error());
  auto commands = open_end<dds::Reader<tandem_msgs::LinkCommand>>(participant, kCommandTopic);
  if (!commands) return std::unexpected(commands.error());
  return std::unique_ptr<Server>(new Server(
      {std::move(*server), std::move(*robot_end), std::move(*state)},
      {std::move(*requests), std::move(*commands)}, robot, gains, std::move(identity), config));
}

Server::Server(ServerPublisher::Writers writers, Readers readers, const hal::Robot& robot,
               const hal::ParameterImage& gains, LinkIdentity identity, const ServerConfig& config)
    : identity_(std::move(identity)),
      config_(config),
      readers_(std::move(readers)),
      capabilities_(robot.joints.begin(), robot.joints.end()),
      request_senders_(readers_.requests.endpoint().get()),
      command_senders_(readers_.commands.endpoint().get()),
      gains_(gains),
      newest_(Taken{hal::CommandImage(robot.shape()), gains_}),
      stop_(static_cast<std::uint8_t>(StopCategory::kWarn)),
      played_(robot.shape()),
      received_(robot.shape()),
      publisher_(std::move(writers), identity_, config_, lease_, robot.joints.size()) {
  if (config_.playout) {
    commands_.emplace(sizeof(std::uint64_t) + identity_.command_bytes, kCommands);
    playout_.emplace(robot, config_.playout->delay_cycles, config_.playout->brake_cycles,
                     identity_.period_ns);
  }
  on_requests_.emplace(readers_.requests.endpoint().get(), [this] { take_requests(); });
  on_commands_.emplace(readers_.commands.endpoint().get(), [this] { take_commands(); });
}

Server::~Server() {
  on_news({});
  close();
}

void Server::close() {
  on_requests_.reset();
  on_commands_.reset();
  publisher_.close();
}

void Server::on_news(std::function<void()> ring) {
  const std::lock_guard lock(ring_mutex_);
  on_news_ = std::move(ring);
}

void Server::ring() {
  const std::lock_guard lock(ring_mutex_);
  if (on_news_) on_news_();
}

void Server::take_requests() {
  readers_.requests.take([this](const tandem_msgs::LinkRequest& sample, const auto& info) {
    if (sample.run != number() || sample.client == 0) return;
    const std::optional<Sender>& sender = request_senders_.of(info);
    switch (static_cast<LeaseAction>(sample.action)) {
      case LeaseAction::kAcquire: acquire(sample, sender); break;
      case LeaseAction::kRenew:
        if (is_owner(sample.client, sender)) lease_.heard(clock_ns(CLOCK_MONOTONIC));
        return;
      case LeaseAction::kRelease:
        if (is_owner(sample.client, sender)) (void)lease_.release(sample.client);
        break;
      default: return;
    }
    publisher_.tell_news();
  });
  ring();
}

void Server::acquire(const tandem_msgs::LinkRequest& sample, const std::optional<Sender>& sender) {
  if (sample.protocol != identity_.protocol) return;  // it has been reported
  if (!sender || (config_.admits && !config_.admits(*sender))) return;
  const std::lock_guard lock(owner_mutex_);
  if (lease_.owner() == sample.client && sender != owner_sender_) return;  // another one's number
  const char* name = sample.name == nullptr ? "" : sample.name;
  if (lease_.acquire(sample.client, name, clock_ns(CLOCK_MONOTONIC))) owner_sender_ = sender;
}

bool Server::is_owner(std::uint64_t client, const std::optional<Sender>& sender) {
  const std::lock_guard lock(owner_mutex_);
  return client != 0 && client == lease_.owner() && sender && sender == owner_sender_;
}

void Server::take_commands() {
  {
    const std::lock_guard lock(in_mutex_);
    readers_.commands.take([this](const tandem_msgs::LinkCommand& sample, const auto& info) {
      const Verdict verdict = judge(sample, command_senders_.of(info));
      counts_[static_cast<std::size_t>(verdict)].fetch_add(1, std::memory_order_relaxed);
    });
  }
  ring();
}

/// Whether a sample may reach the loop; hands it over then.
Verdict Server::judge(const tandem_msgs::LinkCommand& sample, const std::optional<Sender>& sender) {
  if (sample.run != number() || !is_owner(sample.client, sender)) return Verdict::kNoLease;
  if (sample.client != gate_client_) {
    gate_client_ = sample.client;
    gate_sequence_ = 0;
    gate_stops_ = gate_resets_ = 0;
  }
  if (sample.sequence_number <= gate_sequence_) return Verdict::kOutOfOrder;
  gate_sequence_ = sample.sequence_number;
  note_stops(sample);  // whatever else is wrong with it
  const std::uint64_t cycle = publisher_.cycle();
  if (sample.cycle > cycle || cycle - sample.cycle > config_.max_age_cycles) {
    return Verdict::kStale;
  }
  if (!unpack(sample)) return Verdict::kMalformed;
  lease_.heard(clock_ns(CLOCK_MONOTONIC));
  keep_for_playout(newest_.back());
  newest_.publish();
  return Verdict::kTaken;
}

/// Every command, where the loop takes the newest alone.
void Server::keep_for_playout(const Taken& taken) {
  if (!commands_ || !taken.live) return;
  const std::span<std::byte> slot = commands_->begin_push();
  if (slot.empty()) return;  // as if it were lost
  std::memcpy(slot.data(), &taken.client, sizeof taken.client);
  std::ranges::copy(taken.command.bytes(), slot.begin() + sizeof taken.client);
  commands_->end_push();
}

void Server::note_stops(const tandem_msgs::LinkCommand& sample) {
  if (sample.resets != gate_resets_) {
    reset_cycle_.store(sample.cycle, std::memory_order_relaxed);
    reset_.store(true, std::memory_order_release);
  }
  gate_resets_ = sample.resets;
  if (sample.stops == gate_stops_) return;
  gate_stops_ = sample.stops;
  const auto hardest = static_cast<std::uint8_t>(StopCategory::kCategory1);
  // What nobody knows stops as category 1.
  const std::uint8_t asked =
      sample.stop < static_cast<std::uint8_t>(StopCategory::kWarn) ? sample.stop : hardest;
  std::uint8_t before = stop_.load(std::memory_order_relaxed);
  while (asked < before && !stop_.compare_exchange_weak(before, asked)) {
  }
}

bool Server::unpack(const tandem_msgs::LinkCommand& sample) {
  Taken& to = newest_.back();
  if (sample.command._length != to.command.bytes().size()) return false;
  const std::uint32_t gains = sample.gains._length;
  if (gains != 0 && gains != capabilities_.size() * kGainsPerJoint) return false;
  std::memcpy(to.command.bytes().data(), sample.command._buffer, sample.command._length);
  if (!is_sound(to.command)) return false;
  const double* value = sample.gains._buffer;
  if (!std::all_of(value, value + gains, [](double v) { return std::isfinite(v) && v >= 0.0; })) {
    return false;
  }
  hal::ParameterImage wanted = gains_;
  for (std::size_t i = 0; i < gains; i += 3) {
    const auto loop = static_cast<hal::PidLoop>(i % kGainsPerJoint / 3);
    const hal::PidGains one{.kp = value[i], .ki = value[i + 1], .kd = value[i + 2]};
    if (one != gains_.gains(i / kGainsPerJoint, loop) &&
        !hal::gains_problem(capabilities_[i / kGainsPerJoint], loop, one).empty()) {
      return false;
    }
    wanted.set_gains(i / kGainsPerJoint, loop, one);
  }
  gains_ = std::move(wanted);
  if (gains != 0) ++gains_number_;
  if (to.gains_number != gains_number_) to.gains = gains_;
  to.gains_number = gains_number_;
  to.client = sample.client;
  to.sequence = sample.sequence_number;
  to.cycle = sample.cycle;
  to.state_ns = sample.state_ns;
  to.sent_ns = sample.sent_ns;
  to.live = sample.live;
  to.done = sample.done;
  return true;
}

FaultCause Server::loss_of(const hal::PortView& view, std::uint64_t owner) noexcept TANDEM_RT {
  const std::int64_t now = clock_ns(CLOCK_MONOTONIC), lease = ns(config_.lease_timeout_s);
  if (silence_.of(lease_.heard_ns(), now, lease / 4) > lease) return FaultCause::kOwnerSilent;
  const Taken& taken = newest_.front();
  if (config_.lockstep) {
    const bool there = taken.client == owner && taken.cycle == view.time.cycle;
    const bool late =
        waits_since_ns_ != 0 && now - waits_since_ns_ > ns(config_.lockstep_timeout_s);
    return late && !there ? FaultCause::kOwnerLate : FaultCause::kNone;
  }
  const bool old = led_by_ == owner && view.time.cycle - taken.cycle > config_.max_age_cycles;
  return old ? FaultCause::kOwnerStale : FaultCause::kNone;
}

std::int64_t Server::wait_until_ns(const hal::PortView& view) noexcept {
  if (view.phase == RunPhase::kShutDown || view.phase == RunPhase::kDone) return 0;
  const std::int64_t now = clock_ns(CLOCK_MONOTONIC);
  const std::uint64_t owner = lease_.owner();
  if (owner == 0) {
    waits_since_ns_ = 0;
    const bool stands = view.phase == RunPhase::kBringUp || view.phase == RunPhase::kSettling ||
                        view.phase == RunPhase::kRunning;
    return stands && led_by_ == 0 ? now + kLook_ns : 0;
  }
  if (waits_since_ns_ == 0) waits_since_ns_ = now;
  newest_.refresh();
  const Taken& taken = newest_.front();
  if (taken.client == owner && taken.cycle == view.time.cycle) return 0;
  if (loss_of(view, owner) != FaultCause::kNone) return 0;
  return now + kLook_ns;
}

hal::RemoteCommand Server::exchange(const hal::PortView& view) noexcept TANDEM_RT {
  if (!config_.lockstep) publisher_.push(view, answered_);
  hal::RemoteCommand wish;
  wish.on_loss = config_.on_lost;
  constexpr auto kNone = static_cast<std::uint8_t>(StopCategory::kWarn);
  if (stop_.load(std::memory_order_relaxed) != kNone) {
    wish.stop = static_cast<StopCategory>(stop_.exchange(kNone, std::memory_order_relaxed));
  }
  if (reset_.load(std::memory_order_relaxed)) {
    wish.reset = reset_.exchange(false, std::memory_order_acquire);
    wish.reset_cycle = reset_cycle_.load(std::memory_order_relaxed);
  }
  newest_.refresh();
  const Taken& taken = newest_.front();
  const std::uint64_t owner = lease_.owner();
  if (taken.client != owner) answered_.sent_ns = 0;  // not of this owner
  if (owner != 0 && taken.client == owner && done_client_ != owner) {
    measure(view, taken);
    wish.live = taken.live;
    wish.command = &taken.command;
    if (taken.gains_number != gains_taken_) wish.gains = &taken.gains;
    gains_taken_ = taken.gains_number;
    wish.done = taken.done;
    if (taken.done) done_client_ = owner;
    wish.ends_run = config_.ends_with_owner;
    if (taken.done && !config_.ends_with_owner) wish.live = false;
  }
  if (owner != 0 && !wish.done) wish.loss = loss_of(view, owner);
  if (wish.loss != FaultCause::kNone) wish.live = false;
  if (owner != 0 && (wish.done || wish.loss != FaultCause::kNone)) {
    (void)lease_.release(owner);
    if (wish.loss != FaultCause::kNone) losses_.fetch_add(1, std::memory_order_relaxed);
    // One that has commanded nothing yet leaves nothing behind.
    if (led_by_ != owner) wish.loss = FaultCause::kNone;
  }
  if (wish.live) answered_.source_cycle = taken.command.cycle()[0];
  if (playout_) play(view, led_by_ != owner, wish);
  led_by_ = wish.live ? owner : 0;
  waits_since_ns_ = 0;
  return wish;
}

/// What has arrived takes effect in its time. The first command of an owner begins from what the
/// joints follow.
void Server::play(const hal::PortView& view, bool begins,
                  hal::RemoteCommand& wish) noexcept TANDEM_RT {
  const std::uint64_t owner = lease_.owner(), cycle = view.time.cycle;
  bool started = !begins;
  for (std::size_t i = 0; i < kCommands; ++i) {
    const std::span<const std::byte> slot = commands_->front();
    if (slot.empty()) break;
    std::uint64_t client = 0;
    std::memcpy(&client, slot.data(), sizeof client);
    std::ranges::copy(slot.subspan(sizeof client), received_.bytes().begin());
    commands_->pop();
    if (!wish.live || client != owner) continue;
    if (!started) playout_->start(received_.cycle()[0], view.command);
    if (!started) played_cycle_ = cycle - 1;
    started = true;
    playout_->take(cycle, received_);
  }
  if (!wish.live || !started) {
    wish.live = false;
    return;
  }
  const std::uint64_t first = std::max(played_cycle_ + 1, cycle - std::min(cycle, kMostMadeUp));
  for (std::uint64_t one = first; one <= cycle; ++one) playout_->play(one, played_);
  played_cycle_ = cycle;
  answered_.source_cycle = playout_->source_cycle();
  wish.command = &played_;
}

void Server::measure(const hal::PortView& view, const Taken& taken) noexcept TANDEM_RT {
  if (taken.sequence == answered_sequence_ && taken.sent_ns == answered_.sent_ns) return;
  answered_sequence_ = taken.sequence;
  answered_.cycle = taken.cycle;
  answered_.sent_ns = taken.sent_ns;
  age_.record(clock_ns(CLOCK_MONOTONIC) - taken.state_ns);
  age_cycles_.record(static_cast<std::int64_t>(view.time.cycle - taken.cycle));
}

}  // namespace tandem::remote
