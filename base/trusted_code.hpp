// Whether a library may be loaded, or a process be asked: only what nobody else could have put
// where it is.
// Layer: base.  Thread: any, not RT.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>

#include "base/result.hpp"

namespace tandem {

/// Code that a process loads runs with all its rights, so nobody else may have had a hand in it:
/// the file and every folder above it belong to this user, to root or to whoever owns the program
/// itself, and others may not write to them. A group may, when it is root's or this user's own; a
/// folder like /tmp, in which everybody may only change what is his, may lie above. Folders above
/// the program itself are not judged: who can change those can change the program.
///
/// @param path  of a file, followed through links
/// Errors: no such file, or no regular one; who may write where, with the path.
[[nodiscard]] Status check_trusted_code(const std::string& path);

/// The same of a folder, and of every folder above it: whoever may change one of them may put
/// another file in the place of one that is there.
///
/// @param folder   followed through links; empty: the working directory
/// @param partner  a user who may own them, too
/// Errors: no such folder; who may write where, with the folder and its mode.
[[nodiscard]] Status check_trusted_folder(const std::string& folder,
                                          std::optional<uid_t> partner = {});

/// Whether a library's file holds all that its own header says is to be loaded. A loader maps what
/// is missing of a file that was cut, as one that is being copied, and its first touch ends the
/// process.
/// Errors: it cannot be read, is no ELF file of 64 bits, or is cut, with both sizes.
[[nodiscard]] Status check_whole(const std::string& path);

/// Adds the SHA-256 of a library's bytes behind its end, where no loader looks.
/// Errors: the file cannot be read or written.
[[nodiscard]] Status seal_library(const std::string& path);
/// Whether a library is as it was when it was sealed. A damaged one would end the process while it
/// is being loaded. Errors: it cannot be read, is not sealed, or has changed since.
[[nodiscard]] Status check_seal(const std::string& path);

}  // namespace tandem
