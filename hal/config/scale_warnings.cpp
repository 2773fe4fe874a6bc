// What of a drive's sheet contradicts the scale of its joint: the units, factors and polarity that
// CiA 402 has beside 608F, 6091 and 6092.
#include <fmt/core.h>

#include <array>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <vector>

#include "base/counted.hpp"
#include "canopen/drive_abilities.hpp"
#include "canopen/objects.hpp"
#include "hal/config/joint_scale.hpp"

namespace tandem::hal {
namespace {

namespace object = canopen::object;

// 60A8, CiA 303-2: prefix (a power of ten), numerator, denominator, reserved.
constexpr std::uint32_t kUnit = 0x00FFFFFF;
constexpr std::uint32_t kIncrements = 0x00B50000;
constexpr std::uint32_t kRadians = 0x00100000;
constexpr std::uint32_t kDegrees = 0x00410000;
constexpr std::uint32_t kRevolutions = 0x00B40000;

/// How many such units a revolution has, as far as that is known.
std::optional<double> units_per_rev(std::uint32_t unit) {
  const double power = std::pow(10.0, -static_cast<std::int8_t>(unit >> 24));
  switch (unit & kUnit) {
    case kRadians: return 2.0 * std::numbers::pi * power;
    case kDegrees: return 360.0 * power;
    case kRevolutions: return power;
    default: return {};
  }
}

bool differ(double one, double other) { return !(std::abs(one / other - 1.0) <= 0.01); }

/// Warnings of one joint on a drive of another make.
class JointScale {
 public:
  JointScale(const RobotConfig& robot, const JointConfig& joint, const BoardConfig& board)
      : robot_(robot),
        joint_(joint),
        board_(board),
        units_(canopen::units_of(*board.sheet, joint.axis)) {}

  Diagnostics run() {
    doubt_positions();
    doubt_velocities();
    doubt_direction();
    if (!joint_.slides) compare();
    return std::move(warnings_);
  }

 private:
  void warn(const char* key, std::string message, std::string hint) {
    warnings_.push_back({std::move(message), std::move(hint), robot_.file, joint_.line,
                         "joint." + joint_.name + "." + key});
  }

  [[nodiscard]] std::uint32_t value(std::uint16_t index, std::uint8_t sub = 0) const {
    const auto found = board_.sheet->value(canopen::of_axis(index, joint_.axis), sub, 0);
    return static_cast<std::uint32_t>(found.value_or(0));
  }

  /// The factor or resolution; none: the sheet does not say it.
  [[nodiscard]] std::optional<double> factor(std::uint16_t index) const {
    return canopen::ratio(*board_.sheet, canopen::of_axis(index, joint_.axis));
  }

  void warn_of_factor(const char* key, std::uint16_t index, const char* name, const char* what) {
    warn(key,
         fmt::format("{:04X} ({}) is {} / {} in {}: {}", canopen::of_axis(index, joint_.axis), name,
                     value(index, 1), value(index, 2), board_.eds, what),
         std::string("set this key to the drive's ") +
             (index == object::kPositionFactor
                  ? "position units per revolution of the joint"
                  : "velocity units at one revolution of the joint per second"));
  }

  void doubt_positions() {
    if (!joint_.encoder_counts_per_rev.of_sheet) return;
    if (factor(object::kPositionFactor).value_or(1.0) != 1.0) {
      warn_of_factor("encoder_counts_per_rev", object::kPositionFactor, "position factor",
                     "the drive converts positions, and the joint's counts are without that");
    }
    const std::uint32_t unit = value(object::kPositionUnit);
    if (unit == 0 || unit == kIncrements) return;
    const auto per_rev = units_per_rev(unit);
    if (per_rev && !differ(*per_rev, joint_.encoder_counts_per_rev)) return;
    warn(
        "encoder_counts_per_rev",
        fmt::format("60A8 (SI unit position) is 0x{:08X} in {}, {}; the joint has {:.10g} by 608F, "
                    "6091 or 6092",
                    unit, board_.eds,
                    per_rev ? fmt::format("{:.10g} position units per revolution", *per_rev)
                            : std::string("no increments"),
                    joint_.encoder_counts_per_rev.value),
        "set this key to the drive's position units per revolution of the joint");
  }

  void doubt_velocities() {
    if (joint_.velocity_units_per_rev > 0.0) return;
    constexpr const char* kKey = "velocity_units_per_rev";
    constexpr const char* kWhat =
        "the drive converts velocities, and the joint's are counts per second";
    // The encoder of positions, or a 1 that nobody set, changes nothing.
    const double resolution = factor(object::kVelocityResolution).value_or(1.0);
    const double positions = factor(object::kEncoderResolution).value_or(1.0);
    if (resolution != 1.0 && differ(resolution, positions)) {
      warn_of_factor(kKey, object::kVelocityResolution, "velocity encoder resolution",
                     "velocities have other counts than positions (608F)");
    }
    for (const auto& [index, name] :
         {std::pair{object::kVelocityEncoderFactor, "velocity encoder factor"},
          {object::kVelocityFactor1, "velocity factor 1"},
          {object::kVelocityFactor, "velocity factor"}}) {
      if (factor(index).value_or(1.0) != 1.0) warn_of_factor(kKey, index, name, kWhat);
    }
  }

  void doubt_direction() {
    const std::uint32_t bits = value(object::kPolarity);
    if (bits == 0 || joint_.reversed.line > 0) return;
    warn("reversed",
         fmt::format("607E (polarity) is 0x{:02X} in {}: the drive turns its counts round itself",
                     bits, board_.eds),
         "set this key to whether its counts then go down as the joint's position grows");
  }

  /// What the sheet says of counts; none: nothing that could be relied on.
  [[nodiscard]] std::optional<double> sheets_counts() const {
    constexpr double kLeast = 100.0;  // less is a 1 that the drive replaces
    if (factor(object::kPositionFactor).value_or(1.0) != 1.0) return {};
    const std::uint32_t unit = value(object::kPositionUnit);
    const bool increments = unit == 0 || unit == kIncrements;
    const auto counts = increments ? units_.counts_per_rev : units_per_rev(unit);
    return counts.value_or(0.0) >= kLeast ? counts : std::nullopt;
  }

  /// robot.toml counts; one that is far from the sheet's word is often a slip, as a gear left out.
  void compare() {
    const auto against = [&](const char* key, double used, std::optional<double> said,
                             std::initializer_list<std::uint16_t> objects) {
      if (!said || !differ(used, *said)) return;
      std::vector<std::uint16_t> there;
      for (const std::uint16_t one : objects) {
        if (board_.sheet->has(canopen::of_axis(one, joint_.axis))) there.push_back(one);
      }
      const std::string values = canopen::values_of(*board_.sheet, joint_.axis, there);
      warn(key,
           fmt::format("is {:.10g}, and the drive's sheet says {:.10g}, which is {:.4g} times as "
                       "much ({} in {})",
                       used, *said, *said / used, values, board_.eds),
           "is the gear in both? This file's number is used: correct it, or the sheet");
    };
    if (!joint_.encoder_counts_per_rev.of_sheet) {
      against("encoder_counts_per_rev", joint_.encoder_counts_per_rev, sheets_counts(),
              {object::kEncoderResolution, object::kGearRatio, object::kFeedConstant,
               object::kPositionUnit});
    }
    if (!joint_.velocity_units_per_rev.of_sheet && joint_.velocity_units_per_rev > 0.0) {
      against("velocity_units_per_rev", joint_.velocity_units_per_rev, units_.velocity_per_rev,
              {object::kVelocityUnit, object::kGearRatio});
    }
    // A sheet in uNm is right by a thousandth, and the key says so where that suits the joint.
    const double ratio = units_.rated_torque_Nm.value_or(0.0) / joint_.rated_torque_Nm;
    const bool in_uNm = !differ(ratio, 1000.0) &&
                        joint_.max_torque_Nm < 32.0 * joint_.rated_torque_Nm &&
                        joint_.rated_torque_Nm < 32.0 * joint_.max_torque_Nm;
    if (!joint_.rated_torque_Nm.of_sheet && !in_uNm) {
      against("rated_torque_Nm", joint_.rated_torque_Nm, units_.rated_torque_Nm,
              {object::kRatedTorque, object::kGearRatio});
    }
  }

  const RobotConfig& robot_;
  const JointConfig& joint_;
  const BoardConfig& board_;
  const canopen::DriveUnits units_;
  Diagnostics warnings_;
};

/// Our own boards take whole numbers: 608F, 2033, and 6076 in mNm.
Diagnostics rounded(const RobotConfig& robot, const JointConfig& joint) {
  Diagnostics warnings;
  const auto compare = [&](const char* key, double given, double per_unit, const char* object) {
    const double whole = std::round(given * per_unit) / per_unit;
    constexpr double kUnseen = 1e-9;
    const bool torque = per_unit > 1.0;
    if (!(std::abs(given / whole - 1.0) > (torque ? 1e-3 : kUnseen))) return;
    warnings.push_back(
        {.message = fmt::format("is {:.12g}, and our own boards take whole numbers ({}): they are "
                                "told {:.12g}",
                                given, object, whole),
         .hint = torque ? "give it in whole mNm" : "give a whole number",
         .file = robot.file,
         .line = joint.line,
         .key = "joint." + joint.name + "." + key});
  };
  compare("encoder_counts_per_rev", joint.encoder_counts_per_rev, 1.0, "608F");
  compare("motor_encoder_counts_per_rev", joint.motor_encoder_counts_per_rev, 1.0, "2033");
  compare("rated_torque_Nm", joint.rated_torque_Nm, 1000.0, "6076, in mNm");
  return warnings;
}

}  // namespace

Diagnostics scale_warnings(const RobotConfig& robot) {
  Diagnostics all;
  std::vector<int> others;  // by warning: joints besides the first
  for (const JointConfig& joint : robot.joints) {
    const BoardConfig* board = robot.board(joint.board);
    if (board == nullptr) continue;
    for (Error& warning :
         board->eds.empty() ? rounded(robot, joint) : JointScale(robot, joint, *board).run()) {
      const auto same = std::ranges::find_if(all, [&](const Error& one) {
        return one.message == warning.message && one.hint == warning.hint;
      });
      if (same != all.end()) {
        ++others[static_cast<std::size_t>(same - all.begin())];
        continue;
      }
      all.push_back(std::move(warning));
      others.push_back(0);
    }
  }
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (others[i] == 0) continue;
    all[i].message += fmt::format("; so it is of {}", counted(others[i], "other joint"));
  }
  return all;
}

}  // namespace tandem::hal
