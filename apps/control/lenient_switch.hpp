// What a switch of controllers asks for when it is not strict: strict is all or none, an error
// otherwise.
// Layer: apps/control.  Thread: any.
#pragma once

#include <string>
#include <vector>

#include "runtime/run_services.hpp"

namespace tandem::apps {

/// What is left of a switch when everything is left out of it that cannot be done.
struct LenientSwitch {
  std::vector<std::string> stop, start;
  std::vector<std::string> left_out;  ///< each with the reason
  bool some = false;                  ///< one of the names at least is a loaded controller's
};

/// Leaves out who is not loaded, who is in that state already, and who would need a joint of one
/// that is active then.
[[nodiscard]] LenientSwitch best_effort(const std::vector<runtime::ControllerStatus>& all,
                                        const std::vector<std::string>& stop,
                                        const std::vector<std::string>& start);
/// The first of what was left out, for people.
[[nodiscard]] std::string left_out_text(const LenientSwitch& is);

/// `stop`, and who is active and has a joint of those to start.
[[nodiscard]] std::vector<std::string> with_who_is_in_the_way(
    const std::vector<runtime::ControllerStatus>& all, std::vector<std::string> stop,
    const std::vector<std::string>& start);

}  // namespace tandem::apps
