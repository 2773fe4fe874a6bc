// Why the loop refused a request, in words.
// Layer: runtime.  Thread: any but the loop's; it allocates.
#pragma once

#include <string>

#include "runtime/inbox.hpp"
#include "runtime/progress.hpp"

namespace tandem::runtime {

struct RefusalText {
  std::string message;
  std::string hint;  ///< what to do about it
};

/// @param phase       of the run, at the answer
/// @param joint       empty where there is none
/// @param one, other  controllers that stand in the way; empty where there is none
[[nodiscard]] RefusalText refusal_text(RejectReason reason, RunPhase phase,
                                       const std::string& joint, const std::string& one,
                                       const std::string& other);

}  // namespace tandem::runtime
