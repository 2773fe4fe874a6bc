#include "runtime/run/run.hpp"

#include "controllers/hosted_call.hpp"

namespace tandem::runtime {
namespace {

/// Why an experiment needs more than a loop in this process.
Diagnostics not_alone(const Experiment& e) {
  if (e.hal.backend != BackendKind::kSim) {
    return {{.message = "its robot is not in this process",
             .hint = "override the backend by kSim, or use `tandem run`",
             .file = e.file,
             .key = "hal.backend"}};
  }
  if (!e.parallel) return {};
  return {{.message = "a second robot needs a loop of its own",
           .hint = "leave [parallel] out, or use `tandem run`",
           .file = e.file,
           .key = "parallel"}};
}

}  // namespace

std::expected<std::unique_ptr<Run>, Diagnostics> Run::open(const std::string& experiment,
                                                           Overrides overrides,
                                                           log::Recorder* recorder) {
  if (overrides.missing_kernels == robot::MissingKernels::kTolerate) {
    overrides.missing_kernels = robot::MissingKernels::kRefuse;  // there is no run without
  }
  std::unique_ptr<Run> run(new Run());
  Composition& c = *run->parts_;
  Diagnostics errors = compose(c, experiment, overrides);
  if (errors.empty()) errors = not_alone(c.experiment);
  if (!errors.empty()) {
    if (a_hosted_call_goes_on()) (void)run->parts_.release();  // it uses what it was given
    return std::unexpected(std::move(errors));
  }
  const Experiment& e = c.experiment;
  run->cycle_.emplace(CycleParts{.robot = e.robot,
                                 .backend = *c.backend,
                                 .controllers = *c.controllers,
                                 .clock = run->clock_,
                                 .recorder = recorder,
                                 .truth = e.sim.ground_truth ? &c.sim->truth() : nullptr,
                                 .owner = {nullptr, c.owner.get(), c.owner_slot},
                                 .estimator = c.estimator.get()},
                      cycle_config(e, c.backend->pace()));
  return run;
}

}  // namespace tandem::runtime
