// What the benchmarks of the cycle share: an experiment with its kernels and controllers.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "model/kernel_library.hpp"
#include "runtime/controller_host.hpp"
#include "runtime/experiment.hpp"

namespace tandem::bench {

/// Everything of a run but its robot and its loop.
struct Rig {
  runtime::Experiment experiment;
  model::KernelLibrary kernels;
  std::unique_ptr<runtime::ControllerHost> host;
};

/// @param library  of the robot's kernels. Errors: those of each part.
[[nodiscard]] Result<std::unique_ptr<Rig>> make_rig(const std::string& experiment,
                                                    const std::string& library);

/// CPU, kernel and scheduler, a line each: a time means nothing without them.
[[nodiscard]] std::string machine_text();

/// Prints the error. @return the exit status for wrong input.
int fail_with(const Error& error);

[[nodiscard]] inline double us(std::int64_t ns) { return static_cast<double>(ns) * 1e-3; }
[[nodiscard]] double median(std::vector<double> values);

}  // namespace tandem::bench
