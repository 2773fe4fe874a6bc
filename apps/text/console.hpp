// Text for people: tables, errors, progress; and the JSON files for programs.
// Layer: apps/text.  Thread: main.
#pragma once

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/quoting.hpp"
#include "base/result.hpp"
#include "rt/histogram.hpp"

namespace tandem::apps {

/// Exit status of every command.
enum class Exit : int {
  kDone = 0,   ///< did what was asked
  kFault = 1,  ///< the run ended in a fault; the logs that were compared differ
  kUsage = 2,  ///< wrong input or usage; nothing was run
};
/// Status of a command that ended in order before its time, because of this signal: as of one that
/// the signal killed, by a shell's count.
[[nodiscard]] constexpr Exit interrupted(int signal) { return static_cast<Exit>(128 + signal); }

/// Keys in the order in which they are written.
using Json = nlohmann::ordered_json;

/// Where text for people goes: standard error when the JSON takes standard output ("-").
[[nodiscard]] std::FILE* human_output(const std::string& json_file);

/// Whether people read along: `out` is a terminal.
[[nodiscard]] bool is_terminal(std::FILE* out);

/// From now on what is printed to either standard stream is harmless() (base/quoting.hpp), whoever
/// wrote it. Call it first.
void show_harmless();

/// Whether `out` may have colours: a terminal that knows them, without $NO_COLOR (no-color.org).
[[nodiscard]] bool has_colours(std::FILE* out);

/// What a line on the standard error is.
enum class Said : std::uint8_t { kError, kWarning, kFault, kHint };
/// A line on the standard error that begins with what it is, in its colour where there are colours.
/// Throws nothing where it cannot be written.
void say(Said what, const std::string& text);

/// Begins the line anew on a terminal, over a bar that is there; nothing elsewhere.
void restart_line(std::FILE* out);

/// From now on no file ends the process in the middle of a cycle. When a pipe's reader or the
/// terminal is gone, what is printed is thrown away and a stop is asked for (rt::request_stop()).
/// Where no space is left it is thrown away only, and flush_output() says so at the end.
/// Call it before other threads print.
void outlive_files();

/// Writes what is left of the standard output. An error when something that was printed could not
/// be written, then or before; none when a pipe's reader has gone, who wants no more.
/// @param before  errno of what could not be printed before; 0: not known
[[nodiscard]] Status flush_output(int before = 0);

/// Whether `file` and the folders that it lacks can be written, found out before a run: an error
/// that names it when not. Nothing is made.
/// @param begins  of a file that is there and may be lost; empty: JSON. @param what  that is
[[nodiscard]] Status check_writable(const std::string& file, std::string_view begins = {},
                                    const std::string& what = "JSON");

/// `value` as JSON, whatever bytes its texts hold: what is no UTF-8 becomes U+FFFD.
/// @param indent  blanks a level; -1: all in one line
[[nodiscard]] std::string json_text(const Json& value, int indent = -1);

/// Writes `value` to `file`, and makes the folders that it lacks; "-" for standard output; does
/// nothing when `file` is empty.
[[nodiscard]] Status write_json(const std::string& file, const Json& value);

/// Writes a new file, or over an old one, and removes it when not all of it could be written: give
/// it a Draft's path. @pre its folder is there
[[nodiscard]] Status write_file(const std::filesystem::path& file, const std::string& text);

/// An error when a file is there that does not begin as what would be written over it.
/// @param begins  of all that may be written over: "time_s,", "\x7F" "ELF"
[[nodiscard]] Status check_overwrites(const std::string& file, std::string_view begins,
                                      const std::string& what);

/// Writes the JSON of a command that has done its work.
/// @return `exit`, or that of a JSON that cannot be written, after its error was printed
[[nodiscard]] Exit end_with_json(const std::string& file, const Json& value,
                                 Exit exit = Exit::kDone);

/// p50, p99, p999, max; all [ns].
[[nodiscard]] Json percentiles_json(const rt::Percentiles& p);
/// The same; null when nothing was measured.
[[nodiscard]] Json percentiles_json(const rt::Histogram& of);

/// Every error on a line of its own, on standard error.
void print_errors(const Diagnostics& errors);

/// The same; what a command returns whose input is wrong.
Exit refuse(const Diagnostics& errors);
Exit refuse(const Error& error);

/// The same of warnings; write_failure() has no part in them.
void print_warnings(const Diagnostics& warnings);

/// For write_failure(): an error that has been reported in other words than print_errors()'s.
void remember_error(Error error);

/// A list of objects: file, line, key, message, hint.
[[nodiscard]] Json errors_json(const Diagnostics& errors);

/// A command with `--json file` begins: what a former one left there goes, so that a command which
/// comes to no end leaves no result. Once, before it does anything.
void begin_json(const std::string& file);

/// write_failure() with this error, to the file of begin_json(): the process ends at once.
void fail_begun_json(Error error);

/// For a command that failed: {"ok": false, "errors": [...]} with all that print_errors() said,
/// unless write_json() has written something already. `file` as there.
void write_failure(const std::string& file);

/// A table of two or more columns, the first left-aligned and the others to the right, unless all
/// are texts. Cells are shown(), each in one line. A table of texts that is wider than 100
/// characters, or than the terminal, breaks the widest column's lines at blanks.
class Table {
 public:
  explicit Table(std::vector<std::string> header) : rows_{std::move(header)} {}
  void add(std::vector<std::string> row);
  [[nodiscard]] std::size_t rows() const { return rows_.size() - 1; }
  void align_left() { left_ = true; }
  /// Prints with a rule below the header, when that is not empty.
  void print(std::FILE* out) const;

 private:
  std::vector<std::vector<std::string>> rows_;
  bool left_ = false;
};

/// Name and value, one pair a line, the values aligned.
class Facts {
 public:
  void add(const std::string& name, const std::string& value);
  void print(std::FILE* out) const;

 private:
  std::vector<std::pair<std::string, std::string>> facts_;
};

/// One line that is shown anew once a second, on a terminal in its own place.
class StatusLine {
 public:
  explicit StatusLine(std::FILE* out);
  ~StatusLine();
  StatusLine(const StatusLine&) = delete;
  StatusLine& operator=(const StatusLine&) = delete;
  /// True once a second; elsewhere than on a terminal once in ten.
  [[nodiscard]] bool due();
  void show(const std::string& text);

 private:
  std::FILE* out_;
  bool terminal_;
  bool drawn_ = false;
  std::chrono::steady_clock::time_point next_;
};

/// The progress of a run: a bar that is redrawn on a terminal, a line per tenth elsewhere.
class ProgressBar {
 public:
  /// @param total_s  of the whole; 0: it has no end, and no bar
  ProgressBar(std::FILE* out, double total_s);
  /// @param done_s  simulated seconds so far.  @param note  behind the bar; may be empty.
  void update(double done_s, const std::string& note);
  /// Ends the bar's line, when there is one.
  void finish();

 private:
  void update_endless(double done_s, const std::string& note);

  std::FILE* out_;
  double total_s_;
  bool terminal_;
  bool drawn_ = false;
  int tenth_ = -1;
  std::optional<std::string> noted_;  // of an endless one
  std::chrono::steady_clock::time_point started_;
  std::chrono::steady_clock::time_point next_;
};

}  // namespace tandem::apps
