// The expectations of an experiment, judged in every cycle of its run.
// Layer: runtime/condition.  Thread: read() and results() non-RT; take() the loop's.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/archive.hpp"
#include "base/result.hpp"
#include "hal/cycle_observer.hpp"
#include "runtime/condition/expectation.hpp"

namespace tandem::runtime {

/// What else of a run is judged as an expectation is.
class AlsoJudged {
 public:
  virtual ~AlsoJudged() = default;
  /// The loop's: add_results() gives what is known now, from another thread, too.
  virtual void follow() noexcept TANDEM_RT = 0;
  /// @param followed  as of the last follow(); else as it is now
  virtual void add_results(bool followed, std::vector<ExpectationResult>& results) const = 0;
};

/// Watches a loop from within: what crosses a ring may be dropped, and an expectation is on every
/// cycle. From the controllers' start to the
/// shut-down, with the fault that may be its reason.
class Expectations final : public hal::CycleObserver {
 public:
  /// @param file  of the specs, for errors
  /// Errors, all at once: Expectation::read()'s.
  [[nodiscard]] static std::expected<std::unique_ptr<Expectations>, Diagnostics> read(
      std::span<const ExpectationSpec> specs, const std::string& file, const QuantityNames& names);

  /// These come after its own. Before the first cycle.
  void judge(AlsoJudged* others) noexcept { others_ = others; }

  /// A cycle that it has seen already counts once. @rt no heap, no lock, some 30 ns an expectation
  void take(const hal::CycleView& view) noexcept TANDEM_RT override;

  /// Once the loop has ended: the verdicts.
  [[nodiscard]] std::vector<ExpectationResult> results() const;
  /// While the loop stands.
  [[nodiscard]] std::vector<ExpectationResult> so_far() const;
  /// so_far() while the loop cycles, for another thread, one at a time: as of its next cycle.
  /// Empty: none came in that time.
  [[nodiscard]] std::optional<std::vector<ExpectationResult>> look(
      std::chrono::nanoseconds at_most);
  /// Faults that an expectation awaits, such as `eventually = "fault(board_silent)"`: causes, a bit
  /// each. These are no failure of the run.
  [[nodiscard]] std::uint64_t awaited_faults() const;
  /// A hash of their rows: archive() fits those that have the same.
  [[nodiscard]] std::uint64_t fingerprint() const noexcept;
  /// How far they are, for a run that is rewound.
  void archive(Archive& ar) {
    ar(started_, ended_, newest_ns_);
    for (Expectation& one : all_) one.archive(ar);
  }

 private:
  void show() noexcept TANDEM_RT;
  [[nodiscard]] std::vector<ExpectationResult> each(const std::vector<Expectation>& all,
                                                    ExpectationResult (Expectation::*result)()
                                                        const,
                                                    bool followed) const;

  std::vector<Expectation> all_;
  std::vector<Expectation> shown_;  // the loop's while looked_at_, else look()'s
  std::atomic<bool> looked_at_{false};
  AlsoJudged* others_ = nullptr;
  bool started_ = false, ended_ = false;
  std::int64_t newest_ns_ = -1;  // of the cycles seen
};

/// How many of them failed.
[[nodiscard]] std::size_t failed(std::span<const ExpectationResult> results);
/// "passed, margin 3.2 Nm at 1.234 s", "failed, it never held".
[[nodiscard]] std::string in_words(const ExpectationResult& result);
/// "3.2 Nm"; empty: there is none.
[[nodiscard]] std::string margin_text(const ExpectationResult& result);

}  // namespace tandem::runtime
