// What a run is asked for beside its command: faults, commands of the control socket, signals,
// words. Layer: python.  Thread: as python/running.hpp.
#include <vector>

#include "apps/control/controller_control.hpp"
#include "apps/control/input_control.hpp"
#include "apps/control/joint_control.hpp"
#include "apps/control/sensor_control.hpp"
#include "apps/control/signal_control.hpp"
#include "hal/sim/scenario.hpp"
#include "python/running.hpp"

namespace tandem::python {

std::size_t Running::inject(const std::string& scenario) {
  const Turn turn(*this);
  check_going("inject");
  const runtime::Experiment& e = run().experiment();
  auto faults = sim::parse_scenario(scenario, "inject", e.robot, e.loop.period_ns, e.tree().get());
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

apps::ControlRegistry& Running::commands() {
  if (commands_ == nullptr) {  // not those of stops and time, which are the run's own
    runtime::RobotCycle& cycle = run().cycle();
    commands_ = std::make_unique<apps::ControlRegistry>();
    apps::add_controller_commands(*commands_, cycle.services(), c_->experiment.robot);
    apps::add_joint_commands(*commands_, cycle, c_->experiment.robot);
    apps::add_input_commands(*commands_, cycle.services());
    apps::add_sensor_commands(*commands_, cycle.services());
    apps::add_signal_commands(*commands_, cycle.services(), c_->experiment.robot);
  }
  return *commands_;
}

void Running::carry_out_events() {
  runtime::Events* const events = run().events();
  if (events == nullptr) return;
  events->ask_by([this](const std::string& request) -> Status {
    const apps::Json answer = commands().answer(request);
    if (answer.value("ok", false)) return {};
    return fail(answer.value("error", "no answer"), answer.value("hint", ""));
  });
}

std::string Running::ask(const std::string& question) {
  const Turn turn(*this, true);
  check_open();
  if (begun_) run().cycle().attend();  // what is asked for is judged by the state that was read
  const apps::Json answer = commands().answer(question);
  look_for_plugins();
  take_lead();
  if (!answer.value("ok", false)) {
    raise(fail(answer.value("error", "no answer"), answer.value("hint", "")).error());
  }
  return answer.dump(-1, ' ', false, apps::Json::error_handler_t::replace);
}

py::list Running::signals() {
  py::list all;
  for (const runtime::ControllerSignals& one : run().cycle().services().signals()) {
    const hal::SignalBlock& block = *one.block;
    all.append(py::make_tuple(one.controller, views(block.layout(), block.image().data(), -1, 0,
                                                    keeper(one.block), false)));
  }
  return all;
}

py::list Running::texts() {
  std::vector<hal::TextEvent> events;
  std::uint64_t seen = texts_before_;
  run().cycle().services().texts().read(seen, events);
  py::list all;
  for (const hal::TextEvent& one : events) {
    all.append(py::make_tuple(static_cast<double>(one.time_ns) * 1e-9, one.cycle,
                              std::string(one.controller()),
                              one.level == hal::TextLevel::kWarn ? "warn" : "info", one.words()));
  }
  return all;
}

}  // namespace tandem::python
