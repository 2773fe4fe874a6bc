#include "hal/config/drive_ranges.hpp"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <cmath>
#include <initializer_list>
#include <numbers>
#include <tuple>

#include "canopen/data_sheet.hpp"
#include "canopen/drive_abilities.hpp"
#include "canopen/objects.hpp"

namespace tandem::hal {
namespace {

constexpr double kMost = 2147483647.0;    // of an object of 32 bits with a sign
constexpr double kMost32 = 4294967295.0;  // of one without

class RangeCheck {
 public:
  RangeCheck(const RobotConfig& robot, const JointConfig& joint) : robot_(robot), joint_(joint) {}

  Diagnostics run() {
    check_counts();
    check_turn();
    check_velocity_units();
    if (joint_.homing) check_homing(*joint_.homing);
    check_profile();
    const StopOptions& stop = joint_.stop_options;
    using namespace canopen::object;
    check_option("shutdown", stop.shutdown, kShutdownOption);
    check_option("disable", stop.disable, kDisableOption);
    check_option("halt", stop.halt, kHaltOption);
    check_option("fault", stop.fault, kFaultReactionOption);
    check_stop_deceleration();
    return std::move(errors_);
  }

 private:
  void error(int line, const std::string& key, std::string message, std::string hint) {
    errors_.push_back({std::move(message), std::move(hint), robot_.file, line,
                       "joint." + joint_.name + "." + key});
  }

  [[nodiscard]] double velocity_units(double rad_s) const {
    const double per_rev = joint_.velocity_units_per_rev > 0.0 ? joint_.velocity_units_per_rev
                                                               : joint_.encoder_counts_per_rev;
    return rad_s * per_rev / (2.0 * std::numbers::pi);
  }

  [[nodiscard]] double acceleration_units(double rad_s2) const {
    const double per_rev = joint_.acceleration_units_per_rev;
    return per_rev > 0.0 ? rad_s2 * per_rev / (2.0 * std::numbers::pi) : velocity_units(rad_s2);
  }

  /// Where the joint's range is too much for its encoders, their counts are as often the slip.
  void check_counts() {
    const bool motor = joint_.motor_encoder_counts_per_rev > joint_.encoder_counts_per_rev;
    const char* key = motor ? "motor_encoder_counts_per_rev" : "encoder_counts_per_rev";
    const double given =
        motor ? joint_.motor_encoder_counts_per_rev : joint_.encoder_counts_per_rev;
    const double most = std::max(-joint_.min_position_rad, joint_.max_position_rad);
    const double per_count = 2.0 * std::numbers::pi / given;
    const BoardConfig* board = robot_.board(joint_.board);
    const bool own = board == nullptr || board->eds.empty();
    if (given > kMost32) {
      error(joint_.line, key,
            fmt::format("{:.10g} does not fit the 32 bits of {}", given,
                        own ? (motor ? "2033" : "608F") : "a revolution's counts (6064, 607A)"),
            fmt::format("give at most {:.0f}", kMost32));
    } else if (most > kMostCounts * per_count) {
      error(joint_.line, key,
            fmt::format("the joint's limits, {:.6g} to {:.6g}, would be up to {:.4g} counts, and "
                        "the 32 bits of 6064 and 607A take {:.4g}",
                        joint_.min_position_rad, joint_.max_position_rad, most / per_count,
                        kMostCounts),
            fmt::format("give at most {:.0f} counts, or narrow min_position_rad and "
                        "max_position_rad",
                        std::floor(kMostCounts * 2.0 * std::numbers::pi / most)));
    }
  }

  /// At power-on a place within the joint's range has to be one place of a single-turn encoder.
  void check_turn() {
    if (joint_.encoder_turn_counts == 0) return;
    const double turn_rad =
        2.0 * std::numbers::pi * joint_.encoder_turn_counts / joint_.encoder_counts_per_rev;
    const bool beyond = joint_.max_position_rad - joint_.min_position_rad >= turn_rad;
    if (joint_.homing && joint_.homing->required) {
      error(joint_.encoder_turn_counts.line, "encoder_turn_counts",
            "a joint that is homed finds its place so, and not by its encoder's turn",
            beyond ? "remove this key" : "remove this key, or set required = false in `homing`");
    } else if (beyond) {
      error(joint_.encoder_turn_counts.line, "encoder_turn_counts",
            fmt::format("an encoder that repeats itself after {:.6g} {} does not tell where in its "
                        "range, {:.6g} to {:.6g}, the joint is at power-on",
                        turn_rad, joint_.slides ? "m" : "rad", joint_.min_position_rad,
                        joint_.max_position_rad),
            "narrow min_position_rad and max_position_rad, or replace this key by a `homing`");
    }
  }

  void check_velocity_units() {
    const double most = velocity_units(joint_.max_velocity_rad_s);
    if (!(joint_.velocity_units_per_rev > 0.0)) return check_velocity(most);
    if (most >= 1.0 && most <= kMost) return;
    error(joint_.line, "velocity_units_per_rev",
          fmt::format("the joint's maximum velocity, {:.6g} rad/s, would be {:.3g} of the drive's "
                      "units, which are integers of 32 bits",
                      joint_.max_velocity_rad_s, most),
          "set it to the drive's velocity units at one revolution of the joint per second");
  }

  void check_velocity(double most) {
    if (!(most > kMost)) return;
    error(joint_.line, "max_velocity_rad_s",
          fmt::format("{:.6g} {} would be {:.3g} counts per second, which are integers of 32 bits "
                      "(606C, 60FF)",
                      joint_.max_velocity_rad_s, joint_.slides ? "m/s" : "rad/s", most),
          fmt::format("give at most {:.4g}, or correct encoder_counts_per_rev",
                      kMost * joint_.max_velocity_rad_s / most));
  }

  /// The limits of a joint whose drive moves in profile modes are written to it: what the sheet
  /// does not take is mostly in other units.
  void check_profile() {
    const BoardConfig* board = robot_.board(joint_.board);
    if (board == nullptr) return;
    using namespace canopen::object;
    if (!canopen::moves_by_profile(canopen::abilities_of(*board->sheet, joint_.axis))) return;
    const double velocity = velocity_units(joint_.max_velocity_rad_s);
    const double acceleration = acceleration_units(joint_.max_acceleration_rad_s2);
    check_rate("velocity", velocity, {kMaxProfileVelocity, kProfileVelocity});
    check_rate("acceleration", acceleration, {kProfileAcceleration, kProfileDeceleration});
  }

  /// @param what  "velocity" or "acceleration", of the keys' names
  void check_rate(const std::string& what, double units,
                  std::initializer_list<std::uint16_t> objects) {
    const canopen::DataSheet& sheet = *robot_.board(joint_.board)->sheet;
    for (const std::uint16_t index : objects) {
      const std::uint16_t of = canopen::of_axis(index, joint_.axis);
      const canopen::SheetEntry* entry = sheet.find(of);
      if (entry == nullptr || (entry->access & canopen::kWrite) == 0) continue;
      const auto most =
          static_cast<double>(entry->high.value_or(0) > 0 ? *entry->high : 0xFFFFFFFF);
      if (units <= most) continue;
      error(joint_.line, what + "_units_per_rev",
            fmt::format("the joint's maximum {} would be {:.0f} in {:04X}, which takes at most "
                        "{:.0f} in {}",
                        what, units, of, most, sheet.file),
            fmt::format("set it to the drive's {} units at one revolution of the joint per second"
                        "{}, or give the joint a smaller max_{}",
                        what,
                        what == "velocity" ? " (a motor's rpm: 60 times the gear)"
                                           : " and second (a motor's rev/s^2: the gear)",
                        what == "velocity" ? "velocity_rad_s" : "acceleration_rad_s2"));
      return;
    }
  }

  void check_stop_deceleration() {
    const double asked = joint_.drive.stop_deceleration_rad_s2;
    const BoardConfig* board = robot_.board(joint_.board);
    if (std::isnan(asked) || board == nullptr) return;
    const auto index = canopen::of_axis(canopen::object::kQuickStopDeceleration, joint_.axis);
    if (!board->eds.empty() && !canopen::writable(*board->sheet, index, 0)) {
      error(joint_.line, "stop_deceleration_rad_s2",
            fmt::format("{:04X} cannot be written in {}", index, board->sheet->file),
            "remove it: the drive stops as it was commissioned");
      return;
    }
    const canopen::SheetEntry* entry = board->sheet->find(index);
    const bool limited = entry != nullptr && entry->high.value_or(0) > 0;
    const double most = limited ? static_cast<double>(*entry->high) : kMost32;
    const double units = acceleration_units(asked);
    if (units >= 0.5 && units <= most) return;
    error(joint_.line, "stop_deceleration_rad_s2",
          fmt::format("{:.6g} would be {:.3g} of the drive's units, and {:04X} takes 1 to {:.0f}",
                      asked, units, index, most),
          "give a value between these, or correct the joint's units");
  }

  void check_homing(const HomingConfig& homing) {
    const auto wrong = [&](const char* key, std::string message, std::string hint) {
      error(homing.line, std::string("homing.") + key, std::move(message), std::move(hint));
    };
    if (homing.speed_rad_s > joint_.max_velocity_rad_s) {
      wrong("speed_rad_s",
            fmt::format("{:.6g} is more than the joint's max_velocity_rad_s, {:.6g}",
                        homing.speed_rad_s, joint_.max_velocity_rad_s),
            "homing is slow: the joint runs into a switch or a stop");
    }
    if (homing.zero_speed_rad_s > homing.speed_rad_s) {
      wrong("zero_speed_rad_s", "is more than speed_rad_s",
            "the last way, to the zero, is the slower one");
    }
    const auto of_velocity = [&](const char* key, double value) {
      return std::tuple(key, value, velocity_units(value));
    };
    for (const auto& [key, value, units] :
         {of_velocity("speed_rad_s", homing.speed_rad_s),
          of_velocity("zero_speed_rad_s", homing.zero_speed_rad_s),
          std::tuple("acceleration_rad_s2", homing.acceleration_rad_s2,
                     acceleration_units(homing.acceleration_rad_s2))}) {
      if (units >= 0.5 && units <= kMost) continue;
      wrong(
          key,
          fmt::format("{:.6g} would be {:.3g} of the drive's units, which are integers of 32 bits",
                      value, units),
          "give a value between one of its units and 2^31");
    }
    const double width = joint_.max_position_rad - joint_.min_position_rad;
    const double counts =
        homing.position_rad * joint_.encoder_counts_per_rev / (2.0 * std::numbers::pi) +
        joint_.zero_counts;
    if (homing.position_rad < joint_.min_position_rad - 0.5 * width ||
        homing.position_rad > joint_.max_position_rad + 0.5 * width ||
        !(std::abs(counts) < kMost)) {
      wrong("position_rad",
            fmt::format("{:.6g} is far outside of the joint's range, {:.6g} to {:.6g}",
                        homing.position_rad, joint_.min_position_rad, joint_.max_position_rad),
            "give the joint's angle at the place that is found");
    }
    check_method(homing);
  }

  /// Our own boards have the standard's methods; another's sheet may say which values it takes.
  void check_method(const HomingConfig& homing) {
    const BoardConfig* board = robot_.board(joint_.board);
    if (board == nullptr) return;
    const int m = homing.method;
    const bool standard =
        (m >= 1 && m <= 14) || (m >= 17 && m <= 30) || (m >= 33 && m <= 35) || m == 37;
    if (board->eds.empty() && !standard) {
      error(homing.line, "homing.method", fmt::format("our own boards have no homing method {}", m),
            "give one of 1 to 14, 17 to 30, 33, 34, 35 and 37 (docs/firmware.md)");
      return;
    }
    check_limits(homing.line, "homing.method", m, canopen::object::kHomingMethod);
  }

  void check_option(const char* key, std::optional<int> value, std::uint16_t index) {
    if (value) check_limits(joint_.line, std::string("stop_options.") + key, *value, index);
  }

  void check_limits(int line, const std::string& key, int value, std::uint16_t index) {
    const BoardConfig* board = robot_.board(joint_.board);
    if (board == nullptr) return;
    const std::uint16_t of = canopen::of_axis(index, joint_.axis);
    const canopen::SheetEntry* entry = board->sheet->find(of);
    if (entry == nullptr) return;
    const bool low = entry->low && value < *entry->low;
    const bool high = entry->high && value > *entry->high;
    if (!low && !high) return;
    const std::string where = board->eds.empty()
                                  ? std::string("our own boards (docs/firmware.md)")
                                  : fmt::format("{}:{}", board->sheet->file, entry->line);
    error(line, key,
          fmt::format("{} is {} than {}, the limit of {:04X} in {}", value, low ? "less" : "more",
                      low ? *entry->low : *entry->high, of, where),
          "give a value that the drive takes");
  }

  const RobotConfig& robot_;
  const JointConfig& joint_;
  Diagnostics errors_;
};

}  // namespace

Diagnostics check_drive_ranges(const RobotConfig& robot, const JointConfig& joint) {
  return RangeCheck(robot, joint).run();
}

}  // namespace tandem::hal
