// Starts this program anew with a request file; the exit status of that process is the verdict.
#include "apps/run/controller_trial.hpp"

#include <fmt/core.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <sstream>
#include <thread>

#include "apps/run/connection.hpp"
#include "apps/run/loop_crash.hpp"
#include "apps/text/console.hpp"
#include "apps/text/json_reader.hpp"
#include "base/archive.hpp"
#include "base/open_file.hpp"
#include "base/process.hpp"
#include "base/quoting.hpp"
#include "base/temporary_folder.hpp"
#include "controllers/hosted_call.hpp"
#include "runtime/run/composition.hpp"
#include "runtime/run_services.hpp"

namespace tandem::apps {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;

/// The other process' exit status when the run's experiment cannot be composed there.
constexpr int kUntried = 3;
constexpr std::uint64_t kMostTrialBytes = std::uint64_t{32} << 20;
constexpr char kUntriedHint[] =
    "put that right; or load it with --untried: then its crash ends the run";

/// What the other process needs of the run to compose the same robot.
Json request_of(const RunOptions& options, const ControllerTrial& trial) {
  Json settings = Json::array();
  for (const TomlSetting& one : options.settings) settings.push_back(one.key + "=" + one.value);
  return {{"experiment", options.experiment},
          {"settings", settings},
          {"hal", options.hal},
          {"serves", options.serves},
          {"lockstep", options.lockstep},
          {"kernel_variant", options.kernel_variant},
          {"name", trial.name},
          {"plugin", trial.plugin},
          {"parameters", trial.parameters},
          {"file", trial.file},
          {"table", trial.table}};
}

/// Waits for the child. While a debugger has this process, or --debug, for ever. One that has said
/// that it crashed gets the time to find out where.
/// @return its exit status, 128 + signal; empty: it was too slow, and is no more
std::optional<int> wait_for_trial(pid_t child, milliseconds limit, const std::string& output) {
  constexpr milliseconds kTick{2};
  int raw = 0;
  bool extended = false;
  for (auto left = limit; left.count() > 0;) {
    const pid_t ended = ::waitpid(child, &raw, WNOHANG);
    if (ended == child) return exit_status(raw);
    if (ended < 0 && errno != EINTR) return -1;
    std::this_thread::sleep_for(kTick);
    if (!time_limits_are_waived()) left -= kTick;
    if (left.count() > 0 || extended) continue;
    const auto said = read_file(output, "", kMostTrialBytes);
    if (!said || !said->contains(kEarlyCrash)) continue;
    extended = true;
    left = kPlaceTime;
  }
  ::kill(child, SIGKILL);
  (void)wait_for(child);
  return std::nullopt;
}

/// The innermost call that a crash's stack names of the library, which has no name yet while it is
/// opened: then the innermost of all. Empty: there is no stack.
std::string place_in(const std::string& output, const std::string& plugin) {
  std::istringstream lines(output);
  const std::string library = fs::path(plugin).filename().string();
  std::string innermost;
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("  ")) continue;
    const std::string place = " in " + line.substr(2);
    if (line.find("(" + library) != std::string::npos) return place;
    if (innermost.empty()) innermost = place;
  }
  return innermost;
}

/// Its first lines, harmless.
void print_said(const ControllerTrial& trial, const std::string& output) {
  constexpr int kMostLines = 60;
  fmt::print(stderr, "note: from the trial of the controller '{}':\n", shown(trial.name));
  std::istringstream lines(output);
  int left = kMostLines;
  for (std::string line; left-- > 0 && std::getline(lines, line);)
    fmt::print(stderr, "  {}\n", shown(line, 500));
}

Error trial_error(const ControllerTrial& trial, std::string message, std::string hint) {
  return {.message = std::move(message), .hint = std::move(hint), .file = {}, .key = trial.name};
}

/// What an exit status of the other process says.
Status judged(const ControllerTrial& trial, const std::optional<int>& status, milliseconds limit,
              const std::string& output) {
  constexpr char kGoesOn[] =
      "correct it; it was tried in a process of its own, and the run goes on";
  if (status == 0) return {};
  if (!output.empty()) print_said(trial, output);
  if (!status) {
    return std::unexpected(trial_error(
        trial, fmt::format("the controller did not return within {} ms", limit.count()), kGoesOn));
  }
  if (*status == kUntried) {
    return std::unexpected(trial_error(
        trial, "it could not be tried: " + output.substr(0, output.find('\n')), kUntriedHint));
  }
  if (*status <= 128) {
    return std::unexpected(trial_error(trial, "the controller called exit()", kGoesOn));
  }
  const char* signal = ::sigabbrev_np(*status - 128);
  return std::unexpected(
      trial_error(trial,
                  fmt::format("the controller crashed before its first cycle: SIG{}{}",
                              signal == nullptr ? std::to_string(*status - 128) : signal,
                              place_in(output, trial.plugin)),
                  kGoesOn));
}

Status tried(const RunOptions& options, const ControllerTrial& trial) {
  const TemporaryFolder folder("trial");
  const auto untried = [&](const std::string& why) {
    return std::unexpected(trial_error(trial, "it could not be tried: " + why, kUntriedHint));
  };
  if (const Status made = folder.made(); !made) return untried(made.error().message);
  const std::string asked = folder.below("request.json"), said = folder.below("output");
  {
    auto request = open_output(asked, 0600);
    if (!request) return untried(request.error().message);
    if (write_all(*request, json_text(request_of(options, trial))) != 0)
      return untried("the disk is full");
  }
  const auto child = spawn({.command = {same_program(), kTryController, asked}, .output = said});
  if (!child) return untried(child.error().message);
  const milliseconds limit = runtime::ControllerHost::kConfigureTime;
  const std::optional<int> status = wait_for_trial(*child, limit, said);
  const auto output = read_file(said, "", kMostTrialBytes);
  return judged(trial, status, limit, output ? *output : "");
}

/// @return 0: it can be opened, configured, archived and destroyed, or says itself that it cannot
int tried_here(const Json& request) {
  runtime::Overrides overrides;
  const auto text = [&](const char* key) { return request[key].get<std::string>(); };
  for (const Json& one : request["settings"]) {
    if (auto setting = read_setting(one.get<std::string>()))
      overrides.settings.push_back(std::move(*setting));
  }
  overrides.hal = text("hal");
  overrides.serves = request["serves"].get<bool>();
  overrides.lockstep = request["lockstep"].get<bool>();
  overrides.kernel_variant = text("kernel_variant");
  overrides.no_build = true;
  overrides.change = [](runtime::Experiment& e) { e.controllers.clear(); };
  const auto c = runtime::composed<WiredComposition>(text("experiment"), overrides, {});
  if (!c) {
    fmt::print(stderr, "{}\n", c.error().front().to_string());
    return kUntried;
  }
  const std::string name = text("name");
  auto loaded = load_controller(text("plugin"), controller_folders());
  if (!loaded) return 0;
  const auto document = TomlDocument::parse(text("parameters"), text("file"));
  if (!document) return 0;
  const auto made = (*c)->controllers->configure(
      name, std::move(*loaded), runtime::table_at(*document, text("table")), std::nullopt);
  if (!made) return 0;
  Archive archive;
  (void)hosted_call(name, [&]() -> Status {
    (*made)->controller->archive(archive);
    return {};
  });
  return 0;
}

}  // namespace

TryController try_in_other_process(const RunOptions& options) {
  return [options](const ControllerTrial& trial) { return tried(options, trial); };
}

int try_controller(const std::string& path) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  const rlimit none{0, 0};
  ::setrlimit(RLIMIT_CORE, &none);  // the run that asks prints the stack
  const auto text = read_file(path, "", kMostTrialBytes);
  if (!text) return kUntried;
  const auto request = read_json_object(*text);
  return request ? tried_here(*request) : kUntried;
}

}  // namespace tandem::apps
