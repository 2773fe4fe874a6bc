// tandem inject: what it asks a running process.
#include <fmt/core.h>

#include "apps/clients/commands.hpp"
#include "apps/clients/control_client.hpp"
#include "apps/text/console.hpp"
#include "hal/sim/scenario.hpp"

namespace tandem::apps {

Exit inject_command(const InjectOptions& options) {
  const Json question{{"do", "inject"}, {"scenario", sim::scenario_of_words(options.fault)}};
  const Result<Json> answer = ask(options.target, "", question);
  if (!answer) return refuse(answer.error());
  fmt::print("{} injected\n",
             answer->value("injected", 0) == 1 ? "the fault is" : "the faults are");
  return Exit::kDone;
}

}  // namespace tandem::apps
