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

std::int32_t ClaimGuard::take_back(std::span<const ControllerSetup::Claim> claims,
                                   std::span<const std::uint8_t> claimed,
                                   std::span<const std::uint8_t> told,
                                   hal::CommandImage& command) noexcept TANDEM_RT {
  std::int32_t first = -1;
  const auto note = [&](bool changed, std::size_t joint) {
    if (changed && first < 0 && told[joint] == 0) first = static_cast<std::int32_t>(joint);
  };
  for (std::size_t j = 0; j < claimed.size(); ++j) {
    if (claimed[j] == 0) note(take_back_joint(j, command), j);
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
