// `tandem ask`: puts a question to a running process and prints the answer.
#include <fmt/core.h>

#include "apps/clients/commands.hpp"
#include "apps/clients/control_client.hpp"
#include "apps/text/console.hpp"
#include "apps/text/json_reader.hpp"

namespace tandem::apps {

Exit ask_command(const AskOptions& options) {
  const Result<Json> question = read_json_object(options.question);
  if (!question) return refuse(question.error());
  const Result<Json> answer = ask(options.target, "", *question);
  if (!answer) return refuse(answer.error());
  fmt::print("{}\n", json_text(*answer, 2));
  return Exit::kDone;
}

}  // namespace tandem::apps
