// Result<T>: the answer of everything that can fail off the real-time path.
// Layer: base.  Thread: non-RT only (an Error owns strings).
#pragma once

#include <expected>
#include <string>
#include <utility>
#include <vector>

namespace tandem {

/// What went wrong, where, and what to do next.
struct Error {
  std::string message;  ///< one sentence, without file or line
  std::string hint;     ///< the next step for the reader; may be empty
  std::string file;     ///< path of the file at fault; empty when there is none
  int line = 0;         ///< 1-based line in `file`; 0 when unknown
  std::string key;      ///< dotted key, link, joint or node at fault; may be empty

  /// "file:line: key: message (hint)", leaving out what is empty.
  [[nodiscard]] std::string to_string() const;
};

/// A value, or the first error met.
template <class T>
using Result = std::expected<T, Error>;

/// Success without a value, or the first error met.
using Status = std::expected<void, Error>;

/// Every error met in one reading, in the order of the file.
using Diagnostics = std::vector<Error>;

/// Puts the errors of one file into the order of its lines; those of a line keep theirs,
/// and those without a line come last.
void sort_by_line(Diagnostics& errors);

/// Shorthand for `return fail("…", "do this next")`.
[[nodiscard]] inline std::unexpected<Error> fail(std::string message, std::string hint = {}) {
  return std::unexpected(
      Error{.message = std::move(message), .hint = std::move(hint), .file = {}, .key = {}});
}

/// The same of what stands under `key`.
[[nodiscard]] inline std::unexpected<Error> fail_at(std::string key, std::string message,
                                                    std::string hint) {
  return std::unexpected(Error{
      .message = std::move(message), .hint = std::move(hint), .file = {}, .key = std::move(key)});
}

}  // namespace tandem
