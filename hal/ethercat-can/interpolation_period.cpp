#include "hal/ethercat-can/interpolation_period.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>
#include <vector>

#include "canopen/drive_abilities.hpp"
#include "canopen/objects.hpp"

namespace tandem::hal::can {
namespace {

namespace object = canopen::object;

constexpr int kNanosecond = -9;  // a cycle is a whole number of these
constexpr int kSecond = 0;       // and no longer than one

std::int64_t unit_ns(int power) noexcept {
  std::int64_t unit = 1;
  for (int p = kNanosecond; p < power; ++p) unit *= 10;
  return unit;
}

bool takes_period(const canopen::DataSheet& sheet, int axis) {
  const std::uint16_t index = canopen::of_axis(object::kInterpolationPeriod, axis);
  return canopen::writable(sheet, index, 1) && canopen::writable(sheet, index, 2);
}

/// A joint's drive of another make whose 60C2 can be written.
struct Drive {
  const JointConfig* joint;
  const BoardConfig* board;
  InterpolationLimits limits;
};

std::vector<Drive> drives_with_period(const RobotConfig& robot) {
  std::vector<Drive> all;
  for (const JointConfig& joint : robot.joints) {
    const BoardConfig* board = robot.board(joint.board);
    if (board == nullptr || board->eds.empty() || !takes_period(*board->sheet, joint.axis))
      continue;
    all.push_back({&joint, board, InterpolationLimits::of(*board->sheet, joint.axis)});
  }
  return all;
}

/// Whether every drive takes this period.
bool all_take(std::int64_t ns, const std::vector<Drive>& drives) {
  return std::ranges::all_of(
      drives, [&](const Drive& one) { return interpolation_period(ns, one.limits).has_value(); });
}

/// Whether each board's control divides it or is divided by it.
bool divides(std::int64_t ns, const RobotConfig& robot) {
  return std::ranges::all_of(robot.boards, [&](const BoardConfig& board) {
    return ns % board.control_period_ns == 0 || board.control_period_ns % ns == 0;
  });
}

/// The nearest periods below and above that are as `right` says, between half and twice of it.
template <class Right>
std::vector<std::string> nearest_periods(std::int64_t period_ns, const Right& right) {
  constexpr std::int64_t kLeast_ns = 10'000;  // of a loop
  constexpr std::int64_t kMost_ns = 1'000'000'000;
  std::int64_t below = 0;
  std::int64_t above = 0;
  for (int power = kNanosecond; power <= kSecond; ++power) {
    for (std::int64_t units = 1; units <= 255; ++units) {
      const std::int64_t ns = units * unit_ns(power);
      const bool near = ns >= std::max(kLeast_ns, period_ns / 2) &&
                        ns <= std::min(kMost_ns, 2 * period_ns) && ns != period_ns;
      if (!near || !right(ns)) continue;
      if (ns < period_ns) below = std::max(below, ns);
      if (ns > period_ns && (above == 0 || ns < above)) above = ns;
    }
  }
  std::vector<std::string> found;
  for (const std::int64_t ns : {below, above}) {
    if (ns != 0) found.push_back(std::to_string(ns));
  }
  return found;
}

/// What to do: periods that fit the boards' control, too, where there are any.
std::string remedy(std::int64_t period_ns, const std::vector<Drive>& drives,
                   const RobotConfig& robot) {
  const auto taken = [&](std::int64_t ns) { return all_take(ns, drives); };
  const auto both = [&](std::int64_t ns) { return taken(ns) && divides(ns, robot); };
  constexpr const char* kSet = "set period_ns of the experiment to ";
  if (const auto periods = nearest_periods(period_ns, both); !periods.empty()) {
    return fmt::format("{}{}", kSet, fmt::join(periods, " or "));
  }
  if (const auto periods = nearest_periods(period_ns, taken); !periods.empty()) {
    return fmt::format("{}{}, and each control_period_ns to one that fits it", kSet,
                       fmt::join(periods, " or "));
  }
  return "choose another period_ns of the experiment, or correct the sheet's limits";
}

}  // namespace

InterpolationLimits InterpolationLimits::of(const canopen::DataSheet& sheet, int axis) {
  InterpolationLimits limits;
  const std::uint16_t index = canopen::of_axis(object::kInterpolationPeriod, axis);
  const auto narrow = [&](std::uint8_t sub, auto& least, auto& most) {
    const canopen::SheetEntry* entry = sheet.find(index, sub);
    if (entry == nullptr) return;
    const std::int64_t low = entry->low.value_or(least);
    const std::int64_t high = entry->high.value_or(most);
    const bool some = low <= most && high >= least && low <= high;
    if (!some) return;  // no period at all: the limits are wrong
    least =
        static_cast<std::remove_reference_t<decltype(least)>>(std::max<std::int64_t>(low, least));
    most = static_cast<std::remove_reference_t<decltype(most)>>(std::min<std::int64_t>(high, most));
  };
  narrow(1, limits.least_units, limits.most_units);
  narrow(2, limits.least_power, limits.most_power);
  return limits;
}

std::optional<InterpolationPeriod> interpolation_period(
    std::int64_t period_ns, const InterpolationLimits& limits) noexcept TANDEM_RT {
  constexpr std::array kPowers{-3, -4, -5, -6, -7, -8, -9, -2, -1, 0};
  for (const int power : kPowers) {
    if (power < limits.least_power || power > limits.most_power) continue;
    const std::int64_t unit = unit_ns(power);
    const std::int64_t units = period_ns / unit;
    if (period_ns % unit != 0 || units < limits.least_units || units > limits.most_units) continue;
    return InterpolationPeriod{static_cast<std::uint8_t>(units), static_cast<std::int8_t>(power)};
  }
  return {};
}

Diagnostics check_interpolation(const RobotConfig& robot, std::int64_t period_ns) {
  const std::vector<Drive> drives = drives_with_period(robot);
  Diagnostics errors;
  std::set<std::string> seen;  // sheets that several joints have
  for (const Drive& one : drives) {
    if (interpolation_period(period_ns, one.limits)) continue;
    if (!seen.insert(fmt::format("{}:{}", one.board->eds, one.joint->axis)).second) continue;
    errors.push_back({.message = fmt::format("the drive of joint '{}' cannot be told a cycle of {} "
                                             "ns: 60C2 in {} is {} to {} times "
                                             "10^{} to 10^{} s",
                                             one.joint->name, period_ns, one.board->eds,
                                             one.limits.least_units, one.limits.most_units,
                                             one.limits.least_power, one.limits.most_power),
                      .hint = remedy(period_ns, drives, robot),
                      .file = robot.file,
                      .line = one.board->line,
                      .key = "board '" + one.board->name + "'"});
  }
  return errors;
}

}  // namespace tandem::hal::can
