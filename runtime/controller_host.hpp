// Hosts the controllers of a run: their claims on joints, and their calls in the cycle.
// Layer: runtime.  Thread: add/configure non-RT; start, update, hold, stop RT.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/realtime.hpp"
#include "base/result.hpp"
#include "controllers/controller.hpp"
#include "controllers/plugin_loader.hpp"
#include "hal/capabilities.hpp"
#include "hal/image.hpp"
#include "hal/robot_config.hpp"

namespace tandem::runtime {

/// Controllers run in the order in which they were added, each on the joints that it claimed.
/// A joint that nobody claims is held where it was measured when the controllers started.
class ControllerHost {
 public:
  /// The robot must outlive the host. `kernels` may be null.
  ControllerHost(const hal::RobotConfig& robot, const tandem_kernels* kernels,
                 std::int64_t period_ns);

  /// Configures a controller and takes its claims.
  ///
  /// Errors (nothing has moved then): what the controller's configure() says; a joint index or
  /// mode that the robot lacks; a joint that another controller claimed (both are named).
  /// Errors in `parameters` go to the document's diagnostics: the caller looks there, too.
  [[nodiscard]] Status add(const std::string& name, std::shared_ptr<Controller> controller,
                           TomlTable parameters);
  /// The same for a plugin; the host keeps its library open.
  [[nodiscard]] Status add(const std::string& name, LoadedController plugin, TomlTable parameters);

  /// Writes "stay where you are" for every joint: position control at the measured position.
  /// A joint that is enabled and whose last command was in position control keeps its reference
  /// and feed-forward.
  void hold(const hal::StateImage& state, hal::CommandImage& command) const noexcept TANDEM_RT;
  /// Every joint idle: no torque.
  void release(hal::CommandImage& command) const noexcept TANDEM_RT;

  /// First cycle: holds every joint, sets the claimed modes, lets the controllers seed theirs.
  void start(const hal::CycleTime& time, const hal::StateImage& state,
             hal::CommandImage& command) noexcept TANDEM_RT;
  /// Every cycle, the first included.
  /// @return kOk; kStopped once every controller is done (one that is done keeps its last
  ///         references); else the first code that is neither, culprit() says whose.
  [[nodiscard]] Code update(const hal::CycleTime& time, const hal::StateImage& state,
                            hal::CommandImage& command) noexcept TANDEM_RT;
  void stop() noexcept TANDEM_RT;

  [[nodiscard]] std::size_t size() const noexcept { return hosted_.size(); }
  /// Index of the controller whose code update() returned last.
  [[nodiscard]] std::size_t culprit() const noexcept { return culprit_; }
  [[nodiscard]] const std::string& name(std::size_t index) const { return hosted_[index].name; }

  void archive(Archive& ar);

 private:
  struct Hosted {
    std::string name;
    std::shared_ptr<Controller> controller;  // a plugin's shares its library's life
    std::vector<ControllerSetup::Claim> claims;
  };
  [[nodiscard]] Status check_claims(const std::string& name,
                                    std::span<const ControllerSetup::Claim> claims) const;
  void set_modes(hal::CommandImage& command) const noexcept TANDEM_RT;

  const hal::RobotConfig* robot_;
  const tandem_kernels* kernels_;
  std::int64_t period_ns_;
  std::vector<hal::JointCapabilities> capabilities_;
  std::vector<Hosted> hosted_;
  std::vector<std::uint8_t> done_;  // by controller
  std::size_t culprit_ = 0;
};

}  // namespace tandem::runtime
