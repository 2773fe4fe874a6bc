#include <fmt/core.h>

#include "apps/commands.hpp"
#include "apps/console.hpp"
#include "apps/control_client.hpp"
#include "apps/json_reader.hpp"

namespace tandem::apps {

Exit ask_command(const AskOptions& options) {
  const Result<Json> question = read_json_object(options.question);
  if (!question) {
    print_errors({question.error()});
    return Exit::kUsage;
  }
  const Result<Json> answer = ask(options.target, "", *question);
  if (!answer) {
    print_errors({answer.error()});
    return Exit::kUsage;
  }
  fmt::print("{}\n", json_text(*answer, 2));
  return Exit::kDone;
}

}  // namespace tandem::apps
