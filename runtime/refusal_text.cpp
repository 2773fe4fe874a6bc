#include "runtime/refusal_text.hpp"

#include <fmt/core.h>

#include "runtime/owner_controller.hpp"

namespace tandem::runtime {
namespace {

/// @param what  "moved", "set"
RefusalText while_latched(const std::string& what) {
  return {"nothing is " + what + " while a fault is latched", "tandem fault reset, then ask again"};
}

/// Why no joint may move in the phase. Empty in one with another answer.
RefusalText not_yet(RunPhase phase) {
  switch (phase) {
    case RunPhase::kBringUp:
      return {"its drive is not enabled yet", "ask again in the phase running"};
    case RunPhase::kSettling:
      return {"the joints are held until the robot has settled at its start",
              "wait a moment, then ask again"};
    case RunPhase::kRetreating:
      return {"the robot is on its way to a safe posture", "ask again after a reset"};
    case RunPhase::kFaulted: return while_latched("moved");
    case RunPhase::kResetting: return {"a reset is under way", "wait a moment, then ask again"};
    case RunPhase::kRunning:
    case RunPhase::kHeld:
    case RunPhase::kShutDown:
    case RunPhase::kDone: break;
  }
  return {};
}

using enum RejectReason;
constexpr struct {
  const char *message, *hint;
} kWords[]{
    {"", ""},
#define TANDEM_REFUSAL(name, words, hint) {words, hint},
#include "runtime/refusals.inc"
#undef TANDEM_REFUSAL
};

}  // namespace

RefusalText refusal_text(RejectReason reason, RunPhase phase, const std::string& joint,
                         const std::string& one, const std::string& other) {
  if (reason == kNone) return {};
  if (reason == kNotRunning && phase == RunPhase::kFaulted) return while_latched("set");
  if (reason == kNotRunning && phase == RunPhase::kHeld) {
    return {"every joint is held after the reset, until the controllers run",
            "tandem controller start lets them continue, then ask again"};
  }
  if (reason == kClaimed && one == kOwnerController) {
    return {"is claimed by the owner of the robot in another process",
            "ask that process, or end it: then the joint is free"};
  }
  if (reason == kNotEnabled) {
    if (RefusalText yet = not_yet(phase); !yet.message.empty()) return yet;
  }
  const std::string who = one.empty() ? "this" : "the controller '" + one + "'";
  const auto& row = kWords[static_cast<std::size_t>(reason)];
  const auto filled = [&](const char* words) {
    return fmt::format(fmt::runtime(words), joint, one, other, to_string(phase), who);
  };
  return {filled(row.message), filled(row.hint)};
}

void append_refusal(hal::TextEvent& to, RejectReason reason,
                    const RefusalNames& names) noexcept TANDEM_RT {
  if (!names.joint.empty()) {
    to.append(names.joint);
    to.append(": ");
  }
  std::string_view words = kWords[static_cast<std::size_t>(reason)].message;
  for (std::size_t open; (open = words.find('{')) != std::string_view::npos;) {
    to.append(words.substr(0, open));
    switch (words[open + 1]) {
      case '0': to.append(names.joint); break;
      case '1': to.append(names.one); break;
      case '2': to.append(names.other); break;
      case '4': to.append(names.one.empty() ? std::string_view("this") : names.one); break;
      default: to.append("now"); break;  // {3}: the phase
    }
    words.remove_prefix(open + 3);
  }
  to.append(words);
}

}  // namespace tandem::runtime
