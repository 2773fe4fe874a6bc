// This process' part in a DDS domain: sockets and threads of Cyclone DDS.
// Layer: dds.  Thread: any, non-RT.
#pragma once

#include <dds/ddsrt/log.h>

#include <atomic>
#include <cstdint>
#include <memory>

#include "base/result.hpp"
#include "dds/config.hpp"
#include "dds/entity.hpp"

namespace tandem::dds {

/// What Cyclone DDS has to say goes to stderr, as long as it is not too much: one line for each
/// malformed packet would let a peer fill a disk. Of a process, the one made last.
class DdsLog {
 public:
  DdsLog();
  ~DdsLog();
  DdsLog(const DdsLog&) = delete;
  DdsLog& operator=(const DdsLog&) = delete;

 private:
  static void write(void* self, const dds_log_data_t* data);
  std::atomic<std::uint64_t> lines_ = 0;
};

/// A process has at most one of each number; participants share it.
class Domain {
 public:
  /// Errors: a configuration that Cyclone DDS refuses; a domain that this process has already.
  [[nodiscard]] static Result<std::shared_ptr<Domain>> open(const Config& config);

  [[nodiscard]] const Config& config() const noexcept { return config_; }

 private:
  Domain(Config config, std::unique_ptr<DdsLog> log, Entity entity)
      : config_(std::move(config)), log_(std::move(log)), entity_(std::move(entity)) {}

  Config config_;
  std::unique_ptr<DdsLog> log_;
  Entity entity_;
};

}  // namespace tandem::dds
