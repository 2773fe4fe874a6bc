#include "runtime/claim_guard.hpp"

#include <cstring>

namespace tandem::runtime {
namespace {

/// Whether the bytes differed; a NaN is as good as any other.
template <class T>
bool put_back(std::span<T> now, std::span<const T> before, std::size_t joint) noexcept TANDEM_RT {
  if (std::memcmp(&now[joint], &before[joint], sizeof(T)) == 0) return false;
  now[joint] = before[joint];
  return true;
}

}  // namespace

void ClaimGuard::remember(const hal::CommandImage& command,
                          const hal::ParameterImage& gains) noexcept TANDEM_RT {
  before_.assign(command);
  for (std::size_t j = 0; j < gains.joints(); ++j)
    if (gains.revision(j) != gains_.revision(j)) gains_.copy_joint(j, gains);
}

std::int32_t ClaimGuard::take_back(std::span<const ControllerSetup::Claim> claims,
                                   std::span<const std::uint8_t> claimed,
                                   std::span<const std::uint8_t> told, hal::CommandImage& command,
                                   hal::ParameterImage& gains) noexcept TANDEM_RT {
  std::int32_t first = -1;
  const auto note = [&](bool changed, std::size_t joint) {
    if (changed && first < 0 && told[joint] == 0) first = static_cast<std::int32_t>(joint);
  };
  for (std::size_t j = 0; j < claimed.size(); ++j) {
    if (claimed[j] == 0) note(take_back_joint(j, command), j);
    note(take_back_gains(j, claimed[j] != 0, gains), j);
  }
  for (const ControllerSetup::Claim& claim : claims) {
    note(take_back_mode(claim, command), claim.joint);
  }
  return first;
}

bool ClaimGuard::take_back_joint(std::size_t joint,
                                 hal::CommandImage& command) const noexcept TANDEM_RT {
  const hal::CommandImage& before = before_;
  bool changed = put_back(command.position_rad(), before.position_rad(), joint);
  changed |= put_back(command.velocity_rad_s(), before.velocity_rad_s(), joint);
  changed |= put_back(command.torque_Nm(), before.torque_Nm(), joint);
  changed |= put_back(command.voltage_V(), before.voltage_V(), joint);
  changed |= put_back(command.current_A(), before.current_A(), joint);
  changed |= put_back(command.stiffness_Nm_rad(), before.stiffness_Nm_rad(), joint);
  changed |= put_back(command.damping_Nms_rad(), before.damping_Nms_rad(), joint);
  changed |= put_back(command.mode(), before.mode(), joint);
  changed |= put_back(command.interaction(), before.interaction(), joint);
  changed |= put_back(command.fault_reset(), before.fault_reset(), joint);
  return changed;
}

bool ClaimGuard::take_back_gains(std::size_t joint, bool claimed,
                                 hal::ParameterImage& gains) noexcept TANDEM_RT {
  if (gains.revision(joint) == gains_.revision(joint)) return false;
  const auto usable = [](const hal::PidGains& wanted, const hal::PidGains& most) {
    return wanted.kp >= 0.0 && wanted.kp <= most.kp && wanted.ki >= 0.0 && wanted.ki <= most.ki &&
           wanted.kd >= 0.0 && wanted.kd <= most.kd;
  };
  bool good = claimed;
  for (std::size_t i = 0; i < hal::kPidLoops; ++i) {
    const auto loop = static_cast<hal::PidLoop>(i);
    const hal::PidGains& wanted = gains.gains(joint, loop);
    good = good && (wanted == gains_.gains(joint, loop) ||
                    usable(wanted, (*capabilities_)[joint].most_gains[i]));
  }
  if (good) {
    gains_.copy_joint(joint, gains);
  } else {
    gains.copy_joint(joint, gains_);
  }
  return !good;
}

bool ClaimGuard::take_back_mode(const ControllerSetup::Claim& claim,
                                hal::CommandImage& command) const noexcept TANDEM_RT {
  const auto mode = static_cast<hal::ControlMode>(command.mode()[claim.joint]);
  const auto interaction = static_cast<hal::InteractionMode>(command.interaction()[claim.joint]);
  if (claim.with_modes && (*capabilities_)[claim.joint].can(mode, interaction)) return false;
  const hal::CommandImage& before = before_;
  const bool changed = put_back(command.mode(), before.mode(), claim.joint);
  return put_back(command.interaction(), before.interaction(), claim.joint) || changed;
}

}  // namespace tandem::runtime
