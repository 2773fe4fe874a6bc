// The controller that Python is: it claims joints, and hands over what Python wrote for them.
// Layer: python.  Thread: configure non-RT; the rest the loop's, which is Python's.
#pragma once

#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "controllers/controller.hpp"

namespace tandem::python {

class Lead final : public Controller {
 public:
  explicit Lead(std::vector<ControllerSetup::Claim> claims, const hal::ImageShape& shape)
      : claims_(std::move(claims)),
        command_(shape),
        begun_(shape),
        unheard_(shape),
        leads_(shape.joints) {
    for (const ControllerSetup::Claim& claim : claims_) leads_[claim.joint] = 1;
  }

  [[nodiscard]] Status configure(ControllerSetup& setup) override {
    for (const ControllerSetup::Claim& one : claims_)
      setup.claim(one.joint, one.mode, one.interaction);
    return {};
  }
  void start(const hal::CycleTime&, const hal::StateImage&,
             hal::CommandImage&) noexcept TANDEM_RT override {}
  [[nodiscard]] Code update(const hal::CycleTime&, const hal::StateImage&,
                            hal::CommandImage& command) noexcept TANDEM_RT override {
    for (const Reference& one : kReferences) {
      const std::span<const double> from = (std::as_const(command_).*one.of)();
      const std::span<double> to = (command.*one.to)();
      for (const ControllerSetup::Claim& claim : claims_) {
        if (is_silent(one, claim)) continue;
        to[claim.joint] = from[claim.joint];
      }
      pass_on_stray(from, (std::as_const(begun_).*one.of)(), to);
    }
    return Code::kOk;
  }
  void archive(Archive& ar) override { ar(command_, begun_); }

  /// What Python writes.
  [[nodiscard]] hal::CommandImage& command() noexcept { return command_; }
  /// Begins where the robot is: `command` is the last one before Python leads. Where no drive
  /// follows a position, none is wanted until Python writes one.
  void follow(const hal::StateImage& state, const hal::CommandImage& command) noexcept {
    command_.assign(command);
    std::ranges::copy(state.position_rad(), command_.position_rad().begin());
    std::ranges::copy(state.torque_Nm(), command_.torque_Nm().begin());
    std::ranges::fill(command_.velocity_rad_s(), 0.0);
    for (const ControllerSetup::Claim& claim : claims_) {
      if (claim.mode != hal::ControlMode::kPosition) {
        command_.position_rad()[claim.joint] = std::numeric_limits<double>::quiet_NaN();
      }
    }
    begun_.assign(command_);
  }
  /// From now on nobody obeys `command()`.
  void disobeyed() noexcept { unheard_.assign(command_); }
  /// Whether Python has written since then; told once.
  [[nodiscard]] bool take_unheard() noexcept {
    const bool written =
        std::memcmp(unheard_.bytes().data(), command_.bytes().data(), command_.bytes().size()) != 0;
    if (written) disobeyed();
    return written;
  }
  /// A number that is none, in a claimed joint's references.
  struct Bad {
    std::string_view field;
    std::size_t joint;
  };
  [[nodiscard]] std::optional<Bad> find_bad() const noexcept {
    for (const Reference& one : kReferences) {
      const std::span<const double> values = (command_.*one.of)();
      for (const ControllerSetup::Claim& claim : claims_) {
        if (is_silent(one, claim)) continue;
        if (!std::isfinite(values[claim.joint])) return Bad{one.name, claim.joint};
      }
    }
    return std::nullopt;
  }

 private:
  /// What Python wrote of joints that it does not lead: the cycle takes it back, and tells it as it
  /// does a plugin's.
  void pass_on_stray(std::span<const double> written, std::span<const double> begun,
                     std::span<double> to) const noexcept TANDEM_RT {
    for (std::size_t j = 0; j < leads_.size(); ++j) {
      if (leads_[j] == 0 && std::memcmp(&written[j], &begun[j], sizeof(double)) != 0)
        to[j] = written[j];
    }
  }
  struct Reference {
    std::string_view name;
    std::span<const double> (hal::CommandImage::*of)() const noexcept;
    std::span<double> (hal::CommandImage::*to)() noexcept;
  };
  /// No position is wanted of a joint that follows none: its tracking error is none, either.
  [[nodiscard]] bool is_silent(const Reference& one,
                               const ControllerSetup::Claim& claim) const noexcept {
    return &one == kReferences.data() && claim.mode != hal::ControlMode::kPosition &&
           std::isnan(command_.position_rad()[claim.joint]);
  }
#define TANDEM_REFERENCE(name) \
  { #name, &hal::CommandImage::name, &hal::CommandImage::name }
  static constexpr std::array<Reference, 7> kReferences{
      {TANDEM_REFERENCE(position_rad), TANDEM_REFERENCE(velocity_rad_s),
       TANDEM_REFERENCE(torque_Nm), TANDEM_REFERENCE(voltage_V), TANDEM_REFERENCE(current_A),
       TANDEM_REFERENCE(stiffness_Nm_rad), TANDEM_REFERENCE(damping_Nms_rad)}};
#undef TANDEM_REFERENCE

  std::vector<ControllerSetup::Claim> claims_;
  hal::CommandImage command_;
  hal::CommandImage begun_;          // as it was before Python wrote
  hal::CommandImage unheard_;        // as it was when nobody obeyed any more
  std::vector<std::uint8_t> leads_;  // by joint
};

}  // namespace tandem::python
