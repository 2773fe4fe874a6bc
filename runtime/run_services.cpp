// Asking the loop for controllers.
#include "runtime/run_services.hpp"

#include <algorithm>
#include <thread>
#include <utility>

#include "base/file_name.hpp"
#include "base/nearest.hpp"
#include "base/quoting.hpp"
#include "runtime/cycle_log.hpp"
#include "runtime/refusal_text.hpp"

namespace tandem::runtime {
namespace {

using SteadyClock = std::chrono::steady_clock;

constexpr std::chrono::microseconds kLook{200};  // between two looks for an answer

}  // namespace

RunServices::RunServices(const hal::RobotConfig& robot, ControllerHost& host, Inbox& inbox,
                         const Progress& progress, const hal::ParameterImage& gains, CycleLog& log,
                         bool linked)
    : robot_(&robot),
      host_(&host),
      inbox_(&inbox),
      progress_(&progress),
      log_(&log),
      looks_(robot.joints.size()),
      sensor_looks_(robot.sensors.size()),
      gain_looks_(gains.all().size()),
      linked_(linked) {
  show(gains);
  for (const auto& one : host.owned()) {
    if (one != nullptr) log.open(*one);
  }
}

// Asking the loop.

Status RunServices::check_phase() const {
  const RunPhase phase = progress_->phase.load();
  if (phase != RunPhase::kShutDown && phase != RunPhase::kDone) return {};
  return fail(std::string("the run is in the phase ") + to_string(phase), "start another run");
}

/// Takes the answers that are there: frees what the loop has let go, keeps what is awaited.
void RunServices::collect() {
  while (const auto answer = inbox_->take_answer()) {
    const auto request = asked_.extract(answer->number);
    if (!request.empty()) free_what_left(request.mapped(), *answer);
    const auto waiter = awaited_.find(answer->number);
    if (waiter != awaited_.end()) waiter->second = *answer;
  }
}

void RunServices::free_what_left(const CycleRequest& request, const CycleAnswer& answer) {
  using Kind = CycleRequest::Kind;
  const bool done = answer.reason == RejectReason::kNone;
  forget_changes(request);
  if (request.kind == Kind::kInsert && done) host_->note_code(*host_->owned()[request.slot]);
  if ((request.kind == Kind::kInsert && !done) || (request.kind == Kind::kRemove && done)) {
    host_->owned()[request.slot].reset();
    ++loads_;
  } else if (request.kind == Kind::kRemove) {
    host_->owned()[request.slot]->leaves = false;
  } else if (request.kind == Kind::kReplace) {
    std::unique_ptr<HostedController>& place = host_->owned()[request.slot];
    std::unique_ptr<HostedController> next = std::move(place->next);
    if (!done) return;
    for (const auto& port : next->inputs) {
      for (const auto& before : place->inputs) {  // whoever feeds it feeds this one
        if (port->is_same_as(*before)) before->pass_to(port);
      }
    }
    place = std::move(next);
    host_->note_code(*place);
    ++loads_;
  }
}

/// Undoes what was noted of a request that the loop will not see.
void RunServices::take_back(const CycleRequest& request) {
  using Kind = CycleRequest::Kind;
  forget_changes(request);
  if (request.kind == Kind::kRemove) host_->owned()[request.slot]->leaves = false;
  if (request.kind == Kind::kReplace) host_->owned()[request.slot]->next.reset();
}

Result<RequestResult> RunServices::ask(Lock& lock, CycleRequest request, Patience patience) {
  if (asks_ahead_) {  // what was loaded stays: others may name it
    take_back(request);
    return RequestResult{.done = true};
  }
  request.number = ++number_;
  if (!inbox_->ask(request)) {
    take_back(request);
    if (request.kind == CycleRequest::Kind::kInsert) host_->owned()[request.slot].reset();
    return fail(
        "the loop has not come to the last " + std::to_string(Inbox::kCapacity) + " requests",
        "is it paused? Let it go on");
  }
  asked_[request.number] = request;
  const auto deadline = SteadyClock::now() + patience;
  auto& answer = awaited_[request.number];
  bool stands = false;  // nothing comes any more, until somebody lets time go on
  while (!answer && !stands && SteadyClock::now() < deadline) {
    lock.unlock();
    if (asker_.attends()) {
      asker_.attend();
    } else {
      std::this_thread::sleep_for(kLook);
    }
    stands = asker_.attends() || inbox_->clock().state().standing ||
             progress_->phase.load() == RunPhase::kDone;
    lock.lock();
    collect();
  }
  // What is looked at next shows it.
  while (answer && looks().front().cycle < answer->cycle && SteadyClock::now() < deadline) {
    std::this_thread::sleep_for(kLook);
  }
  const std::optional<CycleAnswer> found = answer;
  awaited_.erase(request.number);
  if (!found) {
    inbox_->leave(request.number);
    if (Status phase = check_phase(); !phase) return std::unexpected(phase.error());
    return RequestResult{.stands = inbox_->clock().state().standing};
  }
  if (found->reason != RejectReason::kNone) return std::unexpected(refusal(*found));
  return RequestResult{.done = true, .cycle = found->cycle, .phase = progress_->phase.load()};
}

std::string RunServices::controller_name(std::int32_t slot) const {
  if (slot < 0 || static_cast<std::size_t>(slot) >= kMostControllers) return {};
  const auto& one = host_->owned()[static_cast<std::size_t>(slot)];
  return one == nullptr ? std::string() : one->name;
}

Error RunServices::refusal(const CycleAnswer& answer) const {
  const std::string joint =
      answer.joint < 0 ? "" : robot_->joints[static_cast<std::size_t>(answer.joint)].name;
  RefusalText words = refusal_text(answer.reason, progress_->phase.load(), joint,
                                   controller_name(answer.one), controller_name(answer.other));
  return {
      .message = std::move(words.message), .hint = std::move(words.hint), .file = {}, .key = joint};
}

// Controllers.

std::vector<ControllerStatus> RunServices::controllers() {
  const Lock lock(mutex_);
  collect();
  const ControllerHost::Shown shown = host_->shown();
  std::vector<ControllerStatus> all;
  for (std::size_t slot = 0; slot < kMostControllers; ++slot) {
    const auto& one = host_->owned()[slot];
    if (one == nullptr || one->leaves) continue;
    const bool active = (shown.active & only(slot)) != 0;
    all.push_back({.name = one->name,
                   .plugin = one->plugin,
                   .active = active,
                   .shadow = (host_->shadows().shown() & only(slot)) != 0,
                   .done = active && (shown.done & only(slot)) != 0,
                   .of_experiment = one->of_experiment,
                   .call_ns = one->times->calls.percentiles(),
                   .overruns = one->times->overruns.load(),
                   .claims = one->claims});
  }
  return all;
}

std::vector<ControllerSignals> RunServices::signals() {
  const Lock lock(mutex_);
  collect();
  const ControllerSet active = host_->shown().active | host_->shadows().shown();
  std::vector<ControllerSignals> all;
  for (std::size_t slot = 0; slot < kMostControllers; ++slot) {
    const auto& one = host_->owned()[slot];
    if (one == nullptr || one->leaves || one->io->signals.numbers() == 0) continue;
    all.push_back({one->name, (active & only(slot)) != 0, {one->io, &one->io->signals}});
  }
  return all;
}

std::vector<ControllerMarks> RunServices::marks() {
  const Lock lock(mutex_);
  collect();
  std::vector<ControllerMarks> all;
  for (const auto& one : host_->owned()) {
    if (one == nullptr || one->leaves || one->io->marks.declared().empty()) continue;
    all.push_back({one->name, {one->io, &one->io->marks}});
  }
  return all;
}

Result<std::size_t> RunServices::slot_of(const std::string& name) const {
  std::vector<std::string> names;
  for (std::size_t slot = 0; slot < kMostControllers; ++slot) {
    const auto& one = host_->owned()[slot];
    if (one == nullptr || one->leaves) continue;
    if (one->name == name) return slot;
    names.push_back(one->name);
  }
  return fail_at(name, "no controller '" + name + "' is loaded", suggest(name, names));
}

/// Who is active once the loop has done all that it was asked for; asked ahead, nobody knows.
ControllerSet RunServices::planned() const {
  if (asks_ahead_) return 0;
  ControllerSet active = host_->shown().active;
  for (const auto& [number, request] : asked_) {
    if (request.kind != CycleRequest::Kind::kSwitch) continue;
    active = (active & ~request.stop) | request.start;
  }
  return active;
}

/// The errors of a document in one, as many as somebody reads. `library`: the controller's;
/// `missing`, `unknown`: what to do about a key.
Status RunServices::errors_of(const TomlDocument& document, const std::string& library,
                              const char* missing, const char* unknown) {
  constexpr std::size_t kMost = 20;
  const Diagnostics& errors = document.diagnostics();
  std::string all;
  for (std::size_t i = 0; i < std::min(kMost, errors.size()); ++i) {
    Error one = errors[i];
    if (one.hint.starts_with("add it to the table")) one.hint = missing;
    if (one.message == "unknown key" && *unknown != '\0')
      one.hint += (one.hint.empty() ? "" : " ") + std::string(unknown);
    all += (all.empty() ? "" : "; ") + one.to_string();
  }
  if (errors.size() > kMost) all += "; and " + std::to_string(errors.size() - kMost) + " more";
  if (all.empty()) return {};
  return fail(all, is_bundled_controller(library)
                       ? "the parameters of each controller are in docs/controllers.md"
                       : "");
}

Status RunServices::check_name(const std::string& name) {
  if (const std::string problem = topic_name_problem(name); !problem.empty()) {
    return fail_at("name", "the controller's name '" + shown(name) + "' " + problem,
                   topic_name_hint(name));
  }
  if (slot_of(name)) {
    return fail_at(name, "a controller of this name is loaded already",
                   "give this one another name");
  }
  return {};
}

Result<RequestResult> RunServices::load(const std::string& name, LoadedController plugin,
                                        const TomlDocument& parameters, Patience patience) {
  const std::string library = plugin.path();
  auto made = host_->configure(name, std::move(plugin), parameters.root());
  if (Status read = errors_of(parameters, library); !read) return std::unexpected(read.error());
  if (!made) return std::unexpected(made.error());
  (*made)->document = parameters;
  return load(std::move(*made), patience);
}

Result<RequestResult> RunServices::load(const std::string& name,
                                        std::shared_ptr<Controller> controller,
                                        const TomlDocument& parameters, Patience patience) {
  auto made = host_->configure(name, std::move(controller), parameters.root());
  if (Status read = errors_of(parameters, ""); !read) return std::unexpected(read.error());
  if (!made) return std::unexpected(made.error());
  (*made)->document = parameters;
  return load(std::move(*made), patience);
}

void RunServices::tell_loaded(HostedController& controller) {
  for (ParameterRow& row : controller.io->parameters.rows()) {
    if (std::isnan(row.now())) continue;
    controller.loaded.push_back(
        {.parameter = &row, .value = row.now(), .name = controller.name + "." + row.name});
  }
}

Result<RequestResult> RunServices::load(std::unique_ptr<HostedController> controller,
                                        Patience patience) {
  Lock lock(mutex_);
  collect();
  if (Status phase = check_phase(); !phase) return std::unexpected(phase.error());
  if (Status fresh = check_name(controller->name); !fresh) return std::unexpected(fresh.error());
  ControllerHost::Owned& owned = host_->owned();
  const auto free = std::ranges::find_if(owned, [](const auto& one) { return one == nullptr; });
  if (free == owned.end()) {
    return fail_at(
        controller->name,
        std::to_string(kMostControllers) + " controllers are loaded, the most there can be",
        "unload one first");
  }
  controller->of_experiment = false;
  host_->enter(*controller);
  log_->open(*controller);
  tell_loaded(*controller);
  CycleRequest request{.kind = CycleRequest::Kind::kInsert,
                       .slot = static_cast<std::uint32_t>(free - owned.begin()),
                       .controller = controller.get()};
  *free = std::move(controller);
  ++loads_;
  return ask(lock, request, patience);
}

Result<RequestResult> RunServices::unload(const std::string& name, Patience patience) {
  Lock lock(mutex_);
  collect();
  if (Status phase = check_phase(); !phase) return std::unexpected(phase.error());
  const Result<std::size_t> slot = slot_of(name);
  if (!slot) return std::unexpected(slot.error());
  if ((planned() & only(*slot)) != 0) {
    return fail_at(name, "the controller is active",
                   "stop it first: tandem controller stop " + name);
  }
  if (host_->owned()[*slot]->next != nullptr) {
    return fail_at(name, "the controller is being reloaded", "ask again when that is done");
  }
  host_->owned()[*slot]->leaves = true;
  return ask(lock, {.kind = CycleRequest::Kind::kRemove, .slot = static_cast<std::uint32_t>(*slot)},
             patience);
}

Result<ControllerSet> RunServices::set_of(const std::vector<std::string>& names) const {
  ControllerSet set = 0;
  for (const std::string& name : names) {
    const Result<std::size_t> slot = slot_of(name);
    if (!slot) return std::unexpected(slot.error());
    if ((set & only(*slot)) != 0) return fail_at(name, "is named twice", "name each once");
    set |= only(*slot);
  }
  return set;
}

std::string RunServices::names_of(ControllerSet set) const {
  std::string names;
  for (std::size_t slot = 0; slot < kMostControllers; ++slot) {
    if ((set & only(slot)) == 0) continue;
    names += (names.empty() ? "" : ",") + controller_name(static_cast<std::int32_t>(slot));
  }
  return names;
}

Status RunServices::check_switch(ControllerSet stop, ControllerSet start) const {
  const ControllerSet active = planned();
  ControllerHost::Table table{};
  for (std::size_t slot = 0; slot < kMostControllers; ++slot) {
    table[slot] = host_->owned()[slot].get();
    const std::string name = table[slot] == nullptr ? "" : table[slot]->name;
    const ControllerSet bit = only(slot);
    if ((stop & start & bit) != 0) {
      return fail_at(name, "is to be stopped and started", "name it once");
    }
    if (!asks_ahead_ && (stop & ~active & bit) != 0) {
      return fail_at(name, "is not active", "tandem controller list shows which are");
    }
    if ((start & active & bit) != 0) {
      const RunPhase phase = progress_->phase.load();
      if (phase == RunPhase::kFaulted || phase == RunPhase::kResetting) {
        return fail_at(name, "a fault is latched: this controller was active, and stands still",
                       "tandem fault reset, then tandem controller start");
      }
      return fail_at(name, "is active already", "tandem controller list shows which are");
    }
  }
  const auto conflict = ControllerHost::find_conflict(table, (active & ~stop) | start);
  if (!conflict) return {};
  Error error = refusal({.reason = RejectReason::kConflict,
                         .joint = static_cast<std::int32_t>(conflict->joint),
                         .one = static_cast<std::int32_t>(conflict->one),
                         .other = static_cast<std::int32_t>(conflict->other)});
  // Everybody who stands in the way, unless two are in each other's that are both to start.
  ControllerSet leave = stop;
  while (const auto next = ControllerHost::find_conflict(table, (active & ~leave) | start)) {
    const ControllerSet active_one = (only(next->one) | only(next->other)) & ~start;
    if (active_one == 0) return std::unexpected(error);
    leave |= active_one;
  }
  error.hint = "tandem controller switch --stop " + names_of(leave) + " --start " + names_of(start);
  return std::unexpected(error);
}

Result<RequestResult> RunServices::switch_controllers(const std::vector<std::string>& stop,
                                                      const std::vector<std::string>& start,
                                                      Patience patience) {
  return ask_to_switch(stop, start, {.kind = CycleRequest::Kind::kSwitch}, patience);
}

Result<RequestResult> RunServices::go_on(Patience patience) {
  Lock lock(mutex_);
  collect();
  if (Status phase = check_phase(); !phase) return std::unexpected(phase.error());
  return ask(lock, {.kind = CycleRequest::Kind::kGoOn}, patience);
}

}  // namespace tandem::runtime
