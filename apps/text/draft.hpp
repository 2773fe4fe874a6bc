// What a command writes, beside its place until all of it is there.
// Layer: apps/text.  Thread: main.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "base/result.hpp"

namespace tandem::apps {

/// A folder or file that is made under another name, NAME.new-PID, and moved to its place when it
/// is whole. What is not placed is removed: by the destructor; when SIGINT, SIGTERM or SIGHUP ends
/// the process, with a word on standard error (unless somebody handles these signals); and after a
/// SIGKILL by the next draft of the same name, which removes those of processes that are gone, as
/// far as this PID namespace shows; a folder's draft is locked as long as it is written, whatever
/// the namespace. One at a time.
class Draft {
 public:
  /// Which drafts of processes that are gone are removed.
  enum class Removes : std::uint8_t {
    kSameName,
    kAnyNumber,  ///< of names, too, that have other digits at their end: run-001 beside run-002
  };
  /// Draft of the folder `final` and the parents that it lacks; of what is to be added to a folder
  /// that is there. Errors: it is a file; the folder cannot be made.
  /// @param interrupted  what is said when a signal ends the process; empty: that nothing was
  ///                     written to `final`
  [[nodiscard]] static Result<Draft> folder(const std::string& final,
                                            Removes removes = Removes::kSameName,
                                            const std::string& interrupted = {});
  /// Draft of the file `final`, with the same ending, and of the folders that it lacks. Nothing is
  /// written yet, so it has no errors: who writes to path() meets them. What is no regular file, or
  /// in a folder that nothing may be added to, is its own draft.
  [[nodiscard]] static Draft file(const std::string& final);

  ~Draft();
  Draft(Draft&& other) noexcept;
  Draft& operator=(Draft&&) = delete;

  /// Where to write.
  [[nodiscard]] const std::string& path() const { return path_; }
  /// A text, of which each path of the draft is the one that was meant: of results and messages.
  [[nodiscard]] std::string placed(std::string text) const;
  /// The same of file, message and hint: the draft is gone when they are read.
  [[nodiscard]] Error placed(Error error) const;

  /// Called for each file before it is moved, with its place and itself.
  using Before = std::function<Status(const std::filesystem::path&, const std::filesystem::path&)>;
  /// Moves everything to its place, over what is there. Errors: `before`'s; a file's.
  [[nodiscard]] Status place(const Before& before = {});

 private:
  Draft(std::string final, std::filesystem::path root, std::string path,
        const std::string& interrupted = {});
  void remove();
  void lock();
  std::string final_;
  std::filesystem::path root_;  // what is removed; empty: nothing
  std::string path_;
  int lock_ = -1;  // on `root_`, if that is a folder
};

}  // namespace tandem::apps
