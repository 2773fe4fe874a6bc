#include "apps/run/start_room.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "apps/control/fault_table.hpp"
#include "apps/text/console.hpp"
#include "rt/stop_signal.hpp"

namespace tandem::apps {
namespace {

constexpr std::chrono::milliseconds kLook{50};  // between two looks for a signal
constexpr char kWaits[] = "waits for its start: tandem controller start";
constexpr char kStopped[] =
    "waits, and an emergency stop is latched: tandem fault reset, then tandem controller start";
constexpr char kWaiting[] = "waiting", kLeft[] = "bring-up";
constexpr char kResetFirst[] = "tandem fault reset, then tandem controller start";

/// No controller can retreat yet.
hal::StopCategory retreatless(hal::StopCategory category) {
  return std::min(category, hal::StopCategory::kCategory1);
}

}  // namespace

Result<std::unique_ptr<StartRoom>> StartRoom::open(const std::string& socket, ServiceNotice& notice,
                                                   Before before, hal::StopCategory declared) {
  std::unique_ptr<StartRoom> room(new StartRoom(notice, declared));
  room->stop_ = before.stop;
  room->add_commands();
  auto opened = serve(room->commands_, {.path = socket,
                                        .kind = "run",
                                        .wanted = true,
                                        .needed = true,
                                        .listener = std::move(before.listener)});
  if (!opened) return std::unexpected(opened.error());
  room->socket_ = std::move(*opened);
  rt::install_emergency_signal();
  room->tell(before.why);
  return room;
}

/// To journal and service manager.
void StartRoom::tell(const std::string& why) {
  const std::string line =
      std::string(stop_ ? kStopped : kWaits) + (why.empty() ? "" : "; before: " + why);
  fmt::print(stderr, "{}\n", shown(line, 2'000));
  notice_.waits(line);
}

void StartRoom::latch(hal::FaultCause cause, hal::StopCategory category) {
  if (stop_) return;
  stop_ = runtime::FaultReport{
      .text = hal::row_of(cause).words, .cause = cause, .category = retreatless(category)};
  tell("");
}

void StartRoom::look_for_stop() {
  const rt::EmergencyStop stop = rt::take_emergency_stop();
  if (stop == rt::EmergencyStop::kNone) return;
  latch(stop == rt::EmergencyStop::kOnRequest ? hal::FaultCause::kByRequest
                                              : hal::FaultCause::kBySignal,
        declared_);
}

std::unexpected<Error> StartRoom::not_started() {
  const std::scoped_lock lock(mutex_);
  return stop_ ? fail("the run waits, and an emergency stop is latched: no drive was touched yet",
                      kResetFirst)
               : fail("the run waits for its start, and has touched no drive yet",
                      "tandem controller start");
}

Json StartRoom::status() {
  const std::scoped_lock lock(mutex_);
  return {{"phase", left_ ? kLeft : kWaiting},
          {"paused", false},
          {"cycles", 0},
          {"running_cycles", 0},
          {"total_cycles", 0},
          {"overruns", 0},
          {"dropped", 0},
          {"latched", stop_ ? 1 : 0},
          {"resets", 0},
          {"failed_resets", 0}};
}

void StartRoom::add_commands() {
  commands_.add("status", [this](const Json&) -> Result<Json> { return status(); });
  commands_.add("fault.show", [this](const Json&) -> Result<Json> {
    Json answer = status();
    const std::scoped_lock lock(mutex_);
    answer["faults"] =
        figures_json(stop_ ? std::vector{*stop_} : std::vector<runtime::FaultReport>{});
    answer["lost"] = 0;
    return answer;
  });
  commands_.add("fault.reset", [this](const Json&) -> Result<Json> {
    bool cleared = false;
    {
      const std::scoped_lock lock(mutex_);
      cleared = std::exchange(stop_, std::nullopt).has_value();
      if (cleared) tell("");
    }
    Json answer = status();
    answer["cleared"] = cleared;
    return answer;
  });
  // Confirmed at once: no drive is enabled, and from here on none will be. A run that goes on looks
  // for it before it enables one.
  commands_.add("estop", [this](const Json& request) -> Result<Json> {
    const std::scoped_lock lock(mutex_);
    hal::StopCategory category = declared_;  // what the run carries out, however it is asked
    if (left_) {
      rt::request_emergency_stop();
    } else {
      if (request.contains("category"))
        category = static_cast<hal::StopCategory>(request["category"].get<std::int64_t>());
      latch(hal::FaultCause::kByRequest, category);
    }
    return Json{{"category", hal::to_string(retreatless(category))},
                {"paused", false},
                {"confirmed", true},
                {"waiting", !left_}};
  });
  commands_.add("run.stop", [this](const Json&) -> Result<Json> {
    const std::scoped_lock lock(mutex_);
    ends_ = true;
    news_.notify_all();
    return Json::object();
  });
  commands_.add("controller.start", [this](const Json& request) { return start(request); });
  for (const CommandRow& row : command_rows()) {
    if (commands_.effect(row.name) || !row.more.asks.empty()) continue;
    commands_.add(row, [this](const Json&) -> Result<Json> { return not_started(); });
  }
}

/// On a thread of the socket, which waits for main.
Result<Json> StartRoom::start(const Json& request) {
  if (request.contains("name")) {
    return fail("the run waits for its start: no controller is there by itself yet",
                "tandem controller start, without a name");
  }
  std::unique_lock lock(mutex_);
  if (stop_) return fail("an emergency stop is latched: nothing starts", kResetFirst);
  if (ends_) return fail("the run ends");
  if (left_) return fail("the run has been started, and goes on to its robot");
  wanted_ = true;
  const std::uint64_t before = answers_;
  news_.notify_all();
  news_.wait(lock, [&] { return answers_ != before || ends_; });
  if (answers_ == before) return fail("the run ends");
  if (refused_) return std::unexpected(*refused_);
  return Json{
      {"done", false},
      {"active", Json::array()},
      {"note", "the run goes on to its robot: drives are enabled, then the controllers start"}};
}

bool StartRoom::await() {
  std::unique_lock lock(mutex_);
  for (;;) {
    look_for_stop();
    if (rt::stop_requested()) ends_ = true;
    if (ends_) {
      news_.notify_all();
      return false;
    }
    if (wanted_) return true;
    news_.wait_for(lock, kLook);
  }
}

bool StartRoom::answer(std::optional<Error> refused) {
  {
    const std::scoped_lock lock(mutex_);
    look_for_stop();
    if (stop_ && !refused) {  // it came after the question, and wins
      refused = fail("an emergency stop is latched: nothing starts", kResetFirst).error();
    }
    refused_ = refused;
    wanted_ = false;
    left_ = !refused;
    ++answers_;
  }
  news_.notify_all();
  if (refused) tell(refused->to_string());
  return !refused;
}

}  // namespace tandem::apps
