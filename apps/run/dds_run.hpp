// The DDS side of a run: the process' part in the domain, and what shows the robot there.
// Layer: apps/run.  Thread: main.
#pragma once

#include <memory>
#include <string>

#include "apps/run/connection.hpp"
#include "base/result.hpp"
#include "dds/participant.hpp"
#include "dds/publisher.hpp"
#include "dds/service_server.hpp"
#include "runtime/robot_cycle.hpp"

namespace tandem::apps {

/// What a run has published, and what it was asked.
struct DdsResult {
  int domain = 0;
  dds::PublishCounts counts;
  dds::ServiceServer::Counts services{};
};

/// A composed run as its topics show it, whoever takes their samples.
/// @pre the composition is connected and outlives what is made of it
[[nodiscard]] dds::RunDescription described(const WiredComposition& composition);
/// What a cycle tells its topics beside its images.
[[nodiscard]] dds::FaultFeed fault_feed(runtime::RobotCycle& cycle);
[[nodiscard]] dds::ControllerFeed controller_feed(runtime::RunServices& services);

class DdsRun {
 public:
  /// Enters the domain of the experiment's [dds] and makes the topics, before anything has moved;
  /// null when it is off.
  ///
  /// @param node  this process in ROS 2's graph: "tandem_run"
  /// @pre the composition is connected and outlives this
  /// Errors: Domain::open()'s, Participant::open()'s and Publisher::create()'s.
  [[nodiscard]] static Result<std::unique_ptr<DdsRun>> open(const WiredComposition& composition,
                                                            const std::string& node);

  /// For others that talk DDS in this run, such as services. Outlived by this.
  [[nodiscard]] dds::Participant& participant() { return *participant_; }
  /// CycleParts::observer
  [[nodiscard]] hal::CycleObserver& tap() { return *publisher_; }

  /// From now on cycles are published. Before the first of them; the cycle stays until finish().
  /// @param parallel  the second robot; null: there is none
  void start(runtime::RobotCycle& cycle, hal::ParallelSource* parallel);
  /// When there are no more of them.
  DdsResult finish();

 private:
  DdsRun(std::unique_ptr<dds::Participant> participant, std::unique_ptr<dds::Publisher> publisher)
      : participant_(std::move(participant)), publisher_(std::move(publisher)) {}

  std::unique_ptr<dds::Participant> participant_;
  std::unique_ptr<dds::Publisher> publisher_;  // after the participant, so that it goes first
};

}  // namespace tandem::apps
