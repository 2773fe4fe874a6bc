// The other end of a control socket: finds a running process and asks it one thing.
// Layer: apps.  Thread: any, non-RT.
#pragma once

#include <sys/un.h>

#include <string>
#include <vector>

#include "apps/console.hpp"
#include "base/result.hpp"

namespace tandem::apps {

/// How long ask() waits for an answer.
inline constexpr int kControlAnswer_ms = 5000;

/// The socket's address. Errors: a path that is empty, or longer than the 107 bytes of one.
[[nodiscard]] Result<sockaddr_un> control_address(const std::string& path);

/// True when a process listens at `path`.
[[nodiscard]] bool control_socket_alive(const std::string& path);

/// The sockets of this user's running processes, in the order of their names. Files that dead
/// processes left are removed.
/// @param kind  "run", "emulate"; empty: any
[[nodiscard]] std::vector<std::string> running_control_sockets(const std::string& kind);

/// The one that is meant: `path` when it is not empty, else the only one of that kind.
/// Errors: none runs; several do (they are listed).
[[nodiscard]] Result<std::string> find_control_socket(const std::string& path,
                                                      const std::string& kind);

/// Sends `question` and waits for its answer.
/// Errors: nobody listens; no answer in time; {"ok": false}, with its error and hint.
[[nodiscard]] Result<Json> ask(const std::string& path, const Json& question);

/// find_control_socket() and ask() in one.
[[nodiscard]] Result<Json> ask(const std::string& path, const std::string& kind,
                               const Json& question);

}  // namespace tandem::apps
