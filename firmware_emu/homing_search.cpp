// One table of the methods, and four legs for all of them (IEC 61800-7-201, homing mode).
#include "firmware_emu/homing_search.hpp"

#include <array>
#include <utility>

#include "base/archive.hpp"

namespace tandem::firmware {
namespace {

enum class Switch : std::uint8_t { kLow, kHigh, kHome };

/// A method that looks for a switch.
struct Plan {
  Switch at;
  int first;    ///< the way to begin with
  int last;     ///< the way over the edge, and on to the index pulse
  bool leaves;  ///< the edge where the switch opens on the last way; else where it closes
};

/// Methods 1 to 14; 17 to 30 are the same without an index pulse. A home switch of 3 and 4 is
/// active up to the upper end of the range, one of 5 and 6 down to the lower end.
constexpr std::array<Plan, 14> kPlans{{{Switch::kLow, -1, +1, true},
                                       {Switch::kHigh, +1, -1, true},
                                       {Switch::kHome, +1, -1, true},
                                       {Switch::kHome, +1, +1, false},
                                       {Switch::kHome, -1, +1, true},
                                       {Switch::kHome, -1, -1, false},
                                       {Switch::kHome, +1, -1, true},
                                       {Switch::kHome, +1, +1, false},
                                       {Switch::kHome, +1, -1, false},
                                       {Switch::kHome, +1, +1, true},
                                       {Switch::kHome, -1, +1, true},
                                       {Switch::kHome, -1, -1, false},
                                       {Switch::kHome, -1, +1, false},
                                       {Switch::kHome, -1, -1, true}}};
constexpr int kWithoutIndex = 16;  // between a method with index pulse and the same without
constexpr int kIndexBelow = 33;
constexpr int kIndexAbove = 34;

constexpr bool is_here(int method) { return method == 35 || method == 37; }
constexpr bool is_index_alone(int method) { return method == kIndexBelow || method == kIndexAbove; }
constexpr bool has_plan(int method) {
  const int number = method > kWithoutIndex ? method - kWithoutIndex : method;
  return number >= 1 && number <= static_cast<int>(kPlans.size());
}
const Plan& plan_of(int method) {
  const int number = method > kWithoutIndex ? method - kWithoutIndex : method;
  return kPlans[static_cast<std::size_t>(number - 1)];
}

bool is_active(Switch at, const HomingSenses& seen) {
  switch (at) {
    case Switch::kLow: return seen.at_low_switch;
    case Switch::kHigh: return seen.at_high_switch;
    case Switch::kHome: return seen.at_home_switch;
  }
  return false;
}

/// At the limit switch to which this way leads.
bool ends(const HomingSenses& seen, int direction) {
  return direction > 0 ? seen.at_high_switch : seen.at_low_switch;
}

}  // namespace

bool HomingSearch::has(int method) noexcept TANDEM_RT {
  return has_plan(method) || is_index_alone(method) || is_here(method);
}

void HomingSearch::begin(int method) noexcept TANDEM_RT {
  method_ = static_cast<std::int8_t>(method);
  reversed_ = was_active_ = false;
  if (is_here(method)) return enter(Step::kHere, 0);
  if (is_index_alone(method)) return enter(Step::kIndex, method == kIndexAbove ? 1 : -1);
  enter(Step::kFind, plan_of(method).first);
}

void HomingSearch::enter(Step step, int direction) noexcept {
  step_ = step;
  direction_ = static_cast<std::int8_t>(direction);
  turned_ = true;
}

HomingSearch::Result HomingSearch::step(const HomingSenses& seen) noexcept TANDEM_RT {
  turned_ = false;
  const auto way = static_cast<std::int32_t>(static_cast<std::uint32_t>(seen.position) -
                                             static_cast<std::uint32_t>(was_at_));
  was_at_ = seen.position;
  switch (step_) {
    case Step::kHere: return Result::kFound;
    case Step::kFind: return find(seen);
    case Step::kClear:
      if (crosses(seen, way, false)) {
        enter(Step::kEdge, plan_of(method_).last);
        return Result::kMoves;
      }
      break;
    case Step::kEdge:
      if (!crosses(seen, way, !plan_of(method_).leaves)) break;
      if (method_ > kWithoutIndex) return Result::kFound;
      step_ = Step::kIndex;
      return Result::kMoves;
    case Step::kIndex:
      if (seen.index == direction_) return Result::kFound;
      break;
  }
  return ends(seen, direction_) ? Result::kFailed : Result::kMoves;
}

/// Whether the switch closes, or opens, while the axis is on its way: then it is the edge that is
/// meant. What it sees while it still turns round, or swings, is none.
bool HomingSearch::crosses(const HomingSenses& seen, std::int32_t way, bool closes) noexcept {
  const bool before = std::exchange(was_active_, is_active(plan_of(method_).at, seen));
  const bool on_its_way = way != 0 && (way > 0) == (direction_ > 0);
  return on_its_way && before != closes && was_active_ == closes;
}

HomingSearch::Result HomingSearch::find(const HomingSenses& seen) noexcept {
  const Plan& plan = plan_of(method_);
  if (is_active(plan.at, seen)) {
    was_active_ = true;
    enter(plan.leaves ? Step::kEdge : Step::kClear, plan.leaves ? plan.last : -plan.last);
    return Result::kMoves;
  }
  if (!ends(seen, direction_)) return Result::kMoves;
  if (std::exchange(reversed_, true)) return Result::kFailed;
  enter(Step::kFind, -direction_);
  return Result::kMoves;
}

void HomingSearch::archive(Archive& ar) {
  ar(method_, step_, direction_, turned_, reversed_, was_active_, was_at_);
}

}  // namespace tandem::firmware
