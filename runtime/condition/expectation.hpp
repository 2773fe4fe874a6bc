// One expectation: judged cycle by cycle, with its distance to failing.
// Layer: runtime/condition.  Thread: read(), so_far() and verdict() non-RT; take() the loop's.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "base/result.hpp"
#include "runtime/condition/condition.hpp"
#include "runtime/condition/expectation_spec.hpp"
#include "runtime/condition/recorded.hpp"

namespace tandem::runtime {

/// What became of an expectation.
struct ExpectationResult {
  std::string name;
  bool passed = false;
  /// Signed distance to failing [unit]: not above 0 when it failed. Empty: there is none, as a
  /// phase, a fault or the run's end decided, or it was not measured.
  std::optional<double> margin{};
  std::string unit;              ///< "Nm"; empty: a plain number
  std::optional<double> at_s{};  ///< when that was, as in the log: the worst cycle
  std::string reason;            ///< why it failed; empty: it passed, or did not come and may
  std::string joint{};           ///< with a `*`: which one that was
  /// What may still come to one that has not passed, while the run goes on: "its window ends at
  /// 5 s". Empty: it passed, or nothing can make it pass any more.
  std::string awaits{};
  bool holds_so_far = false;  ///< of one that awaits something: nothing speaks against it yet

  bool operator==(const ExpectationResult&) const = default;
};

class Expectation {
 public:
  /// Looks every name up. An expectation on the truth of a run that has none is read, and fails.
  /// Errors, with the key: Condition::read()'s; bounds that leave no room.
  [[nodiscard]] static Result<Expectation> read(const ExpectationSpec& spec,
                                                const QuantityNames& names);

  /// A cycle since the controllers start, before the run is shut down. @rt no heap, no lock
  void take(const hal::CycleView& view) noexcept TANDEM_RT;
  /// What became of it by now. Of one that holds so far the margin is that so far.
  [[nodiscard]] ExpectationResult so_far() const;
  /// What became of it if no further cycle comes.
  [[nodiscard]] ExpectationResult verdict() const;

  /// Faults that have to come for it to pass: causes, a bit each.
  [[nodiscard]] std::uint64_t awaited_faults() const { return awaited_; }
  [[nodiscard]] const ExpectationSpec& spec() const { return spec_; }
  void archive(Archive& ar) { ar(so_far_); }
  /// Is as far as `other`, of the same spec. @rt a copy of plain data
  void follow(const Expectation& other) noexcept TANDEM_RT { so_far_ = other.so_far_; }

 private:
  /// What the cycles so far amount to; plain data.
  struct SoFar {
    std::int64_t zero_ns = kNever;                    // of the window's times
    std::int64_t last_ns = kNever;                    // the newest cycle
    std::int64_t first_ns = kNever, end_ns = kNever;  // cycles in the window
    std::uint64_t cycles = 0;                         // in it
    std::uint64_t unknown = 0;                        // of these
    std::int64_t unknown_ns = kNever;                 // the first of these
    std::uint64_t held = 0;                           // known ones in which it did
    double worst = 0.0;                               // margin; of kEventually the best
    std::int64_t worst_ns = kNever;
    double sum = 0.0, last = 0.0;      // of the number, or its square
    std::uint64_t worst_of = 0;        // kAsIn: of compared_
    std::int64_t outside_ns = kNever;  // the last cycle out of the bounds
    std::int64_t period_ns = 0;
  };
  /// A number of this run, and what it was in a recorded one.
  struct Compared {
    std::string joint;
    Expression now;
    Recorded then;
  };
  /// Its product is the power that a joint's drive has.
  struct Driven {
    Expression torque, velocity;
  };
  static constexpr std::int64_t kNever = -1;

  /// read(), by these names alone.
  [[nodiscard]] static Result<Expectation> look_up(const ExpectationSpec& spec,
                                                   const QuantityNames& names);
  [[nodiscard]] bool is_condition() const { return spec_.kind <= ExpectationKind::kEventually; }
  [[nodiscard]] double margin_of(double number) const noexcept TANDEM_RT;
  void note(double margin, bool holds, const hal::CycleView& view) noexcept TANDEM_RT;
  /// Whether nothing can be said yet, or at all; the reason is in `result` then.
  [[nodiscard]] bool unjudged(ExpectationResult& result) const;
  [[nodiscard]] std::string amount(double value) const;
  /// Reads what a kAsIn compares with: of a signal with a `*`, of each joint.
  Status read_recorded(const QuantityNames& names);
  /// The worst of these; NaN where one is not known.
  [[nodiscard]] double margin_to_recorded(const hal::CycleView& view) noexcept TANDEM_RT;
  /// Finds the joint of a kWork, or all of them.
  Status look_up_joints(const QuantityNames& names);
  Status read_bounds();
  /// What the cycle adds to the sum; NaN where it is not known.
  [[nodiscard]] double number_in(const hal::CycleView& view) const noexcept TANDEM_RT;
  [[nodiscard]] const std::string& unit() const;
  void judge_condition(ExpectationResult& result) const;
  void judge_number(ExpectationResult& result) const;
  void judge_settling(ExpectationResult& result) const;

  ExpectationSpec spec_;
  std::string impossible_;          // why it cannot pass in this run
  Condition condition_;             // kAlways, kNever, kEventually
  Expression expression_;           // the others
  std::vector<Compared> compared_;  // kAsIn
  std::vector<Driven> driven_;      // kWork
  double within_ = 0.0;
  std::optional<Condition> after_;
  double above_ = -std::numeric_limits<double>::infinity();
  double below_ = std::numeric_limits<double>::infinity();
  std::int64_t from_ns_ = 0, to_ns_ = std::numeric_limits<std::int64_t>::max();
  std::uint64_t awaited_ = 0;
  SoFar so_far_;
};

}  // namespace tandem::runtime
