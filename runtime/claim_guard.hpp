// What a controller wrote without a claim is taken back before anybody else sees it.
// Layer: runtime.  Thread: made non-RT; the rest RT.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/realtime.hpp"
#include "controllers/controller.hpp"
#include "hal/image.hpp"
#include "hal/joint_capabilities.hpp"

namespace tandem::runtime {

/// Watches one call of a controller after the other: remember(), the call, take_back().
///
/// A controller may write every field of the joints that it claims but mode and interaction, which
/// its claim has set; with claim_with_modes() these too, within what the joint can do.
class ClaimGuard {
 public:
  /// `capabilities` must outlive it.
  ClaimGuard(const hal::ImageShape& shape, const std::vector<hal::JointCapabilities>& capabilities)
      : capabilities_(&capabilities), before_(shape) {}

  void remember(const hal::CommandImage& command) noexcept TANDEM_RT { before_.assign(command); }

  /// Gives everything that was not the controller's to write its value of remember().
  /// @param claimed  by joint: not 0 where one of `claims` is for it
  /// @param told     by joint: not 0 where it was reported before
  /// @return the first joint of which that was necessary, and was not reported; -1: none
  [[nodiscard]] std::int32_t take_back(std::span<const ControllerSetup::Claim> claims,
                                       std::span<const std::uint8_t> claimed,
                                       std::span<const std::uint8_t> told,
                                       hal::CommandImage& command) noexcept TANDEM_RT;

 private:
  [[nodiscard]] bool take_back_joint(std::size_t joint,
                                     hal::CommandImage& command) const noexcept TANDEM_RT;
  [[nodiscard]] bool take_back_mode(const ControllerSetup::Claim& claim,
                                    hal::CommandImage& command) const noexcept TANDEM_RT;

  const std::vector<hal::JointCapabilities>* capabilities_;
  hal::CommandImage before_;
};

}  // namespace tandem::runtime
