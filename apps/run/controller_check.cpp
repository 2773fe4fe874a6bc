// `tandem controller check`: a controller on a simulated robot, under the traps of the gate and
// with a run that is rewound.
#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <thread>

#include "apps/robot/kernel_build.hpp"
#include "apps/run/commands.hpp"
#include "apps/run/connection.hpp"
#include "apps/run/cycle_guard.hpp"
#include "apps/run/gate.hpp"
#include "apps/run/loop_crash.hpp"
#include "apps/text/console.hpp"
#include "apps/text/figures.hpp"
#include "base/bundled_files.hpp"
#include "base/open_file.hpp"
#include "base/quoting.hpp"
#include "base/temporary_folder.hpp"
#include "rt/stop_signal.hpp"
#include "runtime/run/run.hpp"

namespace tandem::apps {
namespace {

namespace fs = std::filesystem;

constexpr char kDefaultRobot[] = "double_pendulum";
constexpr double kBeforeSave_s = 0.2;  // under the controllers

/// An experiment that is made for the check, and gone after it.
class MadeExperiment {
 public:
  static Result<MadeExperiment> make(const ControllerCheckOptions& o) {
    const auto robot = named_file(o.robot.empty() ? kDefaultRobot : o.robot, Bundled::kRobot);
    if (!robot) return std::unexpected(robot.error());
    std::string text = fmt::format(
        "robot = {}\nduration_s = 1.0\n[[controller]]\nplugin = {}\n[controller.parameters]\n",
        quoted_text(fs::absolute(*robot).string()), quoted_text(o.plugin));
    for (const std::string& line : o.set) text += line + "\n";
    MadeExperiment made(o.set);
    if (const Status there = made.folder_.made(); !there) return std::unexpected(there.error());
    auto file = open_output(made.path(), 0600);
    if (!file) return std::unexpected(file.error());
    if (::write(file->get(), text.data(), text.size()) != static_cast<ssize_t>(text.size()))
      return fail("cannot write " + made.path(), "is the disk full?");
    return made;
  }
  [[nodiscard]] std::string path() const { return folder_.below("check.toml"); }

  /// Errors of this file, which nobody has seen, as those of the command line that it was made of.
  [[nodiscard]] Diagnostics as_given(Diagnostics errors) const {
    constexpr std::string_view kTable = "controller[0].parameters.";
    for (Error& error : errors) {
      if (error.file != path()) continue;
      const auto line = static_cast<std::size_t>(error.line);
      const bool is_set = line >= kFirstSet && line < kFirstSet + set_.size();
      error.file = is_set ? "--set " + shell_word(set_[line - kFirstSet]) : "";
      error.line = 0;
      if (error.key.starts_with(kTable)) error.key.erase(0, kTable.size());
      if (error.hint.starts_with("add it to the table"))
        error.hint = "give it: --set '" + error.key + " = …'";
    }
    return errors;
  }

 private:
  static constexpr std::size_t kFirstSet = 6;  // line
  explicit MadeExperiment(std::vector<std::string> set) : set_(std::move(set)) {}
  TemporaryFolder folder_{"check"};
  std::vector<std::string> set_;
};

/// What the loop's thread finds out.
struct Proof {
  std::string archive{}, rewound{};  ///< what is wrong; empty: nothing
  std::string error{};               ///< why it could not be proved
  std::string crashed{};
};

/// Runs the controllers, rewinds them, and runs them again.
class RewoundRun {
 public:
  RewoundRun(runtime::Run& run, Gate& gate, double seconds)
      : run_(run),
        gate_(gate),
        period_s_(static_cast<double>(run.experiment().loop.period_ns) * 1e-9),
        cycles_(static_cast<std::size_t>(std::max(1.0, seconds / period_s_))) {}

  Proof prove() {
    const auto before = static_cast<std::uint64_t>(kBeforeSave_s / period_s_);
    while (run_.cycle().running_cycles() < before && run_.step()) {
    }
    if (run_.cycle().running_cycles() == 0) return {.error = "its controllers never ran"};
    const auto saved = run_.cycle().save();
    if (!saved) return {.error = saved.error().to_string()};
    const Parts parts = parts_of_controllers();
    const Commands once = commands();
    if (const Status back = run_.cycle().restore(*saved); !back) {
      return {.archive =
                  "a snapshot that was just taken cannot be restored: an archive() does not "
                  "read what it wrote"};
    }
    Proof proof;
    if (const Parts again = parts_of_controllers(); again != parts) {
      for (std::size_t i = 0; i < parts.size(); ++i)
        if (again[i] != parts[i]) proof.archive = difference(parts[i], again[i]);
    } else if (const auto second = run_.cycle().save(); !second || *second != *saved) {
      proof.archive = "save, restore and save give other bytes";
    }
    proof.rewound = compare(once, commands());
    return proof;
  }

 private:
  struct Part {
    std::string controller;
    std::vector<std::byte> bytes;
    bool operator==(const Part&) const = default;
  };
  using Parts = std::vector<Part>;
  using Commands = std::vector<std::vector<std::byte>>;

  /// What each controller's own archive() writes: once to see how much, and once as in a cycle.
  Parts parts_of_controllers() {
    Parts parts;
    for (const auto& one : run_.controllers().owned()) {
      if (one == nullptr) continue;
      Archive first;
      one->controller->archive(first);
      Archive ar(first.bytes().size());
      gate_.enter(one->id, runtime::ControllerFunction::kArchive);
      one->controller->archive(ar);
      gate_.leave();
      parts.push_back({one->name, {ar.bytes().begin(), ar.bytes().end()}});
    }
    return parts;
  }
  static std::string difference(const Part& saved, const Part& again) {
    if (saved.bytes.size() != again.bytes.size()) {
      return fmt::format("'{}' writes {} bytes, and after they were read {}", saved.controller,
                         saved.bytes.size(), again.bytes.size());
    }
    const auto at = std::ranges::mismatch(saved.bytes, again.bytes).in1 - saved.bytes.begin();
    return fmt::format("'{}' writes other bytes after it read its own, from byte {} of {} on",
                       saved.controller, at, saved.bytes.size());
  }

  Commands commands() {
    Commands all;
    for (std::size_t i = 0; i < cycles_ && run_.step(); ++i) {
      const auto bytes = run_.command().bytes();
      all.emplace_back(bytes.begin(), bytes.end());
    }
    return all;
  }

  /// The first command that is another one in the run that was rewound.
  [[nodiscard]] std::string compare(const Commands& once, const Commands& again) const {
    if (once.size() != again.size()) {
      return fmt::format("the run that was rewound lasts {} cycles instead of {}", again.size(),
                         once.size());
    }
    for (std::size_t i = 0; i < once.size(); ++i) {
      if (once[i] != again[i]) return place(i, once[i], again[i]);
    }
    return {};
  }
  [[nodiscard]] std::string place(std::size_t cycle, const std::vector<std::byte>& one,
                                  const std::vector<std::byte>& other) const {
    const auto at = static_cast<std::size_t>(std::ranges::mismatch(one, other).in1 - one.begin());
    const auto& joints = run_.experiment().robot.joints;
    for (const hal::Field& field : run_.command().layout().fields()) {
      const std::size_t size = hal::size_of(field.type);
      if (at < field.offset || at >= field.offset + size * field.count) continue;
      const std::size_t joint = (at - field.offset) / size;
      if (field.count != joints.size()) continue;
      const std::int32_t owner = run_.controllers().owner_id(joint);
      return fmt::format(
          "{} of {} differs {} after the rewind: {} depends on more than its archive() names",
          field.name, joints[joint].name,
          cycle == 0 ? "in the first cycle" : fmt::format("{} cycles", cycle + 1),
          owner < 0 ? std::string("a controller")
                    : "'" + run_.controllers().name(static_cast<std::size_t>(owner)) + "'");
    }
    return fmt::format("the command differs {} cycles after the rewind", cycle + 1);
  }

  runtime::Run& run_;
  Gate& gate_;
  double period_s_;
  std::size_t cycles_;
};

/// The loop on a thread of its own, as in a run: a crash or a loop without end has a name and a
/// place.
Result<Proof> prove_on_thread(const WiredComposition& c, runtime::Run& run, Gate& gate,
                              double seconds) {
  ServiceNotice nobody({}, {});
  auto guard = CycleGuard::open(c, run.cycle(), nobody);
  if (!guard) return std::unexpected(guard.error());
  Proof proof;
  std::atomic<bool> done{false};
  std::thread thread([&] {
    stand_still_on_crash(run.cycle().heartbeat());
    proof = RewoundRun(run, gate, seconds).prove();
    done.store(true);
  });
  while (!done.load() && !(*guard)->gave_up())
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  if (done.load()) {
    thread.join();
    return proof;
  }
  thread.detach();
  const std::string fault = (*guard)->fault();
  (*guard)->log_is_closed();  // there is none
  (void)guard->release();     // it still watches, and so what follows cannot last for ever
  return Proof{.crashed = fault};
}

void add_proof(const Proof& proof, std::vector<GateResult>& results) {
  const auto row = [&](const char* rule, const std::string& wrong) {
    results.push_back({.rule = rule,
                       .kept = known(proof.error.empty(), wrong.empty()),
                       .note = proof.error.empty() ? wrong : proof.error,
                       .breaches = {}});
  };
  row("save, restore, save", proof.archive);
  row("a rewound run", proof.rewound);
}

/// A plugin that the experiment calls by its name is the one in this folder.
void look_first_in(const std::string& folder) {
  const char* others = std::getenv("TANDEM_CONTROLLERS");
  const std::string all = others == nullptr ? folder : folder + ":" + others;
  ::setenv("TANDEM_CONTROLLERS", all.c_str(), 1);
}

/// Whether one of the experiment's controllers is this library.
bool has_plugin(const runtime::ControllerHost& host, const std::string& plugin) {
  return std::ranges::any_of(host.code(), [&](const runtime::ControllerCode& one) {
    std::error_code ignored;
    return fs::equivalent(one.path, plugin, ignored);
  });
}

}  // namespace

void figures(Figures& f, const ControllerCheckResult& result) {
  f("plugin", "its path", result.plugin);
  f("kept", "every rule that could be watched, and no fault was latched", result.kept);
  f("faults", "that are latched; empty when the run ended well", result.faults);
  f("rules", result.rules);
}

Exit controller_check_command(const ControllerCheckOptions& given) {
  ControllerCheckOptions options = given;
  if (const Status writable = check_writable(options.json); !writable)
    return refuse(writable.error());
  if (const Status again = Gate::enter_process(); !again) return refuse(again.error());
  std::error_code error;
  options.plugin = fs::absolute(options.plugin, error).string();
  if (!fs::is_regular_file(options.plugin, error)) {
    return refuse({.message = "there is no such library",
                   .hint = "name the .so that the build made",
                   .file = options.plugin,
                   .key = {}});
  }
  std::optional<MadeExperiment> made;
  std::string experiment = options.experiment;
  if (experiment.empty()) {
    auto one = MadeExperiment::make(options);
    if (!one) return refuse(one.error());
    made.emplace(std::move(*one));
    experiment = made->path();
  }
  look_first_in(fs::path(options.plugin).parent_path().string());

  const auto gate = Gate::open();
  runtime::Overrides overrides;
  overrides.hal = "sim";
  overrides.rate = 0.0;
  overrides.duration_s = std::max(3600.0, 10.0 * options.seconds);
  overrides.dds = false;
  overrides.on_fault = "end";
  auto c =
      runtime::composed<WiredComposition>(experiment, overrides, {.build = builder(options.quiet)});
  if (!c) return refuse(made ? made->as_given(c.error()) : c.error());
  if (!has_plugin(*(*c)->controllers, options.plugin)) {
    return refuse({.message = "none of its controllers is " + options.plugin,
                   .hint = "let a [[controller]] name it, or its file's name without .so",
                   .file = experiment,
                   .key = "controller"});
  }
  print_warnings(std::exchange((*c)->warnings, {}));
  if (const Diagnostics errors = connect(**c, ""); !errors.empty()) return refuse(errors);
  (*c)->controllers->watch_calls(gate.get());
  runtime::Run run(**c, overrides, {});
  auto proof = prove_on_thread(**c, run, *gate, options.seconds);
  if (!proof) return refuse(proof.error());
  if (!proof->crashed.empty()) {
    await_crash_place();
    remember_error(loop_error(proof->crashed));
    write_failure(options.json);
    say(Said::kFault, proof->crashed);
    std::fflush(nullptr);
    ::_exit(static_cast<int>(Exit::kFault));  // the loop's thread is still there
  }
  ControllerCheckResult result{.plugin = options.plugin};
  result.rules = gate->results(*(*c)->controllers->names());
  add_proof(*proof, result.rules);
  for (const runtime::FaultReport& fault : run.cycle().faults()) {
    if (fault.latched)
      result.faults.push_back(fmt::format("{:.3f} s: {}{}{}", fault.time_s, fault.joint,
                                          fault.joint.empty() ? "" : ": ", fault.text));
  }
  result.kept = kept(result.rules) && result.faults.empty();
  if (!options.quiet) print_gate(result.rules, human_output(options.json));
  for (const std::string& fault : result.faults) say(Said::kFault, shown(fault, 2'000));
  if (const Status written = write_json(options.json, figures_json(result)); !written)
    return refuse(written.error());
  return result.kept ? Exit::kDone : Exit::kFault;
}

}  // namespace tandem::apps
