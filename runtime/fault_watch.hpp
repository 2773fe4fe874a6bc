// What is wrong with a robot in this cycle: its joints, its sensors, its body.
// Layer: runtime.  Thread: made non-RT; the rest RT.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "estimation/estimator.hpp"
#include "hal/backend.hpp"
#include "hal/config/robot_config.hpp"
#include "hal/truth.hpp"
#include "runtime/fall_watch.hpp"
#include "runtime/fault.hpp"

namespace tandem::runtime {

/// Reports each fault once: again when a reset has found it gone, or a sensor was well meanwhile.
class FaultWatch {
 public:
  /// Both outlive it.
  /// @param lost_after_cycles  feedback older than this is a lost joint or sensor
  FaultWatch(const hal::RobotConfig& robot, const hal::Backend& backend,
             std::uint32_t lost_after_cycles, const FallLimits& fall);

  // Called again until there is nothing more.

  /// A joint whose drive is in fault, or whose feedback is lost; with the joint's category.
  [[nodiscard]] std::optional<FaultRecord> next_joint(
      const hal::StateImage& state) noexcept TANDEM_RT;
  /// A joint whose drive stays enabled in spite of a stop; of those that next_joint() has not
  /// returned as such.
  [[nodiscard]] std::optional<FaultRecord> next_disobedient(
      const hal::StateImage& state) noexcept TANDEM_RT;
  /// A sensor without samples: a warning, for the joints can still be controlled.
  [[nodiscard]] std::optional<FaultRecord> next_sensor(
      const hal::StateImage& state) noexcept TANDEM_RT;

  /// The link to a robot far away is lost: a warning, for the robot brakes and holds by itself.
  [[nodiscard]] std::optional<FaultRecord> lost_link() noexcept TANDEM_RT;
  /// Whether it is back, after that.
  [[nodiscard]] bool link_is_back() noexcept TANDEM_RT;

  /// A robot with feet that has fallen. For cycles in which controllers run: what has been stopped
  /// may lie as it likes.
  [[nodiscard]] std::optional<FaultRecord> fall(const hal::TruthImage& truth) noexcept TANDEM_RT;
  /// What pushes a robot that moves: one that lies, or that somebody holds, feels more than itself.
  /// @param counts  false: it is under no control, and this is no collision of its motion
  [[nodiscard]] static std::optional<FaultRecord> collision(estimation::Estimator& estimator,
                                                            bool counts) noexcept TANDEM_RT;
  /// Controllers start: flight is counted from here.
  void controllers_start() noexcept TANDEM_RT { fall_.begin(); }

  /// Some joint's fault has been reported, and no reset has cleared it.
  [[nodiscard]] bool joint_in_fault() const noexcept TANDEM_RT { return joint_in_fault_; }
  /// A reset is done: what is still there (its category is "warn") is not reported again.
  void reset(const hal::StateImage& state) noexcept TANDEM_RT;
  /// The drive is in fault, or its feedback is lost.
  [[nodiscard]] bool is_ill(const hal::StateImage& state,
                            std::size_t joint) const noexcept TANDEM_RT;
  /// The joint alone was reset, and is well: reported again when it falls ill.
  void forget(std::size_t joint) noexcept TANDEM_RT;
  /// Whether the cause of `record` is still there. Only joints, sensors and a link can be
  /// looked at.
  [[nodiscard]] bool is_there(const FaultRecord& record) const noexcept TANDEM_RT;

  [[nodiscard]] std::size_t joints() const noexcept { return joint_told_.size(); }
  [[nodiscard]] std::size_t sensors() const noexcept { return sensor_told_.size(); }
  [[nodiscard]] const FallLimits& fall_limits() const noexcept { return fall_.limits(); }
  void archive(Archive& ar) {
    ar(joint_told_, code_told_, sensor_told_, joint_in_fault_, link_lost_, fall_);
  }

 private:
  [[nodiscard]] hal::FaultCause found(const hal::StateImage& state,
                                      std::size_t joint) const noexcept;

  const hal::RobotConfig* robot_;
  const hal::Backend* backend_;
  std::uint32_t lost_after_cycles_;
  FallWatch fall_;
  std::vector<hal::FaultCause> joint_told_;  ///< kNone: nothing
  std::vector<std::uint32_t> code_told_;     ///< of a drive's fault; another one is news
  std::vector<std::uint8_t> sensor_told_;
  bool joint_in_fault_ = false, link_lost_ = false;
};

}  // namespace tandem::runtime
