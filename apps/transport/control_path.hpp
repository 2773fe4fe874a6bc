// Where running processes' control sockets lie, and whom to trust there: of both ends.
// Layer: apps/transport.  Thread: any, non-RT.
#pragma once

#include <sys/types.h>
#include <sys/un.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace tandem::apps {

/// The folder of this process' socket: $TANDEM_SOCKETS, else $XDG_RUNTIME_DIR/tandem, or
/// /tmp/tandem-<uid> where there is no such folder.
[[nodiscard]] std::string control_folder();
/// Where another process of this user can have its socket, whose environment may be another one:
/// control_folder() first, then /run/user/<uid>/tandem, /tmp/tandem-<uid> and that of
/// scripts/tandem@.service. Each once, as far as the names tell. With $TANDEM_SOCKETS there is
/// no other than that.
[[nodiscard]] std::vector<std::string> control_folders();
/// Whether $TANDEM_SOCKETS keeps the search to one folder.
[[nodiscard]] bool one_control_folder();
/// The paths of what listens in a table like /proc/net/unix, of which another process' environment
/// may have made the folder. Only absolute ones.
[[nodiscard]] std::vector<std::string> listening_paths(const std::string& table);
/// Whether `folder` is a folder that this user alone may change: in any other one somebody else may
/// have put a socket of theirs. Errors: it is not, with its owner; it is not there.
[[nodiscard]] Status check_private_folder(const std::string& folder);
/// Whether nobody else could have put a socket of theirs at `path`: check_private_folder() of the
/// default folder, check_trusted_folder() of any other. A folder that is not there is nobody's.
/// @param partner  who listens, and may own the folder; empty: this user is to listen
[[nodiscard]] Status check_socket_folder(const std::string& path,
                                         std::optional<uid_t> partner = {});
/// The user at the other end of a connection of AF_UNIX.  @return -1: unknown
[[nodiscard]] std::int64_t peer_user(int descriptor);
/// "<control_folder()>/<kind>-<pid>.sock" of this process.
/// @param kind  the command that runs: "run", "emulate"
[[nodiscard]] std::string default_control_path(const std::string& kind);

/// The socket's address. Errors: a path that is empty, or longer than the 107 bytes of one.
[[nodiscard]] Result<sockaddr_un> control_address(const std::string& path);

/// True when a process listens at `path`.
[[nodiscard]] bool control_socket_alive(const std::string& path);

}  // namespace tandem::apps
