// The owner of a robot in another process, as one of the loop's controllers: "remote".
// Layer: runtime.  Thread: configure non-RT; the rest RT.
#pragma once

#include "controllers/controller.hpp"
#include "hal/remote/robot_side.hpp"
#include "hal/remote_command.hpp"

namespace tandem::runtime {

/// Its name among the loop's controllers.
inline constexpr const char* kOwnerController = "remote";

/// Claims every joint, and writes whatever the owner wrote: its own modes and references, which
/// pass the loop's limits as any controller's do.
class OwnerController final : public Controller {
 public:
  [[nodiscard]] Status configure(ControllerSetup& setup) override {
    using enum hal::ControlMode;
    const std::vector<hal::DrivenJoint>& joints = setup.robot.joints;
    for (std::size_t j = 0; j < joints.size(); ++j) {
      for (const hal::ControlMode mode : {kPosition, kVelocity, kTorque, kOpenLoop, kCurrent}) {
        if (!joints[j].can(mode, hal::InteractionMode::kStiff)) continue;
        setup.claim_with_modes(j, mode);  // this one until its first command
        break;
      }
    }
    return {};
  }
  /// Has joints of its own, whatever the owner commands. Outlives this; null: nobody does.
  void beside(remote::RobotSide* side) { side_ = side; }
  /// What update() writes from now on.
  void follow(const hal::RemoteCommand& wish) noexcept TANDEM_RT {
    command_ = wish.live ? wish.command : nullptr;
    done_ = wish.done && wish.ends_run;
  }

  void start(const hal::CycleTime& time, const hal::StateImage& state,
             hal::CommandImage& command) noexcept TANDEM_RT override {
    if (side_ != nullptr) side_->start(time, state, command);
  }
  [[nodiscard]] Code update(const hal::CycleTime& time, const hal::StateImage& state,
                            hal::CommandImage& command) noexcept TANDEM_RT override {
    if (command_ != nullptr) command.assign(*command_);
    if (side_ != nullptr) {
      if (const Code code = side_->update(time, state, command); code != Code::kOk) return code;
    }
    return done_ ? Code::kStopped : Code::kOk;
  }

 private:
  const hal::CommandImage* command_ = nullptr;  // null: what was commanded last stays
  remote::RobotSide* side_ = nullptr;
  bool done_ = false;
};

/// What a cycle needs for an owner in another process. All null: there is none.
struct RemoteCommandParts {
  hal::RemoteCommandPort* port = nullptr;
  OwnerController* controller = nullptr;
  std::size_t slot = 0;  ///< the controller's in its host
};

}  // namespace tandem::runtime
