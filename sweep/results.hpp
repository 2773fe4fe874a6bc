// What points came to: a line of JSON each, in files that a killed sweep goes on with.
// Layer: sweep.  Thread: one at a time.
#pragma once

#include <chrono>
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
  /// The study's time limit, where it was too slow for that: another limit has another result.
  std::optional<double> limit_s{};

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

/// What a sweep is made of.
struct SweepHead {
  /// What every point hangs on, and its SHA-256 or name: "kernel variant", "coman_push.toml",
  /// "plugin hold". All of it is the same when it goes on.
  std::vector<std::pair<std::string, std::string>> parts;
  /// SHA-256 of Study::meaning(): when it is another, points that are in both studies stay.
  std::string study;
  std::uint64_t points = 0;
};

/// The head of the sweep in a folder; none: no sweep is there.
/// Errors: it cannot be read.
[[nodiscard]] Result<std::optional<SweepHead>> head_in(const std::string& folder);

/// A row of points that a process of its own computes, on whatever machine.
struct Chunk {
  std::uint64_t number = 0, first = 0, end = 0;  ///< its points: first <= index < end
};

/// The folder of a sweep: `sweep.json` is its head, `points.jsonl` has a line a point, in the order
/// in which they ended. One process has it at a time. Beside it those of chunks, each with a file
/// of its own that nobody else writes, `chunks/NUMBER.*.jsonl`: so nothing hangs on locks of a
/// shared file system, and a chunk that is started twice mixes nothing. A point is known by its
/// name, so its result stays when the study gets others.
class SweepFolder {
 public:
  /// Makes it, or goes on with it: the last line, when it is not whole, is taken away. Results of
  /// chunks are read, too. Where the study has other points than before, what is there is numbered
  /// anew.
  /// Errors: the folder cannot be made; another process has it; its head is another, with the first
  /// part that differs; other points, while others are submitted; it is something else's.
  [[nodiscard]] static Result<SweepFolder> open(const std::string& path, const SweepHead& head,
                                                const Points& points);
  /// For one chunk, whose results alone are here. Errors: the same; other points; there is no
  /// sweep.
  [[nodiscard]] static Result<SweepFolder> open_chunk(const std::string& path,
                                                      const SweepHead& head, const Points& points,
                                                      const Chunk& chunk);

  [[nodiscard]] const std::string& path() const { return path_; }
  /// By the points' numbers, of a chunk from its first on; empty: not yet.
  [[nodiscard]] const std::vector<std::optional<PointResult>>& results() const { return results_; }
  [[nodiscard]] bool has(std::uint64_t index) const {
    return results_[static_cast<std::size_t>(index - first_)].has_value();
  }
  [[nodiscard]] std::uint64_t done() const { return done_; }
  /// Lines that could not be read, a warning each: their points have no result.
  [[nodiscard]] const Diagnostics& damaged() const { return damaged_; }
  /// Keeps a result; a chunk's is on the disk at the next one that comes a second later.
  /// Errors: the disk is full or gone; then the file ends with the line before.
  [[nodiscard]] Status add(const Point& point, PointResult result);
  /// What was kept is on the disk. Errors: as add()'s.
  [[nodiscard]] Status sync();

 private:
  [[nodiscard]] std::optional<std::uint64_t> number_of(const Points& points, const ReadLine& line);
  [[nodiscard]] std::size_t take(const Points& points, const std::string& file,
                                 const std::string& text);
  [[nodiscard]] Status take_chunks(const Points& points, const std::string& begin);
  [[nodiscard]] Status hold(const std::string& file);
  [[nodiscard]] Status write_anew(const Points& points, bool without_chunks);
  [[nodiscard]] std::unexpected<Error> write_fails(int error);
  void keep(std::uint64_t index, PointResult result);

  std::string path_, name_;  // of the folder, of the file that is written
  Descriptor file_;
  bool shared_ = false;  // what is written is a chunk's
  std::chrono::steady_clock::time_point synced_;
  std::uint64_t bytes_ = 0, first_ = 0, done_ = 0;
  std::vector<std::optional<PointResult>> results_;
  std::vector<std::pair<std::uint64_t, std::uint64_t>> by_name_;  // once one is elsewhere: numbers
  std::vector<ReadLine> others_;                                  // of points that are no more
  Diagnostics damaged_;
};

/// How far a sweep is, without its study: any machine may look, at any time.
struct Progress {
  std::uint64_t points = 0, done = 0, failed = 0;
  double seconds = 0.0;     ///< of those that are done, on the wall clock
  std::vector<bool> there;  ///< by the points' numbers
};
/// Errors: there is no sweep; a file that cannot be read.
[[nodiscard]] Result<Progress> progress_in(const std::string& folder);

}  // namespace tandem::sweep
