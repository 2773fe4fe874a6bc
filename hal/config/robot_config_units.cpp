// A joint's units: counts, velocity units and rated torque, of its table or of its drive's sheet.
#include <cmath>
#include <initializer_list>

#include "canopen/drive_abilities.hpp"
#include "canopen/objects.hpp"
#include "hal/config/robot_config_read.hpp"

namespace tandem::hal {
namespace {

namespace object = canopen::object;

/// Completes one joint's units from its drive's sheet.
class FromSheet {
 public:
  FromSheet(TomlTable& table, const BoardConfig& board, JointConfig& joint)
      : table_(table),
        board_(board),
        joint_(joint),
        units_(canopen::units_of(*board.sheet, joint.axis)) {}

  void complete() {
    if (std::isnan(joint_.encoder_counts_per_rev.value)) take_counts();
    if (joint_.velocity_units_per_rev <= 0.0) take_velocity();
    if (std::isnan(joint_.motor_encoder_counts_per_rev)) {
      joint_.motor_encoder_counts_per_rev = joint_.encoder_counts_per_rev;
    }
    if (std::isnan(joint_.rated_torque_Nm.value)) take_torque();
  }

 private:
  [[nodiscard]] std::string values(std::initializer_list<std::uint16_t> objects) const {
    return canopen::values_of(*board_.sheet, joint_.axis, {objects.begin(), objects.size()}) +
           " in " + board_.eds;
  }

  void take_counts() {
    // Many sheets say 1, which the drive replaces when it is commissioned.
    const double counts = units_.counts_per_rev.value_or(0.0);
    joint_.encoder_counts_per_rev.of_sheet =
        counts >= keys::kCounts.min && counts <= keys::kCounts.max;
    if (joint_.encoder_counts_per_rev.of_sheet) {
      joint_.encoder_counts_per_rev = counts;
      return;
    }
    table_.error(
        "encoder_counts_per_rev",
        "neither this table nor the drive's sheet says what the counts of joint '" + joint_.name +
            "' are: " +
            values({object::kEncoderResolution, object::kGearRatio, object::kFeedConstant}),
        "set it to the position units per revolution of the joint, or per 2 pi m of one "
        "that slides");
  }

  void take_velocity() {
    joint_.velocity_units_per_rev.of_sheet = units_.velocity_per_rev.has_value();
    joint_.velocity_units_per_rev = units_.velocity_per_rev.value_or(0.0);
    if (units_.unknown_velocity == 0) return;
    table_.error("velocity_units_per_rev",
                 "the sheet does not say what a velocity of joint '" + joint_.name +
                     "' is: 60A9 is " + hex(units_.unknown_velocity) + " in " + board_.eds +
                     ", and no gear (6091) or no unit that is known goes with it",
                 "set it to the drive's velocity units at one revolution of the joint per second");
  }

  void take_torque() {
    joint_.rated_torque_Nm = units_.rated_torque_Nm.value_or(kUnset);
    joint_.rated_torque_Nm.of_sheet = units_.rated_torque_Nm.has_value();
    if (joint_.rated_torque_Nm.of_sheet) return;
    table_.error("rated_torque_Nm",
                 "neither this table nor the drive's sheet says what the torques of joint '" +
                     joint_.name +
                     "' are per mille of: " + values({object::kRatedTorque, object::kGearRatio}),
                 "set it to the motor's rated torque times the gear ratio");
  }

  TomlTable& table_;
  const BoardConfig& board_;
  JointConfig& joint_;
  const canopen::DriveUnits units_;
};

}  // namespace

void complete_units(TomlTable& table, const RobotConfig& robot, JointConfig& joint) {
  const BoardConfig* board = robot.board(joint.board);
  if (board == nullptr || board->eds.empty()) {
    for (const char* key : {"reversed", "zero_counts", "encoder_turn_counts",
                            "velocity_units_per_rev", "acceleration_units_per_rev"}) {
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
  FromSheet(table, *board, joint).complete();
}

}  // namespace tandem::hal
