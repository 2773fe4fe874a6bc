// This process as others in the domain see it: a ROS 2 node with its topics.
// Layer: dds.  Thread: any, non-RT.
#pragma once

#include <memory>
#include <string>

#include "base/result.hpp"
#include "dds/domain.hpp"
#include "dds/ros_graph.hpp"

namespace tandem::dds {

class Participant {
 public:
  /// @param node  its name in ROS 2's graph: "tandem_run"
  /// Errors: no participant of the domain can be made (too many are on this machine);
  /// RosGraph::open()'s.
  [[nodiscard]] static Result<std::unique_ptr<Participant>> open(std::shared_ptr<Domain> domain,
                                                                 std::string node);

  [[nodiscard]] dds_entity_t get() const noexcept { return entity_.get(); }
  [[nodiscard]] const Config& config() const noexcept { return domain_->config(); }
  [[nodiscard]] const std::string& node() const noexcept { return node_; }

  /// Its node's endpoints, which enter and leave by themselves.
  [[nodiscard]] RosGraph& graph() noexcept { return *graph_; }

  /// Config::topic_name()
  [[nodiscard]] std::string topic_name(const std::string& ros_name) const {
    return config().topic_name(ros_name);
  }

 private:
  Participant(std::shared_ptr<Domain> domain, std::string node, Entity entity,
              std::unique_ptr<RosGraph> graph);

  std::shared_ptr<Domain> domain_;  // outlives the participant's entity
  std::string node_;
  Entity entity_;
  std::unique_ptr<RosGraph> graph_;
};

}  // namespace tandem::dds
