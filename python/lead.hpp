// The controller that Python is: it claims joints, and hands over what Python wrote for them.
// Layer: python.  Thread: configure non-RT; the rest the loop's, which is Python's.
#pragma once

#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include "controllers/controller.hpp"

namespace tandem::python {

class Lead final : public Controller {
 public:
  explicit Lead(std::vector<ControllerSetup::Claim> claims, const hal::ImageShape& shape)
      : claims_(std::move(claims)), command_(shape) {}

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
      for (const ControllerSetup::Claim& claim : claims_) to[claim.joint] = from[claim.joint];
    }
    return Code::kOk;
  }
  void archive(Archive& ar) override { ar(command_); }

  /// What Python writes.
  [[nodiscard]] hal::CommandImage& command() noexcept { return command_; }
  /// Begins where the robot is: `command` is the last one before Python leads.
  void follow(const hal::StateImage& state, const hal::CommandImage& command) noexcept {
    command_.assign(command);
    std::ranges::copy(state.position_rad(), command_.position_rad().begin());
    std::ranges::copy(state.torque_Nm(), command_.torque_Nm().begin());
    std::ranges::fill(command_.velocity_rad_s(), 0.0);
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
        if (!std::isfinite(values[claim.joint])) return Bad{one.name, claim.joint};
      }
    }
    return std::nullopt;
  }

 private:
  struct Reference {
    std::string_view name;
    std::span<const double> (hal::CommandImage::*of)() const noexcept;
    std::span<double> (hal::CommandImage::*to)() noexcept;
  };
#define TANDEM_REFERENCE(name) \
  { #name, &hal::CommandImage::name, &hal::CommandImage::name }
  static constexpr std::array<Reference, 7> kReferences{
      {TANDEM_REFERENCE(position_rad), TANDEM_REFERENCE(velocity_rad_s),
       TANDEM_REFERENCE(torque_Nm), TANDEM_REFERENCE(voltage_V), TANDEM_REFERENCE(current_A),
       TANDEM_REFERENCE(stiffness_Nm_rad), TANDEM_REFERENCE(damping_Nms_rad)}};
#undef TANDEM_REFERENCE

  std::vector<ControllerSetup::Claim> claims_;
  hal::CommandImage command_;
};

}  // namespace tandem::python
