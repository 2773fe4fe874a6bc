// Libraries that may be loaded, and folders whose sockets may be asked: only what nobody else could
// have put where it is.
// Layer: base.  Thread: any, not RT.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>

#include "base/open_file.hpp"
#include "base/result.hpp"

namespace tandem {

/// A library that was judged, held open: what is checked and loaded is this file, whatever its name
/// leads to by then.
///
/// Code that a process loads runs with all its rights, so nobody else may have had a hand in it
/// (who_else_may_change()): the file and every folder and link on the way to it belong to this
/// user, to root or to whoever owns the program itself, and others may not write to them. A folder
/// like /tmp, in which everybody may only change what is his, may be on the way. Folders above the
/// program itself are not judged: who can change those can change the program.
class TrustedCode {
 public:
  /// Errors: no such file, or no regular one; who may write where, with the path.
  [[nodiscard]] static Result<TrustedCode> open(const std::string& path);

  /// Whether the file holds all that its own header says is to be loaded. A loader maps what is
  /// missing of a file that was cut, as one that is being copied, and its first touch ends the
  /// process.
  /// Errors: it cannot be read, is no ELF file of 64 bits, or is cut, with both sizes.
  [[nodiscard]] Status check_whole() const;
  /// Whether it is as it was when it was sealed. A damaged one would end the process while it is
  /// being loaded. Errors: it cannot be read, is not sealed, or has changed since.
  [[nodiscard]] Status check_seal() const;

  /// dlopen(). The loader, debuggers and dladdr() know the library by its real path. Of the file
  /// itself; by its real path, of which every folder was judged, if it looks for other libraries
  /// beside itself ($ORIGIN), or a debugger has this process.
  /// Errors: the loader's words, without the path; /proc is missing.
  [[nodiscard]] Result<void*> load(int flags) const;
  /// What this process has loaded by its real path, such as a former build: a handle to compare
  /// with load()'s. Null: nothing.
  [[nodiscard]] const void* loaded() const noexcept;

  /// The file itself, and where it is, without links.
  [[nodiscard]] const Descriptor& file() const noexcept { return file_; }
  [[nodiscard]] const std::string& real_path() const noexcept { return real_; }

 private:
  TrustedCode(std::string path, std::string real, Descriptor file)
      : path_(std::move(path)), real_(std::move(real)), file_(std::move(file)) {}
  std::string path_;  // as it was named
  std::string real_;  // without links
  Descriptor file_;
};

/// Whether a folder, and every folder and link on the way to it, is nobody else's: whoever may
/// change one of them may put another file in the place of one that is there.
///
/// @param folder   followed through links; empty: the working directory
/// @param partner  a user who may own them, too
/// Errors: no such folder; who may write where, with the folder and its mode.
[[nodiscard]] Status check_trusted_folder(const std::string& folder,
                                          std::optional<uid_t> partner = {});

/// Adds the SHA-256 of a library's bytes behind its end, where no loader looks.
/// Errors: the file cannot be read or written.
[[nodiscard]] Status seal_library(const std::string& path);

}  // namespace tandem
