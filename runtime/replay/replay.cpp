#include "runtime/replay/replay.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <utility>

#include "base/clock_ns.hpp"
#include "base/nearest.hpp"
#include "base/open_file.hpp"
#include "runtime/replay/recorded_robot.hpp"
#include "runtime/replay/replay_requests.hpp"
#include "runtime/robot_cycle.hpp"
#include "runtime/run/identity.hpp"
#include "runtime/run/run_log.hpp"

namespace tandem::runtime {
namespace {

Diagnostics refuse_log(const RecordedRun& run, std::string message, std::string hint) {
  return {{.message = std::move(message),
           .hint = std::move(hint),
           .file = run.file().path(),
           .key = {}}};
}

std::string seconds_text(std::int64_t time_ns) {
  return fmt::format("{:.3f} s", 1e-9 * static_cast<double>(time_ns));
}

/// "NAME SHA256 PATH", a controller as the log's information has it.
struct CodeLine {
  std::string name, sha256;
};
std::vector<CodeLine> code_of(const log::RunInfo& info) {
  std::vector<CodeLine> all;
  for (const std::string& line : info.controllers) {
    const std::size_t name = line.find(' '), sha = line.find(' ', name + 1);
    if (name != std::string::npos && sha != std::string::npos)
      all.push_back({line.substr(0, name), line.substr(name + 1, sha - name - 1)});
  }
  return all;
}

/// Why no cycle of it can be played.
Diagnostics unfit(const RecordedRun& run) {
  if (run.info().hal.starts_with("dds")) {
    return refuse_log(run,
                      "its robot was in another process, and the command that was in force there "
                      "when the controllers started is in no log",
                      "replay a log of that process, or of a run on the robot itself");
  }
  for (const CodeLine& one : code_of(run.info())) {
    if (one.sha256 != "-" || one.name == kOwnerController) continue;
    return refuse_log(run, "the controller '" + one.name + "' was part of the program that ran it",
                      "only controllers in libraries can be loaded once more");
  }
  return {};
}

/// What the run went by, as far as no file says it.
Overrides overrides_of(const RecordedRun& run, const ReplayOptions& options) {
  const log::RunInfo& info = run.info();
  Overrides overrides;
  overrides.from_log = true;
  overrides.hal = info.hal.substr(0, info.hal.find(' '));
  overrides.lockstep = info.hal.ends_with(" lockstep");
  overrides.seed = info.seed;
  overrides.rate = 0.0;
  overrides.kernel_variant = info.kernel_variant;
  overrides.dds = std::ranges::any_of(
      code_of(info), [](const CodeLine& one) { return one.name == kOwnerController; });
  if (const std::string text = run.option("duration_s"); !text.empty())
    overrides.duration_s = std::strtod(text.c_str(), nullptr);
  if (const std::string text = run.option("delay_cycles"); !text.empty())
    overrides.delay_cycles = static_cast<std::uint32_t>(std::strtoul(text.c_str(), nullptr, 10));
  overrides.on_fault = run.option("on_fault");
  overrides.change = [&options](Experiment& e) {
    for (ControllerSpec& spec : e.controllers) {
      const auto other = options.plugins.find(spec.name);
      if (other != options.plugins.end())
        spec.plugin = std::filesystem::absolute(other->second).string();
    }
  };
  return overrides;
}

/// --plugin of a controller that the run did not have.
Diagnostics check_plugins(const RecordedRun& run, const ReplayOptions& options) {
  std::vector<std::string> known;
  for (const CodeLine& one : code_of(run.info())) known.push_back(one.name);
  for (const auto& [name, file] : options.plugins) {
    if (std::ranges::find(known, name) == known.end())
      return refuse_log(run, "the run had no controller '" + name + "'", suggest(name, known));
  }
  return {};
}

/// What is not as recorded, and may be why something differs.
Diagnostics notes_of(const RecordedRun& run, const Composition& c, const ReplayOptions& options) {
  Diagnostics notes;
  const log::RunInfo& info = run.info();
  std::string gone;
  const bool was_set = std::ranges::any_of(
      info.options, [](const std::string& one) { return one.starts_with("--set "); });
  for (const auto& [path, text] : info.configuration) {
    const auto now = read_file(path, {}, kMostUrdfBytes);
    if (!now) gone += (gone.empty() ? "" : ", ") + path;
    if (!now || *now == text) continue;
    notes.push_back({.message = (was_set ? "is otherwise here, by --set or a change since"
                                         : "has changed since") +
                                std::string(": the log's text of it is replayed"),
                     .hint = "record the run once more to have the file as it is now",
                     .file = path,
                     .key = {}});
  }
  if (!gone.empty()) {
    notes.push_back(
        {.message = "the log's texts are replayed, for these files are not here: " + gone,
         .hint = {},
         .file = {},
         .key = {}});
  }
  if (!info.kernel_sha256.empty() && info.kernel_sha256 != c.kernels.sha256()) {
    notes.push_back({.message = "the robot's kernels are another build than the recorded ones",
                     .hint = "last bits may differ by it",
                     .file = {},
                     .key = {}});
  }
  const std::vector<CodeLine> then = code_of(info);
  for (const ControllerCode& now : c.controllers->code()) {
    const auto was = std::ranges::find(then, now.name, &CodeLine::name);
    if (was == then.end() || was->sha256 == now.sha256 || options.plugins.contains(now.name))
      continue;
    notes.push_back(
        {.message =
             "the controller '" + now.name + "' is another build than the one that was recorded",
         .hint = "what differs may be that; to try a changed one: --plugin " + now.name + "=FILE",
         .file = now.path,
         .key = {}});
  }
  for (std::string& remark : run.file().remarks())
    notes.push_back(
        {.message = std::move(remark), .hint = {}, .file = run.file().path(), .key = {}});
  if (const std::string cut = run.file().cut_remark(); !cut.empty())
    notes.push_back({.message = cut, .hint = {}, .file = run.file().path(), .key = {}});
  return notes;
}

void note_missing(const std::vector<std::string>& fields, const char* image, const char* follows,
                  ReplayResult& result) {
  for (const std::string& field : fields) {
    result.notes.push_back(
        {.message = fmt::format("the log has no {} of the {}: {}", field, image, follows),
         .hint = {},
         .file = {},
         .key = {}});
  }
}

/// One replay, from the first cycle on.
class Player {
 public:
  Player(const RecordedRun& run, Composition& c, const Overrides& overrides,
         const ReplayOptions& options, log::Recorder* recorder, ReplayResult& result)
      : options_(options),
        host_(*c.controllers),
        robot_(robot_of(run, c)),
        comparison_(run.command(), c.experiment.robot.shape(), run.info()),
        cycle_({.robot = c.experiment.robot,
                .backend = robot_,
                .controllers = *c.controllers,
                .clock = clock_,
                .recorder = recorder,
                .truth = robot_.truth(),
                .owner = {nullptr, c.owner.get(), c.owner_slot},
                .estimator = c.estimator.get()},
               config_of(c, overrides)),
        requests_(cycle_, *c.controllers, c.experiment.robot, run),
        result_(result) {
    note_missing(robot_.missing(), "state", "controllers see 0", result);
    note_missing(comparison_.missing(), "command", "it is not compared", result);
  }

  Status play(const RecordedRun& run, const Composition& c) {
    const auto guard = options_.guard ? options_.guard(cycle_, c) : nullptr;
    const std::int64_t begin_ns = clock_ns(CLOCK_MONOTONIC);
    const Status read = run.visit([this](const RecordedCycle& cycle) { return take(cycle); });
    result_.seconds = 1e-9 * static_cast<double>(clock_ns(CLOCK_MONOTONIC) - begin_ns);
    result_.compared = comparison_.cycles();
    result_.differ = comparison_.differ();
    result_.first = std::move(comparison_.first());
    result_.spreads = comparison_.spreads();
    return read;
  }

 private:
  static RecordedRobot robot_of(const RecordedRun& run, const Composition& c) {
    const bool real = run.info().hal != "sim" && !run.info().hal.ends_with(" lockstep");
    return RecordedRobot(c.experiment.robot,
                         real ? hal::Pace::kWallClock : hal::Pace::kSimulatedClock, run);
  }
  CycleConfig config_of(Composition& c, const Overrides& overrides) const {
    CycleConfig config = cycle_config(c, overrides, robot_.pace());
    config.loop.pacing = rt::Pacing::kSimulated;
    config.loop.rate = 0.0;
    config.loop.start_paused = false;
    return config;
  }

  /// @return false: no more
  bool take(const RecordedCycle& cycle) {
    if (options_.to_ns && cycle.time_ns > *options_.to_ns) return false;
    if (over_) {
      return end(cycle, "the replay has shut down, and the recorded run went on");
    }
    if (cycle.before > 0 && !cycle.was_late()) {
      return end(cycle, fmt::format("{} cycles before it are not in the log: they were dropped, or "
                                    "are damaged",
                                    cycle.before));
    }
    if (options_.goes_on && !options_.goes_on()) return end(cycle, "it was stopped");
    robot_.begin(cycle);
    if (const std::string why = requests_.ask(cycle); !why.empty()) return end(cycle, why);
    over_ = !cycle_.step();
    ++result_.cycles;
    result_.end_ns = cycle.time_ns;
    if (const std::string refused = requests_.check(); !refused.empty()) {
      result_.notes.push_back({.message = "at " + seconds_text(cycle.time_ns) +
                                          " something was asked that is refused now: " + refused,
                               .hint = {},
                               .file = {},
                               .key = {}});
    }
    if (!cycle.command.empty()) compare(cycle);
    return true;
  }

  void compare(const RecordedCycle& cycle) {
    const bool had = comparison_.first().has_value();
    const std::int32_t joint =
        comparison_.take(cycle_.last_view().command, cycle.command, cycle.time_ns);
    if (had || joint < 0) return;
    const std::int32_t owner = host_.owner_id(static_cast<std::size_t>(joint));
    if (owner >= 0) comparison_.first()->controller = host_.name(static_cast<std::size_t>(owner));
  }

  bool end(const RecordedCycle& cycle, const std::string& why) {
    result_.why_short = "at " + seconds_text(cycle.time_ns) + " " + why;
    return false;
  }

  const ReplayOptions& options_;
  ControllerHost& host_;
  rt::WallClock clock_;
  RecordedRobot robot_;
  CommandComparison comparison_;
  RobotCycle cycle_;
  ReplayRequests requests_;
  ReplayResult& result_;
  bool over_ = false;
};

}  // namespace

std::expected<ReplayResult, Diagnostics> replay(const std::string& log,
                                                const ReplayOptions& options) {
  const auto run = RecordedRun::open(log);
  if (!run) return std::unexpected(Diagnostics{run.error()});
  if (Diagnostics reasons = unfit(*run); !reasons.empty()) return std::unexpected(reasons);
  if (Diagnostics wrong = check_plugins(*run, options); !wrong.empty())
    return std::unexpected(wrong);
  const Overrides overrides = overrides_of(*run, options);
  const auto composition = [&] {
    const TextsInstead recorded(run->info().configuration);
    return composed(run->info().configuration.front().first, overrides, options.kernels);
  }();
  if (!composition) return std::unexpected(composition.error());
  Composition& c = **composition;
  if (c.predictor != nullptr && c.predictor->is_prepared()) {
    return std::unexpected(
        refuse_log(*run, "one of its controllers acts on predictions, whose answers are in no log",
                   "there is no replay of such a run; run its experiment once more"));
  }
  if (c.experiment.log.state_every != 1) {
    return std::unexpected(
        refuse_log(*run, fmt::format("it has every {}th state alone", c.experiment.log.state_every),
                   "record it once more without [log] state_every"));
  }
  ReplayResult result{.notes = notes_of(*run, c, options)};
  for (const auto& [name, file] : options.plugins) result.changed.push_back(name);
  std::unique_ptr<log::Recorder> recorder;
  if (!options.output.empty()) {
    const std::filesystem::path path(options.output);
    auto opened = open_log(c, path.has_parent_path() ? path.parent_path().string() : ".",
                           path.filename().string());
    if (!opened) return std::unexpected(Diagnostics{opened.error()});
    recorder = std::move(*opened);
  }
  {
    Player player(*run, c, overrides, options, recorder.get(), result);
    const Status read = player.play(*run, c);
    if (recorder != nullptr) {
      const log::RecordingResult closed = recorder->close({{"replay_of", log}});
      result.log = closed.path;
      if (!closed.error.empty())
        return std::unexpected(Diagnostics{fail(closed.error, "free some space").error()});
    }
    if (!read) return std::unexpected(Diagnostics{read.error()});
  }
  return result;
}

}  // namespace tandem::runtime
