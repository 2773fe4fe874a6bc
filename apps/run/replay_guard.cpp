#include "apps/run/replay_guard.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <system_error>
#include <utility>

#include "apps/run/cycle_guard.hpp"
#include "apps/run/loop_crash.hpp"
#include "apps/text/console.hpp"

namespace tandem::apps {

ReplayGuard::ReplayGuard(runtime::RobotCycle& cycle, const runtime::Composition& composition,
                         std::string draft, std::string json)
    : cycle_(&cycle),
      controllers_(composition.controllers.get()),
      draft_(std::move(draft)),
      json_(std::move(json)),
      limit_s_(composition.experiment.watchdog_s.value_or(CycleGuard::kSimulated_s)),
      watchdog_(cycle.heartbeat(),
                {.limit = std::chrono::nanoseconds(static_cast<std::int64_t>(limit_s_ * 1e9)),
                 .waits_for_debugger = true},
                {.on_hang = [this](bool at_work) { end(at_work); },
                 .on_return = [] {},
                 .on_given_up = [] {}}) {
  robot_is_stopped();  // there is none
  stand_still_on_crash(cycle.heartbeat());
}

void ReplayGuard::end(bool at_work) const {
  const std::string where = where_the_loop_is(*controllers_, at_work);
  Error error;
  if (cycle_->heartbeat().stands_still()) {
    await_crash_place();
    error = loop_error(fmt::format("the replay crashed {}: {}", where, crash_reason()));
  } else {
    error =
        loop_error(fmt::format("the replay hangs: no cycle for {:g} s, it is {}", limit_s_, where));
  }
  if (error.hint.empty()) error.hint = "correct it; the replay has no result";
  print_errors({error});
  write_failure(json_);
  std::error_code ignored;
  if (!draft_.empty()) std::filesystem::remove(draft_, ignored);
  std::fflush(nullptr);
  ::_exit(static_cast<int>(Exit::kUsage));
}

}  // namespace tandem::apps
