#include "runtime/input_port.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <limits>
#include <set>

#include "base/nearest.hpp"

namespace tandem::runtime {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kUnitNorm = 1e-3;  // that a quaternion's may differ from 1
constexpr double kMostTime_s = 1e6;
constexpr double kMostTolerance = 1e6;

bool is_name(const std::string& name) {
  const auto fits = [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; };
  return !name.empty() && name.size() <= 64 && std::ranges::all_of(name, fits) &&
         std::isdigit(static_cast<unsigned char>(name.front())) == 0;
}

/// Where those of a joint begin among a trajectory's terms.
constexpr std::size_t terms_of_joint(std::size_t joint) {
  return InputBlock::kTerms + joint * InputBlock::kTermsOfJoint;
}

/// A bound of each component, from none, one, or each.
std::vector<double> each(const std::vector<double>& given, std::size_t count, double otherwise) {
  if (given.size() == 1) return std::vector<double>(count, given.front());
  return given.empty() ? std::vector<double>(count, otherwise) : given;
}

Status check_value(const std::string& name, double value, double min, double max,
                   const std::string& unit) {
  if (!std::isfinite(value)) {
    return fail_at(name, "is not finite", "give a number of every component");
  }
  if (value >= min && value <= max) return {};
  // + 0.0: no -0.
  return fail_at(
      name, fmt::format("{:g} is beyond its bounds", value),
      fmt::format("{:g} to {:g}{}{}", min + 0.0, max + 0.0, unit.empty() ? "" : " ", unit));
}

}  // namespace

InputPort::InputPort(std::shared_ptr<ControllerIo> io, InputBlock& block, std::string controller,
                     std::int64_t period_ns)
    : io_(std::move(io)),
      block_(&block),
      controller_(std::move(controller)),
      period_ns_(period_ns),
      mail_(std::make_shared<Mail>(block.value.size())),
      shown_(3 + block.value.size()),
      scratch_(3 + block.value.size()) {}

Result<std::shared_ptr<InputPort>> InputPort::make(std::shared_ptr<ControllerIo> io,
                                                   InputBlock& block, const std::string& controller,
                                                   const hal::Robot& robot, std::int64_t period_ns,
                                                   const InputSource* source) {
  if (block.values() > InputBlock::kMostValues || block.value.size() != block.values()) {
    return fail_at(block.name, "the input is too large",
                   fmt::format("at most {} numbers, fewer `most_points`", InputBlock::kMostValues));
  }
  std::shared_ptr<InputPort> port(new InputPort(std::move(io), block, controller, period_ns));
  if (const Status right = port->check_declaration(robot); !right) {
    Error error = right.error();
    error.message = "the input '" + block.name + "': " + error.message;
    return std::unexpected(std::move(error));
  }
  if (source != nullptr) port->source_ = *source;
  if (port->source_.feeder == InputFeeder::kTopic) {
    const auto message = message_of(block.kind, port->source_);
    if (!message) return std::unexpected(message.error());
    port->message_ = *message;
  }
  if (!port->source_.action.empty() && !block.options.terms) {
    Error error = port->source_.where;
    error.message = "the input '" + block.name + "' of '" + controller + "' takes no goals";
    error.hint = "leave `action` out, or use trajectory_follower";
    return std::unexpected(std::move(error));
  }
  const PlannedInput planned{
      .block = block,
      .controller = controller,
      .without = port->without_,
      .period_ns = period_ns,
      .check = [&port](std::span<const double> sample) { return port->check(sample); }};
  auto plan = make_plan(planned, port->source_);
  if (!plan) return std::unexpected(plan.error());
  port->plan_ = std::move(*plan);
  port->hold(port->without_);
  port->show();
  return port;
}

Status InputPort::fill_bounds(const hal::Robot& robot) {
  const InputOptions& options = block_->options;
  const std::size_t count = block_->components.size();
  for (const auto& [given, what] : {std::pair{&options.min, "min"}, {&options.max, "max"}}) {
    if (given->size() <= 1 || given->size() == count) continue;
    return fail_at(what, fmt::format("has {} numbers for {} components", given->size(), count),
                   "one, or one of each");
  }
  const bool buttons = block_->kind == InputKind::kButtons;
  max_ = each(options.max, count, buttons ? 1.0 : kInfinity);
  min_ = max_;
  for (double& bound : min_) bound = buttons ? 0.0 : -bound;
  if (!options.min.empty()) min_ = each(options.min, count, 0.0);
  if (block_->kind == InputKind::kTrajectory) {
    for (std::size_t i = 0; i < count; ++i) {
      const int joint = robot.joint_index(block_->components[i]);
      if (joint < 0) return std::unexpected(robot.no_joint(block_->components[i]));
      const hal::DrivenJoint& limit = robot.joints[static_cast<std::size_t>(joint)];
      min_[i] = std::max(min_[i], limit.min_position_rad);
      max_[i] = std::min(max_[i], limit.max_position_rad);
      max_speed_.push_back(limit.max_velocity_rad_s);
    }
  }
  for (std::size_t i = 0; i < count; ++i) {
    if (min_[i] <= max_[i]) continue;
    return fail_at(block_->components[i], fmt::format("{:g} to {:g} is no range", min_[i], max_[i]),
                   "let `min` be at most `max`");
  }
  return {};
}

Status InputPort::check_declaration(const hal::Robot& robot) {
  const InputOptions& options = block_->options;
  const std::vector<std::string>& names = block_->components;
  if (!is_name(block_->name)) {
    return fail_at("name", "its name is not 1 to 64 letters, digits and '_'", "rename it");
  }
  if (names.empty()) return fail_at("names", "names no components", "give InputOptions::names");
  if (std::set<std::string>(names.begin(), names.end()).size() != names.size()) {
    return fail_at("names", "names a component twice", "name each once");
  }
  if (!(options.timeout_s >= 0.0 && options.timeout_s <= 1e6)) {
    return fail_at("timeout_s", fmt::format("{:g} s is no time-out", options.timeout_s),
                   "0 to 1e6 s; 0: none");
  }
  timeout_cycles_ = static_cast<std::uint64_t>(
      std::ceil(options.timeout_s * 1e9 / static_cast<double>(period_ns_) - 1e-6));
  if (const Status bounds = fill_bounds(robot); !bounds) return bounds;
  zero_.assign(block_->value.size(), 0.0);
  if (block_->kind == InputKind::kPose) zero_.back() = 1.0;
  without_ = zero_;
  if (options.after == AfterTimeout::kZero || options.otherwise.empty()) return {};
  if (options.otherwise.size() != without_.size()) {
    return fail_at("otherwise",
                   fmt::format("has {} numbers, not {}", options.otherwise.size(), without_.size()),
                   "a number of each component");
  }
  without_ = options.otherwise;
  return check(without_);
}

Status InputPort::check_trajectory(std::span<const double> sample) const {
  const std::size_t joints = block_->components.size();
  const double points = sample[0];
  if (!(points >= 0.0 && points <= static_cast<double>(block_->options.most_points)) ||
      points != std::floor(points)) {
    return fail_at("points", fmt::format("{:g} way-points are too many", points),
                   fmt::format("at most {}", block_->options.most_points));
  }
  const bool moves = sample[1] != 0.0;
  const auto terms = sample.subspan(block_->terms_at());
  double before_s = 0.0;
  for (std::size_t p = 0; p < static_cast<std::size_t>(points); ++p) {
    const auto point = sample.subspan(2 + p * (1 + 2 * joints), 1 + 2 * joints);
    const bool later = p == 0 ? point[0] >= 0.0 : point[0] > before_s;
    if (!later || !(point[0] <= kMostTime_s)) {
      return fail_at("after_s", fmt::format("the time of way-point {} does not grow", p + 1),
                     "seconds after the sample, each later than the one before");
    }
    before_s = point[0];
    for (std::size_t j = 0; j < joints; ++j) {
      const std::string& name = block_->components[j];
      const double stays = terms.empty() ? 0.0 : terms[terms_of_joint(j)];
      const Status fits = check_value(name, point[1 + j], stays != 0.0 ? 0.0 : min_[j],
                                      stays != 0.0 ? 0.0 : max_[j], "rad (of a slide m)");
      if (!fits) return fits;
      const double speed = point[1 + joints + j];
      const Status slow = check_value(name + "'s velocity", speed, moves ? -max_speed_[j] : 0.0,
                                      moves ? max_speed_[j] : 0.0, "rad/s (of a slide m/s)");
      if (!slow) return slow;
    }
  }
  return check_terms(terms);
}

Status InputPort::check_terms(std::span<const double> terms) const {
  if (terms.empty()) return {};
  const Status starts = check_value("start", terms[0], -kMostTime_s, kMostTime_s, "s");
  const Status ends = check_value("goal_time_tolerance", terms[1], -1.0, kMostTime_s, "s");
  if (!starts || !ends) return starts ? ends : starts;
  for (std::size_t i = InputBlock::kTerms; i < terms.size(); ++i) {
    const std::size_t of = i - InputBlock::kTerms;
    const std::string& name = block_->components[of / InputBlock::kTermsOfJoint];
    const bool stays = of % InputBlock::kTermsOfJoint == 0;
    const Status fits = check_value(name + (stays ? " stays" : "'s tolerance"), terms[i],
                                    stays ? 0.0 : -1.0, stays ? 1.0 : kMostTolerance, {});
    if (!fits) return fits;
  }
  return {};
}

Status InputPort::check(std::span<const double> sample) const {
  if (sample.size() != block_->value.size()) {
    return fail_at(block_->name,
                   fmt::format("{} numbers are not {}", sample.size(), block_->value.size()),
                   "give every component");
  }
  if (block_->kind == InputKind::kTrajectory) return check_trajectory(sample);
  for (std::size_t i = 0; i < sample.size(); ++i) {
    const Status fits =
        check_value(block_->components[i], sample[i], min_[i], max_[i], block_->units[i]);
    if (!fits) return fits;
  }
  if (block_->kind == InputKind::kPose) {
    const double norm =
        std::hypot(std::hypot(sample[3], sample[4]), std::hypot(sample[5], sample[6]));
    if (!(std::abs(norm - 1.0) < kUnitNorm)) {
      return fail_at("qx, qy, qz, qw", fmt::format("have a norm of {:g}, not 1", norm),
                     "give a unit quaternion");
    }
  }
  return {};
}

Result<std::uint64_t> InputPort::offer(InputFeeder feeder, std::span<const double> sample) {
  {
    std::unique_lock lock(mutex_);
    if (const auto next = next_) {
      lock.unlock();
      return next->offer(feeder, sample);
    }
  }
  Status fits = check(sample);
  if (feeder != source_.feeder) {
    fits = fail_at(block_->name, fmt::format("is fed by its {}", to_string(source_.feeder)),
                   "[controller.inputs] of the experiment says by whom; one source at a time");
  }
  if (!fits) {
    refuse(fits.error());
    return std::unexpected(fits.error());
  }
  const std::lock_guard lock(mail_->mutex);
  Sample& back = mail_->feed.back();
  back.number = ++mail_->number;
  back.build = build_;
  std::ranges::copy(sample, back.values.begin());
  mail_->feed.publish();
  return mail_->number;
}

void InputPort::pass_over(std::uint64_t samples) noexcept {
  mail_->superseded.fetch_add(samples, std::memory_order_relaxed);
}

void InputPort::refuse(const Error& why) {
  mail_->refused.fetch_add(1, std::memory_order_relaxed);
  const std::lock_guard lock(mail_->mutex);
  mail_->why = why.to_string();
}

std::optional<std::uint64_t> InputPort::taken(std::uint64_t number) const noexcept {
  if (mail_->taken.load(std::memory_order_acquire) < number) return std::nullopt;
  return mail_->taken_cycle.load(std::memory_order_relaxed);
}

InputLook InputPort::look() const {
  std::vector<double> seen(shown_.size());
  while (!shown_.read(seen)) {
  }
  const std::lock_guard lock(mail_->mutex);
  return {.value = {seen.begin() + 3, seen.end()},
          .sequence = static_cast<std::uint64_t>(seen[0]),
          .cycle = static_cast<std::uint64_t>(seen[1]),
          .fresh = seen[2] != 0.0,
          .counts = {.arrived = mail_->arrived.load(std::memory_order_relaxed),
                     .refused = mail_->refused.load(std::memory_order_relaxed),
                     .superseded = mail_->superseded.load(std::memory_order_relaxed),
                     .timed_out = mail_->timed_out.load(std::memory_order_relaxed)},
          .why = mail_->why};
}

// The loop's.

void InputPort::begin(const hal::CycleTime& time, bool waits,
                      const hal::Outside& outside) noexcept TANDEM_RT {
  if (waits && !outside.closed && mail_->feed.refresh()) {
    const std::uint64_t number = mail_->feed.front().number;
    mail_->superseded.fetch_add(number - mail_->taken.load(std::memory_order_relaxed),
                                std::memory_order_relaxed);
    note_taken(number, time.cycle);
  }
  base_ = plan_.of_run ? 0 : time.cycle;
  const auto first = std::ranges::lower_bound(plan_.at, time.cycle - base_);
  row_ = static_cast<std::uint64_t>(first - plan_.at.begin());
  block_->sequence = block_->cycle = 0;
  block_->fresh = block_->arrived = false;
  hold(without_);
  show();
}

void InputPort::note_taken(std::uint64_t number, std::uint64_t cycle) noexcept TANDEM_RT {
  mail_->taken_cycle.store(cycle, std::memory_order_relaxed);
  mail_->taken.store(number, std::memory_order_release);
}

/// The sample of this cycle; empty: there is none.
std::span<const double> InputPort::next(std::uint64_t cycle,
                                        hal::Outside& outside) noexcept TANDEM_RT {
  const std::size_t size = block_->value.size();
  if (!plan_.at.empty()) {
    const auto from = plan_.at.begin() + static_cast<std::ptrdiff_t>(row_);
    const auto past = std::upper_bound(from, plan_.at.end(), cycle - base_);
    const bool again = plan_.repeat_cycles > 0 && block_->sequence > 0 &&
                       cycle - block_->cycle >= plan_.repeat_cycles;
    if (past == from && !again) return {};
    if (past - from > 1 && !outside.closed) {
      mail_->superseded.fetch_add(static_cast<std::uint64_t>(past - from) - 1,
                                  std::memory_order_relaxed);
    }
    row_ = static_cast<std::uint64_t>(past - plan_.at.begin());
    return plan_.row(row_ - 1, size);
  }
  if (outside.closed || !mail_->feed.refresh()) return {};
  outside.came = true;
  const Sample& sample = mail_->feed.front();
  const std::uint64_t before = mail_->taken.load(std::memory_order_relaxed);
  mail_->superseded.fetch_add(sample.number - before - 1, std::memory_order_relaxed);
  note_taken(sample.number, cycle);
  if (sample.build == build_ || admits(sample.values)) return sample.values;
  mail_->refused.fetch_add(1, std::memory_order_relaxed);  // it was offered to the former build
  return {};
}

bool InputPort::take(const hal::CycleTime& time, bool open,
                     hal::Outside& outside) noexcept TANDEM_RT {
  InputBlock& to = *block_;
  to.arrived = false;
  const std::span<const double> sample =
      open ? next(time.cycle, outside) : std::span<const double>();
  if (!sample.empty()) {
    hold(sample);
    ++to.sequence;
    to.cycle = time.cycle;
    to.fresh = to.arrived = true;
    if (!outside.closed) mail_->arrived.fetch_add(1, std::memory_order_relaxed);
    show();
    return true;
  }
  const bool silent = timeout_cycles_ > 0 && time.cycle - to.cycle > timeout_cycles_;
  if (!to.fresh || !silent) return false;
  to.fresh = false;
  if (to.options.after != AfterTimeout::kLast) hold(without_);
  if (!outside.closed) mail_->timed_out.fetch_add(1, std::memory_order_relaxed);
  show();
  return false;
}

bool InputPort::forget_waiting() {
  if (!mail_->feed.refresh()) return false;
  const std::uint64_t number = mail_->feed.front().number;
  const std::uint64_t before = mail_->taken.load(std::memory_order_relaxed);
  mail_->superseded.fetch_add(number - before - 1, std::memory_order_relaxed);
  note_taken(number, mail_->taken_cycle.load(std::memory_order_relaxed));
  refuse(fail("time went elsewhere before the cycle that would have taken it", "give it again")
             .error());
  return true;
}

void InputPort::hold(std::span<const double> values) noexcept TANDEM_RT {
  std::ranges::copy(values, block_->value.begin());
}

void InputPort::show() noexcept TANDEM_RT {
  scratch_[0] = static_cast<double>(block_->sequence);
  scratch_[1] = static_cast<double>(block_->cycle);
  scratch_[2] = block_->fresh ? 1.0 : 0.0;
  std::ranges::copy(block_->value, scratch_.begin() + 3);
  shown_.write(scratch_);
}

std::span<const std::byte> InputPort::message() noexcept TANDEM_RT {
  std::memcpy(scratch_.data(), &block_->cycle, sizeof(std::uint64_t));
  std::memcpy(scratch_.data() + 1, &block_->sequence, sizeof(std::uint64_t));
  std::ranges::copy(block_->value, scratch_.begin() + 2);
  return std::as_bytes(std::span(scratch_).first(2 + block_->value.size()));
}

void InputPort::archive(Archive& ar) {
  ar(base_, row_);
  if (ar.reading()) show();
}

Result<std::vector<std::shared_ptr<InputPort>>> make_input_ports(
    const std::shared_ptr<ControllerIo>& io, const std::string& controller, const hal::Robot& robot,
    std::int64_t period_ns, std::span<const InputSource> sources) {
  std::deque<InputBlock>& declared = io->inputs.all;
  if (declared.size() > InputBlock::kMost) {
    return fail_at(controller, "declares " + std::to_string(declared.size()) + " inputs",
                   "at most " + std::to_string(InputBlock::kMost));
  }
  std::vector<std::shared_ptr<InputPort>> ports;
  std::vector<std::string> names;
  for (InputBlock& block : declared) {
    if (std::ranges::find(names, block.name) != names.end()) {
      return fail_at(controller, "declares the input '" + block.name + "' twice",
                     "give each a name of its own");
    }
    names.push_back(block.name);
    const auto its = std::ranges::find(sources, block.name, &InputSource::name);
    auto port = InputPort::make(io, block, controller, robot, period_ns,
                                its == sources.end() ? nullptr : &*its);
    if (!port) return std::unexpected(port.error());
    ports.push_back(std::move(*port));
  }
  for (const InputSource& source : sources) {
    if (std::ranges::find(names, source.name) != names.end()) continue;
    Error error = source.where;
    error.message = "the controller '" + controller + "' has no input '" + source.name + "'";
    error.hint = names.empty() ? "it declares none" : suggest(source.name, names);
    return std::unexpected(std::move(error));
  }
  return ports;
}

}  // namespace tandem::runtime
