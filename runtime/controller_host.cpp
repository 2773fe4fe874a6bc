#include "runtime/controller_host.hpp"

#include <algorithm>
#include <utility>

namespace tandem::runtime {
namespace {

constexpr auto kPosition = static_cast<std::int8_t>(hal::ControlMode::kPosition);
constexpr auto kStiff = static_cast<std::uint8_t>(hal::InteractionMode::kStiff);

Error about(const std::string& key, std::string message, std::string hint) {
  return {.message = std::move(message), .hint = std::move(hint), .file = {}, .key = key};
}

}  // namespace

ControllerHost::ControllerHost(const hal::RobotConfig& robot, const tandem_kernels* kernels,
                               std::int64_t period_ns)
    : robot_(&robot),
      kernels_(kernels),
      period_ns_(period_ns),
      capabilities_(hal::joint_capabilities(robot)) {}

Status ControllerHost::add(const std::string& name, LoadedController plugin, TomlTable parameters) {
  auto owner = std::make_shared<LoadedController>(std::move(plugin));
  return add(name, std::shared_ptr<Controller>(owner, &**owner), std::move(parameters));
}

Status ControllerHost::add(const std::string& name, std::shared_ptr<Controller> controller,
                           TomlTable parameters) {
  ControllerSetup setup(*robot_, kernels_, period_ns_, std::move(parameters));
  Status configured = controller->configure(setup);
  setup.parameters.finish();
  if (configured) configured = check_claims(name, setup.claims());
  if (!configured) return configured;
  const auto claims = setup.claims();
  hosted_.push_back({name, std::move(controller), {claims.begin(), claims.end()}});
  done_.push_back(0);
  return {};
}

Status ControllerHost::check_claims(const std::string& name,
                                    std::span<const ControllerSetup::Claim> claims) const {
  std::vector<std::string> owner(robot_->joints.size());
  for (const Hosted& one : hosted_) {
    for (const auto& claim : one.claims) owner[claim.joint] = one.name;
  }
  for (const auto& claim : claims) {
    if (claim.joint >= owner.size()) {
      return std::unexpected(about(name,
                                   "claims joint number " + std::to_string(claim.joint) + " of " +
                                       std::to_string(owner.size()),
                                   "joints are numbered from 0 in the robot.toml's order"));
    }
    const std::string& joint = robot_->joints[claim.joint].name;
    if (!owner[claim.joint].empty()) {
      return std::unexpected(about(
          joint, "is claimed by the controllers '" + owner[claim.joint] + "' and '" + name + "'",
          "let one controller have the joint"));
    }
    owner[claim.joint] = name;
    if (Status able = hal::check_capability(*robot_, claim.joint, claim.mode, claim.interaction);
        !able) {
      return able;
    }
  }
  return {};
}

void ControllerHost::hold(const hal::StateImage& state,
                          hal::CommandImage& command) const noexcept TANDEM_RT {
  for (std::size_t j = 0; j < capabilities_.size(); ++j) {
    if (!capabilities_[j].can(hal::Capability::kPosition)) {
      command.mode()[j] = static_cast<std::int8_t>(hal::ControlMode::kIdle);
      continue;
    }
    const bool enabled =
        state.drive_state()[j] == static_cast<std::uint8_t>(hal::DriveState::kOperationEnabled);
    if (command.mode()[j] != kPosition || !enabled) {
      command.mode()[j] = kPosition;
      command.interaction()[j] = kStiff;
      command.position_rad()[j] = state.position_rad()[j];
      command.torque_Nm()[j] = 0.0;
    }
    command.velocity_rad_s()[j] = 0.0;
  }
}

void ControllerHost::release(hal::CommandImage& command) const noexcept TANDEM_RT {
  std::ranges::fill(command.mode(), static_cast<std::int8_t>(hal::ControlMode::kIdle));
}

void ControllerHost::set_modes(hal::CommandImage& command) const noexcept TANDEM_RT {
  for (const Hosted& one : hosted_) {
    for (const auto& claim : one.claims) {
      command.mode()[claim.joint] = static_cast<std::int8_t>(claim.mode);
      command.interaction()[claim.joint] = static_cast<std::uint8_t>(claim.interaction);
      command.stiffness_Nm_rad()[claim.joint] = capabilities_[claim.joint].stiffness_Nm_rad;
      command.damping_Nms_rad()[claim.joint] = capabilities_[claim.joint].damping_Nms_rad;
    }
  }
}

void ControllerHost::start(const hal::CycleTime& time, const hal::StateImage& state,
                           hal::CommandImage& command) noexcept TANDEM_RT {
  release(command);  // so that hold() takes every measured position
  hold(state, command);
  set_modes(command);
  std::ranges::fill(done_, std::uint8_t{0});
  for (const Hosted& one : hosted_) one.controller->start(time, state, command);
}

Code ControllerHost::update(const hal::CycleTime& time, const hal::StateImage& state,
                            hal::CommandImage& command) noexcept TANDEM_RT {
  bool all_done = true;
  for (std::size_t i = 0; i < hosted_.size(); ++i) {
    if (done_[i] != 0) continue;
    const Code code = hosted_[i].controller->update(time, state, command);
    if (code == Code::kStopped) {
      done_[i] = 1;
    } else if (code != Code::kOk) {
      culprit_ = i;
      return code;
    }
    all_done = all_done && done_[i] != 0;
  }
  return all_done ? Code::kStopped : Code::kOk;
}

void ControllerHost::stop() noexcept TANDEM_RT {
  for (const Hosted& one : hosted_) one.controller->stop();
}

void ControllerHost::archive(Archive& ar) {
  for (const Hosted& one : hosted_) one.controller->archive(ar);
  ar(done_, culprit_);
}

}  // namespace tandem::runtime
