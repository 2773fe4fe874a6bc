// How joints moved in a log: what they were commanded, or what was measured of them, checked sample
// by sample so that another run can play it.
// Layer: log.  Thread: non-RT only.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "log/log_file.hpp"

namespace tandem::log {

enum class MotionSource : std::uint8_t {
  kCommand,  ///< the references of /tandem/command
  kState,    ///< what /tandem/state measured
};
[[nodiscard]] const char* to_string(MotionSource source) noexcept;  ///< "command", "state"

// What a replay (docs/import.md) puts before a recording, which its report has to know.
inline constexpr double kReplayApproach_s = 3.0;  ///< to its first place, unless it says other
inline constexpr double kReplayRunUp_s = 0.5;     ///< in which its joints get their first speed
inline constexpr double kReplaySlowest = 0.01, kReplayFastest = 10.0;  ///< times as recorded

/// Which motion of a log is wanted.
struct MotionRequest {
  std::vector<std::string> joints;     ///< by name
  std::optional<MotionSource> source;  ///< empty: the commands where the log has them
  std::optional<double> from_s, to_s;  ///< of the log's time; empty: while controllers ran
  bool torque = false;                 ///< the torques are wanted, too
};

/// One joint's samples. Link side; of a slide m, m/s and N.
struct JointTrack {
  std::string joint;
  std::vector<std::int64_t> time_ns;   ///< of the log, increasing
  std::vector<double> position_rad;    ///< finite
  std::vector<double> velocity_rad_s;  ///< finite; empty where the log lacks any of it
  std::vector<double> torque_Nm;       ///< finite, on the link; empty when not asked for
};

struct JointMotion {
  MotionSource source = MotionSource::kCommand;
  std::int64_t begin_ns = 0, end_ns = 0;  ///< of the log's time
  std::int64_t period_ns = 0;             ///< of the log's cycles
  std::vector<JointTrack> tracks;         ///< in the order of the request's joints
};

/// Without from_s and to_s it is all that controllers did: of an import the whole log.
///
/// Errors, each with the log's path and what to do: the log has none of it, or not the topic; it
/// lacks a joint; it is reduced, or cut, or its run met a fault, before to_s; times that do not
/// increase, or are outside of the log; a joint without a sample for more than 20 ms (and three
/// cycles); a position, or a torque that is asked for, that is not finite; commands that are no
/// references of stiff position control.
[[nodiscard]] Result<JointMotion> read_joint_motion(const LogFile& file,
                                                    const MotionRequest& request);

}  // namespace tandem::log
