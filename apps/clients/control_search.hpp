// Which processes of this user are running, by their control sockets: wherever their environment
// has put them. Layer: apps/clients.  Thread: any, non-RT.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"

namespace tandem::apps {

/// What a search for running processes found.
struct ControlSearch {
  std::vector<std::string> sockets{};  ///< in the order of their paths
  std::vector<std::string> looked{};   ///< the places, for a message
  /// Folders that are there and were not used, because others may change them or own them.
  Diagnostics refused{};
};

/// Looks in control_folders(), and at every socket "<kind>-<pid>.sock" of this user that listens
/// (/proc/net/unix), so that a process with another XDG_RUNTIME_DIR is found, too. Files that dead
/// processes left in those folders are removed.
/// @param kind  "run", "emulate"; empty: any
[[nodiscard]] ControlSearch search_control_sockets(const std::string& kind);

/// The sockets that the search found.
[[nodiscard]] std::vector<std::string> running_control_sockets(const std::string& kind);

/// The same. Errors: none runs, with the places where it was looked for; or others may change this
/// process' own control_folder().
[[nodiscard]] Result<std::vector<std::string>> find_control_sockets(const std::string& kind);

/// Process behind a socket of running_control_sockets(): its command line and its number,
/// "tandem run squat.toml (process 17566)"; `path` when it does not name the process.
[[nodiscard]] std::string process_of(const std::string& path);

/// The one that is meant: `path` when it is not empty, else the only one of that kind.
/// Errors: none runs; several do (they are listed, with process_of()).
[[nodiscard]] Result<std::string> find_control_socket(const std::string& path,
                                                      const std::string& kind);

}  // namespace tandem::apps
