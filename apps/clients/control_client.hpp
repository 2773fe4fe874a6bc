// The other end of a control socket, or of tandem/ask: finds a running process and asks it.
// Layer: apps/clients.  Thread: any, non-RT.
#pragma once

#include <sys/un.h>

#include <chrono>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "apps/command_line/control_target.hpp"
#include "apps/text/console.hpp"
#include "base/result.hpp"

namespace tandem::apps {

/// How long an emergency stop waits for its answer: who asks has to know soon that nothing stops
/// the robot. More than the longest time in which a run looks for the loop's confirmation.
inline constexpr std::chrono::milliseconds kStopAnswer{3000};
/// How long ask() waits for the answer to `question`: kStopAnswer, or 5 s.
[[nodiscard]] std::chrono::milliseconds answer_time(const Json& question);

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
/// Errors: nobody listens; no answer within answer_time(); {"ok": false}, with its error and hint.
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
