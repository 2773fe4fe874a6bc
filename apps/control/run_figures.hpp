// Figures of a run that are the robot's and the controllers', not those of the program around it.
// Layer: apps/control.  Thread: any, when the loop stands.
#pragma once

#include <optional>

#include "apps/text/figures.hpp"
#include "runtime/condition/expectations.hpp"
#include "runtime/controller_host.hpp"
#include "runtime/experiment.hpp"
#include "runtime/robot_cycle.hpp"

namespace tandem::apps {

/// `tandem run --json` and Python's `Run.result` have them.
struct RunFigures {
  const runtime::Experiment* experiment = nullptr;
  const runtime::RobotCycle* cycle = nullptr;
  const runtime::ControllerHost* controllers = nullptr;
  std::optional<runtime::GroundFigures> ground{};  ///< runtime::ground_of()'s
  const char* kernel_variant = "";
  const runtime::Expectations* expectations = nullptr;  ///< null: there are none

  [[nodiscard]] double sim_s() const;
};

/// What became of an expectation.
void figures(Figures& f, const runtime::ExpectationResult& one);

/// docs/json.md, `tandem run`
void figures(Figures& f, const RunFigures* s);

}  // namespace tandem::apps
