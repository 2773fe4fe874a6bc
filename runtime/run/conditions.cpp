#include "runtime/run/conditions.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "hal/config/capabilities.hpp"

namespace tandem::runtime {

Diagnostics unfit_for_events(const Experiment& e, bool serves) {
  if (e.faults.empty() && e.events.empty()) return {};
  const TomlTable root = e.document.root();
  const char* const first = root.has("push") ? "push" : root.has("fault") ? "fault" : "event";
  if (e.hal.backend != BackendKind::kSim) {
    return {{.message = "pushes, faults and events come in a simulation in this process, and this "
                        "robot is not",
             .hint = "add --hal sim; or leave them out, and give faults to `tandem emulate "
                     "--scenario`",
             .file = e.file,
             .line = root.line(first),
             .key = first}};
  }
  if (!serves || e.events.empty()) return {};
  return {{.message = "who commands a served robot is another process: no condition is looked at "
                      "here, and nothing asked for",
           .hint = "leave [[event]] and `when` out; a push may have a time",
           .file = e.file,
           .line = e.events.front().line,
           .key = first}};
}

Diagnostics look_up_conditions(Composition& c) {
  const Experiment& e = c.experiment;
  if ((e.expectations.empty() && e.events.empty()) || c.controllers == nullptr) return {};
  const hal::Robot robot = hal::robot_of(e.robot);
  const hal::StateImage state(robot.shape());
  const hal::CommandImage command(robot.shape());
  const hal::TruthImage* truth = truth_of(c);
  QuantityNames names{
      .robot = robot,
      .state = state.layout(),
      .command = command.layout(),
      .truth = truth == nullptr ? nullptr : &truth->layout(),
      .estimate = c.estimator == nullptr ? nullptr : &c.estimator->image().layout()};
  for (const auto& one : c.controllers->owned()) {
    if (one == nullptr || one->io->signals.numbers() == 0) continue;
    names.signals.push_back({one->name, {one->io, &one->io->signals}});
  }
  auto expectations = Expectations::read(e.expectations, e.file, names);
  auto events = Events::read(e.events, e.file, names);
  Diagnostics errors;
  if (!expectations) errors = expectations.error();
  if (!events) std::ranges::copy(events.error(), std::back_inserter(errors));
  if (!errors.empty()) return errors;
  c.expectations = std::move(*expectations);
  if (e.events.empty()) return {};
  c.events = std::move(*events);
  if (c.sim != nullptr) c.events->strike(c.sim->robot());
  c.expectations->judge(c.events.get());
  return {};
}

}  // namespace tandem::runtime
