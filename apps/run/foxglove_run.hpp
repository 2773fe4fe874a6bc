// A run's ROS 2 topics, parameters and meshes for Foxglove's protocol, from the studio's cycles.
// Layer: apps/run.  Thread: open() and start() any but the loop's; the rest the studio's.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "apps/run/connection.hpp"
#include "base/result.hpp"
#include "dds/run_topics.hpp"
#include "runtime/robot_cycle.hpp"
#include "studio/foxglove/hub.hpp"
#include "studio/mesh_files.hpp"
#include "studio/tap.hpp"

namespace tandem::apps {

/// The newest cycle of a tick is what clients see: 30 samples a second of each topic, at most.
class FoxgloveRun {
 public:
  /// @param node     this process in ROS 2's graph: "tandem_run"
  /// @param session  another one: another run
  /// @pre the composition is connected and outlives this
  /// Errors: two sensors whose names are the same in ROS 2
  [[nodiscard]] static Result<std::unique_ptr<FoxgloveRun>> open(
      const WiredComposition& composition, const std::string& node, const std::string& session);
  ~FoxgloveRun();
  FoxgloveRun(const FoxgloveRun&) = delete;
  FoxgloveRun& operator=(const FoxgloveRun&) = delete;

  /// @param cycle     stays until nobody is served any more
  /// @param parallel  the second robot; null: there is none
  /// @param lost      cycles that did not reach the studio so far
  void start(runtime::RobotCycle& cycle, hal::ParallelSource* parallel,
             std::function<std::uint64_t()> lost);
  /// studio::Feed::cycle
  void take(const studio::Tap::Cycle& cycle);
  [[nodiscard]] studio::Protocol& protocol() { return hub_; }

 private:
  class Channels;
  FoxgloveRun(const WiredComposition& composition, const std::string& node,
              studio::foxglove::Description description);
  void publish(bool again);
  /// The time of messages: as their stamps, or the wall clock's.
  [[nodiscard]] std::int64_t now_ns() const;
  [[nodiscard]] Result<std::string> asset(const std::string& uri) const;

  bool simulated_time_;
  std::string folder_;        // of the description
  studio::MeshFiles meshes_;  // that it names
  studio::foxglove::Hub hub_;
  std::unique_ptr<Channels> channels_;
  std::unique_ptr<dds::RunTopics> topics_;  // goes before where its samples go

  // The newest cycle.
  hal::CycleTime time_{};
  hal::RunPhase phase_ = hal::RunPhase::kBringUp;
  Code read_code_ = Code::kOk;
  hal::CycleTimes times_;
  hal::StateImage state_;
  hal::CommandImage command_;
  std::optional<hal::TruthImage> truth_;
  std::optional<hal::EstimateImage> estimate_;
  bool has_cycle_ = false, has_truth_ = false, has_estimate_ = false;
  std::optional<std::uint64_t> shown_;  // the cycle that was published last
  std::function<std::uint64_t()> lost_;
};

}  // namespace tandem::apps
