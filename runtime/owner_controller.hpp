// The owner of a robot in another process, as one of the loop's controllers: "remote".
// Layer: runtime.  Thread: configure non-RT; the rest RT.
#pragma once

#include "controllers/controller.hpp"
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
    const std::vector<hal::Joint>& joints = setup.robot.joints;
    for (std::size_t j = 0; j < joints.size(); ++j) {
      for (const hal::ControlMode mode : {kPosition, kVelocity, kTorque, kOpenLoop, kCurrent}) {
        if (!joints[j].can(mode, hal::InteractionMode::kStiff)) continue;
        setup.claim_with_modes(j, mode);  // this one until its first command
        break;
      }
    }
    return {};
  }
  /// What update() writes from now on.
  void follow(const hal::RemoteCommand& wish) noexcept TANDEM_RT {
    command_ = wish.live ? wish.command : nullptr;
    done_ = wish.done && wish.ends_run;
  }

  void start(const hal::CycleTime&, const hal::StateImage&,
             hal::CommandImage&) noexcept TANDEM_RT override {}
  [[nodiscard]] Code update(const hal::CycleTime&, const hal::StateImage&,
                            hal::CommandImage& command) noexcept TANDEM_RT override {
    if (command_ != nullptr) command.assign(*command_);
    return done_ ? Code::kStopped : Code::kOk;
  }

 private:
  const hal::CommandImage* command_ = nullptr;  // null: what was commanded last stays
  bool done_ = false;
};

/// What a cycle needs for an owner in another process. All null: there is none.
struct RemoteCommandParts {
  hal::RemoteCommandPort* port = nullptr;
  OwnerController* controller = nullptr;
  std::size_t slot = 0;  ///< the controller's in its host
};

}  // namespace tandem::runtime
