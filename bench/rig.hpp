// What the benchmarks of the cycle share.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "runtime/run/run.hpp"

namespace tandem::bench {

/// The run of an experiment, as Run::open(). Errors: its first.
[[nodiscard]] Result<std::unique_ptr<runtime::Run>> open_run(
    const std::string& experiment, const runtime::Overrides& overrides,
    const runtime::RunParts& parts = {}, const runtime::Run::Connect& connect = {});

/// CPU, kernel and scheduler, a line each: a time means nothing without them.
[[nodiscard]] std::string machine_text();

/// Prints the error. @return the exit status for wrong input.
int fail_with(const Error& error);

[[nodiscard]] inline double us(std::int64_t ns) { return static_cast<double>(ns) * 1e-3; }
[[nodiscard]] double median(std::vector<double> values);

}  // namespace tandem::bench
