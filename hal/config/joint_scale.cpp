#include "hal/config/joint_scale.hpp"

#include <fmt/core.h>

#include "canopen/objects.hpp"

namespace tandem::hal {
namespace {

class ScaleCheck {
 public:
  ScaleCheck(const RobotConfig& robot, const JointConfig& joint, const BoardConfig& board)
      : robot_(robot), joint_(joint), board_(board) {}

  Diagnostics run() {
    if (joint_.slides) check_slide();
    check_polarity();
    return std::move(errors_);
  }

 private:
  void error(const char* key, std::string message, std::string hint) {
    errors_.push_back({std::move(message), std::move(hint), robot_.file, joint_.line,
                       "joint." + joint_.name + "." + key});
  }

  /// A sheet's objects are of shafts. How far one revolution of them moves a slide, none tells.
  void check_slide() {
    const std::string slides = fmt::format("joint '{}' slides, and ", joint_.name);
    if (joint_.encoder_counts_per_rev.of_sheet) {
      error("encoder_counts_per_rev",
            fmt::format("{}608F, 6091 and 6092 of {} are per revolution of a shaft: they do not "
                        "say how far it moves the joint",
                        slides, board_.eds),
            "set it to the drive's position units in 2 pi m (6.2832 m) of travel");
    }
    if (joint_.velocity_units_per_rev.of_sheet) {
      error("velocity_units_per_rev",
            fmt::format("{}60A9 of {} is in revolutions of the motor", slides, board_.eds),
            "set it to the drive's velocity units at 2 pi m/s (6.2832 m/s)");
    }
    if (joint_.rated_torque_Nm.of_sheet) {
      error("rated_torque_Nm",
            fmt::format("{}6076 of {} is a torque: it does not say what force that is", slides,
                        board_.eds),
            "set it to the force, in N, at the motor's rated torque");
    }
  }

  void check_polarity() {
    using namespace canopen::object;
    const auto bits = board_.sheet->value(canopen::of_axis(kPolarity, joint_.axis), 0, 0);
    const bool position = (bits.value_or(0) & 0x80) != 0;
    const bool velocity = (bits.value_or(0) & 0x40) != 0;
    if (position == velocity) return;
    error("reversed",
          fmt::format("607E (polarity) of {} is 0x{:02X}: the drive of joint '{}' would turn {} "
                      "round, and no key can say that of one alone",
                      board_.eds, *bits, joint_.name,
                      position ? "positions and not velocities" : "velocities and not positions"),
          "set bits 6 and 7 of 607E alike in the drive, and correct its sheet");
  }

  const RobotConfig& robot_;
  const JointConfig& joint_;
  const BoardConfig& board_;
  Diagnostics errors_;
};

}  // namespace

Diagnostics check_joint_scale(const RobotConfig& robot, const JointConfig& joint) {
  const BoardConfig* board = robot.board(joint.board);
  if (board == nullptr || board->eds.empty()) return {};
  return ScaleCheck(robot, joint, *board).run();
}

}  // namespace tandem::hal
