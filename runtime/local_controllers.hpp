// Controllers at the robot's end of a link: plugins like any other, beside an operator's.
// Layer: runtime.  Thread: made non-RT; RobotSide's calls RT.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hal/remote/robot_side.hpp"
#include "runtime/controller_host.hpp"

namespace tandem::runtime {

class LocalControllers final : public remote::RobotSide {
 public:
  /// As ControllerHost's.
  LocalControllers(const hal::RobotConfig& robot, const tandem_kernels* kernels,
                   std::int64_t period_ns);

  /// Errors: those of ControllerHost::configure(); a joint that another one claims; an input, which
  /// nobody could feed there.
  [[nodiscard]] Status add(const std::string& name, LoadedController plugin, TomlTable parameters);
  /// What the last one declared that nobody will see: "signals", "marks"; empty: nothing.
  [[nodiscard]] std::string unseen() const;
  /// The first joint that one of these and one of the operator's `host` claim.
  [[nodiscard]] std::optional<std::size_t> shared_joint(ControllerHost& host) const;

  void start(const hal::CycleTime& time, const hal::StateImage& state,
             hal::CommandImage& command) noexcept TANDEM_RT override;
  [[nodiscard]] Code update(const hal::CycleTime& time, const hal::StateImage& state,
                            hal::CommandImage& command) noexcept TANDEM_RT override;
  void archive(Archive& ar) override;

 private:
  ControllerHost host_;  // configures them
  std::vector<std::unique_ptr<HostedController>> controllers_;
};

}  // namespace tandem::runtime
