// The DDS side of a run: the process' part in the domain, and what shows the robot there.
// Layer: apps.  Thread: main.
#pragma once

#include <memory>
#include <string>

#include "apps/composition.hpp"
#include "base/result.hpp"
#include "dds/participant.hpp"

namespace tandem::apps {

class DdsRun {
 public:
  /// Enters the domain of the experiment's [dds], before anything has moved; null when it is off.
  /// @param node  this process in ROS 2's graph: "tandem_run"
  /// Errors: Domain::open()'s and Participant::open()'s.
  [[nodiscard]] static Result<std::unique_ptr<DdsRun>> open(const Composition& composition,
                                                            const std::string& node);

  /// For others that talk DDS in this run, such as services. Outlived by this.
  [[nodiscard]] dds::Participant& participant() { return *participant_; }

 private:
  explicit DdsRun(std::unique_ptr<dds::Participant> participant)
      : participant_(std::move(participant)) {}

  std::unique_ptr<dds::Participant> participant_;
};

}  // namespace tandem::apps
