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
/// its claim has set; with claim_with_modes() these too, within what the joint can do. It may set
/// these joints' gains, up to the most that the joint can use.
class ClaimGuard {
 public:
  /// `capabilities` must outlive it.
  ClaimGuard(const hal::ImageShape& shape, const std::vector<hal::JointCapabilities>& capabilities,
             const hal::ParameterImage& gains)
      : capabilities_(&capabilities), before_(shape), gains_(gains) {}

  void remember(const hal::CommandImage& command,
                const hal::ParameterImage& gains) noexcept TANDEM_RT;
  /// The run has been set back: revisions of gains do not tell any more what has changed.
  void forget(const hal::ParameterImage& gains) { gains_ = gains; }

  /// Gives everything that was not the controller's to write its value of remember().
  /// @param claimed  by joint: not 0 where one of `claims` is for it
  /// @param told     by joint: not 0 where it was reported before
  /// @return the first joint of which that was necessary, and was not reported; -1: none
  [[nodiscard]] std::int32_t take_back(std::span<const ControllerSetup::Claim> claims,
                                       std::span<const std::uint8_t> claimed,
                                       std::span<const std::uint8_t> told,
                                       hal::CommandImage& command,
                                       hal::ParameterImage& gains) noexcept TANDEM_RT;

 private:
  [[nodiscard]] bool take_back_gains(std::size_t joint, bool claimed,
                                     hal::ParameterImage& gains) noexcept TANDEM_RT;
  [[nodiscard]] bool take_back_joint(std::size_t joint,
                                     hal::CommandImage& command) const noexcept TANDEM_RT;
  [[nodiscard]] bool take_back_mode(const ControllerSetup::Claim& claim,
                                    hal::CommandImage& command) const noexcept TANDEM_RT;

  const std::vector<hal::JointCapabilities>* capabilities_;
  hal::CommandImage before_;
  hal::ParameterImage gains_;  ///< before, too; brought up to date by their revisions
};

}  // namespace tandem::runtime
