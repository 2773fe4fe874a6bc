// Figures and faults of a run, by the names of `tandem run --json` (docs/json.md).
// Layer: python.  Thread: as python/running.hpp.
#include <fmt/core.h>

#include <cmath>

#include "hal/sim/plant_changes.hpp"
#include "python/running.hpp"

namespace tandem::python {
namespace {

py::object known(bool is, double value) { return is ? py::cast(value) : py::none(); }

py::dict joints_of(const runtime::Run& run) {
  py::dict joints;
  const auto tracking = run.cycle().statistics().tracking();
  const auto limited = run.cycle().statistics().limited_cycles();
  for (std::size_t j = 0; j < tracking.size(); ++j) {
    py::dict joint;
    const bool any = tracking[j].cycles > 0;
    joint["rms_tracking_error_rad"] = known(any, tracking[j].rms_rad);
    joint["max_tracking_error_rad"] = known(any, tracking[j].max_rad);
    joint["limited_cycles"] = limited[j];
    joints[run.experiment().robot.joints[j].name.c_str()] = std::move(joint);
  }
  return joints;
}

py::list fault_log_of(const runtime::RobotCycle& cycle) {
  py::list out;
  for (const runtime::FaultReport& one : cycle.faults()) {
    py::dict fault;
    fault["time_s"] = one.time_s;
    fault["cycle"] = one.cycle;
    fault["joint"] = one.joint;
    fault["board"] = one.board;
    fault["controller"] = one.controller;
    fault["cause"] = one.text;
    fault["category"] = hal::to_string(one.category);
    fault["latched"] = one.latched;
    fault["cleared_s"] = known(!one.latched, one.cleared_s);
    out.append(std::move(fault));
  }
  return out;
}

/// How it ended; None: it goes on.
py::object ended_of(const Running& running) {
  if (!running.over()) return py::none();
  const runtime::RobotCycle& cycle = running.run().cycle();
  const std::uint64_t planned = running.run().experiment().cycles();
  for (const runtime::FaultReport& one : cycle.faults()) {
    if (one.latched) return py::str("by a fault");
  }
  if (planned > 0 && cycle.running_cycles() >= planned) return py::str("as planned");
  return py::str(cycle.inbox().bell().ended() ? "on request" : "its controllers were done");
}

double weight_N(const tandem_kernels& k) {
  const double* g = k.gravity_m_s2;
  return k.mass_kg * std::sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
}

/// What the plant's truth tells.
void add_truth(const runtime::Run& run, py::dict& out) {
  using namespace py::literals;
  const runtime::RunStatistics& figures = run.cycle().statistics();
  out["ground"] = py::none();
  out["base"] = py::none();
  if (const auto ground = figures.ground(weight_N(run.kernels()))) {
    out["ground"] = py::dict("weight_N"_a = ground->weight_N,
                             "mean_vertical_force_N"_a = ground->mean_vertical_force_N,
                             "max_foot_slip_m"_a = ground->max_foot_slip_m);
  }
  if (const auto base = figures.base()) {
    out["base"] =
        py::dict("min_height_m"_a = base->min_height_m, "max_height_m"_a = base->max_height_m,
                 "final_tilt_rad"_a = base->final_tilt_rad, "max_tilt_rad"_a = base->max_tilt_rad);
  }
  py::dict loops;
  for (const runtime::ClosureFigures& one : figures.loops()) {
    loops[run.experiment().robot.loops[py::len(loops)].name.c_str()] =
        py::dict("max_position_error_m"_a = one.max_position_error_m,
                 "max_velocity_error_m_s"_a = one.max_velocity_error_m_s);
  }
  out["loops"] = std::move(loops);
}

}  // namespace

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

py::dict Running::result() {
  using namespace py::literals;
  const Turn turn(*this);
  const runtime::Run& run = *run_;
  const runtime::RobotCycle& cycle = run.cycle();
  const runtime::Experiment& e = run.experiment();
  const double period_s = static_cast<double>(e.loop.period_ns) * 1e-9;
  const auto cycles = static_cast<std::int64_t>(cycle.running_cycles());
  py::dict out("robot"_a = e.robot.name, "seed"_a = e.seed, "ended"_a = ended_of(*this),
               "planned_cycles"_a = e.endless() ? py::none() : py::cast(e.cycles()),
               "cycles"_a = cycles, "period_ns"_a = e.loop.period_ns,
               "sim_seconds"_a = static_cast<double>(cycles * e.loop.period_ns) / 1e9,
               "joints"_a = joints_of(run), "work"_a = py::none());
  if (const auto work = cycle.statistics().work(period_s)) {
    out["work"] = py::dict("done_J"_a = work->done_J, "taken_J"_a = work->taken_J,
                           "max_power_W"_a = work->max_power_W);
  }
  add_truth(run, out);
  out["plant"] = e.plant != nullptr ? py::cast(e.plant->differences) : py::none();
  py::list latched;
  for (const runtime::FaultReport& one : cycle.faults()) {
    if (!one.latched) continue;
    const std::string where = one.joint.empty() ? "" : one.joint + ": ";
    latched.append(fmt::format("{:.3f} s: {}{}", one.time_s, where, one.text));
  }
  out["faults"] = std::move(latched);
  out["fault_log"] = fault_log_of(cycle);
  out["kernel_variant"] = std::string(run.kernels().variant);
  return out;
}

}  // namespace tandem::python
