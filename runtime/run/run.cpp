#include "runtime/run/run.hpp"

#include <utility>

#include "controllers/hosted_call.hpp"
#include "runtime/run/fork.hpp"

namespace tandem::runtime {
namespace {

Diagnostics connect_to(Composition& c, const Run::Connect& connect) {
  if (connect) return connect(c);
  if (c.experiment.hal.backend == BackendKind::kSim) return {};
  return {{.message = "its robot is not in this process",
           .hint = "override `hal` by \"sim\", connect it, or use `tandem run`",
           .file = c.experiment.file,
           .key = "hal.backend"}};
}

}  // namespace

std::expected<std::unique_ptr<Run>, Diagnostics> Run::open(const std::string& experiment,
                                                           const Overrides& overrides,
                                                           const RunParts& parts,
                                                           const Connect& connect) {
  auto c = std::make_unique<Composition>();
  Diagnostics errors = compose(*c, experiment, overrides);
  if (errors.empty()) errors = connect_to(*c, connect);
  if (!errors.empty()) {
    if (a_hosted_call_goes_on()) (void)c.release();  // it uses what it was given
    return std::unexpected(std::move(errors));
  }
  auto run = std::make_unique<Run>(*c, overrides, parts);
  run->own_ = std::move(c);
  return run;
}

Run::Run(Composition& c, const Overrides& overrides, const RunParts& parts) : c_(&c) {
  const Experiment& e = c.experiment;
  const CycleConfig config = cycle_config(c, overrides);
  hal::Backend* backend = c.backend.get();
  if (c.parallel != nullptr) {
    const bool both_float = c.sim != nullptr && e.robot.model.floating_base;
    parallel_.emplace(
        internal_model::ParallelParts{.first = *c.backend,
                                      .second = *c.parallel,
                                      .truth = e.sim.ground_truth ? &c.parallel->truth() : nullptr,
                                      .recorder = parts.recorder,
                                      .first_truth = both_float ? &c.sim->truth() : nullptr},
        e.robot.shape(), c.controllers->gains(), e.loop.period_ns);
    backend = &parallel_->backend();  // passes every call on to the first robot, and tapes it
  }
  cycle_.emplace(CycleParts{.robot = e.robot,
                            .backend = *backend,
                            .controllers = *c.controllers,
                            .clock = parts.clock == nullptr ? clock_ : *parts.clock,
                            .recorder = parts.recorder,
                            .truth = truth_of(c),
                            .observer = parts.observer,
                            .owner = {parts.owner, c.owner.get(), c.owner_slot},
                            .estimator = c.estimator.get(),
                            .snapshots = c.predictor.get()},
                 config);
  if (c.predictor != nullptr) {
    c.predictor->attach(*cycle_, parallel(), [&c, config] { return make_fork(c, config); });
  }
  if (parallel_) parallel_->start();
}

Run::~Run() {
  if (c_->predictor != nullptr) c_->predictor->close();
}

}  // namespace tandem::runtime
