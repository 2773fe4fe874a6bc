// A run that Python steps: it stands between the halves of a cycle, where the state has been read
// and the command is awaited.
// Layer: python.  Thread: one at a time per run, else an error; long steps leave the
// interpreter's lock to others.
#include <algorithm>
#include <atomic>
#include <cstring>
#include <functional>
#include <map>
#include <optional>
#include <string_view>

#include "hal/config/capabilities.hpp"
#include "hal/sim/scenario.hpp"
#include "python/arrays.hpp"
#include "python/lead.hpp"
#include "runtime/run/run.hpp"

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

/// Which joints Python leads, in which mode.
using Control = std::map<std::string, std::string>;

/// The run, the controller that Python is, and where in a cycle they stand. Arrays keep it alive.
class Running {
 public:
  Running(const std::string& file, runtime::Overrides overrides, const std::string& all,
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

  [[nodiscard]] runtime::Run& run() const { return *run_; }
  [[nodiscard]] Lead* lead() const { return lead_.get(); }
  /// Controllers have ended; the shut-down may be still to come.
  [[nodiscard]] bool over() const {
    return !begun_ || run().cycle().phase() == RunPhase::kShutDown;
  }
  [[nodiscard]] const std::vector<std::string>& joints() const { return joints_; }

  /// Gives the command and reads the next state, `cycles` times. False: the run has ended.
  bool step(std::int64_t cycles) {
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
  /// Ends the run, if it has not ended, and carries out the shut-down.
  void finish() {
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
  /// For iteration: the state that nobody has looked at yet, or else the next one.
  bool next() {
    if (over()) return false;
    if (std::exchange(fresh_, false)) return true;
    return step(1);
  }

  /// A mark, whether the cycle has begun, and a hash of all the rest, which is RobotCycle's.
  [[nodiscard]] py::bytes save() {
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
  void restore(const py::bytes& snapshot) {
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

  std::size_t inject(const std::string& scenario) {
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

  [[nodiscard]] py::dict result() const;
  [[nodiscard]] py::list faults() const;

 private:
  /// Marks that a thread is in the run.
  class Turn {
   public:
    explicit Turn(Running& of) : of_(&of) {
      if (of.busy_.exchange(true)) {
        raise(fail("another thread is in this run", "let one thread at a time step it").error());
      }
    }
    ~Turn() { of_->busy_ = false; }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;

   private:
    Running* of_;
  };

  static Diagnostics refuse_others(runtime::Composition& c) {
    if (c.experiment.hal.backend == runtime::BackendKind::kSim) return {};
    return {{.message = "Python steps a robot that is simulated in its own process; a robot on a "
                        "wire, or of another process, does not wait for it",
             .hint = "pass hal=\"sim\", or write the controller in C++ and use `tandem run`",
             .file = c.experiment.file,
             .key = "hal.backend"}};
  }

  void add_lead(const std::string& all, const Control& some) {
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

  void begin() {
    begun_ = run().cycle().begin();
    const bool leads = begun_ && run().cycle().phase() == RunPhase::kRunning;
    if (leads && !led_ && lead_ != nullptr) lead_->follow(run().state(), run().command());
    led_ = leads;
  }
  /// The rest of this cycle, and the next one's begin.
  bool advance() {
    begun_ = run().cycle().finish();
    if (begun_) begin();
    return !over();
  }
  /// Cycles between two looks at what Ctrl-C asks for.
  [[nodiscard]] std::int64_t per_turn() const {
    return run().experiment().loop.rate > 0.0 ? 1 : 100;
  }
  void check_command() const {
    if (lead_ == nullptr) return;
    const auto bad = lead_->find_bad();
    if (!bad) return;
    raise_value("command." + std::string(bad->field),
                "of " + joints_[bad->joint] + " is not finite in cycle " +
                    std::to_string(run().state().cycle()[0]) + ": nothing was commanded");
  }

  std::unique_ptr<runtime::Run> run_;
  std::shared_ptr<Lead> lead_;
  std::vector<std::string> joints_;
  std::atomic<bool> busy_{false};
  bool begun_ = false;  // the cycle's first half is done
  bool fresh_ = true;   // nobody has looked at its state
  bool led_ = false;    // controllers ran in the cycle before
};

py::list Running::faults() const {
  py::list out;
  for (const runtime::FaultReport& one : run().cycle().faults()) {
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

/// The names are those of `tandem run --json`.
py::dict Running::result() const {
  const runtime::RunStatistics& figures = run().cycle().statistics();
  const double period_s = static_cast<double>(run().experiment().loop.period_ns) * 1e-9;
  py::dict joints, out;
  const auto tracking = figures.tracking();
  const auto limited = figures.limited_cycles();
  for (std::size_t j = 0; j < tracking.size(); ++j) {
    py::dict joint;
    const bool any = tracking[j].cycles > 0;
    joint["rms_tracking_error_rad"] = any ? py::cast(tracking[j].rms_rad) : py::none();
    joint["max_tracking_error_rad"] = any ? py::cast(tracking[j].max_rad) : py::none();
    joint["limited_cycles"] = limited[j];
    joints[run().experiment().robot.joints[j].name.c_str()] = std::move(joint);
  }
  out["cycles"] = run().cycle().loop().cycles;
  out["running_cycles"] = run().cycle().running_cycles();
  out["simulated_s"] = static_cast<double>(run().cycle().running_cycles()) * period_s;
  out["phase"] = hal::to_string(run().cycle().phase());
  out["faults"] = faults();
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

/// Limits of every joint, by the names of hal::JointCapabilities.
py::dict limits_of(const runtime::Run& run) {
  const hal::Robot robot = hal::robot_of(run.experiment().robot);
  py::dict out;
  const auto add = [&](const char* name, double hal::JointCapabilities::*limit) {
    py::array_t<double> values(static_cast<py::ssize_t>(robot.joints.size()));
    for (std::size_t j = 0; j < robot.joints.size(); ++j)
      values.mutable_data()[j] = robot.joints[j].*limit;
    out[name] = std::move(values);
  };
  add("min_position_rad", &hal::JointCapabilities::min_position_rad);
  add("max_position_rad", &hal::JointCapabilities::max_position_rad);
  add("max_velocity_rad_s", &hal::JointCapabilities::max_velocity_rad_s);
  add("max_torque_Nm", &hal::JointCapabilities::max_torque_Nm);
  return out;
}

using Shared = std::shared_ptr<Running>;

py::list views_of(const Shared& of, const hal::Image& image, bool writeable) {
  return views(image.layout(), image.bytes().data(), -1, 0, keeper(of), writeable);
}

}  // namespace

void add_run(py::module_& module) {
  using namespace py::literals;
  py::class_<Running, Shared>(module, "Run", "A run that stands where its command is awaited.")
      .def(py::init([](const std::string& file, const std::string& control_all,
                       const Control& control_some, std::optional<std::uint64_t> seed,
                       std::optional<double> duration_s, std::optional<double> rate,
                       const std::string& scenario, const std::string& hal,
                       const std::string& on_fault, std::optional<std::uint32_t> delay_cycles,
                       const std::string& kernel_variant, bool build) {
             runtime::Overrides o;
             o.seed = seed;
             o.duration_s = duration_s;
             o.rate = rate;
             o.scenario = scenario;
             o.hal = hal;
             o.on_fault = on_fault;
             o.delay_cycles = delay_cycles;
             o.kernel_variant = kernel_variant;
             o.no_build = !build;
             return std::make_shared<Running>(file, std::move(o), control_all, control_some);
           }),
           "experiment"_a, "control_all"_a, "control_some"_a, "seed"_a, "duration_s"_a, "rate"_a,
           "scenario"_a, "hal"_a, "on_fault"_a, "delay_cycles"_a, "kernel_variant"_a, "build"_a)
      .def("step", &Running::step, "cycles"_a)
      .def("next", &Running::next)
      .def("save", &Running::save)
      .def("restore", &Running::restore, "snapshot"_a)
      .def("inject", &Running::inject, "scenario"_a)
      .def("finish", &Running::finish)
      .def(
          "stop",
          [](Running& r, int category) {
            if (category < 0 || category > 2)
              raise_value("stop", "category: " + std::to_string(category) + ", wanted 0, 1 or 2");
            r.run().cycle().inbox().emergency_stop(static_cast<hal::StopCategory>(category));
          },
          "category"_a)
      .def("reset_faults", [](Running& r) { r.run().cycle().inbox().reset_faults(); })
      .def("faults", &Running::faults)
      .def("result", &Running::result)
      .def("limits", [](const Running& r) { return limits_of(r.run()); })
      .def("state", [](const Shared& r) { return views_of(r, r->run().state(), false); })
      .def("command",
           [](const Shared& r) {
             return r->lead() != nullptr ? views_of(r, r->lead()->command(), true)
                                         : views_of(r, r->run().command(), false);
           })
      .def("sent", [](const Shared& r) { return views_of(r, r->run().command(), false); })
      .def("truth", [](const Shared& r) { return views_of(r, r->run().truth(), false); })
      .def("estimate",
           [](const Shared& r) {
             const bool any = r->run().experiment().estimation.any();
             return any ? views_of(r, r->run().estimate(), false) : py::list();
           })
      .def_property_readonly("over", &Running::over)
      .def_property_readonly(
          "phase", [](const Running& r) { return hal::to_string(r.run().cycle().phase()); })
      .def_property_readonly("warnings",
                             [](const Running& r) {
                               std::vector<std::string> texts;
                               for (const Error& one : r.run().warnings())
                                 texts.push_back(one.to_string());
                               return texts;
                             })
      .def_property_readonly("robot_file",
                             [](const Running& r) { return r.run().experiment().robot_file; })
      .def_property_readonly("seed", [](const Running& r) { return r.run().experiment().seed; })
      .def_property_readonly("period_s",
                             [](const Running& r) {
                               const auto ns = r.run().experiment().loop.period_ns;
                               return static_cast<double>(ns) * 1e-9;
                             })
      .def_property_readonly("joints", [](const Running& r) {
        std::vector<std::string> names;
        for (const auto& joint : r.run().experiment().robot.joints) names.push_back(joint.name);
        return names;
      });
}

}  // namespace tandem::python
