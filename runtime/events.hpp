// The events of a run that its own cycles decide: at conditions, and requests at times.
// Layer: runtime.  Thread: read() non-RT; the rest the loop's, but for results.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/archive.hpp"
#include "base/result.hpp"
#include "hal/cycle_observer.hpp"
#include "runtime/condition/condition.hpp"
#include "runtime/condition/expectations.hpp"
#include "runtime/event_spec.hpp"

namespace tandem::sim {
class EmulatedRobot;
}

namespace tandem::runtime {

/// Each comes once. What is injected acts from the end of the cycle in which its condition held;
/// what is asked for is carried out in the cycle after it, or in the one at its time, while
/// simulated time waits: the same run has them in the same cycles. Part of the run's state.
class Events final : public AlsoJudged {
 public:
  /// Carries out a request of the control registry.
  using Ask = std::function<Status(const std::string& request)>;

  /// @param file  of the specs, for errors
  /// Errors, all at once: Condition::read()'s.
  [[nodiscard]] static std::expected<std::unique_ptr<Events>, Diagnostics> read(
      std::span<const EventSpec> specs, const std::string& file, const QuantityNames& names);
  /// Has their state and does nothing: for a copy of the run.
  [[nodiscard]] std::unique_ptr<Events> idle_copy() const;

  /// What became of an event of another run, by what it is called and awaits.
  struct Row {
    std::string name, when;
  };
  [[nodiscard]] std::vector<Row> rows() const;
  /// From now on they are no part of a run's state, but kept beside it: their rows may be others
  /// where it goes on.
  void keep_apart() noexcept { apart_ = true; }
  [[nodiscard]] bool apart() const noexcept { return apart_; }
  /// Those in `later` have not come, and are due later than the moment; the others are as `theirs`
  /// of the same name. @param happened  their archive(). Before the first cycle
  /// @return false: it says nothing of one; nothing has changed
  [[nodiscard]] bool begin_as(std::span<const std::byte> happened, std::span<const Row> theirs,
                              std::span<const std::string> later, std::int64_t moment_ns);

  /// Whom faults strike, before the first cycle.
  void strike(sim::EmulatedRobot& robot) noexcept { robot_ = &robot; }
  /// Who carries out requests, before the first cycle; else they are refused.
  void ask_by(Ask ask) { ask_ = std::move(ask); }
  [[nodiscard]] bool asks() const noexcept;
  [[nodiscard]] std::size_t size() const noexcept { return all_.size(); }
  [[nodiscard]] const EventSpec& spec(std::size_t event) const { return all_[event].spec; }

  /// A cycle is done: looks at conditions, and injects what is due. @rt no heap, no lock
  void take(const hal::CycleView& view) noexcept TANDEM_RT;
  /// The next request that is due in a cycle of this time, in the order of the file.
  [[nodiscard]] std::optional<std::size_t> next_ask(std::int64_t time_ns) const noexcept;
  /// Carries it out, between the halves of a cycle. Blocks, and takes heap.
  /// @return why not; empty: it is done
  [[nodiscard]] std::string ask(std::size_t event, std::int64_t time_ns) noexcept;

  void follow() noexcept TANDEM_RT override;
  void add_results(bool followed, std::vector<ExpectationResult>& results) const override;
  void archive(Archive& ar);

 private:
  enum class Outcome : std::uint8_t { kNone, kDone, kRefused };
  struct State {
    std::int64_t held_ns = -1, came_ns = -1;
    Outcome outcome = Outcome::kNone;
    std::array<char, 191> why{};  // it was refused, zero-terminated
  };
  struct Event {
    EventSpec spec;
    Condition when;
    State now, followed;
  };
  [[nodiscard]] static bool due(const Event& one, std::int64_t time_ns) noexcept TANDEM_RT;
  [[nodiscard]] static bool begins_as(Event& one, const std::vector<State>& was,
                                      std::span<const Row> theirs, bool later,
                                      std::int64_t moment_ns);
  static void note(Event& one, std::int64_t time_ns, std::string_view why) noexcept TANDEM_RT;

  std::vector<Event> all_;
  sim::EmulatedRobot* robot_ = nullptr;
  Ask ask_;
  bool idle_ = false, apart_ = false;
  bool started_ = false, ended_ = false;
};

}  // namespace tandem::runtime
