// Whose changes a process takes over DDS, which knows no users: participants that somebody who may
// use its control socket has named.
// Layer: apps/transport.  Thread: any, non-RT.
#pragma once

#include <cstddef>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "apps/control/control_registry.hpp"
#include "dds/service.hpp"

namespace tandem::apps {

class DdsAdmission {
 public:
  static constexpr std::size_t kMost = 1000;  ///< the oldest leaves first

  /// @param everybody  in the domain is admitted: [remote] trust = "domain"
  explicit DdsAdmission(bool everybody) : everybody_(everybody) {}

  /// Whether who wrote a sample may change something; empty: its writer is gone.
  [[nodiscard]] bool admits(const std::optional<dds::ParticipantId>& writer) const;
  void admit(const dds::ParticipantId& participant);

  /// Adds the command "dds.admit". Outlives the registry.
  void add_to(ControlRegistry& registry);

 private:
  bool everybody_;
  mutable std::mutex mutex_;  // of what follows
  std::vector<dds::ParticipantId> admitted_;
};

}  // namespace tandem::apps
