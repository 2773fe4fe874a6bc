#include <fmt/core.h>

#include "apps/commands.hpp"
#include "apps/console.hpp"
#include "apps/control_client.hpp"

namespace tandem::apps {

Exit ask_command(const AskOptions& options) {
  const Json question = Json::parse(options.question, nullptr, false);
  if (!question.is_object()) {
    print_errors({{.message = "the question is no JSON object",
                   .hint = R"(for instance: tandem ask '{"do": "help"}')",
                   .file = {},
                   .key = {}}});
    return Exit::kUsage;
  }
  const Result<Json> answer = ask(options.target, "", question);
  if (!answer) {
    print_errors({answer.error()});
    return Exit::kUsage;
  }
  fmt::print("{}\n", json_text(*answer, 2));
  return Exit::kDone;
}

}  // namespace tandem::apps
