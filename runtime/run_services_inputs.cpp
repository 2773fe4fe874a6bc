// Inputs of controllers, as another thread sees and feeds them.
#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

#include "base/nearest.hpp"
#include "runtime/run_services.hpp"

namespace tandem::runtime {
namespace {

constexpr std::chrono::microseconds kSampleLook{200};  // between two looks for the sample's arrival

/// Way-points as a sample. Errors: too many of them, or a list of another length.
Result<std::vector<double>> trajectory_of(const InputBlock& input, const InputRequest& wish) {
  const std::size_t joints = input.components.size();
  const std::size_t step = 1 + 2 * joints;
  if (wish.points.size() > input.options.most_points) {
    return fail_at(input.name, std::to_string(wish.points.size()) + " way-points are too many",
                   "at most " + std::to_string(input.options.most_points));
  }
  std::vector<double> sample(input.values(), 0.0);
  const bool moves = !wish.points.empty() && !wish.points.front().velocity_rad_s.empty();
  sample[0] = static_cast<double>(wish.points.size());
  sample[1] = moves ? 1.0 : 0.0;
  for (std::size_t p = 0; p < wish.points.size(); ++p) {
    const InputRequest::Point& point = wish.points[p];
    if (point.position_rad.size() != joints ||
        point.velocity_rad_s.size() != (moves ? joints : 0)) {
      return fail_at(input.name,
                     "way-point " + std::to_string(p + 1) + " has not a number of each joint",
                     std::to_string(joints) + " positions, and as many velocities or none, of all");
    }
    auto at = sample.begin() + static_cast<std::ptrdiff_t>(2 + p * step);
    *at++ = point.after_s;
    at = std::ranges::copy(point.position_rad, at).out;
    std::ranges::copy(point.velocity_rad_s, at);
  }
  return sample;
}

Result<std::vector<double>> sample_of_wish(const InputPort& port, const InputRequest& wish) {
  const InputBlock& input = port.input();
  const bool way = input.kind == InputKind::kTrajectory;
  if (way ? !wish.components.empty() : !wish.points.empty()) {
    return fail_at(port.full_name(),
                   way ? "is fed with way-points" : "is fed with values, not with way-points",
                   way ? "--point 1.0,0.3,0.2" : "x=0.2 yaw=0.1");
  }
  if (way) return trajectory_of(input, wish);
  return sample_of(input, port.without(), wish.components, wish.numbers);
}

}  // namespace

std::vector<InputReport> RunServices::inputs() {
  const Lock lock(mutex_);
  collect();
  const ControllerSet active = host_->shown().active | host_->shadows().shown();
  std::vector<InputReport> all;
  for (std::size_t slot = 0; slot < kMostControllers; ++slot) {
    const auto& one = host_->owned()[slot];
    if (one == nullptr || one->leaves) continue;
    for (const auto& port : one->inputs) {
      InputReport& report = all.emplace_back(port, (active & only(slot)) != 0, port->look());
      if (report.active) continue;
      report.look.fresh = false;  // nobody takes samples: its start begins anew
      report.look.value.assign(port->without().begin(), port->without().end());
    }
  }
  return all;
}

std::vector<std::shared_ptr<InputPort>> RunServices::inputs_of(InputFeeder feeder) {
  const Lock lock(mutex_);
  std::vector<std::shared_ptr<InputPort>> all;
  for (const auto& one : host_->owned()) {
    if (one == nullptr) continue;
    for (const auto& port : one->inputs) {
      if (port->source().feeder == feeder) all.push_back(port);
    }
  }
  return all;
}

Result<std::shared_ptr<InputPort>> RunServices::input_of(const std::string& name) const {
  std::vector<std::string> known;
  const bool full = name.find('/') != std::string::npos;
  std::vector<std::shared_ptr<InputPort>> found;
  for (const auto& one : host_->owned()) {
    if (one == nullptr || one->leaves) continue;
    for (const auto& port : one->inputs) {
      known.push_back(full ? port->full_name() : port->input().name);
      if (name == port->full_name()) return port;
      if (name == port->input().name) found.push_back(port);
    }
  }
  if (found.size() == 1) return found.front();
  std::ranges::sort(known);
  known.erase(std::ranges::unique(known).begin(), known.end());
  if (!found.empty()) {
    return fail_at(name, std::to_string(found.size()) + " controllers have an input of this name",
                   "name it as " + found.front()->full_name());
  }
  return fail_at(name, "no loaded controller has an input '" + name + "'",
                 known.empty() ? "none of them has any" : suggest(name, known));
}

void RunServices::name_owner(std::function<std::string()> owner) {
  const Lock lock(mutex_);
  owner_ = std::move(owner);
}

Status RunServices::check_runs_locked(const InputPort& port) const {
  if (asks_ahead_) return {};
  if (const std::string who = owner_ ? owner_() : std::string(); !who.empty()) {
    return fail_at(port.full_name(), "'" + who + "' commands the robot",
                   "wait until it releases the robot");
  }
  const RunPhase phase = progress_->phase.load();
  if (phase != RunPhase::kRunning) {
    return fail_at(port.full_name(),
                   std::string("no sample is taken in the phase ") + to_string(phase),
                   "ask again in the phase running");
  }
  const ControllerSet active = host_->shown().active | host_->shadows().shown();
  for (std::size_t slot = 0; slot < kMostControllers; ++slot) {
    const auto& one = host_->owned()[slot];
    if (one == nullptr || (active & only(slot)) == 0) continue;
    const auto is_its = [&port](const auto& other) { return other.get() == &port; };
    if (std::ranges::any_of(one->inputs, is_its)) return {};
  }
  return fail_at(port.full_name(), "its controller is not active",
                 "tandem controller start " + port.controller());
}

Status RunServices::check_runs(const InputPort& port) {
  const Lock lock(mutex_);
  return check_runs_locked(port);
}

Result<RequestResult> RunServices::set_input(const std::string& name, const InputRequest& wish,
                                             Patience patience) {
  Lock lock(mutex_);
  collect();
  const auto port = input_of(name);
  if (!port) return std::unexpected(port.error());
  const Status runs = check_runs_locked(**port);
  const auto sample = runs ? sample_of_wish(**port, wish) : std::unexpected(runs.error());
  if (!sample) {
    (*port)->refuse(sample.error());
    return std::unexpected(sample.error());
  }
  const auto number = (*port)->offer(InputFeeder::kCommand, *sample);
  if (!number) return std::unexpected(number.error());
  if (asks_ahead_) return RequestResult{.done = true};
  lock.unlock();  // the port stays, and a flood of samples holds up nobody else
  const auto deadline = std::chrono::steady_clock::now() + patience;
  for (;;) {
    if (const auto cycle = (*port)->taken(*number)) {
      return RequestResult{.done = true, .cycle = *cycle, .phase = progress_->phase.load()};
    }
    const bool stands = asker_.attends() || inbox_->clock().state().standing ||
                        progress_->phase.load() != RunPhase::kRunning;
    if (stands || std::chrono::steady_clock::now() >= deadline)
      return RequestResult{.stands = inbox_->clock().state().standing};
    std::this_thread::sleep_for(kSampleLook);
  }
}

void RunServices::refuse_input(const std::string& name, const Error& why) {
  const Lock lock(mutex_);
  if (const auto port = input_of(name)) (*port)->refuse(why);
}

}  // namespace tandem::runtime
