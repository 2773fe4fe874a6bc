#include "runtime/local_controllers.hpp"

#include <algorithm>

namespace tandem::runtime {
namespace {

bool claims(const HostedController& controller, std::size_t joint) {
  return std::ranges::find(controller.claims, joint, &ControllerSetup::Claim::joint) !=
         controller.claims.end();
}

}  // namespace

LocalControllers::LocalControllers(const hal::RobotConfig& robot, const tandem_kernels* kernels,
                                   std::int64_t period_ns)
    : host_(robot, kernels, period_ns) {}

Status LocalControllers::add(const std::string& name, LoadedController plugin,
                             TomlTable parameters) {
  auto made = host_.configure(name, std::move(plugin), std::move(parameters));
  if (!made) return std::unexpected(made.error());
  if (!(*made)->inputs.empty()) {
    return fail_at(
        name,
        "has the input '" + (*made)->inputs.front()->input().name +
            "', and nobody feeds inputs of controllers at the robot's end of a link",
        "let the operator's [[controller]] have its joints; or run it at the robot, with "
        "`tandem run` and its input from a topic");
  }
  for (const auto& other : controllers_) {
    for (const ControllerSetup::Claim& claim : (*made)->claims) {
      if (!claims(*other, claim.joint)) continue;
      return fail_at(name, "claims a joint of '" + other->name + "'",
                     "let one controller have the joint");
    }
  }
  host_.enter(**made);
  host_.note_code(**made);
  controllers_.push_back(std::move(*made));
  return {};
}

std::string LocalControllers::unseen() const {
  const ControllerIo& io = *controllers_.back()->io;
  std::string what = io.signals.numbers() > 0 ? "signals" : "";
  if (!io.marks.declared().empty()) what += what.empty() ? "marks" : " and marks";
  return what;
}

std::optional<std::size_t> LocalControllers::shared_joint(ControllerHost& host) const {
  for (const auto& theirs : host.owned()) {
    if (theirs == nullptr) continue;
    for (const ControllerSetup::Claim& claim : theirs->claims) {
      for (const auto& ours : controllers_) {
        if (claims(*ours, claim.joint)) return claim.joint;
      }
    }
  }
  return std::nullopt;
}

void LocalControllers::start(const hal::CycleTime& time, const hal::StateImage& state,
                             hal::CommandImage& command) noexcept TANDEM_RT {
  for (const auto& one : controllers_) one->controller->start(time, state, command);
}

Code LocalControllers::update(const hal::CycleTime& time, const hal::StateImage& state,
                              hal::CommandImage& command) noexcept TANDEM_RT {
  Code worst = Code::kOk;
  for (const auto& one : controllers_) {
    for (const ControllerSetup::Claim& claim : one->claims) {
      command.mode()[claim.joint] = static_cast<std::int8_t>(claim.mode);
      command.interaction()[claim.joint] = static_cast<std::uint8_t>(claim.interaction);
    }
    const Code code = one->controller->update(time, state, command);
    if (code != Code::kOk && code != Code::kStopped) worst = code;
  }
  return worst;
}

void LocalControllers::archive(Archive& ar) {
  for (const auto& one : controllers_) one->controller->archive(ar);
}

}  // namespace tandem::runtime
