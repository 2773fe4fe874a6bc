#include "hal/remote/live_link.hpp"

#include <algorithm>
#include <cstdlib>

#include "hal/remote/playout.hpp"

namespace tandem::remote {
namespace {

constexpr std::uint64_t kDriftCycles = 100;       // after which the numbers are corrected
constexpr std::uint64_t kDriftPace = 4;           // cycles from one correction by one to the next
constexpr std::int64_t kJump = 20;                // cycles that no drift and jitter explain
constexpr std::uint64_t kMostTwinCycles = 20;     // cycles of the twin in one of the loop
constexpr std::int64_t kPast_ns = 2'000'000'000;  // beyond the declared delays

/// By how much the numbers are to be corrected that were `lead` before the robot's cycles.
std::int64_t correction(std::int64_t lead) noexcept TANDEM_RT {
  constexpr auto kMost = static_cast<std::int64_t>(kDriftCycles / kDriftPace);
  const std::int64_t most = std::abs(lead) > kJump ? kMost : 1;
  return -std::clamp(lead, -most, most);
}

}  // namespace

LiveLink::LiveLink(const hal::Robot& description, std::unique_ptr<RemoteBackend> robot, End twin,
                   const TeleConfig& config, std::int64_t delay_ns, std::uint64_t playout_cycles,
                   std::int64_t period_ns)
    : OperatorEnd(*robot, std::move(twin), cycles_in(config.unanswered_ns, period_ns)),
      robot_(std::move(robot)),
      config_(config),
      delay_cycles_(cycles_in(delay_ns, period_ns)),
      playout_cycles_(playout_cycles),
      up_(config.up, config.seed, hal::CommandImage(description.shape()).bytes().size()),
      down_(config.down, config.seed + 1, hal::StateImage(description.shape()).bytes().size()),
      robot_state_(description.shape()),
      twin_state_(description.shape()),
      arrived_(description.shape()),
      sent_(description.shape()),
      twin_command_(description.shape()),
      twin_goal_(description.shape()),
      prediction_(description.joints.size(),
                  cycles_in(config.playout_ns + 2 * delay_ns + kPast_ns, period_ns),
                  config.correction_ns, period_ns) {
  twin_now_.period_ns = period_ns;
}

std::string LiveLink::status_text() const {
  if (twin_failed_) return "the predicted robot failed: " + twin_->status_text();
  return robot_->status_text();
}

void LiveLink::exchange(const hal::CycleTime& time) noexcept {
  while (linked_) {
    const std::span<const std::byte> image = up_.receive(time.time_ns).image;
    if (image.empty()) break;
    std::ranges::copy(image, sent_.bytes().begin());
    robot_->post(sent_);
  }
  robot_->exchange(time);
}

void LiveLink::begin_link(const hal::CycleTime& time) noexcept TANDEM_RT {
  linked_ = true;
  linked_ns_ = time.time_ns;
  answers_.start(time.cycle);
  arrived_.assign(robot_state_);
  arrived_cycle_ = robot_->cycle();
  number_ = arrived_cycle_ - std::min(arrived_cycle_, delay_cycles_);
  next_kept_ = number_;
  led_ = count_ = 0;
  owed_ = 0;
  (void)robot_->command_in_force(sent_);
  sent_.cycle()[0] = number_;
  prediction_.start();
  if (!twin_) return;
  prediction_.assume(robot_state_, twin_state_);
  if (twin_side_) twin_side_->start(twin_now_, twin_state_, twin_command_);
}

/// The number of this cycle's command. Once in a while it is brought nearer to the robot's cycle
/// that came with the least delay, for the two clocks differ.
void LiveLink::count_on(const hal::CycleTime& time) noexcept TANDEM_RT {
  const std::uint64_t passed = time.cycle - now_.cycle;
  late_ = passed - 1;
  answers_.left_out(late_);
  const std::int64_t step = count_ % kDriftPace == 0 ? std::clamp<std::int64_t>(owed_, -1, 1) : 0;
  number_ = static_cast<std::uint64_t>(static_cast<std::int64_t>(number_ + passed) + step);
  drifted_ += step;
  owed_ -= step;
  if (++count_ < kDriftCycles) return;
  if (led_ > 0) owed_ = correction(least_lead_);
  led_ = count_ = 0;
}

/// What came over the real link crosses the declared network; what has, is taken, the newest last.
void LiveLink::carry_state(const hal::CycleTime& time) noexcept TANDEM_RT {
  const std::int64_t since_ns = time.time_ns - linked_ns_;
  const bool cut = config_.is_cut(since_ns);
  up_.cut(cut);
  down_.cut(cut);
  if (robot_->is_fresh()) {
    down_.send(time.time_ns, {robot_->cycle(), robot_->source_cycle()}, robot_state_.bytes());
  }
  for (;;) {
    const auto [head, image] = down_.receive(time.time_ns);
    if (image.empty()) break;
    if (head.cycle <= arrived_cycle_) continue;  // overtaken, or twice
    std::ranges::copy(image, arrived_.bytes().begin());
    if (twin_ && !ended_) {
      const std::uint64_t due = head.cycle - 1 - std::min(head.cycle - 1, playout_cycles_);
      prediction_.correct(arrived_, due, head.cycle - arrived_cycle_);
    }
    const auto lead = static_cast<std::int64_t>(number_ - head.cycle);
    least_lead_ = led_ == 0 ? lead : std::min(least_lead_, lead);
    ++led_;
    arrived_cycle_ = head.cycle;
    if (!ended_) answers_.take(head.source, time.cycle);
  }
  if (!ended_) answers_.count(time.cycle);
}

Code LiveLink::read(const hal::CycleTime& time, hal::StateImage& state) noexcept TANDEM_RT {
  Code code = robot_->read(time, robot_state_);
  if (code == Code::kTimeout) code = Code::kOk;  // no state came since the last cycle
  if (twin_) {
    const Code twin = read_twin();
    if (code == Code::kOk && twin != Code::kOk) {
      code = twin;
      twin_failed_ = twin_failed_ || !ended_;
    }
  }
  if (linked_) {
    count_on(time);
  } else if (phase() == hal::Phase::kOperational) {
    begin_link(time);
  }
  now_ = time;
  if (!linked_) {
    state.assign(robot_state_);
    return code;
  }
  while (twin_ && next_kept_ + late_ <= number_) prediction_.keep(next_kept_++, twin_state_);
  carry_state(time);
  state.assign(twin_ ? twin_state_ : arrived_);
  if (twin_) prediction_.show(arrived_, state);
  state.cycle()[0] = time.cycle;
  state.time_ns()[0] = time.time_ns;
  return code;
}

/// Its boards would take a gap in the loop's time for a silent master.
Code LiveLink::read_twin() noexcept TANDEM_RT {
  const Code code = twin_->read(twin_now_, twin_state_);
  ++twin_now_.cycle;
  twin_now_.time_ns += twin_now_.period_ns;
  return code;
}

void LiveLink::lead_twin(const hal::CommandImage& command,
                         const hal::ParameterImage& parameters) noexcept TANDEM_RT {
  twin_command_.assign(command);
  if (linked_ && twin_side_) (void)twin_side_->update(twin_now_, twin_state_, twin_command_);
  (void)twin_->write(twin_command_, parameters);
}

/// Cycles that the loop left out are the twin's as well: it is led to the command as the robot is,
/// which interpolates. Of a long gap it goes through the beginning alone.
void LiveLink::move_twin(const hal::CommandImage& command,
                         const hal::ParameterImage& parameters) noexcept TANDEM_RT {
  for (std::uint64_t left = late_; left > 0 && late_ - left < kMostTwinCycles; --left) {
    move_towards(twin_goal_, command, 1.0 / static_cast<double>(left + 1));
    lead_twin(twin_goal_, parameters);
    (void)read_twin();
    prediction_.keep(next_kept_++, twin_state_);
  }
  if (late_ > 0) next_kept_ = number_ + 1;
  late_ = 0;
  twin_goal_.assign(command);
  lead_twin(twin_goal_, parameters);
}

Code LiveLink::write(const hal::CommandImage& command,
                     const hal::ParameterImage& parameters) noexcept TANDEM_RT {
  if (twin_) move_twin(command, parameters);
  if (!linked_) {  // commands have no numbers yet: none is to be followed
    const bool waits = robot_->phase() == hal::Phase::kOperational;
    return waits ? Code::kOk : robot_->write(command, parameters);
  }
  twin_command_.assign(command);
  twin_command_.cycle()[0] = number_;
  up_.send(now_.time_ns, {number_, 0}, twin_command_.bytes());
  return robot_->write(sent_, parameters);  // once more: the robot knows its number
}

void LiveLink::last_command(const hal::CommandImage& command) noexcept TANDEM_RT {
  robot_->last_command(linked_ ? sent_ : command);
}

void LiveLink::reset() noexcept TANDEM_RT {
  twin_failed_ = false;
  OperatorEnd::reset();
}

TeleFigures LiveLink::figures() const noexcept {
  return {.up = up_.counts(),
          .down = down_.counts(),
          .robot_end = false,
          .silent_cycles = answers_.silent(),
          .most_silent_cycles = answers_.most_silent(),
          .unanswered_cycles = answers_.unanswered(),
          .most_unanswered_cycles = answers_.most_unanswered(),
          .clock_cycles = drifted_,
          .compared = prediction_.compared(),
          .worst_prediction_rad = prediction_.worst_rad()};
}

}  // namespace tandem::remote
