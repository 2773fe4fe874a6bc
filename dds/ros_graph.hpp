// What ROS 2's tools list of this process: its node with the endpoints that are the node's,
// published on the topic ros_discovery_info as ROS 2's Cyclone DDS middleware does. Layer: dds.
// Thread: any, non-RT.
#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.hpp"
#include "dds/raw_endpoint.hpp"

namespace tandem::dds {

/// Whether ROS 2 takes it for a node's name: letters, digits and _, no digit first, at most 255.
[[nodiscard]] bool is_node_name(std::string_view name);

/// Sixteen bytes that name an entity among all of a domain: its GUID.
using Gid = rmw_dds_common_msg_dds__Gid_;
[[nodiscard]] Gid gid_of(dds_entity_t entity);

class RosGraph {
 public:
  /// Announces the node, which has no endpoint yet.
  /// @param name_space  "/", "/left"
  /// Errors: a name that ROS 2 has no nodes of; what Cyclone DDS refuses.
  [[nodiscard]] static Result<std::unique_ptr<RosGraph>> open(dds_entity_t participant,
                                                              std::string name_space,
                                                              std::string node);

  /// Announces one endpoint more, or less.
  void add(EndpointKind kind, const Gid& gid);
  void remove(EndpointKind kind, const Gid& gid);

 private:
  RosGraph(dds_entity_t participant, std::string name_space, std::string node, RawEndpoint writer);
  void publish();

  Gid participant_;
  std::string name_space_;
  std::string node_;
  RawEndpoint writer_;
  std::mutex mutex_;
  std::vector<Gid> writers_;
  std::vector<Gid> readers_;
};

/// An endpoint in the graph, until this goes. The graph outlives it.
class GraphEntry {
 public:
  GraphEntry(RosGraph& graph, EndpointKind kind, dds_entity_t endpoint)
      : graph_(&graph), kind_(kind), gid_(gid_of(endpoint)) {
    graph_->add(kind_, gid_);
  }
  ~GraphEntry() {
    if (graph_ != nullptr) graph_->remove(kind_, gid_);
  }
  GraphEntry(GraphEntry&& other) noexcept
      : graph_(std::exchange(other.graph_, nullptr)), kind_(other.kind_), gid_(other.gid_) {}
  GraphEntry& operator=(GraphEntry&& other) noexcept {
    std::swap(graph_, other.graph_);
    std::swap(kind_, other.kind_);
    std::swap(gid_, other.gid_);
    return *this;
  }

 private:
  RosGraph* graph_;
  EndpointKind kind_;
  Gid gid_;
};

}  // namespace tandem::dds
