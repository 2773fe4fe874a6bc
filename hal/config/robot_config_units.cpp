// A joint's units: counts, velocity units and rated torque, of its table or of its drive's sheet.
#include <cmath>

#include "canopen/drive_abilities.hpp"
#include "hal/config/robot_config_read.hpp"

namespace tandem::hal {

void complete_units(TomlTable& table, const RobotConfig& robot, JointConfig& joint) {
  const BoardConfig* board = robot.board(joint.board);
  if (board == nullptr || board->eds.empty()) {
    for (const char* key : {"reversed", "zero_counts", "velocity_units_per_rev"}) {
      if (!table.has(key)) continue;
      table.error(key, "is for drives of other makers: our own boards count along the joint",
                  "give its board an `eds`, or remove this key");
    }
    for (const char* key : {"encoder_counts_per_rev", "motor_encoder_counts_per_rev"}) {
      if (!table.has(key)) (void)table.number(key);  // says that it is missing
    }
    return;
  }
  if (board->sheet == canopen::tandem_board_sheet()) return;  // its own could not be read
  const canopen::DriveUnits units = canopen::units_of(*board->sheet, joint.axis);
  if (std::isnan(joint.encoder_counts_per_rev)) {
    // Many sheets say 1, which the drive replaces when it is commissioned.
    const double counts = units.counts_per_rev.value_or(0.0);
    joint.counts_of_sheet = counts >= kCounts.min && counts <= kCounts.max;
    joint.encoder_counts_per_rev = joint.counts_of_sheet ? counts : kUnset;
    if (!joint.counts_of_sheet) {
      table.error("encoder_counts_per_rev",
                  "neither this table nor the drive's sheet says what the counts of joint '" +
                      joint.name + "' are: 608F, 6091 and 6092 have no use in " + board->eds,
                  "set it to the position units per revolution of the joint");
    }
  }
  if (joint.velocity_units_per_rev <= 0.0) {
    joint.velocity_of_sheet = units.velocity_per_rev.has_value();
    joint.velocity_units_per_rev = units.velocity_per_rev.value_or(0.0);
    if (units.unknown_velocity != 0) {
      table.error("velocity_units_per_rev",
                  "the sheet does not say what a velocity of joint '" + joint.name +
                      "' is: 60A9 is " + hex(units.unknown_velocity) + " in " + board->eds +
                      ", and no gear (6091) or no unit that is known goes with it",
                  "set it to the drive's velocity units at one revolution of the joint per second");
    }
  }
  if (std::isnan(joint.motor_encoder_counts_per_rev)) {
    joint.motor_encoder_counts_per_rev = joint.encoder_counts_per_rev;
  }
  if (!std::isnan(joint.rated_torque_Nm)) return;
  joint.rated_torque_Nm = units.rated_torque_Nm.value_or(kUnset);
  joint.torque_of_sheet = units.rated_torque_Nm.has_value();
  if (!joint.torque_of_sheet) {
    table.error("rated_torque_Nm",
                "neither this table nor the drive's sheet says what the torques of joint '" +
                    joint.name + "' are per mille of: 6076 has no value in " + board->eds,
                "set it to the motor's rated torque times the gear ratio");
  }
}

}  // namespace tandem::hal
