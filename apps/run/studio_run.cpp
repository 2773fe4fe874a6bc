#include "apps/run/studio_run.hpp"

#include <algorithm>
#include <filesystem>
#include <mutex>
#include <utility>
#include <vector>

#include "apps/control/clock_commands.hpp"
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
    const bool moves = command.starts_with("joint.") || command.starts_with("site.");
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

  /// Any thread: a command was carried out, or refused.
  void requested(const std::string& request, const Json& answer) {
    Event event{.time_s = 1e-9 * static_cast<double>(cycle_.progress().time_ns.load()),
                .cycle = cycle_.progress().cycles.load(),
                .who = {},
                .text = "request " + request.substr(0, kLongestRequest)};
    if (!answer.value("ok", false)) {
      event.level = Event::Level::kWarn;
      event.text += ": " + answer.value("error", std::string("refused"));
    }
    const std::scoped_lock lock(mutex_);
    if (requests_.size() < kMostRequests) requests_.push_back(std::move(event));
  }

  void take(std::vector<Event>& out) {
    look_at_texts(out);
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

  void look_at_faults(std::vector<Event>& out) {
    const runtime::FaultLog& log = cycle_.fault_log();
    const std::size_t size = log.size(), latched = log.latched();
    if (size == latched_.size() && latched == latched_count_) return;
    const std::vector<runtime::FaultReport> faults = cycle_.faults();
    for (std::size_t i = 0; i < faults.size(); ++i) {
      const runtime::FaultReport& fault = faults[i];
      const std::string& who = fault.joint;
      if (i >= latched_.size()) {
        latched_.push_back(true);
        out.push_back({fault.time_s, fault.cycle, level_of(fault), who, "fault: " + fault.text});
      }
      if (!fault.latched && latched_[i]) {
        latched_[i] = false;
        out.push_back({fault.cleared_s, cycle_.progress().cycles.load(), Event::Level::kInfo, who,
                       "cleared: " + fault.text});
      }
    }
    latched_count_ = latched;
  }

  runtime::RobotCycle& cycle_;
  std::uint64_t seen_ = 0;
  std::vector<hal::TextEvent> texts_;
  std::vector<bool> latched_;  // by fault, as it was shown
  std::size_t latched_count_ = 0;
  std::mutex mutex_;
  std::vector<Event> requests_;
};

StudioRun::StudioRun(std::unique_ptr<studio::Studio> studio) : studio_(std::move(studio)) {}

StudioRun::~StudioRun() { finish("", ""); }

Result<std::unique_ptr<StudioRun>> StudioRun::open(const WiredComposition& c,
                                                   const StudioOptions& options) {
  if (!options.wanted) return nullptr;
  const runtime::Experiment& e = c.experiment;
  const hal::StateImage state(e.robot.shape());
  const hal::CommandImage command(e.robot.shape());
  auto opened =
      studio::Studio::open({.address = options.address, .port = options.port, .page = options.page},
                           {.robot = e.robot,
                            .urdf = robot::text_in(e.files, e.robot.model.urdf),
                            .urdf_file = e.robot.model.urdf,
                            .version = TANDEM_VERSION,
                            .experiment = std::filesystem::path(e.file).filename().string(),
                            .run = studio::draw_hex(4),
                            .simulated = c.backend->pace() == hal::Pace::kSimulatedClock,
                            .period_ns = e.loop.period_ns},
                           {.state = state,
                            .command = command,
                            .truth = runtime::truth_of(c),
                            .estimate = c.estimator == nullptr ? nullptr : &c.estimator->image()});
  if (!opened) return std::unexpected(opened.error());
  return std::unique_ptr<StudioRun>(new StudioRun(std::move(*opened)));
}

void StudioRun::start(runtime::RobotCycle& cycle, ControlRegistry& commands) {
  happenings_ = std::make_shared<Happenings>(cycle);
  commands.tell([happenings = happenings_](const std::string& request, const Json& answer) {
    happenings->requested(request, answer);
  });
  turns_ =
      std::make_unique<ControlTurns>(commands, [studio = studio_.get()] { studio->answered(); });
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
      .time_stands = [&cycle] { return time_stands(cycle); }};
  studio::Asker asker{
      .ask =
          [turns = turns_.get()](studio::Question question) {
            (void)turns->ask(
                question.asker, static_cast<std::uint64_t>(question.number),
                std::move(question.text),
                {.known = question.rights.token, .gate = studio_gate(question.rights)});
          },
      .drop =
          [turns = turns_.get()](std::uint64_t who) {
            turns->drop([who](std::uint64_t one) { return one == who; });
          },
      .take =
          [turns = turns_.get()] {
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
  studio_->start(std::move(feed), std::move(asker));
}

void StudioRun::finish(const std::string& how, const std::string& log) {
  if (turns_ != nullptr) turns_->end();
  studio_->finish(how, log);
}

}  // namespace tandem::apps
