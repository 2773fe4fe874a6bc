// A fault's record in words.
// Layer: runtime.  Thread: any but the loop's; it allocates.
#pragma once

#include "runtime/controller_host.hpp"
#include "runtime/cycle_config.hpp"
#include "runtime/fault.hpp"

namespace tandem::runtime {

/// Where a record's numbers have their names from.
struct FaultContext {
  const hal::RobotConfig& robot;
  const hal::Backend& backend;
  const ControllerHost& controllers;
  const CycleConfig& config;
};

/// @param cleared_ns  of FaultLog
[[nodiscard]] FaultReport in_words(const FaultRecord& record, std::int64_t cleared_ns,
                                   const FaultContext& about);

}  // namespace tandem::runtime
