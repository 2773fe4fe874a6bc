// A log as the cycles that were: what each of them read, took and commanded.
// Layer: runtime/replay.  Thread: one at a time, non-RT.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "log/given.hpp"
#include "log/log_file.hpp"

namespace tandem::runtime {

/// One cycle, as the log has it. Its spans are good during the call that shows it; empty: the log
/// has none of this cycle.
struct RecordedCycle {
  /// A sample that reached a controller.
  struct Sample {
    std::string input;  ///< "CONTROLLER/INPUT"
    std::vector<double> values;
  };
  std::uint64_t cycle = 0;
  std::int64_t time_ns = 0;
  std::uint64_t before = 0;  ///< cycles since the one before that are not in the log
  std::span<const std::byte> state, command, truth;
  std::vector<log::EventText> events;
  std::vector<log::Given> given;
  std::vector<Sample> samples;

  /// Whether the loop left out those before it, being late: then none is missing.
  [[nodiscard]] bool was_late() const;
};

class RecordedRun {
 public:
  /// Errors: LogFile::open()'s; a log that cannot be played again from its beginning, with the
  /// reason: of another program, a reduced copy, a branch, without its first cycles, without the
  /// state of each cycle.
  [[nodiscard]] static Result<RecordedRun> open(const std::string& path);

  [[nodiscard]] const log::LogFile& file() const { return file_; }
  [[nodiscard]] const log::RunInfo& info() const { return file_.info(); }
  /// Layouts of the messages. @pre the log has the topic
  [[nodiscard]] const hal::Layout& state() const { return file_.find("/tandem/state")->layout; }
  [[nodiscard]] const hal::Layout& command() const { return file_.find("/tandem/command")->layout; }
  /// Null: the log has no truth.
  [[nodiscard]] const hal::Layout* truth() const;
  /// Whether it has what was asked of the run: logs of earlier versions do not.
  [[nodiscard]] bool has_given() const { return !info().options.empty(); }
  /// A value of RunInfo::options; empty: it has none.
  [[nodiscard]] std::string option(std::string_view key) const;

  /// Calls `visit` with each cycle, in order, until it answers false. Errors: a message that cannot
  /// be read.
  [[nodiscard]] Status visit(const std::function<bool(const RecordedCycle&)>& visit) const;

 private:
  explicit RecordedRun(log::LogFile file) : file_(std::move(file)) {}

  log::LogFile file_;
};

}  // namespace tandem::runtime
