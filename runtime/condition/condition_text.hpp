// The text of a condition, word by word, as a program.
// Layer: runtime/condition.  Thread: non-RT only.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "runtime/condition/condition.hpp"

namespace tandem::runtime {

/// Reads one text, from its begin to its end.
class ConditionText {
 public:
  ConditionText(std::string_view text, const QuantityNames* names) : text_(text), names_(names) {}

  /// A whole text that is a condition. @pre names
  [[nodiscard]] Result<ConditionProgram> condition();
  /// One that is a sum. @pre names
  [[nodiscard]] Result<ConditionProgram> expression();
  /// One that is a number with a unit, in SI.
  [[nodiscard]] Result<double> amount(std::string_view unit);
  [[nodiscard]] bool mixes_units() const { return units_.size() > 1; }

 private:
  using Kind = ConditionStep::Kind;
  /// What a sum is in.
  struct Measure {
    std::string unit;
    bool any = false;   // a 0, which is one of every unit
    std::size_t begin;  // of its text
  };

  void any_of();
  void all_of();
  void one_of();
  void comparison();
  void phase(std::size_t begin);
  void fault(std::size_t begin);
  Measure sum();
  Measure term();
  Measure number();
  Measure quantity(std::size_t begin, std::string_view word);
  /// Both are of one unit, which is returned.
  Measure agree(const Measure& one, const Measure& other);

  void blanks();
  [[nodiscard]] bool at_end();
  /// Takes `sign` when it comes next.
  bool take(std::string_view sign);
  /// The word that comes next; empty: none does. `look` leaves it there.
  std::string_view word();
  std::string_view look_word();
  /// From "(" to ")", without blanks around.
  std::optional<std::string_view> argument();
  void end();

  void push(Kind kind, double number = 0.0, std::uint64_t index = 0);
  void refuse(std::size_t at, std::string message, std::string hint);
  [[nodiscard]] std::string part(std::size_t begin) const;
  [[nodiscard]] Result<ConditionProgram> result();

  std::string_view text_;
  const QuantityNames* names_;
  std::size_t at_ = 0;
  std::size_t deep_ = 0;     // levels of brackets and words `not`
  std::size_t stacked_ = 0;  // values on the stack there
  ConditionProgram program_;
  std::set<std::string> units_;   // of comparisons
  std::optional<Error> refused_;  // the first; nothing is read after it
};

}  // namespace tandem::runtime
