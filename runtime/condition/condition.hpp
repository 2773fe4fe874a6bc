// A condition on what a run measures, commands and knows: `torque(LKneeSag) > 40Nm`.
// Layer: runtime/condition.  Thread: read() non-RT; holds() and look() the loop's, or whose images
// they are.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/realtime.hpp"
#include "base/result.hpp"
#include "runtime/condition/quantity.hpp"

namespace tandem::runtime {

/// One step of an expression that is computed on a small stack.
struct ConditionStep {
  enum class Kind : std::uint8_t {
    kNumber,    ///< pushes `number`
    kQuantity,  ///< pushes quantity `index`
    kAdd,
    kSubtract,
    kNegate,
    kAbs,
    kLess,  ///< of two numbers, from here: the margin and whether it holds
    kLessEqual,
    kGreater,
    kGreaterEqual,
    kEqual,
    kNotEqual,
    kPhase,  ///< pushes whether the phase is `index`
    kFault,  ///< pushes whether one of the causes `index`, a bit each, was noted in this cycle
    kAnd,
    kOr,
    kNot,
  };
  Kind kind = Kind::kNumber;
  double number = 0.0;
  std::uint64_t index = 0;
};

/// What it computes: steps, and the quantities that they read.
struct ConditionProgram {
  /// A condition that needs more is refused.
  static constexpr std::size_t kStack = 16, kSteps = 256;

  /// A number, or a comparison's margin and whether it holds: 1 yes, 0 no, -1 nobody knows.
  struct Value {
    double number = 0.0;
    std::int8_t holds = -1;
  };
  std::vector<ConditionStep> steps;
  std::vector<Quantity> quantities;
  std::string unit;  ///< of what is compared: "Nm"; empty: plain numbers, or several units

  [[nodiscard]] Value run(const hal::CycleView& view) const noexcept TANDEM_RT;
  /// The same of numbers alone, without phases and faults: `known` has the quantities.
  [[nodiscard]] Value run(std::span<const double> known) const noexcept TANDEM_RT;

 private:
  template <class Push>
  [[nodiscard]] Value run_with(const Push& push) const noexcept TANDEM_RT;
};

/// Words and numbers of one:
///
///     condition   = all { "or" all }
///     all         = one { "and" one }
///     one         = "not" one | "(" condition ")" | comparison | "fault(" NAME ")"
///     comparison  = sum ("<" | "<=" | ">" | ">=" | "==" | "!=") sum
///                 | "phase()" ("==" | "!=") PHASE
///     sum         = term { ("+" | "-") term }
///     term        = [ "-" ] ( NUMBER [ UNIT ] | "abs(" sum ")" | QUANTITY )
///
/// QUANTITY as in find_quantity(). Both sides of a comparison have the same kind of unit; 0 needs
/// none. A PHASE is that of the run (`running`), a fault's NAME that of its cause (`board_silent`),
/// of its event (`fell`) or `any`: it holds in the cycle in which it is noted.
///
/// A comparison with a quantity that nobody has measured yet is unknown, and so is its `not`.
/// Unknown does not hold. `a or b` with an unknown `a` holds when `b` does.
///
/// Controllers come and go: what it reads of one that is stopped, replaced or removed is unknown
/// from then on, as is one that was loaded later under the same name. read() again finds that one.
class Condition {
 public:
  /// Parses `text` and looks every name up. What it needs later it keeps.
  /// Errors, each with the place in the text: what is no condition; an unknown name, with the
  /// nearest; a unit of another kind, or none where one is needed; one that is too long.
  [[nodiscard]] static Result<Condition> read(std::string_view text, const QuantityNames& names);

  /// Whether it does in this cycle. @rt no heap, no lock, some 10 ns a comparison
  [[nodiscard]] bool holds(const hal::CycleView& view) const noexcept TANDEM_RT {
    return program_.run(view).holds == 1;
  }
  /// How far it is from failing: greater than 0 when it holds with room, NaN when nobody knows.
  struct Look {
    bool holds = false;
    bool known = false;
    double margin = 0.0;  ///< [unit()] signed; infinite where a phase or fault decides
  };
  /// `and` has the smaller margin, `or` the larger, `not` the opposite one. @rt as holds()
  [[nodiscard]] Look look(const hal::CycleView& view) const noexcept TANDEM_RT;

  /// Unit of its margin; empty: plain numbers, or several units are compared.
  [[nodiscard]] const std::string& unit() const noexcept { return program_.unit; }
  /// Whether its comparisons have more than one unit, so that margins are not of a kind.
  [[nodiscard]] bool mixes_units() const noexcept { return mixes_units_; }
  /// Causes that it names, a bit each.
  [[nodiscard]] std::uint64_t faults() const noexcept;
  /// As it was given.
  [[nodiscard]] const std::string& text() const noexcept { return text_; }

 private:
  std::string text_;
  ConditionProgram program_;
  bool mixes_units_ = false;
};

/// A sum alone: "abs(torque(LKneeSag))".
class Expression {
 public:
  /// Errors: Condition::read()'s.
  [[nodiscard]] static Result<Expression> read(std::string_view text, const QuantityNames& names);

  /// In this cycle [unit()]; NaN: nobody has measured it yet. @rt as Condition::holds()
  [[nodiscard]] double value(const hal::CycleView& view) const noexcept TANDEM_RT {
    return program_.run(view).number;
  }
  /// The same where its quantities() have these numbers.
  [[nodiscard]] double value(std::span<const double> known) const noexcept TANDEM_RT {
    return program_.run(known).number;
  }
  [[nodiscard]] std::span<const Quantity> quantities() const noexcept {
    return program_.quantities;
  }
  [[nodiscard]] const std::string& unit() const noexcept { return program_.unit; }
  [[nodiscard]] const std::string& text() const noexcept { return text_; }

 private:
  std::string text_;
  ConditionProgram program_;
};

/// "40Nm", "0.5 rad", "2%" in SI, for a quantity in `unit`. Errors: no number; no finite one; a
/// unit of another kind; none, where `unit` has one and the number is not 0.
[[nodiscard]] Result<double> read_amount(std::string_view text, std::string_view unit);

}  // namespace tandem::runtime
