// Topics and actions of other ROS 2 nodes that feed inputs of a run's controllers.
// Layer: apps/run.  Thread: opened and closed by main; one of its own takes samples.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <thread>
#include <vector>

#include "apps/control/control_registry.hpp"
#include "apps/run/input_lease.hpp"
#include "apps/transport/dds_admission.hpp"
#include "base/result.hpp"
#include "dds/participant.hpp"
#include "runtime/run_services.hpp"

namespace tandem::apps {

class TrajectoryAction;

/// Why topics cannot feed the inputs that they are the source of: no DDS, or what changes the run
/// is not let in. With the place in the experiment.
[[nodiscard]] Status topics_may_feed(std::span<const std::shared_ptr<runtime::InputPort>> inputs,
                                     bool on_dds, const ControlRegistry::Gate& gate);

/// A sample is a change of the run like "input.set": it passes the same gate, and its writer has to
/// be admitted. One writer feeds an input at a time: another one's samples are refused until it has
/// been silent for the input's time-out, and for half a second at least. Of a flood the newest
/// samples that a reader keeps are looked at; the others count as superseded. Where the source
/// names an action, its goals feed the input by the same rules (trajectory_action.hpp).
class InputTopics {
 public:
  /// Subscribes to the topics of every input whose source is one; null when none is.
  /// @param participant  null: without DDS, which is an error then
  /// @param simulated_time  which clock stamps of goals are of
  /// All outlive it. Errors: what DDS refuses; an action of an input that has no goals.
  [[nodiscard]] static Result<std::unique_ptr<InputTopics>> open(dds::Participant* participant,
                                                                 runtime::RunServices& services,
                                                                 ControlRegistry::Gate gate,
                                                                 const DdsAdmission& admission,
                                                                 bool simulated_time = true);
  ~InputTopics();
  InputTopics(const InputTopics&) = delete;
  InputTopics& operator=(const InputTopics&) = delete;

  class Feed;  ///< of one input

 private:
  InputTopics() = default;
  void take();

  std::atomic<std::uint64_t> rung_{0};  // a sample came, or the end
  std::atomic<bool> ending_{false};
  std::vector<std::unique_ptr<TrajectoryAction>> actions_;
  std::vector<std::unique_ptr<Feed>> feeds_;  // after what their listeners ring
  std::thread thread_;
};

}  // namespace tandem::apps
