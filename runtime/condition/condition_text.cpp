#include "runtime/condition/condition_text.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <utility>
#include <vector>

#include "base/nearest.hpp"
#include "base/quoting.hpp"
#include "runtime/condition/fault_names.hpp"
#include "runtime/condition/unit.hpp"

namespace tandem::runtime {
namespace {

constexpr hal::RunPhase kPhases[] = {
    hal::RunPhase::kBringUp, hal::RunPhase::kSettling,  hal::RunPhase::kRunning,
    hal::RunPhase::kFaulted, hal::RunPhase::kResetting, hal::RunPhase::kShutDown,
    hal::RunPhase::kDone,    hal::RunPhase::kHeld,      hal::RunPhase::kRetreating};

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_keyword(std::string_view word) { return word == "and" || word == "or" || word == "not"; }

std::string in_unit(const std::string& unit) {
  return unit.empty() ? "is a plain number" : "is in " + unit;
}

}  // namespace

Result<ConditionProgram> ConditionText::condition() {
  any_of();
  end();
  if (units_.size() == 1) program_.unit = *units_.begin();
  return result();
}

Result<ConditionProgram> ConditionText::expression() {
  program_.unit = sum().unit;
  end();
  return result();
}

Result<double> ConditionText::amount(std::string_view unit) {
  blanks();
  const bool minus = take("-");
  if (!minus) take("+");
  const Measure of = number();
  end();
  agree({.unit = std::string(unit), .any = false, .begin = 0}, of);
  if (refused_) return std::unexpected(*refused_);
  return minus ? -program_.steps.back().number : program_.steps.back().number;
}

Result<ConditionProgram> ConditionText::result() {
  if (refused_) return std::unexpected(*refused_);
  return std::move(program_);
}

void ConditionText::any_of() {
  all_of();
  while (!refused_ && look_word() == "or") {
    (void)word();
    all_of();
    push(Kind::kOr);
  }
}

void ConditionText::all_of() {
  one_of();
  while (!refused_ && look_word() == "and") {
    (void)word();
    one_of();
    push(Kind::kAnd);
  }
}

void ConditionText::one_of() {
  if (refused_) return;
  if (++deep_ > ConditionProgram::kStack) {
    return refuse(at_, "has too many levels of brackets", "write it with fewer of them");
  }
  blanks();
  const std::size_t begin = at_;
  if (look_word() == "not") {
    (void)word();
    one_of();
    push(Kind::kNot);
  } else if (take("(")) {
    any_of();
    if (!refused_ && !take(")")) refuse(at_, "lacks a )", "close the bracket of " + part(begin));
  } else if (look_word() == "phase") {
    (void)word();
    phase(begin);
  } else if (look_word() == "fault") {
    (void)word();
    fault(begin);
  } else {
    comparison();
  }
  --deep_;
}

void ConditionText::phase(std::size_t begin) {
  const auto inside = argument();
  if (!inside || !inside->empty()) {
    return refuse(begin, "'phase' names nothing", "write phase() == running");
  }
  const bool equal = take("==");
  if (!equal && !take("!=")) {
    return refuse(at_, "phase() is only compared by == and !=", "write phase() == running");
  }
  blanks();
  const std::size_t of = at_;
  while (at_ < text_.size() && (is_letter(text_[at_]) || text_[at_] == '-')) ++at_;
  const std::string_view name = text_.substr(of, at_ - of);
  const auto* is =
      std::ranges::find_if(kPhases, [name](hal::RunPhase one) { return to_string(one) == name; });
  if (is == std::end(kPhases)) {
    std::vector<std::string> known;
    for (const hal::RunPhase one : kPhases) known.emplace_back(to_string(one));
    return refuse(of, "there is no phase '" + shown(name) + "'", suggest(name, known));
  }
  push(Kind::kPhase, 0.0, static_cast<std::uint64_t>(*is));
  if (!equal) push(Kind::kNot);
}

void ConditionText::fault(std::size_t begin) {
  const auto inside = argument();
  const std::vector<NamedCauses> known = named_causes();
  if (!inside) return refuse(begin, "'fault' names none", "write fault(any) or fault(fell)");
  const auto is = std::ranges::find(known, *inside, &NamedCauses::name);
  if (is == known.end()) {
    std::vector<std::string> names;
    for (const NamedCauses& one : known) names.push_back(one.name);
    return refuse(begin, "there is no fault '" + shown(*inside) + "'", suggest(*inside, names, 64));
  }
  push(Kind::kFault, 0.0, is->causes);
}

void ConditionText::comparison() {
  const Measure left = sum();
  if (refused_) return;
  constexpr std::pair<std::string_view, Kind> kSigns[] = {
      {"<=", Kind::kLessEqual}, {">=", Kind::kGreaterEqual}, {"==", Kind::kEqual},
      {"!=", Kind::kNotEqual},  {"<", Kind::kLess},          {">", Kind::kGreater}};
  for (const auto& [sign, kind] : kSigns) {
    if (!take(sign)) continue;
    const Measure right = sum();
    if (refused_) return;
    units_.insert(agree(left, right).unit);
    return push(kind);
  }
  refuse(at_, part(left.begin) + " is compared with nothing",
         "go on with <, <=, >, >=, == or != and what it is compared with");
}

ConditionText::Measure ConditionText::sum() {
  Measure of = term();
  while (!refused_) {
    const bool plus = take("+");
    if (!plus && !take("-")) break;
    const Measure right = term();
    of = agree(of, right);
    push(plus ? Kind::kAdd : Kind::kSubtract);
  }
  return of;
}

ConditionText::Measure ConditionText::term() {
  blanks();
  const std::size_t begin = at_;
  const Measure none{.unit = {}, .any = false, .begin = begin};
  if (refused_) return none;
  if (take("-")) {
    Measure of = term();
    push(Kind::kNegate);
    of.begin = begin;
    return of;
  }
  if (at_ < text_.size() && (is_digit(text_[at_]) || text_[at_] == '.')) return number();
  const std::string_view name = word();
  if (name.empty() || is_keyword(name)) {
    refuse(begin, begin < text_.size() ? part(begin) + " is no quantity" : "ends too early",
           "write a quantity, such as torque(JOINT), or a number with its unit, such as 40Nm");
    return none;
  }
  if (name != "abs") return quantity(begin, name);
  if (!take("(")) {
    refuse(at_, "abs lacks its (", "write abs(torque(JOINT))");
    return none;
  }
  if (++deep_ > ConditionProgram::kStack) {
    refuse(at_, "has too many levels of brackets", "write it with fewer of them");
    return none;
  }
  Measure of = sum();
  --deep_;
  if (!refused_ && !take(")")) refuse(at_, "lacks a )", "close the bracket of abs(");
  push(Kind::kAbs);
  of.begin = begin;
  return of;
}

ConditionText::Measure ConditionText::number() {
  blanks();
  Measure of{.unit = {}, .any = false, .begin = at_};
  double value = 0.0;
  const char* last = text_.data() + text_.size();
  const auto [stop, error] = std::from_chars(text_.data() + at_, last, value);
  const bool begins = at_ < text_.size() && (is_digit(text_[at_]) || text_[at_] == '.');
  if (!begins || error != std::errc() || !std::isfinite(value)) {
    refuse(at_, part(at_) + " is no finite number", "write one with its unit, such as 40Nm");
    return of;
  }
  at_ = static_cast<std::size_t>(stop - text_.data());
  of.any = value == 0.0;
  const std::size_t before = at_;
  blanks();
  const std::size_t begin = at_;
  const auto is_part = [](char c) { return is_letter(c) || is_digit(c) || c == '/' || c == '%'; };
  const bool unit = at_ < text_.size() && (is_letter(text_[at_]) || text_[at_] == '%');
  while (unit && at_ < text_.size() && is_part(text_[at_])) ++at_;
  const std::string_view its = text_.substr(begin, at_ - begin);
  if (its.empty() || is_keyword(its)) {
    at_ = before;
    push(Kind::kNumber, value);
    return of;
  }
  const std::optional<Unit> known = unit_of(its);
  if (!known) {
    refuse(begin, "there is no unit '" + shown(its) + "'",
           "write one such as Nm, rad, deg, m, mm, rad/s, N, A, V, s, ms, degC or %");
    return of;
  }
  of.unit = known->base;
  of.any = false;
  push(Kind::kNumber, known->in_base(value));
  return of;
}

ConditionText::Measure ConditionText::quantity(std::size_t begin, std::string_view name) {
  Measure of{.unit = {}, .any = false, .begin = begin};
  blanks();
  const bool called = at_ < text_.size() && text_[at_] == '(';
  std::string_view inside = name;
  if (called) {
    const auto given = argument();
    if (!given) {
      refuse(begin, "'" + shown(name) + "(' lacks its )", "close the bracket");
      return of;
    }
    inside = *given;
  }
  const bool path = name.find('.') != std::string_view::npos;
  if (!called && !path) {
    const auto with = find_quantity(name, {}, *names_);
    const bool known = with || with.error().message.find("no quantity") == std::string::npos;
    refuse(begin, "'" + shown(name) + "' has no brackets",
           known ? "write " + std::string(name) + "(…), with the joint's name where there is one"
                 : with.error().hint);
    return of;
  }
  const auto found = find_quantity(called ? name : "", inside, *names_);
  if (!found) {
    refuse(begin, found.error().message, found.error().hint);
    return of;
  }
  of.unit = found->unit;
  push(Kind::kQuantity, 0.0, program_.quantities.size());
  program_.quantities.push_back(*found);
  return of;
}

ConditionText::Measure ConditionText::agree(const Measure& one, const Measure& other) {
  if (refused_ || one.unit == other.unit) return {one.unit, one.any && other.any, one.begin};
  if (one.any) return {other.unit, false, one.begin};
  if (other.any) return {one.unit, false, one.begin};
  const Measure& plain = one.unit.empty() ? one : other;
  const Measure& with = one.unit.empty() ? other : one;
  std::string hint = with.unit.empty() || !plain.unit.empty()
                         ? "compare what has the same kind of unit"
                         : "give its unit: " + units_like(with.unit);
  if (one.unit.empty() == other.unit.empty()) hint = "use one of " + units_like(one.unit);
  refuse(other.begin,
         one.begin == other.begin
             ? "the number " + in_unit(other.unit) + ", and " + one.unit + " is needed"
             : "this " + in_unit(other.unit) + ", and what is before it " + in_unit(one.unit),
         std::move(hint));
  return one;
}

void ConditionText::blanks() {
  while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\t' || text_[at_] == '\n'))
    ++at_;
}

bool ConditionText::at_end() {
  blanks();
  return at_ == text_.size();
}

bool ConditionText::take(std::string_view sign) {
  if (refused_) return false;
  blanks();
  if (!text_.substr(at_).starts_with(sign)) return false;
  at_ += sign.size();
  return true;
}

std::string_view ConditionText::look_word() {
  const std::size_t before = at_;
  const std::string_view found = word();
  at_ = before;
  return found;
}

std::string_view ConditionText::word() {
  blanks();
  const std::size_t begin = at_;
  if (at_ == text_.size() || !is_letter(text_[at_])) return {};
  const auto is_part = [](char c) { return is_letter(c) || is_digit(c) || c == '.' || c == '/'; };
  while (at_ < text_.size() && is_part(text_[at_])) ++at_;
  return text_.substr(begin, at_ - begin);
}

std::optional<std::string_view> ConditionText::argument() {
  if (!take("(")) return std::nullopt;
  const std::size_t close = text_.find(')', at_);
  if (close == std::string_view::npos) return std::nullopt;
  std::string_view inside = text_.substr(at_, close - at_);
  at_ = close + 1;
  while (inside.starts_with(' ')) inside.remove_prefix(1);
  while (inside.ends_with(' ')) inside.remove_suffix(1);
  return inside;
}

void ConditionText::end() {
  if (!refused_ && !at_end())
    refuse(at_, part(at_) + " is one word too many", "join conditions by 'and' or 'or'");
}

void ConditionText::push(Kind kind, double number, std::uint64_t index) {
  if (refused_) return;
  const bool adds = kind == Kind::kNumber || kind == Kind::kQuantity || kind == Kind::kPhase ||
                    kind == Kind::kFault;
  const bool keeps = kind == Kind::kNegate || kind == Kind::kAbs || kind == Kind::kNot;
  stacked_ = adds ? stacked_ + 1 : keeps ? stacked_ : stacked_ - 1;
  if (stacked_ > ConditionProgram::kStack || program_.steps.size() == ConditionProgram::kSteps)
    return refuse(at_, "is too long", "write it with fewer parts, or as several");
  program_.steps.push_back({kind, number, index});
}

void ConditionText::refuse(std::size_t at, std::string message, std::string hint) {
  if (refused_) return;
  refused_ = Error{.message = "character " + std::to_string(at + 1) + " of '" + shown(text_) +
                              "': " + std::move(message),
                   .hint = std::move(hint),
                   .file = {},
                   .key = {}};
}

/// A short piece of the text, for an error.
std::string ConditionText::part(std::size_t begin) const {
  constexpr std::size_t kPiece = 24;
  return "'" + shown(text_.substr(std::min(begin, text_.size())), kPiece) + "'";
}

}  // namespace tandem::runtime
