// What of a recording lies: it is found in the signals themselves, and becomes NaN.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "identification/recording.hpp"

namespace tandem::identification {
namespace {

constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();

void bridge(Signal& signal) {
  std::size_t i = 0;
  while (i < signal.size() && std::isnan(signal[i])) ++i;
  while (i < signal.size()) {
    while (i < signal.size() && !std::isnan(signal[i])) ++i;
    const std::size_t hole = i;
    while (i < signal.size() && std::isnan(signal[i])) ++i;
    const std::size_t samples = i - hole;
    if (i == signal.size() || samples > kBridge_samples) continue;
    const double before = signal[hole - 1];
    const double slope = (signal[i] - before) / static_cast<double>(samples + 1);
    for (std::size_t k = 0; k < samples; ++k)
      signal[hole + k] = before + slope * static_cast<double>(k + 1);
  }
}

/// A stretch of samples.
struct Stretch {
  std::size_t begin, end;
};

/// Stretches of at least `least` samples in which `signal` has one and the same value.
std::vector<Stretch> constant_stretches(const Signal& signal, std::size_t least) {
  std::vector<Stretch> found;
  for (std::size_t i = 0; i < signal.size();) {
    std::size_t k = i + 1;
    while (k < signal.size() && signal[k] == signal[i]) ++k;
    if (k - i >= least && !std::isnan(signal[i])) found.push_back({i, k});
    i = k;
  }
  return found;
}

/// How far a signal goes within a stretch; NaN when it has no value there.
double travel(const Signal& signal, Stretch stretch) {
  double low = kNothing, high = kNothing;
  for (std::size_t i = stretch.begin; i < stretch.end; ++i) {
    if (std::isnan(signal[i])) continue;
    low = std::isnan(low) ? signal[i] : std::min(low, signal[i]);
    high = std::isnan(high) ? signal[i] : std::max(high, signal[i]);
  }
  return high - low;
}

void erase(Signal& signal, Stretch stretch) {
  std::fill(signal.begin() + static_cast<std::ptrdiff_t>(stretch.begin),
            signal.begin() + static_cast<std::ptrdiff_t>(stretch.end), kNothing);
}

/// One remark for all the stretches of a signal.
void remark(Recording& recording, const std::string& what, const std::vector<Stretch>& stretches) {
  if (stretches.empty()) return;
  std::size_t samples = 0;
  for (const Stretch& one : stretches) samples += one.end - one.begin;
  const LeftOut left{recording.path, what, static_cast<double>(samples) * recording.period_s,
                     recording.time_s[stretches[0].begin], recording.time_s[stretches[0].end - 1]};
  recording.remarks.push_back(
      fmt::format("{}: {:.3f} s excluded, the first from {:.3f} to {:.3f} s", what, left.sum_s,
                  left.first_begin_s, left.first_end_s));
  recording.left_out.push_back(left);
}

/// The smallest step of a signal: of its encoder or its wire.
double quantum_of(const Signal& signal) {
  double quantum = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < signal.size(); ++i) {
    const double step = std::abs(signal[i] - signal[i - 1]);
    if (step > 0.0) quantum = std::min(quantum, step);
  }
  return quantum;
}

/// Whether a signal goes on somewhere else after it stood still: a small one that is rounded stands
/// still by itself, and goes on by one step.
bool jumps(const Signal& signal, Stretch stretch) {
  const double quantum = quantum_of(signal);
  if (stretch.end == signal.size()) {
    return stretch.end - stretch.begin > signal.size() / 10 &&
           travel(signal, {0, signal.size()}) > 20.0 * quantum;
  }
  return std::abs(signal[stretch.end] - signal[stretch.begin]) > 5.0 * quantum;
}

/// Signals that a fault may freeze: what must move when the joint does, and by how much.
constexpr double kFrozen_s = 0.2;
constexpr double kMoves_rad = 0.02;

/// Whether a position lies that stands still, from itself alone: a joint has inertia, so it comes
/// to rest little by little and leaves it so. A frozen encoder stops in one sample at full speed,
/// or is somewhere else in one sample.
bool stops_or_leaves_at_once(const Recording& recording, const Signal& position, Stretch one) {
  constexpr double kNear_s = 0.02, kSlow_rad_s = 0.05;
  const double least = std::max(5.0 * quantum_of(position), kSlow_rad_s * recording.period_s);
  const auto near =
      static_cast<std::size_t>(std::max(3.0, std::ceil(kNear_s / recording.period_s)));
  if (one.begin > near) {
    const double step = position[one.begin] - position[one.begin - 1];
    const double way = position[one.begin] - position[one.begin - near];
    // A joint that brakes evenly goes a fifth of the mean or less in the last of five samples.
    const bool at_once = std::abs(step) * static_cast<double>(near) > 0.6 * std::abs(way);
    if (at_once && std::abs(way) > least * static_cast<double>(near)) return true;
  }
  if (one.end + 2 < position.size()) {
    const double leap = std::abs(position[one.end] - position[one.end - 1]);
    const double next = std::abs(position[one.end + 2] - position[one.end]);
    if (leap > least && leap > 1.5 * next) return true;
  }
  return false;
}

}  // namespace

void bridge_holes(Recording& recording) {
  for (std::vector<Signal>* signals :
       {&recording.position_rad, &recording.torque_Nm, &recording.motor_position_rad,
        &recording.current_A, &recording.reference_rad, &recording.sensor}) {
    for (Signal& signal : *signals) bridge(signal);
  }
}

void exclude_frozen(Recording& recording, const hal::RobotConfig& robot) {
  const auto least = static_cast<std::size_t>(std::ceil(kFrozen_s / recording.period_s));
  std::vector<std::vector<Stretch>> frozen_positions(robot.joints.size());
  for (std::size_t j = 0; j < robot.joints.size(); ++j) {
    Signal& position = recording.position_rad[j];
    std::vector<Stretch> torque;
    for (const Stretch& one : constant_stretches(position, least)) {
      const bool led = travel(recording.reference_rad[j], one) > kMoves_rad;
      const bool driven = travel(recording.motor_position_rad[j], one) > kMoves_rad;
      if (led || driven || stops_or_leaves_at_once(recording, position, one))
        frozen_positions[j].push_back(one);
    }
    for (const Stretch& one : constant_stretches(recording.torque_Nm[j], least)) {
      if (travel(position, one) > 5.0 * kMoves_rad && jumps(recording.torque_Nm[j], one))
        torque.push_back(one);
    }
    for (const Stretch& one : frozen_positions[j]) erase(position, one);
    for (const Stretch& one : torque) erase(recording.torque_Nm[j], one);
    const std::string joint = "joint '" + robot.joints[j].name + "': its ";
    remark(recording, joint + "position stands still while the joint is moved",
           frozen_positions[j]);
    remark(recording, joint + "torque stands still while the joint moves", torque);
  }
  std::size_t channel = 0;
  for (const hal::SensorConfig& sensor : robot.sensors) {
    const std::size_t first = channel;
    channel += sensor.channels();
    std::vector<Stretch> frozen;
    for (const Stretch& one : constant_stretches(recording.sensor[first], least)) {
      bool same = true, moves = false;
      for (std::size_t c = first; c < channel; ++c)
        same = same && travel(recording.sensor[c], one) == 0.0;
      for (const Signal& position : recording.position_rad)
        moves = moves || travel(position, one) > 5.0 * kMoves_rad;
      if (same && moves) frozen.push_back(one);
    }
    for (const Stretch& one : frozen)
      for (std::size_t c = first; c < channel; ++c) erase(recording.sensor[c], one);
    remark(recording, "sensor '" + sensor.name + "' stands still while the robot moves", frozen);
  }
}

void exclude_clipped(Recording& recording, const hal::RobotConfig& robot) {
  const auto least = static_cast<std::size_t>(std::ceil(0.03 / recording.period_s));
  for (std::size_t j = 0; j < robot.joints.size(); ++j) {
    Signal& torque = recording.torque_Nm[j];
    const double quantum = quantum_of(torque);
    double low = 0.0, high = 0.0;
    for (const double one : torque) {
      if (std::isnan(one)) continue;
      low = std::min(low, one);
      high = std::max(high, one);
    }
    // A smooth extremum that is rounded: within half of its plateau's length it is three steps
    // lower. What is cut off by h is 3 h lower. Where one stretch is cut off, all at this value
    // are.
    bool cut[] = {false, false};
    std::vector<Stretch> plateaus;
    for (const Stretch& one : constant_stretches(torque, least)) {
      const double value = torque[one.begin];
      if (value != low && value != high) continue;
      const std::size_t half = (one.end - one.begin) / 2;
      const double before = travel(torque, {one.begin - std::min(one.begin, half), one.begin + 1});
      const double after = travel(torque, {one.end - 1, std::min(one.end + half, torque.size())});
      double rise = std::min(before, after);
      if (one.begin == 0) rise = after;
      if (one.end == torque.size()) rise = before;
      const bool at_limit = std::abs(value) >= 0.99 * robot.joints[j].max_torque_Nm;
      cut[value == high] |= at_limit || rise > 10.0 * quantum;
      plateaus.push_back(one);
    }
    std::vector<Stretch> clipped;
    for (const Stretch& one : plateaus)
      if (cut[torque[one.begin] == high]) clipped.push_back(one);
    for (const Stretch& one : clipped) erase(torque, one);
    remark(recording, "joint '" + robot.joints[j].name + "': its torque is cut off at a limit",
           clipped);
  }
}

void undo_holds(Signal& signal) {
  constexpr std::size_t kLongest = 20;
  std::size_t every = 1, phase = 0;
  for (std::size_t e = 2; e <= kLongest; ++e) {
    std::vector<std::size_t> changes(e, 0);
    std::size_t total = 0;
    for (std::size_t i = 1; i < signal.size(); ++i) {
      if (!(signal[i] != signal[i - 1]) || std::isnan(signal[i]) || std::isnan(signal[i - 1]))
        continue;
      ++changes[i % e];
      ++total;
    }
    const auto most = std::ranges::max_element(changes);
    if (total < 20 || static_cast<double>(*most) < 0.98 * static_cast<double>(total)) continue;
    every = e;
    phase = static_cast<std::size_t>(most - changes.begin());
  }
  if (every == 1) return;
  for (std::size_t at = phase; at + every < signal.size(); at += every) {
    const double from = signal[at], to = signal[at + every];
    for (std::size_t k = 1; k < every; ++k)
      signal[at + k] = from + (to - from) * static_cast<double>(k) / static_cast<double>(every);
  }
}

}  // namespace tandem::identification
