#include "python/running.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <functional>
#include <string_view>
#include <utility>

#include "base/bundled_files.hpp"
#include "base/counted.hpp"
#include "base/crash_signals.hpp"
#include "hal/config/capabilities.hpp"
#include "runtime/run/run_log.hpp"

namespace tandem::python {
namespace {

using runtime::RunPhase;

constexpr std::string_view kMark = "tandem-run";  // of a snapshot

struct ModeName {
  const char* name;
  hal::ControlMode mode;
  hal::InteractionMode interaction;
};
constexpr ModeName kModes[] = {
    {"position", hal::ControlMode::kPosition, hal::InteractionMode::kStiff},
    {"velocity", hal::ControlMode::kVelocity, hal::InteractionMode::kStiff},
    {"torque", hal::ControlMode::kTorque, hal::InteractionMode::kStiff},
    {"current", hal::ControlMode::kCurrent, hal::InteractionMode::kStiff},
    {"open_loop", hal::ControlMode::kOpenLoop, hal::InteractionMode::kStiff},
    {"compliant", hal::ControlMode::kPosition, hal::InteractionMode::kCompliant},
};

const ModeName& mode_of(const std::string& name) {
  std::vector<std::string> known;
  for (const ModeName& one : kModes) {
    if (name == one.name) return one;
    known.emplace_back(one.name);
  }
  raise_unknown("mode", name, known);
}

bool is_backend(std::string_view hal) { return hal == "can" || hal == "ethercat" || hal == "dds"; }

[[noreturn]] void refuse_place(const std::string& file) {
  raise(Error{.message = "Python steps a robot that is simulated in its own process; a robot on a "
                         "wire, or of another process, does not wait for it",
              .hint = "pass hal=\"sim\", or write the controller in C++ and use `tandem run`",
              .file = file,
              .key = "hal.backend"});
}

/// In a folder, or as the file that the name's end says.
Result<std::unique_ptr<log::Recorder>> open_log_at(const runtime::Composition& c,
                                                   const std::filesystem::path& place) {
  std::error_code ignored;
  if (place.extension() != ".mcap" || std::filesystem::is_directory(place, ignored)) {
    return runtime::open_log(c, place);
  }
  const std::filesystem::path folder = place.parent_path();
  return runtime::open_log(c, folder.empty() ? "." : folder, place.filename());
}

}  // namespace

Running::Turn::Turn(Running& of, bool hosts) : of_(&of) {
  if (of.busy_.exchange(true)) {
    raise(fail("another thread is in this run", "let one thread at a time step it").error());
  }
  if (hosts || of.has_plugins_) guard_.emplace(*of.scene_, hosts);
}

void Running::check_going(const char* what) const {
  check_open();
  if (!over()) return;
  raise(fail(std::string(what) + ": the run is over",
             "open another one, or restore() a snapshot of it")
            .error());
}

Running::Running(const std::string& given, runtime::Overrides overrides, const std::string& all,
                 const Control& some, const std::string& log) {
  if (is_backend(overrides.hal)) refuse_place({});
  const std::string file = take(named_file(given, Bundled::kExperiment));
  using Last = std::function<void(const char*)>;
  scene_ = std::make_unique<runtime::CrashScene>(
      log.empty() ? Last() : [this](const char* what) { end_log_by(what); });
  const runtime::CrashGuard guard(*scene_, true);
  overrides.change = [&all](runtime::Experiment& e) {
    e.loop.start_paused = false;  // there is nobody to let it go on
    if (!all.empty()) e.controllers.clear();
  };
  auto composed = [&] {
    const Away away;
    const std::scoped_lock alone(reading());
    return runtime::composed(file, overrides);
  }();
  c_ = take(std::move(composed));
  if (c_->experiment.hal.backend != runtime::BackendKind::kSim) refuse_place(c_->experiment.file);
  if (!all.empty() || !some.empty()) add_lead(all, some);
  if (!log.empty()) {
    recorder_ = take(open_log_at(*c_, log));
    log_path_ = recorder_->path();
    plugins_at_start_ = c_->controllers->code().size();
    process_ = ::getpid();
  }
  const Away away;
  run_ = std::make_unique<runtime::Run>(*c_, overrides,
                                        runtime::RunParts{.recorder = recorder_.get()});
  scene_->look_at(run());
  look_for_plugins();
  run().cycle().services().asker().attend_by([this] {
    if (begun_) run().cycle().attend();
  });
  carry_out_events();
  begin();
  while (begun_ && (run().cycle().phase() == RunPhase::kBringUp ||
                    run().cycle().phase() == RunPhase::kSettling)) {
    advance();
  }
  first_ = run().state().cycle()[0];
}

Running::~Running() {
  if (recorder_ != nullptr && ::getpid() != process_) {
    (void)recorder_.release();  // its thread, and its file, are the parent's
    (void)scene_.release();     // so is this one's
    return;
  }
  try {
    end_log();
  } catch (py::error_already_set& lost) {
    lost.discard_as_unraisable("tandem.Run");
  }
}

void Running::end_log() {
  if (recorder_ == nullptr || std::exchange(closed_, true)) return;
  const log::RecordingResult done = [this] {
    const py::gil_scoped_release free;
    if (run_ != nullptr && run_->parallel() != nullptr) (void)run_->parallel()->finish();
    return recorder_->close(runtime::loaded_later(*c_->controllers, plugins_at_start_));
  }();
  log_path_ = done.path;
  if (done.error.empty()) return;
  raise(Error{.message = "the log lost " + counted(done.failed, "message") + ": " + done.error,
              .hint = {},
              .file = done.path,
              .key = {}});
}

/// Before the process ends by a crash: another thread than the one that crashed, without Python.
void Running::end_log_by(const char* crash) {
  if (recorder_ == nullptr || std::exchange(closed_, true)) return;
  log::StringMap result = runtime::loaded_later(*c_->controllers, plugins_at_start_);
  result.emplace_back("ended", crash);
  const log::RecordingResult done = recorder_->close(result);
  for (const char* part : {"the log up to then is ", done.path.c_str(), "\n"}) write_text(part);
}

void Running::look_for_plugins() { has_plugins_ = !c_->controllers->code().empty(); }

void Running::check_open() const {
  if (recorder_ != nullptr && ::getpid() != process_) {
    raise(fail("this run and its log are those of another process",
               "open the run in the process that steps it")
              .error());
  }
  if (closed_) raise(fail("the run is closed", "open another one").error());
}

bool Running::step(std::int64_t cycles) {
  const Turn turn(*this);
  if (cycles < 1) raise_value("step", "cycles: " + std::to_string(cycles) + ", wanted 1 or more");
  check_going("step");
  check_command();
  fresh_ = false;
  if (cycles == 1 && run().experiment().loop.rate == 0.0) return advance();
  while (cycles > 0 && !over()) {
    const std::int64_t some = std::min<std::int64_t>(cycles, per_turn());
    cycles -= some;
    {
      const Away away;
      for (std::int64_t i = 0; i < some && !Away::is_recalled() && advance(); ++i) {
      }
    }
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  }
  return !over();
}

void Running::finish() {
  const Turn turn(*this);
  if (closed_) return;
  check_open();
  run().cycle().inbox().end_run();
  while (begun_) {
    {
      const Away away;
      for (std::int64_t i = 0; i < per_turn() && begun_; ++i) (void)advance();
    }
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  }
  end_log();
}

void Running::close() {
  const Turn turn(*this);
  if (!closed_) check_open();
  end_log();
  closed_ = true;
}

bool Running::next() {
  if (over() || waits_too_long()) return false;
  if (std::exchange(fresh_, false)) return true;
  return step(1);
}

py::bytes Running::save() {
  const Turn turn(*this);
  const std::vector<std::byte> bytes = take(run().cycle().save());
  const std::string_view rest(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const std::size_t hash = std::hash<std::string_view>{}(rest);
  std::string all(kMark);
  all.push_back(begun_ ? '1' : '0');
  all.append(reinterpret_cast<const char*>(&hash), sizeof hash);
  all.append(rest);
  return py::bytes(all);
}

void Running::restore(const py::bytes& snapshot) {
  const Turn turn(*this);
  check_open();
  if (recorder_ != nullptr) {
    raise(fail("a run with a log goes forward only: the log would tell of one run and show two",
               "restore the snapshot in a run that is opened without `log`")
              .error());
  }
  const std::string_view all(snapshot);
  constexpr std::size_t kHead = kMark.size() + 1 + sizeof(std::size_t);
  std::size_t hash = 0;
  if (all.size() > kHead) std::memcpy(&hash, all.data() + kMark.size() + 1, sizeof hash);
  if (all.size() <= kHead || !all.starts_with(kMark) ||
      std::hash<std::string_view>{}(all.substr(kHead)) != hash) {
    raise_value("snapshot", "is none of Run.save(), or damaged");
  }
  const std::vector<std::byte> before = take(run().cycle().save());
  const auto* bytes = reinterpret_cast<const std::byte*>(all.data() + kHead);
  if (const Status done = run().cycle().restore({bytes, all.size() - kHead}); !done) {
    (void)run().cycle().restore(before);  // another experiment's may have been read in part
    raise(done.error());
  }
  begun_ = all[kMark.size()] == '1';
  fresh_ = !over();
  led_ = run().cycle().phase() == RunPhase::kRunning;
  texts_before_ = run().cycle().services().texts().count();
  if (!led_ && lead_ != nullptr) lead_->disobeyed();
}

void Running::stop(int category) {
  if (!busy_) check_going("stop");  // also from another thread than the one that steps it
  if (category < 0 || category > 2)
    raise_value("stop", "category: " + std::to_string(category) + ", wanted 0, 1 or 2");
  run().cycle().inbox().emergency_stop(static_cast<hal::StopCategory>(category));
}

void Running::reset_faults() {
  if (!busy_) check_going("reset_faults");
  run().cycle().inbox().reset_faults();
}

void Running::start() {
  const Turn turn(*this);
  check_going("start");
  const RunPhase phase = run().cycle().phase();
  if (phase != RunPhase::kHeld) {
    raise(fail(std::string("start: the run is in the phase '") + hal::to_string(phase) +
                   "', wanted 'held'",
               phase == RunPhase::kRunning
                   ? "its controllers lead already"
                   : "reset_faults(), then step() until the phase is 'held'")
              .error());
  }
  run().cycle().attend();  // it is judged by the state that was read
  take(run().cycle().services().go_on());
  take_lead();
}

void Running::add_lead(const std::string& all, const Control& some) {
  const hal::Robot robot = hal::robot_of(c_->experiment.robot);
  std::vector<ControllerSetup::Claim> claims;
  for (const hal::DrivenJoint& joint : robot.joints) joints_.push_back(joint.name);
  for (const auto& [name, mode] : some) {
    if (robot.joint_index(name) < 0) raise_unknown("joint", name, joints_);
  }
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    const auto found = some.find(joints_[j]);
    if (all.empty() && found == some.end()) continue;
    const ModeName& mode = mode_of(found == some.end() ? all : found->second);
    claims.push_back({j, mode.mode, mode.interaction, false});
  }
  lead_ = std::make_shared<Lead>(std::move(claims), robot.shape());
  const auto nothing = TomlDocument::parse("", c_->experiment.file);
  Status added = c_->controllers->add("python", lead_, nothing->root(), true);
  if (added) return;
  if (!added.error().hint.empty()) {  // it is the experiment's controller that is in the way
    added.error().hint =
        "leave these joints out of its parameters (`joints = [...]`), or out of `control`; "
        "control=\"MODE\" leads every joint, without the experiment's controllers";
  }
  raise(added.error());
}

void Running::begin() {
  begun_ = run().cycle().begin();
  take_lead();
}

/// Where Python begins to lead, its command does; where it does not lead any more, nobody obeys it.
void Running::take_lead() {
  const bool leads = begun_ && run().cycle().phase() == RunPhase::kRunning;
  if (leads != led_ && lead_ != nullptr) {
    leads ? lead_->follow(run().state(), run().command()) : lead_->disobeyed();
  }
  led_ = leads;
}

/// The rest of this cycle, and the next one's begin.
bool Running::advance() {
  begun_ = run().cycle().finish();
  if (begun_) begin();
  return !over();
}

/// Cycles between two looks at what Ctrl-C asks for.
std::int64_t Running::per_turn() const { return run().experiment().loop.rate > 0.0 ? 1 : 100; }

/// In fault, or held, no time runs out where the run waits for an operator: a loop over it ends.
bool Running::waits_too_long() const {
  const RunPhase phase = run().cycle().phase();
  if (phase == RunPhase::kRunning || run().experiment().endless()) return false;
  return run().state().cycle()[0] >= first_ + run().experiment().cycles();
}

void Running::check_command() const {
  if (lead_ == nullptr) return;
  if (!led_ && lead_->take_unheard()) {
    const std::string text = std::string("the run is in the phase '") +
                             hal::to_string(run().cycle().phase()) +
                             "': its command is not obeyed (reset_faults(), and start() once it is "
                             "'held', give it back)";
    if (PyErr_WarnEx(PyExc_RuntimeWarning, text.c_str(), 1) != 0) throw py::error_already_set();
  }
  const auto bad = lead_->find_bad();
  if (!bad) return;
  raise_value("command." + std::string(bad->field),
              "of " + joints_[bad->joint] + " is not finite in cycle " +
                  std::to_string(run().state().cycle()[0]) + ": nothing was commanded");
}

}  // namespace tandem::python
