// Who may change a file: its owner, its mode, its group, its access list.
// Layer: base.  Thread: any, not RT.
#pragma once

#include <sys/stat.h>

#include <optional>
#include <string>

namespace tandem {

/// Whose code runs in this process anyway: this user's, root's, the program's owner's.
[[nodiscard]] bool is_trusted_user(uid_t user);

/// Empty, or who else may change it: "may be changed by everybody".
///
/// A group may write when it is the own group of a trusted user and nobody else is in it, as far as
/// the system's lists of users and groups say. In a folder like /tmp everybody may only change what
/// is his, so it counts as nobody else's.
/// @param descriptor  of the same file; O_PATH is enough
/// @param partner     a user who may own it, too
[[nodiscard]] std::string who_else_may_change(int descriptor, const struct stat& found,
                                              std::optional<uid_t> partner = {});

}  // namespace tandem
