// What the events of a log say of its run: faults, parameters that were set, marks.
// Layer: report.  Thread: non-RT only.
#pragma once

#include <string>
#include <vector>

#include "log/event.hpp"
#include "report/run_data.hpp"

namespace tandem::report {

/// @param error_text  of drives; empty: faults go by their codes
[[nodiscard]] std::vector<RunFault> faults_of(const std::vector<log::EventText>& events,
                                              const std::vector<std::string>& joints,
                                              const ErrorText& error_text);

/// @param at_start  RunInfo::parameters
[[nodiscard]] std::vector<RunParameter> parameters_of(const std::vector<log::EventText>& events,
                                                      const std::vector<std::string>& at_start);

/// Payloads, parameters and gains that were set, limits that were met.
[[nodiscard]] std::vector<RunMark> marks_of(const std::vector<log::EventText>& events);

}  // namespace tandem::report
