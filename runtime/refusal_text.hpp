// Why the loop refused a request, in words.
// Layer: runtime.  Thread: refusal_text() any but the loop's; it allocates.
#pragma once

#include <string>
#include <string_view>

#include "hal/text_event.hpp"

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

/// Whom a refusal names.
struct RefusalNames {
  std::string_view joint, one, other;
};
/// The same for a log, by the loop itself: "LKneeSag: stands outside its limits". @rt no heap
void append_refusal(hal::TextEvent& to, RejectReason reason,
                    const RefusalNames& names) noexcept TANDEM_RT;

}  // namespace tandem::runtime
