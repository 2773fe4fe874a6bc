#include "python/running.hpp"

#include <algorithm>
#include <cstring>
#include <functional>
#include <string_view>
#include <utility>

#include "hal/config/capabilities.hpp"
#include "hal/sim/scenario.hpp"

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

Diagnostics refuse_others(runtime::Composition& c) {
  if (c.experiment.hal.backend == runtime::BackendKind::kSim) return {};
  return {{.message = "Python steps a robot that is simulated in its own process; a robot on a "
                      "wire, or of another process, does not wait for it",
           .hint = "pass hal=\"sim\", or write the controller in C++ and use `tandem run`",
           .file = c.experiment.file,
           .key = "hal.backend"}};
}

}  // namespace

Running::Turn::Turn(Running& of) : of_(&of) {
  if (of.busy_.exchange(true)) {
    raise(fail("another thread is in this run", "let one thread at a time step it").error());
  }
}

Running::Running(const std::string& file, runtime::Overrides overrides, const std::string& all,
                 const Control& some) {
  overrides.change = [&all](runtime::Experiment& e) {
    e.loop.start_paused = false;  // there is nobody to let it go on
    if (!all.empty()) e.controllers.clear();
  };
  auto opened = [&] {
    const Away away;
    const std::scoped_lock alone(reading());
    return runtime::Run::open(file, overrides, {}, refuse_others);
  }();
  run_ = take(std::move(opened));
  if (!all.empty() || !some.empty()) add_lead(all, some);
  const Away away;
  begin();
  while (begun_ && (run().cycle().phase() == RunPhase::kBringUp ||
                    run().cycle().phase() == RunPhase::kSettling)) {
    advance();
  }
}

bool Running::step(std::int64_t cycles) {
  const Turn turn(*this);
  if (cycles < 1) raise_value("step", "cycles: " + std::to_string(cycles) + ", wanted 1 or more");
  if (over()) {
    raise(fail("the run is over", "open another one, or restore() a snapshot of it").error());
  }
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
  run().cycle().inbox().end_run();
  while (begun_) {
    {
      const Away away;
      for (std::int64_t i = 0; i < per_turn() && begun_; ++i) (void)advance();
    }
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  }
}

bool Running::next() {
  if (over()) return false;
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
}

std::size_t Running::inject(const std::string& scenario) {
  const Turn turn(*this);
  const runtime::Experiment& e = run().experiment();
  auto faults = sim::parse_scenario(scenario, "inject", e.robot, e.loop.period_ns);
  if (!faults) {
    for (Error& error : faults.error()) error.file.clear();  // there is none
    raise(faults.error());
  }
  for (const sim::ScenarioFault& fault : *faults) {
    const Code code = run().robot().robot().inject(fault);
    if (code == Code::kOk) continue;
    raise(fail(code == Code::kOutOfRange
                   ? "board_duplicate has to be known when the robot is made"
                   : "the most faults that there can be were injected already",
               code == Code::kOutOfRange ? "pass it as `scenario`" : "open the run again")
              .error());
  }
  return faults->size();
}

void Running::add_lead(const std::string& all, const Control& some) {
  const hal::Robot robot = hal::robot_of(run().experiment().robot);
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
  const auto nothing = TomlDocument::parse("", run().experiment().file);
  take(run().controllers().add("python", lead_, nothing->root(), true));
}

void Running::begin() {
  begun_ = run().cycle().begin();
  const bool leads = begun_ && run().cycle().phase() == RunPhase::kRunning;
  if (leads && !led_ && lead_ != nullptr) lead_->follow(run().state(), run().command());
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

void Running::check_command() const {
  if (lead_ == nullptr) return;
  const auto bad = lead_->find_bad();
  if (!bad) return;
  raise_value("command." + std::string(bad->field),
              "of " + joints_[bad->joint] + " is not finite in cycle " +
                  std::to_string(run().state().cycle()[0]) + ": nothing was commanded");
}

py::list faults_of(const Running& running) {
  py::list out;
  for (const runtime::FaultReport& one : running.run().cycle().faults()) {
    py::dict fault;
    fault["time_s"] = one.time_s;
    fault["cycle"] = one.cycle;
    fault["joint"] = one.joint;
    fault["board"] = one.board;
    fault["text"] = one.text;
    fault["category"] = static_cast<int>(one.category);
    fault["latched"] = one.latched;
    out.append(std::move(fault));
  }
  return out;
}

py::dict result_of(const Running& running) {
  const runtime::RunStatistics& figures = running.run().cycle().statistics();
  const double period_s = static_cast<double>(running.run().experiment().loop.period_ns) * 1e-9;
  py::dict joints, out;
  const auto tracking = figures.tracking();
  const auto limited = figures.limited_cycles();
  for (std::size_t j = 0; j < tracking.size(); ++j) {
    py::dict joint;
    const bool any = tracking[j].cycles > 0;
    joint["rms_tracking_error_rad"] = any ? py::cast(tracking[j].rms_rad) : py::none();
    joint["max_tracking_error_rad"] = any ? py::cast(tracking[j].max_rad) : py::none();
    joint["limited_cycles"] = limited[j];
    joints[running.run().experiment().robot.joints[j].name.c_str()] = std::move(joint);
  }
  out["cycles"] = running.run().cycle().loop().cycles;
  out["running_cycles"] = running.run().cycle().running_cycles();
  out["simulated_s"] = static_cast<double>(running.run().cycle().running_cycles()) * period_s;
  out["phase"] = hal::to_string(running.run().cycle().phase());
  out["faults"] = faults_of(running);
  out["joints"] = std::move(joints);
  if (const auto work = figures.work(period_s)) {
    out["work"] = py::dict(py::arg("done_J") = work->done_J, py::arg("taken_J") = work->taken_J,
                           py::arg("max_power_W") = work->max_power_W);
  }
  if (const auto base = figures.base()) {
    out["base"] = py::dict(py::arg("min_height_m") = base->min_height_m,
                           py::arg("max_height_m") = base->max_height_m,
                           py::arg("max_tilt_rad") = base->max_tilt_rad);
  }
  return out;
}

}  // namespace tandem::python
