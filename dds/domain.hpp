// This process' part in a DDS domain: sockets and threads of Cyclone DDS.
// Layer: dds.  Thread: any, non-RT.
#pragma once

#include <memory>

#include "base/result.hpp"
#include "dds/config.hpp"
#include "dds/entity.hpp"

namespace tandem::dds {

/// A process has at most one of each number; participants share it.
class Domain {
 public:
  /// Errors: a configuration that Cyclone DDS refuses; a domain that this process has already.
  [[nodiscard]] static Result<std::shared_ptr<Domain>> open(const Config& config);

  [[nodiscard]] const Config& config() const noexcept { return config_; }

 private:
  Domain(Config config, Entity entity) : config_(std::move(config)), entity_(std::move(entity)) {}

  Config config_;
  Entity entity_;
};

}  // namespace tandem::dds
