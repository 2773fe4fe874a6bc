// The logs of a run that went back in time: which went on from which.
// Layer: log.  Thread: any, non-RT.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "log/info.hpp"

namespace tandem::log {

/// One that goes on from another.
struct BranchLog {
  std::string file;  ///< beside the other: "arm-001.branch-2.mcap"
  std::string of;    ///< "arm-001.mcap"
  std::uint64_t cycle = 0;
  std::int64_t time_ns = 0;  ///< of that cycle
};

/// Those that are beside the log at `path`, a branch or the first, in the order in which they were
/// made. Files that cannot be read are left out.
[[nodiscard]] std::vector<BranchLog> branches_beside(const std::string& path);

/// A log at `path` goes on from another: the one that has its run's beginning, as far as
/// those in between are beside it.
[[nodiscard]] std::string first_log(const std::string& path, const RunInfo& info);
/// The one of them that has `cycle`, which was before the log at `path` began. A run may have left
/// a branch for a cycle that is not in it.
[[nodiscard]] std::string log_with(const std::string& path, const RunInfo& info,
                                   std::uint64_t cycle);

}  // namespace tandem::log
