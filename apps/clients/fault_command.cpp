// tandem fault show|reset and tandem estop: what they ask a running process, and its answer.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <future>
#include <string>
#include <thread>
#include <vector>

#include "apps/clients/asked.hpp"
#include "apps/clients/dds_client.hpp"
#include "apps/control/fault_table.hpp"
#include "apps/text/console.hpp"

namespace tandem::apps {
namespace {

using SteadyClock = std::chrono::steady_clock;

/// A board that is configured anew takes some seconds.
constexpr std::chrono::seconds kResetTime{30};

const char kNotStarted[] =
    "the run waits for its start: no drive was enabled, and none will be before `tandem fault "
    "reset` and `tandem controller start`";
const char kKept[] = "simulated time stands: it is done in the next cycle (tandem clock resume)";
const char kAsked[] =
    "simulated time stands: it is asked for in the next cycle (tandem clock resume, then tandem "
    "fault show)";

/// "RKneeSag: position sensor (error code 0x7300); …": what is latched; of each joint the last,
/// which is what is there now.
std::string causes_of(const Json& answer) {
  const Json faults = answer.value("faults", Json::array());
  std::string causes;
  for (auto fault_at = faults.begin(); fault_at != faults.end(); ++fault_at) {
    const Json& fault = *fault_at;
    if (!fault.value("latched", false)) continue;
    const std::string joint = fault.value("joint", "");
    const bool superseded =
        !joint.empty() && std::any_of(fault_at + 1, faults.end(), [&](const Json& later) {
          return later.value("latched", false) && later.value("joint", "") == joint;
        });
    if (superseded) continue;
    causes += (causes.empty() ? "" : "; ") + (joint.empty() ? "" : joint + ": ") +
              fault.value("cause", "?");
  }
  return causes;
}

/// Whether a fault that is latched now was latched before: its cause is still there.
bool stayed(const Json& before, const Json& now) {
  const auto is_latched = [](const Json& fault) { return fault.value("latched", false); };
  for (const Json& fault : now.value("faults", Json::array())) {
    for (const Json& old : before.value("faults", Json::array())) {
      const bool same = fault.value("time_s", -1.0) == old.value("time_s", -2.0) &&
                        fault.value("joint", "") == old.value("joint", "");
      if (same && is_latched(fault) && is_latched(old)) return true;
    }
  }
  return false;
}

/// Whether an emergency stop is latched that was not before.
bool stopped_since(const Json& before, const Json& now) {
  const auto stops = [](const Json& answer) {
    return std::ranges::count_if(answer.value("faults", Json::array()), [](const Json& fault) {
      return fault.value("latched", false) && fault.value("joint", "").empty() &&
             fault.value("cause", "").starts_with("emergency stop");
    });
  };
  return stops(now) > stops(before);
}

/// Error when a fault stays latched at a joint whose faults only warn: the others are enabled.
Error still_there(const Json& answer) {
  return {.message = fmt::format("a cause is still there ({}): what it struck is not enabled, "
                                 "every other joint is",
                                 causes_of(answer)),
          .hint = "remove the cause, then `tandem fault reset` again",
          .file = {},
          .key = {}};
}

Error faulted_again(const Json& answer) {
  return {.message = fmt::format("the reset succeeded, and a fault followed at once ({})",
                                 causes_of(answer)),
          .hint = "reset a robot that lies or hangs still, then `tandem fault reset` again",
          .file = {},
          .key = {}};
}

/// Why a reset did not succeed, with the joints whose faults are latched.
/// @param stayed  nothing has stopped the robot since
Error failed_reset(const Json& answer, bool through, bool stayed) {
  const std::string why = through ? (stayed ? "a cause is still there" : "a stop came, and wins")
                                  : fmt::format("not through after {} s, in the phase {}",
                                                kResetTime.count(), answer.value("phase", "?"));
  return {
      .message = fmt::format("the reset failed, {} ({}): nothing moves", why, causes_of(answer)),
      .hint = "remove the cause, then `tandem fault reset` again",
      .file = {},
      .key = {}};
}

/// The run's answer once a reset is through; the last one when it takes too long.
Result<Json> wait_for_reset(ControlClient& run, const Json& before) {
  const auto deadline = SteadyClock::now() + kResetTime;
  for (;;) {
    Result<Json> now = run.ask({{"do", "fault.show"}});
    if (!now) return now;
    const bool counted = now->value("resets", 0) > before.value("resets", 0) ||
                         now->value("failed_resets", 0) > before.value("failed_resets", 0);
    const bool through = counted && now->value("phase", "") != "resetting";
    if (through || SteadyClock::now() > deadline) return now;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

/// @param who  whose answer it is; empty: of the one that was named
Exit tell_stop(const Result<Json>& answer, const Json& question, const std::string& who) {
  if (!answer) {
    Error error = answer.error();
    if (!who.empty()) error.message = fmt::format("{}: {}", who, error.message);
    print_errors({error});
    return Exit::kFault;
  }
  const std::string category = shown(answer->value("category", "?"));
  const bool no_retreat = question.value("category", -1) == 2 && category == "category1";
  fmt::print("{}{}emergency stop, {}{}\n", shown(who), who.empty() ? "" : ": ",
             category_words(category),
             no_retreat ? ": no active controller can bring the robot to a safe posture" : "");
  if (answer->value("paused", false)) fmt::print("{}\n", kKept);
  if (answer->value("waiting", false)) fmt::print("{}\n", kNotStarted);
  std::fflush(stdout);  // before an error of the next run
  return Exit::kDone;
}

/// Who looks for a run to stop needs no advice to start one.
Error nobody_to_stop(const ControlSearch& search) {
  return {.message = fmt::format("no run was stopped: none of this user was found in {}",
                                 fmt::join(search.looked, ", ")),
          .hint =
              "if the robot moves, press its emergency stop or cut its power. Runs of other "
              "users, in other containers and with --no-socket are not found: `tandem estop` "
              "as that user or there, --socket PATH, --dds, or kill -USR1 PID",
          .file = {},
          .key = {}};
}

/// Everybody in a domain can serve tandem/stop, and confirm what they like.
Exit tell_unvouched(const DdsAnswer& one) {
  print_errors({{.message = fmt::format(
                     "{}: the stop was sent, and participant {} says that it is carried out, for "
                     "whom there is no proof: it is no confirmation",
                     one.who, one.participant ? dds::to_text(*one.participant) : "unknown"),
                 .hint = "if the robot moves, press its emergency stop or cut its power. What "
                         "confirms is a run of this user on this machine, or DDS Security "
                         "(--dds-from); --trust-domain takes everybody's word (docs/safety.md)",
                 .file = {},
                 .key = {}}});
  return Exit::kFault;
}

/// Runs of this user in the same place that nobody has heard.
Exit tell_missing(const OwnRuns& own, const DdsAnswers& answers, const ControlTarget& target) {
  for (const std::string& who : own.silent) {
    say(Said::kWarning, who + " does not answer: if it is in this domain, it is not stopped");
  }
  if (!target.place.from.empty()) return Exit::kDone;  // which domain and namespace, it says
  const auto place = dds_config(target.place);         // it has been asked there: this is right
  Exit exit = Exit::kDone;
  for (const OwnRun& run : own.runs) {
    const bool meant = place && run.domain == place->domain &&
                       (!target.name_space || *target.name_space == run.name_space);
    const auto heard =
        std::ranges::find(answers.all, std::optional(run.participant), &DdsAnswer::participant);
    if (!meant || heard != answers.all.end()) continue;
    print_errors({{.message = run.who + ": is in this domain, and has not confirmed the stop",
                   .hint = "tandem estop, without --dds; or press its emergency stop",
                   .file = {},
                   .key = {}}});
    exit = Exit::kFault;
  }
  return exit;
}

/// Stops every run that serves in the DDS domain, and in the namespace when one is named. Whose
/// word counts is asked meanwhile: it delays no stop.
/// @param trusts  everybody's word counts
Exit stop_all_over_dds(const ControlTarget& target, const Json& question, bool trusts) {
  auto asked = std::async(std::launch::async,
                          [all = trusts] { return all ? OwnRuns{} : own_runs_on_dds(); });
  const auto answers = stop_all_by_dds(target, question);
  if (!answers) {
    for (const std::string& socket : running_control_sockets("run")) {
      say(Said::kWarning,
          fmt::format("{} is not stopped: tandem estop, without --dds", process_of(socket)));
    }
    return tell_stop(std::unexpected(answers.error()), question, {});
  }
  const OwnRuns own = asked.get();
  Exit exit = Exit::kDone;
  for (const DdsAnswer& one : answers->all) {
    const bool is_own =
        one.participant &&
        std::ranges::find(own.runs, *one.participant, &OwnRun::participant) != own.runs.end();
    const bool vouched = is_own || answers->secured || trusts;
    const Exit told =
        one.answer && !vouched ? tell_unvouched(one) : tell_stop(one.answer, question, one.who);
    if (told != Exit::kDone) exit = Exit::kFault;
  }
  return tell_missing(own, *answers, target) == Exit::kDone ? exit : Exit::kFault;
}

/// The runs of this user on this machine. A run that has just been started has no socket for some
/// 0.1 s: where there is none, it is looked for until then.
ControlSearch search_runs() {
  constexpr std::chrono::milliseconds kStart{500}, kAgain{10};
  const auto deadline = SteadyClock::now() + kStart;
  for (;;) {
    ControlSearch search = search_control_sockets("run");
    if (!search.sockets.empty() || SteadyClock::now() > deadline) return search;
    std::this_thread::sleep_for(kAgain);
  }
}

/// Stops every run of this user on this machine. All are asked at once: one that hangs must not
/// delay the others.
Exit stop_all(const Json& question) {
  const ControlSearch search = search_runs();
  for (const Error& refused : search.refused) {
    say(Said::kWarning, "not looked for runs there: " + refused.message);
  }
  if (search.sockets.empty()) {
    print_errors({nobody_to_stop(search)});
    return Exit::kFault;
  }
  std::vector<std::string> who;  // while they run
  for (const std::string& socket : search.sockets) who.push_back(process_of(socket));
  std::vector<std::future<Result<Json>>> answers;
  for (const std::string& socket : search.sockets) {
    answers.push_back(std::async(std::launch::async, [&] { return ask(socket, question); }));
  }
  Exit exit = Exit::kDone;
  for (std::size_t i = 0; i < answers.size(); ++i) {
    if (tell_stop(answers[i].get(), question, who[i]) != Exit::kDone) exit = Exit::kFault;
  }
  return exit;
}

}  // namespace

void print_latched(const Json& answer) {
  fmt::print("phase {}, {} latched\n", shown(answer.value("phase", "?")),
             answer.value("latched", 0));
  print_faults(answer.value("faults", Json::array()), stdout);
}

Result<Exit> tell_fault_reset(Asked& asked) {
  const Json before = asked.answer;
  Json& answer = asked.answer;
  const bool nothing = before.value("latched", 0) == 0;
  const bool kept = !nothing && before.value("paused", false);
  if (!nothing && !kept) {
    const Result<Json> through = wait_for_reset(asked.run, before);
    if (!through) {  // it was asked for, and nobody knows what came of it
      print_errors({through.error()});
      return Exit::kFault;
    }
    answer = *through;
  }
  const bool done = answer.value("resets", 0) > before.value("resets", 0);
  const bool held = answer.value("phase", "") == "held";
  const bool again = done && answer.value("latched", 0) > 0;
  const bool stays = again && stayed(before, answer);
  if (asked.prints()) {
    if (nothing) {
      fmt::print("{}\n",
                 before.value("cleared", false)
                     ? "the emergency stop is cleared; `tandem controller start` starts the run"
                     : "nothing is latched");
    }
    if (kept) fmt::print("{}\n", kAsked);
    if (done && !stays) fmt::print("reset: every joint is enabled where it is\n");
    if (!nothing) print_latched(answer);
    if (done && held) fmt::print("held: `tandem controller start` starts the controllers again\n");
  }
  if (!nothing && !kept && !done) {
    const bool through = answer.value("failed_resets", 0) > before.value("failed_resets", 0);
    print_errors({failed_reset(answer, through, !stopped_since(before, answer))});
  }
  if (again) print_errors({stays ? still_there(answer) : faulted_again(answer)});
  return nothing || kept || (done && !again) ? Exit::kDone : Exit::kFault;
}

Exit estop_command(const AskedOptions& options) {
  Json question{{"do", "estop"}};
  if (options.given.contains("category")) question["category"] = options.given["category"];
  const bool trusts = options.given.value("trust-domain", false);
  if (trusts && !options.target.dds) {
    return refuse(Error{"--trust-domain requires --dds", "leave it out", {}, 0, {}});
  }
  if (options.target.dds) return stop_all_over_dds(options.target, question, trusts);
  if (options.target.socket.empty()) return stop_all(question);
  return tell_stop(ask(options.target, "run", question), question, {});
}

}  // namespace tandem::apps
