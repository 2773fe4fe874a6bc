// The other end of a control socket, or of tandem/ask: finds a running process and asks it.
// Layer: apps/clients.  Thread: any, non-RT.
#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "apps/clients/control_search.hpp"
#include "apps/command_line/control_target.hpp"
#include "apps/text/console.hpp"
#include "base/result.hpp"

namespace tandem::apps {

/// How the error begins of who does not answer in time.
inline constexpr char kNoAnswer[] = "no answer within";

/// How long ask() waits for the answer to `question`: as its row says.
[[nodiscard]] std::chrono::milliseconds answer_time(const Json& question);

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
