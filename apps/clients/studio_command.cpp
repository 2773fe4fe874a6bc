// `tandem studio`: a run that goes on opens its studio.
#include <fmt/core.h>

#include <filesystem>

#include "apps/clients/commands.hpp"
#include "apps/clients/control_client.hpp"
#include "apps/text/console.hpp"

namespace tandem::apps {
namespace {

Json question_of(const StudioCommandOptions& options) {
  Json question{{"do", "studio.open"}};
  if (options.port) question["port"] = *options.port;
  if (!options.address.empty()) question["address"] = options.address;
  if (!options.origins.empty()) question["origins"] = options.origins;
  // The run may be in another folder.
  if (!options.page.empty()) question["page"] = std::filesystem::absolute(options.page).string();
  return question;
}

/// What a process says that does not know the command.
Error why_not(Error error) {
  if (!error.message.starts_with("unknown command")) return error;
  error.message = "this process has no studio: it is no run, or one of an older version of Tandem";
  error.hint =
      "an emulation opens its own when it starts: tandem emulate … --studio; start an older "
      "run again: tandem run … --studio";
  return error;
}

}  // namespace

Exit attach_studio(const StudioCommandOptions& options) {
  const Result<Json> answer = ask(options.target, "run", question_of(options));
  if (!answer) return refuse(why_not(answer.error()));
  const std::string address = answer->value("address", "");
  const bool asked = question_of(options).size() > 1;
  if (!answer->value("opened", true) && asked) {
    fmt::print(stderr, "note: it was open already, and stays as it is until the run ends\n");
  }
  if (answer->contains("note")) fmt::print(stderr, "note: {}\n", shown(answer->value("note", "")));
  fmt::print("studio: {}\n", shown(address));
  return Exit::kDone;
}

}  // namespace tandem::apps
