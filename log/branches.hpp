// The logs of a run that went back in time: which went on from which.
// Layer: log.  Thread: any, non-RT.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

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

}  // namespace tandem::log
