// The other end of a control socket, or of tandem/ask: finds a running process and asks it.
// Layer: apps/clients.  Thread: any, non-RT.
#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "apps/command_line/control_target.hpp"
#include "apps/text/console.hpp"
#include "base/result.hpp"

namespace tandem::apps {

/// How long ask() waits for the answer to `question`: kStopAnswer, or 5 s.
[[nodiscard]] std::chrono::milliseconds answer_time(const Json& question);

/// The sockets of this user's running processes, in the order of their names. Files that dead
/// processes left are removed.
/// @param kind  "run", "emulate"; empty: any
[[nodiscard]] std::vector<std::string> running_control_sockets(const std::string& kind);

/// The same. Errors: others may change the folder; none runs.
[[nodiscard]] Result<std::vector<std::string>> find_control_sockets(const std::string& kind);

/// Of a socket of running_control_sockets(): the command line and the number of its process,
/// "tandem run squat.toml (process 17566)"; `path` when it does not name the process.
[[nodiscard]] std::string process_of(const std::string& path);

/// The one that is meant: `path` when it is not empty, else the only one of that kind.
/// Errors: none runs; several do (they are listed, with process_of()).
[[nodiscard]] Result<std::string> find_control_socket(const std::string& path,
                                                      const std::string& kind);

/// Sends `question` and waits for its answer.
/// Errors: no process listens; no answer within answer_time(); {"ok": false}, with its error and
/// hint.
[[nodiscard]] Result<Json> ask(const std::string& path, const Json& question);

/// An answer's text. Errors: {"ok": false}, with its error and hint; what is no answer, which names
/// `who` sent it.
[[nodiscard]] Result<Json> read_answer(std::string_view text, const std::string& who);

/// Asks one process, whichever way leads there.
class ControlClient {
 public:
  virtual ~ControlClient() = default;
  /// Finds the process.
  /// @param kind  of the only one, over a socket: "run", "emulate"; empty: any
  /// Errors: find_control_socket()'s, or open_dds_client()'s.
  [[nodiscard]] static Result<std::unique_ptr<ControlClient>> open(const ControlTarget& target,
                                                                   const std::string& kind);
  /// Errors: nobody is there; no answer within answer_time(); read_answer()'s.
  [[nodiscard]] virtual Result<Json> ask(const Json& question) = 0;
};

/// Opens and asks once.
[[nodiscard]] Result<Json> ask(const ControlTarget& target, const std::string& kind,
                               const Json& question);

}  // namespace tandem::apps
