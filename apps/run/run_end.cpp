#include "apps/run/run_end.hpp"

#include <fmt/core.h>

#include <algorithm>

#include "apps/control/fault_table.hpp"
#include "apps/run/gate.hpp"
#include "apps/text/console.hpp"
#include "apps/text/draft.hpp"
#include "base/counted.hpp"
#include "runtime/trace_file.hpp"

namespace tandem::apps {
namespace {

/// Whether a latched fault ended or disturbed the run that no expectation awaits.
bool has_unexpected_fault(const RunSummary& summary) {
  const auto& expectations = summary.composition.expectations;
  const std::uint64_t awaited = expectations == nullptr ? 0 : expectations->awaited_faults();
  std::size_t expected = 0;
  for (const runtime::FaultReport& one : summary.cycle.faults()) {
    const auto bit = static_cast<unsigned>(one.cause);
    if (one.latched && bit < 64 && (awaited >> bit & 1U) != 0) ++expected;
  }
  return summary.faults.size() > expected;  // they have the log's trouble as well
}

/// Whether it ended with a stop after which another run would wait for a reset.
bool ended_by_its_stop(const runtime::RobotCycle& cycle) {
  return cycle.config().after_stop == runtime::AfterStop::kEnd &&
         std::ranges::any_of(cycle.faults(), [](const runtime::FaultReport& one) {
           return one.latched && one.category != hal::StopCategory::kHold &&
                  one.category != hal::StopCategory::kWarn;
         });
}

/// Says which expectations failed. @return how many
std::size_t tell_failures(const RunSummary& summary) {
  std::size_t failures = 0;
  if (summary.composition.expectations == nullptr) return failures;
  for (const runtime::ExpectationResult& one : summary.composition.expectations->results()) {
    if (one.passed) continue;
    ++failures;
    fmt::print(stderr, "expected: {}: {}\n", shown(one.name), runtime::in_words(one));
  }
  return failures;
}

/// Writes what --trace asks for, and says how much of the run it is.
Status add_trace(const RunOptions& options, const RunSummary& summary, std::FILE* out) {
  if (options.trace.empty()) return {};
  const runtime::RobotCycle& cycle = summary.cycle;
  Draft draft = Draft::file(options.trace);
  const Status written =
      runtime::write_trace(draft.path(), summary.composition.experiment.robot.name, cycle.trace(),
                           cycle.faults(), *summary.composition.controllers->names());
  if (!written) return std::unexpected(draft.placed(written.error()));
  if (const Status placed = draft.place(); !placed || options.quiet) return placed;
  const std::uint64_t all = cycle.trace().count();
  Facts facts;
  facts.add(
      "trace",
      fmt::format("{} (the last {} of {} cycles; open it on https://ui.perfetto.dev)",
                  options.trace, std::min<std::uint64_t>(all, cycle.trace().capacity()), all));
  facts.print(out);
  return {};
}

}  // namespace

std::vector<std::string> fault_texts(const runtime::RobotCycle& cycle,
                                     const std::optional<log::RecordingResult>& log) {
  std::vector<std::string> texts = latched_texts(cycle.faults());
  if (log && !log->error.empty()) {
    texts.push_back(
        fmt::format("the log lost {}: {}", counted(log->failed, "message"), log->error));
  }
  return texts;
}

Exit tell_end(const RunSummary& summary, const RunOptions& options, std::FILE* out) {
  if (!options.quiet) {
    fmt::print(out, "\n");
    summary.print(out);
    if (summary.gate) {
      fmt::print(out, "\n");
      print_gate(*summary.gate, out);
    }
  }
  for (const std::string& warning : summary.warnings()) {
    say(Said::kWarning, shown(warning, 2'000));
  }
  for (const std::string& fault : summary.faults) say(Said::kFault, shown(fault, 2'000));
  if (!options.quiet && !summary.faults.empty() && ended_by_its_stop(summary.cycle)) {
    say(Said::kHint,
        "with `--on-fault wait` a run stays after a stop, for `tandem fault reset` and "
        "`tandem controller start` (docs/safety.md)");
  }
  const Status traced = add_trace(options, summary, out);
  const Status written = write_json(options.json, summary.json());
  if (!traced) return refuse(traced.error());
  if (!written) return refuse(written.error());
  const std::size_t failures = tell_failures(summary);
  const bool broken = summary.gate && !kept(*summary.gate);
  if (has_unexpected_fault(summary) || broken) return Exit::kFault;
  if (summary.cut_short()) return interrupted(summary.interrupted_by);
  return failures > 0 ? Exit::kFault : Exit::kDone;
}

}  // namespace tandem::apps
