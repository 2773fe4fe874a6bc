#include "hal/remote/tele_backend.hpp"

#include <algorithm>

namespace tandem::remote {
namespace {

constexpr std::int64_t kMargin_ns = 1'000'000'000;  // of the past, beyond the delays
constexpr double kJitters = 8.0;

/// From a command to the state that shows it, at most; later states correct nothing.
std::uint64_t round_trip_cycles(const TeleConfig& config, std::int64_t period_ns) {
  const double down_s = config.down.delay_s + kJitters * config.down.jitter_s;
  return cycles_in(config.playout_ns + static_cast<std::int64_t>(1e9 * down_s) + kMargin_ns,
                   period_ns);
}

}  // namespace

TeleBackend::TeleBackend(const hal::Robot& description, End robot, End twin,
                         const TeleConfig& config, std::int64_t period_ns)
    : OperatorEnd(*robot.robot, std::move(twin), cycles_in(config.unanswered_ns, period_ns)),
      robot_(std::move(robot.robot)),
      robot_side_(std::move(robot.side)),
      config_(config),
      up_(config.up, config.seed, hal::CommandImage(description.shape()).bytes().size()),
      down_(config.down, config.seed + 1, hal::StateImage(description.shape()).bytes().size()),
      playout_(description, cycles_in(config.playout_ns, period_ns),
               cycles_in(config.brake_ns, period_ns), period_ns),
      limits_(description, period_ns),
      robot_state_(description.shape()),
      twin_state_(description.shape()),
      arrived_(description.shape()),
      robot_command_(description.shape()),
      twin_command_(description.shape()),
      received_(description.shape()),
      playout_cycles_(cycles_in(config.playout_ns, period_ns)),
      prediction_(description.joints.size(), round_trip_cycles(config, period_ns),
                  config.correction_ns, period_ns) {}

/// From now on the network lies between the two.
void TeleBackend::begin_link(const hal::CycleTime& time) noexcept TANDEM_RT {
  linked_ = true;
  linked_ns_ = time.time_ns;
  arrived_cycle_ = time.cycle;
  answers_.start(time.cycle);
  arrived_.assign(robot_state_);
  playout_.start(time.cycle, robot_command_);
  limits_.follow(robot_command_);
  prediction_.start();
  if (robot_side_) robot_side_->start(time, robot_state_, robot_command_);
  if (twin_ && twin_side_) twin_side_->start(time, twin_state_, twin_command_);
}

/// The robot's state of this cycle goes down; what has arrived is taken, the newest last.
void TeleBackend::carry_state(const hal::CycleTime& time) noexcept TANDEM_RT {
  const std::int64_t since_ns = time.time_ns - linked_ns_;
  const bool cut = config_.is_cut(since_ns);
  up_.cut(cut);
  down_.cut(cut);
  down_.send(time.time_ns, {time.cycle, playout_.source_cycle()}, robot_state_.bytes());
  for (;;) {
    const auto [head, image] = down_.receive(time.time_ns);
    if (image.empty()) break;
    if (head.cycle <= arrived_cycle_) continue;  // overtaken, or twice
    std::ranges::copy(image, arrived_.bytes().begin());
    if (twin_ && !ended_) {
      const std::uint64_t due = head.cycle - 1 - std::min(head.cycle - 1, playout_cycles_);
      prediction_.correct(arrived_, due, head.cycle - arrived_cycle_);
    }
    arrived_cycle_ = head.cycle;
    if (!ended_) answers_.take(head.source, time.cycle);
  }
  if (!ended_) answers_.count(time.cycle);
}

void TeleBackend::show(const hal::CycleTime& time, hal::StateImage& state) noexcept TANDEM_RT {
  if (!twin_) {
    state.assign(arrived_);
  } else {
    state.assign(twin_state_);
    prediction_.show(arrived_, state);
  }
  state.cycle()[0] = time.cycle;
  state.time_ns()[0] = time.time_ns;
}

Code TeleBackend::read(const hal::CycleTime& time, hal::StateImage& state) noexcept TANDEM_RT {
  now_ = time;
  Code code = robot_->read(time, robot_state_);
  if (twin_) {
    const Code twin = twin_->read(time, twin_state_);
    if (code == Code::kOk) code = twin;
  }
  const bool begins = !linked_ && phase() == hal::Phase::kOperational;
  if (begins) begin_link(time);
  if (!linked_) {
    state.assign(robot_state_);
    return code;
  }
  if (twin_) prediction_.keep(time.cycle, twin_state_);
  carry_state(time);
  show(time, state);
  return code;
}

/// The operator's command goes up; the robot plays what it has.
void TeleBackend::carry_command(const hal::CommandImage& command) noexcept TANDEM_RT {
  received_.assign(command);
  received_.cycle()[0] = now_.cycle;
  up_.send(now_.time_ns, {now_.cycle, 0}, received_.bytes());
  for (;;) {
    const std::span<const std::byte> image = up_.receive(now_.time_ns).image;
    if (image.empty()) break;
    std::ranges::copy(image, received_.bytes().begin());
    playout_.take(now_.cycle, received_);
  }
  playout_.play(now_.cycle, robot_command_);
  robot_command_.cycle()[0] = now_.cycle;
  robot_command_.time_ns()[0] = now_.time_ns;
  if (robot_side_ && robot_side_->update(now_, robot_state_, robot_command_) != Code::kOk) {
    robot_->stop(hal::StopCategory::kCategory1);
  }
  (void)limits_.apply(robot_state_, robot_command_);
}

Code TeleBackend::write(const hal::CommandImage& command,
                        const hal::ParameterImage& parameters) noexcept TANDEM_RT {
  if (linked_) {
    carry_command(command);
  } else {
    robot_command_.assign(command);
  }
  if (twin_) {
    twin_command_.assign(command);
    if (linked_ && twin_side_) (void)twin_side_->update(now_, twin_state_, twin_command_);
    (void)twin_->write(twin_command_, parameters);
  }
  return robot_->write(robot_command_, parameters);
}

bool TeleBackend::set_link(const hal::LinkChange& change) noexcept TANDEM_RT {
  if (change.up) up_.change(change.delay_s, change.jitter_s, change.loss);
  if (change.down) down_.change(change.delay_s, change.jitter_s, change.loss);
  return true;
}

bool TeleBackend::archive(Archive& ar) {
  if (!robot_->archive(ar) || (twin_ && !twin_->archive(ar))) return false;
  if (robot_side_) robot_side_->archive(ar);
  if (twin_ && twin_side_) twin_side_->archive(ar);
  ar(up_, down_, playout_, limits_, robot_state_, twin_state_, arrived_, robot_command_, linked_,
     ended_, now_, linked_ns_, arrived_cycle_, answers_, prediction_);
  return true;
}

TeleFigures TeleBackend::figures() const noexcept {
  return {.up = up_.counts(),
          .down = down_.counts(),
          .starved_cycles = playout_.starved_cycles(),
          .holds = playout_.holds(),
          .silent_cycles = answers_.silent(),
          .most_silent_cycles = answers_.most_silent(),
          .unanswered_cycles = answers_.unanswered(),
          .most_unanswered_cycles = answers_.most_unanswered(),
          .compared = prediction_.compared(),
          .worst_prediction_rad = prediction_.worst_rad()};
}

}  // namespace tandem::remote
