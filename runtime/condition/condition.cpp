#include "runtime/condition/condition.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "runtime/condition/condition_text.hpp"

namespace tandem::runtime {
namespace {

using Kind = ConditionStep::Kind;
using Value = ConditionProgram::Value;

Value compare(Kind kind, double a, double b) noexcept TANDEM_RT {
  if (std::isnan(a) || std::isnan(b)) return {std::numeric_limits<double>::quiet_NaN(), -1};
  const auto as = [](double margin, bool holds) {
    return Value{margin, static_cast<std::int8_t>(holds ? 1 : 0)};
  };
  switch (kind) {
    case Kind::kLess: return as(b - a, a < b);
    case Kind::kLessEqual: return as(b - a, a <= b);
    case Kind::kGreater: return as(a - b, a > b);
    case Kind::kGreaterEqual: return as(a - b, a >= b);
    case Kind::kEqual: return as(-std::abs(a - b), a == b);
    default: return as(std::abs(a - b), a != b);
  }
}

/// `no` is what decides alone: 0 of "and", 1 of "or".
Value join(const Value& a, const Value& b, std::int8_t decides) noexcept TANDEM_RT {
  const auto nearest = [decides](double x, double y) {
    return decides == 0 ? std::min(x, y) : std::max(x, y);
  };
  if (a.holds == decides && b.holds == decides) return {nearest(a.number, b.number), decides};
  if (a.holds == decides) return a;
  if (b.holds == decides) return b;
  if (a.holds < 0) return a;
  if (b.holds < 0) return b;
  return {nearest(a.number, b.number), a.holds};
}

Value flag(bool is) noexcept TANDEM_RT {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  return {is ? kFar : -kFar, static_cast<std::int8_t>(is ? 1 : 0)};
}

}  // namespace

/// @param push  the value of a step that reads the run
template <class Push>
Value ConditionProgram::run_with(const Push& push) const noexcept TANDEM_RT {
  std::array<Value, kStack> stack;
  std::size_t top = 0;  // ConditionText has counted that it fits
  for (const ConditionStep& step : steps) {
    switch (step.kind) {
      case Kind::kNumber: stack[top++] = {step.number, -1}; continue;
      case Kind::kQuantity:
      case Kind::kPhase:
      case Kind::kFault: stack[top++] = push(step); continue;
      case Kind::kNegate: stack[top - 1].number = -stack[top - 1].number; continue;
      case Kind::kAbs: stack[top - 1].number = std::abs(stack[top - 1].number); continue;
      case Kind::kNot: {
        Value& of = stack[top - 1];
        of = {-of.number, static_cast<std::int8_t>(of.holds < 0 ? -1 : 1 - of.holds)};
        continue;
      }
      default: break;
    }
    const Value right = stack[--top];
    Value& left = stack[top - 1];
    switch (step.kind) {
      case Kind::kAdd: left.number += right.number; break;
      case Kind::kSubtract: left.number -= right.number; break;
      case Kind::kAnd: left = join(left, right, 0); break;
      case Kind::kOr: left = join(left, right, 1); break;
      default: left = compare(step.kind, left.number, right.number); break;
    }
  }
  return stack[0];
}

Value ConditionProgram::run(const hal::CycleView& view) const noexcept TANDEM_RT {
  return run_with([this, &view](const ConditionStep& step) noexcept {
    switch (step.kind) {
      case Kind::kPhase: return flag(static_cast<std::uint64_t>(view.phase) == step.index);
      case Kind::kFault: return flag((view.faults & step.index) != 0);
      default: return Value{quantities[step.index].read(view), -1};
    }
  });
}

Value ConditionProgram::run(std::span<const double> known) const noexcept TANDEM_RT {
  return run_with([known](const ConditionStep& step) noexcept {
    return Value{known[step.index], -1};
  });
}

Condition::Look Condition::look(const hal::CycleView& view) const noexcept TANDEM_RT {
  const Value value = program_.run(view);
  return {.holds = value.holds == 1, .known = value.holds >= 0, .margin = value.number};
}

std::uint64_t Condition::faults() const noexcept {
  std::uint64_t causes = 0;
  for (const ConditionStep& step : program_.steps)
    if (step.kind == Kind::kFault) causes |= step.index;
  return causes;
}

Result<Condition> Condition::read(std::string_view text, const QuantityNames& names) {
  ConditionText reader(text, &names);
  Result<ConditionProgram> program = reader.condition();
  if (!program) return std::unexpected(program.error());
  Condition condition;
  condition.text_ = text;
  condition.program_ = std::move(*program);
  condition.mixes_units_ = reader.mixes_units();
  return condition;
}

Result<Expression> Expression::read(std::string_view text, const QuantityNames& names) {
  Result<ConditionProgram> program = ConditionText(text, &names).expression();
  if (!program) return std::unexpected(program.error());
  Expression expression;
  expression.text_ = text;
  expression.program_ = std::move(*program);
  return expression;
}

Result<double> read_amount(std::string_view text, std::string_view unit) {
  return ConditionText(text, nullptr).amount(unit);
}

}  // namespace tandem::runtime
