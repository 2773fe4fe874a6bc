#include "runtime/controller_shadow.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tandem::runtime {
namespace {

using hal::ControlMode;

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

struct EndRow {
  const char* words;
  bool trouble;
};
constexpr EndRow kEnds[] = {
    {"", false},
    {"that was asked for", false},
    {"it leads its joints now", false},
    {"the controllers were stopped", false},
    {"its task is done", false},
    {"a new build took its place", false},
    {"its update() answered an error: ", true},
    {"a reference is not finite: ", true},
    {"it wrote what it has not claimed: ", true},
    {"it needs more time than the cycle leaves", true},
};

const EndRow& row_of(ShadowEnd end) noexcept TANDEM_RT {
  const auto row = static_cast<std::size_t>(end);  // bytes of a snapshot are anybody's
  return kEnds[row < std::size(kEnds) ? row : 0];
}

}  // namespace

double value_of(CommandReference reference, const hal::CommandImage& command,
                std::size_t joint) noexcept TANDEM_RT {
  switch (reference) {
    case CommandReference::kPosition: return command.position_rad()[joint];
    case CommandReference::kVelocity: return command.velocity_rad_s()[joint];
    case CommandReference::kTorque: return command.torque_Nm()[joint];
    case CommandReference::kVoltage: return command.voltage_V()[joint];
    case CommandReference::kCurrent: return command.current_A()[joint];
  }
  return kUnknown;
}

std::span<const CommandReference> references_of(std::int8_t mode) noexcept TANDEM_RT {
  using enum CommandReference;
  static constexpr CommandReference kInPosition[] = {kPosition, kVelocity, kTorque};
  static constexpr CommandReference kInVelocity[] = {kVelocity, kTorque};
  static constexpr CommandReference kInTorque[] = {kTorque};
  static constexpr CommandReference kInOpenLoop[] = {kVoltage};
  static constexpr CommandReference kInCurrent[] = {kCurrent};
  switch (static_cast<ControlMode>(mode)) {
    case ControlMode::kPosition: return kInPosition;
    case ControlMode::kVelocity: return kInVelocity;
    case ControlMode::kTorque: return kInTorque;
    case ControlMode::kOpenLoop: return kInOpenLoop;
    case ControlMode::kCurrent: return kInCurrent;
    case ControlMode::kIdle: break;
  }
  return {};
}

bool is_trouble(ShadowEnd end) noexcept TANDEM_RT { return row_of(end).trouble; }

void append_end(hal::TextEvent& to, const ShadowLook& look,
                std::string_view joint) noexcept TANDEM_RT {
  to.append("shadow ended: ");
  to.append(row_of(look.end).words);
  to.append(joint);
  if (look.end == ShadowEnd::kCode) to.append(tandem::to_string(look.code));
}

void copy_joint(hal::CommandImage& to, const hal::CommandImage& from,
                std::size_t joint) noexcept TANDEM_RT {
#define TANDEM_FIELD(type, name, count, doc) \
  if constexpr (#count[0] == 'j') to.name()[joint] = from.name()[joint];
#include "hal/command_fields.inc"
#undef TANDEM_FIELD
}

void Shadow::begin(std::uint64_t cycle) noexcept TANDEM_RT {
  look = {.since = cycle};
  took_ns = 0;
  missed_in_a_row = 0;
  JointDifference none;
  none.now.fill(kUnknown);
  none.most.fill(kUnknown);
  none.step.fill(kUnknown);
  std::ranges::fill(joints, none);
}

void Shadow::compare(std::span<const ControllerSetup::Claim> claims, const hal::CommandImage& led,
                     std::span<const std::int32_t> owners) noexcept TANDEM_RT {
  for (std::size_t i = 0; i < claims.size(); ++i) {
    const std::size_t j = claims[i].joint;
    JointDifference& one = joints[i];
    const std::array<double, kCommandReferences> before = one.now;
    one.now.fill(kUnknown);
    one.owner = owners[j];
    one.mode = wants.mode()[j];
    one.interaction = wants.interaction()[j];
    one.commanded_mode = led.mode()[j];
    one.commanded_interaction = led.interaction()[j];
    for (const CommandReference reference : references_of(one.mode)) {
      const auto r = static_cast<std::size_t>(reference);
      one.now[r] = value_of(reference, wants, j) - value_of(reference, led, j);
      // The larger number of the two; of a number and a NaN the number.
      one.most[r] = std::fmax(one.most[r], std::abs(one.now[r]));
      one.step[r] = std::fmax(one.step[r], std::abs(one.now[r] - before[r]));
    }
  }
}

std::int32_t Shadow::not_finite(
    std::span<const ControllerSetup::Claim> claims) const noexcept TANDEM_RT {
  for (const ControllerSetup::Claim& claim : claims) {
    bool finite = true;
    for (const CommandReference reference : references_of(wants.mode()[claim.joint])) {
      finite = finite && std::isfinite(value_of(reference, wants, claim.joint));
    }
    const auto compliant = static_cast<std::uint8_t>(hal::InteractionMode::kCompliant);
    if (wants.interaction()[claim.joint] == compliant) {
      finite = finite && std::isfinite(wants.stiffness_Nm_rad()[claim.joint]) &&
               std::isfinite(wants.damping_Nms_rad()[claim.joint]);
    }
    if (!finite) return static_cast<std::int32_t>(claim.joint);
  }
  return -1;
}

void Shadow::show() noexcept TANDEM_RT {
  shown_joints.write(joints);
  shown.write({&look, 1});
}

}  // namespace tandem::runtime
