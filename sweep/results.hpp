// What points came to: a line of JSON each, in a file that a killed sweep goes on with.
// Layer: sweep.  Thread: one at a time.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/open_file.hpp"
#include "base/result.hpp"
#include "runtime/condition/expectation.hpp"
#include "sweep/study.hpp"

namespace tandem::sweep {

/// What became of a point.
struct PointResult {
  bool passed = false;
  std::string ended;   ///< "as planned", "by a fault", "crashed: SIGSEGV", "refused", "too slow"
  std::string reason;  ///< why it failed, beside its expectations; empty: by them, or it passed
  std::vector<runtime::ExpectationResult> expectations;
  double seconds = 0.0;  ///< on the wall clock: in no result

  /// Why it failed, in words: its reason, or its first expectation that failed.
  [[nodiscard]] std::string why() const;
};

/// In one line of JSON, without its end.
[[nodiscard]] std::string line_of(std::uint64_t index, const std::string& name,
                                  const PointResult& result);

/// A line_of(), read. Errors: it is none.
struct ReadLine {
  std::uint64_t index = 0;
  std::string name;
  PointResult result;
};
[[nodiscard]] Result<ReadLine> read_line(const std::string& line);

/// What a sweep is made of: all of it is the same when it goes on.
struct SweepHead {
  /// What it is, and its SHA-256: "study", "coman_push.toml", "robot.toml", "plugin hold".
  std::vector<std::pair<std::string, std::string>> parts;
  std::uint64_t points = 0;
};

/// The folder of a sweep: `sweep.json` is its head, `points.jsonl` has a line a point, in the order
/// in which they ended. One process has it at a time.
class SweepFolder {
 public:
  /// Makes it, or goes on with it: the last line, when it is not whole, is taken away.
  /// Errors: the folder cannot be made; another process has it; its head is another, with the first
  /// part that differs; it is something else's.
  [[nodiscard]] static Result<SweepFolder> open(const std::string& path, const SweepHead& head,
                                                const Points& points);

  [[nodiscard]] const std::string& path() const { return path_; }
  /// By the points' numbers; empty: not yet.
  [[nodiscard]] const std::vector<std::optional<PointResult>>& results() const { return results_; }
  [[nodiscard]] std::uint64_t done() const { return done_; }
  /// Keeps a result. Errors: the disk is full or gone; then the file ends with the line before.
  [[nodiscard]] Status add(const Point& point, PointResult result);

 private:
  std::string path_;
  Descriptor file_;
  std::uint64_t bytes_ = 0;
  std::vector<std::optional<PointResult>> results_;
  std::uint64_t done_ = 0;
};

}  // namespace tandem::sweep
