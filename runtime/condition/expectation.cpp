#include "runtime/condition/expectation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "base/counted.hpp"
#include "base/nearest.hpp"
#include "hal/truth.hpp"
#include "log/log_file.hpp"

namespace tandem::runtime {
namespace {

using Judged = ExpectationKind;

double in_seconds(std::int64_t ns) { return static_cast<double>(ns) / 1e9; }
std::int64_t in_ns(double seconds) { return std::llround(seconds * 1e9); }

const char* key_of(Judged kind) {
  switch (kind) {
    case Judged::kAlways: return "always";
    case Judged::kNever: return "never";
    case Judged::kEventually: return "eventually";
    case Judged::kBounds: return "bounds";
    case Judged::kRms: return "rms";
    case Judged::kMean: return "mean";
    case Judged::kFinal: return "final";
    case Judged::kWork: return "work";
    case Judged::kSettles: return "settles";
    case Judged::kAsIn: return "signal";
  }
  return "?";
}

std::unexpected<Error> at(Error error, std::string key, int line) {
  error.key = std::move(key);
  error.line = line;
  return std::unexpected(std::move(error));
}

}  // namespace

Result<Expectation> Expectation::read(const ExpectationSpec& spec, const QuantityNames& names) {
  auto one = look_up(spec, names);
  if (one || names.truth != nullptr) return one;
  // On a robot an experiment runs as in simulation: what only that knows cannot pass there.
  const hal::Robot& robot = names.robot;
  const hal::TruthImage truth(robot.joints.size(), robot.feet.size(), robot.loops.size(),
                              robot.passive.size(), 3);
  QuantityNames with = names;
  with.truth = &truth.layout();
  auto simulated = look_up(spec, with);
  if (!simulated) return one;
  simulated->impossible_ = "it needs the truth, which a run has in simulation alone";
  return simulated;
}

Result<Expectation> Expectation::look_up(const ExpectationSpec& spec, const QuantityNames& names) {
  if (spec.stays_up && !names.robot.floating_base) {
    return at(fail("the base of this robot is fixed: it cannot fall", "leave stays_up out").error(),
              "stays_up", spec.line);
  }
  Expectation one;
  one.spec_ = spec;
  one.from_ns_ = in_ns(spec.from_s);
  if (std::isfinite(spec.to_s)) one.to_ns_ = in_ns(spec.to_s);
  if (one.is_condition()) {
    auto condition = Condition::read(spec.text, names);
    if (!condition)
      return at(condition.error(), spec.stays_up ? "stays_up" : key_of(spec.kind), spec.line);
    if (condition->mixes_units()) {
      return at(fail("compares in several units: its margin would have none",
                     "write a row [[expect]] for each unit")
                    .error(),
                key_of(spec.kind), spec.line);
    }
    one.condition_ = std::move(*condition);
    if (spec.kind == Judged::kEventually) one.awaited_ = one.condition_.faults();
  } else if (spec.kind == Judged::kAsIn) {
    if (Status read = one.read_recorded(names); !read) {
      Error error = std::move(read.error());
      return at(error, error.key.empty() ? "signal" : error.key,
                error.key == "within" ? spec.within_line : spec.line);
    }
  } else {
    if (spec.kind == Judged::kWork) {
      if (Status found = one.look_up_joints(names); !found)
        return at(found.error(), "work", spec.line);
    } else {
      auto number = Expression::read(spec.text, names);
      if (!number) return at(number.error(), key_of(spec.kind), spec.line);
      one.expression_ = std::move(*number);
    }
    if (Status bounds = one.read_bounds(); !bounds) return std::unexpected(bounds.error());
  }
  if (!spec.after.empty()) {
    auto after = Condition::read(spec.after, names);
    if (!after) return at(after.error(), "after", spec.after_line);
    one.after_ = std::move(*after);
    if (spec.kind != Judged::kNever) one.awaited_ |= one.after_->faults();
  }
  return one;
}

Status Expectation::read_bounds() {
  for (const auto& [text, line, bound, key] :
       {std::tuple(&spec_.above, spec_.above_line, &above_, "above"),
        std::tuple(&spec_.below, spec_.below_line, &below_, "below")}) {
    if (text->empty()) continue;
    const Result<double> value = read_amount(*text, unit());
    if (!value) return at(value.error(), key, line);
    *bound = *value;
  }
  if (above_ < below_) return {};
  return at(fail("nothing is above " + spec_.above + " and below " + spec_.below,
                 "give a lower bound that is less than the upper one")
                .error(),
            "above", spec_.above_line);
}

Status Expectation::look_up_joints(const QuantityNames& names) {
  for (const hal::DrivenJoint& joint : names.robot.joints) {
    if (spec_.text != "*" && spec_.text != joint.name) continue;
    auto torque = Expression::read("torque(" + joint.name + ")", names);
    auto velocity = Expression::read("velocity(" + joint.name + ")", names);
    if (!torque) return std::unexpected(torque.error());
    if (!velocity) return std::unexpected(velocity.error());
    driven_.push_back({std::move(*torque), std::move(*velocity)});
  }
  if (!driven_.empty()) return {};
  std::vector<std::string> known;
  for (const hal::DrivenJoint& joint : names.robot.joints) known.push_back(joint.name);
  return fail("there is no joint '" + spec_.text + "'", suggest(spec_.text, known));
}

double Expectation::number_in(const hal::CycleView& view) const noexcept TANDEM_RT {
  if (spec_.kind != Judged::kWork) return expression_.value(view);
  double work_J = 0.0;
  for (const Driven& one : driven_) {
    const double power_W = one.torque.value(view) * one.velocity.value(view);
    if (std::isnan(power_W)) return power_W;
    work_J += std::max(power_W, 0.0) * 1e-9 * static_cast<double>(view.time.period_ns);
  }
  return work_J;
}

Status Expectation::read_recorded(const QuantityNames& names) {
  const auto log = log::LogFile::open(spec_.log);
  if (!log) return fail("the log " + spec_.log + ": " + log.error().message, log.error().hint);
  if (const Status whole = log->require_samples(); !whole) return std::unexpected(whole.error());
  const std::size_t star = spec_.text.find('*');
  std::vector<std::string> joints;
  if (star == std::string::npos) joints.emplace_back();
  for (const hal::DrivenJoint& joint : names.robot.joints)
    if (star != std::string::npos) joints.push_back(joint.name);
  for (const std::string& joint : joints) {
    std::string text = spec_.text;
    for (std::size_t i = star; i < text.size(); i = text.find('*', i + joint.size()))
      text.replace(i, 1, joint);
    auto now = Expression::read(text, names);
    if (!now) return std::unexpected(now.error());
    auto then = Recorded::read(*now, names, *log);
    if (!then) return std::unexpected(then.error());
    compared_.push_back({joint, std::move(*now), std::move(*then)});
  }
  const Result<double> within = read_amount(spec_.within, unit());
  if (within && *within > 0.0) {
    within_ = *within;
    return {};
  }
  Error error = within ? fail("nothing is within " + spec_.within, "give more than 0").error()
                       : within.error();
  error.key = "within";
  return std::unexpected(std::move(error));
}

const std::string& Expectation::unit() const {
  static const std::string kJoule = "J";
  return spec_.kind == Judged::kWork   ? kJoule
         : is_condition()              ? condition_.unit()
         : spec_.kind == Judged::kAsIn ? compared_.front().now.unit()
                                       : expression_.unit();
}

double Expectation::margin_to_recorded(const hal::CycleView& view) noexcept TANDEM_RT {
  double margin = std::numeric_limits<double>::infinity();
  std::uint64_t worst_of = 0;
  for (std::size_t i = 0; i < compared_.size(); ++i) {
    const double apart =
        std::abs(compared_[i].now.value(view) - compared_[i].then.at(view.time.time_ns));
    if (std::isnan(apart)) return apart;
    if (within_ - apart >= margin) continue;
    margin = within_ - apart;
    worst_of = i;
  }
  if (so_far_.worst_ns == kNever || margin < so_far_.worst) so_far_.worst_of = worst_of;
  return margin;
}

double Expectation::margin_of(double number) const noexcept TANDEM_RT {
  return std::min(number - above_, below_ - number);
}

void Expectation::note(double margin, bool holds, const hal::CycleView& view) noexcept TANDEM_RT {
  const bool best = spec_.kind == Judged::kEventually;
  const bool counts =
      so_far_.worst_ns == kNever || (best ? margin > so_far_.worst : margin < so_far_.worst);
  if (holds) ++so_far_.held;
  if (!counts) return;
  so_far_.worst = margin;
  so_far_.worst_ns = view.time.time_ns;
}

void Expectation::take(const hal::CycleView& view) noexcept TANDEM_RT {
  so_far_.last_ns = view.time.time_ns;
  so_far_.period_ns = view.time.period_ns;
  if (so_far_.zero_ns == kNever) {
    if (after_ && !after_->holds(view)) return;
    so_far_.zero_ns = view.time.time_ns;
  }
  const std::int64_t since = view.time.time_ns - so_far_.zero_ns;
  if (since < from_ns_ || since > to_ns_) return;
  ++so_far_.cycles;
  if (so_far_.first_ns == kNever) so_far_.first_ns = view.time.time_ns;
  so_far_.end_ns = view.time.time_ns;
  const auto unknown = [this, &view] {
    if (so_far_.unknown++ == 0) so_far_.unknown_ns = view.time.time_ns;
  };
  if (is_condition()) {
    const Condition::Look look = condition_.look(view);
    if (!look.known) return unknown();
    const bool never = spec_.kind == Judged::kNever;
    return note(never ? -look.margin : look.margin, look.holds != never, view);
  }
  if (spec_.kind == Judged::kAsIn) {
    const double margin = margin_to_recorded(view);
    return std::isnan(margin) ? unknown() : note(margin, margin >= 0.0, view);
  }
  const double number = number_in(view);
  if (std::isnan(number)) return unknown();
  const double margin = margin_of(number);
  if (margin < 0.0) so_far_.outside_ns = view.time.time_ns;
  so_far_.last = number;
  so_far_.sum += spec_.kind == Judged::kRms ? number * number : number;
  note(margin, margin >= 0.0, view);
}

bool Expectation::unjudged(ExpectationResult& result) const {
  if (!impossible_.empty()) {
    result.reason = impossible_;
  } else if (so_far_.last_ns == kNever) {
    result.reason = "its controllers never started";
    result.awaits = "its controllers have not started";
  } else if (so_far_.zero_ns == kNever) {
    result.reason = "its window was never reached: '" + spec_.after + "' never held";
    result.awaits = "it begins once '" + spec_.after + "' holds";
  } else if (so_far_.cycles == 0) {
    result.reason = fmt::format(
        "its window was never reached: it begins at {:g} s, and the run ended at {:g} s",
        spec_.from_s, in_seconds(so_far_.last_ns - so_far_.zero_ns));
    result.awaits = fmt::format("it begins at {:g} s", spec_.from_s);
  } else if (so_far_.unknown == so_far_.cycles) {
    result.reason = "nobody measured it";
  }
  return !result.reason.empty();
}

std::string Expectation::amount(double value) const {
  return fmt::format("{:.4g}{}{}", value, unit().empty() ? "" : " ", unit());
}

/// In every cycle, or in one.
void Expectation::judge_condition(ExpectationResult& result) const {
  const bool once = spec_.kind == Judged::kEventually;
  const std::uint64_t known = so_far_.cycles - so_far_.unknown;
  if (once) {
    result.passed = so_far_.held > 0;
    if (!result.passed) {
      result.reason = "it never held";
      if (!result.margin) result.at_s.reset();  // no cycle was nearer than another
    }
    return;
  }
  result.passed = so_far_.held == known && so_far_.unknown == 0;
  if (so_far_.held != known) {
    result.reason = fmt::format("it {} in {} of {}",
                                spec_.kind == Judged::kNever  ? "held"
                                : spec_.kind == Judged::kAsIn ? "differed"
                                                              : "did not hold",
                                known - so_far_.held, counted(so_far_.cycles, "cycle"));
  }
}

void Expectation::judge_number(ExpectationResult& result) const {
  double value = so_far_.last;
  const auto known = static_cast<double>(so_far_.cycles - so_far_.unknown);
  if (spec_.kind == Judged::kRms) value = std::sqrt(so_far_.sum / known);
  if (spec_.kind == Judged::kMean) value = so_far_.sum / known;
  if (spec_.kind == Judged::kWork) value = so_far_.sum;
  if (spec_.kind == Judged::kFinal || spec_.kind == Judged::kWork)
    result.at_s = in_seconds(so_far_.end_ns);
  const double margin = margin_of(value);
  result.margin = margin;
  result.passed = margin >= 0.0;
  if (!result.passed) result.reason = "it is " + amount(value);
}

void Expectation::judge_settling(ExpectationResult& result) const {
  result.unit = "s";
  result.at_s.reset();
  result.margin.reset();
  if (so_far_.outside_ns == so_far_.end_ns) {
    result.reason = "it was outside at the end of its window";
    const double late = spec_.in_s - in_seconds(so_far_.end_ns - so_far_.first_ns);
    if (late < 0.0) {
      result.margin = late;
    } else {
      result.awaits = fmt::format("it has {:g} s left to settle", late);
    }
    return;
  }
  const std::int64_t settled =
      so_far_.outside_ns == kNever ? so_far_.first_ns : so_far_.outside_ns + so_far_.period_ns;
  const double took_s = in_seconds(settled - so_far_.first_ns);
  result.margin = spec_.in_s - took_s;
  result.at_s = in_seconds(settled);
  result.passed = *result.margin >= 0.0;
  if (!result.passed) result.reason = fmt::format("it took {:g} s", took_s);
  const std::int64_t watched = so_far_.end_ns - so_far_.first_ns + so_far_.period_ns;
  if (!result.passed || watched >= in_ns(spec_.in_s)) return;
  result.passed = false;
  result.reason = fmt::format("the run ended {:g} s after its window began", in_seconds(watched));
  result.awaits = "its window goes on";
  result.holds_so_far = true;
}

ExpectationResult Expectation::so_far() const {
  ExpectationResult result;
  result.name = spec_.name;
  result.unit = unit();
  if (unjudged(result)) return result;
  if (std::isfinite(so_far_.worst)) result.margin = so_far_.worst;
  if (so_far_.worst_ns != kNever) result.at_s = in_seconds(so_far_.worst_ns);
  const bool recorded = spec_.kind == Judged::kAsIn;
  if (recorded && so_far_.worst_ns != kNever) result.joint = compared_[so_far_.worst_of].joint;
  if (is_condition() || recorded || spec_.kind == Judged::kBounds) {
    judge_condition(result);
  } else if (spec_.kind == Judged::kSettles) {
    judge_settling(result);
  } else {
    judge_number(result);
  }
  const bool once = spec_.kind == Judged::kEventually;
  // No cycle is worse than another one when a phase or a fault did not come.
  if (result.passed && !once && !result.margin) result.at_s.reset();
  if (so_far_.unknown > 0 && !once && result.reason.empty()) {
    result.passed = false;
    result.reason = fmt::format("nobody measured it in {} of {}, first at {:g} s", so_far_.unknown,
                                counted(so_far_.cycles, "cycle"), in_seconds(so_far_.unknown_ns));
    result.margin.reset();  // of the others
    result.at_s.reset();
  }
  if (so_far_.unknown > 0 && recorded)
    result.reason += fmt::format("; the log has it from {:g} s to {:g} s",
                                 in_seconds(compared_.front().then.first_ns()),
                                 in_seconds(compared_.front().then.last_ns()));
  const std::int64_t ran = so_far_.last_ns - so_far_.zero_ns;
  const bool endless = !std::isfinite(spec_.to_s);
  const bool whole = endless || ran + so_far_.period_ns >= to_ns_;
  if (result.passed && !whole && !once) {
    result.passed = false;
    result.reason = fmt::format("its window ends at {:g} s, and the run ended at {:g} s",
                                spec_.to_s, in_seconds(ran));
    result.awaits = fmt::format("its window ends at {:g} s", spec_.to_s);
    result.holds_so_far = true;
  }
  if (!result.passed && once && (endless || !whole)) result.awaits = "it has not held yet";
  return result;
}

ExpectationResult Expectation::verdict() const {
  ExpectationResult result = so_far();
  if (result.holds_so_far) {  // what failed it is the run's end, not the number
    result.margin.reset();
    result.at_s.reset();
    result.joint.clear();
  }
  return result;
}

}  // namespace tandem::runtime
