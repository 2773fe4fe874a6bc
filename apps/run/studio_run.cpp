#include "apps/run/studio_run.hpp"

#include <algorithm>
#include <deque>
#include <filesystem>
#include <mutex>
#include <new>
#include <utility>
#include <vector>

#include "apps/control/clock_commands.hpp"
#include "apps/run/metrics.hpp"
#include "robot/robot_files.hpp"
#include "runtime/run/run_log.hpp"

namespace tandem::apps {
namespace {

using studio::Event;

constexpr std::size_t kMostRequests = 256;  // that wait to be shown
constexpr std::size_t kLongestRequest = 200;

Event::Level level_of(const runtime::FaultReport& fault) {
  return fault.category == hal::StopCategory::kWarn ? Event::Level::kWarn : Event::Level::kError;
}

/// Reads at once, and needs no more than its name.
bool only_reads(const ControlRegistry& commands, const std::string& name) {
  const CommandRow* row = command_row(name);
  return row != nullptr && commands.effect(name) == ControlEffect::kReads &&
         !row->more.takes_long && std::ranges::none_of(row->keys, [](const ControlKey& key) {
           return key.sent && key.required;
         });
}

}  // namespace

ControlRegistry::Gate studio_gate(const studio::Rights& rights) {
  return [rights](const std::string& command, ControlEffect effect, const Json&) -> Status {
    if (!is_guarded(effect)) return {};
    if (!rights.token) {
      return fail(command + ": who has not the run's token may only look, and stop",
                  "open the address with its token");
    }
    const bool moves = (command.starts_with("joint.") || command.starts_with("site.")) &&
                       command != "joint.halt";  // what brakes is everybody's, as a stop is
    if (effect == ControlEffect::kChanges && moves && !rights.control) {
      return fail(command + ": it moves joints, and control of them is not taken",
                  "take control first");
    }
    return {};
  };
}

/// What has happened since it was last asked: words of controllers, faults, requests.
class StudioRun::Happenings {
 public:
  explicit Happenings(runtime::RobotCycle& cycle) : cycle_(cycle) {}

  /// Any thread: a command was carried out, or refused. The newest are kept.
  void requested(const std::string& request, const Json& answer) {
    Event event{.time_s = 1e-9 * static_cast<double>(cycle_.progress().time_ns.load()),
                .cycle = cycle_.progress().cycles.load(),
                .who = {},
                .text = std::string(Event::kRequest) + request.substr(0, kLongestRequest)};
    if (!answer.value("ok", false)) {
      event.level = Event::Level::kWarn;
      event.text += ": " + answer.value("error", std::string("refused"));
    }
    const std::scoped_lock lock(mutex_);
    if (requests_.size() == kMostRequests) requests_.pop_front();
    requests_.push_back(std::move(event));
  }

  void take(std::vector<Event>& out) {
    look_at_texts(out);
    look_at_limits(out);
    look_at_faults(out);
    const std::scoped_lock lock(mutex_);
    for (Event& one : requests_) out.push_back(std::move(one));
    requests_.clear();
  }

 private:
  void look_at_texts(std::vector<Event>& out) {
    texts_.clear();
    (void)cycle_.services().texts().read(seen_, texts_);
    for (const hal::TextEvent& one : texts_) {
      out.push_back({1e-9 * static_cast<double>(one.time_ns), one.cycle,
                     one.level == hal::TextLevel::kWarn ? Event::Level::kWarn : Event::Level::kInfo,
                     std::string(one.controller()), one.words()});
    }
  }

  void look_at_limits(std::vector<Event>& out) {
    for (const auto& one : cycle_.limits_met(seen_limits_))
      out.push_back(
          {one.time_s, one.cycle, Event::Level::kInfo, one.joint, "limited: " + one.text});
  }

  void look_at_faults(std::vector<Event>& out) {
    const runtime::FaultLog& log = cycle_.fault_log();
    const std::size_t size = log.size(), latched = log.latched();
    if (size == latched_.size() && latched == latched_count_) return;
    const std::vector<runtime::FaultReport> faults = cycle_.faults();
    // Where time went back, those that came after it are not there, and others may come.
    latched_.resize(std::min(latched_.size(), faults.size()));
    for (std::size_t i = 0; i < latched_.size(); ++i) {
      if (latched_[i].cycle != faults[i].cycle) latched_.resize(i);
    }
    for (std::size_t i = 0; i < faults.size(); ++i) {
      const runtime::FaultReport& fault = faults[i];
      const std::string& who = fault.joint;
      if (i >= latched_.size()) {
        latched_.push_back({fault.cycle, true});
        out.push_back({fault.time_s, fault.cycle, level_of(fault), who, "fault: " + fault.text});
      }
      const bool was = std::exchange(latched_[i].latched, fault.latched);
      if (was && !fault.latched) {
        out.push_back({fault.cleared_s, cycle_.progress().cycles.load(), Event::Level::kInfo, who,
                       "cleared: " + fault.text});
      }
    }
    latched_count_ = latched;
  }

  runtime::RobotCycle& cycle_;
  std::uint64_t seen_ = 0, seen_limits_ = 0;
  std::vector<hal::TextEvent> texts_;
  /// A fault as it was shown.
  struct Shown {
    std::uint64_t cycle;
    bool latched;
  };
  std::vector<Shown> latched_;
  std::size_t latched_count_ = 0;
  std::mutex mutex_;
  std::deque<Event> requests_;
};

hal::RobotConfig on_its_ground(hal::RobotConfig robot, const sim::PlantChanges* plant) {
  if (plant != nullptr) robot.contact = plant->robot.contact;
  return robot;
}

StudioRun::~StudioRun() { finish("", ""); }

Result<StudioRun::Parts> StudioRun::make(const StudioOptions& options) const {
  const WiredComposition& c = *composition_;
  const runtime::Experiment& e = c.experiment;
  const hal::StateImage state(e.robot.shape());
  const hal::CommandImage command(e.robot.shape());
  const std::string session = studio::draw_hex(4);
  auto foxglove = FoxgloveRun::open(c, node_, session);
  if (!foxglove) return std::unexpected(foxglove.error());
  auto studio = studio::Studio::open(
      {.address = options.address,
       .port = options.port,
       .page = options.page,
       .origins = options.origins},
      {.robot = c.sim == nullptr ? e.robot : on_its_ground(e.robot, e.plant.get()),
       .urdf = robot::text_in(e.files, e.robot.model.urdf),
       .urdf_file = e.robot.model.urdf,
       .version = TANDEM_VERSION,
       .experiment = std::filesystem::path(e.file).filename().string(),
       .run = session,
       .simulated = c.backend->pace() == hal::Pace::kSimulatedClock,
       .period_ns = e.loop.period_ns},
      {.state = &state,
       .command = &command,
       .truth = runtime::truth_of(c),
       .estimate = c.estimator == nullptr ? nullptr : &c.estimator->image()});
  if (!studio) return std::unexpected(studio.error());
  return Parts{.foxglove = std::move(*foxglove), .studio = std::move(*studio), .turns = nullptr};
}

Result<std::string> StudioRun::open(const StudioOptions& options) {
  const std::scoped_lock lock(mutex_);
  if (open_.studio != nullptr) return open_.studio->address();
  if (over_) return fail("the run is over", "its log is there: tandem report LOG");
  try {
    auto parts = make(options);
    if (!parts) return std::unexpected(parts.error());
    if (cycle_ != nullptr) begin(*parts);
    open_ = std::move(*parts);
  } catch (const std::bad_alloc&) {
    return fail("there is no memory for a studio, which takes 150 MB",
                "raise the limit of memory (ulimit -v, -l), or end other programs");
  }
  tap_.attach(open_.studio->tap());
  return open_.studio->address();
}

void StudioRun::start(runtime::RobotCycle& cycle, ControlRegistry& commands,
                      hal::ParallelSource* parallel, const log::Recorder* recorder) {
  cycle_ = &cycle;
  recorder_ = recorder;
  commands_ = &commands;
  parallel_ = parallel;
  happenings_ = std::make_shared<Happenings>(cycle);
  commands.tell([happenings = happenings_](const std::string& request, const Json& answer) {
    happenings->requested(request, answer);
  });
  commands.add("studio.open", [this](const Json& request) { return asked_to_open(request); });
  if (open_.studio != nullptr) begin(open_);
}

/// Who may ask for it gets the token.
Result<Json> StudioRun::asked_to_open(const Json& request) {
  StudioOptions options;
  if (request.contains("port")) options.port = request["port"].get<std::uint16_t>();
  options.address = request.value("address", options.address);
  options.page = request.value("page", options.page);
  options.origins = request.value("origins", options.origins);
  const bool was_open = is_open();
  const Result<std::string> address = open(options);
  if (!address) return std::unexpected(address.error());
  Json answer{{"address", *address}, {"opened", !was_open}};
  const rt::ClockState clock = cycle_->inbox().clock().state();
  if (clock.pacing == rt::Pacing::kSimulated && clock.rate == 0.0) {
    answer["note"] = "simulated time runs as fast as it can: tandem clock rate 1 for real time";
  }
  return answer;
}

bool StudioRun::is_open() {
  const std::scoped_lock lock(mutex_);
  return open_.studio != nullptr;
}

void StudioRun::begin(Parts& parts) {
  studio::Studio* const studio = parts.studio.get();
  FoxgloveRun* const foxglove = parts.foxglove.get();
  foxglove->start(*cycle_, parallel_, [studio] { return studio->lost(); });
  parts.turns = std::make_unique<ControlTurns>(*commands_, [studio] { studio->answered(); });
  ControlTurns* const turns = parts.turns.get();
  ControlRegistry& commands = *commands_;
  runtime::RobotCycle& cycle = *cycle_;
  runtime::RunServices& services = cycle.services();
  studio::Feed feed{
      .loads = [&services] { return services.loads(); },
      .signals =
          [&services] {
            std::vector<studio::Feed::Signals> all;
            for (const runtime::ControllerSignals& one : services.signals()) {
              all.emplace_back(one.controller, one.block);
            }
            return all;
          },
      .marks =
          [&services] {
            std::vector<studio::Feed::Marks> all;
            for (const runtime::ControllerMarks& one : services.marks()) {
              all.emplace_back(one.controller, one.block);
            }
            return all;
          },
      .events = [happenings = happenings_](std::vector<Event>& out) { happenings->take(out); },
      .time_stands =
          [&cycle, &tap = studio->tap()] {
            const bool stands = time_stands(cycle);
            // It was opened meanwhile: the robot is shown as it stands.
            if (stands && tap.taken() == 0) (void)cycle.show_last_cycle(tap);
            return stands;
          },
      .cycle = [foxglove](const studio::Tap::Cycle& one) { foxglove->take(one); },
      .parallel = parallel_,
      .served = {{.path = "/metrics", .get = [this, &cycle](std::string_view) {
                    return studio::Response{
                        .type = kMetricsType,
                        .body = metrics_text({*composition_, cycle, recorder_})};
                  }}}};
  studio::Asker asker{
      .ask =
          [turns](studio::Question question) {
            (void)turns->ask(
                question.asker, static_cast<std::uint64_t>(question.number),
                std::move(question.text),
                {.known = question.rights.token, .gate = studio_gate(question.rights)});
          },
      .drop =
          [turns](std::uint64_t who) {
            turns->drop([who](std::uint64_t one) { return one == who; });
          },
      .take =
          [turns] {
            std::vector<studio::Answer> answers;
            std::vector<ControlTurns::Answer> taken = turns->take();
            for (ControlTurns::Answer& one : taken) {
              answers.push_back(
                  {one.asker, static_cast<std::int64_t>(one.number), std::move(one.text)});
            }
            return answers;
          },
      .is_urgent =
          [&commands](const std::string& question) {
            return commands.turn_of(question) == ControlTurn::kUrgent;
          },
      .only_reads = [&commands](const std::string& name) { return only_reads(commands, name); }};
  studio->start(std::move(feed), std::move(asker), &foxglove->protocol());
}

void StudioRun::finish(const std::string& how, const std::string& log) {
  const std::scoped_lock lock(mutex_);
  over_ = true;
  if (open_.turns != nullptr) open_.turns->end();
  if (open_.studio != nullptr) open_.studio->finish(how, log);
}

}  // namespace tandem::apps
