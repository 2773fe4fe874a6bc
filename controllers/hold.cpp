// hold: keeps joints where they are measured at the start, or leads them to a posture.
#include "controllers/controller.hpp"
#include "controllers/min_jerk.hpp"
#include "controllers/parameters.hpp"

namespace tandem {
namespace {

/// Parameters: joints (all), posture (none), duration_s (3), interaction ("stiff"),
/// link_damping_Nms_rad (0).
class Hold : public Controller {
 public:
  Status configure(ControllerSetup& setup) override {
    const Parameter interaction =
        setup.parameter("interaction", {.choices = {"stiff", "compliant"},
                                        .otherwise = "stiff",
                                        .doc = "compliant: on robot.toml's spring and damper"});
    const Parameter duration_s =
        setup.parameter("duration_s", {.unit = "s",
                                       .min = 0,
                                       .above_min = true,
                                       .otherwise = 3,
                                       .doc = "of the way to the posture"});
    duration_s_ = duration_s;
    link_damping_Nms_rad_ = link_damping_parameter(setup);
    posture_ = posture_parameter(setup);
    for (const std::size_t joint : joints_parameter(setup)) {
      setup.claim(joint, hal::ControlMode::kPosition,
                  interaction.is("stiff") ? hal::InteractionMode::kStiff
                                          : hal::InteractionMode::kCompliant);
      moves_.push_back({joint, 0.0, 0.0});
      if (posture_ == nullptr) continue;  // start() makes the measured position the target
      const double target = moves_.back().to_rad = posture_->position_rad.at(joint);
      const hal::DrivenJoint& limit = setup.robot.joints[joint];
      if (target < limit.min_position_rad || target > limit.max_position_rad) {
        setup.parameters.error("posture", "is beyond the limits of joint '" + limit.name + "'",
                               "choose another posture, or leave the joint out of `joints`");
      }
    }
    return {};
  }

  void start(const hal::CycleTime& time, const hal::StateImage& state,
             hal::CommandImage&) noexcept TANDEM_RT override {
    start_ns_ = time.time_ns;
    for (Move& move : moves_) {
      move.from_rad = state.position_rad()[move.joint];
      if (posture_ == nullptr) move.to_rad = move.from_rad;
    }
  }

  Code update(const hal::CycleTime& time, const hal::StateImage& state,
              hal::CommandImage& command) noexcept TANDEM_RT override {
    const double since_s = static_cast<double>(time.time_ns - start_ns_) * 1e-9;
    const MinJerk profile = min_jerk(since_s / duration_s_);
    for (const Move& move : moves_) {
      const double way = move.to_rad - move.from_rad;
      command.position_rad()[move.joint] = move.from_rad + way * profile.s;
      command.velocity_rad_s()[move.joint] = way * profile.ds / duration_s_;
      // On a spring the link may swing, which the motor's own loop hardly damps.
      const double swing =
          state.velocity_rad_s()[move.joint] - command.velocity_rad_s()[move.joint];
      command.torque_Nm()[move.joint] = -link_damping_Nms_rad_ * swing;
    }
    return Code::kOk;
  }

  void archive(Archive& ar) override { ar(start_ns_, moves_); }

 private:
  struct Move {
    std::size_t joint;
    double from_rad, to_rad;
  };
  const hal::Posture* posture_ = nullptr;
  double duration_s_ = 0.0;
  Parameter link_damping_Nms_rad_;
  std::int64_t start_ns_ = 0;
  std::vector<Move> moves_;
};

}  // namespace
}  // namespace tandem

TANDEM_CONTROLLER(tandem::Hold, "hold", "Holds joints where they are, or leads them to a posture.")
